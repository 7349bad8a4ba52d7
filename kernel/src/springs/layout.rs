//! Memory layout of a block of [`super::list`]: the layers of its halo, its parts and groups, their springs, and the
//! slots that its points read.

use super::adjacency::Adjacency;
use super::block::{BlockPart, GROUP, GroupRun, LANE, LOCAL, PART, Slots, SpringBlock};
use super::net::Mass;
use crate::ground::real::Real;
use std::ops::Range;

/// Marks a missing point or the slot of no spring.
const NONE: u16 = u16::MAX;
/// Maximum number of points of a part of the halo, whose layers are thin.
const HALO_PART: usize = 64;

/// Converts to a local index.
fn short(i: usize) -> u16 {
    u16::try_from(i).expect("counted before")
}

/// Converts to a stored index.
fn long(i: usize) -> u32 {
    u32::try_from(i).expect("fewer than springs")
}

/// The axis of the points' larger extent.
pub(super) fn longer_axis<T: Real>(points: impl Iterator<Item = [T; 2]> + Clone) -> usize {
    let extent = |axis: usize| {
        let along = points.clone().map(|p| p[axis].wide());
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    usize::from(extent(1) > extent(0))
}

/// The local index of each point while a block is laid out.
pub(super) struct Locals(Vec<u16>);

impl Locals {
    /// For `points` points, none of which has a local index.
    pub(super) fn new(points: usize) -> Self {
        Self(vec![NONE; points])
    }

    fn of(&self, p: u32) -> usize {
        usize::from(self.0[p as usize])
    }
}

/// A block under construction.
struct Layout<'w, 'n, 'a, T> {
    adjacency: &'w Adjacency<'n, 'a, T>,
    locals: &'w mut Locals,
    reach: usize,
    /// Points by local index.
    points: Vec<u32>,
    /// True for points that only pad groups.
    padding: Vec<bool>,
    /// Number of points up to and including each layer.
    layers: Vec<usize>,
    parts: Vec<BlockPart>,
    owning: Vec<GroupRun>,
    arriving: Vec<GroupRun>,
    /// Link index of each slot.
    ids: Vec<u32>,
    offsets: Vec<[T; 2]>,
}

impl<T: Real> Layout<'_, '_, '_, T> {
    /// Adds points as a layer, padded to whole groups. Returns false if there are too many.
    fn layer(&mut self, points: impl Iterator<Item = u32>) -> bool {
        let from = self.points.len();
        self.points.extend(points);
        self.padding.resize(self.points.len(), false);
        if let Some(&last) = self.points[from..].last() {
            self.points.resize(self.points.len().next_multiple_of(GROUP), last);
            self.padding.resize(self.points.len(), true);
        }
        if self.points.len() >= LOCAL {
            return false;
        }
        for p in (from..self.points.len()).filter(|&p| !self.padding[p]) {
            self.locals.0[self.points[p] as usize] = short(p);
        }
        self.layers.push(self.points.len());
        true
    }

    /// The local indices of a layer.
    fn of_layer(&self, layer: usize) -> Range<usize> {
        (if layer == 0 { 0 } else { self.layers[layer - 1] })..self.layers[layer]
    }

    /// Finds the layers of the halo: points one link away from the layer before. Returns false if there are too many.
    fn spread(&mut self, own: Range<usize>, along: &impl Fn(u32) -> f64) -> bool {
        if !self.layer(own.map(long)) {
            return false;
        }
        for layer in 0..self.reach {
            let mut next = Vec::new();
            for p in self.of_layer(layer).filter(|&p| !self.padding[p]) {
                let p = self.points[p];
                next.extend(self.adjacency.owned.of(p).iter().map(|&id| self.adjacency.ends[id as usize][1]));
                next.extend(self.adjacency.incoming.of(p).iter().map(|&id| self.adjacency.ends[id as usize][0]));
            }
            next.retain(|&p| self.locals.0[p as usize] == NONE);
            next.sort_unstable();
            next.dedup();
            next.sort_by(|&a, &b| along(a).total_cmp(&along(b)));
            let alike = |&p: &u32| {
                let owned = self.adjacency.owned.of(p);
                (self.wraps(owned), usize::MAX - owned.len(), usize::MAX - self.adjacency.incoming.of(p).len())
            };
            next.chunks_mut(HALO_PART).for_each(|part| part.sort_by_cached_key(alike));
            if !self.layer(next.into_iter()) {
                return false;
            }
        }
        true
    }

    /// Returns whether any of the springs has an offset.
    fn wraps(&self, springs: &[u32]) -> bool {
        springs.iter().any(|&id| self.adjacency.wraps(id))
    }

    /// Lays out the springs of all points, part after part across the block.
    fn springs(&mut self, along: &impl Fn(u32) -> f64) {
        let mut parts = Vec::new();
        for layer in 0..self.layers.len() {
            let all = self.of_layer(layer);
            let most = if layer == 0 { PART } else { HALO_PART };
            for first in all.clone().step_by(most) {
                let points = first..(first + most).min(all.end);
                let places = self.points[points.clone()].iter().map(|&p| along(p));
                parts.push((places.fold(f64::INFINITY, f64::min), layer, points));
            }
        }
        parts.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        for (_, layer, points) in parts {
            let (slot, offset) = (self.ids.len(), long(self.offsets.len()));
            let runs = [long(self.owning.len()), long(self.arriving.len())];
            for group in points.clone().step_by(GROUP) {
                self.group(group, group == points.start, layer == self.reach);
            }
            self.parts.push(BlockPart {
                layer: short(layer),
                first: short(points.start),
                points: short(points.len()),
                slot: long(slot),
                pulls: 0,
                offset,
                incoming: 0,
                owning: [runs[0], long(self.owning.len())],
                arriving: [runs[1], long(self.arriving.len())],
                ready: [0; 2],
            });
        }
    }

    /// Adds the group of eight points that starts at `first`. `begins`: it is the first of a part; `last`: it is in the
    /// outermost layer.
    fn group(&mut self, first: usize, begins: bool, last: bool) {
        let adjacency = self.adjacency;
        let inner = self.layers[self.reach - 1];
        let lists: [Vec<u32>; GROUP] = std::array::from_fn(|i| {
            let owned = if self.padding[first + i] { &[] } else { adjacency.owned.of(self.points[first + i]) };
            // In the outermost layer only springs that lead inwards count.
            owned
                .iter()
                .copied()
                .filter(|&id| !last || self.locals.of(adjacency.ends[id as usize][1]) < inner)
                .collect()
        });
        let incoming = (first..first + GROUP).filter(|&p| !last && !self.padding[p]);
        let incoming = incoming.map(|p| adjacency.incoming.of(self.points[p]).len()).max().unwrap_or(0);
        let own = lists.iter().map(Vec::len).max().unwrap_or(0);
        let wraps = lists.iter().any(|list| self.wraps(list));
        let ids = (0..own).flat_map(|j| lists.each_ref().map(|list| list.get(j).copied().unwrap_or(u32::MAX)));
        let from = self.ids.len();
        self.ids.extend(ids);
        if wraps {
            let size = adjacency.net.size.map(T::wide);
            let offset = |&id: &u32| {
                let wraps = adjacency.net.wraps.get(id as usize).copied().unwrap_or_default();
                [0, 1].map(|axis| T::of(f64::from(wraps[axis]) * size[axis]))
            };
            self.offsets.extend(self.ids[from..].iter().map(offset));
        }
        join(&mut self.owning, begins, GroupRun { groups: 1, each: long(own), wraps });
        join(&mut self.arriving, begins, GroupRun { groups: 1, each: long(incoming), wraps: false });
    }

    /// The groups of a part: first point, first slot, number of springs that each point owns, and number that end
    /// there.
    fn groups(&self, part: &BlockPart) -> impl Iterator<Item = [usize; 4]> {
        let each = |runs: &'_ [GroupRun]| -> Vec<usize> {
            let each = |run: &GroupRun| std::iter::repeat_n(run.each as usize, usize::from(run.groups));
            runs.iter().flat_map(each).collect()
        };
        let owning = each(&self.owning[part.owning[0] as usize..part.owning[1] as usize]);
        let arriving = each(&self.arriving[part.arriving[0] as usize..part.arriving[1] as usize]);
        let (mut point, mut slot) = (usize::from(part.first), part.slot as usize);
        owning.into_iter().zip(arriving).map(move |(own, incoming)| {
            let group = [point, slot, own, incoming];
            (point, slot) = (point + GROUP, slot + own * GROUP);
            group
        })
    }

    /// For each part the springs that end at the points of its groups: the first one of each point, then the second
    /// ones and so on, each as slot and part; `None` if a point has fewer.
    fn arriving(&mut self, far: &[u16]) -> Vec<Option<(u32, u16)>> {
        let mut first = vec![usize::MAX; self.points.len()];
        let mut all = 0;
        for number in 0..self.parts.len() {
            self.parts[number].incoming = long(all);
            for [point, _, _, incoming] in self.groups(&self.parts[number]) {
                for (i, first) in first[point..point + GROUP].iter_mut().enumerate() {
                    *first = all + i;
                }
                all += incoming * GROUP;
            }
        }
        let mut arriving = vec![None; all];
        // Skip springs that end at the outermost layer, which does not move.
        let moving = self.layers[self.reach - 1];
        for (number, part) in (0..).zip(&self.parts) {
            for slot in part.slot as usize..self.end(usize::from(number)) {
                let (far, id) = (usize::from(far[slot]), self.ids[slot]);
                if far < moving
                    && let Ok(nth) = self.adjacency.incoming.of(self.points[far]).binary_search(&id)
                {
                    arriving[first[far] + nth * GROUP] = Some((long(slot), number));
                }
            }
        }
        arriving
    }

    /// End of the slots of a part.
    fn end(&self, part: usize) -> usize {
        self.parts.get(part + 1).map_or(self.ids.len(), |next| next.slot as usize)
    }

    /// Computes the part after which each part can move, the storage of each part's pulls until they are read, and the
    /// pulls that each point reads. `None` if there is no room.
    fn arrive(&mut self, far: &[u16]) -> Option<[Vec<u16>; 2]> {
        let arriving = self.arriving(far);
        let count = self.parts.len();
        let of = |parts: &[BlockPart], number: usize| {
            let end = parts.get(number + 1).map_or(arriving.len(), |next| next.incoming as usize);
            parts[number].incoming as usize..end
        };
        // For each part the parts that move after it, and the last part after which its pulls are read.
        let mut waits = vec![Vec::new(); count];
        let mut until: Vec<usize> = (0..count).collect();
        for number in (0..count).filter(|&number| usize::from(self.parts[number].layer) < self.reach) {
            let owners = || arriving[of(&self.parts, number)].iter().flatten().map(|&(_, part)| usize::from(part));
            let turn = owners().fold(number, usize::max);
            waits[turn].push(short(number));
            for owner in owners() {
                until[owner] = until[owner].max(turn);
            }
        }
        let mut taken: Vec<(Range<usize>, usize)> = Vec::new();
        for number in 0..count {
            let size = self.end(number) - self.parts[number].slot as usize;
            taken.retain(|(_, until)| *until >= number);
            let free = |&at: &usize| taken.iter().all(|(other, _)| at + size <= other.start || other.end <= at);
            let ends = taken.iter().map(|(other, _)| other.end);
            let at = std::iter::once(0).chain(ends).filter(free).min()?;
            if at + size > usize::from(NONE) {
                return None;
            }
            taken.push((at..at + size, until[number]));
            self.parts[number].pulls = short(at);
        }
        let place = |&(slot, part): &(u32, u16)| {
            let part = &self.parts[usize::from(part)];
            short((slot - part.slot) as usize + usize::from(part.pulls))
        };
        let incoming = arriving.iter().map(|spring| spring.as_ref().map_or(NONE, place)).collect();
        let mut ready = Vec::new();
        for (part, waits) in self.parts.iter_mut().zip(waits) {
            let from = long(ready.len());
            ready.extend(waits);
            part.ready = [from, long(ready.len())];
        }
        Some([ready, incoming])
    }

    /// The far end of each slot; for padding, the point itself.
    fn far(&self) -> Vec<u16> {
        let mut far = vec![0; self.ids.len()];
        for part in &self.parts {
            for [point, slot, own, _] in self.groups(part) {
                for i in 0..own * GROUP {
                    far[slot + i] = match self.ids[slot + i] {
                        u32::MAX => short(point + i % GROUP),
                        id => short(self.locals.of(self.adjacency.ends[id as usize][1])),
                    };
                }
            }
        }
        far
    }
}

/// Adds a group to the last run if both have the same numbers and the group does not begin a part; else starts a run.
fn join(runs: &mut Vec<GroupRun>, begins: bool, run: GroupRun) {
    match runs.last_mut() {
        Some(last) if !begins && GroupRun { groups: 1, ..*last } == run => last.groups += 1,
        _ => runs.push(run),
    }
}

impl<T: Real> SpringBlock<T> {
    /// Builds the block of the points `own` with `reach` layers of halo. `places` are the positions of all points in
    /// their order. If there is no room, returns a point as the error.
    pub(super) fn new(
        own: Range<usize>,
        reach: usize,
        adjacency: &Adjacency<'_, '_, T>,
        places: &[[T; 2]],
        weight: &[T],
        locals: &mut Locals,
    ) -> Result<Self, u32> {
        let mut layout = Layout {
            adjacency,
            locals,
            reach,
            points: Vec::new(),
            padding: Vec::new(),
            layers: Vec::new(),
            parts: Vec::new(),
            owning: Vec::new(),
            arriving: Vec::new(),
            ids: Vec::new(),
            offsets: Vec::new(),
        };
        let axis = longer_axis(places[own.clone()].iter().copied());
        let middle = places[own.start + own.len() / 2][axis].wide();
        // Use the periodic copy of a point that is next to the block.
        let size = adjacency.net.size[axis].wide();
        let along = |p: u32| {
            let place = places[p as usize][axis].wide();
            if size > 0.0 { place - size * ((place - middle) / size).round() } else { place }
        };
        let first = long(own.start);
        let done = layout.spread(own, &along) && {
            layout.springs(&along);
            true
        };
        let block = if done { Self::of(&mut layout, places, weight) } else { None };
        for &p in &layout.points {
            layout.locals.0[p as usize] = NONE;
        }
        block.ok_or(first)
    }

    /// Builds the block; `None` if there is no room for its pulls.
    fn of(layout: &mut Layout<'_, '_, '_, T>, places: &[[T; 2]], weight: &[T]) -> Option<Self> {
        let far = layout.far();
        let [ready, incoming] = layout.arrive(&far)?;
        let (net, reach) = (layout.adjacency.net, layout.reach);
        let ids = std::mem::take(&mut layout.ids);
        // Padding has no stiffness, so its pull is 0; a rest length of 1 gives the 0 the sign that changes no sum.
        let by_lane = |values: &[T], none: T| {
            let mut out = vec![none; if values.is_empty() { 0 } else { ids.len() }];
            for (out, ids) in out.as_chunks_mut::<GROUP>().0.iter_mut().zip(ids.as_chunks::<GROUP>().0) {
                for (lane, &id) in LANE.into_iter().zip(ids).filter(|(_, id)| **id != u32::MAX) {
                    out[lane] = values.get(id as usize).copied().unwrap_or(none);
                }
            }
            out
        };
        let by_slot = |values: &[T]| match values {
            [] => Vec::new(),
            _ => ids.iter().map(|&id| values.get(id as usize).copied().unwrap_or_default()).collect(),
        };
        // Blocks that take several steps per stride compute in place.
        let own = layout.layers[0];
        let mut position = vec![[T::default(); 2]; if reach > 1 { LOCAL } else { own }];
        for (place, &p) in position.iter_mut().zip(&layout.points[..own]) {
            *place = places[p as usize];
        }
        let moving = layout.layers[reach - 1];
        let mut weights: Vec<T> = layout.points[..moving].iter().map(|&p| weight[p as usize]).collect();
        let live = matches!(net.mass, Mass::Live(_));
        let alike = weights.first().copied().filter(|first| !live && weights.iter().all(|w| w == first));
        if alike.is_some() {
            weights = Vec::new();
        }
        Some(Self {
            ghosts: layout.points[layout.layers[0]..].to_vec(),
            published: Vec::new(),
            position,
            parts: std::mem::take(&mut layout.parts),
            ready,
            owning: std::mem::take(&mut layout.owning),
            arriving: std::mem::take(&mut layout.arriving),
            incoming,
            velocity: vec![[T::default(); 2]; layout.layers[reach - usize::from(net.damping.is_empty())]],
            weight: weights.into_iter().map(|w| [w; 2]).collect(),
            alike,
            slots: Slots {
                far,
                stiffness: by_lane(net.stiffness, T::default()),
                rest: by_lane(net.rest, T::ONE),
                threshold: by_lane(net.threshold, T::of(f64::INFINITY)),
                damping: by_slot(net.damping),
                pushes: match net.pushes {
                    [] => Vec::new(),
                    pushes => ids.iter().map(|&id| pushes.get(id as usize) == Some(&true)).collect(),
                },
                offsets: std::mem::take(&mut layout.offsets),
                ids,
            },
            layers: std::mem::take(&mut layout.layers),
        })
    }
}
