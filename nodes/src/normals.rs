//! Normals of a height, for nodes that make the height of a material.
use shibo_kernel::ground::tile;
use shibo_kernel::surface::normal::{self, NormalSpec, SlopeFilter};
use shibo_value::{Field, Halo, Type};

/// Normals of a height in mm, with the defaults of `HeightToNormal`.
pub(crate) fn normals(height: &Field) -> Field {
    Field::map(Type::Normal, [height.clone()], Halo::px(normal::HALO), |out, [height]| {
        let (step, slope) = (tile::step(&out.grid), SlopeFilter::default());
        let spec = NormalSpec { step, strength: 1.0, y_up: true, encode: true, slope };
        normal::normal(&tile::view(height, 0), out.window, &spec, tile::planes3(out));
        Ok(())
    })
}
