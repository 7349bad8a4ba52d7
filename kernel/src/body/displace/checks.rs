//! Checks of a displaced surface: charts that do not fit together, folds, and undercuts.
use super::AT_ONCE;
use super::forest::Forest;
use super::relief::Relief;
use crate::ground::number::narrow;
use crate::ground::stop::Until;
use crate::mesh::rays::Rays;
use glam::DVec3;
use rayon::prelude::*;
use shibo_value::Mesh;

/// The share of samples of borders that may differ: at corners of charts, heights between texels are not exact.
const CORNERS: f64 = 0.01;

/// Differences between the heights of two charts, at samples of their borders.
#[derive(Clone, Copy, Default)]
struct Borders {
    samples: f64,
    /// Samples that differ by more than the error.
    over: f64,
    /// The largest difference in mm, and its place.
    worst: (f64, DVec3),
}

impl Borders {
    fn with(self, other: Self) -> Self {
        let worst = if other.worst.0 > self.worst.0 { other.worst } else { self.worst };
        Self { samples: self.samples + other.samples, over: self.over + other.over, worst }
    }

    /// Those of the edges of a triangle that lead to charts of triangles with a higher number.
    fn of(relief: &Relief<'_>, n: usize, error: f64) -> Self {
        let (atlas, mut borders) = (relief.atlas, Self::default());
        for k in 0..3 {
            let Some((other, its)) = atlas.across(n, k).filter(|(other, _)| *other > n && !atlas.is_inner(n, k)) else {
                continue;
            };
            let (from, to) = ((k + 1) % 3, (k + 2) % 3);
            let [own, beyond] = [n, other].map(|n| atlas.uvs[n].map(|uv| relief.in_texels(uv.as_dvec2())));
            let places = atlas.mesh.corners(n);
            let steps = own[from].distance(own[to]).ceil().max(2.0);
            let mut step = 0.5;
            while step < steps {
                let part = step / steps;
                let one = relief.at(own[from].lerp(own[to], part));
                let two = relief.at(beyond[(its + 2) % 3].lerp(beyond[(its + 1) % 3], part));
                let off: f64 = (one - two).abs();
                let over = f64::from(u8::from(off > error));
                borders = borders.with(Self { samples: 1.0, over, worst: (off, places[from].lerp(places[to], part)) });
                step += 1.0;
            }
        }
        borders
    }
}

/// The largest difference between the heights of two charts on their common border, in mm, and its place. `None` if
/// they differ by no more than the error, but for a few places.
pub(super) fn apart(relief: &Relief<'_>, error: f64) -> Option<(f64, DVec3)> {
    let of = |n: usize| Borders::of(relief, n, error);
    let all: Vec<Borders> = (0..relief.atlas.uvs.len()).into_par_iter().with_min_len(64).map(of).collect();
    let all = all.into_iter().fold(Borders::default(), Borders::with);
    (all.over > CORNERS * all.samples).then_some(all.worst)
}

/// The number of triangles that the relief turns over, in one direction or in both, and the place of the first.
pub(super) fn folded(forest: &Forest<'_>) -> Option<(usize, DVec3)> {
    let folds = |piece: usize| {
        let facet = forest.facet(piece);
        let up = facet.normal[0] + facet.normal[1] + facet.normal[2];
        let faces = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).dot(up);
        // A triangle that is turned in both directions faces outwards again, but all of its edges run backwards.
        let [before, after] = [facet.base, facet.at].map(|[a, b, c]| [b - a, c - b, a - c]);
        let is_reversed = before.iter().zip(after).all(|(before, after)| before.dot(after) < 0.0);
        faces(facet.base) > 0.0 && (faces(facet.at) < 0.0 || is_reversed)
    };
    let folded: Vec<usize> =
        (0..forest.pieces.len()).into_par_iter().with_min_len(1024).filter(|n| folds(*n)).collect();
    folded.first().map(|first| (folded.len(), forest.facet(*first).base[0]))
}

/// The parts of a surface that neither half of a mould lets go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hidden {
    /// Their share of the area.
    pub share: f64,
    /// The middle of the largest triangle among them, in mm.
    pub at: DVec3,
}

/// The triangles that are hidden from the side to which they face, along a direction of any length. `None` if there are
/// none, or if `until` returned true.
pub fn hidden(mesh: &Mesh, pull: DVec3, until: Until<'_>) -> Option<Hidden> {
    let (rays, [low, high]) = (Rays::new(mesh), mesh.bounds());
    let size = low.distance(high);
    // Places are rounded to `f32`.
    let above = 1e-6 * size.max(low.abs().max(high.abs()).max_element());
    let pull = pull.normalize_or_zero();
    let of = |n: usize| {
        let cross = mesh.cross(n);
        let normal = cross.normalize_or_zero();
        let side = if normal.dot(pull) < 0.0 { -pull } else { pull };
        let [a, b, c] = mesh.corners(n);
        let from = (a + b + c) / 3.0 + normal * above;
        !rays.escapes(from.as_vec3(), side.as_vec3(), narrow(2.0 * size))
    };
    let mut found: Vec<usize> = Vec::new();
    for from in (0..mesh.triangles.len()).step_by(AT_ONCE) {
        if until() {
            return None;
        }
        let some = (from..mesh.triangles.len().min(from + AT_ONCE)).into_par_iter();
        found.par_extend(some.with_min_len(256).filter(|n| of(*n)));
    }
    let area = |n: usize| 0.5 * mesh.cross(n).length();
    let largest = found.iter().copied().reduce(|best, n| if area(n) > area(best) { n } else { best })?;
    let [a, b, c] = mesh.corners(largest);
    Some(Hidden { share: found.iter().map(|n| area(*n)).sum::<f64>() / mesh.area(), at: (a + b + c) / 3.0 })
}
