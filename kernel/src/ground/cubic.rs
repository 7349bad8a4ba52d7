//! Weights of cubic interpolation: for four values in a row and a position `t`, 0..1, between the second and the third.
use super::real::Real;

/// Catmull-Rom weights: the curve interpolates the values without blurring.
#[inline(always)]
pub fn catmull_rom<T: Real>(t: T) -> [T; 4] {
    let (t2, t3, half) = (t * t, t * t * t, T::HALF);
    let [two, three, four, five] = [2.0, 3.0, 4.0, 5.0].map(T::of);
    [
        half * (two * t2 - t - t3),
        half * (three * t3 - five * t2 + two),
        half * (four * t2 - three * t3 + t),
        half * (t3 - t2),
    ]
}

/// The same as [`catmull_rom`], but by Horner's rule with all four side by side, for loops that compute four at a time.
/// The bits differ.
#[inline(always)]
pub fn catmull_rom_in_step(t: f32) -> [f32; 4] {
    const A: [f32; 4] = [-0.5, 1.5, -1.5, 0.5];
    const B: [f32; 4] = [1.0, -2.5, 2.0, -0.5];
    const C: [f32; 4] = [-0.5, 0.0, 0.5, 0.0];
    const D: [f32; 4] = [0.0, 1.0, 0.0, 0.0];
    let mut w = [0.0; 4];
    for k in 0..4 {
        w[k] = ((A[k] * t + B[k]) * t + C[k]) * t + D[k];
    }
    w
}

/// Weights of the uniform cubic B-spline: a smooth curve that does not interpolate the values.
#[inline(always)]
pub fn bspline(t: f32) -> [f32; 4] {
    let u = 1.0 - t;
    let near = |t: f32| (4.0 - 6.0 * t * t + 3.0 * t * t * t) * (1.0 / 6.0);
    [u * u * u * (1.0 / 6.0), near(t), near(u), t * t * t * (1.0 / 6.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_agree() {
        for k in 0..=64u8 {
            let t = f32::from(k) / 64.0;
            let (plain, in_step, wide) = (catmull_rom(t), catmull_rom_in_step(t), catmull_rom(f64::from(t)));
            for ((a, b), c) in plain.iter().zip(in_step).zip(wide) {
                assert!((f64::from(*a) - c).abs() < 3e-7 && (f64::from(b) - c).abs() < 3e-7, "{t}: {a} {b} {c}");
            }
            for sum in [plain, in_step, bspline(t)].map(|w| w.iter().sum::<f32>()) {
                assert!((sum - 1.0).abs() < 1e-6, "{t}: {sum}");
            }
            // A linear ramp is reproduced.
            let place = |w: [f32; 4]| w[2] + 2.0 * w[3] - w[0];
            assert!([plain, in_step, bspline(t)].map(place).iter().all(|p| (p - t).abs() < 1e-6));
        }
        assert_eq!(catmull_rom(0.0f32), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(catmull_rom_in_step(0.0), [0.0, 1.0, 0.0, 0.0]);
    }
}
