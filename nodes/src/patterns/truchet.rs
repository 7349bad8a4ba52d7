//! [`Truchet`]: square tiles turned at random.
//!
//! See [`kernel::truchet`](shibo_kernel::pattern::truchet). Cost: O(pixels) for each output.
use super::pieces::{drawn, places};
use crate::degrees::sin_cos;
use crate::fitted;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::pattern::finish::{BevelProfile, degrees};
use shibo_kernel::pattern::truchet::{Motif, Tiles, TruchetPlane};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling, Type};
use std::sync::Arc;

/// Square tiles with one figure, each rotated by random quarter turns: bands that wander and join everywhere.
///
/// ```ron
/// "maze": Truchet(size: 5, width: 1.8, height: 0.8),
/// "example": Relief(height: "maze"),
/// ```
///
/// Elsewhere: Material Maker *Truchet*, *Truchet Generic*.
#[node]
#[derive(PartialEq)]
pub struct Truchet {
    /// The figure of a tile.
    #[default(Motif::Arcs)]
    pub motif: Motif,
    /// Side of a tile; on a canvas that tiles, rounded so that a whole number of tiles fits.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(4.0)]
    pub size: f64,
    /// Width of the bands; at most the side of a tile.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.0)]
    pub width: f64,
    /// Height of the middle of the bands, or of the triangles.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(0.5)]
    pub height: f64,
    /// The cross-section of the bands.
    #[default(BevelProfile::Round)]
    pub profile: BevelProfile,
    /// Rotation of the whole pattern, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Another seed gives the tiles other rotations.
    pub seed: u64,
}

impl Truchet {
    fn tiles(&self, canvas: &CanvasFacts, hash: Hash) -> Option<Tiles> {
        let sizes = [self.size, self.width, self.height];
        Tiles::new(self.motif, sizes, self.profile, sin_cos(self.angle), (canvas.size_mm(), canvas.tile()), hash)
    }
}

impl Node for Truchet {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "`height` in the middle of the bands, 0 between them.").in_unit("mm"),
        Output::new("mask", Type::Gray, "1 on the bands, 0 between them."),
        Output::new("distance", Type::Gray, "Distance from the edge of the tile's own bands; negative inside.")
            .in_unit("mm"),
        Output::new("ids", Type::Ids, "The number of the tile, from 1."),
        Output::new("local", Type::Vec2, "The place within the tile from its middle, turned with it.").in_unit("mm"),
        Output::new("angle", Type::Gray, "By how much the tile is turned, from +x towards +y.").in_unit("°"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        if self.width > self.size {
            let message =
                format!("width is `{}` mm; it must be at most the side of a tile, {} mm", self.width, self.size);
            return vec![Problem::new(Code::OutOfRange, message).at("width")];
        }
        if self.tiles(canvas, Hash::new(0)).is_none() { vec![fitted::too_many("size")] } else { Vec::new() }
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Some(tiles) = self.tiles(canvas, Hash::new(0)) else { return Vec::new() };
        let (wanted, turned) = (DVec2::splat(self.size), degrees(tiles.fit.direction(DVec2::X)));
        fitted::advice(("size", "pieces"), [wanted, tiles.fit.units()], [self.angle, turned], fitted::FITS)
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let tiles = Arc::new(self.tiles(cx.canvas, hash).ok_or_else(|| fitted::too_many("size"))?);
        let tiling = cx.tiling();
        let plane = |ty: Type, plane: TruchetPlane| {
            drawn(&tiles, ty, tiling, move |tiles, frame, out| tiles.fill(plane, frame, out))
        };
        let local = places(&tiles, tiling, Tiles::local);
        Ok(Outputs::one(plane(Type::Gray, TruchetPlane::Height))
            .with("mask", plane(Type::Gray, TruchetPlane::Mask))
            .with("distance", plane(Type::Gray, TruchetPlane::Distance))
            .with("ids", plane(Type::Ids, TruchetPlane::Ids))
            .with("local", local)
            .with("angle", plane(Type::Gray, TruchetPlane::Angle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::{OnCanvas as _, canvas};

    #[test]
    fn every_motif_conforms() {
        for motif in [Motif::Arcs, Motif::Lines, Motif::Triangles] {
            conforms(&Truchet { motif, ..Truchet::default() }, &[]);
            conforms(&Truchet { motif, angle: 33.0, size: 3.3, ..Truchet::default() }, &[]);
        }
        assert_eq!(Truchet { width: 5.0, ..Truchet::default() }.check_on(&canvas()).len(), 1);
        assert_eq!(Truchet { size: 4.3, ..Truchet::default() }.advice_on(&canvas()).len(), 1);
    }
}
