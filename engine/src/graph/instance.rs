//! What a `Use` says of its instance besides the values in `with`: a preset, a seed, and how it lies on the canvas.
use super::convert;
use super::document::Document;
use super::files::Doc;
use super::part::{Entry, Part, Shape};
use super::read::{self, mismatch, shorten};
use super::report::Report;
use super::scope::{Bound, Flat, Port, Slot, Target, Unit};
use super::subst::{number_text, substitute};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::graph::GraphUse;
use crate::node::{Arg, DynNode};
use crate::registry::Registry;
use crate::value::{Accepts, Canvas, Key, Type};
use glam::DVec2;
use petgraph::graph::NodeIndex;
use std::borrow::Cow;
use std::cell::Cell;
use std::sync::Arc;

/// The fields of `Use`, as they are suggested.
pub(super) const FIELDS: [&str; 6] = ["graph", "with", "preset", "seed", "canvas", "note"];
/// How many canvases wide the graph of an instance is made at most, so that it fills a canvas that does not tile.
const MOST_CANVASES: f64 = 8.0;
/// Between which sizes an instance may be scaled, as in the kind that moves fields.
const SCALES: (f64, f64) = (1e-3, 1e3);

/// A value from the command line for a parameter of an instance.
pub(super) struct Setting {
    /// The names of the `Use`s on the way, each with a slash after it, as in [`Scope::prefix`](super::scope::Scope).
    pub(super) prefix: String,
    /// The parameter.
    pub(super) param: String,
    /// The value as typed.
    pub(super) value: String,
    /// Where the value stands.
    pub(super) span: Span,
    /// Where the path to the parameter stands.
    pub(super) path: Span,
    /// Whether there is such an instance.
    pub(super) used: Cell<bool>,
}

/// How an instance lies on the canvas of the graph that uses it.
#[derive(Clone)]
pub(super) struct Layout {
    /// Where that is written.
    part: Part,
    /// The canvas that it lies on.
    pub(super) canvas: Canvas,
    scale: DVec2,
    angle: f64,
    offset: DVec2,
    /// The middle of the instance's own canvas.
    middle: DVec2,
}

impl Layout {
    /// From a place on the canvas to one in the instance, both counted from the middle.
    fn inverse(&self, place: DVec2) -> DVec2 {
        let (sin, cos) = libm::sincos(-self.angle.to_radians());
        DVec2::new(cos, sin).rotate(place - self.offset) / self.scale
    }

    /// The canvas of the instance, large enough that it has no empty corners where nothing repeats.
    fn own_canvas(&mut self, report: &mut Report) -> Canvas {
        let half = self.canvas.size_mm * 0.5;
        let corners = [half, -half, DVec2::new(half.x, -half.y), DVec2::new(-half.x, half.y)];
        let reach = corners.iter().fold(DVec2::ZERO, |reach, corner| reach.max(self.inverse(*corner).abs()));
        let mut size = self.canvas.size_mm;
        let mut small = false;
        let mut grow = |size: &mut f64, reach: f64, half: f64| {
            // Powers of two: most changes of the layout leave the size alone, and so the graph that is moved.
            let mut wanted = 1.0;
            while wanted < reach / half - 1e-9 {
                wanted *= 2.0;
            }
            let most = MOST_CANVASES.min(Canvas::MAX_SIZE_MM / *size);
            small |= wanted > most;
            *size *= wanted.min(most.max(1.0));
        };
        if !self.canvas.tile.x {
            grow(&mut size.x, reach.x, half.x);
        }
        if !self.canvas.tile.y {
            grow(&mut size.y, reach.y, half.y);
        }
        if small {
            let message = "the instance lies too far away, or is too small, to fill the canvas";
            let help = "its graph is made on a canvas at most 8 times as large as this one";
            report.push(self.part.error(Code::Advice, message).help(help).as_warning());
        }
        self.middle = size * 0.5;
        Canvas { size_mm: size, ..self.canvas }
    }

    /// The node that moves a value of a type, and its kind.
    pub(super) fn node(&self, registry: &Registry, ty: Type) -> Option<(String, Arc<dyn DynNode>)> {
        let pair = |pair: DVec2| format!("({}, {})", number_text(pair.x), number_text(pair.y));
        let (scale, angle, middle) = (pair(self.scale), number_text(self.angle), pair(self.middle));
        let offset = pair(self.offset + self.canvas.size_mm * 0.5 - self.middle);
        let same = self.middle == self.canvas.size_mm * 0.5;
        let mut args = vec![
            (convert::PORT, Arg::Slot(0)),
            ("scale", Arg::Ron(&scale)),
            ("angle", Arg::Ron(&angle)),
            ("offset", Arg::Ron(&offset)),
        ];
        if !same {
            args.push(("pivot", Arg::Ron(&middle)));
        }
        let (kind, built) = registry.lay_out(ty, &args)?;
        Some((kind.to_owned(), built.ok()?))
    }
}

/// Whether an instance's value of this type can be laid out.
pub(super) fn can_move(ty: Type) -> bool {
    ty == Type::Ids || can_choose(ty)
}

/// Whether one of several instances' values of this type can be chosen.
pub(super) fn can_choose(ty: Type) -> bool {
    ty == Type::Material || ty.fits(Accepts::Field)
}

/// Which of the instances of an `Each` it is.
#[derive(Clone, Copy)]
pub(super) struct Spread<'n> {
    /// The name of the `Each`.
    pub(super) name: &'n str,
    /// The number, from 0.
    pub(super) index: usize,
}

/// What a `Use` says of its instance.
pub(super) struct Instance {
    /// The names of its presets and where they are written.
    presets: Option<(Vec<String>, Part)>,
    /// The canvas of its graph.
    pub(super) canvas: Canvas,
    /// How it is laid out, unless it lies as the graph does by itself.
    pub(super) layout: Option<Layout>,
}

impl Unit<'_> {
    /// Reads `preset`, `seed` and `canvas` of a `Use` in `scope`.
    pub(super) fn instance(&mut self, scope: usize, args: &[Entry], spread: Option<Spread<'_>>) -> Instance {
        let mut instance = Instance { presets: None, canvas: self.scopes[scope].canvas, layout: None };
        let value = |unit: &mut Self, name: &str| {
            let part = read::get(args, name)?;
            substitute(part, &unit.scopes[scope].params, unit.report).map(|value| value.part)
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

    /// The values of the presets of an instance of `doc`; `name` is that of the import.
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
                // The values are checked where the document is linked by itself.
                let decl = doc.document.param(&entry.name).flatten();
                let value = decl.and_then(|decl| decl.value(&entry.value, false, doc.folder(), &mut Report::default()));
                values.insert(entry.name.clone(), value);
            }
        }
        values
    }

    /// The values that the command line gives to the parameters of the instance `prefix` of `document`.
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
                let part = super::load::argument(decl, &setting.value, setting.span);
                decl.value(&part, true, self.working_dir, self.report)
            });
            values.insert(name.clone(), value);
        }
        values
    }

    /// Reports values of the command line that reach no instance.
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

    /// The node that lays out an output of an instance, the first if none is named, if the instance is laid out at all. It
    /// is made when it is first needed. `from` is what the output is in the scope of the instance.
    pub(super) fn laid_out(&mut self, child: usize, output: Option<&str>, from: &Part) -> Option<usize> {
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

    /// The error for a reference, written at `part`, to an output of an instance that cannot be laid out.
    pub(super) fn check_movable(&self, part: &Part, target: &Target) -> Option<Diagnostic> {
        let Target::Out { flat, .. } = *target else { return None };
        if self.flats[flat].chooses.is_some() {
            let ty = self.type_of(target).filter(|ty| !can_choose(*ty))?;
            let message = format!("`Each` chooses among fields and materials; {} is {ty}", shorten(part.str()));
            let help = "draw it in the sub-graph";
            return Some(part.error(Code::TypeMismatch, message).help(help));
        }
        let layout = self.flats[flat].layout.as_ref()?;
        let ty = self.type_of(target).filter(|ty| !can_move(*ty))?;
        let message =
            format!("`canvas` moves colours, numbers, normals, ids and materials; {} is {ty}", shorten(part.str()));
        let help = "draw it in the sub-graph, or leave `canvas` out of that `Use`";
        Some(part.error(Code::TypeMismatch, message).help(help).related(layout.part.span(), "it is moved here"))
    }

    /// The uses of sub-graphs with the nodes that their outputs come from.
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
                // What is resolved only now may be laid out for nobody.
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

    /// What stands for an input without a default: a material without channels, unless somebody uses the graph and has
    /// forgotten to give one.
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

    /// Reports the material inputs of an instance that are given nothing and have no default.
    pub(super) fn check_given(&mut self, child: usize, kind: &Part, given: &[Option<Bound>]) {
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

/// The presets that are meant by `a+b`, the later ones last.
pub(super) fn preset_names(text: &str) -> impl Iterator<Item = &str> {
    text.split('+').map(str::trim)
}

/// The seed of the canvas of an instance.
fn instance_seed(canvas: u64, seed: u64) -> u64 {
    let key = Key::of("seed of an instance", &[&canvas.to_le_bytes(), &seed.to_le_bytes()]);
    let mut word = [0; 8];
    word.copy_from_slice(&key.as_bytes()[..8]);
    u64::from_le_bytes(word)
}

fn layout(part: &Part, canvas: Canvas, report: &mut Report) -> Option<Layout> {
    let fields = read::fields(part, "`canvas` of `Use`", &["scale", "angle", "offset"], report)?;
    let mut layout = Layout {
        part: part.clone(),
        canvas,
        scale: DVec2::ONE,
        angle: 0.0,
        offset: DVec2::ZERO,
        middle: canvas.size_mm * 0.5,
    };
    let mut good = true;
    for field in &fields {
        match field.name.as_str() {
            "scale" => match two(&field.value, "scale", SCALES, report) {
                Some(scale) => layout.scale = scale,
                None => good = false,
            },
            "angle" => match within(&field.value, "angle", (-360.0, 360.0), report) {
                Some(angle) => layout.angle = angle,
                None => good = false,
            },
            _ => match two(&field.value, "offset", (-1e6, 1e6), report) {
                Some(offset) => layout.offset = offset,
                None => good = false,
            },
        }
    }
    good.then_some(layout)
}

fn within(part: &Part, what: &str, (lo, hi): (f64, f64), report: &mut Report) -> Option<f64> {
    let value = read::number(part, what, report)?;
    if (lo..=hi).contains(&value) {
        return Some(value);
    }
    let message = format!("{what} is `{}`; it must be between {lo} and {hi}", shorten(part.str()));
    report.push(part.error(Code::OutOfRange, message));
    None
}

/// A number for both directions, or one for each.
fn two(part: &Part, what: &str, range: (f64, f64), report: &mut Report) -> Option<DVec2> {
    match part.shape() {
        Shape::Number(_) => within(part, what, range, report).map(DVec2::splat),
        Shape::Tuple(items) if items.len() == 2 => {
            let (x, y) = (within(&items[0], what, range, report), within(&items[1], what, range, report));
            Some(DVec2::new(x?, y?))
        }
        _ => {
            report.push(mismatch(part, &format!("`{what}`"), "a number or a pair of numbers"));
            None
        }
    }
}
