//! Completion in expressions: functions, parameters, and names of formulas.
use super::super::expect::Expect;
use super::super::file::Section;
use super::{Ask, Completion, Sort, Topic};
use shibo_value::expression::described;
use std::ops::Range;

/// Facts of the canvas that an expression may read.
const CANVAS: [(&str, &str); 3] = [
    ("canvas.width", "The width of the canvas in mm."),
    ("canvas.height", "The height of the canvas in mm."),
    ("canvas.seed", "The seed of the canvas."),
];
/// Names of coordinates in a formula.
const PLACES: [(&str, &str); 4] = [
    ("x", "The position in mm, to the right."),
    ("y", "The position in mm, down."),
    ("u", "From 0 to 1 across the canvas."),
    ("v", "From 0 to 1 down the canvas."),
];

impl<'a> Ask<'a> {
    /// Names allowed in an expression; a node's formula may also use its ports and the position.
    pub(super) fn formula(&mut self, expect: Expect<'a>, of_node: bool, inside: Range<usize>) -> Vec<Completion> {
        let text = &self.cx.file.text;
        let before = text.get(inside.start..self.at).unwrap_or_default();
        let part = |c: char| c == '_' || c == '.' || c == '$' || c.is_ascii_alphanumeric();
        let start =
            before.rfind(|c: char| !part(c)).map_or(0, |i| i + before[i..].chars().next().map_or(1, char::len_utf8));
        self.replace = inside.start + start..self.word_end(inside.end);
        self.quoted = true;
        if before[start..].starts_with('$') && before[start..].contains('.') {
            return self.components(&before[start..]);
        }
        let mut found: Vec<Completion> = self.params(Expect::Canvas(Some("")));
        for one in &mut found {
            one.score -= 1.0;
        }
        for one in described() {
            let offer = self.offer(one.name, Sort::Function, one.call, Topic::Text(one.doc.to_owned()), 6.0);
            let takes = one.call.ends_with(')') && !text[self.replace.end..].starts_with('(');
            let insert = if takes { format!("{}($0)", one.name) } else { one.name.to_owned() };
            found.push(Completion { insert, snippet: takes, ..offer });
        }
        let name =
            |(name, doc): (&str, &str), score| self.offer(name, Sort::Value, doc, Topic::Text(doc.to_owned()), score);
        found.extend(CANVAS.map(|one| name(one, 7.0)));
        if of_node {
            found.extend(PLACES.map(|one| name(one, 5.0)));
            let ports = self.trail.node().map_or(&[][..], |level| &level.body.items[..]);
            let ports = ports.iter().filter_map(|item| item.name()).filter(|name| name.len() == 1);
            found.extend(ports.map(|port| name((port, "a field of this node"), 1.0)));
        } else if let Expect::Value(_, param) = expect {
            let words = param.choices.iter().map(|choice| (choice.name.as_str(), choice.doc.as_str()));
            found.extend(words.map(|one| name(one, 8.0)));
        }
        found
    }

    /// Components of a colour.
    fn components(&self, typed: &str) -> Vec<Completion> {
        let name = typed.trim_start_matches('$').split('.').next().unwrap_or_default();
        let head = self.cx.file.entry(Section::Params, name).and_then(|item| self.cx.file.head(item));
        if head != Some("Color") {
            return Vec::new();
        }
        let offer =
            |c: &str| self.offer(&format!("${name}.{c}"), Sort::Value, "a component", Topic::Text(String::new()), 0.0);
        ["r", "g", "b"].map(offer).into()
    }
}
