//! The language server with malformed messages, and its end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::language::{Client, uri};
use serde_json::json;

const GRAPH: &str = "(
  version: 1,
  canvas: (size_mm: 20, resolution: 64),
  nodes: {
    \"noise\": Perlin(size: 4),
  },
  outputs: { \"noise\": \"noise\" },
)
";

/// A folder with a graph, and a server for it.
fn server() -> (tempfile::TempDir, std::path::PathBuf, Client) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().canonicalize().unwrap().join("a.ron");
    std::fs::write(&path, GRAPH).unwrap();
    let mut client = Client::start(path.parent().unwrap(), &[]);
    client.open(&path, GRAPH);
    (folder, path, client)
}

#[test]
fn logs_and_skips_malformed_messages() {
    let (_folder, path, mut client) = server();
    for bad in [
        "Content-Length: 99999999999999\r\n\r\n{}",
        "Content-Length: 184467440737095516160\r\n\r\n",
        "Content-Length: -1\r\n\r\n",
        "Content-Length: 9\r\n\r\nnot json!",
        "Content-Length: 2\r\n\r\n[]",
        "Content-Length: 3\r\n\r\n{\"jsonrpc\":\"2.0\"}",
        "hello\r\n\r\n",
    ] {
        client.raw(bad.as_bytes());
        let symbols = client.result("workspace/symbol", &json!({ "query": "noi" }));
        assert!(symbols.to_string().contains("noise"), "{bad:?}: {symbols}");
        let told = client.wait(|message| message["method"] == "window/logMessage");
        assert!(told["params"]["message"].as_str().unwrap().contains("a message"), "{told}");
    }
    client.at("textDocument/hover", &path, (4, 14));
    client.stop();
}

#[test]
fn pages_end_with_a_server_that_is_killed() {
    let (_folder, path, mut client) = server();
    client.result("workspace/executeCommand", &json!({ "command": "shibo.preview", "arguments": [uri(&path)] }));
    let shown = client.wait(|message| message["method"] == "window/showDocument");
    let url = shown["params"]["uri"].as_str().unwrap().to_owned();
    let address = url.strip_prefix("http://").unwrap().split('/').next().unwrap().to_owned();
    let answers = || std::net::TcpStream::connect(&address).is_ok();
    assert!(answers(), "{url}");
    // The killed server cannot end its children.
    drop(client);
    let end = std::time::Instant::now() + std::time::Duration::from_secs(60);
    while answers() {
        assert!(std::time::Instant::now() < end, "the page of {url} is still there");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}
