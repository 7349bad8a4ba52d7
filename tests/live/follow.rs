//! The page shows the text of the editor as it is typed, and changes it there.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::language::{Client, uri};
use crate::page::{assert_calm, brightness, open};
use crate::watching::browser::{Browser, Page};
use crate::watching::{PATIENCE, Place, Watch, plain, sha256};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const ROOT: &str = "document.documentElement.dataset";

/// A server of the language for the folder of a place, with the graph open; the version of each further text is one more.
struct Editor {
    client: Client,
    path: PathBuf,
    version: i64,
}

impl Editor {
    fn open(place: &Place) -> Self {
        let path = place.graph.canonicalize().unwrap();
        let mut client = Client::start(path.parent().unwrap(), &[]);
        client.open(&path, &place.text());
        Self { client, path, version: 1 }
    }

    /// Sends a text, as after a keystroke.
    fn types(&mut self, text: &str) {
        self.version += 1;
        self.client.change(&self.path, self.version, text);
    }

    fn command(&mut self, name: &str) {
        let wanted = json!({ "command": name, "arguments": [uri(&self.path)] });
        assert_eq!(self.client.result("workspace/executeCommand", &wanted), Json::Null);
    }

    /// The next message for the user.
    fn told(&mut self) -> String {
        let told = self.client.wait(|message| message["method"] == "window/showMessage");
        told["params"]["message"].as_str().unwrap().to_owned()
    }

    fn follow(&mut self) {
        self.command("shibo.follow");
        let told = self.told();
        assert!(told.contains("as you type"), "{told}");
    }

    /// Answers the next request to change the text; returns the text with the change.
    fn change(&mut self, text: &str, answer: &Json) -> String {
        let asked = self.client.wait(|message| message["method"] == "workspace/applyEdit");
        let change = &asked["params"]["edit"]["documentChanges"][0];
        let document = json!({ "uri": uri(&self.path), "version": self.version });
        assert_eq!(change["textDocument"], document, "{asked}");
        let edits = change["edits"].as_array().unwrap();
        assert_eq!(edits.len(), 1, "{asked}");
        let offset = |at: &Json| {
            let line = usize::try_from(at["line"].as_u64().unwrap()).unwrap();
            let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
            start + usize::try_from(at["character"].as_u64().unwrap()).unwrap()
        };
        let range = offset(&edits[0]["range"]["start"])..offset(&edits[0]["range"]["end"]);
        let mut text = text.to_owned();
        text.replace_range(range, edits[0]["newText"].as_str().unwrap());
        self.client.respond(&asked["id"], answer);
        text
    }

    fn close(&mut self) {
        self.client.tell("textDocument/didClose", &json!({ "textDocument": { "uri": uri(&self.path) } }));
    }
}

/// Waits until the page shows a text, and says whether it is saved.
fn wait_shown(page: &mut Page, text: &str, saved: bool) {
    let sha = sha256(text.as_bytes());
    page.wait(&format!(
        "{ROOT}.sha == '{sha}' && {ROOT}.final == 'true' && document.getElementById('unsaved').hidden == {saved}"
    ));
    page.painted();
}

#[test]
fn keystrokes_are_shown_until_the_editor_closes_the_file() {
    let place = Place::new(&plain(0.2));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    wait_shown(&mut page, &plain(0.2), true);
    let dark = brightness(&mut page);
    let mut editor = Editor::open(&place);
    editor.follow();
    editor.types(&plain(0.9));
    wait_shown(&mut page, &plain(0.9), false);
    assert!(brightness(&mut page) > 2.0 * dark, "the picture is that of the text");
    assert_eq!(place.text(), plain(0.2));
    assert_eq!(page.eval("document.getElementById('unsaved').checkVisibility()"), true);
    // A text with an error is reported, and the last picture stays.
    editor.types(&plain(0.9).replace("Remap", "Remapp"));
    page.wait("document.querySelector('#errors mark')?.textContent == 'Remapp'");
    assert!(brightness(&mut page) > 2.0 * dark);
    editor.types(&plain(0.5));
    wait_shown(&mut page, &plain(0.5), false);
    page.wait("document.getElementById('errors').hidden");
    // All these texts are one step of the history.
    let steps = "import('./app.js').then(({ page }) => page.looks.steps.map((step) => step.label).join())";
    assert_eq!(page.eval(steps), "Opened,Typed");
    // The text goes on after a save.
    place.write(&plain(0.5));
    wait_shown(&mut page, &plain(0.5), true);
    editor.types(&plain(0.7));
    wait_shown(&mut page, &plain(0.7), false);
    // An undone change is that of the file.
    editor.types(&plain(0.5));
    wait_shown(&mut page, &plain(0.5), true);
    editor.types(&plain(0.3));
    wait_shown(&mut page, &plain(0.3), false);
    editor.close();
    wait_shown(&mut page, &plain(0.5), true);
    assert_eq!(watch.state()["unsaved"], Json::Null);
    assert_eq!(place.text(), plain(0.5));
    assert_calm(&page, "");
    editor.client.stop();
}

#[test]
fn the_page_returns_to_the_file_when_the_editor_is_gone() {
    let place = Place::new(&plain(0.2));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.2).as_bytes());
    let mut editor = Editor::open(&place);
    editor.follow();
    editor.types(&plain(0.9));
    watch.wait_shown(plain(0.9).as_bytes());
    editor.command("shibo.unfollow");
    assert!(editor.told().contains("saved file"));
    watch.wait_shown(plain(0.2).as_bytes());
    editor.follow();
    watch.wait_shown(plain(0.9).as_bytes());
    assert_eq!(watch.state()["unsaved"], true);
    // A second editor takes over, and the first one is told.
    let mut other = Editor::open(&place);
    other.follow();
    assert!(editor.told().contains("another editor"));
    watch.wait_shown(plain(0.2).as_bytes());
    other.types(&plain(0.4));
    watch.wait_shown(plain(0.4).as_bytes());
    // The process of the editor is killed.
    drop(other);
    watch.wait_shown(plain(0.2).as_bytes());
    assert_eq!(watch.state()["unsaved"], Json::Null);
    // `shibo watch` ends.
    editor.follow();
    drop(watch);
    assert!(editor.told().contains("has ended"));
    editor.command("shibo.follow");
    let told = editor.told();
    assert!(told.contains("`shibo watch ") && told.contains("graph.ron`"), "{told}");
    editor.client.stop();
}

#[test]
fn the_page_saves_through_the_editor() {
    let place = Place::new(&plain(0.2));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let mut editor = Editor::open(&place);
    editor.follow();
    let typed = plain(0.8);
    editor.types(&typed);
    wait_shown(&mut page, &typed, false);
    let slide = "(() => { const b = document.getElementById('param-low'); b.value = 0.5; b.onchange(); })()";
    page.eval(slide);
    page.wait("!document.getElementById('save').disabled");
    let notice = "document.getElementById('notice').textContent";
    // The editor refuses.
    page.press("s", 2);
    editor.change(&typed, &json!({ "applied": false, "failureReason": "it is read-only" }));
    page.wait(&format!("{notice} == 'nothing was written: it is read-only'"));
    page.wait("!document.getElementById('save').disabled");
    // The editor makes the change.
    page.press("s", 2);
    let saved = editor.change(&typed, &json!({ "applied": true }));
    assert_eq!(saved, typed.replace("default: 0.0", "default: 0.5"));
    page.wait(&format!("{notice} == 'Put into the editor: low 0.5' && document.getElementById('save').disabled"));
    editor.types(&saved);
    wait_shown(&mut page, &saved, false);
    assert_eq!(place.text(), plain(0.2), "`shibo watch` writes nothing");
    // The editor undoes it.
    editor.types(&typed);
    wait_shown(&mut page, &typed, false);
    page.wait("document.getElementById('param-low').value == '0'");
    // A text that has changed meanwhile is left alone.
    let wish = json!({ "base": sha256(saved.as_bytes()), "change": { "values": { "set": [["low", "0.1"]], "preset": null } }, "then": null });
    let (status, why) = watch.post("change", &wish.to_string());
    assert!(status == 409 && String::from_utf8_lossy(&why).contains("has changed meanwhile"), "{status}");
    assert_eq!(place.text(), plain(0.2));
    assert_calm(&page, "409");
    editor.client.stop();
}

#[test]
fn unsaved_imports_are_shown_too() {
    let part = |value: f64| format!("(nodes: {{ \"grey\": \"= {value}\" }}, outputs: {{ \"grey\": \"grey\" }})");
    let text = "(canvas: (size_mm: 8, resolution: 64), imports: { \"part\": \"part.ron\" }, \
                nodes: { \"use\": Use(graph: \"part\") }, outputs: { \"grey\": \"use.grey\" })";
    let place = Place::new(text);
    let (path, other) = (place.graph.with_file_name("part.ron"), place.graph.with_file_name("other.ron"));
    std::fs::write(&path, part(0.2)).unwrap();
    std::fs::write(&other, part(0.2)).unwrap();
    let watch = Watch::start(&place.graph, &[]);
    let shown = |kind: &str| {
        watch.wait_for(|event| event["event"] == kind);
        watch.wait_for(|event| event["event"] == "shown" && event["final"] == true).json["picture"].clone()
    };
    let dark = shown("saved");
    let mut editor = Editor::open(&place);
    for file in [&path, &other] {
        editor.client.open(&file.canonicalize().unwrap(), &part(0.2));
    }
    editor.follow();
    editor.client.change(&path.canonicalize().unwrap(), 2, &part(0.7));
    let bright = shown("typed");
    assert_ne!(bright, dark);
    assert_eq!(watch.state()["unsaved"], true);
    // The text of a file that the graph does not read changes nothing.
    editor.client.change(&other.canonicalize().unwrap(), 2, &part(0.7));
    assert!(watch.during(Duration::from_millis(600)).is_empty());
    std::fs::write(&path, part(0.7)).unwrap();
    assert_eq!(shown("saved"), bright);
    assert_eq!(watch.state()["unsaved"], false);
    editor.client.stop();
}

#[test]
fn foreign_texts_are_refused() {
    let place = Place::new(&plain(0.2));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.2).as_bytes());
    let said = |path: &str, body: &Json| {
        let (status, text) = watch.post(path, &body.to_string());
        (status, String::from_utf8_lossy(&text).into_owned())
    };
    let path = place.graph.canonicalize().unwrap();
    let (status, why) = said("follow", &json!({ "graph": "/etc/passwd" }));
    assert!(status == 409 && why.contains("the page shows"), "{why}");
    assert_eq!(said("follow", &json!({ "graph": path, "more": 1 })).0, 400);
    assert_eq!(said("follow/text", &json!({ "id": "x", "file": path, "text": "(" })).0, 409);
    assert_eq!(said("follow/text", &json!({ "file": path })).0, 400);
    assert_eq!(said("follow/answer", &json!({ "id": "x", "number": 1, "why": null })).0, 204);
    assert_eq!(said("follow/text", &json!({ "id": "x", "file": path, "text": "x".repeat(1 << 20) })).0, 413);
    let (port, token) = watch.address();
    let no_origin = format!(
        "POST /{token}/follow HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
    );
    assert!(watch.raw(no_origin.as_bytes()).starts_with(b"HTTP/1.1 403"));
    // A text that is too long for the page is not sent.
    let mut editor = Editor::open(&place);
    editor.follow();
    editor.types(&format!("{}// {}", plain(0.9), "x".repeat(128 << 10)));
    let told = editor.told();
    assert!(told.contains("128 KiB") && told.contains("saved file"), "{told}");
    editor.types(&plain(0.9));
    watch.wait_shown(plain(0.9).as_bytes());
    editor.client.stop();
}

#[test]
fn the_action_follows_and_stops() {
    let place = Place::new(&plain(0.2));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.2).as_bytes());
    let mut editor = Editor::open(&place);
    let offered = |editor: &mut Editor, context: &Json| {
        let at = json!({ "line": 0, "character": 0 });
        let params = json!({ "textDocument": { "uri": uri(&editor.path) }, "range": { "start": at, "end": at }, "context": context });
        let actions = editor.client.result("textDocument/codeAction", &params);
        let commands = actions.as_array().unwrap().iter().filter_map(|action| action["command"]["command"].as_str());
        commands.map(str::to_owned).collect::<Vec<_>>()
    };
    let asked = json!({ "diagnostics": [] });
    assert_eq!(offered(&mut editor, &asked), ["shibo.follow"]);
    // It is not offered by itself, and is no tidying.
    for context in [json!({ "diagnostics": [], "triggerKind": 2 }), json!({ "diagnostics": [], "only": ["source"] })] {
        assert_eq!(offered(&mut editor, &context), Vec::<String>::new());
    }
    editor.follow();
    assert_eq!(offered(&mut editor, &asked), ["shibo.unfollow"]);
    // A node that is not saved is shown, since its text is followed.
    editor.types(&plain(0.2).replace("\"grey\": Remap", "\"new\": Perlin(size: 2),\n    \"grey\": Remap"));
    let show = json!({ "command": "shibo.show", "arguments": [uri(&editor.path), "new"] });
    editor.client.result("workspace/executeCommand", &show);
    let end = Instant::now() + Duration::from_millis(300);
    assert!(editor.client.heard("window/showMessage", end - Instant::now()).is_none());
    editor.client.stop();
}

#[test]
fn keystrokes_are_shown_soon() {
    let place = Place::shipped("starter.ron");
    let text = place.text();
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(text.as_bytes());
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let mut editor = Editor::open(&place);
    editor.follow();
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    for (what, from, to) in [
        ("roughness", "0.56 - ", "0.KEY - "),
        ("waves", "size: 8, ", "size: 8.KEY, "),
        ("springs", "* 7\", ", "* 7.KEY\", "),
    ] {
        assert!(text.contains(from), "{from}");
        let mut logged = Vec::new();
        let mut drawn = Vec::new();
        for key in 10..22 {
            let typed = text.replacen(from, &to.replace("KEY", &key.to_string()), 1);
            let sha = sha256(typed.as_bytes());
            let begun = Instant::now();
            editor.types(&typed);
            let shown = watch.wait_for(|event| event["event"] == "shown" && event["sha256"] == *sha);
            logged.push(shown.at - begun);
            page.wait(&format!("{ROOT}.sha == '{sha}'"));
            drawn.push(begun.elapsed());
            watch.wait_for(|event| event["event"] == "shown" && event["sha256"] == *sha && event["final"] == true);
        }
        let median = |list: &mut Vec<Duration>| {
            list.sort();
            list[list.len() / 2]
        };
        let (logged, drawn) = (median(&mut logged), median(&mut drawn));
        println!("{what}: the server has the coarse picture after {logged:?}, the page after {drawn:?}; load {load}");
        // Much longer than on an idle machine.
        assert!(drawn < Duration::from_secs(5), "{what}: {drawn:?}");
    }
    editor.client.stop();
}

#[test]
fn neovim_types_and_undoes_a_change_of_the_page() {
    let place = Place::new(&plain(0.2));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.2).as_bytes());
    let root = place.dir.path().canonicalize().unwrap();
    let repository = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut nvim = Command::new("nvim")
        .args(["--headless", "-u", "NONE", "-i", "NONE", "-S"])
        .arg(repository.join("tests/neovim/follow.lua"))
        .env("FOLDER", &root)
        .env("SHIBO", assert_cmd::cargo::cargo_bin!("shibo"))
        .env("PLUGIN", repository.join("editors/nvim"))
        .env("XDG_CACHE_HOME", root.join(".cache"))
        .env("XDG_RUNTIME_DIR", root.join(".cache"))
        .stderr(Stdio::piped())
        .spawn()
        .expect("neovim is installed (apt-get install neovim)");
    let typed = plain(0.2).replace("size: 4", "size: 3");
    watch.wait_shown(typed.as_bytes());
    let change = json!({ "values": { "set": [["low", "0.5"]], "preset": null } });
    let wish = json!({ "base": sha256(typed.as_bytes()), "change": change, "then": null });
    let (status, said) = watch.post("change", &wish.to_string());
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&said));
    // The editor sees the change, and undoes it.
    watch.wait_shown(typed.replace("default: 0.0", "default: 0.5").as_bytes());
    std::fs::write(root.join("undo"), "").unwrap();
    watch.wait_shown(typed.as_bytes());
    assert_eq!((watch.state()["unsaved"].clone(), place.text()), (json!(true), plain(0.2)));
    // Without a save, the page is back at the file.
    std::fs::write(root.join("quit"), "").unwrap();
    watch.wait_shown(plain(0.2).as_bytes());
    let end = Instant::now() + PATIENCE;
    while nvim.try_wait().unwrap().is_none() && Instant::now() < end {
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = nvim.kill();
    let run = nvim.wait_with_output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}
