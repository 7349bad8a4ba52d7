//! Noise of turned octaves shows no lines along x and y: two measures of the traces of a grid in its rows and columns.
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::window::Frame;
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Basis, FractalKind, Noise, NoiseSpec};
use shibo_value::{Tiling, Window};
use std::f64::consts::TAU;

/// Side of the picture in pixels, and side of a cell of the first octave.
const SIDE: usize = 256;
const CELL: usize = 32;

/// A picture with pixels of 1 mm on a canvas that tiles.
struct Picture(Vec<f64>);

impl Picture {
    fn of(basis: Basis, fractal: FractalKind, (aspect, angle): (f64, f64), seed: u64) -> Self {
        let shape = CellShape { size: CELL as f64, aspect, angle };
        let spec = NoiseSpec { basis, fractal, shape, turned: true, ..NoiseSpec::fbm(CELL as f64, 5) };
        let noise = Noise::new(&spec, (DVec2::splat(SIDE as f64), Tiling::BOTH), Hash::new(seed));
        let mut out = vec![0.0; SIDE * SIDE];
        let window = Window { x: 0, y: 0, width: SIDE as u32, height: SIDE as u32 };
        noise.fill(&Frame::new(window, [1.0; 2]), &mut out);
        Self(out.into_iter().map(f64::from).collect())
    }

    /// The pixel (x, y), or (y, x) if columns and rows are exchanged.
    fn at(&self, x: usize, y: usize, rows: bool) -> f64 {
        let (x, y) = if rows { (y, x) } else { (x, y) };
        self.0[y % SIDE * SIDE + x % SIDE]
    }

    /// The picture as a height, lit from the upper left.
    fn lit(&self) -> Self {
        let depth = 12.0;
        let shade = |p: usize| {
            let (x, y) = (p % SIDE, p / SIDE);
            let slope = |dx: usize, dy: usize| {
                depth * 0.5 * (self.at(x + dx, y + dy, false) - self.at(x + SIDE - dx, y + SIDE - dy, false))
            };
            let normal = glam::DVec3::new(-slope(1, 0), -slope(0, 1), 1.0).normalize();
            normal.dot(glam::DVec3::new(-0.5, -0.5, 0.7).normalize()).max(0.0)
        };
        Self((0..SIDE * SIDE).map(shade).collect())
    }
}

/// The energy of waves across columns (or rows) that are constant along them, divided by the energy of waves with two
/// to four periods along them.
fn axis_energy(picture: &Picture, rows: bool) -> f64 {
    let energy = |along: usize| -> f64 {
        // Multiply each column by a wave with `along` periods, then measure the waves across.
        let wave = |y: usize| TAU * (along * y % SIDE) as f64 / SIDE as f64;
        let line: Vec<[f64; 2]> = (0..SIDE)
            .map(|x| {
                (0..SIDE).fold([0.0; 2], |[c, s], y| {
                    let v = picture.at(x, y, rows);
                    [c + v * wave(y).cos(), s + v * wave(y).sin()]
                })
            })
            .collect();
        // Wavelengths from half a cell down to four pixels.
        (SIDE / CELL * 2..SIDE / 4)
            .map(|k| {
                let sum = line.iter().enumerate().fold([0.0; 2], |[re, im], (x, [c, s])| {
                    let (sin, cos) = (TAU * (k * x % SIDE) as f64 / SIDE as f64).sin_cos();
                    [re + c * cos + s * sin, im + s * cos - c * sin]
                });
                sum[0] * sum[0] + sum[1] * sum[1]
            })
            .sum()
    };
    energy(0) / ((2..5).map(energy).sum::<f64>() / 3.0)
}

/// The spread of the mean second difference of columns (or rows) over their position in a cell, its half and its
/// quarter. It is divided by the spread over the position in lengths unrelated to cells.
fn spread(picture: &Picture, rows: bool) -> f64 {
    let second = |x: usize, y: usize| {
        let v = |dx: usize| picture.at(x + SIDE - 1 + dx, y, rows);
        (v(0) - 2.0 * v(1) + v(2)).abs()
    };
    let means: Vec<f64> = (0..SIDE).map(|x| (0..SIDE).map(|y| second(x, y)).sum::<f64>() / SIDE as f64).collect();
    let variance = |period: f64| -> f64 {
        let bins = 8;
        let mut sums = vec![(0.0, 0.0); bins];
        for (x, mean) in means.iter().enumerate() {
            let bin = ((x as f64 / period).fract() * bins as f64) as usize;
            sums[bin].0 += mean;
            sums[bin].1 += 1.0;
        }
        let folded: Vec<f64> = sums.iter().map(|(sum, n)| sum / f64::max(*n, 1.0)).collect();
        let mean = folded.iter().sum::<f64>() / bins as f64;
        folded.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / bins as f64
    };
    let (mut found, mut chance) = (0.0, 0.0);
    for period in [1.0, 0.5, 0.25].map(|share| share * CELL as f64) {
        found += variance(period);
        chance += [0.79, 0.87, 1.13, 1.21].map(|by| variance(by * period)).iter().sum::<f64>() / 4.0;
    }
    (found / chance).sqrt()
}

/// Both measures, the mean over seeds and over columns and rows.
fn measured(basis: Basis, fractal: FractalKind, frame: (f64, f64)) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for seed in 0..4 {
        let picture = Picture::of(basis, fractal, frame, seed);
        let lit = picture.lit();
        for rows in [false, true] {
            sums[0] += axis_energy(&lit, rows) / 8.0;
            sums[1] += spread(&picture, rows) / 8.0;
        }
    }
    sums
}

#[test]
fn shows_no_lines_along_x_and_y() {
    let mut bad = Vec::new();
    for basis in [Basis::Gradient, Basis::Value, Basis::Simplex] {
        for fractal in [FractalKind::Fbm, FractalKind::Billow, FractalKind::Ridged, FractalKind::Turbulence] {
            for frame in [(1.0, 0.0), (1.0, 0.4)] {
                let [energy, spread] = measured(basis, fractal, frame);
                // Grids along x and y have 4 to 120 times the energy of the adjacent waves.
                if energy > 2.5 || spread > 1.5 {
                    bad.push(format!("{basis:?} {fractal:?} {frame:?}: {energy:.2} {spread:.2}"));
                }
            }
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn finds_the_lines_of_a_grid_that_lies_along_x_and_y() {
    // White noise consists of squares along x and y: the measures detect them.
    let [energy, spread] = measured(Basis::White, FractalKind::Billow, (1.0, 0.0));
    assert!(energy > 4.0 && spread > 2.0, "{energy} {spread}");
}
