//! Reads fields in tiles, through the caches.
//!
//! A tile is computed on one thread, with an explicit stack of unfinished windows ([`Frame`]) instead of recursion, so
//! a graph may have any depth. Code that fills a tile starts no parallel work, so a thread that waits for another
//! thread's tile never blocks the pool. A tile waits only for its inputs, so threads never wait for each other in a
//! cycle.
use super::memory::{Guard, TileKey, Warned};
use super::run::Run;
use super::stats::Work;
use super::warnings::{Gathered, Warning, Warnings, are_placed};
use crate::diagnostics::{Code, Problem};
use crate::value::clock::Stopwatch;
use crate::value::{Blocks, Field, Given, Grid, Key, Piece, Read, Stop, Tile, Window};
use quick_cache::sync::GuardResult;
use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

/// A tile is computed in halves if its windows that depend on values have more pixels than this.
const MOST_PIXELS: usize = 1 << 22;

#[derive(Clone, Copy)]
enum How {
    /// In the best way for the field: from tiles, or directly.
    Best,
    /// As the tile of a block, which is kept. In a part of a picture, the tile may be clipped to the demand.
    Tile(Piece, Piece),
    /// Exactly this window, without the caches.
    Bare,
}

/// The next step towards a requested window.
enum Step<'f, 'r> {
    /// A requested window of a field, and the result to which its work is charged if the field has no key.
    Want(Read<'f>, Key, How),
    /// Unfinished work, with the window that it waited for.
    Work(Box<Frame<'f, 'r>>, Option<Warned>),
    Done(Warned),
}

/// An unfinished window of a field.
struct Frame<'f, 'r> {
    read: Read<'f>,
    owner: Key,
    /// True if the window counts as a tile in the statistics; false for a piece of a tile.
    counts: bool,
    keep: Option<Keep<'r>>,
    making: Making<'f>,
    /// The warnings so far: those of the windows that it was made of, and its own.
    warnings: Gathered,
}

/// The cache entry for an unfinished tile.
struct Keep<'r> {
    at: TileKey,
    block: (Piece, Piece),
    guard: Option<Guard<'r>>,
}

enum Making<'f> {
    /// Computed by the field's code from windows of its inputs, `wanted`. They include the windows that depend on
    /// values only if `narrowed`.
    Fill { wanted: Vec<Read<'f>>, tiles: Vec<Arc<Tile>>, narrowed: bool },
    /// Joined from windows of the same field, of which `done` are copied. The windows are its tiles, the halves of a
    /// tile that reads too much at once, or the missing pieces of a tile that is partly available.
    Join { parts: Vec<(Window, How)>, done: usize, out: Option<Tile> },
}

impl Run<'_> {
    /// Returns the values of `field` in `window`, and the warnings about them; work for fields without a key is charged to
    /// `owner`.
    pub(super) fn read(&self, field: &Field, grid: &Grid, window: Window, owner: Key) -> Result<Warned, Stop> {
        let mut stack: Vec<Box<Frame<'_, '_>>> = Vec::new();
        let mut step = Step::Want(Read::new(field, grid, window), owner, How::Best);
        loop {
            step = match step {
                Step::Want(read, owner, how) => self.begin(read, owner, how)?,
                Step::Work(mut frame, made) => {
                    let next = frame.step(self, made)?;
                    if let Step::Want(..) = next {
                        stack.push(frame);
                    }
                    next
                }
                Step::Done(tile) => match stack.pop() {
                    Some(frame) => Step::Work(frame, Some(tile)),
                    None => return Ok(tile),
                },
            };
        }
    }

    /// Returns the requested window if it is cached, else the work that computes it.
    fn begin<'f, 's>(&'s self, read: Read<'f>, owner: Key, how: How) -> Result<Step<'f, 's>, Stop> {
        let Read { field, grid, window } = read;
        // A field that finds from its first tiles that it needs no more of an input requests an empty window.
        if window.is_empty() {
            let tile = Arc::new(Tile::new(grid, window, field.channels()));
            return Ok(Step::Done(Warned { tile, warnings: Warnings::default() }));
        }
        let key = match (field.key(), how) {
            (None, _) | (_, How::Bare) => return self.fill(read, owner, false, None),
            (Some(key), How::Tile(x, y)) => return self.tile(read, key, (x, y)),
            (Some(key), How::Best) => key,
        };
        if field.as_constant().is_some() || (!self.known.keeps(field, &grid) && Blocks::endless(window).count() == 1) {
            return self.fill(read, field.owner().unwrap_or(key), true, None);
        }
        let blocks = field.domain().blocks(&grid, window);
        match blocks.get(0).filter(|_| blocks.count() == 1) {
            Some((x, y)) if Piece::window(x, y) == window && (x.shift, y.shift) == (0, 0) => {
                self.tile(read, key, (x, y))
            }
            _ => {
                let part = |(x, y): (Piece, Piece)| {
                    let wanted = Window { x: window.x - x.shift, y: window.y - y.shift, ..window };
                    (Piece::window(x, y).intersection(&wanted), How::Tile(x, y))
                };
                let making = Making::Join { parts: blocks.iter().map(part).collect(), done: 0, out: None };
                Ok(Frame { read, owner: key, counts: false, keep: None, making, warnings: Gathered::default() }.begun())
            }
        }
    }

    /// Returns a tile from the caches, or the work that computes it; the window is the requested part of the tile.
    fn tile<'f, 's>(
        &'s self,
        Read { field, grid, window }: Read<'f>,
        key: Key,
        block: (Piece, Piece),
    ) -> Result<Step<'f, 's>, Stop> {
        self.cancel.check()?;
        let owner = field.owner().unwrap_or(key);
        let ready = |tile, work| {
            self.ledger.add(owner, work);
            Ok(Step::Done(tile))
        };
        let (memory, disk) = (Work { memory: 1, ..Work::default() }, Work { disk: 1, ..Work::default() });
        let tiles = &self.caches.memory.tiles;
        let limit = self.limit();
        let whole = TileKey { field: key, grid: grid.id(), window: Piece::window(block.0, block.1) };
        let part = limit.as_ref().and_then(|limit| limit.window(field, &grid, block, window));
        let at = TileKey { window: part.unwrap_or(whole.window), ..whole };
        // Warnings about places in the whole tile may not be about the part.
        if at != whole
            && let Some(made) = tiles.get(&whole).filter(|made| !are_placed(&made.warnings))
        {
            return ready(made, memory);
        }
        let guard = match tiles.get_value_or_guard(&at, None) {
            GuardResult::Value(made) => return ready(made, memory),
            GuardResult::Guard(guard) => Some(guard),
            GuardResult::Timeout => None,
        };
        // Those of a stored tile may be about more than this run demands: another run may have read more around it.
        let is_about_demand = |warnings: &Warnings| limit.is_none() || !are_placed(warnings);
        let stored = self.stored_tile(&whole, field, &grid).filter(|(_, warnings)| is_about_demand(warnings));
        let stored = stored.map(|(tile, warnings)| (tile, Vec::new(), warnings));
        let found = stored.or_else(|| limit?.take(field, &grid, block, at.window));
        match found {
            Some((tile, missing, warnings)) if missing.is_empty() => {
                let made = Warned { tile: Arc::new(tile), warnings };
                guard.into_iter().for_each(|guard| drop(guard.insert(made.clone())));
                ready(made, disk)
            }
            found => {
                let (read, keep) = (Read::new(field, &grid, at.window), Some(Keep { at, block, guard }));
                let Some((out, missing, found)) = found else { return self.fill(read, owner, true, keep) };
                let parts = missing.into_iter().map(|window| (window, How::Bare)).collect();
                let making = Making::Join { parts, done: 0, out: Some(out) };
                let mut warnings = Gathered::default();
                warnings.add(&found);
                Ok(Frame { read, owner, counts: true, keep, making, warnings }.begun())
            }
        }
    }

    fn fill<'f, 's>(
        &'s self,
        read: Read<'f>,
        owner: Key,
        counts: bool,
        keep: Option<Keep<'s>>,
    ) -> Result<Step<'f, 's>, Stop> {
        self.cancel.check()?;
        let wanted = self.of_owner(Some(owner), || Ok(read.field.source().inputs(&read.grid, read.window)))?;
        let making = Making::Fill { tiles: Vec::with_capacity(wanted.len()), wanted, narrowed: false };
        Ok(Frame { read, owner, counts, keep, making, warnings: Gathered::default() }.begun())
    }
}

impl<'f, 'r> Frame<'f, 'r> {
    fn begun(self) -> Step<'f, 'r> {
        Step::Work(Box::new(self), None)
    }

    /// The next window that the work needs, or the finished one; `made` is the window that it waited for.
    fn step(&mut self, run: &Run<'_>, made: Option<Warned>) -> Result<Step<'f, 'r>, Stop> {
        let mut made = made.map(|made| {
            self.warnings.add(&made.warnings);
            made.tile
        });
        if let Making::Fill { tiles, .. } = &mut self.making {
            tiles.extend(made.take());
            self.narrow(run)?;
        }
        let Read { field, grid, window } = self.read;
        match &mut self.making {
            Making::Join { parts, done, out } => {
                if let (Some(tile), Some((_, how))) = (&made, parts.get(*done)) {
                    let out = out.get_or_insert_with(|| Tile::unset(grid, window, field.channels()));
                    let (dx, dy) = if let How::Tile(x, y) = how { (x.shift, y.shift) } else { (0, 0) };
                    out.copy_from(tile, dx, dy);
                    *done += 1;
                }
                if let Some((window, how)) = parts.get(*done) {
                    return Ok(Step::Want(Read::new(field, &grid, *window), self.owner, *how));
                }
                let tile = out.take().unwrap_or_else(|| Tile::new(grid, window, field.channels()));
                Ok(Step::Done(self.finish(run, tile, None)))
            }
            Making::Fill { wanted, tiles, .. } => {
                if let Some(read) = wanted.get(tiles.len()) {
                    run.check_window(field, window, read).inspect_err(|problem| run.failed(self.owner, problem))?;
                    return Ok(Step::Want(*read, self.owner, How::Best));
                }
                let (tiles, start) = (std::mem::take(tiles), Stopwatch::thread());
                let mut tile = field.blank(grid, window);
                let (filled, found) = self.with_given(run, &tiles, |given| {
                    run.of_owner(Some(self.owner), || field.source().fill(given, &mut tile))
                });
                found.into_iter().for_each(|warning| self.warnings.push(warning));
                filled?;
                Ok(Step::Done(self.finish(run, tile, Some(start.elapsed()))))
            }
        }
    }

    /// Keeps a finished tile; `time` is the time that the field's code took, `None` for a joined tile.
    fn finish(&mut self, run: &Run<'_>, tile: Tile, time: Option<Duration>) -> Warned {
        let Read { field, grid, window } = self.read;
        let (policy, made) = (&run.caches.policy, Warned { tile: Arc::new(tile), warnings: self.warnings.warnings() });
        let debt = match time {
            Some(time) => {
                run.meter.tile(time);
                policy.filled(field, &grid, window, time)
            }
            None if self.keep.is_some() => policy.owed(field, &grid, window),
            None => Duration::ZERO,
        };
        if field.as_constant().is_none() && (self.counts || time.is_some()) {
            let (computed, pixels) = (u64::from(self.counts), time.map_or(0, |_| window.len() as u64));
            run.ledger.add(self.owner, Work { time: time.unwrap_or_default(), computed, pixels, ..Work::default() });
        }
        if let Some(Keep { at, block, guard }) = self.keep.take() {
            guard.into_iter().for_each(|guard| drop(guard.insert(made.clone())));
            // Threads that wait for the tile have it now, so writing it delays none of them.
            if at.window == Piece::window(block.0, block.1) {
                run.keep_tile(&at, field, &made, debt);
            }
            if let Some(limit) = run.limit() {
                limit.hand_over(field, block, &made);
            }
        }
        made
    }

    /// Runs code of the field on tiles of its inputs; also returns its warnings, and those about the prepared data.
    fn with_given<T>(
        &self,
        run: &Run<'_>,
        tiles: &[Arc<Tile>],
        work: impl FnOnce(&Given<'_>) -> T,
    ) -> (T, Vec<Warning>) {
        let Read { field, grid, .. } = &self.read;
        let (prepared, found) = (run.known.prepared(field, grid), RefCell::new(Vec::new()));
        let stopped = || run.cancel.is_cancelled();
        let warn = |problem| found.borrow_mut().push(Warning::of_tile(self.owner, problem, grid));
        let made = work(&Given::new(tiles, prepared.as_ref().map(|whole| &*whole.tile), &stopped).warning(&warn));
        let of_prepared = prepared.iter().flat_map(|whole| whole.warnings.iter().cloned());
        (made, found.take().into_iter().chain(of_prepared).collect())
    }

    /// Adds the windows that depend on values, once the other inputs are there. If they are too large, the tile is
    /// computed in halves.
    fn narrow(&mut self, run: &Run<'_>) -> Result<(), Stop> {
        let Read { field, grid, window } = self.read;
        let Making::Fill { wanted, tiles, narrowed: false } = &self.making else { return Ok(()) };
        if tiles.len() < wanted.len() {
            return Ok(());
        }
        let later = run.of_owner(Some(self.owner), || Ok(field.source().later(&grid, window)))?;
        let narrow =
            |given: &Given<'_>| run.of_owner(Some(self.owner), || Ok(field.source().narrow(given, &grid, window)));
        let (narrow, found) = match later.is_empty() {
            true => (Vec::new(), Vec::new()),
            false => {
                let (windows, found) = self.with_given(run, tiles, narrow);
                (windows?, found)
            }
        };
        if later.len() != narrow.len()
            || !later.iter().zip(&narrow).all(|(later, narrow)| later.window.contains(narrow))
        {
            let problem = Problem::new(Code::BadValue, "a field reads more than it states");
            let problem = problem.help("this is a defect of the node");
            run.failed(self.owner, &problem);
            return Err(problem.into());
        }
        if window.len() > 1 && narrow.iter().map(Window::len).sum::<usize>() > MOST_PIXELS {
            run.cancel.check()?;
            let parts = window.halves().map(|half| (half, How::Bare)).to_vec();
            self.making = Making::Join { parts, done: 0, out: None };
        } else if let Making::Fill { wanted, narrowed, .. } = &mut self.making {
            wanted.extend(later.iter().zip(narrow).map(|(read, window)| Read { window, ..*read }));
            *narrowed = true;
        }
        found.into_iter().for_each(|warning| self.warnings.push(warning));
        Ok(())
    }
}
