//! [`WhiteNoise`]: one octave of white noise.
//!
//! A random value in each cell; see [`kernel::noise`](shibo_kernel::noise::fractal). Unlike one octave there, values
//! are distributed uniformly over 0..1. Cost: O(pixels).
use super::noise_field::one_octave;
use crate::values::each;
use shibo_kernel::ground::math::saturate;
use shibo_kernel::noise::fractal::Basis;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Stop, Tiling, Type};

/// Factor from the deviation of all noises, 0.155, to that of the uniform distribution over 0..1, 12^-½.
const SPREAD: f32 = 0.288_675 / 0.155;

/// Grains of one size, each with a random value, uniformly distributed from 0 to 1: sand, film grain, dither.
///
/// Grains have a size in mm, so every resolution shows the same grains; grains smaller than two pixels fade to ½. On a
/// tiling canvas the noise repeats. `Fractal(basis: White)` has octaves.
///
/// ```ron
/// "example": WhiteNoise(size: 1),
/// ```
///
/// Elsewhere: Substance Designer *White Noise*; Blender *White Noise Texture*; Material Maker *Noise*; Houdini
/// *Random*.
#[node]
#[derive(PartialEq)]
pub struct WhiteNoise {
    /// Size of a grain, across its long direction.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub size: f64,
    /// Length of grains along `angle`, as a multiple of their size across it.
    #[schemars(range(min = 0.02, max = 50))]
    #[default(1.0)]
    pub aspect: f64,
    /// Direction of the long side, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Another seed gives another pattern of the same kind.
    pub seed: u64,
}

impl Node for WhiteNoise {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let noise = one_octave(cx, (self.size, self.aspect, self.angle), Basis::White, self.seed);
        Ok(Outputs::one(each(&noise, |v| saturate((v - 0.5) * SPREAD + 0.5))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::render;

    #[test]
    fn conforms_and_is_uniform() {
        for (size, aspect, angle) in [(2.0, 1.0, 0.0), (1.0, 3.0, 40.0), (1e5, 0.02, -360.0), (1e-300, 50.0, 9.0)] {
            conforms(&WhiteNoise { size, aspect, angle, seed: 1 }, &[]);
        }
        // Grains of two pixels: 1024 of them.
        let tile = render(&WhiteNoise { size: 1.0, ..WhiteNoise::default() }, &[]);
        let below = |v: f32| tile.data().iter().filter(|x| **x < v).count() as f32 / tile.data().len() as f32;
        for share in [0.1, 0.25, 0.5, 0.75, 0.9] {
            assert!((below(share) - share).abs() < 0.05, "{share}: {}", below(share));
        }
    }
}
