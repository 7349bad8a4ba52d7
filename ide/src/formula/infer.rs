//! Types of the parts of a formula, as far as they are known while it is edited.
use super::super::paths::are_components;
use shibo_graph::syntax::formula::{Formula, Part, PartKind};
use shibo_value::{Accepts, Type};

/// The space that numbers are a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Space {
    /// They are the same everywhere.
    Constant,
    /// The canvas.
    Canvas,
    /// Space.
    Solid,
}

/// Type of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Inferred {
    /// Not known.
    Unknown,
    /// One to four numbers.
    Numbers(usize, Space),
    /// Numbers of pieces.
    Ids,
    /// The word of a choice.
    Word,
    /// Another value, such as a material.
    Object(Accepts),
}

impl Inferred {
    /// A constant number.
    pub(crate) const NUMBER: Self = Self::Numbers(1, Space::Constant);

    /// The type of a wire.
    pub(crate) fn of(ty: Accepts) -> Self {
        match ty {
            Accepts::One(Type::Ids) => Self::Ids,
            Accepts::One(ty) if ty.is_field() => Self::Numbers(ty.channels(), Space::Canvas),
            Accepts::One(ty) if ty.is_solid() => Self::Numbers(ty.channels(), Space::Solid),
            Accepts::One(Type::Picture) | Accepts::Field | Accepts::EveryField => Self::Unknown,
            Accepts::AnyVector | Accepts::Direction | Accepts::AnySolid | Accepts::Number | Accepts::Color => {
                Self::Unknown
            }
            Accepts::InSpace | Accepts::AnyNormal => Self::Unknown,
            Accepts::FieldOrSolid | Accepts::EveryFieldOrSolid | Accepts::FieldOrMaterial => Self::Unknown,
            ty @ (Accepts::One(_) | Accepts::AnyMaterial) => Self::Object(ty),
        }
    }

    /// The type of a wire with this value.
    pub(crate) fn ty(self) -> Option<Accepts> {
        let ty = match self {
            Self::Numbers(1, Space::Solid) => Type::Solid,
            Self::Numbers(3, Space::Solid) => Type::SolidColor,
            Self::Numbers(_, Space::Solid) => return None,
            Self::Numbers(1, _) => Type::Gray,
            Self::Numbers(2, _) => Type::Vec2,
            Self::Numbers(3, _) => Type::Rgb,
            Self::Numbers(..) => Type::Jacobian,
            Self::Ids => Type::Ids,
            Self::Object(ty) => return Some(ty),
            Self::Unknown | Self::Word => return None,
        };
        Some(Accepts::One(ty))
    }

    /// Number of components, if known.
    pub(crate) fn count(self) -> Option<usize> {
        if let Self::Numbers(count, _) = self { Some(count) } else { None }
    }

    /// The space, if known.
    pub(crate) fn space(self) -> Option<Space> {
        match self {
            Self::Numbers(_, space) => Some(space),
            Self::Ids => Some(Space::Canvas),
            _ => None,
        }
    }

    /// The type of components `letters` of this value.
    pub(crate) fn components(self, letters: &str) -> Self {
        let good = letters.split('.').all(are_components);
        let last = letters.rsplit('.').next().unwrap_or_default();
        match self {
            Self::Numbers(4, space) if good => Self::Numbers(1, space),
            Self::Numbers(2..=3, space) if good => Self::Numbers(last.len(), space),
            _ => Self::Unknown,
        }
    }
}

/// Types of names and calls.
pub(crate) trait Resolve {
    /// Type of a name without a `$`, with the parts after its dots.
    fn name(&self, path: &str) -> Inferred;

    /// Type of a parameter.
    fn param(&self, name: &str) -> Inferred;

    /// Number of components of the result of a function.
    fn call(&self, name: &str, values: &[Inferred]) -> Option<usize>;
}

/// Types of all parts of a formula.
pub(crate) fn infer(formula: &Formula, resolve: &dyn Resolve) -> Vec<Inferred> {
    let mut found: Vec<Inferred> = Vec::with_capacity(formula.parts().len());
    let mut done: Vec<usize> = Vec::new();
    for (index, part) in formula.parts().iter().enumerate() {
        let operands = done.split_off(done.len().saturating_sub(part.operands));
        let values: Vec<Inferred> = operands.iter().map(|operand| found[*operand]).collect();
        found.push(of_part(formula, part, &values, &found, resolve));
        done.push(index);
    }
    found
}

fn of_part(formula: &Formula, part: &Part, values: &[Inferred], found: &[Inferred], resolve: &dyn Resolve) -> Inferred {
    let word = part.word.map_or("", |word| formula.word(word));
    match part.kind {
        PartKind::Missing | PartKind::Unknown => Inferred::Unknown,
        PartKind::Number => Inferred::NUMBER,
        PartKind::Color => Inferred::Numbers(3, Space::Constant),
        PartKind::Param => {
            let (name, rest) = word[1..].split_once('.').unwrap_or((&word[1..], ""));
            let of = resolve.param(name);
            if rest.is_empty() { of } else { of.components(rest) }
        }
        PartKind::Name => {
            let (name, rest) = word.split_once('.').unwrap_or((word, ""));
            match formula.local(name, part.range.start) {
                Some(local) => {
                    let of = found.get(local.value).copied().unwrap_or(Inferred::Unknown);
                    if rest.is_empty() { of } else { of.components(rest) }
                }
                None => resolve.name(word),
            }
        }
        PartKind::Letters => values.first().map_or(Inferred::Unknown, |of| of.components(&word[1..])),
        PartKind::Sign | PartKind::Bracket | PartKind::Let => values.first().copied().unwrap_or(Inferred::Unknown),
        PartKind::Vector if values.len() <= 4 => Inferred::Numbers(values.len(), space(values)),
        PartKind::Vector => Inferred::Unknown,
        PartKind::Binary => {
            let compares =
                matches!(word, "==" | "!=") && values.iter().any(|of| matches!(of, Inferred::Word | Inferred::Ids));
            let counts = if compares { Some(1) } else { widest(values) };
            counts.map_or(Inferred::Unknown, |count| Inferred::Numbers(count, space(values)))
        }
        PartKind::Call => {
            resolve.call(word, values).map_or(Inferred::Unknown, |count| Inferred::Numbers(count, space(values)))
        }
    }
}

/// The space of a value that is computed from others.
fn space(values: &[Inferred]) -> Space {
    values.iter().filter_map(|of| of.space()).max().unwrap_or(Space::Constant)
}

/// Number of components of values that are combined component by component.
fn widest(values: &[Inferred]) -> Option<usize> {
    let known = values.iter().filter_map(|of| of.count()).max()?;
    let all = values.iter().all(|of| of.count().is_some());
    (all || known > 1).then_some(known)
}
