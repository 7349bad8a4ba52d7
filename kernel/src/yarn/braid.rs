//! Braids, laid rope and round cords: parallel bands along x that fill the canvas.
//!
//! Strands follow closed formulas. In a flat braid of n strands a strand runs from edge to edge, and its height is
//! sin((n - 1) φ) of its phase (cos for an even n), so that strands that meet have opposite heights. For n = 3 it is the
//! plait y = sin φ, z = sin 2φ.
use super::lines::{Line, Sway};
use crate::ground::hash::Hash;
use glam::{DVec2, DVec3};
use shibo_macros::choice;
use std::f64::consts::{PI, TAU};

/// The make of a band.
#[choice]
pub enum BandShape {
    /// Strands that wind around each other: rope, cord, piping.
    #[default]
    Rope,
    /// A flat braid: strands cross over one and under one, from edge to edge. Three make a plait.
    Flat,
    /// A round braid: half of the strands wind one way and half the other way, over two and under two. The number of
    /// strands is a multiple of 4.
    Cord,
}

/// Bands that fit the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bands {
    /// Their make.
    pub shape: BandShape,
    /// Number of strands of a band.
    pub strands: u32,
    /// Number of bands.
    pub count: u32,
    /// Number of turns, or of repeats of the braid, along the canvas; negative for the other hand.
    pub turns: f64,
    /// Size of the canvas, mm.
    pub size: DVec2,
    /// Width of a band, mm.
    pub width: f64,
    /// Width and thickness of a strand, mm.
    pub strand: DVec2,
    /// Unevenness, 0..1.
    pub irregular: f64,
    /// Every second band winds the other way.
    pub alternate: bool,
}

/// Width of a strand by default, for a band of `width` mm with strands that touch; and the length of its turn.
pub fn default_strand(shape: BandShape, strands: u32, width: f64) -> (f64, f64) {
    let n = f64::from(strands.max(2));
    match shape {
        BandShape::Rope => {
            let sine = libm::sin(PI / n);
            // Strands of a slanting section look wider.
            (width * sine / (1.0 + sine) * 1.12, 3.4 * width)
        }
        BandShape::Flat => {
            let lay = 1.9 * width;
            // Parallel strands run at about 45°.
            (lay / n * 0.72, lay)
        }
        BandShape::Cord => {
            let lay = 3.4 * width;
            (2.0 * lay / n * 0.6, lay)
        }
    }
}

impl Bands {
    /// Points of a turn.
    fn steps(&self) -> u32 {
        match self.shape {
            BandShape::Rope => 24,
            BandShape::Flat | BandShape::Cord => (8 * self.strands).clamp(24, 128),
        }
    }

    /// Number of points of all strands.
    pub fn points(&self) -> f64 {
        f64::from(self.count) * f64::from(self.strands) * self.turns.abs() * f64::from(self.steps())
    }

    /// A line for each strand; bands follow each other from the top. Bands that wind the other way have yarn 1.
    pub fn lines(&self, hash: Hash) -> Vec<Line> {
        let pitch = self.size.y / f64::from(self.count);
        let sway = Sway::new(hash.with(1), self.size, 2.5 * self.width, 0.06 * self.irregular * self.width);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least one, and limited")]
        let turns = self.turns.abs().round().max(1.0) as u32;
        let steps = turns * self.steps();
        let mut lines = Vec::new();
        for band in 0..self.count {
            let other = self.alternate && band % 2 == 1;
            let hand = if (self.turns < 0.0) == other { 1.0 } else { -1.0 };
            let start = hash.with(2).unit(u64::from(band));
            let middle = (f64::from(band) + 0.5) * pitch;
            for strand in 0..self.strands {
                let first = lines.len();
                let points = (0..steps).map(|k| {
                    let x = self.size.x * f64::from(k) / f64::from(steps);
                    let phase = f64::from(turns) * f64::from(k) / f64::from(steps) + start;
                    let (y, z) = self.place(phase, strand);
                    let at = DVec2::new(x, middle + hand * y);
                    let moved = sway.at(at);
                    DVec3::new(at.x + moved.x, at.y + moved.y, z)
                });
                let points: Vec<DVec3> = points.collect();
                let part = crate::ground::number::index_u32(first) / self.strands.max(1) + 1;
                lines.push(Line {
                    parts: vec![part; points.len()],
                    points,
                    period: DVec2::new(self.size.x, 0.0),
                    yarn: usize::from(other),
                });
            }
        }
        lines
    }

    /// Place of a strand across its band and its height, at a phase in turns.
    fn place(&self, phase: f64, strand: u32) -> (f64, f64) {
        let n = f64::from(self.strands);
        let edge = 0.5 * (self.width - self.strand.x);
        match self.shape {
            BandShape::Rope => {
                let (sin, cos) = libm::sincos(TAU * (phase + f64::from(strand) / n));
                (edge * cos, edge * sin)
            }
            BandShape::Flat => {
                let angle = TAU * (phase + f64::from(strand) / n);
                let sin = libm::sin(angle);
                // Straight between the edges, with round turns.
                let bent = libm::asin(0.93 * sin) / libm::asin(0.93);
                let wave = libm::sincos((n - 1.0) * angle);
                let wave = if self.strands % 2 == 1 { wave.0 } else { wave.1 };
                // Heights are levelled, because the formula gives low ones near the edges.
                let level = wave / (wave * wave + 0.15).sqrt();
                let rounding = 0.35 * self.strand.y * (1.0 - sin * sin);
                (edge * bent, 0.5 * self.strand.y * level + rounding)
            }
            BandShape::Cord => {
                let half = 0.5 * n;
                let (way, number) = if strand.is_multiple_of(2) { (1.0, strand / 2) } else { (-1.0, strand / 2) };
                let angle = TAU * (way * phase + f64::from(number) / half);
                let (sin, cos) = libm::sincos(angle);
                let wave = way * libm::cos(0.5 * half * angle - 0.25 * PI);
                let wave = wave / (wave * wave + 0.2).sqrt();
                let radius = edge + 0.42 * self.strand.y * (wave - 1.0);
                (radius * sin, radius * cos)
            }
        }
    }
}
