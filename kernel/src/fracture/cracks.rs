//! Cracks as smooth lines, and the plates between them.
//!
//! Broken links give the borders of cells as pieces. Corners where cracks bend are smoothed; where a crack meets
//! another one, only the older one is smoothed, so the younger one ends on it and does not bend it.
use super::net::{Net, shortest, wrapped};
use super::springs::Break;
use crate::ground::number::index_u32;
use glam::DVec2;

/// Number of times that corners are smoothed.
const ROUNDS: usize = 12;

/// Cracks of fewer pieces are left out.
const FEWEST: u32 = 3;

/// A straight piece of a crack.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// The broken link.
    pub link: u32,
    /// The first end, in the first repeat, and the second one near it.
    pub ends: [DVec2; 2],
    /// Width at both ends, mm.
    pub widths: [f64; 2],
    /// Age, 0..1; 1 is the oldest.
    pub age: f64,
    /// Age of the oldest crack at each end.
    pub ages: [f64; 2],
    /// True if it lies between two plates.
    pub divides: bool,
}

/// The cracks of a net.
#[derive(Clone, Debug)]
pub struct Cracks {
    /// The pieces, by link.
    pub pieces: Vec<Piece>,
    /// The smoothed corners of all cells.
    pub corners: Vec<DVec2>,
    /// The plate of each point, from 1 on.
    pub plates: Vec<u32>,
}

/// Disjoint sets of numbers.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..index_u32(count)).collect())
    }

    fn root(&mut self, mut n: u32) -> u32 {
        while self.0[n as usize] != n {
            let up = self.0[self.0[n as usize] as usize];
            self.0[n as usize] = up;
            n = up;
        }
        n
    }

    /// The least number of a set is its root.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// The plate of each point: points that whole links connect.
fn plates(net: &Net, order: &[u32]) -> Vec<u32> {
    let mut sets = Sets::new(net.sites.len());
    for (link, _) in net.links.iter().zip(order).filter(|(_, order)| **order == u32::MAX) {
        sets.join(link.ends[0], link.ends[1]);
    }
    let mut plates = vec![0; net.sites.len()];
    let mut count = 0;
    for site in 0..index_u32(plates.len()) {
        let root = sets.root(site);
        if root == site {
            count += 1;
            plates[site as usize] = count;
        } else {
            plates[site as usize] = plates[root as usize];
        }
    }
    plates
}

/// The links of cracks that are long enough.
fn long(net: &Net, order: &[u32]) -> Vec<usize> {
    let broken = || (0..net.links.len()).filter(|l| order[*l] != u32::MAX);
    let mut sets = Sets::new(net.corners.len());
    broken().for_each(|l| sets.join(net.ends(l)[0], net.ends(l)[1]));
    let mut counts = vec![0_u32; net.corners.len()];
    broken().for_each(|l| counts[sets.root(net.ends(l)[0]) as usize] += 1);
    broken().filter(|l| counts[sets.root(net.ends(*l)[0]) as usize] >= FEWEST).collect()
}

/// The links without those that start at a crack and end at once. Only the youngest one at a corner is such a spur, so
/// a link that shows never disappears when more links break.
fn without_spurs(net: &Net, links: &[usize], at: &mut [Vec<usize>]) -> Vec<usize> {
    let is_spur = |link: usize| {
        let [a, b] = net.ends(link).map(|corner| &at[corner as usize]);
        let starts = |list: &[usize]| list.len() == 3 && list[2] == link;
        (a.len() == 1 && starts(b)) || (b.len() == 1 && starts(a))
    };
    let (spurs, rest): (Vec<usize>, Vec<usize>) = links.iter().partition(|link| is_spur(**link));
    for link in spurs {
        for corner in net.ends(link) {
            at[corner as usize].retain(|other| *other != link);
        }
    }
    rest
}

impl Cracks {
    /// The cracks of a broken net, for a limit of strain.
    pub fn new(net: &Net, broken: &Break, strain: f64) -> Self {
        let plates = plates(net, &broken.order);
        let links = long(net, &broken.order);
        // The broken borders at each corner, the oldest first.
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); net.corners.len()];
        for link in &links {
            net.ends(*link).into_iter().for_each(|corner| at[corner as usize].push(*link));
        }
        at.iter_mut().for_each(|list| list.sort_unstable_by_key(|l| broken.order[*l]));
        let links = without_spurs(net, &links, &mut at);
        let corners = smooth(net, &at);
        // All cracks that meet at a corner have the width of the older one there, so that widths do not jump.
        let width = |corner: u32| match at[corner as usize][..] {
            [a, b, ..] => 0.5 * strain * (broken.opening[a] + broken.opening[b]),
            _ => 0.0,
        };
        let age = |link: usize| 1.0 - f64::from(broken.order[link]) / f64::from(broken.count.max(1));
        let piece = |link: &usize| {
            let ends = net.ends(*link);
            let [a, b] = ends.map(|corner| corners[corner as usize]);
            let [from, to] = net.links[*link].ends;
            Piece {
                link: index_u32(*link),
                ends: [a, a + shortest(b - a, net.size)],
                widths: ends.map(width),
                age: age(*link),
                ages: ends.map(|corner| at[corner as usize].first().map_or(0.0, |oldest| age(*oldest))),
                divides: plates[from as usize] != plates[to as usize],
            }
        };
        let pieces = links.iter().map(piece).collect();
        Self { pieces, corners, plates }
    }

    /// The number of plates.
    pub fn count(&self) -> u32 {
        self.plates.iter().copied().max().unwrap_or(0)
    }
}

/// The corners, smoothed along the two oldest cracks that meet there. Ends of cracks stay.
fn smooth(net: &Net, at: &[Vec<usize>]) -> Vec<DVec2> {
    let other = |corner: u32, link: usize| {
        let [a, b] = net.ends(link);
        if a == corner { b } else { a }
    };
    let pairs: Vec<(u32, [u32; 2])> = (0_u32..)
        .zip(at)
        .filter_map(|(corner, list)| {
            let (Some(a), Some(b)) = (list.first(), list.get(1)) else { return None };
            Some((corner, [other(corner, *a), other(corner, *b)]))
        })
        .collect();
    let mut corners = net.corners.clone();
    let mut next = Vec::with_capacity(pairs.len());
    for _ in 0..ROUNDS {
        next.clear();
        next.extend(pairs.iter().map(|(corner, [a, b])| {
            let here = corners[*corner as usize];
            let to = |corner: u32| shortest(corners[corner as usize] - here, net.size);
            wrapped(here + 0.25 * (to(*a) + to(*b)), net.size)
        }));
        for ((corner, _), at) in pairs.iter().zip(&next) {
            corners[*corner as usize] = *at;
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_have_their_least_number_as_root() {
        let mut sets = Sets::new(6);
        sets.join(5, 3);
        sets.join(3, 1);
        sets.join(4, 2);
        assert_eq!([0, 1, 2, 3, 4, 5].map(|n| sets.root(n)), [0, 1, 2, 1, 2, 1]);
    }
}
