//! Stages of the method on a surface, shared by the nodes of single stages and the preset `Patent`.
use super::analysis::color;
use super::inputs::faulty;
use super::stages::raster;
use glam::{DVec2, UVec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::exact::{CorrectionRule, Corrector, Features};
use shibo_kernel::synthesis::jacobian::{self, IDENTITY, Jacobian};
use shibo_kernel::synthesis::sheet::Sheet;
use shibo_kernel::synthesis::surface;
use shibo_kernel::synthesis::surface_measure::{Measured, seam};
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Exemplar, ExemplarFrame, Field, IndirectionMap, Stop, Surface, Tiling};
use std::sync::Arc;

/// Coordinates of the pixels of a level.
pub(super) type Coords = Vec<[f32; 2]>;

fn wide(coords: &[[f32; 2]]) -> Vec<[f64; 2]> {
    coords.iter().map(|c| c.map(f64::from)).collect()
}

fn narrowed(coords: Vec<[f64; 2]>) -> Coords {
    coords.into_iter().map(|c| c.map(narrow)).collect()
}

/// The coordinates of a level from those of the next coarser one, by equation (3). Both come with the Jacobians of
/// their pixels.
pub(super) fn upsampled(
    (coarse, coords, before): (&Sheet<'_>, &[[f32; 2]], &[Jacobian]),
    (sheet, jacobians): (&Sheet<'_>, &[Jacobian]),
) -> Coords {
    let settled = |_: usize, at: Option<[f64; 2]>| at.unwrap_or([0.0; 2]);
    narrowed(surface::upsampled((coarse, &wide(coords), before), (sheet, |pixel: usize| jacobians[pixel]), settled))
}

/// Displaces coordinates at random by at most `reach` exemplar pixels, times the mask. The random numbers depend on the
/// place on the surface. `pitch` is the size of an exemplar pixel in mm.
pub(super) fn jittered(sheet: &Sheet<'_>, coords: &mut Coords, (reach, mask): (f64, &[f32]), hash: Hash, pitch: f64) {
    for (pixel, at) in coords.iter_mut().enumerate() {
        let name = sheet.name(hash, pixel, pitch);
        let reach = reach * mask.get(pixel).map_or(1.0, |v| f64::from(*v));
        *at = [0, 1].map(|d| narrow(f64::from(at[d]) + (name.unit(d as u64) * 2.0 - 1.0) * reach));
    }
}

/// Corrects coordinates `passes` times to fit their neighbours. `step` is called before each pass.
pub(super) fn corrected(
    (sheet, jacobians): (&Sheet<'_>, &[Jacobian]),
    (features, rule): (&Features<'_, f64>, &CorrectionRule<f64>),
    coords: &[[f32; 2]],
    passes: u32,
    step: impl Fn(u32) -> Result<(), Stop>,
) -> Result<Coords, Stop> {
    let jacobian = |pixel: usize| jacobians[pixel].map(f64::from);
    let corrector = Corrector { features, rule, lookup: sheet, jacobian };
    let mut coords = wide(coords);
    for pass in 0..passes {
        step(pass)?;
        corrector.pass(sheet.plane(), &[], &mut coords);
    }
    Ok(narrowed(coords))
}

/// The level of a surface to which coordinates of this size and spacing belong.
fn level(surface: &IndirectionMap, size: UVec2, spacing: u32) -> Result<Sheet<'_>, Problem> {
    let found = surface.levels.iter().position(|level| level.h == spacing && UVec2::from(level.size) == size);
    if let Some(found) = found {
        return Ok(Sheet::new(surface, found));
    }
    let own = |spacing: u32| surface.levels.iter().find(|level| level.h == spacing).map(|level| level.size);
    let [message, help] = match own(spacing) {
        Some([w, h]) => [
            format!("{}x{} coordinates at spacing {spacing}, where the surface has {w}x{h} pixels", size.x, size.y),
            "connect the same IndirectionMap to all stages, or leave `size` of StartCoords to it".into(),
        ],
        None => [
            format!(
                "the surface has no level of spacing {spacing}; its coarsest is {}",
                1u64 << surface.levels.len() >> 1
            ),
            format!("set `levels: {}` or more in IndirectionMap", spacing.ilog2() + 1),
        ],
    };
    Err(Problem::new(Code::BadValue, message).at("surface").help(help))
}

/// Coordinates on a surface, stage by stage.
pub(super) struct Staged<'a> {
    cx: &'a Context<'a>,
    surface: &'a IndirectionMap,
    jacobian: Option<Field>,
    frame: ExemplarFrame,
}

impl<'a> Staged<'a> {
    /// # Errors
    /// If the exemplar is not known.
    pub(super) fn new(
        cx: &'a Context<'a>,
        surface: &'a IndirectionMap,
        jacobian: Option<Field>,
        frame: Option<ExemplarFrame>,
    ) -> Result<Self, Problem> {
        let message =
            "the size of the exemplar's pixels is not known, so neither is how large features are on the surface";
        let missing =
            || Problem::new(Code::MissingInput, message).at("coords").help("connect `exemplar` to StartCoords");
        Ok(Self { cx, surface, jacobian, frame: frame.ok_or_else(missing)? })
    }

    /// The level to which coordinates belong.
    pub(super) fn sheet(&self, map: &CoordMap) -> Result<Sheet<'a>, Problem> {
        level(self.surface, map.size, map.spacing)
    }

    /// The Jacobians of a level, in exemplar pixels per finest pixel; the unit matrix without a field.
    pub(super) fn jacobians(&self, sheet: &Sheet<'_>) -> Result<Vec<Jacobian>, Stop> {
        let Some(field) = &self.jacobian else { return Ok(vec![IDENTITY; sheet.level.owner.len()]) };
        let grid = sheet.raster().grid();
        let tile = raster(self.cx, field, UVec2::from(sheet.level.size), grid.step)?;
        let to_pixels = sheet.to_pixels(self.frame.pitch);
        let planes: [&[f32]; 4] = std::array::from_fn(|c| tile.plane(c));
        let at = |pixel: usize| match sheet.level.triangle(pixel) {
            Some(_) => to_pixels(planes.map(|plane| plane[pixel])),
            None => IDENTITY,
        };
        let all: Vec<Jacobian> = (0..sheet.level.owner.len()).map(at).collect();
        match all.iter().enumerate().find_map(|(pixel, j)| jacobian::fault(j).map(|fault| (pixel, fault))) {
            None => Ok(all),
            Some((pixel, fault)) => {
                let center: DVec2 = sheet.raster().center(pixel) * sheet.atlas.size_mm;
                Err(faulty(fault, center, &all[pixel]).into())
            }
        }
    }

    /// The map of a level. Pixels outside of charts get no coordinates.
    pub(super) fn map(&self, sheet: &Sheet<'_>, mut coords: Coords, jacobians: &[Jacobian]) -> CoordMap {
        coords
            .iter_mut()
            .zip(&sheet.level.owner)
            .filter(|(_, owner)| **owner == 0)
            .for_each(|(at, _)| *at = [f32::NAN; 2]);
        let h = sheet.level.h as f32;
        let surface = Surface {
            atlas: Arc::clone(&self.surface.atlas),
            finest: self.surface.size,
            level: sheet.level.clone(),
            jacobians: jacobians.iter().map(|j| j.map(|v| v * h)).collect(),
            seam: None,
        };
        CoordMap {
            size: UVec2::from(sheet.level.size),
            start: glam::IVec2::ZERO,
            pitch: sheet.raster().grid().step,
            periodic: Tiling::NONE,
            spacing: sheet.level.h,
            coords: Arc::new(coords),
            exemplar: Some(self.frame),
            coherence: 0.0,
            coverage: 0.0,
            surface: Some(Arc::new(surface)),
        }
    }

    /// Like [`Self::map`], for final coordinates: at the finest level it also measures how well they continue across
    /// pixels and borders.
    pub(super) fn measured(
        &self,
        sheet: &Sheet<'_>,
        coords: Coords,
        jacobians: &[Jacobian],
        exemplar: &Exemplar,
    ) -> CoordMap {
        let mut map = self.map(sheet, coords, jacobians);
        if sheet.level.h == 1 {
            let color = |at: [f32; 2]| color(exemplar, at);
            let measured = Measured { sheet, coords: &map.coords, jacobians, color };
            map.coherence = measured.coherence();
            let found = seam(&measured.steps());
            if let Some(surface) = map.surface.as_mut().and_then(Arc::get_mut) {
                surface.seam = Some(found);
            }
        }
        map
    }

    /// The first coordinates on a surface: zeros, or given ones by rows.
    pub(super) fn start(&self, levels: u32, given: &[(f64, f64)]) -> Result<CoordMap, Problem> {
        let wanted = self.surface.levels.iter().find(|level| level.h == 1 << levels);
        let size = wanted.map_or(UVec2::ZERO, |level| UVec2::from(level.size));
        let sheet = level(self.surface, size, 1 << levels)?;
        let n = sheet.level.owner.len();
        let coords = match given.len() {
            0 => vec![[0.0; 2]; n],
            k if k == n => given.iter().map(|&(u, v)| [narrow(u), narrow(v)]).collect(),
            k => {
                let message = format!("{k} coordinates; the surface's level has {}x{} pixels", size.x, size.y);
                return Err(Problem::new(Code::BadValue, message).at("coords").help("give one for each, or none"));
            }
        };
        Ok(self.map(&sheet, coords, &vec![IDENTITY; n]))
    }
}
