//! Shared by the nodes of trees: parameters, and error messages.
use glam::DVec3;
use shibo_kernel::wood::branch::Axis;
use shibo_kernel::wood::fit::{self, FitError};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Skeleton, Stop};

/// A vector in a graph file.
pub(super) type Triple = (f64, f64, f64);

/// Converts to a vector.
pub(super) const fn vector(v: Triple) -> DVec3 {
    DVec3::new(v.0, v.1, v.2)
}

/// The problem for nodes of a trunk that make no skeleton.
pub(super) fn problem(error: FitError, nodes: &[DVec3]) -> Problem {
    let at = |i: usize| nodes.get(i).map_or(DVec3::ZERO, |n| *n);
    let bad = |message: String| Problem::new(Code::BadValue, message);
    match error {
        FitError::TooFew => bad(format!("there are {} nodes; a trunk needs at least 2", nodes.len()))
            .help("give nodes from the ground up"),
        FitError::NotFinite(i) => {
            Problem::new(Code::NotFinite, format!("node {i} is not finite; all its numbers must be"))
        }
        FitError::Falls(i) => {
            let (below, z) = (at(i.saturating_sub(1)).z, at(i).z);
            bad(format!("node {i} is at height `{z}`; it must be above node {}, at `{below}`", i.saturating_sub(1)))
                .help("a trunk only rises: list its nodes from the ground up, each higher than the one before")
        }
        FitError::TangentFalls(i) => bad(format!("the curve does not rise at node {i}; it must rise everywhere"))
            .help("move the neighbours of this node so that heights are more even, or use `scheme: Local`"),
    }
}

/// The trunk with control points evenly spaced in z, as growth times need it.
pub(super) fn even(skeleton: &Skeleton, port: &str) -> Result<Vec<[DVec3; 4]>, Stop> {
    if skeleton.even {
        return Ok(skeleton.trunk.clone());
    }
    let nodes: Vec<DVec3> = skeleton.trunk.iter().map(|c| c[0]).chain(skeleton.trunk.last().map(|c| c[3])).collect();
    fit::equalize(&skeleton.trunk).map(|(even, _)| even).map_err(|e| problem(e, &nodes).at(port).into())
}

/// The branches in the form of the equations; they grow in length at the speed of the trunk.
pub(super) fn axes<R: shibo_kernel::ground::real::Real>(
    skeleton: &Skeleton,
    elongation: f64,
    ground: f64,
) -> Vec<Axis<R>> {
    let axis = |b: &shibo_value::Branch| {
        Axis::new(b.start, b.direction, b.length, (b.start.z - ground) / elongation, elongation, b.thickening)
    };
    skeleton.branches.iter().map(axis).collect()
}
