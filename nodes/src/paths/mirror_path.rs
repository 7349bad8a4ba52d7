//! [`MirrorPath`]: a path and its mirror image. See [`kernel::mirror`](shibo_kernel::path::mirror). Cost: O(pieces).
use crate::degrees::sin_cos;
use glam::DVec2;
use shibo_kernel::path::mirror::{Axis, mirror};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::{self as value, Stop, Tiling, Type};

/// The mirror image of a path, joined to the path itself: draw half of an ornament, and get all of it.
///
/// A curve that ends on the axis is joined to its image; with both ends on the axis it becomes a closed curve. Images run
/// backwards, so that the inside of a closed curve stays on the same side. Where the canvas tiles, the result repeats
/// with it.
///
/// ```ron
/// "half": Path(d: "M 20 6 C 26 0 38 6 34 16 C 32 22 24 26 20 35"),
/// "heart": MirrorPath(path: "half"),
/// "rim": Path(outline: "heart", reach: 5),
/// "inner": OffsetPath(path: "heart", distance: 2.2),
/// "sewn": Stitch(path: "inner", pitch: 2.6, width: 0.8),
/// "patch": "= 1.5 * smoothstep(-0.6, 0.6, rim.across) - sewn.pull",
/// "height": Blend(base: "patch", top: "= patch + sewn", mask: "sewn.mask"),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Blender *Mirror*; Houdini *Mirror*; Inkscape *Mirror Symmetry*.
#[node]
pub struct MirrorPath {
    /// The path.
    pub path: In<value::Path>,
    /// A point on the axis; the middle of the canvas if not given.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
    /// Direction of the axis, from +x towards +y: 90 swaps left and right, 0 swaps above and below.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    #[default(90.0)]
    pub angle: f64,
    /// True to keep the path beside its image, false for the image alone.
    #[default(true)]
    pub both: bool,
}

impl Node for MirrorPath {
    const OUTPUTS: &'static [Output] = &[Output::new("path", Type::Path, "The path and its image.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let path = cx.get(&self.path)?;
        let (sin, cos) = sin_cos(self.angle);
        let through = self.center.map_or(cx.size_mm() * 0.5, |c| DVec2::new(c.x, c.y));
        Ok(Outputs::one(mirror(&path, &Axis { through, way: DVec2::new(cos, sin) }, self.both)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::Path;
    use crate::testing::{canvas, outputs, port};
    use shibo_value::Value;

    #[test]
    fn half_a_square_becomes_a_square() {
        let half = Path { d: "M 16 4 H 20 V 12 H 16".into(), ..Path::default() };
        let half = outputs(&half, &[], &canvas()).unwrap().take("path", true).cloned().unwrap();
        let made =
            |node: MirrorPath| match outputs(&node, std::slice::from_ref(&half), &canvas()).unwrap().take("path", true)
            {
                Some(Value::Path(path)) => path.clone(),
                other => panic!("no path: {other:?}"),
            };
        let whole = made(MirrorPath { path: port(0), ..MirrorPath::default() });
        let [curve] = &whole.curves[..] else { panic!("{} curves", whole.curves.len()) };
        assert!(curve.closed && curve.length() == 32.0);
        let below = made(MirrorPath { path: port(0), angle: 0.0, both: false, ..MirrorPath::default() });
        assert_eq!(below.curves[0].points[0], DVec2::new(16.0, 20.0));
    }
}
