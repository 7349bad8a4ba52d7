//! [`PoissonPoints`]: random points with a minimum distance.
//!
//! One choice of "any algorithm giving an almost uniform distribution" (JP4905282B2 §3, rows A9, A68). Cost: O(points),
//! about two microseconds each.
use super::grid_points::{MAX_POINTS, afford, too_many};
use super::reading::SampledMap;
use glam::Vec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::poisson::{PoissonSpec, poisson_estimate, poisson_until};
use shibo_node::{CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Points, Stop, Tiling, Type};

/// Random points with a minimum distance: neither a grid nor clumps. The best start for leather.
///
/// ```ron
/// "points": PoissonPoints(pitch: 3),
/// "links": ConnectNeighbors(points: "points"),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.5, 0.9), depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Blender *Distribute Points on Faces* (Poisson Disk); Houdini *Scatter*.
#[node]
pub struct PoissonPoints {
    /// Field of distances: points are closer where it is dark. 1 gives the pitch, 0 a pitch `spread` times smaller.
    /// Read at four samples per pitch.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub density: Option<In<Gray>>,
    /// Field of the direction in which points are wider apart, instead of `angle`: degrees from +x towards +y, or
    /// vectors. Read at four samples per pitch.
    pub direction: Option<In<Direction>>,
    /// Factor on the effect of `aspect`, 0..1: where it is 0, points are equally far apart in all directions. Read at
    /// four samples per pitch.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub stretch: Option<In<Gray>>,
    /// Mean distance between neighbours. No two points are nearer than 0.8 of it.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.0)]
    pub pitch: f64,
    /// Distance between points along `angle`, as a multiple of that across.
    #[schemars(range(min = 1, max = 10))]
    #[default(1.0)]
    pub aspect: f64,
    /// Direction in which points are wider apart, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Ratio of the distance between points where `density` is 1 to that where it is 0.
    #[schemars(range(min = 1, max = 8))]
    #[default(2.0)]
    pub spread: f64,
    /// Another seed gives other points.
    pub seed: u64,
}

impl PoissonPoints {
    fn spec(&self, canvas: &CanvasFacts) -> PoissonSpec<'static> {
        PoissonSpec {
            size: canvas.size_mm().as_vec2(),
            pitch: narrow(self.pitch),
            aspect: narrow(self.aspect),
            angle: narrow(self.angle.to_radians()),
            periodic: canvas.tile() == Tiling::BOTH,
            factor: None,
            shape: None,
            most: 1.0,
        }
    }
}

impl PoissonPoints {
    /// The parameters for an upper bound on the number of points: with `stretch`, the aspect may be 1 anywhere.
    fn most(&self, canvas: &CanvasFacts) -> PoissonSpec<'static> {
        let spec = self.spec(canvas);
        PoissonSpec { aspect: if self.stretch.is_some() { 1.0 } else { spec.aspect }, ..spec }
    }
}

impl Node for PoissonPoints {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "The points, in no particular order.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        if self.pitch * self.aspect > canvas.size_mm().min_element() {
            let message = format!(
                "pitch is `{}`, times aspect `{}`; it must be smaller than the canvas, {} mm",
                self.pitch,
                self.aspect,
                canvas.size_mm().min_element()
            );
            return vec![Problem::new(Code::OutOfRange, message).at("pitch")];
        }
        let wanted = poisson_estimate(&self.most(canvas));
        if wanted > MAX_POINTS as f64 { vec![too_many(wanted, "pitch")] } else { Vec::new() }
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if canvas.tile() == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let spec = self.spec(cx.canvas);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a few million")]
        afford(cx, poisson_estimate(&self.most(cx.canvas)) as usize, "pitch")?;
        let until = || cx.check().is_err();
        let [density, direction, stretch] =
            [cx.get_opt(&self.density)?, cx.get_opt(&self.direction)?, cx.get_opt(&self.stretch)?]
                .map(|field| field.map(|field| SampledMap::read(cx, &field, self.pitch, true)));
        let (density, direction, stretch) = (density.transpose()?, direction.transpose()?, stretch.transpose()?);
        let spread = narrow(self.spread);
        let read = |map: &Option<SampledMap>, p: Vec2, without: f32| map.as_ref().map_or(without, |map| map.nearest(p));
        let factor = |p: Vec2| 1.0 + (spread - 1.0) * read(&density, p, 0.0).clamp(0.0, 1.0);
        let shape = |p: Vec2| {
            let angle = direction.as_ref().map_or(spec.angle, |map| map.nearest(p).to_radians());
            (1.0 + (spec.aspect - 1.0) * read(&stretch, p, 1.0).clamp(0.0, 1.0), angle)
        };
        let mut full = spec;
        if density.is_some() {
            full = PoissonSpec { factor: Some(&factor), most: spread, ..full };
        }
        if direction.is_some() || stretch.is_some() {
            full.shape = Some(&shape);
        }
        let positions = poisson_until(&full, hash, &until);
        cx.check()?;
        Ok(Outputs::one(Points {
            positions,
            size_mm: cx.size_mm(),
            periodic: Node::tiling(self, cx.canvas),
            pitch: narrow(self.pitch),
            ..Points::default()
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs, port};
    use shibo_value::{Field, Value};

    fn count(node: &PoissonPoints, inputs: &[Value]) -> usize {
        match outputs(node, inputs, &canvas()).unwrap().take("", true) {
            Some(Value::Points(points)) => points.len(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn has_the_stated_density() {
        let n = count(&PoissonPoints::default(), &[]) as f64;
        assert!((n / (0.97 * 32.0 * 32.0) - 1.0).abs() < 0.05, "{n}");
    }

    #[test]
    fn density_thins_out() {
        let node = PoissonPoints { density: Some(port(0)), ..PoissonPoints::default() };
        let dense = count(&node, &[Value::Field(Field::constant(Type::Gray, &[0.0]))]);
        let sparse = count(&node, &[Value::Field(Field::constant(Type::Gray, &[1.0]))]);
        assert!(sparse * 3 < dense, "{sparse} {dense}");
    }

    #[test]
    fn direction_and_stretch_fields_match_parameters() {
        let number = |v: f32| Value::Field(Field::constant(Type::Gray, &[v]));
        let plain = PoissonPoints { aspect: 3.0, angle: 40.0, ..PoissonPoints::default() };
        let steered = PoissonPoints { angle: 0.0, direction: Some(port(0)), stretch: Some(port(1)), ..plain.clone() };
        let of = |node: &PoissonPoints, inputs: &[Value]| match outputs(node, inputs, &canvas()).unwrap().take("", true)
        {
            Some(Value::Points(points)) => points.len() as f64,
            other => panic!("{other:?}"),
        };
        let (a, b) = (of(&plain, &[]), of(&steered, &[number(40.0), number(1.0)]));
        assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
        let round = of(&steered, &[number(40.0), number(0.0)]);
        assert!((round / of(&PoissonPoints::default(), &[]) - 1.0).abs() < 0.05, "{round}");
    }
}
