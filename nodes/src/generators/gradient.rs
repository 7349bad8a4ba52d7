//! [`Gradient`]: a ramp from one point to another.
//!
//! See [`kernel::gradient`](shibo_kernel::pointwise::gradient) for the formulas of the shapes. On a canvas that tiles,
//! shapes around a point are drawn around the nearest of its copies if that leaves no seam. Cost: O(pixels), about half
//! a nanosecond per pixel, 3 ns for `Angular`.
use glam::DVec2;
use shibo_kernel::ground::tile;
use shibo_kernel::pointwise::gradient::{self as kernel, GradientShape, GradientSpec, Repeat};
use shibo_node::{CanvasFacts, Context, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Type};

/// A ramp from 0 at one point to 1 at another.
///
/// `Linear` tiles if it repeats a whole number of times across the canvas (an even number with `Mirror`). `Radial`
/// always tiles, and so do `Diamond` and `Square` without rotation; `Angular` never does.
///
/// ```ron
/// "example": Gradient(angle: 45, times: 4, repeat: Mirror),
/// ```
///
/// Elsewhere: Substance Designer *Gradient Linear*; Blender *Gradient Texture*, *Wave Texture*; Material Maker
/// *Gradient*; Houdini *Ramp*.
#[node]
#[derive(PartialEq)]
pub struct Gradient {
    /// Shape of the lines of equal value.
    #[default(GradientShape::Linear)]
    pub shape: GradientShape,
    /// The point of value 0, measured from the canvas' upper left corner. If not given: for `Linear`, the start of a
    /// ramp that just covers the canvas; for other shapes, the middle of the canvas.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub from: Option<Xy>,
    /// The point of value 1. If not given, it lies in the direction `angle` from `from`: for `Linear`, far enough to
    /// cover the canvas; for other shapes, half the shorter side of the canvas away.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub to: Option<Xy>,
    /// Direction from `from` to `to`, from +x towards +y; has no effect if both points are given.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Number of ramps between `from` and `to`, or once around for `Angular`. With `Mirror`, up and down count as two.
    #[schemars(range(min = 1, max = 1000))]
    #[default(1)]
    pub times: u32,
    /// Values beyond the end of the ramp.
    #[default(Repeat::Once)]
    pub repeat: Repeat,
}

/// Minimum distance between `from` and `to`, mm.
const LEAST: f64 = 1e-6;

impl Gradient {
    fn ends(&self, size: DVec2) -> (DVec2, DVec2) {
        let given = |point: Option<Xy>| point.map(|p| DVec2::new(p.x, p.y));
        let (sin, cos) = (libm::sin(self.angle.to_radians()), libm::cos(self.angle.to_radians()));
        let linear = self.shape == GradientShape::Linear;
        let reach = if linear { (size * DVec2::new(cos, sin).abs()).element_sum() } else { 0.5 * size.min_element() };
        let run = reach * DVec2::new(cos, sin);
        match (given(self.from), given(self.to)) {
            (Some(from), Some(to)) => (from, to),
            (Some(from), None) => (from, from + run),
            (None, Some(to)) if linear => (to - run, to),
            (None, Some(to)) => (0.5 * size, to),
            (None, None) if linear => (0.5 * (size - run), 0.5 * (size + run)),
            (None, None) => (0.5 * size, 0.5 * size + run),
        }
    }

    /// The ramp on a canvas, and the directions in which it repeats.
    fn spec(&self, size: DVec2, tile: Tiling) -> (GradientSpec, Tiling) {
        let (from, to) = self.ends(size);
        let mut spec = GradientSpec {
            shape: self.shape,
            from: from.to_array(),
            to: to.to_array(),
            times: f64::from(self.times),
            repeat: self.repeat,
            period: [None; 2],
        };
        let [x, y] = match self.shape {
            GradientShape::Linear => spec.runs(size.to_array()).map(|runs| self.repeats(runs)),
            GradientShape::Radial => [true; 2],
            GradientShape::Angular => [false; 2],
            GradientShape::Diamond | GradientShape::Square => {
                let d = to - from;
                [(d.x * d.y).abs() < 1e-9 * d.length_squared(); 2]
            }
        };
        let tiling = tile.and(Tiling { x, y });
        spec.period = [tiling.x.then_some(size.x), tiling.y.then_some(size.y)];
        (spec, tiling)
    }

    /// True if a linear ramp with this many runs across the canvas repeats with it.
    fn repeats(&self, runs: f64) -> bool {
        let whole = |x: f64| (x - x.round()).abs() < 1e-6;
        match self.repeat {
            Repeat::Once => runs.abs() < 1e-9,
            Repeat::Repeat => whole(runs),
            Repeat::Mirror => whole(0.5 * runs),
        }
    }
}

impl Node for Gradient {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The ramp, 0..1.")];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        let (from, to) = self.ends(canvas.size_mm());
        if from.distance(to) < LEAST {
            let message = format!("`from` and `to` are the same point, ({}, {}); they must differ", from.x, from.y);
            problems.push(Problem::new(Code::BadValue, message).at(if self.to.is_some() { "to" } else { "from" }));
        }
        if self.times > 1 && self.repeat == Repeat::Once {
            let message = format!("times is `{}`; it must be 1 where `repeat` is `Once`", self.times);
            let help = "say `repeat: Mirror` or `repeat: Repeat`";
            problems.push(Problem::new(Code::BadValue, message).at("times").help(help));
        }
        problems
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let idle =
            self.angle != 0.0 && self.to.is_some() && (self.from.is_some() || self.shape != GradientShape::Linear);
        let message = "`angle` has no effect: the direction is that from `from` to `to`";
        if idle { vec![Problem::new(Code::Advice, message).at("angle")] } else { Vec::new() }
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.spec(canvas.size_mm(), canvas.tile()).1
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (spec, tiling) = self.spec(cx.size_mm(), cx.tiling());
        Ok(Outputs::one(Field::generate(Type::Gray, tiling, move |out, _| {
            kernel::gradient(&spec, &tile::frame(out), out.plane_mut(0));
            Ok(())
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::OnCanvas as _;
    use crate::testing::canvas;

    const SHAPES: [GradientShape; 5] = [
        GradientShape::Linear,
        GradientShape::Radial,
        GradientShape::Angular,
        GradientShape::Diamond,
        GradientShape::Square,
    ];

    #[test]
    fn conforms_in_every_shape() {
        for shape in SHAPES {
            for (repeat, times) in [(Repeat::Once, 1), (Repeat::Repeat, 3), (Repeat::Mirror, 2)] {
                for angle in [0.0, 90.0, 37.0] {
                    conforms(&Gradient { shape, repeat, times, angle, ..Gradient::default() }, &[]);
                }
            }
        }
        let far =
            Gradient { from: Some(Xy::new(-1e6, 1e6)), to: Some(Xy::new(-1e6, 1e6 + 1e-5)), ..Gradient::default() };
        conforms(&Gradient { repeat: Repeat::Mirror, times: 1000, ..far }, &[]);
    }

    #[test]
    fn covers_the_canvas_from_black_to_white() {
        let tile = part(&field(&Gradient::default(), &[], "value"), &canvas(), 0, 0, 64, 64);
        assert!((tile.row(0, 0)[0] - 0.5 / 64.0).abs() < 1e-6 && (tile.row(0, 63)[63] - 63.5 / 64.0).abs() < 1e-6);
        let turned = Gradient { angle: 45.0, ..Gradient::default() };
        let tile = part(&field(&turned, &[], "value"), &canvas(), 0, 0, 64, 64);
        assert!(tile.row(0, 0)[0] < 0.02 && tile.row(0, 63)[63] > 0.98 && (tile.row(0, 0)[63] - 0.5).abs() < 1e-6);
    }

    #[test]
    fn tells_where_it_tiles() {
        let tiling = |gradient: Gradient| gradient.tiling_on(&canvas());
        let (along_x, x_only) = (Gradient::default(), Tiling { x: true, y: false });
        assert_eq!(tiling(along_x.clone()), Tiling { x: false, y: true });
        assert_eq!(tiling(Gradient { angle: 90.0, ..along_x.clone() }), x_only);
        assert_eq!(tiling(Gradient { repeat: Repeat::Repeat, ..along_x.clone() }), Tiling::BOTH);
        assert!(!tiling(Gradient { repeat: Repeat::Mirror, ..along_x.clone() }).x);
        assert_eq!(tiling(Gradient { repeat: Repeat::Mirror, times: 2, ..along_x.clone() }), Tiling::BOTH);
        assert_eq!(tiling(Gradient { repeat: Repeat::Mirror, times: 4, angle: 45.0, ..along_x.clone() }), Tiling::BOTH);
        assert_eq!(tiling(Gradient { shape: GradientShape::Radial, ..along_x.clone() }), Tiling::BOTH);
        assert_eq!(tiling(Gradient { shape: GradientShape::Square, angle: 20.0, ..along_x.clone() }), Tiling::NONE);
        assert_eq!(tiling(Gradient { shape: GradientShape::Angular, ..along_x }), Tiling::NONE);
    }

    #[test]
    fn refuses_contradictory_parameters() {
        let same = Some(Xy::new(3.0, 3.0));
        let wrong = Gradient { from: same, to: same, times: 3, angle: 10.0, ..Gradient::default() };
        let fields: Vec<_> = wrong.check_on(&canvas()).into_iter().filter_map(|p| p.field).collect();
        assert_eq!(fields, ["to", "times"]);
        assert_eq!(wrong.advice_on(&canvas()).len(), 1);
    }
}
