//! The best depths of films: one-dimensional k-means, exact.
//!
//! Clusters of sorted values are intervals, so dynamic programming finds the least sum of squares (H. Wang, M. Song,
//! "Ckmeans.1d.dp", 2011). The best border moves only one way, so a row of the table takes O(bins · log bins). The first
//! cluster has the depth 0: material that no film opens.

/// Number of bins of the histogram.
pub(super) const BINS: usize = 4096;

/// Numbers of samples, their sums and sums of squares in the bins before each bin.
struct Sums {
    count: Vec<f64>,
    sum: Vec<f64>,
    squares: Vec<f64>,
}

impl Sums {
    /// The sum of squares of the differences from the mean, over the bins `from..to`; from 0 if `pinned`.
    fn cost(&self, from: usize, to: usize, pinned: bool) -> f64 {
        let part = |of: &[f64]| of[to] - of[from];
        let (count, sum, squares) = (part(&self.count), part(&self.sum), part(&self.squares));
        if pinned || count == 0.0 { squares } else { (squares - sum * sum / count).max(0.0) }
    }
}

/// The `films` depths, rising, that are best for these depths, and 0: the least sum of squares of the differences from
/// the nearest one. `most` is the greatest depth. Returns the number of different depths instead if they are too few.
pub(super) fn best(depths: impl Iterator<Item = f64>, most: f64, films: usize) -> Result<Vec<f64>, usize> {
    let (mut counts, mut totals) = (vec![0_u64; BINS], vec![0.0; BINS]);
    for depth in depths {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a bin, limited to the last one")]
        let bin = ((depth / most * BINS as f64) as usize).min(BINS - 1);
        counts[bin] += 1;
        totals[bin] += depth;
    }
    let used: Vec<(f64, f64)> =
        counts.iter().zip(&totals).filter(|(n, _)| **n > 0).map(|(n, total)| (*n as f64, total / *n as f64)).collect();
    let etched = used.iter().filter(|(_, depth)| *depth > 0.0).count();
    if etched < films {
        return Err(etched);
    }
    let mut sums = Sums { count: vec![0.0], sum: vec![0.0], squares: vec![0.0] };
    for (k, (n, depth)) in used.iter().enumerate() {
        sums.count.push(sums.count[k] + n);
        sums.sum.push(sums.sum[k] + n * depth);
        sums.squares.push(sums.squares[k] + n * depth * depth);
    }
    let bins = used.len();
    // The least cost of the bins before each bin, and the first bin of the last cluster, for each number of clusters.
    let mut costs: Vec<f64> = (0..=bins).map(|to| sums.cost(0, to, true)).collect();
    let mut starts = Vec::with_capacity(films);
    for _ in 0..films {
        let (mut next, mut start) = (vec![f64::INFINITY; bins + 1], vec![0; bins + 1]);
        extend(&sums, &costs, (&mut next, &mut start), 0..bins + 1, 0..bins);
        costs = next;
        starts.push(start);
    }
    let (mut depths, mut to) = (Vec::with_capacity(films), bins);
    for start in starts.iter().rev() {
        let from = start[to];
        depths.push((sums.sum[to] - sums.sum[from]) / (sums.count[to] - sums.count[from]));
        to = from;
    }
    depths.reverse();
    Ok(depths)
}

/// Adds a cluster: for each end in `ends`, its best start, which lies in `starts`.
#[expect(clippy::needless_range_loop, reason = "the loop counts bins, which also name costs")]
fn extend(
    sums: &Sums,
    before: &[f64],
    (next, start): (&mut [f64], &mut [usize]),
    ends: std::ops::Range<usize>,
    starts: std::ops::Range<usize>,
) {
    if ends.is_empty() {
        return;
    }
    let middle = usize::midpoint(ends.start, ends.end);
    let mut found = starts.start;
    // A cluster has a bin at least.
    for from in starts.start..(starts.end + 1).min(middle) {
        let cost = before[from] + sums.cost(from, middle, false);
        if cost < next[middle] {
            (next[middle], found) = (cost, from);
        }
    }
    start[middle] = found;
    extend(sums, before, (&mut *next, &mut *start), ends.start..middle, starts.start..found);
    extend(sums, before, (next, start), middle + 1..ends.end, found..starts.end);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_found_exactly() {
        let steps = [0.0, 0.1, 0.13, 0.4, 0.8];
        let depths = (0..1000).map(|k| steps[k % 5]);
        let found = best(depths.clone(), 0.8, 4).unwrap();
        assert!(found.iter().zip(&steps[1..]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        assert_eq!(best(depths, 0.8, 5), Err(4));
    }

    /// The error of some depths, computed value by value.
    fn error(values: &[f64], depths: &[f64]) -> f64 {
        let off = |v: &f64| depths.iter().fold(v * v, |least, depth| least.min((v - depth) * (v - depth)));
        values.iter().map(off).sum()
    }

    /// Compares with all choices of borders between 40 values.
    #[test]
    fn no_other_depths_are_better() {
        let values: Vec<f64> = (0..40_u32).map(|k| f64::from((k * k * 17 + 5) % 97) / 97.0).collect();
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let mut least = f64::INFINITY;
        for a in 0..38 {
            for b in a + 1..39 {
                for c in b + 1..40 {
                    let depths = [mean(&sorted[a..b]), mean(&sorted[b..c]), mean(&sorted[c..])];
                    least = least.min(error(&values, &depths));
                }
            }
        }
        let found = best(values.iter().copied(), 1.0, 3).unwrap();
        assert!(found.is_sorted() && error(&values, &found) <= least + 1e-9, "{found:?}");
    }
}
