//! [`Dither`]: rounds to few values that look like many.
//!
//! Uses thresholds by place: a blue noise mask (R. Ulichney, "The void-and-cluster method for dither array generation",
//! 1993), 64 pixels wide, or the matrices of B. Bayer (1973). The threshold of a pixel depends on its place on the
//! canvas, so results are the same in every window. Cost: O(pixels), 2 ns per pixel.
use super::quantize::check_range;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::pointwise::steps::{self, DitherPattern, Steps};
use shibo_node::{AnyField, CanvasFacts, Context, In, Linear, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile};

/// Rounds values to few levels but keeps averages over a few pixels: two levels are enough for a picture.
///
/// The pattern belongs to the pixels: another resolution has other dots. On a tiling canvas the pattern repeats; it is
/// seamless if the picture's sides are multiples of 64 pixels.
///
/// ```ron
/// "clouds": Fractal(size: 20, octaves: 3),
/// "wide": Levels(input: "clouds", low: 0.25, high: 0.75),
/// "example": Dither(input: "wide", levels: 2),
/// ```
///
/// Elsewhere: Material Maker *Dither*.
#[node]
pub struct Dither {
    /// Field to round.
    pub input: In<AnyField>,
    /// Number of levels, both ends of `range` included.
    #[schemars(range(min = 2, max = 65536))]
    #[default(2)]
    pub levels: u32,
    /// Lowest and highest level; values beyond are clamped.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Linear::new(0.0, 1.0))]
    pub range: Linear,
    /// Pattern of thresholds, which decide where values are rounded up or down.
    #[default(DitherPattern::BlueNoise)]
    pub pattern: DitherPattern,
    /// Strength: 0 rounds to the nearest level, 1 keeps averages.
    #[schemars(range(min = 0, max = 1))]
    #[default(1.0)]
    pub amount: f64,
    /// True for a separate pattern for each channel of a colour, which hides the dots better.
    #[default(true)]
    pub separate: bool,
}

impl Node for Dither {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input with few values.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        check_range(self.range)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let spec = Steps { range: [narrow(self.range.at0), narrow(self.range.at1)], levels: self.levels };
        let (pattern, amount, separate) = (self.pattern, narrow(self.amount), self.separate);
        let (size, tiling) = (cx.size_mm(), cx.tiling().and(input.tiling()));
        let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
            let frame = tile::frame(out);
            #[expect(clippy::cast_possible_truncation, reason = "pixels of a canvas")]
            let pixels = (size / out.grid.step).round().to_array().map(|n| n.clamp(1.0, 1e9) as i32);
            let period = [tiling.x.then_some(pixels[0]), tiling.y.then_some(pixels[1])];
            for (k, out) in (0..).zip(out.planes_mut()) {
                let channel = if separate { k } else { 0 };
                let plane = input.plane(usize::try_from(k).unwrap_or(0));
                steps::dither(plane, &frame, period, (&spec, pattern, amount), channel, out);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(input.ty(), [input], Halo::NONE, fill)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray, rgb};
    use crate::testing::{port, render};
    use shibo_value::Type;

    #[test]
    fn dots_average_to_the_value() {
        for pattern in [DitherPattern::BlueNoise, DitherPattern::Bayer2, DitherPattern::Bayer4, DitherPattern::Bayer8] {
            let node = Dither { input: port(0), pattern, ..Dither::default() };
            conforms(&node, &[gray().into()]);
            conforms(&node, &[rgb().into()]);
            let out = render(&node, &[Field::constant(Type::Gray, &[0.25]).into()]);
            assert!(out.data().iter().all(|v| *v == 0.0 || *v == 1.0));
            let mean = out.data().iter().sum::<f32>() / 4096.0;
            assert!((mean - 0.25).abs() < 0.001, "{pattern:?}: {mean}");
        }
    }
}
