//! Simulation of springs between points of a surface.
//!
//! A spring pulls along its chord by k(D - L); each end uses the component in the plane of its triangle. Points move
//! straight over the surface, and their velocities are transported. On a plane this is the motion of `springs`. Cost:
//! O(steps · links).
use super::slide::{flat, slide};
use crate::ground::stop::Until;
use glam::DVec3;
use rayon::prelude::*;
use shibo_value::Atlas;

/// Springs of a net.
#[derive(Clone, Copy, Debug)]
pub struct Springs<'a> {
    /// The end points of each spring.
    pub links: &'a [[u32; 2]],
    /// Stiffness of each spring.
    pub stiffness: &'a [f64],
    /// Rest length of each spring in mm; may be negative.
    pub rest: &'a [f64],
    /// Force beyond which each spring breaks; empty if none breaks.
    pub limit: &'a [f64],
    /// Marks of the points that stay; empty if all move.
    pub fixed: &'a [bool],
}

/// Settings of the simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetMotion {
    /// Length of a step.
    pub step: f64,
    /// Number of steps.
    pub steps: u32,
    /// Drag: force against a point's motion per unit of its speed.
    pub drag: f64,
    /// Damping: force against a spring's change of length per unit of its speed.
    pub damping: f64,
    /// True if velocity advances before position; false: position first, as in the source.
    pub semi_implicit: bool,
    /// Maximum distance that a point may move in a step, in mm.
    pub farthest: f64,
}

/// State of the points and springs.
#[derive(Clone, Debug, PartialEq)]
pub struct NetState {
    /// Positions in mm.
    pub places: Vec<DVec3>,
    /// The triangle under each point.
    pub triangles: Vec<u32>,
    /// Marks of the broken springs.
    pub broken: Vec<bool>,
}

/// Reasons why there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// A point moved too far in this step.
    Diverged(u32),
    /// Cancelled.
    Cancelled,
}

/// The springs of each point, in ascending order.
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

/// Simulates springs that start at rest.
///
/// # Errors
/// Returns an error if the motion diverges or is cancelled.
pub fn simulate(
    atlas: &Atlas,
    (places, triangles): (&[DVec3], &[u32]),
    springs: &Springs<'_>,
    motion: &NetMotion,
    (until, progress): (Until<'_>, &mut dyn FnMut(u32)),
) -> Result<NetState, Stopped> {
    let (starts, entries) = adjacency(springs.links, places.len());
    let mut state =
        NetState { places: places.to_vec(), triangles: triangles.to_vec(), broken: vec![false; springs.links.len()] };
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
            if way.length() > motion.farthest || !way.is_finite() {
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

/// Force of each spring at the start, including pushes.
pub fn forces(places: &[DVec3], springs: &Springs<'_>) -> Vec<f64> {
    let of = |link: usize| force(places, springs, link);
    (0..springs.links.len()).map(of).collect()
}

fn force(places: &[DVec3], springs: &Springs<'_>, link: usize) -> f64 {
    let [a, b] = springs.links[link].map(|point| places[point as usize]);
    (springs.stiffness[link] * (a.distance(b) - springs.rest[link])).abs()
}

/// Breaks the springs whose force exceeds their limit.
fn snap(springs: &Springs<'_>, state: &mut NetState) {
    for (link, limit) in springs.limit.iter().enumerate() {
        if !state.broken[link] && force(&state.places, springs, link) > *limit {
            state.broken[link] = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::ground::stop::NEVER;
    use crate::mesh::fixture::{plane, sphere};
    use crate::mesh::links::Points;
    use crate::mesh::sow::{normal, sow};
    use glam::Vec3;

    fn net(atlas: &Atlas, pitch: f64) -> (Vec<DVec3>, Vec<u32>, Vec<Vec3>, Vec<[u32; 2]>) {
        let sown = sow((&atlas.mesh, &atlas.smooth), pitch, &|_, _| 1.0, Hash::new(1), NEVER);
        let places: Vec<DVec3> = sown.iter().map(|s| s.place).collect();
        let normals: Vec<Vec3> = sown.iter().map(|s| normal(&atlas.mesh, &atlas.smooth, s)).collect();
        let links = Points { places: &places, normals: &normals }.delaunay(2.5 * pitch);
        (places, sown.iter().map(|s| s.triangle).collect(), normals, links)
    }

    fn motion(semi_implicit: bool) -> NetMotion {
        NetMotion { step: 0.1, steps: 40, drag: 3.0, damping: 0.2, semi_implicit, farthest: 2.0 }
    }

    /// Compares with springs computed in two dimensions; the cuts of the atlas have no effect.
    #[test]
    fn matches_planar_motion_on_a_plane() {
        let mut results = Vec::new();
        for name in ["plane_one", "plane_cut"] {
            let atlas = plane(name);
            let (places, triangles, _, links) = net(&atlas, 5.0);
            let [low, high] = atlas.mesh.bounds();
            let fixed: Vec<bool> = places
                .iter()
                .map(|p| (*p - low).truncate().min_element().min((high - *p).truncate().min_element()) < 5.0)
                .collect();
            let stiffness: Vec<f64> = (0..links.len() as u64).map(|n| 0.5 + Hash::new(2).with(n).unit(0)).collect();
            let rest: Vec<f64> = (0..links.len() as u64).map(|n| 3.0 * Hash::new(2).with(n).unit(1)).collect();
            for semi_implicit in [true, false] {
                let springs = Springs { links: &links, stiffness: &stiffness, rest: &rest, limit: &[], fixed: &fixed };
                let motion = motion(semi_implicit);
                let state = simulate(&atlas, (&places, &triangles), &springs, &motion, (NEVER, &mut |_| ())).unwrap();
                let mut x = places.clone();
                let mut v = vec![DVec3::ZERO; x.len()];
                for _ in 0..motion.steps {
                    let mut force = vec![DVec3::ZERO; x.len()];
                    for (n, [a, b]) in links.iter().enumerate() {
                        let [a, b] = [*a as usize, *b as usize];
                        let (d, grows) = (x[b] - x[a], v[b] - v[a]);
                        let along = d.normalize();
                        let f = along * (stiffness[n] * (d.length() - rest[n]) + motion.damping * grows.dot(along));
                        force[a] += f;
                        force[b] -= f;
                    }
                    for p in (0..x.len()).filter(|p| !fixed[*p]) {
                        let a = force[p] - v[p] * motion.drag;
                        let faster = v[p] + a * motion.step;
                        x[p] += if semi_implicit {
                            faster * motion.step
                        } else {
                            v[p] * motion.step + a * (0.5 * motion.step * motion.step)
                        };
                        v[p] = faster;
                    }
                }
                let farthest = x.iter().zip(&state.places).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
                let moved = x.iter().zip(&places).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
                assert!(farthest < 1e-5 && moved > 0.5, "{name}: {farthest} of {moved}");
                results.push(state.places);
            }
        }
    }

    #[test]
    fn points_stay_on_a_ball_and_springs_break() {
        let atlas = sphere();
        let (places, triangles, _, links) = net(&atlas, 4.0);
        assert!((5.5..6.05).contains(&(2.0 * links.len() as f64 / places.len() as f64)));
        let (stiffness, rest) = (vec![1.0; links.len()], vec![0.0; links.len()]);
        let forces =
            forces(&places, &Springs { links: &links, stiffness: &stiffness, rest: &rest, limit: &[], fixed: &[] });
        let mut sorted = forces.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = vec![sorted[sorted.len() * 9 / 10]; links.len()];
        let springs = Springs { links: &links, stiffness: &stiffness, rest: &rest, limit: &limit, fixed: &[] };
        let state = simulate(&atlas, (&places, &triangles), &springs, &motion(true), (NEVER, &mut |_| ())).unwrap();
        for (place, triangle) in state.places.iter().zip(&state.triangles) {
            let [corner, ..] = atlas.mesh.corners(*triangle as usize);
            let off = (*place - corner).dot(atlas.mesh.cross(*triangle as usize).normalize());
            assert!(off.abs() < 1e-4, "{off}");
        }
        for (force, broken) in forces.iter().zip(&state.broken) {
            assert!(*broken || *force <= limit[0]);
        }
        // More than half a pitch per step is rejected.
        let wild = NetMotion { step: 10.0, ..motion(false) };
        let stopped = simulate(&atlas, (&places, &triangles), &springs, &wild, (NEVER, &mut |_| ()));
        assert!(matches!(stopped, Err(Stopped::Diverged(_))));
    }

    #[test]
    fn strews_points_evenly_independent_of_charts() {
        let (one, cut) = (plane("plane_one"), plane("plane_cut"));
        let (places, _, _, links) = net(&one, 4.0);
        for (n, a) in places.iter().enumerate() {
            assert!(places[..n].iter().all(|b| a.distance(*b) >= 0.8 * 4.0));
        }
        let mean = links.iter().map(|l| places[l[0] as usize].distance(places[l[1] as usize])).sum::<f64>()
            / links.len() as f64;
        assert!((0.9..1.2).contains(&(mean / 4.0)), "{mean}");
        assert_eq!(places, net(&cut, 4.0).0);
    }
}
