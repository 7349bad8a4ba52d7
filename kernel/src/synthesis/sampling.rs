//! Evaluates pictures at synthesised coordinates, on any grid.
use super::jacobian::{self, IDENTITY, Jacobian};
use super::magnify;
use super::plane::PixelPlane;
use super::texels::{Fetch, Texels};
use crate::ground::number::narrow;
use crate::ground::window::{WindowExt, index};
use shibo_value::Window;

/// A picture that covers the exemplar.
pub struct Source {
    /// The picture, and its halved levels if features may shrink.
    levels: Vec<Texels<f32>>,
    /// Pixels of the picture per exemplar pixel, in x and y.
    scale: [f32; 2],
    /// Filter between pixels.
    fetch: Fetch,
}

impl Source {
    /// Builds a picture of these planes, `scale` times as fine as the exemplar. `shrinks`: features may become smaller.
    pub fn new(plane: PixelPlane, planes: &[&[f32]], scale: [f32; 2], fetch: Fetch, shrinks: bool) -> Self {
        let data = (0..plane.w * plane.h).flat_map(|p| planes.iter().map(move |plane| plane[p])).collect();
        let mut levels = vec![Texels::new(plane, planes.len(), data)];
        // Labels must not be averaged.
        while shrinks && fetch != Fetch::Nearest && levels.len() < 8 {
            let Some(half) = levels.last().filter(|l| l.plane.w.min(l.plane.h) > 1).map(Texels::halved) else { break };
            levels.push(half);
        }
        Self { levels, scale, fetch }
    }

    /// Filter between pixels.
    pub(super) fn fetch(&self) -> Fetch {
        self.fetch
    }

    /// Adds the value at exemplar position `at`, averaged over about `size` exemplar pixels across, to `out`.
    #[inline(always)]
    pub(super) fn add(&self, at: [f32; 2], size: f32, weight: f32, out: &mut [f32]) {
        let place = [at[0] * self.scale[0], at[1] * self.scale[1]];
        let size = size * self.scale[0].min(self.scale[1]);
        if size <= 1.5 || self.levels.len() == 1 {
            self.levels[0].add(place, self.fetch, weight, out);
            return;
        }
        let wanted = crate::ground::math::log2(size).min((self.levels.len() - 1) as f32);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number of a level")]
        let low = (wanted as usize).min(self.levels.len() - 1);
        let mix = wanted - low as f32;
        let mut read = |level: usize, weight: f32| {
            if let Some(texels) = self.levels.get(level).filter(|_| weight > 0.0) {
                let plane = self.levels[0].plane;
                let scale = [texels.plane.w as f32 / plane.w as f32, texels.plane.h as f32 / plane.h as f32];
                let fetch = if level == 0 { self.fetch } else { Fetch::Bilinear };
                texels.add([place[0] * scale[0], place[1] * scale[1]], fetch, weight, out);
            }
        };
        read(low, weight * (1.0 - mix));
        read(low + 1, weight * mix);
    }
}

/// Pixels to evaluate, and the coordinates of the map behind them.
pub struct Area<'a> {
    /// Positions in the exemplar.
    pub map: &'a [[f32; 2]],
    /// Size of the map, and the axes that wrap.
    pub plane: PixelPlane,
    /// Finest pixels per pixel of the map.
    pub spacing: f64,
    /// The outer corner of pixel (0, 0) of the result, in pixels of the map.
    pub origin: [f64; 2],
    /// The size of a pixel of the result, in pixels of the map.
    pub step: [f64; 2],
    /// The pixels of the result.
    pub window: Window,
    /// Jacobians of the window's pixels, if not constant 1.
    pub jacobians: Option<&'a [Jacobian]>,
    /// True if Δ is multiplied by the Jacobian: equation (6), else (5).
    pub follow: bool,
}

/// Largest number of map samples across a pixel of the result.
const MOST: i32 = 16;

impl Area<'_> {
    /// Returns whether the pixels of the result coincide with those of the map.
    fn aligned(&self) -> bool {
        let near = |v: f64| (v - v.round()).abs() < 1e-6;
        (0..2).all(|d| (self.step[d] - 1.0).abs() < 1e-9 && near(self.origin[d]))
    }

    /// Fills the planes of all channels, one after another.
    pub fn fill(&self, source: &Source, channels: usize, out: &mut [f32]) {
        crate::ground::simd::dispatch(
            #[inline(always)]
            || match channels {
                1 => self.fill_all::<1>(source, out),
                2 => self.fill_all::<2>(source, out),
                3 => self.fill_all::<3>(source, out),
                _ => self.fill_all::<4>(source, out),
            },
        );
    }

    #[inline(always)]
    fn fill_all<const C: usize>(&self, source: &Source, out: &mut [f32]) {
        let n = self.window.len();
        let whole = self.aligned();
        #[expect(clippy::cast_possible_truncation, reason = "limited to a few samples")]
        let parts = match source.fetch {
            Fetch::Nearest => [1; 2],
            _ => self.step.map(|s| (s - 1e-9).ceil().clamp(1.0, f64::from(MOST)) as i32),
        };
        let mut value = [0.0f32; C];
        let value = &mut value;
        for y in 0..self.window.rows() {
            for x in 0..self.window.columns() {
                let pixel = y * self.window.columns() + x;
                let j = self.jacobians.map_or(IDENTITY, |list| list[pixel]);
                value.fill(0.0);
                let (px, py) = (f64::from(self.window.x + index(x)), f64::from(self.window.y + index(y)));
                if whole {
                    self.one(source, [px, py], &j, value);
                } else {
                    let weight = 1.0 / (parts[0] * parts[1]) as f32;
                    for part in 0..parts[0] * parts[1] {
                        let (i, k) = (part % parts[0], part / parts[0]);
                        let sub = |at: f64, k: i32, d: usize| {
                            self.origin[d] + (at + (f64::from(k) + 0.5) / f64::from(parts[d])) * self.step[d]
                        };
                        self.between(source, [sub(px, i, 0), sub(py, k, 1)], (&j, parts), weight, value);
                    }
                }
                value.iter().enumerate().for_each(|(c, v)| out[c * n + pixel] = *v);
            }
        }
    }

    #[inline(always)]
    fn one(&self, source: &Source, [x, y]: [f64; 2], j: &Jacobian, value: &mut [f32]) {
        #[expect(clippy::cast_possible_truncation, reason = "pixels")]
        let (x, y) = ((x + self.origin[0]).round() as i32, (y + self.origin[1]).round() as i32);
        let at = self.map[super::plane::Lookup::index(&self.plane, x, y)];
        let size = jacobian::det(j).abs().sqrt() * narrow(self.spacing);
        source.add(at, size, 1.0, value);
    }

    #[inline(always)]
    fn between(&self, source: &Source, p: [f64; 2], (j, parts): (&Jacobian, [i32; 2]), weight: f32, value: &mut [f32]) {
        #[expect(clippy::cast_possible_truncation, reason = "positions within a map")]
        let p = p.map(|v| v as f32);
        let spacing = narrow(self.spacing);
        let lead = if self.follow { *j } else { IDENTITY }.map(|v| v * spacing);
        let size = jacobian::det(j).abs().sqrt() * spacing * narrow(self.step[0] / f64::from(parts[0]));
        // An average needs no filter: the nearest pixel is enough.
        if parts[0] * parts[1] > 1 {
            #[expect(clippy::cast_possible_truncation, reason = "positions within a map")]
            let cell = p.map(|v| v.floor() as i32);
            let at = self.map[super::plane::Lookup::index(&self.plane, cell[0], cell[1])];
            source.add(at, size, weight, value);
            return;
        }
        let places = magnify::places(self.map, &self.plane, p, |_| lead);
        let first = places[0].0;
        let near = |at: [f32; 2]| (at[0] - first[0]).abs() + (at[1] - first[1]).abs() < 1e-3;
        if source.fetch == Fetch::Nearest {
            let nearest = places.into_iter().reduce(|best, place| if place.1 > best.1 { place } else { best });
            source.add(nearest.map_or(first, |nearest| nearest.0), size, weight, value);
            return;
        }
        // If all four agree, one sample is enough.
        if near(places[1].0) && near(places[2].0) && near(places[3].0) {
            source.add(first, size, weight, value);
            return;
        }
        for (at, share) in places {
            if share > 0.0 {
                source.add(at, size, weight * share, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(map: &[[f32; 2]], per: f64, n: usize) -> Area<'_> {
        let (plane, window) = (PixelPlane { w: 4, h: 4, wrap: [true; 2] }, Window::of(0, 0, n, n));
        let step = [1.0 / per; 2];
        Area { map, plane, spacing: 1.0, origin: [0.0; 2], step, window, jacobians: None, follow: false }
    }

    fn filled(fetch: Fetch, map: &[[f32; 2]], per: f64, n: usize) -> Vec<f32> {
        let names: Vec<f32> = (0..64).map(|p| (p * 37 % 64) as f32).collect();
        let source = Source::new(PixelPlane { w: 8, h: 8, wrap: [false; 2] }, &[&names], [1.0; 2], fetch, true);
        let mut out = vec![0.0; n * n];
        area(map, per, n).fill(&source, 1, &mut out);
        out
    }

    #[test]
    fn never_averages_labels() {
        let hash = crate::ground::hash::Hash::new(5);
        let map: Vec<[f32; 2]> = (0..16).map(|p| [0, 1].map(|d| 8.0 * hash.unit_f32(2 * p + d))).collect();
        for (per, n) in [(1.0, 4), (3.0, 12), (0.4, 1)] {
            let shown = filled(Fetch::Nearest, &map, per, n);
            assert!(shown.iter().all(|v| v.fract() == 0.0 && (0.0..64.0).contains(v)), "{per}: {shown:?}");
            assert!(filled(Fetch::Bilinear, &map, per, n).iter().any(|v| v.fract() != 0.0), "{per}");
        }
    }

    #[test]
    fn filters_agree_at_whole_pixels() {
        let map: Vec<[f32; 2]> = (0..16).map(|p| [(p * 5 % 8) as f32 + 0.5, (p * 3 % 8) as f32 + 0.5]).collect();
        let shown = [Fetch::Nearest, Fetch::Bilinear, Fetch::CatmullRom].map(|fetch| filled(fetch, &map, 1.0, 4));
        assert!(shown[0] == shown[1] && shown[1] == shown[2], "{shown:?}");
    }
}
