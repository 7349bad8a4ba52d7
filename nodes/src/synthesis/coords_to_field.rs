//! [`CoordsToField`]: synthesised coordinates as a picture, for files and other programs.
//!
//! Source: JP5149288B2 II, box 260 (row C12): coordinates are the result of synthesis. Cost: O(pixels).
use glam::DVec2;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Stop, Tiling, Type};

/// Unit of a coordinate.
#[choice]
pub enum CoordUnit {
    /// Pixels of the exemplar, from its upper left corner; the centre of pixel `i` is at `i + ½`.
    #[default]
    Pixels,
    /// Shares of the exemplar, 0 to 1, from its upper left corner; other programs call this a UV or ST map.
    Share,
}

/// Synthesised coordinates as a field of vectors, for other nodes and for files with another unit.
///
/// An output of a graph may also be the coordinates themselves, without this node: they are written in pixels, as EXR
/// with the channels `X` and `Y` and the size of their exemplar. `CoordsFromField` reads the file. Render at as many
/// pixels as the coordinates have. Pixels are exact in half floats up to exemplars of 1024 pixels.
///
/// Elsewhere: an *STMap* in compositing, with `unit: Share`.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "exemplar": Exemplar(input: "cells.border", size: (64, 64)),
/// "coords": Synthesize(exemplar: "exemplar", size: (128, 128)),
/// "example": CoordsToField(coords: "coords", unit: Share),
/// ```
#[node]
pub struct CoordsToField {
    /// The coordinates, in the plane.
    pub coords: In<CoordMap>,
    /// Unit of the coordinates.
    pub unit: CoordUnit,
}

impl Node for CoordsToField {
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] = &[Output::new("field", Type::Vec2, "The coordinates.")];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let map = cx.get(&self.coords)?;
        if map.surface.is_some() {
            let problem = Problem::new(Code::BadValue, "`coords` lie on a surface, not in the plane").at("coords");
            return Err(problem.help("connect the coordinates of `Synthesize`").into());
        }
        let scale = match (self.unit, map.exemplar) {
            (CoordUnit::Pixels, _) => DVec2::ONE,
            (CoordUnit::Share, Some(frame)) => 1.0 / frame.size.as_dvec2(),
            (CoordUnit::Share, None) => {
                let message = "the coordinates never met an exemplar, so it is not known what they are a share of";
                let help = "use `unit: Pixels`, or coordinates of `Synthesize` or `CorrectCoords`";
                return Err(Problem::new(Code::BadValue, message).at("unit").help(help).into());
            }
        };
        Ok(Outputs::one(map.to_field(scale)))
    }
}
