//! Reaction and diffusion after Gray and Scott: spots, worms and mazes that grow.
//!
//! Substance u is fed, v turns u into more v and is removed: u' = Δu − u v² + F (1 − u), v' = ½ Δv + u v² − (F + k) v.
//! The pattern is computed in mm on a grid of its own with [`POINTS`] points a wave, so it does not depend on the
//! resolution of a picture, and is read between points by a spline ([`spline`]). It starts from spots at places hashed
//! from the seed. The width of the waves follows from feed and kill ([`regime`]); diffusion is chosen so
//! that a wave has the wanted length.
//!
//! Sources: P. Gray, S. Scott (1984); J. Pearson, "Complex patterns in a simple system" (1993), for the regimes;
//! A. Sanderson et al., "Advanced reaction-diffusion models for texture synthesis" (2006), for diffusion along a field.
//! Unlike there, only the diffusion of u depends on the direction. Stripes then follow it closely, and nothing dies.
pub mod regime;
pub mod spline;
mod start;
mod step;
#[cfg(test)]
mod waves;

use crate::ground::hash::Hash;
use crate::ground::math::clamp;
use crate::ground::number::narrow;
use crate::ground::stop::Until;
use glam::DVec2;
use spline::Spline;
use step::{Law, Laws, State};

/// Points of the grid for one wave.
pub const POINTS: f64 = 12.0;

/// Maximum number of points of the grid.
pub const MOST: usize = 1 << 21;

/// Length of a step, in the unit of feed and kill.
const STEP: f64 = 1.5;

/// The time until a pattern has settled.
pub const SETTLED: f64 = 4000.0;

/// The largest diffusion in a step per square of the cell for which steps are stable, also if it is 1.3 times as large
/// in one direction.
const STABLE: f64 = 0.3;

/// The share by which u diffuses less along the direction, and more across it, at full anisotropy.
const ALONG: f64 = 0.3;

/// The additional rate at which v vanishes outside of the mask.
const CLEARED: f64 = 0.1;

/// Concentration of v below which nothing has grown.
const NOTHING: f32 = 0.05;

/// The reaction at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// How fast u is fed.
    pub feed: f64,
    /// How fast v is removed.
    pub kill: f64,
    /// Length of a wave, as a share of the usual one: at least a half, at most 1.
    pub scale: f64,
    /// Unit vector along which stripes run.
    pub along: DVec2,
    /// 1 where the pattern may grow, 0 where it may not.
    pub open: f64,
    /// True where the pattern may start.
    pub starts: bool,
}

/// A pattern to grow.
#[derive(Clone, Copy, Debug)]
pub struct Reaction {
    /// The area that repeats, mm.
    pub size: DVec2,
    /// Length of a wave, mm.
    pub wave: f64,
    /// Length of a wave where the diffusion of u is 1, from [`regime`].
    pub natural: f64,
    /// How closely stripes follow the direction, 0..1.
    pub anisotropy: f64,
    /// How long it grows, in units of feed and kill.
    pub time: f64,
}

/// The number of points on an area of `size` mm for a wave of `wave` mm; it may exceed [`MOST`].
pub fn points(size: DVec2, wave: f64) -> f64 {
    let sides = sides(size, wave);
    sides.x * sides.y
}

/// Points along both sides of the area.
fn sides(size: DVec2, wave: f64) -> DVec2 {
    (size * POINTS / wave).round().max(DVec2::splat(4.0))
}

impl Reaction {
    /// Grows the pattern; 0 where nothing grows, 1 at its densest. `local` gives the reaction at a place. If `varies`
    /// is false, it is the same everywhere except for `starts`. `None` if stopped.
    ///
    /// # Panics
    /// If there are more points than [`MOST`].
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most MOST points")]
    pub fn grow(
        &self,
        varies: bool,
        local: impl Fn(DVec2) -> Local + Sync,
        hash: Hash,
        until: Until<'_>,
    ) -> Option<Spline> {
        let sides = sides(self.size, self.wave);
        assert!(sides.x * sides.y <= MOST as f64, "as many points as fit");
        let (width, height) = (sides.x as usize, sides.y as usize);
        let cell = self.size / sides;
        let center = |x: usize, y: usize| (DVec2::new(x as f64, y as f64) + 0.5) * cell;
        let start = start::Start::new(self.size, self.wave, hash);
        let mut state = State::new(width, height, |x, y| {
            let dose = start.at(center(x, y), |spot| local(spot).starts);
            [1.0 - 0.5 * dose, 0.3 * dose].map(narrow)
        });
        let steps = (self.time / STEP).round().clamp(0.0, 1e6) as usize;
        if varies {
            let laws = Laws::of(width * height, |k| self.law(local(center(k % width, k / width)), cell));
            advance(&mut state, laws.all(), steps, until)?;
        } else {
            advance(&mut state, self.law(local(DVec2::ZERO), cell), steps, until)?;
        }
        let mut values = state.into_v();
        let top = values.iter().copied().fold(NOTHING, f32::max);
        let factor = if top > NOTHING { 1.0 / top } else { 0.0 };
        values.iter_mut().for_each(|v| *v = clamp(factor * *v, 0.0, 1.0));
        Some(Spline::new(values, width, height, self.size))
    }

    /// The law of a step at a point, for cells of `cell` mm.
    fn law(&self, local: Local, cell: DVec2) -> Law {
        let diffusion = (self.wave * local.scale / self.natural).powi(2) * STEP;
        let most = DVec2::splat(STABLE);
        // Across a narrow area nothing differs anyway, so there diffusion may be limited.
        let [across, down] = (DVec2::splat(diffusion) / (cell * cell)).min(most).to_array();
        let [x, y] = local.along.to_array();
        // The diffusion of u: 1 + turn across, 1 − turn along.
        let turn = ALONG * self.anisotropy;
        let straight = turn * (y * y - x * x);
        let mixed = -turn * x * y * (across * down).sqrt();
        let clear = CLEARED * (1.0 - local.open);
        Law {
            speed: narrow(STEP),
            feed: narrow(local.feed * STEP),
            loss: narrow((local.feed + local.kill + clear) * STEP),
            u: [across * (1.0 + straight), down * (1.0 - straight), mixed].map(narrow),
            v: [0.5 * across, 0.5 * down].map(narrow),
        }
    }
}

fn advance(state: &mut State, law: impl step::Here, steps: usize, until: Until<'_>) -> Option<()> {
    for _ in 0..steps {
        if until() {
            return None;
        }
        state.advance(law);
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::stop::NEVER;

    pub(super) fn everywhere(feed: f64, kill: f64) -> Local {
        Local { feed, kill, scale: 1.0, along: DVec2::X, open: 1.0, starts: true }
    }

    fn maze(size: DVec2, wave: f64, time: f64) -> Reaction {
        Reaction { size, wave, natural: regime::Regime::Maze.natural(), anisotropy: 0.0, time }
    }

    fn grown(reaction: &Reaction, local: Local, varies: bool) -> Vec<f32> {
        let spline = reaction.grow(varies, |_| local, Hash::new(1), NEVER).unwrap();
        (0..64 * 64).map(|k| spline.at(DVec2::new((k % 64) as f64, (k / 64) as f64) / 64.0 * reaction.size)).collect()
    }

    #[test]
    fn both_forms_of_laws_have_the_same_bits_for_any_threads() {
        let (feed, kill) = regime::Regime::Maze.rates();
        let reaction = maze(DVec2::new(30.0, 22.0), 3.0, 400.0);
        let local = everywhere(feed, kill);
        let want = grown(&reaction, local, false);
        assert!(want.iter().any(|v| *v > 0.8) && want.iter().any(|v| *v < 0.1));
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| grown(&reaction, local, true)), want);
        }
    }

    #[test]
    fn areas_of_any_form_stay_finite() {
        for (size, wave) in [([1.0, 1.0], 1e5), ([0.1, 40.0], 2.0), ([40.0, 1e-3], 3.0), ([7.3, 5.1], 3.0)] {
            let reaction = Reaction { anisotropy: 1.0, ..maze(DVec2::from(size), wave, 600.0) };
            for along in [DVec2::X, DVec2::new(0.6, 0.8)] {
                let local = Local { along, ..everywhere(0.034, 0.059) };
                assert!(grown(&reaction, local, true).iter().all(|v| (0.0..=1.0).contains(v)), "{size:?}");
            }
        }
        // Rates at the ends of their ranges.
        for (feed, kill) in [(0.0, 0.0), (0.12, 0.0), (0.0, 0.12), (0.12, 0.12)] {
            let values = grown(&maze(DVec2::splat(20.0), 2.0, 600.0), everywhere(feed, kill), false);
            assert!(values.iter().all(|v| (0.0..=1.0).contains(v)), "{feed} {kill}");
        }
    }

    #[test]
    fn nothing_grows_where_it_may_not() {
        let reaction = maze(DVec2::splat(40.0), 4.0, 1500.0);
        let half = |p: DVec2| Local { open: if p.x < 20.0 { 1.0 } else { 0.0 }, ..everywhere(0.034, 0.059) };
        let spline = reaction.grow(true, half, Hash::new(1), NEVER).unwrap();
        let most = |x: f64| (0..40).map(|y| spline.at(DVec2::new(x, f64::from(y)))).fold(0.0, f32::max);
        assert!(most(30.0) < 0.01 && most(10.0) > 0.5, "{} {}", most(30.0), most(10.0));
        let none = |_| Local { starts: false, ..everywhere(0.034, 0.059) };
        let spline = reaction.grow(false, none, Hash::new(1), NEVER).unwrap();
        assert_eq!(spline.at(DVec2::new(3.0, 4.0)), 0.0);
    }

    #[test]
    fn stops_when_asked() {
        let reaction = maze(DVec2::splat(40.0), 4.0, 1500.0);
        assert!(reaction.grow(false, |_| everywhere(0.034, 0.059), Hash::new(1), &|| true).is_none());
    }
}
