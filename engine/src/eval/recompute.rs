//! Compares the cost of recomputing a pixel of a field with the cost of handing it over to another part of the picture.
use super::demand::{At, Fields, at, reads};
use crate::value::{Cost, Field, Grid};
use std::collections::{HashMap, HashSet};

/// Assumed relative costs of a pixel: to write, read and check one channel (4 bytes); to compute it pointwise; to
/// compute it by any other code.
const HANDED: f64 = 3.0;
const POINTWISE: f64 = 1.0;
const COMPUTED: f64 = 6.0;

/// The cost of a pixel of each field, including its inputs. The cost of an input is divided among its readers.
pub(super) struct RecomputeCost(HashMap<At, f64>);

impl RecomputeCost {
    /// The costs of all fields below pictures. A picture counts as one more reader of its field.
    pub(super) fn of(fields: &Fields<'_>) -> Self {
        let mut readers: HashMap<At, f64> = HashMap::new();
        let of = |(field, grid): &(&Field, Grid)| {
            reads(field, grid).map(|read| at(read.field, &read.grid)).collect::<HashSet<_>>()
        };
        let inputs: Vec<HashSet<At>> = fields.order.iter().map(of).collect();
        let pictures = fields.pictures.iter().map(|field| at(field, &fields.grid));
        inputs.iter().flatten().copied().chain(pictures).for_each(|read| *readers.entry(read).or_default() += 1.0);
        let mut costs: HashMap<At, f64> = HashMap::new();
        for ((field, grid), inputs) in fields.order.iter().zip(&inputs).rev() {
            let share = |input: &At| Some(costs.get(input)? / readers.get(input)?);
            let mut inputs: Vec<f64> = inputs.iter().filter_map(share).collect();
            // Sorted, because the sum depends on the order and that of the set is random.
            inputs.sort_by(f64::total_cmp);
            let own = match field.source().cost() {
                _ if field.as_constant().is_some() => 0.0,
                Cost::Pointwise => POINTWISE,
                Cost::Local => COMPUTED,
            };
            costs.insert(at(field, grid), own + inputs.iter().sum::<f64>());
        }
        Self(costs)
    }

    /// True if recomputing `read` pixels of a field costs more than handing over all `overlap` pixels of it.
    pub(super) fn exceeds_handing(&self, field: &Field, grid: &Grid, overlap: u64, read: u64) -> bool {
        let cost = self.0.get(&at(field, grid)).copied().unwrap_or(0.0);
        read as f64 * cost > overlap as f64 * HANDED * field.channels() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Halo, Key, Tiling, Type};
    use glam::{DVec2, UVec2};

    #[test]
    fn adds_costs_and_divides_them_among_readers() {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(2048)), shown: None };
        let keyed = |field: Field, name: &str| field.keyed(Key::of("test", &[name.as_bytes()]));
        let source = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "a");
        let filter = |inputs: [&Field; 2], name: &str| {
            keyed(Field::map(Type::Gray, inputs.map(Field::clone), Halo::px(3), |_, _| Ok(())), name)
        };
        let left = filter([&source, &source], "left");
        let right = filter([&source, &source], "right");
        let both = filter([&left, &right], "both");
        let costs = RecomputeCost::of(&Fields::new(&[&both], &grid));
        let cost = |field: &Field| costs.0[&at(field, &grid)];
        let own = cost(&source);
        assert_eq!(cost(&left), COMPUTED + own / 2.0);
        assert_eq!(cost(&both), 3.0 * COMPUTED + own);
        assert!(costs.exceeds_handing(&both, &grid, 100, 50));
        assert!(!costs.exceeds_handing(&both, &grid, 100, 5));
    }
}
