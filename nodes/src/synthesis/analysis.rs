//! Shared by the nodes of this family: converts an exemplar to the arguments of the kernels.
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::stop::Until;
use shibo_kernel::synthesis::PixelPlane;
use shibo_kernel::synthesis::analysis::{AnalysisSpec, analyse_until, find_alike, spacings};
use shibo_kernel::synthesis::texels::Texels;
use shibo_kernel::synthesis::{lattice, levels};
use shibo_value::{Exemplar, ExemplarLattice, ExemplarLevel, Tiling};

/// Size of an exemplar, and the directions in which its sides join.
pub(super) fn plane(exemplar: &Exemplar) -> PixelPlane {
    let (size, Tiling { x, y }) = (exemplar.frame.size, exemplar.frame.periodic);
    PixelPlane { w: size.x as usize, h: size.y as usize, wrap: [x, y] }
}

/// The features that are compared at the finest level.
pub(super) fn features(exemplar: &Exemplar) -> Texels<f32> {
    Texels::new(plane(exemplar), exemplar.channels, exemplar.features.to_vec())
}

/// The hash behind all random numbers of an analysis: always the same, so that an exemplar is analysed in the same way
/// everywhere.
pub(super) const ANALYSIS: Hash = Hash::new(0x5348_4942_4F31);

/// The analysed levels; must not be used if the work was cancelled.
pub(super) fn levels_of(exemplar: &Exemplar, spec: &AnalysisSpec, until: Until<'_>) -> Vec<ExemplarLevel> {
    let features = features(exemplar);
    let spacings = spacings(features.plane.w.min(features.plane.h));
    let image = |h| levels::image(&features, h, exemplar.pyramid);
    analyse_until(&spacings, image, &exemplar.usable, spec, ANALYSIS, until)
}

/// Adds sets of `k` similar pixels to every level; `distance` is a share of the shorter side. The result must not be
/// used if the work was cancelled.
pub(super) fn add_alike(exemplar: &Exemplar, levels: &mut [ExemplarLevel], k: usize, distance: f64, until: Until<'_>) {
    let plane = plane(exemplar);
    let distance = distance * plane.w.min(plane.h) as f64;
    find_alike(levels, plane, &exemplar.usable, distance, k, ANALYSIS.with(1), until);
}

/// Detects the lattice of an exemplar.
pub(super) fn find_lattice(exemplar: &Exemplar) -> ExemplarLattice {
    match lattice::detect(&features(exemplar)) {
        Some(found) => {
            let vectors = [DVec2::from(found.basis.a), DVec2::from(found.basis.b)];
            let regular = found.is_regular();
            ExemplarLattice { vectors: regular.then_some(vectors), strength: found.mean.clamp(0.0, 1.0) }
        }
        None => ExemplarLattice { vectors: None, strength: 0.0 },
    }
}

/// The colour of the exemplar's pixel nearest to a position.
pub(super) fn color(exemplar: &Exemplar, at: [f32; 2]) -> [f32; 3] {
    let (n, size) = (exemplar.len(), exemplar.frame.size);
    let axis = |v: f32, n: u32, wraps: bool| {
        let n = f64::from(n);
        let v = if wraps { f64::from(v).rem_euclid(n) } else { f64::from(v) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited just before")]
        let k = v.clamp(0.0, n - 1.0) as usize;
        k
    };
    let Tiling { x, y } = exemplar.frame.periodic;
    let p = axis(at[1], size.y, y) * size.x as usize + axis(at[0], size.x, x);
    if exemplar.is_color() { [0, 1, 2].map(|c| exemplar.shown[c * n + p]) } else { [exemplar.shown[p]; 3] }
}
