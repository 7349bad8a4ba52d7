//! [`Perlin`]: one octave of gradient noise.
//!
//! Source: K. Perlin, "Improving noise" (2002). Unlike there, gradients are uniform in a square, and the noise repeats
//! with the canvas; see [`kernel::noise`](shibo_kernel::noise::fractal). Cost: O(pixels).
use super::noise_field::one_octave;
use shibo_kernel::noise::fractal::Basis;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Stop, Tiling, Type};

/// Smooth bumps of one size: gradient noise, 0..1 with mean ½.
///
/// On a tiling canvas the noise repeats; size and angle are then rounded, by up to half a bump per canvas side.
///
/// ```ron
/// "example": Perlin(size: 5),
/// ```
///
/// Elsewhere: Blender *Noise Texture*; Houdini *Perlin Noise*; Substance Designer *Perlin Noise*; Material Maker
/// *Perlin*.
#[node]
#[derive(PartialEq)]
pub struct Perlin {
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

impl Node for Perlin {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(one_octave(cx, (self.size, self.aspect, self.angle), Basis::Gradient, self.seed)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::render;

    #[test]
    fn stays_within_its_range_and_repeats() {
        let tile = render(&Perlin { size: 4.0, ..Perlin::default() }, &[]);
        assert!(tile.data().iter().all(|v| (0.0..=1.0).contains(v)));
        let mean = tile.data().iter().sum::<f32>() / tile.data().len() as f32;
        assert!((mean - 0.5).abs() < 0.1, "{mean}");
    }
}
