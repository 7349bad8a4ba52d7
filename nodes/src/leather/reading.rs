//! What several nodes do with a scalar field: reading it as a picture that their own parameters fix, never the output's.
use crate::kernel::lattice::Links;
use crate::kernel::lines::{Along, Raster, Reduce};
use crate::kernel::tile::narrow;
use glam::{DVec2, UVec2, Vec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::Context;
use shibo_engine::value::{Field, Lattice, Stop, Tiling, Window};

/// Which places of the field belong to a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Sample {
    /// Two samples per pixel along the link, between the pixels: the better choice in practice.
    #[default]
    Smooth,
    /// The pixels of Bresenham's line, as in the source.
    Line,
    /// The pixels at most so many mm from the link.
    Near(f64),
}

/// How the values that belong to a link or a point are summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Reduction {
    /// Their mean.
    #[default]
    Mean,
    /// Their sum, which grows with the number of pixels.
    Sum,
}

impl Reduction {
    pub(super) fn kernel(self) -> Reduce {
        match self {
            Self::Mean => Reduce::Mean,
            Self::Sum => Reduce::Sum,
        }
    }
}

/// The most columns or rows at which a field is read by default.
const MOST_SAMPLES: f64 = 4096.0;

/// How many links are read between two looks at whether to stop: a few milliseconds' work.
const LINKS_AT_ONCE: usize = 1 << 15;

/// A field over the whole canvas as a picture.
pub(super) struct Reading {
    /// Columns and rows.
    pub(super) size: UVec2,
    /// Values by rows, all finite.
    pub(super) values: Vec<f32>,
    size_mm: Vec2,
    periodic: bool,
}

/// Reads `field`, which came in at `port`, at `resolution`; by default at the picture's own where it is one, else at four
/// samples per `pitch`. What reads it repeats in the directions of `periodic`.
pub(super) fn read(
    cx: &Context<'_>,
    (pitch, periodic): (f32, Tiling),
    (field, port): (&Field, &str),
    resolution: Option<(u32, u32)>,
) -> Result<Reading, Stop> {
    let size = match (resolution, field.native()) {
        (Some((width, height)), _) => UVec2::new(width, height),
        (None, Some(native)) => {
            let pixels = (cx.size_mm() / native.step).round();
            pixels.clamp(DVec2::ONE, DVec2::splat(2.0 * MOST_SAMPLES)).as_uvec2()
        }
        (None, None) => {
            let pitch = f64::from(pitch.max(f32::MIN_POSITIVE));
            (cx.size_mm() / pitch * 4.0).ceil().clamp(DVec2::ONE, DVec2::splat(MOST_SAMPLES)).as_uvec2()
        }
    };
    let map = cx.evaluator.raster(field, &cx.canvas.grid(size), Window::full(size))?;
    if let Some(at) = map.plane(0).iter().position(|v| !v.is_finite()) {
        let (bad, width) = (map.plane(0)[at], size.x as usize);
        let place = (DVec2::new((at % width) as f64, (at / width) as f64) + 0.5) * cx.size_mm() / size.as_dvec2();
        let message = format!(
            "{port} has the value `{bad}` at ({:.3}, {:.3}) mm; it must be finite everywhere",
            place.x, place.y
        );
        return Err(Problem::new(Code::NotFinite, message).at(port).into());
    }
    let periodic = periodic == Tiling::BOTH;
    Ok(Reading { size, values: map.plane(0).to_vec(), size_mm: cx.size_mm().as_vec2(), periodic })
}

impl Reading {
    /// The picture as the kernels take it.
    pub(super) fn raster(&self) -> Raster<'_> {
        Raster {
            values: &self.values,
            width: self.size.x as usize,
            height: self.size.y as usize,
            size: self.size_mm,
            periodic: self.periodic,
        }
    }

    /// The scalar of each link of a lattice.
    ///
    /// # Errors
    /// When somebody asks to stop.
    pub(super) fn along(
        &self,
        cx: &Context<'_>,
        lattice: &Lattice,
        (sample, reduction): (Sample, Reduction),
    ) -> Result<Vec<f32>, Stop> {
        let links = Links { pairs: lattice.links.to_vec(), wraps: lattice.offsets.to_vec() };
        let end = |l: usize| links.ends(l, &lattice.points.positions, self.size_mm);
        let ends: Vec<[Vec2; 2]> = (0..links.pairs.len()).map(end).collect();
        let along = match sample {
            Sample::Smooth => Along::Smooth,
            Sample::Line => Along::Line,
            Sample::Near(radius) => Along::Near(narrow(radius)),
        };
        let (raster, mut scalars) = (self.raster(), Vec::with_capacity(ends.len()));
        for part in ends.chunks(LINKS_AT_ONCE) {
            cx.check()?;
            scalars.extend(raster.along_all(part, along, reduction.kernel()));
        }
        Ok(scalars)
    }
}
