//! [`SolidNoise`]: clouds in space.
//!
//! Source: K. Perlin, "Improving noise" (2002), summed in octaves. Cost: about 4 ns a point and octave.
use super::trees::Triple;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::noise::noise3::{DEVIATION, Noise3, visible};
use shibo_kernel::wood::solids::Code;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, SolidVector, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Stop, Type};

/// Noise in space: clouds with detail of several sizes, 0..1, with mean ½ and standard deviation 0.155, like `Fractal`.
///
/// Detail finer than a pixel fades out.
///
/// ```ron
/// "clouds": SolidNoise(size: 14, octaves: 5, stretch: (1, 1, 4)),
/// "example": CutPlane(solid: "clouds", v: (0, 28, 28)),
/// ```
///
/// Elsewhere: Blender *Noise Texture* (3D); Houdini *Unified Noise*; Substance Designer *3D Perlin Noise*.
#[node]
pub struct SolidNoise {
    /// Other coordinates for the noise, such as those of `FiberSpace`.
    pub place: Option<In<SolidVector>>,
    /// Size of a cloud of the coarsest octave.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(10.0)]
    pub size: f64,
    /// Factors on the size of clouds in x, y and z.
    #[schemars(extend("minimum" = 0.01, "maximum" = 1000.0))]
    #[default((1.0, 1.0, 1.0))]
    pub stretch: Triple,
    /// Number of octaves.
    #[schemars(range(min = 1, max = 16))]
    #[default(4)]
    pub octaves: u32,
    /// Frequency of each octave, as a multiple of that of the one before.
    #[schemars(range(min = 1, max = 16))]
    #[default(2.0)]
    pub lacunarity: f64,
    /// Strength of each octave, as a multiple of that of the one before.
    #[schemars(range(min = 0, max = 2))]
    #[default(0.5)]
    pub gain: f64,
    /// Another seed gives other clouds of the same kind.
    pub seed: u64,
}

impl Node for SolidNoise {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Solid, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let s = self.stretch;
        if [s.0, s.1, s.2].iter().all(|v| v.is_finite() && *v > 0.0) {
            return Vec::new();
        }
        vec![Problem::new(ErrorCode::OutOfRange, "stretch must be three numbers greater than 0").at("stretch")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let place = cx.get_opt(&self.place)?;
        let hash = Hash::new(cx.seed(self.seed));
        let (mut size, mut weight, mut variance) = (self.size, 1.0, 0.0);
        let mut octaves = Vec::new();
        for octave in 0..self.octaves {
            let s = self.stretch;
            let inverse = [s.0, s.1, s.2].map(|s| narrow(1.0 / (s * size)));
            octaves.push((
                Noise3::new(hash, u64::from(octave)),
                inverse,
                narrow(size * s.0.min(s.1).min(s.2)),
                narrow(weight),
            ));
            variance += weight * weight;
            size /= self.lacunarity;
            weight *= self.gain;
        }
        let scale = 0.155 / (DEVIATION * narrow(variance.sqrt()));
        let given = place.is_some();
        let code = Code::of_place(move |patch, inputs, out| {
            let [x, y, z] = if given { [0, 1, 2].map(|c| inputs[0].plane(c)) } else { patch.place };
            out[0].fill(0.5);
            for (noise, [a, b, c], size, weight) in &octaves {
                let weight = weight * scale * visible(*size, patch.pixel);
                // There are no cells beyond the range of the hash.
                if weight > 0.0 {
                    dispatch(
                        #[inline(always)]
                        || {
                            noise.each([x, y, z], [*a, *b, *c], 0.0, &mut *out[0], |sum, v| sum + weight * v);
                        },
                    );
                }
            }
            out[0].iter_mut().for_each(|v| *v = math::saturate(*v));
        });
        Ok(Outputs::one(code.solid(Type::Solid, place.into_iter().collect())))
    }
}
