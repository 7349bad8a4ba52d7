//! Distance of exemplar pixels to the edges of features: comparing it keeps thin lines whole, which colours alone
//! hardly do.
use super::texels::mirrored;
use crate::filter::distance::{DistanceSpec, distance};
use crate::ground::window::{View, WindowExt, index};
use shibo_value::Window;

/// Signed distance of each pixel to the edge of the area above ½, negative inside, limited to ±`radius` pixels.
pub fn signed_distance(plane: &[f32], [w, h]: [usize; 2], wrap: [bool; 2], radius: f64) -> Vec<f32> {
    let spec = DistanceSpec { threshold: 0.5, radius, step: [1.0; 2] };
    let whole = Window::of(0, 0, w, h);
    let padded = whole.with_halo(spec.halo());
    let [x, y] = [(padded.columns(), w, wrap[0], padded.x), (padded.rows(), h, wrap[1], padded.y)]
        .map(|(count, n, wrap, first)| (0..count).map(|k| mirrored(first + index(k), n, wrap)).collect::<Vec<_>>());
    let around = |sign: f32| {
        let values: Vec<f32> =
            y.iter().flat_map(|y| x.iter().map(move |x| 0.5 + sign * (plane[y * w + x] - 0.5))).collect();
        let mut out = vec![0.0; w * h];
        distance(&View::new(&values, padded), whole, &spec, &mut out);
        out
    };
    around(1.0).iter().zip(around(-1.0)).map(|(outside, inside)| outside - inside).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_negative_distance_inside_line() {
        let plane: Vec<f32> = (0..20 * 6).map(|p| if (8..12).contains(&(p % 20)) { 1.0 } else { 0.0 }).collect();
        let d = signed_distance(&plane, [20, 6], [false; 2], 5.0);
        for row in d.chunks_exact(20) {
            for (x, v) in row.iter().enumerate() {
                let edge = (x as f32 - 9.5).abs() - 2.0;
                assert!((v - edge.clamp(-5.0, 5.0)).abs() < 1e-5, "{x}: {v}, not {edge}");
            }
        }
        assert!(signed_distance(&[0.0; 9], [3, 3], [true; 2], 4.0).iter().all(|v| *v == 4.0));
    }
}
