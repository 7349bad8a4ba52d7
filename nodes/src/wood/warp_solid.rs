//! [`WarpSolid`]: displaces the points of a solid by noise, for burls and figure.
//!
//! Beyond the source. Cost: about 12 ns a point and octave.
use super::trees::Triple;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::noise::noise3::{DEVIATION, Noise3};
use shibo_kernel::wood::solids::Code;
use shibo_node::{Context, Fact, In, InSpace, MaterialInputs, Node, Output, Outputs, node};
use shibo_value::{ChannelSet, Stop, Type};

/// Warps a solid, or a material of solids, by noise.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "warped": WarpSolid(solid: "time", amount: 7, size: 30, octaves: 3, stretch: (1, 1, 1.5)),
/// "rings": ColorPattern(stops: [(0, "#bc8350"), (0.4, "#b67a48"), (0.8, "#a1663a"), (0.95, "#8e542e"), (1, "#a76c40")]),
/// "wood": RingColor(time: "warped", pattern: "rings"),
/// "example": CutPlane(solid: "wood", preset: FlatSawn, distance: 30),
/// ```
///
/// Elsewhere: Houdini *Volume Deform*.
#[node]
pub struct WarpSolid {
    /// Solid, or material of solids, to warp.
    pub solid: In<InSpace>,
    /// Displacement of points: the standard deviation in each direction.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    #[default(2.0)]
    pub amount: f64,
    /// Size of a cloud of the coarsest octave.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(20.0)]
    pub size: f64,
    /// Factors on the size of clouds in x, y and z.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1000.0))]
    #[default((1.0, 1.0, 1.0))]
    pub stretch: Triple,
    /// Number of octaves.
    #[schemars(range(min = 1, max = 16))]
    #[default(2)]
    pub octaves: u32,
    /// Strength of each octave, as a multiple of that of the one before.
    #[schemars(range(min = 0, max = 2))]
    #[default(0.4)]
    pub gain: f64,
    /// Another seed gives another warp of the same kind.
    pub seed: u64,
}

impl Node for WarpSolid {
    const OUTPUTS: &'static [Output] = &[Output::value_of("solid", &["solid"], "The solid, bent.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn no_op(&self) -> Option<&'static str> {
        (self.amount == 0.0).then_some("solid")
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("solid")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let solid = cx.get(&self.solid)?;
        let hash = Hash::new(cx.seed(self.seed));
        let (mut size, mut weight) = (self.size, self.amount / f64::from(DEVIATION));
        let mut octaves = Vec::new();
        for octave in 0..self.octaves {
            let s = self.stretch;
            let noise: [Noise3; 3] = std::array::from_fn(|k| Noise3::new(hash, u64::from(octave) * 3 + k as u64));
            octaves.push((noise, [s.0, s.1, s.2].map(|s| narrow(1.0 / (s.max(1e-3) * size))), narrow(weight)));
            size *= 0.5;
            weight *= self.gain;
        }
        let code = Code::of_place(move |patch, _, out| {
            let [x, y, z] = patch.place;
            for (axis, plane) in out.iter_mut().enumerate() {
                plane.copy_from_slice(patch.place[axis]);
                for (noise, [a, b, c], weight) in &octaves {
                    let noise = noise[axis];
                    dispatch(
                        #[inline(always)]
                        || {
                            noise.each([x, y, z], [*a, *b, *c], 0.0, plane, |sum, v| sum + weight * v);
                        },
                    );
                }
            }
        });
        let place = code.solid(Type::SolidVector, Vec::new());
        let place = cx.shared("place", place);
        Ok(Outputs::one(solid.map(|solid| solid.moved(place.clone(), false))))
    }
}
