//! A field as it looks through an affine map: what [`Transform`](super::Transform) makes.
use crate::kernel::resample::{self, Places};
use crate::kernel::tile;
use glam::{DMat2, DVec2};
use shibo_engine::value::{Field, FieldSource, Grid, Reader, Stop, Tile, Type, Window};

/// A field moved by an affine map.
pub(super) struct Moved {
    /// What is moved.
    pub(super) input: Field,
    /// From the result to the input, without its shift.
    pub(super) inverse: DMat2,
    /// Sine and cosine of the angle.
    pub(super) turn: (f64, f64),
    /// Where the pivot goes.
    pub(super) shift: DVec2,
    /// The point of the input that goes there.
    pub(super) pivot: DVec2,
    /// The canvas.
    pub(super) size: DVec2,
}

/// How the input's pixels lie under those of the result.
enum Plan {
    /// Pixel (x, y) shows the input's pixel (x, y) - shift.
    Copy { grid: Grid, shift: (i32, i32) },
    /// Pixel (x, y) shows the place `map`·(x, y), counted from the centre of pixel (0, 0).
    Read { grid: Grid, map: DMat2 },
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
        let grid = Grid { step, ..*grid }.centered_at(first);
        Plan::Read { grid, map: DMat2::from_diagonal(1.0 / step) * map }
    }

    fn copy(&self, reader: &dyn Reader, grid: &Grid, (dx, dy): (i32, i32), out: &mut Tile) -> Result<(), Stop> {
        let window = Window { x: out.window.x - dx, y: out.window.y - dy, ..out.window };
        let input = reader.read(&self.input, grid, window)?;
        out.data_mut().copy_from_slice(input.data());
        Ok(())
    }

    #[expect(clippy::cast_possible_truncation, reason = "pixels, and f32 for what lies between them")]
    fn read(&self, reader: &dyn Reader, grid: &Grid, map: DMat2, out: &mut Tile) -> Result<(), Stop> {
        let (window, rect) = (out.window, tile::rect(out.window));
        let at = |x: i32, y: i32| map * DVec2::new(f64::from(x), f64::from(y));
        let (right, bottom) = (window.right() - 1, window.bottom() - 1);
        let corners = [at(window.x, window.y), at(right, window.y), at(window.x, bottom), at(right, bottom)];
        let low = corners.into_iter().fold(DVec2::MAX, DVec2::min).floor();
        let high = corners.into_iter().fold(DVec2::MIN, DVec2::max).floor();
        let size = |d: f64| d as u32 + 1;
        let whole =
            Window { x: low.x as i32, y: low.y as i32, width: size(high.x - low.x), height: size(high.y - low.y) };
        let halo = resample::HALO as i32;
        let input = reader.read(&self.input, grid, whole.grow(halo, halo))?;
        let views: Vec<_> = (0..out.channels()).map(|channel| tile::view(&input, channel)).collect();
        let mut planes = out.planes_mut();
        resample::resample(
            &views,
            rect,
            &mut planes,
            #[inline(always)]
            |x, y, places: &mut Places| {
                let row = map.y_axis * f64::from(y);
                for (k, x) in (x..).take(resample::BLOCK).enumerate() {
                    let (px, py) = (map.x_axis.x * f64::from(x) + row.x, map.x_axis.y * f64::from(x) + row.y);
                    let (i, j) = (px.floor(), py.floor());
                    (places.i[k], places.j[k]) = (i as i32, j as i32);
                    (places.u[k], places.v[k]) = ((px - i) as f32, (py - j) as f32);
                }
            },
        );
        Ok(())
    }
}

impl FieldSource for Moved {
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        match self.plan(&out.grid) {
            Plan::Copy { grid, shift } => self.copy(reader, &grid, shift, out)?,
            Plan::Read { grid, map } => self.read(reader, &grid, map, out)?,
        }
        if self.input.ty() == Type::Normal && self.turn != (0.0, 1.0) {
            turn_normals(out, self.turn);
        }
        Ok(())
    }

    fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)> {
        match self.plan(grid) {
            Plan::Copy { grid, .. } | Plan::Read { grid, .. } => vec![(&self.input, grid)],
        }
    }
}

/// Turns normals kept as ½ + ½n with y up, as the picture was turned with y down.
#[expect(clippy::cast_possible_truncation, reason = "a direction needs no more than f32")]
fn turn_normals(out: &mut Tile, (sin, cos): (f64, f64)) {
    let (sin, cos) = (sin as f32, cos as f32);
    let [x, y, _] = tile::planes3(out);
    for (x, y) in x.iter_mut().zip(y) {
        let (a, b) = (*x - 0.5, *y - 0.5);
        (*x, *y) = (0.5 + (cos * a + sin * b), 0.5 + (cos * b - sin * a));
    }
}
