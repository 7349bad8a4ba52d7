//! The inputs of a synthesis on a surface, level by level.
use super::inputs::FieldInputs;
use shibo_kernel::mesh::frame::Framing;
use shibo_kernel::synthesis::aniso::{Jacobians, Position};
use shibo_kernel::synthesis::driver::{Fixed, Inputs};
use shibo_kernel::synthesis::jacobian::Jacobian;
use shibo_kernel::synthesis::region::Region;
use shibo_kernel::synthesis::sheet::Sheet;
use shibo_kernel::synthesis::surface::SurfaceInputs;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Field, Frames, Stop};
use std::sync::Arc;

/// The fields that control a synthesis on a surface.
pub(super) struct SurfaceFields<'a> {
    /// The fields shared with the plane.
    pub(super) fields: FieldInputs<'a>,
    pub(super) atlas: Arc<Atlas>,
    pub(super) frames: Arc<Frames>,
    /// Rotation of the directions, in degrees.
    pub(super) angle: Option<Field>,
    /// Size of the features.
    pub(super) scale: Option<Field>,
    /// The size of an exemplar pixel in mm.
    pub(super) exemplar: glam::DVec2,
}

impl Inputs for SurfaceFields<'_> {
    type Stop = Stop;

    fn jacobians(&self, _region: &Region) -> Result<Option<Jacobians>, Stop> {
        Ok(None)
    }

    fn guide(&self, region: &Region) -> Result<Vec<f32>, Stop> {
        self.fields.guide(region)
    }

    fn fixed(&self, region: &Region) -> Result<Option<Fixed>, Stop> {
        self.fields.fixed(region)
    }

    fn jitter(&self, region: &Region) -> Result<Vec<f32>, Stop> {
        self.fields.jitter(region)
    }

    fn start(&self, region: &Region) -> Result<Vec<Position>, Stop> {
        self.fields.start(region)
    }

    fn step(&self, done: usize, total: usize) -> Result<(), Stop> {
        self.fields.step(done, total)
    }
}

impl SurfaceInputs for SurfaceFields<'_> {
    fn along(&self, sheet: &Sheet<'_>) -> Result<Vec<Jacobian>, Stop> {
        let values = |field: &Option<Field>, port: &str| match field {
            Some(field) => self.fields.finite(field, &sheet.region(), port),
            None => Ok(Vec::new()),
        };
        let (angles, scales) = (values(&self.angle, "angle")?, values(&self.scale, "scale")?);
        let framing = Framing { atlas: &self.atlas, frames: &self.frames };
        let jacobians = sheet.jacobians(&framing, self.exemplar, (&angles, &scales));
        match sheet.fault(&jacobians) {
            None => Ok(jacobians),
            Some((pixel, fault)) => Err(self.faulty(sheet, pixel, fault, &jacobians[pixel]).into()),
        }
    }
}

impl SurfaceFields<'_> {
    fn faulty(&self, sheet: &Sheet<'_>, pixel: usize, fault: &str, [a, b, c, d]: &Jacobian) -> Problem {
        let triangle = sheet.level.triangle(pixel).unwrap_or_default();
        let at = sheet.place(pixel).unwrap_or_default();
        let mesh = &self.atlas.mesh;
        let part = mesh.parts.get(triangle).and_then(|part| mesh.part_names.get(usize::from(*part)));
        let of = part.filter(|name| !name.is_empty()).map_or_else(String::new, |name| format!(" of `{name}`"));
        let message = format!(
            "the Jacobian is {fault} at ({:.3}, {:.3}, {:.3}) mm in triangle {triangle}{of}, where it is [{a}, {b}; {c}, {d}]",
            at.x, at.y, at.z
        );
        let help =
            "features must keep an area there: look at the directions' length, `scale`, and the stretch of the atlas";
        Problem::new(Code::BadValue, message).at("frames").help(help)
    }
}
