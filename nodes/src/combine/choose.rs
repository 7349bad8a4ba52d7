//! [`Choose`] and [`ChooseMaterial`]: at every pixel one of several inputs, by the number of the piece that it lies in; and what
//! [`Switch`](super::Switch) does with a field.
//!
//! They are no kinds in graph files: `Each` makes them. Which input shows is a hash of the number, so that neighbours with
//! neighbouring numbers are unlike. Of an input only the part is computed that shows in a tile. Cost: a copy.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::node::{AnyField, Context, Fact, IdsField, In, Node, Output, Outputs};
use shibo_engine::value::{
    Channel, Cost, Field, FieldSource, Given, Grid, Material, Read, Stop, Tile, Type, Value, Window,
};
use shibo_kernel::ground::hash::Hash;
use std::collections::BTreeSet;
use std::sync::Arc;

/// One of several fields at every pixel.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Choose {
    /// Numbers of pieces.
    pub ids: In<IdsField>,
    /// What to choose among.
    pub inputs: Vec<In<AnyField>>,
}

/// One of several materials at every pixel.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ChooseMaterial {
    /// Numbers of pieces.
    pub ids: In<IdsField>,
    /// What to choose among.
    pub inputs: Vec<In<Material>>,
}

/// Which of `count` inputs shows in the piece of this number.
#[expect(clippy::cast_possible_truncation, reason = "whole numbers, and a remainder that is smaller than `count`")]
fn choice(id: f32, count: usize) -> usize {
    (Hash::new((id.round() as i64).cast_unsigned()).u64(0) % count as u64) as usize
}

/// Which of `count` inputs shows where a field has a value.
pub(super) type Choice = fn(f32, usize) -> usize;

/// The smallest window of those pixels of a tile of ids where each of `count` inputs shows; an empty one where it does not.
fn shown(ids: &Tile, at: Window, count: usize, choice: Choice) -> Vec<Window> {
    let mut found: Vec<Option<[i32; 4]>> = vec![None; count];
    // Pieces are larger than pixels: most have the number of the one before.
    let mut last = (f32::NAN, 0);
    for (y, row) in (at.y..at.bottom()).enumerate() {
        for (x, id) in (at.x..at.right()).zip(ids.row(0, y)) {
            if *id != last.0 {
                last = (*id, choice(*id, count));
            }
            let [left, top, right, bottom] = found[last.1].get_or_insert([x, row, x, row]);
            (*left, *top, *right, *bottom) = ((*left).min(x), (*top).min(row), (*right).max(x), (*bottom).max(row));
        }
    }
    let empty = Window { x: at.x, y: at.y, width: 0, height: 0 };
    let window = |[left, top, right, bottom]: [i32; 4]| Window {
        x: left,
        y: top,
        width: (right - left).unsigned_abs() + 1,
        height: (bottom - top).unsigned_abs() + 1,
    };
    found.into_iter().map(|found| found.map_or(empty, window)).collect()
}

pub(super) struct Chosen {
    ids: Field,
    inputs: Vec<Field>,
    choice: Choice,
}

impl Chosen {
    /// Fields of one type, of which one shows at each pixel, by the value of another there.
    pub(super) fn field(ids: &Field, inputs: Vec<Field>, choice: Choice) -> Field {
        let Some(first) = inputs.first() else { return Field::constant(Type::Gray, &[0.0]) };
        if inputs.len() == 1 {
            return first.clone();
        }
        let tiling = inputs.iter().fold(ids.tiling(), |tiling, input| tiling.and(input.tiling()));
        Field::new(first.ty(), tiling, Self { ids: ids.clone(), inputs, choice })
    }
}

impl FieldSource for Chosen {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.ids, grid, window)]
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.inputs.iter().map(|input| Read::new(input, grid, window)).collect()
    }

    fn narrow(&self, given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        shown(given.tile(0), window, self.inputs.len(), self.choice)
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (ids, at) = (given.tile(0), out.window);
        let channels = out.channels();
        for (y, line) in (at.y..at.bottom()).enumerate() {
            let ids = ids.row(0, y);
            let mut x = 0;
            while x < ids.len() {
                // A run of pixels of one piece is copied at once.
                let run = ids[x..].iter().take_while(|id| **id == ids[x]).count().max(1);
                let input = given.tile(1 + (self.choice)(ids[x], self.inputs.len()));
                // The window of an input begins where it first shows.
                let row = (line - input.window.y).unsigned_abs() as usize;
                let from = (at.x - input.window.x + i32::try_from(x).unwrap_or_default()).unsigned_abs() as usize;
                for channel in 0..channels {
                    let width = at.width as usize;
                    let to = &mut out.plane_mut(channel)[y * width + x..y * width + x + run];
                    to.copy_from_slice(&input.row(channel, row)[from..from + run]);
                }
                x += run;
            }
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Local
    }
}

impl Node for Choose {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["inputs"], "What was chosen.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (ids, inputs) = (cx.get(&self.ids)?, cx.get_all(&self.inputs)?);
        Ok(Outputs::one(Chosen::field(&ids, inputs, choice)))
    }
}

impl Node for ChooseMaterial {
    const OUTPUTS: &'static [Output] = &[Output::new("result", Type::Material, "What was chosen.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (ids, materials) = (cx.get(&self.ids)?, cx.get_all(&self.inputs)?);
        let all: BTreeSet<Channel> = materials.iter().flat_map(|m| m.channels().iter().map(|(c, _)| *c)).collect();
        let channels = all.into_iter().map(|channel| {
            let fields = materials.iter().map(|material| material.or_default(channel)).collect();
            (channel, Chosen::field(&ids, fields, choice))
        });
        Ok(Outputs::one(Value::Material(Arc::new(Material::new(channels)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_input_is_read_where_it_shows() {
        let window = Window { x: 10, y: 20, width: 4, height: 2 };
        let mut ids = Tile::new(crate::testing::canvas().grid(glam::UVec2::splat(64)), window, 1);
        // Two numbers that choose different inputs of three.
        let other = (1_u16..).map(f32::from).find(|id| choice(*id, 3) != choice(0.0, 3)).unwrap();
        ids.data_mut().copy_from_slice(&[0.0, 0.0, other, 0.0, 0.0, 0.0, other, other]);
        let windows = shown(&ids, window, 3, choice);
        assert_eq!(windows[choice(0.0, 3)], window);
        assert_eq!(windows[choice(other, 3)], Window { x: 12, y: 20, width: 2, height: 2 });
        assert_eq!(windows.iter().filter(|window| window.is_empty()).count(), 1);
    }

    #[test]
    fn all_inputs_are_chosen_about_equally_often() {
        let mut counts = [0; 5];
        (0_u16..5000).for_each(|id| counts[choice(f32::from(id), 5)] += 1);
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
    }
}
