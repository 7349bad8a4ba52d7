//! [`RandomPoints`]: points anywhere on the canvas.
//!
//! Source: JP4905282B2 §3 (row A8). Cost: O(points).
use super::grid_points::{MAX_POINTS, afford};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::points::random;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Points, Stop, Tiling, Type};

/// Random points anywhere on the canvas: they form clumps and leave gaps.
///
/// `PoissonPoints` usually looks better. `RandomPoints` is the plain form of the source, and suits specks that should
/// form clumps.
///
/// ```ron
/// "points": RandomPoints(count: 220),
/// "links": ConnectNeighbors(points: "points", neighbors: Radius(3.6)),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.3, 0.7), depth: 0.4, taper: 0.5),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Blender *Distribute Points on Faces* (Random); Houdini *Scatter*.
#[node]
#[derive(PartialEq)]
pub struct RandomPoints {
    /// Number of points.
    #[schemars(range(min = 1, max = 4_000_000))]
    #[default(1000)]
    pub count: u32,
    /// Another seed gives other points.
    pub seed: u64,
}

impl Node for RandomPoints {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "The points, in no particular order.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if canvas.tile() == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let count = (self.count as usize).min(MAX_POINTS);
        afford(cx, count, "count")?;
        let pitch = (cx.size_mm().element_product() / count.max(1) as f64).sqrt();
        cx.check()?;
        Ok(Outputs::one(Points {
            positions: random(count, cx.size_mm().as_vec2(), Hash::new(cx.seed(self.seed))),
            size_mm: cx.size_mm(),
            periodic: Node::tiling(self, cx.canvas),
            pitch: narrow(pitch),
            ..Points::default()
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs};
    use shibo_value::Value;

    #[test]
    fn they_lie_on_the_canvas() {
        let made = outputs(&RandomPoints::default(), &[], &canvas()).unwrap();
        let Some(Value::Points(points)) = made.take("", true) else { panic!() };
        assert_eq!(points.len(), 1000);
        let inside = |p: &glam::Vec2| p.cmpge(glam::Vec2::ZERO).all() && p.cmplt(glam::Vec2::splat(32.0)).all();
        assert!(points.positions.iter().all(inside));
        assert!((points.pitch - (32.0f32 * 32.0 / 1000.0).sqrt()).abs() < 1e-5);
    }
}
