//! A grid of values that repeats, read between its points by cubic splines.
//!
//! The spline passes through all values and has a continuous curvature, so light on it shows no facets. Its
//! coefficients are those of B-splines, after M. Unser, A. Aldroubi, M. Eden, "B-spline signal processing" (1993).
use crate::ground::cubic::bspline;
use crate::ground::math::clamp;
use crate::ground::number::narrow;
use glam::DVec2;

/// The pole of the filter that gives the coefficients: √3 − 2.
const POLE: f64 = -0.267_949_192_431_122_7;

/// Terms of the first coefficient; the pole to this power is less than 1e-16.
const TERMS: usize = 28;

/// A smooth function, 0..1, through values on a grid that repeats.
#[derive(Clone, Debug)]
pub struct Spline {
    coefficients: Vec<f32>,
    width: usize,
    height: usize,
    /// Distance of points, mm.
    cell: DVec2,
}

/// Columns, and their weights, that a column of a picture reads.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    first: [usize; 4],
    weights: [f32; 4],
}

impl Spline {
    /// The spline through `values`, by rows; the area that repeats has `size` mm.
    ///
    /// # Panics
    /// If there are not `width` × `height` values.
    pub fn new(values: Vec<f32>, width: usize, height: usize, size: DVec2) -> Self {
        assert!(values.len() == width * height && width > 0 && height > 0, "a value for each point");
        let mut coefficients = values;
        let mut line = vec![0.0; width];
        for row in coefficients.chunks_exact_mut(width) {
            line.iter_mut().zip(&*row).for_each(|(line, v)| *line = f64::from(*v));
            filter(&mut line);
            row.iter_mut().zip(&line).for_each(|(v, line)| *v = narrow(*line));
        }
        let mut line = vec![0.0; height];
        for x in 0..width {
            for (y, v) in line.iter_mut().enumerate() {
                *v = f64::from(coefficients[y * width + x]);
            }
            filter(&mut line);
            for (y, v) in line.iter().enumerate() {
                coefficients[y * width + x] = narrow(*v);
            }
        }
        Self { coefficients, width, height, cell: size / DVec2::new(width as f64, height as f64) }
    }

    /// Its memory in bytes.
    pub fn bytes(&self) -> usize {
        4 * self.coefficients.len()
    }

    /// The points that a column at `x` mm reads.
    pub fn column(&self, x: f64) -> Taps {
        taps(x / self.cell.x, self.width)
    }

    /// The points that a row at `y` mm reads.
    pub fn row(&self, y: f64) -> Taps {
        taps(y / self.cell.y, self.height)
    }

    /// The value where a column and a row meet.
    #[inline]
    pub fn value(&self, column: &Taps, row: &Taps) -> f32 {
        let mut sum = 0.0;
        for (y, weight) in row.first.iter().zip(row.weights) {
            let line = &self.coefficients[y * self.width..(y + 1) * self.width];
            let [a, b, c, d] = column.first.map(|x| line[x]);
            let [p, q, r, s] = column.weights;
            sum += weight * ((a * p + b * q) + (c * r + d * s));
        }
        clamp(sum, 0.0, 1.0)
    }

    /// The value at a place in mm.
    pub fn at(&self, p: DVec2) -> f32 {
        self.value(&self.column(p.x), &self.row(p.y))
    }
}

/// The taps at a place in cells; the first point lies at ½.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the grid")]
fn taps(place: f64, count: usize) -> Taps {
    let place = if place.is_finite() { (place - 0.5).rem_euclid(count as f64) } else { 0.0 };
    let cell = (place.floor() as usize).min(count - 1);
    let first = [count - 1, 0, 1, 2].map(|away| (cell + away) % count);
    Taps { first, weights: bspline(narrow(place - place.floor())) }
}

/// Replaces values of a line that repeats by the coefficients of their spline.
fn filter(line: &mut [f64]) {
    let count = line.len();
    let start = |values: &mut dyn Iterator<Item = f64>| {
        let mut power = 1.0;
        values.take(TERMS).fold(0.0, |sum, v| {
            let sum = sum + power * v;
            power *= POLE;
            sum
        })
    };
    line[0] = start(&mut (0..).map(|k| line[(count - k % count) % count]));
    for k in 1..count {
        line[k] += POLE * line[k - 1];
    }
    line[count - 1] = start(&mut (0..).map(|k| line[(count - 1 + k) % count]));
    for k in (0..count - 1).rev() {
        line[k] += POLE * line[k + 1];
    }
    let gain = (1.0 - POLE) * (1.0 - POLE);
    line.iter_mut().for_each(|v| *v *= gain);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_through_values_and_follows_waves() {
        let (width, height, size) = (24, 5, DVec2::new(12.0, 10.0));
        let wave = |x: f64, y: f64| 0.5 + 0.3 * (std::f64::consts::TAU * (x / 6.0 + y / 10.0)).sin();
        let values = (0..width * height)
            .map(|k| narrow(wave(((k % width) as f64 + 0.5) * 0.5, ((k / width) as f64 + 0.5) * 2.0)))
            .collect::<Vec<_>>();
        let spline = Spline::new(values.clone(), width, height, size);
        for (k, v) in values.iter().enumerate() {
            let p = DVec2::new(((k % width) as f64 + 0.5) * 0.5, ((k / width) as f64 + 0.5) * 2.0);
            for p in [p, p + size, p - 3.0 * size] {
                assert!((spline.at(p) - v).abs() < 1e-5, "{p}");
            }
        }
        // Twelve points a wave: between points the error is below a thousandth.
        for k in 0..100 {
            let x = f64::from(k) * 0.12;
            assert!((f64::from(spline.at(DVec2::new(x, 3.0))) - wave(x, 3.0)).abs() < 1e-3);
        }
        assert_eq!(Spline::new(vec![0.25], 1, 1, DVec2::ONE).at(DVec2::new(7.3, f64::NAN)), 0.25);
    }
}
