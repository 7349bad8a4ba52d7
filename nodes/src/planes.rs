//! Planes of a field that several outputs share.
use shibo_value::{Field, Halo, Tile, Type};

/// One plane of a field as a field of its own.
pub(crate) fn plane(all: &Field, ty: Type, number: usize) -> Field {
    Field::map(ty, [all.clone()], Halo::NONE, move |out: &mut Tile, [all]: [&Tile; 1]| {
        out.plane_mut(0).copy_from_slice(all.plane(number));
        Ok(())
    })
}
