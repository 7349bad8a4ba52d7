//! [`ShapeMath`]: shapes combined, by their distances.
//!
//! See [`kernel::combine`](shibo_kernel::shape::combine). `Repeat` shows the nearest four copies of the input in two
//! cells about the middle of the canvas, interpolated by Catmull-Rom. Cost: O(pixels), bound by memory; `Repeat` adds
//! the cost of the input over two cells.
use super::masked;
use glam::DVec2;
use shibo_kernel::filter::sample::{Filter, Outside, Sampler};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::shape::combine::{self, Operation};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, FieldSource, Given, Grid, Halo, Read, Stop, Tile, Tiling, Type, Window};

/// Joins, cuts, offsets, outlines and repeats shapes. Works on distances in mm (`Shape.distance`, `Text.distance`),
/// negative inside. The result is a distance again, so that nodes can be chained.
///
/// Corners are rounded in two steps: draw the shape smaller by the radius, then `Offset` it by the same amount. Inside
/// overlapping shapes, the distance is that of the deeper one. `Repeat` fits its cells to a canvas that tiles.
///
/// ```ron
/// "bar": Shape(form: Box, size: (26, 7), radius: 1),
/// "disc": Shape(size: 17),
/// "joined": ShapeMath(a: "bar.distance", b: "disc.distance", radius: 5),
/// "outline": ShapeMath(operation: Shell, a: "joined", amount: 1.5),
/// "example": Invert(input: "outline.mask"),
/// ```
///
/// Elsewhere: Material Maker *Boolean*, *Smooth Boolean*, *Rounded Shape*, *Annular Shape*; Blender *Boolean Math*,
/// *Math* (Smooth Minimum).
#[node]
pub struct ShapeMath {
    /// Operation on the shapes.
    #[default(Operation::Union)]
    pub operation: Operation,
    /// The distance of the first shape.
    pub a: In<Gray>,
    /// The distance of the second shape, for `Union`, `Intersection` and `Difference`.
    pub b: Option<In<Gray>>,
    /// Radius of the fillet between two shapes; 0 is a sharp corner.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub radius: f64,
    /// By how much `Offset` grows the shape; the width of the outline of `Shell`.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub amount: f64,
    /// The cell of `Repeat`: the part of the input in the cell about the middle of the canvas is repeated. On a canvas
    /// that tiles, the cell is changed so that a whole number fits.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Xy::new(10.0, 10.0))]
    pub cell: Xy,
    /// Width over which the edge of the mask fades, half of it inside; at least one pixel.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub softness: f64,
}

impl ShapeMath {
    /// The cell, changed to fit the canvas.
    fn fitted(&self, size: DVec2, tiling: Tiling) -> DVec2 {
        let cell = DVec2::new(self.cell.x, self.cell.y);
        let fitted = size / (size / cell).round().max(DVec2::ONE);
        DVec2::new(if tiling.x { fitted.x } else { cell.x }, if tiling.y { fitted.y } else { cell.y })
    }
}

impl Node for ShapeMath {
    const OUTPUTS: &'static [Output] = &[
        Output::new("distance", Type::Gray, "Distance from the edge; negative inside.").in_unit("mm"),
        Output::new("mask", Type::Gray, "1 inside and 0 outside."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        if self.operation == Operation::Shell && self.amount < 0.0 {
            let message = format!("amount is `{}` mm; the width of a `Shell` must be at least 0 mm", self.amount);
            problems.push(Problem::new(Code::OutOfRange, message).at("amount"));
        }
        if self.operation == Operation::Repeat {
            let (size, cell) = (canvas.size_mm(), DVec2::new(self.cell.x, self.cell.y));
            if cell.cmpgt(size).any() {
                let message = format!(
                    "cell is `({}, {})` mm; it must be at most as large as the canvas, {} × {} mm",
                    cell.x, cell.y, size.x, size.y
                );
                problems.push(Problem::new(Code::OutOfRange, message).at("cell"));
            }
        }
        problems
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        if self.operation.takes_two() && self.b.is_none() {
            let message = format!("`{:?}` of one shape is that shape", self.operation);
            return vec![Problem::new(Code::Advice, message).at("operation").help("connect `b`")];
        }
        let cell = DVec2::new(self.cell.x, self.cell.y);
        let fitted = self.fitted(canvas.size_mm(), canvas.tile());
        if self.operation == Operation::Repeat && ((fitted - cell) / cell).abs().max_element() > 2e-3 {
            let message = format!(
                "cells are {:.4} × {:.4} mm instead of {} × {} mm, so that a whole number fits the canvas",
                fitted.x, fitted.y, cell.x, cell.y
            );
            return vec![Problem::new(Code::Advice, message).at("cell")];
        }
        Vec::new()
    }

    fn distances(&self) -> &'static [&'static str] {
        &["a", "b"]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if self.operation == Operation::Repeat { canvas.tile() } else { Tiling::BOTH }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (a, b) = (cx.get(&self.a)?, cx.get_opt(&self.b)?);
        let (operation, numbers) = (self.operation, (narrow(self.radius), narrow(self.amount)));
        let distance = match (operation, b) {
            (Operation::Repeat, _) => {
                let cell = self.fitted(cx.size_mm(), cx.tiling());
                let tiling = cx.tiling().and(a.tiling());
                Field::new(Type::Gray, tiling, Repeated { input: a, cell, middle: cx.size_mm() * 0.5 })
            }
            (operation, Some(b)) if operation.takes_two() => {
                Field::map(Type::Gray, [a, b], Halo::NONE, move |out: &mut Tile, [a, b]: [&Tile; 2]| {
                    combine::fill(operation, a.data(), b.data(), numbers, out.data_mut());
                    Ok(())
                })
            }
            (operation, _) if operation.takes_two() => a,
            (operation, _) => Field::map(Type::Gray, [a], Halo::NONE, move |out: &mut Tile, [a]: [&Tile; 1]| {
                combine::fill(operation, a.data(), &[], numbers, out.data_mut());
                Ok(())
            }),
        };
        Ok(Outputs::one(distance.clone()).with("mask", masked::mask(&distance, self.softness)))
    }
}

/// A distance, repeated in each cell.
struct Repeated {
    input: Field,
    cell: DVec2,
    middle: DVec2,
}

impl Repeated {
    /// The pixels of the input to read: a cell on each side of the middle.
    #[expect(clippy::cast_possible_truncation, reason = "pixels of a canvas")]
    fn source(&self, grid: &Grid) -> Window {
        let (low, high) = (
            ((self.middle - self.cell - grid.origin) / grid.step).floor(),
            ((self.middle + self.cell - grid.origin) / grid.step).ceil(),
        );
        let (x, y) = (low.x as i32, low.y as i32);
        Window { x, y, width: (high.x as i32).abs_diff(x).max(1), height: (high.y as i32).abs_diff(y).max(1) }
            .grow(2, 2)
    }
}

impl FieldSource for Repeated {
    fn inputs(&self, grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.input, grid, self.source(grid))]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let sampler = Sampler::new(tile::view(given.tile(0), 0), Filter::CatmullRom, [Outside::Clamp; 2]);
        let (grid, window) = (out.grid, out.window);
        // The pixel of the input for the copy at or before the place, and for the next copy.
        let place = |p: f64, k: usize| {
            let away = p - self.middle[k];
            let first = away - (away / self.cell[k]).floor() * self.cell[k];
            [first, first - self.cell[k]].map(|at| narrow((self.middle[k] + at - grid.origin[k]) / grid.step[k]))
        };
        for (row, y) in (0..out.height()).zip(window.y..) {
            given.check()?;
            let ys = place(grid.center(0, y).y, 1);
            for (out, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                let xs = place(grid.center(x, 0).x, 0);
                let four = ys.map(|y| xs.map(|x| sampler.at(x, y)));
                *out = four.iter().flatten().copied().fold(f32::INFINITY, f32::min);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of a test")]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::shapes::{Form, Shape};
    use crate::testing::{OnCanvas as _, canvas, port};

    fn distance(node: &Shape) -> Field {
        field(node, &[], "distance")
    }

    #[test]
    fn a_repeated_shape_is_drawn_in_each_cell() {
        let small = Shape { form: Form::Box, size: Xy::new(5.0, 3.0), ..Shape::default() };
        let node =
            ShapeMath { operation: Operation::Repeat, a: port(0), cell: Xy::new(8.0, 16.0), ..ShapeMath::default() };
        let input = [distance(&small).into()];
        conforms(&node, &input);
        let got = part(&field(&node, &input, "distance"), &canvas(), 0, 0, 64, 64);
        // By hand: boxes about (4 + 8 i, 16 j) mm, because the middle is (16, 16) and cells are 8 × 16.
        for (k, got) in got.data().iter().enumerate() {
            let p = canvas().grid(canvas().resolution).center((k % 64) as i32, (k / 64) as i32);
            let mut want = f64::INFINITY;
            for i in -2..6 {
                for j in -1..4 {
                    let q = (p - DVec2::new(8.0 * f64::from(i), 16.0 * f64::from(j))).abs() - DVec2::new(2.5, 1.5);
                    want = want.min(q.max(DVec2::ZERO).length() + q.max_element().min(0.0));
                }
            }
            assert!((f64::from(*got) - want).abs() < 0.09, "{p}: {got} {want}");
        }
    }

    #[test]
    fn all_operations_conform() {
        let a = distance(&Shape::default());
        let b = distance(&Shape { form: Form::Box, center: Some(Xy::new(20.0, 3.0)), ..Shape::default() });
        for operation in
            [Operation::Union, Operation::Intersection, Operation::Difference, Operation::Offset, Operation::Shell]
        {
            let node =
                ShapeMath { operation, a: port(0), b: Some(port(1)), radius: 2.0, amount: 1.0, ..ShapeMath::default() };
            conforms(&node, &[a.clone().into(), b.clone().into()]);
        }
    }

    #[test]
    fn reports_cells_that_do_not_fit() {
        let node = |operation, cell, amount| ShapeMath {
            operation,
            a: port(0),
            cell: Xy::new(cell, cell),
            amount,
            ..ShapeMath::default()
        };
        assert_eq!(node(Operation::Repeat, 7.0, 0.0).advice_on(&canvas()).len(), 1);
        assert_eq!(node(Operation::Repeat, 8.0, 0.0).advice_on(&canvas()).len(), 0);
        assert_eq!(node(Operation::Repeat, 33.0, 0.0).check_on(&canvas()).len(), 1);
        assert_eq!(node(Operation::Shell, 7.0, -1.0).check_on(&canvas()).len(), 1);
        assert_eq!(node(Operation::Union, 7.0, -1.0).advice_on(&canvas()).len(), 1, "without b");
    }
}
