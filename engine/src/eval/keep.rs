//! Decides which results to store beyond the process: time saved later, weighed against the time to write.
//!
//! Every result has a *debt*: the CPU time needed to recompute it from stored results. The debt is the result's own
//! time plus the debts of its inputs; the debt of a stored result is zero. A tile is stored if
//!
//! ```text
//! min(debt, computed − charged) ≥ R · write        R = (pixels / 1024²)⁴, at least 1 and at most 32
//! ```
//!
//! - `write` is the time to write the tile: its bytes, plus a fixed overhead per entry, at the rate measured so far in
//!   this process.
//! - `pixels` counts the whole picture. Small pictures store every tile that takes longer to compute than to write, so
//!   that an edit recomputes only nodes downstream of it. A large picture has hundreds of MB of tiles; writing all of
//!   them would take half as long as computing them, so a stored tile must save up to 32 times its writing.
//! - `computed` is the time of all code of nodes so far. Every stored tile adds `R · write` to `charged`, so all
//!   writing together takes at most `1 / R` of the computing, even if several readers count the same debt.
//!
//! An edit then recomputes less than `R · write` upstream of it, for each field read there.
//!
//! Objects are few and small, and often take seconds to compute: an object is stored if it took longer than to write
//! it, and at least [`OBJECT`]. Encoded pictures are always stored, so a second run computes nothing.
use super::demand::{At, at, reads};
use crate::value::{Field, Grid, TILE, Window};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// An object that takes less time is not stored.
const OBJECT: Duration = Duration::from_micros(700);
/// Pictures of at most this many pixels store every tile that takes longer to compute than to write.
const SMALL: f64 = 1024.0 * 1024.0;
/// Upper limit of the factor `R`: how many times its own writing a stored tile must save.
const MOST: f64 = 32.0;
/// Overhead of an entry: creating, sealing and naming it takes as long as writing this many bytes.
const ENTRY: f64 = 65_536.0;
/// Prior for the write rate: seconds per byte, and the number of measured bytes that weigh as much as this prior.
const RATE: (f64, f64) = (0.9e-3 / 1_048_576.0, 32.0 * 1_048_576.0);
/// A single field may take at most one part in this many of a store.
const SHARE_OF_ROOM: u64 = 32;
/// Number of fields whose debts are remembered.
const REMEMBERED: usize = 1 << 16;

/// Area of a window in mm², a unit that all grids have in common.
fn area(grid: &Grid, window: Window) -> f64 {
    window.len() as f64 * grid.step.x * grid.step.y
}

/// Decides whether results are stored. Lives as long as the caches, so one run profits from the measurements of the
/// last.
#[derive(Default)]
pub(super) struct CachePolicy(Mutex<State>);

#[derive(Default)]
struct State {
    /// Debt of each field in seconds per mm².
    debts: HashMap<At, f64>,
    /// Seconds of all node code so far.
    computed: f64,
    /// Seconds charged for stored tiles and objects.
    charged: f64,
    /// Seconds and bytes of all writing; each entry counts `ENTRY` extra bytes.
    written: (f64, f64),
}

impl State {
    /// Estimated seconds to write `bytes`.
    fn write(&self, bytes: u64) -> f64 {
        let (rate, weight) = RATE;
        (bytes as f64 + ENTRY) * (rate * weight + self.written.0) / (weight + self.written.1)
    }

    fn pay(&mut self, debt: f64, price: f64) -> bool {
        let worth = debt.min(self.computed - self.charged) >= price;
        self.charged += if worth { price } else { 0.0 };
        worth
    }
}

impl CachePolicy {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records that `window` of a field was computed, with `own` spent in its own code, and returns its debt. Must be
    /// called for every field whose code runs, even if its tiles are not stored.
    pub(super) fn filled(&self, field: &Field, grid: &Grid, window: Window, own: Duration) -> Duration {
        let area = area(grid, window);
        let mut inputs: Vec<At> = Vec::new();
        for input in reads(field, grid).map(|read| at(read.field, &read.grid)) {
            if !inputs.contains(&input) {
                inputs.push(input);
            }
        }
        let mut state = self.state();
        state.computed += own.as_secs_f64();
        let inputs: f64 = inputs.iter().filter_map(|input| state.debts.get(input)).sum();
        // Recomputing everything takes no longer than it did the first time.
        let debt = (own.as_secs_f64() + inputs * area).min(state.computed);
        if state.debts.len() >= REMEMBERED {
            state.debts.clear();
        }
        let known = state.debts.entry(at(field, grid)).or_insert(debt / area);
        *known += (debt / area - *known) / 4.0;
        Duration::from_secs_f64(debt)
    }

    /// The debt of a window that was computed in parts.
    pub(super) fn owed(&self, field: &Field, grid: &Grid, window: Window) -> Duration {
        let state = self.state();
        let owed = state.debts.get(&at(field, grid)).map_or(0.0, |debt| debt * area(grid, window));
        Duration::from_secs_f64(owed.min(state.computed))
    }

    /// Returns true if a tile should be stored in a store with this much room; the caller must then write it.
    pub(super) fn tile(&self, field: &Field, grid: &Grid, bytes: usize, debt: Duration, room: u64) -> bool {
        if !fits(field, grid, room) {
            return false;
        }
        let mut state = self.state();
        let price = state.write(bytes as u64) * times(grid);
        let worth = state.pay(debt.as_secs_f64(), price);
        if worth {
            state.debts.insert(at(field, grid), 0.0);
        }
        worth
    }

    /// Records that a node spent `time` on objects.
    pub(super) fn made(&self, time: Duration) {
        self.state().computed += time.as_secs_f64();
    }

    /// Returns true if an object of about `bytes` bytes should be stored.
    pub(super) fn object(&self, bytes: usize, time: Duration) -> bool {
        let mut state = self.state();
        let price = state.write(bytes as u64);
        let worth = time >= OBJECT && time.as_secs_f64() >= price;
        state.charged += if worth { price } else { 0.0 };
        worth
    }

    /// Records the time of a write.
    pub(super) fn wrote(&self, bytes: usize, time: Duration) {
        let mut state = self.state();
        state.written.0 += time.as_secs_f64();
        state.written.1 += bytes as f64 + ENTRY;
    }
}

/// Returns true if all tiles of a field fit into its share of the store. A field on a grid without a picture is
/// unbounded and never fits.
pub(super) fn fits(field: &Field, grid: &Grid, room: u64) -> bool {
    let pixels = grid.picture().map(|p| u64::from(p.x) * u64::from(p.y));
    pixels.is_some_and(|pixels| pixels * 4 * field.channels() as u64 <= room / SHARE_OF_ROOM)
}

/// The factor `R` of a grid: how many times its own writing a stored tile must save.
fn times(grid: &Grid) -> f64 {
    let whole = |pixels: u32| f64::from(pixels.max(TILE));
    let pixels = grid.picture().map_or(f64::INFINITY, |p| whole(p.x) * whole(p.y));
    (pixels / SMALL).powi(4).clamp(1.0, MOST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Halo, Key, Tiling, Type};
    use glam::{DVec2, UVec2};

    const SIDE: u32 = TILE;
    const BYTES: usize = (SIDE * SIDE * 4) as usize;
    const WINDOW: Window = Window { x: 0, y: 0, width: SIDE, height: SIDE };

    fn grid(pixels: u32) -> Grid {
        Grid { origin: DVec2::ZERO, step: DVec2::splat(0.1), period: Some(UVec2::splat(pixels)), shown: None }
    }

    fn keyed(field: Field, name: &str) -> Field {
        field.keyed(Key::of("test", &[name.as_bytes()]))
    }

    fn source(name: &str) -> Field {
        keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), name)
    }

    fn reader(inputs: [&Field; 2], name: &str) -> Field {
        keyed(Field::map(Type::Gray, inputs.map(Field::clone), Halo::px(1), |_, _| Ok(())), name)
    }

    /// The estimated time to write a tile before any measurement.
    fn writing() -> Duration {
        Duration::from_secs_f64(State::default().write(BYTES as u64))
    }

    /// A policy in whose process node code has run for this many seconds.
    fn after(seconds: f64) -> CachePolicy {
        let policy = CachePolicy::default();
        policy.made(Duration::from_secs_f64(seconds));
        policy
    }

    /// Fills a tile with `own` time in the field's code; returns true if the tile should be stored.
    fn fill(policy: &CachePolicy, field: &Field, grid: &Grid, own: Duration) -> bool {
        let debt = policy.filled(field, grid, WINDOW, own);
        policy.tile(field, grid, BYTES, debt, 1 << 40)
    }

    #[test]
    fn stores_tiles_of_small_pictures_that_take_longer_than_writing() {
        for pixels in [1, 256, 1024] {
            let policy = after(9.0);
            assert!(!fill(&policy, &source("a"), &grid(pixels), writing().mul_f64(0.9)), "{pixels}");
            assert!(fill(&policy, &source("b"), &grid(pixels), writing().mul_f64(1.1)), "{pixels}");
        }
    }

    #[test]
    fn stores_tiles_of_large_pictures_that_take_many_times_longer() {
        for (pixels, times) in [(1228, 4.278), (2048, 32.0), (16_384, 32.0)] {
            let policy = after(9.0);
            assert!(!fill(&policy, &source("a"), &grid(pixels), writing().mul_f64(0.99 * times)), "{pixels}");
            assert!(fill(&policy, &source("b"), &grid(pixels), writing().mul_f64(1.01 * times)), "{pixels}");
        }
    }

    #[test]
    fn sums_debts_until_a_tile_is_stored() {
        let (policy, grid, own) = (after(9.0), grid(2048), writing().mul_f64(10.0));
        let mut kept = Vec::new();
        let mut field = source("0");
        for name in 1..=8 {
            kept.push(fill(&policy, &field, &grid, own));
            // A reader that reads a field twice computes it once.
            field = reader([&field, &field], &name.to_string());
        }
        // The fourth field of a chain owes 40 times its writing; the fields after it start again from zero.
        assert_eq!(kept, [false, false, false, true, false, false, false, true]);
    }

    #[test]
    fn sums_debts_of_branches_in_proportion_to_their_area() {
        let (policy, grid) = (after(9.0), grid(2048));
        let (a, b) = (source("a"), source("b"));
        policy.filled(&a, &grid, WINDOW, writing().mul_f64(9.0));
        policy.filled(&b, &grid, WINDOW, writing().mul_f64(6.0));
        let debt = |window: Window| {
            let debt = policy.filled(&reader([&a, &b], "sum"), &grid, window, Duration::ZERO);
            debt.as_secs_f64() / writing().as_secs_f64()
        };
        assert!((debt(WINDOW) - 15.0).abs() < 0.01);
        assert!((debt(Window { height: SIDE / 4, ..WINDOW }) - 3.75).abs() < 0.01);
    }

    #[test]
    fn limits_writing_to_its_share_of_computing() {
        let (policy, grid) = (CachePolicy::default(), grid(2048));
        let dear = source("dear");
        let mut written = 0;
        // Each of these readers owes all the time of the source, which was computed once.
        policy.filled(&dear, &grid, WINDOW, writing().mul_f64(80.0));
        for i in 0..100 {
            let reader = reader([&dear, &dear], &i.to_string());
            written += u32::from(fill(&policy, &reader, &grid, Duration::ZERO));
        }
        assert_eq!(written, 2);
    }

    #[test]
    fn limits_debt_to_the_time_computed() {
        let (policy, grid) = (CachePolicy::default(), grid(2048));
        let (mut a, mut b) = (source("a"), source("b"));
        let own = Duration::from_micros(10);
        let mut debt = Duration::ZERO;
        for i in 0..2000 {
            let next = [reader([&a, &b], &format!("a{i}")), reader([&b, &a], &format!("b{i}"))];
            [&a, &b].into_iter().for_each(|field| debt = policy.filled(field, &grid, WINDOW, own));
            [a, b] = next;
        }
        assert!(debt <= Duration::from_millis(40) + own, "{debt:?}");
    }

    #[test]
    fn stores_less_in_slow_stores() {
        let (policy, grid) = (after(9.0), grid(1024));
        let own = writing().mul_f64(1.5);
        assert!(fill(&policy, &source("a"), &grid, own));
        for _ in 0..1000 {
            policy.wrote(BYTES, writing() * 4);
        }
        assert!(!fill(&policy, &source("b"), &grid, own));
        assert!(fill(&policy, &source("c"), &grid, own * 4));
    }

    #[test]
    fn stores_objects_that_take_longer_than_writing() {
        let policy = CachePolicy::default();
        assert!(policy.object(1000, Duration::from_millis(1)));
        assert!(!policy.object(1000, Duration::from_micros(600)));
        assert!(!policy.object(100 << 20, Duration::from_millis(50)));
        assert!(policy.object(100 << 20, Duration::from_millis(150)));
    }

    #[test]
    fn skips_tiles_of_too_large_or_unbounded_fields() {
        let (policy, field) = (after(9.0), source("a"));
        let endless = Grid { period: None, ..grid(256) };
        let debt = Duration::from_secs(5);
        assert!(!policy.tile(&field, &grid(256), BYTES, debt, 31 * BYTES as u64));
        assert!(!policy.tile(&field, &endless, BYTES, debt, 1 << 40));
        assert!(policy.tile(&field, &grid(256), BYTES, debt, 32 * BYTES as u64));
    }
}
