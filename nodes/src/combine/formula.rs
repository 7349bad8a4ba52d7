//! Meaning of the names in the formula of an [`Expression`](super::Expression).
use glam::DVec2;
use shibo_value::diagnostics::Code;
use shibo_value::expression::{Meaning, Names, Value};

/// The names of the ports.
pub(super) const PORTS: [&str; 4] = ["a", "b", "c", "d"];
/// Names of the position, in the order of its planes.
pub(super) const PLACES: [&str; 4] = ["x", "y", "u", "v"];
const FACTS: [&str; 3] = ["canvas.width", "canvas.height", "canvas.seed"];

/// Knowledge about the input of a port.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Port {
    /// Nothing is connected.
    Open,
    /// An input whose components are not known yet.
    Something,
    /// A field with this number of components.
    Field(usize),
    /// A constant.
    Constant(Vec<f64>),
}

/// Resolves the names in a formula.
pub(super) struct InFormula {
    pub(super) ports: [Port; 4],
    pub(super) size: DVec2,
    pub(super) canvas_seed: u64,
    pub(super) seed: u64,
}

impl InFormula {
    fn port(&self, name: &str) -> Option<Meaning> {
        let index = PORTS.iter().position(|port| *port == name)?;
        let first = PLACES.len() + 4 * index;
        Some(match &self.ports[index] {
            Port::Open => {
                let message = format!("`{name}` is not connected");
                Meaning::Wrong(
                    Code::MissingInput,
                    message,
                    Some(format!("write `{name}: \"node\"` beside the formula")),
                )
            }
            Port::Something => Meaning::Any { first },
            Port::Field(count) => Meaning::Planes { first, count: *count },
            Port::Constant(values) => Meaning::Known(match values[..] {
                [value] => Value::Number(value),
                _ => Value::Vector(values.clone()),
            }),
        })
    }
}

impl Names for InFormula {
    fn param(&mut self, name: &str) -> Meaning {
        let help = "parameters stand in formulas that are plain texts".to_owned();
        Meaning::Wrong(Code::UnknownParam, format!("`${name}` has no value here"), Some(help))
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        if let Some(place) = PLACES.iter().position(|place| *place == name) {
            return Some(Meaning::Planes { first: place, count: 1 });
        }
        if let Some(fact) = FACTS.iter().position(|fact| *fact == name) {
            let facts = [self.size.x, self.size.y, self.canvas_seed as f64];
            return Some(Meaning::Known(Value::Number(facts[fact])));
        }
        self.port(name)
    }

    fn all(&self) -> Vec<String> {
        let connected = PORTS.iter().zip(&self.ports).filter(|(_, port)| **port != Port::Open).map(|(name, _)| *name);
        connected.chain(PLACES).chain(FACTS).map(str::to_owned).collect()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(self.canvas_seed.wrapping_add(self.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }
}

/// Increase of each position from one repeat of the canvas to the next.
pub(super) fn growth(size: DVec2) -> [[f64; 2]; 4] {
    [[size.x, 0.0], [0.0, size.y], [1.0, 0.0], [0.0, 1.0]]
}
