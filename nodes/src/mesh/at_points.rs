//! Reads fields of an atlas at places of the surface.
use glam::{DVec2, UVec2};
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Field, Stop, Tile, Window};

/// Maximum number of columns or rows of samples of a field.
const MOST: f64 = 4096.0;

/// Samples of a field on an atlas, four per pitch.
pub(super) struct AtPoints {
    picture: Tile,
}

impl AtPoints {
    /// Reads `field`, the input of `port`.
    pub(super) fn read(
        cx: &Context<'_>,
        atlas: &Atlas,
        pitch: f64,
        (field, port): (&Field, &str),
    ) -> Result<Self, Stop> {
        // Lengths on the surface are `scale` times those on the canvas.
        let pixels = cx.size_mm() * atlas.scale() / pitch * 4.0;
        let size: UVec2 = pixels.ceil().clamp(DVec2::splat(16.0), DVec2::splat(MOST)).as_uvec2();
        let picture = cx.evaluator.raster(field, &cx.canvas.grid(size), Window::full(size))?;
        if let Some(bad) = picture.data().iter().find(|v| !v.is_finite()) {
            let message = format!("{port} has the value `{bad}` somewhere; it must be finite everywhere");
            return Err(Problem::new(Code::NotFinite, message).at(port).into());
        }
        Ok(Self { picture })
    }

    /// The value at a place of a triangle, given by barycentric weights.
    pub(super) fn at(&self, atlas: &Atlas, triangle: usize, weights: [f64; 3]) -> f64 {
        let corners = atlas.uvs[triangle].map(|uv| uv.as_dvec2());
        let uv: DVec2 = corners.iter().zip(weights).map(|(corner, weight)| *corner * weight).sum();
        let size = DVec2::new(self.picture.width() as f64, self.picture.height() as f64);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the picture")]
        let [x, y] = (uv * size).floor().clamp(DVec2::ZERO, size - 1.0).to_array().map(|k| k as usize);
        f64::from(self.picture.row(0, y)[x])
    }
}
