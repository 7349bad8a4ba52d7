//! Pictures of what is no field: solids by a cut, patterns, exemplars and coordinates by their own pixels.
use glam::{DVec2, DVec3};
use petgraph::Direction;
use petgraph::graph::NodeIndex;
use shibo_engine::graph::{Graph, Input};
use shibo_engine::session::{Failure, Look};
use shibo_engine::value::{
    ColorPattern, CoordMap, Cut, Exemplar, Field, Grid, Key, Solid, Tile, Tiling, Type, Value, Window,
};
use std::collections::{HashSet, VecDeque};

/// The narrowest strip that shows a pattern, in pixels.
const STRIP: usize = 960;

/// A picture with pixels of its own.
pub(crate) struct Flat {
    /// What it shows.
    pub(super) ty: Type,
    size: [usize; 2],
    /// One plane after another.
    planes: Vec<f32>,
}

impl Flat {
    fn new(ty: Type, size: [usize; 2], planes: Vec<f32>) -> Option<Self> {
        let pixels = size[0] * size[1];
        (pixels > 0 && planes.len() >= pixels && planes.len().is_multiple_of(pixels)).then_some(Self {
            ty,
            size,
            planes,
        })
    }

    /// The picture, thinned out if it is wider or higher than `longest`.
    pub(super) fn tile(&self, longest: u32) -> Tile {
        let [width, height] = self.size;
        let step = width.max(height).div_ceil((longest as usize).max(1)).max(1);
        let (columns, rows) = (width.div_ceil(step), height.div_ceil(step));
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let window = Window { x: 0, y: 0, width: count(columns), height: count(rows) };
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: None };
        let mut tile = Tile::new(grid, window, self.planes.len() / (width * height));
        for (plane, from) in tile.planes_mut().into_iter().zip(self.planes.chunks_exact(width * height)) {
            for (row, line) in plane.chunks_exact_mut(columns).zip(from.chunks(width * step)) {
                row.iter_mut().zip(line[..width].iter().step_by(step)).for_each(|(out, value)| *out = *value);
            }
        }
        tile
    }
}

/// What is to be seen of an object that has pixels.
pub(super) fn flat(value: &Value) -> Option<Flat> {
    match value {
        Value::ColorPattern(pattern) => strip(pattern),
        Value::Exemplar(exemplar) => sample(exemplar),
        Value::CoordMap(map) => coordinates(map),
        _ => None,
    }
}

/// The years side by side, from early to late wood.
fn strip(pattern: &ColorPattern) -> Option<Flat> {
    let entries = pattern.table.len();
    let wide = STRIP.div_ceil(entries.max(1)).max(1);
    let size = [entries * wide, (entries * wide / 6).max(1)];
    let plane = |c: usize| {
        let line: Vec<f32> = pattern.table.iter().flat_map(|color| std::iter::repeat_n(color[c], wide)).collect();
        line.repeat(size[1])
    };
    Flat::new(Type::Rgb, size, (0..3).flat_map(plane).collect())
}

/// The exemplar itself.
fn sample(exemplar: &Exemplar) -> Option<Flat> {
    let size = exemplar.frame.size;
    let ty = if exemplar.is_color() { Type::Rgb } else { Type::Gray };
    Flat::new(ty, [size.x as usize, size.y as usize], exemplar.shown.to_vec())
}

/// Where in the exemplar each pixel comes from: (0, 0) is black, (1, 0) red, (0, 1) green, (1, 1) yellow. Pieces that lie
/// there as they do here run from colour to colour smoothly; where pieces meet, colours jump.
fn coordinates(map: &CoordMap) -> Option<Flat> {
    let finite = || map.coords.iter().filter(|c| c[0].is_finite() && c[1].is_finite());
    let frame = map.exemplar.map(|frame| frame.size.as_vec2().to_array());
    let most = |axis: usize| finite().map(|c| c[axis].abs()).fold(1.0, f32::max);
    let size = frame.unwrap_or_else(|| [most(0), most(1)]);
    let plane = |axis: usize| map.coords.iter().map(move |c| (c[axis] / size[axis].max(1.0)).rem_euclid(1.0));
    let blue = std::iter::repeat_n(0.0, map.coords.len());
    let planes = plane(0).chain(plane(1)).chain(blue).collect();
    Flat::new(Type::Normal, [map.size.x as usize, map.size.y as usize], planes)
}

/// The field that is shown of a solid: the cut that the graph itself makes, of this solid or of what is made of it; without
/// one, an upright plane through the pith.
pub(super) fn cut(look: &Look<'_>, graph: &Graph, at: (NodeIndex, usize), solid: &Solid) -> Result<Field, Failure> {
    if let Some(by) = cutter(graph, at.0)
        && let Some(Value::Field(field)) = look.through(at, by)?
    {
        return Ok(field);
    }
    Ok(solid.cut(&upright(graph.canvas.size_mm)))
}

/// The nearest of the nodes after this one that makes a field out of a solid, and its slot for that.
fn cutter(graph: &Graph, from: NodeIndex) -> Option<(NodeIndex, usize)> {
    let is_solid = |ty: Type| matches!(ty, Type::Solid | Type::SolidColor | Type::SolidVector);
    let reads_solid = |input: &Input| match input {
        Input::Wire { node, output } => graph.nodes[*node].outputs.get(*output).is_some_and(|ty| is_solid(*ty)),
        Input::Constant(_) => false,
    };
    let mut queue = VecDeque::from([from]);
    let mut seen = HashSet::from([from]);
    while let Some(index) = queue.pop_front() {
        let node = &graph.nodes[index];
        if index != from
            && node.outputs.first().is_some_and(|ty| ty.is_field())
            && let Some(slot) = node.inputs.iter().position(reads_solid)
        {
            return Some((index, slot));
        }
        // In the order of the file, not of the wires.
        let mut after: Vec<NodeIndex> = graph.nodes.neighbors_directed(index, Direction::Outgoing).collect();
        after.sort();
        queue.extend(after.into_iter().filter(|next| seen.insert(*next)));
    }
    None
}

/// The plane y = 0: x to the right with the pith in the middle, and z down.
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
    use shibo_engine::value::ExemplarFrame;
    use std::sync::Arc;

    #[test]
    fn coordinates_run_from_black_to_red_green_and_yellow() {
        let size = glam::UVec2::new(8, 4);
        let frame = ExemplarFrame { size, origin: DVec2::ZERO, pitch: DVec2::ONE, periodic: Tiling::NONE };
        let coords = vec![[0.0, 0.0], [7.992, 0.0], [0.0, 3.996], [7.992, 3.996], [4.0, 1.0], [12.0, 5.0]];
        let map = CoordMap {
            size: glam::UVec2::new(6, 1),
            start: glam::IVec2::ZERO,
            pitch: DVec2::ONE,
            periodic: Tiling::NONE,
            spacing: 1,
            coords: Arc::new(coords),
            exemplar: Some(frame),
            coherence: 0.0,
            coverage: 0.0,
        };
        let tile = coordinates(&map).unwrap().tile(64);
        let wanted = [[0.0, 0.0], [0.999, 0.0], [0.0, 0.999], [0.999, 0.999], [0.5, 0.25], [0.5, 0.25]];
        for (p, [red, green]) in wanted.into_iter().enumerate() {
            for (c, wanted) in [red, green, 0.0].into_iter().enumerate() {
                assert!((tile.plane(c)[p] - wanted).abs() < 1e-5, "pixel {p}, channel {c}: {}", tile.plane(c)[p]);
            }
        }
    }

    #[test]
    fn flat_pictures_are_thinned_out() {
        let planes: Vec<f32> = (0..30 * 20).map(|i| i as f32).collect();
        let flat = Flat::new(Type::Gray, [30, 20], planes).unwrap();
        let whole = flat.tile(64);
        assert_eq!((whole.window.width, whole.window.height), (30, 20));
        assert_eq!(whole.row(0, 19)[29], 599.0);
        let small = flat.tile(10);
        assert_eq!((small.window.width, small.window.height), (10, 7));
        assert_eq!(small.row(0, 1)[2], 96.0);
        assert!(Flat::new(Type::Gray, [0, 0], Vec::new()).is_none());
    }
}
