//! [`TileSampler`]: one field stamped many times, on a grid or on points.
//!
//! The stamp is read once per resolution, with as many pixels as the largest stamp has; its pyramid serves smaller
//! stamps, with interpolation between pixels. A tile then costs the stamps that overlap it. Control fields are read at
//! the middle of each stamp, from four samples per pitch. See [`kernel::paint`](shibo_kernel::scatter::paint).
use super::plan::{Choice, Order, PLACE, StampPlan};
use super::sown::{self, Ground, OtherStamp, Sown};
use super::varied::varied;
use crate::bounds::{exceeds, told};
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::scatter::paint::{Content, Overlap};
use shibo_node::{AnyField, CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, Range, Xy};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Points, Stop, Tiling};
use std::sync::Arc;

/// Maximum number of stamps.
pub(super) const MOST_STAMPS: f64 = 4e6;

varied! {
    /// Stamps a field many times, on a grid or on points: the whole canvas of the input becomes one stamp of `size` mm.
    ///
    /// Size, rotation, place, value and order vary at random, and fields control the density, size and direction of
    /// stamps. On a canvas that tiles, the grid is changed so that it repeats, and a warning gives the change.
    ///
    /// ```ron
    /// "leaf": Shape(form: Ellipse, size: (36, 16), softness: 8),
    /// "example": TileSampler(input: "leaf.mask", pitch: 4, size: 7, scale: (0.6, 1.2), turn: (0, 360), jitter: 0.8, value: (0.3, 1), overlap: Max),
    /// ```
    ///
    /// Elsewhere: Substance Designer *Tile Sampler*, *Tile Random*, *Splatter*; Material Maker *Tiler*, *Splatter*;
    /// Blender *Instance on Points*; Houdini *Copy to Points*.
    pub struct TileSampler {
        /// Field to stamp; its whole canvas becomes a stamp.
        input: In<AnyField>,
        /// Opacity of the stamp, 0..1, over the same canvas; a full rectangle if not given.
        #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
        shape: Option<In<Gray>>,
        /// Height of the stamp, for `ByHeight`; the input itself if not given.
        height: Option<In<Gray>>,
        /// Positions of the stamps, instead of a grid; `pitch`, `stagger` and `jitter` then have no effect.
        points: Option<In<Points>>,
        /// Further stamps, each with its own size. Every place draws one of all stamps at random, by their weights.
        others: Vec<OtherStamp>,
        [steering]
        /// Distance between columns and between rows; one number sets both.
        #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
        #[default(Xy::new(4.0, 4.0))]
        pitch: Xy,
        /// By how much every second row is shifted, as a share of the pitch.
        #[schemars(range(min = 0, max = 1))]
        stagger: f64,
        /// Largest random shift of stamps, as a share of the pitch: at 1 by up to half a pitch in x and in y.
        #[schemars(range(min = 0, max = 4))]
        jitter: f64,
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

impl TileSampler {
    /// Numbers of columns and rows, and the distances between them.
    fn grid(&self, canvas: &CanvasFacts) -> (DVec2, DVec2) {
        let (size, pitch, tiling) = (canvas.size_mm(), DVec2::new(self.pitch.x, self.pitch.y), canvas.tile());
        let wanted = size / pitch;
        let rows = if self.stagger > 0.0 && self.stagger < 1.0 {
            2.0 * (0.5 * wanted.y).round().max(1.0)
        } else {
            wanted.y.round().max(1.0)
        };
        let fitted = DVec2::new(wanted.x.round().max(1.0), rows);
        let pick = |tiles: bool, fitted: f64, wanted: f64| if tiles { fitted } else { wanted.ceil() };
        let counts = DVec2::new(pick(tiling.x, fitted.x, wanted.x), pick(tiling.y, fitted.y, wanted.y));
        let pitch = DVec2::new(
            if tiling.x { size.x / counts.x } else { pitch.x },
            if tiling.y { size.y / counts.y } else { pitch.y },
        );
        (counts, pitch)
    }
}

impl Node for TileSampler {
    const OUTPUTS: &'static [Output] = sown::OUTPUTS;
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = too_large(&self.choices(), self.scale, canvas);
        let count = self.grid(canvas).0.element_product();
        if self.points.is_none() && count > MOST_STAMPS {
            let message = format!("pitch would make about {count:.0} stamps; at most {MOST_STAMPS:.0} are allowed");
            problems.push(Problem::new(Code::TooLarge, message).at("pitch").help("make the pitch larger"));
        }
        problems
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (wanted, (_, pitch)) = (DVec2::new(self.pitch.x, self.pitch.y), self.grid(canvas));
        if self.points.is_some() || ((pitch - wanted) / wanted).abs().max_element() < 2e-3 {
            return Vec::new();
        }
        let message = format!(
            "distances of stamps are {:.4} × {:.4} mm instead of {} × {} mm, so that the grid fits the canvas",
            pitch.x, pitch.y, wanted.x, wanted.y
        );
        vec![Problem::new(Code::Advice, message).at("pitch")]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if self.points.is_some() { Tiling::BOTH } else { canvas.tile() }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let plan = self.plan(self.value);
        let (set, tiling) = match cx.get_opt(&self.points)? {
            Some(points) => {
                let places = points.positions.iter().map(|p| p.as_dvec2());
                let tiling = points.periodic;
                (plan.stamps(cx, places, (hash, f64::from(points.pitch), tiling))?, tiling)
            }
            None => {
                let (counts, pitch) = self.grid(cx.canvas);
                let (columns, count) = (counts.as_u64vec2().x, counts.as_u64vec2().element_product());
                let place = |n: u64| {
                    let (i, j) = (n % columns, n / columns);
                    let draw = |k: u64| hash.with(n).unit(PLACE + k) - 0.5;
                    let shift = if j % 2 == 1 { self.stagger } else { 0.0 };
                    let at = DVec2::new(i as f64 + 0.5 + shift, j as f64 + 0.5);
                    (at + DVec2::new(draw(0), draw(1)) * self.jitter) * pitch
                };
                (plan.stamps(cx, (0..count).map(place), (hash, pitch.min_element(), cx.tiling()))?, cx.tiling())
            }
        };
        let sown = Sown {
            stamps: sown::stamps(cx, (&self.input, &self.shape, &self.height), &self.others)?,
            set: Arc::new(set),
            overlap: self.overlap,
            content: Content::Scaled,
            ground: Ground::Flat(narrow(self.background)),
            size_mm: cx.size_mm(),
        };
        sown.outputs(tiling)
    }
}

/// Refuses stamps larger than four canvases, which would overlap themselves that often.
pub(super) fn too_large(choices: &[Choice], scale: Range, canvas: &CanvasFacts) -> Vec<Problem> {
    let most = 4.0 * canvas.size_mm().max_element();
    let largest = |choice: &Choice| choice.size.max_element() * scale.hi;
    let Some(number) = choices.iter().position(|choice| exceeds(largest(choice), most)) else { return Vec::new() };
    let (largest, most) = (told(largest(&choices[number])), told(most));
    let message = format!("size makes stamps of up to {largest} mm; they must be at most {most} mm");
    let field = if number == 0 { "size" } else { "others" };
    vec![Problem::new(Code::OutOfRange, message).at(field).help("that is four times the canvas")]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part, rgb};
    use crate::testing::{OnCanvas as _, canvas, port};
    use shibo_value::{Field, Type, Value};

    fn node() -> TileSampler {
        TileSampler {
            input: port(0),
            pitch: Xy::new(8.0, 8.0),
            size: Xy::new(6.0, 4.0),
            turn: Range::new(0.0, 90.0),
            jitter: 1.0,
            ..TileSampler::default()
        }
    }

    #[test]
    fn every_overlap_conforms() {
        for overlap in [Overlap::Max, Overlap::Add, Overlap::Over, Overlap::ByHeight] {
            let node = TileSampler { overlap, scale: Range::new(0.5, 2.0), ..node() };
            conforms(&node, &[gray().into()]);
            let steered = TileSampler {
                shape: Some(port(1)),
                height: Some(port(1)),
                density: Some(port(1)),
                scale_by: Some(port(1)),
                order: Order::Random,
                ..node
            };
            conforms(&steered, &[rgb().into(), gray().into()]);
        }
    }

    #[test]
    fn a_grid_of_full_stamps_is_a_grid_of_rectangles() {
        let one: [Value; 1] = [Field::constant(Type::Gray, &[0.5]).into()];
        let node = TileSampler { turn: Range::new(0.0, 0.0), jitter: 0.0, ..node() };
        let tile = part(&field(&node, &one, "result"), &canvas(), 0, 0, 64, 64);
        let ids = part(&field(&node, &one, "ids"), &canvas(), 0, 0, 64, 64);
        for k in 0..64 * 64 {
            // Pixels of ½ mm; in every 8 × 8 mm a stamp from 1 to 7 mm and from 2 to 6 mm.
            let (x, y) = (k % 64, k / 64);
            let inside = (2..14).contains(&(x % 16)) && (4..12).contains(&(y % 16));
            assert_eq!(tile.data()[k], if inside { 0.5 } else { 0.0 }, "{x} {y}");
            let number = (y / 16 * 4 + x / 16 + 1) as f32;
            assert_eq!(ids.data()[k], if inside { number } else { 0.0 });
        }
    }

    #[test]
    fn fields_control_stamps() {
        let value = |v: f32| Value::from(Field::constant(Type::Gray, &[v]));
        let mean = |node: &TileSampler, steer: f32| {
            let tile = part(&field(node, &[value(1.0), value(steer)], "mask"), &canvas(), 0, 0, 64, 64);
            tile.data().iter().sum::<f32>() / 4096.0
        };
        let node = TileSampler { pitch: Xy::new(1.0, 1.0), size: Xy::new(0.5, 0.5), jitter: 0.0, ..node() };
        let thinned = TileSampler { density: Some(port(1)), ..node.clone() };
        assert!((mean(&thinned, 0.4) - 0.4 * mean(&node, 1.0)).abs() < 0.015);
        assert_eq!(mean(&thinned, 0.0), 0.0);
        let small =
            TileSampler { scale_by: Some(port(1)), pitch: Xy::new(8.0, 8.0), size: Xy::new(8.0, 4.0), ..node.clone() };
        assert!((mean(&small, 0.5) - 0.125).abs() < 0.01, "{}", mean(&small, 0.5));
        let turned = TileSampler { direction: Some(port(1)), turn: Range::new(0.0, 0.0), ..small };
        let turned = TileSampler { scale_by: None, ..turned };
        let tile = part(&field(&turned, &[value(1.0), value(90.0)], "result"), &canvas(), 0, 0, 64, 64);
        assert!(tile.row(0, 1)[7] == 1.0 && tile.row(0, 7)[2] == 0.0, "upright");
    }

    #[test]
    fn refuses_invalid_stamps() {
        assert_eq!(TileSampler { pitch: Xy::new(1e-3, 1e-3), ..node() }.check_on(&canvas())[0].code, Code::TooLarge);
        assert_eq!(TileSampler { size: Xy::new(200.0, 1.0), ..node() }.check_on(&canvas())[0].code, Code::OutOfRange);
        assert_eq!(TileSampler { pitch: Xy::new(7.0, 8.0), ..node() }.advice_on(&canvas()).len(), 1);
        let normal: Value = Field::constant(Type::Normal, &[0.5, 0.5, 1.0]).into();
        assert!(crate::testing::outputs(&node(), &[normal], &canvas()).is_err());
    }
}
