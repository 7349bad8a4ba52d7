//! Fields of directions on a mesh (rows C20, C21): drawn, given, or computed.
//!
//! Each vertex has a wished direction with a weight; the field between is as smooth as possible:
//! [`solver`](super::solver). For a field with 2- or 4-fold symmetry, the equivalent directions are chosen so that
//! neighbours fit where possible.
use super::comb::{comb, singular};
use super::connection::{Connection, angle, unit};
use super::solver::{Accuracy, System, dot};
use super::strokes::Surface;
use crate::ground::hash::Hash;
use crate::ground::stop::Until;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use shibo_macros::choice;
use shibo_value::{Frames, Mesh};
use std::sync::Arc;

/// One of the two principal directions.
#[choice]
pub enum Principal {
    /// Direction of the largest curvature.
    #[default]
    Max,
    /// Direction of the smallest curvature: along edges and folds.
    Min,
}

/// Wished directions.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// One direction, projected to the surface.
    Direction(DVec3),
    /// Around an axis: its direction, and a point on it.
    Around(DVec3, DVec3),
    /// Along lines on the surface; elsewhere in a direction, if `smooth` is given.
    Strokes(Vec<Vec<DVec3>>, DVec3),
    /// As smooth as possible.
    Smooth(Hash),
    /// Along a principal direction of curvature.
    Curvature(Principal),
}

/// Settings of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldSpec {
    /// Wished directions.
    pub wish: Wish,
    /// Length over which wishes are smoothed, in mm; 0 for the default of the wish.
    pub smooth: f64,
    /// Rotational symmetry: 1, 2 or 4.
    pub symmetry: u8,
    /// Angle of a final rotation, from t towards b.
    pub turn: f64,
    /// Size of features: the length of the vectors.
    pub length: f64,
}

/// Reasons why there is no field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// A point of a stroke is off the surface: index of the stroke and of the point, distance and tolerance in mm.
    Far(usize, usize, f64, f64),
    /// Stopped.
    Stopped,
}

/// A wish for each vertex: complex numbers of length 1, and their weights.
struct Wishes {
    wanted: Vec<DVec2>,
    weight: Vec<f64>,
}

/// Computes the field.
///
/// # Errors
/// Returns an error for strokes off the surface, or if stopped.
pub fn tangent_field(mesh: &Arc<Mesh>, spec: &FieldSpec, until: Until<'_>) -> Result<Frames, Fault> {
    let connection = Connection::new(mesh);
    let symmetry = match spec.wish {
        Wish::Curvature(_) => spec.symmetry.max(2),
        _ => spec.symmetry.max(1),
    };
    let n = f64::from(symmetry);
    let field = match &spec.wish {
        Wish::Smooth(hash) => smoothest(&connection, n, *hash, until),
        _ => {
            let (wishes, kept) = wishes(mesh, &connection, spec, n)?;
            follow(&connection, n, &wishes, (spec.smooth, kept), until)
        }
    };
    if until() {
        return Err(Fault::Stopped);
    }
    let angles: Vec<f64> = field.iter().map(|u| angle(*u)).collect();
    let singular = singular(mesh, &connection, &angles, n);
    let (angles, turns) = comb(mesh, &connection, angles, symmetry);
    // Seen from outside, b lies clockwise of t.
    let direction = |(plane, angle): (&super::connection::TangentPlane, &f64)| {
        (plane.direction(angle - spec.turn) * spec.length).as_vec3()
    };
    let t = connection.planes.iter().zip(&angles).map(direction).collect();
    Ok(Frames { mesh: Arc::clone(mesh), t, b: Vec::new(), symmetry, turns, singular })
}

/// Computes the wish of each vertex; and whether the weights already are those of the system.
fn wishes(mesh: &Mesh, connection: &Connection, spec: &FieldSpec, n: f64) -> Result<(Wishes, bool), Fault> {
    let of = |wish: &dyn Fn(usize) -> DVec3| {
        let flat = |(v, plane): (usize, &super::connection::TangentPlane)| {
            let flat = plane.flat(wish(v));
            (unit(n * angle(flat)), flat.length_squared())
        };
        let (wanted, weight) = connection.planes.iter().enumerate().map(flat).unzip();
        Wishes { wanted, weight }
    };
    let place = |v: usize| mesh.positions[v].as_dvec3();
    Ok(match &spec.wish {
        Wish::Direction(direction) => {
            let direction = direction.normalize_or(DVec3::Z);
            (of(&|_| direction), false)
        }
        Wish::Around(direction, axis) => {
            let direction = direction.normalize_or(DVec3::Z);
            (of(&|v| direction.cross(place(v) - *axis).normalize_or_zero()), false)
        }
        Wish::Strokes(strokes, direction) => {
            let drawn = drawn(mesh, connection, strokes, n)?;
            let direction = direction.normalize_or(DVec3::Z);
            (beside_strokes(connection, drawn, of(&|_| direction), spec.smooth), true)
        }
        Wish::Curvature(which) => (bent(mesh, connection, *which, n), false),
        Wish::Smooth(_) => (Wishes { wanted: Vec::new(), weight: Vec::new() }, false),
    })
}

/// Wishes of strokes: the directions of all their segments, at the corners of the triangles that they pass.
fn drawn(mesh: &Mesh, connection: &Connection, strokes: &[Vec<DVec3>], n: f64) -> Result<Wishes, Fault> {
    let surface = Surface::new(mesh, 2.0 * connection.edge);
    let [low, high] = mesh.bounds();
    let most = 0.05 * (high - low).max_element();
    let mut wanted = vec![DVec2::ZERO; connection.planes.len()];
    for (s, stroke) in strokes.iter().enumerate() {
        let mut points = Vec::with_capacity(stroke.len());
        for (k, point) in stroke.iter().enumerate() {
            let near = surface.nearest(*point, most).ok_or_else(|| {
                let far = surface.nearest(*point, f64::INFINITY).map_or(f64::INFINITY, |near| near.1.distance(*point));
                Fault::Far(s, k, far, most)
            })?;
            points.push(near.1);
        }
        for pair in points.windows(2) {
            let (along, length) = (pair[1] - pair[0], pair[0].distance(pair[1]));
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
            let pieces = ((2.0 * length / connection.edge).ceil() as usize).clamp(1, 100_000);
            for k in 0..=pieces {
                let at = pair[0] + along * (k as f64 / pieces as f64);
                let Some((triangle, _)) = surface.nearest(at, f64::INFINITY) else { continue };
                for vertex in mesh.triangles[triangle] {
                    let flat = connection.planes[vertex as usize].flat(along);
                    wanted[vertex as usize] += unit(n * angle(flat)) * flat.length();
                }
            }
        }
    }
    let weight = wanted.iter().map(|u| if u.length() > 0.0 { 1.0 } else { 0.0 }).collect();
    Ok(Wishes { wanted: wanted.iter().map(|u| u.normalize_or_zero()).collect(), weight })
}

/// Combines strokes, which hold strictly, with an optional direction elsewhere, over the length `smooth`. Components of
/// the surface without strokes follow the direction.
fn beside_strokes(connection: &Connection, drawn: Wishes, direction: Wishes, smooth: f64) -> Wishes {
    let pieces = connection.pieces();
    let mut has = vec![false; pieces.len()];
    for (v, piece) in pieces.iter().enumerate() {
        has[*piece as usize] |= drawn.weight[v] > 0.0;
    }
    let count = connection.planes.len();
    let total: f64 = connection.beside.iter().map(|b| b.weight).sum();
    let firm = 1e3 * total / count.max(1) as f64;
    let mut all = direction;
    for v in 0..count {
        let reach = if smooth > 0.0 { smooth } else { 2.0 * connection.edge };
        let pull = connection.areas[v] / (reach * reach);
        let loose = smooth <= 0.0 && has[pieces[v] as usize];
        all.weight[v] *= if loose { 0.0 } else { pull };
        if drawn.weight[v] > 0.0 {
            (all.wanted[v], all.weight[v]) = (drawn.wanted[v], firm);
        }
    }
    all
}

/// The field that follows wishes. `kept`: the weights already are those of the system.
fn follow(
    connection: &Connection,
    n: f64,
    wishes: &Wishes,
    (smooth, kept): (f64, bool),
    until: Until<'_>,
) -> Vec<DVec2> {
    let reach = if smooth > 0.0 { smooth } else { 2.0 * connection.edge };
    let pull: Vec<f64> = match kept {
        true => wishes.weight.clone(),
        false => wishes.weight.iter().zip(&connection.areas).map(|(m, area)| m * area / (reach * reach)).collect(),
    };
    let right: Vec<DVec2> = wishes.wanted.iter().zip(&pull).map(|(u, pull)| *u * *pull).collect();
    let mut field = wishes.wanted.clone();
    let accuracy = Accuracy { residual: 1e-8, rounds: 2000 };
    System::new(connection, n, &pull).solve(&right, &mut field, accuracy, until);
    field
}

/// The smoothest field, by inverse iteration from a hashed start.
fn smoothest(connection: &Connection, n: f64, hash: Hash, until: Until<'_>) -> Vec<DVec2> {
    let area: f64 = connection.areas.iter().sum();
    let pull: Vec<f64> = connection.areas.iter().map(|a| a / area.max(1e-300)).collect();
    let system = System::new(connection, n, &pull);
    let start = |v: usize| unit(std::f64::consts::TAU * hash.unit(v as u64));
    let mut field: Vec<DVec2> = (0..pull.len()).map(start).collect();
    for _ in 0..20 {
        let right: Vec<DVec2> = field.iter().zip(&connection.areas).map(|(u, a)| *u * *a).collect();
        system.solve(&right, &mut field, Accuracy { residual: 1e-5, rounds: 2000 }, until);
        if until() {
            break;
        }
        let size = (dot(&field, &field) / pull.len().max(1) as f64).sqrt().max(1e-300);
        field.iter_mut().for_each(|u| *u /= size);
    }
    field
}

/// The principal directions at each vertex, from the curvature towards its neighbours.
fn bent(mesh: &Mesh, connection: &Connection, which: Principal, n: f64) -> Wishes {
    let place = |v: usize| mesh.positions[v].as_dvec3();
    let at = |v: usize| -> (DVec2, f64) {
        let plane = &connection.planes[v];
        // Least squares for the curvature a·c² + 2b·cs + d·s² in the direction (c, s).
        let (mut m, mut right) = (glam::DMat3::ZERO, DVec3::ZERO);
        for beside in connection.beside(v) {
            let way = place(beside.vertex as usize) - place(v);
            let flat = plane.flat(way).normalize_or_zero();
            let bending = -2.0 * plane.axes[2].dot(way) / way.length_squared().max(1e-300);
            let row = DVec3::new(flat.x * flat.x, 2.0 * flat.x * flat.y, flat.y * flat.y);
            m += glam::DMat3::from_cols(row * row.x, row * row.y, row * row.z);
            right += row * bending;
        }
        if m.determinant().abs() < 1e-9 {
            return (DVec2::X, 0.0);
        }
        let [a, b, d] = (m.inverse() * right).to_array();
        let twice = DVec2::new(a - d, 2.0 * b);
        let (mean, half) = (0.5 * (a + d), 0.5 * twice.length());
        // The curvature with the larger magnitude: with a negative mean, it is the other one.
        let most = 0.5 * angle(twice) + if mean < 0.0 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let chosen = most + if which == Principal::Min { std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let sure = half * half / (half * half + mean * mean).max(1e-300);
        (unit(n * chosen), sure)
    };
    let (wanted, weight) = (0..connection.planes.len()).into_par_iter().with_min_len(256).map(at).unzip();
    Wishes { wanted, weight }
}

#[cfg(test)]
#[path = "field_tests.rs"]
mod tests;
