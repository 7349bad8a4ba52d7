//! The pixels of pictures, computed and written from top to bottom.
//!
//! Pictures are computed in bands that are one or a few tiles high, so that what they share is still in memory, and so is the
//! row of tiles above. For a very wide picture those rows alone would fill the memory. It is computed in vertical strips,
//! which are kept in temporary files beside the pictures until whole rows can be written. A part of a picture that is much wider
//! than high is computed from left to right instead, if that fits the memory: then less is in memory at a time, which each process
//! must first fetch from the system, and nothing is computed or handed over twice. It is written as it is computed, in blocks.
use super::export::Sink;
use super::part::PartSink;
use super::render::{Job, Render};
use super::{Failure, located};
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::{Event, Neighbor, Passing, Spill};
use crate::picture::AtomicFile;
use crate::value::{Field, Grid, TILE, Tile, Window};
use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;

/// The least width of strips: what is read beyond their edges is computed twice, or written and read.
const NARROWEST: u32 = 4 * TILE;
/// With less of the memory for tiles in use, strips are not worth their files.
const FEW: u64 = 4;
/// What is read beyond the edges of a strip, or of a part of a picture, may reach over so many others.
pub(super) const NEAR: usize = 2;

impl Render<'_, '_> {
    /// Computes and writes the pictures together.
    pub(super) fn bands(&self, jobs: &[&Job<'_>], writers: &mut [Sink], grid: &Grid) -> Result<(), Failure> {
        let window = self.area;
        let fields: Vec<&Field> = jobs.iter().flat_map(|job| &job.fields).map(|(_, field)| field).collect();
        if let Some(width) = self.low_width(&fields, grid) {
            return self.strips(jobs, &fields, writers, grid, (width, false));
        }
        let strip = self.strip_width(&fields, grid);
        if strip < window.width {
            return self.strips(jobs, &fields, writers, grid, (strip, true));
        }
        let heights = band_height(window.width);
        let mut passing = self.planner.request.once.then(|| Passing::new(&fields, grid, window));
        for band in bands(window, heights) {
            for (job, writer) in jobs.iter().zip(&mut *writers) {
                let tiles = self.tiles(job, grid, band)?;
                write(writer, &tiles, band)?;
            }
            self.pass(passing.as_mut(), window, band);
            self.rows(u64::from(band.bottom().abs_diff(window.y)));
        }
        Ok(())
    }

    /// Frees what nothing reads any more once the rows `band` of `window` are done.
    fn pass(&self, passing: Option<&mut Passing<'_>>, window: Window, band: Window) {
        let rest = Window { y: band.bottom(), height: window.bottom().abs_diff(band.bottom()), ..window };
        if let Some(passing) = passing.filter(|_| !rest.is_empty()) {
            self.run.pass(passing, rest);
        }
    }

    /// How many columns are computed at once if the pictures are so low that less is in memory when they are computed from left to
    /// right; `None` if they are not, or if even that does not fit.
    fn low_width(&self, fields: &[&Field], grid: &Grid) -> Option<u32> {
        let (window, room) = (self.area, self.run.tile_bytes());
        if !self.planner.request.once || u64::from(window.height) * 4 > u64::from(window.width) {
            return None;
        }
        let passing = Passing::new(fields, grid, window);
        let bytes = |before, after| self.run.bytes_at_hand(&passing, before, after);
        let band = band_height(window.width).min(window.height);
        if bytes(Window { height: band, ..window }, window) <= room / FEW {
            return None;
        }
        let width = narrow_width(window.height).min(window.width);
        let x = window.x.saturating_add_unsigned((window.width - width) / 2 / TILE * TILE);
        let before = Window { width: x.abs_diff(window.x) + width, ..window };
        let after = Window { x, width: window.right().abs_diff(x), ..window };
        (bytes(before, after) <= room).then_some(width)
    }

    /// Computes and writes the pictures in strips of `width` columns. If what is read beyond their edges does not fit the memory, they are `apart`: each is
    /// computed as if alone, but for what those beside it have left in a file.
    fn strips(
        &self,
        jobs: &[&Job<'_>],
        fields: &[&Field],
        writers: &mut [Sink],
        grid: &Grid,
        (width, apart): (u32, bool),
    ) -> Result<(), Failure> {
        let window = self.area;
        let height = band_height(width);
        let strips = cut(window.x, window.right(), width)
            .map(|(x, right)| Window { x, width: right.abs_diff(x), ..window })
            .collect::<Vec<_>>();
        let channels: usize = fields.iter().map(|field| field.channels()).sum();
        let in_memory = window.len() as u64 * 4 * channels as u64 <= self.run.tile_bytes() / FEW;
        // Parts take blocks as they are; pictures, whole rows.
        let blocks: Option<Vec<&PartSink>> = writers.iter().map(Sink::part).collect();
        let waiting = jobs.iter().filter(|_| blocks.is_none()).map(|job| Waiting::create(&job.planned.path, in_memory));
        let mut waiting = waiting.collect::<Result<Vec<_>, _>>()?;
        let once = self.planner.request.once;
        let mut across = (once && !apart).then(|| Passing::new(fields, grid, window));
        let mut spills = Spills { beside: jobs.first().map(|job| &*job.planned.path), open: BTreeMap::new() };
        let following = strips.iter().skip(1).map(Some).chain([None]);
        for ((i, strip), next) in (0_u64..).zip(&strips).zip(following) {
            if apart {
                // At its edges no more than what it reads.
                let neighbors = self.beside(&strips, strip, &mut spills);
                self.run.limit(fields, grid, *strip, neighbors);
            }
            let mut passing = (once && apart).then(|| Passing::new(fields, grid, *strip));
            for band in bands(*strip, height) {
                for (number, job) in jobs.iter().enumerate() {
                    let tiles = self.tiles(job, grid, band)?;
                    match &blocks {
                        Some(sinks) => sinks[number].write_block(&planes(&tiles), band)?,
                        None => waiting[number].put(&tiles)?,
                    }
                }
                self.pass(passing.as_mut(), *strip, band);
                let rows = u64::from(band.bottom().abs_diff(window.y));
                self.rows((i * u64::from(window.height) + rows) / strips.len() as u64);
            }
            if let (Some(passing), Some(next)) = (passing.as_mut(), next) {
                // What only this strip reads would be in the way of the next one.
                self.run.pass(passing, *next);
            }
            let rest = Window { x: strip.right(), width: window.right().abs_diff(strip.right()), ..window };
            if let Some(across) = across.as_mut().filter(|_| !rest.is_empty()) {
                self.run.pass(across, rest);
            }
        }
        drop(spills);
        if blocks.is_some() {
            return Ok(());
        }
        for band in bands(window, height) {
            for ((job, writer), waiting) in jobs.iter().zip(&mut *writers).zip(&mut waiting) {
                let channels: usize = job.fields.iter().map(|(_, field)| field.channels()).sum();
                let mut whole = Tile::new(*grid, band, channels);
                for strip in &strips {
                    let part = Window { x: strip.x, width: strip.width, ..band };
                    let before = strip.x.abs_diff(window.x) as u64 * u64::from(window.height)
                        + band.y.abs_diff(window.y) as u64 * u64::from(strip.width);
                    whole.copy_from(&waiting.take(Tile::new(*grid, part, channels), before)?, 0, 0);
                }
                write(writer, &[whole], band)?;
            }
        }
        Ok(())
    }

    /// The other parts of the picture that read some of what a strip reads: those beside it, and what is above and below.
    fn beside(&self, strips: &[Window], strip: &Window, spills: &mut Spills<'_>) -> Vec<Neighbor> {
        let mut neighbors: Vec<Neighbor> = self.neighbors.clone();
        for neighbor in &mut neighbors {
            neighbor.window = Window { x: strip.x, width: strip.width, ..neighbor.window };
        }
        let own = strips.iter().position(|other| other == strip).unwrap_or(0);
        spills.open.retain(|(_, last), _| *last >= own);
        for (number, other) in strips.iter().enumerate().filter(|(number, _)| near(own, *number, strips.len())) {
            if let Some(spill) = spills.between(own.min(number), own.max(number)) {
                neighbors.push(Neighbor { window: *other, spill, waits: number > own });
            }
        }
        neighbors
    }

    /// How many columns are computed at once: as many as fit the memory. Tiles that it has lost are made again, which costs more than
    /// strips do at their edges and on the disk: if it holds seven eighths of those at hand, a chain of four filters takes 1.24 times
    /// as long, and in strips 1.01 times.
    fn strip_width(&self, fields: &[&Field], grid: &Grid) -> u32 {
        let room = self.run.tile_bytes();
        let whole = self.area.width;
        let fits = |width: u32| {
            // In the middle, so that there are strips on both sides.
            let x = self.area.x.saturating_add_unsigned((whole - width) / 2 / TILE * TILE);
            let strip = Window { x, width, ..self.area };
            let y = self.area.y.saturating_add_unsigned(self.area.height / 2 / TILE * TILE);
            let height = y.abs_diff(strip.y) + band_height(width).min(strip.bottom().abs_diff(y));
            let (before, after) =
                (Window { height, ..strip }, Window { y, height: strip.bottom().abs_diff(y), ..strip });
            self.run.bytes_at_hand(&Passing::new(fields, grid, strip), before, after) <= room
        };
        let widths = (1..).map(|strips| whole.div_ceil(strips).next_multiple_of(TILE).max(NARROWEST).min(whole));
        widths.into_iter().find(|width| *width <= NARROWEST || fits(*width)).unwrap_or(NARROWEST)
    }

    /// Tells how many rows are done.
    fn rows(&self, done: u64) {
        self.observer.event(Event::Rows { done, total: u64::from(self.area.height) });
    }

    /// The values of a picture's fields.
    fn tiles(&self, job: &Job<'_>, grid: &Grid, band: Window) -> Result<Vec<Tile>, Failure> {
        let graph = self.planner.graph;
        let mut tiles: Vec<Tile> = Vec::with_capacity(job.fields.len());
        for (_, field) in &job.fields {
            let tile = self.run.raster(field, grid, band).map_err(|stop| located(self.run, graph, stop))?;
            // Without an early end, so that many are looked at together.
            if !tile.data().iter().fold(true, |all, v| all & v.is_finite())
                && let Some(at) = tile.data().iter().position(|v| !v.is_finite())
            {
                return Err(not_finite(job, &tile, at));
            }
            tiles.push(tile);
        }
        Ok(tiles)
    }
}

/// Whether two of `count` parts lie side by side, or nearly so; the last one is beside the first, since pictures may repeat.
pub(super) fn near(own: usize, other: usize, count: usize) -> bool {
    let apart = own.abs_diff(other);
    apart > 0 && apart.min(count - apart) <= NEAR
}

/// What strips leave for each other, by the numbers of two that share it.
struct Spills<'p> {
    /// A picture, for their place and their names.
    beside: Option<&'p Path>,
    open: BTreeMap<(usize, usize), Arc<Spill>>,
}

impl Spills<'_> {
    /// The file of two strips. Without one, both compute what they need.
    fn between(&mut self, first: usize, last: usize) -> Option<Arc<Spill>> {
        if let Some(spill) = self.open.get(&(first, last)) {
            return Some(spill.clone());
        }
        let spill = Arc::new(Spill::create(self.beside?).ok()?);
        self.open.insert((first, last), spill.clone());
        Some(spill)
    }
}

/// The height of bands of this width: high enough that every thread has tiles to compute.
fn band_height(width: u32) -> u32 {
    let threads = u32::try_from(rayon::current_num_threads()).unwrap_or(1);
    (4 * threads).div_ceil(width.div_ceil(TILE).max(1)) * TILE
}

/// The width of strips of low parts: wide enough for that, and no wider, since all that they read is in memory.
fn narrow_width(height: u32) -> u32 {
    let threads = u32::try_from(rayon::current_num_threads()).unwrap_or(1);
    (2 * threads).div_ceil(height.div_ceil(TILE).max(1)).max(2) * TILE
}

/// A window in bands of `height` rows, the first up to a border of tiles.
fn bands(window: Window, height: u32) -> impl Iterator<Item = Window> {
    cut(window.y, window.bottom(), height).map(move |(y, end)| Window { y, height: end.abs_diff(y), ..window })
}

/// `from..to` in pieces of `length`, a multiple of a tile, that end where tiles end.
fn cut(from: i32, to: i32, length: u32) -> impl Iterator<Item = (i32, i32)> {
    let tile = TILE.cast_signed();
    let end = move |at: i32| (at.div_euclid(tile) * tile).saturating_add_unsigned(length).min(to);
    std::iter::successors(Some((from, end(from))), move |&(_, at)| Some((at, end(at))))
        .take_while(move |&(at, _)| at < to)
}

fn write(writer: &mut Sink, tiles: &[Tile], band: Window) -> Result<(), Failure> {
    writer.write_rows(&planes(tiles), band.height)
}

/// The samples of all channels.
fn planes(tiles: &[Tile]) -> Vec<&[f32]> {
    tiles.iter().flat_map(|t| (0..t.channels()).map(|c| t.plane(c))).collect()
}

/// The part of a picture that is computed but cannot be written yet: strip after strip, band after band, plane after plane.
struct Waiting<'p> {
    medium: Medium,
    picture: &'p Path,
}

enum Medium {
    Memory(Vec<f32>),
    /// A temporary file that is removed when it is dropped.
    File(AtomicFile),
}

impl<'p> Waiting<'p> {
    fn create(picture: &'p Path, in_memory: bool) -> Result<Self, Failure> {
        let medium = match in_memory {
            true => Medium::Memory(Vec::new()),
            false => Medium::File(AtomicFile::create(picture).map_err(|e| failed(picture, &e))?),
        };
        Ok(Self { medium, picture })
    }

    fn put(&mut self, tiles: &[Tile]) -> Result<(), Failure> {
        for tile in tiles {
            match &mut self.medium {
                Medium::Memory(values) => values.extend_from_slice(tile.data()),
                Medium::File(file) => {
                    file.write_all(bytemuck::cast_slice(tile.data())).map_err(|e| failed(self.picture, &e))?;
                }
            }
        }
        Ok(())
    }

    /// Fills `tile` with what was put; `before` is the number of pixels before it.
    fn take(&mut self, mut tile: Tile, before: u64) -> Result<Tile, Failure> {
        let at = before * tile.channels() as u64;
        let taken = match &mut self.medium {
            Medium::Memory(values) => {
                let from = usize::try_from(at).ok().and_then(|at| values.get(at..)?.get(..tile.data().len()));
                from.map(|from| tile.data_mut().copy_from_slice(from))
                    .ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
            }
            Medium::File(file) => {
                let bytes = bytemuck::cast_slice_mut::<f32, u8>(tile.data_mut());
                file.seek(SeekFrom::Start(at * 4)).and_then(|_| file.read_exact(bytes))
            }
        };
        taken.map_err(|e| failed(self.picture, &e))?;
        Ok(tile)
    }
}

fn failed(picture: &Path, error: &io::Error) -> Failure {
    Failure::File(format!("cannot keep the strips of `{}` in a temporary file beside it: {error}", picture.display()))
}

fn not_finite(job: &Job<'_>, tile: &Tile, at: usize) -> Failure {
    let at = at % tile.window.len().max(1);
    let (x, y) = (at % tile.width(), at / tile.width());
    let message = format!(
        "`{}` is not a finite number at pixel ({}, {})",
        job.planned.output.name,
        i64::from(tile.window.x) + x as i64,
        i64::from(tile.window.y) + y as i64,
    );
    let help = "look for divisions by zero or overflow in the nodes before it";
    Failure::Errors(vec![Diagnostic::new(Code::NotFinite, job.planned.output.span, message).help(help)])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod tests {
    use super::*;

    #[test]
    fn parts_are_near_across_the_ends() {
        let of = |own: usize, count: usize| (0..count).filter(|other| near(own, *other, count)).collect::<Vec<_>>();
        assert_eq!(of(0, 16), [1, 2, 14, 15]);
        assert_eq!(of(7, 16), [5, 6, 8, 9]);
        assert_eq!((of(0, 3), of(1, 2), of(0, 1)), (vec![1, 2], vec![0], vec![]));
    }

    #[test]
    fn pieces_end_where_tiles_end_and_cover_everything() {
        assert_eq!(cut(0, 1000, 512).collect::<Vec<_>>(), [(0, 512), (512, 1000)]);
        assert_eq!(cut(300, 1000, 512).collect::<Vec<_>>(), [(300, 768), (768, 1000)]);
        assert_eq!(cut(5, 6, 256).collect::<Vec<_>>(), [(5, 6)]);
        assert_eq!(cut(5, 5, 256).count(), 0);
    }

    fn message<T>(result: Result<T, Failure>) -> String {
        match result {
            Err(Failure::File(message)) => message,
            Err(other) => panic!("{other:?}"),
            Ok(_) => panic!("it worked"),
        }
    }

    #[test]
    fn what_waits_comes_back_or_is_missed() {
        let dir = tempfile::tempdir().unwrap();
        let picture = dir.path().join("a.png");
        let grid = Grid { origin: glam::DVec2::ZERO, step: glam::DVec2::ONE, period: None, shown: None };
        let window = Window { x: 0, y: 0, width: 3, height: 2 };
        let tile = |from: f32| {
            let mut tile = Tile::new(grid, window, 1);
            tile.data_mut().iter_mut().zip(0_u8..).for_each(|(v, i)| *v = from + f32::from(i));
            tile
        };
        for in_memory in [true, false] {
            let mut waiting = Waiting::create(&picture, in_memory).unwrap();
            waiting.put(&[tile(0.0), tile(10.0)]).unwrap();
            waiting.put(&[tile(20.0)]).unwrap();
            assert_eq!(waiting.take(Tile::new(grid, window, 1), 6).unwrap(), tile(10.0));
            assert_eq!(waiting.take(Tile::new(grid, window, 1), 12).unwrap(), tile(20.0));
            // Half of what is asked for was never put: no zeros in its place.
            let missed = message(waiting.take(Tile::new(grid, window, 1), 15));
            assert!(missed.contains("a.png") && missed.contains("strips"), "{missed}");
        }
        assert_eq!(dir.path().read_dir().unwrap().count(), 0);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_named() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("file"), "").unwrap();
        for picture in ["gone/a.png", "file/a.png"] {
            let refused = message(Waiting::create(&dir.path().join(picture), false));
            assert!(refused.contains(picture) && refused.contains("temporary file"), "{refused}");
        }
    }
}
