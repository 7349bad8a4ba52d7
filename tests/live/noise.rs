//! The page of `shibo watch` and the language server with damaged requests and messages, and with a client that holds
//! every connection. Longer runs as in `tests/fuzz`.
use crate::damage::{Chance, fuzz};
use crate::language::{Client, uri};
use crate::watching::{PATIENCE, Place, Watch, plain};
use serde_json::json;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

const TEXT: &str = "(
  version: 1,
  canvas: (size_mm: 20, resolution: 64),
  params: { \"size\": Number(default: 4, range: (1, 8), unit: \"mm\", doc: \"Size of a cell\") },
  nodes: { \"noise\": Perlin(size: \"$size\"), \"soft\": Blur(input: \"noise\", radius: 0.5) },
  outputs: { \"soft\": \"soft\" },
)
";

/// A request as a browser sends it.
fn request(port: u16, line: &str, more: &str) -> Vec<u8> {
    format!(
        "{line} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nConnection: close\r\n{more}"
    )
    .into_bytes()
}

#[test]
fn damaged_requests_are_answered_or_dropped() {
    let place = Place::new(&plain(0.5));
    let mut watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.5).as_bytes());
    let (port, token) = watch.address();
    let body = |body: &str| format!("Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}", body.len());
    let values = body(r#"{"values":{"low":0.25},"generation":1}"#);
    let seeds = vec![
        request(port, &format!("GET /{token}/"), "\r\n"),
        request(port, &format!("GET /{token}/state"), "Accept: */*\r\n\r\n"),
        request(port, &format!("GET /{token}/thumb?g=1&n=0&name=%22noise%22"), "\r\n"),
        request(port, &format!("GET /{token}/graph?g=1"), "If-None-Match: \"a\"\r\n\r\n"),
        request(port, &format!("GET /{token}/pixel?g=1&o=0&x=3&y=4"), "\r\n"),
        request(port, &format!("POST /{token}/values"), &values),
        request(port, &format!("POST /{token}/save"), &body(r#"{"text":"(version: 1)","sha256":"00"}"#)),
        request(port, &format!("POST /{token}/values"), "Transfer-Encoding: chunked\r\n\r\n5\r\n{\"a\":\r\n0\r\n\r\n"),
    ];
    fuzz("requests", &seeds, 600, |input| {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
        let _ = stream.write_all(input);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let mut answer = [0; 64];
        let read = stream.read(&mut answer).unwrap_or(0);
        let answer = String::from_utf8_lossy(&answer[..read]);
        assert!(read == 0 || answer.starts_with("HTTP/1."), "{answer}");
        assert!(!answer.starts_with("HTTP/1.1 500"), "{answer} to {}", String::from_utf8_lossy(input));
    });
    assert!(watch.is_alive() && watch.get("state").0 == 200);
}

#[test]
fn answers_while_a_client_holds_all_connections() {
    let place = Place::new(&plain(0.5));
    let mut watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.5).as_bytes());
    let (port, token) = watch.address();
    let (port, token) = (port, token.to_owned());
    // Half a request line; headers one letter at a time; a huge body that is only announced; nothing.
    let mut held: Vec<TcpStream> = Vec::new();
    for k in 0..300 {
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { continue };
        let begun = match k % 4 {
            0 => format!("GET /{token}/sta"),
            1 => format!("GET /{token}/state HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Slow: "),
            2 => format!(
                "POST /{token}/values HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: 99999999999\r\n\r\n["
            ),
            _ => String::new(),
        };
        let _ = stream.write_all(begun.as_bytes());
        held.push(stream);
    }
    let mut longest = Duration::ZERO;
    for _ in 0..20 {
        for stream in held.iter_mut().skip(1).step_by(4) {
            let _ = stream.write_all(b"x");
        }
        let start = Instant::now();
        assert_eq!(watch.get("state").0, 200);
        longest = longest.max(start.elapsed());
        std::thread::sleep(Duration::from_millis(50));
    }
    println!("{} connections are held; a request took {longest:.1?} at most", held.len());
    assert!(held.len() > 250 && longest < PATIENCE, "{} held, {longest:?}", held.len());
    assert!(watch.is_alive());
}

#[test]
fn damaged_messages_of_an_editor_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().canonicalize().unwrap().join("a.ron");
    std::fs::write(&path, TEXT).unwrap();
    let mut client = Client::start(path.parent().unwrap(), &[]);
    client.open(&path, TEXT);
    let document = json!({ "uri": uri(&path) });
    let methods =
        ["completion", "hover", "definition", "references", "rename", "documentSymbol", "codeAction", "formatting"];
    let mut chance = Chance::new(5);
    for version in 2..120 {
        let text = String::from_utf8_lossy(&chance.damaged(&[TEXT.as_bytes().to_vec()])).into_owned();
        let change =
            json!({ "textDocument": { "uri": uri(&path), "version": version }, "contentChanges": [{ "text": text }] });
        client.tell("textDocument/didChange", &change);
        // Positions may lie outside the text, and parameters may be invalid.
        let position = json!({ "line": chance.below(12), "character": chance.below(90) });
        let range = json!({ "start": position, "end": { "line": chance.below(12), "character": chance.below(90) } });
        let method = methods[chance.below(methods.len())];
        let params = match chance.below(8) {
            0 => json!({ "textDocument": 7 }),
            1 => json!([position]),
            _ => json!({
                "textDocument": document, "position": position, "range": range, "newName": "a\"b",
                "context": { "includeDeclaration": true, "diagnostics": [] }, "options": { "tabSize": 2, "insertSpaces": true },
            }),
        };
        let answer = client.ask(&format!("textDocument/{method}"), &params);
        let code = answer["error"]["code"].as_i64();
        assert!(code.is_none() || code != Some(-32603), "{method}: {answer}");
    }
    let change = json!({ "textDocument": { "uri": uri(&path), "version": 999 }, "contentChanges": [{ "text": TEXT }] });
    client.tell("textDocument/didChange", &change);
    let symbols = client.ask("textDocument/documentSymbol", &json!({ "textDocument": document }));
    assert!(symbols["result"].as_array().is_some_and(|list| !list.is_empty()), "{symbols}");
}
