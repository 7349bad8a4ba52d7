//! The pixel of a level that represents a point of the surface.
use super::raster::{Raster, inside};
use super::walk::{SurfacePoint, flatten, walk};
use crate::ground::number::index_u32;
use glam::{DVec2, DVec3, I64Vec3};
use shibo_value::Jump;
use std::collections::HashMap;

/// The pixels of a level that represent points.
pub struct Sites<'a> {
    /// The pixels.
    pub raster: Raster<'a>,
    /// The triangle of each pixel plus one, or 0.
    pub owner: &'a [u32],
    /// Distance class of each pixel to a border; see [`Raster::near`].
    pub near: &'a [u8],
    /// Pixels near borders, by their position in space, in cells of `reach`.
    cells: HashMap<I64Vec3, Vec<(u32, DVec3)>>,
    reach: f64,
}

impl<'a> Sites<'a> {
    /// Indexes the pixels of a level with these owners; `near` as returned by [`Raster::near`].
    pub fn new(raster: Raster<'a>, owner: &'a [u32], near: &'a [u8]) -> Self {
        let atlas = raster.atlas;
        let reach = 1.5 * (raster.step() * atlas.size_mm).element_product().sqrt() * atlas.scale();
        let mut sites = Self { raster, owner, near, cells: HashMap::new(), reach };
        for pixel in (0..owner.len()).filter(|&p| near[p] > 0 && owner[p] > 0) {
            let place = sites.place(raster.spot(owner[pixel] as usize - 1, pixel));
            sites.cells.entry(sites.cell(place)).or_default().push((index_u32(pixel), place));
        }
        sites
    }

    fn place(&self, spot: SurfacePoint) -> DVec3 {
        self.raster.atlas.place(spot.triangle, spot.uv)
    }

    #[expect(clippy::cast_possible_truncation, reason = "places within 10⁷ mm")]
    fn cell(&self, place: DVec3) -> I64Vec3 {
        let cell = (place / self.reach).floor();
        I64Vec3::new(cell.x as i64, cell.y as i64, cell.z as i64)
    }

    /// Returns whether a pixel belongs to a chart.
    pub fn is_of(&self, pixel: usize, chart: u16) -> bool {
        self.owner[pixel].checked_sub(1).is_some_and(|triangle| self.raster.atlas.charts[triangle as usize] == chart)
    }

    /// The pixel that represents a point, and the point's offset from it in pixels.
    pub fn site(&self, spot: SurfacePoint) -> Option<(usize, DVec2)> {
        let beside = self.beside(spot);
        match beside {
            Some((_, off)) if off.length_squared() <= 0.5 => beside,
            _ => self.nearest(spot).or(beside),
        }
    }

    /// The same, in its stored form.
    pub fn jump(&self, spot: SurfacePoint) -> Jump {
        self.site(spot).map_or(Jump::NONE, |(pixel, off)| {
            #[expect(clippy::cast_possible_truncation, reason = "limited just before")]
            let keep = |v: f64| (v * f64::from(Jump::STEPS)).round().clamp(-32_727.0, 32_727.0) as i16;
            Jump { to: index_u32(pixel), residue: off.to_array().map(keep) }
        })
    }

    /// The nearest of the 3 × 3 pixels around that lie in the chart and are reached within it.
    fn beside(&self, spot: SurfacePoint) -> Option<(usize, DVec2)> {
        let atlas = self.raster.atlas;
        let chart = atlas.charts[spot.triangle];
        let at = spot.uv / self.raster.step();
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let (x, y) = (at.x.floor() as i64, at.y.floor() as i64);
        let size = self.raster.size().map(u32::cast_signed);
        let own = inside(x, y, size);
        if let Some(pixel) = own.filter(|&p| self.near[p] < 3 && self.is_of(p, chart)) {
            return Some((pixel, at - self.raster.center(pixel) / self.raster.step()));
        }
        let mut found = [(f64::INFINITY, 0, DVec2::ZERO); 9];
        let mut count = 0;
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            let Some(pixel) = inside(x + dx, y + dy, size).filter(|&p| self.is_of(p, chart)) else { continue };
            let off = at - self.raster.center(pixel) / self.raster.step();
            found[count] = (off.length_squared(), pixel, off);
            count += 1;
        }
        let found = &mut found[..count];
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let reached = |pixel: usize| {
            let way = walk(atlas, spot, self.raster.center(pixel) - spot.uv);
            way.is_some_and(|way| !way.crossed)
        };
        found.iter().find(|(_, pixel, _)| reached(*pixel)).map(|&(_, pixel, off)| (pixel, off))
    }

    /// The nearest pixel in space, on the same side of the surface.
    fn nearest(&self, spot: SurfacePoint) -> Option<(usize, DVec2)> {
        let atlas = self.raster.atlas;
        let place = self.place(spot);
        let middle = self.cell(place);
        let normal = atlas.mesh.cross(spot.triangle).normalize_or_zero();
        for reach in [1i64, 2] {
            let mut best: Option<(f64, u32, DVec3)> = None;
            for z in -reach..=reach {
                for (x, y) in (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y))) {
                    let Some(cell) = self.cells.get(&(middle + I64Vec3::new(x, y, z))) else { continue };
                    for &(pixel, at) in cell {
                        let distance = at.distance_squared(place);
                        let far = distance > (self.reach * reach as f64).powi(2);
                        if far || best.is_some_and(|b| (b.0, b.1) <= (distance, pixel)) {
                            continue;
                        }
                        let owner = self.owner[pixel as usize] as usize - 1;
                        if atlas.mesh.cross(owner).normalize_or_zero().dot(normal) > 0.3 {
                            best = Some((distance, pixel, at));
                        }
                    }
                }
            }
            if let Some((_, pixel, at)) = best {
                let owner = self.owner[pixel as usize] as usize - 1;
                let axes = atlas.jacobians[owner].map(|axis| axis.as_dvec3());
                let off = flatten(axes, place - at) / self.raster.step();
                return off.is_finite().then_some((pixel as usize, off));
            }
        }
        None
    }
}
