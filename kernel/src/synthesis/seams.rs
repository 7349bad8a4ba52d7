//! Detection of exemplars that wrap, and removal of their shading.
use super::plane::PixelPlane;
use super::texels::Texels;

/// Detects for each axis whether opposite sides look joined: the step across them is no larger than the steps inside,
/// both in the picture and in a blurred copy.
pub fn join(features: &[f32], channels: usize, [w, h]: [usize; 2]) -> [bool; 2] {
    if w.min(h) < 16 {
        return [false; 2];
    }
    // Blurring across the border would hide the step; so blur without wrapping.
    let plane = PixelPlane { w, h, wrap: [false; 2] };
    let sharp = Texels::new(plane, channels, features.to_vec());
    let soft = sharp.blurred(4);
    [true, false].map(|across| {
        let both = [&sharp, &soft].map(|picture| {
            let n = if across { w } else { h };
            let line = |k: usize| -> Vec<f32> {
                let at = |m: usize| if across { m * w + k } else { k * w + m };
                let count = if across { h } else { w };
                (0..count).flat_map(|m| &picture.data[at(m) * channels..(at(m) + 1) * channels]).copied().collect()
            };
            let step = |a: usize, b: usize| -> f64 {
                line(a).iter().zip(line(b)).map(|(a, b)| f64::from((a - b).abs())).sum()
            };
            let mean = (1..n).map(|k| step(k - 1, k)).sum::<f64>() / (n - 1) as f64;
            step(n - 1, 0) <= 1.2 * mean
        });
        both[0] && both[1]
    })
}

/// Removes variation over more than `share` of the shorter side from a plane.
pub fn flatten(plane: &mut [f32], [w, h]: [usize; 2], share: f64) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
    let width = ((w.min(h) as f64 * share) as usize).max(2);
    let shading = Texels::new(PixelPlane { w, h, wrap: [false; 2] }, 1, plane.to_vec()).blurred(width);
    plane.iter_mut().zip(&shading.data).for_each(|(v, shading)| *v -= shading);
}
