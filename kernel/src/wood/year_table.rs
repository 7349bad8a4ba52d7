//! All the years of a tree in one table, and its mean over any span of time: filtered lookup of thin rings, by repeated
//! integration (P. Heckbert, 1986).
//!
//! Time is nearly linear inside a pixel with edges u and v, so its distribution there is box(A) ∗ box(B) with A =
//! |∂T/∂u| and B = |∂T/∂v|. Prefix sums of the table and of its prefix sums give the exact mean of a piecewise constant
//! table over it with four look-ups. The mean is subtracted first, so that both sums are periodic and no digits are
//! lost.
use super::pattern;
use super::years::Calendar;
use crate::ground::hash::Hash;
use crate::ground::number::narrow;

/// A table entry: red, green, blue, and the share of late wood.
pub type Entry = [f32; 4];

/// Variation between years.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    /// Relative deviation of the depth of late wood.
    pub depth: f64,
    /// Deviation of the logarithm of the power that is applied to the phase of a year.
    pub phase: f64,
}

/// A table of many years.
#[derive(Clone, Debug)]
pub struct YearTable {
    per_year: usize,
    years: usize,
    /// 1 / `years`.
    inverse: f64,
    mean: Entry,
    /// The table without its mean.
    rest: Vec<Entry>,
    /// Its sum up to each entry, in years, minus the mean of the sums.
    first: Vec<[f64; 4]>,
    /// The sum of `first`.
    second: Vec<[f64; 4]>,
}

/// Maximum number of years of a table by even time.
const MOST: usize = 1024;

fn lcm(a: usize, b: usize) -> Option<usize> {
    let (mut x, mut y) = (a, b);
    while y > 0 {
        (x, y) = (y, x % y);
    }
    (x > 0).then(|| a / x * b)
}

/// Up to this number, entries are summed one by one.
const FEW: f64 = 8.0;

/// Entries per year.
const PER_YEAR: usize = 128;

impl YearTable {
    /// Builds a table of `years` years from a pattern with `entries` per year. Cycles through the pattern's years; each
    /// year varies a little. `late` is the share of late wood of each entry of one year, 0..1.
    pub fn new(pattern: &[[f32; 3]], entries: usize, late: &[f32], years: usize, vary: Variation, hash: Hash) -> Self {
        let given = (pattern.len() / entries.max(1)).max(1);
        let normal = |i: u64| {
            let (u, v) = (1.0 - hash.unit(2 * i), hash.unit(2 * i + 1));
            (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
        };
        let early = early_color(pattern, late);
        let mut table = Vec::with_capacity(years * PER_YEAR);
        for year in 0..years {
            let from = (year % given) * entries;
            let colors = &pattern[from..from + entries];
            let depth = narrow((1.0 + vary.depth * normal(2 * year as u64)).clamp(0.15, 1.9));
            let power = libm::exp(vary.phase * normal(2 * year as u64 + 1).clamp(-2.0, 2.0));
            for k in 0..PER_YEAR {
                let bent = libm::pow((k as f64 + 0.5) / PER_YEAR as f64, power);
                let (color, share) = (smooth(colors, bent), one(late, bent));
                // Deeper late wood is farther from the early wood, in the logarithm so that it stays positive.
                let shade = |c: usize| {
                    early[c] * narrow(libm::pow(f64::from(color[c] / early[c]), f64::from(1.0 + (depth - 1.0) * share)))
                };
                table.push([shade(0), shade(1), shade(2), share * depth.min(1.25)]);
            }
        }
        Self::of_table(&table, PER_YEAR)
    }

    /// From a table of whole years with `per_year` entries each.
    pub fn of_table(table: &[Entry], per_year: usize) -> Self {
        let n = table.len();
        let step = 1.0 / per_year as f64;
        let mean_of = |sum: [f64; 4]| sum.map(|s| s / n as f64);
        let add = |a: [f64; 4], b: [f64; 4], f: f64| std::array::from_fn(|c| a[c] + b[c] * f);
        let mean = mean_of(table.iter().fold([0.0; 4], |sum, e| add(sum, e.map(f64::from), 1.0)));
        let exact: Vec<[f64; 4]> = table.iter().map(|e| add(e.map(f64::from), mean, -1.0)).collect();
        let mut first = vec![[0.0; 4]; n];
        for i in 1..n {
            first[i] = add(first[i - 1], exact[i - 1], step);
        }
        // The mean of the piecewise linear sum is the mean of the middles of its segments.
        let middle = (0..n).fold([0.0; 4], |sum, i| add(sum, add(first[i], exact[i], 0.5 * step), 1.0));
        let offset = mean_of(middle);
        first.iter_mut().for_each(|v| *v = add(*v, offset, -1.0));
        let mut second = vec![[0.0; 4]; n];
        for i in 1..n {
            second[i] = add(add(second[i - 1], first[i - 1], step), exact[i - 1], 0.5 * step * step);
        }
        let rest = exact.iter().map(|e| e.map(narrow)).collect();
        let years = n / per_year;
        Self { per_year, years, inverse: 1.0 / years as f64, mean: mean.map(narrow), rest, first, second }
    }

    /// The same by even time instead of the calendar's, which is not linear inside a pixel. `None` if it would take
    /// more than `MOST` years until both repeat.
    pub fn by_even_time(&self, calendar: &Calendar) -> Option<Self> {
        let years = lcm(self.years, calendar.years()).filter(|years| *years <= MOST)?;
        const PARTS: usize = 4;
        let fine = 1.0 / (PER_YEAR * PARTS) as f64;
        let mean = |from: f64, to: f64| -> [f64; 4] {
            let (low, high) = (self.first_at(from), self.first_at(to));
            let width = (to - from).max(1e-9);
            std::array::from_fn(|c| f64::from(self.mean[c]) + (high[c] - low[c]) / width)
        };
        let mut before = calendar.at(0.0);
        let mut next = 0.0;
        let entries = 0..years * PER_YEAR;
        let table: Vec<Entry> = entries
            .map(|_| {
                let mut sum = [0.0; 4];
                for _ in 0..PARTS {
                    next += 1.0;
                    let after = calendar.at(next * fine);
                    let part = mean(before, after);
                    (0..4).for_each(|c| sum[c] += part[c] / PARTS as f64);
                    before = after;
                }
                sum.map(narrow)
            })
            .collect();
        Some(Self::of_table(&table, PER_YEAR))
    }

    /// Number of years until the table repeats.
    pub fn years(&self) -> usize {
        self.years
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        self.rest.len() * (16 + 32 + 32)
    }

    /// The index of the entry at a time, and the position of the time within it, in years.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index within the table")]
    fn locate(&self, time: f64) -> (usize, f64) {
        let span = self.years as f64;
        let t = (time - (time * self.inverse).floor() * span) * self.per_year as f64;
        let i = (t as usize).min(self.rest.len() - 1);
        (i, (t - i as f64) / self.per_year as f64)
    }

    /// The entry at a time, unfiltered.
    #[inline(always)]
    pub fn at(&self, time: f64) -> Entry {
        let entry = &self.rest[self.locate(if time.is_finite() { time } else { 0.0 }).0];
        std::array::from_fn(|c| self.mean[c] + entry[c])
    }

    /// The mean over `width` years from a time on, if they span few entries.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a part of an entry, to f32")]
    fn few(&self, from: f64, width: f64) -> Entry {
        let (mut i, into) = self.locate(from);
        let per_year = self.per_year as f64;
        let (mut left, mut free) = ((width * per_year) as f32, 1.0 - (into * per_year) as f32);
        let inverse = 1.0 / left;
        let mut sum = [0.0_f32; 4];
        loop {
            let weight = if free < left { free } else { left };
            let entry = &self.rest[i];
            (0..4).for_each(|c| sum[c] += entry[c] * weight);
            if left <= free {
                break;
            }
            left -= free;
            free = 1.0;
            i = if i + 1 < self.rest.len() { i + 1 } else { 0 };
        }
        std::array::from_fn(|c| self.mean[c] + sum[c] * inverse)
    }

    #[inline(always)]
    fn first_at(&self, time: f64) -> [f64; 4] {
        let (i, f) = self.locate(time);
        let (a, b) = (&self.first[i], &self.rest[i]);
        std::array::from_fn(|c| a[c] + f64::from(b[c]) * f)
    }

    #[inline(always)]
    fn second_at(&self, time: f64) -> [f64; 4] {
        let (i, f) = self.locate(time);
        let (a, b, e) = (&self.second[i], &self.first[i], &self.rest[i]);
        std::array::from_fn(|c| a[c] + (b[c] + f64::from(e[c]) * (0.5 * f)) * f)
    }

    /// The mean over box(`a`) ∗ box(`b`) years around `time`; never narrower than an entry, so that it is continuous.
    #[inline(always)]
    pub fn mean(&self, time: f64, a: f64, b: f64) -> Entry {
        if !(time.is_finite() && a.is_finite() && b.is_finite()) {
            return self.mean;
        }
        let least = 1.0 / self.per_year as f64;
        let (a, b) = (a.max(b).clamp(least, 1e3), a.min(b).min(1e3));
        // A box that is much narrower than the other one or than an entry has no effect.
        let box_alone = b < (0.02 * a).max(0.25 * least);
        if box_alone && a < FEW * least {
            return self.few(time - 0.5 * a, a);
        }
        let rest: [f64; 4] = if box_alone {
            let (low, high) = (self.first_at(time - 0.5 * a), self.first_at(time + 0.5 * a));
            std::array::from_fn(|c| (high[c] - low[c]) / a)
        } else {
            let (wide, thin) = (0.5 * (a + b), 0.5 * (a - b));
            let (p, q) = (self.second_at(time + wide), self.second_at(time + thin));
            let (r, s) = (self.second_at(time - thin), self.second_at(time - wide));
            let area = 1.0 / (a * b);
            std::array::from_fn(|c| (p[c] - q[c] - r[c] + s[c]) * area)
        };
        std::array::from_fn(|c| self.mean[c] + narrow(rest[c]))
    }
}

/// The mean colour of the early wood.
fn early_color(pattern: &[[f32; 3]], late: &[f32]) -> [f32; 3] {
    let n = late.len().max(1);
    let weighted = pattern.iter().enumerate().map(|(i, c)| (1.0 - late[i % n], c));
    let (weight, sum) =
        weighted.fold((1e-6, [0.0; 3]), |(w, s), (x, c)| (w + x, std::array::from_fn(|k| s[k] + x * c[k])));
    sum.map(|v| (v / weight).max(1e-4))
}

fn smooth(colors: &[[f32; 3]], phase: f64) -> [f32; 3] {
    // No entry reads beyond the border of the year, which would blur its edge.
    let at = (phase * colors.len() as f64 - 0.5).clamp(0.0, (colors.len() - 1) as f64);
    let (i, t) = split(at);
    let (a, b) = (colors[i], colors[(i + 1).min(colors.len() - 1)]);
    std::array::from_fn(|c| (a[c] + (b[c] - a[c]) * t).max(1e-5))
}

fn one(values: &[f32], phase: f64) -> f32 {
    values[pattern::index(phase.clamp(0.0, 0.999_999), values.len())]
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place within a table")]
fn split(at: f64) -> (usize, f32) {
    (at as usize, (at - at.floor()) as f32)
}

/// Share of late wood of each entry of one year: 0 where the pattern is lightest, 1 where it is darkest (the other way
/// round if early wood is the darker).
pub fn late_share(pattern: &[[f32; 3]], entries: usize) -> Vec<f32> {
    let years = (pattern.len() / entries.max(1)).max(1) as f32;
    let light = |c: &[f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    let mut mean = vec![0.0; entries];
    pattern.iter().enumerate().for_each(|(i, c)| mean[i % entries] += light(c) / years);
    let (low, high) = mean.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    mean.iter().map(|v| if high - low > 1e-5 { (high - v) / (high - low) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> YearTable {
        let pattern: Vec<[f32; 3]> = (0..32).map(|i| [0.9 - 0.02 * i as f32, 0.5, 0.2 + 0.01 * i as f32]).collect();
        let late = late_share(&pattern, 32);
        YearTable::new(&pattern, 32, &late, 40, Variation { depth: 0.3, phase: 0.25 }, Hash::new(2))
    }

    #[test]
    fn means_are_those_of_many_samples() {
        let table = table();
        for (t, a, b) in [
            (3.2, 0.3, 0.1),
            (39.9, 0.5, 0.5),
            (-1.3, 2.5, 0.7),
            (7.01, 0.2, 0.0),
            (7.002, 0.03, 0.0005),
            (39.99, 0.05, 0.0),
            (100.0, 6.0, 3.0),
        ] {
            let n = 4000;
            let mut sum = [0.0_f64; 4];
            for i in 0..n {
                for k in 0..n {
                    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
                    let e = table.at(t + a * at(i) + b * at(k));
                    (0..4).for_each(|c| sum[c] += f64::from(e[c]) / f64::from(n * n));
                }
            }
            let mean = table.mean(t, a, b);
            for c in 0..4 {
                assert!((f64::from(mean[c]) - sum[c]).abs() < 2e-4, "{t} {a} {b}: {mean:?} {sum:?}");
            }
        }
    }

    #[test]
    fn even_time_shows_the_same_years() {
        let table = table();
        let calendar = Calendar::new(&(0..20).map(|i| 1.0 + 0.5 * libm::sin(f64::from(i) * 1.3)).collect::<Vec<_>>());
        let even = table.by_even_time(&calendar).unwrap();
        assert_eq!(even.years(), 40);
        for i in 0..4000 {
            let t = f64::from(i) * 0.037 - 30.0;
            let (a, b) = (even.mean(t, 0.0, 0.0), table.mean(calendar.at(t), 0.0, 0.0));
            // Skip the borders of years, which an entry of either table may straddle.
            let phase = calendar.at(t).rem_euclid(1.0);
            let near = !(0.05..=0.95).contains(&phase);
            assert!(near || (0..4).all(|c| (a[c] - b[c]).abs() < 0.02), "{t}: {a:?} {b:?}");
        }
        assert!(table.by_even_time(&Calendar::new(&[1.0; 1021])).is_none());
    }

    #[test]
    fn fades_to_mean_far_away() {
        let table = table();
        let (near, far) = (table.mean(12.34, 900.0, 700.0), table.mean);
        assert!((0..4).all(|c| (near[c] - far[c]).abs() < 2e-3), "{near:?} {far:?}");
        assert_eq!(table.mean(f64::NAN, 0.1, 0.1), far);
    }
}
