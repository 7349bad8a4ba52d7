//! [`FiberShading`]: reflection of light by fibres on a cut.
//!
//! Beyond the source, after S. Marschner et al., "Measuring and modeling the appearance of finished wood"
//! (2005). Cost: about 10 ns a point besides the direction.
use super::frames::{Frame, dot, frames};
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::wood::solids::Code;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, SolidColor, SolidVector, node};
use shibo_value::{Solid, Stop, Type};

/// Computes, from the angle between fibres and the cut: anisotropy and its direction, the tilt of fibres out of the
/// cut, and figure, which makes wood lighter where fibres tilt one way and darker where they tilt the other way.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(stops: [(0, "#e6cda6"), (0.6, "#e3c89f"), (0.9, "#dabb8e"), (0.98, "#c8a273"), (1, "#dec297")]),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "fiber": FiberSpace(time: "time", tree: "tree", curl: 0.36, curl_length: 9.5),
/// "maple": FiberShading(color: "wood", direction: "fiber.direction", figure: 0.9),
/// "example": CutPlane(solid: "maple", preset: FlatSawn, distance: 30),
/// ```
///
/// Elsewhere: Blender *Tangent*, *Anisotropic BSDF*; Houdini *Principled Shader* (anisotropy).
#[node]
pub struct FiberShading {
    /// The colour to which figure is added.
    pub color: In<SolidColor>,
    /// The direction of `FiberSpace`.
    pub direction: In<SolidVector>,
    /// Strength of figure: by how much wood is lighter where fibres tilt out of the cut towards the right of the
    /// canvas; on meshes, where fibres that lead up the trunk rise out of the surface.
    #[schemars(range(min = -4, max = 4))]
    pub figure: f64,
    /// The share of the tilt that the normal follows.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.5)]
    pub normal_gain: f64,
}

/// A number computed from the direction of fibres in the frame of the cut.
fn each(local: &Solid, f: impl Fn(f32, f32, f32) -> f32 + Send + Sync + 'static) -> Solid {
    let code = Code::of_inputs(move |_, inputs, out| {
        let [a, b, c] = [0, 1, 2].map(|k| inputs[0].plane(k));
        dispatch(
            #[inline(always)]
            || out[0].iter_mut().zip(a.iter().zip(b).zip(c)).for_each(|(out, ((a, b), c))| *out = f(*a, *b, *c)),
        );
    });
    code.solid(Type::Solid, vec![local.clone()])
}

impl Node for FiberShading {
    const VERSION: u32 = 4;
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::SolidColor, "The colour with its figure."),
        Output::new("anisotropy", Type::Solid, "1 where fibres lie in the cut, 0 on end grain."),
        Output::new("angle", Type::Solid, "The angle of fibres on the canvas, -90..90, from +x towards +y.")
            .in_unit("°"),
        Output::new(
            "x",
            Type::Solid,
            "How far fibres of length 1 run to the right on the canvas, for `JacobianFromVectors`.",
        ),
        Output::new("y", Type::Solid, "How far they run down on it."),
        Output::new("tilt", Type::Solid, "The angle of fibres out of the cut, -90..90.").in_unit("°"),
        Output::new("normal", Type::SolidVector, "The normal turned by the tilt, as ½ + ½n, y up."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (color, direction) = (cx.get(&self.color)?, cx.get(&self.direction)?);
        // The direction in the frame of the cut.
        let code = Code::of_place(|patch, inputs, out| {
            let [x, y, z] = [0, 1, 2].map(|c| inputs[0].plane(c));
            let [along, down, up, tilt] = out else { return };
            let rounded = patch.rounded;
            // Single points have no cut: assume a view from y, with z to the right.
            let alone = Frame { right: [0.0, 0.0, 1.0], down: [1.0, 0.0, 0.0], normal: [0.0, 1.0, 0.0] };
            dispatch(
                #[inline(always)]
                || {
                    frames(
                        patch,
                        #[inline(always)]
                        |from, to, frame| {
                            let frame = *frame.unwrap_or(&alone);
                            let from_space = x[from..to].iter().zip(&y[from..to]).zip(&z[from..to]);
                            let local = along[from..to].iter_mut().zip(&mut down[from..to]);
                            let out = up[from..to].iter_mut().zip(&mut tilt[from..to]);
                            for (((x, y), z), ((along, down), (up, tilt))) in from_space.zip(local.zip(out)) {
                                let f = [*x, *y, *z];
                                let across = dot(f, frame.right);
                                // A fibre has no sign: make it point to the right, or down.
                                let sign = if across < 0.0 { -1.0 } else { 1.0 };
                                *along = sign * across;
                                (*down, *up) = (sign * dot(f, frame.down), sign * dot(f, frame.normal));
                                *tilt = if rounded.is_some() { sign } else { *up };
                            }
                        },
                    );
                    // On a mesh, neither the layout of charts nor facets may be visible: the sign of fibres is taken in
                    // space, and the smooth normals define the surface.
                    let Some([to_right, to_down, to_up]) = rounded else { return };
                    for (i, tilt) in tilt.iter_mut().enumerate() {
                        *tilt *= along[i] * to_right[i] + down[i] * to_down[i] + up[i] * to_up[i];
                    }
                },
            );
        });
        // A wood often needs the results twice: to hide details on end grain, and for its figure.
        let all = Solid::bundle(4, vec![direction.clone()], code.with_rounded_quads());
        let all = cx.shared_of(&format!("FiberShading {}", Self::VERSION), all, &direction);
        let (local, tilt) = (all.pick(Type::SolidVector, &[0, 1, 2]), all.channel(3));
        let figure = narrow(self.figure);
        let paint = Code::of_inputs(move |_, inputs, out| {
            let tilt = inputs[1].plane(0);
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
        Ok(Outputs::one(paint.solid(Type::SolidColor, vec![color, tilt.clone()]))
            .with("x", local.channel(0))
            .with("y", local.channel(1))
            .with("anisotropy", each(&local, |_, _, c| 1.0 - c * c))
            .with("angle", each(&local, |a, b, _| math::atan2(b, a) * (180.0 / std::f32::consts::PI)))
            .with(
                "tilt",
                Code::of_inputs(|_, inputs, out| {
                    let [a, b, c] = [0, 1, 2].map(|k| inputs[0].plane(k));
                    for (i, (out, tilt)) in out[0].iter_mut().zip(inputs[1].plane(0)).enumerate() {
                        let flat = a[i] * a[i] + b[i] * b[i] + (c[i] * c[i] - tilt * tilt);
                        *out = math::atan2(*tilt, math::max(flat, 0.0).sqrt()) * (180.0 / std::f32::consts::PI);
                    }
                })
                .solid(Type::Solid, vec![local.clone(), tilt]),
            )
            .with("normal", normal.solid(Type::SolidVector, vec![local])))
    }
}
