//! [`ToolReach`]: the height that a milling or engraving tool leaves.
//!
//! The tool goes as low as its tip allows at every place: the surface that it leaves is the closing of the height by the
//! tip (J. Serra, "Image analysis and mathematical morphology", 1982), see
//! [`kernel::envelope`](shibo_kernel::surface::envelope). Cost: O(pixels · square of the radius in pixels) at most; less
//! where heights differ by less than the tip is high.
use super::lowered::Envelope;
use crate::bounds::at_most_half;
use crate::values::pairs;
use shibo_kernel::surface::envelope::Profile;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Stop, Type};

/// Tip of a tool.
#[choice]
pub enum Tip {
    /// A ball of the radius
    #[default]
    Ball,
    /// A flat end of the radius
    Flat,
    /// A cone with the angle `angle`, up to the radius
    Vee,
}

/// Computes the height that a tool leaves when it mills or engraves a given height: grooves that are narrower than the
/// tool stay filled.
///
/// ```ron
/// "cells": Worley(size: 6),
/// "grooves": Remap(input: "cells.border", from: (0, 0.25), to: (-0.6, 0), clamp: true),
/// "milled": ToolReach(input: "grooves", radius: 0.5),
/// "example": Relief(height: "milled"),
/// ```
///
/// Elsewhere: CAM programs *Rest machining* and *Stock simulation*.
#[node]
pub struct ToolReach {
    /// Height in mm that is wanted.
    pub input: In<Gray>,
    /// Radius of the tool; at most half the canvas' longer side.
    #[schemars(range(min = 1e-3, max = 50), extend("unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// Form of the tip.
    #[default(Tip::Ball)]
    pub tip: Tip,
    /// Angle between the sides of a tip `Vee`.
    #[schemars(range(min = 1, max = 179), extend("unit" = "°"))]
    #[default(60.0)]
    pub angle: f64,
}

impl Node for ToolReach {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "The height that the tool leaves, at least the wanted one.").in_unit("mm"),
        Output::new("left", Type::Gray, "The material that the tool cannot reach, as a height.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let profile = match self.tip {
            Tip::Ball => Profile::Ball(self.radius),
            Tip::Flat => Profile::Flat,
            Tip::Vee => Profile::Tip(1.0 / libm::tan(0.5 * self.angle.to_radians())),
        };
        let envelope = Envelope { profile, reach: self.radius, way: None, above: true, named: ("radius", None) };
        // The lowest places of the tip, then the surface below the tip at all of them.
        let lowest = cx.shared_field("lowest", envelope.of(input.clone()));
        let height = cx.shared_field("height", Envelope { above: false, ..envelope }.of(lowest));
        let left = pairs([&height, &input], |after, before| (after - before).max(0.0));
        Ok(Outputs::one(height).with("left", left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{by_x, check_field, field, lumps, port, render};

    fn node(tip: Tip, radius: f64) -> ToolReach {
        ToolReach { input: port(0), radius, tip, ..ToolReach::default() }
    }

    /// A tool of radius 2 mm in a groove of 3 mm: it stops where its tip is 1.5 mm from the middle.
    #[test]
    fn tips_stop_at_the_sides_of_a_groove() {
        let groove = || by_x(|x| if (x - 16.25).abs() < 1.3 { -10.0 } else { 0.0 });
        let tips = [
            (Tip::Ball, 2.0 - (4.0f32 - 1.5 * 1.5).sqrt()),
            (Tip::Flat, 0.0),
            (Tip::Vee, 1.5 / 30f32.to_radians().tan()),
        ];
        for (tip, height) in tips {
            let got = render(&node(tip, 2.0), &[groove()]);
            // The sides of the groove are the samples at 14.75 and 17.75 mm.
            let deepest = got.row(0, 5)[32];
            assert!((deepest + height).abs() < 1e-4 && got.row(0, 5)[8] == 0.0, "{tip:?}: {deepest}");
        }
        let wide = by_x(|x| if (x - 16.25).abs() < 6.0 { -3.0 } else { 0.0 });
        assert_eq!(render(&node(Tip::Ball, 2.0), &[wide]).row(0, 9)[32], -3.0);
    }

    #[test]
    fn leaves_no_less_and_the_same_again() {
        for tip in [Tip::Ball, Tip::Flat, Tip::Vee] {
            let once = field(&node(tip, 1.7), &[lumps().into()]);
            check_field(&once);
            let (before, after) = (
                crate::testing::raster(&lumps(), &crate::testing::canvas()),
                render(&node(tip, 1.7), &[lumps().into()]),
            );
            assert!(after.data().iter().zip(before.data()).all(|(a, b)| *a >= *b - 1e-6), "{tip:?}");
            let again = render(&node(tip, 1.7), &[once.into()]);
            assert!(again.data().iter().zip(after.data()).all(|(a, b)| (a - b).abs() < 1e-5), "{tip:?}");
        }
    }
}
