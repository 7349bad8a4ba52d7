//! [`MixSolids`]: mixes two solids. Cost: about 1 ns a point.
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::solids::Code;
use shibo_node::{AnySolid, Context, Fact, In, Node, Output, Outputs, SolidNumber, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Solid, Stop, Type};

/// Mixes two solids: `a` where `mask` is 0, `b` where it is 1.
///
/// ```ron
/// "a": SolidNoise(size: 3, octaves: 4),
/// "b": SolidNoise(size: 12, octaves: 1),
/// "mask": SolidNoise(size: 25, octaves: 1),
/// "edge": SolidMath(operation: SmoothStep, a: "mask", b_value: 0.48, c_value: 0.52),
/// "mixed": MixSolids(a: "a", b: "b", mask: "edge"),
/// "example": CutPlane(solid: "mixed"),
/// ```
///
/// Elsewhere: Blender *Mix*; Houdini *Volume Mix*.
#[node]
pub struct MixSolids {
    /// The solid where the mask is 0.
    pub a: In<AnySolid>,
    /// The solid where the mask is 1, of the same type.
    pub b: In<AnySolid>,
    /// Weight of `b`, 0..1; `amount` everywhere if not given.
    pub mask: Option<In<SolidNumber>>,
    /// Weight of `b` if `mask` is not connected.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.5)]
    pub amount: f64,
}

impl Node for MixSolids {
    const OUTPUTS: &'static [Output] = &[Output::solid_like("solid", &["a", "b"], "The mixture.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (a, b) = (cx.get(&self.a)?, cx.get(&self.b)?);
        if a.ty() != b.ty() {
            let message = format!("a is {} and b is {}; they must be of the same type", a.ty(), b.ty());
            return Err(Problem::new(ErrorCode::TypeMismatch, message).at("b").into());
        }
        let mask = cx.get_opt(&self.mask)?.unwrap_or_else(|| Solid::constant(Type::Solid, &[narrow(self.amount)]));
        let code = Code::of_inputs(|_, inputs, out| {
            for (c, plane) in out.iter_mut().enumerate() {
                let (a, b, m) = (inputs[0].plane(c), inputs[1].plane(c), inputs[2].plane(0));
                for (((out, a), b), m) in plane.iter_mut().zip(a).zip(b).zip(m) {
                    *out = math::lerp(*a, *b, math::saturate(*m));
                }
            }
        });
        let ty = a.ty();
        Ok(Outputs::one(Solid::new(ty, vec![a, b, mask], code)))
    }
}
