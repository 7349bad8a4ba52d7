//! Which fields two parts of a picture hand to each other.
//!
//! What both read of a field, its overlap, can be left for the other part, or computed twice. To leave all of it writes several
//! times as much as is needed: once a height is there, nobody reads what it is made of. So fields are looked at from the pictures
//! upwards. One is left if that is cheaper than to compute what is still read of its overlap, with all that it is made of; then
//! nothing more is read for it.
use super::prepare::{At, at, reads};
use crate::value::{Cost, Field, Grid};
use std::collections::{HashMap, HashSet};

/// What is believed of a pixel: to write, read and check four bytes of it; to compute it pointwise; to compute it by any other code.
const HANDED: f64 = 3.0;
const POINTWISE: f64 = 1.0;
const COMPUTED: f64 = 6.0;

/// What a pixel of each field costs with all that it is made of; what several read they share.
pub(super) struct Prices(HashMap<At, f64>);

impl Prices {
    /// Of fields that come before what they read; `pictures` are read once more.
    pub(super) fn new(order: &[(&Field, Grid)], pictures: &[&Field], grid: &Grid) -> Self {
        let mut readers: HashMap<At, f64> = HashMap::new();
        let of = |(field, grid): &(&Field, Grid)| {
            reads(field, grid).map(|read| at(read.field, &read.grid)).collect::<HashSet<_>>()
        };
        let inputs: Vec<HashSet<At>> = order.iter().map(of).collect();
        let pictures = pictures.iter().map(|field| at(field, grid));
        inputs.iter().flatten().copied().chain(pictures).for_each(|read| *readers.entry(read).or_default() += 1.0);
        let mut prices: HashMap<At, f64> = HashMap::new();
        for ((field, grid), inputs) in order.iter().zip(&inputs).rev() {
            let share = |input: &At| Some(prices.get(input)? / readers.get(input)?);
            let mut inputs: Vec<f64> = inputs.iter().filter_map(share).collect();
            // In an order of their own, so that the sum is always the same.
            inputs.sort_by(f64::total_cmp);
            let own = match field.source().cost() {
                _ if field.as_constant().is_some() => 0.0,
                Cost::Pointwise => POINTWISE,
                Cost::Local => COMPUTED,
            };
            prices.insert(at(field, grid), own + inputs.iter().sum::<f64>());
        }
        Self(prices)
    }

    /// Whether a field is better left than computed, if `read` of the `overlap` pixels are read.
    pub(super) fn is_left(&self, field: &Field, grid: &Grid, overlap: u64, read: u64) -> bool {
        let price = self.0.get(&at(field, grid)).copied().unwrap_or(0.0);
        read as f64 * price > overlap as f64 * HANDED * field.channels() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Halo, Key, Tiling, Type};
    use glam::{DVec2, UVec2};

    #[test]
    fn prices_add_up_and_are_shared() {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(2048)), shown: None };
        let keyed = |field: Field, name: &str| field.keyed(Key::of("test", &[name.as_bytes()]));
        let source = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "a");
        let filter = |inputs: [&Field; 2], name: &str| {
            keyed(Field::map(Type::Gray, inputs.map(Field::clone), Halo::px(3), |_, _| Ok(())), name)
        };
        let left = filter([&source, &source], "left");
        let right = filter([&source, &source], "right");
        let both = filter([&left, &right], "both");
        let order = [&both, &left, &right, &source].map(|field| (field, grid));
        let prices = Prices::new(&order, &[&both], &grid);
        let price = |field: &Field| prices.0[&at(field, &grid)];
        let own = price(&source);
        assert_eq!(price(&left), COMPUTED + own / 2.0);
        assert_eq!(price(&both), 3.0 * COMPUTED + own);
        assert!(prices.is_left(&both, &grid, 100, 50));
        assert!(!prices.is_left(&both, &grid, 100, 5));
    }
}
