//! [`EqualizeHeight`]: control points evenly spaced in height, so that the curve's parameter is linear in z.
//!
//! Source: Momoi & Takatera 2014, §3.4 (eqs 5–8; rows B6, B7). Cost: O(segments).
use super::trees::problem;
use glam::DVec3;
use shibo_kernel::wood::fit;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Skeleton, Stop, Type};

/// Moves the inner control points of a skeleton along its tangents until they are evenly spaced in height.
///
/// The curve stays smooth in direction (C1). Growth times do this automatically; use this node to see the result, or to
/// place branches on it. A shift of more than a third of a segment gives a warning.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -20), (6, 2, 10), (-8, 0, 40), (4, 0, 70)]),
/// "raw": FitSkeleton(curve: "nodes"),
/// "trunk": EqualizeHeight(skeleton: "raw"),
/// "tree": Tree(skeleton: "trunk", thickening_speed: 4),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "example": CutPlane(solid: "wood", origin: (-20, 0, 40), v: (0, 0, -40)),
/// ```
#[node]
pub struct EqualizeHeight {
    /// The skeleton.
    pub skeleton: In<Skeleton>,
}

impl Node for EqualizeHeight {
    const OUTPUTS: &'static [Output] =
        &[Output::new("skeleton", Type::Skeleton, "The skeleton with heights evenly spaced in every segment.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let skeleton = cx.get(&self.skeleton)?;
        let nodes: Vec<DVec3> =
            skeleton.trunk.iter().map(|c| c[0]).chain(skeleton.trunk.last().map(|c| c[3])).collect();
        let (trunk, shift) = fit::equalize(&skeleton.trunk).map_err(|e| problem(e, &nodes).at("skeleton"))?;
        let shortest = trunk.iter().map(|c| c[3].z - c[0].z).fold(f64::INFINITY, f64::min);
        if shift > shortest / 3.0 {
            let message = format!("control points were moved by up to {shift:.3} mm; the curve differs visibly");
            let help = "space the nodes more evenly in height";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("skeleton").help(help));
        }
        Ok(Outputs::one(Skeleton { trunk, even: true, branches: skeleton.branches.clone() }))
    }
}
