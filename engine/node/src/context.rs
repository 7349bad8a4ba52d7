//! The view of a node while it is evaluated.
use super::{CanvasFacts, In, PortType};
use crate::diagnostics::{Code, Problem};
use crate::value::files::FileHandle;
use crate::value::{Accepts, Canvas, Cut, Evaluator, Field, Key, Solid, Stop, Tiling, Type, Value};
use glam::DVec2;

/// The data that the engine passes to a node to evaluate it. The node sees it as a [`Context`].
pub struct Call<'a> {
    /// The kind of the node.
    pub kind: &'a str,
    /// The canvas.
    pub canvas: &'a Canvas,
    /// The values at its ports, by slot.
    pub inputs: &'a [Value],
    /// Its files, with the parameter that names each.
    pub files: &'a [(&'static str, FileHandle)],
    /// The engine.
    pub evaluator: &'a dyn Evaluator,
}

/// The view of a node while it is evaluated: its inputs, its files, the facts of the canvas that it declares, and the
/// engine.
pub struct Context<'a> {
    /// The facts of the canvas that it declares.
    pub canvas: &'a CanvasFacts,
    /// The engine.
    pub evaluator: &'a dyn Evaluator,
    kind: &'a str,
    inputs: &'a [Value],
    files: &'a [(&'static str, FileHandle)],
}

impl<'a> Context<'a> {
    /// Restricts a call to the facts that the node declares.
    pub(super) fn new(call: &Call<'a>, canvas: &'a CanvasFacts) -> Self {
        Self { canvas, evaluator: call.evaluator, kind: call.kind, inputs: call.inputs, files: call.files }
    }
}

impl Context<'_> {
    /// The value at a port.
    pub fn get<T: PortType>(&self, port: &In<T>) -> Result<T::Got, Stop> {
        let value = match (port.slot(), port.default_value()) {
            (Some(slot), _) => self.inputs.get(slot as usize).and_then(|value| value.convert(T::ACCEPTS)),
            (None, Some(value)) => Some(Value::Field(constant(T::ACCEPTS, value))),
            (None, None) => None,
        };
        value
            .and_then(T::take)
            .ok_or_else(|| Problem::new(Code::MissingInput, format!("a port for {} has no value", T::ACCEPTS)).into())
    }

    /// Value at an optional port.
    pub fn get_opt<T: PortType>(&self, port: &Option<In<T>>) -> Result<Option<T::Got>, Stop> {
        port.as_ref().map(|port| self.get(port)).transpose()
    }

    /// The values at a port that takes a list.
    pub fn get_all<T: PortType>(&self, ports: &[In<T>]) -> Result<Vec<T::Got>, Stop> {
        ports.iter().map(|port| self.get(port)).collect()
    }

    /// The size of the canvas in mm.
    pub fn size_mm(&self) -> DVec2 {
        self.canvas.size_mm()
    }

    /// The directions in which the result must repeat.
    pub fn tiling(&self) -> Tiling {
        self.canvas.tile()
    }

    /// The seed for random numbers, derived from the canvas' seed, the kind and the node's `seed` parameter.
    pub fn seed(&self, seed: u64) -> u64 {
        seed_of(self.canvas.seed(), self.kind, seed)
    }

    /// Gives a key to a solid that several outputs of the node share but that is not an output itself. So its cuts can
    /// be cached, and their work is counted for the node.
    pub fn shared(&self, name: &str, solid: Solid) -> Solid {
        match self.evaluator.key() {
            Some(key) => solid.keyed(Key::of("shared part", &[key.as_bytes(), name.as_bytes()])).owned_by(key),
            None => solid,
        }
    }

    /// Like [`shared`](Self::shared), for a part that depends only on another solid and on the code called `name`.
    /// Nodes with the same part compute it once. `name` should include the kind and the version of the node.
    pub fn shared_of(&self, name: &str, solid: Solid, of: &Solid) -> Solid {
        match (self.evaluator.key(), of.key()) {
            (Some(owner), Some(key)) => {
                solid.keyed(Key::of("shared part of a solid", &[key.as_bytes(), name.as_bytes()])).owned_by(owner)
            }
            _ => self.shared(name, solid),
        }
    }

    /// Like [`shared`](Self::shared), for a field: its tiles are kept if several fields read it.
    pub fn shared_field(&self, name: &str, field: Field) -> Field {
        match self.evaluator.key() {
            Some(key) => field.keyed(Key::of("shared part", &[key.as_bytes(), name.as_bytes()])).owned_by(key),
            None => field,
        }
    }

    /// The field of a cut through `solid`. Nodes that make the same cut share it.
    pub fn cut(&self, solid: &Solid, cut: &Cut) -> Field {
        self.evaluator.cuts().map_or_else(|| solid.cut(cut), |cuts| cuts.cut(solid, cut))
    }

    /// All files that the parameter `field` names; several only with `<UDIM>`.
    pub fn files(&self, field: &str) -> Vec<&FileHandle> {
        self.files.iter().filter(|(name, _)| *name == field).map(|(_, file)| file).collect()
    }

    /// The file that the parameter `field` names.
    pub fn file(&self, field: &str) -> Option<&FileHandle> {
        self.files.iter().find(|(name, _)| *name == field).map(|(_, file)| file)
    }

    /// Fails if the work was cancelled. Call it about every millisecond during long work.
    pub fn check(&self) -> Result<(), Stop> {
        self.evaluator.check()
    }
}

/// The seed for random numbers of a node: of the canvas' seed, the kind and the node's `seed` parameter.
pub fn seed_of(canvas: u64, kind: &str, seed: u64) -> u64 {
    let key = Key::of("seed", &[&canvas.to_le_bytes(), kind.as_bytes(), &seed.to_le_bytes()]);
    let mut word = [0; 8];
    word.copy_from_slice(&key.as_bytes()[..8]);
    u64::from_le_bytes(word)
}

/// The constant field for the default number of a port.
fn constant(port: Accepts, value: f32) -> Field {
    let ty = port.only().unwrap_or(Type::Gray);
    Field::constant(ty, &vec![value; ty.channels().max(1)])
}

/// The results of a node, by output name.
#[derive(Clone, Debug, Default)]
pub struct Outputs(Vec<(&'static str, Value)>);

/// Name under which [`Outputs::one`] keeps the main output until the engine sets the real one.
const MAIN: &str = "";

impl Outputs {
    /// A main output alone.
    pub fn one(value: impl Into<Value>) -> Self {
        Self(vec![(MAIN, value.into())])
    }

    /// Adds another output.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl Into<Value>) -> Self {
        self.0.push((name, value.into()));
        self
    }

    /// Value of the output `name`; `main` tells whether this is the main output.
    pub fn take(&self, name: &str, main: bool) -> Option<&Value> {
        self.0.iter().find(|(n, _)| *n == name || (main && *n == MAIN)).map(|(_, value)| value)
    }
}
