//! How a cut lies in space at a point of a patch of whole quads.
use shibo_engine::value::Patch;

/// Directions of length 1: to the right on the canvas, down on it, and out of it towards who looks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) right: [f32; 3],
    pub(super) down: [f32; 3],
    pub(super) normal: [f32; 3],
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: [f32; 3]) -> Option<[f32; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-12).then(|| v.map(|c| c / length))
}

/// The frame at point `i`; `None` for single points, which lie on no surface.
pub(super) fn frame(patch: &Patch<'_>, i: usize) -> Option<Frame> {
    if patch.pixel <= 0.0 {
        return None;
    }
    let n = patch.columns;
    let corner = ((i / n) & !1) * n + ((i % n) & !1);
    let step = |to: usize| patch.place.map(|axis| axis[to] - axis[corner]);
    let right = unit(step(corner + 1))?;
    let down = step(corner + n);
    // y points down on the canvas, so right × down points away.
    let normal = unit(cross(down, right))?;
    Some(Frame { right, down: cross(right, normal), normal })
}
