//! Mip levels in TIFF, end to end: the same as in EXR. `tests/readers/run` checks that OpenImageIO reads them.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use std::fs::File;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

/// Sides that are no multiple of a tile or of two.
const GRAPH: &str = r##"(
  canvas: (size_mm: (60, 35), resolution: (150, 87), tile: X, seed: 3),
  nodes: {
    "lumps": Perlin(size: 8),
    "color": GradientMap(input: "lumps", stops: [(0, "#202020"), (1, "#e08040")]),
    "height": Remap(input: "lumps", to: (0, 3)),
    "normal": HeightToNormal(input: "height"),
    "rough": Remap(input: "lumps", to: (0.2, 0.5)),
    "skin": Material(base_color: "color", roughness: "rough", normal: "normal"),
  },
  outputs: {
    "exr": File(from: "skin", format: Exr, depth: F32, mip: true),
    "f": File(from: "skin", format: Tiff, depth: F32, mip: true),
    "u": File(from: "skin", format: Tiff, mip: true),
  },
)"##;

/// A level: its width and height, and its samples, pixel after pixel.
type Level = (u32, u32, Vec<f32>);

/// The directories (levels) of a TIFF.
fn directories(desk: &Desk, file: &str) -> Vec<Level> {
    let mut decoder = Decoder::new(File::open(desk.path(file)).unwrap()).unwrap();
    let mut levels = Vec::new();
    loop {
        let (width, height) = decoder.dimensions().unwrap();
        let text = |tag, decoder: &mut Decoder<File>| decoder.get_tag_ascii_string(Tag::Unknown(tag)).unwrap();
        assert_eq!(text(33302, &mut decoder), "Plain Texture");
        assert_eq!(text(33303, &mut decoder), "periodic,clamp");
        assert_eq!(decoder.get_tag_u32(Tag::TileWidth).unwrap(), 64);
        let reduced = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType).unwrap();
        assert_eq!(reduced, (!levels.is_empty()).then_some(1));
        let samples = match decoder.read_image().unwrap() {
            DecodingResult::F32(samples) => samples,
            DecodingResult::U16(samples) => samples.into_iter().map(|v| f32::from(v) / 65535.0).collect(),
            other => panic!("{other:?}"),
        };
        levels.push((width, height, samples));
        if !decoder.more_images() {
            return levels;
        }
        decoder.next_image().unwrap();
    }
}

/// The samples of a channel in an EXR, level by level.
fn exr_levels(desk: &Desk, file: &str, channel: &str) -> Vec<Vec<f32>> {
    use exr::prelude::*;
    let reader = read().no_deep_data().all_resolution_levels().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_file(desk.path(file)).unwrap();
    let found = image.layer_data.channel_data.list.into_iter().find(|c| c.name.to_string() == channel).unwrap();
    found.sample_data.levels_as_slice().iter().map(|level| level.values_as_f32().collect()).collect()
}

#[test]
fn a_tiff_has_the_levels_of_an_exr() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    desk.shibo("render a.ron -o out --no-cache").expect(0);
    for (name, channels) in [("roughness", &["Y"][..]), ("normal", &["R", "G", "B"]), ("base_color", &["R", "G", "B"])]
    {
        let floats = directories(&desk, &format!("out/f_{name}.tiff"));
        let sizes: Vec<(u32, u32)> = floats.iter().map(|(width, height, _)| (*width, *height)).collect();
        assert_eq!(sizes, [(150, 87), (75, 43), (37, 21), (18, 10), (9, 5), (4, 2), (2, 1), (1, 1)]);
        let integers = directories(&desk, &format!("out/u_{name}.tiff"));
        for (c, channel) in channels.iter().enumerate() {
            let expected = exr_levels(&desk, &format!("out/exr_{name}.exr"), channel);
            for (level, expected) in expected.iter().enumerate() {
                let samples = |levels: &[Level]| -> Vec<f32> {
                    levels[level].2.iter().skip(c).step_by(channels.len()).copied().collect()
                };
                assert_eq!(samples(&floats), *expected, "{name}.{channel}, level {level}");
                // Linear light is averaged, then encoded with the sRGB curve.
                let curve = |v: f32| if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
                for (got, light) in samples(&integers).into_iter().zip(expected) {
                    let want = if name == "base_color" { curve(*light) } else { *light };
                    assert!((got - want).abs() < 1e-5, "{name}.{channel}, level {level}: {got} for {want}");
                }
            }
        }
    }
    // The bytes are equal for any number of threads.
    let bytes = |folder: &str| std::fs::read(desk.path(format!("{folder}/u_normal.tiff"))).unwrap();
    desk.shibo("render a.ron -o one --no-cache --threads 1 --output u").expect(0);
    assert_eq!(bytes("out"), bytes("one"));
    // The reader gets the largest level.
    desk.write(
        "b.ron",
        r#"(canvas: (size_mm: 60, resolution: (150, 87)), nodes: { "i": Image(path: "out/f_roughness.tiff") },
        outputs: { "i": File(from: "i.gray", format: Exr, depth: F32) })"#,
    );
    desk.shibo("render b.ron -o out").expect(0);
    desk.write("c.ron", GRAPH.replace("mip: true", "mip: false"));
    desk.shibo("render c.ron -o flat --output exr.roughness").expect(0);
    assert_eq!(exr_levels(&desk, "out/i.exr", "Y"), exr_levels(&desk, "flat/exr_roughness.exr", "Y"));
}
