//! Reads a scalar field along links: from the pixels on or near a link, or from samples between the pixels.
//!
//! Source: JP4905282B2 §4, claim 3, and §6(1) for masses. The source's pixels "on the line" are taken to be those of
//! Bresenham's line between the two end pixels, which gives the numbers of its figure 10. [`Sample::Smooth`]
//! interpolates the picture instead and is the better default: a small motion of a point changes its value a little
//! rather than by jumps.

use crate::ground::number::narrow;
use glam::{IVec2, Vec2};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_macros::choice;

/// A picture over the work area: pixel (0, 0) touches the origin, row 0 is at y = 0.
#[derive(Clone, Copy, Debug)]
pub struct Raster<'a> {
    /// Values by rows.
    pub values: &'a [f32],
    /// Columns, > 0.
    pub width: usize,
    /// Rows, > 0.
    pub height: usize,
    /// Size of the work area in mm, > 0.
    pub size: Vec2,
    /// Positions outside wrap to the opposite edge; otherwise they read the nearest pixel.
    pub periodic: bool,
}

/// The positions of the field that belong to a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Sample {
    /// Two interpolated samples per pixel along the link: the better choice in practice.
    #[default]
    Smooth,
    /// The pixels of Bresenham's line, as in the source.
    Line,
    /// The pixels at most this many mm from the link.
    Near(f64),
}

/// Reduction of the values of a link or a point.
#[choice]
pub enum Reduction {
    /// Their mean.
    #[default]
    Mean,
    /// Their sum, which grows with the number of pixels.
    Sum,
}

impl Raster<'_> {
    /// Millimetres to pixels.
    fn scale(&self) -> Vec2 {
        Vec2::new(self.width as f32, self.height as f32) / self.size
    }

    /// The pixel of a point: `floor(x / a · W)`, clamped unless the picture is periodic.
    #[inline]
    pub fn pixel(&self, point: Vec2) -> IVec2 {
        let count = Vec2::new(self.width as f32, self.height as f32);
        let at = (point / self.size * count).floor().as_ivec2();
        if self.periodic { at } else { at.clamp(IVec2::ZERO, count.as_ivec2() - 1) }
    }

    /// The value of a pixel, continued outside.
    #[inline]
    pub fn get(&self, pixel: IVec2) -> f32 {
        let fit = |v: i32, n: usize| {
            let n = i32::try_from(n).unwrap_or(i32::MAX);
            let v = if self.periodic { v.rem_euclid(n) } else { v.clamp(0, n - 1) };
            usize::try_from(v).unwrap_or(0)
        };
        self.values[fit(pixel.y, self.height) * self.width + fit(pixel.x, self.width)]
    }

    /// The value at a point, linear between the centres of pixels.
    #[inline]
    pub fn sample(&self, point: Vec2) -> f32 {
        let at = point * self.scale() - 0.5;
        let (base, t) = (at.floor().as_ivec2(), at - at.floor());
        let row = |y: i32| {
            let (a, b) = (self.get(base + IVec2::new(0, y)), self.get(base + IVec2::new(1, y)));
            a + (b - a) * t.x
        };
        let (top, bottom) = (row(0), row(1));
        top + (bottom - top) * t.y
    }

    /// The value of the pixel at a point: the source's mass of a point.
    #[inline]
    pub fn at(&self, point: Vec2) -> f32 {
        self.get(self.pixel(point))
    }

    /// The mean or sum along the line between two points. `Near` uses the pixel of the middle if no pixel is near.
    pub fn along(&self, ends: [Vec2; 2], along: Sample, reduce: Reduction) -> f32 {
        let (mut sum, mut count) = (0.0f64, 0u32);
        let mut add = |value: f32| {
            sum += f64::from(value);
            count += 1;
        };
        match along {
            Sample::Line => bresenham(self.pixel(ends[0]), self.pixel(ends[1]), |p| add(self.get(p))),
            Sample::Near(radius) => self.near(ends, narrow(radius), |p| add(self.get(p))),
            Sample::Smooth => {
                let [a, b] = ends;
                // Sample the middles of equal parts, so that all parts of the line have the same weight.
                let parts = (2.0 * ((b - a) * self.scale()).length()).ceil().clamp(1.0, 65536.0);
                let mut part = 0.5;
                while part < parts {
                    add(self.sample(a + (b - a) * (part / parts)));
                    part += 1.0;
                }
            }
        }
        let result = if reduce == Reduction::Mean { sum / f64::from(count.max(1)) } else { sum };
        narrow(if count == 0 { f64::from(self.at((ends[0] + ends[1]) * 0.5)) } else { result })
    }

    /// The pixels whose centres lie within `radius` of a line; also those of a point, when both ends are the same.
    pub fn near(&self, [a, b]: [Vec2; 2], radius: f32, mut visit: impl FnMut(IVec2)) {
        let scale = self.scale();
        let mut low = ((a.min(b) - radius) * scale - 0.5).ceil().as_ivec2();
        let mut high = ((a.max(b) + radius) * scale - 0.5).floor().as_ivec2();
        if !self.periodic {
            let last = Vec2::new(self.width as f32, self.height as f32).as_ivec2() - 1;
            (low, high) = (low.max(IVec2::ZERO), high.min(last));
        }
        let d = b - a;
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let centre = (Vec2::new(x as f32, y as f32) + 0.5) / scale;
                let t = ((centre - a).dot(d) / d.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
                if (a + d * t).distance_squared(centre) <= radius * radius {
                    visit(IVec2::new(x, y));
                }
            }
        }
    }

    /// [`Self::along`] for many lines, in parallel.
    pub fn along_all(&self, lines: &[[Vec2; 2]], along: Sample, reduce: Reduction) -> Vec<f32> {
        lines.par_iter().map(|&ends| self.along(ends, along, reduce)).collect()
    }
}

/// The pixels of Bresenham's line from one pixel to another, both included, in order.
pub fn bresenham(from: IVec2, to: IVec2, mut visit: impl FnMut(IVec2)) {
    let d = (to - from).abs();
    let step = (to - from).signum();
    let mut error = d.x - d.y;
    let mut at = from;
    loop {
        visit(at);
        if at == to {
            return;
        }
        let twice = 2 * error;
        if twice >= -d.y {
            error -= d.y;
            at.x += step.x;
        }
        if twice <= d.x {
            error += d.x;
            at.y += step.y;
        }
    }
}
