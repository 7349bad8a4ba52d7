//! Shows diagnostics to people: position, surrounding lines, and help.
use crate::terminal::{Style, Terminal, Text, escape, is_unsafe};
use miette::{
    Diagnostic as Report, GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents,
    Severity, SourceCode, SourceSpan, SpanContents,
};
use shibo_value::diagnostics::{Diagnostic, FileId, SourceMap, Span};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;

/// Number of reports that show source lines; further ones take one line each.
const PICTURES: usize = 40;
/// Longer lines are not shown, in bytes.
const LONGEST_LINE: usize = 400;

/// Places at most this many lines apart are drawn together.
const NEAR: usize = 3;

/// A span, its message, and whether it is the primary one of its diagnostic.
type Place = (Span, String, bool);

/// Shows diagnostics, errors and warnings.
pub(crate) fn show(terminal: &Terminal, diagnostics: &[Diagnostic], sources: &SourceMap) {
    if diagnostics.is_empty() {
        return;
    }
    let mut text = Text::new(terminal.color());
    let mut texts = Texts { sources, shown: BTreeMap::new() };
    for (i, diagnostic) in diagnostics.iter().enumerate() {
        write(&mut text, diagnostic, &mut texts, terminal.width(), i < PICTURES);
    }
    terminal.show(&text);
}

/// A number with its noun: `1 file`, `2 files`, `2 entries`.
pub(crate) fn count(number: u64, noun: &str) -> String {
    match noun.strip_suffix('y') {
        _ if number == 1 => format!("1 {noun}"),
        Some(stem) => format!("{number} {stem}ies"),
        None => format!("{number} {noun}s"),
    }
}

fn write(text: &mut Text, diagnostic: &Diagnostic, texts: &mut Texts<'_>, width: usize, picture: bool) {
    let (style, word) = if diagnostic.warning { (Style::Warning, "warning") } else { (Style::Error, "error") };
    text.styled(style, word).push(&format!("[{}]: {}", diagnostic.code, one_line(&diagnostic.message))).end();
    let mut places = vec![(diagnostic.span, String::new(), true)];
    places.extend(diagnostic.related.iter().map(|r| (r.span, one_line(&r.message), false)));
    let pictures = picture.then(|| pictures(&places, texts, width, text.color())).flatten();
    match pictures {
        Some(pictures) => pictures.iter().for_each(|p| {
            text.rendered(p);
        }),
        None => plain(text, &places, texts.sources),
    }
    if let Some(help) = &diagnostic.help {
        let help = escape(&one_line(help));
        let options = textwrap::Options::new(width.max(40)).initial_indent("  help: ").subsequent_indent("        ");
        text.push(&textwrap::fill(&help, options.break_words(false))).end();
    }
    text.end();
}

fn one_line(message: &str) -> String {
    message.replace(['\n', '\r'], " ")
}

/// Places without source lines.
fn plain(text: &mut Text, places: &[Place], sources: &SourceMap) {
    for (span, label, _) in places {
        let at = sources.position(span.file, span.start);
        let path = escape(&sources.path(span.file).to_string_lossy());
        text.push("  at ").styled(Style::Accent, &format!("{path}:{}:{}", at.line, at.column));
        if !label.is_empty() {
            text.push(&format!(": {label}"));
        }
        text.end();
    }
}

/// Places drawn into their source lines, neighbours together; `None` if a text cannot be shown.
fn pictures(places: &[Place], texts: &mut Texts<'_>, width: usize, color: bool) -> Option<Vec<String>> {
    let theme = if color { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let handler = GraphicalReportHandler::new_themed(theme).with_width(width.max(40)).without_syntax_highlighting();
    groups(places, texts.sources)
        .into_iter()
        .map(|here| {
            let source = texts.get(here.first()?.0)?;
            here.iter().all(|(span, ..)| source.is_readable(span)).then_some(())?;
            let picture = Picture { source, labels: here.iter().map(|place| label(source, place)).collect() };
            let mut out = String::new();
            handler.render_report(&mut out, &picture).ok()?;
            // The first lines repeat the message, which is already printed above all files.
            let start = out.find('╭').and_then(|at| out[..at].rfind('\n')).map_or(0, |at| at + 1);
            Some(out.split_off(start))
        })
        .collect()
}

/// Groups places that are drawn together; all lines between them are shown.
fn groups<'p>(places: &'p [Place], sources: &SourceMap) -> Vec<Vec<&'p Place>> {
    let mut groups: Vec<(FileId, RangeInclusive<usize>, Vec<&Place>)> = Vec::new();
    for place in places {
        let span = place.0;
        let (first, last) = (sources.position(span.file, span.start).line, sources.position(span.file, span.end).line);
        let near = |(file, lines, _): &&mut (FileId, RangeInclusive<usize>, Vec<&Place>)| {
            *file == span.file && first <= lines.end() + NEAR && *lines.start() <= last + NEAR
        };
        match groups.iter_mut().find(near) {
            Some((_, lines, group)) => {
                *lines = first.min(*lines.start())..=last.max(*lines.end());
                group.push(place);
            }
            None => groups.push((span.file, first..=last, vec![place])),
        }
    }
    groups.into_iter().map(|(.., group)| group).collect()
}

fn label(source: &Shown, (span, label, primary): &Place) -> LabeledSpan {
    let (start, end) = source.within(span);
    let label = (!label.is_empty()).then(|| escape(label));
    if *primary {
        LabeledSpan::new_primary_with_span(label, (start, end - start))
    } else {
        LabeledSpan::new_with_span(label, (start, end - start))
    }
}

/// Texts of a source map, prepared for display.
struct Texts<'a> {
    sources: &'a SourceMap,
    shown: BTreeMap<usize, Shown>,
}

impl Texts<'_> {
    fn get(&mut self, span: Span) -> Option<&Shown> {
        let sources = self.sources;
        sources.sources().get(span.file.0)?;
        Some(self.shown.entry(span.file.0).or_insert_with(|| {
            Shown::new(escape(&sources.path(span.file).to_string_lossy()), &sources.text(span.file))
        }))
    }
}

/// A text whose control characters are replaced by others of the same length, so that offsets stay valid.
#[derive(Debug)]
struct Shown {
    name: String,
    text: String,
    lines: Vec<usize>,
}

impl Shown {
    fn new(name: String, text: &str) -> Self {
        let mut safe = String::with_capacity(text.len());
        for c in text.chars() {
            match c {
                '\n' | '\t' => safe.push(c),
                '\r' => safe.push(' '),
                c if !is_unsafe(c) => safe.push(c),
                c => safe.push_str(["?", "·", "\u{fffd}"][(c.len_utf8() - 1).min(2)]),
            }
        }
        let lines = std::iter::once(0).chain(safe.match_indices('\n').map(|(i, _)| i + 1)).collect();
        Self { name, text: safe, lines }
    }

    /// Clips a span to the text and to the characters of its first lines.
    fn within(&self, span: &Span) -> (usize, usize) {
        let floor = |mut offset: usize| {
            while !self.text.is_char_boundary(offset) {
                offset -= 1;
            }
            offset
        };
        let start = floor(span.start.min(self.text.len()));
        (start, floor(span.end.clamp(start, self.text.len())))
    }

    fn line_of(&self, offset: usize) -> usize {
        self.lines.partition_point(|&start| start <= offset).saturating_sub(1)
    }

    fn line_end(&self, line: usize) -> usize {
        self.lines.get(line + 1).copied().unwrap_or(self.text.len())
    }

    /// Returns whether the lines of a span and around it are few and short enough to show.
    fn is_readable(&self, span: &Span) -> bool {
        let (start, end) = self.within(span);
        let (first, last) = (self.line_of(start), self.line_of(end));
        let lines = first.saturating_sub(1)..(last + 2).min(self.lines.len());
        !self.text.is_empty()
            && last - first < 8
            && lines.into_iter().all(|l| self.line_end(l) - self.lines[l] <= LONGEST_LINE)
    }
}

impl SourceCode for Shown {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let end = span.offset() + span.len();
        if end > self.text.len() {
            return Err(MietteError::OutOfBounds);
        }
        let line = self.line_of(span.offset());
        // Context starts with a whole line; without context, the span itself is requested with its column in
        // characters.
        let (from, first) = match before {
            0 => (span.offset(), line),
            n => (self.lines[line.saturating_sub(n)], line.saturating_sub(n)),
        };
        let column = self.text.get(self.lines[line]..from).map_or(0, |text| text.chars().count());
        let last = self.line_of(end.saturating_sub(1).max(span.offset())) + after;
        let to = if after == 0 { end.max(from) } else { self.line_end(last) };
        let data = self.text.as_bytes().get(from..to).ok_or(MietteError::OutOfBounds)?;
        let span = SourceSpan::from((from, to - from));
        let contents = MietteSpanContents::new_named(self.name.clone(), data, span, first, column, self.lines.len());
        Ok(Box::new(contents))
    }
}

/// Input of the miette handler: places in one text.
#[derive(Debug)]
struct Picture<'a> {
    source: &'a Shown,
    labels: Vec<LabeledSpan>,
}

impl fmt::Display for Picture<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.source.name)
    }
}

impl std::error::Error for Picture<'_> {}

impl Report for Picture<'_> {
    fn severity(&self) -> Option<Severity> {
        Some(Severity::Error)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        Some(Box::new(self.labels.iter().cloned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::diagnostics::Code;

    fn rendered(diagnostic: &Diagnostic, sources: &SourceMap, width: usize) -> String {
        let mut text = Text::new(false);
        let mut texts = Texts { sources, shown: BTreeMap::new() };
        write(&mut text, diagnostic, &mut texts, width, true);
        text.as_str().to_owned()
    }

    #[test]
    fn counts_columns_in_characters_and_never_wraps_locations() {
        let mut sources = SourceMap::default();
        let name = format!("{}/シボ.ron", "long".repeat(30));
        let file = sources.add(&name, "(\n  \"シボ\": Perlim(),\n)\n");
        let start = sources.text(file).find("Perlim").unwrap();
        let span = Span { file, start, end: start + 6 };
        let text = rendered(&Diagnostic::new(Code::UnknownKind, span, "no kind `Perlim`").help("x"), &sources, 20);
        assert!(text.contains(&format!("{name}:2:9")), "{text}");
        assert!(text.starts_with("error[unknown-kind]: no kind `Perlim`\n"), "{text}");
    }

    #[test]
    fn shows_several_and_empty_files() {
        let mut sources = SourceMap::default();
        let a = sources.add("a.ron", "one\ntwo\n");
        let b = sources.add("b.ron", "three");
        let empty = sources.add("none.ron", "");
        let span = |file, start, end| Span { file, start, end };
        let error = Diagnostic::new(Code::Cycle, span(a, 4, 7), "m").related(span(b, 0, 5), "which is there");
        let text = rendered(&error, &sources, 80);
        assert!(text.contains("a.ron:2:1") && text.contains("b.ron:1:1") && text.contains("which is there"), "{text}");
        let text = rendered(&Diagnostic::new(Code::FileNotFound, span(empty, 0, 0), "m"), &sources, 80);
        assert!(text.contains("none.ron:1:1"), "{text}");
        // The end of a text is a valid position too.
        for start in 0..=8 {
            let text = rendered(&Diagnostic::new(Code::Syntax, span(a, start, start), "m"), &sources, 80);
            let at = sources.position(a, start);
            assert!(text.contains(&format!("a.ron:{}:{}", at.line, at.column)), "{start}: {text}");
        }
    }

    #[test]
    fn control_characters_of_texts_and_names_are_not_shown() {
        let mut sources = SourceMap::default();
        let file = sources.add("a\u{1b}[2J.ron", "x\u{1b}]0;t\u{7}\u{9b}\r\n\u{202e}y\r\n");
        let error = Diagnostic::new(Code::Syntax, Span { file, start: 0, end: 1 }, "\u{1b}c\nd").help("\u{7}");
        let text = rendered(&error, &sources, 80);
        assert!(!text.chars().any(|c| is_unsafe(c) && c != '\n'), "{text:?}");
        assert!(text.contains("a\\u{1b}[2J.ron:1:1"), "{text}");
    }

    #[test]
    fn draws_distant_places_separately() {
        let mut sources = SourceMap::default();
        let file = sources.add("a.ron", (0..1000).map(|i| format!("line{i}\n")).collect::<String>());
        let at = |line: usize| {
            let start = sources.text(file).find(&format!("line{line}\n")).unwrap();
            Span { file, start, end: start + 4 }
        };
        let error = Diagnostic::new(Code::DuplicateKey, at(900), "m").related(at(10), "first").related(at(902), "near");
        let text = rendered(&error, &sources, 80);
        for place in ["a.ron:901:1", "a.ron:11:1"] {
            assert!(text.contains(place), "{text}");
        }
        assert!(text.contains("first") && text.contains("near") && text.trim_end().lines().count() <= 18, "{text}");
    }

    #[test]
    fn omits_very_long_lines() {
        let mut sources = SourceMap::default();
        let file = sources.add("a.ron", "x".repeat(100_000));
        let text = rendered(&Diagnostic::new(Code::Syntax, Span { file, start: 7, end: 9 }, "m"), &sources, 80);
        assert!(text.contains("  at a.ron:1:8\n") && text.len() < 300, "{text}");
    }
}
