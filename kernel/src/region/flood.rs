//! Connected components of a mask.
//!
//! The runs of pixels of each row are joined with the runs that they touch in the previous row (union-find over runs).
//! Cost: O(pixels).

/// A run of pixels inside the mask: the first pixel and one past the last.
type Run = [u32; 2];

/// Runs with their union-find links: an earlier run of the same piece; the first run of a piece links to itself.
struct Forest {
    runs: Vec<Run>,
    /// Index of the first run of each row; one more entry marks the end.
    rows: Vec<usize>,
    before: Vec<usize>,
}

impl Forest {
    fn first(&mut self, mut run: usize) -> usize {
        while self.before[run] != run {
            // Path halving.
            self.before[run] = self.before[self.before[run]];
            run = self.before[run];
        }
        run
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.first(a), self.first(b));
        self.before[a.max(b)] = a.min(b);
    }

    fn add_row(&mut self, mask: &[f32]) {
        let mut x = 0;
        while x < mask.len() {
            let Some(skipped) = mask[x..].iter().position(|v| *v >= 0.5) else { break };
            let from = x + skipped;
            x = mask[from..].iter().position(|v| *v < 0.5 || v.is_nan()).map_or(mask.len(), |length| from + length);
            self.before.push(self.runs.len());
            self.runs.push([from, x].map(super::pieces::index));
        }
        self.rows.push(self.runs.len());
    }

    /// Joins the runs of two rows that have columns in common.
    fn join_rows(&mut self, upper: usize, lower: usize) {
        let (mut a, a_end) = (self.rows[upper], self.rows[upper + 1]);
        let (mut b, b_end) = (self.rows[lower], self.rows[lower + 1]);
        while a < a_end && b < b_end {
            let (one, other) = (self.runs[a], self.runs[b]);
            if one[0] < other[1] && other[0] < one[1] {
                self.join(a, b);
            }
            if one[1] <= other[1] {
                a += 1;
            } else {
                b += 1;
            }
        }
    }
}

/// Numbers the pieces of `mask`, a picture with rows of `width` pixels: pixels of at least ½, connected by their sides,
/// also across the border in the directions that `wrap`. Pieces are numbered from 1 by their first pixels in reading
/// order; other pixels get 0. Returns the number of pieces.
pub fn label(mask: &[f32], width: usize, wrap: [bool; 2], ids: &mut [f32]) -> usize {
    let mut forest = Forest { runs: Vec::new(), rows: vec![0], before: Vec::new() };
    for (y, row) in mask.chunks_exact(width.max(1)).enumerate() {
        forest.add_row(row);
        if y > 0 {
            forest.join_rows(y - 1, y);
        }
        let (first, end) = (forest.rows[y], forest.rows[y + 1]);
        if wrap[0] && first < end && forest.runs[first][0] == 0 && forest.runs[end - 1][1] as usize == width {
            forest.join(first, end - 1);
        }
    }
    let height = forest.rows.len() - 1;
    if wrap[1] && height > 1 {
        forest.join_rows(height - 1, 0);
    }
    ids.fill(0.0);
    let (mut numbers, mut count) = (vec![0.0_f32; forest.runs.len()], 0);
    for (y, row) in ids.chunks_exact_mut(width.max(1)).enumerate() {
        for run in forest.rows[y]..forest.rows[y + 1] {
            let first = forest.first(run);
            if first == run {
                count += 1;
            }
            numbers[run] = if first == run { count as f32 } else { numbers[first] };
            let [from, to] = forest.runs[run].map(|x| x as usize);
            row[from..to].fill(numbers[run]);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    /// Labels pieces by walking from pixel to pixel, started in reading order.
    fn walked(mask: &[f32], [w, h]: [usize; 2], wrap: [bool; 2]) -> Vec<f32> {
        let (mut ids, mut count) = (vec![0.0; mask.len()], 0.0);
        for start in 0..mask.len() {
            if mask[start] < 0.5 || ids[start] > 0.0 {
                continue;
            }
            count += 1.0;
            let mut open = vec![start];
            while let Some(i) = open.pop() {
                if mask[i] < 0.5 || ids[i] > 0.0 {
                    continue;
                }
                ids[i] = count;
                let (x, y) = (i % w, i / w);
                if x > 0 || wrap[0] {
                    open.push(y * w + (x + w - 1) % w);
                }
                if x + 1 < w || wrap[0] {
                    open.push(y * w + (x + 1) % w);
                }
                if y > 0 || wrap[1] {
                    open.push((y + h - 1) % h * w + x);
                }
                if y + 1 < h || wrap[1] {
                    open.push((y + 1) % h * w + x);
                }
            }
        }
        ids
    }

    #[test]
    fn finds_the_pieces_of_a_flood_fill() {
        for (seed, [w, h]) in [(1, [40, 30]), (2, [7, 50]), (3, [64, 1]), (4, [1, 20]), (5, [1, 1]), (6, [33, 33])] {
            for share in [0.3_f32, 0.55, 0.62, 0.8, 1.0] {
                for wrap in [[false, false], [true, false], [false, true], [true, true]] {
                    let hash = Hash::new(seed);
                    let mask: Vec<f32> =
                        (0..w * h).map(|i| if hash.unit_f32(i as u64) < share { 0.5 } else { 0.49 }).collect();
                    let mut ids = vec![9.0; mask.len()];
                    let count = label(&mask, w, wrap, &mut ids);
                    let want = walked(&mask, [w, h], wrap);
                    assert_eq!(ids, want, "{w} {h} {share} {wrap:?}");
                    assert_eq!(count as f32, want.iter().copied().fold(0.0, f32::max));
                }
            }
        }
    }
}
