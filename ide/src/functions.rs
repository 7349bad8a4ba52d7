//! Functions that graphs define, and those of the language.
use super::file::{File, Section, head_name};
use super::view::{Item, plain};
use super::world::Cx;
use shibo_graph::syntax::formula::{self, Formula};
use shibo_value::expression::{UserFunction, described};
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

/// The head of a function, `ridge(x, w)`, as bytes of its text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    /// The name.
    pub name: Range<usize>,
    /// The values.
    pub params: Vec<Range<usize>>,
}

impl Head {
    /// Reads a head; the closing bracket may be missing.
    pub(crate) fn of(text: &str) -> Self {
        let trimmed = |range: Range<usize>| {
            let part = &text[range.clone()];
            let start = range.start + part.len() - part.trim_start().len();
            start..start + part.trim().len()
        };
        let Some(open) = text.find('(') else { return Self { name: trimmed(0..text.len()), params: Vec::new() } };
        let end = text.rfind(')').filter(|end| *end > open).unwrap_or(text.len());
        let mut start = open + 1;
        let params = text[start..end].split(',').map(|part| {
            let range = start..start + part.len();
            start = range.end + 1;
            trimmed(range)
        });
        let params = params.filter(|range| !range.is_empty()).collect();
        Self { name: trimmed(0..open), params }
    }
}

/// A function.
#[derive(Clone, Debug)]
pub(crate) struct Function {
    /// The name, as it is called.
    pub name: String,
    /// The call with the names of its values.
    pub call: String,
    /// The manual.
    pub doc: String,
    /// The file that defines it, and its entry there; `None` for a function of the language.
    pub place: Option<(Arc<File>, usize)>,
}

impl Function {
    fn of(file: &Arc<File>, index: usize, import: &str) -> Option<Self> {
        let head = file.entries(Section::Functions).get(index)?.name()?;
        let prefix = if import.is_empty() { String::new() } else { format!("{import}.") };
        Some(Self {
            name: format!("{prefix}{}", head_name(head)),
            call: format!("{prefix}{head}"),
            doc: comment_above(file, &file.entries(Section::Functions)[index]),
            place: Some((file.clone(), index)),
        })
    }

    /// Its entry.
    pub(crate) fn item(&self) -> Option<(&File, &Item)> {
        let (file, index) = self.place.as_ref()?;
        Some((file, file.entries(Section::Functions).get(*index)?))
    }

    /// It as the compiler of formulas takes it.
    pub(crate) fn compiled(&self) -> Option<UserFunction> {
        let (_, item) = self.item()?;
        let (head, text) = (item.name()?, item.value.as_ref()?.text()?);
        let params = Head::of(head).params.into_iter().map(|range| head[range].to_owned()).collect();
        let body = text[formula::begins(text).unwrap_or(0)..].to_owned();
        Some(UserFunction { name: self.name.clone(), params, body })
    }
}

/// The function of a graph that is called `name` or `import.name`.
pub(crate) fn find(cx: Cx<'_>, name: &str) -> Option<Function> {
    let (import, inner) = name.split_once('.').unwrap_or(("", name));
    let file = if import.is_empty() { Arc::new(cx.file.whole()) } else { imported(cx, import)? };
    Function::of(&file, file.position(Section::Functions, inner)?, import)
}

/// The file of an import.
fn imported(cx: Cx<'_>, import: &str) -> Option<Arc<File>> {
    cx.world.file(&cx.import_path(import)?)
}

/// The functions that a call may mean: those of the language, which differ in their values, or one of a graph.
pub(crate) fn called(cx: Cx<'_>, name: &str) -> Vec<Function> {
    let own = of_language().filter(|function| function.name == name);
    let found: Vec<Function> = own.collect();
    if found.is_empty() { find(cx, name).into_iter().collect() } else { found }
}

/// All functions of graphs that a formula may call: those of the file, then those of its imports.
pub(crate) fn of_graphs(cx: Cx<'_>) -> Vec<Function> {
    let own = Arc::new(cx.file.whole());
    let all = |file: &Arc<File>, import: &str| -> Vec<Function> {
        (0..file.entries(Section::Functions).len()).filter_map(|index| Function::of(file, index, import)).collect()
    };
    let mut found = all(&own, "");
    for import in cx.file.names(Section::Imports) {
        found.extend(imported(cx, import).iter().flat_map(|file| all(file, import)));
    }
    found
}

/// Indices of the file's functions of these names, and of those that they call, directly or not.
pub(crate) fn called_by(cx: Cx<'_>, names: Vec<String>) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut queue = names;
    while let Some(name) = queue.pop() {
        let Some(index) = cx.file.position(Section::Functions, &name) else { continue };
        let body = cx.file.entries(Section::Functions)[index].value.as_ref().and_then(|value| value.text());
        if let Some(body) = body.filter(|_| found.insert(index)) {
            let formula = Formula::parse(body);
            let calls = (0..formula.words().len()).filter(|word| formula.is_call(*word));
            queue.extend(calls.map(|word| formula.word(word).to_owned()));
        }
    }
    found
}

/// The functions and constants of the language.
pub(crate) fn of_language() -> impl Iterator<Item = Function> {
    described().iter().map(|one| Function {
        name: one.name.to_owned(),
        call: one.call.to_owned(),
        doc: one.doc.to_owned(),
        place: None,
    })
}

/// Returns true for a function or a constant of the language.
pub(crate) fn is_of_language(name: &str) -> bool {
    described().iter().any(|one| one.name == name)
}

/// Bytes in the file of the name in a function's head, or of one of its values.
pub(crate) fn in_head(file: &File, item: &Item, part: &Range<usize>) -> Option<Range<usize>> {
    let key = item.key.as_ref()?;
    let inside = plain(&file.text, &key.range, &key.name)?;
    Some(inside.start + part.start..inside.start + part.end)
}

/// The comment on the lines directly above an entry.
pub(crate) fn comment_above(file: &File, item: &Item) -> String {
    let above = file.text.get(..item.range.start).unwrap_or_default();
    let above = &above[..above.rfind('\n').map_or(0, |at| at + 1)];
    let lines = above.lines().rev().map_while(|line| line.trim_start().strip_prefix("//"));
    let mut lines: Vec<&str> = lines.map(str::trim).collect();
    lines.reverse();
    lines.join(" ")
}

#[cfg(test)]
mod tests {
    use super::Head;

    #[test]
    fn reads_heads_of_functions() {
        let read = |text: &str| {
            let head = Head::of(text);
            let params: Vec<&str> = head.params.iter().map(|range| &text[range.clone()]).collect();
            format!("{}/{}", &text[head.name], params.join("/"))
        };
        assert_eq!(read("ridge(x, w)"), "ridge/x/w");
        assert_eq!(read(" one ( t )"), "one/t");
        assert_eq!(read("half(a,"), "half/a");
        assert_eq!(read("none"), "none/");
        assert_eq!(read("é)("), "é)/");
    }
}
