//! Pictures of values that are not fields: solids are cut, and objects may have pixels of their own.
use glam::{DVec2, DVec3};
use petgraph::Direction;
use petgraph::graph::NodeIndex;
use shibo_engine::session::{Failure, Look};
use shibo_graph::{Graph, Input};
use shibo_value::{Channel, Cut, Field, Grid, Key, Pixels, Solid, Tile, Tiling, Type, Value, Window};
use std::collections::{HashSet, VecDeque};

/// Returns the pixels of an object, thinned out if a side exceeds `longest`.
pub fn tile(pixels: &Pixels, longest: u32) -> Tile {
    let [width, height] = pixels.size();
    let step = width.max(height).div_ceil((longest as usize).max(1)).max(1);
    let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let window = Window { x: 0, y: 0, width: count(columns), height: count(rows) };
    let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: None, shown: None };
    let mut tile = Tile::new(grid, window, pixels.planes().len());
    for (plane, from) in tile.planes_mut().into_iter().zip(pixels.planes()) {
        for (row, line) in plane.chunks_exact_mut(columns).zip(from.chunks(width * step)) {
            row.iter_mut().zip(line[..width].iter().step_by(step)).for_each(|(out, value)| *out = *value);
        }
    }
    tile
}

/// Returns the field that shows a solid, or a channel of a material of solids: a cut that the graph makes of this solid or of one derived from it, or else an
/// upright plane through the pith.
pub(super) fn cut(
    look: &Look<'_>,
    graph: &Graph,
    at: (NodeIndex, usize),
    (solid, channel): (&Solid, Option<Channel>),
) -> Result<Field, Failure> {
    let shown = cutter(graph, at.0).map(|by| look.through(at, by)).transpose()?.flatten();
    let field = match (shown, channel) {
        (Some(Value::Field(field)), _) => Some(field),
        (Some(Value::Material(material)), Some(channel)) => material.get(channel).cloned(),
        _ => None,
    };
    if let Some(field) = field {
        return Ok(field);
    }
    Ok(solid.cut(&upright(graph.canvas.size_mm)))
}

/// Finds the nearest downstream node that cuts a solid or a material of solids, and its slot for it.
fn cutter(graph: &Graph, from: NodeIndex) -> Option<(NodeIndex, usize)> {
    let reads_solid = |input: &Input| match input {
        Input::Wire { node, output } => graph.nodes[*node].outputs.get(*output).is_some_and(|ty| ty.is_in_space()),
        Input::Constant(_) => false,
    };
    let mut queue = VecDeque::from([from]);
    let mut seen = HashSet::from([from]);
    while let Some(index) = queue.pop_front() {
        let node = &graph.nodes[index];
        if index != from
            && node.outputs.first().is_some_and(|ty| ty.is_field() || *ty == Type::Material)
            && let Some(slot) = node.inputs.iter().position(reads_solid)
        {
            return Some((index, slot));
        }
        // Sorted in the order of the file, not of the wires.
        let mut after: Vec<NodeIndex> = graph.nodes.neighbors_directed(index, Direction::Outgoing).collect();
        after.sort();
        queue.extend(after.into_iter().filter(|next| seen.insert(*next)));
    }
    None
}

/// The plane y = 0: x to the right with the pith in the middle, z down.
fn upright(size: DVec2) -> Cut {
    let origin = DVec3::new(-0.5 * size.x, 0.0, 0.0);
    let place = Field::generate(Type::Rgb, Tiling::NONE, move |out: &mut Tile, _| {
        let (grid, window, width) = (out.grid, out.window, out.width());
        for (axis, plane) in out.planes_mut().into_iter().enumerate() {
            for (i, value) in plane.iter_mut().enumerate() {
                let (column, row) = (i % width.max(1), i / width.max(1));
                let to = |start: i32, n: usize| start.saturating_add(i32::try_from(n).unwrap_or(i32::MAX));
                let center = grid.center(to(window.x, column), to(window.y, row));
                let point = origin + DVec3::new(center.x, 0.0, center.y);
                *value = single(point[axis]);
            }
        }
        Ok(())
    });
    let bits: Vec<u8> = size.to_array().iter().flat_map(|n| n.to_bits().to_le_bytes()).collect();
    Cut::new(Key::of("upright plane", &[&bits]), place, |grid: &Grid| grid.step.max_element()).with_level_rows(true)
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
const fn single(v: f64) -> f32 {
    v as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thins_out_large_pixel_pictures() {
        let planes: Vec<f32> = (0..30 * 20).map(|i| i as f32).collect();
        let pixels = Pixels::new(Type::Gray, [30, 20], planes).unwrap();
        let whole = tile(&pixels, 64);
        assert_eq!((whole.window.width, whole.window.height), (30, 20));
        assert_eq!(whole.row(0, 19)[29], 599.0);
        let small = tile(&pixels, 10);
        assert_eq!((small.window.width, small.window.height), (10, 7));
        assert_eq!(small.row(0, 1)[2], 96.0);
    }
}
