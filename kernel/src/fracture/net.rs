//! Points on a torus, their links, and the borders between their cells.
//!
//! Links are those of the Delaunay triangulation. A link has two halves, one from each of its ends; half `2 l` starts
//! at the first end of link `l`. On the left of a half lies a triangle, and its circumcentre is a corner of the cells.
use crate::ground::hash::Hash;
use crate::ground::number::index_u32;
use crate::ground::stop::Until;
use crate::leather::delaunay::delaunay_until;
use glam::{DVec2, Vec2};

/// Largest shift of points from the centres of hexagons, as a share of their distance.
const JITTER: f64 = 0.3;

/// Least number of points in a row and in a column.
const LEAST: f64 = 4.0;

/// A link between two points.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Its points.
    pub ends: [u32; 2],
    /// The vector from the first to the second.
    pub along: DVec2,
    /// Length of the border between the two cells.
    pub border: f64,
}

/// A net of points that repeats in both directions.
#[derive(Clone, Debug)]
pub struct Net {
    /// The area that repeats, mm.
    pub size: DVec2,
    /// Mean distance of points, mm.
    pub pitch: f64,
    /// The points.
    pub sites: Vec<DVec2>,
    /// Area of the cell of each point.
    pub area: Vec<f64>,
    /// The links.
    pub links: Vec<Link>,
    /// For each point the index in `halves` of its first half, and the end.
    pub starts: Vec<usize>,
    /// The halves that start at each point, in order of their direction.
    pub halves: Vec<u32>,
    /// The corners of cells.
    pub corners: Vec<DVec2>,
    /// For each half the corner on its left.
    pub left: Vec<u32>,
}

/// The vector on the torus that is the shortest of all equal ones.
pub fn shortest(v: DVec2, size: DVec2) -> DVec2 {
    v - (v / size).round() * size
}

/// The place in the first repeat.
pub fn wrapped(p: DVec2, size: DVec2) -> DVec2 {
    let at = p - (p / size).floor() * size;
    DVec2::select(at.cmplt(size), at, DVec2::ZERO)
}

/// Columns and rows of hexagons; the number of rows is even. On a small area the pitch is smaller.
fn rows(size: DVec2, pitch: f64) -> DVec2 {
    let pitch = pitch.min(size.min_element() / LEAST);
    let columns = (size.x / pitch).round();
    let rows = 2.0 * (size.y / (pitch * 3f64.sqrt())).round().max(1.0);
    DVec2::new(columns, rows)
}

/// The number of points of a net with a pitch.
pub fn count(size: DVec2, pitch: f64) -> f64 {
    rows(size, pitch).element_product()
}

impl Net {
    /// A net of jittered centres of hexagons; `None` if stopped.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the caller limits the count")]
    pub fn hexagons(size: DVec2, pitch: f64, hash: Hash, until: Until<'_>) -> Option<Self> {
        let counts = rows(size, pitch);
        let (columns, step) = (counts.x as u64, size / counts);
        let site = |n: u64| {
            let (i, j) = ((n % columns) as f64, n / columns);
            let stray = (DVec2::new(hash.unit(2 * n), hash.unit(2 * n + 1)) - 0.5) * (2.0 * JITTER);
            let at = DVec2::new(i + 0.25 + 0.5 * (j % 2) as f64, j as f64 + 0.5) + stray;
            wrapped(at * step, size)
        };
        let sites: Vec<DVec2> = (0..columns * counts.y as u64).map(site).collect();
        Self::new(size, &sites, until)
    }

    /// A net of points in the first repeat; `None` if stopped.
    pub fn new(size: DVec2, sites: &[DVec2], until: Until<'_>) -> Option<Self> {
        // The triangulation takes single precision, so the net has the same points.
        let narrow = size.as_vec2();
        let flat: Vec<Vec2> = sites
            .iter()
            .map(|p| {
                let p = p.as_vec2();
                Vec2::select(p.cmplt(narrow), p, Vec2::ZERO)
            })
            .collect();
        let made = delaunay_until(&flat, narrow, true, until);
        if until() {
            return None;
        }
        let sites: Vec<DVec2> = flat.iter().map(|p| p.as_dvec2()).collect();
        let links: Vec<Link> = (0..made.pairs.len())
            .map(|l| {
                let [a, b] = made.pairs[l].map(|p| sites[p as usize]);
                let wrap = made.wraps.get(l).copied().unwrap_or_default().map(f64::from);
                Link { ends: made.pairs[l], along: b + DVec2::from(wrap) * size - a, border: 0.0 }
            })
            .collect();
        let pitch = (size.element_product() / sites.len().max(1) as f64 * 2.0 / 3f64.sqrt()).sqrt();
        let (starts, halves) = around(&links, sites.len());
        let area = vec![0.0; sites.len()];
        let mut net = Self { size, pitch, sites, area, links, starts, halves, corners: Vec::new(), left: Vec::new() };
        net.find_corners();
        net.measure();
        Some(net)
    }

    /// The point at which a half starts.
    pub fn start(&self, half: u32) -> u32 {
        self.links[half as usize / 2].ends[half as usize % 2]
    }

    /// The point at which a half ends.
    pub fn end(&self, half: u32) -> u32 {
        self.start(half ^ 1)
    }

    /// The vector of a half.
    pub fn along(&self, half: u32) -> DVec2 {
        let along = self.links[half as usize / 2].along;
        if half.is_multiple_of(2) { along } else { -along }
    }

    /// The halves that start at a point, in order of their direction.
    pub fn from(&self, site: usize) -> &[u32] {
        &self.halves[self.starts[site]..self.starts[site + 1]]
    }

    /// The corners at the right and left end of a link's border.
    pub fn ends(&self, link: usize) -> [u32; 2] {
        [self.left[2 * link + 1], self.left[2 * link]]
    }

    fn find_corners(&mut self) {
        let mut place = vec![0; self.halves.len()];
        self.halves.iter().enumerate().for_each(|(n, half)| place[*half as usize] = n);
        // The half after `half` around the triangle on its left: at the end, the one before the way back.
        let next = |half: u32| {
            let (site, at) = (self.end(half) as usize, place[half as usize ^ 1]);
            self.halves[if at == self.starts[site] { self.starts[site + 1] - 1 } else { at - 1 }]
        };
        let mut left = vec![u32::MAX; self.halves.len()];
        let mut corners = Vec::new();
        for half in 0..index_u32(left.len()) {
            if left[half as usize] != u32::MAX {
                continue;
            }
            let second = next(half);
            let corner = index_u32(corners.len());
            let (a, b) = (self.along(half), self.along(half) + self.along(second));
            corners.push(wrapped(self.sites[self.start(half) as usize] + circumcentre(a, b), self.size));
            for half in [half, second, next(second)] {
                left[half as usize] = corner;
            }
        }
        (self.left, self.corners) = (left, corners);
    }

    /// Sets the lengths of borders and the areas of cells.
    fn measure(&mut self) {
        for l in 0..self.links.len() {
            let [right, left] = self.ends(l).map(|corner| self.corners[corner as usize]);
            let link = &mut self.links[l];
            let length = link.along.length().max(1e-12);
            let border = shortest(left - right, self.size).dot(link.along.perp()) / length;
            link.border = border.clamp(0.0, 4.0 * self.pitch);
            for end in link.ends {
                self.area[end as usize] += 0.25 * link.border * length;
            }
        }
    }
}

/// The halves around each point.
fn around(links: &[Link], sites: usize) -> (Vec<usize>, Vec<u32>) {
    let mut lists: Vec<Vec<(f64, u32)>> = vec![Vec::new(); sites];
    for (l, link) in (0_u32..).zip(links) {
        lists[link.ends[0] as usize].push((libm::atan2(link.along.y, link.along.x), 2 * l));
        lists[link.ends[1] as usize].push((libm::atan2(-link.along.y, -link.along.x), 2 * l + 1));
    }
    let (mut starts, mut halves) = (vec![0], Vec::with_capacity(2 * links.len()));
    for list in &mut lists {
        list.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        halves.extend(list.iter().map(|(_, half)| *half));
        starts.push(halves.len());
    }
    (starts, halves)
}

/// The centre of the circle through 0, `a` and `b`; the mean of the points if they lie on a line.
fn circumcentre(a: DVec2, b: DVec2) -> DVec2 {
    let twice = 2.0 * a.perp_dot(b);
    let centre = (a.length_squared() * b.perp() - b.length_squared() * a.perp()) / -twice;
    let far = a.length().max(b.length());
    if centre.is_finite() && centre.length() < 4.0 * far { centre } else { (a + b) / 3.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::stop::NEVER;

    #[test]
    fn circles_go_through_three_points() {
        let (a, b) = (DVec2::new(2.0, 0.3), DVec2::new(0.4, 1.7));
        let centre = circumcentre(a, b);
        for p in [a, b] {
            assert!((centre.distance(p) - centre.length()).abs() < 1e-12, "{centre}");
        }
    }

    #[test]
    fn cells_cover_the_torus_and_are_in_balance() {
        for (size, pitch) in [(DVec2::new(30.0, 20.0), 1.0), (DVec2::new(3.0, 50.0), 2.0), (DVec2::splat(5.0), 9.0)] {
            let net = Net::hexagons(size, pitch, Hash::new(3), NEVER).unwrap();
            let area: f64 = net.area.iter().sum();
            assert!((area / size.element_product() - 1.0).abs() < 1e-4, "{size}: {area}");
            assert_eq!(net.corners.len(), 2 * net.sites.len(), "{size}");
            for site in 0..net.sites.len() {
                let pull = |half: &u32| net.along(*half).normalize() * net.links[*half as usize / 2].border;
                let pull: DVec2 = net.from(site).iter().map(pull).sum();
                assert!(pull.length() < 1e-4 * net.pitch, "{size}: {pull}");
            }
        }
    }

    #[test]
    fn the_count_is_known_before() {
        let size = DVec2::new(31.0, 22.0);
        let net = Net::hexagons(size, 0.7, Hash::new(3), NEVER).unwrap();
        assert_eq!(net.sites.len() as f64, count(size, 0.7));
    }
}
