//! Code of fields: the reads that it declares, and the tiles that it gets.
use super::{Field, Grid, Listener, Stop, Tile, Window};
use crate::diagnostics::Problem;
use std::any::Any;
use std::sync::Arc;

/// The caching policy for a field's tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Recomputing is cheaper than storing, unless several nodes read it.
    Pointwise,
    /// Stored, because computing costs more than a copy.
    Local,
}

/// A read of a field by another field.
#[derive(Clone, Copy, Debug)]
pub struct Read<'f> {
    /// The field that is read.
    pub field: &'f Field,
    /// The grid.
    pub grid: Grid,
    /// Pixels of that grid.
    pub window: Window,
}

impl<'f> Read<'f> {
    /// `window` of `field` on `grid`.
    pub const fn new(field: &'f Field, grid: &Grid, window: Window) -> Self {
        Self { field, grid: *grid, window }
    }
}

/// The data that a field's code gets to fill a tile: only the tiles that it declared.
pub struct Given<'a> {
    tiles: &'a [Arc<Tile>],
    prepared: Option<&'a Tile>,
    stopped: &'a dyn Fn() -> bool,
    warn: Option<&'a dyn Fn(Problem)>,
}

impl<'a> Given<'a> {
    /// Takes the tiles of [`FieldSource::inputs`], then those of [`FieldSource::later`]; the result of
    /// [`FieldSource::prepare`]; and a function that tells whether the work was cancelled.
    pub fn new(tiles: &'a [Arc<Tile>], prepared: Option<&'a Tile>, stopped: &'a dyn Fn() -> bool) -> Self {
        Self { tiles, prepared, stopped, warn: None }
    }

    /// Sets the function that takes warnings.
    #[must_use]
    pub fn warning(self, warn: &'a dyn Fn(Problem)) -> Self {
        Self { warn: Some(warn), ..self }
    }

    /// Reports a warning about the values. Of all reports of a field, one counts: the first in the order of the places
    /// ([`Problem::at_mm`]), row by row. Code that names a place must name the first one of the tile.
    pub fn warn(&self, problem: Problem) {
        if let Some(warn) = self.warn {
            warn(problem);
        }
    }

    /// The receiver of warnings, for code that this field calls.
    pub fn listener(&self) -> Option<Listener<'a>> {
        self.warn.map(Listener)
    }

    /// The tile of the declared read with this index.
    pub fn tile(&self, number: usize) -> &'a Tile {
        &self.tiles[number]
    }

    /// All tiles, in the order of the declared reads.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &'a Tile> {
        self.tiles.iter().map(|tile| &**tile)
    }

    /// The result of [`FieldSource::prepare`] on this grid.
    pub const fn prepared(&self) -> Option<&'a Tile> {
        self.prepared
    }

    /// Fails if the work was cancelled. Call it about every millisecond.
    ///
    /// # Errors
    /// [`Stop::Cancelled`].
    pub fn check(&self) -> Result<(), Stop> {
        if (self.stopped)() { Err(Stop::Cancelled) } else { Ok(()) }
    }
}

/// The pictures for [`FieldSource::prepare`]: windows of the reads that [`FieldSource::whole`] declares.
pub trait Pictures: Sync {
    /// The window of the picture with this index, computed on all threads.
    ///
    /// # Errors
    /// Errors of the code of the fields.
    fn read(&self, number: usize, window: Window) -> Result<Tile, Stop>;

    /// Fails if the work was cancelled. Call it about every millisecond.
    ///
    /// # Errors
    /// [`Stop::Cancelled`].
    fn check(&self) -> Result<(), Stop>;
}

/// Code of a field.
///
/// It declares its reads, and the engine passes it only these. The engine uses the declarations to read ahead, to free
/// memory early and to compute a tile on another machine. On one grid, the declared fields and grids must be the same
/// for every window, and a part of a window must not need more than the whole.
pub trait FieldSource: Send + Sync {
    /// The reads of [`fill`](Self::fill) for `window` of `grid`.
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>>;

    /// Additional reads whose windows depend on the values of the [`inputs`](Self::inputs). The windows must contain
    /// everything that may be read.
    fn later(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    /// The actual windows of the reads of [`later`](Self::later), computed from the tiles of the inputs. Each must lie
    /// within the declared window, which is the default.
    fn narrow(&self, _given: &Given<'_>, grid: &Grid, window: Window) -> Vec<Window> {
        self.later(grid, window).iter().map(|read| read.window).collect()
    }

    /// Computes every value of `out`, for its window and grid. Runs on one thread.
    ///
    /// # Errors
    /// When values cannot be computed, or the work was cancelled.
    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop>;

    /// The parameter that determines the reach of its reads, for error messages.
    fn reaches_by(&self) -> Option<&'static str> {
        None
    }

    /// The caching policy for its tiles.
    fn cost(&self) -> Cost {
        Cost::Local
    }

    /// The pictures that [`prepare`](Self::prepare) reads for `grid`, whole or by windows in any order.
    fn whole(&self, _grid: &Grid) -> Vec<Read<'_>> {
        Vec::new()
    }

    /// Computes data from whole pictures for [`fill`](Self::fill), once per grid and before any tile.
    ///
    /// # Errors
    /// When values cannot be computed, or the work was cancelled.
    fn prepare(&self, _grid: &Grid, _pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        Ok(None)
    }

    /// The peak memory of [`prepare`](Self::prepare) in bytes.
    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        0
    }

    /// Its memory in bytes, without the objects that it shares.
    fn bytes(&self) -> usize {
        0
    }

    /// The code itself, for a reader that can compute the values together with its own. Only code that names the type can
    /// read it.
    fn for_reader(&self) -> Option<&dyn Any> {
        None
    }
}
