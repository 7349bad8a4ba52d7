//! Small picture files of each format, built byte by byte or by the writers of other programs.
#![allow(dead_code, clippy::unwrap_used, reason = "each test program uses a part of it, and fails by panicking")]

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding as ExrEncoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
    WritableImage,
};
use shibo_picture::{Compression, Depth, Encoding, Format, PictureSpec, ReadLimits, Writer};
use std::io::Cursor;

/// The limits of the tests: large for their files, small for the machine.
pub(crate) const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: 16 << 20, max_pixels: 1 << 22, max_bytes_decoded: 64 << 20 };

/// Size of most of the pictures.
pub(crate) const SIZE: (u16, u16) = (37, 41);
const PIXELS: u16 = SIZE.0 * SIZE.1;

pub(crate) fn written(format: Format, depth: Depth, channels: usize, compression: Compression) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a");
    let names = (0..channels).map(|index| format!("c{index}")).collect();
    let (encoding, metadata) = (Encoding::default(), vec![("Software".to_owned(), "test".to_owned())]);
    let (mips, chromaticities) = (Vec::new(), None);
    let spec = PictureSpec {
        width: 37,
        height: 41,
        channels: names,
        format,
        depth,
        encoding,
        compression,
        mips,
        chromaticities,
        pixel_mm: None,
        metadata,
    };
    let plane: Vec<f32> = (0..PIXELS).map(|index| f32::from(index % 251) / 250.0).collect();
    let mut writer = Writer::create(&path, &spec).unwrap();
    writer.write_rows(&vec![&plane[..]; channels], 41).unwrap();
    writer.finish().unwrap();
    std::fs::read(&path).unwrap()
}

pub(crate) fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels: Vec<u8> = (0..PIXELS * 3).map(|index| index.to_le_bytes()[0]).collect();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut bytes);
    encoder.encode(&pixels, 37, 41, image::ExtendedColorType::Rgb8).unwrap();
    bytes
}

fn exr_layer(name: &str, encoding: ExrEncoding) -> Layer<AnyChannels<FlatSamples>> {
    let data = FlatSamples::F32((0..PIXELS).map(f32::from).collect());
    let channels = AnyChannels::sort(std::iter::once(AnyChannel::new("height", data)).collect());
    Layer::new((37, 41), LayerAttributes::named(name), encoding, channels)
}

fn exr(encoding: ExrEncoding) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(exr_layer("l", encoding)).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

pub(crate) fn tiled_exr() -> Vec<u8> {
    exr(ExrEncoding::FAST_LOSSLESS)
}

/// Uncompressed rows, each a block of its own.
pub(crate) fn plain_exr() -> Vec<u8> {
    exr(ExrEncoding::UNCOMPRESSED)
}

/// Two parts; the first has uncompressed rows.
pub(crate) fn exr_of_parts() -> Vec<u8> {
    let parts = [exr_layer("a", ExrEncoding::UNCOMPRESSED), exr_layer("b", ExrEncoding::SMALL_LOSSLESS)];
    let layers = parts.into_iter().collect::<SmallVec<[_; 2]>>();
    let attributes = exr::prelude::ImageAttributes::new(exr::prelude::IntegerBounds::from_dimensions((37, 41)));
    let mut bytes = Cursor::new(Vec::new());
    Image::empty(attributes)
        .with_layer(layers[0].clone())
        .with_layer(layers[1].clone())
        .write()
        .to_buffered(&mut bytes)
        .unwrap();
    bytes.into_inner()
}

pub(crate) fn tiff(compression: tiff::encoder::Compression, rows: u32) -> Vec<u8> {
    use tiff::encoder::{TiffEncoder, colortype::Gray16};
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
    let mut picture = encoder.new_image::<Gray16>(37, 41).unwrap();
    picture.rows_per_strip(rows).unwrap();
    picture.write_data(&[77; PIXELS as usize]).unwrap();
    bytes.into_inner()
}

pub(crate) fn big_tiff() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new_big(&mut bytes).unwrap();
    encoder.write_image::<tiff::encoder::colortype::RGB8>(37, 41, &[9; PIXELS as usize * 3]).unwrap();
    bytes.into_inner()
}

/// A valid file of each format.
pub(crate) fn samples() -> Vec<Vec<u8>> {
    use Compression::{Best, Fast};
    use tiff::encoder::Compression as Tiff;
    vec![
        written(Format::Png, Depth::U8, 4, Best),
        written(Format::Png, Depth::U16, 1, Fast),
        written(Format::Tiff, Depth::U8, 3, Best),
        written(Format::Tiff, Depth::F32, 1, Fast),
        written(Format::Exr, Depth::F16, 5, Best),
        written(Format::Exr, Depth::F32, 1, Fast),
        jpeg(),
        tiled_exr(),
        tiff(Tiff::Lzw, 41),
        tiff(Tiff::Uncompressed, 8),
        tiff(Tiff::Packbits, 8),
        exr_of_parts(),
        big_tiff(),
        indexed_png(&[0, 1, 2, 1], (2, 2), 2, &[9; 9], Some(&[7, 8])),
        Jpeg::default().bytes(),
        Jpeg::progressive().bytes(),
        include_bytes!("../../tiff/lzw_tiles.tif").to_vec(),
        include_bytes!("../../tiff/jpeg_ycbcr.tif").to_vec(),
        include_bytes!("../../tiff/jpeg_rgb_tiles.tif").to_vec(),
    ]
}

/// A PNG of these chunks, with correct checksums.
pub(crate) fn png_of(chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, content) in chunks {
        bytes.extend(u32::try_from(content.len()).unwrap().to_be_bytes());
        bytes.extend([&name[..], content, &[0; 4]].concat());
    }
    mend_checksums(&mut bytes);
    bytes
}

/// The chunks of a PNG: name and content.
pub(crate) fn chunks_of(bytes: &[u8]) -> Vec<([u8; 4], Vec<u8>)> {
    let mut at = 8;
    let mut chunks = Vec::new();
    while let Some((length, rest)) = bytes.get(at..).and_then(<[u8]>::split_first_chunk::<4>) {
        let length = u32::from_be_bytes(*length) as usize;
        let (Some(name), Some(content)) = (rest.first_chunk::<4>(), rest.get(4..4 + length)) else { break };
        chunks.push((*name, content.to_vec()));
        at += length + 12;
    }
    chunks
}

/// Corrects the checksums of a PNG, as far as its chunks can be read.
pub(crate) fn mend_checksums(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes(head.try_into().unwrap()) as usize;
        let Some(end) = at.checked_add(8 + length).filter(|end| end + 4 <= bytes.len()) else { return };
        let mut sum = flate2::Crc::new();
        sum.update(&bytes[at + 4..end]);
        let sum = sum.sum().to_be_bytes();
        bytes[end..end + 4].copy_from_slice(&sum);
        at = end + 4;
    }
}

/// An indexed PNG from samples (one a byte), size, bits per sample, palette and opacities.
pub(crate) fn indexed_png(
    samples: &[u8],
    (width, height): (u32, u32),
    bits: u8,
    palette: &[u8],
    opacities: Option<&[u8]>,
) -> Vec<u8> {
    let mut rows = Vec::new();
    for row in samples.chunks(width as usize) {
        rows.push(0);
        let per_byte = usize::from(8 / bits);
        rows.extend(row.chunks(per_byte).map(|group| {
            // The unused bits of a byte have no meaning; here all are ones.
            let all = group.iter().chain(std::iter::repeat(&u8::MAX)).take(per_byte);
            all.fold(0_u16, |byte, sample| (byte << bits) | (u16::from(*sample) & ((1 << bits) - 1))).to_le_bytes()[0]
        }));
    }
    indexed_png_of(&rows, (width, height), bits, false, palette, opacities)
}

/// An indexed PNG from filtered rows, which may be those of interlace passes.
pub(crate) fn indexed_png_of(
    rows: &[u8],
    (width, height): (u32, u32),
    bits: u8,
    interlaced: bool,
    palette: &[u8],
    opacities: Option<&[u8]>,
) -> Vec<u8> {
    use std::io::Write;
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(6));
    packed.write_all(rows).unwrap();
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[bits, 3, 0, 0, u8::from(interlaced)]].concat();
    let mut chunks = vec![(b"IHDR", header), (b"PLTE", palette.to_vec())];
    chunks.extend(opacities.map(|opacities| (b"tRNS", opacities.to_vec())));
    chunks.extend([(b"IDAT", packed.finish().unwrap()), (b"IEND", Vec::new())]);
    png_of(&chunks)
}

/// A JPEG of one block of 8 × 8 grey pixels, with parts that tests can change.
#[derive(Clone)]
pub(crate) struct Jpeg {
    /// Segments before the samples: marker and content.
    pub(crate) segments: Vec<(u8, Vec<u8>)>,
    /// Scan headers, each with its compressed samples.
    pub(crate) scans: Vec<(Vec<u8>, Vec<u8>)>,
    pub(crate) end: Vec<u8>,
}

/// A frame header of 8 × 8 pixels. Its channels are numbered from 1 and share a quantization table.
pub(crate) fn frame(bits: u8, channels: u8) -> Vec<u8> {
    let channel = |id: u8| [id, 0x11, 0];
    [vec![bits, 0, 8, 0, 8, channels], (1..=channels).flat_map(channel).collect()].concat()
}

/// A table of one code word, a 0, that stands for the number 0.
fn huffman(class: u8) -> Vec<u8> {
    [&[class << 4, 1][..], &[0; 16]].concat()
}

impl Default for Jpeg {
    /// Sequential: the block is the code word of its first coefficient and the end-of-block code.
    fn default() -> Self {
        let quantization = (0xdb, [&[0][..], &[1; 64]].concat());
        Self {
            segments: vec![quantization, (0xc0, frame(8, 1)), (0xc4, huffman(0)), (0xc4, huffman(1))],
            scans: vec![(vec![1, 1, 0, 0, 63, 0], vec![0b0011_1111])],
            end: vec![0xff, 0xd9],
        }
    }
}

impl Jpeg {
    /// Progressive: one scan for the first coefficients, one for the others.
    pub(crate) fn progressive() -> Self {
        let mut jpeg = Self::default();
        jpeg.segments[1].0 = 0xc2;
        jpeg.scans = vec![(vec![1, 1, 0, 0, 0, 0], vec![0b0111_1111]), (vec![1, 1, 0, 1, 63, 0], vec![0b0111_1111])];
        jpeg
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0xff, 0xd8];
        let segment = |marker: u8, content: &[u8]| {
            let length = u16::try_from(content.len() + 2).unwrap().to_be_bytes();
            [&[0xff, marker], &length[..], content].concat()
        };
        self.segments.iter().for_each(|(marker, content)| bytes.extend(segment(*marker, content)));
        self.scans.iter().for_each(|(header, data)| bytes.extend([segment(0xda, header), data.clone()].concat()));
        bytes.extend(&self.end);
        bytes
    }
}

/// An EXIF segment with an orientation from 1 to 8.
pub(crate) fn exif(orientation: u8, big_endian: bool) -> Vec<u8> {
    let ifd: &[u8] = if big_endian {
        &[b'M', b'M', 0, 42, 0, 0, 0, 8, 0, 1, 0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0, 0, 0, 0, 0]
    } else {
        &[b'I', b'I', 42, 0, 8, 0, 0, 0, 1, 0, 0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0, 0, 0, 0, 0]
    };
    [&b"Exif\0\0"[..], ifd].concat()
}

/// Inserts a segment after the first marker of a JPEG.
pub(crate) fn with_segment(jpeg: &[u8], marker: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len() + 2).unwrap().to_be_bytes();
    [&jpeg[..2], &[0xff, marker], &length, content, &jpeg[2..]].concat()
}
