//! [`OrientationField`]: the direction of the features of a field.
//!
//! The structure tensor (J. Bigün, G. Granlund, 1987): products of slopes, averaged by a Gaussian; see
//! [`kernel::tensor`](shibo_kernel::filter::tensor). Cost: that of two blurs, O(pixels).
use crate::bounds::at_most_half;
use shibo_kernel::filter::{fields, slopes, tensor};
use shibo_kernel::ground::math::{cos_degrees, sin_degrees};
use shibo_kernel::ground::tile;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Buffer, Field, Halo, Stop, Tile, Type};

/// Finds the direction of stripes, fibres and edges in a field, and how distinct it is: in a photograph of wood, of
/// woven cloth, of hair.
///
/// The direction is that of a line: it has no sign, and jumps from 90° to -90°. Nodes that take directions handle this.
///
/// Slopes are differences between neighbouring pixels. Features of a few pixels look steeper in a larger picture, so
/// set `detail` to at least a pixel to get the same directions at all resolutions. Where the angle and the vector jump,
/// a small picture shows the direction at the middle of a pixel, because an average would be wrong.
///
/// ```ron
/// "bent": Curl(size: 24),
/// "strokes": Gabor(wavelength: 1.2, direction: "bent", aspect: 3),
/// "flow": OrientationField(input: "strokes", radius: 1.5),
/// "noise": WhiteNoise(size: 0.3),
/// "lines": AlongField(input: "noise", direction: "flow", length: 6),
/// "example": Levels(input: "lines", low: 0.3, high: 0.7),
/// ```
///
/// Elsewhere: ImageJ *OrientationJ*; OpenCV `cornerEigenValsAndVecs`.
#[node]
pub struct OrientationField {
    /// Field whose features are analysed.
    pub input: In<Gray>,
    /// Radius over which directions are averaged: standard deviation of a Gaussian; at most half the canvas' longer
    /// side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.0)]
    pub radius: f64,
    /// Detail that is removed first: standard deviation of a Gaussian; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.1)]
    pub detail: f64,
}

/// The averaged tensor of a field.
fn averaged(cx: &Context<'_>, input: Field, radius: f64) -> Field {
    let products = Field::map(Type::Rgb, [input], Halo::px(slopes::HALO), |out: &mut Tile, [input]: [&Tile; 1]| {
        let (rect, step) = (out.window, tile::step(&out.grid));
        let [mut gx, mut gy] = [(); 2].map(|()| Buffer::zeros(rect.len()));
        slopes::slopes(&tile::view(input, 0), rect, step, &mut gx, &mut gy);
        tensor::products(&gx, &gy, tile::planes3(out));
        Ok(())
    });
    fields::blurred(&cx.shared_field("products", products), radius, cx.size_mm())
}

/// A field computed from a tensor, pixel by pixel.
fn each(tensor: &Field, ty: Type, of: impl Fn([f32; 3]) -> [f32; 2] + Send + Sync + 'static) -> Field {
    Field::map(ty, [tensor.clone()], Halo::NONE, move |out: &mut Tile, [tensor]: [&Tile; 1]| {
        for (part, plane) in out.planes_mut().into_iter().enumerate() {
            for (i, out) in plane.iter_mut().enumerate() {
                *out = of([0, 1, 2].map(|k| tensor.plane(k)[i]))[part];
            }
        }
        Ok(())
    })
}

impl Node for OrientationField {
    const OUTPUTS: &'static [Output] = &[
        Output::new("angle", Type::Gray, "Where features run, -90..90, from +x towards +y.").in_unit("°"),
        Output::new("coherence", Type::Gray, "How clearly: 0 where there is no direction, 1 where all run alike."),
        Output::new("vector", Type::Vec2, "The same direction as a vector of length 1."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        [at_most_half("radius", self.radius, canvas), at_most_half("detail", self.detail, canvas)].concat()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let soft = if self.detail > 0.0 { fields::blurred(&input, self.detail, cx.size_mm()) } else { input };
        let tensor = cx.shared_field("tensor", averaged(cx, soft, self.radius));
        let vector = |t: [f32; 3]| {
            let angle = tensor::angle(t);
            [cos_degrees(angle), sin_degrees(angle)]
        };
        Ok(Outputs::one(each(&tensor, Type::Gray, |t| [tensor::angle(t), 0.0]))
            .with("coherence", each(&tensor, Type::Gray, |t| [tensor::coherence(t), 0.0]))
            .with("vector", each(&tensor, Type::Vec2, vector)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray};
    use crate::testing::{canvas, lumps, port, raster};
    use shibo_value::Tiling;

    /// Waves of 4 mm whose stripes run at an angle.
    fn stripes(degrees: f64) -> Field {
        let across = glam::DVec2::from_angle((degrees + 90.0).to_radians());
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width);
                #[expect(clippy::cast_possible_truncation, reason = "a test picture")]
                let value = (at.dot(across) * std::f64::consts::TAU / 4.0).sin() as f32;
                *v = value;
            }
            Ok(())
        })
    }

    #[test]
    fn stripes_have_their_direction() {
        let node = OrientationField { input: port(0), radius: 2.0, ..OrientationField::default() };
        for degrees in [-70.0f32, -30.0, 0.0, 25.0, 80.0] {
            let inputs = [stripes(f64::from(degrees)).into()];
            let part = |name: &str| raster(&field(&node, &inputs, name), &canvas()).row(0, 33)[21];
            assert!((part("angle") - degrees).abs() < 0.6, "{degrees}: {}", part("angle"));
            assert!(part("coherence") > 0.98);
            assert!((part("vector") - degrees.to_radians().cos()).abs() < 0.01);
        }
        // Two equally strong sets of stripes at a right angle have no direction.
        let both = Field::map(
            Type::Gray,
            [stripes(20.0), stripes(110.0)],
            Halo::NONE,
            |out: &mut Tile, [a, b]: [&Tile; 2]| {
                out.data_mut().iter_mut().zip(a.data().iter().zip(b.data())).for_each(|(out, (a, b))| *out = a + b);
                Ok(())
            },
        );
        let wide = OrientationField { radius: 6.0, ..node };
        let coherence = raster(&field(&wide, &[both.into()], "coherence"), &canvas()).row(0, 32)[32];
        assert!(coherence < 0.1, "{coherence}");
    }

    #[test]
    fn orientation_conforms() {
        for (radius, detail) in [(1.0, 0.1), (0.01, 0.0), (16.0, 16.0)] {
            let node = OrientationField { input: port(0), radius, detail };
            conforms(&node, &[gray().into()]);
            conforms(&node, &[lumps().into()]);
            conforms(&node, &[Field::constant(Type::Gray, &[1.0]).into()]);
        }
    }
}
