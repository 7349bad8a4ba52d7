//! [`Branches`]: adds branches to a trunk.
//!
//! Source: Momoi & Takatera 2014, §3.1 and §3.6 (rows B12, B13, B20). Beyond the source: branches that end or die, and
//! whorls as measured on a spruce log. Cost: O(branches).
use super::trees::{Triple, even, vector};
use glam::DVec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::wood::fit;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, Range, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Branch, Skeleton, Stop, Type};

/// A branch as given in a graph.
#[node]
#[derive(PartialEq)]
pub struct BranchSpec {
    /// Height on the trunk at which it starts.
    #[schemars(extend("unit" = "mm"))]
    pub height: f64,
    /// Direction in which it grows; the length of the vector has no meaning.
    #[default((1.0, 0.0, 0.5))]
    pub direction: Triple,
    /// Growth in radius.
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "mm/year"))]
    #[default(0.4)]
    pub thickening_speed: f64,
    /// Length; by default it never ends.
    #[schemars(extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub length: Option<f64>,
    /// Year of the tree in which the branch dies; by default it lives.
    #[schemars(extend("minimum" = 0.0, "unit" = "years"))]
    pub dead_from: Option<f64>,
}

/// Adds branches to a trunk: listed branches, and generated whorls (rings of branches at one height).
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 5),
/// "trunk": FitSkeleton(curve: "nodes"),
/// "tree": Branches(skeleton: "trunk", branches: [(height: 0, direction: (0, 1, 0.7), thickening_speed: 0.7)]),
/// "trunk_time": TrunkTime(tree: "tree"),
/// "time": BlendTimes(times: ["trunk_time"], tree: "tree", origin: Branch),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings", knots: "time.knots"),
/// "example": CutPlane(solid: "wood", preset: FlatSawn, distance: 35, height: 5),
/// ```
///
/// Elsewhere: Houdini *L-System*, *Labs Tree Branch Generator*.
#[node]
pub struct Branches {
    /// The trunk.
    pub skeleton: In<Skeleton>,
    /// Branches, each `(height: 0, direction: (x, y, z), thickening_speed: 0.4)`. At most 1000 branches, including
    /// those of whorls.
    pub branches: Vec<BranchSpec>,
    /// Mean distance between generated whorls along the trunk; 0 makes no whorls. In a spruce it is 165 mm.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub whorl_spacing: f64,
    /// Smallest and largest number of branches in a whorl.
    #[schemars(extend("minimum" = 1.0, "maximum" = 32.0))]
    #[default(Range::new(3.0, 5.0))]
    pub per_whorl: Range,
    /// Elevation angle of generated branches.
    #[schemars(extend("minimum" = -60.0, "maximum" = 85.0, "unit" = "°"))]
    #[default(Range::new(30.0, 45.0))]
    pub elevation: Range,
    /// Growth of generated branches in radius.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e3, "unit" = "mm/year"))]
    #[default(Range::new(0.26, 0.46))]
    pub thickening_speed: Range,
    /// Share of generated branches that die.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.6)]
    pub dead_share: f64,
    /// Lifetime, in years, of generated branches that die.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "years"))]
    #[default(Range::new(12.0, 30.0))]
    pub lifetime: Range,
    /// Another seed gives other whorls of the same kind.
    pub seed: u64,
}

/// Maximum number of branches.
const MOST: usize = 1000;

fn whole(v: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 32")]
    let n = v.round().clamp(1.0, 32.0) as u64;
    n
}

impl Branches {
    fn whorls(&self, trunk: &[[DVec3; 4]], hash: Hash) -> Vec<Branch> {
        let (Some(first), Some(last)) = (trunk.first(), trunk.last()) else { return Vec::new() };
        let mut list = Vec::new();
        let (mut z, mut whorl) = (first[0].z, 0u64);
        while self.whorl_spacing > 0.0 && list.len() < MOST {
            let hash = hash.with(whorl);
            // Whorls are 0.6 to 1.4 of the mean distance apart.
            z += self.whorl_spacing * (0.6 + 0.8 * hash.unit(0));
            if z >= last[3].z {
                break;
            }
            let count = whole(self.per_whorl.at(hash.unit(1)));
            let turn = hash.unit(2);
            for i in 0..count {
                let draw = |k: u64| hash.unit(16 + 16 * i + k);
                let angle = std::f64::consts::TAU * (turn + (i as f64 + 0.5 * (draw(0) - 0.5)) / count as f64);
                let rise = self.elevation.at(draw(1)).to_radians();
                let height = z + 0.1 * self.whorl_spacing * (draw(2) - 0.5);
                let flat = libm::cos(rise);
                let lived = if draw(4) < self.dead_share { self.lifetime.at(draw(5)) } else { f64::INFINITY };
                list.push(Branch {
                    start: fit::point_at(trunk, height),
                    direction: DVec3::new(flat * libm::cos(angle), flat * libm::sin(angle), libm::sin(rise)),
                    thickening: self.thickening_speed.at(draw(3)),
                    length: f64::INFINITY,
                    dead_from: f64::INFINITY,
                    lifetime: lived,
                });
            }
            whorl += 1;
        }
        list.truncate(MOST);
        list
    }
}

impl Node for Branches {
    const OUTPUTS: &'static [Output] = &[Output::new("skeleton", Type::Skeleton, "The trunk with its branches.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let bad = |message: String| Problem::new(Code::BadValue, message).at("branches");
        if self.branches.len() > MOST {
            let message = format!("branches has {} entries; at most {MOST} are allowed", self.branches.len());
            return vec![Problem::new(Code::TooLarge, message).at("branches")];
        }
        let wrong = |(i, b): (usize, &BranchSpec)| {
            let direction = vector(b.direction);
            let finite = direction.is_finite() && b.height.is_finite() && b.thickening_speed.is_finite();
            if !finite {
                return Some(bad(format!("branch {i} has a number that is not finite")));
            }
            if b.thickening_speed <= 0.0 {
                let message =
                    format!("branch {i} has thickening_speed `{}`; it must be greater than 0", b.thickening_speed);
                return Some(Problem::new(Code::OutOfRange, message).at("branches"));
            }
            if direction.length() < 1e-9 {
                return Some(bad(format!("branch {i} has no direction; (0, 0, 0) points nowhere")));
            }
            match (b.length, b.dead_from) {
                (Some(l), _) if l.is_nan() || l <= 0.0 => {
                    Some(bad(format!("branch {i} has length `{l}`; it must be greater than 0 mm")))
                }
                (_, Some(y)) if y.is_nan() || y < 0.0 => {
                    Some(bad(format!("branch {i} is dead from year `{y}`; it must be 0 or later")))
                }
                _ => None,
            }
        };
        self.branches.iter().enumerate().find_map(wrong).into_iter().collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let skeleton = cx.get(&self.skeleton)?;
        let trunk = even(&skeleton, "skeleton")?;
        let (low, high) = (trunk.first().map_or(0.0, |c| c[0].z), trunk.last().map_or(0.0, |c| c[3].z));
        let mut branches = skeleton.branches.clone();
        for (i, spec) in self.branches.iter().enumerate() {
            if spec.height < low || spec.height > high {
                let message = format!(
                    "branch {i} starts at height `{}`, where there is no trunk; it must start between {low} and {high}",
                    spec.height
                );
                return Err(Problem::new(Code::BadValue, message).at("branches").into());
            }
            branches.push(Branch {
                start: fit::point_at(&trunk, spec.height),
                direction: vector(spec.direction).normalize(),
                thickening: spec.thickening_speed,
                length: spec.length.unwrap_or(f64::INFINITY),
                dead_from: spec.dead_from.unwrap_or(f64::INFINITY),
                lifetime: f64::INFINITY,
            });
        }
        branches.extend(self.whorls(&trunk, Hash::new(cx.seed(self.seed))));
        branches.truncate(MOST);
        Ok(Outputs::one(Skeleton { trunk, even: true, branches }))
    }
}
