//! Knitting: rows of loops, each drawn through the loop below it.
//!
//! A stitch is the periodic curve x = w t / 2π + a sin 2t, y = -h cos t, z = ∓ d cos 2t for t from -π to π: head and feet
//! lie behind and the legs in front in a knit stitch, the other way round in a purl stitch. Properties of stitches are
//! blended where two stitches meet, so that the yarn has no kinks. Where columns cross, they move smoothly within a
//! few rows, one half in front of the other.
use super::chart::{Chart, Stitch};
use super::lines::{Line, Sway, smooth};
use crate::ground::hash::Hash;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A knitted fabric that fits its canvas.
#[derive(Clone, Debug)]
pub struct Knitted {
    /// The stitches.
    pub chart: Chart,
    /// Number of columns and rows on the canvas, multiples of the chart.
    pub counts: [u32; 2],
    /// Size of the canvas, mm.
    pub size: DVec2,
    /// Width and thickness of the yarn, mm.
    pub yarn: DVec2,
    /// Unevenness of stitches, 0..1.
    pub irregular: f64,
}

/// Points of a stitch.
pub const POINTS: u32 = 20;

/// Properties of a stitch, which are blended between stitches.
#[derive(Clone, Copy, Debug, Default)]
struct Loop {
    /// 1 knit, -1 purl.
    side: f64,
    /// Displacement to the right and upwards, mm.
    right: f64,
    lift: f64,
    /// Relative height and width of the loop.
    tall: f64,
    wide: f64,
}

impl Loop {
    fn mix(self, other: Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * t;
        Self {
            side: mix(self.side, other.side),
            right: mix(self.right, other.right),
            lift: mix(self.lift, other.lift),
            tall: mix(self.tall, other.tall),
            wide: mix(self.wide, other.wide),
        }
    }
}

impl Knitted {
    /// Width and height of a stitch, mm.
    pub fn stitch(&self) -> DVec2 {
        self.size / DVec2::new(f64::from(self.counts[0]), f64::from(self.counts[1]))
    }

    /// A line for each row.
    pub fn lines(&self, hash: Hash) -> Vec<Line> {
        let stitch = self.stitch();
        let sway = Sway::new(hash.with(1), self.size, 4.0 * stitch.max_element(), 0.22 * self.irregular * stitch.x);
        let [columns, rows] = self.counts.map(i64::from);
        (0..rows)
            .map(|row| {
                let capacity = self.counts[0] as usize * POINTS as usize;
                let (mut points, mut parts) = (Vec::with_capacity(capacity), Vec::with_capacity(capacity));
                for column in 0..columns {
                    let part = u32::try_from(row * columns + column + 1).unwrap_or(u32::MAX);
                    for n in 0..POINTS {
                        let t = TAU * (f64::from(n) / f64::from(POINTS)) - PI;
                        let mut at = self.point(column, row, t, hash);
                        let moved = sway.at(at.truncate());
                        at += DVec3::new(moved.x, moved.y, 0.0);
                        points.push(at);
                        parts.push(part);
                    }
                }
                Line { points, parts, period: DVec2::new(self.size.x, 0.0), yarn: 0 }
            })
            .collect()
    }

    /// A point of a stitch, with t from -π to π.
    fn point(&self, column: i64, row: i64, t: f64, hash: Hash) -> DVec3 {
        let (pitch, width) = (self.stitch(), self.yarn.x);
        // Heads reach over the feet of the next row.
        let tall = 0.5 * (pitch.y + 1.6 * width.min(pitch.y));
        let (sin2, cos2) = libm::sincos(2.0 * t);
        let cos = libm::cos(t);
        let level = tall * cos;
        let this = self.at(column, row, level, hash);
        let edge = 0.5 * PI;
        let all = if t > edge {
            this.mix(self.at(column + 1, row, level, hash), smooth((t - edge) / PI))
        } else if t < -edge {
            this.mix(self.at(column - 1, row, level, hash), smooth((-edge - t) / PI))
        } else {
            this
        };
        let x = (column as f64 + 0.5) * pitch.x + pitch.x * t / TAU + 0.25 * pitch.x * all.wide * sin2 + all.right;
        // The head is taller, and the feet stay where they are.
        let y = (row as f64 + 0.5) * pitch.y - level - (all.tall - 1.0) * tall * smooth(0.5 + 0.5 * cos);
        // Legs stay in front for most of their length.
        let depth = 0.55 * self.yarn.y;
        let z = -all.side * depth * (cos2 + 0.25 * (1.0 - cos2 * cos2)) + all.lift;
        DVec3::new(x, y, z)
    }

    /// The properties of a stitch `level` mm above the middle of its row.
    fn at(&self, column: i64, row: i64, level: f64, hash: Hash) -> Loop {
        let side = |row: i64| if self.chart.at(column, row) == Stitch::Purl { -1.0 } else { 1.0 };
        let [columns, rows] = self.counts.map(i64::from);
        let number = (row.rem_euclid(rows) * columns + column.rem_euclid(columns)).unsigned_abs();
        let random = |n: u64| 2.0 * hash.with(2 + n).unit(number) - 1.0;
        let (right, lift) = self.crossed(column, row, level);
        // Columns of one kind stand out or sink in, as in a rib.
        let kind: f64 = (-2..=2).map(|k| side(row + k)).sum::<f64>() / 5.0;
        Loop {
            side: side(row),
            right,
            lift: lift + 0.4 * self.yarn.y * kind,
            tall: 1.0 + 0.07 * self.irregular * random(0),
            wide: 1.0 + 0.3 * self.irregular * random(1),
        }
    }

    /// Displacement of a stitch to the right and upwards by a crossing nearby.
    fn crossed(&self, column: i64, row: i64, level: f64) -> (f64, f64) {
        let pitch = self.stitch();
        let rows = i64::from(self.chart.rows);
        // The nearest crossing of this column lies below or above; its line is the lower edge of its row.
        let near = (0..rows).flat_map(|k| [(row + k, k), (row - k, k)]).find_map(|(at, away)| {
            match self.chart.at(column, at) {
                Stitch::Cross(cross) if 2 * away <= rows => Some((at, cross)),
                _ => None,
            }
        });
        let Some((at, cross)) = near else { return (0.0, 0.0) };
        let reach =
            (0.8 * f64::from(cross.span) * pitch.x / pitch.y + 1.0).min(0.5 * f64::from(self.chart.rows.max(2)));
        let above = (at - row) as f64 + 0.5 + level / pitch.y;
        let share = smooth(0.5 + 0.5 * above / reach);
        // Below the crossing, this column's stitches go on in another column.
        let after = row <= at;
        let moved = f64::from(cross.from) * pitch.x * if after { 1.0 - share } else { share };
        let bump = (1.0 - (above / reach).powi(2)).max(0.0);
        let front = cross.front == after;
        (moved, 0.7 * self.yarn.y * bump * bump * if front { 1.0 } else { -1.0 })
    }
}
