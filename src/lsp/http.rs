//! Minimal HTTP client for the page of `shibo watch`.
use serde_json::Value as Json;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Timeout of an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum size of an answer in bytes.
const LONGEST: u64 = 8 << 20;

/// Address and path of `http://127.0.0.1:PORT/TOKEN/`.
fn parts(url: &str) -> Option<(SocketAddr, &str)> {
    let rest = url.strip_prefix("http://")?;
    let slash = rest.find('/')?;
    Some((rest[..slash].parse().ok()?, &rest[slash..]))
}

fn open(url: &str, method: &str, path: &str, body: &str) -> Option<BufReader<TcpStream>> {
    let (address, root) = parts(url)?;
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE).ok()?;
    stream.set_read_timeout(Some(PATIENCE)).ok()?;
    let head = format!(
        "{method} {root}{path} HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\nContent-Type: application/json\r\n\
         Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(head.as_bytes()).ok()?;
    let mut reader = BufReader::new(stream);
    let mut status = String::new();
    reader.read_line(&mut status).ok()?;
    let good = status.split(' ').nth(1).is_some_and(|code| code.starts_with('2'));
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line).ok()? == 0 {
            return None;
        }
        if line.trim().is_empty() {
            return good.then_some(reader);
        }
    }
}

/// Posts JSON and reads the answer.
pub(super) fn post(url: &str, path: &str, body: &Json) -> Option<Json> {
    let mut text = String::new();
    open(url, "POST", path, &body.to_string())?.take(LONGEST).read_to_string(&mut text).ok()?;
    // The answer may be chunked, with a length before each chunk, so the JSON is cut out.
    let json = text.find('{').and_then(|start| text.rfind('}').map(|end| &text[start..=end]));
    Some(json.and_then(|json| serde_json::from_str(json).ok()).unwrap_or(Json::Null))
}

/// Receives the news of a page, kind and content of each, until the page ends.
pub(super) fn listen(url: &str, mut hear: impl FnMut(&str, &Json) -> bool) {
    let Some(mut reader) = open(url, "GET", "events?editor=yes", "") else { return };
    let mut kind = String::new();
    loop {
        let mut line = String::new();
        // The page sends at least a comment every ten seconds.
        match reader.get_ref().set_read_timeout(Some(PATIENCE * 6)).and_then(|()| reader.read_line(&mut line)) {
            Ok(0) | Err(_) => return,
            Ok(_) => {}
        }
        if let Some(word) = line.trim().strip_prefix("event: ") {
            word.clone_into(&mut kind);
        } else if let Some(data) = line.trim().strip_prefix("data: ")
            && let Ok(data) = serde_json::from_str(data)
            && !hear(&kind, &data)
        {
            return;
        }
    }
}
