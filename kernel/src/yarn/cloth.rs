//! Woven cloth of yarns: warp threads run down, weft threads across.
use super::draft::Draft;
use super::lines::{Line, Sway, smooth};
use super::noise::{cells, ring};
use crate::ground::hash::Hash;
use glam::{DVec2, DVec3};

/// A cloth that fits its canvas.
#[derive(Clone, Debug)]
pub struct Woven {
    /// The crossings.
    pub draft: Draft,
    /// Number of warp and weft threads, multiples of the draft.
    pub counts: [u32; 2],
    /// Size of the canvas, mm.
    pub size: DVec2,
    /// Thickness of warp and weft, mm.
    pub thickness: [f64; 2],
    /// Share of the bending that the warp takes, 0..1.
    pub crimp: f64,
    /// Unevenness, 0..1.
    pub irregular: f64,
}

/// Points of a thread for each crossing.
pub const POINTS: u32 = 4;

impl Woven {
    /// Distances of warp and of weft threads, mm.
    pub fn pitch(&self) -> DVec2 {
        self.size / DVec2::new(f64::from(self.counts[0]), f64::from(self.counts[1]))
    }

    /// A line for each thread: warp threads first, with yarn 0, then weft threads, with yarn 1.
    pub fn lines(&self, hash: Hash) -> Vec<Line> {
        let pitch = self.pitch();
        let scale = 7.0 * pitch.max_element();
        let sway = Sway::new(hash.with(1), self.size, scale, 0.35 * self.irregular * pitch.min_element());
        let bend = 0.5 * (self.thickness[0] + self.thickness[1]);
        let bends = [bend * self.crimp, bend * (1.0 - self.crimp)];
        let mut lines = Vec::new();
        for system in [0, 1] {
            let other = 1 - system;
            let (count, crossings) = (self.counts[system], self.counts[other]);
            let wave = cells(f64::from(crossings), 5.0);
            for number in 0..count {
                let thread = hash.with(2 + u64::from(system == 1)).with(u64::from(number));
                let over = |at: i64| {
                    let n = i64::from(number);
                    if system == 0 { self.draft.over(n, at) } else { !self.draft.over(at, n) }
                };
                let steps = crossings * POINTS;
                let (mut points, mut parts) = (Vec::new(), Vec::new());
                for k in 0..steps {
                    // Crossings lie at whole numbers plus a half.
                    let along = f64::from(k) / f64::from(POINTS);
                    let (height, part) = height(along, &over, i64::from(crossings));
                    let away =
                        0.13 * self.irregular * ring(thread, along * f64::from(wave) / f64::from(crossings), wave);
                    let across = (f64::from(number) + 0.5 + away) * pitch[system];
                    let along = along * pitch[other];
                    let at = if system == 0 { DVec2::new(across, along) } else { DVec2::new(along, across) };
                    let at = at + sway.at(at);
                    points.push(DVec3::new(at.x, at.y, bends[system] * height));
                    parts.push(part);
                }
                let period = if system == 0 { DVec2::new(0.0, self.size.y) } else { DVec2::new(self.size.x, 0.0) };
                lines.push(Line { points, parts, period, yarn: system });
            }
        }
        lines
    }
}

/// Height of a thread at a place in crossings, -1..1 and a little more on long floats; and 1 where it lies on top.
#[expect(clippy::cast_possible_truncation, reason = "far fewer crossings than 2^63")]
fn height(along: f64, over: &impl Fn(i64) -> bool, crossings: i64) -> (f64, u32) {
    let before = (along - 0.5).floor() as i64;
    let t = along - 0.5 - before as f64;
    let at = |n: i64| if over(n.rem_euclid(crossings)) { 1.0 } else { -1.0 };
    let (a, b) = (at(before), at(before + 1));
    let part = u32::from(over((along.floor() as i64).rem_euclid(crossings)));
    if a != b {
        return (a + (b - a) * smooth(t), part);
    }
    // Between two crossings of a float the thread rises, because nothing holds it down there.
    let held = |n: i64| f64::from(u8::from(at(n) != a));
    let start = 1.0 - held(before - 1) * (1.0 - smooth(t));
    let end = 1.0 - held(before + 2) * smooth(t);
    (a * (1.0 + 0.14 * start.min(end)), part)
}
