//! Pictures of an exemplar's levels.
use super::texels::{Fetch, Texels};

/// The picture of the level of spacing `h`, at the finest resolution: blurred (stack), or halved and enlarged
/// (pyramid).
pub fn image(finest: &Texels<f32>, h: usize, pyramid: bool) -> Texels<f32> {
    if !pyramid {
        return finest.blurred(h);
    }
    let coarse = pyramid_level(finest, h);
    let mut out = Texels { data: vec![0.0; finest.data.len()], ..finest.clone() };
    let (w, channels) = (finest.plane.w, finest.channels);
    let scale = 1.0 / h as f32;
    for (p, out) in out.data.chunks_exact_mut(channels).enumerate() {
        let at = [(p % w) as f32 + 0.5, (p / w) as f32 + 0.5].map(|v| v * scale);
        coarse.add(at, Fetch::Bilinear, 1.0, out);
    }
    out
}

/// The level of a pyramid whose pixels are `h` finest ones wide, `h` a power of two.
pub fn pyramid_level<T: crate::ground::real::Real>(finest: &Texels<T>, h: usize) -> Texels<T> {
    (0..h.ilog2()).fold(finest.clone(), |level, _| level.halved())
}
