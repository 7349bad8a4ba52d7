//! Output to the terminal. Control characters are escaped, since names and texts come from files.
use crate::environment;
use crate::quit::Quit;
use indicatif::MultiProgress;
use std::fmt::Write as _;
use std::io::{ErrorKind, IsTerminal, Write as _};
use std::process::ExitCode;

/// Style of a piece of text where colours are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    /// A heading or a name.
    Bold,
    /// Less important text.
    Dim,
    /// An error.
    Error,
    /// A warning.
    Warning,
    /// A type or a link.
    Accent,
}

impl Style {
    const fn code(self) -> &'static str {
        match self {
            Self::Bold => "1",
            Self::Dim => "2",
            Self::Error => "1;31",
            Self::Warning => "1;33",
            Self::Accent => "36",
        }
    }
}

/// Returns whether a character could change the state of a terminal or the order of shown text.
pub(crate) fn is_unsafe(c: char) -> bool {
    let reorders = matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    c.is_control() || reorders || matches!(c, '\u{2028}' | '\u{2029}')
}

/// Escapes everything in `text` that is not plain text on one line.
pub(crate) fn escape(text: &str) -> String {
    if !text.contains(is_unsafe) {
        return text.to_owned();
    }
    let mut safe = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_unsafe(c) { safe.extend(c.escape_debug()) } else { safe.push(c) }
    }
    // `escape_debug` does not escape some of them.
    if safe.contains(is_unsafe) {
        safe =
            safe.chars().map(|c| if is_unsafe(c) { c.escape_unicode().to_string() } else { c.to_string() }).collect();
    }
    safe
}

/// Text that is safe to show: escaped pieces, line breaks, and the requested styles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Text {
    color: bool,
    buffer: String,
}

impl Text {
    /// Creates an empty text; styles are ignored without `color`.
    pub(crate) fn new(color: bool) -> Self {
        Self { color, buffer: String::new() }
    }

    /// Adds plain text; line breaks are kept.
    pub(crate) fn push(&mut self, text: &str) -> &mut Self {
        for (i, line) in text.split('\n').enumerate() {
            if i > 0 {
                self.buffer.push('\n');
            }
            self.buffer.push_str(&escape(line));
        }
        self
    }

    /// Adds text in a style.
    pub(crate) fn styled(&mut self, style: Style, text: &str) -> &mut Self {
        if !self.color {
            return self.push(text);
        }
        let _ = write!(self.buffer, "\u{1b}[{}m", style.code());
        self.push(text);
        self.buffer.push_str("\u{1b}[0m");
        self
    }

    /// Adds text with styles of its own (`ESC [ … m`), which are kept if colours are allowed; all else is escaped.
    pub(crate) fn rendered(&mut self, text: &str) -> &mut Self {
        let mut rest = text;
        while let Some(at) = rest.find('\u{1b}') {
            self.push(&rest[..at]);
            let after = &rest[at + 1..];
            let style =
                after.strip_prefix('[').and_then(|s| s.find(|c: char| !c.is_ascii_digit() && c != ';').map(|n| (s, n)));
            match style {
                Some((s, n)) if self.color && s[n..].starts_with('m') => {
                    let _ = write!(self.buffer, "\u{1b}[{}m", &s[..n]);
                    rest = &s[n + 1..];
                }
                _ => {
                    self.buffer.push_str("\\u{1b}");
                    rest = after;
                }
            }
        }
        self.push(rest)
    }

    /// Returns whether colours are allowed.
    pub(crate) fn color(&self) -> bool {
        self.color
    }

    /// Adds a line break.
    pub(crate) fn end(&mut self) -> &mut Self {
        self.buffer.push('\n');
        self
    }

    /// The text so far.
    #[cfg(test)]
    pub(crate) fn as_str(&self) -> &str {
        &self.buffer
    }
}

/// Stdout and stderr.
pub(crate) struct Terminal {
    color: bool,
    width: usize,
    bars: MultiProgress,
}

impl Terminal {
    /// Detects the properties of the terminal.
    pub(crate) fn new() -> Self {
        let color = std::io::stderr().is_terminal() && environment::colors();
        Self { color, width: width(), bars: MultiProgress::new() }
    }

    /// Returns whether stderr may have colours.
    pub(crate) fn color(&self) -> bool {
        self.color
    }

    /// Number of columns.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    /// Container of progress bars; hidden if stderr is no terminal.
    pub(crate) fn bars(&self) -> &MultiProgress {
        &self.bars
    }

    /// Starts a text for stdout, with colours if stdout is a terminal.
    pub(crate) fn page(&self) -> Text {
        Text::new(std::io::stdout().is_terminal() && environment::colors())
    }

    /// Writes to stderr.
    pub(crate) fn show(&self, text: &Text) {
        // If stderr is closed, the error cannot be reported anywhere.
        self.bars.suspend(|| drop(std::io::stderr().write_all(text.buffer.as_bytes())));
    }

    fn message(&self, style: Style, word: &str, message: &str) {
        let mut text = Text::new(self.color);
        text.styled(style, word).push(": ").push(message).end();
        self.show(&text);
    }

    /// Shows an error.
    pub(crate) fn error(&self, message: &str) {
        self.message(Style::Error, "error", message);
    }

    /// Shows a warning.
    pub(crate) fn warning(&self, message: &str) {
        self.message(Style::Warning, "warning", message);
    }

    /// Shows a message.
    pub(crate) fn say(&self, message: &str) {
        let mut text = Text::new(self.color);
        text.push(message).end();
        self.show(&text);
    }

    /// Writes a page to stdout.
    pub(crate) fn print(&self, text: &Text) -> Result<(), Quit> {
        write_out(&text.buffer)
    }

    /// Writes data to stdout: unchanged to files and pipes, escaped for a terminal.
    pub(crate) fn data(&self, data: &str) -> Result<(), Quit> {
        if std::io::stdout().is_terminal() {
            let mut text = Text::new(false);
            text.push(data);
            return write_out(&text.buffer);
        }
        write_out(data)
    }

    /// Writes a line of JSON to stdout.
    pub(crate) fn json(&self, value: &impl serde::Serialize) -> Result<(), Quit> {
        let mut out = std::io::BufWriter::with_capacity(1 << 16, std::io::stdout().lock());
        let mut serializer = serde_json::Serializer::with_formatter(&mut out, SafeJson);
        value
            .serialize(&mut serializer)
            .map_err(std::io::Error::from)
            .and_then(|()| out.write_all(b"\n"))
            .and_then(|()| out.flush())
            .map_err(|e| unwritten(&e))
    }

    /// Shows clap's output: help and versions on stdout, errors on stderr.
    pub(crate) fn usage(&self, error: &clap::Error) -> ExitCode {
        let plain = std::env::args_os().any(|arg| arg.to_string_lossy().contains(is_unsafe));
        let (out, code) = if error.use_stderr() { (false, ExitCode::from(2)) } else { (true, ExitCode::SUCCESS) };
        let mut text = if out { self.page() } else { Text::new(self.color) };
        // If arguments in the message contain escape sequences, these cannot be told from the styles, so styles are
        // dropped.
        let rendered = if plain { error.render().to_string() } else { error.render().ansi().to_string() };
        if text.color {
            text.rendered(&rendered)
        } else {
            text.push(&error.render().to_string())
        };
        if out {
            return self.print(&text).map_or_else(|quit| quit.code(self), |()| code);
        }
        self.show(&text);
        code
    }
}

fn write_out(text: &str) -> Result<(), Quit> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| unwritten(&e))
}

fn unwritten(error: &std::io::Error) -> Quit {
    match error.kind() {
        ErrorKind::BrokenPipe => Quit::Closed,
        _ => Quit::failed(format!("cannot write to stdout: {error}")),
    }
}

/// JSON without characters that a terminal could act on; the meaning stays the same.
struct SafeJson;

impl serde_json::ser::Formatter for SafeJson {
    fn write_string_fragment<W: ?Sized + std::io::Write>(&mut self, writer: &mut W, text: &str) -> std::io::Result<()> {
        for piece in text.split_inclusive(is_unsafe) {
            let mut rest = piece.chars();
            match rest.next_back() {
                Some(c) if is_unsafe(c) => {
                    writer.write_all(rest.as_str().as_bytes())?;
                    let mut units = [0; 2];
                    c.encode_utf16(&mut units).iter().try_for_each(|unit| write!(writer, "\\u{unit:04x}"))?;
                }
                _ => writer.write_all(piece.as_bytes())?,
            }
        }
        Ok(())
    }
}

/// Number of columns, limited to a readable width.
fn width() -> usize {
    let of = |size: Option<(terminal_size::Width, terminal_size::Height)>| size.map(|(w, _)| usize::from(w.0));
    of(terminal_size::terminal_size_of(std::io::stdout()))
        .or_else(|| of(terminal_size::terminal_size_of(std::io::stderr())))
        .unwrap_or(100)
        .clamp(20, 120)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_control_characters() {
        assert_eq!(escape("a\u{1b}[31mb\n\t\u{9b}\u{202e}ü"), "a\\u{1b}[31mb\\n\\t\\u{9b}\\u{202e}ü");
        assert_eq!(escape("plain — text"), "plain — text");
    }

    #[test]
    fn json_is_safe_and_keeps_meaning() {
        let word = "a\u{7f}b\u{9b}\u{202e}\u{1b}\n\"é";
        let mut out = Vec::new();
        let mut serializer = serde_json::Serializer::with_formatter(&mut out, SafeJson);
        serde::Serialize::serialize(word, &mut serializer).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert!(!text.contains(is_unsafe), "{text:?}");
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), word);
    }

    #[test]
    fn passes_only_styles() {
        let mut text = Text::new(true);
        text.rendered("\u{1b}[1;31mred\u{1b}[0m\n\u{1b}]0;title\u{7}\u{1b}[2J\u{1b}");
        assert_eq!(text.as_str(), "\u{1b}[1;31mred\u{1b}[0m\n\\u{1b}]0;title\\u{7}\\u{1b}[2J\\u{1b}");
        let mut text = Text::new(false);
        text.rendered("\u{1b}[1mb").styled(Style::Bold, "c");
        assert_eq!(text.as_str(), "\\u{1b}[1mbc");
    }
}
