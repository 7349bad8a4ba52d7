//! The triangles of a height field in blocks, and the sides that blocks share.
use super::block::Mesh;
use super::sides::Side;
use super::store::{self, Place, Store};
use std::error::Error;
use std::{fmt, io};

/// The vertices between the ends of each side of a block: four counts, and the lists one after another.
#[derive(Clone, Debug, Default)]
pub(super) struct OnSides(Box<[u8]>);

impl OnSides {
    fn of(mesh: &Mesh) -> Self {
        let sides = mesh.on_sides();
        let counts = sides.iter().map(|side| u8::try_from(side.len()).unwrap_or(u8::MAX));
        Self(counts.chain(sides.iter().flatten().copied()).collect())
    }

    /// The vertices of the sides: top, bottom, left, right.
    pub(super) fn sides(&self) -> [&[u8]; 4] {
        let mut from = 4;
        [0, 1, 2, 3].map(|side| {
            let count = usize::from(self.0.get(side).copied().unwrap_or(0));
            from += count;
            self.0.get(from - count..from).unwrap_or_default()
        })
    }
}

/// The triangles of a height field.
#[derive(Debug)]
pub struct Tiles {
    /// The columns and the rows at which blocks meet, ends included.
    pub(super) columns: Vec<usize>,
    pub(super) rows: Vec<usize>,
    repeats: [bool; 2],
    /// The blocks, row by row.
    places: Vec<Place>,
    /// The largest distance of each block to the field, in mm.
    errors: Vec<f64>,
    sides: Vec<OnSides>,
    store: Box<dyn Store>,
    /// The most triangles.
    most: u64,
    count: u64,
    bytes: Vec<u8>,
}

/// A store, and the most triangles that it takes.
pub type Room = (Box<dyn Store>, u64);

/// The reason of an error: there are more triangles than a [`Room`] takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Full;

impl fmt::Display for Full {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("too many triangles")
    }
}

impl Error for Full {}

impl Tiles {
    /// Blocks without triangles.
    pub(super) fn new(columns: Vec<usize>, rows: Vec<usize>, repeats: [bool; 2], (store, most): Room) -> Self {
        let count = (columns.len() - 1) * (rows.len() - 1);
        let (places, errors) = (vec![Place::default(); count], vec![0.0; count]);
        let (sides, bytes) = (vec![OnSides::default(); count], Vec::new());
        Self { columns, rows, repeats, places, errors, sides, store, most, count: 0, bytes }
    }

    /// Sets the triangles of a block, and their largest distance to the field in mm. Fails with [`Full`] before the store has
    /// too many triangles.
    pub(super) fn set(&mut self, block: usize, mesh: &Mesh, error: f64) -> io::Result<()> {
        self.count -= u64::from(self.places[block].triangles);
        self.count += mesh.triangles.len() as u64;
        if self.count > self.most {
            return Err(io::Error::other(Full));
        }
        self.places[block] = store::add(&mut *self.store, mesh, &mut self.bytes)?;
        self.sides[block] = OnSides::of(mesh);
        self.errors[block] = error;
        Ok(())
    }

    /// The triangles of a row of blocks.
    pub(super) fn line(&self, line: usize) -> io::Result<Vec<Mesh>> {
        let across = self.count()[0];
        let mut bytes = Vec::new();
        let places = &self.places[line * across..(line + 1) * across];
        places.iter().map(|place| store::read(&*self.store, *place, &mut bytes)).collect()
    }

    /// The vertices on the sides of a block.
    pub(super) fn on_sides(&self, block: usize) -> [&[u8]; 4] {
        self.sides[block].sides()
    }

    /// Number of blocks in each direction.
    pub(super) fn count(&self) -> [usize; 2] {
        [self.columns.len() - 1, self.rows.len() - 1]
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        self.count
    }

    /// Number of edges on each rim: top, bottom, left, right.
    pub fn rims(&self) -> [u64; 4] {
        let [across, down] = self.count();
        let mut rims = [0; 4];
        for block in 0..across * down {
            let (x, y) = (block % across, block / across);
            let outer = [y == 0, y + 1 == down, x == 0, x + 1 == across];
            for (side, spots) in self.on_sides(block).iter().enumerate().filter(|(side, _)| outer[*side]) {
                rims[side] += spots.len() as u64 + 1;
            }
        }
        rims
    }

    /// The largest distance to the field in mm.
    pub fn error(&self) -> f64 {
        self.errors.iter().copied().fold(0.0, f64::max)
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
