//! [`JacobianFromVectors`]: features that follow vectors.
//!
//! Source: JP5149288B2 III (rows C3, C15): `J = (t b)⁻¹`, where t and b are the directions that the exemplar's axes
//! take. Cost: O(pixels).
use shibo_kernel::synthesis::jacobian::from_vectors;
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, Vec2Field, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Makes the exemplar's x axis follow vectors, given as two numbers, as two fields, or as one field of vectors.
///
/// The exemplar's y axis is perpendicular to them, unless `across` is given.
///
/// ```ron
/// "hills": Perlin(size: 30),
/// "x": Remap(input: "hills", to: (-1, 1)),
/// "jacobian": JacobianFromVectors(x: "x", y: 1),
/// "bricks": Worley(size: 4),
/// "exemplar": Exemplar(input: "bricks", size: (64, 64), periodic: Yes),
/// "coords": Synthesize(exemplar: "exemplar", jacobian: "jacobian", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "bricks", jacobian: "jacobian"),
/// ```
#[node]
pub struct JacobianFromVectors {
    /// The vectors; instead of `x` and `y`.
    pub along: Option<In<Vec2Field>>,
    /// Vectors for the exemplar's y axis.
    pub across: Option<In<Vec2Field>>,
    /// The vectors' first component.
    #[default(In::constant(1.0))]
    pub x: In<Gray>,
    /// The vectors' second component.
    #[default(In::constant(0.0))]
    pub y: In<Gray>,
    /// True to use only the directions: features keep their size.
    #[default(true)]
    pub normalize: bool,
}

impl Node for JacobianFromVectors {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] =
        &[Output::new("jacobian", Type::Jacobian, "From output to exemplar: J00 J01 J10 J11.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (along, across) = (cx.get_opt(&self.along)?, cx.get_opt(&self.across)?);
        let normalize = self.normalize;
        let unit = move |[x, y]: [f32; 2]| {
            let length = if normalize { (x * x + y * y).sqrt() } else { 1.0 };
            // Without a direction, features stay upright.
            if length > 1e-12 { [x / length, y / length] } else { [1.0, 0.0] }
        };
        let write = move |out: &mut Tile, t: &dyn Fn(usize) -> [f32; 2], b: Option<&Tile>| {
            let n = out.window.len();
            for p in 0..n {
                let t = unit(t(p));
                let b = b.map_or([-t[1], t[0]], |b| unit([b.plane(0)[p], b.plane(1)[p]]));
                let j = from_vectors(t, b);
                (0..4).for_each(|c| out.data_mut()[c * n + p] = j[c]);
            }
            Ok(())
        };
        let along = match along {
            Some(along) => along,
            None => Field::map(Type::Vec2, [cx.get(&self.x)?, cx.get(&self.y)?], Halo::NONE, |out, [x, y]| {
                out.plane_mut(0).copy_from_slice(x.data());
                out.plane_mut(1).copy_from_slice(y.data());
                Ok(())
            }),
        };
        Ok(Outputs::one(match across {
            Some(across) => Field::map(Type::Jacobian, [along, across], Halo::NONE, move |out, [t, b]| {
                write(out, &|p| [t.plane(0)[p], t.plane(1)[p]], Some(b))
            }),
            None => Field::map(Type::Jacobian, [along], Halo::NONE, move |out, [t]| {
                write(out, &|p| [t.plane(0)[p], t.plane(1)[p]], None)
            }),
        }))
    }
}
