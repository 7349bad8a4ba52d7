//! Fields that are computed by casting rays from texels, see [`sparse`]: from all where the values change, from few
//! where they do not.
use shibo_kernel::mesh::bake::{self, Texels};
use shibo_kernel::mesh::fields;
use shibo_kernel::mesh::rays::Rays;
use shibo_kernel::mesh::sparse::{self, Cells};
use shibo_value::{Atlas, Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::Arc;

/// A surface and the data needed to cast rays at it.
pub(super) struct Cast {
    atlas: Arc<Atlas>,
    texels: Field,
    /// The surface, prepared for rays.
    pub(super) rays: Rays,
    /// Length of the diagonal of the mesh's bounding box, in mm.
    pub(super) size: f64,
}

/// A texel on the surface.
pub(super) struct TexelPoint {
    /// Its position.
    pub(super) at: glam::Vec3,
    /// The normal, interpolated between vertices, so that charts agree at their borders.
    pub(super) normal: glam::Vec3,
    /// The normal of its triangle.
    pub(super) flat: glam::Vec3,
}

impl Cast {
    /// Prepares the triangles of the surface for rays.
    pub(super) fn new(atlas: &Arc<Atlas>) -> Self {
        let [low, high] = atlas.mesh.bounds();
        let size = (high - low).length();
        Self { atlas: atlas.clone(), texels: fields::texels(atlas), rays: Rays::new(&atlas.mesh), size }
    }

    /// The field of `value` at each texel; `empty` where there is no texel. Between texels whose values are `close`, given
    /// the least and the greatest of them, it is interpolated.
    pub(super) fn field(
        self,
        empty: f32,
        close: impl Fn(f32, f32) -> bool + Send + Sync + 'static,
        value: impl Fn(&Self, &TexelPoint) -> f32 + Send + Sync + 'static,
    ) -> Field {
        Field::new(Type::Gray, Tiling::NONE, Source { cast: self, empty, close, value }).overwriting()
    }
}

struct Source<C, F> {
    cast: Cast,
    empty: f32,
    close: C,
    value: F,
}

impl<C, F> FieldSource for Source<C, F>
where
    C: Fn(f32, f32) -> bool + Send + Sync,
    F: Fn(&Cast, &TexelPoint) -> f32 + Send + Sync,
{
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let window = sparse::covered(window, sparse::spacing(&self.cast.atlas, grid));
        vec![Read::new(&self.cast.texels, grid, window)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, inner, atlas) = (out.grid, out.window, &*self.cast.atlas);
        let (window, values) = (given.tile(0).window, given.tile(0).plane(0));
        let texels = Texels { atlas, grid: &grid, window, values };
        let mut places: [Vec<f32>; 6] = std::array::from_fn(|_| vec![0.0; window.len()]);
        let [x, y, z, a, b, c] = &mut places;
        bake::places_on_triangles(&texels, [x, y, z]);
        bake::vertex_normals(&texels, [a, b, c]);
        let at = |k: usize, from: usize| glam::Vec3::from_array([0, 1, 2].map(|axis| places[from + axis][k]));
        let triangle = |k: usize| shibo_kernel::mesh::texels::triangle(values[k]);
        let charts: Vec<Option<u16>> = (0..values.len()).map(|k| triangle(k).map(|n| atlas.charts[n])).collect();
        let normals: Vec<glam::Vec3> = (0..values.len()).map(|k| at(k, 3)).collect();
        let cells = Cells { window, charts: &charts, normals: &normals };
        let found = cells.values(sparse::spacing(atlas, &grid), &self.close, |k| {
            // Rays are slow: check for cancellation.
            given.check()?;
            let flat = triangle(k).map_or(normals[k], |n| atlas.mesh.cross(n).normalize_or_zero().as_vec3());
            Ok::<f32, Stop>((self.value)(&self.cast, &TexelPoint { at: at(k, 0), normal: normals[k], flat }))
        })?;
        let width = inner.width.max(1) as usize;
        for (row, out) in out.plane_mut(0).chunks_mut(width).enumerate() {
            let start = sparse::row_start(window, inner, row);
            for (out, value) in out.iter_mut().zip(&found[start..]) {
                *out = if value.is_nan() { self.empty } else { *value };
            }
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        // Bounding boxes and triangles.
        100 * self.cast.atlas.mesh.triangles.len()
    }
}
