//! The shapes of a view, and the camera that looks at them. Vectors have x to the right, y down and z to the viewer.
use super::Shape;
use crate::ground::math::{atan2, max};

/// Distance of the camera from the middle of the shape, whose radius is about 1.
const FAR: f32 = 5.2;
/// Half the width of the picture at distance 1.
const WIDE: f32 = 0.235;

/// Half the longer side of the plane.
const LONG: f32 = 1.15;

/// A place where a ray meets the shape.
pub(super) struct Hit {
    /// Place on the material, mm.
    pub(super) place: [f32; 2],
    /// Normal of the shape.
    pub(super) normal: [f32; 3],
    /// Directions on the shape of the material's +x and +y.
    pub(super) axes: [[f32; 3]; 2],
    /// Direction to the viewer.
    pub(super) view: [f32; 3],
    /// The share of the sky that the shape itself leaves free.
    pub(super) open: f32,
}

impl Hit {
    /// From a vector of the material to one of the camera; its length becomes 1.
    pub(super) fn turned(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        unit([0, 1, 2].map(|k| x * self.axes[0][k] + y * self.axes[1][k] + z * self.normal[k]))
    }
}

/// A camera before a shape.
pub(super) struct Camera<'a> {
    shape: Shape<'a>,
    /// Millimetres of the material for a length of 1.
    scale: f32,
    /// Middle of the canvas, mm.
    middle: [f32; 2],
    /// The directions of a cube's or plane's own x, y and z.
    axes: [[f32; 3]; 3],
    /// Half the width and height of the plane.
    half: [f32; 2],
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: [f32; 3]) -> [f32; 3] {
    let long = 1.0 / max(dot(v, v).sqrt(), 1e-12);
    v.map(|c| c * long)
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl<'a> Camera<'a> {
    /// A material that repeats covers the ball 1.3 times from edge to edge; one that does not covers it once.
    #[expect(clippy::cast_possible_truncation, reason = "sizes of pictures")]
    pub(super) fn new(shape: Shape<'a>, size_mm: [f64; 2], repeats: [bool; 2]) -> Self {
        let [w, h] = size_mm.map(|mm| mm as f32);
        let covers = if repeats == [true, true] { 1.3 * w.max(h) } else { w.min(h) };
        let scale = match shape {
            Shape::Ball => covers / std::f32::consts::PI,
            // An edge of the cube has a length of 1.1.
            Shape::Cube => 0.9 * covers / 1.1,
            Shape::Plane => w.max(h) / (2.0 * LONG),
            Shape::Body(_) => 1.0,
        };
        // A material that does not repeat is a plane with the shape of the canvas.
        let half = if repeats == [true, true] { [LONG; 2] } else { [w, h].map(|side| LONG * side / w.max(h)) };
        let up = match shape {
            // Seen from above, and from beside an edge.
            Shape::Ball | Shape::Cube | Shape::Body(_) => unit([0.0, -0.88, 0.48]),
            Shape::Plane => unit([0.0, -0.7, 0.72]),
        };
        let turn = if matches!(shape, Shape::Cube) { [0.8, 0.6] } else { [1.0, 0.0] };
        let ahead = cross([1.0, 0.0, 0.0], up);
        let x = [0, 1, 2].map(|k| turn[0] * f32::from(u8::from(k == 0)) + turn[1] * ahead[k]);
        let axes = [x, cross(up, x), up];
        Self { shape, scale, middle: [0.5 * w, 0.5 * h], axes, half }
    }

    /// The place that is seen at a point of the picture, -1..1 with y down.
    pub(super) fn meet(&self, [x, y]: [f32; 2]) -> Option<Hit> {
        let ray = unit([x * WIDE, y * WIDE, -1.0]);
        let eye = [0.0, 0.0, FAR];
        let view = ray.map(|c| -c);
        match self.shape {
            Shape::Ball => self.ball(eye, ray, view),
            Shape::Cube => self.cube(eye, ray, view),
            Shape::Plane => self.plane(eye, ray, view),
            Shape::Body(body) => body.meet(eye, ray, view),
        }
    }

    /// The material lies around the place that faces the camera: distances from it are true along the ball.
    fn ball(&self, eye: [f32; 3], ray: [f32; 3], view: [f32; 3]) -> Option<Hit> {
        let along = -dot(eye, ray);
        let left = 1.0 - dot(eye, eye) + along * along;
        if left < 0.0 {
            return None;
        }
        let t = along - left.sqrt();
        let n = unit([0, 1, 2].map(|k| eye[k] + t * ray[k]));
        let flat = (n[0] * n[0] + n[1] * n[1]).sqrt();
        let (c, s) = if flat > 1e-6 { (n[0] / flat, n[1] / flat) } else { (1.0, 0.0) };
        let away = atan2(flat, n[2]) * self.scale;
        let (out, round) = ([n[2] * c, n[2] * s, -flat], [-s, c, 0.0]);
        let axes = [[c, -s], [s, c]].map(|[a, b]| [0, 1, 2].map(|k| a * out[k] + b * round[k]));
        Some(Hit { place: [self.middle[0] + away * c, self.middle[1] + away * s], normal: n, axes, view, open: 1.0 })
    }

    fn cube(&self, eye: [f32; 3], ray: [f32; 3], view: [f32; 3]) -> Option<Hit> {
        const HALF: f32 = 0.55;
        let (from, way) = (self.axes.map(|axis| dot(axis, eye)), self.axes.map(|axis| dot(axis, ray)));
        let mut best: Option<(f32, usize, f32)> = None;
        for k in 0..3 {
            let side = if way[k] > 0.0 { -1.0 } else { 1.0 };
            if way[k].abs() < 1e-9 {
                continue;
            }
            let t = (side * HALF - from[k]) / way[k];
            let inside = (0..3).all(|m| m == k || (from[m] + t * way[m]).abs() <= HALF);
            if inside && best.is_none_or(|(nearest, ..)| t < nearest) {
                best = Some((t, k, side));
            }
        }
        let (t, k, side) = best?;
        let at = [0, 1, 2].map(|m| from[m] + t * way[m]);
        let normal = self.axes[k].map(|c| c * side);
        // On the sides of the cube the material's y points down; on its top, to the viewer.
        let down = if k == 2 { self.axes[1] } else { self.axes[2].map(|c| -c) };
        let right = cross(down, normal);
        let point = [0, 1, 2].map(|m| (0..3).map(|axis| at[axis] * self.axes[axis][m]).sum::<f32>());
        // Each face shows another part.
        let shift = [0.0, 0.37, 0.71][k] * self.middle[0];
        let place =
            [dot(point, right) * self.scale + self.middle[0] + shift, dot(point, down) * self.scale + self.middle[1]];
        Some(Hit { place, normal, axes: [right, down], view, open: 1.0 })
    }

    fn plane(&self, eye: [f32; 3], ray: [f32; 3], view: [f32; 3]) -> Option<Hit> {
        let normal = self.axes[2];
        let down = dot(normal, ray);
        if down >= -1e-6 {
            return None;
        }
        let t = -dot(normal, eye) / down;
        let point = [0, 1, 2].map(|k| eye[k] + t * ray[k]);
        let axes = [self.axes[0], self.axes[1]];
        let at = axes.map(|axis| dot(point, axis));
        if at[0].abs() > self.half[0] || at[1].abs() > self.half[1] {
            return None;
        }
        Some(Hit { place: [0, 1].map(|k| self.middle[k] + at[k] * self.scale), normal, axes, view, open: 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On every shape the axes of the material and the normal form a frame that faces the viewer, and a step along an
    /// axis is that step on the material.
    #[test]
    fn frames_follow_the_shapes() {
        for shape in [Shape::Ball, Shape::Cube, Shape::Plane] {
            let camera = Camera::new(shape, [40.0, 40.0], [true, true]);
            let mut met = 0;
            for i in 0..40_u8 {
                for j in 0..40_u8 {
                    let at = [i, j].map(|k| 0.05 * f32::from(k) - 0.975);
                    let Some(hit) = camera.meet(at) else { continue };
                    met += 1;
                    let [x, y] = hit.axes;
                    for (a, b) in [(x, y), (x, hit.normal), (y, hit.normal)] {
                        assert!(dot(a, b).abs() < 1e-3 && (dot(a, a) - 1.0).abs() < 1e-3, "{shape:?} {at:?}");
                    }
                    assert!(dot(hit.normal, hit.view) > -1e-3, "{shape:?} {at:?}");
                    // x to the right, y down, z to the viewer.
                    assert!(dot(cross(x, y), hit.normal) > 0.999, "{shape:?} {at:?}");
                }
            }
            assert!(met > 400, "{shape:?}: {met}");
        }
    }

    #[test]
    fn material_is_upright() {
        for shape in [Shape::Ball, Shape::Cube, Shape::Plane] {
            let camera = Camera::new(shape, [40.0, 40.0], [true, true]);
            let at = |x: f32, y: f32| camera.meet([x, y]).unwrap().place;
            assert!(at(-0.1, 0.4)[0] < at(0.0, 0.4)[0], "{shape:?}");
            assert!(at(0.1, 0.3)[1] < at(0.1, 0.4)[1], "{shape:?}");
        }
    }
}
