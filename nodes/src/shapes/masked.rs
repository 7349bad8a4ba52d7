//! The mask of a signed distance.
use shibo_engine::value::{Field, Halo, Type};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::shape::mask;

/// 1 where `distance` (mm) is negative, over one pixel or `softness` mm.
pub(super) fn mask(distance: &Field, softness: f64) -> Field {
    let softness = narrow(softness);
    Field::map(Type::Gray, [distance.clone()], Halo::NONE, move |out, [d]| {
        let step = out.grid.step;
        mask::fill(d.data(), softness, narrow((step.x * step.y).sqrt()), out.data_mut());
        Ok(())
    })
}
