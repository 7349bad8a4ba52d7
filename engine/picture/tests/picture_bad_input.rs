//! Damaged picture files: each gives a clear error, no panic, and no more memory than the limits allow. A separate
//! program, because it measures its own memory.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, its helpers too")]

#[path = "all/pictures/mod.rs"]
mod pictures;

use pictures::{LIMITS, mend_checksums, samples, written};
use proptest::prelude::*;
use proptest::sample::Index;
use shibo_picture::{
    Compression, Depth, FileError, Format, ReadError, ReadLimits, check, check_bytes, header, header_bytes, read,
    read_bytes,
};
use std::path::Path;

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
                // Only text at the end of the file may be missing.
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

/// A change of a file: position, length, new value, and kind of change.
type Change = (Index, Index, u8, u8);

fn changed(sample: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for (place, length, value, how) in changes {
        // Headers are the sensitive part.
        let end = if how & 1 == 0 { bytes.len().min(400) } else { bytes.len() };
        let place = place.index(end.max(1)).min(bytes.len());
        let stop = (place + 1 + length.index(24)).min(bytes.len());
        match how >> 1 {
            0 => drop(bytes.drain(place..stop)),
            1 => bytes.splice(place..place, bytes[place..stop].to_vec()).for_each(drop),
            _ => bytes.iter_mut().skip(place).take(1).for_each(|byte| *byte = *value),
        }
    }
    // Wrong PNG checksums would hide most of the changes.
    if changes.len().is_multiple_of(2) && bytes.starts_with(b"\x89PNG") {
        mend_checksums(&mut bytes);
    }
    bytes
}

/// Checks and reads a file. A file that passes the check must be readable, unless its compressed samples are damaged.
fn check_and_read(bytes: &[u8]) {
    let checked = check_bytes(bytes, &LIMITS);
    match (&checked, read_bytes(bytes, &LIMITS)) {
        (Ok(header), Ok(picture)) => {
            let size = (picture.width, picture.height, picture.channels, picture.source, picture.has_alpha);
            assert_eq!((header.width, header.height, header.channels, header.kind, header.has_alpha), size);
        }
        (Ok(_), Err(ReadError::Damaged(_))) => {}
        (Ok(_), Err(error)) => panic!("passes the check and is refused: {error}"),
        (Err(error), Err(read)) => assert_eq!(error.to_string(), read.to_string()),
        (Err(error), Ok(_)) => panic!("is read and does not pass the check: {error}"),
    }
    for error in [checked.err(), header_bytes(bytes).err()].into_iter().flatten() {
        assert!(!error.to_string().contains("gave up"), "a decoder panicked");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]
    #[test]
    fn mutations_neither_panic_nor_exhaust_memory(
        changes in proptest::collection::vec((any::<Index>(), any::<Index>(), any::<u8>(), 0..12_u8), 1..12),
    ) {
        use std::sync::LazyLock;
        static SAMPLES: LazyLock<Vec<Vec<u8>>> = LazyLock::new(samples);
        for sample in SAMPLES.iter() {
            check_and_read(&changed(sample, &changes));
        }
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
    // One entry per line: tag, type, count, value.
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
    let with = |method: u32, size: u32, rows, count| {
        let base = [(258, 3, 1, 8), (259, 3, 1, method), (262, 3, 1, 1), (277, 3, 1, 1)];
        let more = [(256, 4, 1, size), (257, 4, 1, size), (273, 4, count, 8), (278, 4, 1, rows), (279, 4, count, 8)];
        let mut entries = [&base[..], &more].concat();
        entries.sort_unstable();
        tiff(&entries)
    };
    for (size, rows, count) in
        [(64, 1, u32::MAX), (64, 0, 64), (64, 64, 1 << 28), (1 << 20, 1, 1 << 20), (u32::MAX, 1, 1)]
    {
        for method in [1, 5] {
            assert!(!error_of(&with(method, size, rows, count)).to_string().is_empty());
        }
    }
    let lenient = ReadLimits { max_pixels: u64::MAX, max_bytes_decoded: u64::MAX, ..LIMITS };
    for (method, reason) in [(1, "it ends within the picture"), (5, "cannot hold")] {
        let error = read_bytes(&with(method, 40_000, 40_000, 1), &lenient).unwrap_err();
        assert!(error.to_string().contains(reason), "{error}");
    }
}

fn file_error(path: &Path) -> FileError {
    assert!(header(path).is_err());
    let error = read(path, &LIMITS).unwrap_err();
    assert_eq!(check(path, None, &LIMITS).unwrap_err().to_string(), error.to_string());
    error
}

#[test]
fn does_not_open_special_files() {
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
    for error in [read(&path, &LIMITS).unwrap_err(), check(&path, None, &LIMITS).unwrap_err()] {
        assert!(matches!(error.reason, ReadError::FileTooLarge { bytes, .. } if bytes == 1 << 40), "{error}");
    }
}
