//! Checking without decoding: finds every fault of a file except damage in compressed samples, and names it.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, its helpers too")]
use crate::pictures;

use crate::pictures::{
    Jpeg, LIMITS, chunks_of, exif, exr_of_parts, frame, indexed_png, indexed_png_of, jpeg, plain_exr, png_of, samples,
    tiff, tiled_exr, with_segment, written,
};
use shibo_picture::{
    Compression, Depth, Format, Picture, ReadError, ReadLimits, check, check_bytes, header_bytes, read_bytes,
};

/// The error of a bad file, which must be the same for a check and for reading.
#[track_caller]
fn refused(bytes: &[u8]) -> String {
    let error = check_bytes(bytes, &LIMITS).expect_err("the file is bad").to_string();
    assert_eq!(read_bytes(bytes, &LIMITS).expect_err("the file is bad").to_string(), error);
    error
}

#[track_caller]
fn refused_for(bytes: &[u8], reason: &str) {
    let error = refused(bytes);
    assert!(error.contains(reason), "`{error}` should say `{reason}`");
}

#[track_caller]
fn good(bytes: &[u8]) -> Picture {
    let header = check_bytes(bytes, &LIMITS).unwrap();
    let picture = read_bytes(bytes, &LIMITS).unwrap();
    assert_eq!((header.width, header.height), (picture.width, picture.height));
    picture
}

#[test]
fn good_files_pass() {
    let folder = tempfile::tempdir().unwrap();
    for (number, bytes) in samples().iter().enumerate() {
        let checked = check_bytes(bytes, &LIMITS).unwrap_or_else(|error| panic!("sample {number}: {error}"));
        assert_eq!(checked, header_bytes(bytes).unwrap());
        let path = folder.path().join("a");
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(check(&path, None, &LIMITS).unwrap(), checked);
    }
}

#[test]
fn detects_every_truncation_without_decoding() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    for (number, bytes) in samples().iter().enumerate() {
        let whole = read_bytes(bytes, &LIMITS).unwrap();
        let step = (bytes.len() / 50).max(1);
        for length in (1..bytes.len()).step_by(step).chain(bytes.len().saturating_sub(8)..bytes.len()) {
            let cut = &bytes[..length];
            match check_bytes(cut, &LIMITS) {
                Err(error) => {
                    std::fs::write(&path, cut).unwrap();
                    assert_eq!(check(&path, None, &LIMITS).unwrap_err().reason.to_string(), error.to_string());
                }
                // Only text at the end of the file may be missing.
                Ok(_) => assert_eq!(read_bytes(cut, &LIMITS).unwrap(), whole, "sample {number}: {length} bytes"),
            }
        }
    }
}

#[test]
fn checks_apply_limits() {
    let png = written(Format::Png, Depth::U8, 3, Compression::Fast);
    for limits in [ReadLimits { max_pixels: 1000, ..LIMITS }, ReadLimits { max_bytes_decoded: 1000, ..LIMITS }] {
        for bytes in [&png, &jpeg(), &tiled_exr(), &tiff(tiff::encoder::Compression::Lzw, 8)] {
            assert!(check_bytes(bytes, &limits).unwrap_err().is_too_large());
        }
    }
}

#[test]
fn names_unsupported_formats() {
    let mut tga = [&[0, 0, 2][..], &[0; 9], &[4, 0, 4, 0, 24, 0], &[7; 48]].concat();
    refused_for(&tga, "it looks like TGA");
    tga[2] = 99;
    tga.extend([&[0; 8], &b"TRUEVISION-XFILE.\0"[..]].concat());
    assert!(check_bytes(&tga, &LIMITS).unwrap_err().to_string().starts_with("it is TGA"));
    for (start, name) in [
        (&b"GIF89a...."[..], "it is GIF"),
        (b"BM..........", "it is BMP"),
        (b"RIFF....WEBPVP8 ", "it is WebP"),
        (b"RIFF....WAVEfmt ", "it is a RIFF file"),
        (b"\0\0\0\x20ftypavif\0\0", "it is AVIF"),
        (b"\0\0\0\x20ftypheic\0\0", "it is HEIC"),
        (b"\0\0\0\x20ftypisom\0\0", "it is a film"),
        (b"8BPS\0\x01", "it is a Photoshop document"),
        (b"P6\n3 4\n255\n", "it is PNM"),
        (b"<?xml version=\"1.0\"?>\n<svg>", "it is SVG"),
        (b"\xef\xbb\xbf<!DOCTYPE html><html>", "it is a web page"),
        (b"hello, this is \xe3\x82\xb7\xe3\x83\x9c\n", "it is text"),
        (b"\x89", "its format is not known"),
        (b"\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", "its format is not known"),
    ] {
        let message = refused(start);
        assert!(message.starts_with(name), "{message}");
        assert!(
            message
                .ends_with("it must be PNG, JPEG, TIFF, OpenEXR or Radiance HDR: convert it to PNG, TIFF, JPEG or EXR")
        );
    }
    assert!(matches!(check_bytes(b"", &LIMITS), Err(ReadError::Empty)));
}

#[test]
fn refuses_incomplete_or_misplaced_png_chunks() {
    let bytes = written(Format::Png, Depth::U8, 3, Compression::Fast);
    let chunks = chunks_of(&bytes);
    type Chunks = Vec<([u8; 4], Vec<u8>)>;
    let changed = |change: &dyn Fn(&mut Chunks)| {
        let mut chunks = chunks.clone();
        change(&mut chunks);
        png_of(&chunks.iter().map(|(name, content)| (name, content.clone())).collect::<Vec<_>>())
    };
    assert_eq!(good(&changed(&|_| {})), good(&bytes));
    let data = |chunks: &[([u8; 4], Vec<u8>)]| chunks.iter().position(|(name, _)| name == b"IDAT").unwrap();
    refused_for(&changed(&|chunks| drop(chunks.pop())), "its last chunk, `IEND`, is missing");
    refused_for(&changed(&|chunks| drop(chunks.remove(0))), "`IHDR`");
    refused_for(&changed(&|chunks| chunks.retain(|(name, _)| name != b"IDAT")), "there is no chunk `IDAT`");
    refused_for(&changed(&|chunks| chunks[0].1.push(0)), "has 14 bytes");
    refused_for(&changed(&|chunks| chunks.insert(2, (*b"CgBI", vec![0; 4]))), "its chunk `CgBI`, which is not known");
    let apart = |chunks: &mut Vec<_>| {
        let at = data(chunks);
        let tail = chunks[at].1.split_off(9);
        chunks.insert(at + 1, (*b"tIME", vec![0; 7]));
        chunks.insert(at + 2, (*b"IDAT", tail));
    };
    refused_for(&changed(&apart), "do not follow one another");
    // Chunks of other programs, and samples in several chunks, are valid.
    let split = |chunks: &mut Vec<_>| {
        let at = data(chunks);
        let tail = chunks[at].1.split_off(9);
        chunks.insert(at + 1, (*b"IDAT", tail));
        chunks.insert(1, (*b"prVt", vec![1, 2, 3]));
    };
    assert_eq!(good(&changed(&split)), good(&bytes));
    let mut crlf = bytes.clone();
    crlf.remove(4);
    refused_for(&crlf, "changed line ends");
    let mut long = bytes.clone();
    long[33..37].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
    refused_for(&long, "it ends within the chunk");
    long[33] = 0xff;
    refused_for(&long, "there is no chunk at byte 33");
    let mut header = bytes;
    header[20] ^= 1;
    refused_for(&header, "CRC");
}

#[test]
fn refuses_palettes_that_do_not_fit() {
    let colors = [10, 20, 30, 40, 50, 60, 70, 80, 90];
    let samples = [0, 1, 2, 2, 1, 0];
    let of = |palette: &[u8], opacities: Option<&[u8]>| indexed_png(&samples, (3, 2), 2, palette, opacities);
    assert_eq!(good(&of(&colors, None)).plane(0)[2], 70.0 / 255.0);
    assert_eq!(good(&of(&colors, Some(&[0, 51]))).plane(3)[..3], [0.0, 0.2, 1.0]);
    refused_for(&of(&colors[..4], None), "its palette, `PLTE`, has 4 bytes; it must have 3 for each of 1 to 4 colours");
    refused_for(&of(&[], None), "has 0 bytes");
    refused_for(&of(&[1; 15], None), "has 15 bytes");
    refused_for(&of(&colors, Some(&[1; 4])), "opacities, `tRNS`, for 4 colours, but only 3 colours");
    let chunks = chunks_of(&of(&colors, Some(&[1; 3])));
    let order = |places: &[usize]| {
        png_of(&places.iter().map(|place| (&chunks[*place].0, chunks[*place].1.clone())).collect::<Vec<_>>())
    };
    good(&order(&[0, 1, 2, 3, 4]));
    refused_for(&order(&[0, 3, 4]), "it has no palette");
    refused_for(&order(&[0, 3, 1, 4]), "it has no palette");
    refused_for(&order(&[0, 2, 1, 3, 4]), "do not lie between its palette and its samples");
    refused_for(&order(&[0, 1, 1, 3, 4]), "one palette");
}

#[test]
fn refuses_indices_beyond_the_palette() {
    for bits in [1, 2, 4, 8] {
        let most = u8::MAX >> (8 - bits);
        let palette: Vec<u8> = (0..3 * u16::from(most)).map(|value| value.to_le_bytes()[0]).collect();
        // 13 pixels a row: the unused bits of the last byte are not a sample.
        let mut samples: Vec<u8> = (0..26).map(|k| k % most).collect();
        good(&indexed_png(&samples, (13, 2), bits, &palette, None));
        samples[13 + 12] = most;
        let bad = indexed_png(&samples, (13, 2), bits, &palette, None);
        let last = most - 1;
        let reason = format!("column 12 of row 1 has colour {most} of the palette, which ends with colour {last}");
        refused_for(&bad, &reason);
        // With a complete palette every index is valid.
        let whole: Vec<u8> = (0..3 * (u16::from(most) + 1)).map(|value| value.to_le_bytes()[0]).collect();
        good(&indexed_png(&samples, (13, 2), bits, &whole, None));
    }
    // The three passes of 2 × 2 interlaced pixels: the first pixel, the one beside it, the row below.
    let passes = |last: u8| [0, 0, 0, 1 << 6, 0, (1 << 6) | (last << 4)];
    let colors = [1, 2, 3, 4, 5, 6, 7, 8, 9];
    assert_eq!(good(&indexed_png_of(&passes(2), (2, 2), 2, true, &colors, None)).plane(0)[3], 7.0 / 255.0);
    let bad = indexed_png_of(&passes(3), (2, 2), 2, true, &colors, None);
    refused_for(&bad, "column 1 of row 1 has colour 3");
}

#[test]
fn leaves_damaged_samples_to_reading() {
    let mut png = written(Format::Png, Depth::U8, 3, Compression::Fast);
    let data = png.windows(4).position(|name| name == b"IDAT").unwrap() + 4;
    png[data + 40..data + 60].fill(0xff);
    pictures::mend_checksums(&mut png);
    let mut tiff = tiff(tiff::encoder::Compression::Lzw, 41);
    tiff[9..40].fill(0xff);
    let mut exr = written(Format::Exr, Depth::F32, 1, Compression::Fast);
    let end = exr.len() - 30;
    exr[end..].fill(0x55);
    for bytes in [png, tiff, exr] {
        check_bytes(&bytes, &LIMITS).unwrap();
        let error = read_bytes(&bytes, &LIMITS).unwrap_err();
        assert!(matches!(error, ReadError::Damaged(_)), "{error}");
        assert!(error.to_string().starts_with("the compressed data is damaged: "), "{error}");
    }
}

#[test]
fn refuses_incomplete_jpegs() {
    let plain = Jpeg::default();
    for jpeg in [&plain, &Jpeg::progressive()] {
        assert!(good(&jpeg.bytes()).plane(0).iter().all(|sample| (sample * 255.0 - 128.0).abs() < 1.5));
    }
    let with = |change: &dyn Fn(&mut Jpeg)| {
        let mut jpeg = plain.clone();
        change(&mut jpeg);
        jpeg.bytes()
    };
    refused_for(&with(&|jpeg| jpeg.end.clear()), "its end marker is missing");
    refused_for(&with(&|jpeg| drop(jpeg.segments.remove(0))), "channel 1 has no table to unpack it with");
    refused_for(&with(&|jpeg| drop(jpeg.segments.remove(1))), "its samples come before its frame header");
    refused_for(&with(&|jpeg| drop(jpeg.segments.remove(2))), "channel 1 has no table to unpack it with");
    refused_for(&with(&|jpeg| jpeg.scans.clear()), "it ends before all of its channels were stored");
    refused_for(&with(&|jpeg| jpeg.segments[1].1[0] = 12), "it has 12 bits a channel");
    refused_for(&with(&|jpeg| jpeg.segments[1].1[4] = 0), "it has no pixels");
    refused_for(&with(&|jpeg| jpeg.segments[1].1[7] = 0x31), "save it as a usual JPEG");
    refused_for(&with(&|jpeg| jpeg.segments[1].0 = 0xc9), "arithmetic coding");
    refused_for(&with(&|jpeg| jpeg.segments[1].0 = 0xc3), "without loss");
    refused_for(&with(&|jpeg| jpeg.segments[0].1.truncate(60)), "a quantization table is too short");
    refused_for(&with(&|jpeg| jpeg.segments[2].1[1] = 2), "a Huffman table");
    refused_for(&with(&|jpeg| jpeg.scans[0].0[1] = 9), "one that does not exist");
    refused_for(&with(&|jpeg| jpeg.scans[0].0[4] = 64), "a range of coefficients that cannot be");
    refused_for(&with(&|jpeg| jpeg.end.splice(0..0, [0xff, 0xd8]).for_each(drop)), "another picture begins");
    refused_for(&with(&|jpeg| jpeg.end.splice(0..0, [0xff, 0xdc, 0, 4, 0, 8]).for_each(drop)), "its height follows");
    let frame_of = |channels: u8| with(&|jpeg| jpeg.segments[1].1 = frame(8, channels));
    refused_for(&frame_of(2), "it has 2 channels");
    refused_for(&frame_of(3), "it ends before all of its channels were stored");
    let print = frame_of(4);
    refused_for(&print, "its colours are those of print, CMYK or YCCK");
    refused_for(&print, "convert it to RGB");
    for transform in [0, 2] {
        let adobe = [&b"Adobe\0\x64\0\0\0\0"[..], &[transform]].concat();
        refused_for(&with_segment(&print, 0xee, &adobe), "convert it to RGB");
        good(&with_segment(&jpeg(), 0xee, &adobe));
    }
    let mut progressive = Jpeg::progressive();
    progressive.scans[1].0[3] = 0;
    refused_for(&progressive.bytes(), "a range of coefficients that cannot be");
    progressive.scans.remove(0);
    refused_for(&progressive.bytes(), "a range of coefficients that cannot be");
}

#[test]
fn turns_camera_pictures_upright() {
    let stored = jpeg();
    let lying = good(&stored);
    let (w, h) = (lying.width as usize, lying.height as usize);
    for (orientation, big_endian) in (0..=9).flat_map(|number| [(number, false), (number, true)]) {
        let bytes = with_segment(&stored, 0xe1, &exif(orientation, big_endian));
        let upright = good(&bytes);
        let header = header_bytes(&bytes).unwrap();
        assert_eq!((header.width, header.height), (upright.width, upright.height));
        let swapped = (5..=8).contains(&orientation);
        assert_eq!((upright.width, upright.height), if swapped { (41, 37) } else { (37, 41) });
        for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
            // Position at which EXIF shows the stored rows and columns.
            let (seen_x, seen_y) = match orientation {
                2 => (w - 1 - x, y),
                3 => (w - 1 - x, h - 1 - y),
                4 => (x, h - 1 - y),
                5 => (y, x),
                6 => (h - 1 - y, x),
                7 => (h - 1 - y, w - 1 - x),
                8 => (y, w - 1 - x),
                _ => (x, y),
            };
            for channel in 0..3 {
                let there = upright.plane(channel)[seen_y * upright.width as usize + seen_x];
                assert_eq!(there, lying.plane(channel)[y * w + x], "orientation {orientation} at {x}, {y}");
            }
        }
    }
    let gray = good(&with_segment(&Jpeg::default().bytes(), 0xe1, &exif(6, false)));
    assert_eq!((gray.width, gray.height, gray.channels), (8, 8, 1));
}

/// Changes the value of a tag in the first directory of a little-endian TIFF.
fn set_tag(bytes: &mut [u8], tag: u16, value: u32) {
    let start = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let count = usize::from(u16::from_le_bytes(bytes[start..start + 2].try_into().unwrap()));
    let mut entries = bytes[start + 2..].chunks_mut(12).take(count);
    let entry = entries.find(|entry| entry[..2] == tag.to_le_bytes()).unwrap();
    // The type decides how many bytes of the value count.
    let kind = u16::from_le_bytes(entry[2..4].try_into().unwrap());
    let width = if kind == 3 { 2 } else { 4 };
    entry[8..8 + width].copy_from_slice(&value.to_le_bytes()[..width]);
}

#[test]
fn refuses_tiff_strips_beyond_the_file() {
    let packed = tiff(tiff::encoder::Compression::Lzw, 41);
    let plain = tiff(tiff::encoder::Compression::Uncompressed, 41);
    let with = |bytes: &[u8], tag: u16, value: u32| {
        let mut bytes = bytes.to_vec();
        set_tag(&mut bytes, tag, value);
        bytes
    };
    let beyond = u32::try_from(packed.len()).unwrap();
    refused_for(&with(&packed, 273, beyond), "it ends within the picture");
    refused_for(&with(&packed, 279, beyond), "it ends within the picture");
    refused_for(&with(&packed, 279, 0), "part 0 of its samples is empty");
    // For uncompressed strips the stated length is ignored.
    good(&with(&plain, 279, 1));
    refused_for(&with(&plain, 273, u32::try_from(plain.len()).unwrap() - 100), "it ends within the picture");
    refused_for(&with(&packed, 259, 34_926), "it is packed by the method");
    refused_for(&with(&packed, 262, 5), "its colours are CMYK; save it as grey or RGB");
    refused_for(&with(&packed, 262, 3), "its palette has 1 numbers of 16 bits");
}

/// The offset of the table of `count` blocks in an EXR file: its first entry points directly behind the table.
fn table_of(bytes: &[u8], count: usize) -> usize {
    let leads = |at: &usize| u64::from_le_bytes(bytes[*at..*at + 8].try_into().unwrap()) == (at + 8 * count) as u64;
    (0..bytes.len() - 8).find(leads).unwrap()
}

#[test]
fn an_exr_that_ends_within_its_header_is_truncated() {
    let plain = plain_exr();
    for length in 5..table_of(&plain, 41) {
        for error in [check_bytes(&plain[..length], &LIMITS).err(), header_bytes(&plain[..length]).err()] {
            let error = error.unwrap();
            assert!(matches!(error, ReadError::Truncated(_)), "{length}: {error}");
        }
    }
}

#[test]
fn refuses_missing_exr_blocks() {
    let plain = plain_exr();
    let (table, first) = (table_of(&plain, 41), table_of(&plain, 41) + 41 * 8);
    let with = |at: usize, value: &[u8]| {
        let mut bytes = plain.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        bytes
    };
    good(&with(table, &(first as u64).to_le_bytes()));
    refused_for(&with(table + 8, &(first as u64).to_le_bytes()), "a block occurs twice");
    refused_for(&with(table + 8, &[0; 8]), "it was not written to its end");
    refused_for(&with(table + 8, &(plain.len() as u64 - 5).to_le_bytes()), "it ends within the picture");
    // A block consists of its row, its length and its samples.
    refused_for(&with(first, &41_i32.to_le_bytes()), "the file is corrupt");
    refused_for(&with(first, &(-1_i32).to_le_bytes()), "the file is corrupt");
    refused_for(&with(first + 4, &147_i32.to_le_bytes()), "a block has 147 bytes; it must have 148");
    refused_for(&with(first + 4, &i32::MAX.to_le_bytes()), "it ends within the picture");
    refused_for(&with(first + 4, &(-1_i32).to_le_bytes()), "a negative place or length");
    // The last of several parts is checked although the first is read.
    let parts = exr_of_parts();
    good(&parts);
    refused_for(&parts[..parts.len() - 3], "it ends within the picture");
}
