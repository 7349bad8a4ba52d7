//! The engine as the code of nodes sees it.
use super::{Cuts, Field, Grid, Key, Stop, Tile, Window};
use crate::diagnostics::Problem;

/// What a node's code may ask of the engine outside of tiles: whole pictures, computed on all threads.
pub trait Evaluator: Sync {
    /// The values of `field` in `window` of `grid`.
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop>;

    /// Fails if the work was cancelled; call it about every millisecond.
    fn check(&self) -> Result<(), Stop>;

    /// Tells how far the node has come.
    fn progress(&self, done: u64, total: u64);

    /// How many bytes a node may take for what it computes.
    fn memory(&self) -> u64;

    /// The key of the main output of the node that is being evaluated.
    fn key(&self) -> Option<Key> {
        None
    }

    /// Where cuts through solids are remembered, so that nodes that cut alike share the work.
    fn cuts(&self) -> Option<&Cuts> {
        None
    }

    /// Reports something that the user should know; the node continues.
    fn warn(&self, problem: Problem);
}
