//! [`ColorSolid`]: a colour ramp in space. Cost: about 10 ns a point.
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::tone::{Gradient, Interpolation};
use shibo_kernel::wood::solids::Code;
use shibo_node::{CanvasFacts, Color, Context, Fact, In, Node, Output, Outputs, SolidNumber, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Stop, Type};

/// Colours a solid: each number becomes the colour of a ramp, mixed in Oklab.
///
/// ```ron
/// "clouds": SolidNoise(size: 14, octaves: 5),
/// "stone": ColorSolid(solid: "clouds", stops: [(0.2, "#3a2f2a"), (0.5, "#b9a58c"), (0.8, "#f2e9d8")]),
/// "example": CutPlane(solid: "stone"),
/// ```
#[node]
pub struct ColorSolid {
    /// The numbers to colour.
    pub solid: In<SolidNumber>,
    /// Stops of the ramp, `[(0.0, "#rrggbb"), …]`, ascending; 1 to 64 stops.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(vec![(0.0, Color([0.02, 0.01, 0.006])), (1.0, Color([0.8, 0.6, 0.4]))])]
    pub stops: Vec<(f64, Color)>,
}

impl Node for ColorSolid {
    const OUTPUTS: &'static [Output] = &[Output::new("color", Type::SolidColor, "The colours, scene-linear.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let problem = |code, message: &str| vec![Problem::new(code, message).at("stops")];
        if self.stops.is_empty() {
            return problem(ErrorCode::BadValue, "stops is empty; there must be at least one stop");
        }
        if self.stops.len() > 64 {
            return problem(ErrorCode::TooLarge, "stops has more than 64 entries");
        }
        if self.stops.windows(2).any(|pair| pair[1].0 < pair[0].0) {
            return problem(ErrorCode::BadValue, "stops must be listed in ascending order");
        }
        Vec::new()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let stops: Vec<_> = self.stops.iter().map(|(at, color)| (narrow(*at), color.0)).collect();
        let ramp = Gradient::new(&stops, Interpolation::Linear, true);
        let code = Code::of_inputs(move |_, inputs, out| {
            if let [r, g, b] = out {
                ramp.apply(inputs[0].plane(0), [&mut **r, &mut **g, &mut **b]);
            }
        });
        Ok(Outputs::one(code.solid(Type::SolidColor, vec![cx.get(&self.solid)?])))
    }
}
