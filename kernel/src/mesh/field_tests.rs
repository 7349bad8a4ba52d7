use super::{FieldSpec, Principal, Wish, tangent_field};
use crate::ground::hash::Hash;
use crate::ground::stop::NEVER;
use crate::mesh::fixture::{cube, plane, sphere, torus};
use glam::{DVec3, Vec3};
use shibo_value::{Frames, Mesh};
use std::sync::Arc;

fn spec(wish: Wish) -> FieldSpec {
    FieldSpec { wish, smooth: 0.0, symmetry: 1, turn: 0.0, length: 1.0 }
}

fn of(mesh: &Arc<Mesh>, spec: &FieldSpec) -> Frames {
    tangent_field(mesh, spec, NEVER).expect("a field")
}

fn degrees(a: Vec3, b: DVec3) -> f64 {
    let a = a.as_dvec3();
    libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees()
}

/// Row C21: every kind of field has as many singular points as the topology of the surface requires.
#[test]
fn sums_singular_points_to_euler_characteristic() {
    let wishes = [
        Wish::Direction(DVec3::new(0.3, -0.2, 0.9)),
        Wish::Around(DVec3::new(0.1, 0.2, 1.0), DVec3::new(3.0, 1.0, 0.0)),
        Wish::Smooth(Hash::new(7)),
        Wish::Curvature(Principal::Max),
    ];
    for (mesh, euler) in [(cube().mesh, 2), (sphere().mesh, 2), (torus(30, 15).mesh, 0)] {
        for wish in &wishes {
            for symmetry in [1u8, 2, 4] {
                let frames = of(&mesh, &FieldSpec { symmetry, ..spec(wish.clone()) });
                let sum: i32 = frames.singular.iter().map(|s| i32::from(s.1)).sum();
                assert_eq!(sum, euler * i32::from(frames.symmetry), "{wish:?} {symmetry}: {:?}", frames.singular);
                assert!(frames.t.iter().all(|t| (t.length() - 1.0).abs() < 1e-5));
                // Directions near a singular point have a turn along some edge path from it.
                assert!(frames.symmetry == 1 || frames.singular.is_empty() || !frames.turns.is_empty() || euler == 2);
            }
        }
    }
}

#[test]
fn follows_torus_exactly_without_singular_points() {
    let mesh = torus(48, 24).mesh;
    let frames = of(&mesh, &spec(Wish::Around(DVec3::Z, DVec3::ZERO)));
    assert!(frames.singular.is_empty());
    for (t, place) in frames.t.iter().zip(&mesh.positions) {
        let wanted = DVec3::Z.cross(place.as_dvec3());
        assert!(degrees(*t, wanted) < 0.1, "{t} {wanted}");
    }
    // Rotated by a quarter turn from t towards b, and twice as long.
    let turned = of(
        &mesh,
        &FieldSpec { turn: std::f64::consts::FRAC_PI_2, length: 2.0, ..spec(Wish::Around(DVec3::Z, DVec3::ZERO)) },
    );
    let normals = crate::mesh::topology::smooth_normals(&mesh);
    for ((t, plain), n) in turned.t.iter().zip(&frames.t).zip(&normals) {
        assert!(t.distance(plain.cross(*n) * 2.0) < 1e-4, "b = t × n");
    }
}

/// Row C20: drawn strokes are kept.
#[test]
fn strokes_are_kept_and_continued() {
    let mesh = plane("plane_one").mesh;
    let stroke = vec![DVec3::new(8.0, 8.0, 0.5), DVec3::new(24.0, 40.0, 0.0)];
    let frames = of(&mesh, &spec(Wish::Strokes(vec![stroke.clone()], DVec3::X)));
    let along = stroke[1] - DVec3::new(8.0, 8.0, 0.0);
    // On a plane, one stroke determines everything.
    assert!(frames.t.iter().all(|t| degrees(*t, along) < 1.0));
    let other = vec![DVec3::new(56.0, 8.0, 0.0), DVec3::new(56.0, 56.0, 0.0)];
    let frames = of(&mesh, &spec(Wish::Strokes(vec![stroke, other], DVec3::X)));
    let (mut one, mut two) = (0, 0);
    for (t, place) in frames.t.iter().zip(&mesh.positions) {
        if place.x == 56.0 && (8.0..=56.0).contains(&place.y) {
            assert!(degrees(*t, DVec3::Y) < 1.0, "{t}");
            one += 1;
        }
        if place.distance(Vec3::new(16.0, 24.0, 0.0)) < 1.0 {
            assert!(degrees(*t, along) < 1.0, "{t}");
            two += 1;
        }
    }
    assert!(one >= 13 && two == 1);
    // Beyond `smooth`, the direction takes over.
    let short = vec![vec![DVec3::new(8.0, 8.0, 0.0), DVec3::new(8.0, 16.0, 0.0)]];
    let frames = of(&mesh, &FieldSpec { smooth: 6.0, ..spec(Wish::Strokes(short.clone(), DVec3::X)) });
    let at = |x: f32, y: f32| mesh.positions.iter().position(|p| p.x == x && p.y == y).expect("a vertex");
    assert!(degrees(frames.t[at(60.0, 60.0)], DVec3::X) < 1.0 && degrees(frames.t[at(8.0, 12.0)], DVec3::Y) < 1.0);
    let far = vec![vec![DVec3::new(8.0, 8.0, 30.0), DVec3::new(8.0, 16.0, 0.0)]];
    let fault = tangent_field(&mesh, &spec(Wish::Strokes(far, DVec3::X)), NEVER).expect_err("far off");
    assert!(matches!(fault, super::Fault::Far(0, 0, far, most) if (far - 30.0).abs() < 1e-9 && most < 30.0));
}

#[test]
fn curvature_follows_a_tube() {
    let mesh = torus(60, 40).mesh;
    for (which, round) in [(Principal::Max, false), (Principal::Min, true)] {
        let frames = of(&mesh, &spec(Wish::Curvature(which)));
        assert_eq!((frames.symmetry, frames.singular.len()), (2, 0));
        for (t, place) in frames.t.iter().zip(&mesh.positions) {
            let around = DVec3::Z.cross(place.as_dvec3()).normalize();
            let off = degrees(*t, around).min(degrees(*t, -around));
            assert!(if round { off < 3.0 } else { off > 87.0 }, "{which:?}: {off}");
        }
    }
}

/// The result does not depend on the order of triangles in a file.
#[test]
fn ignores_order_of_triangles() {
    let mesh = sphere().mesh;
    let mut other = Mesh::clone(&mesh);
    other.triangles.reverse();
    for wish in [
        Wish::Direction(DVec3::new(0.2, 0.3, 1.0)),
        Wish::Strokes(vec![vec![DVec3::new(29.0, 3.1, 7.3), DVec3::new(19.7, 21.3, 9.1)]], DVec3::Z),
    ] {
        let (a, b) = (of(&mesh, &spec(wish.clone())), of(&Arc::new(other.clone()), &spec(wish)));
        let worst = a.t.iter().zip(&b.t).map(|(a, b)| a.distance(*b)).fold(0.0f32, f32::max);
        // Normals are summed in another order; the equations are solved to 1e-8 of their right-hand side.
        assert!(worst < 1e-4, "{worst}");
    }
}
