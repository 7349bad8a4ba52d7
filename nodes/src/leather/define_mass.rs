//! [`DefineMass`]: masses of the points.
//!
//! Source: JP4905282B2 §6(1), claims 4 and 5 (rows A28–A33). Cost: O(points · pixels near a point).
use super::reading;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::lines::Reduction;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Linear, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{ScalarMap, SpringNet, Stop, Type};
use std::sync::Arc;

/// Pixels of the field that count for a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum SamplePoint {
    /// The pixel under the point.
    #[default]
    Point,
    /// The pixels at most this many mm from the point.
    Near(f64),
}

/// When masses are read from the field.
#[choice]
pub enum Refresh {
    /// Once, before the motion: a point keeps its mass.
    #[default]
    Once,
    /// In every step, at the current place of the point.
    EveryStep,
}

/// Sets the masses of the points of springs from a field: heavy points move little, light ones a lot.
///
/// Masses are a second way, besides stiffness, to make a pattern from a field; both can be used together. On a regular
/// grid whose springs are all alike nothing moves, whatever the masses: set the `spread` of `DefineSprings`.
///
/// ```ron
/// "points": GridPoints(pitch: 2.5, stagger: 0.5, jitter: 0.6),
/// "links": ConnectNeighbors(points: "points"),
/// "field": Perlin(size: 12),
/// "springs": DefineSprings(lattice: "links", stiffness: 5, spread: 0.8),
/// "weights": DefineMass(springs: "springs", field: "field", mass: (0.3, 6)),
/// "moved": SimulateSprings(springs: "weights", step: 0.1, steps: 60, drag: 3, integrator: SemiImplicit, boundary: Periodic),
/// "relinked": ConnectNeighbors(points: "moved.points"),
/// "wrinkles": PlaceWrinkles(lattice: "relinked"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.4, 0.8), depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
#[node]
pub struct DefineMass {
    /// The springs.
    pub springs: In<SpringNet>,
    /// Field of masses, 0..1. If not given, all masses are those of a field of 0.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub field: Option<In<Gray>>,
    /// Mass where the field is 0 and mass where it is 1. One number: the same everywhere.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6))]
    #[default(Linear::new(0.5, 4.0))]
    pub mass: Linear,
    /// Pixels of the field that count for a point.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(SamplePoint::Point)]
    pub sample: SamplePoint,
    /// How the values near a point are combined.
    #[default(Reduction::Mean)]
    pub reduce: Reduction,
    /// When masses are read from the field.
    #[default(Refresh::Once)]
    pub refresh: Refresh,
    /// Largest random change of the mass of each point, as a share of its mass. Not with `refresh: EveryStep`, where
    /// masses belong to places and not to points.
    #[schemars(range(min = 0, max = 0.95))]
    pub spread: f64,
    /// True to swap 0 and 1 of the field.
    pub invert: bool,
    /// Columns and rows of the samples of the field. By default the pixels of the picture if the field is a picture,
    /// otherwise four samples per pitch.
    #[schemars(extend("minimum" = 1.0, "maximum" = 8192.0))]
    pub sample_resolution: Option<(u32, u32)>,
    /// Another seed gives other random changes.
    pub seed: u64,
}

impl Node for DefineMass {
    const OUTPUTS: &'static [Output] =
        &[Output::new("springs", Type::SpringNet, "The springs with masses at their ends.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.refresh == Refresh::Once || self.spread == 0.0 {
            return Vec::new();
        }
        let message = format!("spread is `{}`; with `refresh: EveryStep` it must be 0", self.spread);
        let help = "masses that are read in every step belong to places, not to points: add noise to the field instead";
        vec![Problem::new(Code::BadValue, message).at("spread").help(help)]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let springs = cx.get(&self.springs)?;
        let points = &springs.lattice.points;
        self.advise(cx, &springs);
        let hash = Hash::new(cx.seed(self.seed));
        let factor = |n: u64| 1.0 + self.spread * (2.0 * hash.unit(n) - 1.0);
        let Some(field) = cx.get_opt(&self.field)? else {
            let mass = (0..points.len() as u64).map(|n| narrow(self.mass.at0 * factor(n))).collect();
            return Ok(Outputs::one(SpringNet { mass, mass_map: None, ..SpringNet::clone(&springs) }));
        };
        let read = reading::read(cx, (points.pitch, points.periodic), (&field, "field"), self.sample_resolution)?;
        let ends = if self.invert { [self.mass.at1, self.mass.at0] } else { [self.mass.at0, self.mass.at1] };
        let map = ScalarMap {
            size: read.size,
            values: read.values.clone(),
            range: ends.map(narrow),
            sum: self.reduce == Reduction::Sum,
            radius: match self.sample {
                SamplePoint::Point => None,
                SamplePoint::Near(radius) => Some(narrow(radius)),
            },
        };
        let mut mass = read.masses(cx, &map, &points.positions, self.refresh == Refresh::EveryStep)?;
        mass.iter_mut().zip(0..).for_each(|(m, n)| *m *= narrow(factor(n)));
        self.positive(&mass)?;
        let mass_map = (self.refresh == Refresh::EveryStep).then(|| Arc::new(map));
        if let (Some(map), true) = (&mass_map, self.reduce == Reduction::Mean) {
            // Points may move anywhere, so all values of the field count.
            let of = |v: f32| map.range[0] + (map.range[1] - map.range[0]) * v;
            self.positive(&map.values.iter().map(|&v| of(v)).collect::<Vec<_>>())?;
        }
        Ok(Outputs::one(SpringNet { mass, mass_map, ..SpringNet::clone(&springs) }))
    }
}

impl DefineMass {
    fn positive(&self, masses: &[f32]) -> Result<(), Problem> {
        let Some(bad) = masses.iter().find(|m| !(**m > 0.0 && m.is_finite())) else { return Ok(()) };
        let message = format!("mass becomes `{bad}`; it must be greater than 0");
        Err(Problem::new(Code::OutOfRange, message)
            .at("mass")
            .help("keep the field within 0..1, or use `reduce: Mean`"))
    }

    /// Advises if nothing will move because all springs of a regular grid are alike and in balance.
    fn advise(&self, cx: &Context<'_>, springs: &SpringNet) {
        let (points, first) = (&springs.lattice.points, springs.stiffness.first());
        let alike = springs.stiffness.iter().all(|k| Some(k) == first);
        if alike && points.regular.is_none() && springs.lattice.regular {
            let message = "all springs of this regular lattice are alike and hold each other in balance: nothing moves";
            let help = "give `DefineSprings` a `spread`, or the points some jitter";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("springs").help(help));
        }
    }
}
