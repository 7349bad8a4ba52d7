//! Masks of signed distances.
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::shape::mask;
use shibo_kernel::shape::outline::Outline;
use shibo_value::{Field, Halo, Tiling, Type};
use std::sync::Arc;

/// 1 where `distance` (mm) is negative; the edge fades over one pixel or `softness` mm.
pub(super) fn mask(distance: &Field, softness: f64) -> Field {
    let softness = narrow(softness);
    Field::map(Type::Gray, [distance.clone()], Halo::NONE, move |out, [d]| {
        let step = out.grid.step;
        mask::fill(d.data(), softness, narrow((step.x * step.y).sqrt()), out.data_mut());
        Ok(())
    })
}

/// The mask of an outline; distances are measured only near its edge.
pub(super) fn outlined(outline: &Arc<Outline>, softness: f64, tiling: Tiling) -> Field {
    let outline = outline.clone();
    Field::generate(Type::Gray, tiling, move |out, given| {
        let step = out.grid.step;
        let pixel = (step.x * step.y).sqrt();
        let wide = softness.max(pixel);
        let mut distance = vec![0.0; out.window.len()];
        let stop = || given.check().is_err();
        outline.fill_within(&stop, &tile::frame(out), (wide, narrow(2.0 * wide)), &mut distance);
        mask::fill(&distance, narrow(softness), narrow(pixel), out.data_mut());
        given.check()
    })
}
