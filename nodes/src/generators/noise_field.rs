//! Noise as a field of the canvas.
use shibo_engine::node::Context;
use shibo_engine::value::{Field, Type};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::tile;
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Basis, Noise, NoiseSpec};

/// The noise of `spec`, periodic where the canvas tiles.
pub(super) fn noise_field(cx: &Context<'_>, spec: &NoiseSpec, seed: u64) -> Field {
    let noise = Noise::new(spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(seed)));
    Field::generate(Type::Gray, cx.tiling(), move |out, _| {
        noise.fill(&tile::frame(out), out.plane_mut(0));
        Ok(())
    })
}

/// One octave of noise. Its bumps have a size in mm across, are `aspect` times longer along, and turned by an angle in degrees.
pub(super) fn one_octave(cx: &Context<'_>, (size, aspect, angle): (f64, f64, f64), basis: Basis, seed: u64) -> Field {
    let shape = CellShape { size, aspect, angle: angle.to_radians() };
    noise_field(cx, &NoiseSpec { shape, basis, ..NoiseSpec::fbm(size, 1) }, seed)
}
