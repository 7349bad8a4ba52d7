//! What is worth keeping beyond the process: time spared later, weighed against the time to write.
//!
//! Every result has a *debt*: the CPU time that it takes to have it again when no result that is kept is made again. That is
//! its own time and the debts of what it reads, which are nothing for what is kept. A tile is kept when
//!
//! ```text
//! min(debt, computed − charged) ≥ R · write        R = (pixels / 1024²)⁴, at least 1 and at most 32
//! ```
//!
//! - `write` is the time to write it: its bytes, and some for the entry itself, at the rate measured so far in this process.
//! - `pixels` are those of the whole picture. Small pictures keep whatever takes longer than to write it, so that an edit
//!   computes nothing that is not downstream of it. A large one holds hundreds of MB of tiles, and writing them all would
//!   take half as long as computing them; there a kept tile stands for 32 times its writing.
//! - `computed` is the time of all code of nodes so far, and every kept tile charges `R · write`. So all writing together
//!   takes at most `1 / R` of the computing, however debts that several readers share are counted.
//!
//! What an edit makes again upstream of it is then less than `R · write` for each field that is read there.
//!
//! Objects are few and small, and often cost seconds: one is kept when it took longer than to write it, and at least
//! [`OBJECT`]. Encoded pictures are kept always: with them a second run computes nothing.
use super::demand::{At, at, reads};
use crate::value::{Field, Grid, TILE, Window};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// An object that takes less is made again.
const OBJECT: Duration = Duration::from_micros(700);
/// Of pictures with so many pixels, what takes longer than to write it is kept.
const SMALL: f64 = 1024.0 * 1024.0;
/// The most times that the writing of a kept tile must be saved.
const MOST: f64 = 32.0;
/// The bytes that could be written in the time that making, sealing and naming an empty entry takes.
const ENTRY: f64 = 65_536.0;
/// What is believed of the rate before anything is measured: seconds for a byte, and how many bytes' worth of measurements
/// that belief weighs.
const RATE: (f64, f64) = (0.9e-3 / 1_048_576.0, 32.0 * 1_048_576.0);
/// No single field may take more than this part of a store.
const SHARE_OF_ROOM: u64 = 32;
/// The debts of so many fields are remembered.
const REMEMBERED: usize = 1 << 16;

/// In mm², which all grids have in common.
fn area(grid: &Grid, window: Window) -> f64 {
    window.len() as f64 * grid.step.x * grid.step.y
}

/// Weighs results. Lives as long as the caches do, so that what one run learns the next one knows.
#[derive(Default)]
pub(super) struct Keeper(Mutex<State>);

#[derive(Default)]
struct State {
    /// Seconds for each mm² of a field.
    debts: HashMap<At, f64>,
    /// Seconds of all code of nodes.
    computed: f64,
    /// Seconds of that which kept results have been charged with.
    charged: f64,
    /// Seconds and bytes of all writing, each entry counting as `entry` more.
    written: (f64, f64),
}

impl State {
    /// The seconds that writing takes.
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

impl Keeper {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes that `window` of a field was computed, its own code having taken `own`, and gives its debt. To be told of every
    /// field that code runs for, whether its tiles are kept or not.
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
        // To compute everything again takes no longer than it did.
        let debt = (own.as_secs_f64() + inputs * area).min(state.computed);
        if state.debts.len() >= REMEMBERED {
            state.debts.clear();
        }
        let known = state.debts.entry(at(field, grid)).or_insert(debt / area);
        *known += (debt / area - *known) / 4.0;
        Duration::from_secs_f64(debt)
    }

    /// The debt of a window of a field that was computed in parts.
    pub(super) fn owed(&self, field: &Field, grid: &Grid, window: Window) -> Duration {
        let state = self.state();
        let owed = state.debts.get(&at(field, grid)).map_or(0.0, |debt| debt * area(grid, window));
        Duration::from_secs_f64(owed.min(state.computed))
    }

    /// Whether a tile of a field is to be kept in a store with so much room; if so, it is to be written.
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

    /// Notes that the code of a node took `time` for objects.
    pub(super) fn made(&self, time: Duration) {
        self.state().computed += time.as_secs_f64();
    }

    /// Whether an object of about so many bytes is to be kept.
    pub(super) fn object(&self, bytes: usize, time: Duration) -> bool {
        let mut state = self.state();
        let price = state.write(bytes as u64);
        let worth = time >= OBJECT && time.as_secs_f64() >= price;
        state.charged += if worth { price } else { 0.0 };
        worth
    }

    /// Notes what writing took.
    pub(super) fn wrote(&self, bytes: usize, time: Duration) {
        let mut state = self.state();
        state.written.0 += time.as_secs_f64();
        state.written.1 += bytes as f64 + ENTRY;
    }
}

/// True if all tiles of a field fit into its share of the store. A field on a grid without a picture has no bound.
pub(super) fn fits(field: &Field, grid: &Grid, room: u64) -> bool {
    let pixels = grid.picture().map(|p| u64::from(p.x) * u64::from(p.y));
    pixels.is_some_and(|pixels| pixels * 4 * field.channels() as u64 <= room / SHARE_OF_ROOM)
}

/// How many times the writing of a tile must be saved.
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

    /// The time to write a tile, of which nothing was measured yet.
    fn writing() -> Duration {
        Duration::from_secs_f64(State::default().write(BYTES as u64))
    }

    /// A keeper in whose process code has run for so many seconds.
    fn after(seconds: f64) -> Keeper {
        let keeper = Keeper::default();
        keeper.made(Duration::from_secs_f64(seconds));
        keeper
    }

    /// Whether a tile of a field whose code took `own` is kept.
    fn fill(keeper: &Keeper, field: &Field, grid: &Grid, own: Duration) -> bool {
        let debt = keeper.filled(field, grid, WINDOW, own);
        keeper.tile(field, grid, BYTES, debt, 1 << 40)
    }

    #[test]
    fn small_pictures_keep_what_takes_longer_than_to_write_it() {
        for pixels in [1, 256, 1024] {
            let keeper = after(9.0);
            assert!(!fill(&keeper, &source("a"), &grid(pixels), writing().mul_f64(0.9)), "{pixels}");
            assert!(fill(&keeper, &source("b"), &grid(pixels), writing().mul_f64(1.1)), "{pixels}");
        }
    }

    #[test]
    fn large_pictures_keep_what_takes_many_times_as_long() {
        for (pixels, times) in [(1228, 4.278), (2048, 32.0), (16_384, 32.0)] {
            let keeper = after(9.0);
            assert!(!fill(&keeper, &source("a"), &grid(pixels), writing().mul_f64(0.99 * times)), "{pixels}");
            assert!(fill(&keeper, &source("b"), &grid(pixels), writing().mul_f64(1.01 * times)), "{pixels}");
        }
    }

    #[test]
    fn debts_add_up_until_something_is_kept() {
        let (keeper, grid, own) = (after(9.0), grid(2048), writing().mul_f64(10.0));
        let mut kept = Vec::new();
        let mut field = source("0");
        for name in 1..=8 {
            kept.push(fill(&keeper, &field, &grid, own));
            // What reads a field twice makes it once.
            field = reader([&field, &field], &name.to_string());
        }
        // The fourth of a chain owes 40 times its writing; those after it begin anew.
        assert_eq!(kept, [false, false, false, true, false, false, false, true]);
    }

    #[test]
    fn several_branches_add_up_in_proportion_to_what_is_read() {
        let (keeper, grid) = (after(9.0), grid(2048));
        let (a, b) = (source("a"), source("b"));
        keeper.filled(&a, &grid, WINDOW, writing().mul_f64(9.0));
        keeper.filled(&b, &grid, WINDOW, writing().mul_f64(6.0));
        let debt = |window: Window| {
            let debt = keeper.filled(&reader([&a, &b], "sum"), &grid, window, Duration::ZERO);
            debt.as_secs_f64() / writing().as_secs_f64()
        };
        assert!((debt(WINDOW) - 15.0).abs() < 0.01);
        assert!((debt(Window { height: SIDE / 4, ..WINDOW }) - 3.75).abs() < 0.01);
    }

    #[test]
    fn writing_never_takes_more_than_its_part() {
        let (keeper, grid) = (Keeper::default(), grid(2048));
        let dear = source("dear");
        let mut written = 0;
        // Each of these readers owes all that `dear` took, which was computed once.
        keeper.filled(&dear, &grid, WINDOW, writing().mul_f64(80.0));
        for i in 0..100 {
            let reader = reader([&dear, &dear], &i.to_string());
            written += u32::from(fill(&keeper, &reader, &grid, Duration::ZERO));
        }
        assert_eq!(written, 2);
    }

    #[test]
    fn a_ladder_of_readers_owes_no_more_than_was_computed() {
        let (keeper, grid) = (Keeper::default(), grid(2048));
        let (mut a, mut b) = (source("a"), source("b"));
        let own = Duration::from_micros(10);
        let mut debt = Duration::ZERO;
        for i in 0..2000 {
            let next = [reader([&a, &b], &format!("a{i}")), reader([&b, &a], &format!("b{i}"))];
            [&a, &b].into_iter().for_each(|field| debt = keeper.filled(field, &grid, WINDOW, own));
            [a, b] = next;
        }
        assert!(debt <= Duration::from_millis(40) + own, "{debt:?}");
    }

    #[test]
    fn slow_stores_are_given_less() {
        let (keeper, grid) = (after(9.0), grid(1024));
        let own = writing().mul_f64(1.5);
        assert!(fill(&keeper, &source("a"), &grid, own));
        for _ in 0..1000 {
            keeper.wrote(BYTES, writing() * 4);
        }
        assert!(!fill(&keeper, &source("b"), &grid, own));
        assert!(fill(&keeper, &source("c"), &grid, own * 4));
    }

    #[test]
    fn objects_are_kept_when_they_took_longer_than_to_write_them() {
        let keeper = Keeper::default();
        assert!(keeper.object(1000, Duration::from_millis(1)));
        assert!(!keeper.object(1000, Duration::from_micros(600)));
        assert!(!keeper.object(100 << 20, Duration::from_millis(50)));
        assert!(keeper.object(100 << 20, Duration::from_millis(150)));
    }

    #[test]
    fn what_has_no_room_or_no_end_is_not_kept() {
        let (keeper, field) = (after(9.0), source("a"));
        let endless = Grid { period: None, ..grid(256) };
        let debt = Duration::from_secs(5);
        assert!(!keeper.tile(&field, &grid(256), BYTES, debt, 31 * BYTES as u64));
        assert!(!keeper.tile(&field, &endless, BYTES, debt, 1 << 40));
        assert!(keeper.tile(&field, &grid(256), BYTES, debt, 32 * BYTES as u64));
    }
}
