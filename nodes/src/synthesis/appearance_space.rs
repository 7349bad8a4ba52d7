//! [`AppearanceSpace`]: pixels described by their surroundings.
//!
//! Beyond the source (JP5149288B2 compares colours): appearance vectors of 5×5 colours under a Gaussian, reduced to 8
//! numbers by principal components; neighbourhoods of 24 at coarse levels and 4 at fine ones. Cost: O(pixels · levels).
use super::analysis::levels_of;
use shibo_kernel::synthesis::analysis::AnalysisSpec;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Exemplar, Neighborhood, Stop, Type};
use std::sync::Arc;

/// Describes every pixel of an exemplar by its surroundings, which keeps features whole better than colours alone.
///
/// `Synthesize` does this automatically with these defaults; use this node to choose other values, or to share the
/// work.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "exemplar": Exemplar(input: "cells.border", size: (64, 64)),
/// "described": AppearanceSpace(exemplar: "exemplar", coarse: Square5),
/// "coords": Synthesize(exemplar: "described", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "cells.border"),
/// ```
#[node]
pub struct AppearanceSpace {
    /// The exemplar.
    pub exemplar: In<Exemplar>,
    /// Neighbours that are compared at coarse levels.
    #[default(Neighborhood::Square5)]
    pub coarse: Neighborhood,
    /// Neighbours that are compared at fine levels.
    #[default(Neighborhood::Diagonal4)]
    pub fine: Neighborhood,
    /// A level counts as coarse if the spacing of its pixels is at least this, in pixels of the finest level.
    #[schemars(range(min = 1, max = 512))]
    #[default(4)]
    pub switch: u32,
    /// Number of values that describe a pixel.
    #[schemars(range(min = 1, max = 8))]
    #[default(8)]
    pub dimensions: u32,
}

impl Node for AppearanceSpace {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] = &[Output::new("exemplar", Type::Exemplar, "The exemplar, its levels analysed.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let exemplar = cx.get(&self.exemplar)?;
        let spec = AnalysisSpec {
            coarse: self.coarse,
            fine: self.fine,
            switch: self.switch as usize,
            dims: self.dimensions as usize,
        };
        let levels = levels_of(&exemplar, &spec, &|| cx.check().is_err());
        cx.check()?;
        Ok(Outputs::one(Exemplar { levels: Arc::new(levels), ..Exemplar::clone(&exemplar) }))
    }
}
