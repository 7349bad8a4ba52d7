//! Curves through the nodes of a trunk, evenly spaced in height (Momoi & Takatera 2014, §3.2 and §3.4, eqs 4–8).
//!
//! Eq (4) is used with C1 = (7 C0 + 6 C3 - C6) / 12; the printed weights have a wrong sign and do not sum up to 1.
use glam::DVec3;

/// The curve through nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// The natural cubic spline with unit knots: C2. Through three nodes it is eq (4).
    #[default]
    Natural,
    /// Eq (4) on overlapping triples: C1, a node changes only the segments next to it.
    Local,
}

/// Reasons why nodes make no skeleton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FitError {
    /// Fewer than two nodes.
    TooFew,
    /// A number is not finite, at this node.
    NotFinite(usize),
    /// This node is not above the one before it.
    Falls(usize),
    /// The curve does not rise at this node.
    TangentFalls(usize),
}

/// Rejects nodes that do not rise.
///
/// # Errors
/// Returns the first node at fault.
pub fn check_nodes(nodes: &[DVec3]) -> Result<(), FitError> {
    if let Some(i) = nodes.iter().position(|n| !n.is_finite()) {
        return Err(FitError::NotFinite(i));
    }
    if nodes.len() < 2 {
        return Err(FitError::TooFew);
    }
    match nodes.windows(2).position(|pair| pair[1].z <= pair[0].z) {
        Some(i) => Err(FitError::Falls(i + 1)),
        None => Ok(()),
    }
}

/// The control points of a smooth curve through `nodes`, four for each segment (eq 4, extended to more than three
/// nodes).
///
/// # Errors
/// As [`check_nodes`].
pub fn fit(nodes: &[DVec3], scheme: Scheme) -> Result<Vec<[DVec3; 4]>, FitError> {
    check_nodes(nodes)?;
    let tangents = match (scheme, nodes.len()) {
        (_, 2) => vec![nodes[1] - nodes[0]; 2],
        (Scheme::Natural, _) => natural(nodes),
        (Scheme::Local, _) => local(nodes),
    };
    let segment = |i: usize| {
        let (a, b) = (nodes[i], nodes[i + 1]);
        [a, a + tangents[i] / 3.0, b - tangents[i + 1] / 3.0, b]
    };
    Ok((0..nodes.len() - 1).map(segment).collect())
}

/// Derivatives of the natural spline at its knots: `2 m0 + m1 = 3 (N1 - N0)`, `m[i-1] + 4 m[i] + m[i+1] = 3 (N[i+1] -
/// N[i-1])`, and the mirror of the first at the end, solved by elimination.
fn natural(nodes: &[DVec3]) -> Vec<DVec3> {
    let n = nodes.len();
    let right = |i: usize| 3.0 * (nodes[(i + 1).min(n - 1)] - nodes[i.saturating_sub(1)]);
    let (mut upper, mut m) = (vec![0.0; n], vec![DVec3::ZERO; n]);
    for i in 0..n {
        let diagonal = if i == 0 || i == n - 1 { 2.0 } else { 4.0 };
        let (before, so_far) = if i == 0 { (0.0, DVec3::ZERO) } else { (upper[i - 1], m[i - 1]) };
        let pivot = diagonal - before;
        upper[i] = 1.0 / pivot;
        m[i] = (right(i) - so_far) / pivot;
    }
    for i in (0..n - 1).rev() {
        let after = m[i + 1];
        m[i] -= upper[i] * after;
    }
    m
}

/// Half the difference of the neighbours inside; at the ends as in eq (4) for the first and last triple.
fn local(nodes: &[DVec3]) -> Vec<DVec3> {
    let n = nodes.len();
    let mut m: Vec<DVec3> = (0..n).map(|i| 0.5 * (nodes[(i + 1).min(n - 1)] - nodes[i.saturating_sub(1)])).collect();
    // C1 - C0 = (7 C0 + 6 C3 - C6) / 12 - C0, and its mirror.
    m[0] = 3.0 * ((7.0 * nodes[0] + 6.0 * nodes[1] - nodes[2]) / 12.0 - nodes[0]);
    m[n - 1] = 3.0 * (nodes[n - 1] - (7.0 * nodes[n - 1] + 6.0 * nodes[n - 2] - nodes[n - 3]) / 12.0);
    m
}

/// Moves the inner control points of every segment along the end tangents until the four heights are evenly spaced (eqs
/// 5–8). Also returns the largest shift in mm.
///
/// # Errors
/// Returns the first node at which the curve does not rise, or whose height is not above that of the node before.
pub fn equalize(trunk: &[[DVec3; 4]]) -> Result<(Vec<[DVec3; 4]>, f64), FitError> {
    let mut shift = 0.0_f64;
    let mut even = Vec::with_capacity(trunk.len());
    for (i, &[c0, c1, c2, c3]) in trunk.iter().enumerate() {
        let third = (c3.z - c0.z) / 3.0;
        if third.is_nan() || third <= 0.0 {
            return Err(FitError::Falls(i + 1));
        }
        let (start, end) = (c1 - c0, c3 - c2);
        if start.z <= 0.0 {
            return Err(FitError::TangentFalls(i));
        }
        if end.z <= 0.0 {
            return Err(FitError::TangentFalls(i + 1));
        }
        let (mut d1, mut d2) = (c0 + start * (third / start.z), c3 - end * (third / end.z));
        // Evenly spaced by construction; set exactly, against rounding errors.
        (d1.z, d2.z) = (c0.z + third, c3.z - third);
        shift = shift.max(d1.distance(c1)).max(d2.distance(c2));
        even.push([c0, d1, d2, c3]);
    }
    Ok((even, shift))
}

/// The point of an even trunk at height `z`; beyond its ends on the extended tangents, which the source leaves open.
pub fn point_at(trunk: &[[DVec3; 4]], z: f64) -> DVec3 {
    let i = trunk.partition_point(|c| c[3].z <= z).min(trunk.len().saturating_sub(1));
    let Some(&[c0, c1, c2, c3]) = trunk.get(i) else { return DVec3::new(0.0, 0.0, z) };
    let t = (z - c0.z) / (c3.z - c0.z);
    let mut point = if t < 0.0 {
        c0 + 3.0 * (c1 - c0) * t
    } else if t > 1.0 {
        c3 + 3.0 * (c3 - c2) * (t - 1.0)
    } else {
        let s = 1.0 - t;
        c0 * (s * s * s) + c1 * (3.0 * s * s * t) + c2 * (3.0 * s * t * t) + c3 * (t * t * t)
    };
    point.z = z;
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rising() -> impl Strategy<Value = Vec<DVec3>> {
        let node = (-8.0..8.0f64, -8.0..8.0f64, 8.0..14.0f64);
        prop::collection::vec(node, 2..12).prop_map(|steps| {
            let mut z = 0.0;
            let next = |(x, y, dz)| {
                z += dz;
                DVec3::new(x, y, z)
            };
            steps.into_iter().map(next).collect()
        })
    }

    /// First and second derivative of a segment at its start and end.
    fn ends(c: &[DVec3; 4]) -> [[DVec3; 2]; 2] {
        let first = [3.0 * (c[1] - c[0]), 3.0 * (c[3] - c[2])];
        let second = [6.0 * (c[0] - 2.0 * c[1] + c[2]), 6.0 * (c[1] - 2.0 * c[2] + c[3])];
        [[first[0], second[0]], [first[1], second[1]]]
    }

    proptest! {
        #[test]
        fn natural_is_c2_and_stays_c1(nodes in rising()) {
            let raw = fit(&nodes, Scheme::Natural).unwrap();
            for pair in raw.windows(2) {
                let ([_, a], [b, _]) = (ends(&pair[0]), ends(&pair[1]));
                prop_assert!(a[0].distance(b[0]) < 1e-9 && a[1].distance(b[1]) < 1e-8);
            }
            let (even, _) = equalize(&raw).unwrap();
            for pair in even.windows(2) {
                let slope = |v: DVec3| (v / v.z).truncate();
                prop_assert!(slope(pair[0][3] - pair[0][2]).distance(slope(pair[1][1] - pair[1][0])) < 1e-9);
            }
            for c in &even {
                let third = (c[3].z - c[0].z) / 3.0;
                prop_assert!((c[1].z - c[0].z - third).abs() < 1e-9 && (c[3].z - c[2].z - third).abs() < 1e-9);
            }
        }

        #[test]
        fn local_edits_stay_local(nodes in rising(), dx in -3.0..3.0f64) {
            prop_assume!(nodes.len() >= 8);
            let before = fit(&nodes, Scheme::Local).unwrap();
            let mut moved = nodes.clone();
            moved[0].x += dx;
            let after = fit(&moved, Scheme::Local).unwrap();
            prop_assert_eq!(&before[3..], &after[3..]);
        }
    }

    #[test]
    fn reports_faulty_nodes() {
        let at = |z: f64| DVec3::new(0.0, 0.0, z);
        assert_eq!(fit(&[at(0.0)], Scheme::Natural), Err(FitError::TooFew));
        assert_eq!(fit(&[at(0.0), at(5.0), at(4.0)], Scheme::Natural), Err(FitError::Falls(2)));
        assert_eq!(fit(&[at(0.0), at(f64::NAN)], Scheme::Natural), Err(FitError::NotFinite(1)));
        let steep = [at(0.0), DVec3::new(1.0, 0.0, 1.0), at(6.2)];
        assert_eq!(equalize(&fit(&steep, Scheme::Natural).unwrap()).unwrap_err(), FitError::TangentFalls(0));
    }
}
