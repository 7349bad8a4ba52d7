//! Shared by the nodes of deposits: vectors in graphs, and their checks.
use glam::DVec3;
use shibo_kernel::ground::number::narrow;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Patch, Planes};

/// A vector in a graph file.
pub(super) type Triple = (f64, f64, f64);

/// Largest coordinate of a point in mm.
const FAR: f64 = 1e6;

/// Converts to a vector.
pub(super) const fn vector(v: Triple) -> DVec3 {
    DVec3::new(v.0, v.1, v.2)
}

/// The problem with a point of a parameter, if any.
pub(super) fn place(v: Triple, field: &str) -> Option<Problem> {
    let v = vector(v);
    if v.is_finite() && v.abs().max_element() <= FAR {
        return None;
    }
    let message = format!("{field} is ({}, {}, {}); each number must be from -1000000 to 1000000", v.x, v.y, v.z);
    Some(Problem::new(Code::OutOfRange, message).at(field))
}

/// The problem with a direction of a parameter, if any.
pub(super) fn direction(v: Triple, field: &str) -> Option<Problem> {
    let v = vector(v);
    if v.is_finite() && v.length() > 1e-9 && v.abs().max_element() <= FAR {
        return None;
    }
    let message = format!("{field} is ({}, {}, {}); it must be a vector that is not zero", v.x, v.y, v.z);
    Some(Problem::new(Code::BadValue, message).at(field).help("for example (0, 0, 1)"))
}

/// The points of a patch in double precision.
pub(super) fn points<'a>(patch: &Patch<'a>) -> impl Iterator<Item = DVec3> + use<'a> {
    let [x, y, z] = patch.place;
    x.iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z)))
}

/// The vectors of an input in double precision.
pub(super) fn vectors<'a>(planes: &Planes<'a>) -> impl Iterator<Item = DVec3> + use<'a> {
    let [x, y, z] = [0, 1, 2].map(|c| planes.plane(c));
    x.iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z)))
}

/// Stores the vector of point `i`.
pub(super) fn put(out: &mut [&mut [f32]], i: usize, v: DVec3) {
    for (plane, v) in out.iter_mut().zip(v.to_array()) {
        if let Some(out) = plane.get_mut(i) {
            *out = narrow(v);
        }
    }
}

/// The vectors of an exact input.
pub(super) fn exact_vectors(input: &[f64]) -> impl Iterator<Item = DVec3> + '_ {
    let n = input.len() / 3;
    (0..n).map(move |i| DVec3::new(input[i], input[n + i], input[2 * n + i]))
}

/// Vectors as planes, one after another.
pub(super) fn planes(vectors: &[DVec3]) -> Vec<f64> {
    (0..3).flat_map(|c| vectors.iter().map(move |v| v[c])).collect()
}
