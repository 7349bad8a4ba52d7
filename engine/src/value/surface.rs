//! Surfaces under coordinates that were synthesised on an atlas.
use super::{Atlas, IndirectionLevel, Number};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The pixels of an atlas on which coordinates were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// The atlas.
    pub atlas: Arc<Atlas>,
    /// Columns and rows of the finest level, of which these pixels may be a coarser one.
    pub finest: [u32; 2],
    /// Who owns the pixels, and what lies beside them across borders.
    pub level: IndirectionLevel,
    /// For each pixel how coordinates change, in exemplar pixels per pixel: J00 J01 J10 J11.
    pub jacobians: Vec<[f32; 4]>,
    /// How borders of charts compare with the inside.
    pub seam: Option<Seam>,
}

/// How steps across borders of charts compare with those inside: 1 where nothing is to be seen of the borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seam {
    /// How many pairs of pixels across borders were compared.
    pub pairs: u32,
    /// The mean difference of colours per mm across borders, over that inside.
    pub mean: f32,
    /// The difference that 99 of 100 pairs do not exceed, over that inside.
    pub p99: f32,
    /// The share of pairs that do not continue in the exemplar, over that inside.
    pub torn: f32,
}

/// A [`Seam`] as others read it.
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
