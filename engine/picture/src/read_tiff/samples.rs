//! Unpacks strips and tiles into the planes of the picture.
use super::super::SampleKind;
use super::super::guard::guarded;
use super::super::limits::ReadError;
use super::super::read_png::packed_sample;
use super::layout::Layout;
use super::places::ChunkLocations;
use super::unpack::unpack;
use half::f16;
use rayon::prelude::*;
use tiff::tags::Predictor;

/// All channels, one after another, as stored.
pub(super) fn planes(file: &[u8], layout: &Layout, places: &ChunkLocations) -> Result<Vec<f32>, ReadError> {
    let width = layout.width as usize;
    let pixels = width * layout.height as usize;
    let mut planes = vec![0.0; pixels * usize::from(layout.header.channels)];
    // Rows of each strip or row of tiles, for all channels.
    let mut bands: Vec<Vec<&mut [f32]>> = (0..places.down).map(|_| Vec::new()).collect();
    for plane in planes.chunks_exact_mut(pixels) {
        for (band, rows) in bands.iter_mut().zip(plane.chunks_mut(width * places.rows as usize)) {
            band.push(rows);
        }
    }
    let fill = |(row, mut band): (usize, Vec<&mut [f32]>)| guarded(|| fill(file, layout, places, row, &mut band));
    let done: Vec<Result<(), ReadError>> = bands.into_par_iter().enumerate().map(fill).collect();
    // Report the first error, independent of the threads.
    done.into_iter().collect::<Result<(), ReadError>>()?;
    Ok(planes)
}

/// Unpacks one strip or one row of tiles.
fn fill(
    file: &[u8],
    layout: &Layout,
    places: &ChunkLocations,
    row: usize,
    band: &mut [&mut [f32]],
) -> Result<(), ReadError> {
    let (width, wide, together) = (layout.width as usize, places.wide as usize, layout.together());
    let groups = if layout.planes_apart { band.len() } else { 1 };
    let mut scratch = Vec::new();
    for group in 0..groups {
        for x in 0..places.across {
            let index = (group * places.down + row) * places.across + x;
            let mut bytes = unpack(file, layout, places, index)?;
            let (from, to) = (x * wide, ((x + 1) * wide).min(width));
            for (y, line) in bytes.chunks_exact_mut(places.row_bytes).enumerate() {
                restore(line, layout, together, &mut scratch);
                let place = y * width + from..y * width + to;
                if let Some(palette) = &layout.palette {
                    for (at, x) in place.zip(0..) {
                        let color = palette[usize::from(packed_sample(line, x, usize::from(layout.bits)))];
                        band.iter_mut().zip(color).for_each(|(plane, value)| plane[at] = value);
                    }
                } else if layout.planes_apart {
                    put(line, layout, (1, 0), group, &mut band[group][place]);
                } else {
                    for (channel, plane) in band.iter_mut().enumerate() {
                        put(line, layout, (together, channel), channel, &mut plane[place.clone()]);
                    }
                }
            }
        }
    }
    Ok(())
}

/// Undoes the predictor of a row, and converts its samples to native byte order.
fn restore(row: &mut [u8], layout: &Layout, together: usize, scratch: &mut Vec<u8>) {
    let bytes = layout.header.kind.bytes();
    if layout.predictor == Predictor::FloatingPoint {
        // The highest bytes of all samples, then the second ones, and so on; each is stored as a difference from the
        // one before.
        add_up::<1>(row, together, |[a], [b]| [a.wrapping_add(b)]);
        scratch.clear();
        scratch.extend_from_slice(row);
        let samples = row.len() / bytes;
        for (k, sample) in row.chunks_exact_mut(bytes).enumerate() {
            for (j, byte) in sample.iter_mut().enumerate() {
                let significance = if cfg!(target_endian = "big") { j } else { bytes - 1 - j };
                *byte = scratch[significance * samples + k];
            }
        }
        return;
    }
    if layout.is_big_endian != cfg!(target_endian = "big") {
        row.chunks_exact_mut(bytes).for_each(<[u8]>::reverse);
    }
    if layout.predictor == Predictor::Horizontal {
        match bytes {
            1 => add_up::<1>(row, together, |[a], [b]| [a.wrapping_add(b)]),
            2 => add_up::<2>(row, together, |a, b| {
                u16::from_ne_bytes(a).wrapping_add(u16::from_ne_bytes(b)).to_ne_bytes()
            }),
            _ => add_up::<4>(row, together, |a, b| {
                u32::from_ne_bytes(a).wrapping_add(u32::from_ne_bytes(b)).to_ne_bytes()
            }),
        }
    }
}

/// Adds to each sample of N bytes the sample of the pixel before.
fn add_up<const N: usize>(row: &mut [u8], together: usize, add: impl Fn([u8; N], [u8; N]) -> [u8; N]) {
    let (samples, _) = row.as_chunks_mut::<N>();
    for k in together..samples.len() {
        samples[k] = add(samples[k], samples[k - together]);
    }
}

/// Converts sample number `from` of each pixel with `together` samples to values of a channel.
fn put(row: &[u8], layout: &Layout, place: (usize, usize), channel: usize, out: &mut [f32]) {
    let inverted = layout.white_is_zero && channel == 0;
    // Inverted as an integer, which is exact.
    let code = |code: u32, most: u32| if inverted { most - code } else { code };
    match layout.header.kind {
        SampleKind::U8 if layout.bits < 8 => {
            let (bits, most) = (usize::from(layout.bits), u8::MAX >> (8 - layout.bits));
            let (together, from) = place;
            for (x, out) in out.iter_mut().enumerate() {
                let sample = packed_sample(row, x * together + from, bits);
                *out = f32::from(if inverted { most - sample } else { sample }) / f32::from(most);
            }
        }
        SampleKind::U8 => each(row, place, out, |[v]| f32::from(if inverted { !v } else { v }) / 255.0),
        SampleKind::U16 => each(row, place, out, |v| {
            let v = u16::from_ne_bytes(v);
            f32::from(if inverted { !v } else { v }) / 65535.0
        }),
        SampleKind::U32 => each(row, place, out, |v| scaled(code(u32::from_ne_bytes(v), u32::MAX).into(), u32::MAX)),
        SampleKind::I8 => each(row, place, out, |[v]| f32::from(v.cast_signed()) / 127.0),
        SampleKind::I16 => each(row, place, out, |v| f32::from(i16::from_ne_bytes(v)) / 32767.0),
        SampleKind::I32 => each(row, place, out, |v| scaled(i32::from_ne_bytes(v).into(), u32::MAX / 2)),
        SampleKind::F16 => each(row, place, out, |v| {
            let v = f16::from_ne_bytes(v).to_f32();
            if inverted { 1.0 - v } else { v }
        }),
        SampleKind::F32 => each(row, place, out, |v| {
            let v = f32::from_ne_bytes(v);
            if inverted { 1.0 - v } else { v }
        }),
    }
}

fn each<const N: usize>(
    row: &[u8],
    (together, from): (usize, usize),
    out: &mut [f32],
    convert: impl Fn([u8; N]) -> f32,
) {
    let (samples, _) = row.as_chunks::<N>();
    out.iter_mut().zip(samples.iter().skip(from).step_by(together)).for_each(|(out, sample)| *out = convert(*sample));
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to the precision of a sample is meant")]
fn scaled(sample: i64, most: u32) -> f32 {
    (sample as f64 / f64::from(most)) as f32
}
