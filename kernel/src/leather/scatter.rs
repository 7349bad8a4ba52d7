//! Spreads values at scattered points over the canvas.
//!
//! Each point has a smooth weight `(1 - d²/r²)²` out to the radius r; a sample is the weighted mean of the values in
//! its reach (Shepard's method with a compact weight), so constants stay constant and nothing overshoots. O(n · r² ·
//! samples per mm²); points are added in their order, so the result has the same bits for any number of threads.
use glam::{IVec2, UVec2, Vec2};
use rayon::prelude::*;

/// Settings of the spreading.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Columns and rows of samples.
    pub size: UVec2,
    /// The canvas in mm.
    pub size_mm: Vec2,
    /// Reach of a value in mm, > 0.
    pub radius: f32,
    /// True if points near an edge also count at the opposite one.
    pub periodic: bool,
    /// Value of the samples that no point reaches.
    pub empty: f32,
}

/// Rows per task.
const ROWS: usize = 16;

/// The weighted means of the `(point, value)` around the centres of equal cells, by rows.
pub fn spread(values: &[(Vec2, f32)], spec: &Spread) -> Vec<f32> {
    let (columns, rows) = (spec.size.x as usize, spec.size.y as usize);
    let step = spec.size_mm / spec.size.as_vec2();
    let reach = Vec2::splat(spec.radius) / step;
    let mut out = vec![spec.empty; columns * rows];
    // The points that reach each band of rows, in their order.
    let bands = rows.div_ceil(ROWS);
    let mut seen = vec![Vec::new(); bands];
    for (n, (place, _)) in (0u32..).zip(values) {
        let at = *place / step;
        let (first, last) = row_range(at.y, reach.y);
        let fold = |row: i32| if spec.periodic { row.rem_euclid(signed(rows)) } else { row };
        let mut band = None;
        for row in first..=last {
            let row = fold(row);
            if (0..signed(rows)).contains(&row) {
                let this = row.unsigned_abs() as usize / ROWS;
                if band != Some(this) && seen[this].last() != Some(&n) {
                    seen[this].push(n);
                }
                band = Some(this);
            }
        }
    }
    out.par_chunks_mut(columns * ROWS).zip(&seen).enumerate().for_each(|(band, (out, seen))| {
        let mut weights = vec![0.0f32; out.len()];
        let mut sums = vec![0.0f32; out.len()];
        for &n in seen {
            let (place, value) = values[n as usize];
            add(place / step, value, spec, band * ROWS, &mut weights, &mut sums);
        }
        for ((out, sum), weight) in out.iter_mut().zip(&sums).zip(&weights) {
            if *weight > 0.0 {
                *out = sum / weight;
            }
        }
    });
    out
}

/// Adds one point, in sample coordinates, to the band of rows that begins at `top`.
fn add(at: Vec2, value: f32, spec: &Spread, top: usize, weights: &mut [f32], sums: &mut [f32]) {
    let columns = spec.size.x as usize;
    let step = spec.size_mm / spec.size.as_vec2();
    let reach = Vec2::splat(spec.radius) / step;
    let count = IVec2::new(signed(columns), spec.size.y.cast_signed());
    let (first, last) = (row_range(at.x, reach.x), row_range(at.y, reach.y));
    for y in last.0..=last.1 {
        let row = if spec.periodic { y.rem_euclid(count.y) } else { y };
        let Some(row) = usize::try_from(row).ok().and_then(|row| row.checked_sub(top)) else { continue };
        if row * columns >= sums.len() {
            continue;
        }
        for x in first.0..=first.1 {
            let column = if spec.periodic { x.rem_euclid(count.x) } else { x };
            let Ok(column) = usize::try_from(column) else { continue };
            if column >= columns {
                continue;
            }
            let d = (Vec2::new(x as f32, y as f32) + 0.5 - at) * step;
            let t = 1.0 - d.length_squared() / (spec.radius * spec.radius);
            if t > 0.0 {
                weights[row * columns + column] += t * t;
                sums[row * columns + column] += t * t * value;
            }
        }
    }
}

/// The samples whose centres lie within `reach` of `at`.
fn row_range(at: f32, reach: f32) -> (i32, i32) {
    (whole((at - reach - 0.5).ceil()), whole((at + reach - 0.5).floor()))
}

#[expect(clippy::cast_possible_truncation, reason = "a small whole number; casts saturate")]
fn whole(value: f32) -> i32 {
    value as i32
}

fn signed(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn spec(periodic: bool) -> Spread {
        Spread { size: UVec2::new(40, 37), size_mm: Vec2::new(20.0, 18.5), radius: 3.0, periodic, empty: -1.0 }
    }

    #[test]
    fn one_place_reaches_its_radius() {
        let out = spread(&[(Vec2::new(10.25, 9.25), 5.0)], &spec(false));
        for (i, v) in out.iter().enumerate() {
            let at = Vec2::new((i % 40) as f32 + 0.5, (i / 40) as f32 + 0.5) * 0.5;
            let inside = (at - Vec2::new(10.25, 9.25)).length() < 3.0;
            assert_eq!(*v, if inside { 5.0 } else { -1.0 }, "{at}");
        }
    }

    #[test]
    fn wraps_edges_of_periodic_canvas() {
        let value = [(Vec2::new(0.1, 0.1), 5.0)];
        assert_eq!(spread(&value, &spec(true))[36 * 40 + 39], 5.0);
        assert_eq!(spread(&value, &spec(false))[36 * 40 + 39], -1.0);
    }

    proptest! {
        #[test]
        fn means_stay_within_the_values(places in prop::collection::vec((-5f32..25.0, -5f32..25.0, 1f32..2.0), 1..40)) {
            let values: Vec<_> = places.iter().map(|&(x, y, v)| (Vec2::new(x, y), v)).collect();
            for periodic in [false, true] {
                for v in spread(&values, &spec(periodic)) {
                    prop_assert!(v == -1.0 || (0.9999..=2.0001).contains(&v));
                }
            }
        }
    }
}
