//! From RON to JSON.
use super::comments::{self, Around, END, FILE, ITEM, above, behind, of_children, of_gap};
use super::form::Form;
use super::write::Out;
use super::{Forms, TextFault, forms_of};
use crate::{GraphText, Tools};
use shibo_graph::syntax::{Node, NodeKind, Tree, is_infinity, number};
use std::ops::Range;

/// A graph in the JSON form.
///
/// # Errors
/// The mistakes of a text that is not RON, and values that graphs never have: characters, ranges and byte strings.
pub fn to_json(tools: &Tools, graph: &GraphText) -> Result<String, Vec<TextFault>> {
    let tree = Tree::parse(graph.text.as_str());
    if !tree.errors().is_empty() {
        return Err(tree.errors().iter().map(TextFault::from).collect());
    }
    let Some(top) = tree.value().filter(|top| top.kind() != NodeKind::Missing) else {
        let message = "the text has no graph".to_owned();
        return Err(vec![TextFault { range: 0..0, message, help: Some("write `(nodes: { … })`".to_owned()) }]);
    };
    let mut encoder = Encoder { tree: &tree, forms: forms_of(tools, graph), stray: Vec::new(), faults: Vec::new() };
    let mut out = encoder.value(top, &Form::Plain);
    if let Out::Object(fields) = &mut out {
        let (_, lines) = of_gap(&tree, 0..top.range().start, false);
        let (near, below) = of_gap(&tree, top.range().end..tree.text().len(), true);
        if !lines.is_empty() {
            fields.insert(0, (above(FILE), comments::out(lines)));
        }
        let below = [near, below].concat();
        if !below.is_empty() {
            fields.push((behind(FILE), comments::out(below)));
        }
    }
    if encoder.faults.is_empty() { Ok(out.text()) } else { Err(encoder.faults) }
}

struct Encoder<'t> {
    tree: &'t Tree,
    forms: Forms,
    /// Comments in places that have no field for them. They move above the thing.
    stray: Vec<String>,
    faults: Vec<TextFault>,
}

/// The place between brackets.
fn inside(body: Node<'_>) -> Range<usize> {
    let range = body.range();
    range.start + 1..range.end.saturating_sub(1).max(range.start + 1)
}

impl Encoder<'_> {
    /// The form of a value in brackets of a form.
    fn form(&self, value: Node<'_>, of_parent: Form<'_>) -> Form<'static> {
        if let Form::Schema(schema) = of_parent {
            return Form::Schema(std::borrow::Cow::Owned(schema.into_owned()));
        }
        let range = value.range();
        self.forms.get(&(range.start, range.end)).cloned().unwrap_or(Form::Plain)
    }

    fn value(&mut self, value: Node<'_>, form: &Form<'_>) -> Out {
        match value.kind() {
            NodeKind::Text if !value.text().starts_with('b') => Out::Text(value.string().unwrap_or_default()),
            NodeKind::Number => number_out(value.text()),
            NodeKind::Word => match value.name().unwrap_or_default() {
                word @ ("true" | "false") => Out::Plain(word.to_owned()),
                "None" => Out::null(),
                word if form.is_word(word) => Out::Text(word.to_owned()),
                word => Out::one(word, Out::null()),
            },
            NodeKind::Call => {
                let Some(body) = value.body() else { return Out::null() };
                let name = value.name().unwrap_or_default();
                let named = body.entries().next().is_some() || body.children().next().is_none();
                let of_arguments = form.field(name);
                let arguments =
                    if named { self.fields(body, &of_arguments) } else { self.arguments(body, &of_arguments) };
                Out::one(name, arguments)
            }
            NodeKind::Map => self.fields(value, form),
            NodeKind::Parens if value.entries().next().is_some() || value.children().next().is_none() => {
                self.fields(value, form)
            }
            NodeKind::Parens => self.items(value, form, false),
            NodeKind::List => self.items(value, form, true),
            _ => {
                let message = "this value has no JSON form".to_owned();
                let help = Some("graphs have numbers, texts, words, lists and brackets".to_owned());
                self.faults.push(TextFault { range: value.range(), message, help });
                Out::null()
            }
        }
    }

    /// The positional arguments of a word: one value, or an array.
    fn arguments(&mut self, body: Node<'_>, form: &Form<'_>) -> Out {
        let children: Vec<Node<'_>> = body.children().collect();
        let [only] = &children[..] else { return self.items(body, form, false) };
        self.stray(body, &children);
        let out = self.value(*only, &self.form(*only, form.clone()));
        match out {
            Out::List(_) | Out::Object(_) => Out::List(vec![out]),
            Out::Plain(text) if text == "null" => Out::List(vec![Out::null()]),
            out => out,
        }
    }

    /// Keeps comments for the thing around brackets.
    fn stray(&mut self, body: Node<'_>, children: &[Node<'_>]) {
        let (around, end) = of_children(self.tree, inside(body), children);
        let all = around.into_iter().flat_map(|around| around.above.into_iter().chain(around.behind)).chain(end);
        self.stray.extend(all.filter(|line| !line.is_empty()));
    }

    fn items(&mut self, body: Node<'_>, form: &Form<'_>, commented: bool) -> Out {
        let children: Vec<Node<'_>> = body.children().collect();
        if !commented {
            self.stray(body, &children);
        }
        let (around, end) = of_children(self.tree, inside(body), &children);
        let mut items = Vec::new();
        let outer = std::mem::take(&mut self.stray);
        for (index, (child, around)) in children.iter().zip(around).enumerate() {
            let item = self.form(*child, form.item(index));
            let out = self.value(*child, &item);
            let Around { mut above, behind } = around;
            if commented {
                above.append(&mut self.stray);
                items.extend((!above.is_empty()).then(|| Out::one(END, comments::out(above))));
                items.push(out);
                items.extend((!behind.is_empty()).then(|| Out::one(&self::behind(ITEM), comments::out(behind))));
            } else {
                items.push(out);
            }
        }
        items.extend((commented && !end.is_empty()).then(|| Out::one(END, comments::out(end))));
        self.stray.splice(0..0, outer);
        Out::List(items)
    }

    fn fields(&mut self, body: Node<'_>, form: &Form<'_>) -> Out {
        let children: Vec<Node<'_>> = body.children().collect();
        let (around, end) = of_children(self.tree, inside(body), &children);
        let mut fields = Vec::new();
        let outer = std::mem::take(&mut self.stray);
        for (child, around) in children.into_iter().zip(around) {
            let (Some(key), Some(name), Some(value)) = (child.key(), child.key_text(), child.value()) else { continue };
            let Around { mut above, mut behind } = around;
            let (near, far) = of_gap(self.tree, key.range().end..value.range().start, false);
            above.extend(near.into_iter().chain(far));
            let out = self.value(value, &self.form(value, form.field(&name)));
            above.append(&mut self.stray);
            if !above.is_empty() {
                fields.push((self::above(&name), comments::out(above)));
            }
            fields.push((name.clone(), out));
            if !behind.is_empty() {
                fields.push((self::behind(&name), comments::out(std::mem::take(&mut behind))));
            }
        }
        if !end.is_empty() {
            fields.push((END.to_owned(), comments::out(end)));
        }
        self.stray = outer;
        Out::Object(fields)
    }
}

/// A number of RON. Its text stays where JSON has the same notation.
fn number_out(text: &str) -> Out {
    if is_json(text) {
        return Out::Plain(text.to_owned());
    }
    let digits = text.trim_start_matches('+').replace('_', "");
    if is_json(&digits) {
        return Out::Plain(digits);
    }
    if let Ok(whole) = digits.parse::<i128>() {
        return Out::Plain(whole.to_string());
    }
    match number(text) {
        Some(value) if is_infinity(text) => Out::Text(if value > 0.0 { "inf" } else { "-inf" }.to_owned()),
        Some(value) if value.is_finite() => Out::Plain(format!("{value}")),
        _ => Out::Text(text.to_owned()),
    }
}

/// Returns true if JSON writes a number in the same way.
fn is_json(text: &str) -> bool {
    serde_json::from_str::<serde_json::Number>(text).is_ok()
}
