//! Reports to the terminal, and to programs that read stdout.
use crate::report;
use crate::terminal::Terminal;
use serde_json::{Value as Json, json};
use shibo_bridge::scene::PictureInfo;
use shibo_value::diagnostics::{Diagnostic, SourceMap, to_json};
use std::time::Duration;

/// Maximum number of node names in a line of the terminal.
const NAMES: usize = 3;

/// Reports events.
pub(super) struct StatusReporter<'t> {
    /// Terminal for people.
    pub(super) terminal: &'t Terminal,
    /// True if a program reads stdout.
    pub(super) log: bool,
}

impl StatusReporter<'_> {
    fn log(&self, event: &Json) {
        if self.log {
            // If the reader of stdout is gone, pictures are still shown.
            let _ = self.terminal.json(event);
        }
    }

    /// The page is ready.
    pub(super) fn listening(&self, url: &str) {
        self.terminal.say(&format!("the page is at {url}"));
        self.log(&json!({ "event": "listening", "url": url }));
    }

    /// A save was recognised, or a text of an editor that is not saved.
    pub(super) fn read(&self, sha256: Option<&str>, unsaved: bool) {
        self.log(&json!({ "event": if unsaved { "typed" } else { "saved" }, "sha256": sha256 }));
    }

    /// A picture was shown.
    pub(super) fn shown(&self, sha256: &str, output: &str, shown: &PictureInfo) {
        self.log(&json!({
            "event": "shown",
            "sha256": sha256,
            "output": output,
            "size": shown.size,
            "final": shown.is_final,
            "picture": shown.picture,
        }));
    }

    /// The graph has errors.
    pub(super) fn errors(&self, sha256: Option<&str>, errors: &[Diagnostic], sources: &SourceMap) {
        report::show(self.terminal, errors, sources);
        let errors = to_json(errors, sources)["errors"].take();
        self.log(&json!({ "event": "error", "sha256": sha256, "errors": errors }));
    }

    /// A save was evaluated: the change, the nodes that ran, the number of all nodes, and the times of the first and of
    /// all pictures.
    pub(super) fn done(&self, cause: &str, ran: &[&str], nodes: usize, first: Duration, all: Duration) {
        let names = match ran.len() {
            0 => String::new(),
            n if n <= NAMES => format!(" ({})", ran.join(", ")),
            n => format!(" ({}, … {} more)", ran[..NAMES].join(", "), n - NAMES),
        };
        let sharp =
            if all > first + Duration::from_millis(1) { format!(", sharp in {}", time(all)) } else { String::new() };
        let (ran, nodes) = (ran.len(), report::count(nodes as u64, "node"));
        self.terminal.say(&format!("{cause}: {ran} of {nodes} ran{names}; shown in {}{sharp}", time(first)));
    }
}

fn time(time: Duration) -> String {
    match time.as_secs_f64() {
        s if s < 0.9995 => format!("{:.0} ms", s * 1000.0),
        s => format!("{s:.1} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_times_briefly() {
        assert_eq!(time(Duration::from_micros(12_400)), "12 ms");
        assert_eq!(time(Duration::from_millis(1240)), "1.2 s");
    }
}
