//! [`SolidFormula`]: a formula of solids and of the position in space. Cost: as for fields, for each point.
use super::{fused, not_finite, program};
use glam::DVec3;
use shibo_kernel::pointwise::expression::Machine;
use shibo_kernel::wood::solids::Code;
use shibo_node::{AnySolid, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::expression::{Compiled, Fault, ON_CANVAS, PlaneOf};
use shibo_value::{Patch, Planes, Solid, Stop, Type};

/// Computes a formula for every point in space.
#[node]
pub(crate) struct SolidFormula {
    /// The solids that it reads.
    pub inputs: Vec<In<AnySolid>>,
    /// The program.
    pub program: String,
    /// True if one formula alone reads the result, which does not change its values.
    #[serde(skip_serializing)]
    pub inner: bool,
}

impl Node for SolidFormula {
    const OUTPUTS: &'static [Output] = &[
        Output::told("result", "The value of the formula: a number, or a colour of three components."),
        Output::new("vector", Type::SolidVector, "Three components as a vector."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let inputs = cx.get_all(&self.inputs)?;
        let formula = fused::Formula::fused(program(&self.program)?, &inputs, self.inner, Solid::note, same);
        let result = solid(formula)?;
        let last = result.channels() - 1;
        let vector = result.pick(Type::SolidVector, &[0, 1.min(last), 2.min(last)]);
        Ok(Outputs::one(result).with("vector", vector))
    }
}

/// Returns true if two solids have the same values because they have the same key.
fn same(a: &Solid, b: &Solid) -> bool {
    a.key().is_some() && a.key() == b.key()
}

/// The solid of a formula.
fn solid(formula: fused::Formula<Solid>) -> Result<Solid, Stop> {
    let (compiled, inputs) = (&formula.program, formula.inputs.clone());
    let problem = |fault: Fault| Problem::new(fault.code, fault.message);
    let program = compiled.program(&|_| [Some(0.0); 2], [false; 2]).map_err(problem)?;
    let machine = Machine::new(&program);
    let planes: Vec<PlaneOf> = program.planes.iter().map(|plane| PlaneOf::number(*plane)).collect();
    let reads_places = planes.iter().any(|plane| matches!(plane, PlaneOf::Place(_)));
    let fill = move |patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]| {
        let planes: Vec<&[f32]> = planes
            .iter()
            .map(|plane| match plane {
                PlaneOf::Place(place) => patch.place[(place - ON_CANVAS).min(2)],
                PlaneOf::Channel { input, channel } => inputs[*input].plane(*channel),
            })
            .collect();
        if let (Some(_), Some(listener)) = (machine.run(&planes, out), patch.listener) {
            listener.0(not_finite("a point"));
        }
    };
    let code = if reads_places { Code::of_place(fill).passing() } else { Code::of_inputs(fill) };
    let exact = compiled.clone();
    let code = code.with_exact(move |at, inputs| values(&exact, at, inputs));
    let ty = if compiled.components() == 1 { Type::Solid } else { Type::SolidColor };
    // The note is the formula, so that formulas that read the solid can take it over.
    Ok(code.solid(ty, inputs).noted(formula))
}

/// The values in double precision, one channel after another.
fn values(compiled: &Compiled, at: &[DVec3], inputs: &[Vec<f64>]) -> Vec<f64> {
    let count = compiled.components();
    let mut values = vec![0.0; count * at.len()];
    let mut one = vec![0.0; count];
    for (index, point) in at.iter().enumerate() {
        let plane = |plane: usize| match PlaneOf::number(plane) {
            PlaneOf::Place(place) => point[place.saturating_sub(ON_CANVAS).min(2)],
            PlaneOf::Channel { input, channel } => {
                inputs[input].get(channel * at.len() + index).copied().unwrap_or(0.0)
            }
        };
        compiled.value_at(&plane, &mut one);
        for (channel, value) in one.iter().enumerate() {
            values[channel * at.len() + index] = if value.is_finite() { *value } else { 0.0 };
        }
    }
    values
}
