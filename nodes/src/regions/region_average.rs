//! [`RegionAverage`]: the mean over every piece.
//!
//! Sums over the whole picture at the resolution of the output. Cost: O(pixels).
use super::per_piece::{PerPiece, of_pieces};
use glam::{DVec2, UVec2};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::region::axes::Picture;
use shibo_kernel::region::pieces::Pieces;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, IdsField, In, Node, Output, Outputs, node};
use shibo_value::{Stop, Tile};

/// Gives each piece the mean of a field over it: mosaics, stained glass, one height for each stone of a relief.
///
/// A whole-picture operation. The result repeats in the directions in which both the numbers and the input repeat.
///
/// ```ron
/// "clouds": Fractal(size: 14, octaves: 5),
/// "sky": GradientMap(input: "clouds", stops: [(0.25, "#2a3a5c"), (0.5, "#c98f5a"), (0.75, "#f4e2b8")]),
/// "cells": Worley(size: 2),
/// "example": RegionAverage(input: "sky", ids: "cells.ids"),
/// ```
///
/// Elsewhere: Substance Designer *Flood Fill to Grayscale/Color*; Material Maker *Fill to Color*; Blender *Field
/// Average*; Houdini *Attribute Promote*.
#[node]
pub struct RegionAverage {
    /// Field to average.
    pub input: In<AnyField>,
    /// The numbers of the pieces.
    pub ids: In<IdsField>,
}

/// The means of up to three channels over each piece.
fn means(picture: &Picture<'_>, pieces: &Pieces, input: Option<&Tile>) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0_f64; 3]; pieces.ids.len()];
    let Some(input) = input else { return Vec::new() };
    pieces.each(picture.ids, picture.width, |piece, y, from, to| {
        for (channel, sum) in (0..input.channels()).zip(&mut sums[piece]) {
            *sum += input.row(channel, y)[from..to].iter().map(|v| f64::from(*v)).sum::<f64>();
        }
    });
    let mean = |(sum, area): (&[f64; 3], &u64)| sum.map(|sum| narrow(sum / (*area).max(1) as f64));
    sums.iter().zip(&pieces.area).map(mean).collect()
}

impl Node for RegionAverage {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The mean over the piece.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn whole_bytes(&self, pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        of_pieces(pixels, 2)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, ids) = (cx.get(&self.input)?, cx.get(&self.ids)?);
        let ty = input.ty();
        let value = |mean: &[f32; 3], _: DVec2| *mean;
        let per_piece = PerPiece { ids, input: Some(input), size: cx.size_mm(), measure: means, value };
        Ok(Outputs::one(per_piece.field(ty)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::stand_in::slabs;
    use super::*;
    use crate::conform::{conforms, gray, pairs, rgb};
    use crate::testing::{field, port};

    #[test]
    fn means_are_those_of_the_pieces() {
        let node = RegionAverage { input: port(0), ids: port(1) };
        conforms(&node, &[rgb().into(), slabs().into()]);
        let made = field(&node, &[gray().into(), slabs().into()]);
        let ids = pairs(&slabs(), &made);
        let inputs = pairs(&slabs(), &gray());
        for id in [0.0, 1.0, 2.0, 3.0] {
            let values: Vec<f32> = inputs.iter().filter(|(own, _)| *own == id).map(|(_, v)| *v).collect();
            let mean = values.iter().sum::<f32>() / values.len() as f32;
            assert!(ids.iter().filter(|(own, _)| *own == id).all(|(_, v)| (v - mean).abs() < 1e-5), "{id}");
        }
    }
}
