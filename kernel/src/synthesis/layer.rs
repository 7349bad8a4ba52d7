//! The pixels of a level while it is worked on.
use super::coverage::Factors;
use super::phase::Phase;
use super::region::{Planned, Region};

/// The pixels of a level while it is worked on. Where sides do not join, those that are no longer read are left behind: the
/// further a level is, the fewer pixels around those that are wanted still matter.
pub(super) struct Layer {
    /// The pixels.
    pub(super) region: Region,
    /// What is read of the result.
    wanted: Region,
    /// How many pixels around those wanted what is still to be done reads.
    left: i32,
    /// The index of every pixel in the tables of what it shows.
    pub(super) map: Vec<u32>,
    /// Wanted guide values; empty for none.
    pub(super) guide: Vec<f32>,
    /// Pixels that stay as they are; empty for none.
    pub(super) fixed: Vec<bool>,
    /// Where in a cell of the lattice what is shown should lie; empty where nothing is kept in step.
    pub(super) phases: Vec<Phase>,
    /// Factors for even use.
    pub(super) factors: Option<Factors>,
}

impl Layer {
    /// All pixels of a level, of which those up to `reach` around the wanted ones are read.
    pub(super) fn new(planned: &Planned, reach: i32, map: Vec<u32>, guide: Vec<f32>, fixed: Vec<bool>) -> Self {
        Self {
            region: planned.region,
            wanted: planned.wanted,
            left: reach,
            map,
            guide,
            fixed,
            phases: Vec::new(),
            factors: None,
        }
    }

    /// Leaves pixels behind that are not read any more; returns the region that was before, for what else is kept of them.
    pub(super) fn trim(&mut self) -> Region {
        let before = self.region;
        let part = before.around(&self.wanted, self.left);
        before.keep(&part, &mut self.map);
        before.keep(&part, &mut self.guide);
        before.keep(&part, &mut self.fixed);
        before.keep(&part, &mut self.phases);
        if let Some(factors) = self.factors.as_mut().filter(|_| part != before) {
            factors.keep(&before, &part);
        }
        self.region = part;
        before
    }

    /// Something was done that read so many pixels away.
    pub(super) fn spend(&mut self, reach: i32) {
        self.left -= reach;
    }

    /// What is wanted of the level.
    pub(super) fn result(mut self) -> Vec<u32> {
        self.region.keep(&self.wanted, &mut self.map);
        self.map
    }
}
