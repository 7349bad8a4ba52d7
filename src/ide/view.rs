//! The values of a graph file with their places, for any text: what is missing or broken costs the smallest part of it.
use shibo_engine::syntax::{MAX_NESTING, Node, NodeKind, Tree, number};
use std::ops::Range;

/// A value and where it is written.
#[derive(Clone, Debug)]
pub(crate) struct Value {
    /// Its bytes in the text.
    pub(crate) range: Range<usize>,
    /// What it is.
    pub(crate) shape: Shape,
}

/// What a value is.
#[derive(Clone, Debug)]
pub(crate) enum Shape {
    /// A text: what it says, without quotes and escapes.
    Text(String),
    /// A number.
    Number(f64),
    /// A word by itself.
    Word,
    /// A word and what follows it in brackets.
    Call {
        /// Where the word is.
        word: Range<usize>,
        /// The brackets.
        body: Body,
    },
    /// Brackets.
    Body(Body),
    /// Something else.
    Other,
}

/// Brackets and what is in them.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// From the opening bracket to the closing one, both included.
    pub(crate) range: Range<usize>,
    /// The opening bracket.
    pub(crate) bracket: u8,
    /// Whether there is a closing bracket.
    pub(crate) closed: bool,
    /// What is in them.
    pub(crate) items: Vec<Item>,
}

/// One thing in brackets: a value, with a key or without.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    /// The key with the value.
    pub(crate) range: Range<usize>,
    /// The key, if a colon follows it.
    pub(crate) key: Option<Key>,
    /// The value, if there is one.
    pub(crate) value: Option<Value>,
}

/// What stands before a colon.
#[derive(Clone, Debug)]
pub(crate) struct Key {
    /// Where it is, quotes included.
    pub(crate) range: Range<usize>,
    /// What it says.
    pub(crate) name: String,
}

impl Value {
    /// The brackets of it, if it has some.
    pub(crate) fn body(&self) -> Option<&Body> {
        match &self.shape {
            Shape::Call { body, .. } | Shape::Body(body) => Some(body),
            _ => None,
        }
    }

    /// What a text says.
    pub(crate) fn text(&self) -> Option<&str> {
        if let Shape::Text(text) = &self.shape { Some(text) } else { None }
    }

    /// Where its word is, with brackets behind it or without.
    pub(crate) fn word(&self) -> Option<Range<usize>> {
        match &self.shape {
            Shape::Call { word, .. } => Some(word.clone()),
            Shape::Word => Some(self.range.clone()),
            _ => None,
        }
    }
}

impl Body {
    /// Between the brackets.
    pub(crate) fn inside(&self) -> Range<usize> {
        self.range.start + 1..if self.closed { self.range.end - 1 } else { self.range.end }
    }

    /// The first item with that key.
    pub(crate) fn get(&self, name: &str) -> Option<&Item> {
        self.items.iter().find(|item| item.name() == Some(name))
    }

    /// The value with that key.
    pub(crate) fn value(&self, name: &str) -> Option<&Value> {
        self.get(name)?.value.as_ref()
    }

    /// The item whose key or value touches a place.
    pub(crate) fn item_at(&self, at: usize) -> Option<usize> {
        // Items are in the order of the text.
        let after = self.items.partition_point(|item| item.range.start <= at);
        let index = after.checked_sub(1)?;
        (at <= self.items[index].range.end).then_some(index)
    }
}

impl Item {
    /// The name before the colon.
    pub(crate) fn name(&self) -> Option<&str> {
        self.key.as_ref().map(|key| key.name.as_str())
    }
}

/// The value of a whole text.
pub(crate) fn read(tree: &Tree) -> Option<Value> {
    value(tree.value()?, 0)
}

fn value(node: Node<'_>, depth: usize) -> Option<Value> {
    // Mistakes may add levels of their own to those of brackets.
    if depth > 3 * MAX_NESTING {
        return None;
    }
    let mut range = node.range();
    let shape = match node.kind() {
        NodeKind::Text => {
            let quoted = || node.text().trim_matches('"').to_owned();
            Shape::Text(node.string().unwrap_or_else(quoted))
        }
        NodeKind::Number => number(node.text()).map_or(Shape::Other, Shape::Number),
        NodeKind::Word => Shape::Word,
        NodeKind::Parens | NodeKind::List | NodeKind::Map => Shape::Body(body(node, depth)),
        NodeKind::Call => {
            let word = node.tokens().first()?.range();
            Shape::Call { word, body: body(node.body()?, depth) }
        }
        // The value is among what could not be read.
        NodeKind::Error => return node.children().find_map(|child| value(child, depth + 1)),
        NodeKind::Char | NodeKind::Range => Shape::Other,
        NodeKind::Root | NodeKind::Attribute | NodeKind::Entry | NodeKind::Missing => return None,
    };
    if let Shape::Body(body) | Shape::Call { body, .. } = &shape {
        range.end = range.end.max(body.range.end);
    }
    Some(Value { range, shape })
}

fn body(node: Node<'_>, depth: usize) -> Body {
    let mut range = node.range();
    let bracket = node.text().bytes().next().unwrap_or(b'(');
    let close = match bracket {
        b'(' => ')',
        b'[' => ']',
        _ => '}',
    };
    let closed = node.tokens().len() > 1 && node.text().ends_with(close);
    if !closed {
        // Whatever is written next belongs into it: up to the next thing that is there.
        let next = node.tree().tokens().get(node.token_range().end);
        range.end = next.map_or(node.tree().text().len(), |token| token.start());
    }
    let mut items = Vec::new();
    node.children().for_each(|child| item(child, depth + 1, &mut items));
    Body { range, bracket, closed, items }
}

fn item(node: Node<'_>, depth: usize, items: &mut Vec<Item>) {
    match node.kind() {
        NodeKind::Entry => {
            let Some((key, name)) = node.key().zip(node.key_text()) else { return };
            let value = node.value().and_then(|node| value(node, depth));
            let end = value.as_ref().map_or(node.range().end, |value| value.range.end.max(node.range().end));
            let colon = node.tokens().last().map_or(end, |token| token.end());
            let key = Key { range: key.range(), name };
            let range = key.range.start..if value.is_some() { end } else { colon };
            items.push(Item { range, key: Some(key), value });
        }
        // What could not be read may hold things that can.
        NodeKind::Error if depth <= 3 * MAX_NESTING => {
            node.children().for_each(|child| item(child, depth + 1, items));
        }
        _ => {
            if let Some(value) = value(node, depth) {
                items.push(Item { range: value.range.clone(), key: None, value: Some(value) });
            }
        }
    }
}

/// Where what a text says stands between its quotes, if it is written without escapes.
pub(crate) fn plain(text: &str, range: &Range<usize>, says: &str) -> Option<Range<usize>> {
    let inside = range.start + 1..range.start + 1 + says.len();
    (text[range.start..].starts_with('"') && text.get(inside.clone()) == Some(says)).then_some(inside)
}
