//! [`Warp`]: displaces a field by noise or by another field.
//!
//! A point p of the result shows the input at p + d(p), read by Catmull-Rom. Without other displacements d is noise:
//! two independent sums of gradient noise, each scaled from 0..1 to ±amount, so its root mean square is 0.31·amount.
//! The halo of a tile is only as wide as its own displacements. Cost: O(pixels).
use crate::bounds::at_most_half;
use crate::warped::Warped;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::tile;
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Noise, NoiseSpec};
use shibo_node::{CanvasFacts, Context, EveryField, Fact, Gray, In, Node, Output, Outputs, Vec2Field, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tile, Tiling, Type};

/// Warps a field: straight lines become wavy. The displacements are noise, or connected fields.
///
/// A place p of the result shows the input at p + d(p), where d is the displacement there: if d is (2, 0), everything
/// moves 2 mm to the left. By default d is noise: `size` is the length of its waves, and `amount` the largest
/// displacement; three of four places move by less than half of it. Up to an amount of about a quarter of `size`, lines
/// only bend; with more, the picture folds, and places show twice. Small waves on large ones look most natural: use two
/// nodes, the second with a smaller `size` and `amount`.
///
/// `by` takes displacements from elsewhere: `Curl` for eddies, a formula such as `"= (0.5 * sin(360 * 3 * v), 0)"`,
/// or one constant for each piece, which moves the picture in every piece by another vector. `x` and `y` take grey
/// fields. Vectors and numbers of pieces can be warped too: vectors keep their direction, and numbers of pieces stay
/// whole. `DirectionalWarp` pushes in one direction, `WarpMaterial` warps a whole material.
///
/// ```ron
/// "cells":   Worley(size: 8),
/// "example": Warp(input: "cells.value", amount: 1.5, size: 5),
/// ```
///
/// Elsewhere: Substance Designer *Warp*, *Directional Warp*, *Vector Warp*; Blender *Displace*; Material Maker *Warp*;
/// Houdini *Distort*.
#[node]
pub struct Warp {
    /// Field to warp.
    pub input: In<EveryField>,
    /// Displacements in mm, instead of noise; `amount` has no effect on them.
    pub by: Option<In<Vec2Field>>,
    /// Displacement to the right, instead of noise: 0 is `-amount`, ½ is none, 1 is `amount`.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub x: Option<In<Gray>>,
    /// Displacement down, encoded like `x`.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub y: Option<In<Gray>>,
    /// Largest displacement in x and in y; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(0.3)]
    pub amount: f64,
    /// Size of the noise's bumps.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub size: f64,
    /// Number of octaves of the noise; each has half the size and half the weight of the one before.
    #[schemars(range(min = 1, max = 12))]
    #[default(2)]
    pub octaves: u32,
    /// Another seed gives another noise.
    pub seed: u64,
}

impl Warp {
    fn noise(&self, cx: &Context<'_>, axis: u64) -> Noise {
        let spec = NoiseSpec { shape: CellShape::round(self.size), ..NoiseSpec::fbm(self.size, self.octaves) };
        Noise::new(&spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(self.seed)).with(axis))
    }
}

impl Node for Warp {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, bent.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = at_most_half("amount", self.amount, canvas);
        if self.by.is_some() && (self.x.is_some() || self.y.is_some()) {
            let message = "`by` is connected, and so is `x` or `y`; only one sort of displacement can be";
            problems.push(Problem::new(Code::BadValue, message).at("by").help("remove `by`, or `x` and `y`"));
        }
        problems
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.amount == 0.0 && self.by.is_none()).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (by, x, y) = (cx.get_opt(&self.by)?, cx.get_opt(&self.x)?, cx.get_opt(&self.y)?);
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let limit = 0.5 * cx.size_mm().max_element();
        let limit = if by.is_some() { limit } else { self.amount };
        let by = match (by, x, y) {
            (Some(by), ..) => by,
            (None, None, None) => self.by_noise(cx),
            (None, x, y) => {
                let none = || Field::constant(Type::Gray, &[0.5]);
                self.by_fields([x.unwrap_or_else(none), y.unwrap_or_else(none)])
            }
        };
        let tiling = input.tiling().and(by.tiling());
        Ok(Outputs::one(Field::new(input.ty(), tiling, Warped { input, by, limit })))
    }
}

impl Warp {
    /// Maps values of 0..1 to displacements in mm.
    fn scale(&self) -> impl Fn(&mut Tile) + Send + Sync + use<> {
        #[expect(clippy::cast_possible_truncation, reason = "displacements need no more than f32")]
        let amount = self.amount as f32;
        move |out| out.data_mut().iter_mut().for_each(|v| *v = (*v * 2.0 - 1.0) * amount)
    }

    /// Displacements by the node's own noise.
    fn by_noise(&self, cx: &Context<'_>) -> Field {
        let (noise, scale) = ([self.noise(cx, 0), self.noise(cx, 1)], self.scale());
        Field::generate(Type::Vec2, cx.tiling(), move |out, _| {
            let frame = tile::frame(out);
            noise.iter().zip(out.planes_mut()).for_each(|(noise, plane)| noise.fill(&frame, plane));
            scale(out);
            Ok(())
        })
    }

    /// Displacements from two fields.
    fn by_fields(&self, fields: [Field; 2]) -> Field {
        let scale = self.scale();
        Field::map(Type::Vec2, fields, Halo::NONE, move |out: &mut Tile, [x, y]: [&Tile; 2]| {
            out.plane_mut(0).copy_from_slice(x.plane(0));
            out.plane_mut(1).copy_from_slice(y.plane(0));
            scale(out);
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{check_field, field, lumps, port, render};
    use shibo_value::Value;

    fn node() -> Warp {
        Warp { input: port(0), ..Warp::default() }
    }

    #[test]
    fn displacements_are_within_the_amount() {
        let ramp = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window) = (out.grid, out.window);
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                #[expect(clippy::cast_possible_truncation, reason = "a test picture")]
                let x = grid.center(window.x + k % window.width.cast_signed(), 0).x as f32;
                *v = x;
            }
            Ok(())
        });
        let (still, warped) = (
            render(&Warp { amount: 0.0, ..node() }, &[ramp.clone().into()]),
            render(&Warp { amount: 3.0, size: 4.0, ..node() }, &[ramp.into()]),
        );
        let moved: Vec<f32> = warped.data().iter().zip(still.data()).map(|(a, b)| a - b).collect();
        assert!(moved.iter().all(|d| d.abs() <= 3.001));
        let square = moved.iter().map(|d| d * d).sum::<f32>() / moved.len() as f32;
        assert!((0.6..1.3).contains(&square.sqrt()), "{}", square.sqrt());
    }

    #[test]
    fn grey_and_vector_displacements_agree() {
        let (right, both) = (Field::constant(Type::Gray, &[0.75]), Field::constant(Type::Vec2, &[1.0, 0.0]));
        let by_gray = Warp { x: Some(port(1)), amount: 2.0, ..node() };
        let by_vector = Warp { by: Some(port(1)), ..node() };
        let a = render(&by_gray, &[lumps().into(), right.into()]);
        let b = render(&by_vector, &[lumps().into(), both.into()]);
        let input = crate::testing::raster(&lumps(), &crate::testing::canvas());
        assert_eq!(a, b);
        assert_eq!(a.row(0, 7)[..62], input.row(0, 7)[2..]);
    }

    #[test]
    fn numbers_of_pieces_stay_whole_and_vectors_are_moved() {
        let pieces = crate::testing::pieces();
        let ids = field(&Warp { amount: 3.0, ..node() }, &[pieces.clone().into()]);
        check_field(&ids);
        let tile = crate::testing::raster(&ids, &crate::testing::canvas());
        assert!(tile.data().iter().all(|id| *id == 100.0 || *id == 9000.0));
        assert_ne!(tile, crate::testing::raster(&pieces, &crate::testing::canvas()));
        let vectors = Field::map(Type::Vec2, [lumps()], Halo::NONE, |out: &mut Tile, [lumps]: [&Tile; 1]| {
            out.plane_mut(0).copy_from_slice(lumps.plane(0));
            Ok(())
        });
        let warped = render(&node(), &[vectors.into()]);
        assert_eq!(warped.plane(0), render(&node(), &[lumps().into()]).plane(0));
    }

    #[test]
    fn holds_in_any_window() {
        let inputs: [Value; 1] = [lumps().into()];
        for (amount, size, octaves) in [(0.3, 2.0, 2), (16.0, 1e-4, 12), (16.0, 1e5, 1), (1e-9, 3.0, 1)] {
            check_field(&field(&Warp { amount, size, octaves, ..node() }, &inputs));
        }
        check_field(&field(&Warp { amount: 1.0, ..node() }, &[lumps().to_rgb().into()]));
        let wild = Field::constant(Type::Vec2, &[1e30, f32::NAN]);
        check_field(&field(&Warp { by: Some(port(1)), ..node() }, &[lumps().into(), wild.into()]));
        assert_eq!(Warp { amount: 0.0, ..node() }.no_op(), Some("input"));
        assert_eq!(Warp { by: Some(port(1)), x: Some(port(1)), ..node() }.check_on(&crate::testing::canvas()).len(), 1);
    }
}
