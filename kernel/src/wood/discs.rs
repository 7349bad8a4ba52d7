//! Evenly spread points without rows: Poisson discs on a torus, in the order in which they were placed.
//!
//! M. McCool and E. Fiume, "Hierarchical Poisson disk sampling distributions" (1992): darts are thrown at a torus and
//! rejected if closer to an earlier one than a distance, which shrinks as the torus fills. So every prefix of the list
//! is as even as the whole, and selecting a share of the points by their rank leaves no clumps and holes. A raster
//! gives the point nearest to a position with one look-up; it is exact where the nearest point is nearer than half the
//! distance of points less a twelfth of a cell. Made once, in about 10 ms; 130 KB.
use crate::ground::hash::Hash;
use crate::ground::math;
use std::sync::OnceLock;

/// Number of cells along a side of the torus; a cell has one point on average.
pub const SIDE: u16 = 32;

/// Number of points.
const COUNT: usize = SIDE as usize * SIDE as usize;

/// Raster positions along a side of a cell.
const FINE: u16 = 8;

/// Raster positions along a side of the torus.
const RASTER: usize = SIDE as usize * FINE as usize;

/// Initial distance of points, times the root of their number; 0.83 fills the torus.
const NEAR: f32 = 0.76;

/// Number of misses after which the distance shrinks.
const MISSES: u32 = 300;

/// Points on a torus of [`SIDE`] cells.
#[derive(Debug)]
pub struct Discs {
    places: Vec<[f32; 2]>,
    nearest: Vec<u16>,
}

/// The point nearest to a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Id of the point, different for each repetition of the torus.
    pub id: [i32; 2],
    /// Its rank in the order of placing, 0..1.
    pub rank: f32,
    /// Its position, in cells.
    pub at: [f32; 2],
}

/// The difference of two coordinates on the torus.
fn apart(a: f32, b: f32) -> f32 {
    let side = f32::from(SIDE);
    let d = a - b;
    d - side * (d / side + 0.5).floor()
}

fn square(a: [f32; 2], b: [f32; 2]) -> f32 {
    let (x, y) = (apart(a[0], b[0]), apart(a[1], b[1]));
    x * x + y * y
}

/// The points of each cell of the torus.
struct Cells(Vec<Vec<u16>>);

impl Cells {
    #[expect(clippy::cast_possible_truncation, reason = "within the torus")]
    fn cell(at: [f32; 2]) -> [i32; 2] {
        at.map(|v| v.floor() as i32)
    }

    fn index([x, y]: [i32; 2]) -> usize {
        let side = i32::from(SIDE);
        (y.rem_euclid(side) * side + x.rem_euclid(side)).cast_unsigned() as usize
    }

    /// The points at most `reach` cells away, and some more.
    fn around(&self, at: [f32; 2], reach: i32) -> impl Iterator<Item = u16> + '_ {
        let [x, y] = Self::cell(at);
        let rows = (-reach..=reach).flat_map(move |j| (-reach..=reach).map(move |i| [x + i, y + j]));
        rows.flat_map(|cell| self.0[Self::index(cell)].iter().copied())
    }
}

impl Discs {
    /// Returns the points, a shared constant.
    pub fn get() -> &'static Self {
        static DISCS: OnceLock<Discs> = OnceLock::new();
        DISCS.get_or_init(Self::new)
    }

    fn new() -> Self {
        let (hash, side) = (Hash::new(0x0b5e_55ed), f32::from(SIDE));
        let mut places: Vec<[f32; 2]> = Vec::with_capacity(COUNT);
        let mut cells = Cells(vec![Vec::new(); COUNT]);
        let (mut dart, mut misses, mut near) = (0, 0, NEAR);
        while places.len() < COUNT {
            let at = [0, 1].map(|k| side * hash.unit_f32(2 * dart + k)).map(|v| if v < side { v } else { 0.0 });
            dart += 1;
            let distance = near * side / ((places.len() + 1) as f32).sqrt();
            let far = |i: u16| square(places[usize::from(i)], at) >= distance * distance;
            #[expect(clippy::cast_possible_truncation, reason = "at most the torus")]
            let reach = distance.ceil() as i32;
            // While there are few points, testing all is cheaper than testing many cells.
            let free = if places.len() < 400 {
                places.iter().all(|place| square(*place, at) >= distance * distance)
            } else {
                cells.around(at, reach).all(far)
            };
            if free {
                #[expect(clippy::cast_possible_truncation, reason = "there are 1024")]
                cells.0[Cells::index(Cells::cell(at))].push(places.len() as u16);
                places.push(at);
                misses = 0;
            } else {
                misses += 1;
                if misses > MISSES {
                    (near, misses) = (near * 0.99, 0);
                }
            }
        }
        let step = 1.0 / f32::from(FINE);
        let nearest = |k: usize| {
            let at = [k % RASTER, k / RASTER].map(|v| (v as f32 + 0.5) * step);
            let mut best = (f32::INFINITY, 0);
            // The nearest point is nearly always in the cells around.
            for reach in [1, 2] {
                if best.0 > 1.0 {
                    for i in cells.around(at, reach) {
                        let d = square(places[usize::from(i)], at);
                        best = if d < best.0 { (d, i) } else { best };
                    }
                }
            }
            best.1
        };
        let nearest = (0..RASTER * RASTER).map(nearest).collect();
        Self { places, nearest }
    }

    /// The point nearest to a position, in cells.
    #[inline(always)]
    pub fn near(&self, x: f32, y: f32) -> Near {
        let ((_, ix), (_, iy)) = (math::floor_int(x * f32::from(FINE)), math::floor_int(y * f32::from(FINE)));
        let on = |i: i32| i.cast_unsigned() as usize % RASTER;
        let index = self.nearest[on(iy) * RASTER + on(ix)];
        let place = self.places[usize::from(index)];
        let side = f32::from(SIDE);
        // The repetition of the torus that is nearest.
        let turn = |v: f32, place: f32| math::floor_int((v - place) * (1.0 / side) + 0.5);
        let ((tx, cx), (ty, cy)) = (turn(x, place[0]), turn(y, place[1]));
        let at = [place[0] + tx * side, place[1] + ty * side];
        let rank = f32::from(index) * (1.0 / COUNT as f32);
        Near { id: [cx.wrapping_mul(i32::from(SIDE) * i32::from(SIDE)).wrapping_add(i32::from(index)), cy], rank, at }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every prefix of the list keeps its distance: no clumps, whatever share of the points is selected.
    #[test]
    fn keeps_every_prefix_even() {
        let discs = Discs::get();
        for n in [64, 400, COUNT] {
            let cell = f32::from(SIDE) / (n as f32).sqrt();
            let places = &discs.places[..n];
            let own = |i: usize| {
                let others = places.iter().enumerate().filter(|(j, _)| *j != i);
                others.map(|(_, p)| square(*p, places[i])).fold(f32::INFINITY, f32::min).sqrt() / cell
            };
            let all: Vec<f32> = (0..n).step_by(n.div_ceil(400)).map(own).collect();
            let least = all.iter().copied().fold(f32::INFINITY, f32::min);
            assert!(least > 0.68, "{n}: {least}");
        }
    }

    /// The spectrum of the points has no peak, so there are no rows. A jittered grid has peaks.
    #[test]
    fn has_no_peak_in_spectrum() {
        let discs = Discs::get();
        let power = |u: f64, v: f64| {
            let (mut re, mut im) = (0.0, 0.0);
            for [x, y] in &discs.places {
                let (s, c) =
                    (std::f64::consts::TAU * (u * f64::from(*x) + v * f64::from(*y)) / f64::from(SIDE)).sin_cos();
                (re, im) = (re + c, im + s);
            }
            (re * re + im * im) / COUNT as f64
        };
        let side = f64::from(SIDE);
        for (u, v) in [(side, 0.0), (0.0, side), (side, side), (side, -side)] {
            assert!(power(u, v) < 20.0, "{u} {v} {}", power(u, v));
        }
        // Nearly no power in long waves, so there are no clumps.
        let long = (1..=16).map(|k| power(f64::from(k), 0.0) + power(0.0, f64::from(k))).sum::<f64>() / 32.0;
        assert!(long < 0.15, "{long}");
    }

    #[test]
    fn the_raster_finds_the_nearest() {
        let discs = Discs::get();
        let hash = Hash::new(5);
        for k in 0..2000 {
            let at = [0, 1].map(|c| 900.0 * hash.unit_f32(2 * k + c) - 450.0);
            let near = discs.near(at[0], at[1]);
            let found = (near.at[0] - at[0]).hypot(near.at[1] - at[1]);
            let on = at.map(|v| v.rem_euclid(f32::from(SIDE)));
            let least = discs.places.iter().map(|p| square(*p, on)).fold(f32::INFINITY, f32::min).sqrt();
            assert!(found < least + 0.18, "{found} {least}");
            assert!(least > 0.27 || (found - least).abs() < 1e-3, "{found} {least}");
        }
    }
}
