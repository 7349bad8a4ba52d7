//! [`FitSkeleton`]: a smooth curve through the nodes of a trunk.
//!
//! Source: Momoi & Takatera 2014, §3.2 (eq 4; rows B2, B3, B4), with the misprint of C1 corrected, and extended
//! from three nodes to any number. Cost: O(nodes).
use super::trees::problem;
use shibo_kernel::wood::fit;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Curve, Skeleton, Stop, Type};

/// How the curve is constructed from the points.
#[choice]
pub enum Scheme {
    /// Through all points, smooth in direction and curvature (C2): the natural spline.
    #[default]
    Natural,
    /// Through all points, smooth in direction (C1); an edit moves only the segments next to it.
    Local,
    /// The points are Bézier control points already, `3n + 1` of them: every third is an end of a segment.
    Given,
}

/// Lays a cubic Bézier curve through the nodes of a trunk: its skeleton.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -20), (6, 2, 10), (-8, 0, 40), (4, 0, 70)]),
/// "trunk": FitSkeleton(curve: "nodes", scheme: Local),
/// "tree": Tree(skeleton: "trunk", thickening_speed: 4),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "example": CutPlane(solid: "wood", origin: (-20, 0, 40), v: (0, 0, -40)),
/// ```
#[node]
pub struct FitSkeleton {
    /// The nodes, or control points.
    pub curve: In<Curve>,
    /// How the curve is constructed from the points.
    pub scheme: Scheme,
}

impl Node for FitSkeleton {
    const OUTPUTS: &'static [Output] =
        &[Output::new("skeleton", Type::Skeleton, "The curve as Bézier segments, not yet evenly spaced in height.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let curve = cx.get(&self.curve)?;
        let points = &curve.points;
        let scheme = match self.scheme {
            Scheme::Natural => fit::Scheme::Natural,
            Scheme::Local => fit::Scheme::Local,
            Scheme::Given => {
                if points.len() < 4 || points.len() % 3 != 1 {
                    let message = format!(
                        "there are {} control points; there must be 4, 7, 10 or any 3n + 1: each segment shares its ends with its neighbours",
                        points.len()
                    );
                    return Err(Problem::new(Code::BadValue, message).at("curve").into());
                }
                let trunk = (0..points.len() / 3).map(|i| std::array::from_fn(|k| points[3 * i + k])).collect();
                return Ok(Outputs::one(Skeleton { trunk, even: false, branches: Vec::new() }));
            }
        };
        let trunk = fit::fit(points, scheme).map_err(|e| problem(e, points).at("curve"))?;
        Ok(Outputs::one(Skeleton { trunk, even: false, branches: Vec::new() }))
    }
}
