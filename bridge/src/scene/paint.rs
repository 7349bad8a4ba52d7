//! Fields as pictures for a screen: mapping of values to colours, and PNG encoding.
use png::{BitDepth, ColorType, DeflateCompression, Encoder, Filter};
use rayon::prelude::*;
use shibo_picture::SrgbEncoder;
use shibo_value::{Tile, Type};
use std::io::Write;

/// Tolerance within which a value outside 0..1 still counts as a fraction.
const SLACK: f32 = 1e-3;

/// Values of a tile shown as black and white: 0 and 1 if all values lie between, else minimum and maximum. For vectors
/// and matrices the range is symmetric about 0.
pub fn range(ty: Type, tile: &Tile) -> [f32; 2] {
    let fold = |f: fn(f32, f32) -> f32, start| tile.data().iter().copied().filter(|v| v.is_finite()).fold(start, f);
    let (least, greatest) = (fold(f32::min, f32::INFINITY), fold(f32::max, f32::NEG_INFINITY));
    match ty {
        _ if least > greatest => [0.0, 1.0],
        Type::Vec2 | Type::Jacobian => {
            let reach = least.abs().max(greatest.abs()).max(f32::MIN_POSITIVE);
            [-reach, reach]
        }
        Type::Gray if least < -SLACK || greatest > 1.0 + SLACK => [least, greatest],
        _ => [0.0, 1.0],
    }
}

/// Maps values to colours.
pub struct Painter {
    ty: Type,
    range: [f32; 2],
    srgb: Option<SrgbEncoder>,
}

impl Painter {
    /// Creates a painter for values of type `ty`; the ends of `range` become black and white.
    pub fn new(ty: Type, range: [f32; 2]) -> Self {
        Self { ty, range, srgb: (ty == Type::Rgb).then(SrgbEncoder::new) }
    }

    /// Encodes a tile as PNG; `None` if it was stopped.
    pub fn png(&self, tile: &Tile, until: &(dyn Fn() -> bool + Sync)) -> Option<Vec<u8>> {
        let (bytes, channels) = self.bytes(tile, until);
        encode(&bytes, tile.window.width, tile.window.height, channels, until)
    }

    /// Encodes a tile as PNG, shrunk to at most `longest` pixels per side.
    pub fn small(&self, tile: &Tile, longest: u32) -> (Vec<u8>, [u32; 2]) {
        let (bytes, channels) = self.bytes(tile, &|| false);
        small(&bytes, [tile.window.width, tile.window.height], channels, longest)
    }

    /// Pixels by rows, and their number of channels.
    fn bytes(&self, tile: &Tile, until: &(dyn Fn() -> bool + Sync)) -> (Vec<u8>, usize) {
        let channels = if self.ty == Type::Gray { 1 } else { 3 };
        let width = tile.width();
        let mut bytes = vec![0; width * tile.height() * channels];
        let paint = |(y, row): (usize, &mut [u8])| {
            if !until() {
                self.row(tile, y, row);
            }
        };
        bytes.par_chunks_mut((width * channels).max(1)).enumerate().for_each(paint);
        (bytes, channels)
    }

    fn row(&self, tile: &Tile, y: usize, out: &mut [u8]) {
        match (self.ty, &self.srgb) {
            (Type::Gray, _) => out.iter_mut().zip(tile.row(0, y)).for_each(|(o, v)| *o = self.code(*v)),
            (Type::Ids, _) => {
                for (o, id) in out.chunks_exact_mut(3).zip(tile.row(0, y)) {
                    o.copy_from_slice(&region(*id));
                }
            }
            (_, srgb) => {
                for c in 0..3 {
                    let row = if c < tile.channels() { Some(tile.row(c, y)) } else { None };
                    for (x, o) in out.chunks_exact_mut(3).enumerate() {
                        let value = row.map_or(0.0, |row| row[x]);
                        o[c] = match srgb {
                            Some(srgb) => srgb.code(value),
                            None if row.is_none() => 128,
                            None => self.code(value),
                        };
                    }
                }
            }
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
    #[expect(clippy::cast_sign_loss, reason = "the cast saturates")]
    fn code(&self, value: f32) -> u8 {
        let [lo, hi] = self.range;
        ((value - lo) / (hi - lo).max(f32::MIN_POSITIVE) * 255.0 + 0.5) as u8
    }
}

/// Shrinks pixels to at most `longest` per side, each the mean of the pixels it covers, and encodes them as PNG.
pub fn small(bytes: &[u8], [width, height]: [u32; 2], channels: usize, longest: u32) -> (Vec<u8>, [u32; 2]) {
    let side = u64::from(width.max(height)).max(1);
    let scaled = |n: u32| match u64::from(n) * u64::from(longest) {
        _ if side <= u64::from(longest) => n,
        wide => u32::try_from(wide.div_ceil(side)).unwrap_or(n).max(1),
    };
    let size = [scaled(width), scaled(height)];
    let [w, h, columns, rows] = [width, height, size[0], size[1]].map(|n| n as usize);
    let mut out = Vec::with_capacity(columns * rows * channels);
    for y in 0..rows {
        let (top, bottom) = (y * h / rows, ((y + 1) * h / rows).max(y * h / rows + 1));
        for x in 0..columns {
            let (left, right) = (x * w / columns, ((x + 1) * w / columns).max(x * w / columns + 1));
            for c in 0..channels {
                let row = |y: usize| (left..right).map(move |x| usize::from(bytes[(y * w + x) * channels + c]));
                let sum: usize = (top..bottom).flat_map(row).sum();
                let count = (bottom - top) * (right - left);
                out.push(u8::try_from((sum + count / 2) / count).unwrap_or(u8::MAX));
            }
        }
    }
    (encode(&out, size[0], size[1], channels, &|| false).unwrap_or_default(), size)
}

/// Colour of a region; consecutive ids have very different hues.
#[expect(clippy::cast_possible_truncation, reason = "region numbers are whole and below 2^24")]
#[expect(clippy::cast_sign_loss, reason = "region numbers are not negative")]
fn region(id: f32) -> [u8; 3] {
    let hash = (id as u32).wrapping_add(1).wrapping_mul(0x9e37_79b1);
    [8, 16, 24].map(|shift| 56 + ((hash >> shift) & 0xff) as u8 / 4 * 3)
}

/// Number of bytes packed between two checks whether to stop: about a millisecond of work.
const STEP: usize = 1 << 18;

/// Encodes pixels as PNG with fast compression; `None` if it was stopped.
fn encode(bytes: &[u8], width: u32, height: u32, channels: usize, until: &dyn Fn() -> bool) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(bytes.len() / 2 + 1024);
    let mut encoder = Encoder::new(&mut out, width, height);
    encoder.set_color(if channels == 1 { ColorType::Grayscale } else { ColorType::Rgb });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_deflate_compression(DeflateCompression::FdeflateUltraFast);
    encoder.set_filter(Filter::Up);
    let mut stopped = false;
    let written = encoder.write_header().and_then(|mut writer| {
        let mut stream = writer.stream_writer_with_size(STEP)?;
        for part in bytes.chunks(STEP) {
            stopped |= until();
            if stopped {
                return Ok(());
            }
            stream.write_all(part)?;
        }
        stream.finish()
    });
    // Writing into memory does not fail; encoding fails only for a picture without pixels.
    if written.is_err() {
        out.clear();
    }
    (!stopped).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, UVec2};
    use shibo_value::{Grid, Window};

    fn tile(channels: usize, values: &[f32]) -> Tile {
        let size = UVec2::new(2, 1);
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: None, shown: None };
        let mut tile = Tile::new(grid, Window::full(size), channels);
        tile.data_mut().copy_from_slice(values);
        tile
    }

    #[test]
    fn chooses_range_by_type_and_values() {
        assert_eq!(range(Type::Gray, &tile(1, &[0.2, 0.7])), [0.0, 1.0]);
        assert_eq!(range(Type::Gray, &tile(1, &[-0.25, 0.5])), [-0.25, 0.5]);
        assert_eq!(range(Type::Vec2, &tile(2, &[-3.0, 1.0, 0.0, 2.0])), [-3.0, 3.0]);
        assert_eq!(range(Type::Gray, &tile(1, &[f32::NAN, f32::NAN])), [0.0, 1.0]);
    }

    #[test]
    fn shrinks_pictures_by_means() {
        let bytes: Vec<u8> = (0..6 * 4).map(|i| if i % 6 < 3 { 0 } else { 200 }).collect();
        let decoded = |(png, size): (Vec<u8>, [u32; 2])| {
            let image = image::load_from_memory(&png).unwrap();
            assert_eq!([image.width(), image.height()], size);
            image.to_luma8().into_raw()
        };
        assert_eq!(decoded(small(&bytes, [6, 4], 1, 2)), [0, 200, 0, 200]);
        assert_eq!(decoded(small(&bytes, [6, 4], 1, 1)), [100]);
        assert_eq!(decoded(small(&bytes, [6, 4], 1, 6)), bytes);
    }

    #[test]
    fn maps_values_to_colours() {
        let mut row = [0; 2];
        Painter::new(Type::Gray, [-1.0, 1.0]).row(&tile(1, &[-1.0, 0.0]), 0, &mut row);
        assert_eq!(row, [0, 128]);
        let mut row = [0; 6];
        Painter::new(Type::Rgb, [0.0, 1.0]).row(&tile(3, &[0.0, 1.0, 0.0, 2.0, 0.2, -1.0]), 0, &mut row);
        assert_eq!(row, [0, 0, 124, 255, 255, 0]);
        let png = Painter::new(Type::Rgb, [0.0, 1.0]).png(&tile(3, &[0.0; 6]), &|| false).unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        assert_eq!(Painter::new(Type::Rgb, [0.0, 1.0]).png(&tile(3, &[0.0; 6]), &|| true), None);
    }
}
