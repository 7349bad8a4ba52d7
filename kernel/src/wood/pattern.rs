//! The colours of a year, indexed by the fraction of the growth time (Momoi & Takatera 2014, §4.3). A whole number is
//! the start of early wood; interpolation is cyclic.

/// The fraction of a time within its year, 0 ≤ x < 1, also for negative times.
#[inline(always)]
pub fn phase(time: f64) -> f64 {
    let f = time - time.floor();
    if f < 1.0 { f } else { 0.0 }
}

/// The index in a table of `n` entries at `time`: floor(frac(T) · n).
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 ≤ frac · n, limited to the table")]
pub fn index(time: f64, n: usize) -> usize {
    ((phase(time) * n as f64) as usize).min(n.saturating_sub(1))
}

/// The colour at `time`, without interpolation.
#[inline]
pub fn nearest(table: &[[f32; 3]], time: f64) -> [f32; 3] {
    table[index(time, table.len())]
}

/// The colour at `time`, linear between the centres of entries, cyclic.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "entries are limited to the table")]
#[inline]
pub fn linear(table: &[[f32; 3]], time: f64) -> [f32; 3] {
    let n = table.len();
    let at = phase(time) * n as f64 - 0.5;
    let below = at.floor();
    let t = (at - below) as f32;
    let i = if below < 0.0 { n - 1 } else { (below as usize).min(n - 1) };
    let (a, b) = (table[i], table[(i + 1) % n]);
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
}

/// A table of `n` entries from stops in ascending order, cyclic; each entry is the mean of the ramp over its part of
/// the year. Two stops at the same position make an edge.
#[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
pub fn table(stops: &[(f64, [f32; 3])], n: usize) -> Vec<[f32; 3]> {
    let at = |phase: f64| -> [f32; 3] {
        let i = stops.partition_point(|s| s.0 <= phase);
        let (a, b) = match i {
            0 => (stops[stops.len() - 1], stops[0]),
            i if i == stops.len() => (stops[i - 1], stops[0]),
            i => (stops[i - 1], stops[i]),
        };
        let (from, to) = (if i == 0 { a.0 - 1.0 } else { a.0 }, if i == stops.len() { b.0 + 1.0 } else { b.0 });
        let t = if to > from { ((phase - from) / (to - from)) as f32 } else { 0.0 };
        std::array::from_fn(|c| a.1[c] + (b.1[c] - a.1[c]) * t)
    };
    let parts = 16;
    let entry = |i: usize| {
        let sum = (0..parts).fold([0.0_f32; 3], |sum, k| {
            let c = at((i as f64 + (f64::from(k) + 0.5) / f64::from(parts)) / n as f64);
            std::array::from_fn(|j| sum[j] + c[j])
        });
        sum.map(|v| v / parts as f32)
    };
    (0..n).map(entry).collect()
}

/// Scales the contrast of the colours of a table: multiplies their distance from the mean, in the logarithm, by
/// `contrast`.
pub fn contrast(table: &mut [[f32; 3]], contrast: f32) {
    if contrast == 1.0 {
        return;
    }
    let n = table.len() as f32;
    let mut mean = [0.0; 3];
    table.iter().for_each(|c| (0..3).for_each(|k| mean[k] += c[k].max(1e-5) / n));
    for color in table {
        for (value, mean) in color.iter_mut().zip(mean) {
            *value = mean * crate::ground::math::pow(value.max(1e-5) / mean, contrast);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_stops_per_entry() {
        let table = table(&[(0.0, [0.0; 3]), (0.5, [1.0; 3]), (0.5, [0.0; 3]), (1.0, [0.0; 3])], 8);
        for (entry, want) in table.iter().zip([0.125, 0.375, 0.625, 0.875, 0.0, 0.0, 0.0, 0.0]) {
            assert!((entry[0] - want).abs() < 1e-6, "{entry:?}");
        }
    }
}
