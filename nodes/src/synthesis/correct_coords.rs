//! [`CorrectCoords`]: corrects coordinates to fit their neighbours.
//!
//! Source: JP5149288B2 II and III, equations (1) and (2), claims 2 to 4, 10, 16 (rows C6 to C11).
//! Cost: O(pixels · candidates · neighbours).
use super::analysis::{features, plane};
use super::patent::{level, wide};
use super::stages;
use super::surface_stages::{Staged, corrected};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::exact::{CorrectionRule, Corrector, Features};
use shibo_kernel::synthesis::texels::{self, Texels};
use shibo_node::{CanvasFacts, Context, Fact, In, JacobianField, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Exemplar, IndirectionMap, Neighborhood, Stop, Type};
use std::sync::Arc;

/// Interpolation between exemplar pixels.
#[choice]
pub enum Fetch {
    /// Linear in x and y.
    #[default]
    Bilinear,
    /// The nearest pixel.
    Nearest,
}

/// Replaces each coordinate by the best candidate: itself, or one that its eight neighbours predict. Candidates are
/// compared with the exemplar.
///
/// Works at the level of the coordinates. If the exemplar is analysed, its appearance is compared, and similar pixels
/// are further candidates. Otherwise colours are compared, as in the source.
///
/// ```ron
/// "cells": Worley(size: 5),
/// "exemplar": Exemplar(input: "cells", size: (64, 64), periodic: Yes),
/// "start": StartCoords(size: (10, 10), levels: 3),
/// "varied": JitterCoords(coords: "start", amount: 4),
/// "a": UpsampleCoords(coords: "varied"),
/// "b": CorrectCoords(coords: "a", exemplar: "exemplar", passes: 2),
/// "c": UpsampleCoords(coords: "b"),
/// "d": CorrectCoords(coords: "c", exemplar: "exemplar", passes: 2),
/// "e": UpsampleCoords(coords: "d"),
/// "f": CorrectCoords(coords: "e", exemplar: "exemplar", passes: 2),
/// "example": SampleExemplar(coords: "f", input: "cells"),
/// ```
#[node]
pub struct CorrectCoords {
    /// The coordinates.
    pub coords: In<CoordMap>,
    /// The exemplar.
    pub exemplar: In<Exemplar>,
    /// The surface, level by level, if it is not the plane; connect the one of `StartCoords`.
    pub surface: Option<In<IndirectionMap>>,
    /// The Jacobian from output to exemplar; on a surface that of `JacobianFromMesh`. The unit matrix by default.
    pub jacobian: Option<In<JacobianField>>,
    /// The neighbours that are compared.
    #[default(Neighborhood::Diagonal4)]
    pub neighborhood: Neighborhood,
    /// Number of corrections of all coordinates.
    #[schemars(range(min = 0, max = 64))]
    #[default(1)]
    pub passes: u32,
    /// Number of groups of pixels, a square number. Each group is corrected with the results of the groups before it;
    /// with 1 all pixels are corrected from the old map.
    #[schemars(range(min = 1, max = 256))]
    #[default(4)]
    pub sub_passes: u32,
    /// True to average three predictions for each neighbour; false to take one.
    #[default(true)]
    pub averaged: bool,
    /// Interpolation between exemplar pixels.
    #[default(Fetch::Bilinear)]
    pub fetch: Fetch,
    /// Factor on the cost of candidates that are only similar and do not continue a neighbour.
    #[schemars(range(min = 1, max = 10))]
    #[default(1.0)]
    pub copy_size: f64,
}

impl Node for CorrectCoords {
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[Fact::Size];
    const OUTPUTS: &'static [Output] = &[Output::new("coords", Type::CoordMap, "The map, corrected.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.sub_passes.isqrt().pow(2) == self.sub_passes {
            return Vec::new();
        }
        let message = format!("sub_passes is `{}`; it must be a square number: 1, 4, 9, …", self.sub_passes);
        vec![Problem::new(Code::OutOfRange, message).at("sub_passes")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (map, exemplar) = (cx.get(&self.coords)?, cx.get(&self.exemplar)?);
        let h = map.spacing as usize;
        let analysed = exemplar.levels.iter().find(|level| level.h == h);
        let (texels, ratio) = match analysed {
            Some(found) => {
                let data = found.appearance.as_flattened().iter().map(|v| f64::from(*v)).collect();
                (Texels::new(plane(&exemplar), 8, data), 1.0)
            }
            None => level(&wide(&features(&exemplar)), h, exemplar.pyramid),
        };
        let second = analysed.map_or(&[][..], |level| &level.second);
        let features = Features { texels: &texels, ratio, second, plane: plane(&exemplar) };
        let rule = CorrectionRule {
            square: match self.neighborhood {
                Neighborhood::Diagonal4 => 4,
                Neighborhood::Square3 => 3,
                Neighborhood::Square5 => 5,
            },
            averaged: self.averaged,
            fetch: match self.fetch {
                Fetch::Bilinear => texels::Fetch::Bilinear,
                Fetch::Nearest => texels::Fetch::Nearest,
            },
            h: f64::from(map.spacing),
            kappa: self.copy_size,
            sub_passes: self.sub_passes,
        };
        let step = |pass: u32| {
            cx.evaluator.progress(u64::from(pass), u64::from(self.passes));
            cx.check()
        };
        if let Some(surface) = cx.get_opt(&self.surface)? {
            let staged = Staged::new(cx, &surface, cx.get_opt(&self.jacobian)?, Some(exemplar.frame))?;
            let sheet = staged.sheet(&map)?;
            let jacobians = staged.jacobians(&sheet)?;
            let coords = corrected((&sheet, &jacobians), (&features, &rule), &map.coords, self.passes, step)?;
            return Ok(Outputs::one(staged.measured(&sheet, coords, &jacobians, &exemplar)));
        }
        stages::in_the_plane(&map)?;
        let jacobians = stages::jacobians(cx, cx.get_opt(&self.jacobian)?.as_ref(), map.size, map.pitch)?;
        let plane = stages::plane(&map);
        let lookup = stages::Ended(plane);
        let jacobian = |pixel: usize| stages::at(&jacobians, pixel);
        let corrector = Corrector { features: &features, rule: &rule, lookup: &lookup, jacobian };
        let mut coords = stages::wide(&map);
        for pass in 0..self.passes {
            step(pass)?;
            corrector.pass(plane, &[], &mut coords);
        }
        let coords = Arc::new(coords.into_iter().map(|c| c.map(narrow)).collect());
        Ok(Outputs::one(CoordMap { coords, exemplar: Some(exemplar.frame), ..CoordMap::clone(&map) }))
    }
}
