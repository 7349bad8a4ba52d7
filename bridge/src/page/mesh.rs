//! Simplifies meshes that have too many triangles for the page, by merging vertices that are close together.
use shibo_picture::export::Shape;
use shibo_value::Atlas;
use std::collections::HashMap;

/// Maximum number of triangles sent.
const MOST: usize = 500_000;

/// A mesh as it is sent to pages.
pub struct PageMesh {
    /// Position, normal, direction of +u and texture coordinates of each vertex. The mesh is centred on the origin, y
    /// up, and its farthest point is at a distance of 1.
    pub vertices: Vec<[f32; 11]>,
    /// Vertex indices of all triangles.
    pub indices: Vec<u32>,
    /// For each triangle, its index in the original mesh.
    pub triangles: Vec<u32>,
    /// Length of one mm in page units.
    pub per_mm: f32,
    /// Position of the page's origin in mm, z up.
    pub middle: [f32; 3],
}

impl PageMesh {
    /// Converts the mesh of an atlas, ordered by parts, and clusters it if it is large.
    pub fn of(atlas: &Atlas) -> Self {
        let (vertices, indices, per_mm, middle) = Shape::atlas(atlas).around_the_origin();
        let count = u32::try_from(atlas.mesh.triangles.len()).unwrap_or(u32::MAX);
        let mut triangles: Vec<u32> = (0..count).collect();
        triangles.sort_by_key(|triangle| atlas.mesh.parts.get(*triangle as usize).copied().unwrap_or(0));
        Self { vertices, indices, triangles, per_mm, middle }.at_most(MOST, &atlas.charts)
    }

    /// Reduces the mesh to at most `most` triangles: within each chart, all vertices in a grid cell become the first of
    /// them, and triangles without area are dropped.
    pub fn at_most(self, most: usize, charts: &[u16]) -> Self {
        let area = self.indices.as_chunks::<3>().0.iter().map(|t| self.area(*t)).sum::<f32>();
        // The first cell size corresponds to about two triangles per cell.
        let mut cell = (2.0 * area / most as f32).sqrt();
        let mut made = None;
        while made.as_ref().unwrap_or(&self).triangles.len() > most {
            made = Some(self.clustered(cell, charts));
            cell *= 1.25;
        }
        made.unwrap_or(self)
    }

    /// The vertices, then the indices: little-endian numbers of 4 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let floats = self.vertices.iter().flatten().flat_map(|number| number.to_le_bytes());
        floats.chain(self.indices.iter().flat_map(|index| index.to_le_bytes())).collect()
    }

    fn area(&self, triangle: [u32; 3]) -> f32 {
        let [a, b, c] = triangle.map(|v| {
            let [x, y, z, ..] = self.vertices[v as usize];
            glam::Vec3::new(x, y, z)
        });
        0.5 * (b - a).cross(c - a).length()
    }

    fn clustered(&self, cell: f32, charts: &[u16]) -> Self {
        let mut known: HashMap<(u16, [i32; 3]), u32> = HashMap::new();
        let (mut vertices, mut indices, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (corners, triangle) in self.indices.as_chunks::<3>().0.iter().zip(&self.triangles) {
            let three = corners.map(|corner| {
                let vertex = self.vertices[corner as usize];
                #[expect(clippy::cast_possible_truncation, reason = "places are within 1 of the origin")]
                let place = [vertex[0], vertex[1], vertex[2]].map(|v| (v / cell).floor() as i32);
                *known.entry((charts[*triangle as usize], place)).or_insert_with(|| {
                    vertices.push(vertex);
                    u32::try_from(vertices.len() - 1).unwrap_or(u32::MAX)
                })
            });
            if three[0] != three[1] && three[1] != three[2] && three[2] != three[0] {
                indices.extend(three);
                triangles.push(*triangle);
            }
        }
        Self { vertices, indices, triangles, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of n × n quads; its left half is one chart, its right half another.
    fn square(n: u32) -> (PageMesh, Vec<u16>) {
        let share = |k: u32| k as f32 / n as f32;
        let at =
            |x: u32, y: u32| [share(x) - 0.5, share(y) - 0.5, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, share(x), share(y)];
        let vertices = (0..=n).flat_map(|y| (0..=n).map(move |x| at(x, y))).collect();
        let (mut indices, mut charts) = (Vec::new(), Vec::new());
        for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
            let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| y * (n + 1) + x);
            indices.extend([a, b, c, a, c, d]);
            charts.extend([u16::from(2 * x >= n); 2]);
        }
        let triangles = (0..2 * n * n).collect();
        (PageMesh { vertices, indices, triangles, per_mm: 1.0, middle: [0.0; 3] }, charts)
    }

    #[test]
    fn simplifies_large_meshes_within_charts() {
        let (whole, charts) = square(100);
        let area = |sent: &PageMesh| sent.indices.as_chunks::<3>().0.iter().map(|t| sent.area(*t)).sum::<f32>();
        assert!((area(&whole) - 1.0).abs() < 1e-3);
        let same = square(100).0.at_most(20_000, &charts);
        assert_eq!((same.indices.len(), same.vertices.len()), (60_000, 101 * 101));
        let sent = whole.at_most(2000, &charts);
        assert!((400..=2000).contains(&sent.triangles.len()), "{}", sent.triangles.len());
        assert_eq!(sent.indices.len(), 3 * sent.triangles.len());
        // At most a rim one cell wide is missing, and no triangle has vertices of two charts.
        assert!((area(&sent) - 1.0).abs() < 0.12, "{}", area(&sent));
        for (corners, triangle) in sent.indices.as_chunks::<3>().0.iter().zip(&sent.triangles) {
            let right = charts[*triangle as usize] == 1;
            let us = corners.map(|v| sent.vertices[v as usize][9]);
            assert!(us.iter().all(|u| if right { *u >= 0.5 } else { *u <= 0.5 }), "{us:?}");
        }
    }
}
