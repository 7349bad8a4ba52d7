//! [`RadialBlur`]: a blur round a point, or away from it.
//!
//! The mean over an arc of a circle, or over a part of a ray, through each pixel, two samples a pixel of the path, at
//! most 511; see [`kernel::paths`](shibo_kernel::filter::paths). Cost: O(pixels · length of the paths in pixels).
use glam::DVec2;
use shibo_kernel::filter::paths::{self, Reader};
use shibo_kernel::ground::math::{cos_degrees, sin_degrees};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Window};

/// The paths along which a radial blur smears.
#[choice]
pub enum RadialDirection {
    /// Round the centre, along arcs of `angle`
    #[default]
    Spin,
    /// Towards the centre and away from it, by the share `zoom` of the distance
    Zoom,
}

/// Smears a field round a point, as if the field turned, or away from the point, as if the field came nearer.
///
/// The result does not tile. Far from the centre paths are long: the cost grows with the distance.
///
/// ```ron
/// "noise": Perlin(size: 0.8),
/// "spun": RadialBlur(input: "noise", angle: 40),
/// "example": Levels(input: "spun", low: 0.35, high: 0.65),
/// ```
///
/// Elsewhere: Substance Designer *Radial Blur*, Blender *Directional Blur* (Spin, Zoom), Houdini *Radial Blur*.
#[node]
pub struct RadialBlur {
    /// Field to smear.
    pub input: In<AnyField>,
    /// Direction of the paths.
    #[default(RadialDirection::Spin)]
    pub direction: RadialDirection,
    /// With `Spin`: angle of the arcs.
    #[schemars(range(min = 0, max = 360), extend("unit" = "°"))]
    #[default(10.0)]
    pub angle: f64,
    /// With `Zoom`: length of the rays, as a share of the distance from the centre.
    #[schemars(range(min = 0, max = 1.9))]
    #[default(0.2)]
    pub zoom: f64,
    /// The centre of the arcs and rays; the canvas' centre by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
}

/// A field smeared round a point.
struct Smeared {
    input: Field,
    direction: RadialDirection,
    /// Degrees, or a share of the distance.
    amount: f64,
    center: DVec2,
    /// The parameter that determines the halo, for messages.
    reaches_by: &'static str,
}

impl Smeared {
    /// Distance from a pixel to the end of its path, and length of the path, as shares of the distance from the centre.
    fn reach(&self) -> (f64, f64) {
        match self.direction {
            RadialDirection::Spin => (2.0 * libm::sin((0.25 * self.amount).to_radians()), self.amount.to_radians()),
            RadialDirection::Zoom => (0.5 * self.amount, self.amount),
        }
    }
}

impl FieldSource for Smeared {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let ends = [grid.center(window.x, window.y), grid.center(window.right() - 1, window.bottom() - 1)];
        let far = ends.map(|end| (end - self.center).abs());
        let (dx, dy) = grid.pixels(far[0].max(far[1]).length() * self.reach().0);
        vec![Read::new(&self.input, grid, window.grow(dx + 1, dy + 1))]
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some(self.reaches_by)
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, grid, rect) = (given.tile(0), out.grid, out.window);
        let views: Vec<_> = (0..input.channels()).map(|k| tile::view(input, k)).collect();
        let (direction, amount, length) = (self.direction, narrow(self.amount), self.reach().1);
        let pixel = grid.step.as_vec2();
        let path = |x: i32, y: i32, _: usize| {
            let from = grid.center(x, y) - self.center;
            let count = paths::samples(length * from.length() / grid.min_step());
            let from = from.as_vec2();
            let place = move |at: f32| {
                let moved = match direction {
                    RadialDirection::Spin => {
                        let (sin, cos) = (sin_degrees(at * amount), cos_degrees(at * amount));
                        glam::Vec2::new(cos * from.x - sin * from.y, sin * from.x + cos * from.y) - from
                    }
                    RadialDirection::Zoom => from * (at * amount),
                };
                (moved / pixel).to_array()
            };
            (count, place)
        };
        paths::mean_along(&Reader::new(&views), rect, path, &mut out.planes_mut());
        given.check()
    }
}

impl Node for RadialBlur {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, smeared.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let default = Self::default();
        let idle = match self.direction {
            RadialDirection::Spin if self.zoom != default.zoom => ("zoom", "Zoom"),
            RadialDirection::Zoom if self.angle != default.angle => ("angle", "Spin"),
            _ => return Vec::new(),
        };
        let message = format!("`{}` has no effect without `direction: {}`", idle.0, idle.1);
        vec![Problem::new(Code::Advice, message).at(idle.0)]
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        if self.amount() == 0.0 { Tiling::BOTH } else { Tiling::NONE }
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.amount() == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let center = self.center.map_or(0.5 * cx.size_mm(), |center| DVec2::new(center.x, center.y));
        let ty = input.ty();
        let reaches_by = match (self.center, self.direction) {
            (Some(_), _) => "center",
            (None, RadialDirection::Spin) => "angle",
            (None, RadialDirection::Zoom) => "zoom",
        };
        let source = Smeared { input, direction: self.direction, amount: self.amount(), center, reaches_by };
        Ok(Outputs::one(Field::new(ty, Tiling::NONE, source)))
    }
}

impl RadialBlur {
    fn amount(&self) -> f64 {
        match self.direction {
            RadialDirection::Spin => self.angle,
            RadialDirection::Zoom => self.zoom,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, check_field, field, lumps, port, render};
    use shibo_value::Type;

    /// A field that depends only on the distance from the centre, or only on the direction.
    fn rings(of_angle: bool) -> Field {
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width) - 16.0;
                #[expect(clippy::cast_possible_truncation, reason = "a test picture")]
                let value = if of_angle { (3.0 * at.y.atan2(at.x)).sin() } else { (0.7 * at.length()).sin() } as f32;
                *v = value;
            }
            Ok(())
        })
    }

    #[test]
    fn keeps_values_that_are_constant_along_paths() {
        let spin = RadialBlur { input: port(0), angle: 90.0, ..RadialBlur::default() };
        let zoom = RadialBlur { direction: RadialDirection::Zoom, zoom: 0.5, ..spin.clone() };
        for (node, of_angle) in [(&spin, false), (&zoom, true)] {
            let (out, input) =
                (render(node, &[rings(of_angle).into()]), crate::testing::raster(&rings(of_angle), &canvas()));
            for y in 0..64 {
                for x in (0..64).filter(|x| (*x as f32 - 31.5).hypot(y as f32 - 31.5) > 14.0) {
                    let (a, b) = (out.row(0, y)[x], input.row(0, y)[x]);
                    assert!((a - b).abs() < 0.04, "{of_angle} {x} {y}: {a} {b}");
                }
            }
        }
        // Three waves round a circle, smeared over 120°, are gone.
        let gone = render(&RadialBlur { angle: 120.0, ..spin }, &[rings(true).into()]);
        assert!((0..64).all(|x| gone.row(0, 5)[x].abs() < 0.03));
    }

    #[test]
    fn holds_in_any_window() {
        for (direction, angle, zoom) in
            [(RadialDirection::Spin, 360.0, 0.2), (RadialDirection::Spin, 5.0, 0.2), (RadialDirection::Zoom, 10.0, 1.9)]
        {
            let node = RadialBlur { input: port(0), direction, angle, zoom, center: Some(Xy::new(5.0, 40.0)) };
            check_field(&field(&node, &[lumps().to_rgb().into()]));
            assert_eq!(node.tiling_on(&canvas()), Tiling::NONE);
        }
    }
}
