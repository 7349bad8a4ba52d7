//! Fields that are computed by casting rays from each texel.
use shibo_kernel::mesh::bake::{self, Texels};
use shibo_kernel::mesh::fields;
use shibo_kernel::mesh::rays::Rays;
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

    /// The field of `value` at each texel; `empty` where there is no texel.
    pub(super) fn field(self, empty: f32, value: impl Fn(&Self, &TexelPoint) -> f32 + Send + Sync + 'static) -> Field {
        Field::new(Type::Gray, Tiling::NONE, Source { cast: self, empty, value }).overwriting()
    }
}

struct Source<F> {
    cast: Cast,
    empty: f32,
    value: F,
}

impl<F: Fn(&Cast, &TexelPoint) -> f32 + Send + Sync> FieldSource for Source<F> {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.cast.texels, grid, window)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window, atlas) = (out.grid, out.window, &*self.cast.atlas);
        let texels = Texels { atlas, grid: &grid, window, values: given.tile(0).plane(0) };
        let mut places: [Vec<f32>; 6] = std::array::from_fn(|_| vec![0.0; window.len()]);
        let [x, y, z, a, b, c] = &mut places;
        bake::places_on_triangles(&texels, [x, y, z]);
        bake::vertex_normals(&texels, [a, b, c]);
        let at = |k: usize, from: usize| glam::Vec3::from_array([0, 1, 2].map(|axis| places[from + axis][k]));
        for (k, out) in out.plane_mut(0).iter_mut().enumerate() {
            *out = self.empty;
            if let Some(n) = shibo_kernel::mesh::texels::triangle(texels.values[k]) {
                // Rays are slow: check for cancellation.
                given.check()?;
                let flat = atlas.mesh.cross(n).normalize_or_zero().as_vec3();
                *out = (self.value)(&self.cast, &TexelPoint { at: at(k, 0), normal: at(k, 3), flat });
            }
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        // Bounding boxes and triangles.
        100 * self.cast.atlas.mesh.triangles.len()
    }
}
