//! [`StartCoords`]: the first coordinates of a synthesis.
//!
//! Source: JP5149288B2 II, claim 1 (row C2), with any size to start from. Cost: O(pixels).
use super::surface_stages::Staged;
use glam::{IVec2, UVec2};
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Exemplar, IndirectionMap, Stop, Type};
use std::sync::Arc;

/// A small map of coordinates over the canvas, zeros or given ones, to be doubled `levels` times.
///
/// ```ron
/// "start": StartCoords(size: (4, 4), levels: 4),
/// "a": UpsampleCoords(coords: "start"),
/// "b": UpsampleCoords(coords: "a"),
/// "c": UpsampleCoords(coords: "b"),
/// "d": UpsampleCoords(coords: "c"),
/// "cells": Worley(size: 5),
/// "example": SampleExemplar(coords: "d", input: "cells"),
/// ```
#[node]
pub struct StartCoords {
    /// The surface, level by level, if it is not the plane. Connect the same one to all stages.
    pub surface: Option<In<IndirectionMap>>,
    /// The exemplar: on a surface the size of its pixels determines the size of features.
    pub exemplar: Option<In<Exemplar>>,
    /// Columns and rows. On a surface, those of its level.
    #[schemars(extend("minimum" = 1.0, "maximum" = 4096.0))]
    #[default((2, 2))]
    pub size: (u32, u32),
    /// The coordinates by rows, in exemplar pixels; zeros if not given.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6))]
    pub coords: Vec<(f64, f64)>,
    /// Number of times that later stages double the map: one pixel stands for 2^levels pixels of the finest level, in x
    /// and in y.
    #[schemars(range(min = 0, max = 12))]
    pub levels: u32,
}

impl Node for StartCoords {
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] = &[Output::new("coords", Type::CoordMap, "The map.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let n = self.size.0 as usize * self.size.1 as usize;
        if self.surface.is_some() && self.exemplar.is_none() {
            let message = "on a surface the size of the exemplar's pixels must be known";
            return vec![Problem::new(Code::MissingInput, message).at("exemplar").help("connect the exemplar")];
        }
        if self.coords.is_empty() || self.surface.is_some() || self.coords.len() == n {
            return Vec::new();
        }
        let message = format!(
            "{} coordinates for {}x{} pixels; there must be {n}, or none",
            self.coords.len(),
            self.size.0,
            self.size.1
        );
        vec![Problem::new(Code::BadValue, message).at("coords")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let frame = cx.get_opt(&self.exemplar)?.map(|exemplar| exemplar.frame);
        if let Some(surface) = cx.get_opt(&self.surface)? {
            return Ok(Outputs::one(Staged::new(cx, &surface, None, frame)?.start(self.levels, &self.coords)?));
        }
        let size = UVec2::new(self.size.0, self.size.1);
        let coords = if self.coords.is_empty() {
            vec![[0.0; 2]; size.element_product() as usize]
        } else {
            self.coords.iter().map(|&(u, v)| [narrow(u), narrow(v)]).collect()
        };
        Ok(Outputs::one(CoordMap {
            size,
            start: IVec2::ZERO,
            pitch: cx.size_mm() / size.as_dvec2(),
            periodic: cx.tiling(),
            spacing: 1 << self.levels,
            coords: Arc::new(coords),
            exemplar: frame,
            coherence: 0.0,
            coverage: 0.0,
            surface: None,
        }))
    }
}
