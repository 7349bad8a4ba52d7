//! [`BudEyes`]: the eyes of burls, around which rings bend inwards.
//!
//! Beyond the source. Buds are placed like a Poisson process: each cell of angle and height has up to two buds anywhere
//! in it, so that neither rows nor even distances are visible. A dip is a cone in its middle, so that rings close
//! around the eye on every cut, and flat at its rim. Cost: about 25 ns a point.
use super::trees::even;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::noise::noise3::Noise3;
use shibo_kernel::wood::solids::{Code, places};
use shibo_kernel::wood::trunk::{Places, Trunk};
use shibo_node::{Context, Fact, In, Node, Output, Outputs, SolidNumber, node};
use shibo_value::{Solid, Stop, Tree, Type};

/// Adds buds that never grew into branches: rings bend around each of them, and a flat cut shows eyes.
///
/// Buds run outwards from the pith. Put this node before `BlendTimes` and before `VaryGrowth` with a `series`.
/// `WarpSolid` makes the rings between buds swirl.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 7),
/// "tree": Tree(skeleton: FitSkeleton(curve: "nodes"), elongation_speed: 200, thickening_speed: 1.7),
/// "even": TrunkTime(tree: "tree"),
/// "warped": WarpSolid(solid: "even", amount: 4, size: 46, octaves: 3, stretch: (1, 1, 1.5)),
/// "eyes": BudEyes(time: "warped", tree: "tree"),
/// "rings": ColorPattern(stops: [(0, "#bc8350"), (0.4, "#b67a48"), (0.8, "#a1663a"), (0.95, "#8e542e"), (1, "#a76c40")]),
/// "wood": RingColor(time: "eyes", pattern: "rings", knots: "eyes.eyes", knot_color: "#6a3a20"),
/// "example": CutPlane(solid: "wood", preset: FlatSawn, distance: 70),
/// ```
#[node]
pub struct BudEyes {
    /// The growth time before `VaryGrowth` with a `series`.
    pub time: In<SolidNumber>,
    /// The tree; buds run outwards from its pith. The z axis if not given.
    pub tree: Option<In<Tree>>,
    /// Distance between buds at `radius`.
    #[schemars(range(min = 0.5, max = 1000), extend("unit" = "mm"))]
    #[default(11.0)]
    pub spacing: f64,
    /// Distance from the pith at which buds are `spacing` apart; farther out their distance around the stem is larger.
    #[schemars(range(min = 1, max = 1e4), extend("unit" = "mm"))]
    #[default(70.0)]
    pub radius: f64,
    /// Share of the possible places that have a bud.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.62)]
    pub density: f64,
    /// Factor of 0 to 1 on `density`, because buds mostly stand in clusters.
    pub crowd: Option<In<SolidNumber>>,
    /// Depth, in years, of the dip of rings at the middle of the largest buds.
    #[schemars(range(min = 0, max = 20), extend("unit" = "years"))]
    #[default(3.2)]
    pub depth: f64,
    /// Another seed gives other buds of the same kind.
    pub seed: u64,
}

/// Buds in cells of angle and height.
#[derive(Clone, Copy)]
struct Buds {
    cells: Noise3,
    /// Number of cells round the stem, and the inverse of their height.
    around: f32,
    inverse: f32,
    density: f32,
}

/// Radii of the smallest and the largest buds, in cells.
const SIZES: (f32, f32) = (0.22, 0.72);

/// Eight bits of a word as a number 0..1.
#[inline(always)]
fn byte(word: u32, shift: u32) -> f32 {
    ((word >> shift) & 0xff) as f32 * (1.0 / 255.0)
}

impl Buds {
    /// Depth of a point in a bud, from 0 outside to 1 in the middle of the largest; and its nearness to the middle,
    /// 0..1. `turn` is the angle of the point as a share of a full circle, `z` its height, `crowd` the factor on the
    /// density there.
    #[inline(always)]
    fn at(&self, turn: f32, z: f32, crowd: f32) -> (f32, f32) {
        let (u, v) = ((turn + 0.5) * self.around, z * self.inverse);
        let ((fu, _), (fv, iv)) = (math::floor_int(u), math::floor_int(v));
        let (mut deep, mut near) = (0.0, 0.0);
        let chances = 0.5 * self.density * crowd;
        for dv in -1..=1_i16 {
            for du in -1..=1_i16 {
                // The last cell is the neighbour of the first.
                let cell = fu + f32::from(du);
                let cell = cell - math::floor_int(cell / self.around).0 * self.around;
                for which in 0..2 {
                    let word = self.cells.word(math::floor_int(cell).1, iv.wrapping_add(i32::from(dv)), which);
                    // Where the density falls, buds fade by becoming shallow and are never cut off.
                    let there = math::smooth((chances - byte(word, 24)) * 8.0);
                    let (x, y) = (fu + f32::from(du) + byte(word, 0), fv + f32::from(dv) + byte(word, 8));
                    let size = SIZES.0 + (SIZES.1 - SIZES.0) * byte(word, 16);
                    let (dx, dy) = ((u - x) / size, (v - y) / size);
                    let inside = there * math::max(1.0 - (dx * dx + dy * dy).sqrt(), 0.0);
                    deep = math::max(deep, inside * inside * (size / SIZES.1));
                    near = math::max(near, inside);
                }
            }
        }
        (deep, near)
    }

    fn fill(&self, trunk: &Trunk<f32>, at: &Places<'_, f32>, depth: f32, inputs: [&[f32]; 2], out: [&mut [f32]; 2]) {
        let ([time, crowd], [earlier, eyes]) = (inputs, out);
        dispatch(
            #[inline(always)]
            || {
                trunk.runs(
                    at,
                    #[inline(always)]
                    |from, to, qx, qy| {
                        for i in from..to {
                            let (x, y) = (at.x[i] - qx[i - from], at.y[i] - qy[i - from]);
                            let turn = math::atan2(y, x) * (0.5 * std::f32::consts::FRAC_1_PI);
                            // Angles have no meaning at the pith, so there are no buds there.
                            let grown = math::smooth((x * x + y * y).sqrt() * 0.1);
                            let (deep, near) = self.at(turn, at.z[i], math::saturate(crowd[i]));
                            earlier[i] = time[i] - depth * deep * grown;
                            // Only the middle of a bud has its colour.
                            eyes[i] = math::smooth((near - 0.76) * 7.0) * grown;
                        }
                    },
                );
            },
        );
    }
}

impl Node for BudEyes {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[
        Output::new("time", Type::Solid, "The growth time with its dips.").in_unit("years"),
        Output::new("eyes", Type::Solid, "How much of a point is bud, 0..1, for `RingColor.knots`."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let time = cx.get(&self.time)?;
        let trunk = match cx.get_opt(&self.tree)? {
            Some(tree) => Trunk::<f32>::new(&even(&tree.skeleton, "tree")?),
            None => Trunk::new(&[]),
        };
        let buds = Buds {
            cells: Noise3::new(Hash::new(cx.seed(self.seed)), 0),
            around: narrow((std::f64::consts::TAU * self.radius / self.spacing).round().max(3.0)),
            inverse: narrow(1.0 / self.spacing),
            density: narrow(self.density),
        };
        let depth = narrow(self.depth);
        let crowd = cx.get_opt(&self.crowd)?.unwrap_or_else(|| Solid::constant(Type::Solid, &[1.0]));
        let code = Code::of_place(move |patch, inputs, out| {
            if let [time, eyes] = out {
                let read = [inputs[0].plane(0), inputs[1].plane(0)];
                buds.fill(&trunk, &places(patch), depth, read, [&mut **time, &mut **eyes]);
            }
        });
        let all = cx.shared("all", Solid::bundle(2, vec![time, crowd], code));
        Ok(Outputs::one(all.channel(0)).with("eyes", all.channel(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buds_are_round_the_stem_without_a_seam() {
        let buds = Buds { cells: Noise3::new(Hash::new(3), 0), around: 40.0, inverse: 1.0 / 11.0, density: 0.62 };
        let (mut met, mut steepest) = (0, 0.0_f32);
        for i in 0..4000_i16 {
            let z = f32::from(i) * 0.05;
            let (left, right) = (buds.at(-0.5 + 1e-6, z, 1.0).0, buds.at(0.5 - 1e-6, z, 1.0).0);
            assert!((left - right).abs() < 1e-3, "{z}: {left} {right}");
            let (a, b) = (buds.at(0.123, z, 1.0), buds.at(0.123, z + 0.05, 1.0));
            steepest = steepest.max((a.0 - b.0).abs());
            met += i32::from(a.1 > 0.0);
            assert!((0.0..=1.0).contains(&a.0) && (0.0..=1.0).contains(&a.1));
            assert_eq!(buds.at(0.123, z, 0.0), (0.0, 0.0));
        }
        assert!((400..3200).contains(&met) && steepest < 0.05, "{met} {steepest}");
    }

    /// Eyes close around their middles: on small circles round its deepest point, a dip is shallower on all sides.
    #[test]
    fn dips_are_cones() {
        let buds = Buds { cells: Noise3::new(Hash::new(3), 0), around: 40.0, inverse: 1.0 / 11.0, density: 0.62 };
        let at = |x: i16, y: i16| buds.at(f32::from(x) * 0.0002, f32::from(y) * 0.1, 1.0).1;
        let mut middles = 0;
        for x in 1..1200_i16 {
            for y in 1..400_i16 {
                let here = at(x, y);
                let ring = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(i, j)| at(x + i, y + j));
                if here > 0.9 && ring.iter().all(|v| *v <= here) {
                    middles += 1;
                    let lowest = [(9, 0), (-9, 0), (0, 9), (0, -9)].map(|(i, j)| here - at(x + i, y + j));
                    assert!(lowest.iter().all(|fall| *fall > 0.05), "{x} {y}: {here} {lowest:?}");
                }
            }
        }
        assert!(middles > 5, "{middles}");
    }
}
