//! Objects as pages draw them: points and lines in mm, thinned out where there are too many to be seen.
use glam::DVec3;
use serde_json::{Value as Data, json};
use shibo_engine::value::{Canvas, Curve, Lattice, Points, Skeleton, Value};

/// The most points or lines that are sent.
const MOST: usize = 40_000;

/// A branch is drawn so long at the most, in mm.
const BRANCH: f64 = 3000.0;
/// Lines to a cubic of a trunk.
const PIECES: usize = 12;
/// A trunk is drawn so much taller than wide at the most: its bends would not be seen.
const SLENDER: f64 = 4.0;

/// What is to be drawn of an object; nothing of those that are no points or lines.
pub(super) fn object(value: &Value, canvas: &Canvas) -> Option<Data> {
    let mut data = match value {
        Value::Points(points) => points_of(points),
        Value::Lattice(lattice) => links_of(lattice),
        Value::SpringNet(net) => links_of(&net.lattice),
        Value::Segments(segments) => {
            let lines = segments.ends.iter().map(|[a, b]| [a.x, a.y, b.x, b.y]);
            json!({ "count": segments.ends.len(), "lines": thinned(lines, segments.ends.len()) })
        }
        Value::Curve(curve) => return Some(curve_of(curve)),
        Value::Skeleton(skeleton) => return Some(skeleton_of(skeleton)),
        _ => return None,
    };
    data["type"] = value.ty().to_string().into();
    data["size_mm"] = json!(canvas.size_mm.to_array());
    Some(data)
}

fn points_of(points: &Points) -> Data {
    let list = points.positions.iter().map(|p| [p.x, p.y]);
    json!({ "count": points.positions.len(), "points": thinned(list, points.positions.len()) })
}

/// Links with a number that says how they are: 1 intact, 0 broken.
fn links_of(lattice: &Lattice) -> Data {
    let alive = lattice.alive();
    let positions = &lattice.points.positions;
    let lines = (0..lattice.links.len()).map(|link| {
        let a = positions[lattice.links[link][0] as usize];
        let b = a + lattice.span(positions, link);
        [a.x, a.y, b.x, b.y, if alive[link] { 1.0 } else { 0.0 }]
    });
    json!({ "count": lattice.links.len(), "lines": thinned(lines, lattice.links.len()) })
}

/// The nodes of a trunk, and the way from each to the next.
fn curve_of(curve: &Curve) -> Data {
    let ways: Vec<[DVec3; 2]> = curve.points.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    views("Curve", &format!("{} nodes", curve.points.len()), &ways, &curve.points)
}

/// A trunk and its branches.
fn skeleton_of(skeleton: &Skeleton) -> Data {
    let mut ways = Vec::new();
    for cubic in &skeleton.trunk {
        let points: Vec<DVec3> = (0..=PIECES).map(|i| at(cubic, i as f64 / PIECES as f64)).collect();
        ways.extend(points.windows(2).map(|pair| [pair[0], pair[1]]));
    }
    let tall = extent(ways.iter().flatten()).map_or(1.0, |(low, high)| (high - low).max_element());
    let reach = BRANCH.min(0.3 * tall);
    ways.extend(skeleton.branches.iter().map(|b| [b.start, b.start + b.direction * b.length.min(reach)]));
    let ends: Vec<DVec3> = skeleton.trunk.iter().map(|cubic| cubic[0]).collect();
    let note = format!("{} pieces · {} branches", skeleton.trunk.len(), skeleton.branches.len());
    views("Skeleton", &note, &ways, &ends)
}

fn at([a, b, c, d]: &[DVec3; 4], t: f64) -> DVec3 {
    let s = 1.0 - t;
    *a * (s * s * s) + *b * (3.0 * s * s * t) + *c * (3.0 * s * t * t) + *d * (t * t * t)
}

fn extent<'p>(points: impl Iterator<Item = &'p DVec3>) -> Option<(DVec3, DVec3)> {
    points.filter(|p| p.is_finite()).map(|p| (*p, *p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Lines in space from the front, x to the right, and beside it from the side, y to the right; z points up. What is very
/// slender is drawn wider.
fn views(ty: &str, note: &str, ways: &[[DVec3; 2]], points: &[DVec3]) -> Data {
    let Some((low, high)) = extent(ways.iter().flatten().chain(points)) else {
        return json!({ "type": ty, "own": true, "count": 0, "note": note, "size_mm": [1, 1] });
    };
    let size = (high - low).max(DVec3::splat(1e-6));
    let tall = size.z.max(0.05 * size.x.max(size.y));
    let wider = (tall / SLENDER / size.x.max(size.y)).max(1.0);
    let (gap, breadth) = (0.08 * tall, DVec3::new(size.x, size.y, 0.0) * wider);
    let place = |p: DVec3, side: bool| {
        let across = if side { gap + breadth.x + gap + (p.y - low.y) * wider } else { gap + (p.x - low.x) * wider };
        [across, gap + high.z - p.z]
    };
    let both = [false, true];
    let lines = both.iter().flat_map(|side| ways.iter().map(move |way| (way, *side))).map(|([a, b], side)| {
        let ([x0, y0], [x1, y1]) = (place(*a, side), place(*b, side));
        [x0, y0, x1, y1]
    });
    let dots = both.iter().flat_map(|side| points.iter().map(move |p| place(*p, *side)));
    let drawn = if wider > 1.05 { format!(" · drawn {wider:.0} times as wide") } else { String::new() };
    json!({
        "type": ty,
        "own": true,
        "count": ways.len(),
        "note": format!("{note} · {:.0} mm tall · from the front, and from the side{drawn}", size.z),
        "lines": thinned(lines, 2 * ways.len()),
        "points": thinned(dots, 2 * points.len()),
        "size_mm": [breadth.x + breadth.y + 3.0 * gap, tall + 2.0 * gap],
    })
}

fn thinned<T: serde::Serialize>(items: impl Iterator<Item = T>, count: usize) -> Vec<T> {
    items.step_by(count.div_ceil(MOST).max(1)).collect()
}
