//! [`Formula`]: a formula of fields and of the position on the canvas.
//!
//! Inputs that are numbers are constants of the program, and fields that the result does not need are not computed. Cost:
//! O(pixels), 0.05 to 0.15 ns for each operation, 1 to 4 ns for angles, powers, logarithms and noise.
use super::{fused, not_finite, program};
use glam::DVec2;
use shibo_kernel::pointwise::expression::Machine;
use shibo_node::{CanvasFacts, Context, EveryField, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::expression::{Compiled, Fault, Growth, PlaneOf};
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};
use std::any::Any;

/// The growth of a value that repeats.
const REPEATS: Growth = [Some(0.0); 2];

/// Computes a formula for every pixel.
#[node]
pub(crate) struct Formula {
    /// The fields that it reads.
    pub inputs: Vec<In<EveryField>>,
    /// The program.
    pub program: String,
    /// True if one formula alone reads the result, which does not change its values.
    #[serde(skip_serializing)]
    pub inner: bool,
}

/// Growth of a plane on a canvas of this size. `inputs` gives that of a channel of an input.
fn growth(size: DVec2, plane: usize, inputs: impl Fn(usize, usize) -> Growth) -> Growth {
    match PlaneOf::number(plane) {
        PlaneOf::Place(0) => [Some(size.x), Some(0.0)],
        PlaneOf::Place(1) => [Some(0.0), Some(size.y)],
        PlaneOf::Place(2) => [Some(1.0), Some(0.0)],
        PlaneOf::Place(_) => [Some(0.0), Some(1.0)],
        PlaneOf::Channel { input, channel } => inputs(input, channel),
    }
}

/// The type of a field of so many components.
fn type_of(components: usize) -> Type {
    match components {
        1 => Type::Gray,
        2 => Type::Vec2,
        3 => Type::Rgb,
        _ => Type::Jacobian,
    }
}

impl Node for Formula {
    const OUTPUTS: &'static [Output] = &[Output::told("result", "The value of the formula.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.growth(canvas, &[]).map_or(Tiling::BOTH, |growth| where_all(&growth, |by| by == Some(0.0)))
    }

    fn growth(&self, canvas: &CanvasFacts, inputs: &[Vec<Growth>]) -> Option<Vec<Growth>> {
        let of = |input: usize, channel: usize| inputs.get(input).and_then(|input| input.get(channel)).copied();
        let plane = |plane| growth(canvas.size_mm(), plane, |input, channel| of(input, channel).unwrap_or(REPEATS));
        // If all repeats that it reads, so does the result.
        if let Some(components) = Compiled::components_over(&self.program, &|read| plane(read) == REPEATS) {
            return Some(vec![REPEATS; components]);
        }
        Some(program(&self.program).ok()?.growth(&plane))
    }

    fn type_of_output(&self, _inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        program(&self.program).map(|program| type_of(program.components())).map_err(|problem| vec![problem])
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let fields = cx.get_all(&self.inputs)?;
        let formula = fused::Formula::fused(program(&self.program)?, &fields, self.inner, formula_of, same);
        Ok(Outputs::one(field(formula, cx.size_mm(), cx.tiling())?))
    }
}

/// The formula that computes a field, if one does.
fn formula_of(field: &Field) -> Option<&fused::Formula<Field>> {
    source_of(field).map(|source| &source.formula)
}

fn source_of(field: &Field) -> Option<&Source> {
    field.source().for_reader()?.downcast_ref()
}

/// Returns true if two fields have the same values because they have the same key.
fn same(a: &Field, b: &Field) -> bool {
    a.key().is_some() && a.key() == b.key()
}

/// The field of a formula on a canvas of this size, which tiles as `tile` and the fields that it reads do.
fn field(formula: fused::Formula<Field>, size: DVec2, mut tile: Tiling) -> Result<Field, Stop> {
    let fields = &formula.inputs;
    let compiled = formula.program.known(&|plane| match PlaneOf::number(plane) {
        PlaneOf::Channel { input, channel } => {
            fields.get(input)?.as_constant()?.get(channel).map(|value| f64::from(*value))
        }
        PlaneOf::Place(_) => None,
    });
    let ty = type_of(compiled.components());
    let grown = |plane| growth(size, plane, |input, channel| grows(&formula.inputs[input], channel));
    let growth = compiled.growth(&grown);
    let problem = |fault: Fault| Problem::new(fault.code, fault.message);
    let program = compiled.program(&grown, [tile.x, tile.y]).map_err(problem)?;
    if program.planes.is_empty() {
        let mut values = vec![[0.0]; program.results.len()];
        let mut out: Vec<&mut [f32]> = values.iter_mut().map(|value| value.as_mut_slice()).collect();
        Machine::new(&program).run(&[], &mut out);
        return Ok(Field::constant(ty, &values.concat()));
    }
    let mut read: Vec<usize> = Vec::new();
    let mut planes = Vec::new();
    for &plane in &program.planes {
        planes.push(match PlaneOf::number(plane) {
            PlaneOf::Place(place @ (0 | 1)) => Plane::Place(place, 1.0),
            PlaneOf::Place(place) => Plane::Place(place % 2, size[place % 2]),
            PlaneOf::Channel { input, channel } => {
                let known = read.iter().position(|known| *known == input);
                let index = known.unwrap_or_else(|| {
                    read.push(input);
                    read.len() - 1
                });
                Plane::Channel(index, channel)
            }
        });
    }
    let fields: Vec<Field> = read.into_iter().filter_map(|input| fields.get(input).cloned()).collect();
    let read = fields.iter().fold(Tiling::BOTH, |tiling, field| tiling.and(steady(field)));
    let even = read.and(where_all(&growth, |by| by.is_some()));
    tile = tile.and(read).and(where_all(&growth, |by| by == Some(0.0)));
    Ok(Field::new(ty, tile, Source { formula, machine: Machine::new(&program), growth, even, planes, fields }))
}

/// The growth of a channel of a field. It counts as 0 where it is unknown; [`steady`] says if it is.
fn grows(field: &Field, channel: usize) -> Growth {
    let known = source_of(field).and_then(|source| source.growth.get(channel)).copied().unwrap_or(REPEATS);
    known.map(|by| Some(by.unwrap_or(0.0)))
}

/// The directions in which a field repeats, or grows evenly, so that a formula of it can repeat.
fn steady(field: &Field) -> Tiling {
    source_of(field).map_or(field.tiling(), |source| source.even)
}

/// The directions in which this holds for all components.
fn where_all(growth: &[Growth], holds: impl Fn(Option<f64>) -> bool) -> Tiling {
    let [x, y] = [0, 1].map(|axis| growth.iter().all(|by| holds(by[axis])));
    Tiling { x, y }
}

/// Where the values of a plane come from.
#[derive(Clone, Copy, Debug)]
enum Plane {
    /// The position: along which axis, and how many mm are 1.
    Place(usize, f64),
    /// A channel of one of the fields.
    Channel(usize, usize),
}

struct Source {
    formula: fused::Formula<Field>,
    machine: Machine,
    /// The growth of each component, where the fields that it reads repeat or grow evenly.
    growth: Vec<Growth>,
    /// The directions in which it repeats or grows evenly.
    even: Tiling,
    planes: Vec<Plane>,
    /// The fields that the program reads.
    fields: Vec<Field>,
}

impl Source {
    /// The first pixel of the canvas that has a result that is not finite, if the window has other pixels as well.
    fn first_on_canvas(&self, planes: &[&[f32]], (grid, window): (&Grid, Window), components: usize) -> Option<usize> {
        let inside = window.overlap(&Window::full(grid.picture()?)).filter(|inside| *inside != window)?;
        let offset = |at: i32, start: i32| usize::try_from(at - start).unwrap_or(0);
        let (width, columns) = (window.width as usize, inside.width as usize);
        let (left, top) = (offset(inside.x, window.x), offset(inside.y, window.y));
        let starts = (0..inside.height as usize).map(|row| (top + row) * width + left);
        let cut = |plane: &&[f32]| starts.clone().flat_map(|start| &plane[start..start + columns]).copied().collect();
        let cut: Vec<Vec<f32>> = planes.iter().map(cut).collect();
        let mut results = vec![vec![0.0; inside.len()]; components];
        let mut results: Vec<&mut [f32]> = results.iter_mut().map(Vec::as_mut_slice).collect();
        let pixel = self.machine.run(&cut.iter().map(Vec::as_slice).collect::<Vec<_>>(), &mut results)?;
        Some((top + pixel / columns) * width + left + pixel % columns)
    }
}

impl FieldSource for Source {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.fields.iter().map(|field| Read::new(field, grid, window)).collect()
    }

    #[expect(clippy::cast_possible_truncation, reason = "fields hold f32")]
    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window, width) = (out.grid, out.window, out.width());
        let place = |axis: usize, unit: f64| {
            let at = |i: usize| {
                let i = i32::try_from(i).unwrap_or(i32::MAX);
                (grid.center(window.x + i, window.y + i)[axis] / unit) as f32
            };
            match axis {
                0 => (0..width).map(at).collect::<Vec<_>>().repeat(out.height()),
                _ => (0..out.height()).flat_map(|row| std::iter::repeat_n(at(row), width)).collect(),
            }
        };
        let made: Vec<Vec<f32>> = self
            .planes
            .iter()
            .map(|plane| match plane {
                Plane::Place(axis, unit) => place(*axis, *unit),
                Plane::Channel(..) => Vec::new(),
            })
            .collect();
        let planes: Vec<&[f32]> = self
            .planes
            .iter()
            .zip(&made)
            .map(|(plane, made)| match plane {
                Plane::Place(..) => made.as_slice(),
                Plane::Channel(field, channel) => given.tile(*field).plane(*channel),
            })
            .collect();
        let bad = self.machine.run(&planes, &mut out.planes_mut());
        if let Some(first) = bad {
            let pixel = self.first_on_canvas(&planes, (&grid, window), out.channels()).unwrap_or(first);
            let [x, y] = [pixel % width, pixel / width].map(|i| i32::try_from(i).unwrap_or(0));
            let at = grid.center(window.x + x, window.y + y);
            let problem = not_finite(&format!("x = {:.3}, y = {:.3}", at.x, at.y));
            given.warn(problem.at_mm([at.x, at.y, 0.0]));
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }

    fn for_reader(&self) -> Option<&dyn Any> {
        Some(self)
    }
}
