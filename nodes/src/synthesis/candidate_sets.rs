//! [`CandidateSets`]: similar pixels for every pixel of an exemplar.
//!
//! Beyond the source (k-coherence of the published work): usually k = 2, found by PatchMatch on neighbourhood vectors.
//! Cost: O(pixels · levels · log pixels).
use super::analysis::{add_alike, levels_of};
use shibo_kernel::synthesis::analysis::AnalysisSpec;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Exemplar, Stop, Type};
use std::sync::Arc;

/// Finds similar pixels for every pixel of an exemplar, so that pieces can be joined in more ways.
///
/// More than two candidates make smaller pieces with more joints, and take longer.
///
/// `Synthesize` does this automatically with these defaults; use this node to choose other values, or to share the
/// work.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "exemplar": Exemplar(input: "cells.border", size: (64, 64)),
/// "analysed": CandidateSets(exemplar: "exemplar", distance: 0.1),
/// "coords": Synthesize(exemplar: "analysed", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "cells.border"),
/// ```
#[node]
pub struct CandidateSets {
    /// The exemplar. If it is not analysed, `AppearanceSpace` is applied with its defaults.
    pub exemplar: In<Exemplar>,
    /// Candidates per pixel, the pixel itself included: with 1 no other candidates are searched.
    #[schemars(range(min = 1, max = 8))]
    #[default(2)]
    pub k: u32,
    /// Minimum distance of candidates from the pixel and from each other, as a share of the exemplar's shorter side.
    #[schemars(range(min = 0, max = 0.5))]
    #[default(0.05)]
    pub distance: f64,
}

impl Node for CandidateSets {
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] =
        &[Output::new("exemplar", Type::Exemplar, "The exemplar with what looks alike at every level.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let exemplar = cx.get(&self.exemplar)?;
        let until = || cx.check().is_err();
        let mut levels = match exemplar.levels.is_empty() {
            true => levels_of(&exemplar, &AnalysisSpec::default(), &until),
            false => exemplar.levels.to_vec(),
        };
        cx.check()?;
        add_alike(&exemplar, &mut levels, self.k as usize, self.distance, &until);
        cx.check()?;
        Ok(Outputs::one(Exemplar { levels: Arc::new(levels), ..Exemplar::clone(&exemplar) }))
    }
}
