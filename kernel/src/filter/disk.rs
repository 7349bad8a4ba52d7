//! Disks of pixels: the neighbourhoods of medians and morphology.

use crate::ground::window::{index, offset};

/// Pixels whose centres lie within a radius of the central pixel, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Disk {
    /// Half-widths of the rows dy = 0, 1, …; rows above and below are symmetric.
    halves: Vec<i32>,
}

/// The tolerance for pixels on the circle, in pixels, so that rounding does not decide.
const ROUNDING: f64 = 1e-6;

impl Disk {
    /// The disk of `radius` mm, with pixels of `step` mm.
    #[expect(clippy::cast_possible_truncation, reason = "a number of pixels")]
    pub fn new(radius: f64, step: [f64; 2]) -> Self {
        let across = |dy: f64| (radius * radius - dy * dy * step[1] * step[1]).max(0.0).sqrt() / step[0];
        let rows = (radius.max(0.0) / step[1] + ROUNDING).floor().min(1e6) as i32;
        Self { halves: (0..=rows).map(|dy| (across(f64::from(dy)) + ROUNDING).floor().min(1e6) as i32).collect() }
    }

    /// Half-width of each row, from the middle on.
    pub fn halves(&self) -> &[i32] {
        &self.halves
    }

    /// Halo in pixels, in x and y.
    pub fn halo(&self) -> [usize; 2] {
        [offset(self.halves[0]), self.halves.len() - 1]
    }

    /// Rows from the top: offset and half-width.
    pub fn rows(&self) -> impl Iterator<Item = (i32, i32)> + '_ {
        let last = index(self.halves.len() - 1);
        (-last..=last).map(|dy| (dy, self.halves[offset(dy.abs())]))
    }

    /// Number of pixels.
    pub fn count(&self) -> usize {
        self.rows().map(|(_, half)| 2 * offset(half) + 1).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_within_the_radius_and_no_others() {
        for (radius, step) in
            [(0.0, [1.0, 1.0]), (0.99, [1.0, 1.0]), (2.0, [1.0, 1.0]), (3.7, [0.5, 0.8]), (0.3, [0.1, 0.1])]
        {
            let disk = Disk::new(radius, step);
            let mut count = 0;
            for dy in -20..=20 {
                for dx in -20..=20 {
                    let far = f64::hypot(f64::from(dx) * step[0], f64::from(dy) * step[1]);
                    let within = far <= radius + 1e-9;
                    assert_eq!(disk.rows().any(|(y, half)| y == dy && dx >= -half && dx <= half), within, "{dx} {dy}");
                    count += usize::from(within);
                }
            }
            assert_eq!(disk.count(), count);
        }
        assert_eq!(Disk::new(2.0, [1.0; 2]).halves(), [2, 1, 0]);
        assert_eq!(Disk::new(0.3, [0.1, 0.1]).halo(), [3, 3]);
    }
}
