//! Photographs as operations of a host: `photo`, `beside` and `fit`. `docs/protocol.md` has their messages.
use super::held::{Held, MOST_BYTES, Wish, picture, too_large, why};
use super::progress;
use crate::graph::{Bench, Fitting, Refused};
use serde::Deserialize;
use serde_json::{Value as Json, json};
use shibo_bridge::host::{Begun, Given, Host, Message, OnGraph, Operations, Refusal, Step, Steps, base64};
use shibo_bridge::scene::lock;
use shibo_engine::eval::{CancelToken, Observer};
use shibo_engine::session::Failure;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};

/// The photograph of a page, with its operations.
#[derive(Default)]
pub struct Photographs {
    held: Mutex<Option<Arc<Held>>>,
    /// The content of a file whose last part has not come yet.
    parts: Mutex<Vec<u8>>,
}

/// The fields of `photo`.
#[derive(Deserialize)]
struct File {
    #[serde(default)]
    name: String,
    /// A part of the file in base64; without one, the photograph is put away.
    #[serde(default)]
    content: Option<String>,
    /// True if more parts follow.
    #[serde(default)]
    more: bool,
}

/// The fields of `beside`.
#[derive(Deserialize)]
struct Beside {
    target: String,
    /// Width of the photograph in mm.
    #[serde(default)]
    mm: Option<f64>,
    #[serde(flatten)]
    of: OnGraph,
}

/// The fields of `fit`.
#[derive(Deserialize)]
struct Fit {
    /// Width of the photograph in mm; found too if absent.
    #[serde(default)]
    mm: Option<f64>,
    #[serde(flatten)]
    of: OnGraph,
}

impl Operations for Photographs {
    fn names(&self) -> &'static [&'static str] {
        &["photo", "beside", "fit"]
    }

    fn begin(&self, op: &str, request: Json, host: &Host) -> Result<Begun, Refusal> {
        match op {
            "photo" => self.take(read(request)?).map(Begun::Answer),
            "beside" => {
                let Beside { target, mm, of } = read(request)?;
                let (held, given) = (self.held()?, host.given(&of)?);
                Ok(Begun::Work(Box::new(Comparing { held, given, target, mm })))
            }
            _ => {
                let Fit { mm, of } = read(request)?;
                let (held, given) = (self.held()?, host.given(&of)?);
                Ok(Begun::Work(Box::new(Fits::Asked(Some(Box::new((held, given, mm)))))))
            }
        }
    }
}

fn read<T: for<'d> Deserialize<'d>>(request: Json) -> Result<T, Refusal> {
    serde_json::from_value(request).map_err(|error| Refusal::new("bad-request", error.to_string()))
}

impl Photographs {
    fn held(&self) -> Result<Arc<Held>, Refusal> {
        lock(&self.held).clone().ok_or_else(|| Refusal::new("usage", "there is no photograph; `photo` takes one"))
    }

    /// Takes a part of a photograph. The one before goes with the first part, so that its memory is free.
    fn take(&self, File { name, content, more }: File) -> Result<Json, Refusal> {
        *lock(&self.held) = None;
        let mut parts = lock(&self.parts);
        let Some(content) = content else {
            *parts = Vec::new();
            return Ok(json!({}));
        };
        // Four letters of base64 are three bytes.
        if parts.len() + content.len() / 4 * 3 > MOST_BYTES + 2 {
            *parts = Vec::new();
            return Err(Refusal::new("file", too_large()));
        }
        let Some(content) = base64::decode(&content) else {
            *parts = Vec::new();
            return Err(Refusal::new("bad-request", "the content is not base64"));
        };
        parts.extend(content);
        if more {
            return Ok(json!({}));
        }
        let bytes = std::mem::take(&mut *parts);
        drop(parts);
        if bytes.len() > MOST_BYTES {
            return Err(Refusal::new("file", too_large()));
        }
        let held = Held::read(&bytes, &name).map_err(|message| Refusal::new("file", message))?;
        let answer = json!({ "name": held.name(), "size": held.size() });
        *lock(&self.held) = Some(Arc::new(held));
        Ok(answer)
    }
}

/// An unfinished comparison.
struct Comparing {
    held: Arc<Held>,
    given: Given,
    target: String,
    mm: Option<f64>,
}

impl Steps for Comparing {
    fn step(&mut self, cancel: &CancelToken, observer: &dyn Observer) -> Result<Step, Refusal> {
        let Self { held, given, target, mm } = self;
        let scene = &given.scene;
        let missing = || Refusal::new("no-output", format!("there is no `{target}`"));
        let target = scene.target(target).ok_or_else(missing)?;
        let look =
            given.session().look(&scene.graph, &scene.keys, cancel, observer, |look| picture(look, scene, &target));
        let Some(picture) = look.map_err(|failure| given.refusal(failure))? else { return Ok(Step::Done(json!({}))) };
        let found = held.compared(&picture, scene, *mm).map_err(|message| Refusal::new("usage", message))?;
        Ok(Step::Done(json!(found)))
    }
}

/// The parts of a fit.
type Parts = (Arc<Held>, Given, Option<f64>);
type Work = Pin<Box<dyn Future<Output = Result<Json, Refused>> + Send>>;

/// A fit.
enum Fits {
    /// It has not begun.
    Asked(Option<Box<Parts>>),
    /// It is at work, and leaves its news here.
    Running(Work, Arc<Mutex<Option<Message>>>),
}

impl Steps for Fits {
    fn step(&mut self, cancel: &CancelToken, _: &dyn Observer) -> Result<Step, Refusal> {
        if let Self::Asked(asked) = self
            && let Some(asked) = asked.take()
        {
            let (held, given, mm) = *asked;
            let news = Arc::new(Mutex::new(None));
            let work = fitted(held, given, mm, cancel.clone(), news.clone());
            *self = Self::Running(Box::pin(work), news);
        }
        let Self::Running(work, news) = self else { return Err(Refusal::cancelled()) };
        match work.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(Ok(answer)) => Ok(Step::Done(answer)),
            Poll::Ready(Err(Refused::Cancelled | Refused::Graph(Failure::Cancelled, _))) => Err(Refusal::cancelled()),
            Poll::Ready(Err(refused)) => Err(Refusal::new("usage", why(&refused))),
            Poll::Pending => Ok(Step::Event(lock(news).take().unwrap_or_else(|| Message::event("fit")))),
        }
    }
}

/// Runs a fit, with a turn after each picture: the name, the comment and the values of the preset, and the report.
async fn fitted(
    held: Arc<Held>,
    given: Given,
    mm: Option<f64>,
    cancel: CancelToken,
    news: Arc<Mutex<Option<Message>>>,
) -> Result<Json, Refused> {
    let (preset, set) = (given.preset.clone(), given.set.clone());
    let (request, photo) = held.asked(Wish { preset, set, mm })?;
    let bench = Bench { tools: &given.tools, session: given.session(), cancel: &cancel };
    let fitting = Fitting::of(bench, &given.file, &given.scene.graph, &photo, &request)?;
    let watch = |done: usize, status: &crate::Status| {
        let mut event = Message::event("fit");
        event.json.extend(progress(&fitting, done, status));
        *lock(&news) = Some(event);
    };
    let fitted = fitting.run_in_turns(&watch).await?;
    let preset = fitted.preset();
    Ok(json!({ "name": preset.name, "comment": preset.comment, "set": preset.values, "report": fitted.json() }))
}
