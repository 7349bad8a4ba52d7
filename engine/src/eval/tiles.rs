//! Reads fields in tiles, through the caches.
//!
//! A tile is computed on one thread, with an explicit stack of unfinished windows ([`Frame`]) instead of recursion, so
//! a graph may have any depth. Code that fills a tile starts no parallel work, so a thread that waits for another
//! thread's tile never blocks the pool. A tile waits only for its inputs, so threads never wait for each other in a
//! cycle.
use super::memory::{Guard, TileKey};
use super::run::Run;
use super::stats::Work;
use crate::diagnostics::{Code, Problem};
use crate::value::clock::Stopwatch;
use crate::value::{Blocks, Field, Given, Grid, Key, Piece, Read, Stop, Tile, Window};
use quick_cache::sync::GuardResult;
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
    Work(Box<Frame<'f, 'r>>, Option<Arc<Tile>>),
    Done(Arc<Tile>),
}

/// An unfinished window of a field.
struct Frame<'f, 'r> {
    read: Read<'f>,
    owner: Key,
    /// True if the window counts as a tile in the statistics; false for a piece of a tile.
    counts: bool,
    keep: Option<Keep<'r>>,
    making: Making<'f>,
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
    /// Returns the values of `field` in `window`; work for fields without a key is charged to `owner`.
    pub(super) fn read(&self, field: &Field, grid: &Grid, window: Window, owner: Key) -> Result<Arc<Tile>, Stop> {
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
            return Ok(Step::Done(Arc::new(Tile::new(grid, window, field.channels()))));
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
                Ok(Frame { read, owner: key, counts: false, keep: None, making }.begun())
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
        if at != whole
            && let Some(tile) = tiles.get(&whole)
        {
            return ready(tile, memory);
        }
        let guard = match tiles.get_value_or_guard(&at, None) {
            GuardResult::Value(tile) => return ready(tile, memory),
            GuardResult::Guard(guard) => Some(guard),
            GuardResult::Timeout => None,
        };
        let stored = self.stored_tile(&whole, field, &grid).map(|tile| (tile, Vec::new()));
        let found = stored.or_else(|| limit?.take(field, &grid, block, at.window));
        match found {
            Some((tile, missing)) if missing.is_empty() => {
                let tile = Arc::new(tile);
                guard.into_iter().for_each(|guard| drop(guard.insert(tile.clone())));
                ready(tile, disk)
            }
            found => {
                let (read, keep) = (Read::new(field, &grid, at.window), Some(Keep { at, block, guard }));
                let Some((out, missing)) = found else { return self.fill(read, owner, true, keep) };
                let parts = missing.into_iter().map(|window| (window, How::Bare)).collect();
                let making = Making::Join { parts, done: 0, out: Some(out) };
                Ok(Frame { read, owner, counts: true, keep, making }.begun())
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
        Ok(Frame { read, owner, counts, keep, making }.begun())
    }
}

impl<'f, 'r> Frame<'f, 'r> {
    fn begun(self) -> Step<'f, 'r> {
        Step::Work(Box::new(self), None)
    }

    /// The next window that the work needs, or the finished one; `made` is the window that it waited for.
    fn step(&mut self, run: &Run<'_>, mut made: Option<Arc<Tile>>) -> Result<Step<'f, 'r>, Stop> {
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
                let fill = |given: &Given<'_>| field.source().fill(given, &mut tile);
                run.of_owner(Some(self.owner), || self.with_given(run, &tiles, fill))?;
                Ok(Step::Done(self.finish(run, tile, Some(start.elapsed()))))
            }
        }
    }

    /// Keeps a finished tile; `time` is the time that the field's code took, `None` for a joined tile.
    fn finish(&mut self, run: &Run<'_>, tile: Tile, time: Option<Duration>) -> Arc<Tile> {
        let Read { field, grid, window } = self.read;
        let (policy, tile) = (&run.caches.policy, Arc::new(tile));
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
            guard.into_iter().for_each(|guard| drop(guard.insert(tile.clone())));
            // Threads that wait for the tile have it now, so writing it delays none of them.
            if at.window == Piece::window(block.0, block.1) {
                run.keep_tile(&at, field, &tile, debt);
            }
            if let Some(limit) = run.limit() {
                limit.hand_over(field, block, &tile);
            }
        }
        tile
    }

    fn with_given<T>(&self, run: &Run<'_>, tiles: &[Arc<Tile>], work: impl FnOnce(&Given<'_>) -> T) -> T {
        let prepared = run.known.prepared(self.read.field, &self.read.grid);
        let (stopped, warn) = (|| run.cancel.is_cancelled(), |problem| run.warned(self.owner, problem));
        work(&Given::new(tiles, prepared.as_deref(), &stopped).warning(&warn))
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
        let narrow = |given: &Given<'_>| field.source().narrow(given, &grid, window);
        let narrow = match later.is_empty() {
            true => Vec::new(),
            false => run.of_owner(Some(self.owner), || Ok(self.with_given(run, tiles, narrow)))?,
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
        Ok(())
    }
}
