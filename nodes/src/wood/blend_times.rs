//! [`BlendTimes`]: the growth times of trunk and branches combined.
//!
//! Source: Momoi & Takatera 2014, §3.6 (eq 18; rows B18, B19, B20, B35). Beyond the source: `origin: Branch` blends
//! relative to each branch's birth, with branches that end or die, become darker and keep their bark. Cost: about 2 ns
//! a point and branch nearby.
use super::trees::even;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::branch::{Power, blend, blend_all};
use shibo_kernel::wood::knots::{self, Knot, KnotStyle};
use shibo_kernel::wood::solids::{Code, places};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, SolidNumber, choice, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Solid, Stop, Tree, Type};

/// Start of the times that are blended.
#[choice]
pub enum Origin {
    /// From the tree's first year, as in the source: T = (Σ T^-k)^(-1/k) of all `times`.
    #[default]
    Tree,
    /// From the birth of each branch of `tree`: rings are disturbed only near a knot, and are never torn.
    Branch,
}

/// Blends growth times: the rings of the trunk run smoothly around and into the rings of branches.
///
/// With `origin: Tree`, connect the times of trunk and branches. With `origin: Branch`, connect the trunk's time and
/// the `tree`; the times of its branches are then computed here. Branches may die, and outputs give masks of knots
/// and bark.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 5),
/// "trunk": FitSkeleton(curve: "nodes"),
/// "tree": Branches(skeleton: "trunk", branches: [
///     (height: -10, direction: (0.2, 1, 0.7), thickening_speed: 0.42),
///     (height: 12, direction: (-0.35, 1, 0.4), thickening_speed: 0.36, dead_from: 9),
/// ]),
/// "t1": TrunkTime(tree: "tree"),
/// "time": BlendTimes(times: ["t1"], tree: "tree", origin: Branch),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings", knots: "time.knots", bark: "time.bark"),
/// "example": CutPlane(solid: "wood", preset: FlatSawn, distance: 40, height: 10),
/// ```
#[node]
pub struct BlendTimes {
    /// The times; the trunk's time comes first.
    pub times: Vec<In<SolidNumber>>,
    /// The tree with its branches, for `origin: Branch`.
    pub tree: Option<In<Tree>>,
    /// Start of the times that are blended.
    #[default(Origin::Tree)]
    pub origin: Origin,
    /// Sharpness of the blend: 2 is the value of the source, `inf` takes the smaller one of the times. By default 2 for
    /// `Tree` and 4 for `Branch`.
    #[schemars(extend("exclusiveMinimum" = 0.5, "infinite" = true))]
    pub k: Option<f64>,
    /// Depth, in years, of the dip of rings towards a dead stub.
    #[schemars(range(min = 0, max = 3), extend("unit" = "years"))]
    #[default(0.9)]
    pub dip: f64,
    /// Thickness of the bark round a dead stub.
    #[schemars(range(min = 0, max = 20), extend("unit" = "mm"))]
    #[default(0.6)]
    pub bark: f64,
    /// Deviation of knots from circles.
    #[schemars(range(min = 0, max = 0.5))]
    #[default(0.16)]
    pub lobes: f64,
    /// Another seed gives knots other shapes.
    pub seed: u64,
}

impl BlendTimes {
    fn tree(&self, times: Vec<Solid>) -> Solid {
        let k = self.k.unwrap_or(2.0);
        let (single, double) = (Power::<f32>::of(k), Power::<f64>::of(k));
        Code::of_inputs(move |_, inputs, out| {
            out[0].copy_from_slice(inputs[0].plane(0));
            inputs[1..].iter().for_each(|input| blend_all(&mut *out[0], input.plane(0), single));
        })
        .with_exact(move |_, inputs| {
            let mut out = inputs[0].clone();
            for input in &inputs[1..] {
                out.iter_mut().zip(input).for_each(|(a, b)| *a = blend(*a, *b, double));
            }
            out
        })
        .solid(Type::Solid, times)
    }

    /// The share of a point that belongs to branches, from the times of the source.
    fn share(times: Vec<Solid>) -> Solid {
        Code::of_inputs(move |_, inputs, out| {
            let trunk = inputs[0].plane(0);
            out[0].fill(0.0);
            for input in &inputs[1..] {
                for ((share, t1), t2) in out[0].iter_mut().zip(trunk).zip(input.plane(0)) {
                    let g = (t1 / t2.max(1e-6)).clamp(0.0, 100.0).powi(4);
                    *share = share.max(g / (1.0 + g));
                }
            }
        })
        .solid(Type::Solid, times)
    }

    fn knots(tree: &Tree, hash: Hash) -> Vec<Knot> {
        let knot = |(i, b): (usize, &shibo_value::Branch)| {
            let birth = (b.start.z - tree.ground) / tree.elongation_speed;
            let life = (b.dead_from - birth).min(b.lifetime).max(0.0);
            Knot::new(b.start, b.direction, b.length, birth, life, b.thickening, hash.with(i as u64))
        };
        tree.skeleton.branches.iter().enumerate().map(knot).collect()
    }
}

impl Node for BlendTimes {
    const OUTPUTS: &'static [Output] = &[
        Output::new("time", Type::Solid, "Years of growth until anything of the tree reached the point.")
            .in_unit("years"),
        Output::new("knots", Type::Solid, "How much of the point belongs to a branch, 0..1."),
        Output::new("bark", Type::Solid, "Where a dead branch kept its bark, 0..1; for `origin: Branch`."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let bad = |message: &str, field: &str| vec![Problem::new(ErrorCode::BadValue, message).at(field)];
        match (self.times.is_empty(), self.origin, &self.tree) {
            (true, ..) => bad("times is empty; connect at least the trunk's time", "times"),
            (_, Origin::Branch, None) => {
                bad("origin is `Branch`, which needs `tree`: the trunk with its branches", "origin")
            }
            (_, Origin::Tree, Some(_)) => bad(
                "tree is not used with `origin: Tree`; connect a `BranchTime` to `times`, or use `origin: Branch`",
                "tree",
            ),
            _ => Vec::new(),
        }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let times = cx.get_all(&self.times)?;
        if self.origin == Origin::Tree {
            let share = Self::share(times.clone());
            return Ok(Outputs::one(self.tree(times))
                .with("knots", share)
                .with("bark", Solid::constant(Type::Solid, &[0.0])));
        }
        let trunk = if times.len() == 1 { times[0].clone() } else { self.tree(times) };
        let Some(tree) = cx.get_opt(&self.tree)? else {
            return Err(Problem::new(ErrorCode::MissingInput, "tree is not connected").at("tree").into());
        };
        even(&tree.skeleton, "tree")?;
        let knots = Self::knots(&tree, Hash::new(cx.seed(self.seed)));
        let k = self.k.unwrap_or(4.0);
        let style = KnotStyle {
            elongation: narrow(tree.elongation_speed),
            thickening: narrow(tree.thickening_speed),
            power: narrow(k.min(64.0)),
            dip: narrow(self.dip),
            bark: narrow(self.bark),
            lobes: narrow(self.lobes),
        };
        let code = Code::of_place(move |patch, inputs, out| {
            if let [time, share, bark] = out {
                knots::blend(
                    &knots,
                    &style,
                    &places(patch),
                    inputs[0].plane(0),
                    patch.pixel,
                    [&mut **time, &mut **share, &mut **bark],
                );
            }
        });
        let all = Solid::bundle(3, vec![trunk], code);
        let all = cx.shared("all", all);
        Ok(Outputs::one(all.channel(0)).with("knots", all.channel(1)).with("bark", all.channel(2)))
    }
}
