//! From JSON to RON.
use super::comments::{END, FILE, ITEM, above, behind, is_comment, lines};
use super::form::Form;
use super::read::{Field, Json, Shape, read};
use super::{Forms, TextFault, forms_of};
use crate::{GraphText, Tools};
use shibo_graph::schema::ROOT;
use shibo_graph::syntax::{format, formula, is_name};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// The graph that a text in the JSON form means, as laid-out RON.
///
/// # Errors
/// The mistakes of a text that is not JSON, and values that no graph has.
pub fn to_ron(tools: &Tools, graph: &GraphText) -> Result<String, Vec<TextFault>> {
    let top = read(&graph.text).map_err(|fault| vec![fault])?;
    let Shape::Object(fields) = &top.shape else {
        let message = "a graph is an object with `nodes`".to_owned();
        let help = Some("write `{ \"nodes\": { \"name\": { \"Perlin\": { \"size\": 3 } } } }`".to_owned());
        return Err(vec![TextFault { range: top.range, message, help }]);
    };
    // The first text has the places of all values. It tells their forms, from which the second text is made.
    let mut first = Decoder::default();
    first.file(fields);
    if !first.faults.is_empty() {
        return Err(first.faults);
    }
    let path = graph.path.clone();
    let forms = forms_of(tools, &GraphText { path, text: first.out });
    let mut second = Decoder { forms: first.places, known: forms, ..Decoder::default() };
    second.file(fields);
    match format(&second.out) {
        Ok(text) => Ok(text),
        Err(errors) => {
            let fault = |message: String| TextFault { range: top.range.clone(), message, help: None };
            Err(errors
                .iter()
                .map(|error| fault(format!("the graph cannot be written as RON: {}", error.message)))
                .collect())
        }
    }
}

/// The place of an object in a graph.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// The graph, or a local graph.
    Graph,
    /// The local graphs.
    Graphs,
    /// The presets.
    Presets,
    /// The pins.
    Pins,
    /// Names and their values.
    Names,
    /// The fields of a `Use` or an `Each`.
    Use,
    /// Anything else.
    Value,
}

impl Place {
    /// The place of a value in an object.
    fn inside(self, name: &str) -> Self {
        match (self, name) {
            (Self::Graph, "graphs") => Self::Graphs,
            (Self::Graph, "presets") => Self::Presets,
            (Self::Graph, "pins") => Self::Pins,
            (Self::Graph, "canvas" | "version" | "family") => Self::Value,
            (Self::Graph, name) if ROOT.iter().any(|field| field.name == name) => Self::Names,
            (Self::Graphs, _) => Self::Graph,
            (Self::Presets, _) | (Self::Pins, "hold") | (Self::Use, "with") => Self::Names,
            _ => Self::Value,
        }
    }

    /// Returns true if the things in the object are names in quotes.
    fn has_names(self) -> bool {
        matches!(self, Self::Graphs | Self::Presets | Self::Names)
    }
}

#[derive(Default)]
struct Decoder {
    out: String,
    /// The bytes of each value in the text, by its place in the JSON text.
    places: BTreeMap<usize, Range<usize>>,
    /// These places in the first text.
    forms: BTreeMap<usize, Range<usize>>,
    /// The forms of the values in the first text.
    known: Forms,
    faults: Vec<TextFault>,
}

impl Decoder {
    fn file(&mut self, fields: &[Field]) {
        let of_file =
            |name: String| fields.iter().filter(move |field| field.name == name).flat_map(|field| lines(&field.value));
        of_file(above(FILE)).for_each(|line| self.line(&line));
        self.object(fields, Place::Graph, &Form::Plain);
        self.out.push('\n');
        of_file(behind(FILE)).for_each(|line| self.line(&line));
    }

    fn line(&mut self, line: &str) {
        self.out.push_str(line);
        self.out.push('\n');
    }

    /// The form of a value in brackets of a form.
    fn form(&self, json: &Json, of_parent: Form<'_>) -> Form<'static> {
        if let Form::Schema(schema) = of_parent {
            return Form::Schema(Cow::Owned(schema.into_owned()));
        }
        let range = self.forms.get(&json.range.start);
        range.and_then(|range| self.known.get(&(range.start, range.end))).cloned().unwrap_or(Form::Plain)
    }

    fn value(&mut self, json: &Json, place: Place, of_parent: Form<'_>) {
        let (mut start, form) = (self.out.len(), self.form(json, of_parent));
        match &json.shape {
            Shape::Plain(text) => self.out.push_str(text),
            Shape::Null => self.out.push_str("None"),
            Shape::Text(text) if is_driven(text) => self.text(text),
            Shape::Text(text) if form.is_word(text) || form.is_infinite(text) => self.out.push_str(text),
            Shape::Text(text) => self.text(text),
            Shape::List(items) => self.items(items, &form),
            Shape::Object(fields) => match call(fields).filter(|_| place == Place::Value) {
                Some(call) => {
                    let comments = fields.iter().filter(|field| is_comment(&field.name));
                    let comments: Vec<String> = comments.flat_map(|field| lines(&field.value)).collect();
                    self.out.push_str(if comments.is_empty() { "" } else { "\n" });
                    comments.iter().for_each(|line| self.line(line));
                    start = self.out.len();
                    self.call(call, &form);
                }
                None => self.object(fields, place, &form),
            },
        }
        self.places.insert(json.range.start, start..self.out.len());
    }

    /// A text in quotes. Its line breaks stay as they are.
    fn text(&mut self, text: &str) {
        self.out.push('"');
        for c in text.chars() {
            match c {
                '"' | '\\' => self.out.extend(['\\', c]),
                '\n' => self.out.push(c),
                c if c.is_control() => self.out.extend(c.escape_unicode()),
                c => self.out.push(c),
            }
        }
        self.out.push('"');
    }

    /// `Word`, `Word(value, …)` or `Word(name: value)`.
    fn call(&mut self, field: &Field, form: &Form<'_>) {
        self.out.push_str(&field.name);
        let inner = form.field(&field.name);
        match &field.value.shape {
            Shape::Null => {}
            Shape::Object(fields) if call(fields).is_none() => {
                let place = if matches!(field.name.as_str(), "Use" | "Each") { Place::Use } else { Place::Value };
                self.object(fields, place, &inner);
            }
            Shape::List(items) => {
                self.out.push('(');
                for (index, item) in items.iter().enumerate() {
                    let of_item = if items.len() == 1 { inner.clone() } else { inner.item(index) };
                    self.value(item, Place::Value, of_item);
                    self.out.push_str(", ");
                }
                self.out.push(')');
            }
            _ => {
                self.out.push('(');
                self.value(&field.value, Place::Value, inner);
                self.out.push(')');
            }
        }
    }

    /// `[a, b]` or `(a, b)`, with the comments among the items.
    fn items(&mut self, items: &[Json], form: &Form<'_>) {
        let values = items.iter().filter(|item| comment(item).is_none()).count();
        // Pairs in an array make a list of pairs, where the place does not tell.
        let pairs = matches!(form, Form::Plain) && items.iter().any(|item| matches!(item.shape, Shape::List(_)));
        let (open, close) = if pairs || form.is_list(values) { ('[', ']') } else { ('(', ')') };
        self.out.push(open);
        let mut index = 0;
        for (at, item) in items.iter().enumerate() {
            if let Some((name, json)) = comment(item) {
                self.out.push_str(if name == END { "\n" } else { " " });
                lines(json).iter().for_each(|line| self.line(line));
                continue;
            }
            self.value(item, Place::Value, form.item(index));
            self.out.push(',');
            index += 1;
            let next = items.get(at + 1).and_then(comment);
            self.out.push_str(if next.is_none() { " " } else { "" });
        }
        self.out.push(close);
    }

    fn object(&mut self, fields: &[Field], place: Place, form: &Form<'_>) {
        let names = place.has_names();
        self.out.push_str(if names { "{\n" } else { "(\n" });
        let named: BTreeMap<&str, &Field> = fields.iter().map(|field| (field.name.as_str(), field)).collect();
        let comments = |name: &str| named.get(name).map(|field| lines(&field.value));
        let mut seen = BTreeSet::new();
        for field in fields {
            if is_comment(&field.name) {
                self.lone(&named, field, place);
                continue;
            }
            if !seen.insert(&field.name) {
                self.fault(&field.place, format!("`{}` is given twice", field.name), "leave one of them out");
            }
            comments(&above(&field.name)).unwrap_or_default().iter().for_each(|line| self.line(line));
            if names {
                self.text(&field.name);
            } else if is_name(&field.name) {
                self.out.push_str(&field.name);
            } else {
                let help = "a field is letters, digits and `_`; a comment is a field whose name begins with `//`";
                self.fault(&field.place, format!("`{}` cannot be the name of a field", field.name), help);
            }
            self.out.push_str(": ");
            self.value(&field.value, place.inside(&field.name), form.field(&field.name));
            self.out.push_str(", ");
            self.out.push_str(&comments(&behind(&field.name)).unwrap_or_default().join(" "));
            self.out.push('\n');
        }
        self.out.push(if names { '}' } else { ')' });
    }

    /// Writes the comments of a field that belong to no thing of the object.
    fn lone(&mut self, named: &BTreeMap<&str, &Field>, field: &Field, place: Place) {
        let of = |name: &str| named.contains_key(name);
        let (over, after) = (field.name.strip_prefix("// "), field.name.strip_suffix(" //"));
        let is_file = place == Place::Graph && [over, after].contains(&Some(FILE));
        if !is_file && !over.is_some_and(of) && !after.is_some_and(of) {
            lines(&field.value).iter().for_each(|line| self.line(line));
        }
    }

    fn fault(&mut self, range: &Range<usize>, message: String, help: &str) {
        self.faults.push(TextFault { range: range.clone(), message, help: Some(help.to_owned()) });
    }
}

/// Returns true for a text that names a parameter or is a formula.
fn is_driven(text: &str) -> bool {
    text.starts_with('$') || formula::begins(text).is_some()
}

/// The single field of an object that is a word with arguments.
fn call(fields: &[Field]) -> Option<&Field> {
    let mut things = fields.iter().filter(|field| !is_comment(&field.name));
    let field = things.next().filter(|_| things.next().is_none())?;
    let word = field.name.starts_with(|c: char| c.is_ascii_uppercase()) || matches!(field.value.shape, Shape::Null);
    (word && is_name(&field.name)).then_some(field)
}

/// The comments that stand for an item of an array.
fn comment(item: &Json) -> Option<(&str, &Json)> {
    let Shape::Object(fields) = &item.shape else { return None };
    let [field] = &fields[..] else { return None };
    (field.name == END || field.name == behind(ITEM)).then_some((field.name.as_str(), &field.value))
}
