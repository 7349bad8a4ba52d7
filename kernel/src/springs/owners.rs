//! Assigns an owner to each spring of [`super::list`], one of its ends. Points are computed side by side; equal numbers
//! of owned springs minimise padding.

use super::net::Net;
use crate::ground::number::index_u32;
use crate::ground::real::Real;

/// Maximum number of points that a search for an owner with room visits.
const LOOK: usize = 64;

/// Numbers of springs of a point.
#[derive(Clone, Copy, Default)]
pub(super) struct Count {
    /// True if it owns a spring with an offset.
    pub(super) wraps: bool,
    /// Springs that it owns.
    pub(super) owned: u32,
    /// Springs that end there and have another owner.
    pub(super) incoming: u32,
}

/// Returns whether a spring has an offset.
pub(super) fn offset<T: Real>(net: &Net<'_, T>, spring: u32) -> bool {
    net.wraps.get(spring as usize).is_some_and(|&w| w != [0, 0])
}

/// Swaps the ends of springs so that the owner comes first. Depends only on the links and their order; nearly all
/// points own at most the mean number of springs, rounded up.
pub(super) fn share<T: Real>(points: usize, net: &Net<'_, T>, ends: &mut [[u32; 2]]) -> Vec<Count> {
    let mut counts = vec![Count::default(); points];
    for (id, ends) in (0..).zip(&mut *ends) {
        let lead = |p: u32| i64::from(counts[p as usize].owned) - i64::from(counts[p as usize].incoming);
        // The offset is that of the second end from the first.
        let wraps = offset(net, id);
        if !wraps && lead(ends[1]) < lead(ends[0]) {
            ends.reverse();
        }
        let [owner, far] = ends.map(|p| p as usize);
        counts[owner].wraps |= wraps;
        counts[owner].owned += 1;
        counts[far].incoming += 1;
    }
    even(net, ends, &mut counts);
    counts
}

/// Balances the numbers: a point that owns more than the mean looks for a chain of springs to a nearby point that owns
/// fewer, and all springs of the chain change their owner (an augmenting path).
fn even<T: Real>(net: &Net<'_, T>, ends: &mut [[u32; 2]], counts: &mut [Count]) {
    let mean = index_u32(ends.len().div_ceil(counts.len().max(1)));
    let mut owned = Owned::new(net, ends, counts);
    // For each point the number of the last search that visited it.
    let mut seen = vec![0u32; counts.len()];
    let mut search = 0;
    // Points, the spring that leads there, and the index of the previous entry.
    let mut chain: Vec<(u32, u32, usize)> = Vec::with_capacity(LOOK);
    for p in 0..index_u32(counts.len()) {
        while counts[p as usize].owned > mean {
            search += 1;
            chain.clear();
            chain.push((p, 0, 0));
            seen[p as usize] = search;
            let (mut at, mut end) = (0, None);
            while at < chain.len() && chain.len() < LOOK && end.is_none() {
                for &[far, id] in owned.of(chain[at].0) {
                    if seen[far as usize] == search {
                        continue;
                    }
                    seen[far as usize] = search;
                    chain.push((far, id, at));
                    if counts[far as usize].owned < mean {
                        end = Some(chain.len() - 1);
                        break;
                    }
                }
                at += 1;
            }
            let Some(mut at) = end else { break };
            let [from, to] = [p, chain[at].0].map(|point| point as usize);
            (counts[from].owned, counts[from].incoming) = (counts[from].owned - 1, counts[from].incoming + 1);
            (counts[to].owned, counts[to].incoming) = (counts[to].owned + 1, counts[to].incoming - 1);
            while at > 0 {
                let (far, id, before) = chain[at];
                owned.pass(id, chain[before].0, far);
                ends[id as usize].reverse();
                at = before;
            }
        }
    }
}

/// The springs without offset that each point owns, with room for all springs that end there.
struct Owned {
    starts: Vec<u32>,
    counts: Vec<u32>,
    /// Far ends and springs.
    springs: Vec<[u32; 2]>,
}

impl Owned {
    fn new<T: Real>(net: &Net<'_, T>, ends: &[[u32; 2]], counts: &[Count]) -> Self {
        let mut starts = Vec::with_capacity(counts.len());
        let mut all = 0;
        for count in counts {
            starts.push(all);
            all += count.owned + count.incoming;
        }
        let mut owned = Self { starts, counts: vec![0; counts.len()], springs: vec![[0; 2]; all as usize] };
        for (id, &[owner, far]) in (0..).zip(ends).filter(|&(id, _)| !offset(net, id)) {
            owned.add(owner, far, id);
        }
        owned
    }

    fn of(&self, point: u32) -> &[[u32; 2]] {
        let start = self.starts[point as usize] as usize;
        &self.springs[start..start + self.counts[point as usize] as usize]
    }

    fn add(&mut self, owner: u32, far: u32, id: u32) {
        let count = &mut self.counts[owner as usize];
        self.springs[(self.starts[owner as usize] + *count) as usize] = [far, id];
        *count += 1;
    }

    /// Passes a spring to its far end.
    fn pass(&mut self, id: u32, owner: u32, far: u32) {
        let start = self.starts[owner as usize] as usize;
        let place = self.of(owner).iter().position(|spring| spring[1] == id);
        let count = &mut self.counts[owner as usize];
        *count -= 1;
        self.springs.swap(start + place.unwrap_or(*count as usize), start + *count as usize);
        self.add(far, owner, id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::leather::delaunay::delaunay;
    use crate::leather::points;
    use glam::Vec2;

    #[test]
    fn balances_owned_springs() {
        let size = Vec2::splat(40.0);
        let points = points::random(3000, size, Hash::new(3));
        let links = delaunay(&points, size, true);
        let net = Net::<f32> { links: &links.pairs, wraps: &links.wraps, ..Net::default() };
        let mut ends = links.pairs.clone();
        let counts = share(points.len(), &net, &mut ends);
        let mut counted = vec![Count::default(); points.len()];
        for (id, (ends, pair)) in (0..).zip(ends.iter().zip(&links.pairs)) {
            let turned = [pair[1], pair[0]];
            assert!(ends == pair || (*ends == turned && !offset(&net, id)), "the ends of {id}");
            counted[ends[0] as usize].owned += 1;
            counted[ends[0] as usize].wraps |= offset(&net, id);
            counted[ends[1] as usize].incoming += 1;
        }
        let owned = |c: &Count| (c.wraps, c.owned, c.incoming);
        assert!(counted.iter().map(owned).eq(counts.iter().map(owned)));
        // Three springs per point on a torus; the owners of springs with offsets do not change.
        let three = counts.iter().filter(|count| count.owned == 3).count();
        assert!(three * 20 > points.len() * 19, "{three} points own three springs");
    }
}
