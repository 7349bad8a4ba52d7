//! A field seen through an affine map: the core of [`Transform`](crate::space::Transform) and
//! [`TransformMaterial`](crate::material::TransformMaterial).
mod plan;
#[cfg(test)]
mod tests;

use crate::degrees::sin_cos;
use glam::{DMat2, DVec2};
use plan::ReadPlan;
use shibo_kernel::filter::resample::{self, SamplePositions};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_node::Xy;
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};

/// The affine map: features are scaled, then rotated about the pivot, then moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// mm.
    pub(crate) offset: Xy,
    /// Degrees from +x towards +y.
    pub(crate) angle: f64,
    pub(crate) scale: Xy,
    /// mm; the middle of the canvas if not given.
    pub(crate) pivot: Option<Xy>,
}

impl Placement {
    /// S⁻¹·R⁻¹: from the result to the input.
    fn inverse(&self) -> DMat2 {
        let (sin, cos) = sin_cos(self.angle);
        let (x, y) = (1.0 / self.scale.x, 1.0 / self.scale.y);
        DMat2::from_cols(DVec2::new(cos * x, -sin * y), DVec2::new(sin * x, cos * y))
    }

    /// The directions in which the result repeats if the input repeats in those of `input`: those where a side of the
    /// canvas maps to a whole number of sides of the input.
    pub(crate) fn repeats(&self, size: DVec2, input: Tiling) -> Tiling {
        let whole = |side: DVec2| {
            let sides = self.inverse() * side / size;
            let near = (sides - sides.round()).abs().max_element() < 1e-9 * sides.abs().max_element().max(1.0);
            near && (input.x || sides.x.round() == 0.0) && (input.y || sides.y.round() == 0.0)
        };
        Tiling { x: whole(DVec2::new(size.x, 0.0)), y: whole(DVec2::new(0.0, size.y)) }
    }

    /// True if the map moves nothing.
    pub(crate) fn is_identity(&self) -> bool {
        let Self { offset, angle, scale, .. } = self;
        *offset == Xy::new(0.0, 0.0) && angle % 360.0 == 0.0 && *scale == Xy::new(1.0, 1.0)
    }

    /// `input` transformed on a canvas of this size; normals and vectors are rotated with it, matrices transformed.
    pub(crate) fn place(&self, input: &Field, size: DVec2) -> Field {
        let turned = match input.ty() {
            Type::Normal | Type::Vec2 => self.angle % 360.0 != 0.0,
            ty => ty == Type::Jacobian,
        };
        if self.is_identity() || (input.as_constant().is_some() && !turned) {
            return input.clone();
        }
        let pivot = self.pivot.map_or(size * 0.5, |p| DVec2::new(p.x, p.y));
        let moved = Moved {
            input: input.clone(),
            inverse: self.inverse(),
            turn: sin_cos(self.angle),
            shift: pivot + DVec2::new(self.offset.x, self.offset.y),
            pivot,
            size,
        };
        Field::new(input.ty(), self.repeats(size, input.tiling()), moved)
    }
}

/// A field moved by an affine map.
struct Moved {
    /// The input.
    input: Field,
    /// The map from the result to the input, without its shift.
    inverse: DMat2,
    /// Sine and cosine of the angle.
    turn: (f64, f64),
    /// Where the pivot is moved to.
    shift: DVec2,
    /// The pivot: the point of the input that is moved to `shift`.
    pivot: DVec2,
    /// The canvas.
    size: DVec2,
}

impl Moved {
    fn to_input(&self, point: DVec2) -> DVec2 {
        self.pivot + self.inverse * (point - self.shift)
    }

    /// The grid of the picture's own pixels, if they are as large as `step`, and the position of `point` on it. On any
    /// other grid with that step the picture would be filtered twice: once to resample it to the grid, and once to
    /// rotate it.
    fn native(&self, step: DVec2, point: DVec2) -> Option<(Grid, DVec2)> {
        let grid = self.input.native()?;
        let start = (point - grid.center(0, 0)) / grid.step;
        let same = (step / grid.step - 1.0).abs().max_element() < 1e-6;
        (same && start.abs().max_element() < 1e8).then_some((grid, start))
    }

    /// Takes the nearest pixel: for maps from pixels to pixels, and for numbers of pieces, which must not be
    /// interpolated.
    fn nearest(input: &Tile, plan: &ReadPlan, out: &mut Tile) {
        let (window, wraps) = (out.window, plan.wraps(out.window));
        for channel in 0..out.channels() {
            let view = tile::view(input, channel);
            for (row, y) in (0..out.height()).zip(window.y..) {
                let from = plan.row(y);
                for (out, x) in out.row_mut(channel, row).iter_mut().zip(window.x..) {
                    let [i, j] = plan.pixel(plan.map.x_axis * f64::from(x) + from + 0.5, wraps).0;
                    *out = view.at(i, j);
                }
            }
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "f32 for what lies between pixels")]
    fn resample(input: &Tile, plan: &ReadPlan, out: &mut Tile) {
        let (window, wraps) = (out.window, plan.wraps(out.window));
        let views: Vec<_> = (0..out.channels()).map(|channel| tile::view(input, channel)).collect();
        let mut planes = out.planes_mut();
        resample::resample(
            &views,
            window,
            &mut planes,
            #[inline(always)]
            |x, y, places: &mut SamplePositions| {
                let row = plan.row(y);
                for (k, x) in (x..).take(resample::BLOCK).enumerate() {
                    let at = DVec2::new(plan.map.x_axis.x * f64::from(x), plan.map.x_axis.y * f64::from(x)) + row;
                    let ([i, j], rest) = plan.pixel(at, wraps);
                    (places.i[k], places.j[k]) = (i, j);
                    (places.u[k], places.v[k]) = (rest.x as f32, rest.y as f32);
                }
            },
        );
    }
}

impl FieldSource for Moved {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let plan = ReadPlan::new(self, grid);
        vec![Read::new(&self.input, &plan.grid, plan.reads(window, self.input.ty()))]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, plan) = (given.tile(0), ReadPlan::new(self, &out.grid));
        if plan.copies(out.window) {
            out.data_mut().copy_from_slice(input.data());
        } else if plan.whole || self.input.ty() == Type::Ids {
            Self::nearest(input, &plan, out);
        } else {
            Self::resample(input, &plan, out);
        }
        match self.input.ty() {
            Type::Normal if self.turn != (0.0, 1.0) => turn_normals(out, self.turn),
            Type::Vec2 if self.turn != (0.0, 1.0) => turn_vectors(out, self.turn),
            Type::Jacobian => map_matrices(out, self.inverse),
            _ => {}
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        // A map that sends axes to axes copies pixels.
        let DMat2 { x_axis: x, y_axis: y } = self.inverse;
        if x.y == 0.0 && y.x == 0.0 || x.x == 0.0 && y.y == 0.0 { Cost::Pointwise } else { Cost::Local }
    }
}

/// Rotates normals stored as ½ + ½n with y up, as the picture was rotated with y down.
#[expect(clippy::cast_possible_truncation, reason = "a direction needs no more than f32")]
fn turn_normals(out: &mut Tile, (sin, cos): (f64, f64)) {
    let (sin, cos) = (sin as f32, cos as f32);
    let [x, y, _] = tile::planes3(out);
    for (x, y) in x.iter_mut().zip(y) {
        let (a, b) = (*x - 0.5, *y - 0.5);
        (*x, *y) = (0.5 + (cos * a + sin * b), 0.5 + (cos * b - sin * a));
    }
}

/// Turns vectors with the picture.
fn turn_vectors(out: &mut Tile, (sin, cos): (f64, f64)) {
    let (sin, cos) = (narrow(sin), narrow(cos));
    if let [x, y] = &mut out.planes_mut()[..] {
        for (x, y) in x.iter_mut().zip(y.iter_mut()) {
            (*x, *y) = (cos * *x - sin * *y, sin * *x + cos * *y);
        }
    }
}

/// Matrices map steps on the canvas; those on the result are mapped to the input first.
fn map_matrices(out: &mut Tile, inverse: DMat2) {
    let [a, b, c, d] = [inverse.x_axis.x, inverse.y_axis.x, inverse.x_axis.y, inverse.y_axis.y].map(narrow);
    let mut planes = out.planes_mut();
    for row in planes.chunks_exact_mut(2) {
        let [left, right] = row else { continue };
        for (x, y) in left.iter_mut().zip(right.iter_mut()) {
            (*x, *y) = (*x * a + *y * c, *x * b + *y * d);
        }
    }
}
