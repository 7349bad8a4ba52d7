//! Which pixels of a field: columns and rows of its tiles.
use crate::value::{Blocks, Piece, TILE, Window};

/// Columns and rows; all pixels that lie in one of both are meant.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Area {
    columns: Spans,
    rows: Spans,
}

/// Intervals in order, each further from the next than a tile is wide: in no tile there are two.
#[derive(Clone, Debug, Default, PartialEq)]
struct Spans(Vec<(i32, i32)>);

impl Spans {
    /// Adds those pixels of pieces that lie between `from` and `to`.
    fn add(&mut self, pieces: &[Piece], from: i32, to: i32) {
        for piece in pieces {
            let end = piece.start + piece.length.cast_signed();
            let (low, high) = ((from - piece.shift).max(piece.start), (to - piece.shift).min(end));
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

    /// What lies in a piece.
    fn within(&self, piece: Piece) -> Option<(i32, i32)> {
        let (start, end) = (piece.start, piece.start + piece.length.cast_signed());
        self.0.iter().find(|(from, to)| *from < end && start < *to).map(|(from, to)| (*from.max(&start), *to.min(&end)))
    }

    fn overlap(&self, other: &Self) -> Vec<(i32, i32)> {
        let both = self.0.iter().flat_map(|a| other.0.iter().map(move |b| (a.0.max(b.0), a.1.min(b.1))));
        both.filter(|(from, to)| from < to).collect()
    }

    /// What is left without `gone`, which may lie close together.
    fn without(&self, gone: &[(i32, i32)]) -> Vec<(i32, i32)> {
        let mut left = self.0.clone();
        for &(from, to) in gone {
            let parts = left.into_iter().flat_map(|(low, high)| [(low, high.min(from)), (low.max(to), high)]);
            left = parts.filter(|(low, high)| low < high).collect();
        }
        left
    }
}

impl Area {
    /// Adds `window`, which `blocks` cover.
    pub(super) fn add(&mut self, blocks: &Blocks, window: Window) {
        self.columns.add(&blocks.columns, window.x, window.right());
        self.rows.add(&blocks.rows, window.y, window.bottom());
    }

    /// What lies in a tile.
    pub(super) fn within(&self, (x, y): (Piece, Piece)) -> Option<Window> {
        Some(between(self.columns.within(x)?, self.rows.within(y)?))
    }

    pub(super) fn windows(&self) -> Vec<Window> {
        windows(&self.columns.0, &self.rows.0)
    }

    /// How many columns and rows there are.
    pub(super) fn size(&self) -> (u64, u64) {
        let length = |spans: &Spans| spans.0.iter().map(|(from, to)| u64::from(to.abs_diff(*from))).sum();
        (length(&self.columns), length(&self.rows))
    }

    /// How many of its pixels lie in a window.
    pub(super) fn pixels_in(&self, window: Window) -> u64 {
        self.windows().iter().filter_map(|own| own.overlap(&window)).map(|both| both.len() as u64).sum()
    }

    /// What lies in both.
    pub(super) fn overlap(&self, other: &Self) -> Vec<Window> {
        windows(&self.columns.overlap(&other.columns), &self.rows.overlap(&other.rows))
    }

    /// What is left without what lies in one of `others` too, as far as that is columns or rows from edge to edge.
    pub(super) fn without<'a>(&self, others: impl Iterator<Item = &'a Self>) -> Vec<Window> {
        let (mut columns, mut rows) = (Vec::new(), Vec::new());
        for other in others {
            if self.columns.without(&other.columns.0).is_empty() {
                rows.extend(self.rows.overlap(&other.rows));
            } else if self.rows.without(&other.rows.0).is_empty() {
                columns.extend(self.columns.overlap(&other.columns));
            }
        }
        windows(&self.columns.without(&columns), &self.rows.without(&rows))
    }
}

fn windows(columns: &[(i32, i32)], rows: &[(i32, i32)]) -> Vec<Window> {
    rows.iter().flat_map(|&row| columns.iter().map(move |&column| between(column, row))).collect()
}

fn between((left, right): (i32, i32), (top, bottom): (i32, i32)) -> Window {
    Window { x: left, y: top, width: right.abs_diff(left), height: bottom.abs_diff(top) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_stay_in_order_and_apart() {
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
    fn rows_and_columns_from_edge_to_edge_are_left_out() {
        let area =
            |columns: (i32, i32), rows: (i32, i32)| Area { columns: Spans(vec![columns]), rows: Spans(vec![rows]) };
        let own = area((0, 1000), (100, 500));
        let rows = |from, to| between((0, 1000), (from, to));
        let (above, below) = (area((0, 1000), (0, 120)), area((-50, 2000), (470, 900)));
        assert_eq!(own.without([&above, &below].into_iter()), [rows(120, 470)]);
        assert_eq!(own.without([&area((0, 1000), (200, 300))].into_iter()), [rows(100, 200), rows(300, 500)]);
        assert_eq!(own.without([&area((900, 2000), (0, 600))].into_iter()), [between((0, 900), (100, 500))]);
        // A corner.
        assert_eq!(own.without([&area((900, 2000), (0, 300))].into_iter()), own.windows());
        assert_eq!(own.without([&own].into_iter()), []);
        assert_eq!(own.overlap(&area((900, 2000), (0, 300))), [between((900, 1000), (100, 300))]);
    }
}
