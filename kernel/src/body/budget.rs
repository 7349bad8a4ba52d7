//! Finds triangles that are within the error, or the least error at which they are few enough.
use super::even::{Even, Stores};
use super::fewest::fewest;
use super::heights::Heights;
use super::patch::Tolerance;
use super::tiles::{Full, Tiles};
use std::io;

/// How a height field is divided into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// As few triangles as possible, of any form.
    Fewest,
    /// Right triangles, none of them narrow.
    Even,
}

/// Triangles of a height field for any error.
pub struct Mesher<'a> {
    heights: &'a Heights<'a>,
    tolerance: Tolerance,
    even: Option<Even>,
    stores: Stores<'a>,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Mesher<'a> {
    /// Prepares the triangles of a field that is bent as the tolerance states.
    ///
    /// # Errors
    /// Those of the rows of the field and of the stores; [`Interrupted`](io::ErrorKind::Interrupted) if `stop` returns
    /// true.
    pub fn new(
        heights: &'a Heights<'a>,
        pattern: Pattern,
        tolerance: Tolerance,
        stores: Stores<'a>,
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> io::Result<Self> {
        let even = match pattern {
            Pattern::Fewest => None,
            Pattern::Even => Some(Even::new(heights, tolerance, stores, stop)?),
        };
        Ok(Self { heights, tolerance, even, stores, stop })
    }

    /// The triangles within an error in mm; `None` if there are more than `most`.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn within(&self, error: f64, most: u64) -> io::Result<Option<Tiles>> {
        let tolerance = Tolerance { error, ..self.tolerance };
        let room = ((self.stores)(), most);
        let made = match &self.even {
            Some(even) => even.mesh(self.heights, tolerance, room, self.stop),
            None => fewest(self.heights, tolerance, room, self.stop),
        };
        match made {
            Err(error) if error.get_ref().is_some_and(|reason| reason.is::<Full>()) => Ok(None),
            made => made.map(Some),
        }
    }

    /// The least error above `error` at which there are at most `most` triangles and `fits` accepts them, in steps of 2^¼
    /// and rounded up to three digits, with these triangles. The error is tried, so `fits` holds for it. `None` if none does.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn fitting(&self, error: f64, most: u64, fits: impl Fn(&Tiles) -> bool) -> io::Result<Option<(f64, Tiles)>> {
        let at = |step: u32| {
            let stated = step_of(error, step);
            let tiles = self.within(stated, most)?.filter(&fits);
            Ok::<_, io::Error>(tiles.map(|tiles| (stated, tiles)))
        };
        let (mut low, mut high) = (0, 1);
        let mut best = loop {
            if let Some(found) = at(high)? {
                break found;
            }
            // 128 steps are a factor of 2^32, or more than 400 km for an error of 1e-4 mm.
            if high >= 128 {
                return Ok(None);
            }
            (low, high) = (high, 2 * high);
        };
        while high - low > 1 {
            let middle = u32::midpoint(low, high);
            match at(middle)? {
                Some(found) => (high, best) = (middle, found),
                None => low = middle,
            }
        }
        Ok(Some(best))
    }
}

/// An error some steps of 2^¼ above another one, rounded up to three digits.
pub(super) fn step_of(error: f64, step: u32) -> f64 {
    const ROOTS: [f64; 4] = [1.0, 1.189_207_115_002_721, std::f64::consts::SQRT_2, 1.681_792_830_507_429];
    let octaves = (0..step / 4).fold(1.0, |power, _| 2.0 * power);
    let error = error * octaves * ROOTS[step as usize % 4];
    let mut unit = 1.0;
    while error < 100.0 * unit {
        unit /= 10.0;
    }
    while error >= 1000.0 * unit {
        unit *= 10.0;
    }
    // Division by a whole power of ten gives the number that its decimals mean.
    let digits = (error / unit).ceil();
    if unit < 1.0 { digits / (1.0 / unit).round() } else { digits * unit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_numbers() {
        assert_eq!([1, 2, 3, 4].map(|step| step_of(0.01, step)), [0.0119, 0.0142, 0.0169, 0.02]);
        assert_eq!(step_of(5.0, 9), 23.8);
    }

    #[test]
    fn finds_the_least_error_that_fits() {
        let values: Vec<f32> =
            (0..60 * 60).map(|n| ((n % 60) as f32 * 0.7).sin() * ((n / 60) as f32 * 0.4).cos()).collect();
        let heights = Heights::of_canvas(&values, [60, 60], [0.1; 2], [false; 2]).unwrap();
        for pattern in [Pattern::Fewest, Pattern::Even] {
            let mesher =
                Mesher::new(&heights, pattern, Tolerance::flat(1.0), &|| Box::new(Vec::new()), &|| false).unwrap();
            let full = mesher.within(0.01, u64::MAX).unwrap().unwrap().triangles();
            assert!(mesher.within(0.01, full).unwrap().is_some() && mesher.within(0.01, full - 1).unwrap().is_none());
            let (error, tiles) = mesher.fitting(0.01, full / 3, |_| true).unwrap().unwrap();
            assert!(error > 0.01 && tiles.triangles() <= full / 3);
            assert!(mesher.within(error / 1.2, full / 3).unwrap().is_none());
            assert!(mesher.fitting(0.01, u64::MAX, |tiles| tiles.triangles() < 2).unwrap().is_none());
        }
    }
}
