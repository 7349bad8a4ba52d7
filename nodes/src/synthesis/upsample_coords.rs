//! [`UpsampleCoords`]: upsamples coordinates to the next finer level.
//!
//! Source: JP5149288B2 II, equation (3) (rows C4, C5): child = parent + h·J·Δ, Δ = (±½, ±½). Cost:
//! O(pixels).
use super::stages;
use super::surface_stages::{Staged, upsampled};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::exact;
use shibo_kernel::synthesis::sheet::Sheet;
use shibo_node::{Context, Fact, In, JacobianField, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, IndirectionMap, Stop, Type};
use std::sync::Arc;

/// Doubles a map of coordinates in x and y: each pixel becomes four, placed around it by the Jacobian.
///
/// ```ron
/// "start": StartCoords(size: (2, 2), coords: [(20, 20), (50, 30), (80, 70), (30, 90)], levels: 5),
/// "a": UpsampleCoords(coords: "start"),
/// "b": UpsampleCoords(coords: "a"),
/// "c": UpsampleCoords(coords: "b"),
/// "d": UpsampleCoords(coords: "c"),
/// "e": UpsampleCoords(coords: "d"),
/// "cells": Worley(size: 5),
/// "example": SampleExemplar(coords: "e", input: "cells"),
/// ```
#[node]
pub struct UpsampleCoords {
    /// The coarser map.
    pub coords: In<CoordMap>,
    /// The surface, level by level, if it is not the plane; connect the one of `StartCoords`.
    pub surface: Option<In<IndirectionMap>>,
    /// The Jacobian from output to exemplar; on a surface that of `JacobianFromMesh`. The unit matrix by default.
    pub jacobian: Option<In<JacobianField>>,
}

impl Node for UpsampleCoords {
    const FACTS: &'static [Fact] = &[Fact::Size];
    const OUTPUTS: &'static [Output] = &[Output::new("coords", Type::CoordMap, "The finer map.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let map = cx.get(&self.coords)?;
        if map.spacing < 2 {
            let message = "these coordinates are of the finest level already and cannot be doubled";
            let help = "raise `levels` of StartCoords, or leave this node out";
            return Err(Problem::new(Code::BadValue, message).at("coords").help(help).into());
        }
        if let Some(surface) = cx.get_opt(&self.surface)? {
            let staged = Staged::new(cx, &surface, cx.get_opt(&self.jacobian)?, map.exemplar)?;
            let coarse = staged.sheet(&map)?;
            let sheet = Sheet::new(&surface, map.spacing.ilog2() as usize - 1);
            stages::afford(cx, sheet.level.owner.len() as u64)?;
            let (before, jacobians) = (staged.jacobians(&coarse)?, staged.jacobians(&sheet)?);
            let coords = upsampled((&coarse, &map.coords, &before), (&sheet, &jacobians));
            return Ok(Outputs::one(staged.map(&sheet, coords, &jacobians)));
        }
        stages::in_the_plane(&map)?;
        let (size, pitch) = (map.size * 2, map.pitch / 2.0);
        stages::afford(cx, u64::from(size.x) * u64::from(size.y))?;
        let jacobians = stages::jacobians(cx, cx.get_opt(&self.jacobian)?.as_ref(), size, pitch)?;
        let (h, w) = (map.spacing / 2, size.x as usize);
        let coords = exact::upsample(&stages::wide(&map), stages::plane(&map), f64::from(h), |x, y| {
            stages::at(&jacobians, y * w + x)
        });
        let coords = Arc::new(coords.into_iter().map(|c| c.map(narrow)).collect());
        Ok(Outputs::one(CoordMap { size, pitch, spacing: h, coords, ..CoordMap::clone(&map) }))
    }
}
