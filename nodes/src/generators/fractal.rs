//! [`Fractal`]: octaves of noise, each finer and fainter than the one before.
//!
//! Sources: B. Mandelbrot, J. van Ness, "Fractional Brownian motions" (1968); K. Perlin, "An image synthesizer" (1985)
//! for turbulence; F. K. Musgrave in "Texturing and Modeling" (ch. 16) for ridges. Unlike there, every kind is scaled
//! to the same mean and deviation, and each octave repeats with the canvas; see
//! [`kernel::noise`](shibo_kernel::noise::fractal). Cost: O(pixels · octaves), about 3 ns per octave; along a field
//! about 30 ns.
use super::noise_field::{known_angle, noise_along, noise_field, without_aspect};
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Basis, FractalKind, NoiseSpec};
use shibo_node::{CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Stop, Tiling, Type};

/// Clouds, crests, lumps or veins: noise with detail of all sizes, 0..1.
///
/// Mean ½ and standard deviation 0.155 for any number of octaves, so `depth · noise` keeps its depth. Octaves finer
/// than a pixel fade out. On a tiling canvas the noise repeats; size and angle are then rounded, by up to half a bump
/// per canvas side. With `direction`, bumps follow a field: hair, grain around a knot, clouds in a wind.
///
/// ```ron
/// "example": Fractal(size: 14, octaves: 7, kind: Ridged),
/// ```
///
/// Elsewhere: Blender *Noise Texture*, *Musgrave Texture*; Substance Designer *Clouds*, *Fractal Sum*; Material Maker
/// *FBM*, fBm; Houdini *Fractal Noise*.
#[node]
pub struct Fractal {
    /// Direction in which bumps are long, in degrees from +x towards +y or as vectors; `angle` is added. Has an effect
    /// only if `aspect` is not 1, and is sampled eight times per bump of the coarsest octave.
    pub direction: Option<In<Direction>>,
    /// How octaves are folded and summed.
    #[default(FractalKind::Fbm)]
    pub kind: FractalKind,
    /// The noise of each octave.
    #[default(Basis::Gradient)]
    pub basis: Basis,
    /// Size of a bump of the coarsest octave, across its long direction.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(10.0)]
    pub size: f64,
    /// Number of octaves.
    #[schemars(range(min = 1, max = 20))]
    #[default(6)]
    pub octaves: u32,
    /// Frequency of each octave, as a multiple of that of the one before.
    #[schemars(range(min = 1, max = 16))]
    #[default(2.0)]
    pub lacunarity: f64,
    /// Strength of each octave, as a multiple of that of the one before.
    #[schemars(range(min = 0, max = 2))]
    #[default(0.5)]
    pub gain: f64,
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

impl Node for Fractal {
    const VERSION: u32 = 4;
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        without_aspect(self.direction.is_some(), self.aspect)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (known, direction) = known_angle(cx.get_opt(&self.direction)?.filter(|_| self.aspect != 1.0));
        let spec = NoiseSpec {
            shape: CellShape { size: self.size, aspect: self.aspect, angle: (self.angle + known).to_radians() },
            basis: self.basis,
            fractal: self.kind,
            octaves: self.octaves,
            lacunarity: self.lacunarity,
            gain: self.gain,
            turned: true,
        };
        Ok(Outputs::one(match direction {
            Some(direction) => noise_along(cx, &spec, self.seed, direction),
            None => noise_field(cx, &spec, self.seed),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::{OnCanvas as _, canvas, lumps, port, render};
    use shibo_value::Field;

    #[test]
    fn conforms_in_every_kind() {
        for kind in [FractalKind::Fbm, FractalKind::Ridged, FractalKind::Billow, FractalKind::Turbulence] {
            for basis in [Basis::Gradient, Basis::Value, Basis::White, Basis::Simplex] {
                let fractal =
                    Fractal { kind, basis, size: 7.0, octaves: 3, angle: 20.0, aspect: 2.0, ..Fractal::default() };
                conforms(&fractal, &[]);
                let values = render(&fractal, &[]);
                assert!(values.data().iter().all(|v| (0.0..=1.0).contains(v)));
                let mean = values.data().iter().sum::<f32>() / values.data().len() as f32;
                let wanted = if kind == FractalKind::Turbulence { 0.26 } else { 0.5 };
                assert!((mean - wanted).abs() < 0.12, "{kind:?} {basis:?} {mean}");
            }
        }
    }

    #[test]
    fn conforms_along_a_field() {
        for basis in [Basis::Gradient, Basis::Value, Basis::White, Basis::Simplex] {
            let node =
                Fractal { direction: Some(port(0)), basis, size: 4.0, aspect: 3.0, octaves: 3, ..Fractal::default() };
            conforms(&node, &[lumps().into()]);
        }
        for (size, aspect, lacunarity, octaves) in
            [(1e-300, 50.0, 16.0, 3), (1e5, 50.0, 1.0, 3), (1e5, 0.02, 16.0, 20), (1e-3, 0.02, 1.0, 3)]
        {
            let wild = Fractal { direction: Some(port(0)), size, aspect, lacunarity, octaves, ..Fractal::default() };
            conforms(&wild, &[lumps().into()]);
        }
    }

    #[test]
    fn constant_direction_equals_angle() {
        let node = Fractal { aspect: 3.0, angle: 10.0, ..Fractal::default() };
        let along = Fractal { direction: Some(port(0)), ..node.clone() };
        let known = render(&along, &[Field::constant(Type::Gray, &[50.0]).into()]);
        assert_eq!(known, render(&Fractal { angle: 60.0, ..node }, &[]));
        assert_eq!(
            (along.advice_on(&canvas()).len(), Fractal { aspect: 1.0, ..along }.advice_on(&canvas()).len()),
            (0, 1)
        );
    }

    #[test]
    fn extreme_parameters_conform() {
        for (size, aspect, lacunarity, gain) in
            [(1e-300, 50.0, 16.0, 2.0), (1e5, 50.0, 1.0, 0.0), (1e5, 0.02, 16.0, 2.0), (1e-3, 0.02, 1.0, 1.0)]
        {
            conforms(&Fractal { size, aspect, lacunarity, gain, octaves: 20, ..Fractal::default() }, &[]);
        }
    }

    #[test]
    fn seeds_and_kinds_differ() {
        let of = |seed| render(&Fractal { seed, ..Fractal::default() }, &[]);
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
        assert_ne!(of(0), render(&Fractal { kind: FractalKind::Billow, ..Fractal::default() }, &[]));
    }
}
