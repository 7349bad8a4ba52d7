//! Formulas in a file: where they stand, and the types of their parts.
mod infer;
mod put;

pub(crate) use infer::{Inferred, Resolve, Space, infer};
pub(crate) use put::put;

use super::expect::Expect;
use super::file::{Section, head_name};
use super::functions::Head;
use super::view::{Item, Value, plain};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_graph::syntax::formula::{Formula, WordKind, begins};
use std::ops::Range;

/// The use of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role<'a> {
    /// It is computed for every point, and may read nodes.
    Point,
    /// It is one value for the whole picture.
    Value,
    /// It is the body of the function of this name.
    Function(&'a str),
}

/// A formula in a file.
#[derive(Clone, Debug)]
pub(crate) struct FormulaText<'a> {
    /// The content of the literal.
    pub content: &'a str,
    /// The first byte of the formula in this content: after the equals sign.
    pub begin: usize,
    /// Bytes of the literal in the file.
    pub literal: Range<usize>,
    /// Place of the content in the file; `None` for a literal with escapes.
    pub place: Option<Range<usize>>,
    /// Its use.
    pub role: Role<'a>,
}

impl<'a> FormulaText<'a> {
    /// The formula in a value, if there is one.
    pub(crate) fn of(cx: Cx<'a>, expect: Expect<'a>, value: &'a Value) -> Option<Self> {
        let content = value.text()?;
        let begin = begins(content);
        let (role, begin) = match expect {
            Expect::Note => return None,
            Expect::Entry(Section::Functions, head) => (Role::Function(head_name(head)), begin.unwrap_or(0)),
            Expect::Entry(Section::Imports, _) | Expect::Use(_, _, Some("graph")) => return None,
            _ => (if is_point(cx, expect) { Role::Point } else { Role::Value }, begin?),
        };
        let place = plain(&cx.file.text, &value.range, content);
        Some(Self { content, begin, literal: value.range.clone(), place, role })
    }

    /// The formula without the equals sign.
    pub(crate) fn says(&self) -> &'a str {
        &self.content[self.begin..]
    }

    /// The values of the function, if it is the body of one.
    pub(crate) fn values(&self, cx: Cx<'a>) -> Vec<&'a str> {
        let Role::Function(name) = self.role else { return Vec::new() };
        let head = cx.file.entry(Section::Functions, name).and_then(|item| item.name()).unwrap_or_default();
        Head::of(head).params.into_iter().map(|range| &head[range]).collect()
    }

    /// Its parts.
    pub(crate) fn parse(&self) -> Formula {
        Formula::parse(self.says())
    }

    /// The offset in the formula of a position in the file.
    pub(crate) fn offset(&self, at: usize) -> Option<usize> {
        let place = self.place.as_ref()?;
        let offset = at.checked_sub(place.start + self.begin)?;
        self.says().is_char_boundary(offset).then_some(offset)
    }

    /// Bytes in the file of a part of the formula.
    pub(crate) fn in_file(&self, part: &Range<usize>) -> Option<Range<usize>> {
        let start = self.place.as_ref()?.start + self.begin;
        Some(start + part.start..start + part.end)
    }
}

/// The text of a part that stands by itself: with the definitions of the local names that it uses.
pub(crate) fn alone(formula: &Formula, part: usize) -> String {
    let Some(range) = formula.parts().get(part).map(|part| part.range.clone()) else { return String::new() };
    let mut needed = vec![false; formula.locals().len()];
    let mut queue = vec![range.clone()];
    while let Some(range) = queue.pop() {
        let first = formula.words().partition_point(|word| word.range.start < range.start);
        let words = formula.words()[first..].iter().take_while(|word| word.range.end <= range.end);
        for word in words.filter(|word| word.kind == WordKind::Name) {
            let name = formula.at(&word.range).split('.').next().unwrap_or_default();
            let index =
                formula.locals().iter().rposition(|l| formula.at(&l.range) == name && l.from <= word.range.start);
            if let Some(index) = index.filter(|index| !needed[*index]) {
                needed[index] = true;
                queue.push(formula.parts()[formula.locals()[index].value].range.clone());
            }
        }
    }
    let locals = formula.locals().iter().zip(needed).filter(|(_, needed)| *needed);
    let definitions = locals.map(|(local, _)| {
        let value = formula.at(&formula.parts()[local.value].range);
        format!("let {} = {value}; ", formula.at(&local.range))
    });
    let definitions: String = definitions.collect();
    definitions + formula.at(&range)
}

/// The literal of a formula without mistakes.
pub(crate) fn literal(formula: &str) -> String {
    if formula.contains('\n') { format!("r#\"= {formula}\"#") } else { format!("\"= {formula}\"") }
}

/// Names in a formula that nothing in the formula defines, without the parts after their dots.
pub(crate) fn free_names<'f>(formula: &'f Formula, values: &[&str]) -> Vec<&'f str> {
    let names = formula.words().iter().enumerate().filter_map(|(index, word)| {
        let first = formula.word(index).split('.').next()?;
        let is_name = word.kind == WordKind::Name && !formula.is_call(index) && first != "let";
        let free = formula.local(first, word.range.start).is_none() && !values.contains(&first);
        (is_name && free).then_some(first)
    });
    names.collect()
}

/// Names that a formula defines.
pub(crate) fn local_names(formula: &Formula) -> impl Iterator<Item = &str> {
    formula.locals().iter().map(|local| formula.at(&local.range))
}

/// All formulas of a graph, and their parts; those of functions only in the whole file.
pub(crate) fn formulas<'a>(cx: Cx<'a>) -> Vec<(FormulaText<'a>, Formula)> {
    struct Found<'a>(Cx<'a>, Vec<(FormulaText<'a>, Formula)>);
    impl<'a> Visit<'a> for Found<'a> {
        fn key(&mut self, _inside: Expect<'a>, _item: &'a Item) {}

        fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
            if let Some(text) = FormulaText::of(self.0, expect, value) {
                let formula = text.parse();
                self.1.push((text, formula));
            }
        }
    }
    let mut found = Found(cx, Vec::new());
    walk(cx, &mut found);
    found.1
}

/// Returns whether a formula in this place may read nodes.
fn is_point(cx: Cx<'_>, expect: Expect<'_>) -> bool {
    match expect {
        Expect::With(import, Some(name)) => {
            cx.imported(import).is_none_or(|file| file.entry(Section::Params, name).is_none())
        }
        Expect::Any => true,
        _ => expect.takes_nodes() || expect.reference(cx).is_some(),
    }
}

/// The names of positions, with their manuals.
pub(crate) const PLACES: [(&str, &str); 7] = [
    ("x", "The position in mm, to the right."),
    ("y", "The position in mm, down."),
    ("u", "From 0 to 1 across the canvas."),
    ("v", "From 0 to 1 down the canvas."),
    ("point.x", "The position in space in mm. The result is a solid."),
    ("point.y", "The position in space in mm. The result is a solid."),
    ("point.z", "The position in space in mm. The result is a solid."),
];

/// The facts of the canvas, with their manuals.
pub(crate) const CANVAS: [(&str, &str); 3] = [
    ("canvas.width", "The width of the canvas in mm."),
    ("canvas.height", "The height of the canvas in mm."),
    ("canvas.seed", "The seed of the canvas."),
];

/// Words that a node would hide if it had this name.
pub(crate) const HIDDEN: [&str; 7] = ["u", "v", "x", "y", "point", "canvas", "pi"];

/// Manual of a position or a fact of the canvas.
pub(crate) fn manual(name: &str) -> Option<&'static str> {
    PLACES.iter().chain(&CANVAS).find(|(known, _)| *known == name).map(|(_, doc)| *doc)
}
