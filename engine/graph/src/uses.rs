//! Instances of sub-graphs: the values that a `Use`, or each instance of an `Each`, gives to its graph.
use super::defaults;
use super::instance::Spread;
use super::linker::{Bound, Flat, Linker, Port, Slot};
use super::params::{Facts, Params};
use super::part::{Entry, SyntaxValue};
use super::ports::{self, Literal};
use super::read;
use super::remedy;
use super::report::Report;
use super::schema;
use super::subst::substitute;
use crate::diagnostics::Code;
use crate::value::{Accepts, Type};
use std::borrow::Cow;

impl Linker<'_> {
    /// Declares an instance of a sub-graph, for a `Use` or as one instance of an `Each`.
    pub(super) fn declare_use(
        &mut self,
        scope: usize,
        name: &str,
        kind: &SyntaxValue,
        args: &[Entry],
        spread: Option<Spread<'_>>,
    ) -> Option<usize> {
        let known: Vec<&str> = schema::instance(spread.is_some()).iter().map(|field| field.name).collect();
        let what = kind.str();
        for arg in args.iter().filter(|arg| !known.contains(&arg.name.as_str())) {
            let message = format!("`{what}` has no field `{}`", read::shorten(&arg.name));
            let error = arg.key.error(Code::UnknownField, message);
            self.report.unknown(error, &arg.name, "field", known.iter().copied().filter(|name| *name != "note"));
        }
        let Some(graph) = read::get(args, "graph") else {
            let help = "write `graph: \"name\"`, a name from `imports`";
            self.report.push(kind.error(Code::MissingInput, format!("`{what}` has no `graph`")).help(help));
            return None;
        };
        let import = read::text(graph, "graph", self.report)?;
        let docs = self.docs;
        let outer = &docs[self.scopes[scope].doc];
        let Some(index) = outer.document.import(&import) else {
            let names: Vec<&str> = outer.document.usable().collect();
            let message = format!("there is no import or local graph `{}`", read::shorten(&import));
            let error = graph.error(Code::UnknownVariant, message);
            match remedy::import_first(self.registry, &import, &names) {
                Some(help) => self.report.push(error.help(help)),
                None => self.report.unknown(error, &import, "import", names),
            }
            return None;
        };
        let doc = outer.imports[index].filter(|doc| docs[*doc].sound && self.sizes[*doc].is_some())?;
        let with = match read::get(args, "with") {
            Some(with) => read::unique(read::map(with, "with", self.report), "value", self.report),
            None => Vec::new(),
        };
        let instance = self.instance(scope, args, spread);
        let mut params = self.defaults_of(doc);
        params.facts = Some(Facts::of(&instance.canvas));
        let preset = self.preset_values(&instance, &docs[doc], &import);
        params.give_all(preset);
        self.with_params(scope, doc, &with, &mut params);
        let prefix = format!("{}{name}/", self.scopes[scope].prefix);
        if let Some(Spread { name, .. }) = spread {
            let all = format!("{}{name}/", self.scopes[scope].prefix);
            params.give_all(self.settings_of(&all, &docs[doc].document));
        }
        params.give_all(self.settings_of(&prefix, &docs[doc].document));
        if !self.is_as_pinned(scope, kind, doc, (&with, &params)) {
            return None;
        }
        defaults::follow(&docs[doc], &mut params, self.report);
        let child = self.declare(doc, prefix, params, Some((scope, kind.span())));
        (self.scopes[child].canvas, self.scopes[child].layout) = (instance.canvas, instance.layout);
        let given = self.with_inputs(scope, child, &import, &with);
        self.check_given(child, kind, &given);
        self.fill(child, &given);
        Some(child)
    }

    /// The defaults of a sub-graph's parameters, which are checked when the document is linked by itself.
    fn defaults_of(&mut self, doc: usize) -> Params {
        let (child, facts) = (&self.docs[doc], Facts::of(&self.canvas));
        self.defaults.entry(doc).or_insert_with(|| defaults::params(child, Some(facts), &mut Report::default())).clone()
    }

    /// Sets the parameters of a sub-graph that are listed in `with`.
    fn with_params(&mut self, scope: usize, doc: usize, with: &[Entry], params: &mut Params) {
        let docs = self.docs;
        let (child, folder) = (&docs[doc], docs[self.scopes[scope].doc].folder());
        for entry in with {
            let Some(decl) = child.document.param(&entry.name).flatten() else { continue };
            let outer = &self.scopes[scope].params;
            let value = substitute(&entry.value, outer, self.report).and_then(|value| {
                let base = value.base.unwrap_or_else(|| folder.to_owned());
                decl.value(&value.part, true, &base, self.report)
            });
            params.give(entry.name.clone(), value);
        }
    }

    /// The inputs of a sub-graph that are given a value in `with`.
    fn with_inputs(&mut self, scope: usize, child: usize, import: &str, with: &[Entry]) -> Vec<Option<Bound>> {
        let docs = self.docs;
        let document = &docs[self.scopes[child].doc].document;
        let mut given = vec![None; document.inputs.len()];
        for entry in with {
            if let Some(index) = document.input(&entry.name) {
                let ty = document.inputs[index].ty;
                given[index] = Some(ty.map_or(Bound::Broken, |ty| self.bind(scope, child, entry, ty)));
            } else if document.param(&entry.name).is_none() {
                let inputs = document.inputs.iter().map(|input| input.name.as_str());
                let names = inputs.chain(document.params.iter().map(|(param, _)| param.name.as_str()));
                let (import, name) = (read::shorten(import), read::shorten(&entry.name));
                let error =
                    entry.key.error(Code::UnknownField, format!("`{import}` has no input or parameter `{name}`"));
                self.report.unknown(error, &entry.name, "name", names);
            }
        }
        given
    }

    fn bind(&mut self, scope: usize, child: usize, entry: &Entry, ty: Accepts) -> Bound {
        let port = Port::Input(entry.name.clone());
        let (part, name) = if self.is_node(scope, &entry.value) {
            let name = format!("{}.{}", self.name_of_use(scope, child), entry.name);
            self.add_inline(scope, &name, &entry.value);
            (entry.value.clone(), name)
        } else {
            let Some(value) = substitute(&entry.value, &self.scopes[scope].params, self.report) else {
                return Bound::Broken;
            };
            match ports::literal(&value.part, ty, &port, value.is_text) {
                Ok(Literal::Constant(field)) => return Bound::Constant(field, value.part),
                Ok(Literal::Reference(name)) => (value.part, name),
                Err(error) => {
                    self.report.push(*error);
                    return Bound::Broken;
                }
            }
        };
        let slot = Slot::unresolved(port, ty, part.clone());
        if matches!(ty, Accepts::One(Type::Gray | Type::Rgb)) {
            let path = format!("{}{}", self.scopes[child].prefix, entry.name);
            let mut flat = Flat::new(scope, path, entry.key.clone(), "Input".to_owned(), None, Cow::Borrowed(&[]));
            flat.slots.push(slot);
            return Bound::Pass(self.add_flat(flat));
        }
        self.checks.push((scope, slot));
        Bound::Wire { scope, part, name }
    }
}
