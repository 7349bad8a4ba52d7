//! [`GuidedFilter`]: smooths areas and keeps edges sharp.
//!
//! Source: K. He, J. Sun, X. Tang, "Guided image filtering" (2010), with Gaussian instead of box means. Around each
//! place the result is a linear function of the guide. Where the guide varies by more than the threshold, the function
//! is steep and edges stay. It does what a bilateral filter does, at a cost that does not depend on the radius:
//! O(pixels), that of four blurs.
use crate::bounds::at_most_half;
use crate::values::LUMINANCE;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::number::narrow;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Key, Stop, Tile, Type};

/// Smooths a field and keeps its edges sharp, as a bilateral filter does. The edges may also come from another field,
/// the guide.
///
/// ```ron
/// "cells": Worley(size: 9),
/// "fine": Fractal(size: 2, octaves: 5),
/// "grain": Remap(input: "fine", to: (-0.15, 0.15)),
/// "noisy": Blend(base: "cells.value", top: "grain", mode: Add),
/// "example": GuidedFilter(input: "noisy", radius: 0.8, threshold: 0.12),
/// ```
///
/// Elsewhere: Blender *Bilateral Blur*.
#[node]
pub struct GuidedFilter {
    /// Field to smooth.
    pub input: In<AnyField>,
    /// Field whose edges stay. If not given, the input, or the luminance of a colour.
    pub guide: Option<In<Gray>>,
    /// Extent of the smoothing: standard deviation σ of the means; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// Differences of the guide that are smaller than this are smoothed; larger ones stay.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0))]
    #[default(0.1)]
    pub threshold: f64,
}

/// The sum of the channels with these weights, and its square.
fn with_square(input: Field) -> Field {
    Field::map(Type::Vec2, [input], Halo::NONE, |out: &mut Tile, [input]: [&Tile; 1]| {
        if input.channels() == 1 {
            out.plane_mut(0).copy_from_slice(input.plane(0));
        } else {
            for (k, weight) in LUMINANCE.into_iter().enumerate() {
                out.plane_mut(0).iter_mut().zip(input.plane(k)).for_each(|(out, v)| *out += weight * v);
            }
        }
        let n = out.window.len();
        let (plane, square) = out.data_mut().split_at_mut(n);
        square.iter_mut().zip(plane).for_each(|(square, v)| *square = *v * *v);
        Ok(())
    })
}

impl Node for GuidedFilter {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, smoothed.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        if input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let (ty, size) = (input.ty(), cx.size_mm());
        // Fields that are read with a halo get a cache key, so that neighbouring tiles share their tiles.
        let part = |name: &str, field: Field| match cx.evaluator.key() {
            Some(key) => field.keyed(Key::of(name, &[key.as_bytes()])).owned_by(key),
            None => field,
        };
        let mean = |name: &str, field: &Field| part(name, fields::blurred(field, self.radius, size));
        let guide = part("guide", with_square(cx.get_opt(&self.guide)?.unwrap_or_else(|| input.clone())));
        let product = Field::map(ty, [input.clone(), guide.clone()], Halo::NONE, |out: &mut Tile, [input, guide]| {
            for (k, out) in out.planes_mut().into_iter().enumerate() {
                let planes = input.plane(k).iter().zip(guide.plane(0));
                out.iter_mut().zip(planes).for_each(|(out, (v, g))| *out = v * g);
            }
            Ok(())
        });
        let means = [
            mean("mean of the guide", &guide),
            mean("mean of the input", &input),
            mean("mean of the product", &part("product", product)),
        ];
        let least = narrow((self.threshold * self.threshold).max(1e-12));
        let slope = Field::map(ty, means.clone(), Halo::NONE, move |out: &mut Tile, [guide, input, product]| {
            for (k, out) in out.planes_mut().into_iter().enumerate() {
                for (i, out) in out.iter_mut().enumerate() {
                    let (mean, square) = (guide.plane(0)[i], guide.plane(1)[i]);
                    let variance = (square - mean * mean).max(0.0);
                    *out = (product.plane(k)[i] - input.plane(k)[i] * mean) / (variance + least);
                }
            }
            Ok(())
        });
        let slope = part("slope", slope);
        let [guides, inputs, _] = means;
        let start =
            Field::map(ty, [slope.clone(), guides, inputs], Halo::NONE, |out: &mut Tile, [slope, guide, input]| {
                for (k, out) in out.planes_mut().into_iter().enumerate() {
                    for (i, out) in out.iter_mut().enumerate() {
                        *out = input.plane(k)[i] - slope.plane(k)[i] * guide.plane(0)[i];
                    }
                }
                Ok(())
            });
        let (slopes, starts) = (mean("mean slope", &slope), mean("mean start", &part("start", start)));
        Ok(Outputs::one(Field::map(
            ty,
            [slopes, starts, guide],
            Halo::NONE,
            |out: &mut Tile, [slope, start, guide]| {
                for (k, out) in out.planes_mut().into_iter().enumerate() {
                    for (i, out) in out.iter_mut().enumerate() {
                        *out = slope.plane(k)[i] * guide.plane(0)[i] + start.plane(k)[i];
                    }
                }
                Ok(())
            },
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};
    use shibo_value::Tiling;

    fn node() -> GuidedFilter {
        GuidedFilter { input: port(0), radius: 1.0, threshold: 0.2, ..GuidedFilter::default() }
    }

    /// A step of 1 at 16 mm, and a checkerboard of ±0.05.
    fn noisy_step() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let (x, y) = (window.x + k % width, window.y + k / width);
                *v = f32::from(u8::from(x >= 32)) + if (x + y) % 2 == 0 { 0.05 } else { -0.05 };
            }
            Ok(())
        })
    }

    #[test]
    fn removes_noise_and_keeps_edge() {
        let out = render(&node(), &[noisy_step().into()]);
        for y in 10..50 {
            let row = out.row(0, y);
            assert!((5..20).all(|x| row[x].abs() < 0.01) && (44..60).all(|x| (row[x] - 1.0).abs() < 0.01));
            // A Gaussian of the same width would leave a step of 0.2 here.
            assert!(row[32] - row[31] > 0.7, "{}", row[32] - row[31]);
        }
    }

    #[test]
    fn smooths_edges_missing_in_guide() {
        // The guide has no edge, so that of the input is smoothed as by a Gaussian.
        let flat = Field::constant(Type::Gray, &[0.3]);
        let guided = GuidedFilter { guide: Some(port(1)), ..node() };
        let out = render(&guided, &[noisy_step().into(), flat.into()]);
        assert!(out.row(0, 30)[32] - out.row(0, 30)[31] < 0.25);
        check_field(&field(&guided, &[lumps().to_rgb().into(), lumps().into()]));
    }

    #[test]
    fn holds_in_any_window() {
        for (radius, threshold) in [(1e-9, 1e-300), (0.7, 0.1), (16.0, 1e6)] {
            let node = GuidedFilter { radius, threshold, ..node() };
            check_field(&field(&node, &[lumps().into()]));
            check_field(&field(&node, &[lumps().to_rgb().into()]));
        }
    }
}
