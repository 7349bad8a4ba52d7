//! The field of a cut through a solid.
use super::solid::{Patch, PatchPieces, Planes, SolidSource};
use super::{Cost, Cut, Field, FieldSource, Given, Grid, PieceMap, Read, Stop, Tile, Window};
use std::ops::Range;
use std::sync::Arc;

/// Code of the field of a cut.
pub(super) struct CutField {
    pub(super) source: Arc<dyn SolidSource>,
    /// The solids that the code reads.
    pub(super) inputs: Vec<CutInput>,
    pub(super) cut: Cut,
}

/// A solid that the code of another solid reads.
pub(super) struct CutInput {
    /// Its field, or a field of which it is a part.
    pub(super) field: Field,
    /// Its channels within that field.
    pub(super) channels: Range<usize>,
}

/// Some rows of a window, counted from its top.
struct Rows {
    grid: Grid,
    window: Window,
    rows: Range<usize>,
}

impl Rows {
    /// Range of these rows in a plane of the window.
    fn points(&self) -> Range<usize> {
        let columns = self.window.width as usize;
        self.rows.start * columns..self.rows.end * columns
    }

    /// Values of these rows in a channel of a tile of the window.
    fn of<'a>(&self, tile: &'a Tile, channel: usize) -> &'a [f32] {
        &tile.plane(channel)[self.points()]
    }

    fn three<'a>(&self, tile: &'a Tile) -> [&'a [f32]; 3] {
        [0, 1, 2].map(|channel| self.of(tile, channel))
    }
}

/// The smallest window of whole quads around `window`.
fn quads(window: Window) -> Window {
    let (x, y) = (window.x & !1, window.y & !1);
    let even = |from: i32, to: i32| (to.abs_diff(from) + 1) & !1;
    Window { x, y, width: even(x, window.right()), height: even(y, window.bottom()) }
}

/// Distance beyond a quad at which neighbours are read for the footprint of a pixel at the border of a piece.
const BESIDE: i32 = 2;
/// Number of rows of a surface with holes that are computed at a time.
const BAND: u32 = 64;

impl CutField {
    /// True if the code needs whole quads on this grid.
    fn in_quads(&self, grid: &Grid) -> bool {
        self.source.wants().quads && self.cut.pixel(grid) != 0.0
    }

    /// The window that is computed: of whole quads, if the code needs them. At the border of a piece, the footprint of
    /// a pixel may depend on the next quad.
    fn window(&self, grid: &Grid, window: Window) -> Window {
        if !self.in_quads(grid) {
            return window;
        }
        let beside = if self.cut.pieces().is_some() { BESIDE } else { 0 };
        quads(window).grow(beside, beside)
    }

    /// True if its reads come in two stages on this grid: first the ids of pieces over the maximal window, then the
    /// other inputs, over that window only if pieces meet at the edges.
    fn in_stages(&self, grid: &Grid) -> bool {
        self.in_quads(grid) && self.cut.pieces().is_some()
    }

    /// The window that is computed for `window` if the pieces are `ids`: without a margin, unless pieces meet in a quad
    /// at the edges.
    fn window_of(&self, ids: &Tile, grid: &Grid, window: Window) -> Window {
        let close = quads(window);
        if unbroken_at_edges(ids, close) { close } else { self.window(grid, window) }
    }

    /// The pieces of the cut, if the code needs them or there are holes between them.
    fn pieces(&self) -> Option<&PieceMap> {
        self.cut.pieces().filter(|pieces| self.source.wants().quads || pieces.holes)
    }

    /// The metric of the cut, if the code needs it.
    fn metric(&self) -> Option<&Field> {
        self.cut.metric().filter(|_| self.source.wants().quads)
    }

    /// The normals of the rounded surface, if the code needs them.
    fn rounded(&self) -> Option<&Field> {
        self.cut.rounded().filter(|_| self.source.wants().rounded)
    }

    /// The inputs besides the ids of pieces: the one before the ids, and those after.
    fn reads(&self) -> (Option<&Field>, impl Iterator<Item = &Field>) {
        let place = self.source.wants().place.then_some(self.cut.place());
        let planes = self.pieces().and_then(|pieces| pieces.planes.as_ref());
        let after = planes.map(|planes| &planes.turned).into_iter().chain(self.metric()).chain(self.rounded());
        (place, after.chain(self.inputs.iter().map(|input| &input.field)))
    }

    /// Computes some rows of a window from tiles of that window.
    fn compute(&self, given: &Given<'_>, tiles: &[&Tile], rows: &Rows, out: &mut [&mut [f32]]) {
        let (columns, n, points) = (rows.window.width as usize, rows.window.len(), rows.points());
        let mut tiles = tiles.iter().copied();
        let place = if self.source.wants().place { tiles.next() } else { None };
        let pieces = self.pieces().and_then(|pieces| {
            let ids = rows.of(tiles.next()?, 0);
            let planes = pieces.planes.as_ref().and_then(|planes| Some((tiles.next()?, &planes.axes)));
            let planes = planes.map(|(turned, axes)| ([rows.of(turned, 0), rows.of(turned, 1)], axes));
            Some(PatchPieces { ids, planes })
        });
        let metric = self.metric().and_then(|_| tiles.next());
        let rounded = self.rounded().and_then(|_| tiles.next());
        let channels = |input: &CutInput| input.channels.start * n..input.channels.end * n;
        let planes = tiles.zip(&self.inputs).map(|(tile, input)| Planes::new(&tile.data()[channels(input)], n));
        let inputs: Vec<Planes<'_>> = planes.map(|planes| planes.part(points.clone())).collect();
        let patch = Patch {
            place: place.map_or([&[]; 3], |tile| rows.three(tile)),
            columns,
            rows: rows.rows.len(),
            level: self.cut.level(),
            flat: self.cut.flat(),
            pieces: pieces.filter(|_| self.source.wants().quads),
            metric: metric.map(|tile| rows.three(tile)),
            rounded: rounded.map(|tile| rows.three(tile)),
            space: false,
            pixel: self.cut.pixel(&rows.grid),
            listener: given.listener(),
        };
        self.source.fill(&patch, &inputs, out);
    }

    /// Computes a tile from tiles of the larger window `whole`.
    fn compute_whole(&self, given: &Given<'_>, tiles: &[&Tile], whole: Window, out: &mut Tile) {
        let rows = Rows { grid: out.grid, window: whole, rows: 0..whole.height as usize };
        if whole == out.window {
            return self.compute(given, tiles, &rows, &mut out.planes_mut());
        }
        let mut larger = Tile::unset(out.grid, whole, out.channels());
        self.compute(given, tiles, &rows, &mut larger.planes_mut());
        out.copy_from(&larger, 0, 0);
    }

    /// Computes the parts of a tile outside of holes, from tiles of the larger window `whole`. In holes all values are
    /// 0.
    fn compute_between_holes(
        &self,
        given: &Given<'_>,
        tiles: &[&Tile],
        whole: Window,
        out: &mut Tile,
    ) -> Result<(), Stop> {
        let ids = tiles[usize::from(self.source.wants().place)];
        let parts = occupied(ids.plane(0), whole);
        if parts == [whole] {
            self.compute_whole(given, tiles, whole, out);
        } else {
            out.data_mut().fill(0.0);
            let beside = if self.in_quads(&out.grid) { BESIDE } else { 0 };
            for part in parts {
                given.check()?;
                let around = part.grow(beside, beside).intersection(&whole);
                let rows = around.y.abs_diff(whole.y) as usize..around.bottom().abs_diff(whole.y) as usize;
                let rows = Rows { grid: out.grid, window: whole, rows };
                if around.width == whole.width && whole == out.window {
                    let planes = out.planes_mut().into_iter().map(|plane| &mut plane[rows.points()]);
                    self.compute(given, tiles, &rows, &mut planes.collect::<Vec<_>>());
                    continue;
                }
                let mut larger = Tile::unset(out.grid, around, out.channels());
                if around.width == whole.width {
                    self.compute(given, tiles, &rows, &mut larger.planes_mut());
                } else {
                    let cropped: Vec<Tile> = tiles.iter().map(|tile| crop(tile, around)).collect();
                    let cropped: Vec<&Tile> = cropped.iter().collect();
                    let rows = Rows { window: around, rows: 0..around.height as usize, ..rows };
                    self.compute(given, &cropped, &rows, &mut larger.planes_mut());
                }
                out.copy_part(&larger, part, 0, 0);
            }
        }
        for y in out.window.y..out.window.bottom() {
            let from = (out.window.x.abs_diff(whole.x)) as usize;
            let ids = &ids.row(0, y.abs_diff(whole.y) as usize)[from..from + out.width()];
            // No early exit, so that the loop can be vectorized.
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

/// Windows of whole quads that contain all pixels of `window` with an id other than 0, and few others: bands of rows,
/// either from the first to the last such column or over the whole width.
fn occupied(ids: &[f32], window: Window) -> Vec<Window> {
    let mut parts: Vec<Window> = Vec::new();
    let columns = window.width as usize;
    for (ids, y) in ids.chunks((columns * BAND as usize).max(1)).zip((window.y..).step_by(BAND as usize)) {
        let rows = || ids.chunks(columns);
        let Some(first) = rows().filter_map(|row| row.iter().position(|id| *id != 0.0)).min() else { continue };
        let last = rows().filter_map(|row| row.iter().rposition(|id| *id != 0.0)).max().unwrap_or(first);
        let (first, end) = (first & !1, ((last + 2) & !1).min(columns));
        // Whole rows are computed in place; for others all inputs must be copied first.
        let (first, end) = if 2 * (end - first) > columns { (0, columns) } else { (first, end) };
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

/// True if each quad at the edges of `window` lies in one piece. `window` must consist of whole quads.
fn unbroken_at_edges(ids: &Tile, window: Window) -> bool {
    let row = |y: i32| {
        let from = window.x.abs_diff(ids.window.x) as usize;
        &ids.row(0, y.abs_diff(ids.window.y) as usize)[from..from + window.width as usize]
    };
    let quads = |y: i32, columns: Range<usize>| {
        let [upper, lower] = [row(y), row(y + 1)].map(|row| row[columns.clone()].as_chunks::<2>().0);
        upper.iter().zip(lower).all(|(a, b)| a[0] == a[1] && a[0] == b[0] && a[0] == b[1])
    };
    let columns = window.width as usize;
    (window.y..window.bottom()).step_by(2).all(|y| {
        if y == window.y || y + 2 >= window.bottom() {
            quads(y, 0..columns)
        } else {
            quads(y, 0..2) && quads(y, columns - 2..columns)
        }
    })
}

impl FieldSource for CutField {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let ids = self.pieces().map(|pieces| &pieces.ids);
        let (place, after) = self.reads();
        let window = self.window(grid, window);
        let read = |field| Read::new(field, grid, window);
        match self.in_stages(grid) {
            true => ids.into_iter().map(read).collect(),
            false => place.into_iter().chain(ids).chain(after).map(read).collect(),
        }
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        if !self.in_stages(grid) {
            return Vec::new();
        }
        let (place, after) = self.reads();
        let window = self.window(grid, window);
        place.into_iter().chain(after).map(|field| Read::new(field, grid, window)).collect()
    }

    fn narrow(&self, given: &Given<'_>, grid: &Grid, window: Window) -> Vec<Window> {
        let later = self.later(grid, window).len();
        if later == 0 { Vec::new() } else { vec![self.window_of(given.tile(0), grid, window); later] }
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        given.check()?;
        let mut tiles: Vec<&Tile> = given.tiles().collect();
        let mut whole = self.window(&out.grid, out.window);
        let cropped;
        if self.in_stages(&out.grid) {
            let ids = tiles.remove(0);
            whole = self.window_of(ids, &out.grid, out.window);
            cropped = (ids.window != whole).then(|| crop(ids, whole));
            tiles.insert(usize::from(self.source.wants().place), cropped.as_ref().unwrap_or(ids));
        }
        if self.pieces().is_some_and(|pieces| pieces.holes) {
            return self.compute_between_holes(given, &tiles, whole, out);
        }
        self.compute_whole(given, &tiles, whole, out);
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
    fn occupied_windows_cover_all_pieces_and_few_holes() {
        let window = Window { x: -2, y: 4, width: 20, height: 140 };
        let at = |x: usize, y: usize| y * 20 + x;
        let mut ids = vec![0.0; window.len()];
        assert_eq!(occupied(&ids, window), []);
        ids[at(5, 3)] = 2.0;
        ids[at(9, 60)] = 1.0;
        ids[at(19, 130)] = 1.0;
        let part = |x: i32, y: i32, width: u32, height: u32| Window { x, y, width, height };
        // The second band is empty; columns are rounded to whole quads.
        assert_eq!(occupied(&ids, window), [part(2, 4, 6, 64), part(16, 132, 2, 12)]);
        // If most of a row is occupied, the whole row is taken.
        ids[at(16, 10)] = 1.0;
        assert_eq!(occupied(&ids, window)[0], part(-2, 4, 20, 64));
        ids.fill(1.0);
        assert_eq!(occupied(&ids, window), [window]);
    }

    #[test]
    fn needs_a_margin_only_if_pieces_meet_at_the_edges() {
        let close = Window { x: 4, y: -2, width: 8, height: 6 };
        let grid = Grid { origin: glam::DVec2::ZERO, step: glam::DVec2::ONE, period: None, shown: None };
        let with = |others: &[(i32, i32)]| {
            let mut ids = Tile::unset(grid, close.grow(BESIDE, BESIDE), 1);
            ids.data_mut().fill(1.0);
            for (x, y) in others {
                let (x, y) = (x.abs_diff(ids.window.x) as usize, y.abs_diff(ids.window.y) as usize);
                ids.row_mut(0, y)[x] = 2.0;
            }
            unbroken_at_edges(&ids, close)
        };
        assert!(with(&[]));
        // Another piece in the interior, or just outside, does not matter.
        assert!(with(&[(7, 0), (3, 0), (12, 1), (6, -3), (6, 4)]));
        for edge in [(4, 0), (5, 1), (10, 0), (11, -1), (7, -2), (8, -1), (7, 2), (4, 3)] {
            assert!(!with(&[edge]), "{edge:?}");
        }
    }
}
