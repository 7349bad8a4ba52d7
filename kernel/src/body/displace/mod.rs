//! Displaces a surface by a relief, with as many triangles as an error needs.
//!
//! Each triangle is measured at all texels inside and along its edges, and halved while it is off by more than the
//! error, see [`Relief`]. The triangles that are off most are halved first, so the error that a number of triangles
//! allows is known too. A triangle is halved in one way only, and a mesh without gaps that is within an error has a
//! smallest refinement. So the result does not depend on the order or the number of threads.
//!
//! Cost: O(texels · log(texels of a triangle of the mesh) + triangles), on all threads but for the cuts.
mod checks;
mod forest;
mod measure;
mod relief;
#[cfg(test)]
mod tests;

pub use checks::{Hidden, hidden};
pub use forest::BYTES_PER_TRIANGLE;
pub use relief::{Creases, NotFinite, Relief};

use super::budget::step_of;
use crate::ground::number::index_u32;
use crate::ground::stop::Until;
use forest::Forest;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use shibo_value::{Atlas, Mesh};

/// The wanted surface.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// The largest distance in mm, above 0.
    pub error: f64,
    /// The most triangles.
    pub triangles: usize,
    /// True to take a larger error if more triangles are needed.
    pub coarsen: bool,
    /// The number of triangles beyond which those of an error are not counted any more. It may follow from the memory, so no
    /// result depends on it.
    pub most: usize,
    /// The longest edge on the undisplaced surface, in mm.
    pub edge: f64,
    /// True to displace along the normals of the file, if there are any.
    pub file_normals: bool,
}

/// A displaced surface.
#[derive(Clone, Debug)]
pub struct Displaced {
    /// The surface, with the UVs and the parts of the atlas.
    pub mesh: Mesh,
    /// The largest distance to the relief in mm, and its place.
    pub off: (f64, DVec3),
    /// The error that was taken instead, if the wanted one needs too many triangles.
    pub coarser: Option<TooMany>,
    /// The largest difference between the heights of two charts on their common border, and its place, if they differ by
    /// more than the error.
    pub apart: Option<(f64, DVec3)>,
    /// The number of triangles that face inwards because the relief folds over itself, and the place of the first.
    pub folded: Option<(usize, DVec3)>,
}

/// The numbers of a surface that needs more triangles than allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooMany {
    /// The triangles that the error needs; `None` for more than [`Spec::most`].
    pub needed: Option<usize>,
    /// The least error, of those tried, that needs no more than the allowed triangles.
    pub error: Option<f64>,
}

/// The reasons why there is no displaced surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DisplaceError {
    /// More triangles are needed.
    TooMany(TooMany),
    /// The count passed [`Spec::most`], which is below [`Spec::triangles`].
    Memory,
    /// The work was stopped.
    Stopped,
}

/// Number of triangles measured between two checks for a stop.
const AT_ONCE: usize = 1 << 14;

/// Displaces the surface of an atlas along its normals.
///
/// # Errors
/// More triangles are needed than allowed, or `until` returned true.
pub fn displace(relief: &Relief<'_>, spec: &Spec, until: Until<'_>) -> Result<Displaced, DisplaceError> {
    let normals = normals(relief.atlas, spec.file_normals);
    let mut forest = Forest::new(relief, &normals);
    let mut coarser = None;
    let refined = match refine(&mut forest, spec, until)? {
        Refined::Within(off) => off,
        Refined::Beyond(TooMany { error: Some(error), needed }) if spec.coarsen => {
            coarser = Some(TooMany { error: Some(error), needed });
            forest = Forest::new(relief, &normals);
            match refine(&mut forest, &Spec { error, ..*spec }, until)? {
                Refined::Within(off) => off,
                Refined::Beyond(many) => return Err(DisplaceError::TooMany(many)),
            }
        }
        Refined::Beyond(many) => return Err(DisplaceError::TooMany(many)),
    };
    let worst = (0..refined.len()).reduce(|worst, n| if refined[n] > refined[worst] { n } else { worst });
    Ok(Displaced {
        mesh: forest.mesh(),
        off: worst.map_or((0.0, DVec3::ZERO), |worst| forest.facet(worst).worst(relief)),
        coarser,
        apart: checks::apart(relief, spec.error),
        folded: checks::folded(&forest),
    })
}

/// The normals of the vertices: those of the file, where it has some, or else those of the atlas.
fn normals(atlas: &Atlas, of_file: bool) -> Vec<Vec3> {
    let mesh = &atlas.mesh;
    if !of_file || mesh.normals.len() != mesh.triangles.len() {
        return atlas.smooth.clone();
    }
    // The sum over the corners; those that cancel out have the normal of the atlas.
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    for (triangle, normals) in mesh.triangles.iter().zip(&mesh.normals) {
        triangle.iter().zip(normals).for_each(|(vertex, normal)| sums[*vertex as usize] += *normal);
    }
    sums.iter().zip(&atlas.smooth).map(|(sum, smooth)| sum.normalize_or(*smooth)).collect()
}

/// The result of a refinement.
enum Refined {
    /// The distances of all triangles.
    Within(Vec<f64>),
    /// More triangles are needed.
    Beyond(TooMany),
}

/// Number of steps of 2^¼ above the wanted error at which triangles are counted.
const STEPS: u32 = 128;

/// Halves triangles until all are within the error.
fn refine(forest: &mut Forest<'_>, spec: &Spec, until: Until<'_>) -> Result<Refined, DisplaceError> {
    let limits: Vec<f64> = (0..STEPS).map(|step| step_of(spec.error, step)).collect();
    // The triangles that are off by more than a limit and at most by the next one.
    let mut waiting: Vec<Vec<u32>> = vec![Vec::new(); limits.len()];
    // Distances, and the index in `waiting` plus 1.
    let mut state: Vec<(f64, u32)> = Vec::new();
    let mut changed: Vec<u32> = (0..index_u32(forest.pieces.len())).collect();
    let mut fits = None;
    loop {
        state.resize(forest.pieces.len(), (0.0, 0));
        for some in changed.chunks(AT_ONCE) {
            if until() {
                return Err(DisplaceError::Stopped);
            }
            let measure = |piece: &u32| forest.measure(*piece as usize, spec.edge);
            let measured: Vec<(f64, bool)> = some.par_iter().with_min_len(16).map(measure).collect();
            for (piece, (off, halves)) in some.iter().zip(measured) {
                let over = if halves { limits.partition_point(|limit| *limit < off) } else { 0 };
                state[*piece as usize] = (off, index_u32(over));
                if over > 0 {
                    waiting[over - 1].push(*piece);
                }
            }
        }
        changed.clear();
        let top = waiting.iter().rposition(|list| !list.is_empty());
        let (count, met) = (forest.pieces.len(), top.map_or(0, |top| top + 1));
        if count <= spec.triangles {
            fits = limits.get(met).copied();
        }
        let Some(top) = top else {
            if count <= spec.triangles {
                return Ok(Refined::Within(state.into_iter().map(|(off, _)| off).collect()));
            }
            return Ok(Refined::Beyond(TooMany { needed: Some(count), error: fits }));
        };
        for piece in std::mem::take(&mut waiting[top]) {
            // A triangle may have been halved with another one since.
            if state[piece as usize].1 != index_u32(top + 1) {
                continue;
            }
            let before = changed.len();
            forest.halve(piece as usize, &mut changed);
            for half in &changed[before..] {
                if let Some(old) = state.get_mut(*half as usize) {
                    old.1 = 0;
                }
            }
            if forest.pieces.len() > spec.most {
                if forest.pieces.len() <= spec.triangles {
                    return Err(DisplaceError::Memory);
                }
                return Ok(Refined::Beyond(TooMany { needed: None, error: fits }));
            }
        }
        changed.sort_unstable();
        changed.dedup();
    }
}
