//! Pictures of other programs, end to end: channels by name, colour spaces, orientation, windows, opacity, and file
//! sets.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::pictures::{chunks_of, exif, png_of};
use crate::support::Desk;
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes,
    SmallVec, Vec2, WritableImage,
};
use shibo_picture::{Picture, SrgbEncoder, read};
use std::io::Cursor;

/// An EXR of 4 × 2 pixels with constant channels; `change` edits it before it is written.
fn exr(channels: &[(&str, f32)], change: impl FnOnce(&mut ImageAttributes, &mut [Vec<f32>])) -> Vec<u8> {
    let mut attributes = ImageAttributes::new(IntegerBounds::new((0, 0), (4, 2)));
    let mut planes: Vec<Vec<f32>> = channels.iter().map(|(_, value)| vec![*value; 8]).collect();
    change(&mut attributes, &mut planes);
    let named = channels.iter().zip(planes).map(|((name, _), plane)| AnyChannel::new(*name, FlatSamples::F32(plane)));
    let channels = AnyChannels::sort(named.collect::<SmallVec<[_; 4]>>());
    let layer = Layer::new((4, 2), LayerAttributes::default(), Encoding::FAST_LOSSLESS, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image { attributes, layer_data: layer }.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn unchanged(_: &mut ImageAttributes, _: &mut [Vec<f32>]) {}

/// A PNG of one colour, 4 × 4 pixels, with extra chunks after its first one.
fn png(color: [u8; 3], chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    image::RgbImage::from_pixel(4, 4, image::Rgb(color))
        .write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png)
        .unwrap();
    with_chunks(&bytes, 1, chunks)
}

fn with_chunks(png: &[u8], at: usize, chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let all = chunks_of(png);
    let mut all: Vec<(&[u8; 4], Vec<u8>)> = all.iter().map(|(name, content)| (name, content.clone())).collect();
    all.splice(at..at, chunks.iter().cloned());
    png_of(&all)
}

/// A picture at its own resolution, and the messages of `check` and `render` about it.
fn shown(desk: &Desk, size: [u32; 2], node: &str) -> (Picture, String) {
    let [w, h] = size;
    let graph = format!(
        r#"(canvas: (size_mm: ({w}, {h}), resolution: ({w}, {h}), tile: None),
            nodes: {{ "it": Image(filter: Nearest, {node}) }},
            outputs: {{
              "rgb": File(from: "it.rgb", format: Exr, depth: F32), "alpha": File(from: "it.alpha", format: Exr, depth: F32),
              "gray": File(from: "it.gray", format: Exr, depth: F32), "image": File(from: "it", format: Exr, depth: F32),
            }})"#
    );
    desk.write("a.ron", graph);
    let checked = desk.shibo("check a.ron").expect(0).stderr;
    let rendered = desk.shibo("render a.ron -o out").expect(0).stderr;
    (read(&desk.path("out/rgb.exr"), &Default::default()).unwrap(), checked + &rendered)
}

/// The first pixel of a file, and the messages about it in one line.
fn pixel(bytes: &[u8], size: [u32; 2], more: &str) -> ([f32; 3], String) {
    let desk = Desk::new();
    desk.write("picture", bytes);
    let (picture, said) = shown(&desk, size, &format!("path: \"picture\"{more}"));
    ([0, 1, 2].map(|channel| picture.plane(channel)[0]), said.split_whitespace().collect::<Vec<_>>().join(" "))
}

#[track_caller]
fn near(found: [f32; 3], expected: [f32; 3]) {
    assert!(
        found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 2e-4),
        "{found:?}, not {expected:?}"
    );
}

fn codes(color: [f32; 3]) -> [u8; 3] {
    color.map(|light| SrgbEncoder::new().code(light))
}

const COLOR: [f32; 3] = [0.5, 0.25, 0.1];

#[test]
fn reads_channels_by_name() {
    for names in
        [["R", "G", "B"], ["r", "g", "b"], ["red", "green", "blue"], ["Red", "GREEN", "blue"], ["d.r", "d.G", "d.B"]]
    {
        let channels: Vec<(&str, f32)> = names.into_iter().zip(COLOR).collect();
        let (color, said) = pixel(&exr(&channels, unchanged), [4, 2], "");
        near(color, COLOR);
        assert_eq!(said.matches("warning").count(), 0, "{said}");
    }
    for names in [["R", "G"], ["red", "green"], ["x", "y"], ["u", "v"]] {
        let channels: Vec<(&str, f32)> = names.into_iter().zip(COLOR).collect();
        near(pixel(&exr(&channels, unchanged), [4, 2], "").0, [0.5, 0.25, 0.0]);
    }
    let both = exr(&[("R", 0.5), ("G", 0.25), ("B", 0.1), ("r", 7.0), ("g", 8.0), ("b", 9.0)], unchanged);
    near(pixel(&both, [4, 2], "").0, COLOR);
}

#[test]
fn warns_of_channels_in_unknown_order() {
    let bytes = exr(&[("c2", 0.1), ("c0", 0.5), ("c1", 0.25)], unchanged);
    let (color, said) = pixel(&bytes, [4, 2], "");
    near(color, COLOR);
    assert!(said.contains("do not tell their order; they are taken as `c0`, `c1`, `c2`"), "{said}");
    let (color, said) = pixel(&bytes, [4, 2], r#", layer: "c1""#);
    near(color, [0.25; 3]);
    assert!(!said.contains("warning"), "{said}");
}

#[test]
fn honours_chromaticities() {
    let of = |primaries: [f32; 8]| {
        let [rx, ry, gx, gy, bx, by, wx, wy] = primaries;
        Chromaticities { red: Vec2(rx, ry), green: Vec2(gx, gy), blue: Vec2(bx, by), white: Vec2(wx, wy) }
    };
    let with = |names: [&'static str; 3], primaries: [f32; 8]| {
        let channels: Vec<(&str, f32)> = names.into_iter().zip(COLOR).collect();
        exr(&channels, |attributes, _| attributes.chromaticities = Some(of(primaries)))
    };
    let ap1 = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.321_68, 0.337_67];
    let expected = [0.688_756, 0.219_017, 0.071_053];
    near(pixel(&with(["R", "G", "B"], ap1), [4, 2], "").0, expected);
    near(pixel(&with(["R", "G", "B"], ap1), [4, 2], ", color_space: Linear").0, COLOR);
    // Vectors are not colours.
    near(pixel(&with(["X", "Y", "Z"], ap1), [4, 2], "").0, COLOR);
    let (color, said) = pixel(&with(["R", "G", "B"], [0.0; 8]), [4, 2], "");
    near(color, COLOR);
    assert!(
        said.contains("its chromaticities are those of no colours; its colours are taken as linear Rec. 709"),
        "{said}"
    );
}

#[test]
fn reads_back_written_colours() {
    let desk = Desk::new();
    desk.write(
        "b.ron",
        r#"(canvas: (size_mm: 4, resolution: 4),
            nodes: { "it": "= (0.5, 0.25, 0.1)" },
            outputs: {
              "png16": File(from: "it", format: Png, depth: U16), "png8": File(from: "it", format: Png, depth: U8),
              "tif16": File(from: "it", format: Tiff, depth: U16), "tif8": File(from: "it", format: Tiff, depth: U8),
              "aces": File(from: "it", format: Exr, depth: F32, color_space: AcesCg),
            })"#,
    );
    desk.shibo("render b.ron -o made").expect(0);
    for name in desk.names("made").iter().filter(|name| !name.ends_with(".json")) {
        let (picture, said) = shown(&desk, [4, 4], &format!("path: \"made/{name}\""));
        let most = if name.contains('8') { 4e-3 } else { 3e-5 };
        for (channel, expected) in COLOR.into_iter().enumerate() {
            let found = picture.plane(u8::try_from(channel).unwrap())[5];
            assert!((found - expected).abs() < most, "{name}: {found}, not {expected}");
        }
        assert!(!said.contains("warning"), "{said}");
    }
}

#[test]
fn converts_by_profiles_in_all_formats() {
    let files: [(&str, &[u8]); 3] = [
        ("png", include_bytes!("../pictures/adobe_rgb.png")),
        ("jpg", include_bytes!("../pictures/adobe_rgb.jpg")),
        ("tif", include_bytes!("../pictures/adobe_rgb.tif")),
    ];
    for (name, bytes) in files {
        let (color, said) = pixel(bytes, [8, 8], "");
        let (expected, found) = ([227, 100, 42], codes(color));
        assert!(found.iter().zip(expected).all(|(a, b): (&u8, u8)| a.abs_diff(b) <= 1), "{name}: {found:?}");
        assert!(!said.contains("warning"), "{said}");
        let stored = codes(pixel(bytes, [8, 8], ", color_space: Srgb").0);
        assert!(stored.iter().zip([200, 100, 50]).all(|(a, b): (&u8, u8)| a.abs_diff(b) <= 1), "{name}: {stored:?}");
    }
    let broken = png([200, 100, 50], &[(b"iCCP", b"x\0\0damaged".to_vec())]);
    let (color, said) = pixel(&broken, [4, 4], "");
    assert_eq!(codes(color), [200, 100, 50]);
    assert!(said.contains("its ICC profile is damaged; its colours are taken as sRGB"), "{said}");
    let (_, said) = pixel(&broken, [4, 4], ", color_space: Srgb");
    assert!(!said.contains("warning"), "{said}");
}

#[test]
fn converts_by_chunks_of_png() {
    let color = [200, 100, 50];
    let of = |chunks: &[(&[u8; 4], Vec<u8>)]| codes(pixel(&png(color, chunks), [4, 4], "").0);
    let gamma = (b"gAMA", 100_000_u32.to_be_bytes().to_vec());
    assert_eq!(of(std::slice::from_ref(&gamma)), [229, 168, 122]);
    assert_eq!(of(&[(b"gAMA", 45_455_u32.to_be_bytes().to_vec())]), color);
    assert_eq!(of(&[gamma.clone(), (b"sRGB", vec![0])]), color);
    assert_eq!(of(&[gamma, (b"cICP", vec![12, 13, 0, 1])]), [215, 93, 31]);
    let (found, said) = pixel(&png([148; 3], &[(b"cICP", vec![9, 16, 0, 1])]), [4, 4], "");
    assert!((found[0] - 1.0).abs() < 0.01 && !said.contains("warning"), "white paper in PQ: {found:?} {said}");
    let (found, said) = pixel(&png(color, &[(b"cICP", vec![99, 13, 0, 1])]), [4, 4], "");
    assert_eq!(codes(found), color);
    assert!(
        said.contains("its `cICP` names primaries `99`, which are not known; its colours are taken as sRGB"),
        "{said}"
    );
}

#[test]
fn turns_png_upright() {
    // Two rows of three pixels, all different.
    let mut bytes = Vec::new();
    let mut picture = image::RgbImage::new(3, 2);
    picture.pixels_mut().zip(0..).for_each(|(pixel, k)| pixel.0 = [10 * k; 3]);
    picture.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    // Orientation as seen from the upper left, by the numbers of EXIF.
    let seen: [&[u8]; 8] = [
        &[0, 1, 2, 3, 4, 5],
        &[2, 1, 0, 5, 4, 3],
        &[5, 4, 3, 2, 1, 0],
        &[3, 4, 5, 0, 1, 2],
        &[0, 3, 1, 4, 2, 5],
        &[3, 0, 4, 1, 5, 2],
        &[5, 2, 4, 1, 3, 0],
        &[2, 5, 1, 4, 0, 3],
    ];
    for (orientation, seen) in (1..).zip(seen) {
        // The chunk stands after the samples, as some programs write it, or before them.
        let at = if orientation % 2 == 0 { 1 } else { chunks_of(&bytes).len() - 1 };
        let turned = with_chunks(&bytes, at, &[(b"eXIf", exif(orientation, orientation > 4)[6..].to_vec())]);
        let desk = Desk::new();
        desk.write("picture.png", turned);
        let size = if orientation > 4 { [2, 3] } else { [3, 2] };
        let (picture, _) = shown(&desk, size, r#"path: "picture.png", color_space: Raw"#);
        #[expect(clippy::cast_possible_truncation, reason = "0 to 25")]
        let found: Vec<u8> = picture.plane(0).iter().map(|value| (value * 25.5).round() as u8).collect();
        assert_eq!(found, seen, "orientation {orientation}");
    }
}

#[test]
fn shows_the_display_window() {
    let channels = [("R", 1.0), ("G", 2.0), ("B", 3.0), ("A", 1.0)];
    // Offset of the data window in the display window, and size of the display window.
    for ([left, top], [width, height]) in [([0, 0], [4, 2]), ([1, 2], [7, 5]), ([-1, -1], [2, 1]), ([-2, 1], [4, 2])] {
        let bytes = exr(&channels, |attributes, planes| {
            let size = (usize::try_from(width).unwrap(), usize::try_from(height).unwrap());
            attributes.display_window = IntegerBounds::new((-left, -top), size);
            planes[0].iter_mut().zip(1_u8..).for_each(|(value, k)| *value = f32::from(k));
        });
        let desk = Desk::new();
        desk.write("picture.exr", bytes);
        let (picture, said) = shown(&desk, [width as u32, height as u32], r#"path: "picture.exr""#);
        let alpha = read(&desk.path("out/alpha.exr"), &Default::default()).unwrap();
        for ((value, alpha), k) in picture.plane(0).iter().zip(&alpha.planes).zip(0_i32..) {
            let (x, y) = (k % width - left, k / width - top);
            let inside = (0..4).contains(&x) && (0..2).contains(&y);
            let expected = if inside { (1 + x + 4 * y) as f32 } else { 0.0 };
            assert_eq!((*value, *alpha), (expected, f32::from(u8::from(inside))), "{left}, {top}: pixel {k}");
        }
        assert!(!said.contains("warning"), "{said}");
    }
    let far = exr(&channels, |attributes, _| attributes.display_window = IntegerBounds::new((900, 0), (4, 2)));
    let (color, said) = pixel(&far, [4, 2], "");
    assert_eq!(color, [0.0; 3]);
    assert!(said.contains("its data window lies outside of its display window, so the picture is empty"), "{said}");
}

#[test]
fn refuses_giant_display_windows() {
    let giant = exr(&[("Y", 1.0)], |attributes, _| {
        attributes.display_window = IntegerBounds::new((0, 0), (1 << 20, 1 << 20));
    });
    let desk = Desk::new();
    desk.write("picture.exr", giant);
    desk.write("a.ron", r#"(nodes: { "it": Image(path: "picture.exr") }, outputs: { "it": "it" })"#);
    let checked = desk.shibo("check a.ron --format json").expect(1).json();
    assert_eq!(checked["errors"][0]["code"], "too-large", "{checked}");
}

#[test]
fn divides_premultiplied_colours() {
    let of = |alpha: f32| exr(&[("R", 0.25), ("G", 0.125), ("B", 0.05), ("A", alpha)], unchanged);
    near(pixel(&of(0.5), [4, 2], "").0, COLOR);
    near(pixel(&of(0.5), [4, 2], ", premultiplied: false").0, [0.25, 0.125, 0.05]);
    near(pixel(&of(0.0), [4, 2], "").0, [0.25, 0.125, 0.05]);
    let mut bytes = Vec::new();
    image::RgbaImage::from_pixel(4, 4, image::Rgba([100, 50, 25, 128]))
        .write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png)
        .unwrap();
    assert_eq!(codes(pixel(&bytes, [4, 4], "").0), [100, 50, 25]);
    assert_eq!(codes(pixel(&bytes, [4, 4], ", premultiplied: true").0), [199, 100, 50]);
}

#[test]
fn replaces_nan_and_infinities() {
    let bytes = exr(&[("R", 0.5), ("G", 0.25), ("B", 0.1)], |_, planes| {
        planes[0][0] = f32::NAN;
        planes[2][6] = f32::INFINITY;
    });
    let (color, said) = pixel(&bytes, [4, 2], "");
    near(color, [0.0, 0.25, 0.1]);
    let place =
        "2 of 24 samples are NaN or infinite; 0 is used instead. The first is `NaN` in channel `R` at pixel (0, 0)";
    assert!(said.contains(place), "{said}");
    let (color, said) = pixel(&bytes, [4, 2], ", not_finite: 0.75");
    near(color, [0.75, 0.25, 0.1]);
    assert!(!said.contains("warning"), "{said}");
}

#[test]
fn puts_udim_tiles_side_by_side() {
    let desk = Desk::new();
    for (number, value) in [(1001, 0.1), (1002, 0.2), (1012, 0.3)] {
        desk.write(&format!("it.{number}.exr"), exr(&[("Y", value)], unchanged));
    }
    let (picture, said) = shown(&desk, [8, 4], r#"path: "it.<UDIM>.exr""#);
    let at = |x: usize, y: usize| picture.plane(0)[y * 8 + x];
    assert_eq!([at(0, 3), at(7, 3), at(7, 0), at(0, 0)], [0.1, 0.2, 0.3, 0.0]);
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains(
            "there is no file for `1011`, where the picture is 0; there are files for `1001`, `1002`, `1012`"
        ),
        "{said}"
    );
    // The tile number of a file counts, not only its content.
    let keys = || desk.shibo("check a.ron --verify").expect(0);
    keys();
    std::fs::rename(desk.path("it.1012.exr"), desk.path("it.1011.exr")).unwrap();
    let (picture, _) = shown(&desk, [8, 4], r#"path: "it.<UDIM>.exr""#);
    assert_eq!([picture.plane(0)[0], picture.plane(0)[7]], [0.3, 0.0]);
    desk.write("it.1003.exr", exr(&[("R", 1.0), ("G", 1.0), ("B", 1.0)], unchanged));
    let checked = desk.shibo("check a.ron --format json").expect(1).json();
    let message = checked["errors"][0]["message"].as_str().unwrap();
    assert!(message.contains("the tiles of a set must be alike"), "{message}");
    desk.write("a.ron", r#"(nodes: { "it": Image(path: "no.<UDIM>.png") }, outputs: { "it": "it" })"#);
    let checked = desk.shibo("check a.ron --format json").expect(1).json();
    assert_eq!(checked["errors"][0]["code"], "file-not-found", "{checked}");
}
