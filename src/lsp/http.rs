//! Minimal HTTP client for the page of `shibo watch`.
use serde_json::Value as Json;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Timeout of an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum size of an answer in bytes.
const LONGEST: u64 = 8 << 20;

/// Reason why a request has no result.
#[derive(Debug)]
pub(super) enum Failure {
    /// The page does not answer.
    Silent,
    /// The page refuses, with this status and a reason for the user.
    Refused(u16, String),
}

/// An open answer.
pub(super) type Answer = BufReader<TcpStream>;

/// Address and path of `http://127.0.0.1:PORT/TOKEN/`.
fn parts(url: &str) -> Option<(SocketAddr, &str)> {
    let rest = url.strip_prefix("http://")?;
    let slash = rest.find('/')?;
    Some((rest[..slash].parse().ok()?, &rest[slash..]))
}

/// Sends a request, and reads the head of the answer: its status, and the rest.
fn send(url: &str, method: &str, path: &str, body: &str) -> Option<(u16, Answer)> {
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
    let status = status.split(' ').nth(1)?.parse().ok()?;
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line).ok()? == 0 {
            return None;
        }
        if line.trim().is_empty() {
            return Some((status, reader));
        }
    }
}

/// Sends a request; returns the rest of the answer.
pub(super) fn open(url: &str, method: &str, path: &str, body: &str) -> Result<Answer, Failure> {
    let (status, answer) = send(url, method, path, body).ok_or(Failure::Silent)?;
    if (200..300).contains(&status) {
        return Ok(answer);
    }
    let mut reason = String::new();
    let _ = answer.take(LONGEST).read_to_string(&mut reason);
    Err(Failure::Refused(status, if reason.is_empty() { format!("the page answers {status}") } else { reason }))
}

/// Posts JSON and reads the answer.
pub(super) fn post(url: &str, path: &str, body: &Json) -> Result<Json, Failure> {
    let mut text = String::new();
    let answer = open(url, "POST", path, &body.to_string())?;
    answer.take(LONGEST).read_to_string(&mut text).map_err(|_| Failure::Silent)?;
    // The answer may be chunked, with a length before each chunk, so the JSON is cut out.
    let json = text.find('{').and_then(|start| text.rfind('}').map(|end| &text[start..=end]));
    Ok(json.and_then(|json| serde_json::from_str(json).ok()).unwrap_or(Json::Null))
}

/// Receives news, kind and content of each, until the page ends them or `hear` returns false.
pub(super) fn listen(mut news: Answer, mut hear: impl FnMut(&str, &Json) -> bool) {
    let mut kind = String::new();
    loop {
        let mut line = String::new();
        // The page sends at least a comment every ten seconds.
        match news.get_ref().set_read_timeout(Some(PATIENCE * 6)).and_then(|()| news.read_line(&mut line)) {
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
