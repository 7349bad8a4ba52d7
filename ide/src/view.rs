//! Values of a graph file with their ranges, for any text; each syntax error affects the smallest possible part.
use shibo_graph::syntax::{MAX_NESTING, Node, NodeKind, Tree, formula, number};
use std::ops::Range;

/// A value and its range.
#[derive(Clone, Debug)]
pub struct Value {
    /// Its bytes in the text.
    pub range: Range<usize>,
    /// Its shape.
    pub shape: Shape,
}

/// Shape of a value.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A text, without quotes and escapes.
    Text(String),
    /// A number.
    Number(f64),
    /// A word by itself.
    Word,
    /// A word followed by brackets.
    Call {
        /// Range of the word.
        word: Range<usize>,
        /// The brackets.
        body: Body,
    },
    /// Brackets without a word.
    Body(Body),
    /// Anything else.
    Other,
}

/// Brackets and their items.
#[derive(Clone, Debug)]
pub struct Body {
    /// From the opening to the closing bracket, both included.
    pub range: Range<usize>,
    /// The opening bracket.
    pub bracket: u8,
    /// True if there is a closing bracket.
    pub closed: bool,
    /// Items in the brackets.
    pub items: Vec<Item>,
}

/// An item of brackets: a value, with or without a key.
#[derive(Clone, Debug)]
pub struct Item {
    /// Range of key and value.
    pub range: Range<usize>,
    /// The key, if a colon follows it.
    pub key: Option<Key>,
    /// The value, if there is one.
    pub value: Option<Value>,
}

/// The key before a colon.
#[derive(Clone, Debug)]
pub struct Key {
    /// Range, quotes included.
    pub range: Range<usize>,
    /// Name without quotes.
    pub name: String,
}

impl Value {
    /// Brackets of the value, if any.
    pub fn body(&self) -> Option<&Body> {
        match &self.shape {
            Shape::Call { body, .. } | Shape::Body(body) => Some(body),
            _ => None,
        }
    }

    /// Content of a text.
    pub fn text(&self) -> Option<&str> {
        if let Shape::Text(text) = &self.shape { Some(text) } else { None }
    }

    /// Range of the word, with or without brackets after it.
    pub fn word(&self) -> Option<Range<usize>> {
        match &self.shape {
            Shape::Call { word, .. } => Some(word.clone()),
            Shape::Word => Some(self.range.clone()),
            _ => None,
        }
    }
}

impl Body {
    /// Range between the brackets.
    pub fn inside(&self) -> Range<usize> {
        self.range.start + 1..if self.closed { self.range.end - 1 } else { self.range.end }
    }

    /// First item with this key.
    pub fn get(&self, name: &str) -> Option<&Item> {
        self.items.iter().find(|item| item.name() == Some(name))
    }

    /// Value of this key.
    pub fn value(&self, name: &str) -> Option<&Value> {
        self.get(name)?.value.as_ref()
    }

    /// Index of the item whose key or value touches a position.
    pub fn item_at(&self, at: usize) -> Option<usize> {
        // Items are in the order of the text.
        let after = self.items.partition_point(|item| item.range.start <= at);
        let index = after.checked_sub(1)?;
        (at <= self.items[index].range.end).then_some(index)
    }
}

impl Item {
    /// Name before the colon.
    pub fn name(&self) -> Option<&str> {
        self.key.as_ref().map(|key| key.name.as_str())
    }
}

/// Reads the value of a whole text.
pub(crate) fn read(tree: &Tree) -> Option<Value> {
    value(tree.value()?, 0)
}

fn value(node: Node<'_>, depth: usize) -> Option<Value> {
    // Syntax errors may add nesting levels to those of brackets.
    if depth > 3 * MAX_NESTING {
        return None;
    }
    let mut range = node.range();
    let shape = match node.kind() {
        NodeKind::Text => {
            let quoted = || {
                let inside = formula::content(node.text()).map(|range| &node.text()[range]);
                inside.unwrap_or_else(|| node.text().trim_matches('"')).to_owned()
            };
            Shape::Text(node.string().unwrap_or_else(quoted))
        }
        NodeKind::Number => number(node.text()).map_or(Shape::Other, Shape::Number),
        NodeKind::Word => Shape::Word,
        NodeKind::Parens | NodeKind::List | NodeKind::Map => Shape::Body(body(node, depth)),
        NodeKind::Call => {
            let word = node.tokens().first()?.range();
            Shape::Call { word, body: body(node.body()?, depth) }
        }
        // The value is inside an error node.
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
        // Text typed next belongs to the body, so its range extends to the next token.
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
        // An error node may contain values.
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

/// Range of a text's content between its quotes, if it has no escapes.
pub(crate) fn plain(text: &str, range: &Range<usize>, says: &str) -> Option<Range<usize>> {
    let inside = formula::content(text.get(range.clone())?)?;
    let inside = range.start + inside.start..range.start + inside.end;
    (text.get(inside.clone()) == Some(says)).then_some(inside)
}
