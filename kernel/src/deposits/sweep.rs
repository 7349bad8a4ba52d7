//! The time of a front whose speed differs from place to place: |∇T| = slowness, in the plane.
//!
//! Fast sweeping (H. Zhao, 2005) of the factor τ in T = τ · d, where d is the exact distance to the seeds (S. Fomel,
//! S. Luo, H. Zhao, *Fast sweeping method for the factored eikonal equation*, 2009). The distance has the kink at the
//! seeds; τ is the mean slowness on the way and smooth there, so no error starts at a seed. O(n) a sweep.
use glam::{DVec2, UVec2};
use shibo_value::Tiling;

/// Maximum number of rounds of four sweeps.
const ROUNDS: usize = 8;

/// A change of τ that is small enough to stop, as a share.
const SMALL: f64 = 1e-6;

/// The factor τ at the centres of pixels.
#[derive(Clone, Debug)]
pub struct Factor {
    values: Vec<f32>,
    size: UVec2,
    pixel: DVec2,
    tiling: Tiling,
}

/// The grid of a front.
pub struct Front<'a> {
    /// Columns and rows.
    pub size: UVec2,
    /// The size of a pixel in mm.
    pub pixel: DVec2,
    /// The directions in which the plane repeats.
    pub tiling: Tiling,
    /// Time for a mm at each pixel, > 0.
    pub slowness: &'a [f64],
    /// The vector from the nearest seed to each pixel; 0 in and on seeds.
    pub to: &'a [DVec2],
}

impl Front<'_> {
    /// The index of a neighbour, if the plane goes on there.
    fn beside(&self, x: usize, y: usize, [dx, dy]: [isize; 2]) -> Option<usize> {
        let step = |at: usize, by: isize, n: u32, repeats: bool| {
            let n = n as usize;
            match at.checked_add_signed(by) {
                Some(at) if at < n => Some(at),
                _ if repeats => Some(if by < 0 { n - 1 } else { 0 }),
                _ => None,
            }
        };
        let x = step(x, dx, self.size.x, self.tiling.x)?;
        Some(step(y, dy, self.size.y, self.tiling.y)? * self.size.x as usize + x)
    }

    /// τ at a pixel from its neighbours; infinite if none of them was reached.
    fn update(&self, x: usize, y: usize, distances: &[f64], factors: &[f64]) -> f64 {
        let i = y * self.size.x as usize + x;
        let (d, way) = (distances[i], self.to[i] / distances[i]);
        let steps = [([[-1, 0], [1, 0]], self.pixel.x, way.x), ([[0, -1], [0, 1]], self.pixel.y, way.y)];
        // Per axis the neighbour that was reached first: (α, β) of the derivative α τ - β, the slowness, and the time
        // by that neighbour alone.
        let mut sides = [None; 2];
        let mut best = f64::INFINITY;
        for ((pair, h, slope), side) in steps.into_iter().zip(&mut sides) {
            let mut first = f64::INFINITY;
            for (step, sign) in pair.into_iter().zip([1.0, -1.0]) {
                let Some(k) = self.beside(x, y, step) else { continue };
                let time = factors[k] * distances[k];
                if k == i || !time.is_finite() || time >= first {
                    continue;
                }
                first = time;
                let slowness = 0.5 * (self.slowness[i] + self.slowness[k]);
                *side = Some((d / h + sign * slope, d * factors[k] / h, slowness));
                best = best.min((time + h * slowness) / d);
            }
        }
        if let [Some((a, b, s)), Some((c, e, t))] = sides {
            let (square, product) = (a * a + c * c, a * b + c * e);
            let slowness = 0.5 * (s + t);
            let rest = product * product - square * (b * b + e * e - slowness * slowness);
            if rest >= 0.0 && square > 0.0 {
                let factor = (product + rest.sqrt()) / square;
                if a * factor >= b && c * factor >= e {
                    best = best.min(factor);
                }
            }
        }
        best
    }

    /// Solves for τ. `stop` is asked before each sweep; the result is then unfinished.
    pub fn solve(&self, stop: &dyn Fn() -> bool) -> Factor {
        let (columns, rows) = (self.size.x as usize, self.size.y as usize);
        let distances: Vec<f64> = self.to.iter().map(|to| to.length()).collect();
        let near = 1.5 * self.pixel.max_element();
        // Next to seeds, the slowness on the way is that of the pixel.
        let start = |(d, slowness): (&f64, &f64)| if *d <= near { *slowness } else { f64::INFINITY };
        let mut factors: Vec<f64> = distances.iter().zip(self.slowness).map(start).collect();
        for _ in 0..ROUNDS {
            let mut worst: f64 = 0.0;
            for (right, down) in [(true, true), (false, true), (false, false), (true, false)] {
                if stop() {
                    break;
                }
                for j in 0..rows {
                    let y = if down { j } else { rows - 1 - j };
                    for k in 0..columns {
                        let x = if right { k } else { columns - 1 - k };
                        let i = y * columns + x;
                        if distances[i] <= near {
                            continue;
                        }
                        let new = self.update(x, y, &distances, &factors);
                        if new < factors[i] {
                            worst = worst.max((factors[i] - new) / new);
                            factors[i] = new;
                        }
                    }
                }
            }
            if worst < SMALL {
                break;
            }
        }
        let values = factors.iter().map(|f| crate::ground::number::narrow(*f)).collect();
        Factor { values, size: self.size, pixel: self.pixel, tiling: self.tiling }
    }
}

impl Factor {
    /// τ at a point in mm, by linear interpolation. Beyond the grid it goes on with the value at the border.
    pub fn at(&self, p: DVec2) -> f64 {
        let at = p / self.pixel - 0.5;
        let base = at.floor();
        let t = at - base;
        let index = |i: f64, n: u32, repeats: bool| {
            let n = f64::from(n);
            let i = if repeats { i - (i / n).floor() * n } else { i.clamp(0.0, n - 1.0) };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the grid")]
            let i = i.clamp(0.0, n - 1.0) as usize;
            i
        };
        let xs = [0.0, 1.0].map(|k| index(base.x + k, self.size.x, self.tiling.x));
        let ys = [0.0, 1.0].map(|k| index(base.y + k, self.size.y, self.tiling.y));
        let value = |x: usize, y: usize| f64::from(self.values[y * self.size.x as usize + x]);
        let row = |y: usize| value(xs[0], y) + t.x * (value(xs[1], y) - value(xs[0], y));
        row(ys[0]) + t.y * (row(ys[1]) - row(ys[0]))
    }

    /// Memory in bytes.
    pub const fn bytes(&self) -> usize {
        self.values.len() * 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: f64 = 32.0;

    fn solve(n: u32, seeds: impl Fn(DVec2) -> DVec2, slowness: impl Fn(DVec2) -> f64) -> Factor {
        let pixel = DVec2::splat(SIDE / f64::from(n));
        let centres: Vec<DVec2> =
            (0..n * n).map(|i| (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) * pixel).collect();
        let slowness: Vec<f64> = centres.iter().map(|p| slowness(*p)).collect();
        let to: Vec<DVec2> = centres.iter().map(|p| seeds(*p)).collect();
        Front { size: UVec2::splat(n), pixel, tiling: Tiling::NONE, slowness: &slowness, to: &to }.solve(&|| false)
    }

    fn point(p: DVec2) -> DVec2 {
        p - DVec2::new(11.3, 14.9)
    }

    #[test]
    fn constant_speed_gives_exact_times() {
        for n in [64, 256] {
            let factor = solve(n, point, |_| 0.5);
            for k in 0..400 {
                let p = DVec2::new(f64::from(k % 20), f64::from(k / 20)) * (SIDE / 20.0);
                let time = factor.at(p) * point(p).length();
                assert!((time - 0.5 * point(p).length()).abs() < 1e-3, "{n} {p}: {time}");
            }
        }
    }

    /// Stripes of speed 1 and 3 that are crossed at right angles by a front from a wall.
    #[test]
    fn stripes_of_speed_take_their_integral() {
        for (n, share) in [(256, 0.02), (64, 0.06)] {
            let slowness = |p: DVec2| if (p.x / 4.0).floor().rem_euclid(2.0) == 0.0 { 1.0 } else { 1.0 / 3.0 };
            let factor = solve(n, |p| DVec2::new(p.x, 0.0), slowness);
            let mut worst: f64 = 0.0;
            for k in 8..64 {
                let x = f64::from(k) * 0.5;
                let whole = (x / 4.0).floor();
                let want = (0..k).fold(0.0, |sum, j| sum + 0.5 * slowness(DVec2::splat(f64::from(j) * 0.5 + 0.25)));
                let time = factor.at(DVec2::new(x, 9.7)) * x;
                worst = worst.max((time / want - 1.0).abs());
                assert!((time / want - 1.0).abs() < share, "{n} {x} {whole}: {time} instead of {want}");
            }
            println!("stripes at {n}: {worst:.4}");
        }
    }

    /// In a medium whose speed grows evenly, 1 + g y, times from a point have a closed form.
    #[test]
    fn an_even_gradient_of_speed_has_its_closed_form() {
        let (seed, g) = (DVec2::new(11.3, 14.9), 0.05);
        let speed = |p: DVec2| 1.0 + g * p.y;
        let exact = |p: DVec2| {
            let square = (p - seed).length_squared();
            libm::acosh(1.0 + g * g * square / (2.0 * speed(p) * speed(seed))) / g
        };
        let mut errors = Vec::new();
        for n in [64, 128, 256] {
            let factor = solve(n, point, |p| 1.0 / speed(p));
            let mut worst: f64 = 0.0;
            for k in 0..900 {
                let p = (DVec2::new(f64::from(k % 30), f64::from(k / 30)) + 0.5) * (SIDE / 30.0);
                worst = worst.max((factor.at(p) * point(p).length() - exact(p)).abs());
            }
            errors.push(worst);
        }
        println!("gradient: {errors:?}");
        assert!(errors[0] < 0.08 && errors[2] < 0.03 && errors[2] < 0.7 * errors[1], "{errors:?}");
    }

    #[test]
    fn fronts_go_around_slow_places_and_across_seams() {
        // A slow block: the shortest way leads around it.
        let slow = |p: DVec2| if (p - 16.0).abs().max_element() < 6.0 { 100.0 } else { 1.0 };
        let factor = solve(128, |p| p - DVec2::new(4.0, 16.0), slow);
        let time = factor.at(DVec2::new(28.0, 16.0)) * 24.0;
        let want = 2.0 * 6f64.hypot(6.0) + 12.0;
        assert!((time / want - 1.0).abs() < 0.05, "{time} instead of {want}");
        // On a canvas that repeats, a slow wall in the middle is passed through the seam.
        let n = 64;
        let slowness: Vec<f64> = (0..n * n).map(|i| if (28..36).contains(&(i % n)) { 100.0 } else { 1.0 }).collect();
        let centre = |i: u32| (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) * 0.5;
        let wrap = |v: f64| v - (v / SIDE).round() * SIDE;
        let to: Vec<DVec2> =
            (0..n * n).map(|i| centre(i) - DVec2::new(4.0, 16.0)).map(|d| DVec2::new(wrap(d.x), wrap(d.y))).collect();
        let front = Front {
            size: UVec2::splat(n),
            pixel: DVec2::splat(0.5),
            tiling: Tiling::BOTH,
            slowness: &slowness,
            to: &to,
        };
        let factor = front.solve(&|| false);
        let p = DVec2::new(28.0, 16.0);
        assert!((factor.at(p) * 8.0 - 8.0).abs() < 0.1, "{}", factor.at(p));
        assert!((factor.at(p) - factor.at(p + DVec2::new(SIDE, -SIDE))).abs() < 1e-12);
    }
}
