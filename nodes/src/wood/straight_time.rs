//! [`StraightTime`]: the earlier method, for comparison.
//!
//! Source: Momoi & Takatera 2014, §2.2 (eqs 1–3; rows B33–B36). The time jumps far from the skeleton and is angular
//! near it; the curved method avoids both. Cost: O(nodes) a point.
use super::trees::axes;
use super::trees::problem;
use shibo_kernel::ground::real::Real;
use shibo_kernel::wood::branch::{Axis, Power, blend_all, branch_time};
use shibo_kernel::wood::fit;
use shibo_kernel::wood::solids::{Code, columns, places};
use shibo_kernel::wood::straight::Straight;
use shibo_kernel::wood::trunk::Places;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Curve, Skeleton, Stop, Type};

/// The growth time of the earlier method, whose skeleton is straight from node to node. For comparison.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -20), (6, 2, 10), (-8, 0, 40), (4, 0, 70)]),
/// "time": StraightTime(curve: "nodes", elongation_speed: 40, thickening_speed: 2),
/// "years": "= fract(time)",
/// "example": CutPlane(solid: "years", origin: (-20, 0, 40), v: (0, 0, -40)),
/// ```
#[node]
pub struct StraightTime {
    /// The nodes.
    pub curve: In<Curve>,
    /// A skeleton whose branches are blended with the trunk, with k = 2.
    pub branches: Option<In<Skeleton>>,
    /// Growth of the tree along its segments.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm/year"))]
    #[default(230.0)]
    pub elongation_speed: f64,
    /// Growth of the tree away from its segments.
    #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0.0, "unit" = "mm/year"))]
    #[default(2.6)]
    pub thickening_speed: f64,
}

fn fill<R: Real>(straight: &Straight<R>, branches: &[Axis<R>], at: &Places<'_, R>, out: &mut [R]) {
    straight.times(at, out);
    if !branches.is_empty() {
        let mut other = vec![R::ZERO; out.len()];
        branch_time(branches, at, &mut other);
        blend_all(out, &other, Power::Two);
    }
}

impl Node for StraightTime {
    const OUTPUTS: &'static [Output] =
        &[Output::new("time", Type::Solid, "Years of growth, from the nearest segments.").in_unit("years")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let curve = cx.get(&self.curve)?;
        fit::check_nodes(&curve.points).map_err(|e| problem(e, &curve.points).at("curve"))?;
        let branches = cx.get_opt(&self.branches)?;
        let (ve, vh) = (self.elongation_speed, self.thickening_speed);
        let ground = curve.points[0].z;
        let single = branches.as_ref().map_or_else(Vec::new, |s| axes::<f32>(s, ve, ground));
        let double = branches.as_ref().map_or_else(Vec::new, |s| axes::<f64>(s, ve, ground));
        let (short, long) = (Straight::<f32>::new(&curve.points, ve, vh), Straight::<f64>::new(&curve.points, ve, vh));
        let time = Code::of_place(move |patch, _, out| fill(&short, &single, &places(patch), &mut *out[0])).with_exact(
            move |at, _| {
                let mut out = vec![0.0; at.len()];
                columns(at, |at| fill(&long, &double, at, &mut out));
                out
            },
        );
        Ok(Outputs::one(time.solid(Type::Solid, Vec::new())))
    }
}
