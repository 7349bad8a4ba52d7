//! Springs that break while their rest lengths shrink, and points that come off the substrate.
//!
//! A link has the stiffness border / length, along its direction and across it; only its strain along its direction
//! breaks it. The net is linear, so `u` holds the displacements for a shrinkage of 1, and those at another shrinkage
//! are multiples of them. Each break relaxes the points around it alone: a queue, with over-relaxation.
use super::net::Net;
use crate::ground::hash::Hash;
use crate::ground::number::index_u32;
use crate::ground::stop::Until;
use glam::DVec2;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// Over-relaxation.
const OVER: f64 = 1.55;

/// Largest residual of a point at rest, as a share of the force of a link.
const REST: f64 = 0.02;

/// Share of the substrate's stiffness that holds a point that has come off.
const LOOSE: f64 = 1e-3;

/// How a layer breaks.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// The square root of E / k, mm.
    pub scale: f64,
    /// The final shrinkage, as a multiple of the one at which an even layer breaks.
    pub shrink: f64,
    /// Largest share by which the limits of links differ.
    pub noise: f64,
    /// Share by which the stress along `Local::along` is less than across it, 0..1.
    pub anisotropy: f64,
}

/// The properties of a layer at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Thickness, as a multiple of the usual one.
    pub thickness: f64,
    /// Strength, likewise.
    pub strength: f64,
    /// The stress on the substrate at which the layer comes off.
    pub adhesion: f64,
    /// Unit vector along which cracks run if stress is anisotropic.
    pub along: DVec2,
}

impl Default for Local {
    fn default() -> Self {
        Self { thickness: 1.0, strength: 1.0, adhesion: f64::INFINITY, along: DVec2::X }
    }
}

#[derive(Clone, Copy, Debug)]
struct Spring {
    stiffness: f64,
    /// Force on the first point for a shrinkage of 1.
    pull: DVec2,
    /// Unit vector from the first to the second point, divided by the length.
    share: DVec2,
    /// Strain of the spring for a shrinkage of 1 while no point moves.
    strain: f64,
    limit: f64,
}

/// A layer that broke.
#[derive(Clone, Debug)]
pub struct Break {
    /// The final shrinkage.
    pub shrink: f64,
    /// For each link its number in the order of breaking; `u32::MAX` if it is whole.
    pub order: Vec<u32>,
    /// Number of broken links.
    pub count: u32,
    /// Displacement of each point for a shrinkage of 1.
    pub moved: Vec<DVec2>,
    /// Opening of each broken link at the end, for a limit of strain of 1, mm.
    pub opening: Vec<f64>,
    /// True for points that have come off the substrate.
    pub loose: Vec<bool>,
}

/// The way from a point to another.
#[derive(Clone, Copy)]
struct Arm {
    to: u32,
    stiffness: f64,
}

struct State<'n> {
    net: &'n Net,
    springs: Vec<Spring>,
    /// In the order of `Net::halves`.
    arms: Vec<Arm>,
    /// Force of whole links on each point for a shrinkage of 1.
    pull: Vec<DVec2>,
    /// Stiffness of the substrate at each point.
    held: Vec<f64>,
    /// Sum of all stiffnesses at each point.
    total: Vec<f64>,
    u: Vec<DVec2>,
    rest: f64,
    queue: VecDeque<u32>,
    waits: Vec<bool>,
    moved: Vec<u32>,
    has_moved: Vec<bool>,
}

impl<'n> State<'n> {
    fn new(net: &'n Net, local: &[Local], law: &Law, hash: Hash) -> Self {
        let spring = |(l, link): (usize, &super::net::Link)| {
            let [a, b] = link.ends.map(|end| local[end as usize]);
            let length = link.along.length().max(1e-12);
            let thickness = 0.5 * (a.thickness + b.thickness);
            let stiffness = thickness * link.border / length;
            let shrunk = |local: Local| link.along - local.along * (law.anisotropy * local.along.dot(link.along));
            let rest = 0.5 * (shrunk(a) + shrunk(b));
            let share = link.along / (length * length);
            let noise = 1.0 + law.noise * (2.0 * hash.with(2).unit(l as u64) - 1.0);
            let limit = 0.5 * (a.strength + b.strength) * noise;
            Spring { stiffness, pull: rest * stiffness, share, strain: rest.dot(share), limit }
        };
        let springs: Vec<Spring> = net.links.iter().enumerate().map(spring).collect();
        let held: Vec<f64> = net.area.iter().map(|area| area / (law.scale * law.scale)).collect();
        let force: f64 = springs.iter().map(|spring| spring.pull.length()).sum();
        let count = net.sites.len();
        let arms = net.halves.iter().map(|half| Arm { to: net.end(*half), stiffness: 0.0 }).collect();
        let mut state = Self {
            net,
            rest: REST * force / springs.len().max(1) as f64,
            springs,
            arms,
            pull: vec![DVec2::ZERO; count],
            held,
            total: vec![0.0; count],
            u: vec![DVec2::ZERO; count],
            queue: VecDeque::new(),
            waits: vec![false; count],
            moved: Vec::new(),
            has_moved: vec![false; count],
        };
        for site in 0..index_u32(count) {
            state.renew(site, &|_| true);
            state.push(site);
        }
        state
    }

    /// Adds up the stiffnesses and forces of the whole links at a point.
    fn renew(&mut self, site: u32, whole: &dyn Fn(usize) -> bool) {
        let at = site as usize;
        let (mut pull, mut total) = (DVec2::ZERO, self.held[at]);
        for n in self.net.starts[at]..self.net.starts[at + 1] {
            let half = self.net.halves[n];
            let (link, to) = (half as usize / 2, self.arms[n].to);
            let spring = &self.springs[link];
            let stiffness = if whole(link) && to != site { spring.stiffness } else { 0.0 };
            if stiffness > 0.0 {
                pull += if half.is_multiple_of(2) { spring.pull } else { -spring.pull };
                total += stiffness;
            }
            self.arms[n].stiffness = stiffness;
        }
        (self.pull[at], self.total[at]) = (pull, total);
    }

    fn push(&mut self, site: u32) {
        if !std::mem::replace(&mut self.waits[site as usize], true) {
            self.queue.push_back(site);
        }
    }

    /// Moves points until all are at rest. Points that moved are added to `moved`.
    fn relax(&mut self) {
        let mut most = 1_000_000 + 200 * self.u.len();
        while let Some(site) = self.queue.pop_front() {
            let at = site as usize;
            self.waits[at] = false;
            let range = self.net.starts[at]..self.net.starts[at + 1];
            let mut force = self.pull[at] - self.u[at] * self.total[at];
            for arm in &self.arms[range.clone()] {
                force += self.u[arm.to as usize] * arm.stiffness;
            }
            if force.length_squared() <= self.rest * self.rest || most == 0 {
                continue;
            }
            most -= 1;
            self.u[at] += force * (OVER / self.total[at].max(1e-12));
            if !std::mem::replace(&mut self.has_moved[at], true) {
                self.moved.push(site);
            }
            self.push(site);
            for n in range {
                if self.arms[n].stiffness > 0.0 {
                    self.push(self.arms[n].to);
                }
            }
        }
    }

    /// Strain of a link for a shrinkage of 1.
    fn strain(&self, link: usize) -> f64 {
        let ([a, b], spring) = (self.net.links[link].ends, &self.springs[link]);
        spring.strain + (self.u[b as usize] - self.u[a as usize]).dot(spring.share)
    }

    /// The shrinkage at which a link breaks.
    fn key(&self, link: usize) -> f64 {
        let strain = self.strain(link);
        if strain > 1e-9 { self.springs[link].limit / strain } else { f64::INFINITY }
    }
}

impl Break {
    /// Shrinks a net to the end; `None` if stopped.
    pub fn new(net: &Net, local: &[Local], law: &Law, hash: Hash, until: Until<'_>) -> Option<Self> {
        let mut state = State::new(net, local, law, hash);
        state.relax();
        clear(&mut state);
        let mut order = vec![u32::MAX; net.links.len()];
        // Keys of links, and the heap; an entry counts if it still has the key of its link.
        let mut keys: Vec<f64> = (0..net.links.len()).map(|l| state.key(l)).collect();
        let entry = |link: usize, key: f64| Reverse((key.to_bits(), index_u32(link)));
        let within = |key: f64| key <= law.shrink;
        let all = |keys: &[f64], order: &[u32]| -> BinaryHeap<_> {
            let open = |(l, key): &(usize, &f64)| within(**key) && order[*l] == u32::MAX;
            keys.iter().enumerate().filter(open).map(|(l, key)| entry(l, *key)).collect()
        };
        let mut heap = all(&keys, &order);
        let mut count = 0;
        while let Some(Reverse((bits, link))) = heap.pop() {
            let link = link as usize;
            if order[link] != u32::MAX || keys[link].to_bits() != bits {
                continue;
            }
            order[link] = count;
            count += 1;
            if count.is_multiple_of(16) && until() {
                return None;
            }
            for end in net.links[link].ends {
                state.renew(end, &|l| order[l] == u32::MAX);
                state.push(end);
            }
            state.relax();
            for n in 0..state.moved.len() {
                let site = state.moved[n] as usize;
                for half in net.from(site) {
                    let link = *half as usize / 2;
                    if order[link] != u32::MAX {
                        continue;
                    }
                    let key = state.key(link);
                    if key.to_bits() != keys[link].to_bits() {
                        keys[link] = key;
                        if within(key) {
                            heap.push(entry(link, key));
                        }
                    }
                }
            }
            clear(&mut state);
            if heap.len() > 4 * net.links.len() + 1024 {
                heap = all(&keys, &order);
            }
        }
        let loose = peel(&mut state, local, law, &order, until)?;
        let opening = (0..net.links.len())
            .map(|l| {
                let length = net.links[l].along.length();
                if order[l] == u32::MAX { 0.0 } else { (law.shrink * state.strain(l) * length).max(0.0) }
            })
            .collect();
        Some(Self { shrink: law.shrink, order, count, moved: state.u, opening, loose })
    }
}

fn clear(state: &mut State<'_>) {
    for site in std::mem::take(&mut state.moved) {
        state.has_moved[site as usize] = false;
    }
}

/// Takes points off the substrate, from cracks inwards, where it would have to hold more than it can.
fn peel(state: &mut State<'_>, local: &[Local], law: &Law, order: &[u32], until: Until<'_>) -> Option<Vec<bool>> {
    let net = state.net;
    let mut loose = vec![false; net.sites.len()];
    loop {
        if until() {
            return None;
        }
        let comes_off = |site: usize| {
            let stress = law.shrink * state.u[site].length() / law.scale;
            let free = |half: &u32| order[*half as usize / 2] != u32::MAX || loose[net.end(*half) as usize];
            !loose[site] && stress > local[site].adhesion && net.from(site).iter().any(free)
        };
        let off: Vec<u32> = (0..index_u32(loose.len())).filter(|site| comes_off(*site as usize)).collect();
        if off.is_empty() {
            return Some(loose);
        }
        for site in off {
            loose[site as usize] = true;
            state.held[site as usize] *= LOOSE;
            state.renew(site, &|l| order[l] == u32::MAX);
            state.push(site);
        }
        state.relax();
        clear(state);
    }
}
