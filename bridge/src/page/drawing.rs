//! Drawings of objects for pages: points and lines from the engine's sketches.
use glam::{DVec2, DVec3, Vec2};
use serde_json::{Value as Data, json};
use shibo_value::{Canvas, Shapes, Sketch, Type};

/// Maximum ratio of height to width of drawings of objects in space; more slender objects are widened so that the bends
/// of a trunk stay visible.
const SLENDER: f64 = 4.0;

/// Returns the drawing of an object of type `ty`; `None` for pixels, which are sent as a picture.
pub fn drawing(ty: Type, sketch: &Sketch, canvas: &Canvas) -> Option<Data> {
    match sketch {
        Sketch::Canvas(shapes) => Some(flat(ty, shapes, canvas.size_mm)),
        Sketch::Space(shapes) => Some(views(ty, shapes)),
        Sketch::Pixels(_) => None,
    }
}

/// Points and lines on the canvas. Lines that may break carry a number: 1 intact, 0 broken.
fn flat(ty: Type, shapes: &Shapes<Vec2>, size_mm: DVec2) -> Data {
    let (count, unit) = shapes.counts.first().copied().unwrap_or_default();
    let mut data = json!({ "type": ty.name(), "count": count, "unit": unit, "size_mm": size_mm.to_array() });
    if !shapes.points.is_empty() {
        data["points"] = shapes.points.iter().map(|p| json!([p.x, p.y])).collect();
    }
    let ends = shapes.lines.iter().map(|[a, b]| [a.x, a.y, b.x, b.y]);
    if !shapes.broken.is_empty() {
        let state = |broken: &bool| if *broken { 0.0 } else { 1.0 };
        let lines = ends.zip(&shapes.broken).map(|([x0, y0, x1, y1], broken)| [x0, y0, x1, y1, state(broken)]);
        data["lines"] = json!(lines.collect::<Vec<_>>());
    } else if !shapes.lines.is_empty() {
        data["lines"] = json!(ends.collect::<Vec<_>>());
    }
    data
}

/// Points and lines in space in two views, z up: the front with x to the right, and beside it the side with y to the
/// right. Very slender objects are widened.
fn views(ty: Type, shapes: &Shapes<DVec3>) -> Data {
    let counts: Vec<String> = shapes.counts.iter().map(|(count, unit)| format!("{count} {unit}")).collect();
    let note = counts.join(" · ");
    let Some((low, high)) = shapes.extent() else {
        return json!({ "type": ty.name(), "own": true, "count": 0, "note": note, "size_mm": [1, 1] });
    };
    let size = (high - low).max(DVec3::splat(1e-6));
    let tall = size.z.max(0.05 * size.x.max(size.y));
    let wider = (tall / SLENDER / size.x.max(size.y)).max(1.0);
    let (gap, breadth) = (0.08 * tall, DVec3::new(size.x, size.y, 0.0) * wider);
    let place = |p: DVec3, side: bool| {
        let across = if side { gap + breadth.x + gap + (p.y - low.y) * wider } else { gap + (p.x - low.x) * wider };
        [across, gap + high.z - p.z]
    };
    // The two views together have the maximum number of shapes of one drawing.
    let both = |count: usize| Shapes::<DVec3>::thinned(2 * count).map(move |n| (n % count, n >= count));
    let lines = both(shapes.lines.len()).map(|(n, side)| {
        let [[x0, y0], [x1, y1]] = shapes.lines[n].map(|p| place(p, side));
        [x0, y0, x1, y1]
    });
    let dots = both(shapes.points.len()).map(|(n, side)| place(shapes.points[n], side));
    let drawn = if wider > 1.05 { format!(" · drawn {wider:.0} times as wide") } else { String::new() };
    json!({
        "type": ty.name(),
        "own": true,
        "count": shapes.lines.len(),
        "note": format!("{note} · {:.0} mm tall · from the front, and from the side{drawn}", size.z),
        "lines": lines.collect::<Vec<_>>(),
        "points": dots.collect::<Vec<_>>(),
        "size_mm": [breadth.x + breadth.y + 3.0 * gap, tall + 2.0 * gap],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;
    use shibo_value::{Curve, Lattice, Points, Tiling, Value};
    use std::sync::Arc;

    const CANVAS: Canvas =
        Canvas { size_mm: DVec2::new(8.0, 4.0), resolution: UVec2::ONE, tile: Tiling::NONE, seed: 0 };

    fn drawn(value: impl Into<Value>) -> Data {
        let value = value.into();
        drawing(value.ty(), &value.sketch().unwrap(), &CANVAS).unwrap()
    }

    #[test]
    fn sends_canvas_objects_in_mm() {
        let points = Arc::new(Points { positions: vec![Vec2::ZERO, Vec2::new(0.5, 2.0)], ..Points::default() });
        let dots = json!({
            "type": "Points", "count": 2, "unit": "points", "size_mm": [8.0, 4.0], "points": [[0.0, 0.0], [0.5, 2.0]],
        });
        assert_eq!(drawn(points.clone()), dots);
        let links = Arc::new(vec![[0, 1], [1, 0]]);
        let lattice = Lattice { points, links, broken: vec![(1, 9)], ..Lattice::default() };
        let lines = json!([[0.0, 0.0, 0.5, 2.0, 1.0], [0.5, 2.0, 0.0, 0.0, 0.0]]);
        assert_eq!(drawn(lattice)["lines"], lines);
    }

    #[test]
    fn draws_space_objects_in_two_views() {
        let curve = Curve { points: vec![DVec3::ZERO, DVec3::new(1.0, 2.0, 100.0)] };
        let curve = drawn(curve);
        // The drawing is 12.5 times as wide as the object, which makes it a quarter as wide as tall.
        let lines = json!([[8.0, 108.0, 20.5, 8.0], [28.5, 108.0, 53.5, 8.0]]);
        assert_eq!((&curve["lines"], &curve["size_mm"]), (&lines, &json!([61.5, 116.0])));
        let note = "2 nodes · 100 mm tall · from the front, and from the side · drawn 12 times as wide";
        assert_eq!((&curve["note"], &curve["count"]), (&json!(note), &json!(1)));
        assert_eq!(drawn(Curve { points: Vec::new() })["note"], "0 nodes");
    }
}
