//! How a cut lies in space at the points of a block.
use shibo_engine::value::Patch;

/// Directions of length 1: to the right on the canvas, down on it, and out of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) right: [f32; 3],
    pub(super) down: [f32; 3],
    pub(super) normal: [f32; 3],
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: [f32; 3]) -> Option<[f32; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-12).then(|| v.map(|c| c / length))
}

impl Frame {
    /// From vectors to the right and down; `None` if they span no plane.
    fn new(right: [f32; 3], down: [f32; 3]) -> Option<Self> {
        let right = unit(right)?;
        // y points down on the canvas, so right × down points away.
        let normal = unit(cross(down, right))?;
        Some(Self { right, down: cross(right, normal), normal })
    }
}

/// Calls `body(from, to, frame)` for the points of a block of whole quads that have the same frame: for all points of a
/// plane, and elsewhere for the rows of each quad. Single points lie on no surface and have no frame.
#[inline(always)]
pub(super) fn frames(patch: &Patch<'_>, mut body: impl FnMut(usize, usize, Option<&Frame>)) {
    if let Some([right, down]) = patch.flat {
        return body(0, patch.len(), Frame::new(right, down).as_ref());
    }
    if patch.pixel <= 0.0 {
        return body(0, patch.len(), None);
    }
    let n = patch.columns;
    for row in (0..patch.rows).step_by(2) {
        for corner in (row * n..row * n + n).step_by(2) {
            let step = |to: usize| patch.place.map(|axis| axis[to] - axis[corner]);
            let frame = Frame::new(step(corner + 1), step(corner + n));
            body(corner, corner + 2, frame.as_ref());
            body(corner + n, corner + n + 2, frame.as_ref());
        }
    }
}
