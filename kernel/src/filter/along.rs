//! Line integral convolution: means along the streamlines of a direction field.
//!
//! Source: B. Cabral, L. Leedom, "Imaging vector fields using line integral convolution" (1993). From each pixel a
//! streamline is followed both ways in steps of about a pixel, by the midpoint rule, with the direction of the nearest
//! pixel. Opposite directions are the same line: each step takes the sign nearest to the step before. Cost: O(pixels ·
//! length in pixels), about 15 ns for each.

use super::paths::Reader;
use crate::ground::math::{clamp, cos_degrees, floor_int, sin_degrees};
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::{Buffer, Window};

/// Maximum number of samples to each side.
const MOST: f64 = 256.0;

/// Directions in a window, as unit vectors.
pub struct Directions {
    planes: [Buffer; 2],
    window: Window,
}

impl Directions {
    /// Takes angles in degrees.
    pub fn new(angles: &View<'_>) -> Self {
        let window = angles.window();
        let planes = [cos_degrees as fn(f32) -> f32, sin_degrees].map(|part| {
            let mut plane = Buffer::zeros(window.len());
            let w = window.columns();
            for (row, y) in plane.chunks_exact_mut(w.max(1)).zip(window.y..) {
                row.iter_mut().zip(angles.row(window.x, y, w)).for_each(|(out, angle)| *out = part(*angle));
            }
            plane
        });
        Self { planes, window }
    }

    /// Direction at `at` pixels from the centre of pixel (x, y): that of the nearest pixel.
    #[inline(always)]
    fn at(&self, x: i32, y: i32, at: [f32; 2]) -> [f32; 2] {
        let near = |d: f32| floor_int(clamp(d, -1e6, 1e6) + 0.5).1;
        let place = |at: i32, n: usize| offset(at.max(0)).min(n - 1);
        let column = place(x - self.window.x + near(at[0]), self.window.columns());
        let row = place(y - self.window.y + near(at[1]), self.window.rows());
        let k = row * self.window.columns() + column;
        [self.planes[0][k], self.planes[1][k]]
    }
}

/// The sampling of streamlines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineSpec {
    /// Length of a step in pixels, across and down.
    step: [f32; 2],
    /// Number of steps to each side.
    count: usize,
}

impl LineSpec {
    /// Takes the length of lines in mm and the size of a pixel in mm.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a limited number, and steps in f32")]
    pub fn new(length: f64, pixel: [f64; 2]) -> Self {
        let half = 0.5 * length;
        let count = (half / pixel[0].min(pixel[1])).ceil().clamp(1.0, MOST);
        Self { step: pixel.map(|pixel| (half / count / pixel) as f32), count: count as usize }
    }
}

/// Mean along the streamline through each pixel of `rect`.
///
/// # Panics
/// If a plane is smaller than `rect`.
pub fn along(input: &Reader<'_>, lines: &Directions, rect: Window, spec: &LineSpec, out: &mut [&mut [f32]]) {
    let [sx, sy] = spec.step;
    let share = 1.0 / (2 * spec.count + 1) as f32;
    for k in 0..rect.len() {
        let (x, y) = (rect.x + index(k % rect.columns()), rect.y + index(k / rect.columns()));
        let here = lines.at(x, y, [0.0; 2]);
        let mut sum = input.at(x, y, [0.0; 2]);
        for way in [1.0, -1.0] {
            let (mut at, mut before) = ([0.0; 2], here.map(|v| way * v));
            let onward = |place: [f32; 2], before: [f32; 2]| {
                let way = lines.at(x, y, place);
                let same = way[0] * before[0] + way[1] * before[1] >= 0.0;
                if same { way } else { way.map(|v| -v) }
            };
            for _ in 0..spec.count {
                let first = onward(at, before);
                let middle = onward([at[0] + 0.5 * sx * first[0], at[1] + 0.5 * sy * first[1]], first);
                at = [at[0] + sx * middle[0], at[1] + sy * middle[1]];
                before = middle;
                sum.iter_mut().zip(input.at(x, y, at)).for_each(|(sum, v)| *sum += v);
            }
        }
        out.iter_mut().zip(sum).for_each(|(out, sum)| out[k] = sum * share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of a formula over a window.
    fn plane(window: Window, value: impl Fn(f32, f32) -> f32) -> Vec<f32> {
        let w = window.columns();
        (0..window.len()).map(|k| value((window.x + index(k % w)) as f32, (window.y + index(k / w)) as f32)).collect()
    }

    fn mean(angle: impl Fn(f32, f32) -> f32, value: impl Fn(f32, f32) -> f32, length: f64) -> Vec<f32> {
        let rect = Window::of(0, 0, 40, 40);
        let big = rect.with_halo([30, 30]);
        let (angles, values) = (plane(big, angle), plane(big, value));
        let mut out = vec![0.0; rect.len()];
        let lines = Directions::new(&View::new(&angles, big));
        let spec = LineSpec::new(length, [0.5, 0.5]);
        along(&Reader::new(&[View::new(&values, big)]), &lines, rect, &spec, &mut [&mut out]);
        out
    }

    #[test]
    fn straight_lines_are_running_means() {
        // 4 mm are 8 pixels, so nine samples. On a parabola the mean of (x + k)² is x² + 20/3.
        let out = mean(|_, _| 0.0, |x, _| x * x, 4.0);
        assert!((0..40).all(|x| (out[800 + x] - ((x * x) as f32 + 20.0 / 3.0)).abs() < 1e-3 * (1.0 + (x * x) as f32)));
        // Directions that alternate in sign from column to column are the same lines.
        let flipped = mean(|x, _| if x % 2.0 == 0.0 { 90.0 } else { -90.0 }, |_, y| y * y, 4.0);
        assert!((flipped[20 * 40 + 7] - (400.0 + 20.0 / 3.0)).abs() < 0.01, "{}", flipped[20 * 40 + 7]);
    }

    #[test]
    fn circles_are_followed() {
        // Circles around (20, 20) keep a value that depends only on the distance.
        let round = |x: f32, y: f32| (y - 20.0).atan2(x - 20.0).to_degrees() + 90.0;
        let distance = |x: f32, y: f32| (x - 20.0).hypot(y - 20.0);
        let out = mean(round, distance, 20.0);
        for (x, y) in [(35usize, 20usize), (20, 8), (30, 31), (9, 25)] {
            let (got, want) = (out[y * 40 + x], distance(x as f32, y as f32));
            assert!((got - want).abs() < 0.25, "{x} {y}: {got} {want}");
        }
        // The mean along a straight line is far off: its ends have (11² + 20²)^½.
        assert!(mean(|_, _| 90.0, distance, 20.0)[20 * 40 + 31] > 13.0);
    }
}
