//! Solids built from closures, and code shared by solid nodes of several families.
use super::trunk::{Places, Rows};
use crate::ground::real::Real;
use glam::DVec3;
use shibo_value::{Cost, Patch, Planes, Solid, SolidSource, Type, Wants};

type Fill = Box<dyn Fn(&Patch<'_>, &[Planes<'_>], &mut [&mut [f32]]) + Send + Sync>;
type Exact = Box<dyn Fn(&[DVec3], &[Vec<f64>]) -> Vec<f64> + Send + Sync>;

/// The code of a solid.
pub struct Code {
    fill: Fill,
    exact: Option<Exact>,
    wants: Wants,
    cost: Cost,
    bytes: usize,
}

impl Code {
    /// Code that reads the points.
    pub fn of_place(fill: impl Fn(&Patch<'_>, &[Planes<'_>], &mut [&mut [f32]]) + Send + Sync + 'static) -> Self {
        let wants = Wants { place: true, quads: false, rounded: false };
        Self { fill: Box::new(fill), exact: None, wants, cost: Cost::Local, bytes: 0 }
    }

    /// Code that is cheap and reads only the inputs.
    pub fn of_inputs(fill: impl Fn(&Patch<'_>, &[Planes<'_>], &mut [&mut [f32]]) + Send + Sync + 'static) -> Self {
        let wants = Wants { place: false, quads: false, rounded: false };
        Self { wants, cost: Cost::Pointwise, ..Self::of_place(fill) }
    }

    /// Adds an evaluation in double precision.
    #[must_use]
    pub fn with_exact(mut self, exact: impl Fn(&[DVec3], &[Vec<f64>]) -> Vec<f64> + Send + Sync + 'static) -> Self {
        self.exact = Some(Box::new(exact));
        self
    }

    /// Requests evaluation in whole quads.
    #[must_use]
    pub fn with_quads(mut self) -> Self {
        self.wants.quads = true;
        self
    }

    /// Requests evaluation in whole quads, with the normals of rounded surfaces.
    #[must_use]
    pub fn with_rounded_quads(mut self) -> Self {
        self.wants.rounded = true;
        self.with_quads()
    }

    /// Marks values as not worth keeping, since they usually have one reader.
    #[must_use]
    pub fn passing(mut self) -> Self {
        self.cost = Cost::Pointwise;
        self
    }

    /// Marks values as worth keeping as tiles.
    #[must_use]
    pub fn kept(mut self) -> Self {
        self.cost = Cost::Local;
        self
    }

    /// Sets the memory that the code holds.
    #[must_use]
    pub fn holding(mut self, bytes: usize) -> Self {
        self.bytes = bytes;
        self
    }

    /// Builds the solid.
    pub fn solid(self, ty: Type, inputs: Vec<Solid>) -> Solid {
        Solid::new(ty, inputs, self)
    }
}

impl SolidSource for Code {
    fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
        (self.fill)(patch, inputs, out);
    }

    fn exact(&self, at: &[DVec3], inputs: &[Vec<f64>]) -> Option<Vec<f64>> {
        self.exact.as_ref().map(|exact| exact(at, inputs))
    }

    fn wants(&self) -> Wants {
        self.wants
    }

    fn cost(&self) -> Cost {
        self.cost
    }

    fn bytes(&self) -> usize {
        self.bytes
    }
}

/// The points of a patch.
pub fn places<'a>(patch: &Patch<'a>) -> Places<'a, f32> {
    let [x, y, z] = patch.place;
    let rows = if patch.level { Rows::Level(patch.columns) } else { Rows::Of(patch.columns) };
    Places { x, y, z, rows }
}

/// Calls `body` with points in columns.
pub fn columns<T>(points: &[DVec3], body: impl FnOnce(&Places<'_, f64>) -> T) -> T {
    let axis = |a: usize| points.iter().map(|p| f64::of(p[a])).collect::<Vec<_>>();
    let (x, y, z) = (axis(0), axis(1), axis(2));
    body(&Places { x: &x, y: &y, z: &z, rows: Rows::Any })
}

/// The change of a value within a pixel, in the two directions of a quad: the magnitudes of its differences, for all
/// points of a patch of whole quads; 0 for single points. At the border of a piece, a neighbour of the same piece on
/// the other side is used; where the piece is one pixel wide, the difference along it is used for both directions.
pub fn spans(values: &[f32], patch: &Patch<'_>) -> [Vec<f32>; 2] {
    let n = patch.columns;
    let (mut across, mut down) = (vec![0.0; values.len()], vec![0.0; values.len()]);
    if patch.pixel <= 0.0 || n == 0 {
        return [across, down];
    }
    if patch.space {
        return [spans_in_space(values, n), down];
    }
    if let Some(metric) = patch.metric {
        return [spans_along(values, patch, metric), down];
    }
    for (values, across) in values.as_chunks::<2>().0.iter().zip(across.as_chunks_mut::<2>().0) {
        *across = [(values[1] - values[0]).abs(); 2];
    }
    for (values, down) in values.chunks_exact(2 * n).zip(down.chunks_exact_mut(2 * n)) {
        let ((upper, lower), (up, low)) = (values.split_at(n), down.split_at_mut(n));
        for ((a, b), (up, low)) in upper.iter().zip(lower).zip(up.iter_mut().zip(low)) {
            let span = (b - a).abs();
            (*up, *low) = (span, span);
        }
    }
    if let Some(pieces) = &patch.pieces {
        let change = |pair: Option<[usize; 2]>| pair.map(|[a, b]| (values[b] - values[a]).abs());
        broken_quads(pieces.ids, n, |i| {
            let [x, y] = neighbors(pieces.ids, n, i).map(change);
            (across[i], down[i]) = (x.or(y).unwrap_or(0.0), y.or(x).unwrap_or(0.0));
        });
    }
    [across, down]
}

/// The change of a value within a width of `pixel` in the direction of the largest change, in quads that lie in space.
fn spans_in_space(values: &[f32], columns: usize) -> Vec<f32> {
    let mut out = vec![0.0; values.len()];
    for (values, out) in values.chunks_exact(2 * columns).zip(out.chunks_exact_mut(2 * columns)) {
        let ((upper, lower), (up, low)) = (values.split_at(columns), out.split_at_mut(columns));
        let quads = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        let outs = up.as_chunks_mut::<2>().0.iter_mut().zip(low.as_chunks_mut::<2>().0);
        for ((a, b), (up, low)) in quads.zip(outs) {
            let [x, y, z] = [a[1] - a[0], b[0] - a[0], b[1] - a[0]];
            let span = (x * x + y * y + z * z).sqrt();
            (*up, *low) = ([span; 2], [span; 2]);
        }
    }
    out
}

/// The same along a surface: the magnitude of the gradient, √(gᵀ·M⁻¹·g), from the two differences g of a quad and the
/// metric M.
fn spans_along(values: &[f32], patch: &Patch<'_>, [a, b, c]: [&[f32]; 3]) -> Vec<f32> {
    let n = patch.columns;
    let span = |i: usize, x: f32, y: f32| {
        let square = a[i] * x * x + 2.0 * b[i] * x * y + c[i] * y * y;
        if a[i] > 0.0 { patch.pixel * square.max(0.0).sqrt() } else { x.abs().max(y.abs()) }
    };
    let mut out = vec![0.0; values.len()];
    for row in (0..patch.rows).step_by(2) {
        for corner in (row * n..row * n + n).step_by(2) {
            let (x, y) = (values[corner + 1] - values[corner], values[corner + n] - values[corner]);
            [corner, corner + 1, corner + n, corner + n + 1].into_iter().for_each(|i| out[i] = span(i, x, y));
        }
    }
    if let Some(pieces) = &patch.pieces {
        let change = |pair: Option<[usize; 2]>| pair.map_or(0.0, |[a, b]| values[b] - values[a]);
        broken_quads(pieces.ids, n, |i| {
            let [x, y] = neighbors(pieces.ids, n, i).map(change);
            out[i] = span(i, x, y);
        });
    }
    out
}

/// Calls `body` for the four points of each quad that contains more than one piece.
pub fn broken_quads(ids: &[f32], columns: usize, mut body: impl FnMut(usize)) {
    for (row, lines) in ids.chunks_exact(2 * columns.max(1)).enumerate() {
        let (upper, lower) = lines.split_at(columns);
        for (x, (a, b)) in upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0).enumerate() {
            if a[0] != a[1] || a[0] != b[0] || a[0] != b[1] {
                let corner = 2 * (row * columns + x);
                [corner, corner + 1, corner + columns, corner + columns + 1].into_iter().for_each(&mut body);
            }
        }
    }
}

/// A pair of horizontal neighbours, and a pair of vertical ones, whose differences give the change at point `i`. Both
/// points are of the same piece as `i`, which is one of them or next to them. `None` if there is no such pair.
pub fn neighbors(ids: &[f32], columns: usize, i: usize) -> [Option<[usize; 2]>; 2] {
    let (x, y) = (i % columns, i / columns);
    let rows = ids.len() / columns;
    let own = |k: usize| ids[k] == ids[i];
    // First the other point of the quad, then the one on the opposite side.
    let sides = |at: usize, count: usize| {
        let (other, beyond) = (at ^ 1, if at & 1 == 0 { at.checked_sub(1) } else { Some(at + 1) });
        [Some(other), beyond].into_iter().flatten().filter(move |k| *k < count)
    };
    let pair = |a: usize, b: usize| [a.min(b), a.max(b)];
    let in_row = |x: usize, y: usize| {
        let other = sides(x, columns).map(move |k| y * columns + k).find(|k| own(*k));
        other.map(|k| pair(y * columns + x, k))
    };
    let in_column = |x: usize, y: usize| {
        let other = sides(y, rows).map(move |k| k * columns + x).find(|k| own(*k));
        other.map(|k| pair(y * columns + x, k))
    };
    let across = || sides(y, rows).filter(|k| own(k * columns + x)).find_map(|k| in_row(x, k));
    let down = || sides(x, columns).filter(|k| own(y * columns + k)).find_map(|k| in_column(k, y));
    [in_row(x, y).or_else(across), in_column(x, y).or_else(down)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::PatchPieces;

    /// Two adjacent slopes: the change at their border is that within each of them.
    #[test]
    fn spans_end_at_the_borders_of_pieces() {
        // The border runs through quads: three columns of the first piece, five of the second, and one pixel of a
        // third.
        let ids: Vec<f32> = (0..32)
            .map(|i| {
                if i == 13 {
                    3.0
                } else if i % 8 < 3 {
                    1.0
                } else {
                    2.0
                }
            })
            .collect();
        let values: Vec<f32> = (0..32_u8)
            .map(|i| {
                let (x, y) = (f32::from(i % 8), f32::from(i / 8));
                if x < 3.0 { 2.0 * x + y } else { 100.0 + 5.0 * x + 3.0 * y }
            })
            .collect();
        let pieces = Some(PatchPieces { ids: &ids, planes: None });
        let patch = Patch { columns: 8, rows: 4, pieces, pixel: 1.0, ..Patch::of([&[]; 3]) };
        let [across, down] = spans(&values, &patch);
        for i in 0..32 {
            let want = match ids[i] {
                1.0 => (2.0, 1.0),
                2.0 => (5.0, 3.0),
                // It has no neighbour of the same piece.
                _ => (0.0, 0.0),
            };
            assert_eq!((across[i], down[i]), want, "{i}");
        }
    }
}
