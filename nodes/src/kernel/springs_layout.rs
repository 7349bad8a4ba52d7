//! How a patch of [`super::springs_list`] is laid out: its rings, its springs by spans, and which slots its points read.

use super::springs::Real;
use super::springs_list::Web;
use super::springs_patch::{GROUP, LOCAL, Patch, SPAN, Slots, Span};
use std::ops::Range;

/// As a local index.
fn short(i: usize) -> u16 {
    u16::try_from(i).expect("counted before")
}

/// Whether a sorted list has a point.
fn has(ring: &[u32], p: u32) -> bool {
    ring.binary_search(&p).is_ok()
}

/// The points of each ring, sorted: those at most one link from the ring before.
fn rings<T: Real>(own: &Range<usize>, reach: usize, web: &Web<'_, '_, T>) -> Vec<Vec<u32>> {
    let mut rings = vec![own.clone().filter_map(|p| u32::try_from(p).ok()).collect::<Vec<_>>()];
    for r in 0..reach {
        let near = r.saturating_sub(1).max(1)..(r + 1).max(1);
        let known = |p: u32| own.contains(&(p as usize)) || rings[near.clone()].iter().any(|ring| has(ring, p));
        let mut next = Vec::new();
        for &p in &rings[r] {
            next.extend(web.owned.of(p).iter().map(|&id| web.ends[id as usize][1]).filter(|&p| !known(p)));
            next.extend(web.incoming.of(p).iter().map(|&id| web.ends[id as usize][0]).filter(|&p| !known(p)));
        }
        next.sort_unstable();
        next.dedup();
        rings.push(next);
    }
    rings
}

/// Springs by spans, ring after ring.
#[derive(Default)]
struct Layout<T> {
    spans: Vec<Span>,
    /// How many spans and slots there are up to each ring.
    to: Vec<[usize; 2]>,
    /// Per slot the far end, as a point, and the index into the links.
    far: Vec<u32>,
    ids: Vec<u32>,
    offsets: Vec<[T; 2]>,
}

impl<T: Real> Layout<T> {
    /// Adds a ring whose first point is `first`, given the springs of each of its points. A span ends where points have
    /// more springs than those before, or begin or cease to have offsets.
    fn ring(&mut self, mut first: usize, lists: &[&[u32]], web: &Web<'_, '_, T>) {
        for alike in lists.chunk_by(|a, b| a.len() >= b.len() && wraps(web, a) == wraps(web, b)) {
            for part in alike.chunks(SPAN) {
                for j in 0..part[0].len() {
                    let springs = part.iter().map_while(|list| list.get(j)).copied();
                    self.span(first, springs.collect(), web);
                }
                first += part.len();
            }
        }
        self.to.push([self.spans.len(), self.far.len()]);
    }

    /// Adds a span.
    fn span(&mut self, first: usize, springs: Vec<u32>, web: &Web<'_, '_, T>) {
        let mut offsets = None;
        if wraps(web, &springs) {
            offsets = u32::try_from(self.offsets.len()).ok();
            let size = web.net.size.map(T::wide);
            let offset = |&id: &u32| [0, 1].map(|axis| T::of(f64::from(web.net.wraps[id as usize][axis]) * size[axis]));
            self.offsets.extend(springs.iter().map(offset));
        }
        self.spans.push(Span { first: short(first), count: short(springs.len()), offsets });
        self.far.extend(springs.iter().map(|&id| web.ends[id as usize][1]));
        self.ids.extend(springs);
    }
}

/// Whether any of some springs has an offset.
fn wraps<T: Real>(web: &Web<'_, '_, T>, springs: &[u32]) -> bool {
    springs.iter().any(|&id| web.wraps(id))
}

impl<T: Real> Patch<T> {
    /// The patch of the points `own` and of `reach` rings; fails with a point if that is too much.
    pub(super) fn new(own: Range<usize>, reach: usize, web: &Web<'_, '_, T>, weight: &[T]) -> Result<Self, u32> {
        let mut rings = rings(&own, reach, web);
        let crowded = rings[0].first().copied().unwrap_or_default();
        if rings.iter().map(Vec::len).sum::<usize>() >= LOCAL {
            return Err(crowded);
        }
        // Of the last ring only springs that lead inwards count.
        let inner = |p: u32| own.contains(&(p as usize)) || rings[1..reach].iter().any(|ring| has(ring, p));
        let inwards = |&p: &u32| -> (u32, Vec<u32>) {
            (p, web.owned.of(p).iter().copied().filter(|&id| inner(web.ends[id as usize][1])).collect())
        };
        let outer: Vec<_> = rings[reach].iter().map(inwards).collect();
        let springs = |p: u32, ring: usize| match outer.binary_search_by_key(&p, |o| o.0) {
            Ok(at) if ring == reach => &outer[at].1[..],
            _ => web.owned.of(p),
        };
        for (r, ring) in rings.iter_mut().enumerate().skip(1) {
            ring.sort_by_cached_key(|&p| {
                let list = springs(p, r);
                (wraps(web, list), usize::MAX - list.len(), usize::MAX - web.incoming.of(p).len())
            });
        }
        let (mut layout, mut ends) = (Layout::default(), Vec::new());
        let mut first = 0;
        for (r, ring) in rings.iter().enumerate() {
            let lists: Vec<&[u32]> = ring.iter().map(|&p| springs(p, r)).collect();
            if layout.far.len() + lists.iter().map(|list| list.len()).sum::<usize>() >= LOCAL {
                return Err(crowded);
            }
            layout.ring(first, &lists, web);
            first += ring.len();
            ends.push(first);
        }
        let mut places: Vec<(u32, u16)> = rings[1..].iter().flatten().copied().zip(short(own.len())..).collect();
        places.sort_unstable();
        let local = |&p: &u32| match places.binary_search_by_key(&p, |place| place.0) {
            _ if own.contains(&(p as usize)) => short(p as usize - own.start),
            Ok(at) | Err(at) => places[at].1,
        };
        let net = web.net;
        let gather = |values: &[T]| layout.ids.iter().filter_map(|&id| values.get(id as usize).copied()).collect();
        let mut patch = Self {
            ghosts: rings[1..].concat(),
            spans: layout.spans,
            spans_to: layout.to,
            runs: Vec::new(),
            runs_to: Vec::new(),
            incoming: Vec::new(),
            velocity: vec![[T::default(); 2]; ends[reach - usize::from(net.damping.is_empty())]],
            weight: rings[..reach].iter().flatten().map(|&p| [weight[p as usize]; 2]).collect(),
            slots: Slots {
                far: layout.far.iter().map(local).collect(),
                stiffness: gather(net.stiffness),
                rest: gather(net.rest),
                threshold: gather(net.threshold),
                damping: gather(net.damping),
                pushes: layout.ids.iter().filter_map(|&id| net.pushes.get(id as usize).copied()).collect(),
                offsets: layout.offsets,
                ids: layout.ids,
            },
            rings: ends,
        };
        patch.arrive(reach);
        Ok(patch)
    }

    /// Lists which springs end at each point of the rings before the last.
    fn arrive(&mut self, reach: usize) {
        let points = self.rings[reach - 1];
        let mut starts = vec![0usize; points + 1];
        for &far in self.slots.far.iter().filter(|&&far| usize::from(far) < points) {
            starts[usize::from(far) + 1] += 1;
        }
        for i in 0..points {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        self.incoming = vec![0; starts[points]];
        for (slot, &far) in self.slots.far.iter().enumerate().filter(|(_, far)| usize::from(**far) < points) {
            let place = &mut next[usize::from(far)];
            self.incoming[*place] = short(slot);
            *place += 1;
        }
        for r in 0..reach {
            let from = if r == 0 { 0 } else { self.rings[r - 1] };
            for p in from..self.rings[r] {
                self.incoming[starts[p]..starts[p + 1]].sort_unstable_by_key(|&slot| self.slots.ids[usize::from(slot)]);
                let each = short(starts[p + 1] - starts[p]);
                match self.runs.last_mut() {
                    Some([points, same]) if *same == each && p > from && *points < u16::MAX => *points += 1,
                    _ => self.runs.push([1, each]),
                }
            }
            self.runs_to.push(self.runs.len());
        }
        // The first springs of eight points, their second ones and so on, as `take` reads them.
        let mut start = 0;
        for &[points, each] in &self.runs {
            let [points, each] = [points, each].map(usize::from);
            for eight in self.incoming[start..start + points * each].chunks_exact_mut(each.max(1) * GROUP) {
                let before = eight.to_vec();
                for (i, slot) in eight.iter_mut().enumerate() {
                    *slot = before[i % GROUP * each + i / GROUP];
                }
            }
            start += points * each;
        }
    }
}
