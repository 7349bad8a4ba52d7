//! Exemplars: pictures with any number of channels, and the levels derived from them.
use super::plane::PixelPlane;
use crate::ground::cubic::catmull_rom;
use crate::ground::real::Real;
use rayon::prelude::*;
use shibo_macros::choice;

/// Filter for reading a picture between its pixels.
#[choice]
pub enum Fetch {
    /// The nearest pixel: for masks and labels.
    Nearest,
    /// Linear in x and y: soft.
    Bilinear,
    /// Cubic: as sharp as the picture. Never beyond the range of the 16 pixels around.
    #[default]
    CatmullRom,
}

/// A picture: rows from the top, the channels of a pixel side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Texels<T> {
    /// Size, and the axes that wrap.
    pub plane: PixelPlane,
    /// Values per pixel.
    pub channels: usize,
    /// The values.
    pub data: Vec<T>,
}

impl<T: Real> Texels<T> {
    /// A picture of these values.
    ///
    /// # Panics
    /// If there are not `w`·`h`·`channels` values, or none.
    pub fn new(plane: PixelPlane, channels: usize, data: Vec<T>) -> Self {
        assert!(!data.is_empty() && data.len() == plane.w * plane.h * channels, "a picture of {plane:?}");
        Self { plane, channels, data }
    }

    /// The values of a pixel; outside, wrapped or clamped per axis.
    #[inline(always)]
    pub fn at(&self, x: i32, y: i32) -> &[T] {
        let i = super::plane::Lookup::index(&self.plane, x, y) * self.channels;
        &self.data[i..i + self.channels]
    }

    /// Adds the weighted values at a position to `out`.
    #[inline(always)]
    pub fn add(&self, [x, y]: [T; 2], fetch: Fetch, weight: T, out: &mut [T]) {
        match fetch {
            Fetch::Nearest => {
                let (i, j) = (floor(x), floor(y));
                out.iter_mut().zip(self.at(i, j)).for_each(|(o, v)| *o += weight * *v);
            }
            Fetch::Bilinear => {
                let (fx, fy) = (x - T::HALF, y - T::HALF);
                let (i, j) = (floor(fx), floor(fy));
                let (u, v) = (fx - T::of(f64::from(i)), fy - T::of(f64::from(j)));
                let rows = self.quad(i, j);
                for (c, out) in out.iter_mut().enumerate().take(self.channels) {
                    let top = rows[0][c] * (T::ONE - u) + rows[1][c] * u;
                    let bottom = rows[2][c] * (T::ONE - u) + rows[3][c] * u;
                    *out += weight * (top * (T::ONE - v) + bottom * v);
                }
            }
            Fetch::CatmullRom => self.add_cubic(x - T::HALF, y - T::HALF, weight, out),
        }
    }

    #[inline(always)]
    fn add_cubic(&self, x: T, y: T, weight: T, out: &mut [T]) {
        let (i, j) = (floor(x), floor(y));
        let (u, v) = (x - T::of(f64::from(i)), y - T::of(f64::from(j)));
        if u == T::ZERO && v == T::ZERO {
            out.iter_mut().zip(self.at(i, j)).for_each(|(o, v)| *o += weight * *v);
            return;
        }
        let (across, down, c) = (catmull_rom(u), catmull_rom(v), self.channels);
        let (w, h) = (crate::ground::window::index(self.plane.w), crate::ground::window::index(self.plane.h));
        let inside = i > 0 && j > 0 && i + 2 < w && j + 2 < h;
        let rows = [-1, 0, 1, 2].map(|dj| {
            if inside {
                let first = crate::ground::window::offset((j + dj) * w + i - 1) * c;
                let row = &self.data[first..first + 4 * c];
                return [&row[..c], &row[c..2 * c], &row[2 * c..3 * c], &row[3 * c..]];
            }
            [-1, 0, 1, 2].map(|di| self.at(i + di, j + dj))
        });
        for (c, out) in out.iter_mut().enumerate().take(c) {
            let (mut sum, mut least, mut most) = (T::ZERO, rows[0][0][c], rows[0][0][c]);
            for (row, down) in rows.iter().zip(down) {
                let row = row.map(|pixel| pixel[c]);
                sum += down * ((row[0] * across[0] + row[1] * across[1]) + (row[2] * across[2] + row[3] * across[3]));
                least = least.smaller(row[0].smaller(row[1]).smaller(row[2].smaller(row[3])));
                most = most.larger(row[0].larger(row[1]).larger(row[2].larger(row[3])));
            }
            *out += weight * sum.larger(least).smaller(most);
        }
    }

    /// The pixels (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1).
    #[inline(always)]
    fn quad(&self, i: i32, j: i32) -> [&[T]; 4] {
        let (w, h) = (crate::ground::window::index(self.plane.w), crate::ground::window::index(self.plane.h));
        if i >= 0 && j >= 0 && i + 1 < w && j + 1 < h {
            let (c, row) = (self.channels, self.plane.w * self.channels);
            let first = crate::ground::window::offset(j * w + i) * c;
            let data = &self.data[first..first + row + 2 * c];
            return [&data[..c], &data[c..2 * c], &data[row..row + c], &data[row + c..row + 2 * c]];
        }
        [self.at(i, j), self.at(i + 1, j), self.at(i, j + 1), self.at(i + 1, j + 1)]
    }

    /// The values at a position.
    pub fn fetch(&self, at: [T; 2], fetch: Fetch) -> Vec<T> {
        let mut out = vec![T::default(); self.channels];
        self.add(at, fetch, T::ONE, &mut out);
        out
    }

    /// The picture blurred by a Gaussian of σ = h/2, cut at 4 σ: level `h` of the stack. Level 1 is the picture itself.
    #[must_use]
    pub fn blurred(&self, h: usize) -> Self {
        if h <= 1 {
            return self.clone();
        }
        let weights = gaussian::<T>(h);
        let across = self.convolve(&weights, true);
        across.convolve(&weights, false)
    }

    fn convolve(&self, weights: &[T], across: bool) -> Self {
        let (PixelPlane { w, h, wrap }, c) = (self.plane, self.channels);
        let n = if across { w } else { h };
        let radius = crate::ground::window::index(weights.len() / 2);
        // Source of each tap of each column or row.
        let from: Vec<Vec<usize>> = (0..crate::ground::window::index(n))
            .map(|k| (k - radius..=k + radius).map(|k| mirrored(k, n, wrap[usize::from(!across)])).collect())
            .collect();
        let mut data = vec![T::default(); self.data.len()];
        data.par_chunks_mut(w * c).enumerate().for_each(|(y, out)| {
            crate::ground::simd::dispatch(
                #[inline(always)]
                || {
                    if across {
                        let row = &self.data[y * w * c..(y + 1) * w * c];
                        // Extend the row by the reach of its taps, so that each tap is one shifted row.
                        let reached = from[0].iter().chain(from[1..].iter().filter_map(|taps| taps.last()));
                        let padded: Vec<T> =
                            reached.flat_map(|&from| &row[from * c..(from + 1) * c]).copied().collect();
                        for (k, weight) in weights.iter().enumerate() {
                            for (out, v) in out.iter_mut().zip(&padded[k * c..]) {
                                *out += *weight * *v;
                            }
                        }
                    } else {
                        for (weight, &from) in weights.iter().zip(&from[y]) {
                            for (out, v) in out.iter_mut().zip(&self.data[from * w * c..(from + 1) * w * c]) {
                                *out += *weight * *v;
                            }
                        }
                    }
                },
            );
        });
        Self { data, ..self.clone() }
    }

    /// The next level of the pyramid: each pixel is the mean of 2×2 pixels (of fewer at an odd border).
    #[must_use]
    pub fn halved(&self) -> Self {
        let plane = PixelPlane { w: self.plane.w.div_ceil(2), h: self.plane.h.div_ceil(2), ..self.plane };
        let mut data = Vec::with_capacity(plane.w * plane.h * self.channels);
        for y in 0..plane.h {
            for x in 0..plane.w {
                let (x1, y1) = ((2 * x + 1).min(self.plane.w - 1), (2 * y + 1).min(self.plane.h - 1));
                let quad = [(2 * x, 2 * y), (x1, 2 * y), (2 * x, y1), (x1, y1)];
                for c in 0..self.channels {
                    let v = quad.map(|(x, y)| self.data[(y * self.plane.w + x) * self.channels + c]);
                    data.push((v[0] + v[1] + v[2] + v[3]) * T::of(0.25));
                }
            }
        }
        Self { plane, channels: self.channels, data }
    }
}

/// Maps column `k` to 0..`n`: wraps or mirrors.
pub(super) fn mirrored(k: i32, n: usize, wrap: bool) -> usize {
    if wrap {
        return PixelPlane::bring(k, n, true);
    }
    let period = 2 * crate::ground::window::index(n);
    let k = k.rem_euclid(period);
    crate::ground::window::offset(k.min(period - 1 - k))
}

/// Weights of a Gaussian of σ = h/2 at the distances -2h … 2h; they sum up to 1.
fn gaussian<T: Real>(h: usize) -> Vec<T> {
    let (radius, sigma) = (2 * crate::ground::window::index(h), h as f64 / 2.0);
    let bell = |d: i32| libm::exp(-f64::from(d * d) / (2.0 * sigma * sigma));
    let sum: f64 = (-radius..=radius).map(bell).sum();
    (-radius..=radius).map(|d| T::of(bell(d) / sum)).collect()
}

/// The largest whole number not above `x`, within ±10⁹.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "limited just before")]
pub(super) fn floor<T: Real>(x: T) -> i32 {
    x.wide().floor().clamp(-1e9, 1e9) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::sample::{Filter, Outside, Sampler};
    use crate::ground::window::{View, WindowExt};
    use shibo_value::Window;

    fn picture(wrap: [bool; 2], value: impl Fn(usize, usize) -> f32) -> Texels<f32> {
        let plane = PixelPlane { w: 9, h: 7, wrap };
        Texels::new(plane, 2, (0..63).flat_map(|p| [value(p % 9, p / 9), -3.0 * value(p % 9, p / 9)]).collect())
    }

    fn noise(x: usize, y: usize) -> f32 {
        crate::ground::hash::Hash::new(11).unit_f32((9 * y + x) as u64)
    }

    #[test]
    fn the_cubic_filter_is_exact_at_pixels_on_constants_and_on_ramps() {
        let random = picture([true, false], noise);
        let flat = picture([false; 2], |_, _| 0.7);
        let ramp = picture([false; 2], |x, y| 2.0 * x as f32 - 0.5 * y as f32);
        for k in 0..400 {
            let hash = crate::ground::hash::Hash::new(k);
            let (u, v) = (hash.unit_f32(0), hash.unit_f32(1));
            let [x, y] = [u * 60.0 - 20.0, v * 60.0 - 20.0];
            let pixel = [x.floor() + 0.5, y.floor() + 0.5];
            assert_eq!(random.fetch(pixel, Fetch::CatmullRom), random.fetch(pixel, Fetch::Nearest));
            assert!((flat.fetch([x, y], Fetch::CatmullRom)[0] - 0.7).abs() < 1e-6);
            let [x, y] = [1.5 + u * 6.0, 1.5 + v * 4.0];
            let [one, other] = [Fetch::CatmullRom, Fetch::Bilinear].map(|fetch| ramp.fetch([x, y], fetch)[1]);
            assert!((one - other).abs() < 1e-4, "{x} {y}: {one} {other}");
        }
    }

    #[test]
    fn matches_cubic_filter_of_pictures_within_range() {
        for (wrap, outside) in [([true; 2], Outside::Wrap), ([false; 2], Outside::Clamp)] {
            let random = picture(wrap, noise);
            let plane: Vec<f32> = (0..63).map(|p| noise(p % 9, p / 9)).collect();
            let sampler = Sampler::new(View::new(&plane, Window::of(0, 0, 9, 7)), Filter::CatmullRom, [outside; 2]);
            let mut limited = 0;
            for k in 0..2000 {
                let hash = crate::ground::hash::Hash::new(k);
                let at = [hash.unit_f32(0) * 20.0 - 5.0, hash.unit_f32(1) * 20.0 - 5.0];
                let (i, j) = (floor(at[0] - 0.5), floor(at[1] - 0.5));
                let around = (0..16).map(|d| random.at(i - 1 + d % 4, j - 1 + d / 4)[0]);
                let (least, most) = around.fold((1.0f32, 0.0f32), |(a, b), v| (a.min(v), b.max(v)));
                let (shown, free) = (random.fetch(at, Fetch::CatmullRom)[0], sampler.at(at[0], at[1]));
                assert!((shown - free.clamp(least, most)).abs() < 1e-5, "{at:?}: {shown} {free}");
                limited += usize::from(free > most || free < least);
            }
            assert!(limited > 0);
        }
    }
}
