//! Objects as pages draw them: points and lines in mm, thinned out where there are too many to be seen.
use serde_json::{Value as Data, json};
use shibo_engine::value::{Canvas, Lattice, Points, Value};

/// The most points or lines that are sent.
const MOST: usize = 40_000;

/// What is to be drawn of an object; nothing of those without places on the canvas.
pub(super) fn object(value: &Value, canvas: &Canvas) -> Option<Data> {
    let mut data = match value {
        Value::Points(points) => points_of(points),
        Value::Lattice(lattice) => links_of(lattice),
        Value::SpringNet(net) => links_of(&net.lattice),
        Value::Segments(segments) => {
            let lines = segments.ends.iter().map(|[a, b]| [a.x, a.y, b.x, b.y]);
            json!({ "count": segments.ends.len(), "lines": thinned(lines, segments.ends.len()) })
        }
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

fn thinned<T: serde::Serialize>(items: impl Iterator<Item = T>, count: usize) -> Vec<T> {
    items.step_by(count.div_ceil(MOST).max(1)).collect()
}
