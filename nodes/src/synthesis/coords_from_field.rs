//! [`CoordsFromField`]: coordinates from a picture, as [`CoordsToField`](super::CoordsToField) or another program wrote it.
//!
//! Source: JP5149288B2 II, claim 1 (row C2): synthesis may start from any earlier result. Cost: O(pixels).
use super::coords_to_field::CoordUnit;
use glam::{DVec2, IVec2, UVec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{Context, Fact, In, Node, Output, Outputs, Vec2Field};
use shibo_engine::value::{CoordMap, Exemplar, Grid, Stop, Type, Window};
use shibo_kernel::ground::number::narrow;
use std::sync::Arc;

/// Coordinates from a field of vectors, such as a file that was written before: to show an earlier result again, or to go on from it.
///
/// The first number is the column in the exemplar, the second the row. A file that was written from `CoordsToField` is read by
/// `MakeVector(x: "u", y: "v")`, where `u` is `Image(path: …, layer: "X", color_space: Raw)` over the whole canvas, and `v` the
/// same with `layer: "Y"`; `size` then is that of the picture.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "exemplar": Exemplar(input: "cells.border", size: (64, 64)),
/// "made": Synthesize(exemplar: "exemplar", size: (128, 128)),
/// "field": CoordsToField(coords: "made"),
/// "coords": CoordsFromField(input: "field", exemplar: "exemplar", size: (128, 128)),
/// "example": SampleExemplar(coords: "coords", input: "cells.border"),
/// ```
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CoordsFromField {
    /// The field.
    pub input: In<Vec2Field>,
    /// The exemplar that coordinates refer to.
    pub exemplar: In<Exemplar>,
    /// What a coordinate is measured in.
    pub unit: CoordUnit,
    /// Columns and rows over the canvas. By default as many as the exemplar's pixels need.
    #[schemars(extend("minimum" = 1.0, "maximum" = 16384.0))]
    pub size: Option<(u32, u32)>,
}

impl Node for CoordsFromField {
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] = &[Output::new("coords", Type::CoordMap, "The coordinates.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (field, exemplar) = (cx.get(&self.input)?, cx.get(&self.exemplar)?);
        let canvas = cx.size_mm();
        let own = || (canvas / exemplar.frame.pitch).round().clamp(DVec2::ONE, DVec2::splat(16_384.0)).as_uvec2();
        let size = self.size.map(UVec2::from).unwrap_or_else(own);
        let bytes = u64::from(size.x) * u64::from(size.y) * 24;
        if bytes > cx.evaluator.memory() {
            let message = format!("`{}x{}` coordinates take {} MiB", size.x, size.y, bytes >> 20);
            return Err(Problem::new(Code::TooLarge, message).at("size").help("set `size`, or raise --memory").into());
        }
        let pitch = canvas / size.as_dvec2();
        let grid = Grid { origin: DVec2::ZERO, step: pitch, period: Some(size) };
        let tile = cx.evaluator.raster(&field, &grid, Window::full(size))?;
        let scale = match self.unit {
            CoordUnit::Pixels => DVec2::ONE,
            CoordUnit::Share => exemplar.frame.size.as_dvec2(),
        };
        let at = |(u, v): (&f32, &f32)| [narrow(f64::from(*u) * scale.x), narrow(f64::from(*v) * scale.y)];
        let coords: Vec<[f32; 2]> = tile.plane(0).iter().zip(tile.plane(1)).map(at).collect();
        if let Some(p) = coords.iter().position(|c| !(c[0].abs() < 1e6 && c[1].abs() < 1e6)) {
            let (x, y) = (p % size.x as usize, p / size.x as usize);
            let message = format!("`input` is no coordinate at pixel ({x}, {y}): it is {:?}", coords[p]);
            let help = "coordinates must be finite, and below a million pixels";
            return Err(Problem::new(Code::NotFinite, message).at("input").help(help).into());
        }
        Ok(Outputs::one(CoordMap {
            size,
            start: IVec2::ZERO,
            pitch,
            periodic: cx.tiling(),
            spacing: 1,
            coords: Arc::new(coords),
            exemplar: Some(exemplar.frame),
            coherence: 0.0,
            coverage: 0.0,
            surface: None,
        }))
    }
}
