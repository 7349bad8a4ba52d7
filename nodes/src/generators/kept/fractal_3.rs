//! Version 3 of [`Fractal`](crate::generators::Fractal), for graphs that are pinned before change 21: the octaves of `Fbm`
//! have parallel grids.
use crate::generators::noise_field::{known_angle, noise_along, noise_field, without_aspect};
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Basis, FractalKind, NoiseSpec};
use shibo_node::{CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Stop, Tiling, Type};

/// Clouds, crests, lumps or veins, as they were in version 3.
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
    const VERSION: u32 = 3;
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
            turned: self.kind != FractalKind::Fbm,
        };
        Ok(Outputs::one(match direction {
            Some(direction) => noise_along(cx, &spec, self.seed, direction),
            None => noise_field(cx, &spec, self.seed),
        }))
    }
}
