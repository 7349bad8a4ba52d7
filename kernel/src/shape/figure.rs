//! Figures and their signed distances.
//!
//! Distances are exact outside and inside. Exception: inside overlapping copies of a figure, they are those of the copy
//! in which the point is deepest. Ellipses use the iteration of A. Vlachos and C. Peters ("Closest points on an
//! ellipse", trigonometry-free), the heart is by I. Quilez; polygons and stars are folded into half of a corner.
use crate::ground::math::{self, clamp, max, min};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt as _};
use glam::{DVec2, Vec2};
use shibo_value::Tiling;

/// A figure around the origin, y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Figure {
    /// A disc.
    Circle {
        /// Its radius, mm.
        radius: f32,
    },
    /// An ellipse.
    Ellipse {
        /// Half its width and height, mm.
        half: Vec2,
    },
    /// A rectangle with round corners.
    Box {
        /// Half its width and height, mm.
        half: Vec2,
        /// Radius of its corners, mm.
        radius: f32,
    },
    /// A regular polygon or a star, one corner up.
    Star {
        /// Number of corners.
        corners: u32,
        /// The edge from a corner inwards begins at this distance on the axis of the corner.
        outer: f32,
        /// End of that edge, on the axis of the inner corner.
        inner: Vec2,
        /// Radius of the corners, mm; the edges lie further inside by this length.
        radius: f32,
    },
    /// A ring.
    Ring {
        /// Radius of its middle line, mm.
        radius: f32,
        /// Half its width, mm.
        half_width: f32,
    },
    /// All points within a distance of a horizontal line.
    Capsule {
        /// Half the line's length, mm.
        half_length: f32,
        /// The distance, mm.
        radius: f32,
        /// True if the line is vertical.
        upright: bool,
    },
    /// A heart, tip down.
    Heart {
        /// mm per unit of the formula.
        scale: f32,
    },
    /// Two bars that cross.
    Cross {
        /// Half the lengths of the bars, mm.
        half: Vec2,
        /// Half their width, mm.
        half_width: f32,
        /// Radius of the outer corners, mm.
        radius: f32,
    },
}

/// Width and height of the heart of the formula, and the height of its middle above the tip.
const HEART: [f64; 3] = [1.207_106_8, 1.103_553_4, 0.551_776_7];

impl Figure {
    /// The regular polygon or star with `corners` on a circle and round corners. Its inner corners lie on a circle that
    /// is `inner` times as large; the default gives a polygon.
    pub fn star(corners: u32, radius: f64, inner: Option<f64>, rounding: f64) -> Self {
        let half = std::f64::consts::PI / f64::from(corners.max(2));
        let (sin, cos) = (libm::sin(half), libm::cos(half));
        let inner = inner.unwrap_or(cos) * radius;
        // The line from (radius, 0) to the inner corner, as n·p = c, moved inwards.
        let (from, to) = (DVec2::new(radius, 0.0), DVec2::new(cos, sin) * inner);
        let normal = -(to - from).perp().normalize();
        let c = normal.dot(from);
        let moved = (c - rounding).max(1e-6 * c);
        let axis = DVec2::new(cos, sin);
        Self::Star {
            corners,
            outer: narrow(moved / normal.x),
            inner: (axis * (moved / normal.dot(axis))).as_vec2(),
            radius: narrow(c - moved),
        }
    }

    /// The largest corner radius for [`Self::star`].
    pub fn star_room(corners: u32, radius: f64, inner: Option<f64>) -> f64 {
        let half = std::f64::consts::PI / f64::from(corners.max(2));
        let inner = inner.unwrap_or(libm::cos(half)) * radius;
        let to = DVec2::new(libm::cos(half), libm::sin(half)) * inner;
        let line = to - DVec2::new(radius, 0.0);
        (line.perp_dot(DVec2::new(radius, 0.0)) / line.length()).abs()
    }

    /// The heart that fits into a box.
    pub fn heart(size: DVec2) -> Self {
        Self::Heart { scale: narrow((size.x / HEART[0]).min(size.y / HEART[1])) }
    }

    /// The radius of a circle about the origin that contains it.
    pub fn bound(&self) -> f32 {
        match *self {
            Self::Circle { radius } => radius,
            Self::Ellipse { half } => half.max_element(),
            Self::Box { half, .. } => half.length(),
            Self::Star { outer, inner, radius, .. } => outer.max(inner.length()) + radius,
            Self::Ring { radius, half_width } => radius + half_width,
            Self::Capsule { half_length, radius, .. } => half_length + radius,
            Self::Heart { scale } => scale,
            Self::Cross { half, half_width, .. } => half.max_element() + half_width,
        }
    }

    /// The signed distance of a point, mm.
    #[inline(always)]
    pub fn distance(&self, x: f32, y: f32) -> f32 {
        match *self {
            Self::Circle { radius } => length(x, y) - radius,
            Self::Ellipse { half } => ellipse(x.abs(), y.abs(), half),
            Self::Box { half, radius } => rectangle(x, y, half - radius) - radius,
            Self::Star { corners, outer, inner, radius } => star(x, y, corners as f32, outer, inner) - radius,
            Self::Ring { radius, half_width } => (length(x, y) - radius).abs() - half_width,
            Self::Capsule { half_length, radius, upright } => {
                let (x, y) = if upright { (y, x) } else { (x, y) };
                length(max(x.abs() - half_length, 0.0), y) - radius
            }
            Self::Heart { scale } => {
                let unit = 1.0 / scale;
                heart(x.abs() * unit, narrow(HEART[2]) - y * unit) * scale
            }
            Self::Cross { half, half_width, radius } => {
                cross(x.abs(), y.abs(), half - radius, half_width - radius) - radius
            }
        }
    }
}

#[inline(always)]
fn length(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

#[inline(always)]
fn rectangle(x: f32, y: f32, half: Vec2) -> f32 {
    let (x, y) = (x.abs() - half.x, y.abs() - half.y);
    length(max(x, 0.0), max(y, 0.0)) + min(max(x, y), 0.0)
}

/// Distance in the first quadrant.
#[inline(always)]
fn ellipse(x: f32, y: f32, half: Vec2) -> f32 {
    let (a, b) = (half.x, half.y);
    let (mut tx, mut ty) = (std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2);
    let focus = (a - b) * (a + b);
    for _ in 0..6 {
        // The centre of curvature of the point (a tx, b ty); the next point lies on the ray from there through (x, y).
        let (ex, ey) = (focus * tx * tx * tx / a, -focus * ty * ty * ty / b);
        let (rx, ry) = (a * tx - ex, b * ty - ey);
        let (qx, qy) = (x - ex, y - ey);
        let rate = length(rx, ry) / max(length(qx, qy), f32::MIN_POSITIVE);
        tx = clamp((qx * rate + ex) / a, 0.0, 1.0);
        ty = clamp((qy * rate + ey) / b, 0.0, 1.0);
        let norm = 1.0 / max(length(tx, ty), f32::MIN_POSITIVE);
        (tx, ty) = (tx * norm, ty * norm);
    }
    let d = length(x - a * tx, y - b * ty);
    let inside = (x / a) * (x / a) + (y / b) * (y / b) < 1.0;
    if inside { -d } else { d }
}

/// The distance of a point from a segment.
#[inline(always)]
fn segment(p: Vec2, a: Vec2, b: Vec2) -> f32 {
    let (way, to) = (b - a, p - a);
    let t = clamp(to.dot(way) / max(way.length_squared(), f32::MIN_POSITIVE), 0.0, 1.0);
    let rest = to - way * t;
    length(rest.x, rest.y)
}

#[inline(always)]
fn star(x: f32, y: f32, corners: f32, outer: f32, inner: Vec2) -> f32 {
    let sector = std::f32::consts::TAU / corners;
    // From the nearest axis of a corner; the first one points up.
    let angle = math::atan2(x, -y) / sector;
    let (sin, cos) = math::sin_cos((angle - (angle + 0.5).floor()) * sector);
    let r = length(x, y);
    let (p, from) = (Vec2::new(r * cos, (r * sin).abs()), Vec2::new(outer, 0.0));
    let d = segment(p, from, inner);
    if (inner - from).perp_dot(p - from) > 0.0 { -d } else { d }
}

/// The formula's heart: tip at the origin, y up, right half.
#[inline(always)]
fn heart(x: f32, y: f32) -> f32 {
    if x + y > 1.0 {
        return length(x - 0.25, y - 0.75) - 0.5 * std::f32::consts::FRAC_1_SQRT_2;
    }
    let along = 0.5 * max(x + y, 0.0);
    let d = min(length(x, y - 1.0), length(x - along, y - along));
    if x > y { d } else { -d }
}

/// Distance in the first quadrant.
#[inline(always)]
fn cross(x: f32, y: f32, half: Vec2, w: f32) -> f32 {
    let p = Vec2::new(x, y);
    let corner = Vec2::splat(w);
    let across =
        min(segment(p, Vec2::new(half.x, 0.0), Vec2::new(half.x, w)), segment(p, Vec2::new(half.x, w), corner));
    let down = min(segment(p, Vec2::new(0.0, half.y), Vec2::new(w, half.y)), segment(p, Vec2::new(w, half.y), corner));
    let inside = (x < half.x && y < w) || (x < w && y < half.y);
    let d = min(across, down);
    if inside { -d } else { d }
}

/// A figure on the canvas, with the copies on a canvas that tiles.
#[derive(Clone, Debug)]
pub struct PlacedFigure {
    figure: Figure,
    /// Position of the first copy, mm.
    center: DVec2,
    /// Sine and cosine of its angle.
    turn: (f64, f64),
    /// Distance of two copies; 0 without copies.
    period: DVec2,
}

impl PlacedFigure {
    /// A figure about `center`, rotated from +x towards +y by an angle with this sine and cosine, on a canvas of `size`
    /// mm.
    pub fn new(figure: Figure, center: DVec2, turn: (f64, f64), (size, tiling): (DVec2, Tiling)) -> Self {
        let period = DVec2::new(if tiling.x { size.x } else { 0.0 }, if tiling.y { size.y } else { 0.0 });
        Self { figure, center, turn, period }
    }

    /// The centres of the copies that can be nearest to some point of a disc.
    fn copies(&self, middle: DVec2, radius: f64) -> Vec<DVec2> {
        let bound = f64::from(self.figure.bound());
        let home = |k: usize| {
            let (middle, center, period) = (middle[k], self.center[k], self.period[k]);
            if period > 0.0 { center + ((middle - center) / period).round() * period } else { center }
        };
        let nearest = DVec2::new(home(0), home(1));
        // Upper bound of the distance to the nearest copy; others may come as close.
        let far = (nearest - middle).length() + bound + radius;
        let reach = far + bound + radius;
        let count = |k: usize| if self.period[k] > 0.0 { (reach / self.period[k]).ceil() } else { 0.0 };
        let (nx, ny) = (count(0), count(1));
        let steps = |n: f64| std::iter::successors(Some(-n), move |i| (*i < n).then_some(i + 1.0));
        let all = steps(ny).flat_map(|j| steps(nx).map(move |i| DVec2::new(i, j)));
        let centers = all.map(|step| nearest + step * self.period);
        centers.filter(|center| (*center - middle).length() - bound - radius <= far * (1.0 + 1e-9)).collect()
    }

    /// Fills a window with signed distances. O(pixels · copies near).
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn fill(&self, frame: &Frame, out: &mut [f32]) {
        let rect = frame.window;
        let (first, last) = (
            frame.center(rect.x, rect.y),
            frame.center(rect.x + rect.width.cast_signed() - 1, rect.y + rect.height.cast_signed() - 1),
        );
        let (first, last) = (DVec2::from(first), DVec2::from(last));
        let centers = self.copies(0.5 * (first + last), 0.5 * (last - first).length());
        for (n, center) in centers.into_iter().enumerate() {
            simd::dispatch(
                #[inline(always)]
                || self.one(frame, center, n == 0, out),
            );
        }
    }

    #[inline(always)]
    fn one(&self, frame: &Frame, center: DVec2, first: bool, out: &mut [f32]) {
        let (rect, (sin, cos)) = (frame.window, self.turn);
        for (row, y) in out.chunks_exact_mut(rect.columns().max(1)).zip(rect.y..).take(rect.rows()) {
            let dy = frame.origin[1] + (f64::from(y) + 0.5) * frame.step[1] - center.y;
            for (out, x) in row.iter_mut().zip(rect.x..) {
                let dx = frame.origin[0] + (f64::from(x) + 0.5) * frame.step[0] - center.x;
                #[expect(clippy::cast_possible_truncation, reason = "places near a figure need no more than f32")]
                let (u, v) = ((cos * dx + sin * dy) as f32, (cos * dy - sin * dx) as f32);
                let d = self.figure.distance(u, v);
                *out = if first { d } else { min(d, *out) };
            }
        }
    }
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of a test")]
mod tests {
    use super::*;
    use shibo_value::Window;

    /// Distance by brute force: the nearest of many points on the outline.
    fn nearest(outline: &[DVec2], p: DVec2) -> f64 {
        outline.iter().map(|q| (*q - p).length()).fold(f64::INFINITY, f64::min)
    }

    /// Points along the sides of a polygon.
    fn polygon(corners: &[DVec2]) -> Vec<DVec2> {
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        sides.flat_map(|(a, b)| (0..2000).map(move |k| a.lerp(*b, f64::from(k) / 2000.0))).collect()
    }

    fn within(corners: &[DVec2], p: DVec2) -> bool {
        let mut inside = false;
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
                inside = !inside;
            }
        }
        inside
    }

    /// Compares with the outline of a polygon, offset by `radius`.
    fn agrees(figure: Figure, corners: &[DVec2], radius: f64) {
        let outline = polygon(corners);
        for k in 0..400 {
            let p = DVec2::new(f64::from(k % 20) - 9.6, f64::from(k / 20) - 9.7) * 0.7;
            let sign = if within(corners, p) { -1.0 } else { 1.0 };
            let want = sign * nearest(&outline, p) - radius;
            let got = f64::from(figure.distance(p.as_vec2().x, p.as_vec2().y));
            assert!((want - got).abs() < 0.012, "{figure:?} at {p}: {got}, not {want}");
        }
    }

    #[test]
    fn matches_distances_of_outlines() {
        let at = |list: &[(f64, f64)]| list.iter().map(|(x, y)| DVec2::new(*x, *y)).collect::<Vec<_>>();
        let half = Vec2::new(4.0, 2.0);
        agrees(Figure::Box { half, radius: 0.0 }, &at(&[(4.0, 2.0), (-4.0, 2.0), (-4.0, -2.0), (4.0, -2.0)]), 0.0);
        agrees(Figure::Box { half, radius: 0.5 }, &at(&[(3.5, 1.5), (-3.5, 1.5), (-3.5, -1.5), (3.5, -1.5)]), 0.5);
        let arms = [(4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (-1.0, 3.0), (-1.0, 1.0), (-4.0, 1.0)];
        let arms: Vec<_> = arms.iter().copied().chain(arms.iter().map(|(x, y)| (-x, -y))).collect();
        agrees(Figure::Cross { half: Vec2::new(4.0, 3.0), half_width: 1.0, radius: 0.0 }, &at(&arms), 0.0);
        let oval: Vec<_> = (0..720).map(|k| f64::from(k).to_radians() * 0.5).collect();
        let oval: Vec<_> = oval.iter().map(|t| DVec2::new(5.0 * t.cos(), 1.5 * t.sin())).collect();
        agrees(Figure::Ellipse { half: Vec2::new(5.0, 1.5) }, &oval, 0.0);
        let turned: Vec<_> = oval.iter().map(|p| DVec2::new(p.y, p.x)).collect();
        agrees(Figure::Ellipse { half: Vec2::new(1.5, 5.0) }, &turned, 0.0);
        agrees(
            Figure::Capsule { half_length: 3.0, radius: 1.0, upright: true },
            &at(&[(-1e-4, -3.0), (1e-4, -3.0), (1e-4, 3.0), (-1e-4, 3.0)]),
            1.0,
        );
    }

    #[test]
    fn polygons_and_stars_have_their_corners() {
        let ring = |n: u32, r: f64, turn: f64| {
            let corner = move |k: u32| {
                let t = (f64::from(k) / f64::from(n) + turn) * std::f64::consts::TAU;
                DVec2::new(r * t.sin(), -r * t.cos())
            };
            (0..n).map(corner).collect::<Vec<_>>()
        };
        for n in [3, 5, 8] {
            agrees(Figure::star(n, 5.0, None, 0.0), &ring(n, 5.0, 0.0), 0.0);
            let (outer, inner) = (ring(n, 5.0, 0.0), ring(n, 2.0, 0.5 / f64::from(n)));
            let star: Vec<_> = outer.iter().zip(&inner).flat_map(|(a, b)| [*a, *b]).collect();
            agrees(Figure::star(n, 5.0, Some(0.4), 0.0), &star, 0.0);
        }
        // Sides stay where they were when corners are rounded.
        let (sharp, round) = (Figure::star(4, 5.0, None, 0.0), Figure::star(4, 5.0, None, 1.0));
        assert!((sharp.distance(2.0, 2.0) - round.distance(2.0, 2.0)).abs() < 1e-5);
        assert!(round.distance(0.0, -5.0) > 0.3);
        assert!((Figure::star_room(4, 5.0, None) - 5.0 * 0.5f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn the_heart_fits_its_box() {
        let heart = Figure::heart(DVec2::new(12.0, 100.0));
        let (mut low, mut high) = (Vec2::splat(99.0), Vec2::splat(-99.0));
        for k in 0..400 * 400 {
            let p = Vec2::new((k % 400) as f32 - 199.5, (k / 400) as f32 - 199.5) * 0.05;
            if heart.distance(p.x, p.y) < 0.0 {
                (low, high) = (low.min(p), high.max(p));
            }
        }
        assert!((high.x - 6.0).abs() < 0.06 && (low.x + 6.0).abs() < 0.06, "{low} {high}");
        assert!((high.y + low.y).abs() < 0.06, "{low} {high}");
        assert!(heart.distance(0.0, 5.4) < 0.0 && heart.distance(1.0, 5.4) > 0.0, "tip down");
    }

    #[test]
    fn copies_repeat_with_the_canvas() {
        let size = DVec2::new(20.0, 16.0);
        let figure = Figure::Capsule { half_length: 12.0, radius: 1.5, upright: false };
        let (sin, cos) = (30.0f64.to_radians().sin(), 30.0f64.to_radians().cos());
        let center = DVec2::new(3.0, 14.0);
        let placed = PlacedFigure::new(figure, center, (sin, cos), (size, Tiling::BOTH));
        let frame = Frame::new(Window::of(-7, 5, 30, 21), [0.9, 0.8]);
        let mut out = vec![0.0; 30 * 21];
        placed.fill(&frame, &mut out);
        for (k, got) in (0..).zip(&out) {
            let p = DVec2::from(frame.center(-7 + k % 30, 5 + k / 30));
            let mut want = f32::INFINITY;
            for i in -6..=6 {
                for j in -6..=6 {
                    let d = p - center - DVec2::new(f64::from(i), f64::from(j)) * size;
                    let (u, v) = (cos * d.x + sin * d.y, cos * d.y - sin * d.x);
                    want = want.min(figure.distance(u as f32, v as f32));
                }
            }
            assert!((got - want).abs() < 1e-4, "{p}: {got} {want}");
        }
    }
}
