//! Noise as a field of the canvas.
use shibo_engine::node::Context;
use shibo_engine::value::{Field, Type};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::tile;
use shibo_kernel::noise::fractal::{Noise, NoiseSpec};

/// The noise of `spec`, periodic where the canvas tiles.
pub(super) fn noise_field(cx: &Context<'_>, spec: &NoiseSpec, seed: u64) -> Field {
    let noise = Noise::new(spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(seed)));
    Field::generate(Type::Gray, cx.tiling(), move |out, _| {
        noise.fill(&tile::frame(out), out.plane_mut(0));
        Ok(())
    })
}
