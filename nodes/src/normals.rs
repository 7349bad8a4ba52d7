//! Normals of heights, and of detail on them, for nodes that make the height of a material.
use shibo_kernel::ground::tile;
use shibo_kernel::surface::combine_normals::{NormalBlend, combine};
use shibo_kernel::surface::normal::{self, NormalSpec, SlopeFilter};
use shibo_value::{Field, Halo, Tile, Type};

/// Normals of a height in mm, with the defaults of `HeightToNormal`.
pub(crate) fn normals(height: &Field) -> Field {
    if height.as_constant().is_some() {
        return Field::constant(Type::Normal, &[0.5, 0.5, 1.0]);
    }
    Field::map(Type::Normal, [height.clone()], Halo::px(normal::HALO), |out, [height]| {
        let (step, slope) = (tile::step(&out.grid), SlopeFilter::default());
        let spec = NormalSpec { step, strength: 1.0, y_up: true, encode: true, slope };
        normal::normal(&tile::view(height, 0), out.window, &spec, tile::planes3(out));
        Ok(())
    })
}

/// One normal on another, see [`BlendNormals`](crate::surface::BlendNormals).
pub(crate) fn blended(mode: NormalBlend, [base, detail, strength]: [Field; 3]) -> Field {
    let fill = move |out: &mut Tile, [base, detail, strength]: [&Tile; 3]| {
        let [base, detail] = [base, detail].map(|tile| [0, 1, 2].map(|k| tile.plane(k)));
        combine(mode, base, detail, strength.plane(0), tile::planes3(out));
        Ok(())
    };
    Field::map(Type::Normal, [base, detail, strength], Halo::NONE, fill)
}
