//! Cuts polygons into triangles.
//!
//! A polygon may have holes: its outline then runs to each hole along an edge, round the hole, and back along the same
//! edge. Triangles are made by ear clipping; a grid finds the corners near an ear, so a round polygon takes O(n) and
//! others rarely much more.
use glam::{DVec2, DVec3};
use shibo_kernel::ground::stop::Watch;
use std::cell::Cell;

/// Maximum number of corners of a polygon that is cut.
pub(super) const MOST_CORNERS: usize = u16::MAX as usize;
/// Number of cuts by a weaker rule than [`Rule::Ear`] after which a self-intersecting polygon stays with the weaker
/// rule.
const DOUBTS: usize = 64;
/// Mean number of corners tested per corner of a polygon after which the rest is cut by [`Rule::Any`].
const LOOKS: usize = 5000;

/// The normal of a polygon, which need not be flat, by Newell's method; not normalized.
fn newell(corners: &[DVec3]) -> DVec3 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| (*a - corners[0]).cross(*b - corners[0])).sum()
}

/// Calls `add` with the triangles of a polygon, as numbers of its corners. Quads are cut along the shorter diagonal
/// (the first one if both are equal), unless it lies outside. Larger polygons are cut by ear clipping in the plane of
/// their normal. Unwinds if `watch` cancels.
pub(super) fn triangles(corners: &[DVec3], watch: &Watch<'_>, mut add: impl FnMut([usize; 3])) {
    match corners.len() {
        0..3 => {}
        3 => add([0, 1, 2]),
        4 => {
            let normal = newell(corners);
            let up = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(normal) > 0.0;
            let cuts = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
            let fits = cuts.map(|cut| cut.iter().all(|triangle| up(*triangle)));
            let shorter = corners[0].distance_squared(corners[2]) <= corners[1].distance_squared(corners[3]);
            let first = if fits[0] == fits[1] { shorter } else { fits[0] };
            cuts[usize::from(!first)].into_iter().for_each(add);
        }
        _ => ears(&flat(corners), watch, add),
    }
}

/// The corners projected along the polygon's normal, counterclockwise.
fn flat(corners: &[DVec3]) -> Vec<DVec2> {
    let normal = newell(corners).try_normalize().unwrap_or(DVec3::Z);
    let (x, y) = normal.any_orthonormal_pair();
    corners.iter().map(|p| DVec2::new((*p - corners[0]).dot(x), (*p - corners[0]).dot(y))).collect()
}

/// Rules for cutting off a corner, from strict to weak.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// No other part of the outline lies in the triangle or on its border.
    Ear,
    /// The triangle has no area.
    Flat,
    /// No other corner lies inside the triangle.
    Loose,
    /// Any corner.
    Any,
}

impl Rule {
    const fn next(self) -> Self {
        match self {
            Self::Ear => Self::Flat,
            Self::Flat => Self::Loose,
            Self::Loose | Self::Any => Self::Any,
        }
    }
}

/// Cuts off one ear after another. The search continues behind the last ear, so that triangles do not become slivers.
fn ears(at: &[DVec2], watch: &Watch<'_>, mut add: impl FnMut([usize; 3])) {
    let mut ring = Ring::new(at);
    let (mut corner, mut left, mut tried, mut doubts) = (0, at.len(), 0, 0);
    let mut rule = Rule::Ear;
    while left > 3 {
        watch.tick();
        let [a, b, c] = ring.around(corner);
        if !ring.fits([a, b, c], rule) {
            (corner, tried) = (c, tried + 1);
            if ring.looks.get() > LOOKS * at.len() {
                rule = Rule::Any;
            } else if tried == left {
                (rule, tried) = (rule.next(), 0);
            }
            continue;
        }
        add([a, b, c]);
        ring.cut(b);
        (corner, left, tried) = (ring.next[c] as usize, left - 1, 0);
        doubts += usize::from(rule != Rule::Ear);
        if doubts < DOUBTS && rule != Rule::Any {
            rule = Rule::Ear;
        }
    }
    add(ring.around(corner));
}

/// The number of a corner: there are at most [`MOST_CORNERS`].
fn index_u32(corner: usize) -> u32 {
    u32::try_from(corner).unwrap_or(u32::MAX)
}

/// The remaining corners, linked to the ones before and after them, and sorted by place.
struct Ring<'a> {
    at: &'a [DVec2],
    next: Vec<u32>,
    before: Vec<u32>,
    /// Square cells of a grid over the polygon, by rows, and the corners in them.
    cells: Vec<Vec<u32>>,
    side: usize,
    low: DVec2,
    /// Cells per unit of length.
    scale: DVec2,
    /// Number of corners tested so far.
    looks: Cell<usize>,
}

impl<'a> Ring<'a> {
    fn new(at: &'a [DVec2]) -> Self {
        let count = index_u32(at.len());
        // About four corners per cell.
        let side = (at.len() / 4).isqrt().max(1);
        let [low, high] = at.iter().fold([at[0]; 2], |[low, high], p| [low.min(*p), high.max(*p)]);
        let size = high - low;
        let scale = DVec2::from_array(size.to_array().map(|size| if size > 0.0 { side as f64 / size } else { 0.0 }));
        let mut ring = Self {
            at,
            next: (0..count).map(|n| (n + 1) % count).collect(),
            before: (0..count).map(|n| (n + count - 1) % count).collect(),
            cells: vec![Vec::new(); side * side],
            side,
            low,
            scale,
            looks: Cell::new(0),
        };
        for (n, p) in (0..count).zip(at) {
            let [x, y] = ring.cell(*p);
            ring.cells[y * side + x].push(n);
        }
        ring
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
    fn cell(&self, p: DVec2) -> [usize; 2] {
        ((p - self.low) * self.scale).to_array().map(|x| (x as usize).min(self.side - 1))
    }

    /// The corner with the ones before and after it.
    fn around(&self, corner: usize) -> [usize; 3] {
        [self.before[corner] as usize, corner, self.next[corner] as usize]
    }

    fn cut(&mut self, corner: usize) {
        let [a, _, c] = self.around(corner);
        (self.next[a], self.before[c]) = (index_u32(c), index_u32(a));
        let [x, y] = self.cell(self.at[corner]);
        self.cells[y * self.side + x].retain(|n| *n as usize != corner);
    }

    /// The remaining corners near a triangle.
    fn near(&self, [a, b, c]: [DVec2; 3]) -> impl Iterator<Item = usize> + '_ {
        let ([left, top], [right, bottom]) = (self.cell(a.min(b).min(c)), self.cell(a.max(b).max(c)));
        let cells = (top..=bottom).flat_map(move |y| (left..=right).map(move |x| y * self.side + x));
        cells.flat_map(move |cell| &self.cells[cell]).map(|n| *n as usize)
    }

    /// True if the middle one of three corners may be cut off.
    fn fits(&self, corners: [usize; 3], rule: Rule) -> bool {
        let [a, b, c] = corners.map(|n| self.at[n]);
        let turn = (b - a).perp_dot(c - b);
        match rule {
            Rule::Any => return true,
            Rule::Flat => return turn == 0.0,
            Rule::Ear | Rule::Loose if turn <= 0.0 => return false,
            Rule::Ear | Rule::Loose => {}
        }
        !self.near([a, b, c]).any(|n| {
            self.looks.set(self.looks.get() + 1);
            let p = self.at[n];
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(p - from));
            if rule == Rule::Loose {
                return sides.iter().all(|side| *side > 0.0);
            }
            if sides.iter().any(|side| *side < 0.0) {
                return false;
            }
            // The outline touches a corner of the triangle, or is that corner: it must not continue into the triangle.
            let wedge = [(a, b, c), (b, c, a), (c, a, b)].into_iter().find(|(corner, ..)| *corner == p);
            wedge.is_none_or(|(_, to, from)| {
                let inwards = |m: u32| {
                    let along = self.at[m as usize] - p;
                    (to - p).perp_dot(along) > 0.0 && along.perp_dot(from - p) > 0.0
                };
                inwards(self.next[n]) || inwards(self.before[n])
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(corners: &[DVec3]) -> Vec<[usize; 3]> {
        let mut all = Vec::new();
        triangles(corners, &Watch::never(), |triangle| all.push(triangle));
        all
    }

    fn cut(corners: &[[f64; 3]]) -> Vec<[usize; 3]> {
        let corners: Vec<DVec3> = corners.iter().map(|p| DVec3::from_array(*p)).collect();
        let all = all(&corners);
        let area = |[a, b, c]: [usize; 3]| (corners[b] - corners[a]).cross(corners[c] - corners[a]);
        let sum: DVec3 = all.iter().map(|t| area(*t)).sum();
        let normal = newell(&corners);
        assert!(sum.distance(normal) < 1e-9 * (1.0 + normal.length()));
        assert!(all.iter().all(|t| area(*t).dot(normal) > 0.0), "{all:?}");
        all
    }

    /// Cuts a flat polygon and checks that the triangles have its area, face the same way, and cover none of `holes`.
    fn cut_flat(outline: &[[f64; 2]], holes: &[[f64; 2]]) -> Vec<[usize; 3]> {
        let all = cut(&outline.iter().map(|[x, y]| [*x, *y, 0.0]).collect::<Vec<_>>());
        let at = |n: usize| DVec2::from_array(outline[n]);
        let holds = |[a, b, c]: [usize; 3], p: DVec2| {
            [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (at(*to) - at(*from)).perp_dot(p - at(*from)) > 0.0)
        };
        for hole in holes {
            assert!(!all.iter().any(|t| holds(*t, DVec2::from_array(*hole))), "{hole:?}");
        }
        all
    }

    #[test]
    fn quads_are_cut_along_the_shorter_diagonal() {
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 2.0, 0.0], [0.0, 1.0, 0.0]]), [[0, 1, 3], [1, 2, 3]]);
        // The shorter diagonal lies outside.
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [5.0, -1.0, 0.0], [1.0, 0.0, 0.0], [5.0, 1.0, 0.0]]), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn hollow_polygons_are_cut_inside() {
        let star: Vec<[f64; 3]> = (0..14)
            .map(|k| {
                let (angle, radius) = (f64::from(k) * std::f64::consts::TAU / 14.0, if k % 2 == 0 { 3.0 } else { 1.0 });
                [radius * angle.cos(), radius * angle.sin(), 0.5 * radius * angle.sin()]
            })
            .collect();
        assert_eq!(cut(&star).len(), 12);
        let comb = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 1.0], [3.0, 3.0], [2.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        assert_eq!(cut(&comb.map(|[x, y]| [7.0, x, y])).len(), 6);
        // Corners on straight sides.
        let side = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [3.0, 1.0], [3.0, 2.0], [0.0, 2.0]];
        assert_eq!(cut_flat(&side, &[]).len(), 5);
    }

    #[test]
    fn keeps_holes_joined_by_an_edge_open() {
        let square = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];
        let hole = [[3.0, 3.0], [3.0, 7.0], [7.0, 7.0], [7.0, 3.0], [3.0, 3.0]];
        let one: Vec<_> = square.into_iter().chain(hole).collect();
        assert_eq!(cut_flat(&one, &[[5.0, 5.0]]).len(), 8);
        // Start at any corner of the outline and of the hole.
        for turn in 0..10 {
            let mut turned = one.clone();
            turned.rotate_left(turn);
            cut_flat(&turned, &[[5.0, 5.0], [4.0, 6.5], [6.5, 3.5]]);
        }
        // Two holes from one corner, and a chain of three in a row.
        let ring = |x: f64, y: f64| [[x, y], [x, y + 1.0], [x + 1.0, y + 1.0], [x + 1.0, y], [x, y]];
        let two: Vec<_> = square.into_iter().chain(ring(2.0, 5.0)).chain([[0.0, 0.0]]).chain(ring(6.0, 2.0)).collect();
        assert_eq!(cut_flat(&two, &[[2.5, 5.5], [6.5, 2.5]]).len(), two.len() - 2);
        let mut chain = vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];
        for x in [2.0, 5.0, 8.0] {
            chain.extend([[x, x], [x, x + 1.0], [x + 1.0, x + 1.0]]);
        }
        for x in [8.0, 5.0, 2.0] {
            chain.extend([[x + 1.0, x + 1.0], [x + 1.0, x], [x, x]]);
        }
        chain.dedup();
        cut_flat(&chain, &[[2.5, 2.5], [5.5, 5.5], [8.5, 8.5]]);
    }

    #[test]
    fn round_polygons_with_many_holes_keep_their_area() {
        let circle = |count: usize, (x, y, radius): (f64, f64, f64), sense: f64| {
            (0..=count).map(move |k| {
                let angle = sense * std::f64::consts::TAU * (k % count) as f64 / count as f64;
                [x + radius * angle.cos(), y + radius * angle.sin()]
            })
        };
        let mut outline: Vec<[f64; 2]> = circle(3000, (0.0, 0.0, 100.0), 1.0).take(3000).collect();
        let mut holes = Vec::new();
        for k in 0..8 {
            // An edge from the right joins each hole to its own corner of the outline.
            let y = f64::from(k) * 20.0 - 70.0;
            holes.push([0.0, y]);
            let from = (0..outline.len()).min_by(|a, b| {
                let away = |n: &usize| (outline[*n][1] - y).abs() + if outline[*n][0] > 20.0 { 0.0 } else { 1e3 };
                away(a).total_cmp(&away(b))
            });
            let from = from.unwrap();
            let bridge = outline[from];
            outline.splice(from + 1..from + 1, circle(40, (0.0, y, 8.0), -1.0).chain([bridge]));
        }
        assert_eq!(cut_flat(&outline, &holes).len(), outline.len() - 2);
    }

    #[test]
    fn cuts_degenerate_polygons_into_n_minus_2_triangles() {
        for corners in [vec![DVec3::ZERO; 9], (0..9).map(|k| DVec3::splat(f64::from(k * k % 5))).collect()] {
            assert_eq!(all(&corners).len(), 7);
        }
        // A pentagram, and a tangle of 5,000 corners.
        let around = |k: usize, step: usize, n: usize| {
            let angle = std::f64::consts::TAU * (k * step % n) as f64 / n as f64;
            DVec3::new(angle.cos(), angle.sin(), 0.0)
        };
        for (n, step) in [(5, 2), (5001, 2477)] {
            let star: Vec<DVec3> = (0..n).map(|k| around(k, step, n)).collect();
            assert_eq!(all(&star).len(), n - 2);
        }
        assert_eq!(all(&[DVec3::ZERO; 2]).len(), 0);
    }
}
