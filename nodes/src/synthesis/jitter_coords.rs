//! [`JitterCoords`]: random displacements of coordinates, for variety.
//!
//! Beyond the source: without jitter, `J = 1` and coordinates that start as zeros give the exemplar itself, tiled.
//! Cost: O(pixels).
use super::stages;
use super::surface_stages::{Staged, jittered};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::exact;
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::{CoordMap, IndirectionMap, Stop, Type};
use std::sync::Arc;

/// Displaces the coordinates of one level at random.
///
/// ```ron
/// "start": StartCoords(size: (10, 10), levels: 4),
/// "varied": JitterCoords(coords: "start", amount: 3),
/// "a": UpsampleCoords(coords: "varied"),
/// "b": UpsampleCoords(coords: "a"),
/// "c": UpsampleCoords(coords: "b"),
/// "d": UpsampleCoords(coords: "c"),
/// "cells": Worley(size: 5),
/// "example": SampleExemplar(coords: "d", input: "cells"),
/// ```
#[node]
pub struct JitterCoords {
    /// The coordinates.
    pub coords: In<CoordMap>,
    /// The surface, level by level, if it is not the plane; connect the one of `StartCoords`.
    pub surface: Option<In<IndirectionMap>>,
    /// Factor on the amount.
    pub mask: Option<In<Gray>>,
    /// Largest displacement of coordinates, in pixels of the level.
    #[schemars(range(min = 0, max = 64))]
    #[default(0.5)]
    pub amount: f64,
    /// Another seed gives other displacements.
    pub seed: u64,
}

impl Node for JitterCoords {
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];
    const OUTPUTS: &'static [Output] = &[Output::new("coords", Type::CoordMap, "The map, displaced.")];

    fn no_op(&self) -> Option<&'static str> {
        (self.amount == 0.0).then_some("coords")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let map = cx.get(&self.coords)?;
        let mask = match cx.get_opt(&self.mask)? {
            Some(mask) => stages::raster(cx, &mask, map.size, map.pitch)?.plane(0).to_vec(),
            None => Vec::new(),
        };
        if let Some(surface) = cx.get_opt(&self.surface)? {
            let staged = Staged::new(cx, &surface, None, map.exemplar)?;
            let sheet = staged.sheet(&map)?;
            let (reach, hash) = (self.amount * f64::from(map.spacing), Hash::new(cx.seed(self.seed)).with(1));
            let mut coords = map.coords.to_vec();
            let pitch = map.exemplar.map_or(1.0, |frame| frame.pitch.x);
            jittered(&sheet, &mut coords, (reach, &mask), hash, pitch);
            return Ok(Outputs::one(CoordMap { coords: Arc::new(coords), ..CoordMap::clone(&map) }));
        }
        stages::in_the_plane(&map)?;
        let mut coords = stages::wide(&map);
        let hash = Hash::new(cx.seed(self.seed)).with(u64::from(map.spacing));
        exact::jitter(&mut coords, self.amount * f64::from(map.spacing), &mask, hash);
        let coords = Arc::new(coords.into_iter().map(|c| c.map(narrow)).collect());
        Ok(Outputs::one(CoordMap { coords, ..CoordMap::clone(&map) }))
    }
}
