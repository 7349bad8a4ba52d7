//! The domain of a field: its periods and ends, and the blocks in which it is computed.
use super::{Grid, Tiling, Window};

/// The width and height of a block in pixels: fields are computed and kept in tiles of one block each.
pub const TILE: u32 = 256;

/// The domain of a field: the canvas, repeated in the directions in which the field tiles, and extended beyond its
/// edges in the others.
///
/// The engine learns about edges, periods and blocks only from here. So a field on another domain would need no second
/// way of evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Domain {
    tiling: Tiling,
}

impl Domain {
    /// The canvas, on which a field repeats as `tiling` says.
    pub const fn canvas(tiling: Tiling) -> Self {
        Self { tiling }
    }

    /// Directions in which its fields repeat.
    pub const fn tiling(&self) -> Tiling {
        self.tiling
    }

    /// Limits `window` to one period of the domain, which holds all its pixels.
    pub fn one_repeat(&self, grid: &Grid, mut window: Window) -> Window {
        let Some(period) = grid.period else { return window };
        if self.tiling.x && window.width > period.x {
            (window.x, window.width) = (0, period.x);
        }
        if self.tiling.y && window.height > period.y {
            (window.y, window.height) = (0, period.y);
        }
        window
    }

    /// The columns and rows of blocks that cover `window` of `grid`.
    pub fn blocks(&self, grid: &Grid, window: Window) -> Blocks {
        let extent = |repeats: bool, pixels: Option<u32>| match pixels.map(u32::cast_signed) {
            Some(size) if repeats && grid.period.is_some() => Extent::Repeats(size),
            Some(size) => Extent::Ends(size),
            None => Extent::Endless,
        };
        let picture = grid.picture();
        let across = extent(self.tiling.x, picture.map(|p| p.x));
        let down = extent(self.tiling.y, picture.map(|p| p.y));
        Blocks { columns: pieces(window.x, window.right(), across), rows: pieces(window.y, window.bottom(), down) }
    }
}

/// The blocks of a domain in the given columns and rows.
#[derive(Clone, Debug, Default)]
pub struct Blocks {
    /// From left to right.
    pub columns: Vec<Piece>,
    /// From top to bottom.
    pub rows: Vec<Piece>,
}

impl Blocks {
    /// The blocks that cover `window` in a domain without periods and ends.
    pub fn endless(window: Window) -> Self {
        Self {
            columns: pieces(window.x, window.right(), Extent::Endless),
            rows: pieces(window.y, window.bottom(), Extent::Endless),
        }
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// The column and the row of the block with this index, row by row.
    pub fn get(&self, number: usize) -> Option<(Piece, Piece)> {
        let across = self.columns.len().max(1);
        Some((*self.columns.get(number % across)?, *self.rows.get(number / across)?))
    }

    /// The column and the row of each block, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (Piece, Piece)> {
        self.rows.iter().flat_map(|row| self.columns.iter().map(|column| (*column, *row)))
    }

    /// The window that they cover; `None` if there is no block.
    pub fn window(&self) -> Option<Window> {
        let (x, y) = (self.columns.first()?.from(), self.rows.first()?.from());
        let (right, bottom) = (self.columns.last()?.to(), self.rows.last()?.to());
        Some(Window { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) })
    }
}

/// A column or a row of blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Its index.
    pub index: i32,
    /// Its first pixel.
    pub start: i32,
    /// Its number of pixels.
    pub length: u32,
    /// The shift in pixels to the position where it is wanted.
    pub shift: i32,
}

impl Piece {
    /// The pixels of the block in a column and a row.
    pub const fn window(column: Self, row: Self) -> Window {
        Window { x: column.start, y: row.start, width: column.length, height: row.length }
    }

    /// Its first pixel after the shift.
    pub const fn from(&self) -> i32 {
        self.start + self.shift
    }

    /// One past its last pixel after the shift.
    pub const fn to(&self) -> i32 {
        self.from() + self.length.cast_signed()
    }
}

/// Extent of the domain in one direction, in pixels.
#[derive(Clone, Copy, Debug)]
enum Extent {
    /// It has no edge.
    Endless,
    /// It repeats with this period.
    Repeats(i32),
    /// It ends after this many pixels. Few pixels beyond the end are read, so blocks are small there.
    Ends(i32),
}

/// The block that contains the pixel at distance `away` beyond an edge: its index counted from the edge, its first
/// pixel and one past its last. The first eight blocks have 16 pixels, the next four twice as many each, the next four
/// twice as many again, and so on up to whole tiles.
///
/// A read that touches a block computes all of it, and each level of a pyramid reads a little further than the level
/// before. So blocks are small relative to their distance from the edge: with blocks half as large as their distance,
/// the reach of a pyramid would double with each level. For a picture of less than 16 pixels the first blocks are as
/// small as the picture.
fn beyond(away: i32, picture: i32) -> (i32, i32, i32) {
    let first = 1 << picture.clamp(1, 16).ilog2();
    let tile = TILE.cast_signed();
    // Blocks double in size at this distance, at twice this distance, at four times, and so on.
    let near = 4 * first;
    let larger = (away / near).max(1).ilog2().min((tile / first).ilog2());
    let (size, begin) = (first << larger, if away < near { 0 } else { near << larger });
    let before = if away < near { 0 } else { 4 + 4 * larger.cast_signed() };
    let number = (away - begin) / size;
    (before + number, begin + number * size, begin + (number + 1) * size)
}

/// The blocks that cover the pixels `from..to` in one direction, in order.
fn pieces(from: i32, to: i32, extent: Extent) -> Vec<Piece> {
    let tile = TILE.cast_signed();
    let mut list = Vec::new();
    let mut at = from;
    while at < to {
        let wrapped = if let Extent::Repeats(size) = extent { at.rem_euclid(size) } else { at };
        let (index, start, end) = match extent {
            Extent::Ends(size) if at < 0 => {
                let (number, near, far) = beyond(-1 - at, size);
                (-1 - number, -far, -near)
            }
            Extent::Ends(size) if at >= size => {
                let (number, near, far) = beyond(at - size, size);
                ((size - 1).div_euclid(tile) + 1 + number, size + near, size + far)
            }
            _ => {
                let index = wrapped.div_euclid(tile);
                let end = (index + 1) * tile;
                let last = if let Extent::Repeats(size) | Extent::Ends(size) = extent { size } else { end };
                (index, index * tile, end.min(last))
            }
        };
        let shift = at - wrapped;
        list.push(Piece { index, start, length: end.abs_diff(start), shift });
        at = end + shift;
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_everything_once() {
        let extents = [100, 256, 300, 700].into_iter().flat_map(|size| [Extent::Repeats(size), Extent::Ends(size)]);
        for extent in extents.chain([Extent::Endless]) {
            for (from, to) in [(0, 256), (-30, 310), (-700, 900), (5, 6), (-1, 701)] {
                let list = pieces(from, to, extent);
                let mut at = from;
                let mut seen = std::collections::BTreeMap::new();
                for piece in list {
                    assert!(piece.start + piece.shift <= at, "{extent:?} {from}..{to}");
                    at = piece.start + piece.length.cast_signed() + piece.shift;
                    let end = piece.start + piece.length.cast_signed();
                    match extent {
                        Extent::Repeats(size) => assert!(piece.start >= 0 && end <= size),
                        // No block may contain pixels on both sides of the edge.
                        Extent::Ends(size) => {
                            assert!(end <= 0 || (piece.start >= 0 && end <= size) || piece.start >= size)
                        }
                        Extent::Endless => {}
                    }
                    let same = *seen.entry(piece.index).or_insert((piece.start, end));
                    assert_eq!(same, (piece.start, end), "a number for each block: {extent:?} {from}..{to}");
                }
                assert!(at >= to);
            }
        }
    }

    #[test]
    fn computes_little_beyond_an_edge() {
        let list = pieces(-1, 513, Extent::Ends(512));
        let parts: Vec<_> = list.iter().map(|p| (p.index, p.start, p.length)).collect();
        assert_eq!(parts, [(-1, -16, 16), (0, 0, 256), (1, 256, 256), (2, 512, 16)]);
        let lengths: Vec<_> = pieces(0, 615, Extent::Ends(16)).iter().map(|p| p.length).collect();
        let beyond = [[16; 8].as_slice(), &[32; 4], &[64; 4], &[128]].concat();
        assert_eq!(lengths, [&[16], &*beyond].concat());
        let tiny: Vec<_> = pieces(-2, 3, Extent::Ends(1)).iter().map(|p| p.length).collect();
        assert_eq!(tiny, [1; 5]);
        // Nine block sizes, the last ones whole tiles.
        let far: Vec<_> = pieces(915, 1915, Extent::Ends(16)).iter().map(|p| (p.index, p.length)).collect();
        assert_eq!(far, [(20, 128), (21, 256), (22, 256), (23, 256), (24, 256)].map(|(n, l)| (n, l)));
    }

    #[test]
    fn limits_the_reach_of_a_pyramid() {
        // Each level reads twice as many pixels of the finer level, and one more.
        let reach = |wanted: i32| {
            pieces(16, 16 + wanted, Extent::Ends(16)).last().map_or(0, |p| p.start + p.length.cast_signed() - 16)
        };
        let read = (0..4).fold(24, |reached, _| reach(2 * reached + 1));
        // 399 pixels are needed. With blocks as large as their distance from the edge, 4096 would be read.
        assert!((399..1000).contains(&read), "{read}");
    }
}
