//! Springs between points of a surface, set in motion.
//!
//! A spring pulls along its chord by k(D - L); each end takes the part in the plane of its triangle. Points go straight over
//! the surface, and their velocities are carried along. On a plane this is the motion of `springs`. Cost: O(steps · links).
use super::slide::{flat, slide};
use crate::ground::stop::Until;
use glam::DVec3;
use rayon::prelude::*;
use shibo_engine::value::Atlas;

/// Springs of a net.
#[derive(Clone, Copy, Debug)]
pub struct Springs<'a> {
    /// The points at the ends of each.
    pub links: &'a [[u32; 2]],
    /// Their stiffness.
    pub stiffness: &'a [f64],
    /// Their lengths at rest in mm; may be negative.
    pub rest: &'a [f64],
    /// The force beyond which each breaks; empty if none can.
    pub limit: &'a [f64],
    /// For each point whether it stays; empty if all move.
    pub fixed: &'a [bool],
}

/// How they move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Length of a step.
    pub step: f64,
    /// How many steps.
    pub steps: u32,
    /// This factor times a point's speed is a force against it.
    pub drag: f64,
    /// This factor times the speed at which a spring grows is a force against it.
    pub damping: f64,
    /// Whether velocity advances before position; else position first, by the rule of the source.
    pub semi_implicit: bool,
    /// The longest way of a point in a step, in mm.
    pub farthest: f64,
}

/// Where points are.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The places in mm.
    pub places: Vec<DVec3>,
    /// The triangles that they are on.
    pub triangles: Vec<u32>,
    /// For each spring whether it broke.
    pub broken: Vec<bool>,
}

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// A point went too far in this step.
    Diverged(u32),
    /// The work was to stop.
    Cancelled,
}

/// The springs of each point, in rising order.
fn adjacency(links: &[[u32; 2]], points: usize) -> (Vec<usize>, Vec<(u32, u32)>) {
    let mut starts = vec![0; points + 1];
    for point in links.iter().flatten() {
        starts[*point as usize + 1] += 1;
    }
    for n in 0..points {
        starts[n + 1] += starts[n];
    }
    let mut next = starts.clone();
    let mut entries = vec![(0, 0); links.len() * 2];
    for (link, ends) in (0..).zip(links) {
        for (end, other) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            entries[next[end as usize]] = (link, other);
            next[end as usize] += 1;
        }
    }
    (starts, entries)
}

/// Sets springs in motion from rest.
///
/// # Errors
/// A motion that diverges, or that was cancelled.
pub fn simulate(
    atlas: &Atlas,
    (places, triangles): (&[DVec3], &[u32]),
    springs: &Springs<'_>,
    motion: &Motion,
    (until, progress): (Until<'_>, &mut dyn FnMut(u32)),
) -> Result<State, Stopped> {
    let (starts, entries) = adjacency(springs.links, places.len());
    let mut state =
        State { places: places.to_vec(), triangles: triangles.to_vec(), broken: vec![false; springs.links.len()] };
    let mut velocities = vec![DVec3::ZERO; places.len()];
    for step in 0..motion.steps {
        if until() {
            return Err(Stopped::Cancelled);
        }
        progress(step);
        snap(springs, &mut state);
        let (now, before) = (&state, &velocities);
        let advance = |point: usize| {
            let (at, velocity) = (now.places[point], before[point]);
            let triangle = now.triangles[point] as usize;
            if springs.fixed.get(point).is_some_and(|fixed| *fixed) {
                return Ok((at, now.triangles[point], DVec3::ZERO));
            }
            let mut force = DVec3::ZERO;
            for (link, other) in &entries[starts[point]..starts[point + 1]] {
                let (link, other) = (*link as usize, *other as usize);
                if now.broken[link] {
                    continue;
                }
                let chord = now.places[other] - at;
                let length = chord.length();
                if length > 0.0 {
                    let direction = chord / length;
                    let grows = (before[other] - velocity).dot(direction);
                    let pull = springs.stiffness[link] * (length - springs.rest[link]) + motion.damping * grows;
                    force += direction * pull;
                }
            }
            let a = flat(atlas, triangle, force) - velocity * motion.drag;
            let faster = velocity + a * motion.step;
            let way = match motion.semi_implicit {
                true => faster * motion.step,
                false => velocity * motion.step + a * (0.5 * motion.step * motion.step),
            };
            // Also refuses what is no number.
            if !(way.length() <= motion.farthest) {
                return Err(Stopped::Diverged(step));
            }
            let slid = slide(atlas, (triangle, at), way, faster);
            let velocity = if slid.ended { DVec3::ZERO } else { slid.carried };
            Ok((slid.place, u32::try_from(slid.triangle).unwrap_or(u32::MAX), velocity))
        };
        let moved: Vec<_> = (0..places.len()).into_par_iter().map(advance).collect::<Result<_, _>>()?;
        for (point, (place, triangle, velocity)) in moved.into_iter().enumerate() {
            (state.places[point], state.triangles[point], velocities[point]) = (place, triangle, velocity);
        }
    }
    Ok(state)
}

/// The force of each spring at the start, pushes included.
pub fn forces(places: &[DVec3], springs: &Springs<'_>) -> Vec<f64> {
    let of = |link: usize| force(places, springs, link);
    (0..springs.links.len()).map(of).collect()
}

fn force(places: &[DVec3], springs: &Springs<'_>, link: usize) -> f64 {
    let [a, b] = springs.links[link].map(|point| places[point as usize]);
    (springs.stiffness[link] * (a.distance(b) - springs.rest[link])).abs()
}

/// Breaks the springs whose force is beyond their limit.
fn snap(springs: &Springs<'_>, state: &mut State) {
    for (link, limit) in springs.limit.iter().enumerate() {
        if !state.broken[link] && force(&state.places, springs, link) > *limit {
            state.broken[link] = true;
        }
    }
}
