//! The fields of cuts through solids.
//!
//! Every solid that the cut one reads, directly or not, becomes a field with a key of its own. So the tiles of a solid that
//! several solids or outputs read, such as the growth time of a tree, are computed once and cached.
use super::solid::{Body, Patch, PatchPieces, Planes, Solid, SolidSource};
use super::{Cost, Cut, Field, FieldId, FieldSource, Given, Grid, Halo, Key, Pieces, Read, Stop, Tile, Type, Window};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

type Id = (FieldId, FieldId);

/// Cuts through solids, each made once: by the solid and by the cut.
#[derive(Default)]
pub struct Cuts(Mutex<Known>);

#[derive(Default)]
struct Known {
    /// The fields, with their solids and cuts. These are held because an identity can be an address in memory.
    fields: HashMap<Id, (Field, Solid, Cut)>,
    /// By what moves the points, and from which cut.
    moved: HashMap<Id, Cut>,
}

impl Cuts {
    /// The field that `cut` shows of `solid`.
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

    /// The cut through one solid, or those that must be made first.
    fn make(&mut self, solid: &Solid, cut: &Cut) -> Result<Field, Vec<(Solid, Cut)>> {
        let field = match solid.body() {
            Body::Moved { inner, place, keeps_z } => {
                let moved = self.moved(cut, place, *keeps_z)?;
                return self.get(inner, &moved).cloned().ok_or_else(|| vec![(inner.clone(), moved)]);
            }
            Body::Computed { source, inputs } => {
                let fields: Vec<Field> = inputs.iter().filter_map(|input| self.get(input, cut).cloned()).collect();
                if fields.len() < inputs.len() {
                    let missing = inputs.iter().filter(|input| self.get(input, cut).is_none());
                    return Err(missing.map(|input| (input.clone(), cut.clone())).collect());
                }
                let shown = Shown { source: source.clone(), inputs: fields, cut: cut.clone() };
                Field::new(solid.field_type(), cut.tiling(), shown).overwriting()
            }
            Body::Channels { of, channels } => {
                let all = self.get(of, cut).cloned().ok_or_else(|| vec![(of.clone(), cut.clone())])?;
                let channels = channels.clone();
                let pick = move |out: &mut Tile, [from]: [&Tile; 1]| {
                    for (plane, channel) in out.planes_mut().into_iter().zip(&*channels) {
                        plane.copy_from_slice(from.plane(*channel));
                    }
                    Ok(())
                };
                Field::map(solid.field_type(), [all], Halo::NONE, pick).overwriting()
            }
        };
        Ok(match solid.key().zip(cut.key()) {
            Some((key, cut)) => {
                field.keyed(Key::of("cut", &[key.as_bytes(), cut.as_bytes()])).owned_by(solid.owner().unwrap_or(key))
            }
            None => field,
        })
    }

    /// The cut through the points to which `place` moves those of `cut`.
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

/// The code of the field of a cut through a solid.
struct Shown {
    source: Arc<dyn SolidSource>,
    inputs: Vec<Field>,
    cut: Cut,
}

/// The smallest window of whole quads around `window`.
fn quads(window: Window) -> Window {
    let (x, y) = (window.x & !1, window.y & !1);
    let even = |from: i32, to: i32| (to.abs_diff(from) + 1) & !1;
    Window { x, y, width: even(x, window.right()), height: even(y, window.bottom()) }
}

impl Shown {
    /// The window that is computed: of whole quads, where the code needs them. At the border of a piece, the neighbours that
    /// tell the footprint of a pixel may be those of the next quad.
    fn window(&self, grid: &Grid, window: Window) -> Window {
        if !self.source.wants().quads || self.cut.pixel(grid) == 0.0 {
            return window;
        }
        let beside = if self.cut.pieces().is_some() { 2 } else { 0 };
        quads(window).grow(beside, beside)
    }

    /// The pieces of the cut, if the code must know them.
    fn pieces(&self) -> Option<&Pieces> {
        self.cut.pieces().filter(|_| self.source.wants().quads)
    }

    /// The metric of the cut, likewise.
    fn metric(&self) -> Option<&Field> {
        self.cut.metric().filter(|_| self.source.wants().quads)
    }

    fn compute(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        let mut tiles = given.tiles();
        let place = if self.source.wants().place { tiles.next() } else { None };
        let pieces = self.pieces().and_then(|pieces| {
            let ids = tiles.next()?.plane(0);
            let planes = pieces.planes.as_ref().and_then(|planes| Some((tiles.next()?, &planes.axes)));
            let planes = planes.map(|(turned, axes)| ([turned.plane(0), turned.plane(1)], axes));
            Some(PatchPieces { ids, planes })
        });
        let metric = self.metric().and_then(|_| tiles.next());
        let inputs: Vec<Planes<'_>> = tiles.map(|tile| Planes::new(tile.data(), window.len())).collect();
        let patch = Patch {
            place: place.map_or([&[]; 3], |tile| [tile.plane(0), tile.plane(1), tile.plane(2)]),
            columns: out.width(),
            rows: out.height(),
            level: self.cut.level(),
            flat: self.cut.flat(),
            pieces,
            metric: metric.map(|tile| [tile.plane(0), tile.plane(1), tile.plane(2)]),
            space: false,
            pixel: self.cut.pixel(&grid),
        };
        given.check()?;
        self.source.fill(&patch, &inputs, &mut out.planes_mut());
        Ok(())
    }
}

impl FieldSource for Shown {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let window = self.window(grid, window);
        let place = self.source.wants().place.then_some(self.cut.place());
        let pieces = self.pieces().into_iter();
        let pieces = pieces.flat_map(|p| std::iter::once(&p.ids).chain(p.planes.as_ref().map(|planes| &planes.turned)));
        place
            .into_iter()
            .chain(pieces)
            .chain(self.metric())
            .chain(&self.inputs)
            .map(|field| Read::new(field, grid, window))
            .collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let whole = self.window(&out.grid, out.window);
        if whole == out.window {
            return self.compute(given, out);
        }
        let mut larger = Tile::unset(out.grid, whole, out.channels());
        self.compute(given, &mut larger)?;
        out.copy_from(&larger, 0, 0);
        Ok(())
    }

    fn cost(&self) -> Cost {
        self.source.cost()
    }
}
