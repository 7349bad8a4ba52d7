//! The code of the field of a cut through a solid.
use super::solid::{Listener, Patch, PatchPieces, Planes, SolidSource};
use super::{Cost, Cut, Field, FieldSource, Given, Grid, Pieces, Read, Stop, Tile, Window};
use std::sync::Arc;

/// What a cut shows of a solid.
pub(super) struct Shown {
    pub(super) source: Arc<dyn SolidSource>,
    /// The fields of the solids that the code reads.
    pub(super) inputs: Vec<Field>,
    pub(super) cut: Cut,
}

/// The smallest window of whole quads around `window`.
fn quads(window: Window) -> Window {
    let (x, y) = (window.x & !1, window.y & !1);
    let even = |from: i32, to: i32| (to.abs_diff(from) + 1) & !1;
    Window { x, y, width: even(x, window.right()), height: even(y, window.bottom()) }
}

/// How far beyond a quad its neighbours may lie that tell the footprint of a pixel at the border of a piece.
const BESIDE: i32 = 2;
/// So many rows of a surface with holes are computed at a time.
const BAND: u32 = 64;

impl Shown {
    /// Whether the code needs whole quads on this grid.
    fn in_quads(&self, grid: &Grid) -> bool {
        self.source.wants().quads && self.cut.pixel(grid) != 0.0
    }

    /// The window that is computed: of whole quads, where the code needs them. At the border of a piece, the neighbours that
    /// tell the footprint of a pixel may be those of the next quad.
    fn window(&self, grid: &Grid, window: Window) -> Window {
        if !self.in_quads(grid) {
            return window;
        }
        let beside = if self.cut.pieces().is_some() { BESIDE } else { 0 };
        quads(window).grow(beside, beside)
    }

    /// The pieces of the cut, if the code must know them, or there are holes between them.
    fn pieces(&self) -> Option<&Pieces> {
        self.cut.pieces().filter(|pieces| self.source.wants().quads || pieces.holes)
    }

    /// The metric of the cut, if the code must know it.
    fn metric(&self) -> Option<&Field> {
        self.cut.metric().filter(|_| self.source.wants().quads)
    }

    /// The normals of the rounded surface, if the code must know them.
    fn rounded(&self) -> Option<&Field> {
        self.cut.rounded().filter(|_| self.source.wants().rounded)
    }

    /// Computes the whole of a tile from others of the same window.
    fn compute(&self, tiles: &[&Tile], listener: Option<Listener<'_>>, out: &mut Tile) {
        let (grid, window) = (out.grid, out.window);
        let mut tiles = tiles.iter().copied();
        let place = if self.source.wants().place { tiles.next() } else { None };
        let pieces = self.pieces().and_then(|pieces| {
            let ids = tiles.next()?.plane(0);
            let planes = pieces.planes.as_ref().and_then(|planes| Some((tiles.next()?, &planes.axes)));
            let planes = planes.map(|(turned, axes)| ([turned.plane(0), turned.plane(1)], axes));
            Some(PatchPieces { ids, planes })
        });
        let metric = self.metric().and_then(|_| tiles.next());
        let rounded = self.rounded().and_then(|_| tiles.next());
        let inputs: Vec<Planes<'_>> = tiles.map(|tile| Planes::new(tile.data(), window.len())).collect();
        let patch = Patch {
            place: place.map_or([&[]; 3], |tile| [tile.plane(0), tile.plane(1), tile.plane(2)]),
            columns: out.width(),
            rows: out.height(),
            level: self.cut.level(),
            flat: self.cut.flat(),
            pieces: pieces.filter(|_| self.source.wants().quads),
            metric: metric.map(|tile| [tile.plane(0), tile.plane(1), tile.plane(2)]),
            rounded: rounded.map(|tile| [tile.plane(0), tile.plane(1), tile.plane(2)]),
            space: false,
            pixel: self.cut.pixel(&grid),
            listener,
        };
        self.source.fill(&patch, &inputs, &mut out.planes_mut());
    }

    /// Computes a tile from others of the window `whole` around it.
    fn compute_whole(&self, tiles: &[&Tile], listener: Option<Listener<'_>>, whole: Window, out: &mut Tile) {
        if whole == out.window {
            return self.compute(tiles, listener, out);
        }
        let mut larger = Tile::unset(out.grid, whole, out.channels());
        self.compute(tiles, listener, &mut larger);
        out.copy_from(&larger, 0, 0);
    }

    /// Computes the parts of a tile where there is a surface. Elsewhere all values are 0.
    fn compute_between_holes(&self, given: &Given<'_>, whole: Window, out: &mut Tile) -> Result<(), Stop> {
        let tiles: Vec<&Tile> = given.tiles().collect();
        let ids = tiles[usize::from(self.source.wants().place)];
        let parts = occupied(ids.plane(0), whole);
        if parts == [whole] {
            self.compute_whole(&tiles, given.listener(), whole, out);
        } else {
            out.data_mut().fill(0.0);
            let beside = if self.in_quads(&out.grid) { BESIDE } else { 0 };
            for part in parts {
                given.check()?;
                let around = part.grow(beside, beside).intersection(&whole);
                let cropped: Vec<Tile> = tiles.iter().map(|tile| crop(tile, around)).collect();
                let mut larger = Tile::unset(out.grid, around, out.channels());
                self.compute(&cropped.iter().collect::<Vec<_>>(), given.listener(), &mut larger);
                out.copy_part(&larger, part, 0, 0);
            }
        }
        for y in out.window.y..out.window.bottom() {
            let from = (out.window.x.abs_diff(whole.x)) as usize;
            let ids = &ids.row(0, y.abs_diff(whole.y) as usize)[from..from + out.width()];
            // Without an early end, so that many are looked at together.
            if ids.iter().fold(true, |all, id| all & (*id != 0.0)) {
                continue;
            }
            for channel in 0..out.channels() {
                let row = out.row_mut(channel, y.abs_diff(out.window.y) as usize);
                row.iter_mut().zip(ids).for_each(|(value, id)| *value = if *id == 0.0 { 0.0 } else { *value });
            }
        }
        Ok(())
    }
}

/// The part of a tile within a window.
fn crop(tile: &Tile, window: Window) -> Tile {
    let mut part = Tile::unset(tile.grid, window, tile.channels());
    part.copy_from(tile, 0, 0);
    part
}

/// Windows of whole quads that together hold all pixels of `window` with a number that is not 0, and few others: in bands of
/// rows, from the first such column to the last.
fn occupied(ids: &[f32], window: Window) -> Vec<Window> {
    let mut parts: Vec<Window> = Vec::new();
    let columns = window.width as usize;
    for (ids, y) in ids.chunks((columns * BAND as usize).max(1)).zip((window.y..).step_by(BAND as usize)) {
        let rows = || ids.chunks(columns);
        let Some(first) = rows().filter_map(|row| row.iter().position(|id| *id != 0.0)).min() else { continue };
        let last = rows().filter_map(|row| row.iter().rposition(|id| *id != 0.0)).max().unwrap_or(first);
        let (first, end) = (first & !1, ((last + 2) & !1).min(columns));
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "a window's columns and rows")]
        let part =
            Window { x: window.x + first as i32, y, width: (end - first) as u32, height: (ids.len() / columns) as u32 };
        match parts.last_mut() {
            Some(above) if (above.x, above.width, above.bottom()) == (part.x, part.width, part.y) => {
                above.height += part.height;
            }
            _ => parts.push(part),
        }
    }
    parts
}

impl FieldSource for Shown {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let window = self.window(grid, window);
        let place = self.source.wants().place.then_some(self.cut.place());
        let pieces = self.pieces().into_iter();
        let pieces = pieces.flat_map(|p| std::iter::once(&p.ids).chain(p.planes.as_ref().map(|planes| &planes.turned)));
        place
            .into_iter()
            .chain(pieces)
            .chain(self.metric())
            .chain(self.rounded())
            .chain(&self.inputs)
            .map(|field| Read::new(field, grid, window))
            .collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        given.check()?;
        let whole = self.window(&out.grid, out.window);
        if self.pieces().is_some_and(|pieces| pieces.holes) {
            return self.compute_between_holes(given, whole, out);
        }
        let tiles: Vec<&Tile> = given.tiles().collect();
        self.compute_whole(&tiles, given.listener(), whole, out);
        Ok(())
    }

    fn cost(&self) -> Cost {
        self.source.cost()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_around_what_is_there_leave_no_hole_out() {
        let window = Window { x: -2, y: 4, width: 20, height: 140 };
        let at = |x: usize, y: usize| y * 20 + x;
        let mut ids = vec![0.0; window.len()];
        assert_eq!(occupied(&ids, window), []);
        ids[at(5, 3)] = 2.0;
        ids[at(9, 60)] = 1.0;
        ids[at(19, 130)] = 1.0;
        let part = |x: i32, y: i32, width: u32, height: u32| Window { x, y, width, height };
        // Nothing in the second band; columns are those of whole quads.
        assert_eq!(occupied(&ids, window), [part(2, 4, 6, 64), part(16, 132, 2, 12)]);
        ids.fill(1.0);
        assert_eq!(occupied(&ids, window), [window]);
    }
}
