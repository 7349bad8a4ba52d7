//! Transcendental functions with the same bits on every machine: pure Rust, never the system's library.

/// Adding it to a number rounds to a whole number, which then stands in the low bits.
const ROUND: f32 = 12_582_912.0;
/// Coefficients of `(e^r - 1 - r) / r²` for `|r| ≤ ln 2 / 2`, after Cephes.
const EXP: [f32; 6] = [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 0.5];
/// ln 2 in two parts, of which the first has few bits.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// The exponential of `x`, to 3e-7 of its value; below -87 it stays at e^-87. The bits are those of [`exp_simd`].
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let x = x.clamp(-87.0, 88.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let p = EXP[1..].iter().fold(EXP[0], |p, c| p * r + c);
    let power = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
    ((p * (r * r) + r) + 1.0) * power
}

/// [`exp`] of several numbers.
#[inline(always)]
pub fn exp_simd<S: pulp::Simd>(simd: S, x: S::f32s) -> S::f32s {
    let splat = |v: f32| simd.splat_f32s(v);
    let x = simd.min_f32s(simd.max_f32s(x, splat(-87.0)), splat(88.0));
    let shifted = simd.add_f32s(simd.mul_f32s(x, splat(std::f32::consts::LOG2_E)), splat(ROUND));
    let n = simd.sub_f32s(shifted, splat(ROUND));
    let r = simd.sub_f32s(x, simd.mul_f32s(n, splat(LN_2[0])));
    let r = simd.sub_f32s(r, simd.mul_f32s(n, splat(LN_2[1])));
    let mut p = splat(EXP[0]);
    for c in &EXP[1..] {
        p = simd.add_f32s(simd.mul_f32s(p, r), splat(*c));
    }
    let bits = simd.add_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(127));
    let power = simd.transmute_f32s_u32s(simd.wrapping_dyn_shl_u32s(bits, simd.splat_u32s(23)));
    let rest = simd.add_f32s(simd.mul_f32s(p, simd.mul_f32s(r, r)), r);
    simd.mul_f32s(simd.add_f32s(rest, splat(1.0)), power)
}

/// Sine of `x` radians.
#[inline]
pub fn sin(x: f32) -> f32 {
    libm::sinf(x)
}

/// Cosine of `x` radians.
#[inline]
pub fn cos(x: f32) -> f32 {
    libm::cosf(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct All(Vec<f32>);

    impl pulp::WithSimd for All {
        type Output = Vec<f32>;
        fn with_simd<S: pulp::Simd>(mut self, simd: S) -> Vec<f32> {
            S::as_mut_simd_f32s(&mut self.0).0.iter_mut().for_each(|v| *v = exp_simd(simd, *v));
            self.0
        }
    }

    #[test]
    fn one_and_many_exponentials_have_the_same_bits() {
        let x: Vec<f32> = (0..4096).map(|i| (i as f32 - 2048.0) * 0.05).collect();
        let many = pulp::Arch::new().dispatch(All(x.clone()));
        assert!(x.iter().zip(&many).all(|(x, y)| exp(*x).to_bits() == y.to_bits()));
    }
}
