//! The fields of cuts through solids.
//!
//! Every solid that is read, directly or indirectly, becomes a field with its own key. So the tiles of a solid that
//! several solids or outputs read, such as the growth time of a tree, are computed once and cached.
use super::shown::{CutField, CutInput};
use super::solid::{Body, Solid};
use super::{Cut, Field, FieldId, Key, Type};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

type Id = (FieldId, FieldId);

/// A cache of cuts: each pair of a solid and a cut becomes one field.
#[derive(Default)]
pub struct Cuts(Mutex<Known>);

#[derive(Default)]
struct Known {
    /// The fields, with their solids and cuts. These are kept alive because an identity can be an address in memory.
    fields: HashMap<Id, (Field, Solid, Cut)>,
    /// The moved cuts, by the solid that moves the points and the original cut.
    moved: HashMap<Id, Cut>,
}

impl Cuts {
    /// The field of `cut` through `solid`.
    pub fn cut(&self, solid: &Solid, cut: &Cut) -> Field {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).cut(solid, cut)
    }
}

impl Known {
    fn get(&self, solid: &Solid, cut: &Cut) -> Option<&Field> {
        self.fields.get(&(solid.id(), cut.id())).map(|known| &known.0)
    }

    /// Uses a work-list instead of recursion, because solids may read each other in long chains.
    fn cut(&mut self, solid: &Solid, cut: &Cut) -> Field {
        let mut open = vec![(solid.clone(), cut.clone())];
        loop {
            let Some((top, at)) = open.last().cloned() else { break };
            if self.get(&top, &at).is_some() {
                open.pop();
                continue;
            }
            match self.make(&top, &at) {
                Ok(field) => {
                    self.fields.insert((top.id(), at.id()), (field, top, at));
                }
                Err(missing) => open.extend(missing),
            }
        }
        match self.get(solid, cut) {
            Some(field) => field.clone(),
            // Not reached, since the loop ends when the field is known. A constant avoids a panic.
            None => Field::constant(Type::Gray, &[0.0]),
        }
    }

    /// The field of a cut through one solid, or the cuts that must be made before.
    fn make(&mut self, solid: &Solid, cut: &Cut) -> Result<Field, Vec<(Solid, Cut)>> {
        let field = match solid.body() {
            Body::Moved { inner, place, keeps_z } => {
                let moved = self.moved(cut, place, *keeps_z)?;
                return self.get(inner, &moved).cloned().ok_or_else(|| vec![(inner.clone(), moved)]);
            }
            Body::Computed { source, inputs } => {
                let parts: Vec<(&Solid, Range<usize>)> = inputs.iter().map(Solid::whole).collect();
                let read = |(of, channels): &(&Solid, Range<usize>)| {
                    Some(CutInput { field: self.get(of, cut)?.clone(), channels: channels.clone() })
                };
                let Some(inputs) = parts.iter().map(read).collect() else {
                    let missing = parts.iter().filter(|(of, _)| self.get(of, cut).is_none());
                    return Err(missing.map(|(of, _)| ((*of).clone(), cut.clone())).collect());
                };
                let shown = CutField { source: source.clone(), inputs, cut: cut.clone() };
                Field::new(solid.field_type(), cut.tiling(), shown).overwriting()
            }
            Body::Channels { of, channels } => {
                let all = self.get(of, cut).cloned().ok_or_else(|| vec![(of.clone(), cut.clone())])?;
                all.pick(solid.field_type(), channels.clone())
            }
        };
        Ok(match solid.key().zip(cut.key()) {
            Some((key, cut)) => {
                field.keyed(Key::of("cut", &[key.as_bytes(), cut.as_bytes()])).owned_by(solid.owner().unwrap_or(key))
            }
            None => field,
        })
    }

    /// The cut whose points are those of `cut`, moved by `place`.
    fn moved(&mut self, cut: &Cut, place: &Solid, keeps_z: bool) -> Result<Cut, Vec<(Solid, Cut)>> {
        let id = (place.id(), cut.id());
        if let Some(moved) = self.moved.get(&id) {
            return Ok(moved.clone());
        }
        let shown = self.get(place, cut).cloned().ok_or_else(|| vec![(place.clone(), cut.clone())])?;
        let moved = cut.moved(place, shown, keeps_z);
        self.moved.insert(id, moved.clone());
        Ok(moved)
    }
}
