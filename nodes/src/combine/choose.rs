//! [`Choose`] and [`ChooseMaterial`]: one of several inputs at every pixel, chosen by the number of the piece there.
//!
//! Graph files cannot name them: `Each` makes them. A hash of the number chooses the input, so that pieces with
//! neighbouring numbers look unlike. Of each input a tile computes only the part that shows in it. Cost: a copy.
use crate::chosen::Chosen;
use shibo_kernel::ground::hash::Hash;
use shibo_node::{AnyField, Context, Fact, IdsField, In, Node, Output, Outputs, node};
use shibo_value::{Channel, Material, Stop, Type, Value};
use std::collections::BTreeSet;
use std::sync::Arc;

/// One of several fields at every pixel.
#[node]
pub struct Choose {
    /// Numbers of pieces.
    pub ids: In<IdsField>,
    /// Inputs to choose from.
    pub inputs: Vec<In<AnyField>>,
}

/// One of several materials at every pixel.
#[node]
pub struct ChooseMaterial {
    /// Numbers of pieces.
    pub ids: In<IdsField>,
    /// Materials to choose from.
    pub inputs: Vec<In<Material>>,
}

/// Index of the input, of `count`, that shows in the piece of this number.
#[expect(clippy::cast_possible_truncation, reason = "whole numbers, and a remainder that is smaller than `count`")]
fn choice(id: f32, count: usize) -> usize {
    (Hash::new((id.round() as i64).cast_unsigned()).u64(0) % count as u64) as usize
}

impl Node for Choose {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["inputs"], "What was chosen.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (ids, inputs) = (cx.get(&self.ids)?, cx.get_all(&self.inputs)?);
        let count = inputs.len();
        Ok(Outputs::one(Chosen::field(&ids, inputs, move |id| choice(id, count))))
    }
}

impl Node for ChooseMaterial {
    const OUTPUTS: &'static [Output] = &[Output::new("result", Type::Material, "What was chosen.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (ids, materials) = (cx.get(&self.ids)?, cx.get_all(&self.inputs)?);
        let all: BTreeSet<Channel> = materials.iter().flat_map(|m| m.channels().iter().map(|(c, _)| *c)).collect();
        let channels = all.into_iter().map(|channel| {
            let count = materials.len();
            let fields = materials.iter().map(|material| material.or_default(channel)).collect();
            (channel, Chosen::field(&ids, fields, move |id| choice(id, count)))
        });
        Ok(Outputs::one(Value::Material(Arc::new(Material::new(channels)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_inputs_are_chosen_about_equally_often() {
        let mut counts = [0; 5];
        (0_u16..5000).for_each(|id| counts[choice(f32::from(id), 5)] += 1);
        assert!(counts.iter().all(|count| (850..1150).contains(count)), "{counts:?}");
    }
}
