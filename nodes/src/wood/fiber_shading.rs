//! [`FiberShading`]: how fibres catch the light on a cut.
//!
//! Beyond the source; WOOD-LOOK §4.3, after S. Marschner et al., "Measuring and modeling the appearance of finished wood"
//! (2005). Cost: about 10 ns a point besides the direction.
use super::frames::{dot, frame};
use crate::kernel::math;
use crate::kernel::solids::Code;
use crate::kernel::tile::narrow;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::node::{Context, Fact, In, Node, Output, Outputs, SolidColor, SolidVector};
use shibo_engine::value::{Solid, Stop, Type};

/// Fibre direction against the cut: anisotropy and its angle, the tilt of fibres out of the cut, and figure, which is
/// lighter where fibres tilt one way and darker where they tilt the other.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(skeleton: "tree"),
/// "rings": ColorPattern(stops: [(0, "#e6cda6"), (0.6, "#e3c89f"), (0.9, "#dabb8e"), (0.98, "#c8a273"), (1, "#dec297")]),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "fiber": FiberSpace(time: "time", skeleton: "tree", curl: 0.36, curl_length: 9.5),
/// "maple": FiberShading(color: "wood", direction: "fiber.direction", figure: 0.9),
/// "example": CutPlane(solid: "maple", preset: FlatSawn, distance: 30),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FiberShading {
    /// The colour to draw figure on.
    pub color: In<SolidColor>,
    /// The direction of `FiberSpace`.
    pub direction: In<SolidVector>,
    /// How much lighter wood is where its fibres tilt towards the top of the canvas.
    #[schemars(range(min = -4, max = 4))]
    pub figure: f64,
    /// How much of the tilt turns the normal.
    #[schemars(range(min = 0, max = 1))]
    pub normal_gain: f64,
}

impl Default for FiberShading {
    fn default() -> Self {
        Self { color: In::default(), direction: In::default(), figure: 0.0, normal_gain: 0.5 }
    }
}

impl Node for FiberShading {
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::SolidColor, "The colour with its figure."),
        Output::new("anisotropy", Type::Solid, "1 where fibres lie in the cut, 0 on end grain."),
        Output::new("angle", Type::Solid, "The angle of fibres on the canvas in degrees, -90..90, from +x towards +y."),
        Output::new("tilt", Type::Solid, "The angle of fibres out of the cut in degrees, -90..90."),
        Output::new("normal", Type::SolidVector, "The normal turned by the tilt, as ½ + ½n, y up."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (color, direction) = (cx.get(&self.color)?, cx.get(&self.direction)?);
        // The direction in the frame of the cut.
        let code = Code::of_place(|patch, inputs, out| {
            let [x, y, z] = [0, 1, 2].map(|c| inputs[0].plane(c));
            let [along, down, up] = out else { return };
            for i in 0..patch.len() {
                let f = [x[i], y[i], z[i]];
                let local = frame(patch, i)
                    .map_or([f[2], f[0], f[1]], |to| [dot(f, to.right), dot(f, to.down), dot(f, to.normal)]);
                // A fibre has no front: it points to the right, or down.
                let sign = if local[0] < 0.0 { -1.0 } else { 1.0 };
                (along[i], down[i], up[i]) = (sign * local[0], sign * local[1], sign * local[2]);
            }
        });
        let local = Solid::new(Type::SolidVector, vec![direction], code.with_quads());
        let local = cx.shared("local", local);
        let each = |f: fn(f32, f32, f32) -> f32| {
            let code = Code::of_inputs(move |_, inputs, out| {
                let [a, b, c] = [0, 1, 2].map(|k| inputs[0].plane(k));
                (0..a.len()).for_each(|i| out[0][i] = f(a[i], b[i], c[i]));
            });
            code.solid(Type::Solid, vec![local.clone()])
        };
        let figure = narrow(self.figure);
        let paint = Code::of_inputs(move |_, inputs, out| {
            let tilt = inputs[1].plane(2);
            for (c, plane) in out.iter_mut().enumerate() {
                for ((out, color), s) in plane.iter_mut().zip(inputs[0].plane(c)).zip(tilt) {
                    // Steep fibres are end grain, which has no figure.
                    let fade = 1.0 - math::smooth((s.abs() - 0.35) * (1.0 / 0.35));
                    *out = color * math::max(1.0 + figure * s * fade, 0.0);
                }
            }
        });
        let gain = narrow(self.normal_gain);
        let normal = Code::of_inputs(move |_, inputs, out| {
            let [a, b, c] = [0, 1, 2].map(|k| inputs[0].plane(k));
            let [nx, ny, nz] = out else { return };
            for i in 0..a.len() {
                let flat = math::max((a[i] * a[i] + b[i] * b[i]).sqrt(), 1e-4);
                let turn = gain * math::atan2(c[i], flat) * math::smooth(flat * 2.0);
                let s = math::sin(turn);
                nx[i] = 0.5 - 0.5 * s * a[i] / flat;
                ny[i] = 0.5 + 0.5 * s * b[i] / flat;
                nz[i] = 0.5 + 0.5 * math::cos(turn);
            }
        });
        Ok(Outputs::one(paint.solid(Type::SolidColor, vec![color, local.clone()]))
            .with("anisotropy", each(|_, _, c| 1.0 - c * c))
            .with("angle", each(|a, b, _| math::atan2(b, a) * (180.0 / std::f32::consts::PI)))
            .with("tilt", each(|a, b, c| math::atan2(c, (a * a + b * b).sqrt()) * (180.0 / std::f32::consts::PI)))
            .with("normal", normal.solid(Type::SolidVector, vec![local])))
    }
}
