//! The samples of a height field, with the rims of its canvas.
use rayon::prelude::*;
use std::fmt;
use std::io;
use std::ops::Range;

/// The largest number of intervals between samples on a side of a block.
pub(super) const BLOCK: usize = 64;

/// Number of samples that are held at once.
const HELD: usize = 1 << 21;

/// The pixels of a canvas, row by row, in memory or elsewhere.
pub trait Rows: fmt::Debug + Send + Sync {
    /// Reads heights in mm, from pixel `from` on. Pixels are counted row by row.
    ///
    /// # Errors
    /// The place where they are kept cannot be read.
    fn read(&self, from: usize, to: &mut [f32]) -> io::Result<()>;
}

impl Rows for Vec<f32> {
    fn read(&self, from: usize, to: &mut [f32]) -> io::Result<()> {
        let pixels = self.get(from..from + to.len()).ok_or(io::ErrorKind::UnexpectedEof)?;
        to.copy_from_slice(pixels);
        Ok(())
    }
}

/// Samples of a height field in mm, in rows from the top of the picture. The field is bilinear between samples. They are
/// read from [`Rows`] a few rows at a time.
///
/// Positions count half steps between pixel centres, so that the rim of a canvas, which lies half a step beyond the
/// last pixel centre, has a whole number too.
#[derive(Clone, Debug)]
pub struct Heights<'a> {
    pub(super) pixels: &'a dyn Rows,
    /// Number of pixels in each direction.
    pub(super) count: [usize; 2],
    /// True if the canvas is closed from left to right.
    round: bool,
    /// Position of each column in half steps, from 0, rising.
    pub(super) across: Vec<i32>,
    /// Position of each row in half steps, from 0, rising.
    pub(super) down: Vec<i32>,
    /// The length of a half step in each direction, in mm.
    pub(super) half_mm: [f64; 2],
    /// True if the first and the last column (the first and the last row) are the same line of the field, so that both
    /// must get the same vertices.
    pub(super) repeats: [bool; 2],
    /// Number of columns for a pixel.
    finer: usize,
    extent: (f32, f32, [usize; 2]),
    steepest: f64,
    /// The most samples that are held at once.
    held: usize,
}

/// Some rows of samples in memory.
#[derive(Clone, Debug)]
pub(super) struct Band {
    values: Vec<f32>,
    columns: usize,
    top: usize,
}

impl Band {
    /// A row of samples; `row` counts from the top of the field.
    #[inline]
    pub(super) fn row(&self, row: usize) -> &[f32] {
        let from = (row - self.top) * self.columns;
        &self.values[from..from + self.columns]
    }
}

impl<'a> Heights<'a> {
    /// The heights of a canvas of `width` × `height` pixels and their rims. `pixel_mm` is the size of a pixel. In a
    /// direction that `repeats`, a sample on the rim is the mean of the two pixels that meet there; elsewhere it is the
    /// nearest pixel.
    ///
    /// # Errors
    /// Those of the rows.
    ///
    /// # Panics
    /// If a side has no pixel.
    pub fn of_canvas(
        pixels: &'a dyn Rows,
        [width, height]: [usize; 2],
        pixel_mm: [f64; 2],
        repeats: [bool; 2],
    ) -> io::Result<Self> {
        assert!(width > 0 && height > 0, "a canvas has pixels");
        Self {
            pixels,
            count: [width, height],
            round: false,
            across: with_rims(width),
            down: with_rims(height),
            half_mm: pixel_mm.map(|mm| 0.5 * mm),
            repeats,
            finer: 1,
            extent: (0.0, 0.0, [0; 2]),
            steepest: 0.0,
            held: HELD,
        }
        .surveyed()
    }

    /// The heights of a canvas that is closed from left to right. The last column is the first one once more, `width`
    /// pixels farther. Each column is repeated `finer` times, with heights interpolated between its neighbours, which
    /// leaves the field as it is. Rows are as in [`of_canvas`](Self::of_canvas); `repeats` is their direction.
    ///
    /// # Errors
    /// Those of the rows.
    ///
    /// # Panics
    /// If a side has no pixel, or `finer` is 0.
    pub fn round(
        pixels: &'a dyn Rows,
        [width, height]: [usize; 2],
        pixel_mm: [f64; 2],
        repeats: bool,
        finer: usize,
    ) -> io::Result<Self> {
        assert!(width > 0 && height > 0 && finer > 0, "a canvas has pixels, and columns are not left out");
        Self {
            pixels,
            count: [width, height],
            round: true,
            across: (0..=width * finer).map(|x| whole(2 * x)).collect(),
            down: with_rims(height),
            half_mm: [0.5 * pixel_mm[0] / finer as f64, 0.5 * pixel_mm[1]],
            repeats: [true, repeats],
            finer,
            extent: (0.0, 0.0, [0; 2]),
            steepest: 0.0,
            held: HELD,
        }
        .surveyed()
    }

    /// The same heights, with fewer samples at once.
    #[cfg(test)]
    pub(super) fn holding(self, samples: usize) -> Self {
        Self { held: samples, ..self }.surveyed().unwrap()
    }

    /// Number of columns and rows of samples, rims included.
    pub fn size(&self) -> [usize; 2] {
        [self.across.len(), self.down.len()]
    }

    /// Number of columns for a pixel.
    pub fn finer(&self) -> usize {
        self.finer
    }

    /// The position of a sample in mm from the left and from the top.
    pub fn place(&self, column: usize, row: usize) -> [f64; 2] {
        [f64::from(self.across[column]) * self.half_mm[0], f64::from(self.down[row]) * self.half_mm[1]]
    }

    /// The sample in the centre of a pixel: column and row.
    pub fn of_pixel(&self, [x, y]: [usize; 2]) -> [usize; 2] {
        [if self.round { x * self.finer } else { x + 1 }, y + 1]
    }

    /// The size of a pixel in mm.
    pub fn pixel_mm(&self) -> [f64; 2] {
        [2.0 * self.half_mm[0] * self.finer as f64, 2.0 * self.half_mm[1]]
    }

    /// Width and height in mm.
    pub fn size_mm(&self) -> [f64; 2] {
        self.place(self.across.len() - 1, self.down.len() - 1)
    }

    /// The least and the greatest height, and the place of the least one: column and row.
    pub fn extent(&self) -> (f32, f32, [usize; 2]) {
        self.extent
    }

    /// The steepest step between neighbouring samples of a row or a column, as a ratio of lengths.
    pub fn steepest(&self) -> f64 {
        self.steepest
    }

    /// The samples of some rows, `bottom` included.
    pub(super) fn band(&self, top: usize, bottom: usize) -> io::Result<Band> {
        let (columns, [width, height]) = (self.across.len(), self.count);
        let mut values = vec![0.0_f32; columns * (bottom + 1 - top)];
        // The first and the last row of samples are rims; the others are rows of pixels.
        let (first, last) = (top.max(1), bottom.min(height));
        if first <= last {
            let mut pixels = vec![0.0_f32; width * (last + 1 - first)];
            self.pixels.read((first - 1) * width, &mut pixels)?;
            let to = values[(first - top) * columns..].par_chunks_mut(columns);
            to.zip(pixels.par_chunks(width)).for_each(|(to, pixels)| self.line(pixels, to));
        }
        if top == 0 || bottom > height {
            let [above, below] = self.rims()?;
            if top == 0 {
                values[..columns].copy_from_slice(&above);
            }
            if bottom > height {
                let from = values.len() - columns;
                values[from..].copy_from_slice(&below);
            }
        }
        Ok(Band { values, columns, top })
    }

    /// A line of samples of a line of pixels.
    fn line(&self, pixels: &[f32], to: &mut [f32]) {
        let width = pixels.len();
        if !self.round {
            [to[0], to[width + 1]] = rim(pixels[0], pixels[width - 1], self.repeats[0]);
            to[1..=width].copy_from_slice(pixels);
            return;
        }
        if self.finer == 1 {
            to[..width].copy_from_slice(pixels);
            to[width] = pixels[0];
            return;
        }
        for (x, to) in to.iter_mut().enumerate() {
            let (low, part) = (x / self.finer % width, x % self.finer);
            let (a, b) = (f64::from(pixels[low]), f64::from(pixels[(low + 1) % width]));
            *to = single(a + (b - a) * (part as f64 / self.finer as f64));
        }
    }

    /// The rows of samples on the upper and on the lower rim.
    fn rims(&self) -> io::Result<[Vec<f32>; 2]> {
        let [width, height] = self.count;
        let mut rows = [0, height - 1].map(|row| (row, vec![0.0_f32; width]));
        for (row, pixels) in &mut rows {
            self.pixels.read(*row * width, pixels)?;
        }
        let [above, below] = rows.map(|(_, pixels)| pixels);
        let means = |above: &mut [f32], below: &mut [f32]| {
            above.iter_mut().zip(below).for_each(|(a, b)| [*a, *b] = rim(*a, *b, self.repeats[1]));
        };
        let lines = |rows: [&[f32]; 2]| {
            rows.map(|pixels| {
                let mut line = vec![0.0; self.across.len()];
                self.line(pixels, &mut line);
                line
            })
        };
        if self.round {
            let (mut above, mut below) = (above, below);
            means(&mut above, &mut below);
            return Ok(lines([&above, &below]));
        }
        let [mut above, mut below] = lines([&above, &below]);
        means(&mut above, &mut below);
        Ok([above, below])
    }

    /// The end of the rows of blocks that are held at once, from row `from` of blocks on, at least one row of blocks.
    /// `cuts` are the rows of samples at which blocks meet.
    pub(super) fn part(&self, cuts: &[usize], from: usize) -> usize {
        let most = (self.held / self.across.len()).max(1);
        let fits = cuts[from..].iter().skip(1).take_while(|cut| **cut - cuts[from] <= most).count();
        from + fits.max(1)
    }

    /// The rows of blocks in parts that are held at once; `cuts` as for [`part`](Self::part).
    pub(super) fn parts(&self, cuts: &[usize]) -> Vec<Range<usize>> {
        let (mut parts, mut from) = (Vec::new(), 0);
        while from + 1 < cuts.len() {
            let to = self.part(cuts, from);
            parts.push(from..to);
            from = to;
        }
        parts
    }

    /// Finds the extent and the steepest step.
    fn surveyed(mut self) -> io::Result<Self> {
        let rows = self.down.len();
        let most = (self.held / self.across.len()).max(1);
        let (mut least, mut greatest, mut at) = (f32::INFINITY, f32::NEG_INFINITY, [0; 2]);
        for top in (0..rows).step_by(most) {
            let end = (top + most).min(rows);
            let band = self.band(top, end.min(rows - 1))?;
            let of = |y: usize| (extremes(band.row(y)), self.steps(&band, y, y < end.min(rows - 1)));
            let found: Vec<_> = (top..end).into_par_iter().map(of).collect();
            for (y, ((low, column, high), steep)) in (top..end).zip(found) {
                if low < least {
                    (least, at) = (low, [column, y]);
                }
                greatest = greatest.max(high);
                self.steepest = self.steepest.max(steep);
            }
        }
        self.extent = (least, greatest, at);
        Ok(self)
    }

    /// The steepest step along a row, and to the next row if there is one.
    fn steps(&self, band: &Band, y: usize, has_next: bool) -> f64 {
        let row = band.row(y);
        let mut most = 0.0_f64;
        for (x, pair) in row.windows(2).enumerate() {
            let run = f64::from(self.across[x + 1] - self.across[x]) * self.half_mm[0];
            most = most.max(f64::from((pair[1] - pair[0]).abs()) / run);
        }
        if has_next {
            let run = f64::from(self.down[y + 1] - self.down[y]) * self.half_mm[1];
            let step = row.iter().zip(band.row(y + 1)).map(|(a, b)| (b - a).abs()).fold(0.0, f32::max);
            most = most.max(f64::from(step) / run);
        }
        most
    }
}

/// The least height of a row, its column, and the greatest height.
fn extremes(row: &[f32]) -> (f32, usize, f32) {
    let (mut least, mut at, mut greatest) = (f32::INFINITY, 0, f32::NEG_INFINITY);
    for (x, value) in row.iter().enumerate() {
        if *value < least {
            (least, at) = (*value, x);
        }
        greatest = greatest.max(*value);
    }
    (least, at, greatest)
}

/// The samples on both rims of a line of pixels.
fn rim(first: f32, last: f32, repeats: bool) -> [f32; 2] {
    // Halves before the sum, which could overflow.
    if repeats { [0.5 * first + 0.5 * last; 2] } else { [first, last] }
}

/// Positions of the pixel centres of a line, with both rims, in half steps.
fn with_rims(pixels: usize) -> Vec<i32> {
    let centres = (0..pixels).map(|x| whole(2 * x + 1));
    [0].into_iter().chain(centres).chain([whole(2 * pixels)]).collect()
}

/// A number as `i32`; positions are far below its limit.
pub(super) fn whole(number: usize) -> i32 {
    i32::try_from(number).unwrap_or(i32::MAX)
}

/// The nearest `f32`.
#[expect(clippy::cast_possible_truncation, reason = "rounds to the nearest number, as is meant")]
pub(super) const fn single(value: f64) -> f32 {
    value as f32
}

/// Divides `intervals` between samples into blocks of at most `most` intervals, as even as possible. Returns the index
/// of the sample at each end of a block.
pub(super) fn cuts(intervals: usize, most: usize) -> Vec<usize> {
    let count = intervals.div_ceil(most).max(1);
    (0..=count).map(|block| block * intervals / count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rims_are_means_with_equal_bits_where_the_canvas_repeats() {
        let values: Vec<f32> = (0..12).map(|n| (n as f32 * 1.7).sin()).collect();
        let heights = Heights::of_canvas(&values, [4, 3], [0.5, 0.25], [true, true]).unwrap();
        let band = heights.band(0, 4).unwrap();
        let at = |x: usize, y: usize| band.row(y)[x];
        assert_eq!(heights.size(), [6, 5]);
        for y in 0..5 {
            assert_eq!(at(0, y).to_bits(), at(5, y).to_bits());
        }
        for x in 0..6 {
            assert_eq!(at(x, 0).to_bits(), at(x, 4).to_bits());
        }
        assert_eq!(at(0, 2), 0.5 * (values[4] + values[7]));
        assert_eq!(heights.size_mm(), [2.0, 0.75]);
        assert_eq!(heights.place(1, 1), [0.25, 0.125]);
        let open = Heights::of_canvas(&values, [4, 3], [0.5, 0.25], [false, false]).unwrap();
        let band = open.band(0, 2).unwrap();
        assert_eq!((band.row(2)[0], band.row(0)[5]), (values[4], values[3]));
        let part = heights.band(2, 3).unwrap();
        assert_eq!((part.row(2)[3], part.row(3)[0].to_bits()), (values[6], at(0, 3).to_bits()));
    }

    #[test]
    fn finer_columns_keep_the_field() {
        let pixels = vec![0.0, 1.0, 4.0];
        let heights = Heights::round(&pixels, [3, 1], [2.0, 2.0], false, 2).unwrap();
        assert_eq!(heights.band(1, 1).unwrap().row(1), [0.0, 0.5, 1.0, 2.5, 4.0, 2.0, 0.0]);
        assert_eq!(heights.size_mm(), [6.0, 2.0]);
    }

    #[test]
    fn blocks_are_even_and_small() {
        assert_eq!(cuts(2, 64), [0, 2]);
        assert_eq!(cuts(65, 64), [0, 32, 65]);
        for intervals in 2..400 {
            let cuts = cuts(intervals, 64);
            assert!(cuts.windows(2).all(|pair| (1..=64).contains(&(pair[1] - pair[0]))), "{cuts:?}");
        }
    }
}
