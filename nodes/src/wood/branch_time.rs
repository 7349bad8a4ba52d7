//! [`BranchTime`]: the time at which branches reached each point of space.
//!
//! Source: Momoi & Takatera 2014, §3.6 (eqs 14–17; rows B12–B14, B16–B20). Cost: about 1.5 ns a point and branch.
use super::trees::axes;
use shibo_kernel::ground::real::Real;
use shibo_kernel::wood::branch::{Axis, Power, blend_all, branch_time};
use shibo_kernel::wood::solids::{Code, columns, places};
use shibo_kernel::wood::trunk::Places;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Stop, Tree, Type};

/// The time at which branches reached each point: T2 of the source, counted from the tree's first year. The time is
/// infinite behind the plane through a branch's start.
///
/// The time is that of all branches of the tree together, or of one of them. Blend it with the trunk's time. The
/// method is that of the source. For branches that die, use `BlendTimes` with `origin: Branch` instead.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -40), (2, 0, 20), (0, 0, 90)]),
/// "trunk": FitSkeleton(curve: "nodes"),
/// "branched": Branches(skeleton: "trunk", branches: [(height: 0, direction: (1, 0, 0.7), thickening_speed: 0.5)]),
/// "tree": Tree(skeleton: "branched", elongation_speed: 40, thickening_speed: 2),
/// "t1": TrunkTime(tree: "tree"),
/// "t2": BranchTime(tree: "tree"),
/// "time": BlendTimes(times: ["t1", "t2"]),
/// "years": "= fract(time)",
/// "example": CutPlane(solid: "years", origin: (-10, 0, 35), v: (0, 0, -40)),
/// ```
#[node]
pub struct BranchTime {
    /// The tree with its branches.
    pub tree: In<Tree>,
    /// Number of the only branch to use, from 0: first the branches listed in `Branches`, then those of whorls from
    /// below. All branches if not given.
    #[schemars(range(min = 0, max = 1000))]
    pub branch: Option<u32>,
    /// How the times of several branches are combined, as in `BlendTimes`: 2 is the value of the source, `inf` takes
    /// the smallest time. With the same `k` in `BlendTimes`, all branches and the trunk are combined as if at once.
    #[schemars(extend("exclusiveMinimum" = 0.5, "infinite" = true))]
    #[default(2.0)]
    pub k: f64,
}

/// The times of branches at places, combined by `k`.
fn combined<R: Real>(branches: &[Axis<R>], k: f64, at: &Places<'_, R>, out: &mut [R]) {
    if k == 2.0 || branches.len() < 2 {
        return branch_time(branches, at, out);
    }
    let mut one = vec![R::ZERO; out.len()];
    out.fill(R::INFINITY);
    for branch in branches {
        branch_time(std::slice::from_ref(branch), at, &mut one);
        blend_all(out, &one, Power::of(k));
    }
}

impl Node for BranchTime {
    const OUTPUTS: &'static [Output] = &[Output::new(
        "time",
        Type::Solid,
        "Years of growth until a branch reached the point; infinite where none does.",
    )
    .in_unit("years")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let tree = cx.get(&self.tree)?;
        if tree.skeleton.branches.is_empty() && self.branch.is_none() {
            let message = "the tree has no branches: this time is infinite everywhere";
            let help = "connect a `Branches`, or leave this node out";
            cx.evaluator.warn(Problem::new(ErrorCode::Advice, message).at("tree").help(help));
        }
        let mut single: Vec<Axis<f32>> = axes(&tree.skeleton, tree.elongation_speed, tree.ground);
        let mut double: Vec<Axis<f64>> = axes(&tree.skeleton, tree.elongation_speed, tree.ground);
        if let Some(n) = self.branch.map(|n| n as usize) {
            if n >= single.len() {
                let message = format!("branch is `{n}`; the tree has {} branches, numbered from 0", single.len());
                return Err(Problem::new(ErrorCode::OutOfRange, message).at("branch").into());
            }
            (single, double) = (vec![single[n]], vec![double[n]]);
        }
        let k = self.k;
        let time = Code::of_place(move |patch, _, out| combined(&single, k, &places(patch), &mut *out[0])).with_exact(
            move |at, _| {
                let mut out = vec![0.0; at.len()];
                columns(at, |at| combined(&double, k, at, &mut out));
                out
            },
        );
        Ok(Outputs::one(time.solid(Type::Solid, Vec::new())))
    }
}
