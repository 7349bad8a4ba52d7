//! [`DeformSolid`]: work on a solid, such as twisting, drilling and folding.
//!
//! Each step is a formula ([`kernel::bend`](shibo_kernel::deposits::bend)). Cost: 10 to 60 ns a point and step.
use super::parts::{self, Triple, planes, points, put, vector};
use glam::DVec3;
use shibo_kernel::deposits::bend::{Dimples, Step, Work, undo};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::wood::solids::Code;
use shibo_node::{CanvasFacts, Context, Fact, In, InSpace, MaterialInputs, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{ChannelSet, Stop, Type};
use std::sync::Arc;

/// Work on a solid.
#[choice]
pub enum Deformation {
    /// Turned about the axis through `at` along `direction`, by `angle` over each `length`.
    #[default]
    Twist,
    /// Bars beside each other along `across`, each `pitch` wide and twisted about its own axis along `direction`, by
    /// `angle` over each `length`; every second one turns the other way.
    Bars,
    /// Dimples are drilled into the face through `at`, whose outer side is `direction`, and the face is forged or ground
    /// flat: deeper material comes to the face, as in raindrop damascus. Uses `pitch`, `radius`, `depth`, `reach` and
    /// `jitter`.
    Drill,
    /// The same with grooves, which follow each other along `across`, as in ladder damascus.
    Groove,
    /// Squeezed along `direction` to `factor` of its thickness; the sides give way, and the volume stays.
    Press,
    /// A stack of thickness `length` is folded onto itself along `direction`, until it has `layers` of its former self in
    /// the same thickness. Folding n times gives 2^n.
    Fold,
    /// The material at `at` is pushed by the vector `by`, that around it less, up to `radius`.
    Push,
}

/// A step of work as given in a graph.
#[node]
#[derive(PartialEq)]
pub struct WorkStep {
    /// The work.
    pub work: Deformation,
    /// A point of the axis, the face or the push, in mm.
    pub at: Triple,
    /// Direction of the axis, or the outer side of the face; the length of the vector has no meaning.
    #[default((0.0, 0.0, 1.0))]
    pub direction: Triple,
    /// `Twist`, `Bars`: the turn over each `length`.
    #[schemars(range(min = -36000, max = 36000), extend("unit" = "°"))]
    #[default(360.0)]
    pub angle: f64,
    /// `Twist`, `Bars`: length of a turn by `angle`. `Fold`: thickness of the stack.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(60.0)]
    pub length: f64,
    /// `Drill`, `Groove`, `Bars`: distance from one dimple, groove or bar to the next.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(8.0)]
    pub pitch: f64,
    /// `Drill`, `Groove`, `Push`: radius, or half the width of a groove.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(3.5)]
    pub radius: f64,
    /// `Drill`, `Groove`: depth of dimples.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    #[default(1.5)]
    pub depth: f64,
    /// `Drill`, `Groove`: depth below the face at which material stays in place; at least a little more than `depth`.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(6.0)]
    pub reach: f64,
    /// `Drill`, `Groove`: deviation of places and depths from a regular layout.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.4)]
    pub jitter: f64,
    /// `Groove`, `Bars`: direction in which grooves or bars follow each other.
    #[default((1.0, 0.0, 0.0))]
    pub across: Triple,
    /// `Press`: thickness after the work, as a share of that before.
    #[schemars(range(min = 0.01, max = 100))]
    #[default(0.5)]
    pub factor: f64,
    /// `Fold`: number of layers of the stack.
    #[schemars(range(min = 1, max = 65536))]
    #[default(4)]
    pub layers: u32,
    /// `Push`: vector by which the material at `at` moves, in mm.
    pub by: Triple,
}

/// Bends a solid, or a material of solids, by steps of work: twisted, drilled, pressed and folded steel, mokume, or
/// dents in strata.
///
/// ```ron
/// "stack": LayerTime(thickness: 0.8),
/// "steel": DeformSolid(solid: "stack", steps: [(work: Drill, pitch: 9, radius: 4.2, depth: 4, reach: 12)]),
/// "etched": ColorPattern(stops: [(0, "#c8c8c6"), (0.45, "#c0c0be"), (0.5, "#4a4a4c"), (1, "#505052")]),
/// "color": RingColor(time: "steel", pattern: "etched"),
/// "example": CutPlane(solid: "color", origin: (-16, -16, 0), u: (32, 0, 0), v: (0, 32, 0)),
/// ```
///
/// Elsewhere: Houdini *Volume Deform*, *Twist*; Blender *Simple Deform*.
#[node]
pub struct DeformSolid {
    /// Solid, or material of solids, to deform.
    pub solid: In<InSpace>,
    /// Steps of work, in their order. At most 256.
    pub steps: Vec<WorkStep>,
    /// Another seed gives other places of dimples and grooves.
    pub seed: u64,
}

/// Maximum number of steps.
const MOST: usize = 256;

impl WorkStep {
    fn step(&self, hash: Hash) -> Step {
        let way = vector(self.direction).try_normalize().unwrap_or(DVec3::Z);
        let dimples = Dimples {
            pitch: self.pitch,
            radius: self.radius,
            depth: self.depth,
            reach: self.reach,
            jitter: self.jitter,
        };
        let across = vector(self.across);
        let across = (across - way * across.dot(way)).try_normalize();
        let across = across.unwrap_or_else(|| way.any_orthonormal_vector());
        let work = match self.work {
            Deformation::Twist => Work::Twist(self.angle / self.length),
            Deformation::Bars => Work::Bars(self.angle / self.length, self.pitch, across),
            Deformation::Drill => Work::Drill(dimples),
            Deformation::Groove => Work::Groove(dimples, across),
            Deformation::Press => Work::Press(self.factor),
            Deformation::Fold => Work::Fold(self.length, f64::from(self.layers)),
            Deformation::Push => Work::Push(vector(self.by), self.radius),
        };
        Step { at: vector(self.at), way, work, hash }
    }

    fn problems(&self, n: usize) -> Vec<Problem> {
        let field = |name: &str| format!("steps.{n}.{name}");
        let mut list: Vec<Problem> = [
            parts::place(self.at, &field("at")),
            parts::direction(self.direction, &field("direction")),
            parts::direction(self.across, &field("across")),
            parts::place(self.by, &field("by")),
        ]
        .into_iter()
        .flatten()
        .collect();
        if matches!(self.work, Deformation::Drill | Deformation::Groove) && self.reach <= self.depth {
            let message = format!("reach is {} mm; it must be more than depth, {} mm", self.reach, self.depth);
            let problem = Problem::new(ErrorCode::BadValue, message).at(field("reach"));
            list.push(problem.help("two to four times the depth looks natural"));
        }
        list
    }
}

impl Node for DeformSolid {
    const OUTPUTS: &'static [Output] = &[Output::value_of("solid", &["solid"], "The solid after the work.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn no_op(&self) -> Option<&'static str> {
        self.steps.is_empty().then_some("solid")
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("solid")
    }

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.steps.len() > MOST {
            let message = format!("steps has {} entries; at most {MOST} are allowed", self.steps.len());
            return vec![Problem::new(ErrorCode::BadValue, message).at("steps")];
        }
        self.steps.iter().enumerate().flat_map(|(n, step)| step.problems(n)).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let solid = cx.get(&self.solid)?;
        let hash = Hash::new(cx.seed(self.seed));
        let steps: Arc<[Step]> =
            self.steps.iter().enumerate().map(|(n, step)| step.step(hash.with(n as u64))).collect();
        let exact = steps.clone();
        let code = Code::of_place(move |patch, _, out| {
            points(patch).enumerate().for_each(|(i, p)| put(out, i, undo(&steps, p)));
        })
        .with_exact(move |at, _| planes(&at.iter().map(|p| undo(&exact, *p)).collect::<Vec<_>>()));
        let place = cx.shared("place", code.solid(Type::SolidVector, Vec::new()));
        Ok(Outputs::one(solid.map(|solid| solid.moved(place.clone(), false))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs, port};
    use shibo_value::{Solid, Value};

    fn height() -> Solid {
        let code = Code::of_place(|patch, _, out| out[0].copy_from_slice(patch.place[2]));
        code.with_exact(|at, _| at.iter().map(|p| p.z).collect()).solid(Type::Solid, Vec::new())
    }

    fn deformed(steps: Vec<WorkStep>, at: &[DVec3]) -> Vec<f64> {
        let node = DeformSolid { solid: port(0), steps, ..DeformSolid::default() };
        let outputs = outputs(&node, &[height().into()], &canvas()).unwrap();
        let Some(Value::Solid(solid)) = outputs.take("solid", true) else { panic!("no solid") };
        solid.at(at)
    }

    #[test]
    fn steps_are_undone_from_the_last_one() {
        let press = WorkStep { work: Deformation::Press, factor: 0.25, ..WorkStep::default() };
        let fold = WorkStep { work: Deformation::Fold, length: 8.0, layers: 2, ..WorkStep::default() };
        let at = [DVec3::new(1.0, 2.0, 3.0)];
        // Pressed after the fold: z 3 was 12; in the fold, 12 mm is the top of layer 3.
        assert_eq!(deformed(vec![fold.clone(), press.clone()], &at), [8.0]);
        // Folded after the press: z 3 was 6 in the stack, which was 24 mm before the press.
        assert_eq!(deformed(vec![press, fold], &at), [24.0]);
        assert_eq!(deformed(Vec::new(), &at), [3.0]);
    }

    #[test]
    fn refuses_dimples_that_reach_no_deeper_than_they_are() {
        let step = WorkStep { work: Deformation::Drill, depth: 3.0, reach: 3.0, ..WorkStep::default() };
        let node = DeformSolid { steps: vec![step], ..DeformSolid::default() };
        let problems = crate::testing::OnCanvas::check_on(&node, &canvas());
        assert_eq!(problems.len(), 1, "{problems:?}");
    }
}
