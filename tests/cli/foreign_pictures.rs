//! SVG and TIFF files of other programs, and pixel sizes stated by pictures, end to end.
use crate::support::{Desk, samples};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;

/// A graph that shows a file.
fn graph(file: &str) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 20, resolution: 20, tile: None),\n nodes: {{ \"s\": Svg(path: \"{file}\") }},\n \
         outputs: {{ \"c\": File(from: \"s.color\", format: Png, depth: U8) }})"
    )
}

/// A folder with `a.svg` and a graph that shows it.
fn desk(file: &[u8]) -> Desk {
    let desk = Desk::new();
    desk.write("a.svg", file);
    desk.write("a.ron", graph("a.svg"));
    desk
}

const HEAD: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 20">"#;
const SQUARE: &str = r#"<rect width="10" height="20" fill="CornflowerBlue"/></svg>"#;

#[test]
fn draws_compressed_and_latin1_svg() {
    let text = format!("{HEAD}<title>caf\u{e9}</title><text display='none'>x</text>{SQUARE}");
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(text.as_bytes()).unwrap();
    let latin = format!("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>{text}");
    let latin = latin.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    for file in [text.clone().into_bytes(), packed.finish().unwrap(), latin] {
        let desk = desk(&file);
        desk.shibo("check a.ron").expect(0);
        desk.shibo("render a.ron --no-cache").expect(0);
        let (_, pixels) = samples(&desk.path("out/c.png"));
        let [left, right] = [5, 15].map(|x| [0, 1, 2].map(|channel| pixels[20 * 5 + x][channel] >> 8));
        assert_eq!((left, right), ([100, 149, 237], [0, 0, 0]));
    }
}

#[test]
fn refuses_unknown_svg_colours_with_place() {
    let desk = desk(format!("{HEAD}\n  <rect width='5' height='5' fill='var(--brand)'/></svg>").as_bytes());
    let error = desk.shibo("check a.ron --format json").expect(1).json()["errors"][0].clone();
    let message = error["message"].as_str().unwrap();
    assert!(
        message.ends_with("a.svg`, line 2, column 3: `fill` is `var(--brand)`, which is no colour that is read"),
        "{error}"
    );
    assert!(error["help"].as_str().unwrap().contains("write the colour itself"), "{error}");
    assert_eq!((error["line"].as_u64(), error["code"].as_str()), (Some(2), Some("bad-file")));
    desk.shibo("render a.ron").expect(1);
}

#[test]
fn reads_tiff_after_thumbnail_and_turns_it_upright() {
    use tiff::encoder::{TiffEncoder, colortype::Gray8};
    use tiff::tags::Tag;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap();
    for (size, values, (tag, value)) in
        [((1, 1), &[9][..], (Tag::NewSubfileType, 1)), ((3, 2), &[10, 20, 30, 40, 50, 60][..], (Tag::Orientation, 6))]
    {
        let mut image = encoder.new_image::<Gray8>(size.0, size.1).unwrap();
        image.encoder().write_tag(tag, u16::try_from(value).unwrap()).unwrap();
        image.write_data(values).unwrap();
    }
    let desk = Desk::new();
    desk.write("a.tif", bytes.into_inner());
    desk.write(
        "a.ron",
        "(version: 1, canvas: (size_mm: (2, 3), resolution: (2, 3), tile: None),\n nodes: { \"i\": Image(path: \"a.tif\", \
         filter: Nearest) }, outputs: { \"o\": File(from: \"i.gray\", format: Png, depth: U8) })",
    );
    desk.shibo("check a.ron").expect(0);
    desk.shibo("render a.ron --no-cache").expect(0);
    let (width, pixels) = samples(&desk.path("out/o.png"));
    let pixels: Vec<u16> = pixels.iter().map(|pixel| pixel[0] >> 8).collect();
    assert_eq!((width, pixels), (2, vec![40, 10, 50, 20, 60, 30]));
}

#[test]
fn pictures_state_the_size_of_their_pixels() {
    let desk = Desk::new();
    // Four pixels per mm, for the whole canvas and for a region.
    desk.write(
        "a.ron",
        "(version: 1, canvas: (size_mm: (16, 8), resolution: 64, tile: None), nodes: { \"n\": Perlin(size: 3) }, \
         outputs: { \"n\": \"n\" })",
    );
    for more in ["", " --region 3,3,9,5"] {
        desk.shibo(&format!("render a.ron{more} --no-cache")).expect(0);
        let file = std::fs::read(desk.path("out/n.png")).unwrap();
        let reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
        let dims = reader.info().pixel_dims.unwrap();
        assert_eq!((dims.xppu, dims.yppu, dims.unit), (4000, 4000, png::Unit::Meter), "{more}");
    }
    // Results are also kept by the size of the pixels.
    let size = |mm: u32| {
        let graph = format!(
            "(version: 1, canvas: (size_mm: {mm}, resolution: 64, tile: None), nodes: {{ \"n\": \"= 0.5\" }}, outputs: {{ \"n\": \"n\" }})"
        );
        desk.write("b.ron", graph);
        desk.shibo("render b.ron").expect(0);
        let file = std::fs::read(desk.path("out/n.png")).unwrap();
        png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap().info().pixel_dims.unwrap().xppu
    };
    assert_eq!((size(64), size(32), size(64)), (1000, 2000, 1000));
}
