//! The order in which the blocks of pictures are computed, chosen so that the tiles still to be read fit the memory.
use super::demand::{Demand, Fields};
use super::limit::{Limit, Neighbor};
use super::region::Region;
use super::run::Run;
use crate::value::{Field, Grid, TILE, Window};
use std::sync::{Arc, PoisonError};

/// Minimum width of strips. Pixels read beyond their edges are computed twice, or written to a file and read back.
const NARROWEST: u32 = 4 * TILE;
/// Data count as small if they fill at most one part in this many of the memory for tiles. For small data, only
/// [`Order::Rows`] pays off.
const FEW: u64 = 4;

/// An order of the blocks of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// From top to bottom, in bands of one or a few tiles' height. Fields that outputs share and the row of tiles above
    /// are then still in memory.
    Rows,
    /// From left to right, this many columns at a time. A part that is much wider than high thus needs less memory at a
    /// time, and no pixel is computed twice or handed over.
    Columns(u32),
    /// In strips of this many columns, each computed from top to bottom as if it were the only one. For pictures whose
    /// rows of tiles would fill the memory.
    Strips(u32),
}

/// Some columns of pictures, computed from top to bottom.
#[derive(Debug, PartialEq)]
pub struct Pass {
    /// The columns.
    pub window: Window,
    /// The picture pixels whose tiles are kept at the start of the pass: all following columns, or only those of a
    /// strip.
    pub wanted: Window,
    /// The blocks, from top to bottom.
    pub blocks: Vec<Window>,
}

impl Pass {
    /// The picture pixels whose tiles are kept after a block; `None` if they do not change.
    pub fn wanted_after(&self, block: &Window) -> Option<Window> {
        let height = self.window.bottom().abs_diff(block.bottom());
        (self.wanted == self.window && height > 0).then_some(Window { y: block.bottom(), height, ..self.window })
    }
}

impl Order {
    /// Chooses the order for pictures of `fields` in `window`. `frees` is true if tiles that no later block reads are
    /// freed.
    pub fn choose(run: &Run<'_>, fields: &Fields<'_>, window: Window, frees: bool) -> Self {
        let room = run.caches.memory.tiles.capacity();
        // Bytes of the tiles that the pixels before read and the pixels after read again.
        let bytes = |before, after| {
            let [before, after] = [before, after].map(|window| run.demand(fields, window));
            before.shared_bytes(&after, fields, |field, grid| run.known.keeps(field, grid))
        };
        if frees && u64::from(window.height) * 4 <= u64::from(window.width) {
            let band = Window { height: block_length(4, window.width).min(window.height), ..window };
            // Few columns suffice, since all inputs of a column are in memory.
            let width = block_length(2, window.height).max(2 * TILE).min(window.width);
            let column = in_middle(window, width);
            let before = Window { width: column.right().abs_diff(window.x), ..window };
            let after = Window { width: window.right().abs_diff(column.x), ..column };
            if bytes(band, window) > room / FEW && bytes(before, after) <= room {
                return Self::Columns(width);
            }
        }
        // As many columns as fit the memory. Recomputing dropped tiles costs more than strips do at their edges and on
        // the disk: if memory holds seven eighths of the tiles to be read again, a chain of four filters takes 1.24
        // times as long, but only 1.01 times in strips.
        let fits = |width: u32| {
            // A strip in the middle has neighbours on both sides.
            let strip = in_middle(window, width);
            let y = strip.y.saturating_add_unsigned(strip.height / 2 / TILE * TILE);
            let after = Window { y, height: strip.bottom().abs_diff(y), ..strip };
            bytes(Window { height: y.abs_diff(strip.y) + block_length(4, width).min(after.height), ..strip }, after)
                <= room
        };
        let width = |strips| window.width.div_ceil(strips).next_multiple_of(TILE).max(NARROWEST).min(window.width);
        let width = (1..).map(width).find(|width| *width <= NARROWEST || fits(*width)).unwrap_or(NARROWEST);
        if width < window.width { Self::Strips(width) } else { Self::Rows }
    }

    /// Divides `window` into passes.
    pub fn passes(self, window: Window) -> Vec<Pass> {
        let width = match self {
            Self::Rows => window.width.next_multiple_of(TILE) + TILE,
            Self::Columns(width) | Self::Strips(width) => width,
        };
        let pass = |(x, right): (i32, i32)| {
            let pass = Window { x, width: right.abs_diff(x), ..window };
            let after = Window { x, width: window.right().abs_diff(x), ..window };
            let wanted = if let Self::Columns(_) = self { after } else { pass };
            let bands = cut(window.y, window.bottom(), block_length(4, width.min(window.width)));
            let blocks = bands.map(|(y, end)| Window { y, height: end.abs_diff(y), ..pass }).collect();
            Pass { window: pass, wanted, blocks }
        };
        cut(window.x, window.right(), width).map(pass).collect()
    }
}

/// A strip of this width in the middle of a window.
fn in_middle(window: Window, width: u32) -> Window {
    Window { x: window.x.saturating_add_unsigned((window.width - width) / 2 / TILE * TILE), width, ..window }
}

/// The length of blocks of this width, such that every thread has `tiles` tiles to compute.
fn block_length(tiles: u32, width: u32) -> u32 {
    let threads = u32::try_from(rayon::current_num_threads()).unwrap_or(1);
    (tiles * threads).div_ceil(width.div_ceil(TILE).max(1)) * TILE
}

/// Cuts `from..to` at tile edges into pieces of `length`, which must be a multiple of a tile's side.
fn cut(from: i32, to: i32, length: u32) -> impl Iterator<Item = (i32, i32)> {
    let tile = TILE.cast_signed();
    let end = move |at: i32| (at.div_euclid(tile) * tile).saturating_add_unsigned(length).min(to);
    std::iter::successors(Some((from, end(from))), move |&(_, at)| Some((at, end(at))))
        .take_while(move |&(at, _)| at < to)
}

impl Run<'_> {
    /// From now on, computes only pixels that pictures of `fields` in `window` need and that no neighbour has handed
    /// over. Must be called when these fields are prepared and no tile is being computed.
    pub fn limit_to(&self, fields: &Fields<'_>, window: Window, neighbors: Vec<Neighbor>) {
        let limit = Limit::new(fields, window, neighbors, |field, grid| self.known.keeps(field, grid));
        *self.limit.write().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(limit));
    }

    /// The demand of pictures in `window` when they are computed in tiles.
    pub fn demand(&self, fields: &Fields<'_>, window: Window) -> Demand {
        Demand::in_tiles(fields, window, self.limit().as_ref().map(|limit| &limit.demand))
    }

    /// Frees the tiles in `before` that `rest` does not read.
    pub fn free(&self, fields: &Fields<'_>, before: &Demand, rest: &Demand) {
        before.minus(rest, fields).iter().for_each(|tile| drop(self.caches.memory.tiles.remove(tile)));
    }

    /// True if a pixel of `field` needs no whole picture, and at most `most` columns and rows of each field below it.
    pub fn is_near(&self, field: &Field, grid: &Grid, most: u64) -> bool {
        let fields = Fields::new(&[field], grid);
        let demand = Demand::exact(&fields, Window { x: 0, y: 0, width: 1, height: 1 });
        let is_small = |region: &Region| region.side() <= most;
        fields.order.iter().all(|(field, grid)| {
            let reads_little = field.key().is_none() || demand.region(field, grid).is_some_and(is_small);
            reads_little && field.source().whole(grid).is_empty()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_at_tile_edges_and_covers_everything() {
        assert_eq!(cut(0, 1000, 512).collect::<Vec<_>>(), [(0, 512), (512, 1000)]);
        assert_eq!(cut(300, 1000, 512).collect::<Vec<_>>(), [(300, 768), (768, 1000)]);
        assert_eq!(cut(5, 6, 256).collect::<Vec<_>>(), [(5, 6)]);
        assert_eq!(cut(5, 5, 256).count(), 0);
    }

    #[test]
    fn passes_cover_each_pixel_once_and_keep_tiles_for_the_rest() {
        let window = Window { x: 100, y: 300, width: 5000, height: 2500 };
        for order in [Order::Rows, Order::Columns(512), Order::Strips(1024)] {
            let passes = order.passes(window);
            let blocks = passes.iter().flat_map(|pass| &pass.blocks);
            assert_eq!(blocks.clone().map(Window::len).sum::<usize>(), window.len(), "{order:?}");
            assert!(blocks.clone().all(|block| window.contains(block)));
            assert_eq!(passes[0].wanted == window, !matches!(order, Order::Strips(_)), "{order:?}");
            let last = passes.last().unwrap();
            assert_eq!((last.wanted, last.wanted_after(last.blocks.last().unwrap())), (last.window, None));
        }
        let rows = &Order::Rows.passes(window)[0];
        let first = rows.blocks[0];
        assert_eq!((first.y, first.width), (300, 5000));
        assert_eq!(rows.wanted_after(&first).map(|rest| (rest.y, rest.bottom())), Some((first.bottom(), 2800)));
        assert_eq!(Order::Columns(512).passes(window)[0].wanted_after(&first), None);
    }
}
