//! Nodes without function that have every kind of port and parameter.
mod rays;

use rays::{CHANGES, Rays, RaysOf3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::registry::{Family, Internal, Kind, Registry};
use shibo_node::{
    AnyField, AnySolid, CanvasFacts, Color, Context, EveryField, FilePath, Gray, In, Linear, Node, Output, Outputs,
    Range, Vec2Field, Xy,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Lattice, Points, Stop, Tiling, Type};
use std::cell::Cell;

macro_rules! node {
    ($name:ident, [$($output:expr),*]) => {
        impl Node for $name {
            const OUTPUTS: &'static [Output] = &[$($output),*];
            fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
                count();
                Vec::new()
            }
            fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
                Err(Stop::Cancelled)
            }
        }
    };
}

mod materials;

use materials::{Layers, Stack, Surface, Take};

thread_local! {
    static BUILT: Cell<usize> = const { Cell::new(0) };
}

/// Number of nodes that this thread has built and checked.
#[allow(dead_code, reason = "not every test program asks")]
pub(crate) fn built() -> usize {
    BUILT.get()
}

fn count() {
    BUILT.set(BUILT.get() + 1);
}

/// A choice.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub(crate) enum Profile {
    /// Soft.
    #[default]
    Smooth,
    /// Straight.
    Linear,
    /// With a number.
    Fixed(f64),
}

/// A branch.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Branch {
    /// A number.
    pub(crate) height: f64,
    /// A count.
    pub(crate) count: u32,
}

/// All sorts of parameters.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Bands {
    /// A number above zero.
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub(crate) pitch: f64,
    /// A number in a range.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub(crate) amount: f64,
    /// A count.
    #[schemars(range(max = 100))]
    pub(crate) count: u32,
    /// From, to.
    #[schemars(extend("minimum" = 0.0, "maximum" = 50.0, "unit" = "mm"))]
    pub(crate) width: Range,
    /// A line.
    pub(crate) line: Linear,
    /// Two directions.
    pub(crate) offset: Xy,
    /// A choice.
    pub(crate) profile: Profile,
    /// A colour.
    pub(crate) tint: Color,
    /// A text.
    pub(crate) label: String,
    /// A switch.
    pub(crate) on: bool,
    /// Can be infinite.
    #[schemars(extend("infinite" = true))]
    pub(crate) k: f64,
    /// A list.
    pub(crate) points: Vec<(f64, f64)>,
    /// A list of numbers and colours.
    pub(crate) stops: Vec<(f64, Color)>,
    /// A list of structs.
    pub(crate) branches: Vec<Branch>,
    /// A seed.
    pub(crate) seed: u64,
    /// An optional number.
    pub(crate) limit: Option<f64>,
}

impl Default for Bands {
    fn default() -> Self {
        Self {
            pitch: 1.0,
            amount: 0.5,
            count: 3,
            width: Range::new(1.0, 2.0),
            line: Linear::new(0.0, 1.0),
            offset: Xy::new(0.0, 0.0),
            profile: Profile::Smooth,
            tint: Color::default(),
            label: String::new(),
            on: false,
            k: 2.0,
            points: Vec::new(),
            stops: Vec::new(),
            branches: Vec::new(),
            seed: 0,
            limit: None,
        }
    }
}

impl Node for Bands {
    const OUTPUTS: &'static [Output] = &[
        Output::new("value", Type::Gray, "Bands."),
        Output::new("color", Type::Rgb, "Coloured bands.").formerly("hue"),
    ];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        count();
        let wrong = self.pitch == 7.0 && self.amount == 0.25;
        let problem = Problem::new(Code::BadValue, "amount does not go with pitch 7").at("amount").help("take 0.5");
        if wrong { vec![problem] } else { Vec::new() }
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let odd = self.pitch == 13.0;
        if odd { vec![Problem::new(Code::Advice, "thirteen brings bad luck").at("pitch")] } else { Vec::new() }
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// Points.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct GridPoints {
    /// A number.
    #[schemars(range(min = 0.1), extend("unit" = "mm"))]
    pub(crate) pitch: f64,
}
node!(GridPoints, [Output::new("points", Type::Points, "P."), Output::new("lattice", Type::Lattice, "L.")]);

/// Links.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Connect {
    /// Points.
    pub(crate) points: In<Points>,
}
node!(Connect, [Output::new("lattice", Type::Lattice, "L.")]);

/// Springs.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Springs {
    /// Lattice.
    pub(crate) lattice: In<Lattice>,
    /// Field.
    pub(crate) field: Option<In<Gray>>,
}
node!(Springs, [Output::new("springs", Type::SpringNet, "S.")]);

/// Like its inputs.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Mix {
    /// One.
    pub(crate) a: In<AnyField>,
    /// Other.
    pub(crate) b: In<AnyField>,
    /// Amount.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub(crate) amount: In<Gray>,
}

impl Default for Mix {
    fn default() -> Self {
        Self { a: In::default(), b: In::constant(0.0), amount: In::constant(0.5) }
    }
}
node!(Mix, [Output::like("value", &["a", "b"], "Both.")]);

/// A vector.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Flow {}
node!(Flow, [Output::new("vector", Type::Vec2, "V.")]);

/// A solid of numbers.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Grain {}
node!(Grain, [Output::new("solid", Type::Solid, "S.")]);

/// A solid of colours.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Dye {}
node!(Dye, [Output::new("solid", Type::SolidColor, "S.")]);

/// A cut through a solid.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Slice {
    /// Solid.
    pub(crate) solid: In<AnySolid>,
}
node!(Slice, [Output::like("value", &["solid"], "Cut.")]);

/// Pieces.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Pieces {}
node!(Pieces, [Output::new("mask", Type::Gray, "M."), Output::new("ids", Type::Ids, "I.")]);

/// Computes a program.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Program {
    /// Fields.
    pub(crate) inputs: Vec<In<EveryField>>,
    /// Program.
    pub(crate) program: String,
    /// Inner.
    pub(crate) inner: bool,
}
node!(Program, [Output::told("value", "The result.")]);

/// Computes a program of solids.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct SolidProgram {
    /// Solids.
    pub(crate) inputs: Vec<In<AnySolid>>,
    /// Program.
    pub(crate) program: String,
    /// Inner.
    pub(crate) inner: bool,
}
node!(
    SolidProgram,
    [Output::told("value", "The result."), Output::new("vector", Type::SolidVector, "The result as a vector.")]
);

/// A list.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Sum {
    /// Several.
    pub(crate) inputs: Vec<In<Gray>>,
}
node!(Sum, [Output::new("value", Type::Gray, "Sum.")]);

/// Has a text that is wrong where it has a question mark.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Compute {
    /// One.
    pub(crate) a: Option<In<EveryField>>,
    /// The text.
    pub(crate) formula: String,
}

impl Node for Compute {
    const OUTPUTS: &'static [Output] = &[Output::told("value", "The result.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        count();
        let wrong = self.formula.find('?');
        wrong
            .map(|at| Problem::new(Code::BadExpression, "what?").at("formula").within(at..at + 1))
            .into_iter()
            .collect()
    }

    fn type_of_output(&self, inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        let given = inputs.first().map_or(Type::Gray, |(_, ty)| *ty);
        match self.formula.find("a.r") {
            Some(at) if given == Type::Gray => {
                Err(vec![Problem::new(Code::BadExpression, "a is Gray").at("formula").within(at..at + 3)])
            }
            _ => Ok(given),
        }
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// A displacement.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Warp {
    /// Input.
    pub(crate) input: In<AnyField>,
    /// Displacement.
    pub(crate) vector: In<Vec2Field>,
}
node!(Warp, [Output::like("value", &["input"], "Warped.")]);

/// A picture.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Image {
    /// Path.
    pub(crate) path: FilePath,
}

impl Node for Image {
    const OUTPUTS: &'static [Output] = &[Output::new("picture", Type::Picture, "The picture.")];

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        vec![("path", &self.path)]
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// A field that does not repeat.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Ramp {
    /// Input.
    pub(crate) input: Option<In<AnyField>>,
}

impl Node for Ramp {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "A ramp.")];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// A node that makes its input repeat; only across if `x_only`.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Seamless {
    /// Input.
    pub(crate) input: In<AnyField>,
    /// Whether only across.
    pub(crate) x_only: bool,
}

impl Node for Seamless {
    const OUTPUTS: &'static [Output] = &[Output::like("value", &["input"], "The same, without seams.")];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling { x: true, y: !self.x_only }
    }

    fn makes_tile(&self, _port: &str) -> bool {
        true
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// A registry of these nodes.
pub(crate) fn registry() -> Registry {
    let kinds = vec![
        Kind::of::<Bands>(),
        Kind::of::<GridPoints>(),
        Kind::of::<Connect>(),
        Kind::of::<Springs>(),
        Kind::of::<Mix>(),
        Kind::of::<Flow>(),
        Kind::of::<Grain>(),
        Kind::of::<Dye>(),
        Kind::of::<Slice>(),
        Kind::of::<Pieces>(),
        Kind::of::<Sum>(),
        Kind::of::<Compute>(),
        Kind::of::<Warp>(),
        Kind::of::<Image>(),
        Kind::of::<Ramp>(),
        Kind::of::<Seamless>(),
        Kind::of::<Surface>(),
        Kind::of::<Layers>(),
        Kind::of::<Stack>(),
        Kind::of::<Take>(),
        Kind::of::<Rays>(),
    ];
    // Nodes of the kind `Twice` become formulas if they have an input.
    let successor = |node: &str, _: &Registry| Some(format!("\"= 2 * {}\"", node.split('"').nth(1)?));
    Registry::new([Family { name: "Test", doc: "For tests.", kinds }])
        .with_retired(&["Bands", "Twice"])
        .with_kept("Rays", 3, Kind::of::<RaysOf3>())
        .with_changes(CHANGES)
        .with_successor(successor)
        .with_internal(Internal::Formula, Kind::of::<Program>())
        .with_internal(Internal::SolidFormula, Kind::of::<SolidProgram>())
        .with_internal(Internal::Channel, Kind::of::<Take>())
}
