//! Damaged parts: joining returns an error, writes nothing, and never panics.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking, its helpers too")]
use proptest::prelude::*;
use proptest::sample::Index;
use shibo_picture::{
    Compression, Depth, Encoding, Format, JoinError, PartHeader, PartOf, PartPicture, PartWriter, PictureSpec, Writer,
    join,
};
use std::path::Path;

const SIZE: [u32; 2] = [40, 300];

fn specs() -> Vec<PictureSpec> {
    let spec = |format, depth, channels: &[&str]| PictureSpec {
        width: SIZE[0],
        height: SIZE[1],
        channels: channels.iter().map(ToString::to_string).collect(),
        format,
        depth,
        // Dithered, which depends on the position of the pixel.
        encoding: Encoding { dither: true, ..Encoding::default() },
        compression: Compression::Fast,
        mips: Vec::new(),
        chromaticities: None,
        pixel_mm: None,
        metadata: vec![("Software".into(), "test".into())],
    };
    vec![
        spec(Format::Png, Depth::U8, &["R", "G", "B"]),
        spec(Format::Exr, Depth::F32, &["R", "G", "B"]),
        spec(Format::Tiff, Depth::U16, &["Y"]),
    ]
}

fn plane(channel: u32, first: u32, rows: u32) -> Vec<f32> {
    let value = |i: u32| ((i * 7 + 31 * channel) % 1000) as f32 / 999.0;
    (first * SIZE[0]..(first + rows) * SIZE[0]).map(value).collect()
}

fn names() -> [&'static str; 3] {
    ["a.png", "b.exr", "c.tiff"]
}

fn parts(dir: &Path) {
    parts_of(dir, &[[0, SIZE[0]]]);
}

/// Columns of `plane`.
fn columns(plane: &[f32], [x, width]: [u32; 2]) -> Vec<f32> {
    let rows = plane.chunks_exact(SIZE[0] as usize);
    rows.flat_map(|row| &row[x as usize..][..width as usize]).copied().collect()
}

/// Writes parts in blocks of columns, from top to bottom.
fn parts_of(dir: &Path, blocks: &[[u32; 2]]) {
    parts_named(dir, blocks, names());
}

/// Like `parts_of`, with these names of the pictures.
fn parts_named(dir: &Path, blocks: &[[u32; 2]], names: [&str; 3]) {
    for (number, rows) in [(1, [0, 256]), (2, [256, 44])] {
        let part = PartOf { number, count: 2 };
        let picture =
            |(file, spec): (&str, PictureSpec)| PartPicture { file: file.into(), key: "k".into(), spec: Some(spec) };
        let header = PartHeader {
            version: "1".into(),
            build: "b".into(),
            graph: "g".into(),
            parameters: String::new(),
            seed: 1,
            size: SIZE,
            part,
            rows,
            pictures: names.into_iter().zip(specs()).map(picture).collect(),
        };
        let mut writer = PartWriter::create(&dir.join(part.file_name("g")), &header).unwrap();
        for (number, spec) in specs().iter().enumerate() {
            let planes: Vec<_> =
                (0_u32..).take(spec.channels.len()).map(|channel| plane(channel, rows[0], rows[1])).collect();
            if let [[0, width]] = blocks
                && *width == SIZE[0]
            {
                let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
                writer.write_rows(number, &planes, rows[1]).unwrap();
                continue;
            }
            for [x, width] in blocks {
                // In two runs, the lower rows first.
                for [first, count] in [[20, rows[1] - 20], [0, 20]] {
                    let rows_of = |plane: &Vec<f32>| {
                        let [from, to] = [first, first + count].map(|row| (row * SIZE[0]) as usize);
                        columns(&plane[from..to], [*x, *width])
                    };
                    let block: Vec<_> = planes.iter().map(rows_of).collect();
                    let block: Vec<&[f32]> = block.iter().map(Vec::as_slice).collect();
                    writer.write_block(number, &block, [*x, rows[0] + first, *width, count]).unwrap();
                }
            }
        }
        writer.finish().unwrap();
    }
}

#[test]
fn blocks_become_the_files_of_a_single_run() {
    let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    parts_of(dir.path(), &[[7, 20], [0, 7], [27, 13]]);
    assert_eq!(joined(dir.path(), out.path()).unwrap(), whole(out.path()));
}

#[test]
fn refuses_blocks_that_do_not_fit_together() {
    // The right number of pixels, but some pixels twice and others missing.
    for blocks in [&[[0, 20], [0, 20]][..], &[[0, 20], [21, 19], [39, 1]]] {
        let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        parts_of(dir.path(), blocks);
        assert!(matches!(joined(dir.path(), out.path()), Err(JoinError::Parts(_))), "{blocks:?}");
        assert_eq!(out.path().read_dir().unwrap().count(), 0);
    }
    // Too many pixels are refused immediately.
    let dir = tempfile::tempdir().unwrap();
    let more = std::panic::catch_unwind(|| parts_of(dir.path(), &[[0, 40], [0, 1]]));
    assert!(more.is_err());
    assert_eq!(dir.path().read_dir().unwrap().count(), 0);
}

#[test]
fn refuses_names_that_no_output_can_have() {
    let long = format!("{}.png", "x".repeat(252));
    let bad = [
        ".bashrc",
        ".a.png",
        "x.sh",
        "usercustomize.py",
        "a",
        "png",
        ".png",
        "",
        "a.exr",
        "a.svg",
        "a.PNG",
        "../a.png",
        "/a.png",
        "b/a.png",
        "b\\a.png",
        "a b.png",
        "a\nb.png",
        "\u{1b}[2Ja.png",
        "ä.png",
        "a:b.png",
        "B.exr",
        "a.png\0",
        &long,
    ];
    for name in bad {
        let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        parts_named(dir.path(), &[[0, SIZE[0]]], [name, "b.exr", "c.tiff"]);
        let Err(JoinError::Parts(said)) = joined(dir.path(), out.path()) else { panic!("{name:?} is written") };
        assert!(said.iter().all(|line| line.contains("names ") && !line.contains(char::is_control)), "{said:?}");
        assert_eq!(out.path().read_dir().unwrap().count(), 0, "{name:?}");
    }
    for name in ["a.png", "A-b_c.d.png", "-.png"] {
        let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        parts_named(dir.path(), &[[0, SIZE[0]]], [name, "b.exr", "c.tiff"]);
        assert_eq!(joined(dir.path(), out.path()).unwrap(), whole(out.path()), "{name:?}");
    }
}

#[test]
fn accepts_only_drawings_as_files_without_rows() {
    let part = PartOf { number: 1, count: 1 };
    for (file, content, good) in [
        ("a.svg", &b"<?xml version=\"1.0\"?><svg/>"[..], true),
        ("a.svg", b"\x89PNG\r\n\x1a\n", false),
        ("a.svg", b"", false),
        ("a.png", b"<?xml version=\"1.0\"?><svg/>", false),
        ("a.html", b"<?xml version=\"1.0\"?><svg/>", false),
    ] {
        let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        let header = PartHeader {
            version: "1".into(),
            build: "b".into(),
            graph: "g".into(),
            parameters: String::new(),
            seed: 1,
            size: SIZE,
            part,
            rows: [0, SIZE[1]],
            pictures: vec![PartPicture { file: file.into(), key: "k".into(), spec: None }],
        };
        let mut writer = PartWriter::create(&dir.path().join(part.file_name("g")), &header).unwrap();
        writer.put(0, content).unwrap();
        writer.finish().unwrap();
        assert_eq!(joined(dir.path(), out.path()).is_ok(), good, "{file} {content:?}");
        assert_eq!(out.path().read_dir().unwrap().count(), usize::from(good), "{file} {content:?}");
    }
}

/// The files of a single run.
fn whole(dir: &Path) -> Vec<Vec<u8>> {
    let write = |(name, spec): (&str, PictureSpec)| {
        let mut writer = Writer::create(&dir.join(name), &spec).unwrap();
        let planes: Vec<_> = (0_u32..).take(spec.channels.len()).map(|channel| plane(channel, 0, SIZE[1])).collect();
        writer.write_rows(&planes.iter().map(Vec::as_slice).collect::<Vec<_>>(), SIZE[1]).unwrap();
        writer.finish().unwrap();
        std::fs::read(dir.join(name)).unwrap()
    };
    names().into_iter().zip(specs()).map(write).collect()
}

fn joined(dir: &Path, out: &Path) -> Result<Vec<Vec<u8>>, JoinError> {
    let made = join(dir, out, 1 << 20, &|_, _| true)?;
    Ok(made.files.iter().map(|file| std::fs::read(&file.path).unwrap()).collect())
}

#[test]
fn parts_become_the_files_of_a_single_run() {
    let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    parts(dir.path());
    assert_eq!(joined(dir.path(), out.path()).unwrap(), whole(out.path()));
    let stopped = tempfile::tempdir().unwrap();
    let result = join(dir.path(), stopped.path(), 1 << 20, &|done, total| done * 2 < total);
    assert!(matches!(result, Err(JoinError::Cancelled)));
    assert_eq!(stopped.path().read_dir().unwrap().count(), 0);
}

/// A change of a file: position, length, new value, and kind of change.
type Change = (Index, Index, u8, u8);

fn changed(sample: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = sample.to_vec();
    for (place, length, value, how) in changes {
        // Most of the file is rows; header, index and end are the sensitive parts.
        let (from, to) = match how % 4 {
            0 => (0, bytes.len().min(1500)),
            1 => (bytes.len().saturating_sub(1500), bytes.len()),
            _ => (0, bytes.len()),
        };
        let place = from + place.index((to - from).max(1));
        let stop = (place + 1 + length.index(24)).min(bytes.len());
        match how / 4 % 4 {
            0 if place < bytes.len() => bytes[place] ^= value,
            1 => bytes[place.min(stop)..stop].fill(*value),
            2 => drop(bytes.drain(place.min(stop)..stop)),
            _ => bytes.truncate(place),
        }
    }
    bytes
}

proptest! {
    #[test]
    fn detects_any_change_of_a_part(changes in prop::collection::vec(any::<Change>(), 1..5), second: bool, blocks: bool) {
        let [dir, out] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        if blocks {
            parts_of(dir.path(), &[[0, 25], [25, 15]]);
        } else {
            parts(dir.path());
        }
        let right = joined(dir.path(), out.path()).unwrap();
        let place = dir.path().join(PartOf { number: 1 + u32::from(second), count: 2 }.file_name("g"));
        let good = std::fs::read(&place).unwrap();
        let bad = changed(&good, &changes);
        std::fs::write(&place, &bad).unwrap();
        let other = tempfile::tempdir().unwrap();
        match joined(dir.path(), other.path()) {
            Ok(made) => prop_assert!(bad == good && made == right),
            Err(JoinError::Parts(said)) => {
                prop_assert!(said.iter().any(|line| line.contains(if second { "2/2" } else { "1/2" })), "{said:?}");
                prop_assert_eq!(other.path().read_dir().unwrap().count(), 0);
            }
            Err(error) => panic!("{error}"),
        }
    }
}
