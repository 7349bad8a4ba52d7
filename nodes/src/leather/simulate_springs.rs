//! [`SimulateSprings`]: simulates the motion of springs.
//!
//! Source: JP4905282B2 §5 and §6, claims 13 to 16 (rows A34–A46). Beyond the source: the semi-implicit integrator,
//! drag, lattices that repeat with the canvas, and stretch and breakage as fields. A motion that diverges is an error,
//! never a picture. Cost: O(steps · links).
use super::net::{Contacts, live_mass, net, outputs, quantile};
use super::reading;
use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::area::near_contour;
use shibo_kernel::leather::lines::{Reduction, Sample};
use shibo_kernel::leather::points::border;
use shibo_kernel::springs::{self, BreakOn, Integrator, Mass, Motion, Net, Outcome, SpringError};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, Range, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Points, SpringNet, Stop, Tiling, Type};
use std::sync::atomic::{AtomicBool, Ordering};

/// Behaviour at the canvas' edge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Boundary {
    /// Holds the points at the canvas' edge, or at the contour of their work area, and all points at most this many mm
    /// from it. At the edge lie the border points of a grid; of other sets, all points within a pitch. A set that
    /// repeats with the canvas has no edge: only the distance counts, and 0 holds no point.
    Fixed(f64),
    /// All points move.
    Free,
    /// All points move, and opposite edges of the canvas are joined: needs points of a canvas that tiles.
    Periodic,
    /// Follows the canvas: `Periodic` where its points repeat with it, else `Fixed(0)`.
    Canvas,
}

impl Boundary {
    /// Resolves `Canvas`, for points that repeat with the canvas or do not.
    fn of_points(self, periodic: bool) -> Self {
        match self {
            Self::Canvas if periodic => Self::Periodic,
            Self::Canvas => Self::Fixed(0.0),
            stated => stated,
        }
    }
}

/// Lets springs move their points, from rest, for a number of steps. This motion makes the pattern of the wrinkles.
///
/// The result depends on stiffness · step² / mass (keep it below about 0.1), on drag · step / mass, and on the number
/// of steps. With a drag of 6 · stiffness · step either integrator is stable and the motion comes to rest. A spring
/// that breaks is removed, but its link stays and makes a long groove.
///
/// ```ron
/// "points": PoissonPoints(pitch: 3),
/// "links": ConnectNeighbors(points: "points"),
/// "field": Perlin(size: 14),
/// "springs": DefineSprings(lattice: "links", field: "field", stiffness: (1, 10)),
/// "moved": SimulateSprings(springs: "springs", step: 0.1, steps: 60, drag: 6, boundary: Periodic),
/// "relinked": ConnectNeighbors(points: "moved.points"),
/// "wrinkles": PlaceWrinkles(lattice: "relinked"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.4, 0.9), depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Houdini *Vellum Solver*, *Wire Solver*; Blender *Cloth*.
#[node]
pub struct SimulateSprings {
    /// The springs.
    pub springs: In<SpringNet>,
    /// Strength of the springs, 0..1: the limit of a spring is the first number of `break_force` where the field is 0
    /// and the second where it is 1. If not given, limits are random.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub break_field: Option<In<Gray>>,
    /// Pixels of `break_field` that count for a link.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Sample::Smooth)]
    pub sample: Sample,
    /// How the values of `break_field` along a link are combined.
    #[default(Reduction::Mean)]
    pub reduce: Reduction,
    /// Columns and rows of the samples of `break_field`. By default the pixels of the picture if the field is a
    /// picture, otherwise four samples per pitch.
    #[schemars(extend("minimum" = 1.0, "maximum" = 8192.0))]
    pub sample_resolution: Option<(u32, u32)>,
    /// Length of a time step.
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0.0))]
    #[default(0.05)]
    pub step: f64,
    /// Number of steps: how far the pattern develops.
    #[schemars(range(min = 0, max = 100_000))]
    #[default(40)]
    pub steps: u32,
    /// Stops as soon as no point is faster than this; 0 runs all steps.
    #[schemars(range(min = 0), extend("unit" = "mm per unit of time"))]
    pub until: f64,
    /// Integration of position and velocity.
    #[default(Integrator::Explicit)]
    pub integrator: Integrator,
    /// Damping of links, added to that of `DefineSprings`: a force against the stretching of a link, this factor times
    /// the speed at which the link grows.
    #[schemars(range(min = 0, max = 1e6))]
    pub damping: f64,
    /// Drag of points: a force against their motion, this factor times their speed.
    #[schemars(range(min = 0, max = 1e6))]
    pub drag: f64,
    /// Diameter of bodies around the points, which push each other away when they touch; 0 for none. Points more than
    /// three diameters apart at the start are assumed never to meet.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub body: f64,
    /// Stiffness of bodies: their force per mm of overlap.
    #[schemars(range(min = 0, max = 1e6))]
    #[default(20.0)]
    pub body_stiffness: f64,
    /// Behaviour at the canvas' edge.
    #[schemars(extend("minimum" = 0.0, "unit" = "mm"))]
    #[default(Boundary::Fixed(0.0))]
    pub boundary: Boundary,
    /// The force beyond which springs break; a pair gives each spring a limit between the two, at random or by
    /// `break_field`. If neither this nor `break_share` is given, no spring breaks.
    #[schemars(extend("minimum" = 0.0))]
    pub break_force: Option<Range>,
    /// The share of springs that break at the start, those under the greatest force: 0.05 is one in twenty. This
    /// defines a limit of force, which then holds for all springs and all steps.
    #[schemars(range(min = 0, max = 1))]
    pub break_share: Option<f64>,
    /// The springs that can break.
    #[default(BreakOn::Either)]
    pub break_on: BreakOn,
    /// Another seed gives springs other limits.
    pub seed: u64,
}

impl Node for SimulateSprings {
    const VERSION: u32 = 9;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];
    const OUTPUTS: &'static [Output] = &[
        Output::new("lattice", Type::Lattice, "The points where they are in the end, with all their links."),
        Output::new("points", Type::Points, "The points alone, ready to be linked again."),
        Output::new("broken", Type::Lattice, "The same points with the links of broken springs only."),
        Output::new(
            "stretch",
            Type::Gray,
            "How far the links around a place were stretched: 1 is not at all, 2 twice as long.",
        ),
        Output::new("breakage", Type::Gray, "The share of broken springs around a place."),
    ];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.break_force.is_some() && self.break_share.is_some() {
            let message = "break_force and break_share are both given; only one of them can set the limit";
            return vec![Problem::new(Code::BadValue, message).at("break_share").help("leave one of them out")];
        }
        if self.break_field.is_some() && self.break_force.is_none() {
            let message = "break_field is given, but break_force is not: there is no limit that it could choose";
            return vec![
                Problem::new(Code::BadValue, message).at("break_field").help("write `break_force: (lowest, highest)`"),
            ];
        }
        Vec::new()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let springs = cx.get(&self.springs)?;
        let lattice = &springs.lattice;
        let periodic = lattice.points.periodic == Tiling::BOTH;
        if self.boundary == Boundary::Periodic && !periodic {
            let message = "boundary is `Periodic`, but the points do not repeat with the canvas";
            let problem = Problem::new(Code::BadValue, message).at("boundary");
            return Err(problem
                .help("use `Canvas`, which follows the canvas, or say `tile: Both` in the canvas")
                .into());
        }
        let start: Vec<[f32; 2]> = lattice.points.positions.iter().map(Vec2::to_array).collect();
        let fixed = self.fixed(&lattice.points, periodic);
        if !fixed.is_empty() && fixed.iter().all(|f| *f) {
            let message = format!("boundary holds all {} points: nothing moves", fixed.len());
            let help = "choose a smaller margin, more points, or `Free`";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("boundary").help(help));
        }
        let mut threshold = self.threshold(cx, &springs, &start)?;
        let mut damping = springs.damping.clone();
        if self.damping > 0.0 {
            damping.resize(lattice.links.len(), 0.0);
            damping.iter_mut().for_each(|d| *d += narrow(self.damping));
        }
        let weightless = AtomicBool::new(false);
        let live = springs.mass_map.as_deref().map(|map| live_mass(map, &lattice.points, &weightless));
        let contacts = Contacts::of(cx, &springs, self.body, self.body_stiffness)?;
        if let Some(contacts) = &contacts {
            // Contacts neither break nor have damping.
            let count = contacts.links.len();
            damping.resize(if damping.is_empty() { 0 } else { count }, 0.0);
            threshold.resize(if threshold.is_empty() { 0 } else { count }, f32::INFINITY);
        }
        let mut net = Net { damping: &damping, threshold: &threshold, fixed: &fixed, ..net(&springs) };
        if let Some(contacts) = &contacts {
            net = Net {
                links: &contacts.links,
                wraps: &contacts.wraps,
                stiffness: &contacts.stiffness,
                rest: &contacts.rest,
                pushes: &contacts.pushes,
                grid: None,
                ..net
            };
        }
        if let Some(live) = &live {
            net.mass = Mass::Live(live);
        }
        let total = u64::from(self.steps);
        let mut stopped = false;
        let outcome = springs::simulate(&start, &net, &self.motion(), &mut |step| {
            cx.evaluator.progress(u64::from(step), total);
            stopped = cx.check().is_err();
            !stopped
        });
        if stopped {
            return Err(Stop::Cancelled);
        }
        if weightless.load(Ordering::Relaxed) {
            let message = "the mass of a point becomes 0 or less on its way";
            let help = "in `DefineMass`, keep both masses and the field's values positive";
            return Err(Problem::new(Code::OutOfRange, message).at("springs").help(help).into());
        }
        let outcome = outcome.map_err(|e| self.explain(&e))?;
        self.advise(cx, &springs, &outcome);
        Ok(outputs(lattice, &outcome))
    }
}

impl SimulateSprings {
    fn motion(&self) -> Motion<f32> {
        Motion {
            step: narrow(self.step),
            steps: self.steps,
            integrator: self.integrator,
            drag: narrow(self.drag),
            break_on: self.break_on,
            settle: narrow(self.until),
        }
    }

    fn fixed(&self, points: &Points, periodic: bool) -> Vec<bool> {
        let Boundary::Fixed(margin) = self.boundary.of_points(periodic) else { return Vec::new() };
        let (margin, size) = (narrow(margin), points.size_mm.as_vec2());
        let within = |margin: f32| border(&points.positions, size, margin);
        let mut held = Vec::new();
        match &points.grid {
            // A set that repeats has no edge.
            _ if periodic => {}
            // The border points of the grid, independent of jitter.
            Some(order) if order.stagger == 0.0 => held.push(border(points.regular(), size, 0.0)),
            _ => held.push(within(points.pitch)),
        }
        if margin > 0.0 {
            held.push(within(margin));
        }
        if let Some(area) = &points.area {
            // Points within a pitch of the contour have lost neighbours.
            held.push(near_contour(&points.positions, area, margin.max(points.pitch)));
        }
        let either = |mut a: Vec<bool>, b: Vec<bool>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            a
        };
        held.into_iter().reduce(either).unwrap_or_default()
    }

    /// The force beyond which each spring breaks; empty if springs never break.
    fn threshold(&self, cx: &Context<'_>, springs: &SpringNet, start: &[[f32; 2]]) -> Result<Vec<f32>, Stop> {
        let forces = || springs::forces(start, &net(springs));
        let range = match (self.break_force, self.break_share) {
            (_, Some(share)) => {
                let forces = forces();
                // These springs break at once on purpose, so no warning.
                return Ok(vec![quantile(&forces, 1.0 - share); forces.len()]);
            }
            (Some(range), None) => range,
            (None, None) => return Ok(Vec::new()),
        };
        let forces = forces();
        let limits: Vec<f32> = match cx.get_opt(&self.break_field)? {
            None => {
                let hash = Hash::new(cx.seed(self.seed));
                (0..forces.len() as u64).map(|n| narrow(range.at(hash.unit(n)))).collect()
            }
            Some(field) => {
                let lattice = &springs.lattice;
                let (pitch, periodic) = (lattice.points.pitch, lattice.points.periodic);
                let read = reading::read(cx, (pitch, periodic), (&field, "break_field"), self.sample_resolution)?;
                let scalars = read.along(cx, lattice, (self.sample, self.reduce))?;
                scalars.iter().map(|&s| narrow(range.at(f64::from(s).clamp(0.0, 1.0)))).collect()
            }
        };
        let early = forces.iter().zip(&limits).filter(|(f, limit)| f > limit).count();
        if early > 0 {
            let message = format!("{early} of {} springs break before the first step", forces.len());
            let highest = forces.iter().copied().fold(0.0, f32::max);
            let help = format!("the highest force at the start is {highest}; choose a break_force above it");
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("break_force").help(help));
        }
        Ok(limits)
    }

    fn explain(&self, error: &SpringError) -> Problem {
        let problem = Problem::new(Code::Diverged, error.to_string());
        let help = format!(
            "lower step (it is {}), stiffness or steps, or raise drag to about 6 · stiffness · step",
            self.step
        );
        problem.at("step").help(help)
    }

    fn advise(&self, cx: &Context<'_>, springs: &SpringNet, outcome: &Outcome<f32>) {
        if outcome.energy_growth > 1000.0 {
            let message = format!("the motion has gained energy, by a factor of {:.0}", outcome.energy_growth);
            cx.evaluator.warn(self.explain_growth(message));
        }
        let share = outcome.broken.len() as f64 / springs.lattice.links.len().max(1) as f64;
        if share > 0.5 {
            let message = format!("{:.0} % of the springs broke; little holds together", share * 100.0);
            let at = if self.break_share.is_some() { "break_share" } else { "break_force" };
            cx.evaluator.warn(Problem::new(Code::Advice, message).at(at));
        }
    }

    fn explain_growth(&self, message: String) -> Problem {
        let help = "lower step, or raise drag to about 6 · stiffness · step";
        Problem::new(Code::Advice, message).at("step").help(help)
    }
}
