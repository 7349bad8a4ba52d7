//! Fields that control objects drawn on the canvas; they are sampled before drawing starts.
use glam::{DVec2, UVec2};
use shibo_node::{Context, In, PortType};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Window};

/// Maximum number of columns and rows of samples.
const MOST: f64 = 2048.0;

/// Samples of a field over the canvas.
pub(crate) struct Map {
    size: UVec2,
    values: Vec<f32>,
    size_mm: DVec2,
    tiling: Tiling,
}

impl Map {
    /// Samples the field that is connected to `port`, with about four samples per `pitch` mm.
    pub(crate) fn read<T: PortType<Got = Field>>(
        cx: &Context<'_>,
        (port, name): (&Option<In<T>>, &'static str),
        pitch: f64,
    ) -> Result<Option<Self>, Stop> {
        let Some(field) = cx.get_opt(port)? else { return Ok(None) };
        let map = match field.as_constant() {
            Some(values) => {
                Self { size: UVec2::ONE, values: values.to_vec(), size_mm: cx.size_mm(), tiling: Tiling::BOTH }
            }
            None => Self::sampled(cx, &field, pitch)?,
        };
        match map.values.iter().find(|v| !v.is_finite()) {
            None => Ok(Some(map)),
            Some(bad) => {
                let message = format!("{name} has the value `{bad}`; it must be finite everywhere");
                Err(Problem::new(Code::NotFinite, message).at(name).into())
            }
        }
    }

    fn sampled(cx: &Context<'_>, field: &Field, pitch: f64) -> Result<Self, Stop> {
        let wanted = cx.size_mm() / pitch.max(1e-9) * 4.0;
        let size = wanted.ceil().clamp(DVec2::splat(16.0), DVec2::splat(MOST)).as_uvec2();
        let tile = cx.evaluator.raster(field, &cx.canvas.grid(size), Window::full(size))?;
        Ok(Self { size, values: tile.plane(0).to_vec(), size_mm: cx.size_mm(), tiling: field.tiling() })
    }

    /// The four samples around a place, and their weights.
    pub(crate) fn around(&self, place: DVec2) -> [(f32, f64); 4] {
        let step = self.size_mm / self.size.as_dvec2();
        let at = place / step - 0.5;
        let share = at - at.floor();
        let first = (at.floor() + 0.5) * step;
        let part = |x: f64, y: f64| {
            let weight = (1.0 - (share.x - x).abs()) * (1.0 - (share.y - y).abs());
            (self.at(first + DVec2::new(x, y) * step), weight)
        };
        [part(0.0, 0.0), part(1.0, 0.0), part(0.0, 1.0), part(1.0, 1.0)]
    }

    /// The value of the sample that is nearest to a place.
    pub(crate) fn at(&self, place: DVec2) -> f32 {
        let at = (place / self.size_mm * self.size.as_dvec2()).floor().as_ivec2();
        let bring = |i: i32, n: u32, wraps: bool| {
            let n = n.cast_signed();
            (if wraps { i.rem_euclid(n) } else { i.clamp(0, n - 1) }).unsigned_abs()
        };
        let (x, y) = (bring(at.x, self.size.x, self.tiling.x), bring(at.y, self.size.y, self.tiling.y));
        self.values[y as usize * self.size.x as usize + x as usize]
    }
}
