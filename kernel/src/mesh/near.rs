//! Spatial index of points, by cubes.
use glam::DVec3;
use std::collections::HashMap;

/// Indices of points, by cubes in space.
#[derive(Clone, Debug)]
pub struct Near {
    side: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Near {
    /// An empty index with cubes of `side` mm.
    pub fn new(side: f64) -> Self {
        Self { side, cells: HashMap::new() }
    }

    /// Indexes a list of points, numbered in its order.
    pub fn of(side: f64, places: &[DVec3]) -> Self {
        let mut near = Self::new(side);
        for (number, place) in (0..).zip(places) {
            near.add(number, *place);
        }
        near
    }

    #[expect(clippy::cast_possible_truncation, reason = "places are at most 10⁷ mm away")]
    fn cell(&self, place: DVec3) -> [i64; 3] {
        (place / self.side).floor().to_array().map(|x| x as i64)
    }

    /// Adds a point.
    pub fn add(&mut self, number: u32, place: DVec3) {
        self.cells.entry(self.cell(place)).or_default().push(number);
    }

    /// The points in all cubes that a ball touches: cube by cube, in the order in which they were added.
    pub fn within(&self, place: DVec3, radius: f64) -> impl Iterator<Item = u32> + '_ {
        let (low, high) = (self.cell(place - radius), self.cell(place + radius));
        let range = move |axis: usize| low[axis]..=high[axis];
        let cells = range(2).flat_map(move |z| range(1).flat_map(move |y| range(0).map(move |x| [x, y, z])));
        cells.filter_map(|cell| self.cells.get(&cell)).flatten().copied()
    }
}
