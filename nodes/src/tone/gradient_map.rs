//! [`GradientMap`]: colour from a number.
//!
//! Mixing in Oklab (B. Ottosson, "A perceptual color space for image processing", 2020) gives perceptually even ramps.
//! The ramp is computed without a table: exact at its stops. Cost: O(pixels · stops).
use crate::anywhere::{pointwise, rgb_mut};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::tone::{self as kernel, Interpolation};
use shibo_node::{CanvasFacts, Color, Context, Fact, In, Node, Number, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Planes, Stop, Type};

/// Colour space in which colours are mixed.
#[choice]
pub enum MixSpace {
    /// Oklab: perceptually even steps.
    #[default]
    Oklab,
    /// Linear light, as lights mix: brighter in the middle.
    Linear,
}

/// Colours a field or a solid: each number becomes the colour of a ramp at that number.
///
/// ```ron
/// "clouds": Fractal(size: 14, kind: Ridged),
/// "wide": Levels(input: "clouds", low: 0.1, high: 0.9),
/// "example": GradientMap(input: "wide", stops: [(0.0, "#1d1430"), (0.45, "#8a3b4a"), (0.75, "#e08a4a"), (1.0, "#fff1c9")]),
/// ```
///
/// ```ron
/// "clouds": SolidNoise(size: 14, octaves: 5),
/// "stone": GradientMap(input: "clouds", stops: [(0.2, "#3a2f2a"), (0.5, "#b9a58c"), (0.8, "#f2e9d8")]),
/// "cut": CutPlane(solid: "stone"),
/// ```
///
/// Elsewhere: Blender *ColorRamp*; Substance Designer *Gradient Map*; Houdini *Ramp*; Material Maker *Colorize*;
/// Photoshop *Gradient Map*.
#[node]
pub struct GradientMap {
    /// The numbers to colour.
    pub input: In<Number>,
    /// Stops of the ramp, `[(0.0, "#rrggbb"), …]`, ascending; 1 to 64 stops. Two stops at the same place make a hard
    /// edge. Before the first and after the last stop the colour is constant.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default([(0.0, [31, 18, 11]), (0.5, [138, 83, 48]), (1.0, [236, 209, 168])].map(|(at, rgb)| (at, Color::srgb(rgb))).into())]
    pub stops: Vec<(f64, Color)>,
    /// Interpolation between stops.
    #[default(Interpolation::Linear)]
    pub interpolation: Interpolation,
    /// Colour space in which colours are mixed.
    #[default(MixSpace::Oklab)]
    pub space: MixSpace,
}

/// Maximum number of stops.
const MOST: usize = 64;

impl Node for GradientMap {
    const OUTPUTS: &'static [Output] = &[Output::color_of("color", &["input"], "The colours, scene-linear.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let problem = |code, message: String| Problem::new(code, message).at("stops");
        match self.stops.len() {
            0 => return vec![problem(Code::BadValue, "stops is empty; there must be at least one stop".to_owned())],
            n if n > MOST => {
                return vec![problem(Code::TooLarge, format!("stops has {n} entries; at most {MOST} are allowed"))];
            }
            _ => {}
        }
        let falls = |pair: &[(f64, Color)]| pair[1].0 < pair[0].0;
        let Some(i) = self.stops.windows(2).position(falls) else { return Vec::new() };
        let (before, at) = (self.stops[i].0, self.stops[i + 1].0);
        let message = format!("stop {} is at `{at}`; it must not lie before stop {}, at `{before}`", i + 2, i + 1);
        vec![problem(Code::BadValue, message).help("list the stops in ascending order")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let stops: Vec<_> = self.stops.iter().map(|(at, color)| (narrow(*at), color.0)).collect();
        let ramp = kernel::Gradient::new(&stops, self.interpolation, self.space == MixSpace::Oklab);
        let fill = move |out: &mut [&mut [f32]], [input]: [Planes<'_>; 1]| {
            if let Some(out) = rgb_mut(out) {
                ramp.apply(input.plane(0), out);
            }
        };
        Ok(Outputs::one(pointwise(Type::Rgb, [(cx.get(&self.input)?, "input")], fill)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, port};

    const RED: Color = Color([1.0, 0.0, 0.0]);
    const BLUE: Color = Color([0.0, 0.0, 1.0]);

    fn map(stops: Vec<(f64, Color)>) -> GradientMap {
        GradientMap { input: port(0), stops, space: MixSpace::Linear, ..GradientMap::default() }
    }

    #[test]
    fn colours_follow_the_ramp() {
        let map = map(vec![(0.0, RED), (1.0, BLUE)]);
        conforms(&map, &[gray().into()]);
        let (values, colors) = (gray(), field(&map, &[gray().into()], "color"));
        let (values, colors) = (part(&values, &canvas(), 0, 0, 64, 64), part(&colors, &canvas(), 0, 0, 64, 64));
        for (k, x) in values.data().iter().enumerate() {
            let t = x.clamp(0.0, 1.0);
            let color = [0, 1, 2].map(|c| colors.plane(c)[k]);
            assert!((color[0] - (1.0 - t)).abs() < 1e-6 && color[1] == 0.0 && (color[2] - t).abs() < 1e-6);
        }
    }

    #[test]
    fn conforms_in_every_way() {
        for interpolation in [Interpolation::Linear, Interpolation::Smooth, Interpolation::Constant] {
            for space in [MixSpace::Oklab, MixSpace::Linear] {
                let edge = vec![(0.2, RED), (0.5, BLUE), (0.5, RED), (1e9, BLUE)];
                conforms(&GradientMap { interpolation, space, ..map(edge) }, &[gray().into()]);
            }
        }
        conforms(&map(vec![(0.3, BLUE)]), &[gray().into()]);
    }

    #[test]
    fn stops_are_checked() {
        let message = |stops| map(stops).check_on(&canvas()).first().map(|p| p.message.clone());
        assert_eq!(message(vec![]).as_deref(), Some("stops is empty; there must be at least one stop"));
        let fallen = message(vec![(0.0, RED), (0.6, BLUE), (0.4, RED)]);
        assert_eq!(fallen.as_deref(), Some("stop 3 is at `0.4`; it must not lie before stop 2, at `0.6`"));
        assert!(message(vec![(0.0, RED); 65]).is_some());
        assert!(message(vec![(0.0, RED); 64]).is_none());
    }
}
