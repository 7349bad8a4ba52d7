//! [`SampleExemplar`]: samples a picture at synthesised coordinates.
//!
//! Source: JP5149288B2 II box 265 and III (rows C13, C27 to C30, C32): values are looked up at the end, from any number
//! of aligned pictures; values between pixels come from magnification, equations (5) and (6). Beyond the source:
//! normals rotated and heights scaled with the Jacobian, area averages where features shrink. Cost: O(pixels).
use super::sampled::Sampled;
use shibo_kernel::synthesis::texels::Fetch;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, JacobianField, Node, Output, Outputs, node};
use shibo_value::{CoordMap, Stop, Tiling};

/// Shows a picture at synthesised coordinates: the exemplar itself, or any other picture that is aligned with it.
///
/// If the output has the pixels of the coordinates, values are those of the picture, without any blur. At higher
/// resolutions the picture is magnified, at lower ones averaged. Where features are rotated, coordinates lie between
/// pixels, and `filter` sets the interpolation. A normal map is rotated by the Jacobian, if connected.
///
/// Coordinates without an exemplar, such as those of `StartCoords` alone, count pixels of `input`: the pixels of the
/// file if it is a picture, otherwise 128x128 pixels over the canvas. `CorrectCoords` and `Synthesize` add the exemplar
/// to coordinates.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "input": GradientMap(input: "cells.border", stops: [(0.0, "#2a1a10"), (0.25, "#8a5a34"), (1.0, "#c99a66")]),
/// "exemplar": Exemplar(input: "input", size: (64, 64)),
/// "coords": Synthesize(exemplar: "exemplar", size: (160, 160)),
/// "example": SampleExemplar(coords: "coords", input: "input"),
/// ```
///
/// Elsewhere: Blender *Image Texture*; Houdini *Color Map*.
#[node]
pub struct SampleExemplar {
    /// The coordinates.
    pub coords: In<CoordMap>,
    /// The picture to show, which covers the same area as the exemplar.
    pub input: In<AnyField>,
    /// The Jacobian of the coordinates; coordinates on a surface contain it. It rotates normals, prevents aliasing of
    /// features that shrink, and is used between pixels, by equation (6) of the source.
    pub jacobian: Option<In<JacobianField>>,
    /// Interpolation between the picture's pixels, where features are rotated or grow.
    pub filter: Fetch,
    /// True for heights that grow with their features: they are divided by √|det J|, and on a surface multiplied by the
    /// size of features there.
    pub scale_heights: bool,
}

impl Node for SampleExemplar {
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The picture at the coordinates.")];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn makes_tile(&self, port: &str) -> bool {
        port == "input"
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let coords = cx.get(&self.coords)?;
        let jacobian = cx.get_opt(&self.jacobian)?;
        let sampled = Sampled::new(cx, coords, input, jacobian, self.filter, self.scale_heights, None)?;
        Ok(Outputs::one(sampled.into_field()))
    }
}
