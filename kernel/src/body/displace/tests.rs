//! Tests of displaced surfaces.
#![allow(clippy::cast_possible_truncation, reason = "texels and heights are small")]
use super::*;
use crate::body::open_edge;
use crate::ground::stop::NEVER;
use crate::mesh::{fixture, texels};
use glam::{DVec2, UVec2, Vec2};
use shibo_value::{Grid, Window};
use std::collections::BTreeMap;

const TEXELS: u32 = 400;

fn spec(error: f64) -> Spec {
    let (triangles, most) = (1_000_000, 4_000_000);
    Spec { error, triangles, coarsen: false, most, edge: f64::INFINITY, file_normals: false }
}

/// The pixels of the canvas of 100 mm, and the triangle of each, which is negative in the gutter.
fn texels(atlas: &Atlas) -> Vec<(DVec2, f32)> {
    let step = DVec2::splat(100.0 / f64::from(TEXELS));
    let grid = Grid { origin: DVec2::ZERO, step, period: None, shown: None };
    let mut ids = vec![0.0; (TEXELS * TEXELS) as usize];
    texels::fill(atlas, &grid, Window::full(UVec2::splat(TEXELS)), &mut ids);
    let pixel = |p: usize| DVec2::new((p % TEXELS as usize) as f64, (p / TEXELS as usize) as f64);
    ids.into_iter().enumerate().map(|(p, id)| (pixel(p), id)).collect()
}

/// The pixels, and the triangle of each that is in a chart.
fn owners(atlas: &Atlas) -> Vec<(DVec2, Option<usize>)> {
    let owner = |id: f32| if id > 0.0 { texels::triangle(id) } else { None };
    texels(atlas).into_iter().map(|(pixel, id)| (pixel, owner(id))).collect()
}

fn relief<'a>(atlas: &'a Atlas, height: impl Fn(usize, DVec3) -> f64) -> Relief<'a> {
    relief_with(atlas, height, None)
}

fn relief_with<'a>(atlas: &'a Atlas, height: impl Fn(usize, DVec3) -> f64, creases: Option<Creases>) -> Relief<'a> {
    let of = |(pixel, id): (DVec2, f32)| {
        let n = texels::triangle(id)?;
        Some(height(n, atlas.place(n, (pixel + 0.5) / f64::from(TEXELS))) as f32)
    };
    let values = texels(atlas).into_iter().map(|one| of(one).unwrap_or(0.0)).collect();
    Relief::new(atlas, values, UVec2::splat(TEXELS), creases).unwrap()
}

/// Waves in space of 0.6 mm either way.
fn waves(_: usize, at: DVec3) -> f64 {
    0.6 * libm::sin(at.x / 4.0) * libm::cos(at.y / 5.0 + at.z / 5.0)
}

fn displaced(relief: &Relief<'_>, spec: &Spec) -> Displaced {
    displace(relief, spec, NEVER).unwrap()
}

/// Checks that each edge, by the bits of its ends, is used once in each direction.
fn check_bits(mesh: &Mesh) {
    let mut edges: BTreeMap<[[u32; 3]; 2], u32> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let bits = triangle.map(|corner| mesh.positions[corner as usize].to_array().map(f32::to_bits));
        for k in 0..3 {
            let (a, b) = (bits[k], bits[(k + 1) % 3]);
            assert_ne!(a, b);
            *edges.entry(if a < b { [a, b] } else { [b, a] }).or_default() += if a < b { 1 } else { 1000 };
        }
    }
    assert!(edges.values().all(|uses| *uses == 1001), "the mesh is not closed");
}

/// Largest distance of the mesh to the field, over all texels of charts.
fn check_texels(atlas: &Atlas, mesh: &Mesh, height: impl Fn(usize, DVec3) -> f64) -> f64 {
    let owners = owners(atlas);
    let mut found = vec![f64::INFINITY; owners.len()];
    let scale = f64::from(TEXELS);
    for (triangle, uvs) in mesh.triangles.iter().zip(&mesh.uvs) {
        let [a, b, c] = uvs.map(|uv| uv.as_dvec2() * scale - 0.5);
        let (low, high) =
            (a.min(b).min(c).floor().max(DVec2::ZERO), a.max(b).max(c).ceil().min(DVec2::splat(scale - 1.0)));
        for (x, y) in
            (low.x as usize..=high.x as usize).flat_map(|x| (low.y as usize..=high.y as usize).map(move |y| (x, y)))
        {
            let pixel = y * TEXELS as usize + x;
            let (place, Some(owner)) = owners[pixel] else { continue };
            let det = (b - a).perp_dot(c - a);
            let w = [(b - place).perp_dot(c - place), (c - place).perp_dot(a - place), (a - place).perp_dot(b - place)]
                .map(|w| w / det);
            if w.iter().any(|w| *w < -1e-4) {
                continue;
            }
            let corners = triangle.map(|corner| mesh.positions[corner as usize].as_dvec3());
            let on_mesh = corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
            let uv = (place + 0.5) / scale;
            let base = atlas.place(owner, uv);
            let shares = crate::mesh::bake::weights(atlas, owner, uv);
            let normals = atlas.mesh.triangles[owner].map(|v| atlas.smooth[v as usize].as_dvec3());
            let normal = (normals[0] * shares[0] + normals[1] * shares[1] + normals[2] * shares[2]).normalize();
            let wanted = base + normal * f64::from(height(owner, base) as f32);
            found[pixel] = found[pixel].min(wanted.distance(on_mesh));
        }
    }
    found.iter().zip(&owners).filter(|(_, owner)| owner.1.is_some()).map(|(off, _)| *off).fold(0.0, f64::max)
}

fn euler(mesh: &Mesh) -> i64 {
    // Closed: each triangle has 3/2 edges.
    mesh.positions.len() as i64 - mesh.triangles.len() as i64 / 2
}

#[test]
fn closed_meshes_stay_closed_and_keep_the_error() {
    for (atlas, genus) in [(fixture::cube(), 0), (fixture::sphere(), 0), (fixture::torus(24, 12), 1)] {
        let relief = relief(&atlas, waves);
        for error in [0.1, 0.02] {
            let made = displaced(&relief, &spec(error));
            assert!(made.mesh.triangles.len() > atlas.mesh.triangles.len());
            assert!(made.off.0 <= error, "{error}: {:?}", made.off);
            assert_eq!(open_edge(&made.mesh, NEVER).unwrap(), None);
            assert_eq!(euler(&made.mesh), 2 - 2 * genus);
            assert_eq!((made.folded, made.coarser), (None, None));
            check_bits(&made.mesh);
            let off = check_texels(&atlas, &made.mesh, waves);
            assert!(off <= error + 1e-4, "{error}: a texel is {off} mm off");
            // The error is used, and not far undershot.
            assert!(off > 0.5 * error, "{error}: {off}");
        }
    }
}

#[test]
fn charts_that_disagree_have_one_point_on_their_border() {
    let atlas = fixture::cube();
    let steps = relief(&atlas, |n, _| 0.1 * f64::from(atlas.charts[n]));
    let made = displaced(&steps, &spec(0.05));
    assert_eq!(open_edge(&made.mesh, NEVER).unwrap(), None);
    check_bits(&made.mesh);
    assert!(made.apart.is_some_and(|(off, _)| off > 0.25), "{:?}", made.apart);
    let made = displaced(&relief(&fixture::sphere(), waves), &spec(0.05));
    assert_eq!(made.apart, None);
}

#[test]
fn a_flat_relief_keeps_the_triangles() {
    let atlas = fixture::cube();
    let made = displaced(&relief(&atlas, |_, _| 0.0), &spec(0.01));
    assert_eq!((&made.mesh.triangles, &made.mesh.positions), (&atlas.mesh.triangles, &atlas.mesh.positions));
    // Short edges are another reason for more triangles.
    let made = displaced(&relief(&atlas, |_, _| 0.0), &Spec { edge: 9.0, ..spec(0.01) });
    for n in 0..made.mesh.triangles.len() {
        let [a, b, c] = made.mesh.corners(n);
        assert!(a.distance(b).max(b.distance(c)).max(c.distance(a)) <= 9.0);
    }
    check_bits(&made.mesh);
    assert!((made.mesh.area() / atlas.mesh.area() - 1.0).abs() < 1e-6);
}

#[test]
fn both_remedies_for_too_many_triangles_were_tried() {
    let atlas = fixture::sphere();
    let relief = relief(&atlas, waves);
    let few = Spec { triangles: 1500, ..spec(0.02) };
    let Err(DisplaceError::TooMany(TooMany { needed: Some(needed), error: Some(error) })) =
        displace(&relief, &few, NEVER)
    else {
        panic!("it worked")
    };
    let made = displaced(&relief, &Spec { triangles: needed, ..few });
    assert_eq!(made.mesh.triangles.len(), needed);
    assert!(displace(&relief, &Spec { triangles: needed - 1, ..few }, NEVER).is_err());
    let made = displaced(&relief, &Spec { error, ..few });
    assert!(made.mesh.triangles.len() <= 1500 && made.off.0 <= error);
    assert!(displace(&relief, &Spec { error: error / 1.2, ..few }, NEVER).is_err());
    let coarse = displaced(&relief, &Spec { coarsen: true, ..few });
    assert_eq!((coarse.mesh, coarse.coarser), (made.mesh, Some(TooMany { needed: Some(needed), error: Some(error) })));
    // Beyond a limit, triangles are not counted any more.
    let most = Spec { most: 2500, ..few };
    let Err(DisplaceError::TooMany(many)) = displace(&relief, &most, NEVER) else { panic!("it worked") };
    assert_eq!(many, TooMany { needed: None, error: Some(error) });
}

#[test]
fn the_number_of_threads_does_not_change_the_mesh() {
    let atlas = fixture::torus(24, 12);
    let relief = relief(&atlas, waves);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| displaced(&relief, &spec(0.02)).mesh)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn cliffs_end_at_small_triangles_and_say_so() {
    let atlas = fixture::plane("plane_one");
    let cliff = |_: usize, at: DVec3| if at.x < 32.0 { 0.0 } else { 5.0 };
    let made = displaced(&relief(&atlas, cliff), &spec(0.01));
    assert!(made.off.0 > 0.01 && made.off.0 < 1.0, "{:?}", made.off);
    assert!((made.off.1.x - 32.0).abs() < 1.0, "{:?}", made.off);
    assert!(made.mesh.triangles.len() < 200_000, "{}", made.mesh.triangles.len());
}

#[test]
fn folds_and_bad_heights_are_found() {
    let atlas = fixture::sphere();
    assert!(displaced(&relief(&atlas, |_, _| -20.0), &spec(0.5)).folded.is_none());
    // Beyond the middle of the ball, the surface is turned in both directions.
    let (count, at) = displaced(&relief(&atlas, |_, _| -31.0), &spec(0.5)).folded.unwrap();
    assert!(count > 10 && (at.length() - 30.0).abs() < 5.0, "{count} {at}");
    // Beyond the middle of the tube, the surface is turned round the ring only.
    let torus = fixture::torus(48, 24);
    let (count, at) = displaced(&relief(&torus, |_, _| -16.0), &spec(0.5)).folded.unwrap();
    assert!(count > 10 && ((at.x.hypot(at.y) - 40.0).hypot(at.z) - 15.0).abs() < 1.0, "{count} {at}");
    let mut values = vec![0.0; (TEXELS * TEXELS) as usize];
    let (pixel, owner) = owners(&atlas).into_iter().filter(|(_, owner)| owner.is_some()).nth(500).unwrap();
    values[pixel.y as usize * TEXELS as usize + pixel.x as usize] = f32::NAN;
    let bad = Relief::new(&atlas, values, UVec2::splat(TEXELS), None).err().unwrap();
    assert_eq!(bad.on_canvas, (pixel + 0.5) * 0.25);
    assert!(bad.at.distance(atlas.place(owner.unwrap(), (pixel + 0.5) / 400.0)) < 1e-9);
}

#[test]
fn relief_fades_towards_sharp_edges() {
    let atlas = fixture::cube();
    let fading = relief_with(&atlas, |_, _| 1.0, Some(Creases { reach: 10.0, angle: 0.7 }));
    let made = displaced(&fading, &spec(0.02));
    for (before, after) in atlas.mesh.positions.iter().zip(&made.mesh.positions) {
        assert!(before.distance(*after) < 0.02);
    }
    let [low, high] = made.mesh.bounds();
    assert!((high - low - 62.0).abs().max_element() < 0.1, "{low} {high}");
    check_bits(&made.mesh);
}

#[test]
fn normals_of_the_file_are_means_at_each_vertex() {
    let mut mesh = (*fixture::cube().mesh).clone();
    mesh.normals = vec![[Vec3::X; 3]; mesh.triangles.len()];
    let uvs = mesh.uvs.clone();
    let atlas = fixture::atlas(mesh, &uvs);
    let made = displaced(&relief(&atlas, |_, _| 1.0), &Spec { file_normals: true, ..spec(0.02) });
    for (before, after) in atlas.mesh.positions.iter().zip(&made.mesh.positions) {
        assert!((*after - *before).distance(Vec3::X) < 1e-5);
    }
}

#[test]
fn undercuts_depend_on_the_direction() {
    assert_eq!(hidden(&fixture::sphere().mesh, DVec3::Z, NEVER), None);
    let torus = fixture::torus(48, 24);
    assert_eq!(hidden(&torus.mesh, DVec3::Z, NEVER), None);
    let across = hidden(&torus.mesh, DVec3::new(3.0, 0.0, 0.0), NEVER).unwrap();
    assert!((0.02..0.6).contains(&across.share), "{across:?}");
}

#[test]
fn uvs_and_parts_are_those_of_the_atlas() {
    let atlas = fixture::torus(24, 12);
    let made = displaced(&relief(&atlas, waves), &spec(0.05)).mesh;
    let area = |uvs: &[Vec2; 3]| 0.5 * f64::from((uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0])).abs();
    assert!((made.uvs.iter().map(area).sum::<f64>() - atlas.used).abs() < 1e-4);
    assert_eq!((made.parts.len(), &made.part_names), (made.triangles.len(), &atlas.mesh.part_names));
}
