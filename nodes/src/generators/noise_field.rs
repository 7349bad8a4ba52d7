//! Noise as a field on the canvas.
use glam::{DVec2, IVec2, UVec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::tile;
use shibo_kernel::noise::cells::CellShape;
use shibo_kernel::noise::fractal::{Basis, Noise, NoiseSpec};
use shibo_kernel::noise::fractal_along::{Directions, NoiseAlong, doubled};
use shibo_node::{CanvasFacts, Context};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Type, Window};

/// The noise of `spec`, periodic where the canvas tiles.
pub(super) fn noise_field(cx: &Context<'_>, spec: &NoiseSpec, seed: u64) -> Field {
    let noise = Noise::new(spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(seed)));
    Field::generate(Type::Gray, cx.tiling(), move |out, _| {
        noise.fill(&tile::frame(out), out.plane_mut(0));
        Ok(())
    })
}

/// One octave of noise. Bumps have a size in mm across, are `aspect` times longer along, and are turned by an angle in
/// degrees.
pub(super) fn one_octave(cx: &Context<'_>, (size, aspect, angle): (f64, f64, f64), basis: Basis, seed: u64) -> Field {
    let shape = CellShape { size, aspect, angle: angle.to_radians() };
    noise_field(cx, &NoiseSpec { shape, basis, ..NoiseSpec::fbm(size, 1) }, seed)
}

/// The noise of `spec`, stretched along a field of directions in degrees.
pub(super) fn noise_along(cx: &Context<'_>, spec: &NoiseSpec, seed: u64, direction: Field) -> Field {
    let noise = NoiseAlong::new(spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(seed)));
    let tiling = cx.tiling().and(direction.tiling());
    Field::new(Type::Gray, tiling, Along { samples: samples(cx.canvas, spec), noise, direction })
}

/// The grid on which directions are sampled: eight samples per bump, whatever the picture's resolution.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to 4096")]
fn samples(canvas: &CanvasFacts, spec: &NoiseSpec) -> Grid {
    let apart = spec.shape.size * spec.shape.aspect.max(1.0) / 8.0;
    let count = (canvas.size_mm() / apart).ceil().clamp(DVec2::ONE, DVec2::splat(4096.0));
    canvas.grid(UVec2::new(count.x as u32, count.y as u32))
}

struct Along {
    noise: NoiseAlong,
    direction: Field,
    /// The grid on which directions are sampled.
    samples: Grid,
}

impl Along {
    /// The samples around a window.
    #[expect(clippy::cast_possible_truncation, reason = "places on a canvas")]
    fn around(&self, grid: &Grid, window: Window) -> Window {
        let reach = self.noise.reach();
        let low = grid.center(window.x, window.y) - reach;
        let high = grid.center(window.right() - 1, window.bottom() - 1) + reach;
        let place = |p: DVec2| ((p - self.samples.origin) / self.samples.step).floor();
        let (low, high) = (place(low) - 1.0, place(high) + 2.0);
        let (x, y) = (low.x as i32, low.y as i32);
        Window { x, y, width: (high.x as i32).abs_diff(x).max(1), height: (high.y as i32).abs_diff(y).max(1) }
    }
}

impl FieldSource for Along {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.direction, &self.samples, self.around(grid, window))]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let angles = given.tile(0);
        let (window, samples) = (angles.window, &self.samples);
        let all: Vec<[f32; 2]> = angles.plane(0).iter().map(|degrees| doubled(*degrees)).collect();
        let directions = Directions {
            origin: samples.origin + DVec2::new(f64::from(window.x), f64::from(window.y)) * samples.step,
            step: samples.step,
            size: IVec2::new(window.width.cast_signed(), window.height.cast_signed()),
            doubled: &all,
        };
        self.noise.fill(&tile::frame(out), &directions, out.plane_mut(0));
        given.check()
    }
}

/// Splits a direction: the angle in degrees if it is a known constant, otherwise the field.
pub(super) fn known_angle(direction: Option<Field>) -> (f64, Option<Field>) {
    match direction.as_ref().and_then(|field| field.as_constant()).map(|angle| f64::from(angle[0])) {
        Some(angle) => (angle, None),
        None => (0.0, direction),
    }
}

/// Advice for a direction that has no effect because `aspect` is 1.
pub(super) fn without_aspect(directed: bool, aspect: f64) -> Vec<Problem> {
    if !directed || aspect != 1.0 {
        return Vec::new();
    }
    let message = "`direction` has no effect while `aspect` is 1";
    vec![Problem::new(Code::Advice, message).at("direction").help("write `aspect: 3`, say")]
}
