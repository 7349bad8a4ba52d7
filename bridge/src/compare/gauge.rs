//! Statistics of many pictures at one size, number by number.
use super::plane::{Colors, Plane, flatten, oklab, part, resample, shown};
use super::stats::{Filters, Scale, Stats};
use shibo_picture::Picture;

/// Measures square pictures of one size.
pub struct Gauge {
    side: usize,
    filters: Filters,
    scale: Scale,
}

/// Faults of a photograph that spoil a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uneven {
    /// The share of the variance of the lightness that slow changes of light have.
    pub light: f64,
    /// The share of pixels in which a channel is black or white.
    pub clipped: f64,
    /// The range of the samples: 0 for a picture of one colour.
    pub range: f64,
}

impl Gauge {
    /// The gauge for pictures of `side` pixels; at least 16.
    pub fn new(side: usize) -> Self {
        let side = side.max(16);
        let filters = Filters::of(side, side);
        let flat = || Plane { width: side, height: side, values: vec![0.5; side * side] };
        let scale = Stats::with(&[flat(), flat(), flat()], &filters).scale();
        Self { side, filters, scale }
    }

    /// Pixels of a side.
    pub fn side(&self) -> usize {
        self.side
    }

    /// The usual scale of the numbers, and their blocks.
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    /// The numbers of the square in the middle of a picture. `stretched` takes grey values from the smallest to the largest of the
    /// picture as the range from black to white.
    pub fn numbers(&self, picture: &Picture, stretched: bool) -> Vec<f64> {
        Stats::with(&self.small(&self.square(picture, stretched)), &self.filters).numbers()
    }

    /// The numbers of the left and of the right half of a picture, each made square by its middle. `None` if a half has fewer pixels
    /// than the gauge.
    pub fn halves(&self, picture: &Picture, stretched: bool) -> Option<[Vec<f64>; 2]> {
        let colors = self.square(picture, stretched);
        let (side, half) = (colors[0].width, colors[0].width / 2);
        // Halves are compared at the size of pixels of the whole.
        let small = self.side / 2;
        if half < 64 || small < 32 {
            return None;
        }
        let filters = Filters::of(small, small);
        let of = |x: usize| {
            let square = part(&colors, [x, (side - half) / 2], [half, half]);
            Stats::with(&resample(&square, small), &filters).numbers()
        };
        Some([of(0), of(side - half)])
    }

    /// The scale of [`halves`](Self::halves).
    pub fn scale_of_halves(&self) -> Scale {
        let small = (self.side / 2).max(16);
        Self::new(small).scale
    }

    /// The faults of a photograph.
    pub fn uneven(&self, picture: &Picture) -> Uneven {
        let colors = self.small(&self.square(picture, false));
        let lightness = &oklab(&colors)[0];
        let (all, fast) = (lightness.deviation(), flatten(lightness).deviation());
        let light = if all > 1e-6 { 1.0 - fast * fast / (all * all) } else { 0.0 };
        let source = shown(picture);
        let count = source[0].values.len();
        let extreme = |at: &usize| {
            let values = [0, 1, 2].map(|channel: usize| source[channel].values[*at]);
            values.iter().any(|value| *value >= 0.998) || values.iter().all(|value| *value <= 0.002)
        };
        let clipped = (0..count).filter(extreme).count() as f64 / count.max(1) as f64;
        let (low, high) = extremes(&source);
        Uneven { light, clipped, range: high - low }
    }

    fn square(&self, picture: &Picture, stretched: bool) -> Colors {
        let mut colors = shown(picture);
        if stretched {
            let (low, high) = extremes(&colors);
            let width = (high - low).max(1e-9);
            colors.iter_mut().flat_map(|plane| &mut plane.values).for_each(|value| *value = (*value - low) / width);
        }
        let (width, height) = (colors[0].width, colors[0].height);
        let side = width.min(height);
        part(&colors, [(width - side) / 2, (height - side) / 2], [side, side])
    }

    fn small(&self, colors: &Colors) -> Colors {
        resample(colors, self.side)
    }
}

/// The smallest and the largest value of all channels.
fn extremes(colors: &Colors) -> (f64, f64) {
    colors
        .iter()
        .flat_map(|plane| &plane.values)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)))
}
