//! Small pictures of values, and the difference of two pictures.
#![allow(dead_code, reason = "each test program uses a part of it")]
use glam::Vec2;
use shibo_value::{Lattice, Pixels, Shapes, Tile, Type, linear_to_srgb};
use std::path::Path;

/// Width and height in pixels.
pub(crate) const SIDE: u32 = 192;
/// Side of the canvas in mm.
const CANVAS: f32 = 40.0;
const PAPER: [f32; 3] = [0.96; 3];
const INK: [f32; 3] = [0.13, 0.16, 0.22];
const THREAD: [f32; 3] = [0.62, 0.34, 0.20];

/// An 8-bit RGB picture.
pub(crate) struct Picture {
    width: u32,
    height: u32,
    samples: Vec<u8>,
}

/// Difference of two pictures, in steps of an 8-bit sample.
#[derive(Debug)]
pub(crate) struct Difference {
    /// The mean, in steps of 255.
    pub(crate) mean: f64,
    /// The 99.9th percentile.
    most: u8,
}

impl Difference {
    /// True if the difference is too small to be visible.
    pub(crate) fn within(&self, mean: f64, most: u8) -> bool {
        self.mean <= mean && self.most <= most
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

impl Picture {
    /// A picture of a field: colours as they are, other values scaled to 0..1.
    pub(crate) fn of_tile(ty: Type, tile: &Tile) -> Self {
        let (lo, hi) = tile.data().iter().fold((0.0_f32, 1.0_f32), |(lo, hi), &v| (lo.min(v), hi.max(v)));
        let narrow = tile.data().iter().fold((f32::MAX, f32::MIN), |(lo, hi), &v| (lo.min(v), hi.max(v)));
        // Heights of a fraction of a millimetre would otherwise all look the same.
        let spread = ty == Type::Gray && (lo < 0.0 || hi > 1.0 || narrow.1 - narrow.0 < 0.2);
        let (lo, hi) = if spread {
            narrow
        } else if ty == Type::Gray {
            (0.0, 1.0)
        } else {
            (lo, hi)
        };
        let value = |channel: usize, i: usize| {
            let v = tile.plane(channel.min(tile.channels() - 1))[i];
            match ty {
                Type::Rgb => linear_to_srgb(v.max(0.0)),
                Type::Normal => v,
                // Neighbouring ids get very different colours.
                Type::Ids => (v * [0.618_034, 0.754_878, 0.569_84][channel]).fract(),
                _ => (v - lo) / (hi - lo).max(f32::MIN_POSITIVE),
            }
        };
        let samples = (0..tile.window.len()).flat_map(|i| [0, 1, 2].map(|c| byte(value(c, i)))).collect();
        Self { width: tile.window.width, height: tile.window.height, samples }
    }

    /// Points as dots, lines as strokes.
    pub(crate) fn of_shapes(shapes: &Shapes<Vec2>) -> Self {
        draw(|canvas| {
            shapes.lines.iter().for_each(|ends| canvas.line(*ends, 0.16, INK));
            shapes.points.iter().for_each(|p| canvas.line([*p, *p], 0.45, INK));
        })
    }

    /// Unbroken links as lines, and points as dots.
    pub(crate) fn of_lattice(lattice: &Lattice) -> Self {
        let (positions, alive) = (&lattice.points.positions, lattice.alive());
        draw(|canvas| {
            for (link, [i, _]) in lattice.links.iter().enumerate().filter(|(link, _)| alive[*link]) {
                let from = positions[*i as usize];
                canvas.line([from, from + lattice.span(positions, link)], 0.13, THREAD);
            }
            positions.iter().for_each(|p| canvas.line([*p, *p], 0.35, INK));
        })
    }

    /// A picture with its own resolution, scaled to the sheet, or its middle if it is larger.
    pub(crate) fn of_pixels(pixels: &Pixels) -> Self {
        let planes: Vec<&[f32]> = pixels.planes().collect();
        let all = planes.iter().copied().flatten();
        let (lo, hi) = all.fold((f32::MAX, f32::MIN), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        let value = |v: f32| match pixels.ty() {
            Type::Rgb => linear_to_srgb(v),
            Type::Normal => v,
            _ => (v - lo) / (hi - lo).max(f32::MIN_POSITIVE),
        };
        let side = SIDE as usize;
        let at = |k: usize, n: usize| if n > side { k + (n - side) / 2 } else { k * n / side };
        let [width, height] = pixels.size();
        let places = (0..side).flat_map(|y| (0..side).map(move |x| at(y, height) * width + at(x, width)));
        let samples = places.flat_map(|p| [0, 1, 2].map(|c: usize| byte(value(planes[c.min(planes.len() - 1)][p]))));
        Self { width: SIDE, height: SIDE, samples: samples.collect() }
    }

    /// True if all pixels are equal.
    pub(crate) fn is_flat(&self) -> bool {
        self.samples.chunks(3).all(|p| p.iter().zip(&self.samples).all(|(a, b)| a.abs_diff(*b) < 4))
    }

    /// Reads a picture file; `None` if that fails.
    pub(crate) fn read(path: &Path) -> Option<Self> {
        let picture = image::open(path).ok()?.to_rgb8();
        Some(Self { width: picture.width(), height: picture.height(), samples: picture.into_raw() })
    }

    /// Writes the picture as PNG.
    pub(crate) fn write(&self, path: &Path) -> Result<(), String> {
        image::save_buffer(path, &self.samples, self.width, self.height, image::ColorType::Rgb8)
            .map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Expected picture, actual picture and 8 times their difference, side by side. A missing or smaller one is filled
    /// with magenta.
    pub(crate) fn beside(expected: Option<&Self>, made: &Self) -> Self {
        const GAP: u32 = 4;
        let width = expected.map_or(0, |e| e.width).max(made.width);
        let height = expected.map_or(0, |e| e.height).max(made.height);
        let of = |picture: Option<&Self>, x: u32, y: u32| picture.and_then(|picture| picture.pixel(x, y));
        let pixel = |x: u32, y: u32| {
            let (panel, x) = (x / (width + GAP), x % (width + GAP));
            let (expected, got) = (of(expected, x, y), made.pixel(x, y));
            let shown = match (panel, expected, got) {
                _ if x >= width => Some([255; 3]),
                (0, expected, _) => expected,
                (1, _, got) => got,
                (_, Some(a), Some(b)) => Some([0, 1, 2].map(|c| a[c].abs_diff(b[c]).saturating_mul(8))),
                _ => None,
            };
            shown.unwrap_or([255, 0, 255])
        };
        let whole = 3 * width + 2 * GAP;
        let samples =
            (0..height).flat_map(|y| (0..whole).map(move |x| (x, y))).flat_map(|(x, y)| pixel(x, y)).collect();
        Self { width: whole, height, samples }
    }

    fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        let at = (y * self.width + x) as usize * 3;
        (x < self.width && y < self.height).then(|| [0, 1, 2].map(|c| self.samples[at + c]))
    }

    /// The difference to another picture of the same size.
    pub(crate) fn difference(&self, other: &Self) -> Option<Difference> {
        if (self.width, self.height) != (other.width, other.height) {
            return None;
        }
        let mut steps: Vec<u8> = self.samples.iter().zip(&other.samples).map(|(a, b)| a.abs_diff(*b)).collect();
        steps.sort_unstable();
        let mean = steps.iter().map(|&s| f64::from(s)).sum::<f64>() / steps.len() as f64;
        Some(Difference { mean, most: steps[(steps.len() * 999 / 1000).min(steps.len() - 1)] })
    }
}

fn draw(paint: impl FnOnce(&mut Sheet)) -> Picture {
    let mut sheet = Sheet { pixels: vec![PAPER; (SIDE * SIDE) as usize] };
    paint(&mut sheet);
    let samples = sheet.pixels.iter().flatten().map(|&v| byte(v)).collect();
    Picture { width: SIDE, height: SIDE, samples }
}

/// A sheet that tiles, for drawing in mm.
struct Sheet {
    pixels: Vec<[f32; 3]>,
}

impl Sheet {
    /// Draws a line with round ends and a half width in mm.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels of a small sheet")]
    fn line(&mut self, [a, b]: [Vec2; 2], half: f32, color: [f32; 3]) {
        let scale = SIDE as f32 / CANVAS;
        let reach = half + 1.0 / scale;
        let (from, to) = ((a.min(b) - reach) * scale, (a.max(b) + reach) * scale);
        for y in from.y.floor() as i32..to.y.ceil() as i32 {
            for x in from.x.floor() as i32..to.x.ceil() as i32 {
                let p = (Vec2::new(x as f32, y as f32) + 0.5) / scale;
                let along = b - a;
                let t = ((p - a).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
                let cover = ((half - p.distance(a + along * t)) * scale + 0.5).clamp(0.0, 1.0);
                let side = SIDE as i32;
                let pixel = &mut self.pixels[(y.rem_euclid(side) * side + x.rem_euclid(side)) as usize];
                (0..3).for_each(|c| pixel[c] += (color[c] - pixel[c]) * cover);
            }
        }
    }
}
