//! Orientation of a cut in space at the points of a block.
use shibo_kernel::wood::solids::neighbors;
use shibo_value::{Patch, PatchPieces, PieceAxes};

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
    /// A frame from vectors to the right and down; `None` if they span no plane.
    fn new(right: [f32; 3], down: [f32; 3]) -> Option<Self> {
        let right = unit(right)?;
        // y points down on the canvas, so right × down points away.
        let normal = unit(cross(down, right))?;
        Some(Self { right, down: cross(right, normal), normal })
    }
}

/// Calls `body(from, to, frame)` for runs of points, in a block of whole quads, that share a frame: for all points of a
/// plane, and otherwise for the rows of each quad. Single points lie on no surface and have no frame.
#[inline(always)]
pub(super) fn frames(patch: &Patch<'_>, mut body: impl FnMut(usize, usize, Option<&Frame>)) {
    if let Some([right, down]) = patch.flat {
        return body(0, patch.len(), Frame::new(right, down).as_ref());
    }
    if patch.pixel <= 0.0 || patch.space {
        return body(0, patch.len(), None);
    }
    let n = patch.columns;
    if let Some(pieces) = &patch.pieces {
        return match pieces.planes {
            Some((turned, axes)) => in_planes(pieces.ids, turned, axes, body),
            None => in_pieces(patch, pieces, body),
        };
    }
    for row in (0..patch.rows).step_by(2) {
        for corner in (row * n..row * n + n).step_by(2) {
            let step = |to: usize| patch.place.map(|axis| axis[to] - axis[corner]);
            let frame = Frame::new(step(corner + 1), step(corner + n));
            body(corner, corner + 2, frame.as_ref());
            body(corner + n, corner + n + 2, frame.as_ref());
        }
    }
}

/// Like [`frames`] for plane pieces: runs of points of one piece.
#[inline(always)]
fn in_planes(
    ids: &[f32],
    [cos, sin]: [&[f32]; 2],
    axes: &PieceAxes,
    mut body: impl FnMut(usize, usize, Option<&Frame>),
) {
    let mut from = 0;
    let mut known: Option<(f32, [[f32; 3]; 2])> = None;
    while from < ids.len() {
        let (id, c, s) = (ids[from], cos[from], sin[from]);
        let rest = ids[from..].iter().zip(&cos[from..]).zip(&sin[from..]);
        let to = from + rest.take_while(|((i, a), b)| **i == id && **a == c && **b == s).count().max(1);
        let [x, y] = match known {
            Some((same, axes)) if same == id => axes,
            _ => (axes.0)(id),
        };
        known = Some((id, [x, y]));
        let mix = |a: f32, b: f32| std::array::from_fn(|k| a * x[k] + b * y[k]);
        body(from, to, Frame::new(mix(c, -s), mix(s, c)).as_ref());
        from = to;
    }
}

/// Like [`frames`] for curved pieces: quads within a piece are handled as on any surface; points of other quads use the
/// differences to neighbours in their own piece.
#[inline(always)]
fn in_pieces(patch: &Patch<'_>, pieces: &PatchPieces<'_>, mut body: impl FnMut(usize, usize, Option<&Frame>)) {
    let (ids, n) = (pieces.ids, patch.columns);
    for row in (0..patch.rows).step_by(2) {
        for corner in (row * n..row * n + n).step_by(2) {
            let id = ids[corner];
            if [corner + 1, corner + n, corner + n + 1].iter().all(|k| ids[*k] == id) {
                let step = |to: usize| patch.place.map(|axis| axis[to] - axis[corner]);
                let frame = Frame::new(step(corner + 1), step(corner + n));
                body(corner, corner + 2, frame.as_ref());
                body(corner + n, corner + n + 2, frame.as_ref());
            } else {
                for i in [corner, corner + 1, corner + n, corner + n + 1] {
                    body(i, i + 1, at_border(patch, ids, i).as_ref());
                }
            }
        }
    }
}

/// The frame of one point at the border of a piece.
fn at_border(patch: &Patch<'_>, ids: &[f32], i: usize) -> Option<Frame> {
    let step = |[a, b]: [usize; 2]| patch.place.map(|axis| axis[b] - axis[a]);
    match neighbors(ids, patch.columns, i).map(|pair| pair.map(step)) {
        [Some(right), Some(down)] => Frame::new(right, down),
        _ => None,
    }
}
