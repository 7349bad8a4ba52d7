//! Completion of node kinds.
use super::super::docs;
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::habits;
use super::super::view::{Body, Shape};
use super::super::walk::Spot;
use super::{Ask, Completion, Sort, Topic, matches};
use crate::manual::elsewhere;
use shibo_node::{KindInfo, OutputType, Role};
use shibo_value::{Accepts, Type};

/// Kinds that users of other programs look for first. The shipped graphs often write formulas in their place.
const EVERYDAY: [&str; 8] = ["Blend", "Blur", "GradientMap", "Levels", "Perlin", "Switch", "Transform", "Worley"];

/// The word whose manual describes formulas.
const FORMULA: &str = "formula";

/// Fewest letters, in bytes, that find a name of another program.
const LEAST: usize = 3;

/// Keywords that include other graphs.
const COMPOSED: [&str; 2] = ["Use", "Each"];

impl<'a> Ask<'a> {
    /// All kinds; those whose main output fits come first.
    pub(super) fn kinds(&self, expect: Expect<'a>) -> Vec<Completion> {
        let fits = expect.reference(self.cx).flatten();
        let body = self.following();
        let name = match (expect, self.trail.entry()) {
            (Expect::Entry(Section::Nodes, name), _) => Some(name),
            _ => None,
        };
        let at = self.owner(expect);
        let registry = self.cx.registry();
        let mut found = Vec::new();
        for kind in registry.kinds().filter_map(|kind| registry.info(kind)) {
            let mut score = self.score(kind, name, at);
            score += body.map_or(0.0, |body| mismatch(kind, body) * 30.0);
            score += fits.map_or(0.0, |fits| if main_fits(kind, fits) { 0.0 } else { 100.0 });
            let topic = Topic::Kind(kind.kind.clone());
            let offer = self.offer(&kind.kind, Sort::Kind, &docs::first_sentence(&kind.kind, Some(kind)), topic, score);
            let (insert, snippet) = if body.is_some() { (kind.kind.clone(), false) } else { snippet(kind) };
            found.push(Completion { insert, snippet, deprecated: docs::deprecated(&kind.doc), ..offer });
        }
        for kind in COMPOSED {
            let uses = body.map_or(0.0, |body| if body.get("graph").is_some() { -60.0 } else { 30.0 });
            let score = self.popular(kind, name) + uses;
            let detail = docs::first_sentence(kind, None);
            let offer = self.offer(kind, Sort::Kind, &detail, Topic::Kind(kind.to_owned()), score);
            let rest = if kind == "Use" { "(graph: \"$1\"$0)" } else { "(graph: \"$1\", over: $2, ids: \"$3\"$0)" };
            let (insert, snippet) =
                if body.is_some() { (kind.to_owned(), false) } else { (format!("{kind}{rest}"), true) };
            found.push(Completion { insert, snippet, ..offer });
        }
        if body.is_none() {
            found.push(Completion { topic: Topic::Kind(FORMULA.to_owned()), ..self.any_formula("a formula", 40.0) });
        }
        self.name_elsewhere(&mut found);
        found
    }

    /// Marks the kinds whose name in another program begins with the typed letters, if their own name does not.
    fn name_elsewhere(&self, found: &mut [Completion]) {
        let is_called = |one: &Completion, kind: &str| match &one.topic {
            Topic::Kind(own) => own == kind,
            _ => false,
        };
        let typed = self.cx.file.text.get(self.replace.start..self.at).unwrap_or_default();
        if typed.len() < LEAST {
            return;
        }
        for (kind, name) in elsewhere::begin_with(self.cx.registry(), typed) {
            let own = |one: &&mut Completion| is_called(one, kind) && matches(typed, kind).is_none_or(|rank| rank > 1);
            if let Some(one) = found.iter_mut().find(own) {
                let name = name.split_whitespace().collect::<Vec<_>>().join(" ");
                one.detail = format!("{name} in other programs: {}", one.detail);
                one.elsewhere = Some(name);
            }
        }
    }

    /// The brackets after the word, if there are any.
    fn following(&self) -> Option<&'a Body> {
        match self.trail.spot {
            Spot::Value(_, value) => match &value.shape {
                Shape::Call { body, .. } | Shape::Body(body) => Some(body),
                _ => None,
            },
            _ => None,
        }
    }

    /// The kind and field that get a value here.
    pub(super) fn owner(&self, expect: Expect<'a>) -> Option<(&'a str, &'a str)> {
        let field = match expect {
            Expect::Port(field, ..) | Expect::Value(field, _) => field,
            _ => return None,
        };
        match self.trail.node()?.inside {
            Expect::Kind(info) => Some((&info.kind, &field.name)),
            _ => None,
        }
    }

    fn popular(&self, kind: &str, name: Option<&str>) -> f64 {
        let habits = self.cx.world.habits();
        let named = name.map_or(0.0, |name| habits.named(name, kind));
        let everyday = if EVERYDAY.contains(&kind) { 1.5 } else { 0.0 };
        -(1.0 + habits.kind(kind)).ln() - everyday - 3.0 * (1.0 + named).ln()
    }

    /// Score of a kind by how common it is here.
    fn score(&self, info: &KindInfo, name: Option<&str>, at: Option<(&str, &str)>) -> f64 {
        let habits = self.cx.world.habits();
        let source = at.map_or(0.0, |(kind, port)| habits.source(kind, port, &info.kind));
        let own = name.is_some_and(|name| name.replace('_', "").eq_ignore_ascii_case(&info.kind));
        self.popular(&info.kind, name) - 2.0 * (1.0 + source).ln() - if own { 5.0 } else { 0.0 }
    }
}

/// Returns whether the main output of a kind fits a port.
fn main_fits(info: &KindInfo, port: Accepts) -> bool {
    match info.outputs.first().map(|output| output.ty) {
        Some(OutputType::Fixed(ty)) => ty.fits(port),
        Some(OutputType::Like(ports)) => {
            [Type::Gray, Type::Rgb, Type::Normal].iter().any(|ty| ty.fits(port)) || passes_on(info, ports, port)
        }
        Some(OutputType::ValueOf(ports)) => {
            let types = [Type::Gray, Type::Rgb, Type::Normal, Type::Solid, Type::SolidColor];
            types.iter().any(|ty| ty.fits(port)) || passes_on(info, ports, port)
        }
        Some(OutputType::ColorOf(_)) => Type::Rgb.fits(port) || Type::SolidColor.fits(port),
        Some(OutputType::NumberOf(_)) => Type::Gray.fits(port) || Type::Solid.fits(port),
        Some(OutputType::MaterialOf(_)) => Type::Material.fits(port) || Type::SolidMaterial.fits(port),
        Some(OutputType::Told) => true,
        None => false,
    }
}

/// Returns whether an output of the type of these ports may be vectors, matrices or numbers of pieces that fit a port.
fn passes_on(info: &KindInfo, ports: &[&str], port: Accepts) -> bool {
    let takes = |ty: Type| info.ports().any(|(field, own)| ports.contains(&&*field.name) && ty.fits(own.ty));
    [Type::Vec2, Type::Ids, Type::Jacobian].into_iter().any(|ty| ty.fits(port) && takes(ty))
}

/// Penalty of a kind for the fields already present: fields it lacks, and required fields that are missing.
fn mismatch(info: &KindInfo, body: &Body) -> f64 {
    let mut wrong = 0.0;
    for item in &body.items {
        let Some(name) = item.name().filter(|name| *name != "note") else { continue };
        match (info.field(name).map(|field| &field.role), item.value.as_ref().map(|value| &value.shape)) {
            (None, _) => wrong += 1.0,
            (Some(Role::Param(param)), Some(Shape::Number(_))) if !param.choices.is_empty() => wrong += 0.5,
            (Some(Role::Param(param)), Some(Shape::Word)) if param.choices.is_empty() => wrong += 0.2,
            _ => {}
        }
    }
    let missing = info.ports().filter(|(field, port)| port.required && body.get(&field.name).is_none()).count();
    // Among kinds with the same fields, the one with fewer other fields is closer.
    wrong + 0.8 * missing as f64 + 0.005 * info.fields.len() as f64
}

/// Snippet of a kind with its required ports and parameters to fill in.
fn snippet(info: &KindInfo) -> (String, bool) {
    let mut parts = Vec::new();
    for field in &info.fields {
        let number = parts.len() + 1;
        match &field.role {
            Role::Port(port) if port.required && port.list => parts.push(format!("{}: [\"${number}\"]", field.name)),
            Role::Port(port) if port.required => parts.push(format!("{}: \"${number}\"", field.name)),
            Role::Param(param) if param.required => parts.push(format!("{}: \"${number}\"", field.name)),
            _ => {}
        }
    }
    (format!("{}({}$0)", info.kind, parts.join(", ")), true)
}

/// Name of a field in the counts of connections.
pub(super) fn source_of(kind: &str, port: &str) -> String {
    habits::source(kind, port)
}
