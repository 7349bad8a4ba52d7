//! The median over a disk of pixels.
//!
//! Small disks use forgetful selection: among a little more than half of the values, the least and the greatest cannot
//! be the median of all, so they are dropped and the next value is added, until three are left. That is a fixed
//! sequence of comparisons, done for 32 pixels at a time. Larger disks use a window that slides along the row (T.
//! Huang, G. Yang, G. Tang, 1979): the pixels of the tile are ranked once, and a bit set holds the ranks in the disk.
//! Both methods are exact and give the same values.
//!
//! Cost: see `benches/texel.rs`; for large disks O(pixels · radius in pixels).

use super::disk::Disk;
use crate::ground::math::{max, min};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::Window;

/// Up to this number of pixels selection is faster.
const SELECTED: usize = 49;

/// The median of the pixels of `disk` around each pixel of `rect`.
///
/// # Panics
/// If `input` does not cover `rect` grown by the disk's halo, or `out` is smaller than `rect`.
pub fn median(input: &View<'_>, rect: Window, disk: &Disk, out: &mut [f32]) {
    assert!(input.window().contains(&rect.with_halo(disk.halo())), "the window lacks its halo");
    let out = &mut out[..rect.len()];
    if out.is_empty() {
        return;
    }
    if disk.count() <= SELECTED {
        simd::dispatch(
            #[inline(always)]
            || select(input, rect, disk, out),
        );
    } else {
        slide(input, rect, disk, out);
    }
}

/// Number of pixels processed at a time.
const LANES: usize = 32;
type Lanes = [f32; LANES];

/// Orders two values: the smaller one goes to index `first`, which must be less than `second`.
#[inline(always)]
fn order(values: &mut [Lanes], first: usize, second: usize) {
    let (low, high) = values.split_at_mut(second);
    for (a, b) in low[first].iter_mut().zip(&mut high[0]) {
        (*a, *b) = (min(*a, *b), max(*a, *b));
    }
}

/// Moves the least value to the first index and the greatest to the last.
#[inline(always)]
fn extremes(values: &mut [Lanes]) {
    let n = values.len();
    for i in 0..n / 2 {
        order(values, i, n - 1 - i);
    }
    for i in 1..n.div_ceil(2) {
        order(values, 0, i);
    }
    for i in n / 2..n - 1 {
        order(values, i, n - 1);
    }
}

#[inline(always)]
fn select(input: &View<'_>, rect: Window, disk: &Disk, out: &mut [f32]) {
    let places: Vec<(i32, i32)> = disk.rows().flat_map(|(dy, half)| (-half..=half).map(move |dx| (dx, dy))).collect();
    let n = places.len();
    let most = n / 2 + 2;
    let mut values = [[0.0; LANES]; SELECTED / 2 + 2];
    for (y, out) in (rect.y..).zip(out.chunks_exact_mut(rect.columns())) {
        for (x, out) in (rect.x..).step_by(LANES).zip(out.chunks_mut(LANES)) {
            let fill = |to: &mut Lanes, (dx, dy): (i32, i32)| {
                to[..out.len()].copy_from_slice(input.row(x + dx, y + dy, out.len()));
            };
            if n == 1 {
                out.copy_from_slice(input.row(x, y, out.len()));
                continue;
            }
            values.iter_mut().zip(&places).take(most).for_each(|(to, place)| fill(to, *place));
            let mut left = most.min(n);
            for place in &places[left..] {
                extremes(&mut values[..left]);
                // Drops the greatest value, and replaces the least.
                left -= 1;
                fill(&mut values[0], *place);
            }
            extremes(&mut values[..left]);
            out.copy_from_slice(&values[1][..out.len()]);
        }
    }
}

/// The set of ranks in the window: a bit for each, and the number of bits set in each block.
struct Ranks {
    bits: Vec<u64>,
    blocks: Vec<u32>,
}

/// Number of words in a block.
const BLOCK: usize = 32;

impl Ranks {
    fn new(count: usize) -> Self {
        let words = count.div_ceil(64);
        Self { bits: vec![0; words], blocks: vec![0; words.div_ceil(BLOCK)] }
    }

    #[inline(always)]
    fn add(&mut self, rank: u32) {
        let word = rank as usize / 64;
        self.bits[word] |= 1 << (rank % 64);
        self.blocks[word / BLOCK] += 1;
    }

    #[inline(always)]
    fn remove(&mut self, rank: u32) {
        let word = rank as usize / 64;
        self.bits[word] &= !(1 << (rank % 64));
        self.blocks[word / BLOCK] -= 1;
    }

    fn clear(&mut self) {
        self.bits.fill(0);
        self.blocks.fill(0);
    }

    /// The rank in the window that has `below` smaller ranks in the window.
    fn find(&self, mut below: u32) -> usize {
        let mut block = 0;
        while self.blocks[block] <= below {
            below -= self.blocks[block];
            block += 1;
        }
        let mut word = block * BLOCK;
        while self.bits[word].count_ones() <= below {
            below -= self.bits[word].count_ones();
            word += 1;
        }
        let mut bits = self.bits[word];
        for _ in 0..below {
            bits &= bits - 1;
        }
        word * 64 + bits.trailing_zeros() as usize
    }
}

fn slide(input: &View<'_>, rect: Window, disk: &Disk, out: &mut [f32]) {
    let [hx, hy] = disk.halo();
    let big = rect.with_halo([hx, hy]);
    let mut values = Vec::with_capacity(big.len());
    (big.y..).take(big.rows()).for_each(|y| values.extend_from_slice(input.row(big.x, y, big.columns())));
    let count = u32::try_from(values.len()).expect("a window has fewer than 2^32 pixels");
    let mut order: Vec<u32> = (0..count).collect();
    order.sort_unstable_by(|a, b| values[*a as usize].total_cmp(&values[*b as usize]).then(a.cmp(b)));
    let mut ranks = vec![0; values.len()];
    for (rank, pixel) in (0..count).zip(&order) {
        ranks[*pixel as usize] = rank;
    }
    let rows: Vec<(usize, usize)> = disk.rows().map(|(dy, half)| (offset(dy + index(hy)), offset(half))).collect();
    let half = u32::try_from(disk.count() / 2).expect("a disk has fewer than 2^32 pixels");
    let mut window = Ranks::new(values.len());
    for (y, out) in out.chunks_exact_mut(rect.columns()).enumerate() {
        window.clear();
        for (dy, reach) in &rows {
            let row = (y + dy) * big.columns() + hx;
            ranks[row - reach..=row + reach].iter().for_each(|rank| window.add(*rank));
        }
        for (x, out) in out.iter_mut().enumerate() {
            if x > 0 {
                for (dy, reach) in &rows {
                    let row = (y + dy) * big.columns() + hx + x;
                    window.remove(ranks[row - reach - 1]);
                    window.add(ranks[row + reach]);
                }
            }
            *out = values[order[window.find(half)] as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    #[test]
    fn is_the_middle_of_the_ordered_values() {
        let rect = Window::of(-3, 5, 41, 13);
        let hash = Hash::new(3);
        for (radius, step) in [
            (0.5, [1.0, 1.0]),
            (1.0, [1.0, 1.0]),
            (2.0, [1.0, 1.0]),
            (3.0, [1.0, 1.0]),
            (4.0, [1.0, 1.0]),
            (4.0, [1.0, 0.7]),
            (6.5, [1.0, 1.0]),
            (9.0, [2.0, 1.0]),
        ] {
            let disk = Disk::new(radius, step);
            let big = rect.with_halo(disk.halo());
            // Half of the values have duplicates.
            let data: Vec<f32> = (0..big.len() as u64)
                .map(|k| if k % 2 == 0 { hash.unit_f32(k) } else { (hash.unit_f32(k) * 8.0).floor() / 8.0 })
                .collect();
            let view = View::new(&data, big);
            let mut out = vec![0.0; rect.len()];
            median(&view, rect, &disk, &mut out);
            for (k, got) in (0..).zip(&out) {
                let (x, y) = (rect.x + k % 41, rect.y + k / 41);
                let mut all: Vec<f32> = (-20..=20)
                    .flat_map(|dy| (-20..=20).map(move |dx| (dx, dy)))
                    .filter(|(dx, dy)| f64::hypot(f64::from(*dx) * step[0], f64::from(*dy) * step[1]) <= radius + 1e-9)
                    .map(|(dx, dy)| view.at(x + dx, y + dy))
                    .collect();
                all.sort_by(f32::total_cmp);
                assert_eq!(*got, all[all.len() / 2], "{radius} at {x} {y}");
            }
        }
    }
}
