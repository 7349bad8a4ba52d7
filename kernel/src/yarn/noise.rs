//! Smooth random numbers that repeat.
use crate::ground::hash::Hash;

/// A cell of a circle of `count` cells, its share, and the next cell.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and below the count")]
fn cell(x: f64, count: u32) -> (u64, u64, f64) {
    let floor = x.floor();
    let first = floor.rem_euclid(f64::from(count)) as u64 % u64::from(count);
    let next = if first + 1 == u64::from(count) { 0 } else { first + 1 };
    (first, next, x - floor)
}

#[inline(always)]
fn quintic(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// A smooth random curve of mean 0 between -1 and 1, with `count` values on a circle of circumference `count`.
#[inline(always)]
pub(super) fn ring(hash: Hash, x: f64, count: u32) -> f64 {
    let (a, b, t) = cell(x, count.max(1));
    let [a, b] = [a, b].map(|n| 2.0 * hash.unit(n) - 1.0);
    a + (b - a) * quintic(t)
}

/// The same on a torus of `counts` values.
#[inline(always)]
pub(super) fn torus(hash: Hash, [x, y]: [f64; 2], counts: [u32; 2]) -> f64 {
    let (xa, xb, tx) = cell(x, counts[0].max(1));
    let (ya, yb, ty) = cell(y, counts[1].max(1));
    let at = |x: u64, y: u64| 2.0 * f64::from(hash.unit_f32((y << 32) | x)) - 1.0;
    let tx = quintic(tx);
    let [up, down] = [ya, yb].map(|y| {
        let (a, b) = (at(xa, y), at(xb, y));
        a + (b - a) * tx
    });
    up + (down - up) * quintic(ty)
}

/// A number of cells on a length.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
pub(super) fn cells(length: f64, cell: f64) -> u32 {
    (length / cell).round().clamp(1.0, 1e9) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_repeats_and_is_smooth() {
        let hash = Hash::new(3);
        for k in 0..200 {
            let x = 0.173 * f64::from(k) - 9.0;
            assert!((ring(hash, x, 7) - ring(hash, x + 7.0, 7)).abs() < 1e-9);
            assert!((ring(hash, x, 7) - ring(hash, x + 1e-4, 7)).abs() < 1e-3);
            let at = [x, 0.4 * x];
            assert!((torus(hash, at, [5, 3]) - torus(hash, [at[0] - 5.0, at[1] + 6.0], [5, 3])).abs() < 1e-6);
        }
        assert_eq!(cells(0.1, 5.0), 1);
        assert_eq!(cells(12.0, 5.0), 2);
    }
}
