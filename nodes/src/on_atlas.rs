//! Heights on a surface: continuation beyond the borders of charts, and normals relative to the axes of the atlas.
use glam::DVec2;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::tile;
use shibo_kernel::mesh::across::{AtlasPicture, Holds, normal_of};
use shibo_kernel::mesh::texels;
use shibo_kernel::surface::normal::{self, NormalSpec};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Field, FieldSource, Given, Grid, Halo, Pictures, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::Arc;

/// A field whose charts are continued beyond their borders by the values that lie there on the surface. Needs the whole
/// picture.
pub(crate) struct Carried {
    pub(crate) input: Field,
    pub(crate) atlas: Arc<Atlas>,
    /// Distance over which charts are continued.
    pub(crate) reach: Reach,
}

/// Distance over which charts are continued beyond their borders.
#[derive(Clone, Copy)]
pub(crate) enum Reach {
    /// A number of pixels.
    Pixels(u32),
    /// A length in mm of the canvas, at most [`MOST`] pixels.
    Mm(f64),
}

/// Maximum number of pixels that a filter reads beyond a border.
const MOST: f64 = 64.0;

impl Carried {
    /// The distance in pixels of a grid.
    fn width(&self, grid: &Grid) -> Result<usize, Problem> {
        match self.reach {
            Reach::Pixels(pixels) => Ok(pixels as usize),
            Reach::Mm(mm) => {
                let pixels = (mm / grid.step.min_element()).ceil();
                if pixels > MOST {
                    let message = format!(
                        "the radius reaches `{pixels}` texels beyond borders of charts; up to {MOST} are possible"
                    );
                    let help = "lower `radius` or the resolution";
                    return Err(Problem::new(Code::TooLarge, message).at("radius").help(help));
                }
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited just before")]
                let pixels = pixels as usize;
                Ok(pixels.max(1))
            }
        }
    }

    /// The pixels of a grid that the atlas covers.
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
    fn window(&self, grid: &Grid) -> Window {
        let first = (-grid.origin / grid.step + 1e-6).floor();
        let last = ((self.atlas.size_mm - grid.origin) / grid.step - 1e-6).ceil();
        let count = (last - first).max(DVec2::ONE);
        let size = |n: f64| u32::try_from(n as i64).unwrap_or(1);
        Window { x: first.x as i32, y: first.y as i32, width: size(count.x), height: size(count.y) }
    }
}

impl FieldSource for Carried {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.input, grid, window)]
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        vec![Read::new(&self.input, grid, self.window(grid))]
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let window = self.window(grid);
        let mut tile = pictures.read(0, window)?;
        let mut planes: Vec<Vec<f32>> = (0..tile.channels()).map(|c| tile.plane(c).to_vec()).collect();
        let holds = match self.input.ty() {
            Type::Normal => Holds::Normals,
            Type::Ids => Holds::Ids,
            _ => Holds::Values,
        };
        AtlasPicture { atlas: &self.atlas, grid, window }.carry(self.width(grid)?, holds, &mut planes);
        planes.iter().enumerate().for_each(|(c, plane)| tile.plane_mut(c).copy_from_slice(plane));
        Ok(Some(tile))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        let window = self.window(grid);
        u64::from(window.width) * u64::from(window.height) * (8 * self.input.channels() as u64 + 12)
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, window) = (given.tile(0), out.window);
        for channel in 0..out.channels() {
            out.plane_mut(channel).copy_from_slice(input.plane(channel));
        }
        let Some(carried) = given.prepared() else { return Ok(()) };
        let (columns, from) = (window.width as usize, carried.window);
        let end = |first: i32, count: u32| i64::from(first) + i64::from(count);
        let clip = |a: Window, b: Window| {
            let (low, high) = (a.x.max(b.x), end(a.x, a.width).min(end(b.x, b.width)));
            (low, usize::try_from(high - i64::from(low)).unwrap_or(0))
        };
        let (x, count) = clip(window, from);
        let offset = |k: i32, first: i32| usize::try_from(k - first).unwrap_or(0);
        for channel in 0..out.channels() {
            let plane = carried.plane(channel);
            for (row, y) in (0..window.height as usize).zip(window.y..) {
                if count == 0 || y < from.y || i64::from(y) >= end(from.y, from.height) {
                    continue;
                }
                let source = offset(y, from.y) * from.width as usize + offset(x, from.x);
                let to = row * columns + offset(x, window.x);
                out.plane_mut(channel)[to..to + count].copy_from_slice(&plane[source..source + count]);
            }
        }
        Ok(())
    }
}

/// The normals of a height on a surface. `spec` sets the strength, the direction of y and how slopes are measured.
pub(crate) fn normals(height: Field, atlas: Arc<Atlas>, spec: NormalSpec) -> Field {
    let carried = Field::new(
        Type::Gray,
        Tiling::NONE,
        Carried { input: height, atlas: Arc::clone(&atlas), reach: Reach::Pixels(2) },
    );
    Field::map(Type::Normal, [carried], Halo::px(normal::HALO), move |out, [height]| {
        let plain = NormalSpec { step: tile::step(&out.grid), y_up: false, encode: false, ..spec };
        normal::normal(&tile::view(height, 0), out.window, &plain, tile::planes3(out));
        let (grid, window, n) = (out.grid, out.window, out.window.len());
        let mut ids = vec![0.0f32; n];
        texels::fill(&atlas, &grid, window, &mut ids);
        let data = out.data_mut();
        for (p, id) in ids.into_iter().enumerate() {
            let [x, y, z] = [0, 1, 2].map(|c| f64::from(data[c * n + p]));
            let slope = DVec2::new(-x / z, -y / z);
            let mut value = match texels::triangle(id) {
                Some(triangle) => normal_of(&atlas, triangle, slope),
                None => [0.5, 0.5, 1.0],
            };
            if !spec.y_up {
                value[1] = 1.0 - value[1];
            }
            (0..3).for_each(|c| data[c * n + p] = value[c]);
        }
        Ok(())
    })
}

/// A field blurred by a Gaussian of `sigma` mm on the surface, which reads across borders of charts.
pub(crate) fn blurred(input: Field, atlas: Arc<Atlas>, sigma: f64) -> Field {
    // Three σ: the Gaussian is negligible beyond.
    let (ty, size, sigma) = (input.ty(), atlas.size_mm, sigma / atlas.scale());
    let carried = Field::new(ty, Tiling::NONE, Carried { input, atlas, reach: Reach::Mm(3.0 * sigma) });
    fields::blurred(&carried, sigma, size)
}

#[cfg(test)]
mod tests {
    use crate::filter::Blur;
    use crate::mesh::{MeshAtlas, MeshForm, MeshShape, TangentField};
    use crate::surface::{AmbientOcclusion, HeightToNormal};
    use crate::synthesis::JacobianFromMesh;
    use crate::testing::{canvas, check_field, field, lumps, outputs, port, render};
    use shibo_value::Value;

    /// A height, the atlas of a cube, and directions on it.
    fn inputs() -> [Value; 3] {
        let shape = MeshShape { shape: MeshForm::Cube, ..MeshShape::default() };
        let mesh = outputs(&shape, &[], &canvas()).unwrap().take("mesh", true).cloned().unwrap();
        let one = std::slice::from_ref(&mesh);
        let atlas = MeshAtlas { mesh: port(0), ..MeshAtlas::default() };
        let atlas = outputs(&atlas, one, &canvas()).unwrap().take("atlas", true).cloned().unwrap();
        let flow = TangentField { mesh: port(0), ..TangentField::default() };
        let flow = outputs(&flow, one, &canvas()).unwrap().take("frames", true).cloned().unwrap();
        [lumps().into(), atlas, flow]
    }

    #[test]
    fn fields_on_atlases_hold_in_any_window() {
        let inputs = inputs();
        let atlas = || Some(port(1));
        check_field(&field(&HeightToNormal { input: port(0), atlas: atlas(), ..HeightToNormal::default() }, &inputs));
        check_field(&field(&Blur { input: port(0), radius: 2.0, atlas: atlas() }, &inputs));
        let occlusion = AmbientOcclusion { input: port(0), radius: 2.0, atlas: atlas(), ..AmbientOcclusion::default() };
        check_field(&field(&occlusion, &inputs));
        check_field(&field(
            &JacobianFromMesh { atlas: port(1), frames: port(2), ..JacobianFromMesh::default() },
            &inputs,
        ));
    }

    /// The cube is smaller on the canvas than in space, so a radius of 2 mm on the surface is less on the canvas.
    #[test]
    fn radii_are_measured_on_the_surface() {
        let inputs = inputs();
        let span = |node: &Blur| {
            let tile = render(node, &inputs);
            tile.data().iter().fold(f32::MIN, |a, b| a.max(*b)) - tile.data().iter().fold(f32::MAX, |a, b| a.min(*b))
        };
        let canvas = Blur { input: port(0), radius: 6.0, atlas: None };
        assert!(span(&Blur { atlas: Some(port(1)), ..canvas.clone() }) > 1.5 * span(&canvas));
    }
}
