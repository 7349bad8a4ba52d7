//! Values in the texts of nodes that a page has set: they are tried without a change of the text, and written later.
use super::{numbers, wiring};
use serde::{Deserialize, Serialize};
use shibo_graph::{Graph, Loaded};
use shibo_ide::Cx;
use shibo_ide::actions::{alike, apply, promote};
use shibo_ide::format::keep_layout;
use shibo_ide::rename::Edit;
use std::borrow::Cow;
use std::ops::Range;

/// The most edits that a page can hold.
const MOST: usize = 1000;

/// A value in the text of a node.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldEdit {
    /// The node.
    pub node: String,
    /// The field; empty for a node that is a formula.
    pub field: String,
    /// The number of a formula, counted from 0; without it, the whole value.
    #[serde(default)]
    pub index: Option<usize>,
    /// The new value, as RON.
    pub value: String,
}

impl FieldEdit {
    /// The bytes of the old value in the text from which `graph` was loaded.
    ///
    /// # Errors
    /// The reason why the value cannot be set there.
    pub fn place(&self, graph: &Graph) -> Result<Range<usize>, String> {
        let Self { node, field, index, value } = self;
        let found = graph.nodes.node_weights().find(|found| found.name == *node);
        let found = found.ok_or_else(|| format!("there is no node `{node}`"))?;
        let span = wiring::place(found, &graph.sources, field).ok_or_else(|| format!("`{node}` has no `{field}`"))?;
        if graph.sources.path(span.file) != graph.path {
            return Err(format!("`{node}` belongs to another file"));
        }
        let Some(index) = *index else {
            return if is_literal(value) {
                Ok(span.start..span.end)
            } else {
                Err(format!("`{value}` is no number, switch, word or colour"))
            };
        };
        let text = graph.sources.text(span.file);
        let literal = text.get(span.start..span.end).unwrap_or_default();
        let number = numbers::places(literal).into_iter().nth(index).filter(|_| numbers::is_plain(value));
        let number =
            number.ok_or_else(|| format!("`{value}` cannot replace number {index} of the formula of `{node}`"))?;
        Ok(span.start + number.start..span.start + number.end)
    }
}

/// Returns true for the text of one number, switch, word or colour.
fn is_literal(value: &str) -> bool {
    let inside = value.strip_prefix("\"#").and_then(|rest| rest.strip_suffix('"')).unwrap_or(value);
    !inside.is_empty() && inside.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_.+-".contains(&byte))
}

/// Puts edits of a page into the text from which `base` was loaded; also returns the edits that do not fit it, with reasons. `load` loads
/// a text in place of that one.
pub fn tried<'t>(
    text: &'t str,
    base: &Graph,
    edits: &[FieldEdit],
    load: &dyn Fn(&str) -> Loaded,
) -> (Cow<'t, str>, Vec<(FieldEdit, String)>) {
    if edits.is_empty() {
        return (text.into(), Vec::new());
    }
    let (mut places, mut refused) = (Vec::new(), Vec::new());
    for edit in edits.iter().take(MOST) {
        match edit.place(base) {
            Ok(range) => places.push((edit, Edit { range, text: edit.value.clone() })),
            Err(why) => refused.push((edit.clone(), why)),
        }
    }
    // If the graph does not accept the edits, the one at the place of the error gives way, or else the newest one.
    loop {
        let edits = sorted(places.iter().map(|(_, edit)| edit.clone()).collect());
        let text = apply(text, &edits);
        let loaded = load(&text);
        let Some(error) = loaded.diagnostics.iter().find(|found| !found.warning) else { return (text.into(), refused) };
        let own = loaded.sources.path(error.span.file) == base.path;
        let range = if own { at_fault(&edits, error.span.start..error.span.end) } else { None };
        let index = places.iter().rposition(|(_, edit)| range.as_ref().is_none_or(|range| edit.range == *range));
        let Some(index) = index else { return (text.into(), refused) };
        let (edit, _) = places.remove(index);
        refused.push((edit.clone(), error.message.clone()));
    }
}

/// The place in the old text of the edit that an error in the new text lies in. The edits are in the order of the text.
fn at_fault(edits: &[Edit], error: Range<usize>) -> Option<Range<usize>> {
    let (mut longer, mut shorter) = (0, 0);
    for edit in edits {
        let start = edit.range.start + longer - shorter;
        if error.start <= start + edit.text.len() && start <= error.end {
            return Some(edit.range.clone());
        }
        longer += edit.text.len();
        shorter += edit.range.len();
    }
    None
}

/// Edits in the order of the text; of several edits of one place the last one counts.
fn sorted(edits: Vec<Edit>) -> Vec<Edit> {
    let mut kept: Vec<Edit> = Vec::with_capacity(edits.len());
    for edit in edits {
        kept.retain(|other| other.range.end <= edit.range.start || edit.range.end <= other.range.start);
        kept.push(edit);
    }
    kept.sort_by_key(|edit| edit.range.start);
    kept
}

/// The changes of a text that write values of nodes, each in the notation of the old value. `graph` was loaded from the text.
///
/// # Errors
/// The reason why a value cannot be set.
pub fn written(cx: Cx<'_>, graph: &Graph, edits: &[FieldEdit]) -> Result<Vec<Edit>, String> {
    let edit = |edit: &FieldEdit| {
        let range = edit.place(graph)?;
        let text = alike(cx, &range, &edit.value);
        Ok(Edit { range, text })
    };
    Ok(sorted(edits.iter().map(edit).collect::<Result<_, String>>()?))
}

/// The changes of a text that make a parameter of a value of a node. `graph` was loaded from the text.
///
/// # Errors
/// The reason why it cannot be a parameter.
pub fn promoted(cx: Cx<'_>, graph: &Graph, node: &str, field: &str) -> Result<Vec<Edit>, String> {
    let edit = FieldEdit { node: node.to_owned(), field: field.to_owned(), index: None, value: "0".to_owned() };
    promote(cx, edit.place(graph)?.start)
        .ok_or_else(|| format!("`{field}` of `{node}` is no plain number, switch or colour in the file"))
}

/// The text after changes. Everything outside the changed ranges stays as it is. Inserted lines use the line ending of the text, and a
/// text in the usual layout keeps it.
pub fn changed(before: &str, edits: Vec<Edit>) -> String {
    let ends = |edit: Edit| Edit { text: edit.text.replace('\n', "\r\n"), ..edit };
    let edits: Vec<Edit> = if before.contains("\r\n") { edits.into_iter().map(ends).collect() } else { edits };
    keep_layout(before, apply(before, &edits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_graph::{LoadOptions, load_text};
    use std::path::Path;

    const TEXT: &str = r##"(
  canvas: (size_mm: 8, resolution: 64),
  nodes: {
    "noise": Perlin(size: 2, seed: 1),
    "out": Remap(input: "= noise * 2 + 1", from: (0, 1), to: (0, 1), clamp: true),
    "sum": "= noise + 0.5",
  },
  outputs: { "out": "out" },
)"##;

    fn edit(node: &str, field: &str, index: Option<usize>, value: &str) -> FieldEdit {
        FieldEdit { node: node.into(), field: field.into(), index, value: value.into() }
    }

    fn tried_with(edits: Vec<FieldEdit>) -> (String, Vec<String>) {
        let registry = shibo_library::registry();
        let load = |text: &str| load_text(Path::new("a.ron"), text, &registry, &LoadOptions::default());
        let base = load(TEXT).graph.unwrap();
        let (text, refused) = tried(TEXT, &base, &edits, &load);
        (text.into_owned(), refused.into_iter().map(|(edit, _)| edit.node).collect())
    }

    #[test]
    fn puts_values_into_the_text() {
        let edits = vec![
            edit("out", "clamp", None, "false"),
            edit("noise", "size", None, "3.5"),
            edit("out", "input", Some(1), "4"),
            edit("sum", "", Some(0), "0.7"),
            edit("noise", "size", None, "2.5"),
        ];
        let wanted = TEXT.replace("size: 2,", "size: 2.5,").replace("* 2 + 1", "* 2 + 4").replace("+ 0.5", "+ 0.7");
        assert_eq!(tried_with(edits), (wanted.replace("clamp: true", "clamp: false"), Vec::new()));
    }

    #[test]
    fn refuses_values_that_do_not_fit() {
        let wrong = ["1), b: (", "", "\"x\"", "1,2", "\"#80\"4\""];
        for value in wrong {
            assert_eq!(
                tried_with(vec![edit("noise", "size", None, value)]),
                (TEXT.into(), vec!["noise".into()]),
                "{value}"
            );
        }
        // The graph refuses the second value; the others stay.
        let edits = vec![
            edit("noise", "size", None, "-3"),
            edit("noise", "seed", None, "9"),
            edit("gone", "size", None, "1"),
            edit("sum", "", Some(0), "0.75"),
        ];
        let (text, mut refused) = tried_with(edits);
        refused.sort();
        let wanted = TEXT.replace("seed: 1", "seed: 9").replace("+ 0.5", "+ 0.75");
        assert_eq!((text, refused), (wanted, vec!["gone".to_owned(), "noise".to_owned()]));
    }

    #[test]
    fn inserted_lines_end_as_those_of_the_text() {
        let edit = || vec![Edit { range: 1..1, text: "b\n".to_owned() }];
        assert_eq!(changed("a\r\nc\r\n", edit()), "ab\r\n\r\nc\r\n");
        assert_eq!(changed("a\nc\n", edit()), "ab\n\nc\n");
    }
}
