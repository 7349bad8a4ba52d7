//! Direction fields that follow paths, blended by distance between several paths.
//!
//! Each path is a row of short needles. The direction at a point is the sum of the needles within reach, each weighted
//! by its length and by (1 - (d/reach)²)² / (d² + s²), where d is its distance and s the spacing of needles. O(pixels ·
//! needles within reach).
use super::index::{Index, corners};
use crate::ground::math;
use crate::ground::number::narrow;
use crate::ground::window::{Frame, WindowExt as _, index};
use glam::DVec2;
use shibo_value::Path;

/// Number of needles per reach.
const NEEDLES: f64 = 16.0;

/// Maximum number of needles.
const MOST: f64 = 4e6;

/// A short piece of a path.
#[derive(Clone, Copy, Debug)]
struct Needle {
    middle: DVec2,
    /// Its direction, times its length relative to the usual length.
    way: [f32; 2],
    /// The same with twice the angle.
    twice: [f32; 2],
}

/// The needles of a path.
#[derive(Clone, Debug)]
pub struct Flow {
    needles: Vec<Needle>,
    index: Index,
    reach: f64,
    soft: f64,
}

/// The flow at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flowing {
    /// The sum of directions.
    pub way: [f32; 2],
    /// The sum of weights.
    pub weight: f32,
}

impl Flow {
    /// Cuts a path into needles. O(needles).
    pub fn new(path: &Path, reach: f64) -> Self {
        let total: f64 = path.curves.iter().map(shibo_value::Polyline::length).sum();
        let soft = (reach / NEEDLES).max(total / MOST);
        let mut needles = Vec::new();
        for [a, b] in path.pieces() {
            let length = a.distance(b);
            let way = (b - a) / length;
            let count = (length / soft).ceil().max(1.0);
            let share = narrow(length / count / soft);
            let [x, y] = way.as_vec2().to_array();
            let twice = [(x * x - y * y) * share, 2.0 * x * y * share];
            let mut k = 0.0;
            while k < count {
                let middle = a + (b - a) * ((k + 0.5) / count);
                needles.push(Needle { middle, way: [x * share, y * share], twice });
                k += 1.0;
            }
        }
        let boxes: Vec<[DVec2; 2]> = needles.iter().map(|needle| [needle.middle; 2]).collect();
        Self { index: Index::new(&boxes, (path.size_mm, path.periodic)), needles, reach, soft }
    }

    /// Approximate memory in bytes.
    pub fn bytes(&self) -> usize {
        self.needles.len() * (size_of::<Needle>() + 24)
    }

    /// Fills a window, row by row. With `lines`, opposite directions are equal, and sums are of twice the angle.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn fill(&self, stop: &dyn Fn() -> bool, frame: &Frame, lines: bool, out: &mut [Flowing]) {
        out.fill(Flowing::default());
        let (reach, rect) = (narrow(self.reach), frame.window);
        let [low, high] = corners(frame);
        let (inverse, soft) = (1.0 / (reach * reach), narrow(self.soft * self.soft));
        for (n, near) in self.index.near(low - self.reach, high + self.reach).into_iter().enumerate() {
            if n % 64 == 0 && stop() {
                return;
            }
            let needle = &self.needles[near.id as usize];
            let (middle, way) = (needle.middle + near.shift, if lines { needle.twice } else { needle.way });
            let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
            for j in 0..rect.rows() {
                let y = narrow(frame.center(rect.x, rect.y + index(j))[1] - middle.y);
                let rest = reach * reach - y * y;
                if rest <= 0.0 {
                    continue;
                }
                let half = f64::from(rest.sqrt());
                let place = |x: f64| (x - frame.origin[0]) / frame.step[0] - 0.5 - f64::from(rect.x);
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the window")]
                let pixel = |x: f64| x.clamp(0.0, rect.columns() as f64) as usize;
                let columns = pixel(place(middle.x - half).ceil())..pixel(place(middle.x + half).floor() + 1.0);
                for i in columns {
                    let x = narrow(frame.center(rect.x + index(i), rect.y)[0] - middle.x);
                    let d2 = x * x + y * y;
                    let fade = (1.0 - d2 * inverse).max(0.0);
                    let weight = fade * fade / (d2 + soft);
                    let out = &mut out[j * rect.columns() + i];
                    out.way[0] += weight * way[0];
                    out.way[1] += weight * way[1];
                    out.weight += weight * length;
                }
            }
        }
        if lines {
            for out in out.iter_mut().filter(|out| out.weight > 0.0) {
                let size = (out.way[0] * out.way[0] + out.way[1] * out.way[1]).sqrt();
                let half = 0.5 * math::atan2(out.way[1], out.way[0]);
                let (sin, cos) = math::sin_cos(half);
                out.way = [cos * size, sin * size];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::pen::Pen;
    use shibo_value::{Tiling, Window};

    fn path(lines: &[[(f64, f64); 2]], tiling: Tiling) -> Path {
        let mut pen = Pen::default();
        for [a, b] in lines {
            pen.move_to((*a).into());
            pen.line_to((*b).into());
        }
        pen.finish(DVec2::new(20.0, 20.0), tiling)
    }

    fn at(flow: &Flow, lines: bool, x: f64, y: f64) -> Flowing {
        let frame = Frame { window: Window::of(0, 0, 1, 1), origin: [x - 0.05, y - 0.05], step: [0.1; 2] };
        let mut out = [Flowing::default()];
        flow.fill(&|| false, &frame, lines, &mut out);
        out[0]
    }

    fn angle(flowing: Flowing) -> f32 {
        flowing.way[1].atan2(flowing.way[0]).to_degrees()
    }

    #[test]
    fn one_path_is_followed_and_ends_at_its_reach() {
        let flow = Flow::new(&path(&[[(2.0, 5.0), (12.0, 15.0)]], Tiling::NONE), 4.0);
        for (x, y) in [(7.0, 10.0), (8.5, 10.0), (6.0, 11.5), (2.0, 4.0)] {
            assert!((angle(at(&flow, false, x, y)) - 45.0).abs() < 0.1);
        }
        assert_eq!(at(&flow, false, 15.0, 5.0), Flowing::default());
    }

    #[test]
    fn between_two_paths_directions_mix_by_distance() {
        // One path goes right, the other down to the right; they are symmetric about the bisector.
        let lines = [[(-50.0, 5.0), (50.0, 5.0)], [(40.0, 55.0), (-30.0, -15.0)]];
        let flow = Flow::new(&path(&lines, Tiling::NONE), 8.0);
        // A point on the bisector of the lines through (-10, 5), equally far from both: after turning the second line
        // around, the direction is between 0° and 45°.
        let p = DVec2::new(-10.0, 5.0) + DVec2::from_angle(22.5f64.to_radians()) * 8.0;
        assert!((angle(at(&flow, true, p.x, p.y)) - 22.5).abs() < 0.2, "{}", angle(at(&flow, true, p.x, p.y)));
        // Nearer to the first line, the direction is nearer to its direction.
        let near = angle(at(&flow, true, p.x, p.y - 1.5));
        assert!(near > 0.0 && near < 18.0, "{near}");
        // Without `lines`, a path and its reverse cancel out.
        let both = Flow::new(&path(&[[(0.0, 5.0), (20.0, 5.0)], [(20.0, 9.0), (0.0, 9.0)]], Tiling::NONE), 6.0);
        let middle = at(&both, false, 10.0, 7.0);
        assert!(middle.way[0].abs() < 1e-3 * middle.weight && middle.weight > 0.0);
    }

    #[test]
    fn windows_are_crops_and_repeat() {
        let flow = Flow::new(&path(&[[(15.0, 3.0), (27.0, 9.0)], [(3.0, 18.0), (9.0, 23.0)]], Tiling::BOTH), 5.0);
        let fill = |rect: Window| {
            let mut out = vec![Flowing::default(); rect.len()];
            flow.fill(&|| false, &Frame::new(rect, [0.5; 2]), true, &mut out);
            out
        };
        let whole = fill(Window::of(-10, -10, 100, 100));
        for (k, v) in fill(Window::of(3, 7, 30, 20)).iter().enumerate() {
            assert_eq!(*v, whole[(17 + k / 30) * 100 + 13 + k % 30]);
        }
        for (a, b) in fill(Window::of(0, 0, 40, 40)).iter().zip(fill(Window::of(40, -40, 40, 40))) {
            assert!((a.weight - b.weight).abs() < 1e-3 * (1.0 + a.weight), "{a:?} {b:?}");
        }
    }
}
