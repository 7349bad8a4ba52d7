//! Answers about any point of a cracked layer.
//!
//! The nearest crack is found in a tree, the cell of a point among those of the points around it.
use super::cracks::{Cracks, Piece};
use super::curl::Curl;
use super::net::{Net, shortest, wrapped};
use super::springs::Break;
use crate::deposits::seeds::{Nearest, Seed, Seeds};
use crate::ground::number::index_u32;
use glam::{DVec2, IVec2};
use shibo_value::Tiling;

/// Reach, in pitches, of the points whose curl is averaged.
const REACH: f64 = 1.9;

/// Share of a piece that counts as its end.
const TINY: f64 = 1e-6;

/// Heights below this one are rounded off, so that the middle of a plate has no rim.
const SOFT: f64 = 0.06;

/// The nearest crack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crack {
    /// Distance from its middle line, mm.
    pub distance: f64,
    /// Its width there, mm.
    pub width: f64,
    /// Its age, 0..1.
    pub age: f64,
}

/// The plate at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plate {
    /// Its number, from 1 on.
    pub number: u32,
    /// Its height, 0..1.
    pub curl: f64,
    /// The share by which it has come off, 0..1.
    pub peel: f64,
}

/// A cracked layer.
#[derive(Clone, Debug)]
pub struct Drawing {
    size: DVec2,
    pieces: Vec<Piece>,
    /// All cracks.
    tree: Seeds,
    /// The cracks between plates.
    edges: Seeds,
    sites: Vec<DVec2>,
    plates: Vec<u32>,
    curl: Vec<Curl>,
    loose: Vec<bool>,
    /// The corners of each cell, relative to its point, and the first of each.
    outlines: Vec<DVec2>,
    starts: Vec<usize>,
    /// Points by buckets.
    buckets: Buckets,
    reach: f64,
}

#[derive(Clone, Debug)]
struct Buckets {
    counts: IVec2,
    side: DVec2,
    starts: Vec<usize>,
    sites: Vec<u32>,
}

impl Buckets {
    fn new(sites: &[DVec2], size: DVec2, side: f64) -> Self {
        let counts = (size / side).floor().clamp(DVec2::ONE, DVec2::splat(2048.0));
        let mut all = Self { counts: counts.as_ivec2(), side: size / counts, starts: vec![0], sites: Vec::new() };
        let mut places: Vec<(usize, u32)> =
            (0..index_u32(sites.len())).map(|n| (all.index(all.of(sites[n as usize])), n)).collect();
        places.sort_unstable();
        all.starts = (0..=all.counts.element_product().cast_unsigned() as usize)
            .map(|bucket| places.partition_point(|(place, _)| *place < bucket))
            .collect();
        all.sites = places.into_iter().map(|(_, site)| site).collect();
        all
    }

    fn of(&self, p: DVec2) -> IVec2 {
        (p / self.side).floor().as_ivec2()
    }

    fn index(&self, bucket: IVec2) -> usize {
        let at = bucket.rem_euclid(self.counts);
        (at.y * self.counts.x + at.x).cast_unsigned() as usize
    }

    /// The points of all buckets that a square of half a side of `reach` touches. None occurs twice.
    fn around(&self, p: DVec2, reach: f64, mut visit: impl FnMut(u32)) {
        let low = self.of(p - reach);
        let high = self.of(p + reach).min(low + self.counts - 1);
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let bucket = self.index(IVec2::new(x, y));
                self.sites[self.starts[bucket]..self.starts[bucket + 1]].iter().for_each(|site| visit(*site));
            }
        }
    }
}

/// A height in 0..1, without a kink at 0.
fn soft(height: f64) -> f64 {
    let low = height.clamp(-SOFT, SOFT) + SOFT;
    if height < SOFT { low * low / (4.0 * SOFT) } else { height.min(1.0) }
}

impl Drawing {
    /// Prepares a layer.
    pub(super) fn new(net: &Net, broken: &Break, cracks: Cracks, curl: &[Curl]) -> Self {
        let Cracks { pieces, corners, plates } = cracks;
        let seeds = |wanted: &dyn Fn(&Piece) -> bool| {
            let some: Vec<Seed> = (0..)
                .zip(&pieces)
                .filter(|(_, piece)| wanted(piece))
                .map(|(number, piece)| Seed { number, ..Seed::wall(piece.ends, true) })
                .collect();
            Seeds::new(&some, net.size, Tiling::BOTH)
        };
        let (tree, edges) = (seeds(&|_| true), seeds(&|piece| piece.divides));
        let (mut outlines, mut starts) = (Vec::with_capacity(net.halves.len()), vec![0]);
        for site in 0..net.sites.len() {
            let corner = |half: &u32| corners[net.left[*half as usize] as usize] - net.sites[site];
            outlines.extend(net.from(site).iter().map(|half| shortest(corner(half), net.size)));
            starts.push(outlines.len());
        }
        let reach = REACH * net.pitch;
        Self {
            size: net.size,
            tree,
            edges,
            pieces,
            buckets: Buckets::new(&net.sites, net.size, net.pitch),
            sites: net.sites.clone(),
            plates,
            curl: curl.to_vec(),
            loose: broken.loose.clone(),
            outlines,
            starts,
            reach,
        }
    }

    /// Approximate memory in bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
            + self.edges.bytes()
            + self.sites.len() * (size_of::<DVec2>() + size_of::<Curl>() + 16)
            + self.outlines.len() * size_of::<DVec2>()
            + self.pieces.len() * size_of::<Piece>()
    }

    /// The pieces of cracks.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The plate of each point of the net.
    pub fn plates(&self) -> &[u32] {
        &self.plates
    }

    fn far(&self) -> f64 {
        self.size.length()
    }

    fn nearest(&self, seeds: &Seeds, p: DVec2, start: &mut usize) -> Option<Nearest> {
        let nearest = seeds.nearest(wrapped(p, self.size).extend(0.0), *start)?;
        *start = nearest.seed;
        Some(nearest)
    }

    /// The crack nearest to a point; the diagonal of the area away if there is none. The search is fastest with the
    /// `start` of a point nearby.
    pub fn crack(&self, p: DVec2, start: &mut usize) -> Crack {
        let Some(nearest) = self.nearest(&self.tree, p, start) else {
            return Crack { distance: self.far(), width: 0.0, age: 0.0 };
        };
        let piece = &self.pieces[nearest.number as usize];
        let [a, b] = piece.ends;
        let from = shortest(p - nearest.to.truncate() - a, self.size);
        let t = (from.dot(b - a) / (b - a).length_squared().max(1e-24)).clamp(0.0, 1.0);
        let width = piece.widths[0] + (piece.widths[1] - piece.widths[0]) * t;
        // Several pieces are equally near to a point beside a corner.
        let age = match t {
            t if t < TINY => piece.ages[0],
            t if t > 1.0 - TINY => piece.ages[1],
            _ => piece.age,
        };
        Crack { distance: nearest.to.length(), width, age }
    }

    /// Distance from the edge of the plate at a point; the diagonal of the area if there is one plate alone.
    pub fn edge(&self, p: DVec2, start: &mut usize) -> f64 {
        self.nearest(&self.edges, p, start).map_or(self.far(), |nearest| nearest.to.length())
    }

    /// The plate at a point.
    pub fn plate(&self, p: DVec2) -> Plate {
        let p = wrapped(p, self.size);
        let mut near: [(f64, u32, DVec2); 40] = [(f64::INFINITY, 0, DVec2::ZERO); 40];
        let mut count = 0;
        self.buckets.around(p, self.reach, |site| {
            let to = shortest(p - self.sites[site as usize], self.size);
            let square = to.length_squared();
            if square < self.reach * self.reach && count < near.len() {
                near[count] = (square, site, to);
                count += 1;
            }
        });
        let near = &mut near[..count];
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let inside = near.iter().find(|(_, site, to)| self.is_inside(*site as usize, *to)).or_else(|| near.first());
        let Some((_, site, _)) = inside else { return Plate::default() };
        let number = self.plates[*site as usize];
        let (mut weights, mut curl, mut peel) = (0.0, 0.0, 0.0);
        for (square, site, to) in near.iter() {
            let site = *site as usize;
            if self.plates[site] == number {
                let rest = 1.0 - square / (self.reach * self.reach);
                let weight = rest * rest * rest;
                let at = self.curl[site];
                weights += weight;
                curl += weight * (at.height + at.slope.dot(*to));
                peel += if self.loose[site] { weight } else { 0.0 };
            }
        }
        let share = 1.0 / f64::max(weights, 1e-12);
        Plate { number, curl: soft(curl * share), peel: (peel * share).clamp(0.0, 1.0) }
    }

    /// True if a point, relative to a site, lies in its cell.
    fn is_inside(&self, site: usize, p: DVec2) -> bool {
        let outline = &self.outlines[self.starts[site]..self.starts[site + 1]];
        let mut inside = false;
        let Some(mut a) = outline.last().copied() else { return false };
        for b in outline {
            if (a.y > p.y) != (b.y > p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                inside ^= p.x < x;
            }
            a = *b;
        }
        inside
    }
}
