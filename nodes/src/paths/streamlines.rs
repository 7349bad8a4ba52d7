//! [`Streamlines`]: lines that follow a field of directions.
//!
//! See [`kernel::stream`](shibo_kernel::path::stream). Directions are read at four samples per spacing, before the
//! first line is drawn. Cost: O(length of all lines / spacing).
use crate::map::Map;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::path::pen::Pen;
use shibo_kernel::path::stream::Streams;
use shibo_node::{CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling, Type};

/// Maximum number of squares of the spacing on the canvas.
const MOST_CELLS: f64 = 1e6;

/// Number of seeds tried for each square of the spacing.
const TRIES: f64 = 3.0;

/// Evenly spaced lines along a field of directions: engraving, combed hair, furrows, seams that follow a form.
///
/// A line has no direction of its own: angles that differ by 180° mean the same.
///
/// ```ron
/// "noise": Perlin(size: 26),
/// "angles": Remap(input: "noise", to: (-120, 120)),
/// "lines": Streamlines(direction: "angles", spacing: 1.6, length: 60),
/// "lying": Path(outline: "lines", reach: 1),
/// "height": "= smoothstep(0.7, 0, lying.distance) * 0.8",
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Houdini *Volume Trail*; Blender *Curl Noise* curves; ParaView *Evenly Spaced Streamlines*.
#[node]
pub struct Streamlines {
    /// The direction of lines, in degrees from +x towards +y, or as vectors.
    #[default(In::constant(0.0))]
    pub direction: In<Direction>,
    /// Mask of the area of lines: they go where it is ½ or more. Everywhere if not given.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Gray>>,
    /// Distance between lines.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub spacing: f64,
    /// Length of the longest lines.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(40.0)]
    pub length: f64,
    /// Length of the shortest line that is drawn, as a multiple of the spacing.
    #[schemars(range(min = 0, max = 1000))]
    #[default(2.0)]
    pub shortest: f64,
    /// Another seed gives other lines.
    pub seed: u64,
}

impl Streamlines {
    fn streams(&self, size: DVec2, tiling: Tiling) -> Streams {
        Streams {
            spacing: self.spacing,
            length: self.length,
            shortest: (self.shortest * self.spacing).min(self.length),
            size,
            tiling,
        }
    }
}

impl Node for Streamlines {
    const OUTPUTS: &'static [Output] = &[Output::new("path", Type::Path, "The lines.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let size = canvas.size_mm();
        let mut problems = Vec::new();
        let cells = self.streams(size, canvas.tile()).cells();
        if cells > MOST_CELLS {
            let least = (size.element_product() / MOST_CELLS).sqrt();
            let message = format!("spacing is `{}` mm; on this canvas it must be at least {least:.4} mm", self.spacing);
            problems.push(Problem::new(Code::TooLarge, message).at("spacing"));
        }
        let most = 64.0 * size.max_element();
        if self.length > most {
            let message = format!("length is `{}` mm; it must be at most {most} mm", self.length);
            problems.push(Problem::new(Code::OutOfRange, message).at("length").help("that is 64 times the canvas"));
        }
        if self.spacing > 0.25 * size.min_element() {
            let most = 0.25 * size.min_element();
            let message = format!("spacing is `{}` mm; it must be at most {most} mm", self.spacing);
            problems
                .push(Problem::new(Code::OutOfRange, message).at("spacing").help("that is a quarter of the canvas"));
        }
        problems
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (size, hash) = (cx.size_mm(), Hash::new(cx.seed(self.seed)));
        let angles = Map::read(cx, (&Some(self.direction.clone()), "direction"), self.spacing)?;
        let mask = Map::read(cx, (&self.mask, "mask"), self.spacing)?;
        let heading = |p: DVec2, before: Option<DVec2>| {
            if mask.as_ref().is_some_and(|mask| mask.at(p) < 0.5) {
                return DVec2::ZERO;
            }
            let mut sum = DVec2::ZERO;
            let mut like = before;
            for (angle, weight) in angles.iter().flat_map(|map| map.around(p)) {
                let way = DVec2::new(math::cos_degrees(angle).into(), math::sin_degrees(angle).into());
                let way = if like.is_some_and(|like| like.dot(way) < 0.0) { -way } else { way };
                like.get_or_insert(way);
                sum += way * weight;
            }
            sum.normalize_or_zero()
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be below 4 million")]
        let count = (TRIES * size.element_product() / (self.spacing * self.spacing)).max(1.0) as u64;
        let seeds = (0..count).map(|n| DVec2::new(hash.with(n).unit(0), hash.with(n).unit(1)) * size);
        let mut pen = Pen::default();
        self.streams(size, cx.tiling()).draw(seeds, &heading, &|| cx.check(), &mut pen)?;
        Ok(Outputs::one(pen.finish(size, cx.tiling())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OnCanvas as _, canvas, outputs, port};
    use shibo_value::{Field, Path, Value};
    use std::sync::Arc;

    fn drawn(node: &Streamlines, direction: Field) -> Arc<Path> {
        match outputs(node, &[direction.into()], &canvas()).unwrap().take("path", true) {
            Some(Value::Path(path)) => path.clone(),
            other => panic!("no path: {other:?}"),
        }
    }

    #[test]
    fn lines_follow_the_field() {
        let node = Streamlines { direction: port(0), length: 20.0, ..Streamlines::default() };
        for angle in [0.0, 30.0, 180.0, -90.0] {
            let path = drawn(&node, Field::constant(Type::Gray, &[angle]));
            let way = DVec2::from_angle(f64::from(angle).to_radians());
            assert!(path.curves.len() > 10);
            assert!(path.pieces().all(|[a, b]| ((b - a).normalize().dot(way)).abs() > 0.9999), "{angle}");
            let total: f64 = path.curves.iter().map(|curve| curve.length()).sum();
            // Length of all lines if they were exactly `spacing` apart.
            let full = 32.0 * 32.0 / node.spacing;
            assert!(total > 0.5 * full && total < 1.6 * full, "{total} {full}");
        }
        let path = drawn(&node, Field::constant(Type::Gray, &[45.0]));
        let again = drawn(&node, Field::constant(Type::Gray, &[45.0]));
        assert_eq!(path, again);
        assert_ne!(path, drawn(&Streamlines { seed: 1, ..node }, Field::constant(Type::Gray, &[45.0])));
    }

    #[test]
    fn refuses_invalid_streamlines() {
        let refused = |node: Streamlines| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(Streamlines::default()), None);
        assert_eq!(refused(Streamlines { spacing: 0.01, ..Streamlines::default() }).as_deref(), Some("spacing"));
        assert_eq!(refused(Streamlines { spacing: 9.0, ..Streamlines::default() }).as_deref(), Some("spacing"));
        assert_eq!(refused(Streamlines { length: 1e5, ..Streamlines::default() }).as_deref(), Some("length"));
    }
}
