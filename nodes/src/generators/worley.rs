//! [`Worley`]: cellular noise.
//!
//! Source: S. Worley, "A cellular texture basis function" (1996); the border distance after I. Quilez, "Voronoi
//! borders"; along a field after F. Labelle, J. Shewchuk (2003). Unlike there, cells lie on a grid that repeats with
//! the canvas, with one point in each; see [`kernel::worley`](shibo_kernel::noise::worley). Each output is computed
//! separately. Cost: O(pixels), about 13 ns per output; `border` four times that; along a field about 200 ns per
//! output, `border` 450.
use super::noise_field::{known_angle, without_aspect};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::Frame;
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::worley::{self as kernel, Metric, WorleyOut, WorleySpec};
use shibo_kernel::noise::worley_along::WorleyAlong;
use shibo_kernel::pointwise::tone;
use shibo_node::{CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Halo, Stop, Tile, Tiling, Type};
use std::sync::Arc;

/// Cells around scattered points: stones, scales, cracks, pores.
///
/// Distances are in mm; if `aspect` is not 1, they are measured across the long direction. `normalize` makes them
/// shares of `size`, 0 to about 1. On a tiling canvas the pattern repeats; size and angle are then rounded, by up to
/// half a cell per canvas side. With `direction`, cells follow a field: scales along a body, cracks around a knot.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "mortar": Remap(input: "cells.border", from: (0.1, 0.6), clamp: true),
/// "stones": Remap(input: "cells.value", to: (0.3, 0.9)),
/// "example": Blend(base: "stones", top: "mortar", mode: Multiply),
/// ```
///
/// Elsewhere: Substance Designer *Cells*; Blender *Voronoi Texture*; Houdini *Worley Noise*; Material Maker *Voronoi*.
#[node]
pub struct Worley {
    /// Direction in which cells are long, in degrees from +x towards +y or as vectors; `angle` is added. Has an effect
    /// only if `aspect` is not 1.
    pub direction: Option<In<Direction>>,
    /// Size of a cell, across its long direction. With more than 10^9 cells on the canvas all outputs are 0.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(5.0)]
    pub size: f64,
    /// Irregularity of the cells; 0 is a regular grid.
    #[schemars(range(min = 0, max = 1))]
    #[default(1.0)]
    pub jitter: f64,
    /// Metric of `f1` and `f2`; `border` is always the Euclidean distance.
    #[default(Metric::Euclidean)]
    pub metric: Metric,
    /// Length of cells along `angle`, as a multiple of their size across it.
    #[schemars(range(min = 0.02, max = 50))]
    #[default(1.0)]
    pub aspect: f64,
    /// Direction of the long side, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// True if `f1`, `f2` and `border` are shares of `size` instead of mm.
    pub normalize: bool,
    /// Another seed gives another pattern of the same kind.
    pub seed: u64,
}

impl Node for Worley {
    const OUTPUTS: &'static [Output] = &[
        Output::new("f1", Type::Gray, "Distance to the nearest point.").in_unit("mm"),
        Output::new("f2", Type::Gray, "Distance to the second nearest point.").in_unit("mm"),
        Output::new("border", Type::Gray, "Distance to the border of the cell.").in_unit("mm"),
        Output::new("value", Type::Gray, "A random number for each cell, 0..1."),
        Output::new("ids", Type::Ids, "A random whole number below 2^24 that names each cell."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn unit(&self, output: &Output) -> Option<&'static str> {
        output.unit.filter(|_| !self.normalize)
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        without_aspect(self.direction.is_some(), self.aspect)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let direction = cx.get_opt(&self.direction)?.filter(|_| self.aspect != 1.0);
        let (known, direction) = known_angle(direction);
        let angle = (self.angle + known).to_radians();
        let spec = WorleySpec {
            shape: CellShape { size: self.size, aspect: self.aspect, angle },
            jitter: narrow(self.jitter),
            metric: self.metric,
        };
        let (canvas, hash) = ((cx.size_mm(), cx.tiling()), Hash::new(cx.seed(self.seed)));
        let factor = if self.normalize { narrow(1.0 / self.size.max(1e-30)) } else { 1.0 };
        let outputs = |output: &dyn Fn(Type, Plane) -> Field| {
            Outputs::one(output(Type::Gray, Plane::First))
                .with("f2", output(Type::Gray, Plane::Second))
                .with("border", output(Type::Gray, Plane::Border))
                .with("value", output(Type::Gray, Plane::Value))
                .with("ids", output(Type::Ids, Plane::Ids))
        };
        let Some(direction) = direction else {
            let cells = Arc::new(kernel::Worley::new(&spec, canvas, hash));
            return Ok(outputs(&|ty, plane| {
                let cells = cells.clone();
                Field::generate(ty, cx.tiling(), move |out, _| {
                    fill(plane, factor, out, |frame, wanted| cells.fill(frame, wanted));
                    Ok(())
                })
            }));
        };
        let cells = Arc::new(WorleyAlong::new(&spec, canvas, hash));
        let tiling = cx.tiling().and(direction.tiling());
        Ok(outputs(&|ty, plane| {
            let cells = cells.clone();
            let along = move |out: &mut Tile, [angles]: [&Tile; 1]| {
                fill(plane, factor, out, |frame, wanted| cells.fill(frame, &tile::view(angles, 0), wanted));
                Ok(())
            };
            Field::map(ty, [direction.clone()], Halo::NONE, along).tiled(tiling)
        }))
    }
}

/// The outputs computed from the cells.
#[derive(Clone, Copy)]
enum Plane {
    First,
    Second,
    Border,
    Value,
    Ids,
}

fn fill(plane: Plane, factor: f32, out: &mut Tile, draw: impl Fn(&Frame, &mut WorleyOut<'_>)) {
    let frame = tile::frame(out);
    let values = out.plane_mut(0);
    let mut words = Vec::new();
    let mut wanted = match plane {
        Plane::First => WorleyOut { f1: Some(&mut *values), ..WorleyOut::default() },
        Plane::Second => WorleyOut { f2: Some(&mut *values), ..WorleyOut::default() },
        Plane::Border => WorleyOut { border: Some(&mut *values), ..WorleyOut::default() },
        Plane::Value => WorleyOut { value: Some(&mut *values), ..WorleyOut::default() },
        Plane::Ids => {
            words.resize(values.len(), 0);
            WorleyOut { id: Some(&mut words), ..WorleyOut::default() }
        }
    };
    draw(&frame, &mut wanted);
    match plane {
        Plane::First | Plane::Second | Plane::Border if factor != 1.0 => tone::scale(values, factor),
        Plane::Ids => kernel::ids(&words, values),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::{OnCanvas as _, canvas, lumps, port, render};
    use std::collections::BTreeSet;

    #[test]
    fn conforms_in_every_metric() {
        for metric in [Metric::Euclidean, Metric::Manhattan, Metric::Chebyshev] {
            conforms(&Worley { metric, angle: 30.0, aspect: 1.6, ..Worley::default() }, &[]);
        }
        for (size, aspect) in [(1e-300, 50.0), (1e5, 50.0), (1e5, 0.02), (1e-4, 1.0)] {
            conforms(&Worley { size, aspect, normalize: true, ..Worley::default() }, &[]);
        }
    }

    #[test]
    fn distances_are_mm_or_shares() {
        let worley = Worley { size: 8.0, ..Worley::default() };
        let (mm, shares) = (render(&worley, &[]), render(&Worley { normalize: true, ..worley.clone() }, &[]));
        assert!(mm.data().iter().zip(shares.data()).all(|(a, b)| (a / 8.0 - b).abs() < 1e-6));
        let second = part(&field(&worley, &[], "f2"), &canvas(), 0, 0, 64, 64);
        assert!(mm.data().iter().zip(second.data()).all(|(a, b)| a <= b));
        let most = mm.data().iter().copied().fold(0.0, f32::max);
        assert!((4.0..12.0).contains(&most), "{most}");
    }

    #[test]
    fn every_cell_has_its_number() {
        let ids = part(&field(&Worley { size: 8.0, ..Worley::default() }, &[], "ids"), &canvas(), 0, 0, 64, 64);
        assert!(ids.data().iter().all(|v| v.fract() == 0.0 && (0.0..16_777_216.0).contains(v)));
        let different: BTreeSet<u32> = ids.data().iter().map(|v| v.to_bits()).collect();
        assert_eq!(different.len(), 16);
    }

    #[test]
    fn conforms_along_a_field() {
        for metric in [Metric::Euclidean, Metric::Manhattan, Metric::Chebyshev] {
            for aspect in [3.0, 0.25] {
                let node = Worley { direction: Some(port(0)), metric, aspect, ..Worley::default() };
                conforms(&node, &[lumps().into()]);
                conforms(&node, &[gray().into()]);
            }
        }
        let wild = Worley { direction: Some(port(0)), aspect: 50.0, size: 1e-300, ..Worley::default() };
        conforms(&wild, &[gray().into()]);
        conforms(&Worley { size: 1e5, ..wild }, &[gray().into()]);
    }

    #[test]
    fn constant_direction_equals_angle() {
        let node = Worley { aspect: 3.0, angle: 10.0, ..Worley::default() };
        let along = Worley { direction: Some(port(0)), ..node.clone() };
        let known = render(&along, &[Field::constant(Type::Gray, &[50.0]).into()]);
        assert_eq!(known, render(&Worley { angle: 60.0, ..node.clone() }, &[]));
        // With an aspect of 1 the direction has no effect: the pattern is that without a direction.
        let round = Worley { aspect: 1.0, ..along.clone() };
        assert_eq!(render(&round, &[lumps().into()]), render(&Worley { aspect: 1.0, ..node }, &[]));
        assert_eq!((round.advice_on(&canvas()).len(), along.advice_on(&canvas()).len()), (1, 0));
    }

    #[test]
    fn cells_are_long_along_the_direction() {
        let node = Worley { direction: Some(port(0)), size: 2.0, aspect: 4.0, ..Worley::default() };
        // A field of 90 degrees that is not marked as a constant.
        let upright = Field::generate(Type::Gray, Tiling::BOTH, |out: &mut Tile, _| {
            out.data_mut().fill(90.0);
            Ok(())
        });
        let values = part(&field(&node, &[upright.into()], "value"), &canvas(), 0, 0, 64, 64);
        let changes = |dx: usize, dy: usize| {
            (0..63 * 63).filter(|k| values.row(0, k / 63)[k % 63] != values.row(0, k / 63 + dy)[k % 63 + dx]).count()
        };
        let (across, along) = (changes(1, 0), changes(0, 1));
        assert!((3.0..6.0).contains(&(across as f64 / along as f64)), "{across} {along}");
    }

    #[test]
    fn seeds_differ() {
        let of = |seed| render(&Worley { seed, ..Worley::default() }, &[]);
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }
}
