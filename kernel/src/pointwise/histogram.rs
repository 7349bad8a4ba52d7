//! Distributions of values, and monotone maps between them.

use crate::ground::math::lerp;

/// The quantiles of `values` for the fractions `k / count`, k = 0 … `count`, from the least value to the greatest.
/// Sorts the values.
///
/// # Panics
/// If there are no values, or `count` is 0.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the values")]
pub fn quantiles(values: &mut [f32], count: usize) -> Vec<f32> {
    values.sort_unstable_by(f32::total_cmp);
    let last = values.len() - 1;
    (0..=count)
        .map(|k| {
            let at = last as f64 * (k as f64 / count as f64);
            let i = (at as usize).min(last);
            lerp(values[i], values[(i + 1).min(last)], (at - i as f64) as f32)
        })
        .collect()
}

/// The quantile for the fraction `share`, from sorted `quantiles`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the quantiles")]
pub fn quantile(quantiles: &[f32], share: f64) -> f32 {
    let last = quantiles.len() - 1;
    let at = last as f64 * share.clamp(0.0, 1.0);
    let i = (at as usize).min(last);
    lerp(quantiles[i], quantiles[(i + 1).min(last)], (at - i as f64) as f32)
}

/// A monotone map between quantiles of two distributions; constant beyond the first and the last.
#[derive(Clone, Debug)]
pub struct Transfer {
    from: Vec<f32>,
    to: Vec<f32>,
    /// For equal parts of the range: the first knot above the start of each part.
    first: Vec<u32>,
    scale: f32,
}

/// Number of parts of the range in which a search begins.
const PARTS: usize = 4096;

impl Transfer {
    /// From `from` to `to`, both ascending and equally long. A value that occurs as several quantiles maps to the mean
    /// of theirs.
    ///
    /// # Panics
    /// If there are none, or their numbers differ.
    pub fn new(from: &[f32], to: &[f32]) -> Self {
        assert!(from.len() == to.len() && !from.is_empty(), "as many quantiles on both sides");
        let (mut knots, mut values): (Vec<f32>, Vec<f32>) = (Vec::new(), Vec::new());
        let mut start = 0;
        for end in 1..=from.len() {
            if end == from.len() || from[end] > from[start] {
                let mean = to[start..end].iter().map(|v| f64::from(*v)).sum::<f64>() / (end - start) as f64;
                knots.push(from[start]);
                #[expect(clippy::cast_possible_truncation, reason = "values are f32")]
                values.push(mean as f32);
                start = end;
            }
        }
        let width = knots[knots.len() - 1] - knots[0];
        let scale = if width > 0.0 && width.is_finite() { PARTS as f32 / width } else { 0.0 };
        let part = |x: f32| place(x, knots[0], scale);
        // Uses the parts in which the knots lie, so that rounding cannot put a value before its knots.
        let mut first = vec![0u32; PARTS + 1];
        for knot in &knots {
            first[part(*knot)] += 1;
        }
        let mut before = 0;
        for count in &mut first {
            (before, *count) = (before + *count, before);
        }
        Self { from: knots, to: values, first, scale }
    }

    /// The mapped value of `x`.
    #[inline]
    pub fn at(&self, x: f32) -> f32 {
        let last = self.from.len() - 1;
        if x.is_nan() || x <= self.from[0] {
            return self.to[0];
        }
        if x >= self.from[last] {
            return self.to[last];
        }
        let part = place(x, self.from[0], self.scale);
        let low = self.first[part] as usize;
        let high = self.first.get(part + 1).map_or(last + 1, |k| *k as usize);
        let k = low + self.from[low..high].partition_point(|knot| *knot <= x);
        let (a, b) = (self.from[k - 1], self.from[k]);
        lerp(self.to[k - 1], self.to[k], (x - a) / (b - a))
    }
}

/// The part of the range in which `x` lies.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates, and is limited")]
fn place(x: f32, first: f32, scale: f32) -> usize {
    (((x - first) * scale) as usize).min(PARTS)
}

/// Quantiles of the standard normal distribution for the fractions (k + ½) / (count + 1), k = 0 … `count`.
#[expect(clippy::cast_possible_truncation, reason = "values are f32")]
pub fn normal_quantiles(count: usize) -> Vec<f32> {
    (0..=count).map(|k| probit((k as f64 + 0.5) / (count as f64 + 1.0)) as f32).collect()
}

/// The inverse of the normal distribution function, after P. Acklam; relative error 1.2e-9.
fn probit(p: f64) -> f64 {
    const A: [f64; 6] = [
        -3.969_683_028_665_376e1,
        2.209_460_984_245_205e2,
        -2.759_285_104_469_687e2,
        1.383_577_518_672_69e2,
        -3.066_479_806_614_716e1,
        2.506_628_277_459_239,
    ];
    const B: [f64; 5] = [
        -5.447_609_879_822_406e1,
        1.615_858_368_580_409e2,
        -1.556_989_798_598_866e2,
        6.680_131_188_771_972e1,
        -1.328_068_155_288_572e1,
    ];
    const C: [f64; 6] = [
        -7.784_894_002_430_293e-3,
        -3.223_964_580_411_365e-1,
        -2.400_758_277_161_838,
        -2.549_732_539_343_734,
        4.374_664_141_464_968,
        2.938_163_982_698_783,
    ];
    const D: [f64; 4] =
        [7.784_695_709_041_462e-3, 3.224_671_290_700_398e-1, 2.445_134_137_142_996, 3.754_408_661_907_416];
    let horner = |c: &[f64], x: f64| c.iter().fold(0.0, |sum, c| sum * x + c);
    if p > 0.5 {
        return -probit(1.0 - p);
    }
    if p < 0.024_25 {
        let q = (-2.0 * libm::log(p.max(1e-300))).sqrt();
        return horner(&C, q) / (horner(&D, q) * q + 1.0);
    }
    let q = p - 0.5;
    let r = q * q;
    horner(&A, r) * q / (horner(&B, r) * r + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_read_off_the_ordered_values() {
        let mut values = [5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!(quantiles(&mut values, 4), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(quantiles(&mut values, 2), [1.0, 3.0, 5.0]);
        assert_eq!([0.0, 0.25, 0.3, 1.0, 7.0].map(|share| quantile(&values, share)), [1.0, 2.0, 2.2, 5.0, 5.0]);
        assert_eq!(quantiles(&mut [7.0], 3), [7.0; 4]);
    }

    #[test]
    fn interpolates_linearly_between_quantiles() {
        let transfer = Transfer::new(&[0.0, 1.0, 1.0, 1.0, 4.0], &[10.0, 20.0, 30.0, 40.0, 60.0]);
        let found = [-1.0, 0.0, 0.5, 1.0, 2.5, 4.0, 9.0].map(|x| transfer.at(x));
        assert_eq!(found, [10.0, 10.0, 20.0, 30.0, 45.0, 60.0, 60.0]);
        assert_eq!(Transfer::new(&[3.0; 4], &[0.0, 1.0, 2.0, 3.0]).at(3.0), 1.5);
        // Very close knots, far from the others.
        let mut from: Vec<f32> = (0..500u16).map(|k| f32::from(k) * 1e-6).collect();
        from.push(1e3);
        let to: Vec<f32> = (0..501u16).map(f32::from).collect();
        let transfer = Transfer::new(&from, &to);
        assert!(from.iter().zip(&to).all(|(x, y)| transfer.at(*x) == *y));
        assert!((transfer.at(500.0) - 499.5).abs() < 1e-3);
    }

    #[test]
    fn known_quantiles_of_the_normal_distribution() {
        for (p, x) in [(0.5, 0.0), (0.841_344_746, 1.0), (0.977_249_868, 2.0), (0.001_349_898, -3.0)] {
            assert!((probit(p) - x).abs() < 1e-6, "{p}: {}", probit(p));
        }
        let quantiles = normal_quantiles(1024);
        let variance = quantiles.iter().map(|x| x * x).sum::<f32>() / 1025.0;
        assert!((variance - 1.0).abs() < 0.01, "{variance}");
    }
}
