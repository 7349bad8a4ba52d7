//! [`Median`]: removes specks, keeps edges.
//!
//! Exact, over the pixels whose centres lie within the radius; see [`kernel::median`](shibo_kernel::filter::median).
//! Cost: about 20 ns a pixel for a radius of 2 pixels, 200 for 4 and 270 for 8; above that in proportion to the radius.
use super::disk::of_disks;
use crate::bounds::at_most_half;
use shibo_kernel::filter::median;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::Stop;
use shibo_value::diagnostics::Problem;

/// Gives each place the median of a disk around it: removes specks and thin lines and keeps edges sharp.
///
/// Channels of a colour are filtered separately. A radius of less than a pixel changes nothing.
///
/// ```ron
/// "noise": Fractal(size: 8, octaves: 8, gain: 0.8),
/// "spots": Threshold(input: "noise", level: 0.52, softness: 0.03),
/// "example": Median(input: "spots", radius: 0.8),
/// ```
///
/// Elsewhere: Blender *Despeckle*, Houdini *Median*.
#[node]
pub struct Median {
    /// Field to clean.
    pub input: In<AnyField>,
    /// Radius of the disk; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.2)]
    pub radius: f64,
}

impl Node for Median {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The medians.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.radius == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        Ok(Outputs::one(of_disks(input, self.radius, median::median)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, check_field, field, lumps, port, render};
    use shibo_value::{Field, Tiling, Type};

    #[test]
    fn removes_specks_and_keeps_edges() {
        // A half plane, and a speck of one pixel in a hundred.
        let input = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let (x, y) = (window.x + k % width, window.y + k / width);
                let speck = x.rem_euclid(10) == 3 && y.rem_euclid(10) == 7;
                *v = if (x < 32) != speck { 1.0 } else { 0.0 };
            }
            Ok(())
        });
        let out = render(&Median { input: port(0), radius: 1.0 }, &[input.into()]);
        assert!((0..64).all(|y| (0..64).all(|x| out.row(0, y)[x] == if x < 32 { 1.0 } else { 0.0 })));
    }

    #[test]
    fn holds_in_any_window() {
        for radius in [0.0, 0.3, 1.0, 2.2, 6.0, 16.0] {
            let node = Median { input: port(0), radius };
            check_field(&field(&node, &[lumps().into()]));
            check_field(&field(&node, &[lumps().to_rgb().into()]));
        }
        assert_eq!(
            Median { radius: 17.0, ..Median::default() }.check_on(&canvas())[0].field.as_deref(),
            Some("radius")
        );
    }
}
