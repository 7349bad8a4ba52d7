//! [`DetectLattice`]: the two vectors by which a near-regular exemplar repeats.
//!
//! Beyond the source: from the correlation of the exemplar with itself, refined to fractions of a pixel. A lattice in
//! the sense of crystallography: all sums of whole multiples of two vectors. It is not the lattice of springs of the
//! leather nodes. Cost: O(pixels · log pixels).
use super::analysis::find_lattice;
use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Exemplar, ExemplarLattice, Stop, Type};

/// Source of the vectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Lattice {
    /// They are found in the exemplar, if it is near-regular.
    #[default]
    Auto,
    /// There are no vectors.
    Off,
    /// These two vectors, in exemplar pixels.
    Given(Xy, Xy),
}

/// Finds the two vectors by which brickwork, cloth or tiles repeat, so that synthesis stays in phase with them.
///
/// `Synthesize` does this automatically. Use this node to switch it off, to state the vectors, or to look at them with
/// `shibo dump`.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0),
/// "exemplar": Exemplar(input: "cells.border", size: (96, 96)),
/// "regular": DetectLattice(exemplar: "exemplar"),
/// "coords": Synthesize(exemplar: "regular", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "cells.border"),
/// ```
#[node]
pub struct DetectLattice {
    /// The exemplar.
    pub exemplar: In<Exemplar>,
    /// Source of the vectors.
    pub vectors: Lattice,
}

impl Node for DetectLattice {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] =
        &[Output::new("exemplar", Type::Exemplar, "The exemplar; its dump tells the vectors and their strength.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let Lattice::Given(a, b) = self.vectors else { return Vec::new() };
        if (a.x * b.y - a.y * b.x).abs() >= 1.0 {
            return Vec::new();
        }
        let message = "the two vectors must span a cell of at least a pixel; these lie in one line";
        vec![Problem::new(Code::BadValue, message).at("vectors")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let exemplar = cx.get(&self.exemplar)?;
        let lattice = match self.vectors {
            Lattice::Auto => find_lattice(&exemplar),
            Lattice::Off => ExemplarLattice { vectors: None, strength: 0.0 },
            Lattice::Given(a, b) => {
                let vectors = Some([DVec2::new(a.x, a.y), DVec2::new(b.x, b.y)]);
                ExemplarLattice { vectors, strength: 1.0 }
            }
        };
        cx.check()?;
        Ok(Outputs::one(Exemplar { lattice: Some(lattice), ..Exemplar::clone(&exemplar) }))
    }
}
