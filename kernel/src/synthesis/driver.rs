//! Runs a synthesis from an analysed exemplar to coordinates: start, then per level upsample, jitter and correct.
use super::analysis::{self, Level};
use super::aniso::{Jacobians, Position};
use super::coverage::EvenUse;
use super::iso::{QUARTERS, RUN_REACH};
use super::jacobian::{IDENTITY, Jacobian};
use super::lattice::Basis;
use super::lattice_start::{Fitted, fit};
use super::mend;
use super::origin::{best_origin, starting_at};
use super::plane::{Lookup, PixelPlane};
use super::region::{Needs, Output, Planned, Region, plan};
use super::table::Table;
use super::texels::{Texels, mirrored};
use crate::ground::hash::Hash;
use crate::ground::window::index;
use rayon::prelude::*;

/// An analysed exemplar.
pub struct Analysed<'a> {
    /// Size, and the axes that wrap.
    pub plane: PixelPlane,
    /// Levels from the finest.
    pub levels: &'a [Level],
    /// Pixels that may be shown; empty for all.
    pub usable: &'a [bool],
    /// A guide value for every pixel; empty for none.
    pub guide: &'a [f32],
    /// The picture to compare, and whether its levels form a pyramid. Without it nothing is mended.
    pub picture: Option<(&'a Texels<f32>, bool)>,
}

/// Source of the coordinates of the first level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Random positions.
    Random,
    /// Random positions in the same phase of the lattice.
    Lattice(Basis),
    /// [`Inputs::start`].
    Given,
}

/// Settings of a synthesis.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Cost factor κ of candidates that look alike, compared with coherent ones.
    pub kappa: f32,
    /// Even use of the exemplar, at levels with spacing ≥ 2.
    pub even: Option<EvenUse>,
    /// Correction passes per level.
    pub passes: u32,
    /// Mending rounds at the finest level: each looks up patches of the result in the exemplar to mend the joints
    /// between pieces. As many further rounds replace torn spots. The next coarser levels have one more round of the
    /// first kind and none of the second. 0 mends nothing; nothing is mended where `J` is not 1.
    pub rounds: u32,
    /// Mean squared difference of a patch from the exemplar, in units of the exemplar's variance, below which later
    /// rounds leave the patch alone.
    pub enough: f32,
    /// True if three predictions are averaged where `J` is not 1.
    pub averaged: bool,
    /// Displacement of pixels after upsampling, in pixels of the level, at levels with spacing > 2.
    pub jitter: f32,
    /// Weight of the guide.
    pub guide_weight: f32,
    /// Width of the border within which nothing may be shown, in level spacings.
    pub margin: f64,
    /// Spacing of the first level.
    pub coarsest: usize,
    /// Source of the first coordinates.
    pub start: Start,
    /// True if only the Jacobian depends on the position. Then a result that wraps on both axes may begin at any of its
    /// pixels.
    pub adrift: bool,
    /// Random numbers.
    pub hash: Hash,
}

/// Marks of given pixels, and the exemplar positions at their centres.
pub type Fixed = (Vec<bool>, Vec<Position>);

/// Inputs per level; all optional.
pub trait Inputs: Sync {
    /// Reason of a stop.
    type Stop;
    /// The Jacobians; `None` where `J = 1` everywhere.
    fn jacobians(&self, _region: &Region) -> Result<Option<Jacobians>, Self::Stop> {
        Ok(None)
    }
    /// Target guide values by pixel; empty for none.
    fn guide(&self, _region: &Region) -> Result<Vec<f32>, Self::Stop> {
        Ok(Vec::new())
    }
    /// Pixels that are given; `None` for none.
    fn fixed(&self, _region: &Region) -> Result<Option<Fixed>, Self::Stop> {
        Ok(None)
    }
    /// Factors on the jitter by pixel; empty for 1.
    fn jitter(&self, _region: &Region) -> Result<Vec<f32>, Self::Stop> {
        Ok(Vec::new())
    }
    /// Start positions by pixel, at their centres; called for [`Start::Given`] only.
    fn start(&self, _region: &Region) -> Result<Vec<Position>, Self::Stop> {
        Ok(Vec::new())
    }
    /// Called between passes.
    fn step(&self, _done: usize, _total: usize) -> Result<(), Self::Stop> {
        Ok(())
    }
}

/// Result of a synthesis.
pub struct Synthesis {
    /// Positions of the output's pixels, by rows.
    pub coords: Vec<Position>,
    /// Share of pixels whose right and lower neighbours continue the exemplar.
    pub coherence: f32,
    /// Share of the exemplar in use: exp(entropy of the uses), relative to perfectly even use.
    pub coverage: f32,
}

/// A running synthesis.
pub(super) struct SynthesisRun<'a, I: Inputs> {
    pub(super) exemplar: &'a Analysed<'a>,
    pub(super) settings: &'a Settings,
    pub(super) inputs: &'a I,
    pub(super) isometric: bool,
    /// True if the result may begin at any of its pixels.
    pub(super) adrift: bool,
    pub(super) fitted: Option<Fitted>,
    /// The lattice whose phase the result keeps.
    pub(super) in_step: Option<Fitted>,
    /// A constant Jacobian that replaces the one of the inputs.
    pub(super) bent: Option<Jacobian>,
}

/// Synthesises the pixels of `output`.
///
/// # Errors
/// Returns the stop of the inputs.
pub fn run<I: Inputs>(
    exemplar: &Analysed<'_>,
    output: &Output,
    settings: &Settings,
    inputs: &I,
) -> Result<Synthesis, I::Stop> {
    let levels: Vec<&Level> = exemplar.levels.iter().filter(|l| l.h <= settings.coarsest).collect();
    let tile = settings.even.and_then(|even| even.tile);
    let passes = i32::try_from(settings.passes).unwrap_or(64);
    let needs: Vec<Needs> = levels
        .iter()
        .rev()
        .map(|level| {
            // Runs are broken up at the finest level only, at the end.
            let broken = if level.h == 1 { RUN_REACH } else { 0 };
            let mended = mend::reads(settings.rounds, level.h);
            let reach = passes * QUARTERS * level.hood.reach() + mended + broken;
            Needs { h: level.h, reach, tile: tile.filter(|_| level.h >= 2) }
        })
        .collect();
    let planned = plan(output, &needs);
    let first = inputs.jacobians(&planned[0].region)?;
    let j = match &first {
        None => IDENTITY,
        Some(Jacobians::Constant(j)) => *j,
        Some(Jacobians::Each(list)) => list[list.len() / 2],
    };
    let fitted = match settings.start {
        Start::Lattice(basis) if !matches!(first, Some(Jacobians::Each(_))) => {
            let j = j.map(f64::from);
            let size = output.size.map(|n| n as f64);
            Some(fit(basis, [[j[0], j[1]], [j[2], j[3]]], size, output.wrap))
        }
        _ => None,
    };
    // Integer positions (`J = 1`) cannot be bent.
    let bent = fitted.filter(|_| first.is_some()).and_then(|fitted| fitted.bent(&j));
    let j = bent.unwrap_or(j);
    let adrift = settings.adrift && output.wrap == [true; 2] && !matches!(first, Some(Jacobians::Each(_)));
    // Jitter is meant to break the phase. If fitting bends a lattice much, keeping its phase would make pieces too
    // small.
    let in_step = fitted.filter(|fitted| {
        settings.adrift && first.is_none() && settings.jitter <= 0.0 && fitted.bent(&IDENTITY).is_some()
    });
    let run = SynthesisRun { exemplar, settings, inputs, isometric: first.is_none(), adrift, fitted, in_step, bent };
    let coords = if run.isometric {
        run.isometric(&levels, &planned, &needs)?
    } else {
        let tables: Vec<Table> = levels.par_iter().map(|level| run.table(level)).collect();
        run.anisometric(&tables, &planned)?
    };
    let coords = match levels.first() {
        Some(finest) if run.adrift => {
            let looks = (exemplar.plane, &finest.appearance[..]);
            let place = best_origin(&coords, output.size, &j, looks, run.fitted.as_ref());
            starting_at(coords, output.size, place)
        }
        _ => coords,
    };
    let (coherence, coverage) = report(&coords, output, exemplar.plane);
    Ok(Synthesis { coords, coherence, coverage })
}

impl<I: Inputs> SynthesisRun<'_, I> {
    pub(super) fn table(&self, level: &Level) -> Table {
        let plane = self.exemplar.plane;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
        let margin = (level.h as f64 * self.settings.margin).min(plane.w.min(plane.h) as f64 / 6.0) as usize;
        let valid = analysis::valid(plane, self.exemplar.usable, margin);
        let guide = if self.exemplar.guide.is_empty() {
            Vec::new()
        } else {
            let blurred = Texels::new(plane, 1, self.exemplar.guide.to_vec()).blurred(level.h);
            // An isometric position is the corner of its pixel's footprint.
            let shift = if self.isometric { index(level.h / 2) } else { 0 };
            let at = |k: usize, n: usize, wrap: bool| mirrored(index(k) + shift, n, wrap);
            (0..plane.w * plane.h)
                .map(|p| {
                    let (x, y) = (at(p % plane.w, plane.w, plane.wrap[0]), at(p / plane.w, plane.h, plane.wrap[1]));
                    blurred.data[y * plane.w + x]
                })
                .collect()
        };
        let table = Table::new(level, plane, &valid, &guide);
        match &self.in_step {
            Some(fitted) => table.on(&fitted.basis),
            None => table,
        }
    }

    /// Weight of the guide: high at coarse levels, low at fine ones, where the texture decides.
    pub(super) fn weight(&self, table: &Table) -> f32 {
        self.settings.guide_weight * table.spread * (table.h as f32 / 8.0).min(1.0)
    }

    /// Even use at a level, if any.
    pub(super) fn even(&self, region: &Region) -> Option<EvenUse> {
        self.even_from(region, 2)
    }

    /// Even use at levels whose spacing is at least `finest`.
    pub(super) fn even_from(&self, region: &Region, finest: usize) -> Option<EvenUse> {
        let even = self.settings.even.filter(|_| region.h >= finest)?;
        // Not needed if the sides are placed afterwards.
        Some(EvenUse { halved: !self.adrift, ..even })
    }

    /// Returns whether uses are counted once per level instead of before every pass. If a window must be the same part
    /// of a larger output, a pixel may depend on near pixels only.
    pub(super) fn counts_once(&self, planned: &[Planned]) -> bool {
        let whole = planned.iter().all(|planned| planned.region.plane.wrap == [true; 2]);
        self.settings.even.is_some_and(|even| even.tile.is_some()) && !whole
    }

    pub(super) fn passes(
        &self,
        (level, levels): (usize, usize),
        once: bool,
        mut pass: impl FnMut(bool),
    ) -> Result<(), I::Stop> {
        let passes = self.settings.passes as usize;
        for k in 0..passes {
            self.inputs.step(level * passes + k, levels * passes)?;
            pass(k == 0 || !once);
        }
        Ok(())
    }
}

/// Shares of continued pixels and of exemplar pixels in use.
fn report(coords: &[Position], output: &Output, plane: PixelPlane) -> (f32, f32) {
    let [w, h] = output.size;
    let goes_on =
        |a: Position, b: Position, step: [f32; 2]| (b[0] - a[0] - step[0]).abs() + (b[1] - a[1] - step[1]).abs() < 0.5;
    let mut coherent = 0usize;
    let mut counts = vec![0u32; plane.w * plane.h];
    for (p, &at) in coords.iter().enumerate() {
        let (x, y) = (p % w, p / w);
        if x + 1 < w && y + 1 < h {
            coherent += usize::from(goes_on(at, coords[p + 1], [1.0, 0.0]) && goes_on(at, coords[p + w], [0.0, 1.0]));
        }
        #[expect(clippy::cast_possible_truncation, reason = "a position in an exemplar")]
        let cell = at.map(|v| v.floor() as i32);
        counts[plane.index(cell[0], cell[1])] += 1;
    }
    let n = coords.len() as f64;
    let entropy: f64 =
        counts.iter().filter(|c| **c > 0).map(|c| f64::from(*c) / n).map(|share| -share * libm::log(share)).sum();
    let used = libm::exp(entropy) / (plane.w * plane.h).min(coords.len()) as f64;
    #[expect(clippy::cast_possible_truncation, reason = "shares")]
    let used = used as f32;
    (coherent as f32 / ((w - 1).max(1) * (h - 1).max(1)) as f32, used)
}
