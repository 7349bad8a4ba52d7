//! A set of pixels of a field: the product of some columns and some rows.
use crate::value::{Blocks, Domain, Grid, Piece, TILE, Window};

/// The pixels that lie both in one of the column spans and in one of the row spans.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Region {
    columns: Spans,
    rows: Spans,
}

/// Sorted intervals, at least the side of a tile apart, so that no tile meets two of them.
#[derive(Clone, Debug, Default, PartialEq)]
struct Spans(Vec<(i32, i32)>);

impl Spans {
    /// Adds the pixels of `pieces` between `from` and `to`.
    fn add(&mut self, pieces: &[Piece], from: i32, to: i32) {
        for piece in pieces {
            let (start, end) = ends(*piece);
            let (low, high) = ((from - piece.shift).max(start), (to - piece.shift).min(end));
            if low < high {
                self.insert(low, high);
            }
        }
    }

    fn insert(&mut self, mut low: i32, mut high: i32) {
        let apart = TILE.cast_signed();
        self.0.retain(|&(from, to)| {
            let joins = from - apart < high && low < to + apart;
            if joins {
                (low, high) = (low.min(from), high.max(to));
            }
            !joins
        });
        let place = self.0.partition_point(|span| span.0 < low);
        self.0.insert(place, (low, high));
    }

    fn intersect(&self, other: &Self) -> Self {
        let both = self.0.iter().flat_map(|a| other.0.iter().map(move |b| (a.0.max(b.0), a.1.min(b.1))));
        Self(both.filter(|(from, to)| from < to).collect())
    }
}

impl Region {
    /// Adds `window`; `blocks` must cover it.
    pub(super) fn add(&mut self, blocks: &Blocks, window: Window) {
        self.columns.add(&blocks.columns, window.x, window.right());
        self.rows.add(&blocks.rows, window.y, window.bottom());
    }

    /// The region enlarged to whole blocks.
    pub(super) fn rounded(&self, domain: Domain, grid: &Grid) -> Self {
        let mut whole = Self::default();
        for window in self.windows() {
            let blocks = domain.blocks(grid, window);
            blocks.window().into_iter().for_each(|window| whole.add(&blocks, window));
        }
        whole
    }

    /// The pixels of the region in a block. They always form one window.
    pub(super) fn within(&self, (x, y): (Piece, Piece)) -> Option<Window> {
        let cut = |spans: &Spans, piece: Piece| {
            let (start, end) = ends(piece);
            let span = spans.0.iter().find(|(from, to)| *from < end && start < *to)?;
            Some((span.0.max(start), span.1.min(end)))
        };
        Some(between(cut(&self.columns, x)?, cut(&self.rows, y)?))
    }

    /// Disjoint windows that cover the region exactly.
    pub(super) fn windows(&self) -> Vec<Window> {
        let rows = self.rows.0.iter();
        rows.flat_map(|&row| self.columns.0.iter().map(move |&column| between(column, row))).collect()
    }

    /// The pixels in both regions.
    pub(super) fn intersect(&self, other: &Self) -> Self {
        Self { columns: self.columns.intersect(&other.columns), rows: self.rows.intersect(&other.rows) }
    }

    /// Disjoint windows of the pixels that `other` lacks.
    pub(super) fn minus(&self, other: &Self) -> Vec<Window> {
        other.windows().iter().fold(self.windows(), |left, gone| minus(&left, gone))
    }

    /// Number of pixels.
    pub(super) fn pixels(&self) -> u64 {
        self.windows().iter().map(|window| window.len() as u64).sum()
    }

    /// Number of columns or of rows, whichever is larger.
    pub(super) fn side(&self) -> u64 {
        let length = |spans: &Spans| spans.0.iter().map(|(from, to)| u64::from(to.abs_diff(*from))).sum::<u64>();
        length(&self.columns).max(length(&self.rows))
    }
}

/// The pixels of `windows` outside `gone`, as windows.
pub(super) fn minus(windows: &[Window], gone: &Window) -> Vec<Window> {
    let left = windows.iter().flat_map(|window| {
        let Some(both) = window.overlap(gone) else { return [Some(*window), None, None, None] };
        let rows = |from: i32, to: i32| between((window.x, window.right()), (from, to));
        let columns = |from: i32, to: i32| between((from, to), (both.y, both.bottom()));
        [
            Some(rows(window.y, both.y)),
            Some(rows(both.bottom(), window.bottom())),
            Some(columns(window.x, both.x)),
            Some(columns(both.right(), window.right())),
        ]
    });
    left.flatten().filter(|window| !window.is_empty()).collect()
}

const fn ends(piece: Piece) -> (i32, i32) {
    (piece.start, piece.start + piece.length.cast_signed())
}

const fn between((left, right): (i32, i32), (top, bottom): (i32, i32)) -> Window {
    Window { x: left, y: top, width: right.abs_diff(left), height: bottom.abs_diff(top) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(columns: (i32, i32), rows: (i32, i32)) -> Region {
        Region { columns: Spans(vec![columns]), rows: Spans(vec![rows]) }
    }

    #[test]
    fn sorts_spans_and_merges_near_ones() {
        let mut spans = Spans::default();
        spans.insert(1000, 1100);
        spans.insert(0, 10);
        assert_eq!(spans.0, [(0, 10), (1000, 1100)]);
        spans.insert(200, 300);
        assert_eq!(spans.0, [(0, 300), (1000, 1100)]);
        spans.insert(400, 900);
        assert_eq!(spans.0, [(0, 1100)]);
    }

    #[test]
    fn subtracts_rows_columns_corners_and_holes() {
        let own = region((0, 1000), (100, 500));
        let rows = |from, to| between((0, 1000), (from, to));
        assert_eq!(own.minus(&region((0, 1000), (0, 120))), [rows(120, 500)]);
        assert_eq!(own.minus(&region((-50, 2000), (200, 300))), [rows(100, 200), rows(300, 500)]);
        assert_eq!(own.minus(&region((900, 2000), (0, 600))), [between((0, 900), (100, 500))]);
        assert_eq!(own.minus(&region((900, 2000), (0, 300))), [rows(300, 500), between((0, 900), (100, 300))]);
        assert_eq!(own.minus(&own), []);
        let hole = own.minus(&region((400, 500), (200, 300)));
        assert_eq!(hole.iter().map(Window::len).sum::<usize>(), 1000 * 400 - 100 * 100);
        assert_eq!(own.minus(&region((0, 1000), (500, 600))), own.windows());
        assert_eq!(own.intersect(&region((900, 2000), (0, 300))), region((900, 1000), (100, 300)));
    }
}
