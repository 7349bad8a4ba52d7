//! [`TrunkTime`]: the time at which a trunk reached each point of space.
//!
//! Source: Momoi & Takatera 2014, §3.3 and §3.5 (eqs 8–13; rows B7–B11, B15). Beyond the source: young trees may
//! thicken faster. Cost: about 2 ns a point, for any number of nodes.
use super::trees::even;
use shibo_kernel::wood::solids::{Code, columns, places};
use shibo_kernel::wood::trunk::{Growth, Trunk};
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Stop, Tree, Type};
use std::sync::Arc;

/// The time at which a growing trunk reached each point: T = z / elongation + d / thickening, where d is the horizontal
/// distance from its skeleton.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -20), (6, 2, 10), (-8, 0, 40), (4, 0, 70)]),
/// "tree": Tree(skeleton: FitSkeleton(curve: "nodes"), elongation_speed: 40, thickening_speed: 2),
/// "time": TrunkTime(tree: "tree"),
/// "years": "= fract(time)",
/// "example": CutPlane(solid: "years", origin: (-20, 0, 40), v: (0, 0, -40)),
/// ```
#[node]
pub struct TrunkTime {
    /// The tree.
    pub tree: In<Tree>,
    /// Additional growth in radius while the trunk is thin: 0 in the source, about 0.6 in nature.
    #[schemars(range(min = 0, max = 100))]
    pub age_boost: f64,
    /// Radius over which `age_boost` fades.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(25.0)]
    pub age_fade: f64,
}

impl Node for TrunkTime {
    const OUTPUTS: &'static [Output] = &[
        Output::new("time", Type::Solid, "Years of growth until the trunk reached the point.").in_unit("years"),
        Output::new("distance", Type::Solid, "Horizontal distance from the pith.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let tree = cx.get(&self.tree)?;
        let controls = even(&tree.skeleton, "tree")?;
        let growth = Growth {
            elongation: tree.elongation_speed,
            thickening: tree.thickening_speed,
            ground: tree.ground,
            boost: self.age_boost,
            fade: self.age_fade,
        };
        let (single, double) = (Arc::new(Trunk::<f32>::new(&controls)), Arc::new(Trunk::<f64>::new(&controls)));
        let bytes = controls.len() * 200;
        let (s, d) = (single.clone(), double.clone());
        let time = Code::of_place(move |patch, _, out| s.time(&places(patch), &growth, &mut *out[0]))
            .with_exact(move |at, _| {
                let mut out = vec![0.0; at.len()];
                columns(at, |at| d.time(at, &growth, &mut out));
                out
            })
            .holding(bytes);
        let distance = Code::of_place(move |patch, _, out| single.distance(&places(patch), &mut *out[0])).with_exact(
            move |at, _| {
                let mut out = vec![0.0; at.len()];
                columns(at, |at| double.distance(at, &mut out));
                out
            },
        );
        let time = time.solid(Type::Solid, Vec::new());
        Ok(Outputs::one(time).with("distance", distance.solid(Type::Solid, Vec::new())))
    }
}
