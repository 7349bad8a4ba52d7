//! Surfaces of coordinates that were synthesised on an atlas.
use super::{Atlas, IndirectionLevel, Number};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Pixels of an atlas for which coordinates were computed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// The atlas.
    pub atlas: Arc<Atlas>,
    /// Columns and rows of the finest level; these pixels may belong to a coarser level.
    pub finest: [u32; 2],
    /// The owners of the pixels, and their neighbours across borders.
    pub level: IndirectionLevel,
    /// The derivatives of the coordinates at each pixel, in exemplar pixels per pixel: J00 J01 J10 J11.
    pub jacobians: Vec<[f32; 4]>,
    /// The visibility of chart borders.
    pub seam: Option<Seam>,
}

/// Differences across chart borders, relative to those inside charts: 1 means that borders are invisible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seam {
    /// Number of compared pairs of pixels across borders.
    pub pairs: u32,
    /// Mean difference of colours per mm across borders, divided by that inside.
    pub mean: f32,
    /// The 99th percentile of the difference, divided by that inside.
    pub p99: f32,
    /// Fraction of pairs that are not continuous in the exemplar, divided by that inside.
    pub torn: f32,
}

/// The data of a [`Seam`] for output.
#[derive(Serialize)]
pub(super) struct SeamData {
    pairs: u32,
    mean: Number,
    p99: Number,
    torn: Number,
}

impl From<Seam> for SeamData {
    fn from(seam: Seam) -> Self {
        Self { pairs: seam.pairs, mean: Number(seam.mean), p99: Number(seam.p99), torn: Number(seam.torn) }
    }
}

impl Surface {
    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.level.bytes() + size_of_val(&*self.jacobians)
    }
}
