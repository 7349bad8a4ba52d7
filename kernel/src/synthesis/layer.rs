//! The working state of a level.
use super::coverage::Factors;
use super::phase::Phase;
use super::region::{Planned, Region};

/// The working state of a level. Along axes that do not wrap, pixels that later steps do not read are dropped: with
/// each step, the margin around the wanted pixels shrinks.
pub(super) struct Layer {
    /// The pixels still held.
    pub(super) region: Region,
    /// The pixels of the result.
    wanted: Region,
    /// Margin around `wanted` that the remaining steps read, in pixels.
    left: i32,
    /// For each pixel, the table index of the exemplar pixel that it shows.
    pub(super) map: Vec<u32>,
    /// Target guide values; empty for none.
    pub(super) guide: Vec<f32>,
    /// Pixels that must not change; empty for none.
    pub(super) fixed: Vec<bool>,
    /// Target lattice phase of each pixel; empty if no phase is kept.
    pub(super) phases: Vec<Phase>,
    /// Factors for even use.
    pub(super) factors: Option<Factors>,
}

impl Layer {
    /// Starts with all pixels of a level; the steps to come read up to `reach` pixels around the wanted ones.
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

    /// Drops the pixels that are not read any more. Returns the previous region, for cropping other arrays.
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

    /// Records a finished step that read up to `reach` pixels away.
    pub(super) fn spend(&mut self, reach: i32) {
        self.left -= reach;
    }

    /// Returns the map of the wanted pixels.
    pub(super) fn result(mut self) -> Vec<u32> {
        self.region.keep(&self.wanted, &mut self.map);
        self.map
    }
}
