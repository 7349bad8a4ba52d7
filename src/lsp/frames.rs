//! Messages on stdin and stdout. An unreadable message is reported and skipped. Memory is allocated for bytes that have
//! arrived, not for announced lengths.
use lsp_server::{Connection, Message, Notification};
use serde_json::json;
use std::io::{self, BufWriter, Read, Write};
use std::thread;

/// Maximum size of a message in bytes; graph files have at most 8 MiB.
const MOST: usize = 64 << 20;
/// Maximum number of bytes before the content of a message.
const HEAD: usize = 4 << 10;
/// Begin of a message.
const BEGIN: &[u8] = b"Content-Length:";
/// Number of bytes per read.
const PART: usize = 64 << 10;

/// Messages in a stream of bytes.
struct Frames<R> {
    input: R,
    bytes: Vec<u8>,
    /// Offset in `bytes` of the next message.
    start: usize,
}

impl<R: Read> Frames<R> {
    fn new(input: R) -> Self {
        Self { input, bytes: Vec::new(), start: 0 }
    }

    /// Bytes read and not yet consumed.
    fn rest(&self) -> &[u8] {
        &self.bytes[self.start..]
    }

    fn take(&mut self, count: usize) {
        self.start = (self.start + count).min(self.bytes.len());
    }

    /// Reads more bytes; returns false at the end of the stream.
    fn more(&mut self) -> io::Result<bool> {
        self.bytes.drain(..self.start);
        self.start = 0;
        let length = self.bytes.len();
        self.bytes.resize(length + PART, 0);
        let read = loop {
            match self.input.read(&mut self.bytes[length..]) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                read => break read,
            }
        };
        self.bytes.truncate(length + *read.as_ref().unwrap_or(&0));
        read.map(|read| read > 0)
    }

    /// Returns the next message, or the reason why it is unreadable; `None` at the end of the stream.
    fn next(&mut self) -> io::Result<Option<Result<Message, String>>> {
        let end = loop {
            if let Some(end) = find(self.rest(), b"\r\n\r\n").filter(|end| *end <= HEAD) {
                break end + 4;
            }
            if self.rest().len() > HEAD {
                self.skip()?;
                return Ok(Some(Err("a message has no header".into())));
            }
            if !self.more()? {
                return Ok(None);
            }
        };
        let length = match length(&self.rest()[..end]) {
            Ok(length) => length,
            Err(reason) => {
                self.skip()?;
                return Ok(Some(Err(reason)));
            }
        };
        self.take(end);
        while self.rest().len() < length {
            if !self.more()? {
                return Ok(None);
            }
        }
        match serde_json::from_slice(&self.rest()[..length]) {
            Ok(message) => {
                self.take(length);
                Ok(Some(Ok(message)))
            }
            // For a JSON error the length was right; otherwise the next message may begin within this content.
            Err(error) if error.is_data() => {
                self.take(length);
                Ok(Some(Err(format!("a message is not one of the protocol: {error}"))))
            }
            Err(error) => {
                self.skip()?;
                Ok(Some(Err(format!("a message cannot be read: {error}"))))
            }
        }
    }

    /// Skips to the next probable message. JSON has no line that starts with a header, so content is not mistaken for
    /// one.
    fn skip(&mut self) -> io::Result<()> {
        self.take(1);
        loop {
            while let Some(at) = find(self.rest(), BEGIN) {
                self.take(at);
                let line = loop {
                    if let Some(end) = find(self.rest(), b"\r\n") {
                        break &self.rest()[BEGIN.len()..end];
                    }
                    if self.rest().len() > HEAD || !self.more()? {
                        break &[][..];
                    }
                };
                if line.trim_ascii().iter().all(u8::is_ascii_digit) && !line.trim_ascii().is_empty() {
                    return Ok(());
                }
                self.take(1);
            }
            // A header may begin in the last bytes, so these are kept.
            self.take(self.rest().len().saturating_sub(BEGIN.len()));
            if !self.more()? {
                self.take(self.rest().len());
                return Ok(());
            }
        }
    }
}

/// Content length in a header.
fn length(head: &[u8]) -> Result<usize, String> {
    let head = String::from_utf8_lossy(head);
    let lines = head.lines().filter_map(|line| line.split_once(':'));
    let mut told =
        lines.filter(|(name, _)| name.trim().eq_ignore_ascii_case("content-length")).map(|(_, value)| value.trim());
    let told = told.next_back().ok_or("a message has no `Content-Length`")?;
    let length = told.parse::<u128>().map_err(|_| "a message's `Content-Length` is no number".to_owned())?;
    let most = usize::try_from(length).ok().filter(|length| *length <= MOST);
    most.ok_or_else(|| format!("a message of {length} bytes is announced; {MOST} are the most"))
}

fn find(bytes: &[u8], what: &[u8]) -> Option<usize> {
    bytes.windows(what.len()).position(|window| window == what)
}

/// Threads that read stdin and write stdout.
pub(super) struct Threads {
    writer: thread::JoinHandle<io::Result<()>>,
}

impl Threads {
    /// Waits until everything is written.
    pub(super) fn join(self) -> io::Result<()> {
        self.writer.join().unwrap_or(Ok(()))
    }
}

/// Connection to the editor on stdin and stdout.
pub(super) fn stdio() -> (Connection, Threads) {
    let (server, editor) = Connection::memory();
    let Connection { sender, receiver } = editor;
    let (back, told) = (server.sender.clone(), sender);
    // Not joined, since nothing else wakes a thread that waits for stdin; it ends with the process.
    thread::spawn(move || {
        let mut frames = Frames::new(io::stdin());
        while let Ok(Some(message)) = frames.next() {
            let last = matches!(&message, Ok(Message::Notification(note)) if note.method == "exit");
            let sent = match message {
                Ok(message) => told.send(message).is_ok(),
                Err(reason) => back.send(log(&reason)).is_ok(),
            };
            if !sent || last {
                return;
            }
        }
    });
    let writer = thread::spawn(move || {
        let mut out = BufWriter::new(io::stdout());
        for message in receiver {
            message.write(&mut out)?;
            out.flush()?;
        }
        Ok(())
    });
    (server, Threads { writer })
}

/// A line in the editor's log.
fn log(text: &str) -> Message {
    let params = json!({ "type": 1, "message": format!("shibo: {text}") });
    Message::Notification(Notification::new("window/logMessage".to_owned(), params))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn framed(body: &str) -> Vec<u8> {
        format!("Content-Length: {}\r\n\r\n{body}", body.len()).into_bytes()
    }

    fn note(method: &str) -> Vec<u8> {
        framed(&json!({ "jsonrpc": "2.0", "method": method }).to_string())
    }

    /// A stream that returns a few bytes per read.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            let count = self.1.min(self.0.len()).min(out.len());
            out[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    /// Methods of the messages in a stream, and `!` for each unreadable one.
    fn read(bytes: &[u8]) -> Vec<String> {
        let of = |step: usize| {
            let mut frames = Frames::new(Slow(bytes, step));
            let mut found = Vec::new();
            while let Some(message) = frames.next().unwrap() {
                found.push(match message {
                    Ok(Message::Notification(note)) => note.method,
                    Ok(other) => format!("{other:?}"),
                    Err(_) => "!".to_owned(),
                });
                assert!(frames.bytes.capacity() < 1 << 20);
            }
            found
        };
        let found = of(1);
        [7, 1 << 20].into_iter().for_each(|step| assert_eq!(of(step), found));
        found
    }

    #[test]
    fn reads_messages_in_pieces() {
        assert_eq!(read(&[note("a"), note("b")].concat()), ["a", "b"]);
        let typed = b"content-type: x; charset=utf-8\r\nCONTENT-LENGTH:  14\r\n\r\n{\"method\":\"a\"}";
        assert_eq!(read(typed), ["a"]);
        assert_eq!(read(b""), Vec::<String>::new());
        assert_eq!(read(b"Content-Length: 50\r\n\r\n{}"), Vec::<String>::new(), "the stream ends within a message");
    }

    #[test]
    fn skips_unreadable_messages() {
        let bad: [Vec<u8>; 14] = [
            b"Content-Length: 99999999999999999999\r\n\r\n{}".to_vec(),
            b"Content-Length: 999999999999999999999999999999999999999999999999999999\r\n\r\n".to_vec(),
            b"Content-Length: 67108865\r\n\r\n{}".to_vec(),
            b"Content-Length: -1\r\n\r\n{}".to_vec(),
            b"Content-Length: x\r\n\r\n".to_vec(),
            b"Content-Type: a\r\n\r\n{}".to_vec(),
            b"what is this\r\n\r\n".to_vec(),
            framed("{]"),
            framed("not json"),
            framed("[]"),
            framed("{\"jsonrpc\":\"2.0\"}"),
            framed("\u{0}"),
            // Announced lengths that are too short and too long; the latter reach into the next message.
            b"Content-Length: 5\r\n\r\n{\"method\":\"lost\"}".to_vec(),
            b"Content-Length: 30\r\n\r\n{\"method\":\"lost\"}".to_vec(),
        ];
        for bad in bad {
            let said = String::from_utf8_lossy(&bad).into_owned();
            assert_eq!(read(&[note("a"), bad, note("b"), note("c")].concat()), ["a", "!", "b", "c"], "{said}");
        }
        let long = [vec![b'x'; 3 * HEAD], note("a")].concat();
        assert_eq!(read(&long), ["!", "a"]);
        // A text that looks like a header is no header.
        let inside = framed("{\"method\":\"Content-Length: 3\\r\\n\\r\\n{}\" oops");
        assert_eq!(read(&[inside, note("a")].concat()), ["!", "a"]);
    }
}
