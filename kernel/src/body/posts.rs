//! The posts of a block for even triangles: 2^k + 1 on each side, laid on the samples of the block in order.
//!
//! Where a block has fewer samples than posts, two posts share a sample, and triangles between them have no area and are
//! left out. The error of a triangle is the exact maximum over its samples and crossings.
use super::block::Mesh;
use super::heights::{BLOCK, Band, Heights, single};
use super::patch::{Patch, Spot, Tolerance};
use super::scan::{self, Taken};
use super::table::turn;
use super::tiles::Tiles;

/// No sample counts as a vertex.
struct Nothing;

impl Taken for Nothing {
    fn taken(&self, _: usize, _: usize) -> bool {
        false
    }
}

/// A post: column and row.
type Post = [usize; 2];

/// A block at work.
pub(super) struct Block {
    patch: Patch,
    posts: usize,
    /// The sample of each column and row of posts.
    across: Vec<u8>,
    down: Vec<u8>,
}

impl Block {
    pub(super) fn new(
        heights: &Heights<'_>,
        band: &Band,
        tolerance: Tolerance,
        (tiles, block): (&Tiles, usize),
        posts: usize,
    ) -> Self {
        let mut patch = Patch::new(tolerance);
        patch.load(heights, band, tiles.columns(block), tiles.rows(block));
        let [across, down] = [patch.width, patch.height].map(|count| samples(count, posts));
        Self { patch, posts, across, down }
    }

    fn spot(&self, [column, row]: Post) -> Spot {
        [self.across[column], self.down[row]]
    }

    fn index(&self, [column, row]: Post) -> usize {
        row * (self.posts + 1) + column
    }

    /// Twice the area of a triangle in half steps; positive if x turns to y.
    fn area(&self, spots: [Spot; 3]) -> i32 {
        let [a, b, c] = spots.map(|spot| self.patch.place(spot));
        turn(a, b, c)
    }

    /// The error of a triangle; 0 if it has no area.
    fn error(&self, corners: [Post; 3]) -> f32 {
        let spots = corners.map(|post| self.spot(post));
        if self.area(spots) == 0 {
            return 0.0;
        }
        above(scan::worst(&self.patch, &Nothing, spots).share)
    }

    /// The error of a triangle with one sample, in the middle of a side of a square, if both ends are as far from it.
    fn bend(&self, [a, middle, b]: [Post; 3], centre: Post) -> Option<f32> {
        let spots = [a, middle, b, centre].map(|post| self.spot(post));
        let [p, q, r, c] = spots.map(|spot| self.patch.place(spot));
        let along = usize::from(p[0] == r[0]);
        let (run, rise) = (r[along] - p[along], c[1 - along] - q[1 - along]);
        if p[along] + r[along] != 2 * q[along] || run == 0 || rise == 0 || self.patch.tolerance.bend.is_some() {
            return None;
        }
        let [a, middle, b, centre] = spots.map(|spot| self.patch.of(spot));
        let mean = 0.5 * (a + b);
        let mut slope = [(b - a) / f64::from(run), (centre - mean) / f64::from(rise)];
        if along == 1 {
            slope.swap(0, 1);
        }
        Some(above((mean - middle).abs() + self.patch.tolerance.shift(slope)))
    }

    fn raise(&self, errors: &mut [f32], post: Post, error: f32) {
        let at = &mut errors[self.index(post)];
        *at = at.max(error);
    }

    /// The corners of all squares with sides of `size` posts.
    fn squares(&self, size: usize) -> impl Iterator<Item = Post> + use<> {
        let posts = self.posts;
        (0..posts).step_by(size).flat_map(move |y| (0..posts).step_by(size).map(move |x| [x, y]))
    }

    /// Measures the four triangles between the centre and the sides of each square.
    pub(super) fn sides(&self, errors: &mut [f32], size: usize) {
        let (half, quarter) = (size / 2, size / 4);
        for [x, y] in self.squares(size) {
            let centre = [x + half, y + half];
            let corners = [[x, y], [x + size, y], [x + size, y + size], [x, y + size]];
            for side in 0..4 {
                let (a, b) = (corners[side], corners[(side + 1) % 4]);
                let middle = between(a, b);
                // A triangle of two intervals has one sample, on its longest edge.
                let small = if size == 2 { self.bend([a, middle, b], centre) } else { None };
                let mut error = small.unwrap_or_else(|| self.error([a, b, centre]));
                if quarter > 0 {
                    for corner in [a, b] {
                        error = error.max(errors[self.index(between(corner, centre))]);
                    }
                }
                self.raise(errors, middle, error);
            }
        }
    }

    /// Measures the two triangles of each square.
    pub(super) fn halves(&self, errors: &mut [f32], size: usize) {
        for [x, y] in self.squares(size) {
            for corners in triangles([x, y], size) {
                self.raise(errors, [x + size / 2, y + size / 2], self.error(corners));
            }
        }
        self.depend(errors, size);
    }

    /// Gives the centre of each square at least the errors of its sides.
    pub(super) fn depend(&self, errors: &mut [f32], size: usize) {
        let half = size / 2;
        for [x, y] in self.squares(size) {
            for post in [[x + half, y], [x + half, y + size], [x, y + half], [x + size, y + half]] {
                self.raise(errors, [x + half, y + half], errors[self.index(post)]);
            }
        }
    }

    /// Gives posts that share a sample with the centre of a square the error of the centre: without that, one side of an
    /// edge would have a vertex on it and the other none. Returns true if an error changed.
    pub(super) fn share(&self, errors: &mut [f32]) -> bool {
        let mut changed = false;
        for [x, y] in self.squares(2) {
            let centre = errors[self.index([x + 1, y + 1])];
            for post in [[x + 1, y], [x + 1, y + 2], [x, y + 1], [x + 2, y + 1]] {
                if self.spot(post) == self.spot([x + 1, y + 1]) && errors[self.index(post)] < centre {
                    self.raise(errors, post, centre);
                    changed = true;
                }
            }
        }
        changed
    }

    /// The triangles at an error, and the largest distance to the field.
    pub(super) fn mesh(&self, errors: &[f32], error: f64) -> (Mesh, f64) {
        let mut reached = 0.0_f64;
        let size = [self.patch.width, self.patch.height].map(|at| u8::try_from(at).unwrap_or(u8::MAX));
        let mut mesh = Mesh { size, ..Mesh::default() };
        let mut numbers = vec![u16::MAX; (BLOCK + 1) * (BLOCK + 1)];
        let mut waiting: Vec<[Post; 3]> = Vec::new();
        for [a, b, c] in triangles([0, 0], self.posts) {
            // The right angle is the corner that no diagonal touches.
            let apex = [a, b, c].into_iter().find(|p| [a, b, c].iter().all(|q| p[0] == q[0] || p[1] == q[1]));
            let apex = apex.unwrap_or(c);
            let others: Vec<Post> = [a, b, c].into_iter().filter(|p| *p != apex).collect();
            waiting.push([others[0], others[1], apex]);
        }
        while let Some([a, b, apex]) = waiting.pop() {
            let whole = (a[0] + b[0]).is_multiple_of(2) && (a[1] + b[1]).is_multiple_of(2);
            if whole {
                let middle = between(a, b);
                let own = errors[self.index(middle)];
                if f64::from(own) > error {
                    waiting.extend([[b, apex, middle], [apex, a, middle]]);
                    continue;
                }
                reached = reached.max(f64::from(own));
            } else {
                // The smallest triangles have no samples but their corners: rounding and bow are left.
                reached = reached.max(f64::from(self.error([a, b, apex])) * error);
            }
            let mut spots = [a, b, apex].map(|post| self.spot(post));
            match self.area(spots) {
                0 => continue,
                area if area < 0 => spots.swap(0, 1),
                _ => {}
            }
            mesh.triangles.push(spots.map(|spot| {
                let number = &mut numbers[usize::from(spot[1]) * (BLOCK + 1) + usize::from(spot[0])];
                if *number == u16::MAX {
                    *number = u16::try_from(mesh.spots.len()).unwrap_or(u16::MAX);
                    mesh.spots.push(spot);
                }
                *number
            }));
        }
        mesh.heights = self.patch.heights(&mesh.spots);
        (mesh, reached)
    }
}

/// The least `f32` that is no smaller.
fn above(value: f64) -> f32 {
    let near = single(value);
    if f64::from(near) < value { near.next_up() } else { near }
}

fn between(a: Post, b: Post) -> Post {
    [usize::midpoint(a[0], b[0]), usize::midpoint(a[1], b[1])]
}

/// The two triangles of a square. Diagonals of neighbouring squares are mirrored, so that they meet in the corners of
/// larger squares and in their centres.
fn triangles([x, y]: Post, size: usize) -> [[Post; 3]; 2] {
    let [a, b, c, d] = [[x, y], [x + size, y], [x + size, y + size], [x, y + size]];
    if (x / size + y / size).is_multiple_of(2) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}

/// The sample of each post on a side with `intervals` between samples.
fn samples(intervals: usize, posts: usize) -> Vec<u8> {
    (0..=posts).map(|post| u8::try_from(post * intervals / posts).unwrap_or(u8::MAX)).collect()
}
