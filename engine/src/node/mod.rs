//! What a node is: a documented serde struct of ports and parameters, and how to evaluate it.
//!
//! ```
//! use schemars::JsonSchema;
//! use serde::{Deserialize, Serialize};
//! use shibo_engine::node::{AnyField, Context, In, Node, Output, Outputs};
//! use shibo_engine::value::{Field, Halo, Stop, Tile};
//!
//! /// Turns values upside down: 1 becomes 0.
//! #[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
//! #[serde(default, deny_unknown_fields)]
//! pub struct Negate {
//!     /// What to turn upside down.
//!     pub input: In<AnyField>,
//! }
//!
//! impl Node for Negate {
//!     const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "One minus the input.")];
//!
//!     fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
//!         let input = cx.get(&self.input)?;
//!         let negate = |out: &mut Tile, [input]: [&Tile; 1]| {
//!             out.data_mut().iter_mut().zip(input.data()).for_each(|(o, i)| *o = 1.0 - i);
//!             Ok(())
//!         };
//!         Ok(Outputs::one(Field::map(input.ty(), [input], Halo::NONE, negate)))
//!     }
//! }
//! ```
//!
//! Everything about a node follows from that one declaration: parsing, type check, range check, cache key, manual.
//! Attributes that the engine reads from the schema of a parameter: `range(min, max)` or, for parameters that are not
//! plain numbers, `extend("minimum" = …, "maximum" = …)`, also of ports, where it bounds the numbers that are written in place of a wire; `extend("exclusiveMinimum" = …)`; `extend("unit" = "mm")`;
//! `extend("infinite" = true)` where `inf` is allowed. Fields of structs in a list may be ports. A list of ports may be empty with `extend("optional" = true)`.
mod build;
mod channels;
mod context;
mod facts;
mod info;
mod param_type;
mod params;
mod port;
mod spelling;
mod written;

pub use build::{Arg, BuildError, Built, DynNode, build};
pub(crate) use build::{Functions, ron_options};
pub use channels::{MaterialInputs, Taken};
pub use context::{Call, Context, Outputs};
pub use facts::CanvasFacts;
pub use info::{Bounds, Choice, FieldInfo, KindInfo, ParamInfo, PortInfo, Role};
pub use param_type::ParamType;
pub use params::{Color, FilePath, Formula, Linear, Range, Xy, parse_color};
pub use port::{
    AnyField, AnySolid, AnyVector, Direction, EveryField, Gray, IdsField, In, JacobianField, NormalField, PortType,
    Rgb, SolidColor, SolidNumber, SolidVector, Vec2Field,
};
pub use spelling::spell_number;
pub use written::Written;

use crate::diagnostics::Problem;
use crate::value::{ChannelSet, Stop, Tiling, Type};
use glam::UVec2;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// A fact of the canvas that a node's result may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fact {
    /// Its size in mm.
    Size,
    /// In which directions it tiles.
    Tile,
    /// The seed. Read by every node that draws random numbers.
    Seed,
}

impl Fact {
    /// All facts.
    pub const ALL: [Self; 3] = [Self::Size, Self::Tile, Self::Seed];

    /// The name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Size => "the size",
            Self::Tile => "the tiling",
            Self::Seed => "the seed",
        }
    }
}

/// The type of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputType {
    /// Always the same.
    Fixed(Type),
    /// The widest of the types at these ports: `Normal` if any is, else `Rgb` if any is (or a picture), else `Gray`.
    /// For solids, the type of the field that a cut through them gives: `Rgb` for colours and vectors.
    Like(&'static [&'static str]),
    /// What the node tells from the types at its ports, see [`Node::type_of_output`].
    Told,
    /// The widest of the types of the solids at these ports: that of the first one that is not `Solid`, else `Solid`.
    SolidLike(&'static [&'static str]),
}

/// An output of a node; the first of a node's outputs is its main one.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// The name after the dot.
    pub name: &'static str,
    /// What it carries.
    pub ty: OutputType,
    /// The unit of its values.
    pub unit: Option<&'static str>,
    /// The name that it had before. Graphs may still use it, with a warning, and its results keep their keys.
    pub former: Option<&'static str>,
    /// What it is, one line.
    pub doc: &'static str,
}

impl Output {
    /// An output of a fixed type.
    pub const fn new(name: &'static str, ty: Type, doc: &'static str) -> Self {
        Self { name, ty: OutputType::Fixed(ty), unit: None, former: None, doc }
    }

    /// An output whose type follows those of the ports named.
    pub const fn like(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::Like(ports), unit: None, former: None, doc }
    }

    /// An output whose type the node tells.
    pub const fn told(name: &'static str, doc: &'static str) -> Self {
        Self { name, ty: OutputType::Told, unit: None, former: None, doc }
    }

    /// An output that is a solid of the type of those at the ports named.
    pub const fn solid_like(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::SolidLike(ports), unit: None, former: None, doc }
    }

    /// The same with a unit.
    #[must_use]
    pub const fn in_unit(self, unit: &'static str) -> Self {
        Self { unit: Some(unit), ..self }
    }

    /// The same, which was called `former` before.
    #[must_use]
    pub const fn formerly(self, former: &'static str) -> Self {
        Self { former: Some(former), ..self }
    }

    /// The number of the output among these that has a name, or had it before.
    pub fn position(outputs: &[Self], name: &str) -> Option<usize> {
        let now = outputs.iter().position(|output| output.name == name);
        now.or_else(|| outputs.iter().position(|output| output.former == Some(name)))
    }
}

/// A kind of node. The struct's name is the kind, its doc comment the manual, its fields ports and parameters.
pub trait Node: Serialize + DeserializeOwned + JsonSchema + Default + Send + Sync + 'static {
    /// Raise it when the same parameters give another result than before.
    const VERSION: u32 = 1;

    /// What it makes.
    const OUTPUTS: &'static [Output];

    /// The facts of the canvas that it reads; others cannot be read, see [`CanvasFacts`].
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    /// Checks what the range of a single parameter cannot express. Ranges of single parameters were checked before.
    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    /// Advice about parameters that are valid but probably not intended; reported as warnings.
    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    /// The directions in which it keeps pictures periodic. Its outputs tile in those of them in which all inputs tile. But see
    /// [`makes_tile`](Self::makes_tile).
    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::BOTH
    }

    /// Whether it repeats as [`tiling`](Self::tiling) says even where what goes into `port` does not: it makes that tile, or
    /// shows it at other places.
    fn makes_tile(&self, _port: &str) -> bool {
        false
    }

    /// The bytes that it needs at least to hold of a whole picture of so many pixels; 0 for a node that works by tiles. With them
    /// `check` tells beforehand what will not fit the memory.
    fn whole_bytes(&self, _pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        0
    }

    /// The files it reads, with the parameter that names each. They are read while the node is evaluated, or when the first
    /// tile of one of its fields is filled; its fields keep and share what was read then.
    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        Vec::new()
    }

    /// For a node that makes a `Picture`: whether it has one channel, so that ports for any field take it as `Gray`. Reads no
    /// more of its files than their headers; a file that cannot be read is reported by others.
    fn makes_gray(&self, _files: &[(&'static str, PathBuf)]) -> bool {
        false
    }

    /// The type of the outputs that are [told](OutputType::Told), from the names and types of the ports that are connected; or
    /// what is wrong with these types.
    fn type_of_output(&self, _inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        Ok(Type::Gray)
    }

    /// The unit of an output's values, where parameters can change what is declared.
    fn unit(&self, output: &Output) -> Option<&'static str> {
        output.unit
    }

    /// True where `<UDIM>` in a path stands for the numbers of tiles, so that a parameter may name several files.
    fn takes_udim(&self) -> bool {
        false
    }

    /// Checks the files themselves, as far as that is possible without making anything: headers, sizes, completeness. All
    /// of them exist; each comes with the parameter that names it. Advice is reported as warnings.
    fn check_files(&self, _files: &[(&'static str, PathBuf)]) -> Vec<Problem> {
        Vec::new()
    }

    /// The channels of the material that it makes, from those of the materials at its ports: all of these by default.
    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.all()
    }

    /// The single channels that it takes from materials at its ports. A material that lacks one is reported before
    /// anything is made, and the channel's default is used instead.
    fn takes(&self) -> Vec<Taken> {
        Vec::new()
    }

    /// The ports that take distances in mm, which a mask is not: `check` warns where one is connected to an output without a unit
    /// although its node has one in mm.
    fn distances(&self) -> &'static [&'static str] {
        &[]
    }

    /// The port whose value the main output passes on unchanged with these parameters, if there is one.
    fn no_op(&self) -> Option<&'static str> {
        None
    }

    /// Which value that is, where the port of [`no_op`](Self::no_op) takes a list. What is at the others is not made.
    fn no_op_item(&self) -> usize {
        0
    }

    /// Makes the outputs. Fields are returned unevaluated.
    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop>;
}
