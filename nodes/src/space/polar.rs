//! [`Polar`]: bends a field round a point, or unrolls the surroundings of a point.
//!
//! Pixels are displaced and interpolated by Catmull-Rom, as in [`Warp`](crate::space::Warp): a tile reads only the
//! pixels that it shows. Cost: O(pixels).
use crate::bounds::{exceeds, told};
use crate::warped::Warped;
use glam::DVec2;
use shibo_kernel::ground::number::narrow;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tile, Tiling, Type};

/// Direction of the mapping.
#[choice]
pub enum PolarMode {
    /// Round the point: the upper edge becomes the centre, the lower edge the circle of `radius`, columns become rays
    #[default]
    Bend,
    /// The opposite: rays become columns, the centre becomes the upper edge
    Unroll,
}

/// Bends a field round a point, so that its columns become rays; or unrolls the surroundings of a point.
///
/// A field that tiles in x bends without a seam. The result of `Bend` does not tile; the result of `Unroll` tiles in x.
/// Details that are compressed at the centre are not filtered.
///
/// ```ron
/// "petals": Gradient(times: 12, repeat: Mirror),
/// "ends": Gradient(angle: 90),
/// "shape": "= smoothstep(0.1, -0.1, ends - 0.35 - 0.5 * petals)",
/// "example": Polar(input: "shape"),
/// ```
///
/// Elsewhere: Substance Designer *Cartesian to Polar*, *Polar to Cartesian*; Material Maker *Circle Map*; Photoshop
/// *Polar Coordinates*.
#[node]
pub struct Polar {
    /// Field to bend.
    pub input: In<AnyField>,
    /// Direction of the mapping.
    #[default(PolarMode::Bend)]
    pub mode: PolarMode,
    /// Centre of the mapping; the middle of the canvas by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
    /// Distance from the centre that corresponds to the lower edge; half the shorter side of the canvas by default.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub radius: Option<f64>,
    /// Direction of the ray that corresponds to the left edge, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
}

/// The mapping of places.
#[derive(Clone, Copy)]
struct Bent {
    mode: PolarMode,
    size: DVec2,
    center: DVec2,
    radius: f64,
    angle: f64,
}

impl Bent {
    /// The place in the input that shows at a place of the result.
    fn source(self, at: DVec2) -> DVec2 {
        match self.mode {
            PolarMode::Bend => {
                let from = at - self.center;
                let turns = (libm::atan2(from.y, from.x).to_degrees() - self.angle) / 360.0;
                DVec2::new(turns - turns.floor(), from.length() / self.radius) * self.size
            }
            PolarMode::Unroll => {
                let (sin, cos) = crate::degrees::sin_cos(self.angle + 360.0 * at.x / self.size.x);
                self.center + DVec2::new(cos, sin) * (self.radius * at.y / self.size.y)
            }
        }
    }
}

impl Node for Polar {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, bent.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (radius, least) = (self.radius(canvas.size_mm()), 1e-3 * canvas.size_mm().max_element());
        if !exceeds(least, radius) {
            return Vec::new();
        }
        let (radius, least) = (told(radius), told(least));
        let message = format!("radius is `{radius}` mm; it must be at least a thousandth of the canvas, {least} mm");
        vec![Problem::new(Code::OutOfRange, message).at("radius")]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        match self.mode {
            PolarMode::Bend => Tiling::NONE,
            PolarMode::Unroll => Tiling { x: canvas.tile().x, y: false },
        }
    }

    fn makes_tile(&self, _port: &str) -> bool {
        self.mode == PolarMode::Unroll
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, size) = (cx.get(&self.input)?, cx.size_mm());
        if input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let center = self.center.map_or(0.5 * size, |center| DVec2::new(center.x, center.y));
        let bent = Bent { mode: self.mode, size, center, radius: self.radius(size), angle: self.angle };
        let by = Field::generate(Type::Vec2, Tiling::NONE, move |out: &mut Tile, _| {
            let (grid, window) = (out.grid, out.window);
            let width = out.width();
            let (dx, dy) = out.data_mut().split_at_mut(window.len());
            for (k, (dx, dy)) in dx.iter_mut().zip(dy).enumerate() {
                let at = grid.center(window.x + small(k % width), window.y + small(k / width));
                let moved = bent.source(at) - at;
                (*dx, *dy) = (narrow(moved.x), narrow(moved.y));
            }
            Ok(())
        });
        // Upper bound on the distance of places that show on the canvas or next to it.
        let far = center.abs().max_element() + size.element_sum();
        let limit = 4.0 * (far + far * size.y / bent.radius + bent.radius);
        Ok(Outputs::one(Field::new(input.ty(), self.tiling(cx.canvas), Warped { input, by, limit })))
    }
}

/// A pixel of a tile as an index.
fn small(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

impl Polar {
    fn radius(&self, size: DVec2) -> f64 {
        self.radius.unwrap_or(0.5 * size.min_element())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OnCanvas as _, canvas, check_field, field, lumps, port, raster};

    fn node(mode: PolarMode) -> Polar {
        Polar { input: port(0), mode, ..Polar::default() }
    }

    /// A smooth function of the place in mm.
    fn formula(of: fn(DVec2) -> f64) -> Field {
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = narrow(of(grid.center(window.x + k % width, window.y + k / width)));
            }
            Ok(())
        })
    }

    #[test]
    fn rows_become_circles_and_columns_rays() {
        // y mm of 32 map to y/2 mm of a radius of 16.
        let rows = raster(&field(&node(PolarMode::Bend), &[formula(|at| at.y).into()]), &canvas());
        let columns = Polar { angle: 90.0, ..node(PolarMode::Bend) };
        let columns = raster(&field(&columns, &[formula(|at| at.x).into()]), &canvas());
        let grid = canvas().grid(canvas().resolution);
        for (x, y) in [(40, 20), (10, 50), (33, 60), (5, 9)] {
            let from = grid.center(x, y) - 16.0;
            let (row, at) = (usize::try_from(y).unwrap(), usize::try_from(x).unwrap());
            assert!((f64::from(rows.row(0, row)[at]) - 2.0 * from.length()).abs() < 0.02, "{x} {y}");
            let turn = (from.y.atan2(from.x).to_degrees() - 90.0).rem_euclid(360.0) / 360.0;
            assert!((f64::from(columns.row(0, row)[at]) - 32.0 * turn).abs() < 0.05, "{x} {y}");
        }
    }

    #[test]
    fn unrolled_circles_are_rows() {
        let distance = formula(|at| (at - 16.0).length());
        let unrolled = field(&node(PolarMode::Unroll), &[distance.into()]);
        assert_eq!(unrolled.tiling(), Tiling { x: true, y: false });
        let tile = raster(&unrolled, &canvas());
        for y in 4..60u8 {
            let want = 0.25 * (f32::from(y) + 0.5);
            assert!(tile.row(0, y.into()).iter().all(|v| (v - want).abs() < 0.02), "{y}");
        }
    }

    #[test]
    fn holds_in_any_window() {
        for mode in [PolarMode::Bend, PolarMode::Unroll] {
            check_field(&field(&node(mode), &[lumps().to_rgb().into()]));
            let off = Polar { center: Some(Xy::new(-40.0, 3.0)), radius: Some(500.0), angle: -200.0, ..node(mode) };
            check_field(&field(&off, &[lumps().into()]));
        }
        assert_eq!(Polar { radius: Some(1e-3), ..node(PolarMode::Bend) }.check_on(&canvas()).len(), 1);
    }
}
