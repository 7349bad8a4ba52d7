//! Placement of stamps, shared by `TileSampler` and `Scatter`.
use crate::degrees::sin_cos;
use crate::map::Map;
use glam::{DVec2, Vec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::scatter::set::{Stamp, StampSet};
use shibo_node::{Context, Direction, Gray, In, Range, choice};
use shibo_value::{Stop, Tiling};

/// The order in which stamps are drawn.
#[choice]
pub enum Order {
    /// The order of the rows, or of the points.
    #[default]
    Rows,
    /// The reverse order: the first stamps lie on top.
    Reverse,
    /// A random order.
    Random,
}

/// A stamp of several: its size in mm, and how often it is drawn relative to others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    pub(super) size: DVec2,
    pub(super) weight: f64,
}

/// Parameters that vary from stamp to stamp.
pub(super) struct StampPlan<'a> {
    /// The stamps to choose from; at least one.
    pub(super) choices: Vec<Choice>,
    pub(super) scale: Range,
    pub(super) turn: Range,
    pub(super) value: Range,
    pub(super) share: f64,
    pub(super) order: Order,
    pub(super) density: &'a Option<In<Gray>>,
    pub(super) scale_by: &'a Option<In<Gray>>,
    pub(super) direction: &'a Option<In<Direction>>,
}

/// Indices of the random numbers of a stamp; further ones place it in its layout.
const KEEP: u64 = 0;
const SCALE: u64 = 1;
const TURN: u64 = 2;
const VALUE: u64 = 3;
const ORDER: u64 = 4;
/// The first of two random numbers for its place.
pub(super) const PLACE: u64 = 5;
const CHOICE: u64 = 7;

/// The number of the choice for a random number in 0..1.
fn chosen(choices: &[Choice], random: f64) -> usize {
    let mut rest = random * choices.iter().map(|choice| choice.weight).sum::<f64>();
    let found = choices.iter().position(|choice| {
        rest -= choice.weight;
        rest < 0.0
    });
    found.unwrap_or(0)
}

impl StampPlan<'_> {
    /// The stamps at these places, on a canvas that repeats as `tiling` says. Place n uses the random numbers of
    /// `hash.with(n)`. `pitch` is the approximate distance between places.
    pub(super) fn stamps(
        &self,
        cx: &Context<'_>,
        places: impl Iterator<Item = DVec2>,
        (hash, pitch, tiling): (Hash, f64, Tiling),
    ) -> Result<StampSet, Stop> {
        let density = Map::read(cx, (self.density, "density"), pitch)?;
        let scale_by = Map::read(cx, (self.scale_by, "scale_by"), pitch)?;
        let direction = Map::read(cx, (self.direction, "direction"), pitch)?;
        let mut stamps = Vec::new();
        for (n, (id, center)) in (0u64..).zip((1u32..).zip(places)) {
            if n % 65_536 == 0 {
                cx.check()?;
            }
            let hash = hash.with(n);
            let keep = self.share * density.as_ref().map_or(1.0, |map| f64::from(map.at(center)));
            if hash.unit(KEEP) >= keep {
                continue;
            }
            let by = scale_by.as_ref().map_or(1.0, |map| f64::from(map.at(center).clamp(0.0, 1.0)));
            let scale = self.scale.at(hash.unit(SCALE)) * by;
            let turn = self.turn.at(hash.unit(TURN)) + direction.as_ref().map_or(0.0, |map| f64::from(map.at(center)));
            let (sin, cos) = sin_cos(turn);
            let picture = if self.choices.len() > 1 { chosen(&self.choices, hash.unit(CHOICE)) } else { 0 };
            stamps.push(Stamp {
                center,
                half: (self.choices[picture].size * 0.5 * scale).as_vec2(),
                turn: Vec2::new(narrow(cos), narrow(sin)),
                value: narrow(self.value.at(hash.unit(VALUE))),
                id,
                picture: u32::try_from(picture).unwrap_or(0),
            });
        }
        match self.order {
            Order::Rows => {}
            Order::Reverse => stamps.reverse(),
            Order::Random => stamps.sort_by_key(|s| (hash.with(u64::from(s.id) - 1).u64(ORDER), s.id)),
        }
        Ok(StampSet::new(stamps, (cx.size_mm(), tiling)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_decide_how_often_a_stamp_is_chosen() {
        let choices = [1.0, 0.0, 3.0].map(|weight| Choice { size: DVec2::ONE, weight });
        let mut counts = [0; 3];
        (0..4000).for_each(|n| counts[chosen(&choices, f64::from(n) / 4000.0)] += 1);
        assert_eq!(counts, [1000, 0, 3000]);
        assert_eq!(chosen(&[Choice { size: DVec2::ONE, weight: 0.0 }], 0.9), 0);
    }
}
