//! The method of the source on a surface, from start to end: coordinates start as zeros or at random; at each level
//! they are upsampled (3) and corrected (1), (2), across borders through the indirection map. Starting from zeros and
//! without jitter, the result is that of the chain `StartCoords`, `UpsampleCoords`, `CorrectCoords`.
use super::analysis::{features, plane};
use super::patent::{PatentSpec, level, wide};
use super::surface_inputs::SurfaceFields;
use super::surface_stages::{corrected, jittered, upsampled};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::driver::Inputs;
use shibo_kernel::synthesis::exact::{CorrectionRule, Features};
use shibo_kernel::synthesis::jacobian::Jacobian;
use shibo_kernel::synthesis::sheet::Sheet;
use shibo_kernel::synthesis::surface::SurfaceInputs;
use shibo_kernel::synthesis::texels::Fetch;
use shibo_value::{Exemplar, IndirectionMap, Stop};

/// Coordinates of all pixels, and the Jacobians of the finest level. If `zero`, coordinates start as zeros.
pub(super) fn run(
    spec: &PatentSpec,
    zero: bool,
    exemplar: &Exemplar,
    map: &IndirectionMap,
    inputs: &SurfaceFields<'_>,
) -> Result<(Vec<[f32; 2]>, Vec<Jacobian>), Stop> {
    let features = wide(&features(exemplar));
    let (finest, pitch) = (plane(exemplar), exemplar.frame.pitch.x);
    let last = map.levels.len() - 1;
    let sheet = |l: usize| Sheet::new(map, l);
    let first = sheet(last);
    let mut coords: Vec<[f32; 2]> = if inputs.fields.start.is_some() {
        inputs.start(&first.region())?.into_iter().map(|c| c.map(|v| if v.is_finite() { v } else { 0.0 })).collect()
    } else if zero {
        vec![[0.0; 2]; first.level.owner.len()]
    } else {
        let random = |pixel: usize| {
            let name = first.name(spec.hash, pixel, pitch);
            [finest.w as f64 * name.unit(0), finest.h as f64 * name.unit(1)].map(narrow)
        };
        (0..first.level.owner.len()).map(random).collect()
    };
    let mut jacobians = inputs.along(&first)?;
    for l in (0..last).rev() {
        inputs.step(last - 1 - l, last)?;
        let (coarse, sheet) = (sheet(l + 1), sheet(l));
        let before = std::mem::replace(&mut jacobians, inputs.along(&sheet)?);
        coords = upsampled((&coarse, &coords, &before), (&sheet, &jacobians));
        if spec.jitter > 0.0 && sheet.level.h > 2 {
            let reach = spec.jitter * f64::from(sheet.level.h);
            jittered(&sheet, &mut coords, (reach, &inputs.jitter(&sheet.region())?), spec.hash.with(1), pitch);
        }
        let (texels, ratio) = level(&features, sheet.level.h as usize, exemplar.pyramid);
        let features = Features { texels: &texels, ratio, second: &[], plane: finest };
        let rule = CorrectionRule {
            square: 4,
            averaged: spec.averaged,
            fetch: Fetch::Bilinear,
            h: f64::from(sheet.level.h),
            kappa: 1.0,
            sub_passes: spec.sub_passes,
        };
        coords =
            corrected((&sheet, &jacobians), (&features, &rule), &coords, spec.passes, |_| inputs.fields.cx.check())?;
    }
    Ok((coords, jacobians))
}
