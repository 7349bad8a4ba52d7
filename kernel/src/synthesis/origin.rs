//! The origin of a result that wraps on both axes.
//!
//! Repeated, such a result fills the same plane wherever it begins. So its sides are placed where the picture continues
//! best: the content that a piece would show beyond its end is compared with the content there, and the row and column
//! with the smallest difference near them are chosen. With a lattice, the origin moves by lattice vectors only, which
//! keeps the phase.
use super::aniso::Position;
use super::jacobian::Jacobian;
use super::lattice_start::Fitted;
use super::pca::DIMS;
use super::plane::{Lookup, PixelPlane};
use rayon::prelude::*;

/// Number of rows that are examined on each side of an origin.
const NEAR: usize = 4;

/// The column and row of `coords` (`size` pixels) that should be first. `appearance` belongs to the exemplar's pixels
/// at the finest level.
pub fn best_origin(
    coords: &[Position],
    size: [usize; 2],
    j: &Jacobian,
    (plane, appearance): (PixelPlane, &[[f32; DIMS]]),
    fitted: Option<&Fitted>,
) -> [usize; 2] {
    let differences = differences(coords, size, j, (plane, appearance));
    let [columns, rows] = [differences.0, differences.1].map(|line| nearby(&line));
    let Some(fitted) = fitted else {
        return [columns, rows].map(|line| (0..line.len()).min_by_key(|&k| (line[k], k)).unwrap_or(0));
    };
    let m = fitted.map;
    let (mut best, mut least) = ([0, 0], columns[0] + rows[0]);
    for (y, row) in rows.iter().enumerate() {
        for (x, column) in columns.iter().enumerate() {
            if column + row < least {
                let (px, py) = (x as f64, y as f64);
                let c = fitted.basis.coordinates([m[0][0] * px + m[0][1] * py, m[1][0] * px + m[1][1] * py]);
                let off = fitted.basis.at(c[0] - c[0].round(), c[1] - c[1].round());
                if off[0].abs().max(off[1].abs()) <= 0.5 {
                    (best, least) = ([x, y], column + row);
                }
            }
        }
    }
    best
}

/// Differences of the next pixels from the continuation of the exemplar, summed by columns and by rows. Whole numbers,
/// so that sums do not depend on their order.
fn differences(
    coords: &[Position],
    [w, h]: [usize; 2],
    j: &Jacobian,
    (plane, appearance): (PixelPlane, &[[f32; DIMS]]),
) -> (Vec<u64>, Vec<u64>) {
    #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar, or a step beyond")]
    let cell = |[x, y]: Position| plane.index(x.floor() as i32, y.floor() as i32);
    let step = |from: Position, to: Position, by: [f32; 2]| -> u64 {
        let on = [from[0] + by[0], from[1] + by[1]];
        if on == to {
            return 0;
        }
        let (wanted, shown) = (cell(on), cell(to));
        if wanted == shown {
            return 0;
        }
        let (a, b) = (&appearance[wanted], &appearance[shown]);
        let square: f32 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast of floats saturates")]
        let steps = (square.sqrt() * 4096.0) as u32;
        u64::from(steps)
    };
    let bands = (0..h).into_par_iter().with_min_len(16).fold(
        || (vec![0; w], Vec::new()),
        |(mut columns, mut rows), y| {
            let (row, below) = (&coords[y * w..(y + 1) * w], &coords[(y + 1) % h * w..][..w]);
            let mut sum = 0;
            for (x, column) in columns.iter_mut().enumerate() {
                let here = step(row[x], row[(x + 1) % w], [j[0], j[2]]) + step(row[x], below[x], [j[1], j[3]]);
                *column += here;
                sum += here;
            }
            rows.push(sum);
            (columns, rows)
        },
    );
    bands.reduce(
        || (vec![0; w], Vec::new()),
        |(mut columns, mut rows), more| {
            columns.iter_mut().zip(more.0).for_each(|(column, more)| *column += more);
            rows.extend(more.1);
            (columns, rows)
        },
    )
}

/// For each possible first row (or column), the sum over [`NEAR`] rows on both sides of it.
fn nearby(line: &[u64]) -> Vec<u64> {
    let n = line.len();
    let before = NEAR % n;
    (0..n).map(|k| (0..2 * NEAR).map(|d| line[(k + n - before + d) % n]).sum()).collect()
}

/// Rotates `map` (`size` pixels) to begin at column and row `first`.
pub fn starting_at(map: Vec<Position>, [w, h]: [usize; 2], first: [usize; 2]) -> Vec<Position> {
    if first == [0, 0] {
        return map;
    }
    (0..w * h).map(|p| map[(p / w + first[1]) % h * w + (p % w + first[0]) % w]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthesis::lattice::Basis;

    const JOINED: PixelPlane = PixelPlane { w: 16, h: 16, wrap: [true; 2] };

    /// The exemplar, repeated, with one rectangle moved by (5, 3).
    fn patched(n: usize, x: std::ops::Range<usize>, y: std::ops::Range<usize>) -> Vec<Position> {
        let place = |k: usize, moved: usize| ((k + moved) % 16) as f32 + 0.5;
        (0..n * n)
            .map(|p| match x.contains(&(p % n)) && y.contains(&(p / n)) {
                true => [place(p % n, 5), place(p / n, 3)],
                false => [place(p % n, 0), place(p / n, 0)],
            })
            .collect()
    }

    fn appearance() -> Vec<[f32; DIMS]> {
        let hash = crate::ground::hash::Hash::new(3);
        (0..256).map(|p| std::array::from_fn(|d| hash.unit_f32(8 * p + d as u64))).collect()
    }

    #[test]
    fn places_sides_away_from_joints() {
        let (map, looks) = (patched(32, 0..10, 28..32), appearance());
        let j = [1.0, 0.0, 0.0, 1.0];
        let [x, y] = best_origin(&map, [32; 2], &j, (JOINED, &looks), None);
        // Pieces end before columns 0 and 10 and before rows 28 and 32: a side is at least four pixels away.
        let off = |k: usize, end: usize| (k + 32 - end).min((end + 64 - k) % 32) % 32;
        assert!([0, 10].iter().all(|&end| off(x, end) >= 4) && [28, 0].iter().all(|&end| off(y, end) >= 4), "{x} {y}");
        let moved = starting_at(map.clone(), [32; 2], [x, y]);
        assert_eq!(moved[0], map[y * 32 + x]);
        assert_eq!(best_origin(&moved, [32; 2], &j, (JOINED, &looks), None), [0, 0]);
        let whole = patched(32, 0..0, 0..0);
        assert_eq!(best_origin(&whole, [32; 2], &j, (JOINED, &looks), None), [0, 0]);
        let [x, y] = best_origin(&map[..3], [3, 1], &j, (JOINED, &looks), None);
        assert!(x < 3 && y == 0);
    }

    #[test]
    fn keeps_phase_of_lattice() {
        let (map, looks) = (patched(32, 0..10, 28..32), appearance());
        let fitted = Fitted { basis: Basis { a: [8.0, 0.0], b: [4.0, 4.0] }, map: [[1.0, 0.0], [0.0, 1.0]] };
        let [x, y] = best_origin(&map, [32; 2], &[1.0, 0.0, 0.0, 1.0], (JOINED, &looks), Some(&fitted));
        assert!([x, y] != [0, 0] && x % 4 == 0 && y % 4 == 0 && (x + y) % 8 == 0, "{x} {y}");
    }
}
