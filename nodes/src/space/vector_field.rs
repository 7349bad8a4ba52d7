//! [`VectorField`]: directions and displacements from a field of numbers.
//!
//! Gradients are those of [`kernel::slopes`](shibo_kernel::filter::slopes): differences between neighbouring pixels,
//! per mm. Cost: O(pixels), plus a blur with a `radius`.
use crate::bounds::at_most_half;
use shibo_kernel::filter::{fields, slopes};
use shibo_kernel::ground::math::{clamp, cos_degrees, sin_degrees};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// How vectors are made from a field.
#[choice]
pub enum VectorKind {
    /// They point uphill; their length is the slope
    #[default]
    Gradient,
    /// The gradient turned by 90° from +x towards +y: along lines of equal value, round hills and hollows
    Perpendicular,
    /// The field is the direction itself in degrees, from +x towards +y; with vectors of length 1
    Angle,
}

/// Vectors from a field: uphill, along its contour lines, or in the direction that its values give.
///
/// Use them as directions for `AlongField`, `Gabor`, `Fibers` and `JacobianFromVectors`, or as displacements for
/// `Warp`. The perpendicular of a noise is curl noise, which `Curl` makes in one node. The perpendicular of the
/// distance from a knot gives lines round it.
///
/// Slopes are differences between neighbouring pixels. Detail of a few pixels is steeper in a larger picture, so set
/// `radius` to at least a pixel to get the same vectors at all resolutions. The `angle` jumps by a full turn from 180°
/// to -180°: a small picture shows the angle at the middle of a pixel, because an average would be wrong.
///
/// ```ron
/// "knots": Perlin(size: 16),
/// "along": VectorField(input: "knots", kind: Perpendicular),
/// "noise": WhiteNoise(size: 0.35),
/// "lines": AlongField(input: "noise", direction: "along", length: 8),
/// "example": Levels(input: "lines", low: 0.32, high: 0.68),
/// ```
///
/// Elsewhere: Houdini *Slope Direction*; Substance Designer *Normal* as a vector map; Blender *Bump*.
#[node]
pub struct VectorField {
    /// Field to make vectors from.
    pub input: In<Gray>,
    /// How vectors are made from the field.
    #[default(VectorKind::Gradient)]
    pub kind: VectorKind,
    /// Detail that is removed before slopes are taken: standard deviation of a Gaussian; at most half the canvas'
    /// longer side. Has no effect with `Angle`.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    pub radius: f64,
    /// Additional rotation of the vectors, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub turn: f64,
    /// True to set the length of vectors to 1 before `amount`; where the field is flat, vectors stay 0.
    pub normalize: bool,
    /// Factor on the length of vectors: a displacement in mm for a slope of one unit in a mm, or for a length of 1.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(1.0)]
    pub amount: f64,
}

/// Slopes are limited to this, so that their square does not overflow.
const STEEPEST: f32 = 1e15;

impl VectorField {
    fn of_slopes(&self, soft: Field) -> Field {
        let quarter = if self.kind == VectorKind::Perpendicular { 90.0 } else { 0.0 };
        let (sin, cos) = crate::degrees::sin_cos(self.turn + quarter);
        let (sin, cos, amount, normalize) = (narrow(sin), narrow(cos), narrow(self.amount), self.normalize);
        Field::map(Type::Vec2, [soft], Halo::px(slopes::HALO), move |out: &mut Tile, [soft]: [&Tile; 1]| {
            let (rect, step) = (out.window, tile::step(&out.grid));
            let (x, y) = out.data_mut().split_at_mut(rect.len());
            slopes::slopes(&tile::view(soft, 0), rect, step, x, y);
            for (x, y) in x.iter_mut().zip(y) {
                let (a, b) = (clamp(*x, -STEEPEST, STEEPEST), clamp(*y, -STEEPEST, STEEPEST));
                let length = (a * a + b * b).sqrt();
                let scale = if !normalize {
                    amount
                } else if length > 1e-18 {
                    amount / length
                } else {
                    0.0
                };
                (*x, *y) = ((cos * a - sin * b) * scale, (sin * a + cos * b) * scale);
            }
            Ok(())
        })
    }

    fn of_angles(&self, angles: Field) -> Field {
        let (turn, amount) = (narrow(self.turn), narrow(self.amount));
        Field::map(Type::Vec2, [angles], Halo::NONE, move |out: &mut Tile, [angles]: [&Tile; 1]| {
            for (k, part) in [cos_degrees, sin_degrees].into_iter().enumerate() {
                let plane = out.plane_mut(k).iter_mut().zip(angles.plane(0));
                plane.for_each(|(out, angle)| *out = amount * part(*angle + turn));
            }
            Ok(())
        })
    }
}

impl Node for VectorField {
    const OUTPUTS: &'static [Output] = &[
        Output::new("vector", Type::Vec2, "The vectors; y points down."),
        Output::new(
            "angle",
            Type::Gray,
            "Where they point, -180..180, from +x towards +y; 0 where they have no length.",
        )
        .in_unit("°"),
        Output::new("length", Type::Gray, "How long they are."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let vector = if self.kind == VectorKind::Angle {
            self.of_angles(input)
        } else if input.as_constant().is_some() {
            Field::constant(Type::Vec2, &[0.0; 2])
        } else if self.radius > 0.0 {
            self.of_slopes(fields::blurred(&input, self.radius, cx.size_mm()))
        } else {
            self.of_slopes(input)
        };
        let vector = cx.shared_field("vectors", vector);
        let length = Field::map(Type::Gray, [vector.clone()], Halo::NONE, |out: &mut Tile, [vector]: [&Tile; 1]| {
            let parts = vector.plane(0).iter().zip(vector.plane(1));
            let square = |(x, y): (&f32, &f32)| f64::from(*x).powi(2) + f64::from(*y).powi(2);
            out.data_mut().iter_mut().zip(parts).for_each(|(out, parts)| *out = narrow(square(parts).sqrt()));
            Ok(())
        });
        Ok(Outputs::one(vector.clone()).with("angle", vector.to_angle()).with("length", length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray};
    use crate::testing::{canvas, lumps, port, raster};
    use shibo_value::Tiling;

    /// Rises by 3 in a mm to the right and by 4 down.
    fn plane() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width);
                *v = narrow(3.0 * at.x + 4.0 * at.y);
            }
            Ok(())
        })
    }

    fn vector(node: &VectorField, input: Field) -> [f32; 4] {
        let inputs = [input.into()];
        let part = |name: &str| raster(&field(node, &inputs, name), &canvas());
        let vector = part("vector");
        [vector.row(0, 9)[30], vector.row(1, 9)[30], part("angle").row(0, 9)[30], part("length").row(0, 9)[30]]
    }

    #[test]
    fn a_plane_has_one_gradient() {
        let node = VectorField { input: port(0), ..VectorField::default() };
        let close = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3 * (1.0 + b.abs()));
        let uphill = 53.130_1;
        assert!(close(vector(&node, plane()), [3.0, 4.0, uphill, 5.0]));
        let level = VectorField { kind: VectorKind::Perpendicular, ..node.clone() };
        assert!(close(vector(&level, plane()), [-4.0, 3.0, uphill + 90.0, 5.0]));
        let unit = VectorField { normalize: true, amount: 2.0, turn: 180.0, radius: 1.0, ..node.clone() };
        assert!(close(vector(&unit, plane()), [-1.2, -1.6, uphill - 180.0, 2.0]));
        let flat = VectorField { normalize: true, ..node.clone() };
        assert_eq!(vector(&flat, Field::constant(Type::Gray, &[7.0])), [0.0; 4]);
        let angle = VectorField { kind: VectorKind::Angle, amount: 3.0, turn: 60.0, ..node };
        assert!(close(vector(&angle, Field::constant(Type::Gray, &[30.0])), [0.0, 3.0, 90.0, 3.0]));
    }

    #[test]
    fn every_kind_conforms() {
        for kind in [VectorKind::Gradient, VectorKind::Perpendicular, VectorKind::Angle] {
            for (radius, normalize) in [(0.0, false), (0.7, true), (16.0, false)] {
                let node = VectorField { input: port(0), kind, radius, normalize, ..VectorField::default() };
                conforms(&node, &[gray().into()]);
                conforms(&node, &[lumps().into()]);
            }
        }
    }
}
