//! Shapes of values in syntax trees, and their canonical texts: equal exactly for values that differ only in comments, layout and
//! the order of named things.
use shibo_graph::syntax::{Node, NodeKind, formula, is_infinity, number};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// A value with named things: a section, a node with fields, a struct.
pub(crate) struct Fields<'t> {
    /// The word before the brackets, if there is one.
    pub(crate) word: Option<&'t str>,
    /// The brackets.
    pub(crate) body: Node<'t>,
    /// The things, in the order of the text.
    pub(crate) entries: Vec<Field<'t>>,
    /// The places of the things by their names.
    places: BTreeMap<String, usize>,
}

/// A named thing.
#[derive(Clone)]
pub(crate) struct Field<'t> {
    /// Its name.
    pub(crate) name: String,
    /// Name and value.
    pub(crate) entry: Node<'t>,
    /// The value.
    pub(crate) value: Node<'t>,
}

impl<'t> Fields<'t> {
    /// The named things of a value; `None` for other values, where two things have one name, and where a part is unreadable.
    pub(crate) fn of(value: Node<'t>) -> Option<Self> {
        let fields = Self::readable(value)?;
        (fields.entries.len() == fields.body.children().count()).then_some(fields)
    }

    /// The named things of a value, as far as they can be read; the first of equal names. `None` for other values.
    pub(crate) fn readable(value: Node<'t>) -> Option<Self> {
        let body = value.body().unwrap_or(value);
        let brackets = matches!(body.kind(), NodeKind::Parens | NodeKind::Map);
        if !brackets || body.entries().next().is_none() && body.children().next().is_some() {
            return None;
        }
        let (mut places, mut entries) = (BTreeMap::new(), Vec::new());
        for entry in body.entries() {
            let (Some(name), Some(value)) = (entry.key_text(), entry.value()) else { continue };
            if let Entry::Vacant(place) = places.entry(name.clone()) {
                place.insert(entries.len());
                entries.push(Field { name, entry, value });
            }
        }
        Some(Self { word: value.name(), body, entries, places })
    }

    /// Returns true if both have the same word and brackets, so that they differ in their things alone.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.word == other.word && self.body.kind() == other.body.kind()
    }

    /// The place of the thing of this name.
    pub(crate) fn place(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    /// The thing of this name.
    pub(crate) fn get(&self, name: &str) -> Option<&Field<'t>> {
        self.place(name).and_then(|place| self.entries.get(place))
    }
}

/// The elements of a list.
pub(crate) fn elements(value: Node<'_>) -> Option<Vec<Node<'_>>> {
    (value.kind() == NodeKind::List).then(|| value.children().collect())
}

/// The canonical text of a value.
pub(crate) fn canonical(value: Node<'_>) -> String {
    let mut out = String::new();
    write(value, &mut out);
    out
}

fn write(value: Node<'_>, out: &mut String) {
    match value.kind() {
        NodeKind::Call => {
            out.push_str(value.name().unwrap_or_default());
            value.body().into_iter().for_each(|body| write(body, out));
        }
        NodeKind::Parens | NodeKind::Map | NodeKind::List => {
            let (open, close) = match value.kind() {
                NodeKind::Parens => ('(', ')'),
                NodeKind::Map => ('{', '}'),
                _ => ('[', ']'),
            };
            let mut items: Vec<String> = value.children().map(canonical).collect();
            // Values that follow each other have an order, named ones have none.
            if value.entries().next().is_some() {
                items.sort();
            }
            out.push(open);
            out.push_str(&items.join(","));
            out.push(close);
        }
        NodeKind::Entry => {
            let key = value.key_text().unwrap_or_default();
            *out += &format!("{key:?}:");
            value.value().into_iter().for_each(|value| write(value, out));
        }
        NodeKind::Text => match value.string() {
            Some(text) => *out += &plain(&text),
            None => *out += value.text(),
        },
        NodeKind::Number => *out += &number_text(value.text()),
        _ => {
            let text = |token: &shibo_graph::syntax::Token| value.tree().text()[token.range()].to_owned();
            *out += &value.tokens().iter().map(text).collect::<Vec<_>>().join(" ");
        }
    }
}

/// The text of a string, without the layout of a formula and with plain line breaks.
fn plain(text: &str) -> String {
    match formula::begins(text) {
        Some(start) => {
            let formula = &text[start..];
            let words = formula::words(formula);
            let words: Vec<&str> = words.iter().map(|word| &formula[word.range.clone()]).collect();
            format!("{:?}", format!("={}", words.join(" ")))
        }
        None => format!("{:?}", text.replace("\r\n", "\n")),
    }
}

/// The text of a number: `1`, `1.0` and `1e0` are equal.
fn number_text(text: &str) -> String {
    if let Ok(integer) = text.trim_start_matches('+').replace('_', "").parse::<i128>() {
        return integer.to_string();
    }
    match number(text) {
        Some(value) if is_infinity(text) || !value.is_finite() => text.to_owned(),
        Some(value) => format!("{value}"),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_graph::syntax::Tree;

    fn of(text: &str) -> String {
        canonical(Tree::parse(text).value().unwrap())
    }

    #[test]
    fn ignores_comments_layout_and_order() {
        let one = "( a: 1.0, /* x */ b: [1, 2],\n c: \"= a*$b\" , d: { \"x\": \"y\" }) // end";
        let other = "(c: r#\"= a\n   * $b\"#, d: {\"x\": \"y\",}, b: [1, 2,], a: 1)";
        assert_eq!(of(one), of(other));
        for changed in [
            "[2, 1]",
            "\"= a * $bc\"",
            "\"a * $b\"",
            "(1, 2)",
            "A(1, 2)",
            "{\"x\": \"y\"}",
            "(x: \"y\")",
            "-0.5",
            "inf",
        ] {
            for against in ["[1, 2]", "\"= a * $b\"", "\"a*$b\"", "\"[1,2]\"", "(x: y)", "0.5", "\"= ab * $c\""] {
                assert_ne!(of(changed), of(against), "{changed} {against}");
            }
        }
        assert_ne!(of("18446744073709551615"), of("18446744073709551614"));
    }

    #[test]
    fn finds_named_things() {
        let tree = Tree::parse("(nodes: { \"a\": Blur(input: \"b\", radius: 2), \"t\": (1, 2) })");
        let top = Fields::of(tree.value().unwrap()).unwrap();
        let nodes = Fields::of(top.get("nodes").unwrap().value).unwrap();
        assert_eq!(nodes.entries.len(), 2);
        let blur = Fields::of(nodes.entries[0].value).unwrap();
        assert_eq!((blur.word, blur.entries[1].name.as_str()), (Some("Blur"), "radius"));
        assert!(Fields::of(nodes.entries[1].value).is_none());
        assert!(Fields::of(Tree::parse("(a: 1, a: 2)").value().unwrap()).is_none());
    }
}
