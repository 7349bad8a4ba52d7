//! The relief of a surface: heights on the texels of its atlas, bilinear between them.
use crate::ground::number::narrow;
use crate::ground::window::WindowExt;
use crate::mesh::near::Near;
use crate::mesh::texels;
use glam::{DVec2, DVec3, UVec2};
use rayon::prelude::*;
use shibo_value::{Atlas, Grid, Window};

/// A texel of a chart whose height is not a finite number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NotFinite {
    /// Its centre on the canvas in mm.
    pub on_canvas: DVec2,
    /// Its place on the surface in mm.
    pub at: DVec3,
}

/// A relief that falls to 0 towards sharp edges.
#[derive(Clone, Copy, Debug)]
pub struct Creases {
    /// The distance over which it falls, in mm.
    pub reach: f64,
    /// The least angle between the triangles at a sharp edge, in radians.
    pub angle: f64,
}

/// Heights of a surface in mm along its normals.
pub struct Relief<'a> {
    pub(super) atlas: &'a Atlas,
    /// Heights of texels, row by row.
    values: Vec<f32>,
    /// Texels across and down.
    size: UVec2,
}

impl<'a> Relief<'a> {
    /// Takes the heights of `size` texels of an atlas, row by row. Between the last texel of a chart and its border,
    /// heights are interpolated with those of the gutter, which fields on atlases have.
    ///
    /// # Errors
    /// A texel of a chart or of its gutter is not a finite number.
    pub fn new(
        atlas: &'a Atlas,
        mut values: Vec<f32>,
        size: UVec2,
        creases: Option<Creases>,
    ) -> Result<Self, NotFinite> {
        let step = atlas.size_mm / size.as_dvec2();
        let grid = Grid { origin: DVec2::ZERO, step, period: None, shown: None };
        let window = Window::full(size);
        values.resize(window.len(), 0.0);
        let mut ids = vec![0.0; values.len()];
        texels::fill(atlas, &grid, window, &mut ids);
        let on_canvas = |pixel: usize| {
            let (x, y) = (pixel % window.columns(), pixel / window.columns());
            (DVec2::new(x as f64, y as f64) + 0.5) * step
        };
        let place = |pixel: usize| {
            let triangle = texels::triangle(ids[pixel])?;
            Some(atlas.place(triangle, on_canvas(pixel) / atlas.size_mm))
        };
        let bad = ids.iter().zip(&values).position(|(id, value)| *id != 0.0 && !value.is_finite());
        if let Some(pixel) = bad {
            return Err(NotFinite { on_canvas: on_canvas(pixel), at: place(pixel).unwrap_or_default() });
        }
        let fade = creases.map(|creases| Fade::new(atlas, creases));
        values.par_iter_mut().with_min_len(1024).enumerate().for_each(|(pixel, value)| {
            if !value.is_finite() {
                *value = 0.0;
            }
            if let Some((fade, at)) = fade.as_ref().zip(place(pixel)) {
                *value *= fade.share(at);
            }
        });
        Ok(Self { atlas, values, size })
    }

    /// A point of the unit square in texels; texel centres are whole numbers.
    #[inline]
    pub(super) fn in_texels(&self, uv: DVec2) -> DVec2 {
        uv * self.size.as_dvec2() - 0.5
    }

    /// Number of texels.
    pub fn texels(&self) -> u32 {
        self.size.element_product()
    }

    /// Texels across and down.
    pub(super) fn size(&self) -> [usize; 2] {
        self.size.as_usizevec2().to_array()
    }

    /// The height of a texel.
    #[inline]
    pub(super) fn of_texel(&self, x: usize, y: usize) -> f64 {
        f64::from(self.values[y * self.size.x as usize + x])
    }

    /// The height at a point, given in texels. Beyond the canvas it is that of the nearest texel.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the texels")]
    pub(super) fn at(&self, texels: DVec2) -> f64 {
        let last = self.size.as_dvec2() - 1.0;
        let texels = texels.clamp(DVec2::ZERO, last);
        let corner = texels.floor().min((last - 1.0).max(DVec2::ZERO));
        let part = texels - corner;
        let (x, y) = (corner.x as usize, corner.y as usize);
        let width = self.size.x as usize;
        let (right, down) = (usize::from(last.x > 0.0), if last.y > 0.0 { width } else { 0 });
        let of = |offset: usize| f64::from(self.values[y * width + x + offset]);
        let above = of(0) + (of(right) - of(0)) * part.x;
        let below = of(down) + (of(down + right) - of(down)) * part.x;
        above + (below - above) * part.y
    }
}

/// The most samples of sharp edges.
const SAMPLES: f64 = 1e6;

/// Sharp edges, and the distance over which relief falls towards them.
struct Fade {
    reach: f64,
    /// The distance of samples.
    step: f64,
    /// Samples of the edges, numbered by edge.
    near: Near,
    edges: Vec<[DVec3; 2]>,
}

impl Fade {
    fn new(atlas: &Atlas, Creases { reach, angle }: Creases) -> Self {
        let mesh = &atlas.mesh;
        let normal = |n: usize| mesh.cross(n).normalize_or_zero();
        let cosine = libm::cos(angle);
        let mut edges = Vec::new();
        for n in 0..mesh.triangles.len() {
            let corners = mesh.corners(n);
            for k in 0..3 {
                if let Some((other, _)) = atlas.across(n, k)
                    && other > n
                    && normal(n).dot(normal(other)) < cosine
                {
                    edges.push([corners[(k + 1) % 3], corners[(k + 2) % 3]]);
                }
            }
        }
        let length: f64 = edges.iter().map(|[a, b]| a.distance(*b)).sum();
        let step = (0.5 * reach).max(length / SAMPLES);
        let mut near = Near::new(reach + step);
        for (number, [a, b]) in (0..).zip(&edges) {
            let count = (a.distance(*b) / step).ceil().max(1.0);
            let mut k = 0.0;
            while k <= count {
                near.add(number, a.lerp(*b, k / count));
                k += 1.0;
            }
        }
        Self { reach, step, near, edges }
    }

    /// The share of the relief that stays at a place: 0 on a sharp edge, 1 beyond the reach.
    fn share(&self, at: DVec3) -> f32 {
        let far = |number: u32| {
            let [a, b] = self.edges[number as usize];
            let along = b - a;
            let part = ((at - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            at.distance(a + along * part)
        };
        let nearest = self.near.within(at, self.reach + self.step).map(far).fold(self.reach, f64::min);
        let x = nearest / self.reach;
        narrow(x * x * (3.0 - 2.0 * x))
    }
}
