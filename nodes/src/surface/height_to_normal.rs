//! [`HeightToNormal`]: the normal map of a height.
//!
//! n = normalise(-s·∂h/∂x, ∓s·∂h/∂y, 1) with slopes by differences over one pixel on each side. Heights and places are
//! both in mm, so the map shows the same surface at every resolution. Cost: O(pixels), bound by memory.
use crate::on_atlas::normals;
use shibo_kernel::ground::tile;
use shibo_kernel::surface::normal::{self, NormalSpec, SlopeFilter};
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::{Atlas, Field, Halo, Stop, Type};

/// The normal map of a height in mm, stored as ½ + ½n.
///
/// ```ron
/// "cells":   Worley(size: 6),
/// "grooves": Remap(input: "cells.border", from: (0, 0.6), to: (1, 0), clamp: true),
/// "dome":    Pillow(input: "grooves", radius: 2),
/// "example": HeightToNormal(input: "dome"),
/// ```
///
/// Elsewhere: Substance Designer *Normal*; Blender *Bump*; Material Maker *Normal Map*; Houdini *Height to Normal*.
#[node]
pub struct HeightToNormal {
    /// Height in mm.
    pub input: In<Gray>,
    /// Factor on the height: 1 is true to scale, below 0 turns hills into hollows.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(1.0)]
    pub strength: f64,
    /// True if green points up the picture (OpenGL, glTF, Blender), false if down (DirectX).
    #[default(true)]
    pub y_up: bool,
    /// Method of measuring slopes.
    #[default(SlopeFilter::Scharr)]
    pub slope: SlopeFilter,
    /// The atlas on which the height lies. If given, slopes are measured on the surface, also across borders of charts.
    /// This reads the whole picture.
    pub atlas: Option<In<Atlas>>,
}

impl Node for HeightToNormal {
    const OUTPUTS: &'static [Output] = &[Output::new("normal", Type::Normal, "The tangent-space normal.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (strength, y_up, slope) = (self.strength, self.y_up, self.slope);
        if let Some(atlas) = cx.get_opt(&self.atlas)? {
            let spec = NormalSpec { step: [1.0; 2], strength, y_up, encode: true, slope };
            return Ok(Outputs::one(normals(cx.get(&self.input)?, atlas, spec)));
        }
        let inputs = [cx.get(&self.input)?];
        Ok(Outputs::one(Field::map(Type::Normal, inputs, Halo::px(normal::HALO), move |out, [height]| {
            let spec = NormalSpec { step: tile::step(&out.grid), strength, y_up, encode: true, slope };
            normal::normal(&tile::view(height, 0), out.window, &spec, tile::planes3(out));
            Ok(())
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};

    #[test]
    fn normals_have_length_one_and_turn_with_y() {
        let node = HeightToNormal { input: port(0), ..HeightToNormal::default() };
        let inputs = [lumps().into()];
        let (up, down) = (render(&node, &inputs), render(&HeightToNormal { y_up: false, ..node.clone() }, &inputs));
        for k in 0..up.window.len() {
            let n = [0, 1, 2].map(|c| 2.0 * up.plane(c)[k] - 1.0);
            assert!((n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0).abs() < 1e-5 && n[2] > 0.0);
            assert!((up.plane(1)[k] + down.plane(1)[k] - 1.0).abs() < 1e-6);
        }
        for strength in [0.0, 1.0, -1e6, 1e6] {
            for slope in [SlopeFilter::Central, SlopeFilter::Sobel, SlopeFilter::Scharr] {
                check_field(&field(&HeightToNormal { strength, slope, ..node.clone() }, &inputs));
            }
        }
    }
}
