//! [`RaisedEdge`]: a bead along the edge of a mask.
//!
//! Applies a profile to the exact distance from the edge, see [`kernel::distance`](shibo_kernel::filter::distance). The
//! mean of the profile over a pixel is taken, because sides are steep at their foot. Cost: that of two distances,
//! O(pixels · width in pixels).
use crate::bounds::at_most_half;
use crate::distances;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::surface::profile::{self, Profile};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Raises a bead along the edge of a shape: weld seams, rolled rims, the burr of a cut, a piped border. Below 0 it is a
/// groove.
///
/// ```ron
/// "noise": Fractal(size: 18, octaves: 2),
/// "height": RaisedEdge(mask: "noise", threshold: 0.5, width: 1.6, height: 0.8),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Substance Designer *Bevel*; Blender *Bevel*.
#[node]
pub struct RaisedEdge {
    /// Mask; the shape is the area where it is above the threshold.
    pub mask: In<Gray>,
    /// The value at the shape's edge.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(0.5)]
    pub threshold: f64,
    /// Width of the bead, from foot to foot; at most half the canvas' longer side. A bead narrower than two pixels
    /// loses some of its volume.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub width: f64,
    /// Height of the bead; below 0 it is a groove.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(0.2)]
    pub height: f64,
    /// Distance of the middle of the bead inside the edge; below 0 outside. Together with half the width at most half
    /// the canvas' longer side.
    #[schemars(range(min = -5e5, max = 5e5), extend("unit" = "mm"))]
    pub offset: f64,
    /// The shape of the sides of the bead; `Round` gives a half circle.
    #[default(Profile::Round)]
    pub profile: Profile,
}

/// Distances are measured this far beyond the foot of the bead, as a share of its width.
const BEYOND: f64 = 0.25;

impl RaisedEdge {
    /// Largest distance of the bead from the edge, mm.
    fn reach(&self) -> f64 {
        0.5 * self.width + self.offset.abs()
    }
}

impl Node for RaisedEdge {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[Output::new("height", Type::Gray, "The height of the bead.").in_unit("mm")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let problems = at_most_half("width", self.width, canvas);
        if problems.is_empty() { at_most_half("offset", self.reach(), canvas) } else { problems }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mask = cx.get(&self.mask)?;
        // Measure a little beyond the foot, because a pixel there still shows part of the bead. The size of pixels is
        // not known here.
        let reach = self.reach() + BEYOND * self.width;
        let away = |inside: bool| distances::to_edge(&mask, self.threshold, reach, inside);
        let steep = 2.0 / self.width.max(1e-12);
        let line = [narrow(steep), narrow(-self.offset * steep)];
        let (height, profile) = (narrow(self.height), self.profile);
        let fill = move |out: &mut Tile, [inside, outside]: [&Tile; 2]| {
            let across: Vec<f32> = inside.data().iter().zip(outside.data()).map(|(a, b)| a - b).collect();
            let pixel = narrow(out.grid.step.element_product().sqrt());
            profile::ridge(profile, &across, line, (pixel, narrow(reach * (1.0 - 1e-6))), height, out.data_mut());
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Gray, [away(true), away(false)], Halo::NONE, fill)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, check_field, field, lumps, port, render, unlike_average};
    use shibo_value::Tiling;

    #[test]
    fn a_bead_of_half_a_circle() {
        let half = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = grid.center(window.x + k % width, 0).as_vec2().x - 15.5;
            }
            Ok(())
        });
        for offset in [0.0, 3.0, -5.0] {
            let node = RaisedEdge { mask: port(0), width: 8.0, height: 4.0, offset, ..RaisedEdge::default() };
            let out = render(&node, &[half.clone().into()]);
            for (x, v) in out.row(0, 20).iter().enumerate() {
                let off = (x as f32 + 0.5) * 0.5 - 16.0 - narrow(offset);
                // The mean over a pixel of half a mm.
                let part = |k: usize| off + (k as f32 / 100.0 - 0.495) * 0.5;
                let want = (0..100).map(|k| (16.0 - part(k) * part(k)).max(0.0).sqrt()).sum::<f32>() / 100.0;
                assert!((v - want).abs() < 0.03, "{offset} {off}: {v} {want}");
            }
        }
    }

    #[test]
    fn a_small_picture_is_the_average_of_a_large_one() {
        // A bead three pixels wide.
        for profile in [Profile::Round, Profile::Linear, Profile::Smooth, Profile::Cove] {
            let node = RaisedEdge { mask: port(0), width: 1.5, profile, ..RaisedEdge::default() };
            let unlike = unlike_average(&field(&node, &[lumps().into()]));
            assert!(unlike < 0.2, "{profile:?}: {unlike}");
        }
    }

    #[test]
    fn holds_in_any_window() {
        for (width, offset, profile) in
            [(1e-9, 0.0, Profile::Cove), (3.0, -2.0, Profile::Smooth), (16.0, 8.0, Profile::Linear)]
        {
            let node = RaisedEdge { mask: port(0), width, offset, profile, height: -1.0, ..RaisedEdge::default() };
            assert!(node.check_on(&canvas()).is_empty());
            check_field(&field(&node, &[lumps().into()]));
        }
        let far = RaisedEdge { offset: 16.0, ..RaisedEdge::default() };
        assert_eq!(far.check_on(&canvas())[0].field.as_deref(), Some("offset"));
    }
}
