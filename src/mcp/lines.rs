//! The lines of the protocol. A line that is too long is skipped and answered with an error; the library would drop it silently.
use serde_json::{Value as Json, json};
use std::io;
use std::sync::Arc;
use tokio::io::{AsyncBufReadExt, AsyncRead, AsyncWrite, AsyncWriteExt, BufReader, DuplexStream, duplex};
use tokio::sync::Mutex;
use tokio::task::JoinHandle;

/// The longest line in bytes.
const LINE: usize = 8 << 20;
/// Bytes between this program and the library.
const PIPE: usize = 64 << 10;
/// The code of an invalid request in JSON-RPC.
const INVALID: i32 = -32600;
/// Bytes at the start of a long line in which its number is looked for.
const HEAD: usize = 1024;

/// The two ends for the library, and the task that writes answers.
pub(super) struct Lines {
    /// Lines from the client.
    pub(super) questions: DuplexStream,
    /// Lines to the client.
    pub(super) answers: DuplexStream,
    /// Ends when all answers are written.
    pub(super) printed: JoinHandle<io::Result<()>>,
}

impl Lines {
    /// Starts to pass lines on.
    pub(super) fn start(
        input: impl AsyncRead + Send + Unpin + 'static,
        output: impl AsyncWrite + Send + Unpin + 'static,
    ) -> Self {
        let (to_library, questions) = duplex(PIPE);
        let (answers, from_library) = duplex(PIPE);
        let output = Arc::new(Mutex::new(output));
        tokio::spawn(ask(input, to_library, output.clone()));
        let printed = tokio::spawn(print(from_library, output));
        Self { questions, answers, printed }
    }
}

/// Passes lines to the library until the input ends.
async fn ask(
    input: impl AsyncRead + Unpin,
    mut library: impl AsyncWrite + Unpin,
    output: Arc<Mutex<impl AsyncWrite + Unpin>>,
) -> io::Result<()> {
    let mut input = BufReader::with_capacity(PIPE, input);
    let (mut line, mut skips) = (Vec::new(), false);
    loop {
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
            let error = refusal(&line);
            (line, skips) = (Vec::new(), true);
            write_line(&output, error.to_string().as_bytes()).await?;
        }
        if newline.is_some() {
            if !skips {
                library.write_all(&line).await?;
            }
            line.clear();
            skips = false;
        }
    }
}

/// Writes the lines of the library, each as a whole.
async fn print(library: DuplexStream, output: Arc<Mutex<impl AsyncWrite + Unpin>>) -> io::Result<()> {
    let mut library = BufReader::with_capacity(PIPE, library);
    let mut line = Vec::new();
    while library.read_until(b'\n', &mut line).await? > 0 {
        write_line(&output, line.strip_suffix(b"\n").unwrap_or(&line)).await?;
        line.clear();
    }
    Ok(())
}

async fn write_line(output: &Mutex<impl AsyncWrite + Unpin>, line: &[u8]) -> io::Result<()> {
    let mut output = output.lock().await;
    output.write_all(line).await?;
    output.write_all(b"\n").await?;
    output.flush().await
}

/// The error for a line that begins like this.
fn refusal(start: &[u8]) -> Json {
    let message = format!("a line is longer than {} MiB, and was skipped; send less at once", LINE >> 20);
    json!({ "jsonrpc": "2.0", "id": number(start), "error": { "code": INVALID, "message": message } })
}

/// The number of a request, if it stands before its parameters.
fn number(start: &[u8]) -> Json {
    let head = String::from_utf8_lossy(&start[..start.len().min(HEAD)]);
    let inside = head.trim_start().strip_prefix('{').unwrap_or_default();
    let plain = inside.split(['{', '[']).next().unwrap_or_default();
    let value = plain.split_once("\"id\"").and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    let first = value.and_then(|value| serde_json::Deserializer::from_str(value).into_iter::<Json>().next());
    match first {
        Some(Ok(id)) if id.is_i64() || id.is_u64() || id.is_string() => id,
        _ => Json::Null,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use tokio::io::AsyncReadExt;

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
    fn skips_long_lines_and_passes_others() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let exact = "y".repeat(LINE);
            let input = format!("one\n{{\"id\":3,\"x\":\"{}\"}}\n{exact}\ntwo\nrest", "x".repeat(2 * LINE));
            let (mut theirs, output) = duplex(PIPE);
            let mut lines = Lines::start(io::Cursor::new(input.into_bytes()), output);
            let mut passed = String::new();
            lines.questions.read_to_string(&mut passed).await.unwrap();
            assert!(passed == format!("one\n{exact}\ntwo\n"), "{} bytes", passed.len());
            lines.answers.write_all(b"answer\n").await.unwrap();
            drop(lines.answers);
            lines.printed.await.unwrap().unwrap();
            let mut said = String::new();
            theirs.read_to_string(&mut said).await.unwrap();
            let said: Vec<&str> = said.lines().collect();
            assert_eq!((said.len(), said[1]), (2, "answer"));
            let error: Json = serde_json::from_str(said[0]).unwrap();
            assert_eq!((&error["id"], &error["error"]["code"]), (&json!(3), &json!(INVALID)));
        });
    }
}
