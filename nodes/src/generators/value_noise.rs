//! [`ValueNoise`]: one octave of value noise.
//!
//! A random value at each corner of a cell, interpolated smoothly; see [`kernel::noise`](shibo_kernel::noise::fractal).
//! Cost: O(pixels).
use super::noise_field::one_octave;
use shibo_kernel::noise::fractal::Basis;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Stop, Tiling, Type};

/// Soft blots of random brightness: value noise, 0..1 with mean ½. It looks blockier than `Perlin`, as if painted in
/// squares.
///
/// On a tiling canvas the noise repeats; size and angle are then rounded, by up to half a blot per canvas side.
/// `Fractal(basis: Value)` has octaves.
///
/// ```ron
/// "example": ValueNoise(size: 4),
/// ```
///
/// Elsewhere: Material Maker *FBM* (Value); Unreal *Noise* (Value); Godot *FastNoiseLite* (Value).
#[node]
#[derive(PartialEq)]
pub struct ValueNoise {
    /// Size of a blot, across its long direction.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(5.0)]
    pub size: f64,
    /// Length of blots along `angle`, as a multiple of their size across it.
    #[schemars(range(min = 0.02, max = 50))]
    #[default(1.0)]
    pub aspect: f64,
    /// Direction of the long side, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Another seed gives another pattern of the same kind.
    pub seed: u64,
}

impl Node for ValueNoise {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(one_octave(cx, (self.size, self.aspect, self.angle), Basis::Value, self.seed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::render;

    #[test]
    fn conforms_and_has_its_mean() {
        for (size, aspect, angle) in [(2.0, 1.0, 0.0), (1.0, 3.0, 40.0), (1e5, 0.02, -360.0), (1e-300, 50.0, 9.0)] {
            conforms(&ValueNoise { size, aspect, angle, seed: 1 }, &[]);
        }
        let tile = render(&ValueNoise { size: 1.5, ..ValueNoise::default() }, &[]);
        let mean = tile.data().iter().sum::<f32>() / tile.data().len() as f32;
        assert!((mean - 0.5).abs() < 0.03 && tile.data().iter().all(|v| (0.0..=1.0).contains(v)), "{mean}");
    }
}
