//! Years of different widths: the calendar, a map from even growth to that of good and bad years.
//!
//! The calendar is applied to the time itself, after branches are blended: weather changes height and thickness
//! equally, a continuous rising time stays so, and all cuts agree. Its kinks lie on ring borders, where they are
//! invisible.
use crate::ground::hash::Hash;

/// Widths of `count` years relative to their mean: log-normal with deviation `sigma` and autocorrelation `memory`
/// between consecutive years, as in tree rings.
pub fn series(count: usize, sigma: f64, memory: f64, hash: Hash) -> Vec<f64> {
    let normal = |i: u64| {
        let (u, v) = (1.0 - hash.unit(2 * i), hash.unit(2 * i + 1));
        (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
    };
    let mut x = normal(0);
    let mut next = |i: usize| {
        if i > 0 {
            x = memory * x + (1.0 - memory * memory).max(0.0).sqrt() * normal(i as u64);
        }
        libm::exp(sigma * x)
    };
    (0..count).map(&mut next).collect()
}

/// Maps even time to the calendar: piecewise linear through (sum of relative widths, year).
#[derive(Clone, Debug, PartialEq)]
pub struct Calendar {
    /// The even time at which each year begins, and the end of the last one.
    starts: Vec<f64>,
    /// For each quarter of an even year the calendar year in which it begins.
    guess: Vec<u32>,
}

impl Calendar {
    /// From relative widths (> 0), which are scaled to mean 1. After the last year they repeat.
    #[expect(clippy::cast_possible_truncation, reason = "years are few")]
    pub fn new(widths: &[f64]) -> Self {
        let mean = widths.iter().sum::<f64>() / widths.len().max(1) as f64;
        let mut starts = vec![0.0];
        let mut sum = 0.0;
        for width in widths {
            sum += (width / mean).max(1e-3);
            starts.push(sum);
        }
        let scale = widths.len() as f64 / sum;
        starts.iter_mut().for_each(|s| *s *= scale);
        let guess = (0..widths.len() * 4)
            .map(|i| (starts.partition_point(|s| *s <= i as f64 * 0.25).max(1) - 1) as u32)
            .collect();
        Self { starts, guess }
    }

    /// Through points (even time, year) as returned by [`points`](Self::points); `None` if they span fewer than two
    /// years.
    pub fn through(points: &[glam::DVec3]) -> Option<Self> {
        let widths: Vec<f64> = points.windows(2).map(|p| p[1].x - p[0].x).collect();
        (widths.len() > 1).then(|| Self::new(&widths))
    }

    /// Converts calendar time to even time.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a year within the table")]
    pub fn even(&self, year: f64) -> f64 {
        let years = self.years() as f64;
        if years == 0.0 || !year.is_finite() {
            return year;
        }
        let turn = (year / years).floor() * years;
        let i = ((year - turn) as usize).min(self.years() - 1);
        turn + self.starts[i] + (year - turn - i as f64) * (self.starts[i + 1] - self.starts[i])
    }

    /// The points of the map: even time and year.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.starts.iter().enumerate().map(|(i, s)| (*s, i as f64))
    }

    /// Number of years until it repeats.
    pub fn years(&self) -> usize {
        self.starts.len() - 1
    }

    /// Converts even time to calendar time.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index within the table")]
    pub fn at(&self, time: f64) -> f64 {
        let years = self.years() as f64;
        if years == 0.0 || !time.is_finite() {
            return time;
        }
        let turn = (time / years).floor() * years;
        let t = time - turn;
        let mut i = self.guess[((t * 4.0) as usize).min(self.guess.len() - 1)] as usize;
        while i + 2 < self.starts.len() && t >= self.starts[i + 1] {
            i += 1;
        }
        let (a, b) = (self.starts[i], self.starts[i + 1]);
        turn + i as f64 + (t - a) / (b - a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn years_have_their_widths_and_time_goes_on() {
        let widths = series(200, 0.3, 0.5, Hash::new(4));
        let mean = widths.iter().sum::<f64>() / 200.0;
        let calendar = Calendar::new(&widths);
        let mut before = calendar.at(-30.0);
        for i in -2999..50_000 {
            let t = calendar.at(f64::from(i) * 0.01);
            assert!(t > before && t - before < 0.08, "{i}");
            assert!((calendar.even(t) - f64::from(i) * 0.01).abs() < 1e-9);
            before = t;
        }
        let points: Vec<_> = calendar.points().map(|(time, year)| glam::DVec3::new(time, year, 0.0)).collect();
        let again = Calendar::through(&points).unwrap();
        assert!((0..900).all(|i| (again.at(f64::from(i) * 0.31) - calendar.at(f64::from(i) * 0.31)).abs() < 1e-9));
        let starts: Vec<f64> = calendar.points().map(|p| p.0).collect();
        for (i, w) in widths.iter().enumerate() {
            assert!((starts[i + 1] - starts[i] - w / mean).abs() < 1e-9);
        }
    }

    #[test]
    fn series_are_like_those_of_trees() {
        let w = series(4000, 0.3, 0.5, Hash::new(9));
        let mean = w.iter().sum::<f64>() / w.len() as f64;
        let variance = w.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        let lag = w.windows(2).map(|p| (p[0] - mean) * (p[1] - mean)).sum::<f64>() / variance;
        let sensitivity = w.windows(2).map(|p| 2.0 * (p[0] - p[1]).abs() / (p[0] + p[1])).sum::<f64>() / w.len() as f64;
        let cv = (variance / w.len() as f64).sqrt() / mean;
        assert!(cv > 0.1 && lag > 0.3 && (0.08..0.6).contains(&sensitivity), "{cv} {lag} {sensitivity}");
    }
}
