//! [`Curve`]: a tone curve through points.
//!
//! The tool of this name in every picture editor. Smooth curves are monotone cubics (F. Fritsch, R. Carlson, 1980):
//! they do not overshoot their points; see [`kernel::curve`](shibo_kernel::pointwise::curve). Cost: O(pixels · points),
//! eight pixels at a time.
use crate::anywhere::pointwise;
use shibo_kernel::pointwise::curve::{self as kernel, CurveKind};
use shibo_kernel::pointwise::tone;
use shibo_node::{CanvasFacts, Context, Fact, FieldOrSolid, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Planes, Stop};

/// Maps values by a curve through points.
///
/// Before the first and after the last point the curve is constant. Red, green and blue may have separate curves, which
/// are applied before the common one.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "share": Remap(input: "cells.border", from: (0, 3), clamp: true),
/// "example": Curve(input: "share", points: [(0, 0), (0.15, 0.6), (0.4, 0.5), (0.5, 0.9), (1, 1)]),
/// ```
///
/// Elsewhere: Substance Designer *Curve*, Material Maker *Tones*, Blender *RGB Curves*, Houdini *Color Curve*.
#[node]
pub struct Curve {
    /// Field or solid to change; the channels of a colour are changed alike.
    pub input: In<FieldOrSolid>,
    /// Points of the curve, `[(from, to), …]`, 2 to 64, ascending in the first number. Two points at the same place
    /// make a step.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(vec![(0.0, 0.0), (1.0, 1.0)])]
    pub points: Vec<(f64, f64)>,
    /// A curve for red, applied before the common one; none if empty. A field of one channel has no red.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    pub red: Vec<(f64, f64)>,
    /// A curve for green, like `red`.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    pub green: Vec<(f64, f64)>,
    /// A curve for blue, like `red`.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    pub blue: Vec<(f64, f64)>,
    /// Interpolation between points.
    #[default(CurveKind::Smooth)]
    pub interpolation: CurveKind,
    /// True to apply curves to sRGB-encoded values, as picture editors do; false for linear values.
    pub encoded: bool,
}

/// Maximum number of points.
const MOST: usize = 64;

fn check(name: &'static str, points: &[(f64, f64)], may_be_empty: bool) -> Option<Problem> {
    let problem = |code, message: String| Some(Problem::new(code, message).at(name));
    match points.len() {
        0 if may_be_empty => return None,
        n @ 0..=1 => {
            let message = format!("{name} has {n} points; a curve needs at least 2");
            return problem(Code::BadValue, message).map(|p| p.help("write for example `[(0, 0), (1, 1)]`"));
        }
        n if n > MOST => return problem(Code::TooLarge, format!("{name} has {n} points; at most {MOST} are allowed")),
        _ => {}
    }
    let i = points.windows(2).position(|pair| pair[1].0 < pair[0].0)?;
    let (before, at) = (points[i].0, points[i + 1].0);
    let message = format!("point {} is at `{at}`; it must not lie before point {}, at `{before}`", i + 2, i + 1);
    problem(Code::BadValue, message).map(|p| p.help("list the points in ascending order"))
}

impl Node for Curve {
    const OUTPUTS: &'static [Output] = &[Output::value_of("result", &["input"], "The input along the curve.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let single = [("red", &self.red), ("green", &self.green), ("blue", &self.blue)];
        let problems = single.into_iter().filter_map(|(name, points)| check(name, points, true));
        check("points", &self.points, false).into_iter().chain(problems).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let curve = |points: &[(f64, f64)]| kernel::Curve::new(points, self.interpolation);
        let common = curve(&self.points);
        let single = [&self.red, &self.green, &self.blue].map(|points| (!points.is_empty()).then(|| curve(points)));
        let (single, encoded) = (if input.ty().channels() == 3 { single } else { [None, None, None] }, self.encoded);
        let fill = move |out: &mut [&mut [f32]], [input]: [Planes<'_>; 1]| {
            for (k, out) in out.iter_mut().enumerate() {
                let mut plane = vec![0.0; out.len()];
                match encoded {
                    true => tone::encode_srgb(input.plane(k), &mut plane),
                    false => plane.copy_from_slice(input.plane(k)),
                }
                if let Some(Some(own)) = single.get(k) {
                    own.apply(&plane, out);
                    plane.copy_from_slice(out);
                }
                common.apply(&plane, out);
                if encoded {
                    plane.copy_from_slice(out);
                    tone::decode_srgb(&plane, out);
                }
            }
        };
        Ok(Outputs::one(pointwise(input.ty(), [(input, "input")], fill)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs, rgb};
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, port};
    use shibo_value::Field;

    fn curve(points: &[(f64, f64)]) -> Curve {
        let interpolation = CurveKind::Linear;
        Curve { input: port(0), points: points.to_vec(), interpolation, ..Curve::default() }
    }

    #[test]
    fn channels_have_curves_of_their_own() {
        let node = Curve { green: vec![(0.0, 1.0), (1.0, 0.0)], ..curve(&[(0.0, 0.0), (1.0, 3.0)]) };
        conforms(&node, &[rgb().into()]);
        conforms(&node, &[gray().into()]);
        let pairs = pairs(&rgb(), &field(&node, &[rgb().into()], "result"));
        for (channel, pairs) in pairs.chunks_exact(64 * 64).enumerate() {
            let wanted = |x: f32| 3.0 * if channel == 1 { 1.0 - x.clamp(0.0, 1.0) } else { x.clamp(0.0, 1.0) };
            assert!(pairs.iter().all(|(x, y)| (wanted(*x) - y).abs() < 1e-5));
        }
    }

    #[test]
    fn encoded_curves_act_on_encoded_values() {
        let node = Curve { encoded: true, ..curve(&[(0.0, 0.0), (0.5, 0.25), (1.0, 1.0)]) };
        let grey = Field::constant(shibo_value::Type::Gray, &[0.214_041_14]);
        let out = crate::testing::render(&node, &[grey.into()]);
        // An encoded grey of ½ becomes an encoded grey of ¼.
        assert!((out.data()[0] - 0.050_876).abs() < 1e-5, "{}", out.data()[0]);
    }

    #[test]
    fn points_are_checked() {
        let message = |points: &[(f64, f64)]| curve(points).check_on(&canvas()).first().map(|p| p.message.clone());
        assert_eq!(message(&[(0.0, 1.0)]).as_deref(), Some("points has 1 points; a curve needs at least 2"));
        let fallen = message(&[(0.0, 0.0), (0.6, 1.0), (0.4, 1.0)]);
        assert_eq!(fallen.as_deref(), Some("point 3 is at `0.4`; it must not lie before point 2, at `0.6`"));
        assert!(message(&[(0.0, 0.0); 65]).is_some() && message(&[(0.0, 0.0); 64]).is_none());
        let own = Curve { red: vec![(0.0, 0.0)], ..curve(&[(0.0, 0.0), (1.0, 1.0)]) };
        assert_eq!(own.check_on(&canvas())[0].field.as_deref(), Some("red"));
    }
}
