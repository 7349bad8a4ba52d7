//! Combinations of signed distances: minimum and maximum of two, with rounded seams, and offsets of one.
//!
//! The rounded seam is the circular one of I. Quilez, "Smooth minimum" (2024): where the edges of two shapes cross at a
//! right angle it is an arc of exactly the radius. Beyond it the result is the sharp one.
use crate::ground::math::{max, min};
use crate::ground::simd;
use shibo_macros::choice;

/// An operation on one or two shapes.
#[choice]
pub enum Operation {
    /// The union of `a` and `b`; `radius` fills the corners between them.
    #[default]
    Union,
    /// The intersection of both; `radius` rounds the new edges.
    Intersection,
    /// `a` without `b`; `radius` rounds the new edges.
    Difference,
    /// `a` grown by `amount` mm, with round corners; shrunk if `amount` is negative.
    Offset,
    /// The outline of `a`, `amount` mm wide, half of it inside.
    Shell,
    /// `a`, repeated once per cell of `cell` mm.
    Repeat,
}

impl Operation {
    /// Returns whether the operation takes a second shape.
    pub const fn takes_two(self) -> bool {
        matches!(self, Self::Union | Self::Intersection | Self::Difference)
    }
}

/// The smaller of two distances, with a seam of `radius` mm.
#[inline(always)]
pub fn union(a: f32, b: f32, radius: f32) -> f32 {
    let sharp = min(a, b);
    if radius <= 0.0 {
        return sharp;
    }
    let h = max(radius - (a - b).abs(), 0.0) / radius;
    sharp - radius * 0.5 * (1.0 + h - (1.0 - h * (h - 2.0)).sqrt())
}

/// Fills `out` with the operation on `a` and, where it takes two, `b`.
///
/// # Panics
/// If the slices differ in length.
pub fn fill(operation: Operation, a: &[f32], b: &[f32], (radius, amount): (f32, f32), out: &mut [f32]) {
    assert!(a.len() == out.len() && (!operation.takes_two() || b.len() == a.len()), "distances for each pixel");
    simd::dispatch(
        #[inline(always)]
        || {
            let two = out.iter_mut().zip(a.iter().zip(b));
            match operation {
                Operation::Union => two.for_each(|(out, (a, b))| *out = union(*a, *b, radius)),
                Operation::Intersection => two.for_each(|(out, (a, b))| *out = -union(-*a, -*b, radius)),
                Operation::Difference => two.for_each(|(out, (a, b))| *out = -union(-*a, *b, radius)),
                Operation::Offset => out.iter_mut().zip(a).for_each(|(out, a)| *out = a - amount),
                Operation::Shell => out.iter_mut().zip(a).for_each(|(out, a)| *out = a.abs() - 0.5 * amount),
                Operation::Repeat => out.copy_from_slice(a),
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rounded_corner_is_an_arc_of_the_radius() {
        // Two half planes, x < 0 and y < 0: the edge of their union lies on a circle about (r, r).
        for radius in [0.5f32, 2.0] {
            for angle in [10.0f32, 30.0, 45.0, 62.0, 80.0] {
                let (sin, cos) = (angle.to_radians().sin(), angle.to_radians().cos());
                let (x, y) = (radius - radius * cos, radius - radius * sin);
                assert!(
                    union(x, y, radius).abs() < 2e-6 * radius.max(1.0),
                    "{radius} {angle}: {}",
                    union(x, y, radius)
                );
            }
            // Away from the corner nothing changes.
            assert_eq!(union(0.3, 0.3 + radius, radius), 0.3);
        }
    }

    #[test]
    fn combines_sets() {
        let (a, b) = ([-1.0, -1.0, 1.0, 1.0, -3.0], [-2.0, 2.0, -2.0, 2.0, 0.5]);
        let of = |operation, amount| {
            let mut out = [0.0; 5];
            fill(operation, &a, &b, (0.0, amount), &mut out);
            out
        };
        assert_eq!(of(Operation::Union, 0.0), [-2.0, -1.0, -2.0, 1.0, -3.0]);
        assert_eq!(of(Operation::Intersection, 0.0), [-1.0, 2.0, 1.0, 2.0, 0.5]);
        assert_eq!(of(Operation::Difference, 0.0), [2.0, -1.0, 2.0, 1.0, -0.5]);
        assert_eq!(of(Operation::Offset, 0.5), [-1.5, -1.5, 0.5, 0.5, -3.5]);
        assert_eq!(of(Operation::Shell, 2.0), [0.0, 0.0, 0.0, 0.0, 2.0]);
    }
}
