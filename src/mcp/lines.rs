//! The lines of the protocol: requests from stdin, answers to stdout. A line that is no message is answered with an error.
//!
//! At most [`OPEN`] requests wait for their answers. Further lines stay in the pipe, so a client that floods the server waits itself.
use rmcp::RoleServer;
use rmcp::model::{ClientNotification, JsonRpcMessage, RequestId};
use rmcp::service::{RxJsonRpcMessage, TxJsonRpcMessage};
use rmcp::transport::Transport;
use serde_json::{Value as Json, json};
use std::collections::HashSet;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncWrite, AsyncWriteExt, BufReader};
use tokio::sync::{Mutex as Turns, Notify, mpsc};
use tokio::task::JoinHandle;

/// The longest line in bytes.
const LINE: usize = 8 << 20;
/// The most requests that wait for their answers.
const OPEN: usize = 64;
/// Bytes that are read at once.
const PIECE: usize = 64 << 10;
/// The codes of JSON-RPC for a text that is no JSON, and for JSON that is no request.
const UNREADABLE: i32 = -32700;
const INVALID: i32 = -32600;
/// Bytes at the start of a long line in which its number is looked for.
const HEAD: usize = 1024;

type Received = RxJsonRpcMessage<RoleServer>;
type Sent = TxJsonRpcMessage<RoleServer>;

/// The requests that wait for their answers.
#[derive(Default)]
struct Open {
    ids: Mutex<HashSet<RequestId>>,
    fewer: Notify,
}

impl Open {
    fn ids(&self) -> MutexGuard<'_, HashSet<RequestId>> {
        self.ids.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes a request; false if one with this number waits already.
    fn begin(&self, id: &RequestId) -> bool {
        self.ids().insert(id.clone())
    }

    fn end(&self, id: &RequestId) {
        if self.ids().remove(id) {
            self.fewer.notify_one();
        }
    }

    fn is_full(&self) -> bool {
        self.ids().len() >= OPEN
    }
}

/// The connection with a client.
pub(super) struct Lines<W> {
    questions: mpsc::Receiver<Received>,
    output: Arc<Turns<W>>,
    open: Arc<Open>,
}

impl<W: AsyncWrite + Send + Unpin + 'static> Lines<W> {
    /// Starts to read lines. The task ends with the input.
    pub(super) fn start(
        input: impl AsyncRead + Send + Unpin + 'static,
        output: W,
    ) -> (Self, JoinHandle<io::Result<()>>) {
        let (to_library, questions) = mpsc::channel(1);
        let (output, open) = (Arc::new(Turns::new(output)), Arc::new(Open::default()));
        let ended = tokio::spawn(ask(input, to_library, output.clone(), open.clone()));
        (Self { questions, output, open }, ended)
    }
}

impl<W: AsyncWrite + Send + Unpin + 'static> Transport<RoleServer> for Lines<W> {
    type Error = io::Error;

    fn send(&mut self, message: Sent) -> impl Future<Output = io::Result<()>> + Send + 'static {
        let (output, open) = (self.output.clone(), self.open.clone());
        async move {
            let written = match serde_json::to_vec(&message) {
                Ok(line) => write_line(&output, &line).await,
                Err(error) => Err(error.into()),
            };
            match &message {
                JsonRpcMessage::Response(response) => open.end(&response.id),
                JsonRpcMessage::Error(error) => error.id.iter().for_each(|id| open.end(id)),
                JsonRpcMessage::Request(_) | JsonRpcMessage::Notification(_) => {}
            }
            written
        }
    }

    async fn receive(&mut self) -> Option<Received> {
        self.questions.recv().await
    }

    async fn close(&mut self) -> io::Result<()> {
        self.questions.close();
        Ok(())
    }
}

/// Passes messages to the library until the input ends.
async fn ask(
    input: impl AsyncRead + Unpin,
    library: mpsc::Sender<Received>,
    output: Arc<Turns<impl AsyncWrite + Unpin>>,
    open: Arc<Open>,
) -> io::Result<()> {
    let mut input = BufReader::with_capacity(PIECE, input);
    let (mut line, mut skips) = (Vec::new(), false);
    loop {
        while open.is_full() {
            let is_read = input.buffer().is_empty();
            tokio::select! {
                () = open.fewer.notified() => {}
                // The end of the input is noticed meanwhile.
                read = input.fill_buf(), if is_read => if read?.is_empty() {
                    return Ok(());
                }
            }
        }
        let read = input.fill_buf().await?;
        if read.is_empty() {
            return Ok(());
        }
        let newline = read.iter().position(|byte| *byte == b'\n');
        let count = newline.map_or(read.len(), |newline| newline + 1);
        let is_long = !skips && line.len() + count - usize::from(newline.is_some()) > LINE;
        if !skips && !is_long {
            line.extend_from_slice(&read[..count]);
        }
        input.consume(count);
        if is_long {
            let message = format!("a line is longer than {} MiB, and was skipped; send less at once", LINE >> 20);
            let error = fault(INVALID, number(&line), &message);
            (line, skips) = (Vec::new(), true);
            write_line(&output, error.to_string().as_bytes()).await?;
        }
        if newline.is_some() {
            if !std::mem::take(&mut skips) {
                match message(&line, &open) {
                    Ok(Some(message)) => {
                        let cancelled = cancelled(&message);
                        if library.send(message).await.is_err() {
                            return Ok(());
                        }
                        // The library does not answer a cancelled request.
                        cancelled.iter().for_each(|id| open.end(id));
                    }
                    Ok(None) => {}
                    Err(error) => write_line(&output, error.to_string().as_bytes()).await?,
                }
            }
            line.clear();
        }
    }
}

/// The message of a line, or the error that answers the line. Empty lines and unknown notifications have neither.
fn message(line: &[u8], open: &Open) -> Result<Option<Received>, Json> {
    let line = line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line).trim_ascii();
    if line.is_empty() {
        return Ok(None);
    }
    let unreadable = |error| fault(UNREADABLE, Json::Null, &format!("the line is not JSON: {error}"));
    let json: Json = serde_json::from_slice(line).map_err(unreadable)?;
    let (id, has_method) = (json.get("id").cloned(), json["method"].is_string());
    let invalid = |why: &str| Err(fault(INVALID, id.clone().filter(is_number).unwrap_or_default(), why));
    if has_method && id.as_ref().is_some_and(|id| !is_number(id)) {
        return invalid("the `id` of a request is an integer or a text");
    }
    match serde_json::from_value::<Received>(json) {
        Ok(JsonRpcMessage::Request(request)) if !open.begin(&request.id) => {
            invalid("a request with this `id` is not answered yet; give each request another `id`")
        }
        Ok(message) => Ok(Some(message)),
        Err(_) if has_method && id.is_none() => Ok(None),
        Err(_) => {
            invalid("the line is not a request of JSON-RPC 2.0, which has `jsonrpc`, `id`, `method` and `params`")
        }
    }
}

/// The request that a notification cancels.
fn cancelled(message: &Received) -> Option<RequestId> {
    match message {
        JsonRpcMessage::Notification(notification) => match &notification.notification {
            ClientNotification::CancelledNotification(cancelled) => cancelled.params.request_id.clone(),
            _ => None,
        },
        _ => None,
    }
}

async fn write_line(output: &Turns<impl AsyncWrite + Unpin>, line: &[u8]) -> io::Result<()> {
    let mut output = output.lock().await;
    output.write_all(line).await?;
    output.write_all(b"\n").await?;
    output.flush().await
}

/// An answer that tells an error.
fn fault(code: i32, id: Json, message: &str) -> Json {
    json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } })
}

/// Returns true for the number of a request: an integer or a text.
fn is_number(id: &Json) -> bool {
    id.is_i64() || id.is_string()
}

/// The number of a request, if it stands before its parameters.
fn number(start: &[u8]) -> Json {
    let head = String::from_utf8_lossy(&start[..start.len().min(HEAD)]);
    let inside = head.trim_start().strip_prefix('{').unwrap_or_default();
    let plain = inside.split(['{', '[']).next().unwrap_or_default();
    let value = plain.split_once("\"id\"").and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    let first = value.and_then(|value| serde_json::Deserializer::from_str(value).into_iter::<Json>().next());
    match first {
        Some(Ok(id)) if is_number(&id) => id,
        _ => Json::Null,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use rmcp::model::{EmptyResult, ServerResult};
    use std::time::Duration;
    use tokio::io::{AsyncReadExt, DuplexStream, duplex};
    use tokio::time::timeout;

    fn block_on<T>(work: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(work)
    }

    fn ping(id: usize) -> String {
        format!("{{\"jsonrpc\":\"2.0\",\"id\":{id},\"method\":\"ping\"}}\n")
    }

    /// The number of the next request that the library gets; `None` if there is none for a while.
    async fn next(lines: &mut Lines<DuplexStream>) -> Option<i64> {
        match timeout(Duration::from_millis(200), lines.receive()).await.ok()?? {
            JsonRpcMessage::Request(request) => match request.id {
                RequestId::Number(id) => Some(id),
                RequestId::String(_) => None,
            },
            _ => None,
        }
    }

    fn answer(id: i64) -> Sent {
        JsonRpcMessage::response(ServerResult::EmptyResult(EmptyResult {}), RequestId::Number(id))
    }

    #[test]
    fn finds_the_number_of_a_request() {
        for (start, id) in [
            (r#"{"jsonrpc":"2.0","id":5,"method":"a","params":{"id":7"#, json!(5)),
            (r#" {"id" : "x", "params":{"#, json!("x")),
            (r#"{"method":"a","params":{"id":7}"#, Json::Null),
            ("xxxx", Json::Null),
            (r#"{"id":"#, Json::Null),
        ] {
            assert_eq!(number(start.as_bytes()), id, "{start}");
        }
    }

    #[test]
    fn lines_that_are_no_messages_are_answered() {
        let open = Open::default();
        let error = |line: &str| {
            let error = message(line.as_bytes(), &open).unwrap_err();
            (error["error"]["code"].as_i64().unwrap(), error["id"].clone())
        };
        for line in ["not json", "{", "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"ping\"} x", "\u{feff}nul"] {
            assert_eq!(error(line), (-32700, Json::Null), "{line}");
        }
        for (line, id) in [
            ("{}", Json::Null),
            ("[]", Json::Null),
            ("7", Json::Null),
            (r#"{"jsonrpc":"1.0","id":3,"method":"ping"}"#, json!(3)),
            (r#"{"jsonrpc":"2.0","id":[],"method":"ping"}"#, Json::Null),
        ] {
            assert_eq!(error(line), (-32600, id), "{line}");
        }
        for line in ["", " \r\n", r#"{"jsonrpc":"2.0","method":7}"#, r#"{"method":"notifications/none","params":3}"#] {
            // A notification is never answered; something without a method is no notification.
            assert_eq!(message(line.as_bytes(), &open).is_ok(), !line.contains('7'), "{line}");
        }
        assert!(matches!(message(ping(1).as_bytes(), &open), Ok(Some(JsonRpcMessage::Request(_)))));
        assert_eq!(error(&ping(1)), (-32600, json!(1)), "the first one is not answered yet");
        open.end(&RequestId::Number(1));
        assert!(message(format!("\u{feff}{}", ping(1)).as_bytes(), &open).is_ok());
    }

    #[test]
    fn skips_long_lines_and_passes_others() {
        block_on(async {
            let long = format!("{{\"id\":3,\"x\":\"{}\"}}\n", "x".repeat(2 * LINE));
            // A line that is exactly as long as lines may be.
            let exact = format!("{}{}\n", ping(2).trim_end(), " ".repeat(LINE - ping(2).trim_end().len()));
            let input = format!("{}{long}{exact}{}rest", ping(1), ping(4));
            let (mut theirs, output) = duplex(PIECE);
            let (mut lines, ended) = Lines::start(io::Cursor::new(input.into_bytes()), output);
            for id in [1, 2, 4] {
                assert_eq!(next(&mut lines).await, Some(id));
            }
            assert!(lines.receive().await.is_none());
            ended.await.unwrap().unwrap();
            lines.send(answer(1)).await.unwrap();
            drop(lines);
            let mut said = String::new();
            theirs.read_to_string(&mut said).await.unwrap();
            let said: Vec<Json> = said.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
            assert_eq!((said.len(), &said[1]["id"]), (2, &json!(1)));
            assert_eq!((&said[0]["id"], &said[0]["error"]["code"]), (&json!(3), &json!(INVALID)));
        });
    }

    #[test]
    fn a_flood_of_requests_stays_in_the_pipe() {
        block_on(async {
            let (mut theirs, input) = duplex(1 << 20);
            let (mut lines, ended) = Lines::start(input, duplex(1 << 20).0);
            for id in 0..OPEN + 2 {
                theirs.write_all(ping(id).as_bytes()).await.unwrap();
            }
            for id in 0..OPEN {
                assert_eq!(next(&mut lines).await, i64::try_from(id).ok());
            }
            assert_eq!(next(&mut lines).await, None, "more requests are read than may be open");
            // Each answer makes room for one request, even if no answer is read.
            let _ = lines.send(answer(5)).await;
            assert_eq!(next(&mut lines).await, i64::try_from(OPEN).ok());
            assert_eq!(next(&mut lines).await, None);
            drop(theirs);
            assert!(!ended.is_finished(), "a request is still in the pipe");
            let _ = lines.send(answer(6)).await;
            assert_eq!(next(&mut lines).await, i64::try_from(OPEN + 1).ok());
            // The end is noticed although no further request may be read.
            timeout(Duration::from_secs(5), ended).await.unwrap().unwrap().unwrap();
        });
    }

    #[test]
    fn cancelled_requests_make_room() {
        block_on(async {
            let (mut theirs, input) = duplex(1 << 20);
            let (mut lines, _ended) = Lines::start(input, duplex(1 << 20).0);
            for id in 0..3 * OPEN {
                let cancel =
                    json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": id } });
                theirs.write_all(format!("{}{cancel}\n", ping(id)).as_bytes()).await.unwrap();
                assert_eq!(next(&mut lines).await, i64::try_from(id).ok());
                assert_eq!(next(&mut lines).await, None, "the notification");
            }
        });
    }
}
