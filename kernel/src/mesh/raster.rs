//! The pixels of an atlas at one spacing.
use super::texels;
use super::walk::{SurfacePoint, corners};
use glam::{DVec2, UVec2};
use shibo_value::{Atlas, Grid, Window};

/// The pixels of an atlas at one spacing. Pixel (i, j) has its centre at ((i + ½)h, (j + ½)h) finest pixels.
#[derive(Clone, Copy)]
pub struct Raster<'a> {
    /// The atlas.
    pub atlas: &'a Atlas,
    /// Columns and rows of the finest pixels.
    pub finest: [u32; 2],
    /// Spacing in finest pixels.
    pub h: u32,
}

impl Raster<'_> {
    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.finest.map(|n| n.div_ceil(self.h))
    }

    /// Size of a pixel in the unit square.
    #[inline]
    pub fn step(&self) -> DVec2 {
        f64::from(self.h) / UVec2::from(self.finest).as_dvec2()
    }

    /// Centre of a pixel in the unit square.
    #[inline]
    pub fn center(&self, pixel: usize) -> DVec2 {
        let w = self.size()[0] as usize;
        (DVec2::new((pixel % w) as f64, (pixel / w) as f64) + 0.5) * self.step()
    }

    /// The grid on the canvas.
    pub fn grid(&self) -> Grid {
        Grid { origin: DVec2::ZERO, step: self.step() * self.atlas.size_mm, period: None, shown: None }
    }

    /// For each pixel the triangle at its centre plus one, or 0.
    pub fn owners(&self) -> Vec<u32> {
        use rayon::prelude::*;
        let [w, h] = self.size();
        let bands: Vec<u32> = (0..h.div_ceil(64)).collect();
        let band = |band: &u32| {
            let y = 64 * *band;
            let window = Window { x: 0, y: y.cast_signed(), width: w, height: 64.min(h - y) };
            texels::owners(self.atlas, &self.grid(), window)
        };
        bands.par_iter().map(band).collect::<Vec<_>>().concat()
    }

    /// Distance class of each pixel to a border of a chart: 3 if one passes through the pixel, 2 one pixel away, 1 two
    /// pixels away.
    pub fn near(&self) -> Vec<u8> {
        let size = self.size().map(u32::cast_signed);
        let (w, count) = (self.size()[0] as usize, self.size().map(|n| n as usize).iter().product());
        let mut near = vec![0u8; count];
        let mut touched = Vec::new();
        self.each_border(|x, y| {
            if let Some(pixel) = inside(x, y, size)
                && near[pixel] != 3
            {
                near[pixel] = 3;
                touched.push(pixel);
            }
        });
        for pixel in touched {
            let (x, y) = (i64::try_from(pixel % w).unwrap_or(0), i64::try_from(pixel / w).unwrap_or(0));
            for (dx, dy) in (-2..=2i64).flat_map(|dy| (-2..=2i64).map(move |dx| (dx, dy))) {
                let value = if dx.abs().max(dy.abs()) == 2 { 1 } else { 2 };
                if let Some(other) = inside(x + dx, y + dy, size) {
                    near[other] = near[other].max(value);
                }
            }
        }
        near
    }

    /// Calls `call` for each pixel that a border of a chart crosses or touches, for some more than once.
    #[expect(clippy::cast_possible_truncation, reason = "pixels of an atlas")]
    fn each_border(&self, mut call: impl FnMut(i64, i64)) {
        let step = self.step();
        for triangle in 0..self.atlas.uvs.len() {
            if self.atlas.inner[triangle] & 7 == 7 {
                continue;
            }
            let uvs = corners(self.atlas, triangle).map(|uv| uv / step);
            for k in (0..3).filter(|k| !self.atlas.is_inner(triangle, *k)) {
                let (mut a, mut b) = (uvs[(k + 1) % 3], uvs[(k + 2) % 3]);
                if a.y > b.y {
                    (a, b) = (b, a);
                }
                // A border along the sides of pixels counts for both.
                const CLOSE: f64 = 1e-7;
                let at = |y: f64| {
                    let share = if b.y > a.y { ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0) } else { 0.0 };
                    a.x + (b.x - a.x) * share
                };
                for y in (a.y - CLOSE).floor() as i64..=(b.y + CLOSE).floor() as i64 {
                    let (from, to) = if b.y - a.y < CLOSE { (a.x, b.x) } else { (at(y as f64), at(y as f64 + 1.0)) };
                    let (low, high) = (from.min(to) - CLOSE, from.max(to) + CLOSE);
                    (low.floor() as i64..=high.floor() as i64).for_each(|x| call(x, y));
                }
            }
        }
    }

    /// The surface point of a pixel that the triangle owns.
    #[inline]
    pub fn spot(&self, triangle: usize, pixel: usize) -> SurfacePoint {
        SurfacePoint { triangle, uv: self.center(pixel) }
    }
}

/// Index of pixel (x, y), if it exists.
pub(super) fn inside(x: i64, y: i64, [w, h]: [i32; 2]) -> Option<usize> {
    let all = (0..i64::from(w)).contains(&x) && (0..i64::from(h)).contains(&y);
    usize::try_from(y * i64::from(w) + x).ok().filter(|_| all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::fixture::{plane, sphere};

    /// If no border crosses a pixel, everything near its centre lies in the same chart, or in none.
    #[test]
    fn borders_pass_through_pixels_that_are_marked() {
        for (atlas, aligned) in [(plane("plane_wild"), false), (sphere(), false), (plane("plane_cut"), true)] {
            let raster = Raster { atlas: &atlas, finest: [96, 96], h: 1 };
            let near = raster.near();
            let fine = Raster { h: 1, finest: [960, 960], ..raster }.owners();
            let chart = |x: usize, y: usize| fine[y * 960 + x].checked_sub(1).map(|t| atlas.charts[t as usize]);
            let (mut marked, mut mixed) = (0, 0);
            for (pixel, near) in near.iter().enumerate() {
                let (x, y) = (pixel % 96 * 10, pixel / 96 * 10);
                let first = chart(x, y);
                let same = (0..100).all(|k| chart(x + k % 10, y + k / 10) == first);
                mixed += usize::from(!same);
                marked += usize::from(*near == 3);
                assert!(same || *near == 3, "{pixel}");
            }
            // Borders along the sides of pixels count for both.
            assert!(aligned || (mixed > 100 && marked < 3 * mixed), "{marked} {mixed}");
        }
    }
}
