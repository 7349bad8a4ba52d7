//! [`DefineSprings`]: springs on the links of a lattice.
//!
//! Source: JP4905282B2 §4, claims 2 and 3 (rows A17–A27). Cost: O(links · pixels on a link).
use super::reading;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::lines::{Reduction, Sample};
use shibo_kernel::springs::Rest;
use shibo_node::{Context, Fact, Gray, In, Linear, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Lattice, SpringNet, Stop, Type};

/// Turns links into springs whose stiffness and length at rest come from a field: springs are stiff where the field is
/// bright, so cells become small there, and large where it is dark.
///
/// A ratio of 5 to 10 between the two stiffnesses works best, with a field whose features are 3 to 8 pitches large.
///
/// ```ron
/// "points": PoissonPoints(pitch: 2.5),
/// "links": ConnectNeighbors(points: "points"),
/// "bands": BandPattern(pitch: 14, width: (4, 7), length: (20, 40), gradation: Smooth),
/// "springs": DefineSprings(lattice: "links", field: "bands", stiffness: (1, 10)),
/// "moved": SimulateSprings(springs: "springs", step: 0.1, steps: 80, drag: 6, boundary: Periodic),
/// "relinked": ConnectNeighbors(points: "moved.points"),
/// "wrinkles": PlaceWrinkles(lattice: "relinked"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.4, 0.8), depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Houdini *Vellum Constraints*.
#[node]
pub struct DefineSprings {
    /// The points and links.
    pub lattice: In<Lattice>,
    /// Field that controls the springs, 0..1. If not given, all springs are those of a field of 0.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub field: Option<In<Gray>>,
    /// Stiffness where the field is 0 and stiffness where it is 1. One number: the same everywhere.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6))]
    #[default(Linear::new(2.0, 10.0))]
    pub stiffness: Linear,
    /// Standard length at rest.
    #[schemars(extend("minimum" = -100.0, "maximum" = 100.0))]
    #[default(Rest::Source)]
    pub rest: Rest,
    /// Length added to the standard length at rest, where the field is 0 and where it is 1, in pitches; may be
    /// negative.
    #[schemars(extend("minimum" = -100.0, "maximum" = 100.0, "unit" = "pitch"))]
    pub rest_length: Linear,
    /// Damping where the field is 0 and where it is 1: a force against the stretching of a spring, this factor times
    /// the speed at which the spring grows.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6))]
    pub damping: Linear,
    /// Largest random change of the stiffness of each spring, as a share of its stiffness: 0.5 gives from half to one
    /// and a half times the stiffness.
    #[schemars(range(min = 0, max = 1))]
    pub spread: f64,
    /// Pixels of the field that count for a link.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Sample::Smooth)]
    pub sample: Sample,
    /// How the values along a link are combined.
    #[default(Reduction::Mean)]
    pub reduce: Reduction,
    /// True to swap 0 and 1 of the field.
    pub invert: bool,
    /// Columns and rows of the samples of the field. By default the pixels of the picture if the field is a picture,
    /// otherwise four samples per pitch.
    #[schemars(extend("minimum" = 1.0, "maximum" = 8192.0))]
    pub sample_resolution: Option<(u32, u32)>,
    /// Another seed gives other random changes.
    pub seed: u64,
}

impl Node for DefineSprings {
    const OUTPUTS: &'static [Output] = &[Output::new("springs", Type::SpringNet, "The springs.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let lattice = cx.get(&self.lattice)?;
        let scalars = match cx.get_opt(&self.field)? {
            Some(field) => {
                let read = reading::read(
                    cx,
                    (lattice.points.pitch, lattice.points.periodic),
                    (&field, "field"),
                    self.sample_resolution,
                )?;
                let mut scalars = read.along(cx, &lattice, (self.sample, self.reduce))?;
                if self.invert {
                    scalars.iter_mut().for_each(|s| *s = 1.0 - *s);
                }
                scalars
            }
            None => vec![0.0; lattice.links.len()],
        };
        cx.check()?;
        let pitch = self.pitch(&lattice);
        let standard = self.standard(&lattice, pitch);
        let of = |map: Linear, s: f32| narrow(map.at(f64::from(s)));
        let hash = Hash::new(cx.seed(self.seed));
        let factor = |l: u64| 1.0 + self.spread * (2.0 * hash.unit(l) - 1.0);
        let stiffness: Vec<f32> =
            (0..).zip(&scalars).map(|(l, &s)| narrow(self.stiffness.at(f64::from(s)) * factor(l))).collect();
        let damped = self.damping != Linear::new(0.0, 0.0);
        let damping = if damped { scalars.iter().map(|&s| of(self.damping, s)).collect() } else { Vec::new() };
        for (name, values) in [("stiffness", &stiffness), ("damping", &damping)] {
            if let Some(bad) = values.iter().find(|k| **k < 0.0) {
                let message = format!("{name} becomes `{bad}`; it must be at least 0");
                let help = "keep the field within 0..1, or use `reduce: Mean`";
                return Err(Problem::new(Code::OutOfRange, message).at(name).help(help).into());
            }
        }
        let rest_length = standard.iter().zip(&scalars).map(|(l, &s)| l + pitch * of(self.rest_length, s)).collect();
        Ok(Outputs::one(SpringNet { lattice, stiffness, rest_length, damping, ..SpringNet::default() }))
    }
}

impl DefineSprings {
    /// The length d to which standard lengths refer: for a grid the smaller pitch, otherwise as `rest` says.
    fn pitch(&self, lattice: &Lattice) -> f32 {
        match (&lattice.points.grid, self.rest) {
            (Some(order), _) => order.pitch.min_element(),
            (None, Rest::Source) => {
                let lengths = initial_lengths(lattice);
                narrow(lengths.iter().map(|&l| f64::from(l)).sum::<f64>() / lengths.len().max(1) as f64)
            }
            (None, _) => lattice.points.pitch,
        }
    }

    /// The standard length at rest of each link.
    fn standard(&self, lattice: &Lattice, pitch: f32) -> Vec<f32> {
        match self.rest {
            Rest::Zero => vec![0.0; lattice.links.len()],
            Rest::Source => initial_lengths(lattice).into_iter().map(|l| l - pitch).collect(),
            Rest::InitialMinus(factor) => {
                initial_lengths(lattice).into_iter().map(|l| l - pitch * narrow(factor)).collect()
            }
        }
    }
}

/// The lengths of the links before any jitter.
fn initial_lengths(lattice: &Lattice) -> Vec<f32> {
    let regular = lattice.points.regular();
    (0..lattice.links.len()).map(|link| lattice.span(regular, link).length()).collect()
}
