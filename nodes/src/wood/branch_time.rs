//! [`BranchTime`]: when branches reached each point of space.
//!
//! Source: Momoi & Takatera 2014, §3.6 (eqs 14–17; rows B12–B14, B16–B18, B20; W-4, W-8). Cost: about 1.5 ns a point and
//! branch.
use super::trees::axes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code as ErrorCode, Problem};
use shibo_engine::node::{Context, Fact, In, Node, Output, Outputs};
use shibo_engine::value::{Skeleton, Stop, Type};
use shibo_kernel::wood::branch::{Axis, branch_time};
use shibo_kernel::wood::solids::{Code, columns, places};

/// The time at which branches reached each point, by way of the trunk: T2, infinite behind the plane through a branch's
/// start.
///
/// All branches of the skeleton together, combined by the rule of `BlendTimes` with k = 2, or one of them. Blend it with
/// the trunk's time. It follows the source; `BlendTimes` with `origin: Branch` has branches that die.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -40), (2, 0, 20), (0, 0, 90)]),
/// "trunk": FitSkeleton(curve: "nodes"),
/// "tree": Branches(skeleton: "trunk", branches: [(height: 0, direction: (1, 0, 0.7), thickening_speed: 0.5)]),
/// "t1": TrunkTime(skeleton: "tree", elongation_speed: 40, thickening_speed: 2),
/// "t2": BranchTime(skeleton: "tree", elongation_speed: 40),
/// "time": BlendTimes(times: ["t1", "t2"]),
/// "years": SolidMath(operation: Fraction, a: "time"),
/// "example": CutPlane(solid: "years", origin: (-10, 0, 35), v: (0, 0, -40)),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BranchTime {
    /// The trunk with its branches.
    pub skeleton: In<Skeleton>,
    /// How fast trunk and branches grow in length.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm/year"))]
    pub elongation_speed: f64,
    /// The height from which the trunk grows.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub ground: f64,
    /// The number of the only branch to look at, from 0; all of them if not given.
    #[schemars(range(min = 0, max = 1000))]
    pub branch: Option<u32>,
}

impl Default for BranchTime {
    fn default() -> Self {
        Self { skeleton: In::default(), elongation_speed: 230.0, ground: 0.0, branch: None }
    }
}

impl Node for BranchTime {
    const OUTPUTS: &'static [Output] = &[Output::new(
        "time",
        Type::Solid,
        "Years of growth until a branch reached the point; infinite where none does.",
    )];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let skeleton = cx.get(&self.skeleton)?;
        let mut single: Vec<Axis<f32>> = axes(&skeleton, self.elongation_speed, self.ground);
        let mut double: Vec<Axis<f64>> = axes(&skeleton, self.elongation_speed, self.ground);
        if let Some(n) = self.branch.map(|n| n as usize) {
            if n >= single.len() {
                let message = format!("branch is `{n}`; the skeleton has {} branches, numbered from 0", single.len());
                return Err(Problem::new(ErrorCode::OutOfRange, message).at("branch").into());
            }
            (single, double) = (vec![single[n]], vec![double[n]]);
        }
        let time = Code::of_place(move |patch, _, out| branch_time(&single, &places(patch), &mut *out[0])).with_exact(
            move |at, _| {
                let mut out = vec![0.0; at.len()];
                columns(at, |at| branch_time(&double, at, &mut out));
                out
            },
        );
        Ok(Outputs::one(time.solid(Type::Solid, Vec::new())))
    }
}
