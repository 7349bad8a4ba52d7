//! [`WoodPores`]: the vessels of hardwoods.
//!
//! Beyond the source. Cost: about 25 ns a point.
use crate::by_calendar::ByCalendar;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::pores::{PoreStyle, Pores};
use shibo_kernel::wood::solids::{Code, spans};
use shibo_kernel::wood::years::Calendar;
use shibo_node::{Color, Context, Fact, In, Linear, Node, Output, Outputs, SolidColor, SolidNumber, SolidVector, node};
use shibo_value::{Solid, Stop, Tree, Type};

/// Draws the pores of wood: dark dashes along the grain, dots on end grain, most of them in early wood.
///
/// Pores smaller than pixels are drawn as the average share of each part of the year that they cover. Most woods have
/// two populations, few large pores and many small ones: draw each with a separate node.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": Tree(skeleton: FitSkeleton(curve: "nodes"), elongation_speed: 260, thickening_speed: 2.3),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(stops: [(0, "#b58e60"), (0.34, "#c9a577"), (0.7, "#c4a070"), (1, "#b08859")]),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "fiber": FiberSpace(time: "time", tree: "tree"),
/// "oak": WoodPores(color: "wood", fiber: "fiber", time: "time", tree: "tree"),
/// "example": CutPlane(solid: "oak", preset: FlatSawn, distance: 40),
/// ```
#[node]
pub struct WoodPores {
    /// The colour to draw on.
    pub color: In<SolidColor>,
    /// Coordinates along the fibres: the output `place` of `FiberSpace`.
    pub fiber: In<SolidVector>,
    /// The growth time, after `VaryGrowth` with a `series`, which gives the year in which pores grew.
    pub time: In<SolidNumber>,
    /// The tree, for its growth; the usual speeds if not given.
    pub tree: Option<In<Tree>>,
    /// The distance between pores across the grain; at least 1.7 times the largest radius.
    #[schemars(range(min = 0.01, max = 100), extend("unit" = "mm"))]
    #[default(0.36)]
    pub cell: f64,
    /// Length of the longest pores.
    #[schemars(range(min = 0.1, max = 1000), extend("unit" = "mm"))]
    #[default(11.0)]
    pub length: f64,
    /// Radius in early wood and in late wood.
    #[schemars(extend("minimum" = 0.0, "maximum" = 10.0, "unit" = "mm"))]
    #[default(Linear::new(0.145, 0.035))]
    pub radius: Linear,
    /// Share of places that have a pore, in early wood and in late wood.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(Linear::new(0.85, 0.2))]
    pub density: Linear,
    /// Share of the year that is early wood.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.26)]
    pub early: f64,
    /// Clustering of pores into groups, with empty places between them, as in ash and walnut: 0 for none.
    #[schemars(range(min = 0, max = 1))]
    pub groups: f64,
    /// Darkness of pores.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.62)]
    pub darkness: f64,
    /// Colour in pores; by default that of the wood, darkened.
    pub filling: Option<Color>,
    /// Depth of pores.
    #[schemars(range(min = 0, max = 10), extend("unit" = "mm"))]
    #[default(0.11)]
    pub depth: f64,
    /// Another seed gives other pores of the same kind.
    pub seed: u64,
}

impl WoodPores {
    fn pores(&self, tree: Option<&Tree>, calendar: Option<Calendar>, hash: Hash) -> Pores {
        let speeds = tree.map_or([Tree::ELONGATION, Tree::THICKENING, 0.0], |tree| {
            [tree.elongation_speed, tree.thickening_speed, tree.ground]
        });
        let [elongation, thickening, ground] = speeds.map(narrow);
        let style = PoreStyle {
            cell: narrow(self.cell),
            length: narrow(self.length),
            radius: [narrow(self.radius.at0), narrow(self.radius.at1)],
            density: [narrow(self.density.at0), narrow(self.density.at1)],
            early: narrow(self.early),
            groups: narrow(self.groups),
            elongation,
            thickening,
            ground,
        };
        Pores::new(style, calendar, hash)
    }
}

impl Node for WoodPores {
    const VERSION: u32 = 5;
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::SolidColor, "The colour with its pores."),
        Output::new("mask", Type::Solid, "How much of a point is pore, 0..1."),
        Output::new("height", Type::Solid, "Minus the depth in pores.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (color, fiber, time) = (cx.get(&self.color)?, cx.get(&self.fiber)?, cx.get(&self.time)?);
        let tree = cx.get_opt(&self.tree)?;
        let even = ByCalendar::of(&time).map(|(even, calendar)| (even.clone(), calendar));
        let calendar = even.as_ref().map(|(_, calendar)| calendar.clone());
        let mut pores = self.pores(tree.as_deref(), calendar, Hash::new(cx.seed(self.seed)));
        let time = even.filter(|(_, calendar)| pores.by_even_time(calendar)).map_or(time, |(even, _)| even);
        let code = Code::of_inputs(move |patch, inputs, out| {
            let [x, y, z] = [0, 1, 2].map(|c| inputs[0].plane(c));
            let time = inputs[1].plane(0);
            let single = pores.single(patch.pixel);
            if single > 0.0 {
                pores.fill([x, y, z], patch.pixel, out[0]);
            } else {
                out[0].fill(0.0);
            }
            if single < 1.0 {
                let [across, down] = spans(time, patch);
                for (i, out) in out[0].iter_mut().enumerate() {
                    *out = math::lerp(pores.mean(time[i], across[i], down[i]), *out, single);
                }
            }
        });
        let mask = Solid::new(Type::Solid, vec![fiber, time], code.with_quads().kept());
        let mask = cx.shared("mask", mask);
        let (dark, filling) = (narrow(self.darkness), self.filling.map(|c| c.0));
        let paint = Code::of_inputs(move |_, inputs, out| {
            for (c, plane) in out.iter_mut().enumerate() {
                for ((out, color), mask) in plane.iter_mut().zip(inputs[0].plane(c)).zip(inputs[1].plane(0)) {
                    let inside = filling.map_or(*color * (1.0 - dark), |f| math::lerp(*color, f[c], dark));
                    *out = math::lerp(*color, inside, *mask);
                }
            }
        });
        let depth = narrow(self.depth);
        let height = Code::of_inputs(move |_, inputs, out| {
            out[0].iter_mut().zip(inputs[0].plane(0)).for_each(|(out, m)| *out = -depth * m);
        });
        Ok(Outputs::one(paint.solid(Type::SolidColor, vec![color, mask.clone()]))
            .with("mask", mask.clone())
            .with("height", height.solid(Type::Solid, vec![mask])))
    }
}
