//! Broken picture files, end to end: `check` and `render` report the same.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::pictures;
use crate::support;

use crate::pictures::{Jpeg, exif, frame, indexed_png, jpeg, samples, tiff, with_segment};
use crate::support::Desk;
use serde_json::Value as Json;

/// A graph that shows a picture; its path is in line 3, from column 30 on.
fn graph(more: &str) -> String {
    format!(
        "(\n  canvas: (size_mm: 40, resolution: 32, tile: Both),\n  nodes: {{ \"it\": Image(path: \"picture\"{more}) }},\n  outputs: {{ \"it\": \"it\" }},\n)"
    )
}

fn desk(picture: &[u8]) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", graph(""));
    desk.write("picture", picture);
    desk
}

/// The error of `check` about a picture that must be refused; `render` prints the same message.
#[track_caller]
fn refused(picture: &[u8]) -> Json {
    let desk = desk(picture);
    let checked = desk.shibo("check a.ron --format json").expect(1).json();
    let error = checked["errors"][0].clone();
    let place = ["line", "column"].map(|key| error[key].as_u64().unwrap());
    assert_eq!((place, checked["errors"].as_array().unwrap().len()), ([3, 30], 1), "{error}");
    let rendered = desk.shibo("render a.ron").expect(1);
    let flat = |text: &str| text.chars().filter(|c| c.is_alphanumeric()).collect::<String>();
    assert!(flat(&rendered.stderr).contains(&flat(error["message"].as_str().unwrap())), "{}", rendered.stderr);
    error
}

#[test]
fn check_reports_bad_pictures() {
    let good = samples();
    let (png, lzw) = (&good[0], tiff(tiff::encoder::Compression::Lzw, 8));
    let mut print = Jpeg::default();
    print.segments[1].1 = frame(8, 4);
    let cases: &[(&[u8], &str)] = &[
        (b"", "the file is empty"),
        (b"not a picture\n", "it is text, not a picture; it must be PNG, JPEG, TIFF, OpenEXR or Radiance HDR"),
        (
            b"RIFF\x10\0\0\0WEBPVP8 ",
            "it is WebP; it must be PNG, JPEG, TIFF, OpenEXR or Radiance HDR: convert it to PNG",
        ),
        (b"BM\x10\0\0\0", "it is BMP; it must be PNG, JPEG, TIFF, OpenEXR or Radiance HDR: convert it to PNG"),
        (&png[..png.len() / 2], "the file is truncated: it ends within the chunk `IDAT`; copy or save it again"),
        (&png[..png.len() - 12], "the file is truncated: its last chunk, `IEND`, is missing; copy or save it again"),
        (&lzw[..lzw.len() / 2], "copy or save it again"),
        (&print.bytes(), "CMYK or YCCK"),
        (&indexed_png(&[0, 1, 2, 3], (2, 2), 2, &[9; 9], None), "has colour 3 of the palette"),
        // The decoder panics on this palette.
        (&indexed_png(&[0; 4], (2, 2), 2, &[9; 4], None), "its palette, `PLTE`, has 4 bytes"),
    ];
    for (picture, reason) in cases {
        let error = refused(picture);
        assert_eq!(error["code"], "bad-file", "{error}");
        assert!(error["message"].as_str().unwrap().contains(reason), "{error}");
    }
}

#[test]
fn render_reports_damaged_samples() {
    let mut png = samples().remove(0);
    let data = png.windows(4).position(|name| name == b"IDAT").unwrap() + 4;
    png[data + 40..data + 60].fill(0xff);
    pictures::mend_checksums(&mut png);
    let desk = desk(&png);
    desk.shibo("check a.ron").expect(0);
    let ran = desk.shibo("render a.ron").expect(1);
    assert!(ran.stderr.contains("bad-file") && ran.stderr.contains("a.ron:3:30"), "{}", ran.stderr);
    assert!(ran.stderr.contains("compressed"), "{}", ran.stderr);
}

#[test]
fn crops_and_layers_are_checked_without_decoding() {
    // 41 × 37 pixels, stored as 37 × 41.
    let desk = desk(&with_segment(&jpeg(), 0xe1, &exif(6, true)));
    let check = |more: &str| {
        desk.write("a.ron", graph(more));
        desk.shibo("check a.ron --format json").json()["errors"][0]["code"].clone()
    };
    assert_eq!(check(", crop: (40, 36, 1, 1)"), Json::Null);
    assert_eq!(check(", crop: (36, 40, 1, 1)"), "out-of-range");
    assert_eq!(check(", layer: \"G\""), Json::Null);
    assert_eq!(check(", layer: \"height\""), "unknown-variant");
}

const MATERIAL: &str = r#"(
  canvas: (size_mm: 40, resolution: 32, tile: Both),
  nodes: {
    "bumps": Perlin(size: 5),
    "m": Material(height: "bumps"),
    "open": "= m.ao",
  },
  outputs: { "m": "m", "open": "open" },
)"#;

#[test]
fn missing_channels_warn_and_use_default() {
    let desk = Desk::new();
    desk.write("a.ron", MATERIAL);
    let warnings = desk.shibo("check a.ron --format json").expect(0).json()["warnings"].clone();
    let message = "`m` has no channel `ao`; its default, 1, is used";
    assert_eq!((warnings[0]["message"].as_str(), warnings[0]["line"].as_u64()), (Some(message), Some(6)), "{warnings}");
    assert_eq!(warnings.as_array().unwrap().len(), 1, "{warnings}");
    for (what, file) in [("open", "out/open.png"), ("m.ao", "out/m_ao.png"), ("m.normal", "out/m_normal.png")] {
        let ran = desk.shibo(&format!("render a.ron --output {what}")).expect(0);
        assert!(ran.stderr.contains("warning") && ran.stderr.contains("default"), "{}", ran.stderr);
        let (_, pixels) = support::samples(&desk.path(file));
        let expected = if what == "m.normal" { [32768, 32768, 65535, 65535] } else { [65535; 4] };
        assert!(pixels.iter().all(|pixel| *pixel == expected), "{what}: {:?}", pixels[0]);
    }
    desk.shibo("render a.ron --output m.shine").expect(2);
}
