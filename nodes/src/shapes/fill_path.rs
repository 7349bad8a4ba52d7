//! [`FillPath`]: the inside of closed curves.
//!
//! Distances are exact: see [`kernel::outline`](shibo_kernel::shape::outline) and
//! [`kernel::nearest`](shibo_kernel::path::nearest). Cost of a tile: its pixels, and the pieces near its edge; that of
//! the distance is O(pixels · pieces nearby).
use super::masked;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::path::hatch::closed;
use shibo_kernel::path::nearest::Nearest;
use shibo_kernel::shape::outline::{Edge, Outline, Winding};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Path, Stop, Tiling, Type};
use std::sync::Arc;

/// The places that count as inside of curves.
#[choice]
pub enum Inside {
    /// Places around which the curves wind, as in fonts: a hole runs the other way than the curve around it.
    #[default]
    Winding,
    /// Places that an odd number of curves encloses: a curve within another one is a hole.
    EvenOdd,
    /// Places on the right of the nearest curve, as `Outline` draws curves; open curves and those that go around the
    /// canvas count too.
    Right,
}

/// The inside of closed curves as a mask, and the distance from their edge in mm: inlays, patches and panels of any
/// form.
///
/// The mask is sharp at any resolution, and its edge covers exactly a pixel. The distance is negative inside, as that of
/// `Shape`; combine distances with `ShapeMath`. Open curves, and those that go around the canvas, enclose nothing unless
/// `inside` is `Right`. Where the canvas tiles, the shape repeats with it.
///
/// ```ron
/// "leaf": Path(d: "M 4 30 C 4 8 22 2 36 6 C 36 22 26 36 4 30 Z"),
/// "veins": OffsetPath(path: "leaf", distance: 2, copies: 3),
/// "rings": FillPath(path: "veins", inside: EvenOdd),
/// "whole": FillPath(path: "leaf"),
/// "base": Blend(base: "#d8cfb8", top: "#3f6b3a", mask: "whole"),
/// "color": Blend(base: "base", top: "#8fb35c", mask: "rings"),
/// "example": Relief(height: Remap(input: "whole.distance", from: (-2, 0), to: (1, 0), clamp: true), base_color: "color"),
/// ```
///
/// Elsewhere: Substance Designer *Path to Mask*, *SVG*; Blender *Fill Curve*; Houdini *Rasterize*.
#[node]
pub struct FillPath {
    /// The curves.
    pub path: In<Path>,
    /// The places that are inside.
    #[default(Inside::Winding)]
    pub inside: Inside,
    /// Width over which the edge of the mask fades, half of it inside; at least one pixel.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub softness: f64,
}

impl FillPath {
    /// The mask and the distance of curves that enclose areas.
    fn enclosed(&self, path: &Path, far: f32) -> [Field; 2] {
        let edges = closed(path).flat_map(|points| points.windows(2).map(|p| Edge { from: p[0], to: p[1] })).collect();
        let rule = if self.inside == Inside::EvenOdd { Winding::Odd } else { Winding::NonZero };
        let outline = Arc::new(Outline::new(edges, (path.size_mm, path.periodic)).with_rule(rule));
        let mask = masked::outlined(&outline, self.softness, path.periodic);
        let distance = Field::generate(Type::Gray, path.periodic, move |out, given| {
            outline.fill(&|| given.check().is_err(), &tile::frame(out), far, out.plane_mut(0));
            given.check()
        });
        [mask, distance]
    }

    /// The mask and the distance of the places on the right of curves.
    fn beside(&self, path: &Path, far: f32) -> [Field; 2] {
        let nearest = Arc::new(Nearest::new(path));
        let distance = Field::generate(Type::Gray, path.periodic, move |out, given| {
            let frame = tile::frame(out);
            let reach = nearest.farthest(&frame) * (1.0 + 1e-9);
            let plane = out.plane_mut(0);
            nearest.fill(&|| given.check().is_err(), &frame, reach, &mut |k, beside| {
                plane[k] = beside.map_or(far, |beside| narrow(-beside.distance.copysign(beside.across)));
            });
            given.check()
        });
        [masked::mask(&distance, self.softness), distance]
    }
}

impl Node for FillPath {
    const OUTPUTS: &'static [Output] = &[
        Output::new("mask", Type::Gray, "1 inside and 0 outside."),
        Output::new("distance", Type::Gray, "Distance from the edge; negative inside.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (path, far) = (cx.get(&self.path)?, narrow(cx.size_mm().max_element()));
        if self.inside != Inside::Right {
            let left = path.curves.len() - closed(&path).count();
            if left > 0 {
                let message = format!(
                    "{left} of {} curves enclose nothing: they are open, or go around the canvas",
                    path.curves.len()
                );
                let help = "close them by `Path(…, closed: true)`; or write `inside: Right` for an `Outline`";
                cx.evaluator.warn(Problem::new(Code::Advice, message).at("path").help(help));
            }
        }
        let [mask, distance] = match self.inside {
            Inside::Winding | Inside::EvenOdd => self.enclosed(&path, far),
            Inside::Right => self.beside(&path, far),
        };
        Ok(Outputs::one(mask).with("distance", distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{canvas, port};
    use glam::DVec2;
    use shibo_kernel::path::pen::Pen;
    use shibo_value::Value;

    fn path(curves: &[(&[(f64, f64)], bool)], tiling: Tiling) -> Value {
        let mut pen = Pen::default();
        for (points, close) in curves {
            let mut points = points.iter().map(|(x, y)| DVec2::new(*x, *y));
            pen.move_to(points.next().unwrap());
            points.for_each(|p| pen.line_to(p));
            if *close {
                pen.close();
            }
        }
        pen.finish(DVec2::splat(32.0), tiling).into()
    }

    fn node(inside: Inside) -> FillPath {
        FillPath { path: port(0), inside, ..FillPath::default() }
    }

    fn area(node: &FillPath, path: &Value) -> f64 {
        let mask = part(&field(node, std::slice::from_ref(path), "mask"), &canvas(), 0, 0, 64, 64);
        mask.data().iter().map(|v| f64::from(*v)).sum::<f64>() * 0.25
    }

    const SQUARE: &[(f64, f64)] = &[(2.0, 2.0), (12.0, 2.0), (12.0, 12.0), (2.0, 12.0)];
    const INNER: &[(f64, f64)] = &[(5.0, 5.0), (9.0, 5.0), (9.0, 9.0), (5.0, 9.0)];

    #[test]
    fn areas_are_those_of_the_curves() {
        let frame = path(&[(SQUARE, true), (INNER, true)], Tiling::BOTH);
        assert!((area(&node(Inside::Winding), &frame) - 100.0).abs() < 0.1);
        assert!((area(&node(Inside::EvenOdd), &frame) - 84.0).abs() < 0.1);
        let back: Vec<(f64, f64)> = INNER.iter().rev().copied().collect();
        let frame = path(&[(SQUARE, true), (&back, true)], Tiling::BOTH);
        for inside in [Inside::Winding, Inside::EvenOdd, Inside::Right] {
            let got = area(&node(inside), &frame);
            assert!((got - 84.0).abs() < 0.1, "{inside:?}: {got}");
        }
        // A turned square between the centres of pixels, across the border.
        let turned = path(&[(&[(0.1, -5.0), (5.1, 0.0), (0.1, 5.0), (-4.9, 0.0)], true)], Tiling::BOTH);
        assert!((area(&node(Inside::Winding), &turned) - 50.0).abs() < 0.2);
    }

    #[test]
    fn bands_around_the_canvas_lie_on_the_right() {
        let band = path(&[(&[(0.0, 4.0), (32.0, 4.0)], false), (&[(32.0, 12.0), (0.0, 12.0)], false)], Tiling::BOTH);
        assert!((area(&node(Inside::Right), &band) - 256.0).abs() < 0.1);
        assert_eq!(area(&node(Inside::Winding), &band), 0.0);
    }

    #[test]
    fn fills_conform() {
        let star = path(&[(&[(3.0, 1.0), (30.0, 9.0), (1.0, 20.0), (20.0, -4.0), (25.0, 37.0)], true)], Tiling::BOTH);
        for inside in [Inside::Winding, Inside::EvenOdd, Inside::Right] {
            conforms(&FillPath { softness: 1.5, ..node(inside) }, std::slice::from_ref(&star));
            conforms(&node(inside), std::slice::from_ref(&star));
        }
        conforms(&node(Inside::Winding), &[path(&[], Tiling::BOTH)]);
        conforms(&node(Inside::Right), &[path(&[], Tiling::BOTH)]);
    }
}
