//! How the values of a graph are written in their places. A notation without words and tuples, such as JSON, needs this to tell
//! `Srgb` from `"Srgb"`, and `(1, 2)` from `[1, 2]`.
use super::expect::Expect;
use super::view::{Item, Value};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_node::{ParamInfo, Role};
use shibo_picture::export::Takes;
use std::ops::Range;

/// How a value is written in its place.
#[derive(Clone, Copy, Debug)]
pub enum Form<'a> {
    /// A list: `[a, b]`.
    List,
    /// A word.
    Word,
    /// One of these words, or a text.
    WordOrText(&'a [&'static str]),
    /// A parameter of a node, whose schema tells the form.
    Param(&'a ParamInfo),
    /// Anything else: named fields or a tuple, if in brackets.
    Plain,
}

/// Visitor that passes on the forms.
struct Forms<F>(F);

impl<'a, F: FnMut(&Range<usize>, Form<'_>)> Visit<'a> for Forms<F> {
    fn key(&mut self, _: Expect<'a>, _: &'a Item) {}

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        let words;
        let form = match expect {
            Expect::Port(_, port, false) if port.list => Form::List,
            Expect::Param(_, Some("options")) => Form::List,
            Expect::Value(_, param) if has_ports(param) => Form::List,
            Expect::Value(_, param) => Form::Param(param),
            Expect::Canvas(Some(_)) | Expect::File(_, Some(_)) => match expect.takes() {
                Some(Takes::Mesh) => {
                    words = Takes::Mesh.words();
                    Form::WordOrText(&words)
                }
                Some(takes) if !takes.words().is_empty() => Form::Word,
                _ => Form::Plain,
            },
            _ => Form::Plain,
        };
        (self.0)(&value.range, form);
    }
}

/// Returns true if a parameter is a list of structs with ports, whose fields are places of their own.
fn has_ports(param: &ParamInfo) -> bool {
    param.fields.iter().any(|field| matches!(field.role, Role::Port(_)))
}

/// Calls `visit` with the range and the form of each value of a file and its local graphs. Parts of a parameter belong to its
/// value.
pub fn forms(cx: Cx<'_>, mut visit: impl FnMut(&Range<usize>, Form<'_>)) {
    for scope in cx.file.scopes() {
        walk(cx.with(&scope), &mut Forms(&mut visit));
    }
}
