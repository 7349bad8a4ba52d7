//! Atlases: meshes laid out on the canvas.
use super::{Key, Mesh, Number, Object, Shapes, Sketch};
use glam::{DVec2, DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A mesh with the position of each triangle in the unit square (v down), which is the canvas. Also holds precomputed
/// data for walking over the surface and for pictures of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Atlas {
    /// The surface.
    pub mesh: Arc<Mesh>,
    /// The UVs of the corners of each triangle, in multiples of 2⁻²⁴.
    pub uvs: Vec<[Vec2; 3]>,
    /// Chart of each triangle. Charts are numbered in the order of their lowest triangles.
    pub charts: Vec<u16>,
    /// Neighbours of each triangle beyond its edges `k`, from corner `k + 1` to corner `k + 2`: four times the index of
    /// the neighbour, plus the index of the shared edge there; [`END`](Self::END) at the border of the surface.
    pub across: Vec<[u32; 3]>,
    /// The inner edges `k` of each triangle, as bits `1 << k`: both sides have the same UVs, so the chart continues
    /// there.
    pub inner: Vec<u8>,
    /// The unit normal of each vertex: the mean of the normals of its triangles, weighted by their angles.
    pub smooth: Vec<Vec3>,
    /// The derivatives of the position on the surface in mm by u and by v, for each triangle.
    pub jacobians: Vec<[Vec3; 2]>,
    /// Triangles sorted into cells by position.
    pub bins: Bins,
    /// The area on the surface in mm².
    pub area: f64,
    /// The area in the unit square.
    pub used: f64,
    /// The canvas that the unit square covers, in mm.
    pub size_mm: DVec2,
    /// Bytes of the [`Key`] of all this. Atlases with the same key are equal, and so are fields made from them.
    pub key: [u8; 16],
}

/// A grid of square cells over the unit square, with the triangles whose bounding boxes touch each cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bins {
    /// Number of cells along a side.
    pub side: u32,
    /// For each cell, row by row, the start of its range in `triangles`; one more entry marks the end.
    pub starts: Vec<u32>,
    /// The triangles of all cells, in rising order within each.
    pub triangles: Vec<u32>,
}

impl Bins {
    /// The triangles of a cell.
    pub fn cell(&self, column: u32, row: u32) -> &[u32] {
        let n = (row * self.side + column) as usize;
        &self.triangles[self.starts[n] as usize..self.starts[n + 1] as usize]
    }
}

impl Atlas {
    /// Value in `across` at the border of the surface.
    pub const END: u32 = u32::MAX;

    /// Triangle beyond an edge, and the index of the shared edge there.
    pub fn across(&self, triangle: usize, edge: usize) -> Option<(usize, usize)> {
        let across = self.across[triangle][edge];
        (across != Self::END).then_some(((across >> 2) as usize, (across & 3) as usize))
    }

    /// True if the chart continues beyond an edge.
    pub fn is_inner(&self, triangle: usize, edge: usize) -> bool {
        self.inner[triangle] & (1 << edge) != 0
    }

    /// The key of a field made from this atlas, by its name and its parameters.
    pub fn key_of(&self, name: &str, parameters: &[u8]) -> Key {
        Key::of(name, &[&self.key, parameters])
    }

    /// Number of charts.
    pub fn chart_count(&self) -> usize {
        self.charts.iter().max().map_or(0, |most| usize::from(*most) + 1)
    }

    /// Position on the surface of a point of the unit square, extrapolated in the plane of the triangle.
    pub fn place(&self, triangle: usize, uv: DVec2) -> DVec3 {
        let [u, v] = self.jacobians[triangle].map(|axis| axis.as_dvec3());
        let d = uv - self.uvs[triangle][0].as_dvec2();
        self.mesh.corners(triangle)[0] + u * d.x + v * d.y
    }

    /// Mean ratio of lengths on the surface to lengths on the canvas.
    pub fn scale(&self) -> f64 {
        let canvas = self.used * self.size_mm.x * self.size_mm.y;
        if canvas > 0.0 { (self.area / canvas).sqrt() } else { 1.0 }
    }
}

#[derive(Serialize)]
struct ChartData {
    triangles: usize,
    area_mm2: Number<f64>,
    /// The corners of the bounding box.
    uv: [[Number; 2]; 2],
}

#[derive(Serialize)]
struct AtlasData {
    charts: Vec<ChartData>,
    /// The share of the unit square that is used.
    used: Number<f64>,
    area_mm2: Number<f64>,
    /// Per corner of each triangle, v down.
    uvs: Vec<[[Number; 2]; 3]>,
}

impl Object for Atlas {
    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.mesh.bytes()
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.charts)
            + size_of_val(&*self.across)
            + size_of_val(&*self.inner)
            + size_of_val(&*self.smooth)
            + size_of_val(&*self.jacobians)
            + size_of_val(&*self.bins.starts)
            + size_of_val(&*self.bins.triangles)
    }

    fn data(&self) -> impl Serialize {
        let mut charts: Vec<(usize, f64, [Vec2; 2])> =
            vec![(0, 0.0, [Vec2::splat(1.0), Vec2::ZERO]); self.chart_count()];
        for (triangle, chart) in self.charts.iter().enumerate() {
            let of = &mut charts[usize::from(*chart)];
            of.0 += 1;
            of.1 += 0.5 * self.mesh.cross(triangle).length();
            for uv in self.uvs[triangle] {
                of.2 = [of.2[0].min(uv), of.2[1].max(uv)];
            }
        }
        let data = |(triangles, area, uv): (usize, f64, [Vec2; 2])| ChartData {
            triangles,
            area_mm2: Number(area),
            uv: uv.map(|uv| uv.to_array().map(Number)),
        };
        AtlasData {
            charts: charts.into_iter().map(data).collect(),
            used: Number(self.used),
            area_mm2: Number(self.area),
            uvs: self.uvs.iter().map(|uvs| uvs.map(|uv| uv.to_array().map(Number))).collect(),
        }
    }

    fn sketch(&self) -> Option<Sketch> {
        let (all, size) = (self.uvs.len() * 3, self.size_mm.as_vec2());
        let line = |n: usize| [self.uvs[n / 3][n % 3] * size, self.uvs[n / 3][(n + 1) % 3] * size];
        let counts = vec![(self.chart_count(), "charts"), (self.uvs.len(), "triangles")];
        Some(Sketch::Canvas(Shapes {
            lines: Shapes::<Vec2>::thinned(all).map(line).collect(),
            counts,
            ..Shapes::default()
        }))
    }
}
