//! [`Scatter`]: one field stamped on points.
//!
//! Uses the kernel of [`TileSampler`](super::TileSampler).
use super::plan::{Choice, Order, StampPlan};
use super::sown::{self, Ground, OtherStamp, Sown};
use super::tile_sampler::too_large;
use super::varied::varied;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::scatter::paint::{Content, Overlap};
use shibo_node::{AnyField, CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, Range, Xy};
use shibo_value::diagnostics::Problem;
use shibo_value::{Points, Stop};
use std::sync::Arc;

varied! {
    /// Stamps a field on points: pebbles, leaves, rivets, drops. The whole canvas of the input becomes one stamp of
    /// `size` mm.
    ///
    /// `others` adds stamps with sizes of their own. `TileSampler` does the same on a grid.
    ///
    /// ```ron
    /// "pebble": Shape(form: Ellipse, size: (38, 30), softness: 24),
    /// "chip": Shape(form: Polygon, size: 38, sides: 5, softness: 12),
    /// "points": PoissonPoints(pitch: 4),
    /// "pebbles": Scatter(
    ///   input: "pebble.mask", points: "points", size: 6, scale: (0.5, 1.1), turn: (0, 360), value: (1, 2),
    ///   others: [(input: "chip.mask", size: (3, 2.4), weight: 1.5)],
    /// ),
    /// "example": Relief(height: "pebbles"),
    /// ```
    ///
    /// Elsewhere: Substance Designer *Shape Splatter*; Material Maker *Splatter*; Blender *Instance on Points*; Houdini
    /// *Copy to Points*.
    pub struct Scatter {
        /// Field to stamp; its whole canvas becomes a stamp.
        input: In<AnyField>,
        /// Positions of the stamps.
        points: In<Points>,
        /// Opacity of the stamp, 0..1, over the same canvas; a full rectangle if not given.
        #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
        shape: Option<In<Gray>>,
        /// Height of the stamp, for `ByHeight`; the input itself if not given.
        height: Option<In<Gray>>,
        /// Further stamps, each with its own size. Every place draws one of all stamps at random, by their weights.
        others: Vec<OtherStamp>,
        [steering]
        [sizes]
        /// Smallest and largest factor on the values; each stamp draws one at random.
        #[schemars(extend("minimum" = -1e6, "maximum" = 1e6))]
        #[default(Range::new(1.0, 1.0))]
        value: Range,
        [share]
        /// How stamps that overlap are combined.
        #[default(Overlap::Max)]
        overlap: Overlap,
        [order]
        /// The value where there is no stamp.
        #[schemars(range(min = -1e6, max = 1e6))]
        background: f64,
        [seed]
    }
}

impl Node for Scatter {
    const OUTPUTS: &'static [Output] = sown::OUTPUTS;
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        too_large(&self.choices(), self.scale, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let points = cx.get(&self.points)?;
        let plan = self.plan(self.value);
        let places = points.positions.iter().map(|p| p.as_dvec2());
        let hash = Hash::new(cx.seed(self.seed));
        let set = plan.stamps(cx, places, (hash, f64::from(points.pitch), points.periodic))?;
        let sown = Sown {
            stamps: sown::stamps(cx, (&self.input, &self.shape, &self.height), &self.others)?,
            set: Arc::new(set),
            overlap: self.overlap,
            content: Content::Scaled,
            ground: Ground::Flat(narrow(self.background)),
            size_mm: cx.size_mm(),
        };
        sown.outputs(points.periodic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::{canvas, port};
    use shibo_value::{Field, Tiling, Type, Value};

    fn points() -> Value {
        let positions = vec![glam::Vec2::new(4.0, 4.0), glam::Vec2::new(30.0, 20.0), glam::Vec2::new(40.0, 10.0)];
        Points {
            positions,
            size_mm: glam::DVec2::splat(32.0),
            periodic: Tiling::BOTH,
            pitch: 10.0,
            ..Points::default()
        }
        .into()
    }

    #[test]
    fn other_stamps_have_their_own_size_and_colour() {
        let other = OtherStamp { input: port(2), size: Some(Xy::new(2.0, 6.0)), weight: 1e6, ..OtherStamp::default() };
        let node = Scatter { input: port(0), points: port(1), others: vec![other], ..Scatter::default() };
        let (grey, red) = (Field::constant(Type::Gray, &[0.5]), Field::constant(Type::Rgb, &[1.0, 0.0, 0.0]));
        let inputs: [Value; 3] = [grey.into(), points(), red.into()];
        conforms(&node, &inputs);
        // Practically all stamps are of the second sort: 2 × 6 mm are 4 × 12 pixels.
        let mask = part(&field(&node, &inputs, "mask"), &canvas(), 0, 0, 64, 64);
        assert_eq!(mask.data().iter().sum::<f32>(), 144.0);
        let colors = part(&field(&node, &inputs, "result"), &canvas(), 0, 0, 64, 64);
        assert_eq!([0, 1, 2].map(|k| colors.row(k, 8)[8]), [1.0, 0.0, 0.0]);
        // With weight 0, all are of the first sort, whose grey becomes a colour.
        let OtherStamp { input, size, .. } = node.others.into_iter().next().unwrap();
        let none = OtherStamp { input, size, weight: 0.0, ..OtherStamp::default() };
        let node = Scatter { input: port(0), points: port(1), others: vec![none], ..Scatter::default() };
        let colors = part(&field(&node, &inputs, "result"), &canvas(), 0, 0, 64, 64);
        assert_eq!([0, 1, 2].map(|k| colors.row(k, 8)[8]), [0.5; 3]);
        assert_eq!(colors.plane(1).iter().sum::<f32>(), 96.0);
    }

    #[test]
    fn stamps_lie_on_the_points() {
        let node = Scatter { input: port(0), points: port(1), turn: Range::new(0.0, 360.0), ..Scatter::default() };
        conforms(&node, &[gray().into(), points()]);
        let node = Scatter { turn: Range::new(0.0, 0.0), ..node };
        let mask = field(&node, &[Field::constant(Type::Gray, &[1.0]).into(), points()], "mask");
        let tile = part(&mask, &canvas(), 0, 0, 64, 64);
        // Stamps of 4 × 4 mm about (4, 4), about (30, 20) across the border, and about (40, 10), which is (8, 10).
        let covered = |x: usize, y: usize| tile.row(0, y)[x];
        assert_eq!((covered(4, 4), covered(11, 11), covered(12, 8), covered(3, 8)), (1.0, 1.0, 0.0, 0.0));
        assert_eq!((covered(63, 40), covered(0, 40), covered(16, 20), covered(20, 20)), (1.0, 0.0, 1.0, 0.0));
        assert_eq!(tile.data().iter().sum::<f32>(), 192.0);
    }
}
