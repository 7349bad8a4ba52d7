//! Fixes of the notation of other languages: JSON, Python, YAML, Rust, Markdown.
use super::super::diagnose::Finding;
use super::super::rename::{Edit, sort};
use super::super::world::Cx;
use super::scan::{Piece, PieceKind, pieces};
use super::{Applies, Fix};
use std::ops::Range;

/// Fields of JSON that name the kind of a node.
const TYPES: [&str; 4] = ["type", "kind", "node", "class"];
/// Sections whose braces hold fields rather than names.
const STRUCTS: [&str; 2] = ["canvas", "layout"];
/// Suffixes of numbers in Rust.
const SUFFIXES: [&str; 6] = ["f32", "f64", "i32", "u32", "i64", "usize"];

/// A habit of another language and all its places in a text.
pub(super) struct Habit {
    title: &'static str,
    edits: Vec<Edit>,
}

/// The habits of a text.
pub(super) fn habits(text: &str) -> Vec<Habit> {
    Scanned { text, pieces: pieces(text) }.habits()
}

/// Rewrites the habits of other languages: each in all its places, and all of them.
pub(super) fn fixes(cx: Cx<'_>, habits: &[Habit], finding: &Finding) -> Vec<Fix> {
    if habits.is_empty() {
        return Vec::new();
    }
    let text = &cx.file.text;
    let start = text[..finding.range.start].rfind('\n').map_or(0, |newline| newline + 1);
    let end = text[finding.range.end..].find('\n').map_or(text.len(), |newline| finding.range.end + newline);
    let touches = |habit: &&Habit| {
        let is_near = |edit: &Edit| edit.range.start <= end && edit.range.end >= start;
        habit.edits.iter().any(is_near)
    };
    let (near, far): (Vec<&Habit>, Vec<&Habit>) = habits.iter().partition(touches);
    let is_syntax = finding.code == "syntax";
    if near.is_empty() && !is_syntax {
        return Vec::new();
    }
    let mut all: Vec<Edit> = Vec::new();
    let mut found = Vec::new();
    for habit in near.into_iter().chain(far.into_iter().filter(|_| is_syntax)) {
        found.push(Fix::new(habit.title, Applies::Sure, habit.edits.clone()));
        all.extend(habit.edits.iter().cloned());
    }
    if found.len() > 1 {
        found.push(Fix::new("Write all of this as RON", Applies::Sure, apart(all)));
    }
    found
}

/// Edits that do not overlap: of two that do, the first.
pub(super) fn apart(mut edits: Vec<Edit>) -> Vec<Edit> {
    sort(&mut edits);
    let mut end = 0;
    edits.retain(|edit| {
        let fits = edit.range.start >= end;
        end = if fits { edit.range.end } else { end };
        fits
    });
    edits
}

struct Scanned<'t> {
    text: &'t str,
    pieces: Vec<Piece>,
}

impl<'t> Scanned<'t> {
    fn habits(&self) -> Vec<Habit> {
        let habit = |title, edits: Vec<Edit>| Habit { title, edits: apart(edits) };
        let each = |of: &dyn Fn(usize) -> Option<Edit>| (0..self.pieces.len()).filter_map(of).collect::<Vec<_>>();
        let habits = vec![
            habit("Remove the fence", each(&|at| self.fence(at))),
            habit("Begin comments with `//`", each(&|at| self.comment(at))),
            habit("Put texts in double quotes", each(&|at| self.single(at))),
            habit("Write `:` behind names", each(&|at| self.equals(at))),
            habit("Separate by `,`", each(&|at| self.semicolon(at))),
            habit("Put fields in round brackets", self.brackets()),
            habit("Write numbers without unit", each(&|at| self.unit(at))),
            habit("Put formulas in quotes", self.formulas()),
            habit("Leave out the type before `::`", each(&|at| self.path(at))),
            habit("Put colours in quotes", each(&|at| self.color(at))),
        ];
        habits.into_iter().filter(|habit| !habit.edits.is_empty()).collect()
    }

    fn says(&self, at: usize) -> &'t str {
        self.pieces.get(at).map_or("", |piece| &self.text[piece.range.clone()])
    }

    fn kind(&self, at: usize) -> Option<PieceKind> {
        self.pieces.get(at).map(|piece| piece.kind)
    }

    fn range(&self, at: usize) -> Range<usize> {
        self.pieces.get(at).map_or(self.text.len()..self.text.len(), |piece| piece.range.clone())
    }

    fn is_next_to(&self, before: usize, after: usize) -> bool {
        self.range(before).end == self.range(after).start
    }

    fn fence(&self, at: usize) -> Option<Edit> {
        if self.kind(at)? != PieceKind::Fence {
            return None;
        }
        let Range { start, end } = self.range(at);
        let end = self.text[end..].find('\n').map_or(self.text.len(), |newline| end + newline + 1);
        Some(Edit { range: start..end, text: String::new() })
    }

    fn comment(&self, at: usize) -> Option<Edit> {
        let start = self.range(at).start;
        (self.kind(at)? == PieceKind::Comment).then(|| Edit { range: start..start + 1, text: "//".to_owned() })
    }

    fn single(&self, at: usize) -> Option<Edit> {
        let says = self.says(at);
        let text = || format!("\"{}\"", says.trim_matches('\'').replace('"', "\\\""));
        (self.kind(at)? == PieceKind::Single).then(|| Edit { range: self.range(at), text: text() })
    }

    fn equals(&self, at: usize) -> Option<Edit> {
        let is_name = |at: usize| matches!(self.kind(at), Some(PieceKind::Word | PieceKind::Text | PieceKind::Single));
        let name = at.checked_sub(1).filter(|name| is_name(*name))?;
        if self.says(at) != "=" || self.says(at + 1) == "=" {
            return None;
        }
        let end = self.range(at + 1).start;
        let text = if self.text[self.range(at).end..end].contains('\n') { ":" } else { ": " };
        let end = if text == ":" { self.range(at).end } else { end };
        Some(Edit { range: self.range(name).end..end, text: text.to_owned() })
    }

    fn semicolon(&self, at: usize) -> Option<Edit> {
        (self.says(at) == ";").then(|| Edit { range: self.range(at), text: ",".to_owned() })
    }

    fn color(&self, at: usize) -> Option<Edit> {
        (self.kind(at)? == PieceKind::Color)
            .then(|| Edit { range: self.range(at), text: format!("\"{}\"", self.says(at)) })
    }

    fn path(&self, at: usize) -> Option<Edit> {
        let is_path = self.kind(at)? == PieceKind::Word
            && self.says(at + 1) == ":"
            && self.says(at + 2) == ":"
            && self.kind(at + 3) == Some(PieceKind::Word)
            && self.is_next_to(at + 1, at + 2);
        is_path.then(|| Edit { range: self.range(at).start..self.range(at + 3).start, text: String::new() })
    }

    fn unit(&self, at: usize) -> Option<Edit> {
        let (number, unit) = (self.range(at), self.range(at + 1));
        let blank = self.text.get(number.end..unit.start)?;
        let says = self.says(at + 1);
        let spaced = blank.len() <= 1 && !blank.contains('\n');
        if self.kind(at)? != PieceKind::Number || !(blank.is_empty() || spaced) {
            return None;
        }
        if SUFFIXES.contains(&says) && blank.is_empty() {
            return Some(Edit { range: unit, text: String::new() });
        }
        let text = in_units(self.says(at), says)?;
        Some(Edit { range: number.start..unit.end, text })
    }

    /// Formulas and references to parameters that stand without quotes.
    fn formulas(&self) -> Vec<Edit> {
        let mut edits = Vec::new();
        let mut done = 0;
        for at in 0..self.pieces.len() {
            let is_sign = self.kind(at) == Some(PieceKind::Sign) && matches!(self.says(at), "$" | "*" | "/" | "+");
            if !is_sign || at < done {
                continue;
            }
            let ends = |at: usize| matches!(self.says(at), "," | ":" | ";") || self.kind(at).is_none();
            let mut start = at;
            let mut depth = 0_usize;
            while let Some(before) = start.checked_sub(1) {
                match self.kind(before) {
                    Some(PieceKind::Close) => depth += 1,
                    Some(PieceKind::Open) if depth == 0 => break,
                    Some(PieceKind::Open) => depth -= 1,
                    Some(PieceKind::Text | PieceKind::Single | PieceKind::Comment | PieceKind::Fence) => break,
                    _ if depth == 0 && ends(before) => break,
                    _ => {}
                }
                start = before;
            }
            let mut end = at;
            while self.kind(end + 1).is_some() {
                let next = end + 1;
                let line = &self.text[self.range(end).end..self.range(next).start];
                match self.kind(next) {
                    Some(PieceKind::Open) => depth += 1,
                    Some(PieceKind::Close) if depth == 0 => break,
                    Some(PieceKind::Close) => depth -= 1,
                    Some(PieceKind::Text | PieceKind::Single | PieceKind::Comment | PieceKind::Fence) => break,
                    _ if depth == 0 && (ends(next) || line.contains('\n')) => break,
                    _ => {}
                }
                end = next;
            }
            done = end + 1;
            let range = self.range(start).start..self.range(end).end;
            let says = &self.text[range.clone()];
            let alone = self.says(start) == "$" && end == start + 1;
            let text = if alone { format!("\"{says}\"") } else { format!("\"= {says}\"") };
            edits.push(Edit { range, text });
        }
        edits
    }

    /// Braces and quoted names of fields where round brackets and plain names stand.
    fn brackets(&self) -> Vec<Edit> {
        let mut edits = Vec::new();
        // Open brackets: true if their names have no quotes, and the texts of the closing bracket.
        let mut open: Vec<(bool, Option<&str>)> = Vec::new();
        let mut skip = 0;
        for at in 0..self.pieces.len() {
            match self.kind(at) {
                Some(PieceKind::Open) if at < skip => {}
                Some(PieceKind::Open) => {
                    let (is_struct, close) = self.opened(at, &open, &mut edits, &mut skip);
                    open.push((is_struct, close));
                }
                Some(PieceKind::Close) => {
                    if let Some((_, Some(close))) = open.pop() {
                        let start = self.range(at.saturating_sub(1)).end;
                        let blank = &self.text[start..self.range(at).start];
                        let start =
                            if blank.trim().is_empty() && !blank.contains('\n') { start } else { self.range(at).start };
                        edits.push(Edit { range: start..self.range(at).end, text: close.to_owned() });
                    }
                }
                Some(PieceKind::Text | PieceKind::Single) if at >= skip && self.says(at + 1) == ":" => {
                    let name = self.says(at).trim_matches(['"', '\'']);
                    let is_field = open.last().is_some_and(|(is_struct, _)| *is_struct);
                    if is_field && is_plain(name) {
                        edits.push(Edit { range: self.range(at), text: name.to_owned() });
                    }
                }
                _ => {}
            }
        }
        edits
    }

    /// Edits at an opening bracket. Returns whether fields follow, and the text of its closing bracket.
    fn opened(
        &self,
        at: usize,
        open: &[(bool, Option<&str>)],
        edits: &mut Vec<Edit>,
        skip: &mut usize,
    ) -> (bool, Option<&'static str>) {
        if self.says(at) != "{" {
            return (self.says(at) == "(", None);
        }
        let to = |end: usize, text: String| {
            let blank = &self.text[self.range(end - 1).end..self.range(end).start];
            let end = if blank.contains('\n') || !blank.trim().is_empty() {
                self.range(end - 1).end
            } else {
                self.range(end).start
            };
            Edit { range: self.range(at).start..end, text }
        };
        let name = |at: usize| self.says(at).trim_matches(['"', '\'']);
        let is_kind = |word: &str| is_plain(word) && word.starts_with(|c: char| c.is_ascii_uppercase());
        let key = at.checked_sub(2).map_or("", name);
        // `{ "type": "Perlin", … }`
        let is_whole = !["(", "{"].contains(&self.says(at + 4));
        if TYPES.contains(&name(at + 1)) && self.says(at + 2) == ":" && is_kind(name(at + 3)) && is_whole {
            let comma = usize::from(self.says(at + 4) == ",");
            *skip = at + 4 + comma;
            edits.push(to(*skip, format!("{}(", name(at + 3))));
            return (true, Some(")"));
        }
        let before = at.checked_sub(1);
        let called =
            before.is_some_and(|before| self.kind(before) == Some(PieceKind::Word) && is_kind(self.says(before)));
        let is_struct = called || open.is_empty() || (STRUCTS.contains(&key) && self.says(at - 1) == ":");
        if is_struct {
            let start = before.filter(|_| called).map_or(self.range(at).start, |before| self.range(before).end);
            let edit = to(at + 1, "(".to_owned());
            edits.push(Edit { range: start..edit.range.end, ..edit });
        }
        (is_struct, is_struct.then_some(")"))
    }
}

fn is_plain(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c == '_' || c.is_ascii_alphanumeric())
}

/// A number with a unit, in the units of graphs: mm, degrees, and shares from 0 to 1.
pub(super) fn in_units(number: &str, unit: &str) -> Option<String> {
    let value: f64 = number.trim().replace('_', "").parse().ok()?;
    let factor = match unit.trim() {
        "mm" | "deg" | "°" | "px" | "degrees" | "degree" => return Some(number.trim().to_owned()),
        "cm" => 10.0,
        "m" => 1000.0,
        "um" | "µm" | "μm" => 0.001,
        "in" | "inch" => 25.4,
        "rad" => 180.0 / std::f64::consts::PI,
        "%" => 0.01,
        _ => return None,
    };
    let scaled = (value * factor * 1e9).round() / 1e9;
    scaled.is_finite().then(|| format!("{scaled}"))
}

#[cfg(test)]
mod tests {
    use super::super::super::rename::apply;
    use super::*;

    fn rewritten(text: &str) -> String {
        let edits = Scanned { text, pieces: pieces(text) }.habits().into_iter().flat_map(|habit| habit.edits);
        apply(text, &apart(edits.collect()))
    }

    #[test]
    fn writes_other_notations_as_ron() {
        for (foreign, expected) in [
            ("(a: Perlin { size: 3 })", "(a: Perlin(size: 3))"),
            ("{ \"canvas\": { \"seed\": 3 } }", "(canvas: (seed: 3))"),
            ("(n: { \"a\": { \"type\": \"Perlin\", \"size\": 3 } })", "(n: { \"a\": Perlin(size: 3) })"),
            ("(a: B(\"size\": 3, s = 2; t='x'))", "(a: B(size: 3, s: 2, t: \"x\"))"),
            ("(a: 2mm, b: 0.2cm, c: 30%, d: 25°, e: 1.5f32)", "(a: 2, b: 2, c: 0.3, d: 25, e: 1.5)"),
            ("(a: $pitch * (2 + x), b: $q, c: \"$r\")", "(a: \"= $pitch * (2 + x)\", b: \"$q\", c: \"$r\")"),
            ("(a: Tile::Both, b: #ff8000)\n# c\n", "(a: Both, b: \"#ff8000\")\n// c\n"),
            ("```ron\n(a: 1)\n```\n", "(a: 1)\n"),
            ("(p: { \"kind\": Integer(default: 1) })", "(p: { \"kind\": Integer(default: 1) })"),
        ] {
            assert_eq!(rewritten(foreign), expected);
        }
    }

    #[test]
    fn leaves_graphs_alone() {
        for graph in shibo_library::graphs() {
            assert_eq!(rewritten(graph.text), graph.text, "{}", graph.path);
        }
    }
}
