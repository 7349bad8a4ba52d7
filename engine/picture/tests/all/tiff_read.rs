//! TIFF files of other programs: all sample types in strips and tiles, and several directories.
use crate::pictures::LIMITS;
use half::f16;
use shibo_picture::{Picture, ReadError, SampleKind, check_bytes, header_bytes, read_bytes};
use std::io::Write;

const WIDTH: usize = 37;
const HEIGHT: usize = 23;

/// A directory with its strips or tiles.
#[derive(Clone, Default)]
struct Directory {
    /// Integer tags: SHORT if the values fit, else LONG.
    tags: Vec<(u16, Vec<u32>)>,
    /// Tags of bytes.
    bytes: Vec<(u16, Vec<u8>)>,
    parts: Vec<Vec<u8>>,
    tiled: bool,
    below: Vec<Directory>,
}

impl Directory {
    fn gray(width: usize, height: usize, bits: u32, part: Vec<u8>) -> Self {
        let size = [width, height].map(|side| vec![u32::try_from(side).unwrap()]);
        let [across, down] = size;
        let tags = vec![(256, across), (257, down), (258, vec![bits]), (259, vec![1]), (262, vec![1]), (277, vec![1])];
        Self { tags, parts: vec![part], ..Self::default() }
    }

    fn with(mut self, tag: u16, values: &[u32]) -> Self {
        self.tags.retain(|(known, _)| *known != tag);
        self.tags.push((tag, values.to_vec()));
        self
    }

    /// Appends the directory to a file; returns its offset, and the offset of the field that points to the next one.
    fn write(&self, file: &mut Vec<u8>, big_endian: bool) -> (usize, usize) {
        let word = |n: u32| {
            if big_endian { u16::try_from(n).unwrap().to_be_bytes() } else { u16::try_from(n).unwrap().to_le_bytes() }
        };
        let long = |n: u32| if big_endian { n.to_be_bytes() } else { n.to_le_bytes() };
        let mut places = Vec::new();
        for part in &self.parts {
            places.push(u32::try_from(file.len()).unwrap());
            file.extend(part);
        }
        let lengths: Vec<u32> = self.parts.iter().map(|part| u32::try_from(part.len()).unwrap()).collect();
        let below: Vec<u32> =
            self.below.iter().map(|inner| u32::try_from(inner.write(file, big_endian).0).unwrap()).collect();
        let (at, counts) = if self.tiled { (324, 325) } else { (273, 279) };
        let mut entries: Vec<(u16, u16, usize, Vec<u8>)> = Vec::new();
        for (tag, values) in self.tags.iter().chain(&[(at, places), (counts, lengths), (330, below)]) {
            let short = values.iter().all(|value| *value < 65536) && !matches!(*tag, 330);
            let value = values.iter().flat_map(|v| if short { word(*v).to_vec() } else { long(*v).to_vec() }).collect();
            if !values.is_empty() {
                entries.push((*tag, if short { 3 } else { 4 }, values.len(), value));
            }
        }
        entries.extend(self.bytes.iter().map(|(tag, value)| (*tag, 7, value.len(), value.clone())));
        entries.sort_by_key(|entry| entry.0);
        if !file.len().is_multiple_of(2) {
            file.push(0);
        }
        let place = file.len();
        let mut behind = place + 2 + 12 * entries.len() + 4;
        let (mut table, mut values) = (word(u32::try_from(entries.len()).unwrap()).to_vec(), Vec::new());
        for (tag, kind, count, value) in entries {
            table.extend([word(tag.into()), word(kind.into())].concat());
            table.extend(long(u32::try_from(count).unwrap()));
            if value.len() <= 4 {
                table.extend(&value);
                table.resize(table.len() + 4 - value.len(), 0);
            } else {
                table.extend(long(u32::try_from(behind).unwrap()));
                behind += value.len();
                values.extend(value);
            }
        }
        table.extend([0; 4]);
        file.extend(&table);
        file.extend(values);
        (place, place + table.len() - 4)
    }
}

fn file(directories: &[Directory], big_endian: bool) -> Vec<u8> {
    let mut file = if big_endian { b"MM\0\x2a\0\0\0\0".to_vec() } else { b"II\x2a\0\0\0\0\0".to_vec() };
    let mut link = 4;
    for directory in directories {
        let (place, next) = directory.write(&mut file, big_endian);
        let place = u32::try_from(place).unwrap();
        let place = if big_endian { place.to_be_bytes() } else { place.to_le_bytes() };
        file[link..link + 4].copy_from_slice(&place);
        link = next;
    }
    file
}

#[track_caller]
fn good(bytes: &[u8]) -> Picture {
    let picture = read_bytes(bytes, &LIMITS).unwrap();
    let header = check_bytes(bytes, &LIMITS).unwrap();
    assert_eq!((header.width, header.height, header.channels), (picture.width, picture.height, picture.channels));
    picture
}

#[track_caller]
fn refused(bytes: &[u8], reason: &str) -> ReadError {
    let error = read_bytes(bytes, &LIMITS).unwrap_err();
    assert!(error.to_string().contains(reason), "{error}");
    error
}

/// Code of a sample, from which its bytes and its value are derived.
fn code(x: usize, y: usize, channel: usize) -> u32 {
    u32::try_from(x * x * 3 + y * 91 + channel * 57 + 1).unwrap().wrapping_mul(2_654_435_761) >> 3
}

/// A sample type: its format, and the bytes and the value of a code.
struct Sort {
    kind: SampleKind,
    format: u32,
    bytes: fn(u32) -> Vec<u8>,
    value: fn(u32) -> f32,
}

const SORTS: &[Sort] = &[
    Sort { kind: SampleKind::U8, format: 1, bytes: |c| vec![c as u8], value: |c| f32::from(c as u8) / 255.0 },
    Sort {
        kind: SampleKind::U16,
        format: 1,
        bytes: |c| (c as u16).to_be_bytes().to_vec(),
        value: |c| f32::from(c as u16) / 65535.0,
    },
    Sort {
        kind: SampleKind::U32,
        format: 1,
        bytes: |c| c.to_be_bytes().to_vec(),
        value: |c| (f64::from(c) / f64::from(u32::MAX)) as f32,
    },
    Sort { kind: SampleKind::I8, format: 2, bytes: |c| vec![c as u8], value: |c| f32::from(c as u8 as i8) / 127.0 },
    Sort {
        kind: SampleKind::I16,
        format: 2,
        bytes: |c| (c as u16).to_be_bytes().to_vec(),
        value: |c| f32::from(c as u16 as i16) / 32767.0,
    },
    Sort {
        kind: SampleKind::I32,
        format: 2,
        bytes: |c| (c << 3).to_be_bytes().to_vec(),
        value: |c| (f64::from((c << 3) as i32) / f64::from(i32::MAX)) as f32,
    },
    Sort {
        kind: SampleKind::F16,
        format: 3,
        bytes: |c| f16::from_f32((c % 999) as f32).to_bits().to_be_bytes().to_vec(),
        value: |c| (c % 999) as f32,
    },
    Sort { kind: SampleKind::F32, format: 3, bytes: |c| (c as f32).to_be_bytes().to_vec(), value: |c| c as f32 },
];

/// Compresses the rows of a strip or tile.
fn pack(rows: &[u8], method: u32) -> Vec<u8> {
    match method {
        5 => weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(rows).unwrap(),
        8 => {
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(rows).unwrap();
            encoder.finish().unwrap()
        }
        32773 => rows.chunks(100).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect(),
        _ => rows.to_vec(),
    }
}

/// Stores the differences between the samples of a row; the highest byte of each sample comes first.
fn predict(row: &mut [u8], bytes: usize, together: usize, predictor: u32) {
    let size = row.len();
    if predictor == 3 {
        let samples = size / bytes;
        let old = row.to_vec();
        (0..size).for_each(|k| row[k] = old[k % samples * bytes + k / samples]);
        (together..size).rev().for_each(|k| row[k] = row[k].wrapping_sub(row[k - together]));
    } else if predictor == 2 {
        let number = |bytes: &[u8]| bytes.iter().fold(0_u32, |n, byte| n << 8 | u32::from(*byte));
        for k in (together..size / bytes).rev() {
            let difference =
                number(&row[k * bytes..][..bytes]).wrapping_sub(number(&row[(k - together) * bytes..][..bytes]));
            row[k * bytes..][..bytes].copy_from_slice(&difference.to_be_bytes()[4 - bytes..]);
        }
    }
}

/// Storage of samples.
#[derive(Clone, Copy, Debug)]
struct How {
    channels: usize,
    method: u32,
    predictor: u32,
    /// Width and height of tiles.
    tile: Option<(usize, usize)>,
    apart: bool,
    big_endian: bool,
}

fn stored(sort: &Sort, how: How) -> Vec<u8> {
    let (wide, rows) = how.tile.unwrap_or((WIDTH, 5));
    let together = if how.apart { 1 } else { how.channels };
    let bytes = sort.kind.bytes();
    let mut parts = Vec::new();
    for plane in 0..if how.apart { how.channels } else { 1 } {
        for top in (0..HEIGHT).step_by(rows) {
            for left in (0..WIDTH).step_by(wide) {
                let mut part = Vec::new();
                let high = if how.tile.is_some() { rows } else { rows.min(HEIGHT - top) };
                for y in top..top + high {
                    let sample = |k: usize| (sort.bytes)(code(left + k / together, y, plane + k % together));
                    let mut row: Vec<u8> = (0..wide * together).flat_map(sample).collect();
                    predict(&mut row, bytes, together, how.predictor);
                    if !how.big_endian && how.predictor != 3 {
                        row.chunks_mut(bytes).for_each(<[u8]>::reverse);
                    }
                    part.extend(row);
                }
                parts.push(pack(&part, how.method));
            }
        }
    }
    let bits = u32::try_from(bytes * 8).unwrap();
    let mut directory =
        Directory { parts, tiled: how.tile.is_some(), ..Directory::gray(WIDTH, HEIGHT, bits, Vec::new()) };
    directory = directory.with(258, &vec![bits; how.channels]).with(339, &vec![sort.format; how.channels]);
    let count = u32::try_from(how.channels).unwrap();
    directory = directory.with(277, &[count]).with(262, &[if how.channels < 3 { 1 } else { 2 }]);
    directory = directory.with(259, &[how.method]).with(317, &[how.predictor]);
    directory = directory.with(284, &[if how.apart { 2 } else { 1 }]);
    let [across, down] = [wide, rows].map(|side| u32::try_from(side).unwrap());
    directory = if how.tile.is_some() {
        directory.with(322, &[across]).with(323, &[down])
    } else {
        directory.with(278, &[down])
    };
    file(&[directory], how.big_endian)
}

#[track_caller]
fn reads(sort: &Sort, how: How) {
    let picture = good(&stored(sort, how));
    let place = format!("{:?}, {how:?}", sort.kind);
    assert_eq!((picture.source, usize::from(picture.channels)), (sort.kind, how.channels), "{place}");
    for channel in 0..how.channels {
        let plane = picture.plane(channel as u8);
        for (k, sample) in plane.iter().enumerate() {
            let (x, y) = (k % WIDTH, k / WIDTH);
            assert_eq!(*sample, (sort.value)(code(x, y, channel)), "{place}: {x}, {y}, channel {channel}");
        }
    }
}

#[test]
fn reads_all_depths_and_methods_in_strips_and_tiles() {
    for sort in SORTS {
        let float = if sort.kind.is_float() { 3 } else { 2 };
        for (method, predictor) in [(1, 1), (5, 1), (5, 2), (8, 1), (8, 2), (8, float), (5, float), (32773, 1)] {
            for tile in [None, Some((16, 16)), Some((48, 32))] {
                for (channels, apart) in [(1, false), (3, false), (3, true), (4, true)] {
                    // One byte order per case; both orders occur.
                    let big_endian = (channels + method as usize).is_multiple_of(2) != apart;
                    reads(sort, How { channels, method, predictor, tile, apart, big_endian });
                }
            }
        }
    }
}

fn shipped(name: &str) -> Vec<u8> {
    std::fs::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tiff").join(name)).unwrap()
}

#[test]
fn reads_lzw_tiles_of_tifffile() {
    let picture = good(&shipped("lzw_tiles.tif"));
    assert_eq!((picture.width, picture.height), (18, 18));
    for (k, sample) in picture.planes.iter().enumerate() {
        let (x, y) = (k % 18, k / 18);
        assert_eq!(*sample, ((x * 7 + y * 13) % 11 * 20) as f32 / 255.0, "{x}, {y}");
    }
}

#[test]
fn reads_jpeg_strips_and_tiles_in_their_colors() {
    for (name, most) in [("jpeg_ycbcr.tif", 10.0), ("jpeg_rgb_tiles.tif", 5.0)] {
        let picture = good(&shipped(name));
        assert_eq!(
            (picture.width, picture.height, picture.channels, picture.source),
            (24, 20, 3, SampleKind::U8),
            "{name}"
        );
        for k in 0..480 {
            let (x, y) = ((k % 24) as f32, (k / 24) as f32);
            for (channel, expected) in (0..).zip([x * 10.0, y * 12.0, 255.0 - x * 10.0]) {
                let sample = picture.plane(channel)[k] * 255.0;
                assert!(
                    (sample - expected).abs() <= most,
                    "{name}: {x}, {y}, channel {channel}: {sample}, not {expected}"
                );
            }
        }
        // A marker in the data is rejected by the check.
        let mut broken = shipped(name);
        let scan = broken.windows(3).rposition(|bytes| bytes == [0xff, 0xda, 0]).unwrap();
        broken[scan..scan + 2].copy_from_slice(&[0xff, 0xd8]);
        assert!(check_bytes(&broken, &LIMITS).is_err(), "{name}");
    }
}

#[test]
fn reads_samples_of_few_bits() {
    // Each row begins at a whole byte.
    let one = Directory::gray(10, 2, 1, vec![0b1010_1010, 0b1100_0000, 0b0000_0001, 0b0100_0000]);
    let expected: Vec<f32> = b"10101010110000000101".iter().map(|digit| f32::from(digit - b'0')).collect();
    assert_eq!(good(&file(std::slice::from_ref(&one), false)).planes, expected);
    let inverted: Vec<f32> = expected.iter().map(|value| 1.0 - value).collect();
    assert_eq!(good(&file(&[one.clone().with(262, &[0])], false)).planes, inverted);
    // The first pixel is the lowest bit.
    let turned =
        Directory { parts: vec![one.parts[0].iter().map(|byte| byte.reverse_bits()).collect()], ..one.clone() };
    assert_eq!(good(&file(&[turned.with(266, &[2])], true)).planes, expected);
    let two = Directory::gray(5, 1, 2, vec![0b0001_1011, 0b1100_0000]);
    assert_eq!(good(&file(&[two], false)).planes, [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 1.0]);
    let four = Directory::gray(3, 1, 4, vec![0x0f, 0x70]);
    let picture = good(&file(&[four], false));
    assert_eq!((picture.planes, picture.source), (vec![0.0, 1.0, 7.0 / 15.0], SampleKind::U8));
    refused(&file(&[Directory::gray(3, 1, 12, vec![0; 5])], false), "its samples are Uint of 12 bits");
    refused(&file(&[one.with(317, &[2]).with(259, &[8])], false), "stored as differences");
}

#[test]
fn reads_palettes_as_three_channels() {
    let words: Vec<u32> = (0..48).map(|k| k * 257 * 5).collect();
    let indexed = Directory::gray(3, 2, 4, vec![0x01, 0x20, 0xf3, 0x40]).with(262, &[3]);
    let picture = good(&file(&[indexed.clone().with(320, &words)], false));
    assert_eq!((picture.channels, picture.has_alpha, picture.source), (3, false, SampleKind::U8));
    let expected = |channel: usize| [0, 1, 2, 15, 3, 4].map(|k| ((channel * 16 + k) * 5) as f32 / 255.0);
    (0..3).for_each(|channel| assert_eq!(picture.plane(channel as u8), expected(channel)));
    // Palette of bytes instead of words.
    let bytes: Vec<u32> = (0..48).map(|k| k * 5).collect();
    assert_eq!(good(&file(&[indexed.clone().with(320, &bytes)], true)).planes, picture.planes);
    refused(&file(&[indexed.clone().with(320, &words[..45])], false), "its palette has 45 numbers; it must have 48");
    refused(&file(&[indexed], false), "it has no palette");
}

/// A picture of six pixels with six different values.
fn six() -> Directory {
    Directory::gray(3, 2, 8, vec![1, 2, 3, 4, 5, 6])
}

#[test]
fn turns_pictures_upright() {
    let expected = [
        (3, [1, 2, 3, 4, 5, 6]),
        (3, [3, 2, 1, 6, 5, 4]),
        (3, [6, 5, 4, 3, 2, 1]),
        (3, [4, 5, 6, 1, 2, 3]),
        (2, [1, 4, 2, 5, 3, 6]),
        (2, [4, 1, 5, 2, 6, 3]),
        (2, [6, 3, 5, 2, 4, 1]),
        (2, [3, 6, 2, 5, 1, 4]),
    ];
    for (orientation, (width, values)) in (1..).zip(expected) {
        let bytes = file(&[six().with(274, &[orientation])], false);
        let picture = good(&bytes);
        let values = values.map(|value: u8| f32::from(value) / 255.0);
        assert_eq!((picture.width, &picture.planes[..]), (width, &values[..]), "orientation {orientation}");
        assert_eq!(header_bytes(&bytes).unwrap().width, width);
    }
    // Separate channels.
    let colors = Directory::gray(2, 1, 8, vec![1, 2, 3, 4, 5, 6]).with(258, &[8; 3]).with(277, &[3]).with(262, &[2]);
    let picture = good(&file(&[colors.with(274, &[6])], false));
    let values: Vec<u8> = picture.planes.iter().map(|value| (value * 255.0).round() as u8).collect();
    assert_eq!((picture.width, picture.height, values), (1, 2, vec![1, 4, 2, 5, 3, 6]));
}

#[test]
fn finds_the_picture_among_several() {
    let small = Directory::gray(1, 1, 8, vec![9]).with(254, &[1]);
    let wide = |file: Vec<u8>| good(&file).width;
    assert_eq!(wide(file(&[small.clone(), six()], false)), 3, "the second one");
    assert_eq!(wide(file(&[six(), small.clone()], true)), 3, "the first one");
    assert_eq!(wide(file(&[six(), Directory::gray(4, 1, 8, vec![0; 4])], true)), 3, "the first of two pages");
    let parent = Directory { below: vec![small.clone(), six()], ..small.clone() };
    assert_eq!(wide(file(&[parent], false)), 3, "below a smaller one");
    let old = Directory::gray(1, 1, 8, vec![9]).with(255, &[2]);
    assert_eq!(wide(file(&[old, six()], false)), 3, "the old tag");
    let mask = Directory::gray(2, 1, 1, vec![0]).with(254, &[4]).with(262, &[4]);
    assert_eq!(wide(file(&[mask, six()], false)), 3, "no mask");
    assert_eq!(wide(file(&[small.clone(), small.clone()], false)), 1, "all are smaller ones");
    // A cyclic chain of directories is refused.
    let mut circle = file(&[small.clone(), small], false);
    let first: [u8; 4] = circle[4..8].try_into().unwrap();
    let start = u32::from_le_bytes(first) as usize;
    let next = start + 2 + 12 * usize::from(circle[start]);
    circle[next..next + 4].copy_from_slice(&first);
    refused(&circle, "cycle");
}

#[test]
fn reads_profiles_and_associated_opacity() {
    let pixels = Directory::gray(1, 1, 8, vec![1, 2, 3, 4]).with(258, &[8; 4]).with(277, &[4]).with(262, &[2]);
    let header = |directory: &Directory| header_bytes(&file(std::slice::from_ref(directory), false)).unwrap();
    assert_eq!((header(&pixels).has_alpha, header(&pixels).associated, header(&pixels).icc), (true, false, None));
    let associated = Directory { bytes: vec![(34675, b"a profile".to_vec())], ..pixels.clone().with(338, &[1]) };
    let found = header(&associated);
    assert_eq!((found.has_alpha, found.associated, found.icc.as_deref()), (true, true, Some(&b"a profile"[..])));
    assert!(!header(&pixels.clone().with(338, &[2])).associated);
    let other = header(&pixels.with(338, &[0]));
    assert_eq!((other.channels, other.has_alpha, other.associated), (3, false, false));
}

#[test]
fn refuses_unsupported_features_by_name() {
    let colors = Directory::gray(1, 1, 8, vec![1, 2, 3, 4]).with(258, &[8; 4]).with(277, &[4]).with(262, &[5]);
    refused(&file(&[colors], false), "its colours are CMYK; save it as grey or RGB");
    let luma = Directory::gray(2, 2, 8, vec![0; 12]).with(258, &[8; 3]).with(277, &[3]).with(262, &[6]);
    refused(&file(&[luma], false), "its colours are YCbCr and not packed as JPEG");
    refused(&file(&[six().with(259, &[50000])], false), "it is packed by the method");
    refused(&file(&[six().with(258, &[64]).with(339, &[3])], false), "its samples are IEEEFP of 64 bits");
    let ancient = Directory { parts: vec![vec![0, 1, 0, 0]], ..six().with(259, &[5]) };
    refused(&file(&[ancient], false), "in use before 1992");
    let cut = Directory { parts: vec![vec![0x80, 0x00]], ..six().with(259, &[5]) };
    assert!(matches!(refused(&file(&[cut], false), "it ends within the picture"), ReadError::Damaged(_)));
    let huge = Directory { tiled: true, ..six() }.with(322, &[65520]).with(323, &[65520]);
    refused(&file(&[huge], false), "");
    let few = Directory { tiled: true, ..six() }.with(322, &[16]).with(323, &[1]);
    let small = Directory::gray(1, 1, 8, vec![9]).with(254, &[1]);
    refused(&file(&[small, few], false), "it has 1 strips or tiles; it needs 2");
}
