//! Seeds of a front, and the exact distance to the nearest one: points, and walls of straight pieces in the plane.
//!
//! A tree of bounding boxes; a search starts with the distance to the seed that was nearest to the previous point, so
//! neighbouring points take few steps. O(n log n) to build, about O(log n) a point.
use glam::{DVec2, DVec3};
use shibo_value::Tiling;
use std::ops::Range;

/// Maximum number of seeds in a leaf.
const FEW: usize = 4;

/// A seed: a straight piece, or a point if both ends are equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seed {
    /// The ends.
    pub ends: [DVec3; 2],
    /// True if the seed is the same at every height, so that distances are those in the plane.
    pub upright: bool,
    /// Its number.
    pub number: u32,
}

impl Seed {
    /// A point of space, with the number 0.
    pub const fn point(at: DVec3) -> Self {
        Self { ends: [at; 2], upright: false, number: 0 }
    }

    /// A piece in the plane z = 0, with the number 0.
    pub fn wall([from, to]: [DVec2; 2], upright: bool) -> Self {
        Self { ends: [from.extend(0.0), to.extend(0.0)], upright, number: 0 }
    }

    /// The vector from the nearest point of the seed to `p`.
    fn to(&self, p: DVec3) -> DVec3 {
        let p = if self.upright { DVec3::new(p.x, p.y, 0.0) } else { p };
        let ([a, b], to) = (self.ends, p - self.ends[0]);
        let way = b - a;
        let square = way.length_squared();
        let t = if square > 0.0 { (to.dot(way) / square).clamp(0.0, 1.0) } else { 0.0 };
        to - way * t
    }
}

#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(seeds: &[Seed]) -> Self {
        let none = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        seeds.iter().fold(none, |all, seed| {
            let [mut low, mut high] = [seed.ends[0].min(seed.ends[1]), seed.ends[0].max(seed.ends[1])];
            if seed.upright {
                (low.z, high.z) = (f64::NEG_INFINITY, f64::INFINITY);
            }
            Self { low: all.low.min(low), high: all.high.max(high) }
        })
    }

    fn square(&self, p: DVec3) -> f64 {
        p.distance_squared(p.clamp(self.low, self.high))
    }
}

/// A box, its seeds, and the index of its second child (0 for a leaf). The first child follows the node.
#[derive(Clone, Debug)]
struct Branch {
    bounds: Bounds,
    seeds: Range<usize>,
    second: usize,
}

/// Seeds in a tree of boxes.
#[derive(Clone, Debug)]
pub struct Seeds {
    seeds: Vec<Seed>,
    branches: Vec<Branch>,
    /// The canvas in mm, and the directions in which seeds repeat with it.
    period: (DVec2, Tiling),
}

/// The nearest seed.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Index of the seed in the tree, where the next search can start.
    pub seed: usize,
    /// Its number; the lowest one of several seeds at the same distance.
    pub number: u32,
    /// The vector from the seed to the point.
    pub to: DVec3,
}

impl Seeds {
    /// Sorts seeds that repeat with a canvas in the directions of `tiling`.
    pub fn new(seeds: &[Seed], size: DVec2, tiling: Tiling) -> Self {
        let mut all = seeds.to_vec();
        // Copies around the canvas, as far as one can be nearest to a point of it.
        let shifts = |repeats: bool| if repeats { -1..=1 } else { 0..=0 };
        for (i, j) in shifts(tiling.x).flat_map(|i| shifts(tiling.y).map(move |j| (i, j))) {
            if (i, j) != (0, 0) {
                let shift = (DVec2::new(f64::from(i), f64::from(j)) * size).extend(0.0);
                all.extend(seeds.iter().map(|seed| Seed { ends: seed.ends.map(|end| end + shift), ..*seed }));
            }
        }
        let mut branches: Vec<Branch> = Vec::new();
        let mut open = vec![(0..all.len(), None)];
        while let Some((range, parent)) = open.pop() {
            let own = &mut all[range.clone()];
            let number = branches.len();
            if let Some(parent) = parent {
                let parent: &mut Branch = &mut branches[parent];
                parent.second = number;
            }
            branches.push(Branch { bounds: Bounds::of(own), seeds: range.clone(), second: 0 });
            if own.len() <= FEW {
                continue;
            }
            let middle = |seed: &Seed| seed.ends[0] + seed.ends[1];
            let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let (low, high) = own.iter().map(middle).fold(none, |(low, high), m| (low.min(m), high.max(m)));
            let axis = (0..3).max_by(|a, b| (high - low)[*a].total_cmp(&(high - low)[*b])).unwrap_or(0);
            let half = own.len() / 2;
            own.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
            open.push((range.start + half..range.end, Some(number)));
            open.push((range.start..range.start + half, None));
        }
        Self { seeds: all, branches, period: (size, tiling) }
    }

    /// True if there are no seeds.
    pub const fn is_empty(&self) -> bool {
        self.seeds.is_empty()
    }

    /// Approximate memory in bytes.
    pub const fn bytes(&self) -> usize {
        self.seeds.len() * size_of::<Seed>() + self.branches.len() * size_of::<Branch>()
    }

    /// A point in the first repeat of the canvas.
    pub fn wrap(&self, p: DVec3) -> DVec3 {
        let (size, tiling) = self.period;
        let wrap = |v: f64, size: f64, repeats: bool| if repeats { v - (v / size).floor() * size } else { v };
        DVec3::new(wrap(p.x, size.x, tiling.x), wrap(p.y, size.y, tiling.y), p.z)
    }

    /// The seed nearest to a point of the first repeat. The search is fastest if it starts at a seed nearby; the
    /// distance does not depend on the start. `None` if there are no seeds.
    pub fn nearest(&self, p: DVec3, start: usize) -> Option<Nearest> {
        let first = self.seeds.get(start).or_else(|| self.seeds.first())?;
        let mut best = Nearest { seed: start.min(self.seeds.len() - 1), number: first.number, to: first.to(p) };
        let mut least = best.to.length_squared();
        let mut open = [0_usize; 64];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let number = open[count];
            let branch = &self.branches[number];
            if branch.bounds.square(p) > least {
                continue;
            }
            if branch.second > 0 && count + 2 <= open.len() {
                let (one, two) = (number + 1, branch.second);
                let nearer = self.branches[one].bounds.square(p) <= self.branches[two].bounds.square(p);
                (open[count], open[count + 1]) = if nearer { (two, one) } else { (one, two) };
                count += 2;
                continue;
            }
            for seed in branch.seeds.clone() {
                let (to, number) = (self.seeds[seed].to(p), self.seeds[seed].number);
                let square = to.length_squared();
                if square < least || (square == least && number < best.number) {
                    (least, best) = (square, Nearest { seed, number, to });
                }
            }
        }
        Some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    fn random(n: u64) -> DVec3 {
        let unit = |k| Hash::new(4).unit(3 * n + k);
        DVec3::new(20.0 * unit(0), 15.0 * unit(1), 10.0 * unit(2) - 5.0)
    }

    fn some(count: u64) -> Vec<Seed> {
        let seed = |n: u64| match n % 3 {
            0 => Seed::point(random(n)),
            k => Seed::wall([random(n).truncate(), (random(n) + random(n + 1) * 0.1).truncate()], k == 1),
        };
        (0..count).map(seed).collect()
    }

    #[test]
    fn finds_the_distance_of_a_full_search_from_any_start() {
        let size = DVec2::new(20.0, 15.0);
        for count in [1, 3, 5, 200] {
            let seeds = some(count);
            for tiling in [Tiling::NONE, Tiling::BOTH] {
                let tree = Seeds::new(&seeds, size, tiling);
                let mut start = 0;
                for n in 0..300 {
                    let p = random(1000 + n);
                    let mut want = f64::INFINITY;
                    let reach = if tiling == Tiling::BOTH { -2..=2 } else { 0..=0 };
                    for (i, j) in reach.clone().flat_map(|i| reach.clone().map(move |j| (f64::from(i), f64::from(j)))) {
                        let q = p - (DVec2::new(i, j) * size).extend(0.0);
                        want = seeds.iter().map(|seed| seed.to(q).length()).fold(want, f64::min);
                    }
                    let found = tree.nearest(p, start).unwrap();
                    assert!((found.to.length() - want).abs() < 1e-9, "{p}");
                    assert_eq!(tree.nearest(p, 0).unwrap().to.length_squared(), found.to.length_squared());
                    start = found.seed;
                }
            }
        }
        assert!(Seeds::new(&[], size, Tiling::BOTH).nearest(DVec3::ZERO, 0).is_none());
    }

    #[test]
    fn wraps_points_into_the_canvas() {
        let tree = Seeds::new(&some(1), DVec2::new(20.0, 15.0), Tiling { x: true, y: false });
        assert_eq!(tree.wrap(DVec3::new(-3.0, 18.0, 50.0)), DVec3::new(17.0, 18.0, 50.0));
    }
}
