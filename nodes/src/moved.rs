//! A field as it looks through an affine map: what [`Transform`](crate::space::Transform) and
//! [`TransformMaterial`](crate::material::TransformMaterial) make.
use glam::{DMat2, DVec2};
use shibo_engine::node::Xy;
use shibo_engine::value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};
use shibo_kernel::filter::resample::{self, Places};
use shibo_kernel::ground::tile;

/// How features are laid out anew: scaled, then rotated about the pivot, then moved.
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

/// The sine and cosine of an angle in degrees, exact at multiples of 90°.
fn sin_cos(degrees: f64) -> (f64, f64) {
    let quarters = degrees / 90.0;
    if quarters.fract() != 0.0 {
        return (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
    }
    match quarters.rem_euclid(4.0) {
        0.0 => (0.0, 1.0),
        1.0 => (1.0, 0.0),
        2.0 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}

impl Placement {
    /// S⁻¹·R⁻¹: from the result to the input.
    fn inverse(&self) -> DMat2 {
        let (sin, cos) = sin_cos(self.angle);
        let (x, y) = (1.0 / self.scale.x, 1.0 / self.scale.y);
        DMat2::from_cols(DVec2::new(cos * x, -sin * y), DVec2::new(sin * x, cos * y))
    }

    /// The directions in which the result repeats if the input repeats in those of `input`: where a side of the canvas
    /// leads to a whole number of sides in the input.
    pub(crate) fn repeats(&self, size: DVec2, input: Tiling) -> Tiling {
        let whole = |side: DVec2| {
            let sides = self.inverse() * side / size;
            let near = (sides - sides.round()).abs().max_element() < 1e-9 * sides.abs().max_element().max(1.0);
            near && (input.x || sides.x.round() == 0.0) && (input.y || sides.y.round() == 0.0)
        };
        Tiling { x: whole(DVec2::new(size.x, 0.0)), y: whole(DVec2::new(0.0, size.y)) }
    }

    /// Whether everything stays where it is.
    pub(crate) fn is_identity(&self) -> bool {
        let Self { offset, angle, scale, .. } = self;
        *offset == Xy::new(0.0, 0.0) && angle % 360.0 == 0.0 && *scale == Xy::new(1.0, 1.0)
    }

    /// `input` laid out anew on a canvas of that size; normals are rotated with it.
    pub(crate) fn place(&self, input: &Field, size: DVec2) -> Field {
        let turned = input.ty() == Type::Normal && self.angle % 360.0 != 0.0;
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
    /// What is moved.
    input: Field,
    /// From the result to the input, without its shift.
    inverse: DMat2,
    /// Sine and cosine of the angle.
    turn: (f64, f64),
    /// Where the pivot goes.
    shift: DVec2,
    /// The point of the input that goes there.
    pivot: DVec2,
    /// The canvas.
    size: DVec2,
}

/// How the input's pixels lie relative to those of the result.
enum Plan {
    /// Pixel (x, y) shows the input's pixel (x, y) - shift.
    Copy { grid: Grid, shift: (i32, i32) },
    /// Pixel (x, y) shows the place `start` + `map`·(x, y), counted in pixels from the centre of pixel (0, 0).
    Read { grid: Grid, start: DVec2, map: DMat2 },
}

impl Moved {
    fn to_input(&self, point: DVec2) -> DVec2 {
        self.pivot + self.inverse * (point - self.shift)
    }

    #[expect(clippy::cast_possible_truncation, reason = "compared with what it was just after")]
    fn plan(&self, grid: &Grid) -> Plan {
        let first = self.to_input(grid.center(0, 0));
        if self.inverse == DMat2::IDENTITY {
            let pixels = (self.shift - self.pivot) / grid.step;
            let near = pixels.round();
            if (pixels - near).abs().max_element() < 1e-6 && near.abs().max_element() < 1e8 {
                return Plan::Copy { grid: *grid, shift: (near.x as i32, near.y as i32) };
            }
        }
        // Rows of the map from the result's pixels to mm of the input.
        let map = self.inverse * DMat2::from_diagonal(grid.step);
        let step = DVec2::new(map.row(0).length(), map.row(1).length());
        if map.x_axis.y == 0.0 && map.y_axis.x == 0.0 && map.x_axis.x > 0.0 && map.y_axis.y > 0.0 {
            return Plan::Copy { grid: Grid { step, ..*grid }.centered_at(first), shift: (0, 0) };
        }
        // A whole number of pixels to the canvas, so that what repeats is read in the same way everywhere.
        let step = self.size / (self.size / step - 1e-6).ceil().max(DVec2::ONE);
        let pixels = DMat2::from_diagonal(1.0 / step) * map;
        match self.native(step, first) {
            Some((grid, start)) if !is_whole(pixels) => {
                Plan::Read { grid, start, map: DMat2::from_diagonal(1.0 / grid.step) * map }
            }
            _ => Plan::Read { grid: Grid { step, ..*grid }.centered_at(first), start: DVec2::ZERO, map: pixels },
        }
    }

    /// The pixels of the picture that is moved, if they are as large as `step`, and where `point` lies among them. On
    /// any other pixels of that size the picture would be filtered twice: once to resample it to them, and once to
    /// rotate it.
    fn native(&self, step: DVec2, point: DVec2) -> Option<(Grid, DVec2)> {
        let grid = self.input.native()?;
        let start = (point - grid.center(0, 0)) / grid.step;
        let same = (step / grid.step - 1.0).abs().max_element() < 1e-6;
        (same && start.abs().max_element() < 1e8).then_some((grid, start))
    }

    /// The pixels that lie under `window`, with what resampling needs around them.
    #[expect(clippy::cast_possible_truncation, reason = "pixels")]
    fn under(window: Window, (start, map): (DVec2, DMat2)) -> Window {
        let at = |x: i32, y: i32| map.x_axis * f64::from(x) + (start + map.y_axis * f64::from(y));
        let (right, bottom) = (window.right() - 1, window.bottom() - 1);
        let corners = [at(window.x, window.y), at(right, window.y), at(window.x, bottom), at(right, bottom)];
        let low = corners.into_iter().fold(DVec2::MAX, DVec2::min).floor();
        let high = corners.into_iter().fold(DVec2::MIN, DVec2::max).floor();
        let size = |d: f64| d as u32 + 1;
        let whole =
            Window { x: low.x as i32, y: low.y as i32, width: size(high.x - low.x), height: size(high.y - low.y) };
        let halo = resample::HALO as i32;
        whole.grow(halo, halo)
    }

    /// The nearest pixels: between numbers of pieces nothing lies.
    #[expect(clippy::cast_possible_truncation, reason = "pixels")]
    fn nearest(input: &Tile, (start, map): (DVec2, DMat2), out: &mut Tile) {
        let (window, view) = (out.window, tile::view(input, 0));
        for (row, y) in (0..out.height()).zip(window.y..) {
            let from = start + map.y_axis * f64::from(y);
            for (out, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                let p = (map.x_axis * f64::from(x) + from + 0.5).floor();
                *out = view.at(p.x as i32, p.y as i32);
            }
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "pixels, and f32 for what lies between them")]
    fn resample(input: &Tile, (start, map): (DVec2, DMat2), out: &mut Tile) {
        let window = out.window;
        let views: Vec<_> = (0..out.channels()).map(|channel| tile::view(input, channel)).collect();
        let mut planes = out.planes_mut();
        resample::resample(
            &views,
            window,
            &mut planes,
            #[inline(always)]
            |x, y, places: &mut Places| {
                let row = start + map.y_axis * f64::from(y);
                for (k, x) in (x..).take(resample::BLOCK).enumerate() {
                    let (px, py) = (map.x_axis.x * f64::from(x) + row.x, map.x_axis.y * f64::from(x) + row.y);
                    let (i, j) = (px.floor(), py.floor());
                    (places.i[k], places.j[k]) = (i as i32, j as i32);
                    (places.u[k], places.v[k]) = ((px - i) as f32, (py - j) as f32);
                }
            },
        );
    }
}

/// Whether pixels are mapped to whole pixels, as with rotations by multiples of 90°: then they are copied.
fn is_whole(map: DMat2) -> bool {
    map.abs_diff_eq(DMat2::from_cols(map.x_axis.round(), map.y_axis.round()), 1e-6)
}

impl FieldSource for Moved {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let (grid, window) = match self.plan(grid) {
            Plan::Copy { grid, shift: (dx, dy) } => (grid, Window { x: window.x - dx, y: window.y - dy, ..window }),
            Plan::Read { grid, start, map } => (grid, Self::under(window, (start, map))),
        };
        vec![Read::new(&self.input, &grid, window)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        match self.plan(&out.grid) {
            Plan::Copy { .. } => out.data_mut().copy_from_slice(given.tile(0).data()),
            Plan::Read { start, map, .. } if self.input.ty() == Type::Ids => {
                Self::nearest(given.tile(0), (start, map), out)
            }
            Plan::Read { start, map, .. } => Self::resample(given.tile(0), (start, map), out),
        }
        if self.input.ty() == Type::Normal && self.turn != (0.0, 1.0) {
            turn_normals(out, self.turn);
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use crate::image::{Image, Wrap};
    use crate::space::Transform;
    use crate::testing::{Plain, canvas, check_field, field, port, raster, write_tiff};
    use glam::{DVec2, UVec2};
    use shibo_engine::node::{Call, DynNode, Xy};
    use shibo_engine::value::{Canvas, Field, Tiling, Value};
    use shibo_kernel::filter::sample::Filter;

    /// Noise of `side`² pixels.
    fn noise(side: u32) -> Vec<f32> {
        (0..side * side).map(|k| (k * k % 97) as f32 / 97.0).collect()
    }

    /// The `rgb` or `gray` of `node`, which is given that noise.
    fn picture(node: &Image, side: u32, name: &str) -> Field {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("noise.tif");
        write_tiff(&path, side, &["Y"], &[&noise(side)]);
        let files = [("path", path)];
        let call = Call { kind: "Image", canvas: &canvas(), inputs: &[], files: &files, evaluator: &Plain };
        let Some(Value::Field(field)) = DynNode::evaluate(node, &call).unwrap().take(name, false).cloned() else {
            panic!("{name}")
        };
        // Decoded before the folder is gone.
        raster(&field, &canvas());
        field
    }

    /// 40² pixels as large as those of the canvas, not on them.
    fn between_pixels() -> Image {
        Image { position: Xy::new(3.3, -5.1), size_mm: Some(Xy::new(20.0, 20.0)), ..Image::default() }
    }

    fn cubic(t: f64) -> [f64; 4] {
        let near = |t: f64| 1.5 * t * t * t - 2.5 * t * t + 1.0;
        let far = |t: f64| -0.5 * t * t * t + 2.5 * t * t - 4.0 * t + 2.0;
        [far(1.0 + t), near(t), near(1.0 - t), far(2.0 - t)]
    }

    /// The repeated noise, laid out as by [`between_pixels`], at `at` mm.
    fn read_once(pixels: &[f32], at: DVec2) -> f64 {
        let at = (at - DVec2::new(3.3, -5.1)) / 0.5 - 0.5;
        let (first, rest) = (at.floor().as_ivec2() - 1, at - at.floor());
        let (x, y) = (cubic(rest.x), cubic(rest.y));
        let value = |i: i32, j: i32| f64::from(pixels[(j.rem_euclid(40) * 40 + i.rem_euclid(40)) as usize]);
        let row = |j: i32| (first.x..).zip(x).map(|(i, x)| x * value(i, j)).sum::<f64>();
        (first.y..).zip(y).map(|(j, y)| y * row(j)).sum()
    }

    #[test]
    fn a_turned_picture_is_filtered_once() {
        let (pixels, input) = (noise(40), picture(&between_pixels(), 40, "gray"));
        for (angle, offset, size) in [(37.0, 0.0, 64), (-120.0, 7.77, 64), (37.0, 1e5, 64), (10.0, 0.0, 32)] {
            let scale = 64.0 / f64::from(size);
            let node = Transform {
                input: port(0),
                angle,
                offset: Xy::new(offset, 0.0),
                scale: Xy::new(scale, scale),
                ..Transform::default()
            };
            let fine = Canvas { resolution: UVec2::splat(size), ..canvas() };
            let turned = raster(&field(&node, &[input.clone().into()]), &fine);
            let back = DVec2::from_angle(-angle.to_radians());
            let mut squares = 0.0;
            for (k, v) in (0..).zip(turned.plane(0)) {
                let at = fine.grid(fine.resolution).center(k % size as i32, k / size as i32);
                let want = read_once(&pixels, 16.0 + back.rotate(at - 16.0 - DVec2::new(offset, 0.0)) / scale);
                squares += (f64::from(*v) - want).powi(2);
            }
            let rms = (squares / f64::from(size * size)).sqrt();
            assert!(rms < 1e-5, "{angle}° at {size}: {rms}");
        }
    }

    #[test]
    fn moves_and_quarter_turns_show_the_pixels() {
        // The position and the offset add up to whole pixels: ten in x, none in y.
        let pixels = noise(40);
        let node = Transform { input: port(0), offset: Xy::new(1.7, 5.1), ..Transform::default() };
        let moved = raster(&field(&node, &[picture(&between_pixels(), 40, "gray").into()]), &canvas());
        for (y, row) in (0..64).map(|y| (y, moved.row(0, y))) {
            assert!((0..64).all(|x| row[x] == pixels[(y % 40) * 40 + (x + 30) % 40]), "{y}");
        }
        // Whatever the filter of the picture, all values are its own.
        let nearest = Image { filter: Filter::Nearest, ..between_pixels() };
        let node = Transform { input: port(0), angle: 90.0, ..Transform::default() };
        let turned = raster(&field(&node, &[picture(&nearest, 40, "gray").into()]), &canvas());
        assert!(turned.plane(0).iter().all(|v| pixels.contains(v)));
    }

    #[test]
    fn a_turned_picture_holds_in_any_window() {
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            for (angle, offset) in [(37.0, 0.0), (-90.0, 0.3), (200.0, 1e6)] {
                let input = picture(&Image { wrap, ..between_pixels() }, 40, "rgb");
                let node = Transform { input: port(0), angle, offset: Xy::new(offset, 0.7), ..Transform::default() };
                check_field(&field(&node, &[input.into()]));
            }
        }
        // 23 pixels on 16 mm are as large as the pixels that a tiling rotation by 45° reads.
        let diagonal = Xy::new(0.5f64.sqrt(), 0.5f64.sqrt());
        let node = Transform { input: port(0), angle: 45.0, scale: diagonal, ..Transform::default() };
        let input = picture(&Image { size_mm: Some(Xy::new(16.0, 16.0)), ..Image::default() }, 23, "rgb");
        let turned = field(&node, &[input.into()]);
        assert_eq!(turned.tiling(), Tiling::BOTH);
        check_field(&turned);
    }
}
