//! Writes JSON text. Short arrays and objects stand in one line.
use std::fmt::Write as _;

/// The longest line.
const WIDTH: usize = 100;

/// A JSON value to be written.
#[derive(Clone, Debug)]
pub(super) enum Out {
    /// A number, `true`, `false` or `null`.
    Plain(String),
    /// A string.
    Text(String),
    /// An array.
    List(Vec<Self>),
    /// An object, in order.
    Object(Vec<(String, Self)>),
}

impl Out {
    /// `null`.
    pub(super) fn null() -> Self {
        Self::Plain("null".to_owned())
    }

    /// An object with one field.
    pub(super) fn one(name: &str, value: Self) -> Self {
        Self::Object(vec![(name.to_owned(), value)])
    }

    /// The text, with a line break at the end.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        self.write(0, &mut text);
        text.push('\n');
        text
    }

    fn write(&self, indent: usize, out: &mut String) {
        let column = out.len() - out.rfind('\n').map_or(0, |at| at + 1);
        let flat = self.flat(WIDTH.saturating_sub(column));
        match (flat, self) {
            (Some(flat), _) => out.push_str(&flat),
            (None, Self::List(items)) => {
                block(out, indent, ('[', ']'), items, |item, indent, out| item.write(indent, out))
            }
            (None, Self::Object(fields)) => block(out, indent, ('{', '}'), fields, |(name, value), indent, out| {
                let _ = write!(out, "{}: ", quoted(name));
                value.write(indent, out);
            }),
            (None, Self::Plain(text)) => out.push_str(text),
            (None, Self::Text(text)) => out.push_str(&quoted(text)),
        }
    }

    /// The text in one line of at most this many bytes.
    fn flat(&self, most: usize) -> Option<String> {
        let text = match self {
            Self::Plain(text) => text.clone(),
            Self::Text(text) => quoted(text),
            Self::List(items) => {
                let mut text = "[".to_owned();
                for (index, item) in items.iter().enumerate() {
                    text += if index == 0 { "" } else { ", " };
                    text += &item.flat(most.checked_sub(text.len())?)?;
                }
                text + "]"
            }
            Self::Object(fields) => {
                let mut text = "{".to_owned();
                for (index, (name, value)) in fields.iter().enumerate() {
                    text += if index == 0 { " " } else { ", " };
                    text = text + &quoted(name) + ": ";
                    text += &value.flat(most.checked_sub(text.len())?)?;
                }
                text + if fields.is_empty() { "}" } else { " }" }
            }
        };
        (text.len() <= most).then_some(text)
    }
}

/// Writes brackets with one item per line.
fn block<T>(
    out: &mut String,
    indent: usize,
    brackets: (char, char),
    items: &[T],
    write: impl Fn(&T, usize, &mut String),
) {
    out.push(brackets.0);
    for (index, item) in items.iter().enumerate() {
        out.push_str(if index == 0 { "\n" } else { ",\n" });
        out.push_str(&" ".repeat(indent + 2));
        write(item, indent + 2, out);
    }
    out.push('\n');
    out.push_str(&" ".repeat(indent));
    out.push(brackets.1);
}

/// A string with quotes.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
