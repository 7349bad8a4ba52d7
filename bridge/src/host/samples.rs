//! The samples of a picture in the form that a program asks for.
use super::Refusal;
use serde::Deserialize;
use shibo_picture::{Compression, Depth, Encoding, Format, PictureSpec, Transfer, encoded_rows, in_memory};
use shibo_value::Tile;

/// The form of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Form {
    /// Floats of 32 bits, little-endian: the exact values of the graph.
    #[default]
    F32,
    /// Bytes as a PNG has them: colours with the sRGB curve.
    U8,
    /// A PNG file with 8 bits.
    Png,
    /// An EXR file with floats of 32 bits.
    Exr,
}

impl Form {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::U8 => "u8",
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }

    /// Bits of a sample.
    pub(super) fn bits(self) -> u32 {
        match self {
            Self::F32 | Self::Exr => 32,
            Self::U8 | Self::Png => 8,
        }
    }

    /// The samples of a tile. `range` has the values of the least and the greatest byte.
    pub(super) fn bytes(
        self,
        tile: &Tile,
        layout: Layout,
        (is_color, range): (bool, Option<(f64, f64)>),
    ) -> Result<Vec<u8>, Refusal> {
        let planes = layout.planes(tile);
        let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
        if self == Self::F32 {
            let pixels = tile.width() * tile.height();
            let mut bytes = Vec::with_capacity(4 * planes.len() * pixels);
            (0..pixels).for_each(|at| planes.iter().for_each(|plane| bytes.extend(plane[at].to_le_bytes())));
            return Ok(bytes);
        }
        #[expect(clippy::cast_possible_truncation, reason = "picture samples are f32")]
        let range = range.map(|(low, high)| (low as f32, high as f32));
        let (format, depth) = if self == Self::Exr { (Format::Exr, Depth::F32) } else { (Format::Png, Depth::U8) };
        let names: &[&str] = match planes.len() {
            1 => &["Y"],
            2 => &["Y", "A"],
            3 => &["R", "G", "B"],
            _ => &["R", "G", "B", "A"],
        };
        let transfer = if is_color { Transfer::Srgb } else { Transfer::Raw };
        let spec = PictureSpec {
            width: tile.window.width,
            height: tile.window.height,
            channels: names.iter().map(|name| (*name).to_owned()).collect(),
            format,
            depth,
            encoding: Encoding { transfer, range, ..Encoding::default() },
            compression: Compression::Fast,
            mips: Vec::new(),
            chromaticities: None,
            pixel_mm: None,
            metadata: Vec::new(),
        };
        let made = if self == Self::U8 { encoded_rows(&spec, &planes) } else { in_memory(&spec, &planes) };
        made.map_err(|error| Refusal::new("file", error.to_string()))
    }
}

/// Components of a pixel, and order of the rows.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    pub(super) components: usize,
    pub(super) bottom_up: bool,
}

impl Layout {
    /// The components of a pixel with these channels.
    pub(super) fn pixel(self, channels: &[f32]) -> Vec<f32> {
        (0..self.components)
            .map(|at| self.source(channels.len(), at).map_or(1.0, |from| from.map_or(0.0, |from| channels[from])))
            .collect()
    }

    /// The channel for a component: `None` for opacity, which is 1, and for a missing channel, which is 0. A number counts for the
    /// first three.
    fn source(self, channels: usize, at: usize) -> Option<Option<usize>> {
        match (channels, at) {
            (..4, 3) => None,
            (1, _) => Some(Some(0)),
            _ => Some((at < channels).then_some(at)),
        }
    }

    /// The components of all pixels, one plane each.
    fn planes(self, tile: &Tile) -> Vec<Vec<f32>> {
        let (width, height) = (tile.width(), tile.height());
        let plane = |at| match self.source(tile.channels(), at) {
            None => vec![1.0; width * height],
            Some(None) => vec![0.0; width * height],
            Some(Some(from)) if self.bottom_up => {
                tile.plane(from).chunks_exact(width.max(1)).rev().flatten().copied().collect()
            }
            Some(Some(from)) => tile.plane(from).to_vec(),
        };
        (0..self.components).map(plane).collect()
    }
}
