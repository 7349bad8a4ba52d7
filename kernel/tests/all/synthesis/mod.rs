//! Shared by the tests of synthesis: an exemplar, its analysis, and the plainest inputs.
#![allow(dead_code, reason = "each test program uses a part of it")]
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::synthesis::PixelPlane;
use shibo_kernel::synthesis::analysis::{AnalysisSpec, Level, analyse, find_seconds, spacings};
use shibo_kernel::synthesis::aniso::{Jacobians, Position};
use shibo_kernel::synthesis::coverage::EvenUse;
use shibo_kernel::synthesis::driver::{Fixed, Inputs, Settings, Start};
use shibo_kernel::synthesis::jacobian::Jacobian;
use shibo_kernel::synthesis::levels::image;
use shibo_kernel::synthesis::region::Region;
use shibo_kernel::synthesis::texels::Texels;

pub(crate) fn plane(w: usize, h: usize, wrap: bool) -> PixelPlane {
    PixelPlane { w, h, wrap: [wrap; 2] }
}

/// Round lumps of many sizes, two channels.
pub(crate) fn lumps(w: usize, h: usize, wrap: bool) -> Texels<f32> {
    let hash = Hash::new(5);
    let noise = Texels::new(plane(w, h, wrap), 2, (0..2 * w as u64 * h as u64).map(|n| hash.unit_f32(n)).collect());
    noise.blurred(4)
}

pub(crate) fn analysed(exemplar: &Texels<f32>) -> Vec<Level> {
    let spacings = spacings(exemplar.plane.w.min(exemplar.plane.h));
    let spec = AnalysisSpec::default();
    let mut levels = analyse(&spacings, |h| image(exemplar, h, false), &[], &spec, Hash::new(1));
    find_seconds(&mut levels, exemplar.plane, &[], 3.0, Hash::new(2));
    levels
}

/// Inputs with only a Jacobian and given pixels.
#[derive(Default)]
pub(crate) struct Plain {
    pub(crate) jacobian: Option<fn(f64, f64) -> Jacobian>,
    pub(crate) fixed: Option<fn(f64, f64) -> Option<Position>>,
}

impl Inputs for Plain {
    type Stop = ();
    fn jacobians(&self, region: &Region) -> Result<Option<Jacobians>, ()> {
        let Some(j) = self.jacobian else { return Ok(None) };
        let w = region.plane.w;
        let at = |p: usize| region.center(p % w, p / w);
        Ok(Some(Jacobians::Each((0..w * region.plane.h).map(|p| j(at(p)[0], at(p)[1])).collect())))
    }
    fn fixed(&self, region: &Region) -> Result<Option<Fixed>, ()> {
        let Some(fixed) = self.fixed else { return Ok(None) };
        let w = region.plane.w;
        let list: Vec<Option<Position>> = (0..w * region.plane.h)
            .map(|p| {
                let [x, y] = region.center(p % w, p / w);
                fixed(x, y)
            })
            .collect();
        Ok(Some((list.iter().map(Option::is_some).collect(), list.iter().map(|f| f.unwrap_or([0.5; 2])).collect())))
    }
}

pub(crate) fn settings(local: bool) -> Settings {
    Settings {
        kappa: 2.0,
        even: Some(EvenUse { amount: 1.0, tile: local.then_some(32), halved: false }),
        passes: 2,
        rounds: 0,
        enough: 0.015,
        averaged: true,
        jitter: 0.3,
        guide_weight: 1.0,
        margin: 0.25,
        coarsest: 8,
        start: Start::Random,
        adrift: false,
        hash: Hash::new(9),
    }
}
