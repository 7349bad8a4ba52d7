//! Tests of synthesis on surfaces against expected results.
use super::indirection_map::Jumps;
use super::synthesize::Preset;
use super::synthesize_surface::{SurfaceStart, SynthesizeSurface};
use crate::testing::{canvas, outputs, port, shipped_mesh};
use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::stop::NEVER;
use shibo_kernel::mesh::atlas::atlas;
use shibo_kernel::mesh::field::{FieldSpec, Wish, tangent_field};
use shibo_kernel::mesh::frame::Framing;
use shibo_kernel::mesh::levels::{LevelsSpec, indirection};
use shibo_kernel::mesh::unwrap::{Unwrap, unwrap};
use shibo_kernel::synthesis::Neighbours;
use shibo_kernel::synthesis::jacobian;
use shibo_kernel::synthesis::sheet::Sheet;
use shibo_kernel::synthesis::surface_measure::{Measured, seam};
use shibo_value::{Atlas, CoordMap, Exemplar, ExemplarFrame, Frames, Mesh, Tiling, Value};
use std::collections::HashMap;
use std::sync::Arc;

/// The atlas of a mesh in OBJ text, with v up.
fn read(text: &str) -> Arc<Atlas> {
    let (mut positions, mut points) = (Vec::new(), Vec::new());
    let (mut triangles, mut uvs) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |n: usize| words[n].parse::<f32>().unwrap();
        match words.first() {
            Some(&"v") => positions.push(Vec3::new(number(1), number(2), number(3))),
            Some(&"vt") => points.push(Vec2::new(number(1), 1.0 - number(2))),
            Some(&"f") => {
                let corner = |n: usize| -> (u32, Vec2) {
                    let numbers: Vec<u32> = words[n].split('/').map(|k| k.parse().unwrap()).collect();
                    (numbers[0] - 1, points[numbers[1] as usize - 1])
                };
                let three = [corner(1), corner(2), corner(3)];
                triangles.push(three.map(|c| c.0));
                uvs.push(three.map(|c| c.1));
            }
            _ => {}
        }
    }
    made(positions, triangles, &uvs)
}

fn made(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, uvs: &[[Vec2; 3]]) -> Arc<Atlas> {
    let parts = vec![0; triangles.len()];
    let mesh = Mesh { positions, triangles, parts, part_names: vec!["shape".into()], ..Mesh::default() };
    Arc::new(atlas(Arc::new(mesh), uvs, DVec2::splat(100.0)).unwrap())
}

fn plane(name: &str) -> Arc<Atlas> {
    read(match name {
        "plane_cut" => include_str!("../../../tests/meshes/plane_cut.obj"),
        "plane_wild" => include_str!("../../../tests/meshes/plane_wild.obj"),
        _ => include_str!("../../../tests/meshes/plane_one.obj"),
    })
}

/// A torus of n × m quads, R 40 mm and r 15 mm, in one chart whose opposite sides meet.
fn torus(n: u32, m: u32) -> Arc<Atlas> {
    let turn = |k: u32, n: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
    let (mut positions, mut triangles, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let ((sa, ca), (sb, cb)) = (libm::sincos(turn(i, n)), libm::sincos(turn(j, m)));
        positions.push(DVec3::new((40.0 + 15.0 * cb) * ca, (40.0 + 15.0 * cb) * sa, 15.0 * sb).as_vec3());
        let at = |(i, j): (u32, u32)| (i % n) * m + j % m;
        let uv = |(i, j): (u32, u32)| {
            let share = |k: u32, n: u32| f64::from(k) / f64::from(n);
            DVec2::new(0.02 + 0.94 * share(i, n), 0.97 - 0.37 * share(j, m)).as_vec2()
        };
        let (a, b, c, d) = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1));
        for t in [[a, b, c], [a, c, d]] {
            triangles.push(t.map(at));
            uvs.push(t.map(uv));
        }
    }
    made(positions, triangles, &uvs)
}

fn frames(atlas: &Atlas, wish: Wish) -> Frames {
    let spec = FieldSpec { wish, smooth: 0.0, symmetry: 1, turn: 0.0, length: 1.0 };
    tangent_field(&atlas.mesh, &spec, NEVER).unwrap()
}

/// Frames along x; if `varied`, rotated and scaled by place.
fn along_x(atlas: &Atlas, varied: bool) -> Frames {
    let n = atlas.mesh.positions.len();
    let mut frames = frames(atlas, Wish::Direction(DVec3::X));
    frames.t = vec![Vec3::X; n];
    if varied {
        for (t, at) in frames.t.iter_mut().zip(&atlas.mesh.positions) {
            let (angle, size) = (f64::from(at.x * 0.03 + at.y * 0.02), 1.0 + 0.004 * at.x);
            let (s, c) = libm::sincos(angle);
            *t = DVec3::new(c, s, 0.0).as_vec3() * size;
        }
    }
    frames
}

/// A smooth random picture that repeats, of waves.
fn exemplar(n: u32, pitch: f64, finest: u32) -> Exemplar {
    let side = n as usize;
    let value = |p: usize, channel: u64| {
        let (x, y) = ((p % side) as f64 / side as f64, (p / side) as f64 / side as f64);
        let wave = |k: u64| {
            let hash = Hash::new(17 + channel).with(k);
            let whole = |d: u64| (hash.unit(d) * 2.0 * f64::from(finest) - f64::from(finest)).round();
            let angle = std::f64::consts::TAU * (whole(0) * x + whole(1) * y + hash.unit(2));
            libm::sin(angle)
        };
        (0..24).map(wave).sum::<f64>() / 12.0 + 0.5
    };
    #[expect(clippy::cast_possible_truncation, reason = "values of a picture")]
    let shown: Vec<f32> = (0..3).flat_map(|c| (0..side * side).map(move |p| value(p, c) as f32)).collect();
    let features = (0..side * side).flat_map(|p| [0, 1, 2].map(|c| shown[c * side * side + p])).collect();
    Exemplar {
        frame: ExemplarFrame {
            size: UVec2::splat(n),
            origin: DVec2::ZERO,
            pitch: DVec2::splat(pitch),
            periodic: Tiling::BOTH,
        },
        shown: Arc::new(shown),
        channels: 3,
        features: Arc::new(features),
        guide: Arc::default(),
        usable: Arc::default(),
        pyramid: false,
        margin: 1.0,
        levels: Arc::default(),
        lattice: None,
    }
}

fn node() -> SynthesizeSurface {
    SynthesizeSurface { exemplar: port(0), atlas: port(1), frames: port(2), ..SynthesizeSurface::default() }
}

fn grown(node: &SynthesizeSurface, exemplar: &Exemplar, atlas: &Arc<Atlas>, frames: &Frames) -> Arc<CoordMap> {
    let inputs = [Value::from(exemplar.clone()), Value::Atlas(Arc::clone(atlas)), Value::from(frames.clone())];
    let found = outputs(node, &inputs, &canvas()).unwrap().take("coords", true).cloned();
    let Some(Value::CoordMap(map)) = found else { panic!("no coordinates") };
    map
}

/// Coordinates by place on the surface, in hundredths of a mm.
fn by_place(map: &CoordMap) -> HashMap<[i64; 2], [f32; 2]> {
    let surface = map.surface.as_ref().unwrap();
    let sheet = Sheet { atlas: &surface.atlas, finest: map.size.to_array(), level: &surface.level };
    let mut all = HashMap::new();
    for (pixel, at) in map.coords.iter().enumerate() {
        assert_eq!(at[0].is_nan(), sheet.level.triangle(pixel).is_none());
        let Some(place) = sheet.place(pixel) else { continue };
        #[expect(clippy::cast_possible_truncation, reason = "places of a small plane")]
        let key = [place.x, place.y].map(|v| (v * 100.0).round() as i64);
        all.insert(key, *at);
    }
    all
}

fn apart(a: [f32; 2], b: [f32; 2], side: f32) -> f32 {
    let axis = |d: usize| {
        let off = (a[d] - b[d]).rem_euclid(side);
        off.min(side - off)
    };
    axis(0).max(axis(1))
}

/// Rows C18, C22, C24, C26: a plane gets the same coordinates for every way of cutting it into charts, moving and
/// turning them.
#[test]
fn a_plane_that_is_cut_gets_the_same_coordinates() {
    for (size, varied) in [(128u32, false), (128, true), (256, true)] {
        let picture = exemplar(32, 128.0 / f64::from(size), 5);
        let patent = SynthesizeSurface {
            preset: Preset::Patent,
            sub_passes: 1,
            start_mode: SurfaceStart::Random,
            size: Some(size),
            start_size: Some(size / 16),
            ..node()
        };
        let of = |name: &str, node: &SynthesizeSurface| {
            let atlas = plane(name);
            by_place(&grown(node, &picture, &atlas, &along_x(&atlas, varied)))
        };
        let (one, cut) = (of("plane_one", &patent), of("plane_cut", &patent));
        assert_eq!((one.len(), cut.len()), ((size * size / 4) as usize, one.len()));
        let off = one.iter().filter(|(place, at)| apart(**at, cut[*place], 32.0) > 1e-3).count();
        assert!(1000 * off <= one.len(), "{size} {varied}: {off} of {}", one.len());
        let torn = |map: &HashMap<[i64; 2], [f32; 2]>| {
            map.values().map(|at| at[0].to_bits()).collect::<std::collections::HashSet<_>>().len()
        };
        assert!(torn(&one) > 100, "something grew");
    }
}

/// The plane of `plane_one` in four charts, moved by multiples of an eighth of the atlas.
fn moved_plane() -> Arc<Atlas> {
    let whole = plane("plane_one");
    let by = [[-2.0, -2.0], [2.0, -1.0], [-1.0, 2.0], [2.0, 2.0]].map(|eighths| Vec2::from_array(eighths) / 8.0);
    let uvs: Vec<[Vec2; 3]> = whole
        .uvs
        .iter()
        .map(|uvs| {
            let middle = (uvs[0] + uvs[1] + uvs[2]) / 3.0;
            let chart = usize::from(middle.x > 0.5) + 2 * usize::from(middle.y > 0.5);
            uvs.map(|uv| uv + by[chart])
        })
        .collect();
    let Mesh { positions, triangles, .. } = Mesh::clone(&whole.mesh);
    made(positions, triangles, &uvs)
}

/// Row C18, beyond the source: with the default preset too, moved charts get the coordinates of the uncut plane,
/// including random numbers and even use.
#[test]
fn charts_that_are_moved_get_the_same_coordinates() {
    for (size, varied) in [(128u32, false), (256, true)] {
        let picture = exemplar(32, 128.0 / f64::from(size), 5);
        let usual =
            SynthesizeSurface { border_passes: Some(0), size: Some(size), start_size: Some(size / 16), ..node() };
        let of = |atlas: &Arc<Atlas>| by_place(&grown(&usual, &picture, atlas, &along_x(atlas, varied)));
        let (whole, cut) = (plane("plane_one"), moved_plane());
        assert_eq!((whole.charts.iter().max(), cut.charts.iter().max()), (Some(&0), Some(&3)));
        let (one, four) = (of(&whole), of(&cut));
        assert_eq!((one.len(), four.len()), ((size * size / 4) as usize, one.len()));
        let off = one.iter().filter(|(place, at)| apart(**at, four[*place], 32.0) > 1e-3).count();
        assert!(1000 * off <= one.len(), "{size} {varied}: {off} of {}", one.len());
        let different = one.values().map(|at| at[0].to_bits()).collect::<std::collections::HashSet<_>>().len();
        assert!(different > 100, "something grew");
    }
}

/// S-17: an affine map is a fixed point across any border: each neighbour predicts exactly the coordinate of a pixel.
#[test]
fn affine_maps_are_fixed_points_across_borders() {
    let atlas = plane("plane_wild");
    let frames = along_x(&atlas, false);
    let framing = Framing { atlas: &atlas, frames: &frames };
    for (exact, most) in [(true, 3e-3), (false, 3.0)] {
        let spec = LevelsSpec { size: [256, 256], levels: 4, exact, ring: 0, ends: &[] };
        let map = indirection(&atlas, &spec, NEVER);
        let mut all = 0.0f32;
        for l in 0..4 {
            let sheet = Sheet::new(&map, l);
            let pitch = DVec2::new(0.5, 0.7);
            let jacobians = sheet.jacobians(&framing, pitch, (&[], &[]));
            let at = |pixel: usize| {
                let place = sheet.place(pixel).unwrap();
                // y is down in the exemplar.
                (DVec2::new(place.x, -place.y) / pitch).as_vec2()
            };
            let (h, w) = (sheet.level.h as f32, sheet.level.size[0] as i32);
            let mut worst = 0.0f32;
            for &pixel in &sheet.level.border {
                for octant in 0..8 {
                    let (x, y) = (pixel as i32 % w, pixel as i32 / w);
                    let Some((near, residue)) = sheet.near((x, y), octant) else { continue };
                    let [ox, oy] = jacobian::apply(&jacobians[near], residue.map(|v| v * h));
                    let o = jacobian::OCTANTS[octant].map(|v| v as f32 * h);
                    let [sx, sy] = jacobian::apply(&jacobians[pixel as usize], o);
                    let off = at(near) + Vec2::new(ox - sx, oy - sy) - at(pixel as usize);
                    worst = worst.max(off.length() / h);
                }
            }
            assert!(worst < most, "{exact} {h}: {worst}");
            all = all.max(worst);
        }
        assert_eq!(exact, all < 0.1, "{all}");
    }
}

/// The mesh of a shipped graph, in charts made for it.
fn shipped(name: &str) -> Arc<Atlas> {
    let mesh = shipped_mesh(name);
    let wish = Unwrap { repack: false, angle: 70.0, stretch: 4.0, page: 1024, gutter: 4, tight: true };
    let uvs = unwrap(&mesh, DVec2::splat(100.0), &wish, &[], &|| true).unwrap();
    Arc::new(atlas(mesh, &uvs, DVec2::splat(100.0)).unwrap())
}

/// Row C26: steps between pixels across borders of charts are like those inside charts.
#[test]
fn borders_are_not_seen() {
    let ball = read(include_str!("../../../tests/meshes/sphere.obj"));
    let ring = torus(48, 24);
    let wild = plane("plane_wild");
    let seat = shipped("seat.glb");
    let bust = shipped("bust.glb");
    let around = Wish::Around(DVec3::Z, DVec3::ZERO);
    let cases = [
        ("seat", 384, Arc::clone(&seat), frames(&seat, around.clone())),
        ("bust", 384, Arc::clone(&bust), frames(&bust, around.clone())),
        ("torus", 384, Arc::clone(&ring), frames(&ring, around.clone())),
        ("sphere", 256, Arc::clone(&ball), frames(&ball, around)),
        ("plane_wild", 512, Arc::clone(&wild), along_x(&wild, false)),
    ];
    for (name, size, atlas, frames) in cases {
        let pitch = atlas.scale() * 100.0 / f64::from(size);
        let picture = exemplar(64, pitch, 5);
        let (mut pairs, mut sums) = (0, [0.0f64; 3]);
        for seed in 0..6 {
            let map = grown(&SynthesizeSurface { size: Some(size), seed, ..node() }, &picture, &atlas, &frames);
            let seam = map.surface.as_ref().unwrap().seam.unwrap();
            pairs += seam.pairs;
            let all = [seam.mean, seam.p99, seam.torn].map(|v| f64::from(v) * f64::from(seam.pairs));
            sums.iter_mut().zip(all).for_each(|(sum, v)| *sum += v);
        }
        let [mean, p99, torn] = sums.map(|sum| sum / f64::from(pairs));
        println!("{name}: mean {mean:.3}, p99 {p99:.3}, torn {torn:.3} of {pairs}");
        assert!(pairs >= 5000 && mean <= 1.15 && p99 <= 1.15 && torn <= 1.4, "{name}: {mean} {p99} {torn} of {pairs}");
    }
}

/// Counter-check: without pointers between charts, their borders are visible.
#[test]
fn without_pointers_borders_are_seen() {
    let whole = plane("plane_wild");
    let mut apart = Atlas::clone(&whole);
    for (across, inner) in apart.across.iter_mut().zip(&apart.inner) {
        (0..3).filter(|k| inner & (1 << k) == 0).for_each(|k| across[k] = Atlas::END);
    }
    let frames = along_x(&whole, false);
    let picture = exemplar(64, whole.scale() * 100.0 / 512.0, 5);
    let map = grown(&SynthesizeSurface { size: Some(512), ..node() }, &picture, &Arc::new(apart), &frames);
    let spec = LevelsSpec { size: [512, 512], levels: 1, exact: true, ring: 0, ends: &[] };
    let pointers = indirection(&whole, &spec, NEVER);
    let sheet = Sheet::new(&pointers, 0);
    let jacobians = &map.surface.as_ref().unwrap().jacobians;
    let color = |at: [f32; 2]| super::analysis::color(&picture, at);
    let measured = Measured { sheet: &sheet, coords: &map.coords, jacobians, color };
    let seam = seam(&measured.steps());
    assert!(seam.pairs > 800 && seam.mean >= 1.6 && seam.torn > 3.0, "{seam:?}");
}

/// The source's nearest pointers can be used instead.
#[test]
fn nearest_pointers_can_be_taken() {
    let atlas = plane("plane_wild");
    let frames = along_x(&atlas, false);
    let picture = exemplar(32, 1.0, 5);
    let exact = SynthesizeSurface { size: Some(96), ..node() };
    let nearest = SynthesizeSurface { jumps: Some(Jumps::Nearest), ..exact.clone() };
    let [exact, nearest] = [exact, nearest].map(|node| grown(&node, &picture, &atlas, &frames));
    assert!(exact.surface.as_ref().unwrap().level.jumps.as_flattened().iter().any(|j| j.residue != [0; 2]));
    assert!(nearest.surface.as_ref().unwrap().level.jumps.as_flattened().iter().all(|j| j.residue == [0; 2]));
}
