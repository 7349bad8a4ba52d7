//! Files of other programs: all sample types, palettes, tiles, layers and windows.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking, its helpers too")]

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder, SmallVec,
    Vec2, WritableImage, f16,
};
use image::codecs::jpeg::JpegEncoder;
use shibo_picture::{FileFormat, Picture, ReadError, ReadLimits, SampleKind, header_bytes, read_bytes};
use std::io::Cursor;
use tiff::encoder::{TiffEncoder, colortype};

fn decode(bytes: &[u8]) -> Picture {
    let picture = read_bytes(bytes, &ReadLimits::default()).unwrap();
    let header = header_bytes(bytes).unwrap();
    let of_picture = (picture.width, picture.height, picture.channels, picture.source, picture.has_alpha);
    assert_eq!((header.width, header.height, header.channels, header.kind, header.has_alpha), of_picture);
    picture
}

fn png(color: png::ColorType, depth: png::BitDepth, palette: Option<Vec<u8>>, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4, 2);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if let Some(palette) = palette {
        encoder.set_palette(palette);
        encoder.set_trns(vec![255, 255, 51]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

#[test]
fn png_of_few_bits_and_palettes() {
    use png::{BitDepth, ColorType};
    let one = decode(&png(ColorType::Grayscale, BitDepth::One, None, &[0b1010_0000, 0b0111_0000]));
    assert_eq!(one.planes, [1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let two = decode(&png(ColorType::Grayscale, BitDepth::Two, None, &[0b0001_1011, 0]));
    assert_eq!(two.planes[..4], [0.0, 85.0 / 255.0, 170.0 / 255.0, 1.0]);
    let four = decode(&png(ColorType::Grayscale, BitDepth::Four, None, &[0x0f, 0x80, 0, 0]));
    assert_eq!(four.planes[..4], [0.0, 1.0, 136.0 / 255.0, 0.0]);
    let palette = Some(vec![255, 0, 0, 0, 255, 0, 0, 0, 51]);
    let indexed = decode(&png(ColorType::Indexed, BitDepth::Two, palette, &[0b0001_1000, 0b1010_1010]));
    assert_eq!((indexed.channels, indexed.has_alpha, indexed.source), (4, true, SampleKind::U8));
    assert_eq!(indexed.plane(0)[..4], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(indexed.plane(2)[..4], [0.0, 0.0, 0.2, 0.0]);
    assert_eq!(indexed.plane(3)[..4], [1.0, 1.0, 0.2, 1.0]);
    let wide = decode(&png(ColorType::GrayscaleAlpha, BitDepth::Sixteen, None, &[0x12; 32]));
    assert_eq!((wide.channels, wide.source), (2, SampleKind::U16));
    assert!(wide.planes.iter().all(|sample| *sample == f32::from(0x1212_u16) / 65535.0));
}

#[test]
fn jpeg_in_grey_and_colour() {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 100)
        .encode(&[100; 20 * 10], 20, 10, image::ExtendedColorType::L8)
        .unwrap();
    let grey = decode(&bytes);
    assert_eq!((grey.width, grey.height, grey.channels), (20, 10, 1));
    assert!(grey.planes.iter().all(|sample| (sample * 255.0 - 100.0).abs() <= 1.0));
    assert_eq!(header_bytes(&bytes).unwrap().format, FileFormat::Jpeg);
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 100).encode(&[200; 600], 20, 10, image::ExtendedColorType::Rgb8).unwrap();
    assert_eq!(decode(&bytes).channels, 3);
}

fn tiff<C: colortype::ColorType>(data: &[C::Inner]) -> Vec<u8>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let compression = tiff::encoder::Compression::Lzw;
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
    let mut image = encoder.new_image::<C>(4, 6).unwrap();
    image.rows_per_strip(2).unwrap();
    image.write_data(data).unwrap();
    bytes.into_inner()
}

#[test]
fn tiff_of_all_samples_in_strips() {
    let grey: Vec<f32> = (0..24_u8).map(|value| f32::from(value) - 7.5).collect();
    let picture = decode(&tiff::<colortype::Gray32Float>(&grey));
    assert_eq!((picture.source, picture.channels, &picture.planes), (SampleKind::F32, 1, &grey));
    let colour: Vec<f32> = (0..72_u8).map(f32::from).collect();
    let picture = decode(&tiff::<colortype::RGB32Float>(&colour));
    assert_eq!(picture.plane(1)[..3], [1.0, 4.0, 7.0]);
    let picture = decode(&tiff::<colortype::RGBA16>(&[65535; 96]));
    assert_eq!((picture.source, picture.has_alpha, picture.planes[95]), (SampleKind::U16, true, 1.0));
    let picture = decode(&tiff::<colortype::Gray8>(&[51; 24]));
    assert_eq!((picture.source, picture.planes[23]), (SampleKind::U8, 0.2));
    let picture = decode(&tiff::<colortype::Gray32>(&[u32::MAX; 24]));
    assert_eq!((picture.source, picture.planes[23]), (SampleKind::U32, 1.0));
    let doubles = read_bytes(&tiff::<colortype::Gray64Float>(&[0.0; 24]), &ReadLimits::default());
    assert!(matches!(doubles, Err(ReadError::Unsupported { .. })), "{doubles:?}");
}

/// A little-endian TIFF from (tag, type, values), followed by the data; `u32::MAX` stands for the offset of the data.
fn tiff_by_hand(entries: &[(u16, u16, u32)], data: &[u8]) -> Vec<u8> {
    let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
    bytes.extend(u16::try_from(entries.len()).unwrap().to_le_bytes());
    let place = u32::try_from(8 + 2 + entries.len() * 12 + 4).unwrap();
    for (tag, kind, value) in entries {
        bytes.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(if *value == u32::MAX { place } else { *value }.to_le_bytes());
    }
    bytes.extend([0; 4]);
    bytes.extend(data);
    bytes
}

#[test]
fn tiff_of_halves_and_tiles() {
    let half: Vec<u8> = [0.5, -2.0, 3.0, 65504.0].iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect();
    let base = [(256, 3, 2), (257, 3, 2), (258, 3, 16), (259, 3, 1), (262, 3, 1)];
    let entries = [&base[..], &[(273, 4, u32::MAX), (277, 3, 1), (278, 3, 2), (279, 4, 8), (339, 3, 3)]].concat();
    let picture = decode(&tiff_by_hand(&entries, &half));
    assert_eq!((picture.source, &picture.planes[..]), (SampleKind::F16, &[0.5, -2.0, 3.0, 65504.0][..]));
    // The tile is larger than the picture.
    let tile: Vec<u8> = (0..=255).collect();
    let base = [(256, 3, 2), (257, 3, 2), (258, 3, 8), (259, 3, 1), (262, 3, 1), (277, 3, 1)];
    let entries = [&base[..], &[(322, 3, 16), (323, 3, 16), (324, 4, u32::MAX), (325, 4, 256)]].concat();
    let picture = decode(&tiff_by_hand(&entries, &tile));
    assert_eq!(picture.planes, [0.0, 1.0 / 255.0, 16.0 / 255.0, 17.0 / 255.0]);
}

type Channels = SmallVec<[AnyChannel<FlatSamples>; 4]>;

fn layer(name: &str, channels: &[(&str, FlatSamples)], encoding: Encoding) -> Layer<AnyChannels<FlatSamples>> {
    let list: Channels = channels.iter().map(|(name, data)| AnyChannel::new(*name, data.clone())).collect();
    let attributes = LayerAttributes { layer_position: Vec2(-7, 5), ..LayerAttributes::named(name) };
    Layer::new((5, 3), attributes, encoding, AnyChannels::sort(list))
}

fn exr_bytes(layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    if layers.len() == 1 {
        Image::from_layer(layers.into_iter().next().unwrap()).write().to_buffered(&mut bytes).unwrap();
    } else {
        let bounds = exr::prelude::IntegerBounds::new((-7, 5), (5, 3));
        let attributes = exr::prelude::ImageAttributes::new(bounds);
        let layers: SmallVec<[_; 2]> = layers.into_iter().collect();
        Image::empty(attributes).with_layers(layers).write().to_buffered(&mut bytes).unwrap();
    }
    bytes.into_inner()
}

fn ramp(start: f32) -> Vec<f32> {
    (0..15_u8).map(|value| f32::from(value) + start).collect()
}

trait WithLayers {
    type Out;
    fn with_layers(self, layers: SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>) -> Self::Out;
}

impl<L> WithLayers for Image<L> {
    type Out = Image<SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>>;
    fn with_layers(self, layers: SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>) -> Self::Out {
        Image { attributes: self.attributes, layer_data: layers }
    }
}

#[test]
fn exr_of_one_channel_with_any_name() {
    let encodings = [
        Encoding::UNCOMPRESSED,
        Encoding::FAST_LOSSLESS,
        Encoding::SMALL_LOSSLESS,
        Encoding { compression: Compression::ZIP1, ..Encoding::UNCOMPRESSED },
        Encoding { compression: Compression::ZIP16, line_order: LineOrder::Decreasing, ..Encoding::UNCOMPRESSED },
        Encoding { compression: Compression::PIZ, ..Encoding::UNCOMPRESSED },
    ];
    for encoding in encodings {
        for name in ["height", "Z", "Y", "A", "displacement.height"] {
            let picture = decode(&exr_bytes(vec![layer("", &[(name, FlatSamples::F32(ramp(-3.5)))], encoding)]));
            assert_eq!((picture.width, picture.height, picture.channels), (5, 3, 1));
            assert_eq!((picture.planes, picture.names), (ramp(-3.5), vec![name.to_owned()]));
        }
    }
    let halves = FlatSamples::F16(ramp(0.5).into_iter().map(f16::from_f32).collect());
    let picture = decode(&exr_bytes(vec![layer("", &[("h", halves)], Encoding::FAST_LOSSLESS)]));
    assert_eq!((picture.source, picture.planes), (SampleKind::F16, ramp(0.5)));
    let numbers = FlatSamples::U32((0..15).collect());
    let picture = decode(&exr_bytes(vec![layer("", &[("id", numbers)], Encoding::FAST_LOSSLESS)]));
    assert_eq!((picture.source, picture.planes), (SampleKind::U32, ramp(0.0)));
}

#[test]
fn exr_colours_come_in_their_order() {
    let float = |start| FlatSamples::F32(ramp(start));
    let colours = [("A", float(3.0)), ("B", float(2.0)), ("G", float(1.0)), ("R", float(0.0)), ("Z", float(9.0))];
    let picture = decode(&exr_bytes(vec![layer("", &colours, Encoding::FAST_LOSSLESS)]));
    assert_eq!((picture.channels, picture.has_alpha), (4, true));
    assert_eq!((picture.plane(0), picture.plane(3)), (&ramp(0.0)[..], &ramp(3.0)[..]));
    let several = vec![
        layer("depth", &[("Z", float(5.0))], Encoding::FAST_LOSSLESS),
        layer("diffuse", &colours[1..4], Encoding::SMALL_LOSSLESS),
    ];
    let picture = decode(&exr_bytes(several));
    assert_eq!(picture.names, ["diffuse.R", "diffuse.G", "diffuse.B"]);
    assert_eq!(picture.plane(2), ramp(2.0));
}
