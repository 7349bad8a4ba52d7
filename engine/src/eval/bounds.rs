//! Bounds the demand of a picture: sums all windows that fields request before anything is computed or allocated.
//!
//! A parameter in its range may make a field read millions of pixels for each of its own: a blur on an enlarged part of
//! the canvas, a path around a point far away. The check then reports that field, and nothing is started. Windows that
//! depend on values are unknown until the values are computed. If large, such windows are computed in parts (`tiles`);
//! here they count as if nothing were displaced.
use super::demand::{At, Fields, at};
use super::lock;
use super::run::Run;
use crate::diagnostics::{Code, Problem};
use crate::value::{Blocks, Field, Grid, Key, Piece, Read, Stop, Window};
use std::collections::HashMap;

/// A field may be computed on at most this many times the pixels of the picture.
const TIMES: u64 = 16;
/// Any field may be computed on this many pixels, even for a small picture.
const ALWAYS: u64 = 1 << 26;
/// A window may always take this many bytes, even if less memory is allowed.
const BYTES: u64 = 1 << 28;
/// A field read in more windows than this is not checked.
const MANY: usize = 64;

/// The windows of one field on one grid that its readers request.
struct Wanted {
    /// Windows with little overlap; empty if there are too many to check.
    windows: Vec<Window>,
    /// The result that the work is charged to.
    owner: Option<Key>,
}

impl Wanted {
    /// Adds a window, merged with those it overlaps.
    fn add(&mut self, mut window: Window) {
        // Merge two windows if their union has no more pixels than both together.
        while let Some(place) =
            self.windows.iter().position(|other| other.union(&window).len() <= other.len() + window.len())
        {
            window = self.windows.swap_remove(place).union(&window);
        }
        self.windows.push(window);
    }

    fn pixels(&self) -> u64 {
        self.windows.iter().map(|window| window.len() as u64).sum()
    }
}

/// The error for a field that reads too far: the field needs `read` of an input for its own `window`.
fn too_far(field: &Field, window: Window, read: Window) -> Problem {
    let message = format!(
        "{} × {} pixels of an input are needed for {} × {} pixels of the result",
        read.width, read.height, window.width, window.height
    );
    let problem = Problem::new(Code::TooLarge, message);
    match field.source().reaches_by() {
        Some(parameter) => {
            let help = format!("choose `{parameter}` so that less is read, or show a larger part of the result");
            problem.at(parameter).help(help)
        }
        // No parameter to blame: report the node itself.
        None => problem.at("").help("show a larger part of the result, or lower the resolution"),
    }
}

impl Run<'_> {
    /// Checks a window that a field requests in one piece.
    ///
    /// # Errors
    /// [`Code::TooLarge`] at the parameter of `field` that makes the window so large.
    pub(super) fn check_window(&self, field: &Field, window: Window, read: &Read<'_>) -> Result<(), Problem> {
        let bytes = (read.window.len() as u64).saturating_mul(4 * read.field.channels() as u64);
        if bytes <= self.memory.max(BYTES) { Ok(()) } else { Err(too_far(field, window, read.window)) }
    }

    /// Checks the demand of `window` of a picture of `field` on all fields, unless this was done before.
    ///
    /// # Errors
    /// [`Code::TooLarge`] at the node that reads too far.
    pub(super) fn check_bounds(&self, field: &Field, grid: &Grid, window: Window) -> Result<(), Stop> {
        // Most windows are parts of one picture, so check the whole picture once.
        let picture = grid.picture().map_or(window, Window::full);
        let window = if picture.contains(&window) { picture } else { window };
        let place = at(field, grid);
        if lock(&self.bounded).get(&place).is_some_and(|(_, before)| before.contains(&window)) {
            return Ok(());
        }
        self.add_up(field, grid, window).map_err(|refused| {
            let (owner, problem) = *refused;
            if let Some(owner) = owner {
                self.failed(owner, &problem);
            }
            Stop::from(problem)
        })?;
        lock(&self.bounded).insert(place, (field.clone(), window));
        Ok(())
    }

    fn add_up(&self, field: &Field, grid: &Grid, window: Window) -> Result<(), Box<(Option<Key>, Problem)>> {
        let most = (TIMES * window.len() as u64).max(ALWAYS);
        let mut wanted: HashMap<At, Wanted> = HashMap::new();
        wanted.insert(at(field, grid), Wanted { windows: vec![window], owner: None });
        for (reader, grid) in Fields::new(&[field], grid).order {
            let Some(Wanted { windows, owner }) = wanted.remove(&at(reader, &grid)) else { continue };
            let owner = reader.owner().or(reader.key()).or(owner);
            for window in windows.into_iter().filter(|_| reader.as_constant().is_none()) {
                let source = reader.source();
                let later = source.later(&grid, window).into_iter().map(|read| {
                    let window = if read.grid == grid { window } else { Window { width: 1, height: 1, ..read.window } };
                    Read { window, ..read }
                });
                for read in source.inputs(&grid, window).into_iter().chain(later) {
                    let part = read.field.domain().one_repeat(&read.grid, read.window);
                    if part.is_empty() || read.field.as_constant().is_some() {
                        continue;
                    }
                    if part.len() as u64 > most {
                        return Err(Box::new((owner, too_far(reader, window, part))));
                    }
                    let blocks = read.field.domain().blocks(&read.grid, part);
                    let place = at(read.field, &read.grid);
                    let known = wanted.entry(place).or_insert_with(|| Wanted { windows: Vec::new(), owner });
                    parts(&blocks, part).for_each(|part| known.add(part));
                    if known.windows.len() > MANY {
                        known.windows.clear();
                    } else if known.pixels() > most {
                        return Err(Box::new((owner, too_far(reader, window, part))));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Moves a window to the pixels that are computed for it. A window across the edge of a repeating picture gives several
/// parts.
fn parts(blocks: &Blocks, window: Window) -> impl Iterator<Item = Window> {
    let columns = spans(&blocks.columns, window.x, window.right());
    let rows = spans(&blocks.rows, window.y, window.bottom());
    rows.into_iter().flat_map(move |(y, bottom)| {
        let part =
            move |&(x, right): &(i32, i32)| Window { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) };
        columns.iter().map(part).collect::<Vec<_>>()
    })
}

/// The spans of `pieces` between `from` and `to`, shifted to the place where they are computed.
fn spans(pieces: &[Piece], from: i32, to: i32) -> Vec<(i32, i32)> {
    let mut spans: Vec<(i32, i32)> = Vec::new();
    for piece in pieces {
        let span = (piece.from().max(from) - piece.shift, piece.to().min(to) - piece.shift);
        match spans.last_mut().filter(|before| before.1 == span.0) {
            Some(before) => before.1 = span.1,
            None => spans.push(span),
        }
    }
    spans
}
