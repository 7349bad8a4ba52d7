//! The nodes of the pack in the real command: check, render, manual, language server and watch.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use serde_json::{Value as Json, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Output, Stdio};

const GRAPH: &str = include_str!("../graphs/landscape.ron");

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("landscape.ron"), GRAPH).unwrap();
    folder
}

/// The program of the pack, with a cache in `folder`.
fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("shibo-pack"));
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.join(".cache")).args(args);
    command
}

/// Runs the program and returns stdout. It must end with exit code `code`.
#[track_caller]
fn run(folder: &Path, args: &[&str], code: i32) -> String {
    let Output { status, stdout, stderr } = command(folder, args).output().unwrap();
    let (stdout, stderr) = (String::from_utf8(stdout).unwrap(), String::from_utf8(stderr).unwrap());
    assert_eq!(status.code(), Some(code), "{stdout}{stderr}");
    stdout + &stderr
}

#[test]
fn renders_a_graph_with_nodes_of_the_pack() {
    let folder = folder();
    run(folder.path(), &["check", "landscape.ron"], 0);
    run(folder.path(), &["render", "landscape.ron", "-o", "out", "--resolution", "64"], 0);
    let written = std::fs::read(folder.path().join("out/height.png")).unwrap();
    // A second run takes all nodes from the cache and writes the same bytes.
    let stats =
        run(folder.path(), &["render", "landscape.ron", "-o", "again", "--resolution", "64", "--stats", "json"], 0);
    assert_eq!(std::fs::read(folder.path().join("again/height.png")).unwrap(), written, "{stats}");
}

#[test]
fn reports_a_wrong_parameter_with_place_and_range() {
    let folder = folder();
    let wrong = GRAPH.replace("steps: 9", "steps: 0").replace("width: 9", "widht: 9");
    std::fs::write(folder.path().join("landscape.ron"), wrong).unwrap();
    let told = run(folder.path(), &["check", "landscape.ron"], 1);
    for part in ["landscape.ron:6", "steps is `0`", "landscape.ron:7", "`widht`", "`width`"] {
        assert!(told.contains(part), "{part}: {told}");
    }
}

#[test]
fn documents_the_nodes_in_the_manual() {
    let folder = folder();
    let list = run(folder.path(), &["nodes"], 0);
    assert!(list.contains("Example pack") && list.contains("Zones") && list.contains("Perlin"), "{list}");
    let page = run(folder.path(), &["nodes", "Terraces"], 0);
    assert!(page.contains("Cuts a height into level steps") && page.contains("softness"), "{page}");
}

/// Reads one message of the language server.
fn read(from: &mut BufReader<ChildStdout>) -> Json {
    let mut length = 0;
    loop {
        let mut line = String::new();
        assert!(from.read_line(&mut line).unwrap() > 0, "the server ended");
        if let Some(number) = line.strip_prefix("Content-Length: ") {
            length = number.trim().parse().unwrap();
        }
        if line.trim().is_empty() {
            break;
        }
    }
    let mut body = vec![0; length];
    from.read_exact(&mut body).unwrap();
    serde_json::from_slice(&body).unwrap()
}

fn ended(mut child: Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn offers_and_explains_the_nodes_in_an_editor() {
    let folder = folder();
    let root = folder.path().canonicalize().unwrap();
    let mut child =
        command(&root, &["lsp"]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let (mut stdin, mut stdout) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
    let mut send = |message: Json| {
        let text = message.to_string();
        write!(stdin, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        stdin.flush().unwrap();
    };
    let uri = format!("file://{}", root.join("landscape.ron").display());
    let line = GRAPH.lines().position(|line| line.contains("Terraces(")).unwrap();
    let column = GRAPH.lines().nth(line).unwrap().find("Terraces").unwrap() + 2;
    let place = json!({ "textDocument": { "uri": uri }, "position": { "line": line, "character": column } });
    let rpc = |id: i64, method: &str, params: &Json| json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params });
    send(rpc(1, "initialize", &json!({ "processId": null, "rootUri": null, "capabilities": {} })));
    send(json!({ "jsonrpc": "2.0", "method": "initialized", "params": {} }));
    let document = json!({ "uri": uri, "languageId": "ron", "version": 1, "text": GRAPH });
    send(json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": { "textDocument": document } }));
    send(rpc(2, "textDocument/hover", &place));
    send(rpc(3, "textDocument/completion", &place));
    let mut answer = |id: i64| {
        loop {
            let message = read(&mut stdout);
            if message["id"] == id && message.get("method").is_none() {
                break message["result"].to_string();
            }
        }
    };
    let hover = answer(2);
    assert!(hover.contains("Cuts a height into level steps"), "{hover}");
    let offers = answer(3);
    assert!(offers.contains("Cuts a height into level steps"), "{offers}");
    ended(child);
}

#[test]
fn shows_the_graph_again_after_a_save() {
    let folder = folder();
    let args = ["watch", "landscape.ron", "--no-open", "--log", "json"];
    let mut child = command(folder.path(), &args).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut events = BufReader::new(child.stdout.take().unwrap()).lines().map(|line| {
        let line = line.unwrap();
        serde_json::from_str::<Json>(&line).unwrap_or_else(|e| panic!("{e}: {line}"))
    });
    let mut shown = |after: &Json| {
        events.find(|event| event["event"] == "shown" && event["final"] == true && event["sha256"] != *after).unwrap()
    };
    let first = shown(&Json::Null)["sha256"].clone();
    std::fs::write(folder.path().join("landscape.ron"), GRAPH.replace("width: 9", "width: 12")).unwrap();
    // The pictures of the saved text follow; the test waits for them as long as the program runs.
    shown(&first);
    ended(child);
}
