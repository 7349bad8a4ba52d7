//! Continues a picture beyond the border of a chart, with the values of the chart where the surface goes on.
//!
//! A path leads over the surface from the nearest pixel of the chart to the position of a gutter pixel; there the
//! picture is interpolated between the pixels of that chart. Cost: O(pixels of gutters), about 0.5 µs each.
use super::texels;
use super::walk::{SurfacePoint, walk_turning};
use crate::ground::number::narrow;
use crate::ground::window::{WindowExt, index};
use glam::{DMat2, DVec2};
use rayon::prelude::*;
use shibo_value::{Atlas, Grid, Window};

/// A picture of an atlas, or a window of it.
#[derive(Clone, Copy)]
pub struct AtlasPicture<'a> {
    /// The atlas.
    pub atlas: &'a Atlas,
    /// The pixel grid of the whole picture.
    pub grid: &'a Grid,
    /// The window of the grid.
    pub window: Window,
}

/// Kind of the values of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// Values that may be interpolated.
    Values,
    /// Normals, stored as ½ + ½n, in three planes; they are rotated with their charts.
    Normals,
    /// Ids, which must not be interpolated.
    Ids,
}

/// Change of the point on the surface per mm of the canvas, along the canvas' x axis and across: columns for x and y.
pub fn axes(atlas: &Atlas, triangle: usize) -> DMat2 {
    let [x, y] = atlas.jacobians[triangle].map(|axis| axis.as_dvec3());
    let (x, y) = (x / atlas.size_mm.x, y / atlas.size_mm.y);
    let along = x.normalize_or_zero();
    DMat2::from_cols(DVec2::new(x.length(), 0.0), DVec2::new(along.dot(y), (y - along * along.dot(y)).length()))
}

/// Marks a pixel without a chart nearby.
const NONE: u32 = u32::MAX;

impl AtlasPicture<'_> {
    fn uv(&self, pixel: usize) -> DVec2 {
        let (x, y) = (pixel % self.window.columns(), pixel / self.window.columns());
        self.grid.center(self.window.x + index(x), self.window.y + index(y)) / self.atlas.size_mm
    }

    /// The pixel at a column and a row, if there is one.
    fn pixel(&self, x: i64, y: i64) -> Option<usize> {
        let (w, h) = (self.window.columns(), self.window.rows());
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        (x < w && y < h).then_some(y * w + x)
    }

    fn around(&self, pixel: usize) -> impl Iterator<Item = usize> {
        let w = self.window.columns();
        let (x, y) = (i64::from(index(pixel % w)), i64::from(index(pixel / w)));
        (0..9).filter(|n| *n != 4).filter_map(move |n| self.pixel(x + n % 3 - 1, y + n / 3 - 1))
    }

    /// For each pixel the nearest pixel of a chart, within `width` rings.
    fn anchors(&self, owners: &[u32], width: usize) -> Vec<u32> {
        let mut anchors: Vec<u32> = (0..).zip(owners).map(|(p, owner)| if *owner > 0 { p } else { NONE }).collect();
        let mut edge: Vec<usize> = (0..owners.len())
            .into_par_iter()
            .filter(|&p| owners[p] == 0 && self.around(p).any(|n| owners[n] > 0))
            .collect();
        for _ in 0..width {
            let place = |p: u32| self.uv(p as usize);
            let nearest = |&p: &usize| {
                let here = self.uv(p);
                let near = self.around(p).map(|n| anchors[n]).filter(|anchor| *anchor != NONE);
                let far = |anchor: u32| ((place(anchor) - here) * self.atlas.size_mm).length_squared();
                near.min_by(|a, b| far(*a).total_cmp(&far(*b)).then(a.cmp(b))).unwrap_or(NONE)
            };
            let found: Vec<u32> = edge.par_iter().map(nearest).collect();
            edge.iter().zip(found).for_each(|(p, anchor)| anchors[*p] = anchor);
            let mut next: Vec<usize> =
                edge.iter().flat_map(|p| self.around(*p)).filter(|n| anchors[*n] == NONE).collect();
            next.sort_unstable();
            next.dedup();
            edge = next;
        }
        anchors
    }

    /// Fills `width` rings of pixels around charts with the values of the surface there.
    pub fn carry(&self, width: usize, holds: Holds, planes: &mut [Vec<f32>]) {
        let owners = texels::owners(self.atlas, self.grid, self.window);
        let anchors = self.anchors(&owners, width);
        let old: &[Vec<f32>] = planes;
        let found: Vec<(usize, Vec<f32>)> = (0..anchors.len())
            .into_par_iter()
            .with_min_len(1024)
            .filter(|&p| owners[p] == 0 && anchors[p] != NONE)
            .map(|p| (p, self.value(p, anchors[p] as usize, (&owners, holds), old)))
            .collect();
        for (p, value) in found {
            planes.iter_mut().zip(value).for_each(|(plane, value)| plane[p] = value);
        }
    }

    fn value(&self, pixel: usize, anchor: usize, (owners, holds): (&[u32], Holds), planes: &[Vec<f32>]) -> Vec<f32> {
        let triangle = owners[anchor] as usize - 1;
        let from = SurfacePoint { triangle, uv: self.uv(anchor) };
        let kept = || planes.iter().map(|plane| plane[anchor]).collect();
        let Some((way, turn)) = walk_turning(self.atlas, from, self.uv(pixel) - from.uv) else { return kept() };
        let Some(mut value) = self.between(way.spot, (owners, holds), planes) else { return kept() };
        if holds == Holds::Normals && way.crossed {
            let size = DMat2::from_diagonal(self.atlas.size_mm);
            let (here, there) = (axes(self.atlas, triangle), axes(self.atlas, way.spot.triangle));
            // From the axes of the chart read to the axes of the chart continued.
            let back = here * size * turn.inverse() * size.inverse() * there.inverse();
            let flat = DVec2::new(f64::from(value[0]) * 2.0 - 1.0, 1.0 - f64::from(value[1]) * 2.0);
            let turned = (back * flat).normalize_or_zero() * flat.length();
            if turned.is_finite() {
                (value[0], value[1]) = (narrow(0.5 + 0.5 * turned.x), narrow(0.5 - 0.5 * turned.y));
            }
        }
        value
    }

    /// Interpolates the picture at a point, between the pixels of its chart.
    fn between(&self, spot: SurfacePoint, (owners, holds): (&[u32], Holds), planes: &[Vec<f32>]) -> Option<Vec<f32>> {
        let charts = &self.atlas.charts;
        let start = DVec2::new(f64::from(self.window.x), f64::from(self.window.y));
        let at = (spot.uv * self.atlas.size_mm - self.grid.origin) / self.grid.step - start - 0.5;
        let corner = at.floor();
        let rest = at - corner;
        let (mut sums, mut total, mut largest) = (vec![0.0f64; planes.len()], 0.0, 0.0);
        for k in 0..4 {
            let (i, j) = (f64::from(k & 1), f64::from(k >> 1));
            #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
            let (x, y) = ((corner.x + i) as i64, (corner.y + j) as i64);
            let own = |p: &usize| owners[*p] > 0 && charts[owners[*p] as usize - 1] == charts[spot.triangle];
            let Some(pixel) = self.pixel(x, y).filter(own) else { continue };
            let weight = (1.0 - (rest.x - i).abs()) * (1.0 - (rest.y - j).abs());
            if holds == Holds::Ids {
                if weight > largest {
                    (largest, total) = (weight, 1.0);
                    sums.iter_mut().zip(planes).for_each(|(sum, plane)| *sum = f64::from(plane[pixel]));
                }
                continue;
            }
            total += weight;
            sums.iter_mut().zip(planes).for_each(|(sum, plane)| *sum += weight * f64::from(plane[pixel]));
        }
        (total > 1e-6).then(|| sums.iter().map(|sum| narrow(sum / total)).collect())
    }
}

/// Converts slopes of a height per mm of the canvas to normals of the surface, stored as ½ + ½n, y up, relative to the
/// axes of the atlas in the triangle. A triangle without area in the atlas keeps the slopes as they are.
pub fn normal_of(atlas: &Atlas, triangle: usize, slope: DVec2) -> [f32; 3] {
    let turned = axes(atlas, triangle).transpose().inverse() * slope;
    let slope = if turned.is_finite() { turned } else { slope };
    let length = (slope.length_squared() + 1.0).sqrt();
    [0.5 - 0.5 * slope.x / length, 0.5 + 0.5 * slope.y / length, 0.5 + 0.5 / length].map(narrow)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::fixture::{plane, sphere};
    use glam::{DVec3, UVec2};

    fn pixels(n: u32) -> (Grid, Window) {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::splat(100.0 / f64::from(n)), period: None, shown: None };
        (grid, Window::full(UVec2::splat(n)))
    }

    /// A function of the position continues across borders, and at the ends of the surface.
    #[test]
    fn continues_functions_of_position() {
        for (atlas, closed) in [(plane("plane_wild"), false), (sphere(), true)] {
            let (grid, window) = pixels(300);
            let sheet = AtlasPicture { atlas: &atlas, grid: &grid, window };
            let owners = texels::owners(&atlas, &grid, window);
            let of = |place: DVec3| place.dot(DVec3::new(0.01, 0.02, 0.015));
            let own =
                |p: usize| owners[p].checked_sub(1).map_or(0.0, |t| narrow(of(atlas.place(t as usize, sheet.uv(p)))));
            let mut planes = vec![(0..owners.len()).map(own).collect::<Vec<f32>>()];
            let before = planes[0].clone();
            sheet.carry(2, Holds::Values, &mut planes);
            let mut ids = vec![0.0; owners.len()];
            texels::fill(&atlas, &grid, window, &mut ids);
            let (mut off, mut count) = (0.0f64, 0);
            for p in 0..owners.len() {
                if owners[p] > 0 {
                    assert_eq!(planes[0][p], before[p]);
                    continue;
                }
                let Some(triangle) = texels::triangle(ids[p]) else { continue };
                let place = atlas.place(triangle, sheet.uv(p));
                // The surface bends; the triangle's plane goes straight on.
                let place = if closed { place.normalize() * 30.0 } else { place };
                let beyond = !closed && (place.x.min(place.y) < 0.0 || place.x.max(place.y) > 64.0);
                if !beyond {
                    off += (f64::from(planes[0][p]) - of(place)).abs();
                    count += 1;
                }
            }
            // A texel is at least 0.3 mm: 0.01 per texel.
            assert!(count > 500 && off / f64::from(count) < 2e-3, "{closed}: {} over {count}", off / f64::from(count));
        }
    }

    /// Lit from one side, a slope on the surface looks the same in all charts.
    #[test]
    fn matches_normals_across_charts() {
        let atlas = plane("plane_wild");
        let slope = DVec3::new(0.3, -0.2, 0.0);
        for triangle in 0..atlas.uvs.len() {
            let [u, v] = atlas.jacobians[triangle].map(|axis| axis.as_dvec3());
            let canvas = DVec2::new(u.dot(slope), v.dot(slope)) / atlas.size_mm;
            let [x, y, z] = normal_of(&atlas, triangle, canvas).map(|v| f64::from(v) * 2.0 - 1.0);
            let along = u.normalize();
            let up = -(v - along * along.dot(v)).normalize();
            let lit = along * x + up * y + DVec3::Z * z;
            assert!(lit.distance(DVec3::new(-0.3, 0.2, 1.0).normalize()) < 1e-4, "{triangle}: {lit}");
        }
    }

    /// A normal carried across a border keeps its direction on the surface.
    #[test]
    fn rotates_normals_with_charts() {
        let atlas = plane("plane_wild");
        let (grid, window) = pixels(300);
        let sheet = AtlasPicture { atlas: &atlas, grid: &grid, window };
        let slope = DVec3::new(0.5, 0.4, 0.0);
        let normal = |triangle: usize| {
            let [u, v] = atlas.jacobians[triangle].map(|axis| axis.as_dvec3());
            normal_of(&atlas, triangle, DVec2::new(u.dot(slope), v.dot(slope)) / atlas.size_mm)
        };
        let owners = texels::owners(&atlas, &grid, window);
        let value = |p: usize, c: usize| owners[p].checked_sub(1).map_or(0.5, |t| normal(t as usize)[c]);
        let mut planes: Vec<Vec<f32>> = (0..3).map(|c| (0..owners.len()).map(|p| value(p, c)).collect()).collect();
        sheet.carry(2, Holds::Normals, &mut planes);
        let mut ids = vec![0.0; owners.len()];
        texels::fill(&atlas, &grid, window, &mut ids);
        let mut count = 0;
        for p in (0..owners.len()).filter(|&p| owners[p] == 0 && ids[p] != 0.0) {
            let wanted = normal(texels::triangle(ids[p]).unwrap_or(0));
            assert!((0..3).all(|c| (planes[c][p] - wanted[c]).abs() < 1e-3), "{p}");
            count += 1;
        }
        assert!(count > 1000, "{count}");
    }
}
