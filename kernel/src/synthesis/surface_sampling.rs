//! Evaluates coordinates on a surface, on any grid (rows C28 to C30): equation (6) with the four nearest pixels; pixels
//! of other charts are read across the border.
use super::jacobian::{self, Jacobian};
use super::plane::Neighbours;
use super::sampling::Source;
use super::sheet::Sheet;
use super::texels::Fetch;
use crate::ground::number::narrow;
use crate::ground::window::{OCTANTS, WindowExt, index};
use crate::mesh::texels;
use glam::{DMat2, DVec2};
use shibo_value::{Grid, Window};

/// Coordinates on a surface, to be evaluated.
pub struct SurfaceMap<'a> {
    /// The pixels.
    pub sheet: Sheet<'a>,
    /// Their positions in the exemplar.
    pub coords: &'a [[f32; 2]],
    /// Their Jacobians.
    pub jacobians: &'a [Jacobian],
    /// The size of an exemplar pixel in mm.
    pub pitch: DVec2,
}

/// The surface under a pixel of the result: the triangle, and the map pixel whose Jacobian applies.
#[derive(Clone, Copy, Debug)]
pub struct Under {
    /// The triangle.
    pub triangle: usize,
    /// The pixel of the map.
    pub pixel: usize,
}

/// Largest number of map samples across a pixel of the result.
const MOST: i32 = 16;

impl SurfaceMap<'_> {
    fn chart(&self, triangle: usize) -> u16 {
        self.sheet.atlas.charts[triangle]
    }

    /// Index of a pixel, if it belongs to a chart.
    fn own(&self, [x, y]: [i32; 2], chart: u16) -> Option<usize> {
        let [w, h] = self.sheet.level.size.map(u32::cast_signed);
        let pixel = ((0..w).contains(&x) && (0..h).contains(&y)).then(|| usize::try_from(y * w + x).ok()).flatten()?;
        let triangle = self.sheet.level.triangle(pixel)?;
        (self.chart(triangle) == chart).then_some(pixel)
    }

    /// The pixel of a chart nearest to `at`, at most two pixels away from `cell`.
    fn nearest(&self, cell: [i32; 2], at: DVec2, chart: u16) -> Option<usize> {
        if let Some(pixel) = self.own(cell, chart) {
            return Some(pixel);
        }
        let mut best: Option<(f64, usize)> = None;
        for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dx, dy))) {
            let near = [cell[0] + dx, cell[1] + dy];
            let Some(pixel) = self.own(near, chart) else { continue };
            let distance = at.distance_squared(center(near));
            if best.is_none_or(|b| distance < b.0) {
                best = Some((distance, pixel));
            }
        }
        best.map(|best| best.1)
    }

    /// Coordinates of a map pixel as continued from a chart that need not own the pixel: those at the same point of the
    /// surface.
    fn seen(&self, cell: [i32; 2], chart: u16) -> Option<[f32; 2]> {
        let pixel = self.nearest(cell, center(cell), chart)?;
        let w = self.sheet.plane().w;
        let from = [index(pixel % w), index(pixel / w)];
        let off = [cell[0] - from[0], cell[1] - from[1]];
        if off == [0, 0] {
            return Some(self.coords[pixel]);
        }
        if let Some(octant) = OCTANTS.iter().position(|o| *o == off)
            && let Some((to, residue)) = self.sheet.near((from[0], from[1]), octant)
        {
            let by = jacobian::apply(&self.jacobians[to], residue);
            return Some([0, 1].map(|d| self.coords[to][d] + by[d]));
        }
        let by = jacobian::apply(&self.jacobians[pixel], off.map(|v| v as f32));
        Some([0, 1].map(|d| self.coords[pixel][d] + by[d]))
    }

    /// Fills the planes of all channels with `source`, at the pixels of a grid on the canvas. Returns the surface under
    /// each pixel; pixels without one are 0.
    pub fn fill(
        &self,
        source: &Source,
        (grid, window): (&Grid, Window),
        channels: usize,
        out: &mut [f32],
    ) -> Vec<Option<Under>> {
        let n = window.len();
        let mut ids = vec![0.0f32; n];
        texels::fill(self.sheet.atlas, grid, window, &mut ids);
        let pixel = self.sheet.raster().step() * self.sheet.atlas.size_mm;
        let step = grid.step / pixel;
        #[expect(clippy::cast_possible_truncation, reason = "limited to a few samples")]
        let parts = match source.fetch() {
            Fetch::Nearest => [1; 2],
            _ => step.to_array().map(|s| (s - 1e-9).ceil().clamp(1.0, f64::from(MOST)) as i32),
        };
        let mut under = vec![None; n];
        let mut value = [0.0f32; 4];
        let value = &mut value[..channels];
        for (p, under) in under.iter_mut().enumerate() {
            value.fill(0.0);
            if let Some(triangle) = texels::triangle(ids[p]) {
                let (x, y) = (window.x + index(p % window.columns()), window.y + index(p / window.columns()));
                let at = grid.center(x, y) / pixel;
                *under = self.show(source, triangle, (at, step, parts), value);
            }
            value.iter().enumerate().for_each(|(c, v)| out[c * n + p] = *v);
        }
        under
    }

    fn show(
        &self,
        source: &Source,
        triangle: usize,
        (at, step, parts): (DVec2, DVec2, [i32; 2]),
        value: &mut [f32],
    ) -> Option<Under> {
        let chart = self.chart(triangle);
        let pixel = self.nearest(cell(at), at, chart)?;
        let j = &self.jacobians[pixel];
        let size = jacobian::det(j).abs().sqrt();
        if parts[0] * parts[1] > 1 {
            let mut seen = Vec::with_capacity(16);
            for k in 0..parts[0] * parts[1] {
                let part = DVec2::new(f64::from(k % parts[0]) + 0.5, f64::from(k / parts[0]) + 0.5);
                let sub = at + (part / DVec2::new(f64::from(parts[0]), f64::from(parts[1])) - 0.5) * step;
                seen.extend(self.own(cell(sub), chart));
            }
            if seen.is_empty() {
                seen.push(pixel);
            }
            let size = size * narrow(step.x / f64::from(parts[0]));
            let weight = 1.0 / seen.len() as f32;
            seen.into_iter().for_each(|pixel| source.add(self.coords[pixel], size, weight, value));
            return Some(Under { triangle, pixel });
        }
        let size = size * narrow(step.x.min(1.0));
        let corner = (at - 0.5).floor();
        let rest = at - 0.5 - corner;
        if rest.min_element() < 1e-6 && rest.max_element() < 1e-6 {
            source.add(self.seen(cell(at), chart)?, size, 1.0, value);
            return Some(Under { triangle, pixel });
        }
        let mut places = [([0.0f32; 2], 0.0f32); 4];
        for (k, place) in places.iter_mut().enumerate() {
            let (i, m) = (f64::from(u8::from(k & 1 == 1)), f64::from(u8::from(k & 2 == 2)));
            let delta = rest - DVec2::new(i, m);
            let weight = (1.0 - delta.x.abs()) * (1.0 - delta.y.abs());
            let by = jacobian::apply(j, [narrow(delta.x), narrow(delta.y)]);
            let from = cell(corner + DVec2::new(i, m) + 0.5);
            // If the corner is out of reach of the chart, extrapolate from its nearest pixel.
            let seen = match self.seen(from, chart) {
                Some(seen) => [seen[0] + by[0], seen[1] + by[1]],
                None => self.led(pixel, at),
            };
            *place = (seen, narrow(weight));
        }
        show_places(source, &places, size, value);
        Some(Under { triangle, pixel })
    }

    /// Extrapolates the coordinates of a pixel to a position.
    fn led(&self, pixel: usize, at: DVec2) -> [f32; 2] {
        let w = self.sheet.plane().w;
        let off = at - center([index(pixel % w), index(pixel / w)]);
        let by = jacobian::apply(&self.jacobians[pixel], [narrow(off.x), narrow(off.y)]);
        [0, 1].map(|d| self.coords[pixel][d] + by[d])
    }

    /// Change of the point on the surface per pixel, in mm, along T and across; T lies along the canvas' x axis.
    fn axes(&self, triangle: usize) -> DMat2 {
        let step = self.sheet.raster().step();
        let [x, y] = self.sheet.atlas.jacobians[triangle].map(|axis| axis.as_dvec3());
        let (x, y) = (x * step.x, y * step.y);
        let along = x.normalize_or_zero();
        let rest = y - along * along.dot(y);
        DMat2::from_cols(DVec2::new(x.length(), 0.0), DVec2::new(along.dot(y), rest.length()))
    }

    /// The Jacobian of a pixel in mm of the exemplar per pixel.
    fn in_mm(&self, pixel: usize) -> DMat2 {
        let [a, b, c, d] = self.jacobians[pixel].map(f64::from);
        DMat2::from_cols(DVec2::new(a * self.pitch.x, c * self.pitch.y), DVec2::new(b * self.pitch.x, d * self.pitch.y))
    }

    /// Scale of the features on the surface relative to the exemplar.
    pub fn size(&self, under: Under) -> f32 {
        let (surface, exemplar) = (self.axes(under.triangle).determinant(), self.in_mm(under.pixel).determinant());
        narrow((surface.abs() / exemplar.abs().max(1e-12)).sqrt())
    }

    /// Converts a normal of the exemplar to the surface, relative to the axes of the atlas; y points up in both. Slopes
    /// rotate and stretch with their features and keep their height.
    pub fn normal(&self, under: Under, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let z = f64::from(z.max(1e-4));
        let slope = DVec2::new(f64::from(x) / z, -f64::from(y) / z);
        let axes = self.axes(under.triangle);
        let turned = axes.transpose().inverse() * (self.in_mm(under.pixel).transpose() * slope);
        let turned = turned * f64::from(self.size(under));
        let turned = if turned.is_finite() { turned } else { slope };
        let length = (turned.length_squared() + 1.0).sqrt();
        [narrow(turned.x / length), narrow(-turned.y / length), narrow(1.0 / length)]
    }
}

/// Adds the values of four positions.
fn show_places(source: &Source, places: &[([f32; 2], f32); 4], size: f32, value: &mut [f32]) {
    let first = places[0].0;
    let near = |at: [f32; 2]| (at[0] - first[0]).abs() + (at[1] - first[1]).abs() < 1e-3;
    if source.fetch() == Fetch::Nearest {
        let nearest = places.iter().copied().reduce(|best, place| if place.1 > best.1 { place } else { best });
        source.add(nearest.map_or(first, |nearest| nearest.0), size, 1.0, value);
    } else if places[1..].iter().all(|place| near(place.0)) {
        source.add(first, size, 1.0, value);
    } else {
        places.iter().filter(|place| place.1 > 0.0).for_each(|(at, share)| source.add(*at, size, *share, value));
    }
}

fn center([x, y]: [i32; 2]) -> DVec2 {
    DVec2::new(f64::from(x), f64::from(y)) + 0.5
}

#[expect(clippy::cast_possible_truncation, reason = "pixels of an atlas")]
fn cell(at: DVec2) -> [i32; 2] {
    // A centre computed from mm may be slightly off the pixel's centre, but is never near its sides.
    [at.x.floor() as i32, at.y.floor() as i32]
}

#[cfg(test)]
#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "small pictures")]
mod tests {
    use super::*;
    use crate::ground::stop::NEVER;
    use crate::mesh::frame::Framing;
    use crate::mesh::levels::{LevelsSpec, indirection};
    use crate::synthesis::plane::PixelPlane;
    use glam::{DVec3, UVec2};
    use shibo_value::Frames;
    use std::sync::Arc;

    /// Rows C28 to C30: an affine map is reproduced between the pixels of the map, across borders and in gutters, and
    /// normals rotate with their features.
    #[test]
    fn affine_maps_are_magnified_exactly() {
        let atlas = Arc::new(crate::mesh::fixture::plane("plane_wild"));
        let n = atlas.mesh.positions.len();
        let (mesh, t) = (Arc::clone(&atlas.mesh), vec![glam::Vec3::X; n]);
        let frames = Frames { mesh, t, b: Vec::new(), symmetry: 1, turns: Vec::new(), singular: Vec::new() };
        let spec = LevelsSpec { size: [128, 128], levels: 1, exact: true, ring: 0, ends: &[] };
        let pointers = indirection(&atlas, &spec, NEVER);
        let sheet = Sheet::new(&pointers, 0);
        let pitch = DVec2::new(0.5, 0.5);
        let jacobians = sheet.jacobians(&Framing { atlas: &atlas, frames: &frames }, pitch, (&[], &[]));
        let position = |place: DVec3| (DVec2::new(place.x + 16.0, 80.0 - place.y) / pitch).as_vec2().to_array();
        let count = sheet.level.owner.len();
        let coords: Vec<[f32; 2]> = (0..count).map(|p| sheet.place(p).map_or([f32::NAN; 2], position)).collect();
        let plane = PixelPlane { w: 192, h: 192, wrap: [false; 2] };
        let ramps: Vec<Vec<f32>> =
            [0, 1].map(|d: usize| (0..192 * 192).map(|p| [p % 192, p / 192][d] as f32 + 0.5).collect()).to_vec();
        let source = Source::new(plane, &[&ramps[0], &ramps[1]], [1.0; 2], Fetch::Bilinear, false);
        let map = SurfaceMap { sheet, coords: &coords, jacobians: &jacobians, pitch };
        for pixels in [128u32, 320, 1000] {
            let grid =
                Grid { origin: DVec2::ZERO, step: DVec2::splat(100.0 / f64::from(pixels)), period: None, shown: None };
            let window = Window::full(UVec2::splat(pixels));
            let n = (pixels * pixels) as usize;
            let mut out = vec![0.0; 2 * n];
            let under = map.fill(&source, (&grid, window), 2, &mut out);
            let (mut seen, mut worst) = (0, 0.0f32);
            for (p, under) in under.iter().enumerate() {
                let Some(under) = under else { continue };
                let at = grid.center(p as i32 % pixels as i32, p as i32 / pixels as i32) / atlas.size_mm;
                let wanted = position(atlas.place(under.triangle, at));
                worst = worst.max((out[p] - wanted[0]).abs()).max((out[n + p] - wanted[1]).abs());
                seen += 1;
                if p % 97 == 0 {
                    // Under light from the side, all charts look the same: the normal maps to the same direction in
                    // space.
                    let [x, y, z] = map.normal(*under, [0.6, 0.0, 0.8]).map(f64::from);
                    let [u, v] = atlas.jacobians[under.triangle].map(|axis| axis.as_dvec3());
                    let along = u.normalize();
                    let up = -(v - along * along.dot(v)).normalize();
                    let lit = along * x + up * y + DVec3::Z * z;
                    assert!(lit.distance(DVec3::new(0.6, 0.0, 0.8)) < 1e-4, "{lit}");
                }
            }
            assert!(seen > n / 10 && worst < 2e-2, "{pixels}: {worst} over {seen}");
        }
    }
}
