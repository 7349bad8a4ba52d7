//! Pictures of one bit a pixel, for films: TIFF with strips of DEFLATE, and PNG. Rows are made on demand.
use super::lossless::Zlib;
use super::spec::{Compression, PictureSpec, WriteError, described};
use super::write_tiff::{Directory, begin, end, ratio};
use super::{AtomicFile, Format};
use rayon::prelude::*;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Bytes of a strip before compression.
const STRIP_BYTES: usize = 1 << 18;

/// Writes a picture in which `row` sets each pixel of a row, of the number `y`, to 1 for black or leaves it at 0. Returns
/// the complete file without its name. Only size, format, compression, pixel size and metadata of `spec` matter. `stop`
/// is asked every few rows.
///
/// # Errors
/// If the system refuses, the format is neither PNG nor TIFF, or `stop` returned true (an interrupted system call).
pub(crate) fn write(
    path: &Path,
    spec: &PictureSpec,
    stop: &(dyn Fn() -> bool + Sync),
    row: impl Fn(u32, &mut [u8]) + Sync,
) -> Result<AtomicFile, WriteError> {
    let made = AtomicFile::create(path).and_then(|mut file| {
        match spec.format {
            Format::Tiff => tiff(&mut file, spec, stop, &row)?,
            Format::Png => png(&mut file, spec, stop, &row)?,
            _ => return Err(io::ErrorKind::Unsupported.into()),
        }
        Ok(file)
    });
    made.map_err(|error| WriteError::at(path, error))
}

/// Packs pixels of 0 and 1, eight to a byte, the first one in the highest bit.
fn pack(pixels: &[u8], out: &mut Vec<u8>) {
    let (whole, rest) = pixels.as_chunks::<8>();
    // The product moves pixel k to bit 63 - k; no two terms meet.
    let byte = |pixels: &[u8; 8]| u64::from_le_bytes(*pixels).wrapping_mul(0x8040_2010_0804_0201).to_be_bytes()[0];
    out.extend(whole.iter().map(byte));
    if !rest.is_empty() {
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        out.push(byte(&last));
    }
}

/// The packed rows from `first` on.
fn rows(spec: &PictureSpec, first: u32, count: u32, row: &(impl Fn(u32, &mut [u8]) + Sync)) -> Vec<u8> {
    let mut pixels = vec![0; spec.width as usize];
    let mut bytes = Vec::with_capacity(count as usize * pixels.len().div_ceil(8));
    for y in first..first + count {
        pixels.fill(0);
        row(y, &mut pixels);
        pack(&pixels, &mut bytes);
    }
    bytes
}

/// Fails if the work is to stop.
fn go_on(stop: &(dyn Fn() -> bool + Sync)) -> io::Result<()> {
    if stop() { Err(io::ErrorKind::Interrupted.into()) } else { Ok(()) }
}

fn tiff(
    file: &mut AtomicFile,
    spec: &PictureSpec,
    stop: &(dyn Fn() -> bool + Sync),
    row: &(impl Fn(u32, &mut [u8]) + Sync),
) -> io::Result<()> {
    let row_bytes = spec.width.div_ceil(8) as usize;
    let per_strip = u32::try_from((STRIP_BYTES / row_bytes).max(1)).unwrap_or(u32::MAX).min(spec.height);
    let (big, mut position) = begin(file, row_bytes as u64 * u64::from(spec.height))?;
    let zlib = Zlib::new(spec.compression);
    let firsts: Vec<u32> = (0..spec.height).step_by(per_strip as usize).collect();
    let mut places = Vec::with_capacity(firsts.len());
    for group in firsts.chunks(2 * rayon::current_num_threads()) {
        go_on(stop)?;
        let strip = |first: &u32| zlib.stream(&rows(spec, *first, per_strip.min(spec.height - first), row));
        let strips: Vec<Vec<u8>> = group.par_iter().map(strip).collect();
        for strip in strips {
            file.write_all(&strip)?;
            places.push((position, strip.len() as u64));
            position += strip.len() as u64;
        }
    }
    let (offsets, lengths): (Vec<u64>, Vec<u64>) = places.into_iter().unzip();
    let mut directory = Directory::new(big);
    directory.longs(256, &[spec.width]);
    directory.longs(257, &[spec.height]);
    directory.shorts(258, &[1]);
    directory.shorts(259, &[8]); // DEFLATE
    directory.shorts(262, &[0]); // 1 is black
    if !spec.metadata.is_empty() {
        directory.text(270, &described(&spec.metadata));
    }
    directory.places(273, &offsets);
    directory.shorts(277, &[1]);
    directory.longs(278, &[per_strip]);
    directory.places(279, &lengths);
    if let Some([x, y]) = spec.pixel_mm {
        directory.ratio(282, ratio(10.0 / x));
        directory.ratio(283, ratio(10.0 / y));
        directory.shorts(296, &[3]); // pixels per centimetre
    }
    if let Some((_, software)) = spec.metadata.iter().find(|(name, _)| name == "Software") {
        directory.text(305, software);
    }
    end(file, big, position, &[directory])
}

fn png(
    file: &mut AtomicFile,
    spec: &PictureSpec,
    stop: &(dyn Fn() -> bool + Sync),
    row: &(impl Fn(u32, &mut [u8]) + Sync),
) -> io::Result<()> {
    let mut encoder = png::Encoder::new(BufWriter::new(file), spec.width, spec.height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_deflate_compression(match spec.compression {
        Compression::Fast => png::DeflateCompression::Level(1),
        Compression::Best => png::DeflateCompression::Level(7),
    });
    super::write_png::describe(&mut encoder, spec)?;
    let mut writer = encoder.write_header().map_err(super::write_png::to_io)?;
    let mut stream = writer.stream_writer().map_err(super::write_png::to_io)?;
    for y in 0..spec.height {
        go_on(stop)?;
        // In PNG, 1 is white.
        let bytes: Vec<u8> = rows(spec, y, 1, row).iter().map(|byte| !byte).collect();
        stream.write_all(&bytes)?;
    }
    stream.finish().map_err(super::write_png::to_io)?;
    writer.finish().map_err(super::write_png::to_io)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packs_the_first_pixel_into_the_highest_bit() {
        let mut out = Vec::new();
        pack(&[1, 0, 0, 0, 0, 0, 1, 1, 0, 1], &mut out);
        assert_eq!(out, [0b1000_0011, 0b0100_0000]);
        for k in 0..256_u32 {
            let pixels: Vec<u8> = (0..8).map(|bit| u8::from(k >> (7 - bit) & 1 == 1)).collect();
            let mut out = Vec::new();
            pack(&pixels, &mut out);
            assert_eq!(u32::from(out[0]), k);
        }
    }

    #[test]
    fn both_formats_stop_when_asked() {
        let folder = tempfile::tempdir().unwrap();
        for format in [Format::Tiff, Format::Png] {
            let spec = PictureSpec::bilevel((37, 29), format, [0.05, 0.04]);
            let stopped = write(&folder.path().join("a"), &spec, &|| true, |_, _| {});
            let Err(WriteError::Io { source, .. }) = stopped else { panic!("{format}: it worked") };
            assert_eq!(source.kind(), io::ErrorKind::Interrupted, "{format}");
            assert_eq!(folder.path().read_dir().unwrap().count(), 0, "{format}: a file stays behind");
        }
    }

    #[test]
    fn readers_find_the_pixels_and_their_size() {
        let folder = tempfile::tempdir().unwrap();
        for format in [Format::Tiff, Format::Png] {
            let spec = PictureSpec::bilevel((37, 29), format, [0.05, 0.04]);
            let path = folder.path().join("a");
            let black = |x: u32, y: u32| (x * x + 3 * y).is_multiple_of(7);
            let fill = |y: u32, row: &mut [u8]| (0..).zip(row).for_each(|(x, v)| *v = u8::from(black(x, y)));
            write(&path, &spec, &|| false, fill).unwrap().commit().unwrap();
            let picture = crate::read(&path, &crate::ReadLimits::default()).unwrap();
            assert_eq!((picture.width, picture.height, picture.channels), (37, 29, 1));
            let wanted = |k: u32| if black(k % 37, k / 37) { 0.0 } else { 1.0 };
            assert!((0..37 * 29).all(|k| picture.planes[k as usize] == wanted(k)), "{format}");
        }
    }
}
