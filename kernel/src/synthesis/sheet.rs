//! The pixels of a level of a surface: their positions, neighbours and Jacobians.
use super::jacobian::{self, IDENTITY, Jacobian};
use super::plane::{Lookup, Neighbours, PixelPlane};
use super::region::Region;
use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use crate::ground::window::{OCTANTS, index, offset};
use crate::mesh::frame::{Face, Framing};
use crate::mesh::raster::Raster;
use crate::mesh::walk::{barycentric, corners};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use shibo_value::{Atlas, IndirectionLevel, IndirectionMap, Jump8, Parent};

/// A level of a surface.
#[derive(Clone, Copy)]
pub struct Sheet<'a> {
    /// The atlas.
    pub atlas: &'a Atlas,
    /// Size of the finest level in columns and rows.
    pub finest: [u32; 2],
    /// Its pixels.
    pub level: &'a IndirectionLevel,
}

impl<'a> Sheet<'a> {
    /// A level of a map.
    pub fn new(map: &'a IndirectionMap, level: usize) -> Self {
        Self { atlas: &map.atlas, finest: map.size, level: &map.levels[level] }
    }

    /// The raster of its pixels in the unit square.
    pub fn raster(&self) -> Raster<'a> {
        Raster { atlas: self.atlas, finest: self.finest, h: self.level.h }
    }

    /// Columns and rows; no axis wraps.
    pub fn plane(&self) -> PixelPlane {
        let [w, h] = self.level.size.map(|n| n as usize);
        PixelPlane { w, h, wrap: [false; 2] }
    }

    /// The same, as a region of the canvas.
    pub fn region(&self) -> Region {
        Region { h: self.level.h as usize, start: [0; 2], plane: self.plane(), short: [0; 2] }
    }

    /// The position of a pixel's centre on the surface.
    pub fn place(&self, pixel: usize) -> Option<DVec3> {
        let triangle = self.level.triangle(pixel)?;
        let b = barycentric(corners(self.atlas, triangle), self.raster().center(pixel));
        let [p, q, r] = self.atlas.mesh.corners(triangle);
        Some(p * b[0] + q * b[1] + r * b[2])
    }

    /// Hash of a pixel's position on the surface, so that a chart that moves on the canvas keeps its random numbers.
    /// `pitch` is the size of an exemplar pixel in mm.
    pub fn name(&self, hash: Hash, pixel: usize, pitch: f64) -> Hash {
        let place = self.place(pixel).unwrap_or_default() * (16.0 / (f64::from(self.level.h) * pitch));
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let word = |v: f64| (v.round() as i64).cast_unsigned();
        hash.with(u64::from(self.level.h)).with(word(place.x)).with(word(place.y)).with(word(place.z))
    }

    /// The pixels that have an owner, in ascending order.
    pub fn sites(&self) -> Vec<u32> {
        (0..).zip(&self.level.owner).filter(|(_, owner)| **owner != 0).map(|(pixel, _)| pixel).collect()
    }

    /// Jacobians of the pixels: exemplar pixels (of `pitch` mm) per finest pixel. By pixel, `angles` rotate the
    /// directions and `scales` scale the features; both lists may be empty.
    pub fn jacobians(&self, framing: &Framing<'_>, pitch: DVec2, (angles, scales): (&[f32], &[f32])) -> Vec<Jacobian> {
        let (raster, w) = (self.raster(), self.level.size[0] as usize);
        let (canvas, to_pixels) = (self.atlas.size_mm, self.to_pixels(pitch));
        let mut all = vec![IDENTITY; self.level.owner.len()];
        all.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            let mut face: Option<(usize, Face)> = None;
            for (x, j) in row.iter_mut().enumerate() {
                let pixel = y * w + x;
                let Some(triangle) = self.level.triangle(pixel) else { continue };
                if face.as_ref().is_none_or(|(of, _)| *of != triangle) {
                    face = Some((triangle, framing.face(triangle)));
                }
                let Some((_, face)) = &face else { continue };
                let angle = angles.get(pixel).map_or(0.0, |v| f64::from(*v).to_radians());
                let scale = scales.get(pixel).map_or(1.0, |v| f64::from(*v));
                let frame = face.frame_turned(raster.center(pixel), angle, scale);
                let per_mm = crate::mesh::frame::jacobian(frame, [face.jf[0] / canvas.x, face.jf[1] / canvas.y]);
                *j = to_pixels(per_mm.map(narrow));
            }
        });
        all
    }

    /// Converts Jacobians from fields (mm on the canvas to mm on the surface) to ones from finest pixels to exemplar
    /// pixels of `pitch` mm.
    pub fn to_pixels(&self, pitch: DVec2) -> impl Fn(Jacobian) -> Jacobian + Sync + use<> {
        let step = Raster { h: 1, ..self.raster() }.step() * self.atlas.size_mm;
        let by = [step.x / pitch.x, step.y / pitch.x, step.x / pitch.y, step.y / pitch.y];
        move |j| std::array::from_fn(|k| narrow(f64::from(j[k]) * by[k]))
    }

    /// The first pixel whose Jacobian cannot be used, and the reason.
    pub fn fault(&self, jacobians: &[Jacobian]) -> Option<(usize, &'static str)> {
        let faulty = |(pixel, j): (usize, &Jacobian)| jacobian::fault(j).map(|fault| (pixel, fault));
        jacobians.iter().enumerate().find_map(faulty)
    }

    /// The pointers of a row's border pixels, concatenated.
    pub(super) fn border(&self, y: usize) -> (&'a [u32], &'a [Jump8]) {
        let (first, last) = (self.level.rows[y] as usize, self.level.rows[y + 1] as usize);
        (&self.level.border[first..last], &self.level.jumps[first..last])
    }

    /// The parents of a row that are not at the usual positions around their pixels.
    pub(super) fn parents(&self, y: usize) -> &'a [Parent] {
        let w = self.level.size[0];
        let at = |y: usize| {
            let first = u64::from(w) * y as u64;
            self.level.parents.partition_point(|parent| u64::from(parent.pixel) < first)
        };
        &self.level.parents[at(y)..at(y + 1)]
    }
}

impl Lookup for Sheet<'_> {
    fn index(&self, x: i32, y: i32) -> usize {
        self.plane().index(x, y)
    }
}

impl Neighbours for Sheet<'_> {
    const CHARTS: bool = true;

    fn near(&self, (x, y): (i32, i32), octant: usize) -> Option<(usize, [f32; 2])> {
        let w = index(self.level.size[0] as usize);
        let pixel = offset(y * w + x);
        if let Some(jumps) = self.level.jumps(pixel) {
            let jump = jumps[octant];
            return jump.is_some().then(|| (jump.to as usize, jump.offset()));
        }
        let [dx, dy] = OCTANTS[octant];
        Some((offset((y + dy) * w + x + dx), [0.0; 2]))
    }

    fn holds(&self, pixel: usize) -> bool {
        self.level.owner[pixel] != 0
    }
}

/// Number of levels of a map that a synthesis can use, up to the coarsest suitable one. A suitable level has at least
/// 64 pixels with an owner, and at least 99% of the pixels of the next finer level have a parent within one and a half
/// pixels.
pub fn usable_levels(map: &IndirectionMap, most: usize) -> usize {
    let good = |l: &usize| {
        let (level, finer) = (&map.levels[*l], &map.levels[*l - 1]);
        let far = |parent: &&Parent| {
            let [x, y] = parent.jump.offset();
            !parent.jump.is_some() || x * x + y * y > 2.25
        };
        level.owned() >= 64 && 100 * finer.parents.iter().filter(far).count() <= finer.owned()
    };
    (1..map.levels.len().min(most)).rev().find(good).unwrap_or(0) + 1
}
