//! [`Simplex`]: one octave of simplex noise.
//!
//! Source: K. Perlin, "Noise hardware" (2001), on triangles that repeat with the canvas; see
//! [`kernel::noise`](shibo_kernel::noise::fractal). Cost: O(pixels).
use super::noise_field::one_octave;
use shibo_kernel::noise::fractal::Basis;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Stop, Tiling, Type};

/// Smooth bumps of one size, rounder than those of `Perlin` and without its traces of a grid: simplex noise, 0..1
/// with mean ½.
///
/// On a tiling canvas the noise repeats; size and angle are then rounded, by up to half a bump per canvas side.
/// `Fractal(basis: Simplex)` has octaves.
///
/// ```ron
/// "example": Simplex(size: 5),
/// ```
///
/// Elsewhere: Houdini *Unified Noise* (Simplex); Material Maker *FBM* (Simplex); Unreal *Noise* (Simplex); Godot
/// *FastNoiseLite*.
#[node]
#[derive(PartialEq)]
pub struct Simplex {
    /// Size of a bump, across its long direction.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(5.0)]
    pub size: f64,
    /// Length of bumps along `angle`, as a multiple of their size across it.
    #[schemars(range(min = 0.02, max = 50))]
    #[default(1.0)]
    pub aspect: f64,
    /// Direction of the long side, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Another seed gives another pattern of the same kind.
    pub seed: u64,
}

impl Node for Simplex {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(one_octave(cx, (self.size, self.aspect, self.angle), Basis::Simplex, self.seed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::render;

    #[test]
    fn conforms_and_has_its_statistics() {
        for (size, aspect, angle) in [(2.0, 1.0, 0.0), (1.0, 3.0, 40.0), (1e5, 0.02, -360.0), (1e-300, 50.0, 9.0)] {
            conforms(&Simplex { size, aspect, angle, seed: 1 }, &[]);
        }
        let tile = render(&Simplex { size: 1.5, ..Simplex::default() }, &[]);
        let n = tile.data().len() as f32;
        let mean = tile.data().iter().sum::<f32>() / n;
        let deviation = (tile.data().iter().map(|v| (v - mean).powi(2)).sum::<f32>() / n).sqrt();
        assert!((mean - 0.5).abs() < 0.02 && (deviation - 0.155).abs() < 0.02, "{mean} {deviation}");
    }
}
