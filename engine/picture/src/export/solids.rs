//! Simple shapes, one metre wide, that show a material in its real size: texture coordinates are metres along the
//! surface.
use super::shape::{MeshPart, Shape};
use glam::{DVec2, Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A built-in shape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SimpleShape {
    /// A square of one metre that faces up.
    #[default]
    Plane,
    /// A sphere of one metre diameter, with the poles at top and bottom.
    Sphere,
    /// An upright cylinder, one metre wide and high.
    Cylinder,
    /// A cube of one metre.
    Cube,
}

impl SimpleShape {
    /// All of them, by name.
    pub const ALL: [(&'static str, Self); 4] =
        [("Plane", Self::Plane), ("Sphere", Self::Sphere), ("Cylinder", Self::Cylinder), ("Cube", Self::Cube)];

    /// Name in graph files.
    pub const fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }
}

/// Number of quads around a sphere or a cylinder.
const AROUND: u16 = 96;
/// Number of quads from pole to pole.
const DOWN: u16 = 48;

/// A mesh built from patches of quads.
struct Patches(Shape);

impl Patches {
    fn new(name: &str, size_mm: DVec2) -> Self {
        let part = MeshPart { name: name.into(), indices: Vec::new() };
        Self(Shape { parts: vec![part], repeats: Some(1000.0 / size_mm), ..Shape::default() })
    }

    /// Adds `columns` by `rows` quads. `vertex` takes the fractions of the way to the right and down, as seen from
    /// outside, and returns position, normal, direction to the right, and coordinates.
    fn add(&mut self, (columns, rows): (u16, u16), vertex: impl Fn(f32, f32) -> (Vec3, Vec3, Vec3, Vec2)) {
        let mut numbers = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                let (right, down) = (f32::from(column) / f32::from(columns), f32::from(row) / f32::from(rows));
                let (at, normal, along, uv) = vertex(right, down);
                numbers.push(self.0.add(at, normal, along.extend(1.0), uv));
            }
        }
        let number =
            |column: u16, row: u16| numbers[usize::from(row) * (usize::from(columns) + 1) + usize::from(column)];
        for row in 0..rows {
            for column in 0..columns {
                let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| number(column + x, row + y));
                for triangle in [[a, d, c], [a, c, b]] {
                    let [p, q, r] = triangle.map(|n| self.0.positions[n as usize]);
                    // At a pole, one side of a quad has no length.
                    if (q - p).cross(r - p).length() > 1e-9 {
                        self.0.parts[0].indices.extend(triangle);
                    }
                }
            }
        }
    }
}

impl Shape {
    /// A simple shape, on which a canvas of `size_mm` shows in its real size.
    pub fn simple(shape: SimpleShape, size_mm: DVec2) -> Self {
        match shape {
            SimpleShape::Plane => Self::plane(size_mm),
            SimpleShape::Sphere => Self::sphere(size_mm),
            SimpleShape::Cylinder => Self::cylinder(size_mm),
            SimpleShape::Cube => Self::cube(size_mm),
        }
    }

    fn sphere(size_mm: DVec2) -> Self {
        let mut patches = Patches::new("sphere", size_mm);
        patches.add((AROUND, DOWN), |right, down| {
            let (turn, fall) = (right * TAU, down * PI);
            // Exactly zero at the poles, so that degenerate triangles are found there.
            let radius = if down == 0.0 || down == 1.0 { 0.0 } else { libm::sinf(fall) };
            let normal = Vec3::new(radius * libm::sinf(turn), libm::cosf(fall), radius * libm::cosf(turn));
            (0.5 * normal, normal, Vec3::new(libm::cosf(turn), 0.0, -libm::sinf(turn)), 0.5 * Vec2::new(turn, fall))
        });
        patches.0
    }

    fn cylinder(size_mm: DVec2) -> Self {
        let mut patches = Patches::new("cylinder", size_mm);
        patches.add((AROUND, 1), |right, down| {
            let turn = right * TAU;
            let normal = Vec3::new(libm::sinf(turn), 0.0, libm::cosf(turn));
            let at = 0.5 * normal + Vec3::Y * (0.5 - down);
            (at, normal, Vec3::new(libm::cosf(turn), 0.0, -libm::sinf(turn)), Vec2::new(0.5 * turn, down))
        });
        for up in [1.0, -1.0] {
            patches.add((AROUND, 1), |right, down| {
                // Seen from outside, with the centre up, the rim runs to the right.
                let turn = right * TAU;
                let (x, z) = (0.5 * down * libm::sinf(turn), 0.5 * down * up * libm::cosf(turn));
                let at = Vec3::new(x, 0.5 * up, z);
                (at, Vec3::Y * up, Vec3::X, Vec2::new(0.5 + x, 0.5 + up * z))
            });
        }
        patches.0
    }

    fn cube(size_mm: DVec2) -> Self {
        let mut patches = Patches::new("cube", size_mm);
        let sides = (0_u8..4).map(|n| {
            let turn = f32::from(n) * FRAC_PI_2;
            (Vec3::new(libm::cosf(turn), 0.0, -libm::sinf(turn)).round(), Vec3::NEG_Y)
        });
        for (right, down) in sides.chain([(Vec3::X, Vec3::Z), (Vec3::X, Vec3::NEG_Z)]) {
            let normal = down.cross(right);
            patches.add((1, 1), |x, y| {
                let at = 0.5 * normal + (x - 0.5) * right + (y - 0.5) * down;
                (at, normal, right, Vec2::new(x, y))
            });
        }
        patches.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_closed_face_outwards_and_measure_metres() {
        let size = DVec2::splat(100.0);
        let measures = [(1.0, 1e-6), (PI, 0.01), (1.5 * PI, 0.01), (6.0, 1e-5)];
        for ((word, simple), (area, tolerance)) in SimpleShape::ALL.into_iter().zip(measures) {
            assert_eq!(simple.name(), word);
            let shape = Shape::simple(simple, size);
            let name = shape.parts[0].name.clone();
            let mut found = 0.0;
            for triangle in shape.parts[0].indices.as_chunks::<3>().0 {
                let [a, b, c] = triangle.map(|n| n as usize);
                let at = |n: usize| shape.positions[n];
                let cross = (at(b) - at(a)).cross(at(c) - at(a));
                found += 0.5 * cross.length();
                for n in [a, b, c] {
                    assert!(cross.normalize().dot(shape.normals[n]) > 0.99, "{name} faces inwards at {:?}", at(n));
                    assert!((shape.normals[n].length() - 1.0).abs() < 1e-5);
                    assert!(shape.normals[n].dot(shape.tangents[n].truncate()).abs() < 1e-5, "{name}");
                }
                // The tangent points in the direction in which u grows. Along it coordinates are metres, except near a
                // pole.
                let (e, f) = (at(b) - at(a), at(c) - at(a));
                let (p, q) = (shape.uvs[b] - shape.uvs[a], shape.uvs[c] - shape.uvs[a]);
                let det = p.x * q.y - q.x * p.y;
                let along = (e * q.y - f * p.y) / det;
                assert!(along.normalize().dot(shape.tangents[a].truncate()) > 0.9, "{name}: {along}");
                let down = (f * p.x - e * q.x) / det;
                assert!((down.length() - 1.0).abs() < 0.02, "{name}: a metre down is {}", down.length());
            }
            assert!((found - area).abs() < tolerance * area, "{name}: {found} square metres instead of {area}");
            assert_eq!(shape.repeats, Some(DVec2::splat(10.0)));
        }
    }
}
