//! What lies near the edges of a part of a picture, handed from one part to the next.
//!
//! Filters read beyond the edges of a part, so there are pixels on both sides of an edge that two parts need (see
//! [`Reach`](super::reach::Reach)). The one that is made first leaves them for the other in a file (see [`Spill`]). No pixel
//! changes by it, since a value depends on its position alone; so parts may be made in any order, and several at once.
use super::memory::TileKey;
use super::run::Run;
use super::spill::Spill;
use crate::value::{Field, Grid, Piece, Tile, Window};
use std::sync::Arc;

/// The bytes that are left for another part at most, if no store says how much room there is.
const ROOM: u64 = 1 << 30;

/// Another part of the picture.
#[derive(Clone)]
pub struct Neighbor {
    /// Its pixels.
    pub window: Window,
    /// Where one of both leaves what the other needs.
    pub spill: Arc<Spill>,
    /// Whether it is still to be made, so that something is to be left for it.
    pub waits: bool,
}

/// Pixels of a tile that a neighbour reads too.
pub(super) struct Halo {
    /// Under which key they are kept.
    pub(super) at: TileKey,
    pub(super) window: Window,
    pub(super) spill: Arc<Spill>,
    /// Whether the neighbour is still to be made.
    pub(super) waits: bool,
}

/// What is left of `rest` without `part`, if that is a smaller window.
fn without(rest: Window, part: Window) -> Option<Window> {
    let part = rest.overlap(&part)?;
    let (left, top, right, bottom) = (rest.x, rest.y, rest.right(), rest.bottom());
    let between =
        |x: i32, y: i32, right: i32, bottom: i32| Window { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) };
    let (wide, high) = (part.width == rest.width, part.height == rest.height);
    match () {
        () if wide && part.y == top => Some(between(left, part.bottom(), right, bottom)),
        () if wide && part.bottom() == bottom => Some(between(left, top, right, part.y)),
        () if high && part.x == left => Some(between(part.right(), top, right, bottom)),
        () if high && part.right() == right => Some(between(left, top, part.x, bottom)),
        () => None,
    }
}

impl Run<'_> {
    /// The pixels of a tile that neighbours read too, the largest first.
    pub(super) fn shared_with_neighbors(&self, tile: &TileKey, at: (Piece, Piece)) -> Vec<Halo> {
        self.reached(|reach| Some(reach.halos(tile, at))).unwrap_or_default()
    }

    /// What neighbours have left of `window` of a tile, and the pixels that are not there; what was taken is removed from
    /// `halos`. `None` if nothing was.
    pub(super) fn taken(
        &self,
        halos: &mut Vec<Halo>,
        field: &Field,
        grid: &Grid,
        window: Window,
    ) -> Option<(Tile, Window)> {
        let (mut out, mut rest) = (None, window);
        halos.retain(|halo| {
            let Some(smaller) = without(rest, halo.window).filter(|_| halo.spill.has(&halo.at)) else {
                return true;
            };
            let mut part = Tile::unset(*grid, halo.window, field.channels());
            if halo.spill.take(&halo.at, &mut part).is_none() {
                return true;
            }
            rest = smaller;
            out.get_or_insert_with(|| Tile::unset(*grid, window, field.channels())).copy_from(&part, 0, 0);
            false
        });
        out.map(|out| (out, rest))
    }

    /// How many bytes may be left for one other part of a picture: a quarter of what the store of results may hold.
    pub fn room_for_others(&self) -> u64 {
        self.caches.store.as_ref().map_or(ROOM, |store| store.room() / 4)
    }

    /// Leaves for neighbours what they read of a new tile.
    pub(super) fn leave(&self, halos: &[Halo], tile: &Tile) {
        for halo in halos.iter().filter(|halo| halo.waits && tile.window.contains(&halo.window)) {
            let mut part = Tile::unset(tile.grid, halo.window, tile.channels());
            part.copy_from(tile, 0, 0);
            halo.spill.put(&halo.at, &part);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_a_window_or_nothing_is_taken() {
        let window = |x, y, width, height| Window { x, y, width, height };
        let whole = window(10, 20, 100, 50);
        assert_eq!(without(whole, window(0, 0, 500, 30)), Some(window(10, 30, 100, 40)));
        assert_eq!(without(whole, window(10, 60, 100, 10)), Some(window(10, 20, 100, 40)));
        assert_eq!(without(whole, window(10, 20, 30, 50)), Some(window(40, 20, 70, 50)));
        assert_eq!(without(whole, window(90, 0, 20, 100)), Some(window(10, 20, 80, 50)));
        assert!(without(whole, whole).is_some_and(|rest| rest.is_empty()));
        // In the middle, in a corner, beside it.
        for part in [window(20, 20, 10, 50), window(10, 20, 50, 20), window(200, 20, 10, 50)] {
            assert_eq!(without(whole, part), None);
        }
    }
}
