//! [`Dots`]: a dot on each point.
//!
//! Beyond the source: pores, quills, studs, and fields for springs to follow. Dots have a size in millimetres; dots
//! smaller than a pixel are drawn as large as one, and fade. Cost: O(points + pixels under dots), by tiles.
use super::drawing;
use glam::Vec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::strokes::{self, Stroke, StrokeSet, StrokeStyle};
use shibo_node::{Context, Fact, Node, Output, Outputs, Range, choice, node};
use shibo_node::{Gray, In};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Points, Stop, Tiling, Type};

/// The cross-section of a dot.
#[choice]
pub enum DotProfile {
    /// A disc with a sharp edge.
    Flat,
    /// A cone.
    Linear,
    /// A dome, level at the top and at the edge.
    #[default]
    Smooth,
    /// A bell whose standard deviation is a quarter of the diameter.
    Gaussian,
}

/// How dots that overlap are combined.
#[choice]
pub enum DotOverlap {
    /// The maximum.
    #[default]
    Max,
    /// The sum, which may exceed the largest value of a dot.
    Add,
}

/// Draws a dot on each point: pores, quills, studs.
///
/// ```ron
/// "points": PoissonPoints(pitch: 4),
/// "dots": Dots(points: "points", diameter: (1.5, 3.5), value: (0.4, 1.0)),
/// "example": Relief(height: "dots"),
/// ```
///
/// Elsewhere: Material Maker *Dots*; Houdini *Copy to Points*.
#[node]
pub struct Dots {
    /// The points.
    pub points: In<Points>,
    /// Dots vanish where the mask is below ½; from ½ to 1 they grow from faint to full.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Gray>>,
    /// Smallest and largest diameter; each dot draws one at random.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Range::new(0.5, 0.5))]
    pub diameter: Range,
    /// Value in the middle of the faintest and of the brightest dot; each dot draws one at random.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6))]
    #[default(Range::new(1.0, 1.0))]
    pub value: Range,
    /// The cross-section.
    #[default(DotProfile::Smooth)]
    pub profile: DotProfile,
    /// How dots that overlap are combined.
    #[default(DotOverlap::Max)]
    pub overlap: DotOverlap,
    /// Another seed gives the same dots other sizes and values.
    pub seed: u64,
}

impl Node for Dots {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The dots; 0 between them.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let points = cx.get(&self.points)?;
        let hash = Hash::new(cx.seed(self.seed));
        let strength = self.strengths(cx, &points)?;
        let dot = |(n, at): (u64, &Vec2)| {
            let strength = usize::try_from(n).ok().and_then(|n| strength.get(n)).copied().unwrap_or(1.0);
            Stroke {
                ends: [*at; 2],
                half_width: narrow(0.5 * self.diameter.at(hash.unit(2 * n))),
                depth: narrow(self.value.at(hash.unit(2 * n + 1))) * strength,
            }
        };
        let dots: Vec<Stroke> = (0..).zip(&points.positions).map(dot).collect();
        let period = (points.periodic == Tiling::BOTH).then(|| points.size_mm.as_vec2());
        drawing::bounded(
            dots.iter().copied(),
            &self.style(),
            (points.size_mm.as_vec2(), period.is_some()),
            ["diameter"; 2],
        )?;
        let set = StrokeSet::new(&dots, self.style(), period);
        Ok(Outputs::one(drawing::field(set, points.periodic)))
    }
}

impl Dots {
    fn style(&self) -> StrokeStyle {
        StrokeStyle {
            profile: match self.profile {
                DotProfile::Flat => strokes::Profile::Flat,
                DotProfile::Linear => strokes::Profile::Linear,
                DotProfile::Smooth => strokes::Profile::Smooth,
                DotProfile::Gaussian => strokes::Profile::Gaussian { sigma: 0.25, cutoff: 0.8 },
            },
            round_caps: true,
            combine: match self.overlap {
                DotOverlap::Max => strokes::Combine::Max,
                DotOverlap::Add => strokes::Combine::Add,
            },
            ..StrokeStyle::default()
        }
    }

    /// Strength that the mask leaves each dot, 0..1; empty without a mask.
    fn strengths(&self, cx: &Context<'_>, points: &Points) -> Result<Vec<f32>, Stop> {
        let Some(mask) = cx.get_opt(&self.mask)? else { return Ok(Vec::new()) };
        let read = super::reading::read(cx, (points.pitch, points.periodic), (&mask, "mask"), None)?;
        let raster = read.raster();
        let strength = |p: &Vec2| (2.0 * raster.sample(*p) - 1.0).clamp(0.0, 1.0);
        let strengths: Vec<f32> = points.positions.iter().map(strength).collect();
        if strengths.iter().all(|s| *s == 0.0) && !strengths.is_empty() {
            let problem = Problem::new(Code::Advice, "mask is below a half at every point: no dot is left").at("mask");
            cx.evaluator.warn(problem);
        }
        Ok(strengths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::leather::PoissonPoints;
    use crate::testing::{canvas, outputs, port, render};
    use shibo_value::{Field, Value};

    fn points() -> Value {
        outputs(&PoissonPoints { pitch: 5.0, ..PoissonPoints::default() }, &[], &canvas())
            .unwrap()
            .take("", true)
            .cloned()
            .unwrap()
    }

    #[test]
    fn dots_cover_the_expected_area() {
        let Value::Points(all) = points() else { panic!() };
        let node =
            Dots { points: port(0), diameter: Range::new(2.0, 2.0), profile: DotProfile::Flat, ..Dots::default() };
        let tile = render(&node, &[points()]);
        let mean = f64::from(tile.data().iter().sum::<f32>()) / tile.data().len() as f64;
        let area = all.len() as f64 * std::f64::consts::PI / 1024.0;
        assert!((mean - area).abs() < 0.03 * area, "{mean} {area}");
        for profile in [DotProfile::Linear, DotProfile::Smooth, DotProfile::Gaussian] {
            conforms(&Dots { profile, ..node.clone() }, &[points()]);
        }
    }

    #[test]
    fn the_mask_leaves_dots_out() {
        let node = Dots { points: port(0), mask: Some(port(1)), ..Dots::default() };
        let none = render(&node, &[points(), Value::Field(Field::constant(Type::Gray, &[0.3]))]);
        assert!(none.data().iter().all(|v| *v == 0.0));
    }
}
