//! The meshes of shipped graphs, `graphs/meshes/*.glb`, built from formulas.
//!
//! `BLESS=1 cargo test --release --test shipped meshes` writes them.
use serde_json::json;
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

type Point = [f64; 3];

/// Rings of points in mm, z up, from the first point at the bottom to the last one at the top.
struct Rings {
    bottom: Point,
    rings: Vec<Vec<Point>>,
    top: Point,
}

impl Rings {
    fn points(&self) -> Vec<Point> {
        let rings = self.rings.iter().flatten().copied();
        std::iter::once(self.bottom).chain(rings).chain(std::iter::once(self.top)).collect()
    }

    /// Counter-clockwise as seen from outside.
    fn triangles(&self) -> Vec<[u16; 3]> {
        let around = self.rings[0].len();
        let number = |ring: usize, k: usize| 1 + ring * around + k % around;
        let last = self.rings.len() - 1;
        let top = 1 + (last + 1) * around;
        let mut all = Vec::new();
        for k in 0..around {
            all.push([0, number(0, k + 1), number(0, k)]);
            for ring in 0..last {
                let [a, b, c, d] =
                    [(ring, k), (ring, k + 1), (ring + 1, k + 1), (ring + 1, k)].map(|(r, k)| number(r, k));
                all.extend([[a, b, c], [a, c, d]]);
            }
            all.push([number(last, k), number(last, k + 1), top]);
        }
        all.into_iter().map(|corners| corners.map(|n| u16::try_from(n).expect("few points"))).collect()
    }

    /// A binary glTF file: metres, y up.
    fn glb(&self) -> Vec<u8> {
        let (points, triangles) = (self.points(), self.triangles());
        let turned = |p: &Point| [p[0], p[2], -p[1]].map(|x| single(x / 1000.0));
        let places: Vec<[f32; 3]> = points.iter().map(turned).collect();
        let bound = |pick: fn(f32, f32) -> f32| {
            let first = places[0];
            places.iter().fold(first, |all, p| std::array::from_fn(|k| pick(all[k], p[k])))
        };
        let indices: Vec<u8> = triangles.iter().flatten().flat_map(|n| n.to_le_bytes()).collect();
        let positions: Vec<u8> = places.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let json = json!({
            "asset": { "version": "2.0", "generator": "shibo" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
            "buffers": [{ "byteLength": positions.len() + indices.len() }],
            "bufferViews": [
                { "buffer": 0, "byteLength": positions.len(), "target": 34962 },
                { "buffer": 0, "byteOffset": positions.len(), "byteLength": indices.len(), "target": 34963 },
            ],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": places.len(), "type": "VEC3",
                    "min": bound(f32::min), "max": bound(f32::max) },
                { "bufferView": 1, "componentType": 5123, "count": 3 * triangles.len(), "type": "SCALAR" },
            ],
        });
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = [positions, indices].concat();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let length = |n: usize| u32::try_from(n).expect("a small file").to_le_bytes();
        let chunks = [&length(json.len())[..], b"JSON", &json, &length(binary.len()), b"BIN\0", &binary].concat();
        [&b"glTF"[..], &2_u32.to_le_bytes(), &length(12 + chunks.len()), &chunks].concat()
    }
}

/// Files hold single precision.
#[expect(clippy::cast_possible_truncation, reason = "as near as it gets")]
fn single(x: f64) -> f32 {
    x as f32
}

/// Smooth step from 0 below `from` to 1 above `to`.
fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A smooth curve (Catmull and Rom) through points with increasing first coordinates.
fn through(points: &[[f64; 2]], x: f64) -> f64 {
    let after = points.iter().position(|p| p[0] >= x).unwrap_or(points.len() - 1).max(1);
    let [a, b] = [points[after - 1], points[after]];
    let slope = |k: usize| {
        let (low, high) = (points[k.saturating_sub(1)], points[(k + 1).min(points.len() - 1)]);
        (high[1] - low[1]) / (high[0] - low[0])
    };
    let (length, t) = (b[0] - a[0], (x - a[0]) / (b[0] - a[0]));
    let (t2, t3) = (t * t, t * t * t);
    let ends = a[1] * (2.0 * t3 - 3.0 * t2 + 1.0) + b[1] * (3.0 * t2 - 2.0 * t3);
    ends + length * (slope(after - 1) * (t3 - 2.0 * t2 + t) + slope(after) * (t3 - t2))
}

fn bump(x: f64, width: f64) -> f64 {
    (-x * x / (width * width)).exp()
}

/// The seat of a chair: 430 mm wide, hollowed for a sitter, its edge rounded above and cut back below. Its front is -y.
fn seat() -> Rings {
    const AROUND: usize = 120;
    let outline = |angle: f64| {
        let (s, c) = angle.sin_cos();
        // Rounder at the back than at the front.
        let power = 3.1 - 0.7 * s;
        let radius = (c.abs().powf(power) + s.abs().powf(power)).powf(-1.0 / power);
        [215.0 * radius * c * (1.0 - 0.055 * s), 200.0 * radius * s]
    };
    let hollow = |x: f64, y: f64, out: f64| {
        let back = 21.0 * bump((y - 40.0) / 1.25, 105.0) * bump(x, 150.0);
        let legs = 13.0 * (bump(x - 88.0, 62.0) + bump(x + 88.0, 62.0)) * bump(y + 105.0, 100.0);
        let ridge = 7.0 * bump(x, 34.0) * bump(y + 150.0, 80.0);
        (back + legs - ridge) * smooth(1.0, 0.72, out)
    };
    // The profile from the middle below to the middle above: distance from the axis, and height.
    let mut way: Vec<[f64; 2]> = (1..=14).map(|k| [0.85 * f64::from(k) / 14.0, 0.0]).collect();
    way.extend((1..=10).map(|k| {
        let t = f64::from(k) / 10.0;
        [0.85 + 0.15 * (t * PI / 2.0).sin().powf(0.9), 30.0 * t.powf(1.35)]
    }));
    way.extend((1..=12).map(|k| {
        let angle = f64::from(k) / 12.0 * PI / 2.0;
        [1.0 - 0.062 * (1.0 - angle.cos()), 30.0 + 13.0 * angle.sin()]
    }));
    way.extend((1..36).map(|k| [0.938 * (1.0 - f64::from(k) / 36.0), 43.0]));
    let place = |[out, z]: [f64; 2], k: usize| {
        let edge = outline(TAU * k as f64 / AROUND as f64);
        let [x, y] = edge.map(|c| c * out);
        [x, y, if z > 40.0 { z - hollow(x, y, out) } else { z }]
    };
    let rings = way.iter().map(|step| (0..AROUND).map(|k| place(*step, k)).collect()).collect();
    Rings { bottom: [0.0; 3], rings, top: [0.0, 0.0, 43.0 - hollow(0.0, 0.0, 0.0)] }
}

/// A tailor's bust, 640 mm high. Its front is -y.
fn bust() -> Rings {
    const AROUND: usize = 128;
    let half_width = [
        [0.0, 166.0],
        [60.0, 172.0],
        [130.0, 160.0],
        [215.0, 121.0],
        [290.0, 137.0],
        [360.0, 156.0],
        [420.0, 170.0],
        [462.0, 179.0],
        [495.0, 170.0],
        [525.0, 132.0],
        [548.0, 92.0],
        [570.0, 66.0],
        [595.0, 57.0],
        [640.0, 55.0],
    ];
    let half_depth = [
        [0.0, 112.0],
        [60.0, 119.0],
        [130.0, 108.0],
        [215.0, 84.0],
        [290.0, 95.0],
        [360.0, 107.0],
        [420.0, 106.0],
        [462.0, 96.0],
        [495.0, 84.0],
        [525.0, 72.0],
        [548.0, 64.0],
        [570.0, 58.0],
        [595.0, 54.0],
        [640.0, 53.0],
    ];
    let middle = [[0.0, 6.0], [130.0, 2.0], [215.0, -2.0], [360.0, -2.0], [462.0, 8.0], [548.0, 14.0], [640.0, 4.0]];
    let ring = |z: f64, inwards: f64| {
        let (a, b, c) = (through(&half_width, z), through(&half_depth, z), through(&middle, z));
        let power = 2.15 + 0.5 * bump(z - 455.0, 70.0);
        let place = |k: usize| {
            let (s, c0) = (TAU * k as f64 / AROUND as f64).sin_cos();
            let radius = (c0.abs().powf(power) + s.abs().powf(power)).powf(-1.0 / power) * inwards;
            let (x, y) = (a * radius * c0, b * radius * s);
            let front = smooth(0.15, 0.75, -s) * inwards;
            let chest = 34.0 * (bump(x - 66.0, 60.0) + bump(x + 66.0, 60.0)) * bump(z - 372.0, 66.0);
            let blades =
                8.0 * (bump(x - 75.0, 55.0) + bump(x + 75.0, 55.0)) * bump(z - 420.0, 80.0) * smooth(0.15, 0.75, s);
            [x, y + c - chest * front + blades, z]
        };
        (0..AROUND).map(place).collect::<Vec<_>>()
    };
    let mut rings: Vec<Vec<Point>> = [0.25, 0.5, 0.75, 0.9].map(|inwards| ring(0.0, inwards)).into();
    rings.extend([(0.955, 0.6), (0.985, 3.0), (0.998, 7.0)].map(|(inwards, z)| ring(z, inwards)));
    rings.extend((0..=64).map(|k| ring(12.0 + 612.0 * f64::from(k) / 64.0, 1.0)));
    rings.extend((1..=6).map(|k| {
        let angle = f64::from(k) / 6.0 * PI / 2.0;
        let mut round = ring(624.0, 1.0 - 0.28 * (1.0 - angle.cos()));
        round.iter_mut().for_each(|p| p[2] = 624.0 + 16.0 * angle.sin());
        round
    }));
    rings.extend([0.48, 0.24].map(|inwards| {
        let mut flat = ring(624.0, inwards);
        flat.iter_mut().for_each(|p| p[2] = 640.0);
        flat
    }));
    let axis = |z: f64, height: f64| [0.0, through(&middle, z), height];
    Rings { bottom: axis(0.0, 0.0), rings, top: axis(624.0, 640.0) }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/meshes")
}

#[test]
fn the_meshes_of_shipped_graphs_are_those_of_their_formulas() {
    for (name, made) in [("seat.glb", seat()), ("bust.glb", bust())] {
        let (path, bytes) = (folder().join(name), made.glb());
        if std::env::var_os("BLESS").is_some() {
            std::fs::create_dir_all(folder()).expect("a folder");
            std::fs::write(&path, &bytes).expect("written");
        }
        let shipped = std::fs::read(&path).expect("a shipped mesh");
        assert_eq!(shipped.len(), bytes.len(), "{name}");
        // Sines of other machines may differ in the last bit.
        let from = 4 * made.points().len() * 3 + 6 * made.triangles().len();
        let numbers = |bytes: &[u8]| -> Vec<f32> {
            let binary = &bytes[bytes.len() - from.next_multiple_of(4)..][..12 * made.points().len()];
            binary.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
        };
        let far = numbers(&shipped).iter().zip(numbers(&bytes)).any(|(a, b)| (a - b).abs() > 1e-6);
        assert!(!far, "{name} is not what its formula gives; BLESS=1 writes it");
    }
}
