//! The pages of `shibo watch`: finds, starts and stops them, and renders outputs.
use super::event::{Event, Jump};
use super::http;
use crate::environment;
use lsp_types::MessageType;
use serde_json::{Value as Json, json};
use shibo_ide::identity;
use std::collections::HashSet;
use std::ffi::OsString;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Time that a page gets to end.
const PATIENCE: Duration = Duration::from_secs(1);

#[derive(Default)]
struct Inner {
    /// Pages with a listening thread.
    heard: HashSet<String>,
    /// Pages started by this server.
    children: Vec<Child>,
}

/// The pages of `shibo watch`.
#[derive(Clone)]
pub(super) struct Pages {
    events: Sender<Event>,
    cache_dir: Option<PathBuf>,
    inner: Arc<Mutex<Inner>>,
}

impl Pages {
    /// Starts without pages.
    pub(super) fn new(events: Sender<Event>, cache_dir: Option<PathBuf>) -> Self {
        Self { events, cache_dir, inner: Arc::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stops the pages that this server started.
    pub(super) fn stop(&self) {
        let mut children = std::mem::take(&mut self.lock().children);
        children.iter_mut().for_each(|child| drop(child.stdin.take()));
        let end = Instant::now() + PATIENCE;
        for mut child in children {
            while matches!(child.try_wait(), Ok(None)) && Instant::now() < end {
                thread::sleep(Duration::from_millis(5));
            }
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    fn say(&self, kind: MessageType, text: impl Into<String>) {
        let _ = self.events.send(Event::Jump(Jump::Say(kind, text.into())));
    }

    /// Shows a target on the page of a graph; finds or starts the page, and opens it in a browser if none shows it.
    pub(super) fn show(&self, path: &Path, target: &str) {
        let Some(url) = self.find(path).or_else(|| self.start(path)) else {
            self.say(MessageType::ERROR, format!("the page of `{}` cannot be started", path.display()));
            return;
        };
        self.hear(&url);
        let answer = http::post(&url, "show", &json!({ "target": target }));
        let pages = answer.ok().and_then(|answer| answer["pages"].as_u64()).unwrap_or_default();
        if pages == 0 {
            let anchor = target.replace('@', "%40");
            let _ = self.events.send(Event::Jump(Jump::Open(format!("{url}#{anchor}"))));
        }
    }

    /// Address of a page that already watches a graph.
    pub(super) fn find(&self, path: &Path) -> Option<String> {
        let note = std::fs::read_to_string(environment::page_note(&identity(path))).ok()?;
        let note: Json = serde_json::from_str(&note).ok()?;
        let url = note["url"].as_str()?.to_owned();
        http::post(&url, "show", &json!({ "target": null })).ok().map(|_| url)
    }

    /// Starts watching a graph; returns the address of the page.
    fn start(&self, path: &Path) -> Option<String> {
        let mut command = Command::new(std::env::current_exe().ok()?);
        command.arg("watch").arg(path).args(["--no-open", "--log", "json", "--while-stdin"]);
        if let Some(dir) = &self.cache_dir {
            command.arg("--cache-dir").arg(dir);
        }
        command.args(import_paths());
        // The pipe to the child's stdin closes when this process ends in any way, and then the child ends too.
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok()?;
        let mut lines = BufReader::new(child.stdout.take()?).lines();
        let heard = lines.by_ref().map_while(Result::ok).find_map(|line| {
            let event: Json = serde_json::from_str(&line).ok()?;
            event["url"].as_str().map(str::to_owned)
        });
        // Later output is read and dropped, so that the child never blocks on the pipe.
        thread::spawn(move || lines.for_each(drop));
        self.lock().children.push(child);
        heard
    }

    /// Listens for clicks on a page.
    pub(super) fn hear(&self, url: &str) {
        if !self.lock().heard.insert(url.to_owned()) {
            return;
        }
        let (pages, url) = (self.clone(), url.to_owned());
        thread::spawn(move || {
            if let Ok(news) = http::open(&url, "GET", "events?editor=yes", "") {
                http::listen(news, |kind, data| {
                    let number = |key: &str| data[key].as_u64().and_then(|n| u32::try_from(n).ok());
                    let place = data["file"].as_str().zip(number("line")).zip(number("column"));
                    match place.filter(|_| kind == "jump") {
                        Some(((file, line), column)) => {
                            pages.events.send(Event::Jump(Jump::To(PathBuf::from(file), line, column))).is_ok()
                        }
                        None => true,
                    }
                });
            }
            pages.lock().heard.remove(&url);
        });
    }

    /// Renders an output of a graph into the folder `out` beside the graph.
    pub(super) fn render(&self, path: &Path, output: &str) {
        let out = path.parent().unwrap_or(Path::new("")).join("out");
        let made = std::env::current_exe().and_then(|program| {
            let mut command = Command::new(program);
            command.arg("render").arg(path).arg("--output").arg(output).arg("-o").arg(&out);
            if let Some(dir) = &self.cache_dir {
                command.arg("--cache-dir").arg(dir);
            }
            command.args(import_paths()).stdin(Stdio::null()).output()
        });
        match made {
            Ok(made) if made.status.success() => {
                self.say(MessageType::INFO, format!("rendered `{output}` to {}", out.display()));
            }
            Ok(made) => {
                let text = String::from_utf8_lossy(&made.stderr).trim().to_owned();
                self.say(MessageType::ERROR, format!("`{output}` could not be rendered: {text}"));
            }
            Err(error) => self.say(MessageType::ERROR, format!("`{output}` could not be rendered: {error}")),
        }
    }
}

/// Arguments that pass the import folders to a child.
fn import_paths() -> impl Iterator<Item = OsString> {
    environment::import_paths().iter().flat_map(|folder| ["--import-path".into(), folder.clone().into_os_string()])
}
