//! Reading fields: by tiles, through the caches.
//!
//! A tile is made on one thread, by a stack of its own of what is under way ([`Frame`]): a graph may be as deep as it
//! likes. No code that fills a tile starts parallel work, so a thread that waits for a tile of another never holds up the
//! pool; and since a tile waits only for those that it is made from, no two threads wait for each other.
use super::MemoryCache;
use super::halos::Halo;
use super::memory::{Guard, TileKey};
use super::run::Run;
use super::stats::Work;
use crate::diagnostics::{Code, Problem};
use crate::value::{Blocks, Field, Given, Grid, Key, Piece, Read, Stop, Tile, Window};
use cpu_time::ThreadTime;
use quick_cache::sync::GuardResult;
use std::sync::Arc;
use std::time::Duration;

/// A tile that reads more pixels at once, by a window that depends on values, is made in parts.
const MOST_PIXELS: usize = 1 << 22;

/// A window of a field that is wanted, and the result as whose work it counts if it has no key of its own.
#[derive(Clone, Copy)]
struct Want<'f> {
    read: Read<'f>,
    owner: Key,
    how: How,
}

#[derive(Clone, Copy)]
enum How {
    /// As is best for the field.
    Best,
    /// As a whole tile, which is kept; of a part of a picture perhaps no more of it than is read.
    Tile(Piece, Piece),
    /// Just so, without the caches.
    Bare,
}

/// What is under way: a tile that is being made, or a window that is put together from tiles.
enum Frame<'f, 'r> {
    Fill(Box<Fill<'f, 'r>>),
    Join(Box<Join<'f>>),
}

enum Step<'f> {
    Want(Want<'f>),
    Done(Arc<Tile>),
}

/// A window that is put together from whole tiles.
struct Join<'f> {
    field: &'f Field,
    key: Key,
    grid: Grid,
    window: Window,
    blocks: Blocks,
    next: usize,
    out: Option<Tile>,
}

/// A tile that is being made.
struct Fill<'f, 'r> {
    read: Read<'f>,
    owner: Key,
    keep: Option<Keep<'r>>,
    /// Whether it counts as a tile of its own, not as a part of another.
    counts: bool,
    wanted: Vec<Read<'f>>,
    tiles: Vec<Arc<Tile>>,
    narrowed: bool,
    pieces: Option<Pieces>,
}

/// Where a tile is kept when it is made.
struct Keep<'r> {
    at: TileKey,
    guard: Option<Guard<'r>>,
    /// Whether also beyond the process.
    stored: bool,
    /// What other parts of the picture read of it.
    halos: Vec<Halo>,
}

/// A tile that is put together from parts: it would read too much at once, or some of it was there.
struct Pieces {
    /// The parts that are made.
    windows: Vec<Window>,
    done: usize,
    out: Tile,
}

impl Run<'_> {
    /// The values of `field` in `window`.
    pub(super) fn read(&self, field: &Field, grid: &Grid, window: Window, owner: Key) -> Result<Arc<Tile>, Stop> {
        let mut stack: Vec<Frame<'_, '_>> = Vec::new();
        let mut wanted = Some(Want { read: Read::new(field, grid, window), owner, how: How::Best });
        let mut made = None;
        loop {
            if let Some(want) = wanted.take() {
                match self.begin(want)? {
                    Ok(tile) => made = Some(tile),
                    Err(frame) => stack.push(frame),
                }
            }
            let Some(top) = stack.last_mut() else { break };
            let step = match top {
                Frame::Fill(fill) => fill.step(self, made.take())?,
                Frame::Join(join) => join.step(made.take()),
            };
            match step {
                Step::Want(want) => wanted = Some(want),
                Step::Done(tile) => {
                    stack.pop();
                    made = Some(tile);
                }
            }
        }
        // The last frame gave what was wanted first, so this is always there.
        Ok(made.unwrap_or_else(|| Arc::new(Tile::new(*grid, window, field.channels()))))
    }

    /// The tile that is wanted, if it is at hand, or what must be done for it.
    fn begin<'f, 's>(&'s self, want: Want<'f>) -> Result<Result<Arc<Tile>, Frame<'f, 's>>, Stop> {
        let Want { read: Read { field, grid, window }, owner, how } = want;
        // What a field does without here, as it found when it had its first tiles.
        if window.is_empty() {
            return Ok(Ok(Arc::new(Tile::new(grid, window, field.channels()))));
        }
        let (key, how) = match (field.key(), how) {
            (None, _) | (_, How::Bare) => return self.fill(want.read, owner, None, false).map(Err),
            (Some(key), how) => (key, how),
        };
        if let How::Tile(x, y) = how {
            return self.tile(want.read, key, (x, y));
        }
        if field.as_constant().is_some() || (!self.keeps(field, &grid) && Blocks::endless(window).count() == 1) {
            return self.fill(want.read, field.owner().unwrap_or(key), None, true).map(Err);
        }
        let blocks = field.domain().blocks(&grid, window);
        match blocks.get(0).filter(|_| blocks.count() == 1) {
            Some((x, y)) if Piece::window(x, y) == window && (x.shift, y.shift) == (0, 0) => {
                self.tile(want.read, key, (x, y))
            }
            _ => Ok(Err(Frame::Join(Box::new(Join { field, key, grid, window, blocks, next: 0, out: None })))),
        }
    }

    /// One tile from the caches, or what must be done for it; `read` is what is wanted of it.
    fn tile<'f, 's>(
        &'s self,
        Read { field, grid, window }: Read<'f>,
        key: Key,
        (x, y): (Piece, Piece),
    ) -> Result<Result<Arc<Tile>, Frame<'f, 's>>, Stop> {
        self.cancel.check()?;
        let owner = field.owner().unwrap_or(key);
        let whole = TileKey { field: key, grid: grid.id(), at: (x.index, y.index) };
        let memory: &MemoryCache = &self.caches.memory;
        let part = self.reached(|reach| reach.part(&whole, (x, y), window));
        if let Some(tile) = part.and_then(|_| memory.tiles.get(&whole)) {
            self.ledger.add(owner, Work { memory: 1, ..Work::default() });
            return Ok(Ok(tile));
        }
        let at = part.map_or(whole, |(at, _)| at);
        let guard = match memory.tiles.get_value_or_guard(&at, None) {
            GuardResult::Value(tile) => {
                self.ledger.add(owner, Work { memory: 1, ..Work::default() });
                return Ok(Ok(tile));
            }
            GuardResult::Guard(guard) => Some(guard),
            GuardResult::Timeout => None,
        };
        let window = part.map_or(Piece::window(x, y), |(_, window)| window);
        if let Some(tile) = self.stored_tile(&whole, field, &grid, Piece::window(x, y)) {
            self.ledger.add(owner, Work { disk: 1, ..Work::default() });
            let tile = Arc::new(tile);
            if let Some(guard) = guard {
                let _ = guard.insert(tile.clone());
            }
            return Ok(Ok(tile));
        }
        let mut halos = self.shared_with_neighbors(&whole, (x, y));
        let found = self.taken(&mut halos, field, &grid, window);
        let keep = Keep { at, guard, stored: part.is_none(), halos };
        match found {
            Some((tile, rest)) if rest.is_empty() => {
                self.ledger.add(owner, Work { disk: 1, ..Work::default() });
                let tile = Arc::new(tile);
                keep.guard.into_iter().for_each(|guard| drop(guard.insert(tile.clone())));
                Ok(Ok(tile))
            }
            Some((out, rest)) => {
                let pieces = Some(Pieces { windows: vec![rest], done: 0, out });
                let (read, keep, wanted, tiles) = (Read::new(field, &grid, window), Some(keep), Vec::new(), Vec::new());
                let fill = Fill { read, owner, keep, counts: true, wanted, tiles, narrowed: true, pieces };
                Ok(Err(Frame::Fill(Box::new(fill))))
            }
            None => self.fill(Read::new(field, &grid, window), owner, Some(keep), true).map(Err),
        }
    }

    fn fill<'f, 's>(
        &'s self,
        read: Read<'f>,
        owner: Key,
        keep: Option<Keep<'s>>,
        counts: bool,
    ) -> Result<Frame<'f, 's>, Stop> {
        self.cancel.check()?;
        let wanted = self.of_owner(Some(owner), || Ok(read.field.source().inputs(&read.grid, read.window)))?;
        let tiles = Vec::with_capacity(wanted.len());
        let (narrowed, pieces) = (false, None);
        Ok(Frame::Fill(Box::new(Fill { read, owner, keep, counts, wanted, tiles, narrowed, pieces })))
    }

    /// The bytes that may be kept in tiles.
    pub fn tile_bytes(&self) -> u64 {
        self.caches.memory.tiles.capacity()
    }
}

impl<'f> Join<'f> {
    fn step(&mut self, made: Option<Arc<Tile>>) -> Step<'f> {
        if let (Some(tile), Some((x, y))) = (made, self.blocks.get(self.next)) {
            let (grid, window, field) = (self.grid, self.window, self.field);
            let out = self.out.get_or_insert_with(|| Tile::unset(grid, window, field.channels()));
            out.copy_from(&tile, x.shift, y.shift);
            self.next += 1;
        }
        match self.blocks.get(self.next) {
            Some((x, y)) => {
                let piece = Piece::window(x, y);
                let wanted = Window { x: self.window.x - x.shift, y: self.window.y - y.shift, ..self.window };
                let read = Read::new(self.field, &self.grid, piece.intersection(&wanted));
                Step::Want(Want { read, owner: self.key, how: How::Tile(x, y) })
            }
            None => {
                let out = self.out.take().unwrap_or_else(|| Tile::new(self.grid, self.window, self.field.channels()));
                Step::Done(Arc::new(out))
            }
        }
    }
}

impl<'f> Fill<'f, '_> {
    fn step(&mut self, run: &Run<'_>, made: Option<Arc<Tile>>) -> Result<Step<'f>, Stop> {
        match &mut self.pieces {
            Some(pieces) => {
                if let Some(tile) = made {
                    pieces.out.copy_from(&tile, 0, 0);
                    pieces.done += 1;
                }
            }
            None => self.tiles.extend(made),
        }
        if let Some(want) = self.next(run)? {
            return Ok(Step::Want(want));
        }
        let Read { field, grid, window } = self.read;
        let keeper = &run.caches.keeper;
        let (mut own, mut pixels) = (Duration::ZERO, 0);
        let (tile, debt) = match self.pieces.take() {
            Some(pieces) => (pieces.out, keeper.owed(field, &grid, window)),
            None => {
                let start = ThreadTime::now();
                let mut tile = field.blank(grid, window);
                run.of_owner(Some(self.owner), || self.with_given(run, |given| field.source().fill(given, &mut tile)))?;
                own = start.elapsed();
                run.meter.tile(own);
                pixels = window.len() as u64;
                (tile, keeper.filled(field, &grid, window, own))
            }
        };
        let computed = u64::from(self.counts);
        if field.as_constant().is_none() {
            run.ledger.add(self.owner, Work { time: own, computed, pixels, ..Work::default() });
        }
        let tile = Arc::new(tile);
        if let Some(Keep { at, guard, stored, halos }) = self.keep.take() {
            if let Some(guard) = guard {
                let _ = guard.insert(tile.clone());
            }
            // Those who wait for the tile have it now.
            if stored {
                run.keep_tile(&at, field, &tile, debt);
            }
            run.leave(&halos, &tile);
        }
        Ok(Step::Done(tile))
    }

    fn with_given<T>(&self, run: &Run<'_>, work: impl FnOnce(&Given<'_>) -> T) -> T {
        let prepared = run.prepared(self.read.field, &self.read.grid);
        let (stopped, warn) = (|| run.cancel.is_cancelled(), |problem| run.warned(self.owner, problem));
        work(&Given::new(&self.tiles, prepared.as_deref(), &stopped).warning(&warn))
    }

    /// What must be there before the tile can be filled: the inputs, and then what follows from them.
    fn next(&mut self, run: &Run<'_>) -> Result<Option<Want<'f>>, Stop> {
        let Read { field, grid, window } = self.read;
        if self.tiles.len() == self.wanted.len() && !self.narrowed {
            self.narrowed = true;
            let later = run.of_owner(Some(self.owner), || Ok(field.source().later(&grid, window)))?;
            if !later.is_empty() {
                let narrow = || Ok(self.with_given(run, |given| field.source().narrow(given, &grid, window)));
                let narrow = run.of_owner(Some(self.owner), narrow)?;
                let within =
                    later.len() == narrow.len() && later.iter().zip(&narrow).all(|(l, n)| l.window.contains(n));
                if !within {
                    let problem = Problem::new(Code::BadValue, "a field reads more than it states");
                    let problem = problem.help("this is a defect of the node");
                    run.failed(self.owner, &problem);
                    return Err(problem.into());
                }
                let most = narrow.iter().map(Window::len).sum::<usize>();
                if most > MOST_PIXELS && window.len() > 1 {
                    run.cancel.check()?;
                    self.pieces = Some(Pieces {
                        windows: window.halves().to_vec(),
                        done: 0,
                        out: Tile::unset(grid, window, field.channels()),
                    });
                }
                self.wanted.extend(later.iter().zip(narrow).map(|(read, window)| Read { window, ..*read }));
            }
        }
        if let Some(pieces) = &self.pieces {
            let part = pieces.windows.get(pieces.done).map(|window| Read::new(field, &grid, *window));
            return Ok(part.map(|read| Want { read, owner: self.owner, how: How::Bare }));
        }
        let Some(read) = self.wanted.get(self.tiles.len()) else { return Ok(None) };
        run.check_window(field, window, read).inspect_err(|problem| run.failed(self.owner, problem))?;
        Ok(Some(Want { read: *read, owner: self.owner, how: How::Best }))
    }
}
