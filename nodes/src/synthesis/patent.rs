//! The method of the source from start to end: coordinates start as zeros; at each level they are upsampled (3),
//! optionally jittered, and corrected (1), (2).
use super::analysis::{features, plane};
use super::inputs::FieldInputs;
use super::stages::Ended;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::PixelPlane;
use shibo_kernel::synthesis::aniso::Jacobians;
use shibo_kernel::synthesis::driver::Inputs;
use shibo_kernel::synthesis::exact::{self, CorrectionRule, Corrector, Features};
use shibo_kernel::synthesis::jacobian::IDENTITY;
use shibo_kernel::synthesis::levels::pyramid_level;
use shibo_kernel::synthesis::region::Region;
use shibo_kernel::synthesis::texels::{Fetch, Texels};
use shibo_value::{Exemplar, Stop};

/// Parameters of the source's method.
pub(super) struct PatentSpec {
    pub(super) averaged: bool,
    pub(super) sub_passes: u32,
    pub(super) passes: u32,
    pub(super) jitter: f64,
    pub(super) hash: Hash,
}

/// Features of a level in double precision, and the width of one of its texels in pixels of the finest level.
pub(super) fn level(features: &Texels<f64>, h: usize, pyramid: bool) -> (Texels<f64>, f64) {
    if pyramid { (pyramid_level(features, h), h as f64) } else { (features.blurred(h), 1.0) }
}

/// Numbers in double precision.
pub(super) fn wide(texels: &Texels<f32>) -> Texels<f64> {
    Texels::new(texels.plane, texels.channels, texels.data.iter().map(|v| f64::from(*v)).collect())
}

/// The first coordinate at `k` pixels of the finest level, for an exemplar of `n` pixels. It is 0, as in the source, if
/// a Jacobian `bends`. Otherwise zeros would repeat the part of the exemplar that the first spacing covers, instead of
/// the whole exemplar; both are the same if the exemplar and the spacing are the same power of two.
fn begun(bends: bool, k: usize, n: usize) -> f64 {
    if bends { 0.0 } else { (k % n) as f64 }
}

/// Coordinates of all pixels.
pub(super) fn run(
    spec: &PatentSpec,
    start_size: Option<u32>,
    exemplar: &Exemplar,
    inputs: &FieldInputs<'_>,
) -> Result<Vec<[f32; 2]>, Stop> {
    let features = wide(&features(exemplar));
    let finest = plane(exemplar);
    let side = finest.w.min(finest.h);
    let coarsest = start_size.map_or(side, |size| size as usize).clamp(1, side);
    let levels = coarsest.ilog2();
    let (w, h) = (inputs.size.x as usize, inputs.size.y as usize);
    let wrap = [inputs.cx.tiling().x, inputs.cx.tiling().y];
    let region = |h_l: usize| Region {
        h: h_l,
        start: [0, 0],
        plane: PixelPlane {
            w: w.div_ceil(1 << levels) << (levels - h_l.ilog2()),
            h: h.div_ceil(1 << levels) << (levels - h_l.ilog2()),
            wrap,
        },
        short: [0; 2],
    };
    let first = region(1 << levels);
    let mut map: Vec<[f64; 2]> = match inputs.start {
        Some(_) => inputs.start(&first)?.into_iter().map(|c| c.map(f64::from)).collect(),
        None => (0..first.plane.w * first.plane.h)
            .map(|p| {
                [(p % first.plane.w, finest.w), (p / first.plane.w, finest.h)]
                    .map(|(k, n)| begun(inputs.bends(), k << levels, n))
            })
            .collect(),
    };
    for l in 1..=levels {
        inputs.step(l as usize - 1, levels as usize)?;
        let h_l = 1usize << (levels - l);
        let (parent, region) = (region(2 * h_l).plane, region(h_l));
        let jacobians = inputs.jacobians(&region)?.unwrap_or(Jacobians::Constant(IDENTITY));
        let jacobian = |p: usize| jacobians.at(p).map(f64::from);
        map = exact::upsample(&map, parent, h_l as f64, |x, y| jacobian(y * region.plane.w + x));
        if spec.jitter > 0.0 && h_l > 2 {
            let mask = inputs.jitter(&region)?;
            exact::jitter(&mut map, spec.jitter * h_l as f64, &mask, spec.hash.with(h_l as u64));
        }
        let (texels, ratio) = level(&features, h_l, exemplar.pyramid);
        let features = Features { texels: &texels, ratio, second: &[], plane: finest };
        let rule = CorrectionRule {
            square: 4,
            averaged: spec.averaged,
            fetch: Fetch::Bilinear,
            h: h_l as f64,
            kappa: 1.0,
            sub_passes: spec.sub_passes,
        };
        let corrector = Corrector { features: &features, rule: &rule, lookup: &Ended(region.plane), jacobian };
        for _ in 0..spec.passes {
            inputs.cx.check()?;
            corrector.pass(region.plane, &[], &mut map);
        }
    }
    let full = w.div_ceil(1 << levels) << levels;
    let rows = map.chunks_exact(full).take(h);
    Ok(rows.flat_map(|row| &row[..w]).map(|c| c.map(narrow)).collect())
}
