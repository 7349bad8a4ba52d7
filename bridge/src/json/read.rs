//! Reads JSON text. Each value knows its place, numbers keep their text, and names may stand twice.
use super::TextFault;
use std::ops::Range;

/// A JSON value.
#[derive(Clone, Debug)]
pub(super) struct Json {
    /// Its bytes.
    pub(super) range: Range<usize>,
    /// Its shape.
    pub(super) shape: Shape,
}

/// The shape of a JSON value.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A number, `true` or `false`.
    Plain(String),
    /// `null`.
    Null,
    /// A string.
    Text(String),
    /// An array.
    List(Vec<Json>),
    /// An object, in order.
    Object(Vec<Field>),
}

/// A field of an object.
#[derive(Clone, Debug)]
pub(super) struct Field {
    /// The name.
    pub(super) name: String,
    /// The bytes of the name with its quotes.
    pub(super) place: Range<usize>,
    /// The value.
    pub(super) value: Json,
}

/// Reads a whole text.
pub(super) fn read(text: &str) -> Result<Json, TextFault> {
    // The library finds mistakes and limits the depth, so the reader below sees valid JSON only.
    if let Err(error) = serde_json::from_str::<serde_json::Value>(text) {
        let start: usize = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
        let mut at = (start + error.column().saturating_sub(1)).min(text.len());
        while !text.is_char_boundary(at) {
            at -= 1;
        }
        let said = error.to_string();
        let message = said.split(" at line ").next().unwrap_or(&said);
        return Err(TextFault {
            range: at..at,
            message: format!("not JSON: {message}"),
            help: Some("graphs in the JSON form end in `.json`; those in RON need no conversion".to_owned()),
        });
    }
    let mut reader = Reader { text, at: 0 };
    Ok(reader.value())
}

/// A position in valid JSON.
struct Reader<'a> {
    text: &'a str,
    at: usize,
}

impl Reader<'_> {
    /// The next byte behind blanks.
    fn peek(&mut self) -> u8 {
        let rest = self.text.get(self.at..).unwrap_or_default();
        self.at += rest.len() - rest.trim_start_matches([' ', '\n', '\r', '\t']).len();
        self.text.as_bytes().get(self.at).copied().unwrap_or_default()
    }

    /// Passes a byte, if it is the next one.
    fn pass(&mut self, byte: u8) -> bool {
        let found = self.peek() == byte;
        self.at += usize::from(found);
        found
    }

    fn value(&mut self) -> Json {
        let first = self.peek();
        let start = self.at;
        let shape = match first {
            b'{' => {
                let mut fields = Vec::new();
                self.at += 1;
                while !self.pass(b'}') && self.peek() == b'"' {
                    let place = self.literal();
                    let name = self.string(&place);
                    self.pass(b':');
                    fields.push(Field { name, place, value: self.value() });
                    self.pass(b',');
                }
                Shape::Object(fields)
            }
            b'[' => {
                let mut items = Vec::new();
                self.at += 1;
                while !self.pass(b']') && self.peek() != 0 {
                    items.push(self.value());
                    self.pass(b',');
                }
                Shape::List(items)
            }
            b'"' => {
                let place = self.literal();
                Shape::Text(self.string(&place))
            }
            _ => {
                let end = |c: char| matches!(c, ',' | ']' | '}' | ' ' | '\n' | '\r' | '\t');
                let rest = self.text.get(self.at..).unwrap_or_default();
                let word = &rest[..rest.find(end).unwrap_or(rest.len())];
                self.at += word.len();
                if word == "null" { Shape::Null } else { Shape::Plain(word.to_owned()) }
            }
        };
        Json { range: start..self.at, shape }
    }

    /// Passes a string.
    fn literal(&mut self) -> Range<usize> {
        let start = self.at;
        let mut escaped = false;
        let rest = self.text.as_bytes().get(start + 1..).unwrap_or_default();
        let closes = |byte: &u8| {
            let closes = *byte == b'"' && !escaped;
            escaped = *byte == b'\\' && !escaped;
            closes
        };
        self.at = rest.iter().position(closes).map_or(self.text.len(), |length| start + length + 2);
        start..self.at
    }

    fn string(&self, place: &Range<usize>) -> String {
        self.text.get(place.clone()).and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default()
    }
}
