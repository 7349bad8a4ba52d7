//! The fast corrector for any Jacobian: each pixel holds a real-valued position in the exemplar.
//!
//! Equations (1) and (2). Only the eight immediate neighbours are read: the neighbour in the direction of `J⁻¹Δ`
//! predicts the content at Δ. Per Δ, the predictions of the neighbours in the directions `J⁻¹MΔ` for M = 1, diag(1, 0),
//! diag(0, 1) are averaged. Tables are read at the nearest pixel; positions are never rounded. Where features grow, the
//! level whose spacing is `h √|det J|` is compared.
use super::jacobian::{Jacobian, OCTANTS};
use super::plane::{Lookup, PixelPlane};
use super::region::Region;
use super::settle::{Geometry, Matcher};
pub use super::settle::{Position, Terms};
use super::table::Table;
use crate::ground::simd;
use crate::ground::window::{index, offset};
use rayon::prelude::*;

/// The Jacobians of a level's pixels.
pub enum Jacobians {
    /// The same Jacobian everywhere.
    Constant(Jacobian),
    /// One Jacobian per pixel.
    Each(Vec<Jacobian>),
}

impl Jacobians {
    /// Returns the Jacobian of a pixel.
    #[inline(always)]
    pub fn at(&self, pixel: usize) -> &Jacobian {
        match self {
            Self::Constant(j) => j,
            Self::Each(list) => &list[pixel],
        }
    }
}

/// Runs one pass over a level; see [`iso::correct`](super::iso::correct). `tables` starts with the table of `h`,
/// followed by those of all finer levels.
pub fn correct<L: Lookup>(
    tables: &[&Table],
    region: &Region,
    lookup: &L,
    jacobians: &Jacobians,
    terms: &Terms<'_>,
    map: &mut [Position],
) {
    let mut fresh = Vec::new();
    for quarter in [[0, 0], [1, 1], [1, 0], [0, 1]] {
        let first = [0, 1].map(|d| offset((quarter[d] - region.start[d]).rem_euclid(2)));
        let PixelPlane { w, h, .. } = region.plane;
        if first[0] >= w || first[1] >= h {
            continue;
        }
        let (columns, rows) = ((w - first[0]).div_ceil(2), (h - first[1]).div_ceil(2));
        fresh.clear();
        fresh.resize(columns * rows, [0.0f32; 2]);
        let old: &[Position] = map;
        fresh.par_chunks_mut(columns).with_min_len(4).enumerate().for_each(|(row, out)| {
            let row = Row { tables, region, lookup, jacobians, terms, map: old, y: first[1] + 2 * row };
            simd::dispatch(
                #[inline(always)]
                || row.fill(first[0], out),
            );
        });
        map.par_chunks_mut(w).skip(first[1]).step_by(2).zip(fresh.par_chunks(columns)).with_min_len(8).for_each(
            |(map, fresh)| {
                map[first[0]..].iter_mut().step_by(2).zip(fresh).for_each(|(map, fresh)| *map = *fresh);
            },
        );
    }
}

struct Row<'a, L> {
    tables: &'a [&'a Table],
    region: &'a Region,
    lookup: &'a L,
    jacobians: &'a Jacobians,
    terms: &'a Terms<'a>,
    map: &'a [Position],
    y: usize,
}

impl<L: Lookup> Row<'_, L> {
    #[inline(always)]
    fn fill(&self, first: usize, out: &mut [Position]) {
        let h = self.region.h;
        let constant = match self.jacobians {
            Jacobians::Constant(j) => Some(Geometry::new(self.tables, h, j)),
            Jacobians::Each(_) => None,
        };
        for (k, out) in out.iter_mut().enumerate() {
            let x = first + 2 * k;
            let pixel = self.y * self.region.plane.w + x;
            let own = self.map[pixel];
            if !self.terms.fixed.is_empty() && self.terms.fixed[pixel] {
                *out = own;
                continue;
            }
            *out = match &constant {
                Some(geometry) => self.pixel(geometry, x, own),
                None => self.pixel(&Geometry::new(self.tables, h, self.jacobians.at(pixel)), x, own),
            };
        }
    }

    #[inline(always)]
    fn pixel(&self, geometry: &Geometry<'_>, x: usize, own: Position) -> Position {
        let PixelPlane { w, h, .. } = self.region.plane;
        let inner = x > 0 && self.y > 0 && x + 1 < w && self.y + 1 < h;
        let spacing = self.region.h as f32;
        let mut near = [own; 8];
        for (k, near) in near.iter_mut().enumerate() {
            let [dx, dy] = OCTANTS[k];
            let at = if inner {
                offset((index(self.y) + dy) * index(w) + index(x) + dx)
            } else {
                self.lookup.index(index(x) + dx, index(self.y) + dy)
            };
            let [sx, sy] = geometry.step(k);
            *near = [self.map[at][0] - sx, self.map[at][1] - sy];
            if !inner {
                // Across wrapping sides, the neighbour may be nearer than a whole pixel.
                let [bx, by] = self.region.beyond(index(x) + dx, index(self.y) + dy).map(|v| v as f32 / spacing);
                let [right, down] = [geometry.steps[0], geometry.steps[2]];
                *near = [near[0] + bx * right[0] + by * down[0], near[1] + bx * right[1] + by * down[1]];
            }
        }
        let terms = self.terms;
        let factors = terms.factors.map(|factors| factors.of(x, self.y));
        let guide = if terms.guide.is_empty() { None } else { Some(terms.guide[self.y * w + x]) };
        Matcher { terms }.settle(geometry, own, &near, (factors, guide))
    }
}
