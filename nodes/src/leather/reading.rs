//! Reads a scalar field as a picture, for several nodes. The size of the picture depends on their parameters, never on
//! the resolution of the output.
use glam::{DVec2, UVec2, Vec2};
use shibo_kernel::leather::lines::{Raster, Reduction, Sample};
use shibo_kernel::leather::links::Links;
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Lattice, ScalarMap, Stop, Tile, Tiling, Window};

/// Maximum number of columns or rows at which a field is read by default.
const MOST_SAMPLES: f64 = 4096.0;

/// Pixels read between two checks for cancellation: a few milliseconds of work.
const PIXELS_AT_ONCE: f64 = (1 << 22) as f64;

/// Maximum number of pixels read near links or points: some seconds of work.
const MOST_PIXELS: f64 = 2e9;

/// Samples of a field over the whole canvas.
pub(super) struct FieldSamples {
    /// Columns and rows.
    pub(super) size: UVec2,
    /// Values by rows, all finite.
    pub(super) values: Vec<f32>,
    size_mm: Vec2,
    periodic: bool,
}

/// Reads `field`, the input of `port`, at `resolution`; by default at that of the picture if the field is a picture,
/// otherwise at four samples per `pitch`. Coordinates wrap in the directions of `periodic`.
pub(super) fn read(
    cx: &Context<'_>,
    (pitch, periodic): (f32, Tiling),
    (field, port): (&Field, &str),
    resolution: Option<(u32, u32)>,
) -> Result<FieldSamples, Stop> {
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
    Ok(FieldSamples { size, values: map.plane(0).to_vec(), size_mm: cx.size_mm().as_vec2(), periodic })
}

/// A field over the whole canvas at four samples per pitch, read at the nearest sample.
pub(super) struct SampledMap {
    map: Tile,
    size_mm: Vec2,
    periodic: bool,
}

impl SampledMap {
    /// Places beyond the canvas wrap to its other side if `periodic`, otherwise they are clamped to its edge. `pitch`
    /// is in mm.
    ///
    /// # Errors
    /// If the field cannot be computed, or the work is cancelled.
    pub(super) fn read(cx: &Context<'_>, field: &Field, pitch: f64, periodic: bool) -> Result<Self, Stop> {
        let samples = (cx.size_mm() / (pitch * 0.25)).ceil().clamp(DVec2::ONE, DVec2::splat(MOST_SAMPLES));
        let size = samples.as_uvec2();
        let map = cx.evaluator.raster(field, &cx.canvas.grid(size), Window::full(size))?;
        Ok(Self { map, size_mm: cx.size_mm().as_vec2(), periodic })
    }

    /// The sample nearest to a place in mm.
    pub(super) fn nearest(&self, p: Vec2) -> f32 {
        let Self { map, size_mm: size, periodic } = self;
        let beyond = p.cmplt(Vec2::ZERO).any() || p.cmpge(*size).any();
        let p = if beyond && *periodic { p.rem_euclid(*size) } else { p };
        let last = UVec2::new(map.window.width, map.window.height) - 1;
        let at = (p / *size * (last + 1).as_vec2()).floor().max(Vec2::ZERO).as_uvec2().min(last);
        map.row(0, at.y as usize)[at.x as usize]
    }
}

impl FieldSamples {
    /// The picture in the form of the kernels.
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
    /// If the work is cancelled.
    pub(super) fn along(
        &self,
        cx: &Context<'_>,
        lattice: &Lattice,
        (sample, reduction): (Sample, Reduction),
    ) -> Result<Vec<f32>, Stop> {
        let links = Links { pairs: lattice.links.to_vec(), wraps: lattice.offsets.to_vec() };
        let end = |l: usize| links.ends(l, &lattice.points.positions, self.size_mm);
        let ends: Vec<[Vec2; 2]> = (0..links.pairs.len()).map(end).collect();
        let at_once = match sample {
            Sample::Near(radius) => self.near(radius, lattice.points.pitch, ends.len(), MOST_PIXELS)?,
            Sample::Smooth | Sample::Line => 1 << 15,
        };
        let (raster, mut scalars) = (self.raster(), Vec::with_capacity(ends.len()));
        for part in ends.chunks(at_once) {
            cx.check()?;
            scalars.extend(raster.along_all(part, sample, reduction));
        }
        Ok(scalars)
    }

    /// Number of links of about `length`, or of points, to read between two checks for cancellation, if each reads the
    /// pixels within `radius` mm. `count` is the total number of links or points.
    ///
    /// # Errors
    /// If they read more than `most` pixels in all.
    fn near(&self, radius: f64, length: f32, count: usize, most: f64) -> Result<usize, Problem> {
        let scale = self.size.as_dvec2() / self.size_mm.as_dvec2();
        let mut sides = (2.0 * radius + f64::from(length)) * scale + 1.0;
        if !self.periodic {
            sides = sides.min(self.size.as_dvec2());
        }
        let each = sides.element_product();
        let wanted = each * count as f64;
        if wanted > most {
            let message = format!(
                "sample is `Near({radius})`, which would read about {wanted:.1e} pixels of the field; at most {most:.0e} are allowed"
            );
            let help = "use a smaller radius, or a lower sample_resolution";
            return Err(Problem::new(Code::TooLarge, message).at("sample").help(help));
        }
        let at_once = (PIXELS_AT_ONCE / each).clamp(4.0, 32768.0);
        Ok(glam::DVec2::splat(at_once).as_usizevec2().x)
    }

    /// The masses of points, which read the field.
    pub(super) fn masses(
        &self,
        cx: &Context<'_>,
        map: &ScalarMap,
        points: &[Vec2],
        steps: bool,
    ) -> Result<Vec<f32>, Stop> {
        let at_once = match map.radius {
            // Reading masses in every step must take little time.
            Some(radius) if steps => self.near(radius.into(), 0.0, points.len(), MOST_PIXELS / 100.0)?,
            Some(radius) => self.near(radius.into(), 0.0, points.len(), MOST_PIXELS)?,
            None => points.len().max(1),
        };
        let (raster, mut masses) = (self.raster(), Vec::with_capacity(points.len()));
        for part in points.chunks(at_once) {
            cx.check()?;
            masses.extend(part.iter().map(|place| mass_at(map, &raster, *place)));
        }
        Ok(masses)
    }
}

/// The mass of a point at a place.
pub(super) fn mass_at(map: &ScalarMap, raster: &Raster<'_>, place: Vec2) -> f32 {
    let reduce = if map.sum { Reduction::Sum } else { Reduction::Mean };
    let scalar = match map.radius {
        None => raster.at(place),
        Some(radius) => raster.along([place; 2], Sample::Near(f64::from(radius)), reduce),
    };
    map.range[0] + (map.range[1] - map.range[0]) * scalar
}
