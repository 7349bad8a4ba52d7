//! Pores: vessels cut open, locked to the phase of the year.
//!
//! Columns stand on [Poisson discs](super::discs) in X and Y of fibre space. Along Z each is divided into segments with
//! its own offset, and a segment has at most one spindle. The selection of columns with a spindle changes from segment
//! to segment so that spindles are spread evenly both in the plane and along the column. A spindle's density and radius
//! follow the year in which its middle grew, so that no pore is cut by a ring border. Seen from afar, pores are
//! replaced by the mean coverage of the year.
use super::discs::{self, Discs, Near};
use super::year_table::YearTable;
use super::years::Calendar;
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::simd::dispatch;
use crate::noise::noise3::Noise3;

/// Parameters of pores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoreStyle {
    /// The distance of columns in mm.
    pub cell: f32,
    /// The length of a segment in mm.
    pub length: f32,
    /// The radius in early and in late wood, in mm.
    pub radius: [f32; 2],
    /// The share of segments with a pore in early and in late wood.
    pub density: [f32; 2],
    /// The part of the year that is early wood.
    pub early: f32,
    /// Grouping of pores, 0..1.
    pub groups: f32,
    /// Elongation in mm a year.
    pub elongation: f32,
    /// Thickening in mm a year.
    pub thickening: f32,
    /// Height of the ground in mm.
    pub ground: f32,
}

/// Pores, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Pores {
    style: PoreStyle,
    discs: &'static Discs,
    /// Offset of these pores in the torus of the discs, in cells.
    from: [f32; 2],
    columns: Noise3,
    segments: Noise3,
    groups: Noise3,
    calendar: Option<Calendar>,
    mean: YearTable,
}

/// The cosine and sine of the angle by which the torus is rotated, so that no cut of a board runs along its period.
const TURN: [f32; 2] = [0.851_658_6, 0.524_097_9];

/// Shift of the selection of columns with a pore from one segment to the next: the golden section, so that pores of a
/// column are spread evenly too.
const ONWARD: f32 = 0.618_034;

/// Size of a group of pores in mm: across the grain and along it.
const GROUP: [f32; 2] = [2.6, 34.0];

/// Number of points computed together.
const RUN: usize = 64;

/// Maximum number of cached vessels: those of a row of pixels across the grain, which the next row meets again.
const REMEMBERED: usize = 512;

/// A cache entry: the segment of a column, and its vessel (see [`Pores::vessel`]).
type Known = Option<([i32; 3], Option<(f32, f32)>)>;

/// Cache slot of a segment, in a table of a power of two.
#[inline(always)]
fn slot([x, y, segment]: [i32; 3], entries: usize) -> usize {
    let mixed = x.cast_unsigned().wrapping_mul(0x9E37_79B1)
        ^ y.cast_unsigned().wrapping_mul(0x85EB_CA77)
        ^ segment.cast_unsigned().wrapping_mul(0xC2B2_AE3D);
    (mixed ^ (mixed >> 15)) as usize & (entries - 1)
}

/// Ten bits of a word as a number 0..1.
#[inline(always)]
fn unit(word: u32, shift: u32) -> f32 {
    ((word >> shift) & 0x3ff) as f32 * (1.0 / 1023.0)
}

/// Share of early wood at a phase of the year. Pores begin with the year and thin out into the late wood.
fn earliness(phase: f32, early: f32) -> f32 {
    let out = math::smooth((early + 0.12 - phase) / 0.24);
    // The vessels of a year begin just before its border.
    math::max(out, math::smooth((phase - 0.985) / 0.01))
}

impl Pores {
    /// Prepares pores from their settings and the calendar of the years.
    pub fn new(style: PoreStyle, calendar: Option<Calendar>, hash: Hash) -> Self {
        let entries = 64u8;
        let cover = |i: u8| {
            let e = earliness((f32::from(i) + 0.5) / f32::from(entries), style.early);
            let (r, density) =
                (math::lerp(style.radius[1], style.radius[0], e), math::lerp(style.density[1], style.density[0], e));
            // The mean of a spindle over a segment: 2/3 of its section, 0.64 of its length.
            let value = density * std::f32::consts::PI * r * r * 0.444 / (style.cell * style.cell);
            [value, 0.0, 0.0, 0.0]
        };
        let mean = YearTable::of_table(&(0..entries).map(cover).collect::<Vec<_>>(), usize::from(entries));
        let side = f32::from(discs::SIDE);
        Self {
            style,
            discs: Discs::get(),
            from: [side * hash.unit_f32(7), side * hash.unit_f32(8)],
            columns: Noise3::new(hash, 0),
            segments: Noise3::new(hash, 1),
            groups: Noise3::new(hash, 2),
            calendar,
            mean,
        }
    }

    /// The phase of the year at a point of fibre space.
    fn phase(&self, a: f32, z: f32) -> f32 {
        let s = &self.style;
        let time = f64::from((z - s.ground) / s.elongation + a / s.thickening);
        let time = self.calendar.as_ref().map_or(time, |c| c.at(time));
        #[expect(clippy::cast_possible_truncation, reason = "a fraction")]
        let phase = (time - time.floor()) as f32;
        phase
    }

    /// The share of pores in a pixel of `pixel` mm around a point of fibre space, 0..1.
    #[inline]
    pub fn at(&self, [x, y, z]: [f32; 3], pixel: f32) -> f32 {
        let mut out = [0.0];
        self.fill([&[x], &[y], &[z]], pixel, &mut out);
        out[0]
    }

    /// The share of pores in pixels of `pixel` mm around points of fibre space, 0..1.
    pub fn fill(&self, [x, y, z]: [&[f32]; 3], pixel: f32, out: &mut [f32]) {
        out.fill(0.0);
        let mut known: Vec<Known> = vec![None; out.len().next_power_of_two().min(REMEMBERED)];
        dispatch(
            #[inline(always)]
            || {
                for from in (0..out.len()).step_by(RUN) {
                    let n = (out.len() - from).min(RUN);
                    let [x, y, z] = [x, y, z].map(|v| &v[from..][..n]);
                    self.columns([x, y, z], pixel, &mut known, &mut out[from..][..n]);
                }
            },
        );
    }

    /// Draws the nearest column of each point: first computes its distance for all points at once, then draws the few
    /// points that it covers.
    #[inline(always)]
    fn columns(&self, [x, y, z]: [&[f32]; 3], pixel: f32, known: &mut [Known], out: &mut [f32]) {
        let s = &self.style;
        let n = out.len().min(RUN);
        let inverse = 1.0 / s.cell;
        let reach = math::max(s.radius[0], s.radius[1]) + 0.5 * pixel;
        let soft = math::max(pixel, 0.012);
        let mut columns = [Near { id: [0; 2], rank: 0.0, at: [0.0; 2] }; RUN];
        let mut aways = [0.0_f32; RUN];
        for i in 0..n {
            let (tx, ty) = (x[i] * TURN[0] - y[i] * TURN[1], x[i] * TURN[1] + y[i] * TURN[0]);
            let (x, y) = (tx * inverse + self.from[0], ty * inverse + self.from[1]);
            let near = self.discs.near(x, y);
            let (ox, oy) = ((x - near.at[0]) * s.cell, (y - near.at[1]) * s.cell);
            (columns[i], aways[i]) = (near, ox * ox + oy * oy);
        }
        for i in 0..n {
            // Written so that NaN meets no pore.
            if aways[i] <= reach * reach {
                let column = &columns[i];
                let start = 7.3 * unit(self.columns.word(column.id[0], column.id[1], 0), 0);
                let along = z[i] / s.length + start;
                let (floor, segment) = math::floor_int(along);
                // Neighbours meet the same vessel.
                let key = [column.id[0], column.id[1], segment];
                let place = slot(key, known.len());
                let vessel = match known[place] {
                    Some((same, vessel)) if same == key => vessel,
                    _ => {
                        let vessel = self.vessel(column, segment, floor + 0.5 - start);
                        known[place] = Some((key, vessel));
                        vessel
                    }
                };
                let Some((radius, span)) = vessel else { continue };
                let u = (along - floor - 0.5) * 2.0 / span;
                if u * u < 1.0 {
                    let r = radius * (1.0 - u * u).sqrt();
                    out[i] = math::saturate((r - aways[i].sqrt()) / soft + 0.5) * math::min(1.0, 2.0 * r / soft);
                }
            }
        }
    }

    /// The radius of the vessel in a segment of a column and its share of the segment's length; `None` if there is
    /// none. `middle` is the height of the segment's middle, in segments.
    fn vessel(&self, column: &Near, segment: i32, middle: f32) -> Option<(f32, f32)> {
        let s = &self.style;
        let word = self.segments.word(column.id[0], column.id[1], segment);
        // In rotated coordinates, like the columns.
        let [px, py] = [0, 1].map(|k| (column.at[k] - self.from[k]) * s.cell);
        let middle_mm = middle * s.length;
        // Segments at the same height get the same number here, whatever their columns' offsets.
        let layer = (middle + 0.5).floor();
        let turned = column.rank + layer * ONWARD;
        let mut chance = turned - turned.floor();
        if s.groups > 0.0 {
            let group = self.groups.at(px / GROUP[0], py / GROUP[0], middle_mm / GROUP[1]);
            chance /= math::max(1.0 + 3.0 * s.groups * group, 1e-3);
        }
        if chance >= math::max(s.density[0], s.density[1]) {
            return None;
        }
        let e = earliness(self.phase((px * px + py * py).sqrt(), middle_mm), s.early);
        if chance >= math::lerp(s.density[1], s.density[0], e) {
            return None;
        }
        let size = math::min(0.8 + 0.4 * unit(word, 20), 1.0);
        Some((math::lerp(s.radius[1], s.radius[0], e) * size, 0.30 + 0.68 * unit(word, 10)))
    }

    /// Converts [`mean`](Self::mean) from the calendar to even time; returns whether this was possible.
    pub fn by_even_time(&mut self, calendar: &Calendar) -> bool {
        let mean = self.mean.by_even_time(calendar);
        mean.map(|mean| self.mean = mean).is_some()
    }

    /// Mean coverage over a span of years.
    pub fn mean(&self, time: f32, a: f32, b: f32) -> f32 {
        self.mean.mean(f64::from(time), f64::from(a), f64::from(b))[0]
    }

    /// Share of single pores in the picture, at pixels of `pixel` mm; the rest is the mean.
    pub fn single(&self, pixel: f32) -> f32 {
        1.0 - math::smooth((pixel / self.style.cell - 1.0) / 1.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn oak() -> PoreStyle {
        PoreStyle {
            cell: 0.36,
            length: 11.0,
            radius: [0.145, 0.035],
            density: [0.85, 0.2],
            early: 0.26,
            groups: 0.0,
            elongation: 260.0,
            thickening: 2.3,
            ground: 0.0,
        }
    }

    #[test]
    fn matches_mean_of_pores() {
        let pores = Pores::new(oak(), None, Hash::new(1));
        let (mut sum, mut mean, n) = (0.0_f64, 0.0_f64, 60_000);
        let hash = Hash::new(2);
        for i in 0..n {
            let (x, y) = (30.0 + 8.0 * hash.unit_f32(3 * i), 4.0 * hash.unit_f32(3 * i + 1));
            let z = 500.0 * hash.unit_f32(3 * i + 2);
            sum += f64::from(pores.at([x, y, z], 0.0));
            mean += f64::from(pores.mean(z / 260.0 + x.hypot(y) / 2.3, 0.0, 0.0));
        }
        assert!((sum / mean - 1.0).abs() < 0.2, "{} {}", sum / n as f64, mean / n as f64);
    }

    /// Lines in all directions meet about the same number of pores: no line runs along a row of the grid.
    #[test]
    fn shows_no_rows_in_any_cut() {
        let style = PoreStyle { radius: [0.1; 2], density: [0.7; 2], ..oak() };
        let pores = Pores::new(style, None, Hash::new(4));
        let share = |turn: f32, away: f32| {
            let (s, c) = turn.sin_cos();
            let at = |i: u16| {
                let along = 0.05 * f32::from(i) + 20.0;
                pores.at([along * c - away * s, along * s + away * c, 5.0], 0.0)
            };
            (0..4000).map(at).sum::<f32>() / 4000.0
        };
        let shares: Vec<f32> = [0.0, std::f32::consts::FRAC_PI_2]
            .iter()
            .flat_map(|t| (0..8_u8).map(|k| share(*t, 0.05 * f32::from(k))))
            .collect();
        let (low, high) = shares.iter().fold((1.0_f32, 0.0_f32), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(high < 1.6 * low, "{shares:?}");
    }

    #[test]
    fn groups_leave_places_without_pores() {
        let spread = |groups: f32| {
            let style = PoreStyle { radius: [0.1; 2], density: [0.4; 2], groups, ..oak() };
            let pores = Pores::new(style, None, Hash::new(4));
            let hash = Hash::new(9);
            // The share of pores in squares of 1.5 mm of end grain.
            let place = |k: u64| {
                let (x, z) = (20.0 + 100.0 * hash.unit_f32(2 * k), 300.0 * hash.unit_f32(2 * k + 1));
                let at = |i: u16| [x + 0.05 * f32::from(i % 30), 0.05 * f32::from(i / 30), z];
                (0..900).map(|i| pores.at(at(i), 0.0)).sum::<f32>() / 900.0
            };
            let all: Vec<f32> = (0..300).map(place).collect();
            let mean = all.iter().sum::<f32>() / 300.0;
            (mean, (all.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / 300.0).sqrt() / mean)
        };
        let (plain, grouped) = (spread(0.0), spread(1.0));
        assert!(grouped.1 > 1.15 * plain.1, "{plain:?} {grouped:?}");
        assert!((grouped.0 / plain.0 - 1.0).abs() < 0.35, "{plain:?} {grouped:?}");
    }

    #[test]
    fn early_wood_has_the_large_pores() {
        let pores = Pores::new(oak(), None, Hash::new(1));
        let share = |from: f32, to: f32| {
            let hash = Hash::new(7);
            let inside = |i: u64| {
                let year = 10.0 + (hash.unit_f32(2 * i) * 12.0).floor();
                let a = 2.3 * (year + from + (to - from) * hash.unit_f32(2 * i + 1));
                pores.at([a * (0.003 * i as f32).cos(), a * (0.003 * i as f32).sin(), 0.0], 0.0)
            };
            (0..4000).map(inside).sum::<f32>() / 4000.0
        };
        assert!(share(0.05, 0.2) > 8.0 * share(0.5, 0.9), "{} {}", share(0.05, 0.2), share(0.5, 0.9));
    }
}
