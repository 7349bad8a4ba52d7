//! Fields that a node reads while it is evaluated, at places that it chooses.
use glam::{DVec2, UVec2};
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tile, Tiling, Window};

/// Samples along the longer side of the canvas.
const SAMPLES: f64 = 512.0;

/// A field, read at places that do not depend on the resolution of the picture.
pub(crate) enum Samples {
    Constant(f64),
    Sampled { tile: Tile, pixel: DVec2, tiling: Tiling },
}

impl Samples {
    /// Reads the field at the port called `port`.
    pub(crate) fn new(cx: &Context<'_>, field: &Field, port: &str) -> Result<Self, Stop> {
        if let Some(values) = field.as_constant() {
            return Ok(Self::Constant(values.first().map_or(0.0, |v| f64::from(*v))));
        }
        let size = cx.size_mm();
        let pixels: UVec2 = (size / size.max_element() * SAMPLES).round().max(DVec2::splat(4.0)).as_uvec2();
        let tile = cx.evaluator.raster(field, &cx.canvas.grid(pixels), Window::full(pixels))?;
        if let Some(bad) = tile.data().iter().find(|v| !v.is_finite()) {
            let message = format!("{port} has the value `{bad}` somewhere; it must be finite everywhere");
            return Err(Problem::new(Code::NotFinite, message).at(port).into());
        }
        Ok(Self::Sampled { tile, pixel: size / pixels.as_dvec2(), tiling: cx.tiling() })
    }

    /// The mean over the canvas.
    pub(crate) fn mean(&self) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Sampled { tile, .. } => {
                tile.plane(0).iter().map(|v| f64::from(*v)).sum::<f64>() / tile.plane(0).len().max(1) as f64
            }
        }
    }

    /// True if the value is the same everywhere.
    pub(crate) const fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }

    /// The value at a point of the canvas, or that at the edge nearest to it.
    pub(crate) fn at(&self, p: DVec2) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Sampled { tile, pixel, tiling } => {
                let counts = glam::IVec2::new(tile.window.width.cast_signed(), tile.window.height.cast_signed());
                let at = (p / *pixel).floor().as_ivec2();
                let place = |at: i32, count: i32, wraps: bool| {
                    if wraps { at.rem_euclid(count) } else { at.clamp(0, count - 1) }.cast_unsigned() as usize
                };
                let (x, y) = (place(at.x, counts.x, tiling.x), place(at.y, counts.y, tiling.y));
                f64::from(tile.row(0, y)[x])
            }
        }
    }
}
