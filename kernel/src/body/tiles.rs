//! The triangles of a height field in blocks, and the sides that blocks share.
use super::patch::Spot;
use super::sides::Side;

/// The triangles of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    /// The samples that are vertices.
    pub(super) spots: Vec<Spot>,
    /// Numbers of vertices, in the order in which x turns to y: clockwise in the picture.
    pub(super) triangles: Vec<[u16; 3]>,
    /// The largest distance to the field in mm.
    pub(super) error: f64,
    /// Number of intervals between samples in each direction.
    pub(super) size: [u8; 2],
}

impl Mesh {
    /// The vertices between the ends of each side, rising: top, bottom, left, right.
    pub(super) fn on_sides(&self) -> [Vec<u8>; 4] {
        let mut sides = [const { Vec::new() }; 4];
        let [width, height] = self.size;
        for [column, row] in &self.spots {
            let inner = (0..width).contains(column) && *column > 0;
            if inner && *row == 0 {
                sides[0].push(*column);
            } else if inner && *row == height {
                sides[1].push(*column);
            } else if *row > 0 && *row < height && *column == 0 {
                sides[2].push(*row);
            } else if *row > 0 && *row < height && *column == width {
                sides[3].push(*row);
            }
        }
        sides.iter_mut().for_each(|side| side.sort_unstable());
        sides
    }
}

/// The triangles of a height field.
#[derive(Clone, Debug)]
pub struct Tiles {
    /// The columns and the rows at which blocks meet, ends included.
    pub(super) columns: Vec<usize>,
    pub(super) rows: Vec<usize>,
    repeats: [bool; 2],
    /// The blocks, row by row.
    pub(super) meshes: Vec<Mesh>,
}

impl Tiles {
    /// Blocks without triangles.
    pub(super) fn new(columns: Vec<usize>, rows: Vec<usize>, repeats: [bool; 2]) -> Self {
        let count = (columns.len() - 1) * (rows.len() - 1);
        Self { columns, rows, repeats, meshes: vec![Mesh::default(); count] }
    }

    /// Number of blocks in each direction.
    pub(super) fn count(&self) -> [usize; 2] {
        [self.columns.len() - 1, self.rows.len() - 1]
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        self.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum()
    }

    /// Number of edges on each rim: top, bottom, left, right.
    pub fn rims(&self) -> [u64; 4] {
        let [across, down] = self.count();
        let mut rims = [0; 4];
        for (block, mesh) in self.meshes.iter().enumerate() {
            let (x, y) = (block % across, block / across);
            let outer = [y == 0, y + 1 == down, x == 0, x + 1 == across];
            for (side, spots) in mesh.on_sides().iter().enumerate().filter(|(side, _)| outer[*side]) {
                rims[side] += spots.len() as u64 + 1;
            }
        }
        rims
    }

    /// The largest distance to the field in mm.
    pub fn error(&self) -> f64 {
        self.meshes.iter().map(|mesh| mesh.error).fold(0.0, f64::max)
    }

    /// The first and the last column of a block.
    pub(super) fn columns(&self, block: usize) -> [usize; 2] {
        let at = block % self.count()[0];
        [self.columns[at], self.columns[at + 1]]
    }

    /// The first and the last row of a block.
    pub(super) fn rows(&self, block: usize) -> [usize; 2] {
        let at = block / self.count()[0];
        [self.rows[at], self.rows[at + 1]]
    }

    /// Number of sides. Opposite rims have sides of their own only if the field does not repeat.
    pub(super) fn side_count(&self) -> usize {
        let [across, down] = self.count();
        across * (down + 1) + (across + 1) * down
    }

    /// The sides of a block: top, bottom, left, right.
    pub(super) fn sides_of(&self, block: usize) -> [usize; 4] {
        let [across, down] = self.count();
        let (x, y) = (block % across, block / across);
        let row = |y: usize| if self.repeats[1] { y % down } else { y };
        let column = |x: usize| if self.repeats[0] { x % across } else { x };
        let upright = across * (down + 1);
        [
            row(y) * across + x,
            row(y + 1) * across + x,
            upright + y * (across + 1) + column(x),
            upright + y * (across + 1) + column(x + 1),
        ]
    }

    /// The first and the last sample of a side, and the line of samples that it lies on.
    pub(super) fn side(&self, side: usize) -> ((usize, usize), Side) {
        let [across, down] = self.count();
        let level = across * (down + 1);
        if side < level {
            let (x, y) = (side % across, side / across);
            return ((self.columns[x], self.columns[x + 1]), Side::Row(self.rows[y]));
        }
        let (x, y) = ((side - level) % (across + 1), (side - level) / (across + 1));
        ((self.rows[y], self.rows[y + 1]), Side::Column(self.columns[x]))
    }
}
