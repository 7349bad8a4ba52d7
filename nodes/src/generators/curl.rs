//! [`Curl`]: vectors that flow in eddies.
//!
//! Source: R. Bridson et al., "Curl-noise for procedural fluid flow" (2007): the gradient of a noise, turned by 90°;
//! see [`kernel::curl`](shibo_kernel::noise::curl). Cost: O(pixels · octaves), that of four noises.
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::tile;
use shibo_kernel::noise::curl;
use shibo_kernel::noise::fractal::{Noise, NoiseSpec};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::{Field, Stop, Tiling, Type};

/// Vectors that swirl like an incompressible fluid: material that they carry neither gathers nor thins out anywhere.
///
/// Use them as displacements for `Warp` or as directions for `AlongField`, `Fibers` and `JacobianFromVectors`. On a
/// tiling canvas they repeat. `VectorField(kind: Perpendicular)` makes such vectors from any field.
///
/// ```ron
/// "flow": Curl(size: 14, octaves: 2),
/// "noise": WhiteNoise(size: 0.3),
/// "lines": AlongField(input: "noise", direction: "flow", length: 6),
/// "example": Levels(input: "lines", low: 0.3, high: 0.7),
/// ```
///
/// Elsewhere: Houdini *Curl Noise*; Unreal *Curl Noise Force*.
#[node]
#[derive(PartialEq)]
pub struct Curl {
    /// Size of the largest eddies.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(10.0)]
    pub size: f64,
    /// Number of octaves; each has half the eddy size of the one before.
    #[schemars(range(min = 1, max = 12))]
    #[default(1)]
    pub octaves: u32,
    /// Strength of the noise of each octave compared to the one before: if it is large, vectors turn more often.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.4)]
    pub gain: f64,
    /// RMS length of the vectors.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(1.0)]
    pub amount: f64,
    /// Another seed gives other eddies.
    pub seed: u64,
}

impl Node for Curl {
    const OUTPUTS: &'static [Output] = &[
        Output::new("vector", Type::Vec2, "The vectors; y points down.").in_unit("mm"),
        Output::new("angle", Type::Gray, "Where they point, -180..180, from +x towards +y.").in_unit("°"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let spec = NoiseSpec { gain: self.gain, ..NoiseSpec::fbm(self.size, self.octaves) };
        let noise = Noise::new(&spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(self.seed)));
        let curl = curl::Curl::new(&spec, self.amount);
        let vector = Field::generate(Type::Vec2, cx.tiling(), move |out, _| {
            let frame = tile::frame(out);
            let (x, y) = out.data_mut().split_at_mut(frame.window.len());
            curl.fill(&noise, &frame, x, y);
            Ok(())
        });
        let vector = cx.shared_field("vectors", vector);
        Ok(Outputs::one(vector.clone()).with("angle", vector.to_angle()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::render;

    #[test]
    fn conforms_and_has_the_given_length() {
        for (size, octaves, gain, amount) in
            [(8.0, 1, 0.4, 1.0), (4.0, 4, 1.0, 3.0), (1e5, 12, 0.0, 1e5), (1e-300, 2, 0.5, 1.0)]
        {
            conforms(&Curl { size, octaves, gain, amount, seed: 1 }, &[]);
        }
        let tile = render(&Curl { size: 3.0, amount: 2.0, ..Curl::default() }, &[]);
        let squares = tile.data().iter().map(|v| v * v).sum::<f32>() / tile.window.len() as f32;
        assert!((squares.sqrt() / 2.0 - 1.0).abs() < 0.15, "{}", squares.sqrt());
    }

    #[test]
    fn does_not_depend_on_the_resolution() {
        let fine = shibo_value::Canvas { resolution: glam::UVec2::splat(192), ..crate::testing::canvas() };
        let field = crate::testing::field(&Curl { size: 8.0, ..Curl::default() }, &[]);
        let (coarse, fine) =
            (crate::testing::raster(&field, &crate::testing::canvas()), crate::testing::raster(&field, &fine));
        // The centre of a pixel is the centre of the middle one of nine smaller pixels.
        for (x, y) in [(3usize, 9usize), (40, 12), (63, 0)] {
            let (a, b) = (coarse.row(0, y)[x], fine.row(0, 3 * y + 1)[3 * x + 1]);
            assert!((a - b).abs() < 2e-3 * (1.0 + a.abs()), "{a} {b}");
        }
    }
}
