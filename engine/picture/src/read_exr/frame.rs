//! The display window of an OpenEXR file, into which blocks are copied. It can differ from the data window of a part.
use super::super::limits::ReadError;
use super::select::Selection;
use exr::block::UncompressedBlock;
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header as Layer;
use half::f16;
use std::ops::Range;

/// Position of a part's data in the picture.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    /// Size of the display window in pixels.
    pub(super) width: u32,
    pub(super) height: u32,
    /// The upper left pixel of the data, relative to that of the picture.
    left: i64,
    top: i64,
}

impl Frame {
    pub(super) fn of(layer: &Layer) -> Result<Self, ReadError> {
        let (display, data) = (layer.shared_attributes.display_window, layer.own_attributes.layer_position);
        let side = |pixels: usize| u32::try_from(pixels).map_err(ReadError::corrupt);
        Ok(Self {
            width: side(display.size.width())?,
            height: side(display.size.height())?,
            left: i64::from(data.x()) - i64::from(display.position.x()),
            top: i64::from(data.y()) - i64::from(display.position.y()),
        })
    }

    /// True if no data of the part lies in the picture.
    pub(super) fn is_empty(&self, layer: &Layer) -> bool {
        let Vec2(width, height) = layer.layer_size;
        shown(self.left, width, self.width as usize).is_empty()
            || shown(self.top, height, self.height as usize).is_empty()
    }
}

/// Range of pixels visible in the picture (`whole` pixels wide) among the `length` pixels from `start` on.
fn shown(start: i64, length: usize, whole: usize) -> Range<usize> {
    let clamp = |at: i64| usize::try_from(at.max(0)).unwrap_or(usize::MAX).min(length);
    let whole = i64::try_from(whole).unwrap_or(i64::MAX);
    clamp(start.saturating_neg())..clamp(whole.saturating_sub(start))
}

/// The picture into which blocks are copied; 0 where there are no data.
pub(super) struct Target {
    frame: Frame,
    pixels: usize,
    /// Per stored channel: its type, and the index of its plane.
    channels: Vec<(SampleType, Option<usize>)>,
    pub(super) planes: Vec<f32>,
}

impl Target {
    pub(super) fn new(frame: Frame, layer: &Layer, selection: &Selection) -> Self {
        let pixels = frame.width as usize * frame.height as usize;
        let kinds = layer.channels.list.iter().enumerate().map(|(index, channel)| {
            (channel.sample_type, selection.channels.iter().position(|chosen| *chosen == index))
        });
        let planes = vec![0.0; pixels * selection.channels.len()];
        Self { frame, pixels, channels: kinds.collect(), planes }
    }

    pub(super) fn put(&mut self, block: &UncompressedBlock) -> Result<(), ReadError> {
        let (Vec2(left, top), Vec2(width, height)) = (block.index.pixel_position, block.index.pixel_size);
        let place = |offset: i64, at: usize| offset.saturating_add(i64::try_from(at).unwrap_or(i64::MAX));
        let (left, top) = (place(self.frame.left, left), place(self.frame.top, top));
        let (wide, high) = (self.frame.width as usize, self.frame.height as usize);
        let (columns, rows) = (shown(left, width, wide), shown(top, height, high));
        let mut data = block.data.as_slice();
        for row in 0..height {
            for (kind, plane) in &self.channels {
                let size = kind.bytes_per_sample();
                let (line, rest) =
                    data.split_at_checked(width * size).ok_or_else(|| ReadError::damaged("a block is too short"))?;
                data = rest;
                let Some(plane) = plane.filter(|_| rows.contains(&row) && !columns.is_empty()) else { continue };
                let within = |at: i64| usize::try_from(at).map_err(ReadError::corrupt);
                let (x, y) = (within(place(left, columns.start))?, within(place(top, row))?);
                let start = plane * self.pixels + y * wide + x;
                let line = &line[columns.start * size..columns.end * size];
                convert(*kind, line, &mut self.planes[start..start + columns.len()]);
            }
        }
        Ok(())
    }
}

fn convert(kind: SampleType, line: &[u8], out: &mut [f32]) {
    let halves = line.as_chunks::<2>().0;
    let words = line.as_chunks::<4>().0;
    match kind {
        SampleType::F16 => out.iter_mut().zip(halves).for_each(|(out, half)| *out = f16::from_ne_bytes(*half).to_f32()),
        SampleType::F32 => out.iter_mut().zip(words).for_each(|(out, word)| *out = f32::from_ne_bytes(*word)),
        #[expect(clippy::cast_precision_loss, reason = "numbers of objects beyond 2^24 cannot be told apart as floats")]
        SampleType::U32 => out.iter_mut().zip(words).for_each(|(out, word)| *out = u32::from_ne_bytes(*word) as f32),
    }
}
