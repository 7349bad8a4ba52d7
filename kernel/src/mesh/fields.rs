//! Fields on atlases that several nodes read.
use super::bake::{self, Texels};
use super::motion::RigidMotion;
use super::texels;
use shibo_value::{Atlas, Field, Given, Halo, Stop, Tile, Tiling, Type};
use std::sync::Arc;

/// The triangle of each pixel of an atlas, see [`texels::fill`]. Fields of the same atlas are equal, so their tiles are
/// shared.
pub fn texels(atlas: &Arc<Atlas>) -> Field {
    let of = atlas.clone();
    let fill = move |out: &mut Tile, _: &Given<'_>| -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        texels::fill(&of, &grid, window, out.plane_mut(0));
        Ok(())
    };
    Field::generate(Type::Ids, Tiling::NONE, fill).overwriting().keyed(atlas.key_of("texels", &[]))
}

/// A field computed from the texels of an atlas, pixel by pixel: `fill` sets every value.
pub fn baked<F>(ty: Type, atlas: &Arc<Atlas>, fill: F) -> Field
where
    F: Fn(&Texels<'_>, Vec<&mut [f32]>) + Send + Sync + 'static,
{
    let of = atlas.clone();
    let run = move |out: &mut Tile, [texels]: [&Tile; 1]| -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        fill(&Texels { atlas: &of, grid: &grid, window, values: texels.plane(0) }, out.planes_mut());
        Ok(())
    };
    Field::map(ty, [texels(atlas)], Halo::NONE, run).overwriting()
}

/// Positions of texels on the surface in mm; solids are evaluated there.
pub fn places(atlas: &Arc<Atlas>) -> Field {
    let field = baked(Type::Rgb, atlas, |texels, planes| {
        if let Ok(planes) = <[&mut [f32]; 3]>::try_from(planes) {
            bake::places(texels, |_| RigidMotion::NONE, planes);
        }
    });
    field.keyed(atlas.key_of("places of texels", &[]))
}
