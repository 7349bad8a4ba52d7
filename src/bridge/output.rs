//! The lines for the other program.
use serde_json::Value as Json;
use shibo_bridge::scene::lock;
use std::io::{self, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// The output, used by several threads.
pub(super) struct Output<'o> {
    out: Mutex<&'o mut (dyn Write + Send)>,
    closed: AtomicBool,
    error: Mutex<Option<io::Error>>,
}

impl<'o> Output<'o> {
    pub(super) fn new(out: &'o mut (dyn Write + Send)) -> Self {
        Self { out: Mutex::new(out), closed: AtomicBool::new(false), error: Mutex::default() }
    }

    /// Sends a line; false if the other program reads no more.
    pub(super) fn send(&self, message: &Json) -> bool {
        if self.is_closed() {
            return false;
        }
        let mut line = message.to_string();
        line.push('\n');
        let mut out = lock(&self.out);
        match out.write_all(line.as_bytes()).and_then(|()| out.flush()) {
            Ok(()) => true,
            Err(error) => {
                self.closed.store(true, Ordering::Relaxed);
                lock(&self.error).get_or_insert(error);
                false
            }
        }
    }

    /// True after a line that could not be sent.
    pub(super) fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Relaxed)
    }

    /// The reason why a line could not be sent.
    pub(super) fn error(&self) -> Option<io::Error> {
        lock(&self.error).take()
    }
}
