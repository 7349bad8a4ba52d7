//! The settings of an instance in a `Use`, other than `with`: preset, seed, and layout on the canvas.
use super::convert;
use super::document::Document;
use super::files::Doc;
use super::layout::{Layout, layout};
use super::linker::{Bound, Flat, Linker, Port, Slot, Target};
use super::part::{Entry, Shape, SyntaxValue};
use super::presets::preset_names;
use super::read::{self, shorten};
use super::report::Report;
use super::subst::substitute;
use crate::GraphUse;
use crate::diagnostics::{Code, Diagnostic};
use crate::value::{Accepts, Canvas, Key, Type};
use petgraph::graph::NodeIndex;
use std::borrow::Cow;

/// Returns true if an instance's value of this type can be laid out.
pub(super) fn can_move(ty: Type) -> bool {
    matches!(ty, Type::Ids | Type::Vec2 | Type::Jacobian) || can_choose(ty)
}

/// Returns true if `Each` can select among values of this type.
pub(super) fn can_choose(ty: Type) -> bool {
    ty == Type::Material || ty.fits(Accepts::Field)
}

/// Identifies an instance of an `Each`.
#[derive(Clone, Copy)]
pub(super) struct Spread<'n> {
    /// The name of the `Each`.
    pub(super) name: &'n str,
    /// Its number, from 0.
    pub(super) index: usize,
}

/// The settings of an instance.
pub(super) struct Instance {
    /// The names of its presets, and their place.
    presets: Option<(Vec<String>, SyntaxValue)>,
    /// The canvas of its graph.
    pub(super) canvas: Canvas,
    /// The layout, if it differs from that of the graph itself.
    pub(super) layout: Option<Layout>,
}

impl Linker<'_> {
    /// Reads `preset`, `seed` and `canvas` of a `Use` in `scope`.
    pub(super) fn instance(&mut self, scope: usize, args: &[Entry], spread: Option<Spread<'_>>) -> Instance {
        let mut instance = Instance { presets: None, canvas: self.scopes[scope].canvas, layout: None };
        let value = |linker: &mut Self, name: &str| {
            let part = read::get(args, name)?;
            substitute(part, &linker.scopes[scope].params, linker.report).map(|value| value.part)
        };
        if let Some(part) = value(self, "preset") {
            let names = read::text(&part, "preset", self.report);
            instance.presets = names.map(|names| (preset_names(&names).map(str::to_owned).collect(), part));
        }
        if let Some(layout) = value(self, "canvas").and_then(|part| layout(&part, instance.canvas, self.report)) {
            let mut layout = layout;
            instance.canvas = layout.own_canvas(self.report);
            instance.layout = Some(layout);
        }
        if let Some(seed) = value(self, "seed").and_then(|part| super::canvas::seed(&part, self.report)) {
            instance.canvas.seed = instance_seed(instance.canvas.seed, seed);
        }
        if let Some(Spread { index, .. }) = spread {
            instance.canvas.seed = instance_seed(instance.canvas.seed, index as u64);
        }
        instance
    }

    /// The values of the presets of an instance of `doc`, which is imported as `name`.
    pub(super) fn preset_values(&mut self, instance: &Instance, doc: &Doc, name: &str) -> super::params::Values {
        let mut values = super::params::Values::new();
        let Some((wanted, part)) = &instance.presets else { return values };
        for wanted in wanted {
            let presets = &doc.document.presets;
            let Some((_, entries)) = presets.iter().find(|(preset, _)| preset.name == *wanted) else {
                let names = presets.iter().map(|(preset, _)| preset.name.as_str());
                let message = format!("`{}` has no preset `{}`", shorten(name), shorten(wanted));
                self.report.unknown(part.error(Code::UnknownVariant, message), wanted, "preset", names);
                continue;
            };
            for entry in entries {
                // The values are checked when the document is linked by itself.
                let decl = doc.document.param(&entry.name).flatten();
                let value = decl.and_then(|decl| decl.value(&entry.value, false, doc.folder(), &mut Report::default()));
                values.insert(entry.name.clone(), value);
            }
        }
        values
    }

    /// The command-line values for the parameters of the instance `prefix` of `document`.
    pub(super) fn settings_of(&mut self, prefix: &str, document: &Document) -> super::params::Values {
        let mut values = super::params::Values::new();
        let settings = self.settings;
        for setting in settings.iter().filter(|setting| setting.prefix == prefix) {
            setting.used.set(true);
            let name = &setting.param;
            let Some(decl) = document.param(name) else {
                let names = document.params.iter().map(|(param, _)| param.name.as_str());
                let message = format!("`{}` has no parameter `{}`", prefix.trim_end_matches('/'), shorten(name));
                let error = Diagnostic::new(Code::UnknownParam, setting.path, message);
                if document.input(name).is_some() {
                    let help = format!("`{name}` is an input of the sub-graph; give it in `with`");
                    self.report.push(error.help(help));
                } else {
                    self.report.unknown(error, name, "parameter", names);
                }
                continue;
            };
            let value = decl.and_then(|decl| {
                let part = super::command_line::argument(decl, &setting.value, setting.span);
                decl.value(&part, true, self.working_dir, self.report)
            });
            values.insert(name.clone(), value);
        }
        values
    }

    /// Reports command-line values that no instance used.
    pub(super) fn check_settings(&mut self) {
        if self.report.errors() > 0 {
            return;
        }
        for setting in self.settings.iter().filter(|setting| !setting.used.get()) {
            let wanted = setting.prefix.trim_end_matches('/');
            let names: Vec<_> = self.scopes[1..].iter().map(|scope| scope.prefix.trim_end_matches('/')).collect();
            let message = format!("there is no sub-graph `{}`", shorten(wanted));
            let error = Diagnostic::new(Code::UnknownNode, setting.path, message);
            if names.is_empty() {
                self.report.push(error.help("the graph has no `Use`; give the parameter by its name alone"));
            } else {
                self.report.unknown(error, wanted, "sub-graph", names);
            }
        }
    }

    /// The node that lays out an output of an instance (the first output if none is named), if the instance has a
    /// layout. Created on first use. `from` is the output's reference in the scope of the instance.
    pub(super) fn laid_out(&mut self, child: usize, output: Option<&str>, from: &SyntaxValue) -> Option<usize> {
        let layout = self.scopes[child].layout.clone()?;
        let first = self.docs[self.scopes[child].doc].document.outputs.first();
        let output = output.or(first.map(|first| first.name.as_str()))?;
        if let Some(flat) = self.laid.get(&(child, output.to_owned())) {
            return Some(*flat);
        }
        let name = format!("{}.{output}", self.scopes[child].prefix.trim_end_matches('/'));
        let mut flat = Flat::new(child, name, layout.part.clone(), "Layout".to_owned(), None, Cow::Borrowed(&[]));
        let port = Port::Input(convert::PORT.to_owned());
        flat.slots.push(Slot::unresolved(port, Accepts::Field, from.clone()));
        flat.layout = Some(layout);
        let flat = self.add_flat(flat);
        self.laid.insert((child, output.to_owned()), flat);
        Some(flat)
    }

    /// The error for a reference at `part` to an output of an instance that cannot be laid out.
    pub(super) fn check_movable(&self, part: &SyntaxValue, target: &Target) -> Option<Diagnostic> {
        let Target::Out { flat, .. } = *target else { return None };
        if self.flats[flat].chooses.is_some() {
            let ty = self.type_of(target).filter(|ty| !can_choose(*ty))?;
            let message = format!("`Each` chooses among fields and materials; {} is {ty}", shorten(part.str()));
            let help = "draw it in the sub-graph";
            return Some(part.error(Code::TypeMismatch, message).help(help));
        }
        let layout = self.flats[flat].layout.as_ref()?;
        let ty = self.type_of(target).filter(|ty| !can_move(*ty))?;
        let message = format!("`canvas` moves fields and materials; {} is {ty}", shorten(part.str()));
        let help = "draw it in the sub-graph, or leave `canvas` out of that `Use`";
        Some(part.error(Code::TypeMismatch, message).help(help).related(layout.part.span(), "it is moved here"))
    }

    /// The uses of sub-graphs, with the nodes of their outputs.
    pub(super) fn uses(&mut self) -> Vec<GraphUse> {
        let docs = self.docs;
        let made = self.flats.len();
        let mut uses = Vec::new();
        for child in 1..self.scopes.len() {
            let doc = &docs[self.scopes[child].doc];
            let mut outputs = Vec::new();
            for output in &doc.document.outputs {
                let Some((from, Shape::Text(name))) = output.from.as_ref().map(|from| (from, from.shape())) else {
                    continue;
                };
                let target = match &self.scopes[child].layout {
                    Some(_) => {
                        self.laid.get(&(child, output.name.clone())).map(|flat| Target::Out { flat: *flat, output: 0 })
                    }
                    None => Some(self.resolve(child, from, &name).target),
                };
                // Omit layout nodes that were created only by this resolution: nothing reads them.
                if let Some(Target::Out { flat, output: port }) = target.filter(|target| self.is_made(target)) {
                    outputs.push((output.name.clone(), NodeIndex::new(flat), port));
                }
            }
            let name = self.scopes[child].prefix.trim_end_matches('/').to_owned();
            uses.push(GraphUse { name, path: doc.path.clone(), outputs });
        }
        self.flats.truncate(made);
        uses.extend(self.eaches());
        uses
    }

    fn is_made(&self, target: &Target) -> bool {
        matches!(target, Target::Out { flat, .. } if self.flats[*flat].node.is_some())
    }

    /// The stand-in for an input without a default: a material without channels; missing values of a used graph are
    /// reported by `check_given`.
    pub(super) fn without_default(&mut self, scope: usize, input: &super::document::InputDecl) -> Bound {
        let name = format!("{}{}", self.scopes[scope].prefix, input.name);
        Bound::Pass(self.add_flat(Flat::new(
            scope,
            name,
            input.kind.clone(),
            "Input".to_owned(),
            None,
            Cow::Borrowed(&[]),
        )))
    }

    /// Reports material inputs of an instance without a value and without a default.
    pub(super) fn check_given(&mut self, child: usize, kind: &SyntaxValue, given: &[Option<Bound>]) {
        let docs = self.docs;
        let inputs = &docs[self.scopes[child].doc].document.inputs;
        for (input, given) in inputs.iter().zip(given) {
            if given.is_none() && input.default.is_none() && input.ty.is_some() {
                let message = format!("the sub-graph needs `{}` (Material)", input.name);
                let help = format!("write `with: {{ \"{}\": \"node\" }}`", input.name);
                self.report.push(kind.error(Code::MissingInput, message).help(help));
            }
        }
    }
}

/// The canvas seed of an instance.
fn instance_seed(canvas: u64, seed: u64) -> u64 {
    let key = Key::of("seed of an instance", &[&canvas.to_le_bytes(), &seed.to_le_bytes()]);
    let mut word = [0; 8];
    word.copy_from_slice(&key.as_bytes()[..8]);
    u64::from_le_bytes(word)
}
