//! Nodes without a name, written where they are read: `input: Perlin(size: 3)`. Their names derive from the place:
//! `node.input`, and `node.layers.2` for the second item of a list.
use super::document;
use super::linker::{Entity, Linker, Port};
use super::part::{Entry, Shape, SyntaxValue};
use super::ports::{self, Literal};
use crate::diagnostics::Diagnostic;
use crate::value::Accepts;
use std::borrow::Cow;

impl Linker<'_> {
    /// Returns true if a node or the formula of one is written at `part`.
    pub(super) fn is_node(&mut self, scope: usize, part: &SyntaxValue) -> bool {
        match part.shape() {
            Shape::Call => true,
            Shape::Text(_) => self.is_formula(scope, part),
            Shape::Word(word) => word == "Use" || self.registry.info(&word).is_some(),
            _ => false,
        }
    }

    /// Adds the node or formula written at `part`; nodes inside it are added later. `name` is its name in the scope.
    pub(super) fn add_inline(&mut self, scope: usize, name: &str, part: &SyntaxValue) {
        if matches!(part.shape(), Shape::Text(_)) {
            let entity = self.add_formula(scope, name, part);
            self.inlines.insert((scope, part.span()), entity);
            return;
        }
        let entry = Entry { name: name.to_owned(), key: part.clone(), value: part.clone() };
        let decl = document::node(&entry, false, self.report);
        let entity = match &decl.args {
            Some(args) => self.entity(scope, &decl, Cow::Owned(args.clone())),
            None => Entity::Broken,
        };
        self.inlines.insert((scope, part.span()), entity);
        self.enter(scope);
    }

    /// The value at a port whose inline nodes were already added: a node, or the result of [`ports::literal`].
    pub(super) fn written(
        &self,
        scope: usize,
        part: &SyntaxValue,
        wants: Accepts,
        port: &Port,
    ) -> Result<Literal, Box<Diagnostic>> {
        if self.inlines.contains_key(&(scope, part.span())) {
            return Ok(Literal::Reference(part.str().to_owned()));
        }
        ports::literal(part, wants, port, false)
    }

    /// The name of a node in its scope.
    pub(super) fn local_name(&self, flat: usize) -> String {
        let node = &self.flats[flat];
        let prefix = &self.scopes[node.scope].prefix;
        node.name.strip_prefix(prefix.as_str()).unwrap_or(&node.name).to_owned()
    }

    /// The name of a sub-graph in the scope that uses it.
    pub(super) fn name_of_use(&self, scope: usize, child: usize) -> String {
        let (outer, inner) = (&self.scopes[scope].prefix, &self.scopes[child].prefix);
        inner.strip_prefix(outer.as_str()).unwrap_or(inner).trim_end_matches('/').to_owned()
    }
}
