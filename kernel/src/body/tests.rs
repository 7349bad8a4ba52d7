//! Tests of whole bodies, by brute force.
#![allow(clippy::cast_possible_truncation, reason = "sizes and heights are small")]
use super::block::Mesh;
use super::*;
use std::collections::{BTreeMap, BTreeSet};
use std::io;

/// A body in memory.
#[derive(Clone, Default, PartialEq, Debug)]
struct Memory {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Receiver for Memory {
    fn vertex(&mut self, at: [f32; 3]) -> io::Result<()> {
        self.vertices.push(at);
        Ok(())
    }

    fn triangle(&mut self, corners: [Vertex; 3]) -> io::Result<()> {
        for vertex in corners {
            assert_eq!(self.vertices[vertex.number as usize], vertex.at);
        }
        self.triangles.push(corners.map(|vertex| vertex.number));
        Ok(())
    }
}

impl Memory {
    /// Checks that each edge belongs to two triangles in opposite directions, that no triangle lacks area and no two
    /// vertices coincide; returns the Euler number.
    fn euler(&self) -> i64 {
        let mut edges = BTreeSet::new();
        for [a, b, c] in &self.triangles {
            for edge in [(a, b), (b, c), (c, a)] {
                assert_ne!(edge.0, edge.1);
                assert!(edges.insert(edge), "an edge is used twice in one direction");
            }
            let [p, q, r] = [a, b, c].map(|at| self.vertices[*at as usize].map(f64::from));
            let (u, v) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
            let area = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            assert!(area.iter().any(|x| x.abs() > 1e-12), "a triangle without area: {p:?} {q:?} {r:?}");
        }
        assert!(edges.iter().all(|(a, b)| edges.contains(&(*b, *a))), "an open edge");
        let places: BTreeSet<[u32; 3]> = self.vertices.iter().map(|at| at.map(f32::to_bits)).collect();
        assert_eq!(places.len(), self.vertices.len(), "two vertices at one place");
        self.vertices.len() as i64 - edges.len() as i64 / 2 + self.triangles.len() as i64
    }

    fn volume(&self) -> f64 {
        let one = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|at| self.vertices[at as usize].map(f64::from));
            let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
            (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
        };
        self.triangles.iter().map(one).sum()
    }
}

/// Rough heights that repeat only by chance, from whole numbers.
fn rough(width: usize, height: usize, seed: u32) -> Vec<f32> {
    let hash = |x: u32, y: u32| {
        let mut h = x.wrapping_mul(0x9E37_79B9) ^ y.wrapping_mul(0x85EB_CA6B) ^ seed.wrapping_mul(0xC2B2_AE35);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h ^= h >> 12;
        f64::from(h & 0xFFFF) / 65536.0
    };
    let mut values = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let wave = (x as f64 * 0.21).sin() * (y as f64 * 0.13).cos();
            values.push((0.2 * wave + 0.06 * hash(x as u32, y as u32)) as f32);
        }
    }
    values
}

/// All rows of samples.
fn all(heights: &Heights<'_>) -> Vec<Vec<f32>> {
    let rows = heights.size()[1];
    let band = heights.band(0, rows - 1).unwrap();
    (0..rows).map(|row| band.row(row).to_vec()).collect()
}

/// All blocks, row by row.
fn meshes(tiles: &Tiles) -> Vec<Mesh> {
    (0..tiles.count()[1]).flat_map(|line| tiles.line(line).unwrap()).collect()
}

/// The largest distance at samples and crossings, from all triangles of the relief over the plane of half steps.
fn distance(heights: &Heights<'_>, tiles: &Tiles) -> f64 {
    let mut most = 0.0_f64;
    let rows = all(heights);
    let height_at = |x: usize, y: usize| rows[y][x];
    let mut seen = vec![false; heights.across.len() * heights.down.len()];
    for (block, mesh) in meshes(tiles).iter().enumerate() {
        let (left, top) = (tiles.columns(block)[0], tiles.rows(block)[0]);
        for triangle in &mesh.triangles {
            let spots = triangle.map(|at| mesh.spots[usize::from(at)]);
            let samples = spots.map(|[x, y]| (left + usize::from(x), top + usize::from(y)));
            let p = samples
                .map(|(x, y)| [f64::from(heights.across[x]), f64::from(heights.down[y]), f64::from(height_at(x, y))]);
            let turn =
                |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let flat = p.map(|[x, y, _]| [x, y]);
            let area = turn(flat[0], flat[1], flat[2]);
            assert!(area > 0.0);
            let [columns, rows] = [0, 1].map(|axis| {
                let of = |s: &(usize, usize)| if axis == 0 { s.0 } else { s.1 };
                (samples.iter().map(of).min().unwrap(), samples.iter().map(of).max().unwrap())
            });
            for y in rows.0..=rows.1 {
                for x in columns.0..=columns.1 {
                    let at = [f64::from(heights.across[x]), f64::from(heights.down[y])];
                    let shares = [turn(flat[1], flat[2], at), turn(flat[2], flat[0], at), turn(flat[0], flat[1], at)];
                    if shares.iter().all(|share| *share >= 0.0) {
                        let z: f64 = (0..3).map(|k| shares[k] * p[k][2]).sum::<f64>() / area;
                        most = most.max((z - f64::from(height_at(x, y))).abs());
                        seen[y * heights.across.len() + x] = true;
                    }
                }
            }
            for k in 0..3 {
                let (a, b) = (p[k], p[(k + 1) % 3]);
                // Crossings with lines of both directions, by search in the list of positions.
                for (axis, lines, others) in [(0, &heights.across, &heights.down), (1, &heights.down, &heights.across)]
                {
                    let (low, high) = (a[axis].min(b[axis]), a[axis].max(b[axis]));
                    for (line, at) in
                        lines.iter().enumerate().filter(|(_, at)| f64::from(**at) > low && f64::from(**at) < high)
                    {
                        let t = (f64::from(*at) - a[axis]) / (b[axis] - a[axis]);
                        let (other, z) = (a[1 - axis] + t * (b[1 - axis] - a[1 - axis]), a[2] + t * (b[2] - a[2]));
                        let n = others.partition_point(|place| f64::from(*place) <= other).clamp(1, others.len() - 1);
                        let part = (other - f64::from(others[n - 1])) / f64::from(others[n] - others[n - 1]);
                        let height =
                            |n: usize| f64::from(if axis == 0 { height_at(line, n) } else { height_at(n, line) });
                        most = most.max((z - height(n - 1) - part * (height(n) - height(n - 1))).abs());
                    }
                }
            }
        }
    }
    assert!(seen.iter().all(|seen| *seen), "the triangles cover all samples");
    most
}

fn memory() -> Box<dyn Store> {
    Box::new(Vec::new())
}

fn go() -> bool {
    false
}

fn tiles(heights: &Heights<'_>, tolerance: Tolerance, even: bool) -> Tiles {
    if even {
        let even = Even::new(heights, tolerance, &memory, &go).unwrap();
        return even.mesh(heights, tolerance, (memory(), u64::MAX), &go).unwrap();
    }
    fewest(heights, tolerance, (memory(), u64::MAX), &go).unwrap()
}

fn plate(heights: &Heights<'_>, tiles: &Tiles, repeats: [usize; 2]) -> (Memory, Figures) {
    let mut memory = Memory::default();
    let figures = Plate { heights, tiles, thickness: 3.0, repeats, steepest: 45.0 }.build(&mut memory).unwrap();
    (memory, figures)
}

const SIZES: [[usize; 2]; 9] = [[1, 1], [1, 2], [2, 1], [3, 5], [40, 9], [63, 63], [64, 65], [130, 70], [97, 200]];

#[test]
fn plates_are_closed_and_within_the_error_at_samples_and_crossings() {
    for [width, height] in SIZES {
        for repeats in [[false; 2], [true; 2], [true, false]] {
            let values = rough(width, height, 3);
            let heights = Heights::of_canvas(&values, [width, height], [0.03, 0.05], repeats).unwrap();
            for (error, even) in [(0.2, false), (0.02, false), (0.005, false), (0.2, true), (0.02, true), (0.005, true)]
            {
                let tiles = tiles(&heights, Tolerance::flat(error), even);
                let (memory, figures) = plate(&heights, &tiles, [1, 1]);
                assert_eq!(memory.euler(), 2, "{width} × {height}, {error}, {even}");
                let most = distance(&heights, &tiles);
                assert!(most <= error + 1e-12, "{width} × {height}: {most} > {error}, even {even}");
                assert!(tiles.error() <= error + 1e-12 && tiles.error() + 1e-6 >= most, "{} {most}", tiles.error());
                assert_eq!(figures.triangles, memory.triangles.len() as u64);
                assert_eq!(figures.triangles, Plate::triangles(&tiles, [1, 1]));
                assert!((figures.volume - memory.volume()).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn volume_is_that_of_the_bilinear_field() {
    let values = rough(70, 50, 5);
    let heights = Heights::of_canvas(&values, [70, 50], [0.1, 0.1], [true; 2]).unwrap();
    let rows = all(&heights);
    let height_at = |x: usize, y: usize| rows[y][x];
    let mut volume = 0.0;
    for y in 0..51 {
        for x in 0..71 {
            let ([left, top], [right, bottom]) = (heights.place(x, y), heights.place(x + 1, y + 1));
            let mean = 0.25
                * [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]
                    .iter()
                    .map(|(x, y)| f64::from(height_at(*x, *y)))
                    .sum::<f64>();
            volume += (right - left) * (bottom - top) * (3.0 + mean);
        }
    }
    for even in [false, true] {
        let figures = plate(&heights, &tiles(&heights, Tolerance::flat(1e-4), even), [1, 1]).1;
        assert!((figures.volume / volume - 1.0).abs() < 1e-4, "{} {volume}", figures.volume);
    }
}

#[test]
fn tiles_meet_bit_for_bit() {
    let values = rough(90, 70, 9);
    let heights = Heights::of_canvas(&values, [90, 70], [0.04, 0.04], [true; 2]).unwrap();
    for even in [false, true] {
        let tiles = tiles(&heights, Tolerance::flat(0.01), even);
        let (single, one) = plate(&heights, &tiles, [1, 1]);
        let side = |x: f32| {
            let of = single.vertices.iter().filter(|at| at[0] == x && at[2] > 0.0);
            of.map(|at| (at[1].to_bits(), at[2].to_bits())).collect::<BTreeSet<_>>()
        };
        assert_eq!(side(0.0), side((90.0 * 0.04) as f32));
        let (memory, many) = plate(&heights, &tiles, [3, 2]);
        assert_eq!(memory.euler(), 2);
        assert!((many.volume / (6.0 * one.volume) - 1.0).abs() < 1e-6);
        assert_eq!(many.bounds[1][..2], [10.8, 5.6]);
    }
}

#[test]
fn the_last_of_many_tiles_is_within_the_error_after_rounding() {
    let values = rough(40, 30, 13);
    let heights = Heights::of_canvas(&values, [40, 30], [0.2, 0.2], [true; 2]).unwrap();
    let (error, count) = (5e-4, 120);
    let tolerance = Tolerance::flat(error).rounded(&heights, 3.3, [960.0, 6.0]);
    assert!(tolerance.rounding() > 0.05 * error, "{}", tolerance.rounding());
    let rows = all(&heights);
    for even in [false, true] {
        let tiles = tiles(&heights, tolerance, even);
        assert!(tiles.error() <= error);
        let memory = plate(&heights, &tiles, [count, 1]).0;
        let mut seen = 0;
        for triangle in &memory.triangles {
            let p = triangle.map(|at| memory.vertices[at as usize].map(f64::from));
            let turn =
                |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let flat = p.map(|[x, y, _]| [x, y]);
            let area = turn(flat[0], flat[1], flat[2]);
            // Facets of the relief in the last tile.
            if area <= 0.0 || p.iter().any(|at| at[2] <= 0.0 || at[0] < 8.0 * (count - 1) as f64 - 1e-3) {
                continue;
            }
            for (y, row) in rows.iter().enumerate() {
                for (x, height) in row.iter().enumerate() {
                    let [left, top] = heights.place(x, y);
                    let at = [8.0 * (count - 1) as f64 + left, 6.0 - top];
                    let shares = [turn(flat[1], flat[2], at), turn(flat[2], flat[0], at), turn(flat[0], flat[1], at)];
                    if shares.iter().all(|share| *share >= 0.0) {
                        seen += 1;
                        let z = (0..3).map(|k| shares[k] * p[k][2]).sum::<f64>() / area;
                        let off = (z - 3.0 - f64::from(*height)).abs();
                        assert!(off <= error, "{off} at {at:?}, even {even}");
                    }
                }
            }
        }
        assert!(seen > 40 * 30, "{seen}");
    }
}

#[test]
fn plates_look_like_the_picture_from_above() {
    let mut values = vec![0.0; 8 * 4];
    values[7] = 1.0;
    let heights = Heights::of_canvas(&values, [8, 4], [1.0; 2], [false; 2]).unwrap();
    let (memory, figures) = plate(&heights, &tiles(&heights, Tolerance::flat(0.01), false), [1, 1]);
    assert!(memory.vertices.contains(&[7.5, 3.5, 4.0]), "the first row of the picture lies at the greatest y");
    assert_eq!(figures.bounds, [[0.0; 3], [8.0, 4.0, 4.0]]);
    assert!(figures.steepest.0 > 44.0, "{figures:?}");
}

#[test]
fn the_share_over_the_limit_is_that_of_steep_facets() {
    // A ridge of 60°, a quarter of the canvas wide, on a flat ground.
    let slope = 3.0_f32.sqrt();
    let line = |x: usize| if (8..16).contains(&x) { slope * (4.0 - (x as f32 - 11.5).abs()).min(3.5) } else { 0.0 };
    let values: Vec<f32> = (0..8 * 32).map(|n| line(n % 32)).collect();
    let heights = Heights::of_canvas(&values, [32, 8], [1.0; 2], [false; 2]).unwrap();
    let tiles = tiles(&heights, Tolerance::flat(1e-4), false);
    let share = |steepest: f64| {
        let plate = Plate { heights: &heights, tiles: &tiles, thickness: 3.0, repeats: [1, 1], steepest };
        plate.build(&mut Memory::default()).unwrap().over_limit
    };
    // Six steps of 60°, two of half of that slope, and one flat step on top.
    assert!((share(59.0) - 12.0 / (12.0 + 23.0 + 1.0 + 2.0 * 1.75_f64.sqrt())).abs() < 0.01, "{}", share(59.0));
    assert_eq!(share(61.0), 0.0);
}

/// The largest distance of a roll's triangles from the field, at samples, along the radius.
fn radial(heights: &Heights<'_>, tiles: &Tiles, columns: usize, radius: f64) -> f64 {
    let rows = all(heights);
    let height_at = |x: usize, y: usize| rows[y][x];
    let mut most = 0.0_f64;
    for (block, mesh) in meshes(tiles).iter().enumerate() {
        let (left, top) = (tiles.columns(block)[0], tiles.rows(block)[0]);
        for triangle in &mesh.triangles {
            let samples = triangle
                .map(|at| mesh.spots[usize::from(at)])
                .map(|[x, y]| (left + usize::from(x), top + usize::from(y)));
            let angle = |x: f64| x * std::f64::consts::TAU / columns as f64;
            let p = samples.map(|(x, y)| {
                let r = radius + f64::from(height_at(x, y));
                [r * angle(x as f64).cos(), r * angle(x as f64).sin(), heights.place(x, y)[1]]
            });
            let (u, v) = ([0, 1, 2].map(|k| p[1][k] - p[0][k]), [0, 1, 2].map(|k| p[2][k] - p[0][k]));
            let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            let d: f64 = (0..3).map(|k| n[k] * p[0][k]).sum();
            let flat = samples.map(|(x, y)| [x as f64, f64::from(heights.down[y])]);
            let turn =
                |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let [xs, ys] = [0, 1].map(|axis| samples.map(|s| if axis == 0 { s.0 } else { s.1 }));
            for y in *ys.iter().min().unwrap()..=*ys.iter().max().unwrap() {
                for x in *xs.iter().min().unwrap()..=*xs.iter().max().unwrap() {
                    let at = [x as f64, f64::from(heights.down[y])];
                    if (0..3).all(|k| turn(flat[k], flat[(k + 1) % 3], at) >= 0.0) {
                        let z = heights.place(x, y)[1];
                        let r = (d - n[2] * z) / (n[0] * angle(at[0]).cos() + n[1] * angle(at[0]).sin());
                        most = most.max((r - radius - f64::from(height_at(x, y))).abs());
                    }
                }
            }
        }
    }
    most
}

#[test]
fn rolls_are_closed_and_within_the_error() {
    let values = rough(150, 40, 11);
    for (around, bore, tiled) in [(1, 0.0, true), (2, 0.0, false), (3, 2.0, true), (2, 0.8, false)] {
        let heights = Heights::round(&values, [150, 40], [0.1, 0.1], tiled, 2).unwrap();
        let columns = 300 * around;
        let radius = around as f64 * 15.0 / std::f64::consts::TAU;
        let repeats = [around, if tiled { 2 } else { 1 }];
        for even in [false, true] {
            let tolerance = Tolerance::round(0.02, radius, columns);
            let tiles = tiles(&heights, tolerance, even);
            let roll = Roll { heights: &heights, tiles: &tiles, repeats, bore, error: 0.02, steepest: 90.0 };
            assert!((roll.radius() - radius).abs() < 1e-9);
            let mut memory = Memory::default();
            let figures = roll.build(&mut memory).unwrap();
            assert_eq!(memory.euler(), if bore > 0.0 { 0 } else { 2 });
            assert!((figures.volume - memory.volume()).abs() < 1e-6 * figures.volume);
            assert_eq!(figures.triangles, roll.triangles());
            let core = std::f64::consts::PI * (radius * radius - 0.25 * bore * bore) * roll.length();
            assert!((figures.volume / core - 1.0).abs() < 0.2 / radius, "{} {core}", figures.volume);
            let most = radial(&heights, &tiles, columns, radius);
            assert!(most <= 0.02, "{most}");
            assert!(most <= tiles.error() + 1e-9 && tiles.error() <= 0.02 + 1e-9, "{most} {}", tiles.error());
            if tiled {
                let end = |z: f32| {
                    let of = memory.vertices.iter().filter(|at| at[2] == z);
                    of.map(|at| (at[0].to_bits(), at[1].to_bits())).collect::<BTreeSet<_>>()
                };
                assert_eq!(end(0.0), end(roll.length() as f32));
            }
        }
    }
}

#[test]
fn gives_the_same_bodies_for_any_number_of_threads() {
    let values = rough(200, 150, 21);
    let heights = Heights::of_canvas(&values, [200, 150], [0.05; 2], [true; 2]).unwrap();
    let mut all = BTreeMap::new();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        for even in [false, true] {
            let made = pool.install(|| plate(&heights, &tiles(&heights, Tolerance::flat(0.01), even), [1, 1]).0);
            let known = all.entry(even).or_insert_with(|| made.clone());
            assert!(*known == made, "{threads}, {even}");
        }
    }
}

#[test]
fn gives_the_same_bodies_for_any_number_of_rows_at_once() {
    let values = rough(150, 270, 33);
    let flat = || Heights::of_canvas(&values, [150, 270], [0.05; 2], [true; 2]).unwrap();
    let round = || Heights::round(&values, [150, 270], [0.05; 2], true, 2).unwrap();
    for even in [false, true] {
        let whole = flat();
        let known = plate(&whole, &tiles(&whole, Tolerance::flat(0.01), even), [1, 2]).0;
        let roll = |heights: &Heights<'_>| {
            let tolerance = Tolerance::round(0.02, 300.0 * 0.05 / std::f64::consts::TAU, 600);
            let tiles = tiles(heights, tolerance, even);
            let mut memory = Memory::default();
            Roll { heights, tiles: &tiles, repeats: [2, 1], bore: 0.0, error: 0.02, steepest: 90.0 }
                .build(&mut memory)
                .unwrap();
            memory
        };
        let rolled = roll(&round());
        for held in [1, 152 * 70, 152 * 140] {
            let parts = flat().holding(held);
            assert_eq!((parts.extent(), parts.steepest()), (whole.extent(), whole.steepest()));
            assert!(known == plate(&parts, &tiles(&parts, Tolerance::flat(0.01), even), [1, 2]).0, "{held}, {even}");
            assert!(rolled == roll(&round().holding(held)), "{held}, {even}");
        }
    }
}

#[test]
fn stops_when_told() {
    let values = rough(9, 9, 1);
    let heights = Heights::of_canvas(&values, [9, 9], [1.0; 2], [false; 2]).unwrap();
    let stopped = |made: io::Result<()>| made.is_err_and(|error| error.kind() == io::ErrorKind::Interrupted);
    assert!(stopped(fewest(&heights, Tolerance::flat(0.1), (memory(), u64::MAX), &|| true).map(drop)));
    assert!(stopped(Even::new(&heights, Tolerance::flat(0.1), &memory, &|| true).map(drop)));
}
