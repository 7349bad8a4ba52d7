//! The samples of a height field, with the rims of its canvas.
use rayon::prelude::*;

/// The largest number of intervals between samples on a side of a block.
pub(super) const BLOCK: usize = 64;

/// Samples of a height field in mm, in rows from the top of the picture. The field is bilinear between samples.
///
/// Positions count half steps between pixel centres, so that the rim of a canvas, which lies half a step beyond the
/// last pixel centre, has a whole number too.
#[derive(Clone, Debug)]
pub struct Heights {
    /// Heights, row by row.
    pub(super) values: Vec<f32>,
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
}

impl Heights {
    /// The heights of a canvas of `width` × `height` pixels and their rims. `values` holds the pixels row by row;
    /// `pixel_mm` is the size of a pixel. In a direction that `repeats`, a sample on the rim is the mean of the two
    /// pixels that meet there; elsewhere it is the nearest pixel.
    ///
    /// # Panics
    /// If `values` has another length, or a side has no pixel.
    pub fn of_canvas(values: &[f32], [width, height]: [usize; 2], pixel_mm: [f64; 2], repeats: [bool; 2]) -> Self {
        assert!(width > 0 && height > 0 && values.len() == width * height, "the pixels fill the canvas");
        let mut out = vec![0.0_f32; (width + 2) * (height + 2)];
        let row = |to: &mut [f32], of: &dyn Fn(usize) -> f32| {
            let [first, last] = rim(of(0), of(width - 1), repeats[0]);
            (to[0], to[width + 1]) = (first, last);
            to[1..=width].iter_mut().enumerate().for_each(|(x, to)| *to = of(x));
        };
        out.par_chunks_mut(width + 2).enumerate().for_each(|(y, to)| match y {
            // The rows of the rims follow below.
            0 => {}
            y if y == height + 1 => {}
            y => row(to, &|x| values[(y - 1) * width + x]),
        });
        for x in 0..width + 2 {
            let at = |y: usize| y * (width + 2) + x;
            let [first, last] = rim(out[at(1)], out[at(height)], repeats[1]);
            (out[at(0)], out[at(height + 1)]) = (first, last);
        }
        Self {
            values: out,
            across: with_rims(width),
            down: with_rims(height),
            half_mm: pixel_mm.map(|mm| 0.5 * mm),
            repeats,
            finer: 1,
        }
    }

    /// The heights of a canvas that is closed from left to right. The last column is the first one once more, `width`
    /// pixels farther. Each column is repeated `finer` times, with heights interpolated between its neighbours, which
    /// leaves the field as it is. Rows are as in [`of_canvas`](Self::of_canvas); `repeats` is their direction.
    ///
    /// # Panics
    /// If `values` has another length, a side has no pixel, or `finer` is 0.
    pub fn round(values: &[f32], [width, height]: [usize; 2], pixel_mm: [f64; 2], repeats: bool, finer: usize) -> Self {
        assert!(finer > 0, "columns are not left out");
        let wide = width * finer;
        let plain = Self::of_canvas(values, [width, height], pixel_mm, [true, repeats]);
        let mut out = vec![0.0_f32; (wide + 1) * (height + 2)];
        out.par_chunks_mut(wide + 1).zip(plain.values.par_chunks(width + 2)).for_each(|(to, from)| {
            let pixels = &from[1..=width];
            for (x, to) in to.iter_mut().enumerate() {
                let (low, part) = (x / finer % width, x % finer);
                let (a, b) = (f64::from(pixels[low]), f64::from(pixels[(low + 1) % width]));
                *to = single(a + (b - a) * (part as f64 / finer as f64));
            }
        });
        let across = (0..=wide).map(|x| whole(2 * x)).collect();
        let half_mm = [plain.half_mm[0] / finer as f64, plain.half_mm[1]];
        Self { values: out, across, down: plain.down, half_mm, repeats: [true, repeats], finer }
    }

    /// Number of columns and rows of samples, rims included.
    pub fn size(&self) -> [usize; 2] {
        [self.across.len(), self.down.len()]
    }

    /// Number of columns for a pixel.
    pub fn finer(&self) -> usize {
        self.finer
    }

    /// The height of a sample in mm.
    pub fn at(&self, column: usize, row: usize) -> f32 {
        self.values[row * self.across.len() + column]
    }

    /// The position of a sample in mm from the left and from the top.
    pub fn place(&self, column: usize, row: usize) -> [f64; 2] {
        [f64::from(self.across[column]) * self.half_mm[0], f64::from(self.down[row]) * self.half_mm[1]]
    }

    /// Width and height in mm.
    pub fn size_mm(&self) -> [f64; 2] {
        self.place(self.across.len() - 1, self.down.len() - 1)
    }

    /// The least and the greatest height, and the place of the least one: column and row.
    pub fn extent(&self) -> (f32, f32, [usize; 2]) {
        let (mut least, mut greatest, mut at) = (f32::INFINITY, f32::NEG_INFINITY, 0);
        for (index, value) in self.values.iter().enumerate() {
            if *value < least {
                (least, at) = (*value, index);
            }
            greatest = greatest.max(*value);
        }
        (least, greatest, [at % self.across.len(), at / self.across.len()])
    }

    /// The steepest step between neighbouring samples of a row or a column, as a ratio of lengths.
    pub fn steepest(&self) -> f64 {
        let columns = self.across.len();
        let row = |(y, row): (usize, &[f32])| {
            let mut most = 0.0_f64;
            for (x, pair) in row.windows(2).enumerate() {
                let run = f64::from(self.across[x + 1] - self.across[x]) * self.half_mm[0];
                most = most.max(f64::from((pair[1] - pair[0]).abs()) / run);
            }
            if let Some(below) = self.values.get((y + 1) * columns..(y + 2) * columns) {
                let run = f64::from(self.down[y + 1] - self.down[y]) * self.half_mm[1];
                let step = row.iter().zip(below).map(|(a, b)| (b - a).abs()).fold(0.0, f32::max);
                most = most.max(f64::from(step) / run);
            }
            most
        };
        self.values.par_chunks(columns).enumerate().map(row).reduce(|| 0.0, f64::max)
    }
}

/// The samples on both rims of a line of pixels.
fn rim(first: f32, last: f32, repeats: bool) -> [f32; 2] {
    if repeats { [0.5 * (first + last); 2] } else { [first, last] }
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
        let heights = Heights::of_canvas(&values, [4, 3], [0.5, 0.25], [true, true]);
        assert_eq!(heights.size(), [6, 5]);
        for y in 0..5 {
            assert_eq!(heights.at(0, y).to_bits(), heights.at(5, y).to_bits());
        }
        for x in 0..6 {
            assert_eq!(heights.at(x, 0).to_bits(), heights.at(x, 4).to_bits());
        }
        assert_eq!(heights.at(0, 2), 0.5 * (values[4] + values[7]));
        assert_eq!(heights.size_mm(), [2.0, 0.75]);
        assert_eq!(heights.place(1, 1), [0.25, 0.125]);
        let open = Heights::of_canvas(&values, [4, 3], [0.5, 0.25], [false, false]);
        assert_eq!((open.at(0, 2), open.at(5, 0)), (values[4], values[3]));
    }

    #[test]
    fn finer_columns_keep_the_field() {
        let heights = Heights::round(&[0.0, 1.0, 4.0], [3, 1], [2.0, 2.0], false, 2);
        let row: Vec<f32> = (0..7).map(|x| heights.at(x, 1)).collect();
        assert_eq!(row, [0.0, 0.5, 1.0, 2.5, 4.0, 2.0, 0.0]);
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
