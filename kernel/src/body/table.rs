//! A Delaunay triangulation of samples of a block, in a table of triangles. All decisions are made with whole numbers.
use super::heights::BLOCK;
use super::patch::{Patch, Spot};
use super::scan::Taken;

/// No triangle beside an edge.
const NONE: u32 = u32::MAX;

/// The triangles of a block. Edge `3 t + k` goes from corner `k` of triangle `t` to the next corner.
///
/// Corners are in the order in which x turns to y, which is clockwise in the picture.
#[derive(Debug, Default)]
pub(super) struct Table {
    /// The samples that are vertices, in order of insertion.
    pub(super) spots: Vec<Spot>,
    places: Vec<[i32; 2]>,
    corners: Vec<u16>,
    /// The same edge in the triangle beside it.
    twins: Vec<u32>,
    taken: Vec<bool>,
    /// Triangles that changed since they were last taken.
    pub(super) changed: Vec<u32>,
    waiting: Vec<u32>,
}

impl Taken for Table {
    #[inline]
    fn taken(&self, column: usize, row: usize) -> bool {
        self.taken[row * (BLOCK + 1) + column]
    }
}

const fn next(edge: u32) -> u32 {
    if edge % 3 == 2 { edge - 2 } else { edge + 1 }
}

const fn before(edge: u32) -> u32 {
    if edge.is_multiple_of(3) { edge + 2 } else { edge - 1 }
}

/// Twice the area of a triangle; positive if x turns to y.
pub(super) fn turn(a: [i32; 2], b: [i32; 2], c: [i32; 2]) -> i32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// True if `p` lies inside of the circle through `a`, `b`, `c`. Coordinates are at most 130, so nothing overflows.
fn in_circle(a: [i32; 2], b: [i32; 2], c: [i32; 2], p: [i32; 2]) -> bool {
    let [(ax, ay), (bx, by), (cx, cy)] = [a, b, c].map(|q| (i64::from(q[0] - p[0]), i64::from(q[1] - p[1])));
    let (a2, b2, c2) = (ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy);
    ax * (by * c2 - b2 * cy) - ay * (bx * c2 - b2 * cx) + a2 * (bx * cy - by * cx) > 0
}

impl Table {
    /// Starts with the two triangles of a block.
    pub(super) fn start(&mut self, patch: &Patch) {
        self.spots.clear();
        self.places.clear();
        self.corners.clear();
        self.twins.clear();
        self.changed.clear();
        self.taken.clear();
        self.taken.resize((BLOCK + 1) * (BLOCK + 1), false);
        let [right, bottom] = [patch.width, patch.height].map(|at| u8::try_from(at).unwrap_or(u8::MAX));
        for spot in [[0, 0], [right, 0], [right, bottom], [0, bottom]] {
            self.vertex(patch, spot);
        }
        self.corners.extend([0, 1, 2, 0, 2, 3]);
        self.twins.extend([NONE, NONE, 3, 2, NONE, NONE]);
        self.changed.extend([0, 1]);
    }

    /// Number of triangles.
    pub(super) fn len(&self) -> u32 {
        u32::try_from(self.corners.len() / 3).unwrap_or(NONE)
    }

    fn vertex(&mut self, patch: &Patch, spot: Spot) -> u16 {
        self.taken[usize::from(spot[1]) * (BLOCK + 1) + usize::from(spot[0])] = true;
        self.spots.push(spot);
        self.places.push(patch.place(spot));
        u16::try_from(self.spots.len() - 1).unwrap_or(u16::MAX)
    }

    /// The vertices of a triangle, by number.
    pub(super) fn numbers(&self, triangle: u32) -> [u16; 3] {
        let at = 3 * triangle as usize;
        [self.corners[at], self.corners[at + 1], self.corners[at + 2]]
    }

    /// The samples of a triangle's corners.
    pub(super) fn triangle(&self, triangle: u32) -> [Spot; 3] {
        self.numbers(triangle).map(|vertex| self.spots[usize::from(vertex)])
    }

    fn corner(&self, edge: u32) -> u16 {
        self.corners[edge as usize]
    }

    fn place(&self, edge: u32) -> [i32; 2] {
        self.places[usize::from(self.corner(edge))]
    }

    fn join(&mut self, edge: u32, twin: u32) {
        self.twins[edge as usize] = twin;
        if twin != NONE {
            self.twins[twin as usize] = edge;
        }
    }

    /// Writes a triangle over another one, or adds it, with the twins of its edges.
    fn put(&mut self, triangle: u32, corners: [u16; 3], twins: [u32; 3]) {
        let at = 3 * triangle as usize;
        if at == self.corners.len() {
            self.corners.extend(corners);
            self.twins.extend([NONE; 3]);
        } else {
            self.corners[at..at + 3].copy_from_slice(&corners);
        }
        for (edge, twin) in (3 * triangle..).zip(twins) {
            self.join(edge, twin);
        }
        self.changed.push(triangle);
    }

    /// Makes a sample a vertex. The search for its triangle starts at `near`.
    pub(super) fn insert(&mut self, patch: &Patch, spot: Spot, near: u32) {
        let at = patch.place(spot);
        let (triangle, on) = self.find(at, near);
        let new = self.vertex(patch, spot);
        match on {
            Some(edge) => self.divide_edge(edge, new),
            None => self.divide(triangle, new),
        }
        self.restore(new);
    }

    /// The triangle that holds a place, and the edge on which it lies, if any. The walk ends, because the triangulation
    /// is Delaunay.
    fn find(&self, at: [i32; 2], near: u32) -> (u32, Option<u32>) {
        let mut triangle = near;
        loop {
            let first = 3 * triangle;
            let (mut on, mut beyond) = (None, NONE);
            for edge in first..first + 3 {
                match turn(self.place(edge), self.place(next(edge)), at) {
                    0 => on = Some(edge),
                    side if side < 0 => beyond = self.twins[edge as usize],
                    _ => {}
                }
            }
            if beyond == NONE {
                return (triangle, on);
            }
            triangle = beyond / 3;
        }
    }

    /// Divides a triangle into three.
    fn divide(&mut self, triangle: u32, new: u16) {
        let [a, b, c] = self.numbers(triangle);
        let at = 3 * triangle as usize;
        let [ab, bc, ca] = [self.twins[at], self.twins[at + 1], self.twins[at + 2]];
        let (second, third) = (self.len(), self.len() + 1);
        self.put(triangle, [a, b, new], [ab, NONE, NONE]);
        self.put(second, [b, c, new], [bc, NONE, NONE]);
        self.put(third, [c, a, new], [ca, NONE, NONE]);
        for (one, other) in [(triangle, second), (second, third), (third, triangle)] {
            self.join(3 * one + 1, 3 * other + 2);
        }
        self.waiting.extend([3 * triangle, 3 * second, 3 * third]);
    }

    /// Divides an edge, and the triangles on both sides of it into two each.
    fn divide_edge(&mut self, edge: u32, new: u16) {
        let twin = self.twins[edge as usize];
        let (a, b, c) = (self.corner(edge), self.corner(next(edge)), self.corner(before(edge)));
        let (bc, ca) = (self.twins[next(edge) as usize], self.twins[before(edge) as usize]);
        let (one, two) = (edge / 3, self.len());
        // Edges: from a corner to the new vertex and on.
        self.put(one, [a, new, c], [NONE, NONE, ca]);
        self.put(two, [new, b, c], [NONE, bc, NONE]);
        self.join(3 * one + 1, 3 * two + 2);
        self.waiting.extend([3 * one + 2, 3 * two + 1]);
        if twin == NONE {
            return;
        }
        let d = self.corner(before(twin));
        let (ad, db) = (self.twins[next(twin) as usize], self.twins[before(twin) as usize]);
        let (three, four) = (twin / 3, self.len());
        self.put(three, [new, a, d], [NONE, ad, NONE]);
        self.put(four, [b, new, d], [NONE, NONE, db]);
        self.join(3 * three + 2, 3 * four + 1);
        self.join(3 * one, 3 * three);
        self.join(3 * two, 3 * four);
        self.waiting.extend([3 * three + 1, 3 * four + 2]);
    }

    /// Turns edges until the triangulation is Delaunay; `new` is the vertex inserted last.
    fn restore(&mut self, new: u16) {
        while let Some(edge) = self.waiting.pop() {
            let twin = self.twins[edge as usize];
            if twin == NONE {
                continue;
            }
            let [a, b, c, d] = [edge, next(edge), before(edge), before(twin)].map(|edge| self.corner(edge));
            let place = |vertex: u16| self.places[usize::from(vertex)];
            if c != new || !in_circle(place(a), place(b), place(c), place(d)) {
                continue;
            }
            let (bc, ca) = (self.twins[next(edge) as usize], self.twins[before(edge) as usize]);
            let (ad, db) = (self.twins[next(twin) as usize], self.twins[before(twin) as usize]);
            let (one, two) = (edge / 3, twin / 3);
            self.put(one, [a, d, c], [ad, NONE, ca]);
            self.put(two, [d, b, c], [db, bc, NONE]);
            self.join(3 * one + 1, 3 * two + 2);
            self.waiting.extend([3 * one, 3 * two]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::heights::Heights;
    use super::super::patch::Tolerance;
    use super::*;

    fn patch(width: usize, height: usize) -> Patch {
        let values = vec![0.0; width * height];
        let heights = Heights::of_canvas(&values, [width, height], [1.0; 2], [false; 2]).unwrap();
        let mut patch = Patch::new(Tolerance::flat(1.0));
        patch.load(&heights, &heights.band(0, height + 1).unwrap(), [0, width + 1], [0, height + 1]);
        patch
    }

    /// The triangles cover the block once, twins agree, and no vertex lies in the circle of a triangle.
    fn check(table: &Table, patch: &Patch) {
        let mut area = 0;
        for triangle in 0..table.len() {
            let [a, b, c] = table.triangle(triangle).map(|spot| patch.place(spot));
            assert!(turn(a, b, c) > 0);
            area += turn(a, b, c);
            assert!(table.places.iter().all(|p| !in_circle(a, b, c, *p)));
            for edge in 3 * triangle..3 * triangle + 3 {
                let twin = table.twins[edge as usize];
                if twin == NONE {
                    let (a, b) = (table.place(edge), table.place(next(edge)));
                    assert!(a[0] == b[0] || a[1] == b[1], "an outer edge lies on a side");
                } else {
                    assert_eq!(table.twins[twin as usize], edge);
                    assert_eq!(table.corner(edge), table.corner(next(twin)));
                }
            }
        }
        assert_eq!(area, 2 * patch.across[patch.width] * patch.down[patch.height]);
    }

    #[test]
    fn stays_delaunay_while_samples_are_inserted() {
        let patch = patch(21, 13);
        let mut table = Table::default();
        table.start(&patch);
        let mut spots: Vec<Spot> = (0..=14).flat_map(|y| (0..=22).map(move |x| [x, y])).collect();
        let mut state = 7_usize;
        while !spots.is_empty() {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let spot = spots.swap_remove((state >> 33) % spots.len());
            if !table.taken(usize::from(spot[0]), usize::from(spot[1])) {
                table.insert(&patch, spot, 0);
            }
            if spots.len().is_multiple_of(29) {
                check(&table, &patch);
            }
        }
        check(&table, &patch);
        assert_eq!(table.len(), 2 * 22 * 14);
    }
}
