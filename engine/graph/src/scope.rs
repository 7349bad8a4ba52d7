//! Scopes: a graph file, or a use of a sub-graph, with the meanings of its names.
use super::document::NodeDecl;
use super::each;
use super::formula_text::FormulaText;
use super::imports;
use super::linker::{Bound, Entity, Flat, Linker, Port, Scope, Slot};
use super::params::Params;
use super::part::{Entry, Shape, SyntaxValue};
use super::ports::{self, Literal};
use super::read::{self, mismatch};
use super::remedy;
use super::report::Report;
use super::subst::substitute;
use crate::diagnostics::{Code, Span};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

impl<'a> Linker<'a> {
    /// Sets `scope` as the subject of the following diagnostics.
    pub(super) fn enter(&mut self, scope: usize) {
        self.report.enter(self.first_instance + scope, self.scopes[scope].used);
    }

    /// Adds the scope of a document, without names; see [`fill`](Self::fill). `used` is the scope that uses it, and the place.
    pub(super) fn declare(&mut self, doc: usize, prefix: String, params: Params, used: Option<(usize, Span)>) -> usize {
        let scope = self.scopes.len();
        let count = self.docs[doc].document.inputs.len();
        let (inputs, resolved) = (vec![Bound::Broken; count], vec![None; count]);
        let is_shipped = imports::within(&self.docs[doc].path).is_some();
        let own_place = |(user, place): (usize, Span)| self.scopes[user].own_place.unwrap_or(place);
        let own_place = used.filter(|_| is_shipped).map(own_place);
        self.scopes.push(Scope {
            doc,
            prefix,
            params,
            names: BTreeMap::new(),
            inputs,
            resolved,
            used: used.map(|(_, place)| place),
            own_place,
            pinned_by: self.pinned_by(doc, used.map(|(user, _)| user)),
            canvas: self.canvas,
            layout: None,
        });
        scope
    }

    /// Fills a scope: adds its nodes and sub-graphs, and resolves its names. `given` holds the values of its inputs.
    pub(super) fn fill(&mut self, scope: usize, given: &[Option<Bound>]) {
        let docs = self.docs;
        let doc = &docs[self.scopes[scope].doc];
        self.enter(scope);
        self.check_calls(scope);
        for (i, input) in doc.document.inputs.iter().enumerate() {
            // Check the default even if it is not used.
            let default = self.default_input(scope, i);
            let value = given.get(i).cloned().flatten().or(default);
            self.scopes[scope].inputs[i] = value.unwrap_or_else(|| self.without_default(scope, input));
            self.scopes[scope].names.insert(input.name.clone(), Entity::Input(i));
        }
        for decl in &doc.document.nodes {
            if self.cancel.is_cancelled() {
                return;
            }
            self.enter(scope);
            let entity = match &decl.args {
                Some(args) => self.entity(scope, decl, Cow::Borrowed(args)),
                None => Entity::Broken,
            };
            if decl.named {
                self.scopes[scope].names.insert(decl.name.clone(), entity);
            }
        }
        for output in &doc.document.outputs {
            if let Some(from) = output.from.as_ref().filter(|from| FormulaText::of(from).is_some()) {
                self.add_inline(scope, &format!("outputs.{}", output.name), from);
            }
        }
        let names: BTreeSet<String> = self.scopes[scope].names.keys().cloned().collect();
        self.scopes[scope].params.nodes = Arc::new(names);
    }

    /// The default of an input; `None` if it has none.
    fn default_input(&mut self, scope: usize, index: usize) -> Option<Bound> {
        let docs = self.docs;
        let input = &docs[self.scopes[scope].doc].document.inputs[index];
        let Some(ty) = input.ty else { return Some(Bound::Broken) };
        let default = input.default.as_ref()?;
        if self.is_node(scope, default) {
            let name = format!("{}.default", input.name);
            self.add_inline(scope, &name, default);
            self.checks.push((scope, Slot::unresolved(Port::Input(input.name.clone()), ty, default.clone())));
            return Some(Bound::Wire { scope, part: default.clone(), name });
        }
        let Some(value) = substitute(default, &self.scopes[scope].params, self.report) else {
            return Some(Bound::Broken);
        };
        let port = Port::Input(input.name.clone());
        Some(match ports::literal(&value.part, ty, &port, value.is_text) {
            Ok(Literal::Constant(field)) => Bound::Constant(field, value.part),
            Ok(Literal::Reference(name)) => {
                self.checks.push((scope, Slot::unresolved(port, ty, value.part.clone())));
                Bound::Wire { scope, part: value.part, name }
            }
            Err(error) => {
                self.report.push(*error);
                Bound::Broken
            }
        })
    }

    pub(super) fn entity(&mut self, scope: usize, decl: &NodeDecl, args: Cow<'a, [Entry]>) -> Entity {
        if let Some(formula) = &decl.formula {
            return self.add_formula(scope, &decl.name, formula);
        }
        let Some(kind) = &decl.kind else { return Entity::Broken };
        if kind.str() == "Use" {
            return self.declare_use(scope, &decl.name, kind, &args, None).map_or(Entity::Broken, Entity::Use);
        }
        if kind.str() == each::KIND {
            return self.declare_each(scope, &decl.name, kind, &args).unwrap_or(Entity::Broken);
        }
        if self.registry.is_retired(kind.str()) {
            let may_read = self.report.may_read();
            self.report.push(remedy::retired(self.registry, kind, may_read));
            return Entity::Broken;
        }
        let Some(info) = self.registry.info(kind.str()) else {
            let kinds = self.registry.kinds().chain(["Use", each::KIND]);
            let message = format!("there is no node kind `{}`", read::shorten(kind.str()));
            let error = kind.error(Code::UnknownKind, message);
            // This reads the documentation of all kinds, which costs as much as very many comparisons of names.
            let may_read = self.report.may_read();
            match may_read.then(|| remedy::kind_elsewhere(self.registry, kind.str())).flatten() {
                Some(meant) => self.report.push(error.help(format!("here it is called `{meant}`"))),
                None => self.report.unknown(error, kind.str(), "kind", kinds),
            }
            return Entity::Broken;
        };
        let name = format!("{}{}", self.scopes[scope].prefix, decl.name);
        let kind_name = info.kind.clone();
        Entity::Node(self.add_flat(Flat::new(scope, name, kind.clone(), kind_name, Some(info), args)))
    }

    pub(super) fn add_flat(&mut self, flat: Flat<'a>) -> usize {
        self.flats.push(flat);
        self.flats.len() - 1
    }
}

/// Checks a note, a text for readers without effect.
pub(super) fn check_note(part: &SyntaxValue, report: &mut Report) {
    if !matches!(part.shape(), Shape::Text(_)) {
        report.push(mismatch(part, "`note`", "a text in quotes"));
    }
}
