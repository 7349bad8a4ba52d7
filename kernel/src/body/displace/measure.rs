//! The distance between a triangle and the displaced surface that it stands for.
//!
//! A point of the triangle and the point of the surface with the same place on the undisplaced mesh are compared. Their
//! distance is at least that from the surface to the triangle.
use super::relief::Relief;
use glam::{DVec2, DVec3};

/// A triangle with the values that are interpolated on it.
pub(super) struct Facet {
    /// Corners in texels.
    pub(super) texels: [DVec2; 3],
    /// The ends of edge `k`, from corner `k + 1` to corner `k + 2`, in texels on another chart that meets this one there.
    pub(super) beyond: [Option<[DVec2; 2]>; 3],
    /// Corners of the undisplaced surface in mm.
    pub(super) base: [DVec3; 3],
    /// Normals of the corners, of any length.
    pub(super) normal: [DVec3; 3],
    /// Displaced corners in mm.
    pub(super) at: [DVec3; 3],
}

/// Tolerance of weights, for texels on edges.
const EDGE: f64 = 1e-9;

fn mixed(of: &[DVec3; 3], w: [f64; 3]) -> DVec3 {
    of[0] * w[0] + of[1] * w[1] + of[2] * w[2]
}

impl Facet {
    /// The length of the longest edge in texels.
    pub(super) fn longest(&self) -> f64 {
        let [a, b, c] = self.texels;
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// The largest distance in mm at texels inside and along the edges at steps of at most a texel, and its place on the
    /// undisplaced surface.
    pub(super) fn worst(&self, relief: &Relief<'_>) -> (f64, DVec3) {
        let gap: [DVec3; 3] = std::array::from_fn(|k| self.base[k] - self.at[k]);
        let mut worst = (0.0, [1.0, 0.0, 0.0]);
        let mut compare = |w: [f64; 3], height: f64| {
            let off = (mixed(&gap, w) + mixed(&self.normal, w).normalize_or_zero() * height).length_squared();
            if off > worst.0 {
                worst = (off, w);
            }
        };
        for k in 0..3 {
            let (one, other) = ((k + 1) % 3, (k + 2) % 3);
            let [from, to] = [self.texels[one], self.texels[other]];
            // An even number of steps, so that one ends in the middle.
            let steps = 2.0 * (0.5 * from.distance(to)).ceil().max(1.0);
            let mut step = 1.0;
            while step < steps {
                let part = step / steps;
                let mut w = [0.0; 3];
                (w[one], w[other]) = (1.0 - part, part);
                let own = relief.at(from.lerp(to, part));
                // Where two charts meet, the height is the mean of both.
                let mean = |[from, to]: [DVec2; 2]| 0.5 * (own + relief.at(from.lerp(to, part)));
                compare(w, self.beyond[k].map_or(own, mean));
                step += 1.0;
            }
        }
        self.each_texel(relief.size(), |x, y, w| compare(w, relief.of_texel(x, y)));
        (worst.0.sqrt(), mixed(&self.base, worst.1))
    }

    /// Calls `body(column, row, weights)` for each texel inside.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the texels")]
    fn each_texel(&self, [width, height]: [usize; 2], mut body: impl FnMut(usize, usize, [f64; 3])) {
        let [a, b, c] = self.texels;
        let det = (b - a).perp_dot(c - a);
        if det == 0.0 {
            return;
        }
        let range = |low: f64, high: f64, count: usize| {
            let (low, high) = ((low - EDGE).ceil().max(0.0), (high + EDGE).floor().min(count as f64 - 1.0));
            if low <= high { low as usize..high as usize + 1 } else { 0..0 }
        };
        for y in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), height) {
            // The weights of `b` and `c` along the row, and that of `a`: slope and value at column 0.
            let down = y as f64 - a.y;
            let of_b = [(c.y - a.y) / det, (-a.x * (c.y - a.y) - down * (c.x - a.x)) / det];
            let of_c = [-(b.y - a.y) / det, (a.x * (b.y - a.y) + down * (b.x - a.x)) / det];
            let of_a = [-of_b[0] - of_c[0], 1.0 - of_b[1] - of_c[1]];
            let (mut low, mut high) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
            for [slope, start] in [of_a, of_b, of_c] {
                let end = -start / slope;
                if slope > 0.0 {
                    low = low.max(end);
                } else if slope < 0.0 {
                    high = high.min(end);
                } else if start < -EDGE {
                    high = f64::NEG_INFINITY;
                }
            }
            for x in range(low, high, width) {
                let at = x as f64;
                body(x, y, [of_a[0] * at + of_a[1], of_b[0] * at + of_b[1], of_c[0] * at + of_c[1]]);
            }
        }
    }
}
