//! The language server through its protocol: the real process and a client.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::language::{Client, cursor, uri};
use serde_json::{Value as Json, json};
use std::fs;
use std::path::{Path, PathBuf};

const GRAPH: &str = "(
  version: 1,
  canvas: (size_mm: 20, resolution: 64),
  params: { \"size\": Number(default: 4, range: (1, 8), unit: \"mm\", doc: \"Size of a cell\") },
  nodes: {
    \"noise\": Perlin(size: \"$size\"),
    \"soft\": Blur(input: \"noise\", radius: 0.5),
  },
  outputs: { \"soft\": \"soft\" },
)
";

/// A folder with a graph, and a server for it.
fn with(text: &str) -> (tempfile::TempDir, PathBuf, Client) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().canonicalize().unwrap().join("a.ron");
    fs::write(&path, text).unwrap();
    let mut client = Client::start(path.parent().unwrap(), &[]);
    client.open(&path, text);
    (folder, path, client)
}

fn labels(answer: &Json) -> Vec<String> {
    let list = answer["items"].as_array().unwrap();
    list.iter().map(|item| item["label"].as_str().unwrap().to_owned()).collect()
}

/// A text after the edits of one file.
fn applied(text: &str, edits: &Json) -> String {
    let offset = |position: &Json| {
        let (line, character) = (position["line"].as_u64().unwrap(), position["character"].as_u64().unwrap());
        let start: usize = text.split_inclusive('\n').take(usize::try_from(line).unwrap()).map(str::len).sum();
        let mut left = character;
        let rest = &text[start..];
        let end = rest.char_indices().find(|(_, c)| {
            let done = left == 0;
            left = left.saturating_sub(c.len_utf16() as u64);
            done
        });
        start + end.map_or(rest.len(), |(i, _)| i)
    };
    let mut edits: Vec<(usize, usize, &str)> = edits
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            (offset(&range["start"]), offset(&range["end"]), edit["newText"].as_str().unwrap())
        })
        .collect();
    edits.sort_by_key(|edit| std::cmp::Reverse((edit.0, edit.1)));
    let mut text = text.to_owned();
    edits.into_iter().for_each(|(start, end, new)| text.replace_range(start..end, new));
    text
}

#[test]
fn diagnostics_are_those_of_check() {
    let faulty = GRAPH.replace("Perlin", "Perlim").replace("\"$size\"", "\"$sise\"");
    let (_folder, path, mut client) = with(&faulty);
    let told = client.diagnostics(&path, 1);
    let check = std::process::Command::new(assert_cmd::cargo::cargo_bin!("shibo"))
        .args(["check", "--format", "json"])
        .arg(&path)
        .output()
        .unwrap();
    let check: Json = serde_json::from_slice(&check.stdout).unwrap();
    let expected: Vec<_> = check["errors"].as_array().unwrap().iter().collect();
    let errors: Vec<_> = told.iter().filter(|d| d["severity"] == 1).collect();
    assert_eq!(errors.len(), expected.len(), "{told:?} {check}");
    for (told, expected) in errors.iter().zip(expected) {
        assert_eq!(told["code"], expected["code"]);
        assert_eq!(told["range"]["start"]["line"].as_u64().unwrap() + 1, expected["line"].as_u64().unwrap());
        assert_eq!(told["range"]["start"]["character"].as_u64().unwrap() + 1, expected["column"].as_u64().unwrap());
        assert!(told["message"].as_str().unwrap().starts_with(expected["message"].as_str().unwrap()));
    }
    // Diagnostics follow each edit and name the version of the text.
    client.change(&path, 2, GRAPH);
    assert!(client.diagnostics(&path, 2).is_empty());
    let unused = GRAPH.replace("\"noise\": Perlin", "\"more\": Perlin(size: 2),\n    \"noise\": Perlin");
    client.change(&path, 3, &unused);
    let hints = client.diagnostics(&path, 3);
    assert_eq!((hints.len(), &hints[0]["severity"], &hints[0]["tags"]), (1, &json!(4), &json!([1])), "{hints:?}");
    client.stop();
}

#[test]
fn other_files_get_no_diagnostics() {
    let (_folder, path, mut client) = with("(window: (width: 3), \"oops");
    assert!(client.diagnostics(&path, 1).is_empty());
    client.stop();
}

#[test]
fn misspelt_sections_are_reported_where_nothing_else_is() {
    let (_folder, path, mut client) = with("(nods: { \"a\": Perlin() })");
    let told = client.diagnostics(&path, 1);
    assert!(told.iter().any(|d| d["message"].as_str().unwrap().contains("`nods`")), "{told:?}");
    client.stop();
}

#[test]
fn names_of_other_programs_pass_the_filter_of_editors() {
    let text = "(nodes: { \"a\": Voro })";
    let (_folder, path, mut client) = with(text);
    let at = text.find(" })").unwrap();
    let answer = client.at("textDocument/completion", &path, (0, at));
    let found = &answer["items"][0];
    assert_eq!((&found["label"], &found["filterText"]), (&json!("Worley"), &json!("Voronoi")), "{found}");
    client.stop();
}

#[test]
fn nodes_that_are_not_saved_are_not_shown_silently() {
    let (_folder, path, mut client) = with(GRAPH);
    let changed = GRAPH.replace("\"soft\": Blur", "\"new\": Perlin(size: 2),\n    \"soft\": Blur");
    client.change(&path, 2, &changed);
    client.ask("workspace/executeCommand", &json!({ "command": "shibo.show", "arguments": [uri(&path), "new"] }));
    let told = client.wait(|message| message["method"] == "window/showMessage");
    let text = told["params"]["message"].as_str().unwrap();
    assert!(text.contains("`new`") && text.contains("save the file"), "{text}");
    client.stop();
}

#[test]
fn diagnostics_follow_changes_on_disk() {
    let (_folder, path, mut client) = with(GRAPH);
    assert!(client.diagnostics(&path, 1).is_empty());
    let part = path.with_file_name("part.ron");
    fs::write(&part, GRAPH).unwrap();
    let text = GRAPH
        .replace("  params", "  imports: { \"part\": \"part.ron\" },\n  params")
        .replace("\"soft\": Blur(input: \"noise\"", "\"use\": Use(graph: \"part\"),\n    \"soft\": Blur(input: \"use\"")
        .replace("Perlin(size: \"$size\")", "Perlin(size: 2)");
    client.change(&path, 2, &text);
    client.diagnostics(&path, 2);
    fs::write(&part, GRAPH.replace("Perlin", "Perlim")).unwrap();
    let of_part = uri(&part);
    let told = client.wait(|message| {
        message["params"]["uri"] == of_part
            && message["params"]["diagnostics"].as_array().is_some_and(|d| !d.is_empty())
    });
    assert_eq!(told["params"]["diagnostics"][0]["code"], "unknown-kind");
    // An unsaved text takes precedence over the file.
    client.open(&part, GRAPH);
    let told = client.wait(|message| {
        message["params"]["uri"] == of_part && message["params"]["diagnostics"].as_array().is_some_and(Vec::is_empty)
    });
    assert_eq!(told["params"]["version"], 1);
    client.stop();
}

#[test]
fn completion_works_in_broken_lines() {
    let (_folder, path, mut client) = with(GRAPH);
    let cases = [
        ("\"soft\": Blur(input: \"|\", radius: 0.5)", "noise"),
        ("\"soft\": Blur(input: \"no|", "noise"),
        ("\"soft\": Blu|", "Blur"),
        ("\"soft\": Blur(inp|", "input"),
        ("\"soft\": Blur(input: \"noise\", radius: \"$|", "$size"),
        ("\"soft\": Blend(mode: |", "Multiply"),
        ("\"soft\": Blur(input: \"noise\", radius: \"= cla|", "clamp"),
    ];
    for (version, (line, wanted)) in (2..).zip(cases) {
        let text = GRAPH.replace("\"soft\": Blur(input: \"noise\", radius: 0.5)", line);
        let (place, text) = cursor(&text);
        client.change(&path, version, &text);
        let found = labels(&client.at("textDocument/completion", &path, place));
        let place = found.iter().position(|label| label == wanted);
        assert!(place.is_some_and(|place| place < 8), "{line}: {found:?}");
    }
    client.stop();
}

#[test]
fn hovers_show_manual_values_and_pictures() {
    let (_folder, path, mut client) = with(GRAPH);
    let mut hover = |text: &str| {
        let (place, _) = cursor(&GRAPH.replacen(text.replace('|', "").as_str(), text, 1));
        let answer = client.at("textDocument/hover", &path, place);
        answer["contents"]["value"].as_str().unwrap_or_default().to_owned()
    };
    assert!(hover("Per|lin").contains("### Perlin"));
    assert!(hover("rad|ius").contains("radius"));
    assert!(hover("\"$si|ze\"").contains("4 mm"));
    assert!(hover("input: \"no|ise\"").contains("`Gray`, by `Perlin`"));
    // The picture of a node is computed in the background: the first answer does not wait, a later one includes it.
    let shown = (0..200).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        hover("input: \"no|ise\"").contains(".png)")
    });
    assert!(shown, "{}", hover("input: \"no|ise\""));
    client.stop();
}

#[test]
fn formulas_have_tokens_and_pictures_of_their_parts() {
    let text = GRAPH.replace(
        "  },\n  outputs",
        "    \"sum\": r#\"= let s = 2 * noise;\n      s + soft\"#,\n    \"last\": \"= 0.5 * noise + u\",\n  },\n  outputs",
    );
    let (_folder, path, mut client) = with(&text);
    let (place, _) = cursor(&text.replacen("noise + u", "noise |+ u", 1));
    let mut hover = || {
        let answer = client.at("textDocument/hover", &path, place);
        answer["contents"]["value"].as_str().unwrap_or_default().to_owned()
    };
    assert!(hover().starts_with("`0.5 * noise + u`: `Gray`"), "{}", hover());
    let shown = (0..200).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        hover().contains(".png)")
    });
    assert!(shown, "{}", hover());
    let asked = json!({ "textDocument": { "uri": uri(&path) } });
    let tokens = client.ask("textDocument/semanticTokens/full", &asked);
    let data = tokens["result"]["data"].as_array().unwrap();
    // The line after a line break inside of a raw text has tokens, too.
    let (line, _) = cursor(&text.replacen("s + soft", "|s + soft", 1)).0;
    let mut at = 0;
    let lines: Vec<u64> = data
        .chunks(5)
        .map(|token| {
            at += token[0].as_u64().unwrap();
            at
        })
        .collect();
    assert_eq!(lines.iter().filter(|found| **found == line as u64).count(), 3, "{lines:?}");
    client.stop();
}

#[test]
fn nodes_are_renamed_in_all_files() {
    let (_folder, path, mut client) = with(GRAPH);
    let outer = path.with_file_name("outer.ron");
    let text = "(imports: { \"a\": \"a\" }, nodes: { \"u\": Use(graph: \"a\", with: { \"size\": 2 }) }, outputs: { \"o\": \"u.soft\" })";
    fs::write(&outer, text).unwrap();
    let rename = |client: &mut Client, place: (usize, usize), name: &str| {
        let position = json!({ "line": place.0, "character": place.1 });
        client.ask(
            "textDocument/rename",
            &json!({ "textDocument": { "uri": uri(&path) }, "position": position, "newName": name }),
        )
    };
    let (place, _) = cursor(&GRAPH.replacen("\"size\"", "\"si|ze\"", 1));
    let answer = rename(&mut client, place, "cell");
    let changes = &answer["result"]["changes"];
    assert_eq!(applied(GRAPH, &changes[uri(&path)]), GRAPH.replace("\"size\"", "\"cell\"").replace("$size", "$cell"));
    assert!(applied(text, &changes[uri(&outer)]).contains("\"cell\": 2"), "{answer}");
    let (place, _) = cursor(&GRAPH.replacen("{ \"soft\"", "{ \"so|ft\"", 1));
    let answer = rename(&mut client, place, "out");
    assert!(applied(text, &answer["result"]["changes"][uri(&outer)]).contains("\"u.out\""), "{answer}");
    // Names that are taken are refused with a reason.
    let (place, _) = cursor(&GRAPH.replacen("\"noise\"", "\"no|ise\"", 1));
    let answer = rename(&mut client, place, "soft");
    assert!(answer["error"]["message"].as_str().unwrap().contains("there is a node `soft` already"), "{answer}");
    let answer = rename(&mut client, place, "no good");
    assert!(answer["error"]["message"].as_str().unwrap().contains("cannot be a name"), "{answer}");
    client.stop();
}

#[test]
fn sources_and_readers_are_found_in_other_files() {
    let (_folder, path, mut client) = with(GRAPH);
    assert_eq!(client.capabilities["callHierarchyProvider"], true);
    let outer = path.with_file_name("outer.ron");
    let text = "(imports: { \"a\": \"a\" }, nodes: { \"u\": Use(graph: \"a\") }, outputs: { \"o\": \"= u.soft * 2\" })";
    fs::write(&outer, text).unwrap();
    let mut items = client.at("textDocument/prepareCallHierarchy", &path, (6, 26));
    // Each step goes on at the item of the step before, in another file at last.
    for (reader, file, line) in [("soft", &path, 6), ("soft", &path, 8), ("o", &outer, 0)] {
        let calls = client.result("callHierarchy/incomingCalls", &json!({ "item": items[0] }));
        let from = &calls[0]["from"];
        assert_eq!((&from["name"], &from["uri"]), (&json!(reader), &json!(uri(file))), "{calls}");
        assert_eq!(calls[0]["fromRanges"][0]["start"]["line"], line, "{calls}");
        items = json!([from]);
    }
    // And back again: the output of the other file, and the node that uses the file.
    let calls = client.result("callHierarchy/outgoingCalls", &json!({ "item": items[0] }));
    let to: Vec<_> = calls.as_array().unwrap().iter().map(|call| (&call["to"]["name"], &call["to"]["uri"])).collect();
    assert_eq!(to, [(&json!("u"), &json!(uri(&outer))), (&json!("soft"), &json!(uri(&path)))], "{calls}");
    // An item that is gone has no calls.
    client.change(&path, 2, &GRAPH.replace("noise", "other"));
    let gone = json!({ "item": { "name": "noise", "kind": 12, "uri": uri(&path), "range": calls[0]["to"]["range"],
        "selectionRange": calls[0]["to"]["range"],
        "data": { "path": path, "graph": null, "section": "nodes", "name": "noise" } } });
    assert_eq!(client.result("callHierarchy/outgoingCalls", &gone), json!([]));
    client.stop();
}

#[test]
fn offers_quick_fixes() {
    let faulty = GRAPH.replace("Perlin", "Perlim").replace("input: \"noise\", ", "");
    let (_folder, path, mut client) = with(&faulty);
    let told = client.diagnostics(&path, 1);
    let mut fix = |code: &str| {
        let finding = told.iter().find(|d| d["code"] == code).unwrap();
        let params = json!({
            "textDocument": { "uri": uri(&path) }, "range": finding["range"], "context": { "diagnostics": [finding] },
        });
        let actions = client.result("textDocument/codeAction", &params);
        let edits = actions.as_array().unwrap().iter().find(|a| a["kind"] == "quickfix").unwrap();
        applied(&faulty, &edits["edit"]["changes"][uri(&path)])
    };
    assert_eq!(fix("unknown-kind"), faulty.replace("Perlim", "Perlin"));
    assert!(fix("missing-input").contains("Blur(radius: 0.5, input: \"noise\")"), "{}", fix("missing-input"));
    client.stop();
}

#[test]
fn every_request_is_answered() {
    let (_folder, path, mut client) = with(GRAPH);
    client.diagnostics(&path, 1);
    let doc = json!({ "uri": uri(&path) });
    let all = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
    let here = json!({ "textDocument": doc });
    let in_all = json!({ "textDocument": doc, "range": all });
    let has = |answer: &Json, what: &str| assert!(answer.to_string().contains(what), "{what}: {answer}");
    has(&client.at("textDocument/definition", &path, (6, 26)), "\"line\":5");
    assert_eq!(client.at("textDocument/references", &path, (6, 26)).as_array().unwrap().len(), 2);
    assert_eq!(client.at("textDocument/documentHighlight", &path, (6, 26)).as_array().unwrap().len(), 2);
    has(&client.at("textDocument/signatureHelp", &path, (6, 34)), "radius: Number");
    has(&client.result("textDocument/documentSymbol", &here), "Perlin → Gray");
    has(&client.result("textDocument/inlayHint", &in_all), " = 4 mm");
    has(&client.result("textDocument/inlayHint", &in_all), ": Gray");
    has(&client.result("textDocument/foldingRange", &here), "startLine");
    has(&client.result("textDocument/semanticTokens/full", &here), "data");
    has(&client.result("textDocument/codeLens", &here), "shibo.preview");
    has(&client.result("workspace/symbol", &json!({ "query": "noi" })), "noise");
    let selection = json!({ "textDocument": doc, "positions": [{ "line": 6, "character": 26 }] });
    has(&client.result("textDocument/selectionRange", &selection), "parent");
    assert_eq!(client.result("textDocument/documentLink", &here), json!([]));
    assert_eq!(client.result("textDocument/documentColor", &here), json!([]));
    client.stop();
}

#[test]
fn colours_keep_their_notation() {
    let text = GRAPH.replace("  outputs", "  nodes2: 0,\n  outputs").replace(
        "\"soft\": Blur(input: \"noise\", radius: 0.5)",
        "\"a\": Blend(base: \"#336699\", top: (0.5, 0.25, 1), opacity: 0.5)",
    );
    let (_folder, path, mut client) = with(&text);
    let doc = json!({ "uri": uri(&path) });
    let found = client.result("textDocument/documentColor", &json!({ "textDocument": doc }));
    let found = found.as_array().unwrap();
    assert_eq!(found.len(), 2, "{found:?}");
    assert!((found[0]["color"]["green"].as_f64().unwrap() - 0.4).abs() < 1e-3);
    // A linear triple is converted to sRGB for display.
    assert!((found[1]["color"]["red"].as_f64().unwrap() - 0.7354).abs() < 1e-3, "{found:?}");
    let mut present = |index: usize| {
        let color = json!({ "red": 1, "green": 0.5, "blue": 0, "alpha": 1 });
        let params = json!({ "textDocument": doc, "color": color, "range": found[index]["range"] });
        client.result("textDocument/colorPresentation", &params)[0]["label"].as_str().unwrap().to_owned()
    };
    assert_eq!(present(0), "\"#ff8000\"");
    assert_eq!(present(1), "(1.0, 0.214, 0.0)");
    client.stop();
}

#[test]
fn texts_are_formatted() {
    let text =
        GRAPH.replace("Perlin(size: \"$size\")", "Perlin( size:\"$size\" )").replace("radius: 0.5", "radius:0.5");
    let (_folder, path, mut client) = with(&text);
    let options = json!({ "tabSize": 2, "insertSpaces": true });
    let doc = json!({ "uri": uri(&path) });
    let edits = client.result("textDocument/formatting", &json!({ "textDocument": doc, "options": options }));
    // Each parameter has a line of its own.
    let params = GRAPH.replace("params: { ", "params: {\n    ").replace("cell\") },", "cell\"),\n  },");
    assert_eq!(applied(&text, &edits), params);
    assert!(!edits[0]["newText"].as_str().unwrap().contains("canvas"), "lines that are right stay: {edits}");
    let range = json!({ "start": { "line": 5, "character": 6 }, "end": { "line": 5, "character": 8 } });
    let part = json!({ "textDocument": doc, "options": options, "range": range });
    let edits = client.result("textDocument/rangeFormatting", &part);
    assert_eq!(applied(&text, &edits), GRAPH.replace("radius: 0.5", "radius:0.5"));
    // A text with syntax errors is left unchanged.
    client.change(&path, 2, &text.replace("outputs", "\"outputs"));
    let edits = client.result("textDocument/formatting", &json!({ "textDocument": doc, "options": options }));
    assert_eq!(edits, json!([]));
    client.stop();
}

#[test]
fn positions_are_negotiated() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    let path = root.join("a.ron");
    let text = GRAPH.replace("Size of a cell", "Größe シ😀");
    for (encodings, wanted) in [(&["utf-16", "utf-8"][..], "utf-8"), (&["utf-16"], "utf-16"), (&[], "utf-16")] {
        let mut client = Client::start(&root, encodings);
        assert_eq!(client.capabilities["positionEncoding"], wanted);
        client.open(&path, &text.replace(") },\n  nodes", ", bad: 1) },\n  nodes"));
        let told = client.diagnostics(&path, 1);
        let line = text.lines().nth(3).unwrap();
        let before = &line[..line.find(") }").unwrap() + 2];
        let column = if wanted == "utf-8" { before.len() } else { before.encode_utf16().count() };
        assert_eq!(told[0]["range"]["start"]["character"], column, "{told:?}");
        client.stop();
    }
}

#[test]
fn survives_odd_order_and_invalid_requests() {
    let (_folder, path, mut client) = with(GRAPH);
    // Many requests at once, some of them cancelled; every request gets an answer.
    let params = json!({ "textDocument": { "uri": uri(&path) }, "position": { "line": 5, "character": 20 } });
    let ids: Vec<i64> = (0..200).map(|_| client.send("textDocument/completion", &params)).collect();
    for id in ids.iter().rev().step_by(3) {
        client.tell("$/cancelRequest", &json!({ "id": id }));
    }
    for id in ids.iter().rev() {
        let answer = client.answer(*id);
        assert!(answer.get("result").is_some() || answer["error"]["code"] == -32800, "{answer}");
    }
    // Closed files, positions outside the text, changes of unknown files, unknown or malformed requests.
    let other = path.with_file_name("other.ron");
    let closed = json!({ "textDocument": { "uri": uri(&other) }, "position": { "line": 0, "character": 0 } });
    assert!(client.ask("textDocument/hover", &closed)["error"]["message"].as_str().unwrap().contains("not open"));
    client.change(&other, 7, "x");
    client.tell("textDocument/didClose", &json!({ "textDocument": { "uri": uri(&other) } }));
    let far = json!({ "textDocument": { "uri": uri(&path) }, "position": { "line": 4_000_000_000_u32, "character": 4_000_000_000_u32 } });
    client.result("textDocument/completion", &far);
    assert_eq!(client.ask("textDocument/fly", &json!({}))["error"]["code"], -32601);
    assert_eq!(client.ask("textDocument/hover", &json!({ "position": -1 }))["error"]["code"], -32602);
    let close = json!({ "textDocument": { "uri": uri(&path) } });
    client.tell("textDocument/didClose", &close);
    assert!(client.ask("textDocument/hover", &params)["error"].is_object());
    // After the shutdown every request is refused.
    assert_eq!(client.result("shutdown", &Json::Null), Json::Null);
    assert_eq!(client.ask("textDocument/hover", &params)["error"]["code"], -32600);
}

/// The resident memory of a process in KiB.
fn memory(pid: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.trim().trim_end_matches(" kB").parse().ok()
}

#[test]
fn random_edits_do_no_harm() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs");
    let text = fs::read_to_string(root.join("calf.ron")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().canonicalize().unwrap().join("calf.ron");
    let mut client = Client::start(path.parent().unwrap(), &[]);
    client.open(&path, &text);
    let mut random = 88_172_645_463_325_252_u64;
    let mut next = |below: usize| {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        usize::try_from(random % below.max(1) as u64).unwrap()
    };
    let pieces = ["\"", "(", ")", "{", "}", ",", ":", "x", "$p", "= ", "\n", "// ", "😀", "シ", "Blur(", "\"a\": "];
    let mut early = None;
    for version in 2..700 {
        let (line, character) = (next(90), next(100));
        let (from, to) = (
            json!({ "line": line, "character": character }),
            json!({ "line": line, "character": character + next(4) }),
        );
        let edit = json!({ "range": { "start": from, "end": to }, "text": pieces[next(pieces.len())] });
        let doc = json!({ "uri": uri(&path), "version": version });
        client.tell("textDocument/didChange", &json!({ "textDocument": doc, "contentChanges": [edit] }));
        let params = json!({ "textDocument": { "uri": uri(&path) }, "position": from });
        client.result("textDocument/completion", &params);
        client.result("textDocument/hover", &params);
        if version % 100 == 0 {
            client.change(&path, version, &text);
            client.diagnostics(&path, version);
        }
        if version == 200 {
            early = memory(client.pid());
        }
    }
    if let Some((early, late)) = early.zip(memory(client.pid())) {
        assert!(late < early + (64 << 10), "the memory grows from {early} KiB to {late} KiB");
    }
    client.stop();
}
