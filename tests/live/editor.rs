//! The editor and the page of `shibo watch` show the node that is selected in the other.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::language::{Client, uri};
use crate::watching::browser::Browser;
use crate::watching::{PATIENCE, Place, Watch, plain};
use serde_json::{Value as Json, json};
use std::time::{Duration, Instant};

/// Repeats a call until it gives a value.
fn until<T>(mut ask: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = ask() {
            return found;
        }
        assert!(Instant::now() < end, "it takes too long");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn click_starts_the_editor() {
    let place = Place::new(&plain(0.5));
    let shown = place.dir.path().join("shown");
    let command = format!("touch '{}-{{line}}-{{column}}'", shown.display());
    let watch = Watch::start(&place.graph, &["--editor", &command]);
    watch.wait_shown(plain(0.5).as_bytes());
    assert_eq!(watch.post("jump", "{ \"node\": \"grey\" }").0, 202);
    until(|| place.dir.path().join("shown-7-13").exists().then_some(()));
    assert_eq!(watch.post("jump", "{ \"node\": \"nothing\" }").0, 404);
    assert_eq!(watch.post("jump", "{ \"file\": \"/etc/passwd\" }").0, 400);
}

#[test]
fn page_and_editor_follow_each_other() {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.5).as_bytes());
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait("document.documentElement.dataset.shown?.startsWith('grey')");
    // The language server finds the page of the graph by a note file.
    let mut client = Client::start(&place.dir.path().canonicalize().unwrap(), &[]);
    let path = place.graph.canonicalize().unwrap();
    client.open(&path, &plain(0.5));
    let show = |client: &mut Client, what: Json| {
        client.result("workspace/executeCommand", &json!({ "command": "shibo.show", "arguments": [uri(&path), what] }))
    };
    show(&mut client, json!("noise"));
    page.wait("document.documentElement.dataset.target === '@noise'");
    show(&mut client, json!({ "line": 6, "character": 30 }));
    page.wait("document.documentElement.dataset.target === '@grey'");
    // A click on the page jumps to the line in the editor.
    let jumped = until(|| {
        watch.post("jump", "{ \"node\": \"noise\" }");
        client.heard("window/showDocument", Duration::from_millis(200))
    });
    assert_eq!(jumped["params"]["uri"], uri(&path));
    assert_eq!(jumped["params"]["selection"]["start"], json!({ "line": 5, "character": 13 }));
    client.stop();
}
