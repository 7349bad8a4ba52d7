//! [`DistanceField`]: the distance to a shape.
//!
//! Exact Euclidean distance to the line where the input crosses the threshold, found between pixels by linear
//! interpolation (T. Saito, J. Toriwaki, 1994; see [`kernel::distance`](shibo_kernel::filter::distance)). Cost:
//! O(pixels · least of distance and radius, in pixels).
use crate::bounds::at_most_half;
use crate::distances;
use crate::values::{each, pairs};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Stop, Type};

/// The side of the shape's edge on which distances are measured.
#[choice]
pub enum Side {
    /// Outside, where the input is not above the threshold; 0 inside.
    #[default]
    Outside,
    /// Inside; 0 outside.
    Inside,
    /// Outside, and negative inside.
    Signed,
}

/// Computes the distance to a shape, the area where the input is above a threshold: in mm up to the radius, or as a
/// share of it.
///
/// ```ron
/// "noise":   Perlin(size: 9),
/// "example": DistanceField(input: "noise", threshold: 0.6, radius: 4, normalize: true),
/// ```
///
/// Elsewhere: Substance Designer *Distance*; Material Maker *Distance*; Houdini *Mono to SDF*, SDF.
#[node]
pub struct DistanceField {
    /// Input; the shape is the area where it is above the threshold.
    pub input: In<Gray>,
    /// The value at the shape's edge.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(0.5)]
    pub threshold: f64,
    /// The largest distance: larger ones get this value; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub radius: f64,
    /// Side of the edge on which to measure.
    #[default(Side::Outside)]
    pub side: Side,
    /// True to divide the result by the radius: 0..1 instead of mm.
    pub normalize: bool,
}

impl Node for DistanceField {
    const OUTPUTS: &'static [Output] =
        &[Output::new("distance", Type::Gray, "Distance to the shape's edge; 0..1 with `normalize`.").in_unit("mm")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn unit(&self, output: &Output) -> Option<&'static str> {
        output.unit.filter(|_| !self.normalize)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        #[expect(clippy::cast_possible_truncation, reason = "fields are f32")]
        let scale = if self.normalize { (1.0 / self.radius) as f32 } else { 1.0 };
        let scaled = |field: Field| each(&field, move |d| d * scale);
        let away = |inside: bool| distances::to_edge(&input, self.threshold, self.radius, inside);
        let (outside, inside) = (|| away(false), || away(true));
        Ok(Outputs::one(match self.side {
            Side::Outside if !self.normalize => outside(),
            Side::Outside => scaled(outside()),
            Side::Inside if !self.normalize => inside(),
            Side::Inside => scaled(inside()),
            Side::Signed => pairs([&outside(), &inside()], move |a, b| (a - b) * scale),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};

    fn node(side: Side) -> DistanceField {
        DistanceField { input: port(0), radius: 3.0, side, ..DistanceField::default() }
    }

    #[test]
    fn signed_distance_combines_both_sides() {
        let inputs = [lumps().into()];
        let [outside, inside, signed] = [Side::Outside, Side::Inside, Side::Signed].map(|s| render(&node(s), &inputs));
        let input = crate::testing::raster(&lumps(), &crate::testing::canvas());
        for k in 0..input.data().len() {
            let (a, b, s) = (outside.data()[k], inside.data()[k], signed.data()[k]);
            assert!((0.0..=3.0).contains(&a) && (0.0..=3.0).contains(&b) && s == a - b);
            assert_eq!(a == 0.0, input.data()[k] > 0.5 || (a == 0.0 && input.data()[k] == 0.5));
        }
        let share = render(&DistanceField { normalize: true, ..node(Side::Outside) }, &inputs);
        assert!(share.data().iter().zip(outside.data()).all(|(a, b)| (a * 3.0 - b).abs() < 1e-5));
    }

    #[test]
    fn holds_in_any_window() {
        for radius in [1e-9, 0.7, 16.0] {
            for side in [Side::Outside, Side::Inside, Side::Signed] {
                check_field(&field(&DistanceField { radius, ..node(side) }, &[lumps().into()]));
            }
        }
        let empty = Field::constant(Type::Gray, &[0.0]);
        let far = render(&node(Side::Signed), &[empty.into()]);
        assert!(far.data().iter().all(|d| (*d - 3.0).abs() < 1e-6));
    }
}
