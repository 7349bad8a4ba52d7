//! Nodes: documented structs of ports and parameters, with a function that evaluates them; and the [`registry`] of their
//! kinds. A crate with nodes depends on this crate and on those below, not on graph files.
//!
//! ```
//! use shibo_node::{AnyField, Context, In, Node, Output, Outputs, node};
//! use shibo_value::{Field, Halo, Stop, Tile};
//!
//! /// Turns values upside down: 1 becomes 0.
//! #[node]
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
//! Everything about a node follows from that one declaration: parsing, type check, range check, cache key, manual. The
//! engine reads these attributes from the schema of a parameter: `range(min, max)`, or `extend("minimum" = …, "maximum"
//! = …)` for parameters that are not plain numbers and for ports, where it bounds the numbers that are written in place
//! of a wire; `extend("exclusiveMinimum" = …)`; `extend("unit" = "mm")`; `extend("infinite" = true)` where `inf` is
//! allowed. Fields of structs in a list may be ports. A list of ports may be empty with `extend("optional" = true)`.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
pub mod changes;
pub mod registry;

mod build;
mod canonical;
mod channels;
mod context;
mod facts;
mod info;
mod param_type;
mod params;
mod port;
mod spelling;
mod written;

pub(crate) use build::Functions;
pub use build::{Arg, BuildError, Built, DynNode, build, ron_options};
pub use channels::{MaterialInputs, TakenChannel};
pub use context::{Call, Context, Outputs, seed_of};
pub use facts::CanvasFacts;
pub use info::{Bounds, Choice, FieldInfo, KindInfo, ParamInfo, PortInfo, Role};
pub use param_type::ParamType;
pub use params::{Color, FilePath, Linear, Range, Xy};
pub use port::{
    AnyColor, AnyField, AnyMaterial, AnyNormal, AnySolid, AnyVector, Anywhere, Direction, EveryField,
    EveryFieldOrSolid, FieldOrMaterial, FieldOrSolid, FieldsOrMaterial, Gray, IdsField, In, InSpace, JacobianField,
    MaterialAnywhere, NormalField, Number, PortType, Rgb, SolidColor, SolidNumber, SolidOrMaterial, SolidVector,
    Vec2Field,
};
pub use shibo_macros::{choice, node};
pub use shibo_value::parse_color;
pub use spelling::spell_number;
pub use written::ParamForm;

use glam::UVec2;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use shibo_value::diagnostics::{self, Problem};
use shibo_value::expression::Growth;
use shibo_value::files::FileHandle;
use shibo_value::{self as value, ChannelSet, Stop, Tiling, Type};

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");

/// A fact of the canvas that a node's result may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fact {
    /// Its size in mm.
    Size,
    /// Directions in which it tiles.
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
    /// A fixed type.
    Fixed(Type),
    /// The widest of the types at these ports: `Normal` if any is, else `Rgb` if any is (or a picture), else `Gray`.
    /// For solids, the type of the field of a cut: `Rgb` for colours and vectors. `Material` for a material.
    Like(&'static [&'static str]),
    /// Computed by the node from the types at its ports, see [`Node::type_of_output`].
    Told,
    /// A colour: `SolidColor` if there is a solid at one of these ports, else `Rgb`.
    ColorOf(&'static [&'static str]),
    /// The widest type at these ports: as [`Like`](Self::Like), or, if there is something in space at one of these ports
    /// or at another that takes both, the widest type of solids.
    ValueOf(&'static [&'static str]),
    /// `Solid` if there is a solid or a material of solids at one of these ports, else `Gray`.
    NumberOf(&'static [&'static str]),
    /// `SolidMaterial` if there is a solid or a material of solids at one of these ports, else `Material`. Constants
    /// combine with solids; other fields do not.
    MaterialOf(&'static [&'static str]),
}

impl OutputType {
    /// True if its values may be materials of this kind: all of them (`MaterialOf`), or those of a fixed type.
    pub fn is_material(&self) -> bool {
        matches!(self, Self::MaterialOf(_)) || matches!(self, Self::Fixed(ty) if ty.is_material())
    }
}

/// An output of a node; the first of a node's outputs is its main one.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// The name after the dot.
    pub name: &'static str,
    /// Type of its values.
    pub ty: OutputType,
    /// The unit of its values.
    pub unit: Option<&'static str>,
    /// The old name. Graphs may still use it, with a warning, and its results keep their keys.
    pub former: Option<&'static str>,
    /// A description, one line.
    pub doc: &'static str,
}

impl Output {
    /// An output of a fixed type.
    pub const fn new(name: &'static str, ty: Type, doc: &'static str) -> Self {
        Self { name, ty: OutputType::Fixed(ty), unit: None, former: None, doc }
    }

    /// An output whose type follows the types of these ports.
    pub const fn like(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::Like(ports), unit: None, former: None, doc }
    }

    /// An output whose type the node computes.
    pub const fn told(name: &'static str, doc: &'static str) -> Self {
        Self { name, ty: OutputType::Told, unit: None, former: None, doc }
    }

    /// An output that is a colour, on the canvas or in space as the values at these ports.
    pub const fn color_of(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::ColorOf(ports), unit: None, former: None, doc }
    }

    /// An output of the widest type at these ports, on the canvas or in space as the values at all ports.
    pub const fn value_of(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::ValueOf(ports), unit: None, former: None, doc }
    }

    /// An output that is a number, on the canvas or in space as the values at these ports.
    pub const fn number_of(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::NumberOf(ports), unit: None, former: None, doc }
    }

    /// An output that is a material, on the canvas or in space as the values at these ports.
    pub const fn material_of(name: &'static str, ports: &'static [&'static str], doc: &'static str) -> Self {
        Self { name, ty: OutputType::MaterialOf(ports), unit: None, former: None, doc }
    }

    /// Sets the unit.
    #[must_use]
    pub const fn in_unit(self, unit: &'static str) -> Self {
        Self { unit: Some(unit), ..self }
    }

    /// Sets the old name.
    #[must_use]
    pub const fn formerly(self, former: &'static str) -> Self {
        Self { former: Some(former), ..self }
    }

    /// Index of the output with this name or this old name.
    pub fn position(outputs: &[Self], name: &str) -> Option<usize> {
        let now = outputs.iter().position(|output| output.name == name);
        now.or_else(|| outputs.iter().position(|output| output.former == Some(name)))
    }
}

/// A kind of node. The name of the struct is the kind, its doc comment the manual, its fields are ports and parameters.
pub trait Node: Serialize + DeserializeOwned + JsonSchema + Default + Send + Sync + 'static {
    /// Increase it when the same parameters give another result than before.
    const VERSION: u32 = 1;

    /// Its outputs.
    const OUTPUTS: &'static [Output];

    /// The facts of the canvas that it reads. Other facts cannot be read, see [`CanvasFacts`].
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    /// Checks requirements that the range of a single parameter cannot express. Ranges were checked before.
    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    /// Advice about valid parameters that are probably not intended; reported as warnings.
    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    /// Directions in which it keeps pictures periodic. Its outputs tile in those of these directions in which all
    /// inputs tile, except for [`makes_tile`](Self::makes_tile).
    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::BOTH
    }

    /// Growth of each component of its result from one repeat of the canvas to the next, from that of the components of
    /// its inputs; an input that is not given repeats. Only for a node that can repeat although an input does not:
    /// [`tiling`](Self::tiling) is then the case in which all inputs repeat.
    fn growth(&self, _canvas: &CanvasFacts, _inputs: &[Vec<Growth>]) -> Option<Vec<Growth>> {
        None
    }

    /// True if it repeats as [`tiling`](Self::tiling) says even if the input at `port` does not: the node makes the
    /// input tileable, or samples it at other positions.
    fn makes_tile(&self, _port: &str) -> bool {
        false
    }

    /// A lower bound for the bytes that it holds of a whole picture of `_pixels`; 0 for a node that works by tiles.
    /// `check` uses it to report beforehand that the memory does not suffice.
    fn whole_bytes(&self, _pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        0
    }

    /// The files that it reads, with the parameter that names each. A file is read while the node is evaluated, or when
    /// the first tile of one of its fields is filled. The fields keep and share the content.
    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        Vec::new()
    }

    /// For a node that makes a `Picture`: true if it has one channel, so that ports for any field accept it as `Gray`.
    /// Reads only the headers of its files; other functions report files that cannot be read.
    fn makes_gray(&self, _files: &[(&'static str, FileHandle)]) -> bool {
        false
    }

    /// Type of the [computed](OutputType::Told) outputs, from the names and types of the connected ports; or the
    /// problems of these types.
    fn type_of_output(&self, _inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        Ok(Type::Gray)
    }

    /// The unit of the values of an output, where parameters change the declared unit.
    fn unit(&self, output: &Output) -> Option<&'static str> {
        output.unit
    }

    /// True if `<UDIM>` in a path stands for tile numbers, so that a parameter may name several files.
    fn takes_udim(&self) -> bool {
        false
    }

    /// Checks the files themselves as far as possible without evaluating: headers, sizes, completeness. All files
    /// exist; each comes with the parameter that names it. Advice is reported as warnings.
    fn check_files(&self, _files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        Vec::new()
    }

    /// The channels of the material that it makes, from the channels of the materials at its ports: their union by
    /// default.
    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.all()
    }

    /// The single channels that it reads from materials at its ports. If a material lacks one, a warning is reported
    /// before the evaluation, and the channel's default is used.
    fn takes(&self) -> Vec<TakenChannel> {
        Vec::new()
    }

    /// The ports that take distances in mm. `check` warns if such a port is connected to an output without a unit, such
    /// as a mask, although the other node also has an output in mm.
    fn distances(&self) -> &'static [&'static str] {
        &[]
    }

    /// The port whose value the main output passes on unchanged with these parameters, if any.
    fn no_op(&self) -> Option<&'static str> {
        None
    }

    /// Index of that value if the port of [`no_op`](Self::no_op) takes a list. The other values are not computed.
    fn no_op_item(&self) -> usize {
        0
    }

    /// Makes the outputs. Fields are returned unevaluated.
    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop>;
}
