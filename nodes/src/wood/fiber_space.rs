//! [`FiberSpace`]: coordinates along the fibres of a tree.
//!
//! Beyond the source. Cost: about 25 ns a point, with curl 40 ns.
use super::trees::even;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::fiber::{FiberStyle, Fibers, Obstacle};
use shibo_kernel::wood::solids::{Code, places};
use shibo_kernel::wood::trunk::Trunk;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, SolidNumber, node};
use shibo_value::{Stop, Tree, Type};
use std::sync::Arc;

/// Coordinates along the fibres, for drawing streaks, pores and rays; and the direction of the fibres.
///
/// Connect the time before `VaryGrowth` with a `series`. Fibres wander, spiral, curl and flow around the branches of
/// the tree.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "fiber": FiberSpace(time: "time", tree: "tree", curl: 0.4, curl_length: 9),
/// "streaks": SolidNoise(place: "fiber", size: 0.6, octaves: 2, stretch: (1, 1, 60)),
/// "example": CutPlane(solid: "streaks", preset: FlatSawn, distance: 30),
/// ```
#[node]
pub struct FiberSpace {
    /// The growth time, including branches, before `VaryGrowth` with a `series`.
    pub time: In<SolidNumber>,
    /// The tree with its branches.
    pub tree: In<Tree>,
    /// Strength of the wander of fibres; 1 is natural.
    #[schemars(range(min = 0, max = 10))]
    #[default(1.0)]
    pub wander: f64,
    /// The angle at which fibres wind round the stem.
    #[schemars(range(min = -30, max = 30), extend("unit" = "°"))]
    pub spiral: f64,
    /// The angle of interlocked grain, which changes sides from layer to layer; only `direction` shows it.
    #[schemars(range(min = 0, max = 30), extend("unit" = "°"))]
    pub interlock: f64,
    /// Thickness of two layers of interlocked grain.
    #[schemars(range(min = 0.1, max = 1000), extend("unit" = "mm"))]
    #[default(14.0)]
    pub interlock_pitch: f64,
    /// Sideways amplitude of curly grain; 0 for straight grain.
    #[schemars(range(min = 0, max = 10), extend("unit" = "mm"))]
    pub curl: f64,
    /// Wavelength of curly grain.
    #[schemars(range(min = 0.5, max = 1000), extend("unit" = "mm"))]
    #[default(10.0)]
    pub curl_length: f64,
    /// Irregularity of the waves of curly grain.
    #[schemars(range(min = 0, max = 3))]
    #[default(0.55)]
    pub curl_chaos: f64,
    /// Another seed gives other fibres of the same kind.
    pub seed: u64,
}

impl Node for FiberSpace {
    const VERSION: u32 = 4;
    const OUTPUTS: &'static [Output] = &[
        Output::new("place", Type::SolidVector, "Coordinates X, Y across and Z along the fibres.").in_unit("mm"),
        Output::new("direction", Type::SolidVector, "The direction of the fibres in space, of length 1."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let time = cx.get(&self.time)?;
        let tree = cx.get(&self.tree)?;
        let trunk = Arc::new(Trunk::<f32>::new(&even(&tree.skeleton, "tree")?));
        let tangent = |degrees: f64| narrow(libm::tan(degrees.to_radians()));
        let style = FiberStyle {
            elongation: narrow(tree.elongation_speed),
            thickening: narrow(tree.thickening_speed),
            ground: narrow(tree.ground),
            wander: narrow(self.wander),
            spiral: tangent(self.spiral),
            curl: narrow(self.curl),
            curl_length: narrow(self.curl_length),
            curl_chaos: narrow(self.curl_chaos),
            interlock: tangent(self.interlock),
            interlock_pitch: narrow(self.interlock_pitch),
        };
        let obstacle = |b: &shibo_value::Branch| {
            Obstacle::new(b.start, b.direction, b.length, b.thickening / tree.thickening_speed)
        };
        let obstacles = tree.skeleton.branches.iter().map(obstacle).collect();
        let fibers = Arc::new(Fibers::new(style, obstacles, Hash::new(cx.seed(self.seed))));
        let (f, t) = (fibers.clone(), trunk.clone());
        let place = Code::of_place(move |patch, inputs, out| {
            if let [x, y, z] = out {
                let out = [&mut **x, &mut **y, &mut **z];
                f.place(&t, &places(patch), inputs[0].plane(0), patch.pixel, out);
            }
        });
        let direction = Code::of_place(move |patch, _, out| {
            if let [x, y, z] = out {
                fibers.direction(&trunk, &places(patch), patch.pixel, [&mut **x, &mut **y, &mut **z]);
            }
        });
        Ok(Outputs::one(place.solid(Type::SolidVector, vec![time]))
            .with("direction", direction.passing().solid(Type::SolidVector, Vec::new())))
    }
}
