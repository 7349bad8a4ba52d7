//! The inputs of a synthesis, level by level: Jacobians, guides, fixed coordinates, and coordinates to start from.
use glam::{DVec2, IVec2, UVec2};
use shibo_kernel::synthesis::aniso::{Jacobians, Position};
use shibo_kernel::synthesis::driver::{Fixed, Inputs};
use shibo_kernel::synthesis::jacobian::{self, IDENTITY, Jacobian};
use shibo_kernel::synthesis::region::Region;
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Field, Grid, Stop, Tile, Window};
use std::sync::Arc;

/// The fields that control a synthesis.
pub(super) struct FieldInputs<'a> {
    pub(super) cx: &'a Context<'a>,
    pub(super) jacobian: Option<Field>,
    pub(super) guide: Option<Field>,
    pub(super) fixed: Option<(Arc<CoordMap>, Option<Field>)>,
    pub(super) jitter: Option<Field>,
    pub(super) start: Option<Arc<CoordMap>>,
    /// Size of a pixel of the finest level, mm.
    pub(super) pitch: DVec2,
    /// Pixels of the finest level on the canvas.
    pub(super) size: UVec2,
    /// The pixel at the canvas' corner.
    pub(super) origin: IVec2,
}

/// The error for a Jacobian that cannot be used at a place of the canvas.
pub(super) fn faulty(fault: &str, at: DVec2, [a, b, c, d]: &Jacobian) -> Problem {
    let message = format!("the Jacobian is {fault} at ({:.3}, {:.3}) mm, where it is [{a}, {b}; {c}, {d}]", at.x, at.y);
    let help = "features must keep an area there; raise the scale, or keep the field away from such places";
    Problem::new(Code::BadValue, message).at("jacobian").help(help)
}

/// The Jacobians of a raster, or an error that names a wrong one and its place.
pub(super) fn checked(tile: &Tile) -> Result<Vec<Jacobian>, Problem> {
    let planes: [&[f32]; 4] = std::array::from_fn(|c| tile.plane(c));
    let list: Vec<Jacobian> = (0..tile.window.len()).map(|p| planes.map(|plane| plane[p])).collect();
    let w = tile.width();
    for (p, j) in list.iter().enumerate() {
        if let Some(fault) = jacobian::fault(j) {
            let step = |k: usize| i32::try_from(k).unwrap_or(i32::MAX);
            let at = tile.grid.center(tile.window.x + step(p % w), tile.window.y + step(p / w));
            return Err(faulty(fault, at, j));
        }
    }
    Ok(list)
}

impl FieldInputs<'_> {
    /// True if a Jacobian rotates or scales anything.
    pub(super) fn bends(&self) -> bool {
        self.jacobian.as_ref().is_some_and(|field| field.as_constant().is_none_or(|j| *j != IDENTITY))
    }

    fn raster(&self, field: &Field, region: &Region) -> Result<Tile, Stop> {
        let h = f64::from(u32::try_from(region.h).unwrap_or(1));
        let step = self.pitch * h;
        let origin = -self.origin.as_dvec2() * self.pitch;
        let grid = if self.origin == IVec2::ZERO && region.h == 1 {
            Grid { origin, step, period: Some(self.size), shown: None }
        } else {
            Grid { origin, step, period: None, shown: None }
        };
        let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let (w, h) = (size(region.plane.w), size(region.plane.h));
        let window = Window { x: region.start[0], y: region.start[1], width: w, height: h };
        self.cx.evaluator.raster(field, &grid, window)
    }

    pub(super) fn finite(&self, field: &Field, region: &Region, port: &str) -> Result<Vec<f32>, Stop> {
        let tile = self.raster(field, region)?;
        if tile.plane(0).iter().any(|v| !v.is_finite()) {
            let message = format!("`{port}` is not finite everywhere; it must be");
            return Err(Problem::new(Code::NotFinite, message).at(port).into());
        }
        Ok(tile.plane(0).to_vec())
    }

    /// The coordinates of a map at the centres of a region's pixels. Beyond sides that do not join, the pixel at the
    /// border is repeated.
    fn seen(&self, map: &CoordMap, region: &Region) -> Vec<Position> {
        let (w, h) = (region.plane.w, region.plane.h);
        let spacing = f64::from(map.spacing);
        let n = map.size.as_ivec2();
        let shown = |k: i32, n: i32, joins: bool| if joins { k } else { k.clamp(0, n - 1) };
        (0..w * h)
            .map(|p| {
                let centre = DVec2::from(region.center(p % w, p / w)) - self.origin.as_dvec2();
                let place = centre / spacing;
                let at = place.floor().as_ivec2() - map.start;
                let at = IVec2::new(shown(at.x, n.x, map.periodic.x), shown(at.y, n.y, map.periodic.y));
                let cell = (at + map.start).as_dvec2();
                let (x, y) = (at.x.rem_euclid(n.x), at.y.rem_euclid(n.y));
                let rest = ((place - cell - 0.5) * spacing).as_vec2();
                let index = usize::try_from(y * n.x + x).unwrap_or(0);
                let coords = map.coords.get(index).copied().unwrap_or([0.5; 2]);
                [coords[0] + rest.x, coords[1] + rest.y]
            })
            .collect()
    }
}

impl Inputs for FieldInputs<'_> {
    type Stop = Stop;

    fn jacobians(&self, region: &Region) -> Result<Option<Jacobians>, Stop> {
        let Some(field) = &self.jacobian else { return Ok(None) };
        if let Some(&[a, b, c, d]) = field.as_constant() {
            let j = [a, b, c, d];
            if let Some(fault) = jacobian::fault(&j) {
                let message = format!("the Jacobian is {fault} everywhere: it is [{a}, {b}; {c}, {d}]");
                return Err(Problem::new(Code::BadValue, message).at("jacobian").into());
            }
            return Ok((j != IDENTITY).then_some(Jacobians::Constant(j)));
        }
        Ok(Some(Jacobians::Each(checked(&self.raster(field, region)?)?)))
    }

    fn guide(&self, region: &Region) -> Result<Vec<f32>, Stop> {
        self.guide.as_ref().map_or(Ok(Vec::new()), |guide| self.finite(guide, region, "guide"))
    }

    fn fixed(&self, region: &Region) -> Result<Option<Fixed>, Stop> {
        let Some((map, mask)) = &self.fixed else { return Ok(None) };
        let mask = match mask {
            Some(mask) => self.finite(mask, region, "fixed_mask")?.iter().map(|v| *v >= 0.5).collect(),
            None => vec![true; region.plane.w * region.plane.h],
        };
        Ok(Some((mask, self.seen(map, region))))
    }

    fn jitter(&self, region: &Region) -> Result<Vec<f32>, Stop> {
        self.jitter.as_ref().map_or(Ok(Vec::new()), |mask| self.finite(mask, region, "jitter_mask"))
    }

    fn start(&self, region: &Region) -> Result<Vec<Position>, Stop> {
        Ok(self
            .start
            .as_ref()
            .map_or_else(|| vec![[0.0; 2]; region.plane.w * region.plane.h], |map| self.seen(map, region)))
    }

    fn step(&self, done: usize, total: usize) -> Result<(), Stop> {
        self.cx.evaluator.progress(done as u64, total as u64);
        self.cx.check()
    }
}
