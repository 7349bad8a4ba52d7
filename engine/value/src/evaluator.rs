//! The interface of the engine for the code of nodes.
use super::{Cuts, Field, Grid, Key, Stop, Tile, Window};
use crate::diagnostics::Problem;

/// Services of the engine outside of tiles, such as whole pictures, computed on all threads.
pub trait Evaluator: Sync {
    /// The values of `field` in `window` of `grid`.
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop>;

    /// Fails if the work was cancelled. Call it about every millisecond.
    fn check(&self) -> Result<(), Stop>;

    /// Reports the progress of the node.
    fn progress(&self, done: u64, total: u64);

    /// Memory in bytes that a node may use for its computation.
    fn memory(&self) -> u64;

    /// The key of the main output of the node that is being evaluated.
    fn key(&self) -> Option<Key> {
        None
    }

    /// The cache of cuts through solids, so that nodes with equal cuts share the work.
    fn cuts(&self) -> Option<&Cuts> {
        None
    }

    /// Reports a warning; the node continues.
    fn warn(&self, problem: Problem);
}
