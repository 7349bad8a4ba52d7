//! Writes merged brackets: the text of ours with the things of theirs inserted as typed.
use super::bracket::{Bracket, Item};

/// Where things conflict, the text that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pick {
    /// All versions between marks.
    Marks,
    /// Our version.
    Ours,
    /// Their version.
    Theirs,
}

/// Form of the result.
#[derive(Clone, Debug)]
pub(super) struct Form {
    pub(super) pick: Pick,
    /// Characters of a mark.
    pub(super) marker: usize,
    /// End of a line.
    pub(super) eol: &'static str,
}

/// A thing of the result.
#[derive(Clone, Debug)]
pub(super) enum Piece<'t> {
    /// A thing of ours, perhaps changed.
    Keep {
        item: &'t Item<'t>,
        core: String,
        /// New comments above it.
        comments: Option<Vec<&'t str>>,
        /// New comments on its line.
        trail: Option<Vec<&'t str>>,
        /// True if only ours has it.
        new: bool,
    },
    /// A thing of theirs.
    Insert(&'t Item<'t>),
    /// Versions that differ.
    Conflict { ours: Option<&'t Item<'t>>, base: Option<&'t Item<'t>>, theirs: Option<&'t Item<'t>> },
}

impl<'t> Piece<'t> {
    /// A thing of ours as it is.
    pub(super) fn kept(item: &'t Item<'t>, core: impl Into<String>) -> Self {
        Self::Keep { item, core: core.into(), comments: None, trail: None, new: false }
    }

    /// The piece without a conflict, unless that is to be marked.
    fn picked(self, pick: Pick) -> Option<Self> {
        match (self, pick) {
            (Self::Conflict { ours, .. }, Pick::Ours) => ours.map(|item| Self::kept(item, item.core)),
            (Self::Conflict { theirs, ours: Some(item), .. }, Pick::Theirs) => {
                theirs.map(|theirs| Self::kept(item, theirs.core))
            }
            (Self::Conflict { theirs, .. }, Pick::Theirs) => theirs.map(Self::Insert),
            (piece, _) => Some(piece),
        }
    }
}

/// Text that is being written.
struct Out<'a> {
    text: String,
    form: &'a Form,
    indent: String,
    /// True after the last line of a mark: the line break is written already.
    at_line: bool,
    /// True after a comment that ends with its line.
    in_comment: bool,
}

impl Out<'_> {
    /// Adds text that may begin with blanks. Below a mark and after a comment it begins a line, with `indent` in front.
    fn blank(&mut self, text: &str, indent: &str) {
        let rest = text.trim_start_matches([' ', '\t']);
        let line = rest.strip_prefix("\r\n").or_else(|| rest.strip_prefix('\n'));
        match (line, self.at_line, self.in_comment) {
            (Some(line), true, _) => self.text += line,
            (None, true, _) => self.text += &format!("{indent}{rest}"),
            (None, _, true) => self.text += &format!("{}{indent}{rest}", self.form.eol),
            _ => self.text += text,
        }
        (self.at_line, self.in_comment) = (false, false);
    }

    fn comments(&mut self, comments: &[&str]) {
        for comment in comments {
            self.text += &format!("{comment}{}{}", self.form.eol, self.indent);
        }
    }

    /// Ends a thing with its comma and the comments after it.
    fn end(&mut self, gap: &str, comma: bool, trail: &str) {
        self.text += gap;
        self.text += if comma { "," } else { "" };
        self.text += trail;
        let last = format!("{gap}{trail}");
        let line = last.rfind('\n').map_or(0, |newline| newline + 1);
        self.in_comment = last[line..].contains("//");
    }

    fn conflict(&mut self, sides: [Option<&Item<'_>>; 3]) {
        let eol = self.form.eol;
        let line = self.text.rfind('\n').map_or(0, |newline| newline + 1);
        if self.text[line..].trim().is_empty() {
            self.text.truncate(line);
        } else {
            self.text += eol;
        }
        // Comments that all versions have stay above the marks.
        let mut present = sides.into_iter().flatten().map(|item| &item.comments);
        let common = present.next().filter(|first| present.all(|other| other == *first));
        for comment in common.into_iter().flatten() {
            self.text += &format!("{}{comment}{eol}", self.indent);
        }
        let mark = |sign: &str| sign.repeat(self.form.marker);
        let heads = [format!("{} ours", mark("<")), format!("{} base", mark("|")), mark("=")];
        let mut text = String::new();
        for (head, item) in heads.iter().zip(sides) {
            text += &format!("{head}{eol}");
            let Some(item) = item else { continue };
            for comment in item.comments.iter().filter(|_| common.is_none()) {
                text += &format!("{}{comment}{eol}", self.indent);
            }
            text += &format!("{}{}{},{}{eol}", self.indent, item.core, item.gap, item.trail);
        }
        self.text += &format!("{text}{} theirs{eol}", mark(">"));
        (self.at_line, self.in_comment) = (true, false);
    }
}

/// The blanks at the beginning of a text.
fn blanks(text: &str) -> &str {
    &text[..text.len() - text.trim_start().len()]
}

/// The text of brackets of ours with these pieces, and with new comments above the closing bracket.
pub(super) fn write(bracket: &Bracket<'_>, pieces: Vec<Piece<'_>>, tail: Option<Vec<&str>>, form: &Form) -> String {
    let pieces: Vec<Piece<'_>> = pieces.into_iter().filter_map(|piece| piece.picked(form.pick)).collect();
    let has_lines = |item: &Item<'_>| item.lead.contains('\n');
    let inserts_lines = pieces.iter().any(|piece| matches!(piece, Piece::Insert(item) if has_lines(item)));
    let lines = bracket.items.iter().any(has_lines) || (bracket.items.is_empty() && inserts_lines);
    let last_comma = bracket.items.last().map_or(lines, |item| item.comma);
    let indent = bracket.inner_indent();
    let start = bracket.items.first().map_or("", |item| blanks(item.lead));
    let mut out = Out { text: bracket.open.to_owned(), form, indent, at_line: false, in_comment: false };
    let count = pieces.len();
    for (index, piece) in pieces.into_iter().enumerate() {
        let comma = index + 1 < count || last_comma;
        let indent = out.indent.clone();
        match piece {
            Piece::Keep { item, core, comments, trail, .. } => {
                match comments {
                    None if index == 0 && item.comments.is_empty() && !has_lines(item) => out.blank(start, &indent),
                    None => out.blank(item.lead, &indent),
                    Some(comments) => {
                        let above = blanks(item.lead);
                        let line = format!("{}{indent}", form.eol);
                        let above = if above.contains('\n') || comments.is_empty() { above } else { &line };
                        out.blank(above, &indent);
                        out.comments(&comments);
                    }
                }
                out.text += &core;
                let trail =
                    trail.map(|comments| comments.iter().map(|comment| format!(" {comment}")).collect::<String>());
                out.end(item.gap, comma, trail.as_deref().unwrap_or(item.trail));
            }
            Piece::Insert(item) => {
                let spaced = index > 0 && blanks(item.lead).matches('\n').count() > 1;
                let line = format!("{}{}{indent}", if spaced { form.eol } else { "" }, form.eol);
                let own_line = !item.comments.is_empty() || (lines && has_lines(item));
                out.blank(
                    if own_line {
                        &line
                    } else if index == 0 {
                        start
                    } else {
                        " "
                    },
                    &indent,
                );
                out.comments(&item.comments);
                out.text += item.core;
                out.end(item.gap, comma, item.trail);
            }
            Piece::Conflict { ours, base, theirs } => out.conflict([ours, base, theirs]),
        }
    }
    let closing = if bracket.items.is_empty() && lines {
        format!("{}{}", form.eol, bracket.indent)
    } else {
        bracket.tail.to_owned()
    };
    match tail {
        Some(comments) => {
            let line = format!("{}{}", form.eol, out.indent);
            for comment in comments {
                out.blank(&line, "");
                out.text += comment;
                out.in_comment = true;
            }
            out.blank(&format!("{}{}", form.eol, bracket.indent), bracket.indent);
        }
        None => out.blank(&closing, bracket.indent),
    }
    out.text + bracket.close
}
