//! Files that are not what they should be: a clear error each, no panic, no more memory than the limits allow.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, its helpers too")]

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding as ExrEncoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage,
};
use proptest::prelude::*;
use shibo_engine::picture::{
    Compression, Depth, Encoding, FileError, Format, PictureSpec, ReadError, ReadLimits, Writer, header, header_bytes,
    read, read_bytes,
};
use std::io::Cursor;
use std::path::Path;

/// What the tests allow: generous for their files, small for the machine.
const LIMITS: ReadLimits = ReadLimits { max_file_bytes: 16 << 20, max_pixels: 1 << 22, max_bytes_decoded: 64 << 20 };

fn written(format: Format, depth: Depth, channels: usize, compression: Compression) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let names = (0..channels).map(|index| format!("c{index}")).collect();
    let (encoding, metadata) = (Encoding::default(), vec![("Software".to_owned(), "test".to_owned())]);
    let spec = PictureSpec { width: 37, height: 41, channels: names, format, depth, encoding, compression, metadata };
    let plane: Vec<f32> = (0..37 * 41_u16).map(|index| f32::from(index % 251) / 250.0).collect();
    let mut writer = Writer::create(&path, &spec).unwrap();
    writer.write_rows(&vec![&plane[..]; channels], 41).unwrap();
    writer.finish().unwrap();
    std::fs::read(&path).unwrap()
}

fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels: Vec<u8> = (0..37 * 41 * 3_u16).map(|index| index.to_le_bytes()[0]).collect();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut bytes);
    encoder.encode(&pixels, 37, 41, image::ExtendedColorType::Rgb8).unwrap();
    bytes
}

fn tiled_exr() -> Vec<u8> {
    let data = FlatSamples::F32((0..37 * 41_u16).map(f32::from).collect());
    let channels = AnyChannels::sort(std::iter::once(AnyChannel::new("height", data)).collect());
    let layer = Layer::new((37, 41), LayerAttributes::named("l"), ExrEncoding::FAST_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn lzw_tiff() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let compression = tiff::encoder::Compression::Lzw;
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
    encoder.write_image::<tiff::encoder::colortype::Gray16>(37, 41, &[77; 37 * 41]).unwrap();
    bytes.into_inner()
}

/// A good file of each sort.
fn samples() -> Vec<Vec<u8>> {
    use Compression::{Best, Fast};
    vec![
        written(Format::Png, Depth::U8, 4, Best),
        written(Format::Png, Depth::U16, 1, Fast),
        written(Format::Tiff, Depth::U8, 3, Best),
        written(Format::Tiff, Depth::F32, 1, Fast),
        written(Format::Exr, Depth::F16, 5, Best),
        written(Format::Exr, Depth::F32, 1, Fast),
        jpeg(),
        tiled_exr(),
        lzw_tiff(),
    ]
}

fn error_of(bytes: &[u8]) -> ReadError {
    read_bytes(bytes, &LIMITS).expect_err("the file is bad")
}

#[test]
fn the_samples_are_good() {
    samples().iter().for_each(|bytes| assert!(read_bytes(bytes, &LIMITS).is_ok()));
}

#[test]
fn every_truncation_is_an_error() {
    for (number, bytes) in samples().into_iter().enumerate() {
        let whole = read_bytes(&bytes, &LIMITS).unwrap();
        let step = (bytes.len() / 200).max(1);
        for length in (0..bytes.len()).step_by(step).chain(bytes.len() - 8..bytes.len()) {
            let reading = read_bytes(&bytes[..length], &LIMITS);
            let error = match reading {
                Err(error) => error,
                // What is missing may be text that ends a file.
                Ok(picture) if picture == whole && length + 40 > bytes.len() => continue,
                Ok(_) => panic!("sample {number}: half a picture from {length} of {} bytes", bytes.len()),
            };
            let _ = header_bytes(&bytes[..length]);
            assert!(!error.is_too_large(), "{error}");
        }
    }
}

/// Peak of resident memory, in MiB.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("VmHWM: 0 kB").to_owned();
    line.split_whitespace().nth(1).and_then(|number| number.parse::<u64>().ok()).unwrap_or(0) >> 10
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(600) })]
    #[test]
    fn mutations_neither_panic_nor_eat_memory(
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>(), any::<bool>()), 1..12),
    ) {
        use std::sync::atomic::{AtomicUsize, Ordering};
        use std::sync::{Arc, LazyLock};
        static SAMPLES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(samples);
        let panics = Arc::new(AtomicUsize::new(0));
        for sample in SAMPLES.iter() {
            let mut bytes = sample.clone();
            for (place, value, early) in &changes {
                // Headers are where it hurts.
                let end = if *early { bytes.len().min(400) } else { bytes.len() };
                let place = place.index(end);
                bytes[place] = *value;
            }
            for error in [read_bytes(&bytes, &LIMITS).err(), header_bytes(&bytes).err()] {
                if matches!(&error, Some(ReadError::Corrupt(reason)) if reason.contains("gave up")) {
                    panics.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        prop_assert_eq!(panics.load(Ordering::Relaxed), 0, "a decoder panicked");
        prop_assert!(peak() < 400, "{} MiB", peak());
    }
}

#[test]
fn an_exr_of_400_bytes_that_asks_for_40_gb() {
    let mut bytes = written(Format::Exr, Depth::F32, 1, Compression::Fast);
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let place = bytes.windows(name.len()).position(|part| part == name).unwrap() + name.len() + 4;
        bytes[place + 8..place + 16].copy_from_slice(&[0x9f, 0x86, 1, 0, 0x9f, 0x86, 1, 0]);
    }
    bytes.truncate(400);
    let error = error_of(&bytes);
    let lenient = ReadLimits { max_file_bytes: u64::MAX, max_pixels: u64::MAX, max_bytes_decoded: u64::MAX };
    assert!(error.is_too_large() || error.to_string().contains("chunk count"), "{error}");
    let error = read_bytes(&bytes, &lenient).unwrap_err();
    assert!(matches!(error, ReadError::Truncated(_) | ReadError::Corrupt(_)), "{error}");
}

#[test]
fn a_png_of_80_bytes_and_11000_squared() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 11000, 11000);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, &[0x78, 1, 3, 0, 0, 0, 0, 1]).unwrap();
    drop(writer);
    let error = error_of(&bytes);
    assert!(error.is_too_large(), "{error}");
    assert!(error.to_string().contains("`11000x11000`"), "{error}");
    let lenient = ReadLimits { max_pixels: u64::MAX, max_bytes_decoded: u64::MAX, ..LIMITS };
    let error = read_bytes(&bytes, &lenient).unwrap_err();
    assert!(error.to_string().contains("cannot hold the `11000x11000` pixels"), "{error}");
}

#[test]
fn a_tiff_with_absurd_counts() {
    // One entry a line: tag, type, count, value.
    let tiff = |entries: &[(u16, u16, u32, u32)]| {
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        bytes.extend(u16::try_from(entries.len()).unwrap().to_le_bytes());
        for (tag, kind, count, value) in entries {
            bytes.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
            bytes.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
        }
        bytes.extend([0; 4]);
        bytes
    };
    let base = [(258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 1), (277, 3, 1, 1)];
    let with = |size: u32, rows, count| {
        let more = [(256, 4, 1, size), (257, 4, 1, size), (273, 4, count, 8), (278, 4, 1, rows), (279, 4, count, 8)];
        let mut entries = [&base[..], &more].concat();
        entries.sort_unstable();
        tiff(&entries)
    };
    for (size, rows, count) in
        [(64, 1, u32::MAX), (64, 0, 64), (64, 64, 1 << 28), (1 << 20, 1, 1 << 20), (u32::MAX, 1, 1)]
    {
        let error = error_of(&with(size, rows, count));
        assert!(!error.to_string().is_empty());
    }
    let lenient = ReadLimits { max_pixels: u64::MAX, max_bytes_decoded: u64::MAX, ..LIMITS };
    let error = read_bytes(&with(40_000, 40_000, 1), &lenient).unwrap_err();
    assert!(error.to_string().contains("cannot hold"), "{error}");
}

#[test]
fn other_formats_are_named() {
    for (start, name) in [
        (&b"GIF89a...."[..], "it is GIF"),
        (b"BM..........", "it is BMP"),
        (b"RIFF....WEBPVP8 ", "it is WebP"),
        (b"....ftypavif", "it is AVIF"),
        (b"#?RADIANCE\n", "it is Radiance HDR"),
        (b"hello", "its format is not known"),
        (b"\x89", "its format is not known"),
    ] {
        let message = error_of(start).to_string();
        assert!(message.starts_with(name) && message.contains("PNG, JPEG, TIFF or OpenEXR"), "{message}");
    }
    assert!(matches!(error_of(b""), ReadError::Empty));
}

fn file_error(path: &Path) -> FileError {
    assert!(header(path).is_err());
    read(path, &LIMITS).unwrap_err()
}

#[test]
fn what_is_no_file_is_not_opened() {
    let folder = tempfile::tempdir().unwrap();
    let missing = file_error(&folder.path().join("none.png"));
    assert!(missing.reason.is_not_found());
    assert!(missing.to_string().ends_with("none.png`: there is no such file; check the path"), "{missing}");
    assert!(file_error(folder.path()).to_string().ends_with("it is a folder; it must be a regular file"));
    std::fs::write(folder.path().join("empty.png"), "").unwrap();
    assert!(matches!(file_error(&folder.path().join("empty.png")).reason, ReadError::Empty));
    #[cfg(unix)]
    {
        assert!(file_error(Path::new("/dev/zero")).to_string().contains("it is a device"));
        let pipe = folder.path().join("pipe");
        if std::process::Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()) {
            assert!(file_error(&pipe).to_string().contains("it is a named pipe"));
        }
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        assert!(file_error(&socket).to_string().contains("it is a socket"));
    }
}

#[test]
fn large_files_are_not_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sparse.exr");
    std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    let error = read(&path, &LIMITS).unwrap_err();
    assert!(matches!(error.reason, ReadError::FileTooLarge { bytes, .. } if bytes == 1 << 40), "{error}");
}
