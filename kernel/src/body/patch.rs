//! A block of samples: the piece of a height field that is triangulated at once, with its positions and its tolerance.
use super::heights::{BLOCK, Band, Heights};

/// How a body bends the field round an axis; `None` for a plate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    /// Radius at height 0 in mm.
    pub(super) radius: f64,
    /// Angle of a half step in radians.
    pub(super) half_angle: f64,
}

/// The tolerance of a triangulation.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// The largest distance to the field that is allowed, in mm.
    pub(super) error: f64,
    /// The bend of a roll.
    pub(super) bend: Option<Bend>,
    /// The distances by which rounding to `f32` moves vertices.
    pub(super) rounding: Rounding,
}

/// The greatest distances that rounding to `f32` moves a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rounding {
    /// Up or down, in mm.
    up: f64,
    /// In the plane of samples, in half steps.
    aside: [f64; 2],
    /// The distance to the field that this makes on slopes as steep as the field, in mm.
    usual: f64,
}

/// The share of the error of a roll that the heights on sides of blocks may use. The bow of a facet may use the rest.
const HEIGHTS: f64 = 0.75;

/// The extent of a facet or of an edge in the plane of samples, in half steps and mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Width round the roll, and height along it, in half steps.
    pub(super) size: [f64; 2],
    /// Change of the height in mm for each half step.
    pub(super) slope: [f64; 2],
    /// The least and the greatest height.
    pub(super) extent: (f64, f64),
}

impl Tolerance {
    /// The tolerance of a plate.
    pub fn flat(error: f64) -> Self {
        Self { error, bend: None, rounding: Rounding::default() }
    }

    /// The tolerance of a roll with this radius at height 0 in mm, and `columns` intervals between samples all round.
    pub fn round(error: f64, radius: f64, columns: usize) -> Self {
        let half_angle = std::f64::consts::PI / columns.max(1) as f64;
        Self { error, bend: Some(Bend { radius, half_angle }), rounding: Rounding::default() }
    }

    /// The same tolerance for vertices that are rounded to `f32`. Places are up to `across` mm in the plane of samples,
    /// and heights above the base, or radii, up to `up` mm.
    #[must_use]
    pub fn rounded(self, heights: &Heights<'_>, up: f64, across: [f64; 2]) -> Self {
        let (up, aside) = match self.bend {
            None => (half_step(up), across.map(half_step)),
            // The coordinates of a vertex of a roll have both roundings of the radius.
            Some(_) => {
                let round = std::f64::consts::SQRT_2 * half_step(up);
                (round, [round, half_step(across[1])])
            }
        };
        let usual = up + heights.steepest() * (aside[0] + aside[1]);
        let aside = [0, 1].map(|axis| aside[axis] / heights.half_mm[axis]);
        Self { rounding: Rounding { up, aside, usual }, ..self }
    }

    /// The distance to the field that rounding makes on slopes as steep as the field, in mm.
    pub fn rounding(&self) -> f64 {
        self.rounding.usual
    }

    /// The distance to the field that rounding may make on a facet, whose slopes are mm for each half step.
    #[inline]
    pub(super) fn shift(&self, slope: [f64; 2]) -> f64 {
        let Rounding { up, aside, .. } = self.rounding;
        up + aside[0] * slope[0].abs() + aside[1] * slope[1].abs()
    }

    /// The share of the error that the chord between neighbouring samples uses, for steps as steep as `steepest` (a
    /// ratio of lengths) and heights between `extent`.
    pub fn chord(&self, steepest: f64, extent: (f64, f64)) -> f64 {
        let slope = self.bend.map_or(0.0, |bend| steepest * bend.radius * bend.half_angle);
        self.sagitta(&Facet { size: [2.0, 0.0], slope: [slope, 0.0], extent })
    }

    /// The distance to the field that the sides of blocks may leave between their vertices.
    pub(super) fn heights(&self) -> f64 {
        let error = if self.bend.is_some() { HEIGHTS * self.error } else { self.error };
        (error - self.rounding.usual).max(0.5 * error)
    }

    /// The bow of a facet, relative to the share of the error that it may use.
    pub(super) fn sagitta(&self, facet: &Facet) -> f64 {
        self.bow(facet) / ((1.0 - HEIGHTS) * self.error)
    }

    /// The distance in mm between a flat facet and the field interpolated in the angle and along the axis.
    ///
    /// The radius of a plane in cylinder coordinates has the second derivatives r + 2 a² / r in the angle, a b / r in the
    /// angle and z, and 0 in z, where a and b are its first ones. Inside of a triangle a function with the values 0 at
    /// the corners is at most an eighth of the first one, times the width squared, plus a quarter of the second one,
    /// times width and height.
    pub(super) fn bow(&self, facet: &Facet) -> f64 {
        let Some(bend) = self.bend else { return 0.0 };
        let Facet { size: [width, height], slope: [across, down], extent: (low, high) } = *facet;
        let (angle, turn) = (width * bend.half_angle, across / bend.half_angle);
        let least = (bend.radius + low).max(1e-9);
        (bend.radius + high + 2.0 * turn * turn / least) * angle * angle / 8.0
            + (across * width * down * height).abs() / (4.0 * least)
    }
}

/// Half of the distance between neighbouring `f32` below a value.
fn half_step(value: f64) -> f64 {
    if !value.is_finite() {
        return f64::INFINITY;
    }
    // Numbers below 2^k are multiples of 2^(k - 24).
    let mut power = 1.0_f64;
    while power <= value {
        power *= 2.0;
    }
    while power > 2.0 * value.max(1e-6) {
        power *= 0.5;
    }
    0.5 * power / 16_777_216.0
}

/// A block of at most 65 × 65 samples.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// Number of intervals between samples in each direction.
    pub(super) width: usize,
    pub(super) height: usize,
    /// Heights in rows of `BLOCK + 1`.
    values: Vec<f32>,
    /// Positions in half steps from the corner of the block.
    pub(super) across: [i32; BLOCK + 1],
    pub(super) down: [i32; BLOCK + 1],
    /// 1 in a direction in which the first interval is a half step, else 0.
    short: [i32; 2],
    pub(super) tolerance: Tolerance,
}

/// A sample of a block: column and row.
pub(super) type Spot = [u8; 2];

impl Patch {
    pub(super) fn new(tolerance: Tolerance) -> Self {
        let (across, down) = ([0; BLOCK + 1], [0; BLOCK + 1]);
        let values = vec![0.0; (BLOCK + 1) * (BLOCK + 1)];
        Self { width: 0, height: 0, values, across, down, short: [0; 2], tolerance }
    }

    /// Takes the samples between two columns and two rows, ends included. `band` has these rows.
    pub(super) fn load(
        &mut self,
        heights: &Heights<'_>,
        band: &Band,
        [left, right]: [usize; 2],
        [top, bottom]: [usize; 2],
    ) {
        (self.width, self.height) = (right - left, bottom - top);
        for (row, to) in (top..=bottom).zip(self.values.chunks_mut(BLOCK + 1)) {
            let from = &band.row(row)[left..=right];
            to[..from.len()].copy_from_slice(from);
        }
        let local = |to: &mut [i32; BLOCK + 1], from: &[i32]| {
            to.iter_mut().zip(from).for_each(|(to, at)| *to = at - from[0]);
            i32::from(from[1] - from[0] == 1)
        };
        self.short = [
            local(&mut self.across, &heights.across[left..=right]),
            local(&mut self.down, &heights.down[top..=bottom]),
        ];
    }

    #[inline]
    pub(super) fn at(&self, column: usize, row: usize) -> f64 {
        f64::from(self.values[row * (BLOCK + 1) + column])
    }

    #[inline]
    pub(super) fn of(&self, [column, row]: Spot) -> f64 {
        self.at(usize::from(column), usize::from(row))
    }

    /// The heights of some samples.
    pub(super) fn heights(&self, spots: &[Spot]) -> Vec<f32> {
        spots.iter().map(|[x, y]| self.values[usize::from(*y) * (BLOCK + 1) + usize::from(*x)]).collect()
    }

    /// The heights of a row from its first column.
    #[inline]
    pub(super) fn row(&self, row: usize) -> &[f32] {
        &self.values[row * (BLOCK + 1)..=row * (BLOCK + 1) + self.width]
    }

    /// The position of a sample in half steps.
    #[inline]
    pub(super) fn place(&self, [column, row]: Spot) -> [i32; 2] {
        [self.across[usize::from(column)], self.down[usize::from(row)]]
    }

    /// The last column at or left of a position, at most the last but one; and the part of the way to the next column.
    #[inline]
    pub(super) fn column(&self, x: f64) -> (usize, f64) {
        find(&self.across, self.short[0], self.width, x)
    }

    /// As [`column`](Self::column), for rows.
    #[inline]
    pub(super) fn row_at(&self, y: f64) -> (usize, f64) {
        find(&self.down, self.short[1], self.height, y)
    }

    /// True if a sample lies on a side of the block.
    #[inline]
    pub(super) fn on_side(&self, column: usize, row: usize) -> bool {
        column == 0 || row == 0 || column == self.width || row == self.height
    }
}

#[inline]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positions lie in the block")]
fn find(places: &[i32; BLOCK + 1], short: i32, intervals: usize, at: f64) -> (usize, f64) {
    let index = (((at + f64::from(short)) * 0.5) as usize).min(intervals - 1);
    let (low, high) = (f64::from(places[index]), f64::from(places[index + 1]));
    (index, (at - low) / (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_half_a_step_of_the_numbers() {
        // Numbers from 2 to 4 are 2^-22 apart, those from 32 to 64 2^-18.
        assert_eq!([3.0, 60.0].map(half_step), [0.5 / 4_194_304.0, 0.5 / 262_144.0]);
        let pixels = vec![0.0, 0.5];
        let heights = Heights::of_canvas(&pixels, [2, 1], [0.5, 0.5], [false; 2]).unwrap();
        let tolerance = Tolerance::flat(0.01).rounded(&heights, 3.0, [60.0, 60.0]);
        // The field has steps of 45°.
        assert_eq!(tolerance.rounding(), 0.5 / 4_194_304.0 + 1.0 / 262_144.0);
        // 0.25 mm for a half step of 0.25 mm, in both directions.
        assert_eq!(tolerance.shift([0.25, -0.25]), tolerance.rounding());
    }
}
