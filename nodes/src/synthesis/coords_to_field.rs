//! [`CoordsToField`]: synthesised coordinates as a picture, for files and other programs.
//!
//! Source: JP5149288B2 II, box 260 (row C12): the coordinates are the result. Cost: O(pixels).
use glam::{DVec2, IVec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs};
use shibo_engine::value::{CoordMap, Field, Stop, Tile, Tiling, Type};
use shibo_kernel::ground::number::narrow;
use std::sync::Arc;

/// What a coordinate is measured in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CoordUnit {
    /// Pixels of the exemplar, from its upper left corner; the centre of pixel `i` is at `i + ½`.
    #[default]
    Pixels,
    /// Shares of the exemplar, 0 to 1, from its upper left corner: what other programs call a UV or ST map.
    Share,
}

/// Synthesised coordinates as a field of vectors, to write them to a file.
///
/// Render it at as many pixels as the coordinates have, as EXR, whose channels `X` and `Y` they become; `CoordsFromField`
/// reads them again. Pixels are exact in half floats up to exemplars of 1024 pixels.
///
/// Elsewhere: an *STMap* in compositing, with `unit: Share`.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "exemplar": Exemplar(input: "cells.border", size: (64, 64)),
/// "coords": Synthesize(exemplar: "exemplar", size: (128, 128)),
/// "example": CoordsToField(coords: "coords", unit: Share),
/// ```
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CoordsToField {
    /// The coordinates, of the plane.
    pub coords: In<CoordMap>,
    /// What a coordinate is measured in.
    pub unit: CoordUnit,
}

/// The coordinates at the centre of every pixel of a tile: those of the map's pixel there, gone on from its centre.
fn fill(map: &CoordMap, scale: DVec2, out: &mut Tile) {
    let (grid, window, n) = (out.grid, out.window, out.window.len());
    let (size, spacing) = (map.size.as_ivec2(), f64::from(map.spacing));
    let bring = |k: i32, n: i32, repeats: bool| if repeats { k.rem_euclid(n) } else { k.clamp(0, n - 1) };
    for p in 0..n {
        let step = IVec2::new(
            i32::try_from(p % window.width as usize).unwrap_or(0),
            i32::try_from(p / window.width as usize).unwrap_or(0),
        );
        let place = grid.center(window.x + step.x, window.y + step.y) / map.pitch;
        let cell = (place + 1e-6).floor();
        let rest = (place - cell - 0.5) * spacing;
        let at = cell.as_ivec2() - map.start;
        let (x, y) = (bring(at.x, size.x, map.periodic.x), bring(at.y, size.y, map.periodic.y));
        let index = usize::try_from(y * size.x + x).unwrap_or(0);
        let [u, v] = map.coords.get(index).copied().unwrap_or([0.0; 2]);
        // At the map's own pixels nothing is added, not even an error of rounding.
        let near = rest.abs().max_element() < 1e-4;
        let rest = if near { DVec2::ZERO } else { rest };
        out.data_mut()[p] = narrow((f64::from(u) + rest.x) * scale.x);
        out.data_mut()[n + p] = narrow((f64::from(v) + rest.y) * scale.y);
    }
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
        let (tiling, map) = (map.periodic, Arc::clone(&map));
        let field = Field::generate(Type::Vec2, tiling, move |out, _| {
            fill(&map, scale, out);
            Ok(())
        });
        Ok(Outputs::one(field))
    }
}
