//! Writing and reading back, for every format, depth and compression, and the other guarantees of the writer.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, its helpers too")]

use shibo_picture::{
    Compression, Depth, Encoding, Format, MipFilter, Picture, PictureSpec, ReadLimits, SampleKind, Transfer,
    WriteError, WriteStats, Writer, header, linear_sample, read, read_layer, remove_stale_temporaries,
    texture_attributes,
};
use std::path::Path;

fn spec(format: Format, depth: Depth, channels: usize) -> PictureSpec {
    let names = if format == Format::Exr { ["B", "A", "R", "G"] } else { ["R", "G", "B", "A"] };
    PictureSpec {
        width: 83,
        height: 71,
        channels: names[..channels].iter().map(ToString::to_string).collect(),
        format,
        depth,
        encoding: Encoding::default(),
        compression: Compression::Fast,
        mips: Vec::new(),
        chromaticities: None,
        pixel_mm: None,
        metadata: vec![("Software".into(), "Shibo test".into()), ("graph".into(), "Straße 7".into())],
    }
}

/// Smooth values in 0..1 with some noise.
fn planes(spec: &PictureSpec) -> Vec<Vec<f32>> {
    let (width, pixels) = (spec.width as usize, spec.width as usize * spec.height as usize);
    let value = |channel: usize, pixel: usize| {
        let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
        let grain = ((pixel * 7919 + channel * 104_729) % 1009) as f32 / 1009.0;
        0.5 + 0.4 * (x * 0.07 + channel as f32).sin() * (y * 0.05).cos() + 0.05 * (grain - 0.5)
    };
    (0..spec.channels.len()).map(|channel| (0..pixels).map(|pixel| value(channel, pixel)).collect()).collect()
}

fn write(path: &Path, spec: &PictureSpec, planes: &[Vec<f32>], band: u32) -> Result<WriteStats, WriteError> {
    let mut writer = Writer::create(path, spec)?;
    let width = spec.width as usize;
    while writer.next_row() < spec.height {
        let (first, rows) = (writer.next_row() as usize, band.min(spec.height - writer.next_row()));
        let part: Vec<&[f32]> = planes.iter().map(|p| &p[first * width..][..rows as usize * width]).collect();
        writer.write_rows(&part, rows)?;
    }
    writer.finish()
}

fn assert_close(picture: &Picture, expected: &[Vec<f32>], tolerance: f32) {
    assert_eq!(usize::from(picture.channels), expected.len());
    for (channel, expected) in expected.iter().enumerate() {
        for (a, b) in picture.plane(u8::try_from(channel).unwrap()).iter().zip(expected) {
            assert!((a - b).abs() <= tolerance, "channel {channel}: {a} is not {b}");
        }
    }
}

#[test]
fn every_combination_survives_the_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    for format in [Format::Png, Format::Tiff, Format::Exr] {
        for depth in format.depths() {
            for channels in 1..=4 {
                for compression in [Compression::Fast, Compression::Best] {
                    let spec = PictureSpec { compression, ..spec(format, *depth, channels) };
                    let mut planes = planes(&spec);
                    let path = folder.path().join("a").with_extension(format.extension());
                    let written = write(&path, &spec, &planes, 19).unwrap();
                    assert_eq!((written.clipped, written.non_finite), (0, 0));
                    assert_eq!(written.bytes, path.metadata().unwrap().len());
                    let picture = read(&path, &ReadLimits::default()).unwrap();
                    assert_eq!((picture.width, picture.height), (83, 71));
                    let (kind, tolerance) = match depth {
                        Depth::U8 => (SampleKind::U8, 0.5001 / 255.0),
                        Depth::U16 => (SampleKind::U16, 0.501 / 65535.0),
                        Depth::F16 => (SampleKind::F16, 1.0 / 4096.0),
                        Depth::F32 => (SampleKind::F32, 0.0),
                    };
                    assert_eq!(picture.source, kind);
                    if format == Format::Exr {
                        // The file order is B A R G. Colours are read in the order R G B, other channels in file order.
                        let order: &[usize] = [&[0][..], &[1, 0], &[1, 0, 2], &[2, 3, 0, 1]][channels - 1];
                        planes = order.iter().map(|index| planes[*index].clone()).collect();
                        let names: Vec<_> = order.iter().map(|index| spec.channels[*index].clone()).collect();
                        assert_eq!(picture.names, names);
                    }
                    assert_close(&picture, &planes, tolerance);
                }
            }
        }
    }
}

#[test]
fn bands_and_threads_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    for format in [Format::Png, Format::Tiff, Format::Exr] {
        for compression in [Compression::Fast, Compression::Best] {
            // Wide enough for several strips.
            let mut spec = PictureSpec { width: 4096, compression, ..spec(format, format.depths()[0], 3) };
            spec.encoding.dither = true;
            let planes = planes(&spec);
            let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool(1).install(|| write(&a, &spec, &planes, 71)).unwrap();
            pool(8).install(|| write(&b, &spec, &planes, 7)).unwrap();
            assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap(), "{format} {compression:?}");
        }
    }
}

#[test]
fn colours_are_encoded_and_opacity_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    for (depth, step) in [(Depth::U8, 255.0), (Depth::U16, 65535.0)] {
        let mut spec = spec(Format::Png, depth, 4);
        spec.encoding.transfer = Transfer::Srgb;
        let planes = planes(&spec);
        write(&path, &spec, &planes, 71).unwrap();
        let picture = read(&path, &ReadLimits::default()).unwrap();
        assert!(picture.has_alpha);
        for (stored, value) in picture.plane(0).iter().zip(&planes[0]) {
            let (low, high) = (linear_sample(stored - 0.51 / step), linear_sample(stored + 0.51 / step));
            assert!(low <= *value && *value <= high, "{value} became {stored}");
        }
        for (stored, value) in picture.plane(3).iter().zip(&planes[3]) {
            assert!((stored - value).abs() <= 0.501 / step);
        }
    }
}

#[test]
fn ranges_map_and_clipping_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tiff");
    let mut spec = PictureSpec { width: 6, height: 1, ..spec(Format::Tiff, Depth::U16, 1) };
    spec.encoding.range = Some((-1.0, 3.0));
    let heights = vec![-1.0, 1.0, 3.0, 4.0, f32::NAN, f32::NEG_INFINITY];
    let written = write(&path, &spec, &[heights], 1).unwrap();
    assert_eq!((written.clipped, written.non_finite), (3, 2));
    assert_eq!(written.range, (f32::NEG_INFINITY, 4.0));
    let picture = read(&path, &ReadLimits::default()).unwrap();
    let expected = [0.0, 32768.0 / 65535.0, 1.0, 1.0, 0.0, 0.0];
    assert_eq!(picture.planes, expected);

    let spec = PictureSpec { width: 4, height: 1, ..self::spec(Format::Exr, Depth::F16, 1) };
    let written = write(&path, &spec, &[vec![1e6, -7e4, 2.0, f32::INFINITY]], 1).unwrap();
    assert_eq!((written.clipped, written.non_finite), (2, 1));
    let picture = read(&path, &ReadLimits::default()).unwrap();
    assert_eq!(picture.planes, [65504.0, -65504.0, 2.0, f32::INFINITY]);
    assert_eq!(picture.count_non_finite(), 1);
    let first = picture.first_non_finite().unwrap();
    assert_eq!((first.x, first.y, first.channel), (3, 0, 0));
}

#[test]
fn dither_keeps_the_mean_between_two_steps() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let mut spec = PictureSpec { width: 64, height: 64, ..spec(Format::Png, Depth::U8, 1) };
    for (value, dither) in [(100.3, true), (100.3, false), (100.0, true), (0.0, true), (255.0, true)] {
        spec.encoding.dither = dither;
        write(&path, &spec, &[vec![value / 255.0; 4096]], 64).unwrap();
        let picture = read(&path, &ReadLimits::default()).unwrap();
        let mean = picture.planes.iter().map(|sample| f64::from(*sample) * 255.0).sum::<f64>() / 4096.0;
        let expected = if dither { f64::from(value) } else { f64::from(value).round() };
        assert!((mean - expected).abs() < 0.01, "{value} dithered {dither}: mean {mean}");
        assert!(picture.planes.iter().all(|sample| (sample * 255.0 - value).abs() < 1.001));
    }
}

#[test]
fn materials_are_written_as_one_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calf.exr");
    let names = "base_color.R base_color.G base_color.B normal.X normal.Y normal.Z height.Y roughness.Y metallic.Y ao.Y \
                 opacity.Y emission.R emission.G emission.B";
    let mut spec = spec(Format::Exr, Depth::F32, 1);
    spec.channels = names.split_whitespace().map(str::to_owned).collect();
    let planes = planes(&spec);
    write(&path, &spec, &planes, 16).unwrap();
    let limits = ReadLimits::default();
    assert_close(&read(&path, &limits).unwrap(), &planes[0..3], 0.0);
    assert_close(&read_layer(&path, "height.Y", &limits).unwrap(), &planes[6..7], 0.0);
    assert_close(&read_layer(&path, "height", &limits).unwrap(), &planes[6..7], 0.0);
    assert_close(&read_layer(&path, "normal", &limits).unwrap(), &planes[3..6], 0.0);
    let message = read_layer(&path, "bump", &limits).unwrap_err().to_string();
    assert!(message.contains("no layer or channel `bump`") && message.contains("`height.Y`"), "{message}");
    assert_eq!(shibo_picture::header(&path).unwrap().names.len(), 14);
    for (layer, channels) in [("normal", 3), ("height", 1), ("emission.G", 1)] {
        let header = shibo_picture::header_layer(&path, layer).unwrap();
        assert_eq!((header.channels, header.width), (channels, spec.width), "{layer}");
    }
    assert_eq!(shibo_picture::header_layer(&path, "bump").unwrap_err().to_string(), message);
}

#[test]
fn writes_metadata() {
    let folder = tempfile::tempdir().unwrap();
    for format in [Format::Png, Format::Tiff, Format::Exr] {
        let path = folder.path().join("a").with_extension(format.extension());
        let spec = spec(format, format.depths()[0], 3);
        write(&path, &spec, &planes(&spec), 71).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for text in ["Software", "Shibo test", "graph", "Straße 7"] {
            let text =
                if format == Format::Exr { text.to_owned().replace("Software", "software") } else { text.to_owned() };
            assert!(bytes.windows(text.len()).any(|part| part == text.as_bytes()), "{format}: {text}");
        }
    }
    // The `exr` crate can read the file without our code.
    let picture = exr::prelude::read_first_flat_layer_from_file(folder.path().join("a.exr")).unwrap();
    assert_eq!(picture.layer_data.attributes.software_name.unwrap().to_string(), "Shibo test");
}

#[test]
fn contradictions_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let refuse = |spec: PictureSpec| Writer::create(&path, &spec).unwrap_err().to_string();
    for (format, depth) in [
        (Format::Png, Depth::F16),
        (Format::Png, Depth::F32),
        (Format::Tiff, Depth::F16),
        (Format::Exr, Depth::U8),
        (Format::Exr, Depth::U16),
    ] {
        let message = refuse(spec(format, depth, 1));
        assert!(message.starts_with(&format!("depth is `{depth}`; for format `{format}` it must be")), "{message}");
    }
    let five = PictureSpec { channels: vec!["x".into(); 5], ..spec(Format::Png, Depth::U8, 1) };
    assert!(refuse(five.clone()).contains("`5` channels"));
    assert!(refuse(PictureSpec { format: Format::Exr, depth: Depth::F16, ..five }).contains("unique name"));
    assert!(refuse(PictureSpec { width: 0, ..spec(Format::Png, Depth::U8, 1) }).contains("`0x71`"));
    let mut empty = spec(Format::Png, Depth::U8, 1);
    empty.encoding.range = Some((1.0, 1.0));
    assert!(refuse(empty).contains("range is `(1, 1)`"));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0, "nothing is left");
}

#[test]
fn files_appear_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    for format in [Format::Png, Format::Tiff, Format::Exr] {
        let path = folder.path().join("a").with_extension(format.extension());
        std::fs::write(&path, "before").unwrap();
        let spec = spec(format, format.depths()[0], 1);
        let planes = planes(&spec);
        let row = &planes[0][..83];
        let mut writer = Writer::create(&path, &spec).unwrap();
        writer.write_rows(&[row], 1).unwrap();
        assert!(matches!(writer.write_rows(&[row, row], 1), Err(WriteError::Rows { .. })));
        assert!(matches!(writer.write_rows(&[row], 2), Err(WriteError::Rows { .. })));
        assert!(matches!(writer.finish(), Err(WriteError::Rows { end: 1, height: 71, .. })));
        let mut writer = Writer::create(&path, &spec).unwrap();
        writer.write_rows(&[row], 1).unwrap();
        drop(writer);
        assert_eq!(std::fs::read(&path).unwrap(), b"before");
        write(&path, &spec, &planes, 71).unwrap();
        assert!(read(&path, &ReadLimits::default()).is_ok());
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), 3, "no temporary file is left");
    assert_eq!(remove_stale_temporaries(folder.path()).unwrap(), 0);
    let message = Writer::create(&folder.path().join("none/a.png"), &spec(Format::Png, Depth::U8, 1)).unwrap_err();
    assert!(message.to_string().contains("none/a.png` cannot be written"), "{message}");
}

#[test]
fn the_colour_space_has_a_default() {
    use shibo_picture::{ColorSpace, Conversion};
    let folder = tempfile::tempdir().unwrap();
    let cases = [
        (Format::Png, Depth::U8, 3, ColorSpace::Srgb),
        (Format::Png, Depth::U8, 2, ColorSpace::Raw),
        (Format::Png, Depth::U16, 3, ColorSpace::Srgb),
        (Format::Exr, Depth::F16, 4, ColorSpace::Linear),
        (Format::Exr, Depth::F32, 1, ColorSpace::Raw),
    ];
    for (format, depth, channels, expected) in cases {
        let path = folder.path().join("a");
        let spec = spec(format, depth, channels);
        write(&path, &spec, &planes(&spec), 71).unwrap();
        assert_eq!(Conversion::of_file(&header(&path).unwrap()), (expected.into(), Vec::new()));
    }
}

#[test]
fn tiles_have_all_their_levels() {
    use exr::prelude::*;
    for (depth, tolerance) in [(Depth::F32, 1e-6_f32), (Depth::F16, 1e-3)] {
        for (width, height) in [(83, 71), (64, 64), (200, 1), (129, 65)] {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("a.exr");
            let mips = vec![MipFilter::Mean; 3];
            let mut metadata = vec![("Software".to_owned(), "Shibo test".to_owned())];
            metadata.extend(texture_attributes([true, false]));
            let spec = PictureSpec { width, height, mips, metadata, ..spec(Format::Exr, depth, 3) };
            let planes = planes(&spec);
            let mut writer = Writer::create(&path, &spec).unwrap();
            // The bands end at other rows than the tiles.
            for first in (0..height).step_by(10) {
                let rows = 10.min(height - first);
                let band =
                    |plane: &Vec<f32>| plane[(first * width) as usize..((first + rows) * width) as usize].to_vec();
                let band: Vec<Vec<f32>> = planes.iter().map(band).collect();
                writer.write_rows(&band.iter().map(Vec::as_slice).collect::<Vec<_>>(), rows).unwrap();
            }
            writer.finish().unwrap();
            let image =
                read().no_deep_data().all_resolution_levels().all_channels().first_valid_layer().all_attributes();
            let image = image.from_file(&path).unwrap();
            assert_eq!(image.layer_data.attributes.wrap_mode_name, Some(Text::from("periodic,clamp")));
            // The channels lie in the order of their names.
            for (channel, name) in ["A", "B", "R"].iter().enumerate() {
                let given = spec.channels.iter().position(|c| c == name).unwrap();
                let found = &image.layer_data.channel_data.list[channel];
                assert_eq!(found.name, Text::from(*name));
                let levels = found.sample_data.levels_as_slice();
                assert_eq!(levels.len(), width.max(height).ilog2() as usize + 1);
                let whole = &planes[given];
                let mean = whole.iter().sum::<f32>() / whole.len() as f32;
                for (level, samples) in levels.iter().enumerate() {
                    let samples: Vec<f32> = samples.values_as_f32().collect();
                    let size = [(width >> level).max(1), (height >> level).max(1)];
                    assert_eq!(samples.len(), (size[0] * size[1]) as usize);
                    let own = samples.iter().sum::<f32>() / samples.len() as f32;
                    assert!(
                        (own - mean).abs() < tolerance.max(2e-5),
                        "{width}x{height} level {level}: {own} for {mean}"
                    );
                    if level == 0 {
                        let near = |(a, b): (&f32, &f32)| (a - b).abs() <= tolerance;
                        assert!(samples.iter().zip(whole).all(near));
                    }
                }
            }
        }
    }
    let wrong = PictureSpec { mips: vec![MipFilter::Mean], ..spec(Format::Png, Depth::U8, 1) };
    let said = wrong.check().unwrap_err().to_string();
    assert!(said.contains("Exr") && said.contains("Tiff"), "{said}");
    let wrong = PictureSpec { mips: vec![MipFilter::Mean], ..spec(Format::Exr, Depth::F32, 3) };
    assert!(wrong.check().is_err());
}

/// A picture file whose pixels have this size in mm.
fn of_size(format: Format, pixel_mm: Option<[f32; 2]>) -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a");
    let depth = format.depths()[0];
    let spec = PictureSpec { width: 8, height: 8, pixel_mm, ..spec(format, depth, 1) };
    write(&path, &spec, &planes(&spec), 8).unwrap();
    std::fs::read(&path).unwrap()
}

#[test]
fn writes_the_size_of_pixels() {
    use exr::meta::MetaData;
    use std::io::Cursor;
    use tiff::decoder::ifd::Value;
    use tiff::tags::Tag;
    // 10 pixels per mm across, 4 down.
    let size = Some([0.1, 0.25]);
    let png = |size| {
        let reader = png::Decoder::new(Cursor::new(of_size(Format::Png, size))).read_info().unwrap();
        reader.info().pixel_dims.map(|dims| (dims.xppu, dims.yppu, dims.unit))
    };
    assert_eq!(png(size), Some((10_000, 4000, png::Unit::Meter)));
    assert_eq!((png(None), png(Some([3000.0, 3000.0]))), (None, None));
    let tags = |size| {
        let mut decoder = tiff::decoder::Decoder::new(Cursor::new(of_size(Format::Tiff, size))).unwrap();
        [Tag::XResolution, Tag::YResolution, Tag::ResolutionUnit].map(|tag| decoder.find_tag(tag).unwrap())
    };
    assert_eq!(tags(size), [Some(Value::Rational(100, 1)), Some(Value::Rational(40, 1)), Some(Value::Short(3))]);
    assert_eq!(
        tags(Some([0.3, 700.0]))[..2],
        [Some(Value::Rational(333_333, 10_000)), Some(Value::Rational(143, 10_000))]
    );
    assert_eq!(tags(None), [None, None, None]);
    let exr = |size| {
        let meta = MetaData::read_from_buffered(Cursor::new(of_size(Format::Exr, size)), false).unwrap();
        let header = &meta.headers[0];
        (header.own_attributes.horizontal_density, header.shared_attributes.pixel_aspect)
    };
    assert_eq!((exr(size), exr(Some([0.1, 0.1])), exr(None)), ((Some(254.0), 0.4), (Some(254.0), 1.0), (None, 1.0)));
    // The JFIF header: unit, and pixels per unit across and down.
    let jpeg = |size| of_size(Format::Jpeg(90), size)[13..18].to_vec();
    assert_eq!((jpeg(size), jpeg(None)), (vec![1, 0, 254, 0, 102], vec![0, 0, 1, 0, 1]));
}
