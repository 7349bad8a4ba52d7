//! Computed rectangles of fields.
use super::buffer::Buffer;
use super::{Grid, Window};

/// The values of a field in a window: planar `f32`, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// The grid of `window`.
    pub grid: Grid,
    /// Pixels.
    pub window: Window,
    channels: usize,
    data: Buffer,
}

impl Tile {
    /// A tile of zeros.
    pub fn new(grid: Grid, window: Window, channels: usize) -> Self {
        Self { grid, window, channels, data: Buffer::zeros(window.len() * channels) }
    }

    /// A tile of arbitrary values, for code that sets all of them.
    pub fn unset(grid: Grid, window: Window, channels: usize) -> Self {
        Self { grid, window, channels, data: Buffer::unset(window.len() * channels) }
    }

    /// The number of channels.
    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// The number of columns.
    pub const fn width(&self) -> usize {
        self.window.width as usize
    }

    /// The number of rows.
    pub const fn height(&self) -> usize {
        self.window.height as usize
    }

    /// All values, one plane after another.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All values, one plane after another.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// One channel.
    pub fn plane(&self, channel: usize) -> &[f32] {
        let n = self.window.len();
        &self.data[channel * n..(channel + 1) * n]
    }

    /// One channel.
    pub fn plane_mut(&mut self, channel: usize) -> &mut [f32] {
        let n = self.window.len();
        &mut self.data[channel * n..(channel + 1) * n]
    }

    /// All channels, separately borrowed.
    pub fn planes_mut(&mut self) -> Vec<&mut [f32]> {
        self.data.chunks_mut(self.window.len().max(1)).collect()
    }

    /// One row of a channel; `row` counts from the top of the window.
    pub fn row(&self, channel: usize, row: usize) -> &[f32] {
        let w = self.width();
        &self.plane(channel)[row * w..(row + 1) * w]
    }

    /// One row of a channel; `row` counts from the top of the window.
    pub fn row_mut(&mut self, channel: usize, row: usize) -> &mut [f32] {
        let w = self.width();
        &mut self.plane_mut(channel)[row * w..(row + 1) * w]
    }

    /// Copies the common pixels of this tile and `source`, after shifting `source` by `(dx, dy)` pixels.
    pub fn copy_from(&mut self, source: &Tile, dx: i32, dy: i32) {
        self.copy_part(source, self.window, dx, dy);
    }

    /// Like [`copy_from`](Self::copy_from), only for pixels within `part`.
    pub(super) fn copy_part(&mut self, source: &Tile, part: Window, dx: i32, dy: i32) {
        let (a, b) = (self.window, source.window);
        let (left, right) = (a.x.max(part.x).max(b.x + dx), a.right().min(part.right()).min(b.right() + dx));
        let (top, bottom) = (a.y.max(part.y).max(b.y + dy), a.bottom().min(part.bottom()).min(b.bottom() + dy));
        if left >= right || top >= bottom {
            return;
        }
        let index = |from: i32, to: i32| to.abs_diff(from) as usize;
        let n = index(left, right);
        for channel in 0..self.channels.min(source.channels) {
            for y in top..bottom {
                let from = index(b.x + dx, left);
                let to = index(a.x, left);
                let line = &source.row(channel, index(b.y + dy, y))[from..from + n];
                self.row_mut(channel, index(a.y, y))[to..to + n].copy_from_slice(line);
            }
        }
    }

    /// Copies the pixels, which lie within `whole`, into a pixel-interleaved picture of `whole`.
    pub fn interleave(&self, whole: Window, out: &mut [f32]) {
        let (channels, width) = (self.channels, whole.width as usize);
        let offset = |from: i32, to: i32| to.abs_diff(from) as usize;
        let (left, top) = (offset(whole.x, self.window.x), offset(whole.y, self.window.y));
        for row in 0..self.window.height as usize {
            let start = ((top + row) * width + left) * channels;
            let pixels = &mut out[start..start + self.width() * channels];
            for channel in 0..channels {
                let values = pixels[channel..].iter_mut().step_by(channels);
                values.zip(self.row(channel, row)).for_each(|(to, from)| *to = *from);
            }
        }
    }

    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        self.data.len() * size_of::<f32>() + size_of::<Self>()
    }
}
