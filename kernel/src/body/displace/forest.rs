//! Triangles that are halved at their longest edges, together with the neighbours beyond these edges, so that no gaps
//! arise (Rivara 1984).
//!
//! Points are shared by all triangles around them, also where charts meet. The edge that a triangle is cut at depends
//! on places and numbers of points alone, so the order of the cuts does not change the result.
use super::measure::Facet;
use super::relief::Relief;
use crate::ground::number::index_u32;
use glam::{DVec3, Vec2, Vec3};
use shibo_value::{Atlas, Mesh};

/// Marks the end of the surface.
const END: u32 = Atlas::END;

/// A triangle.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    /// Its points.
    pub(super) corners: [u32; 3],
    /// Its corners on the atlas.
    pub(super) uvs: [Vec2; 3],
    /// The triangle of the atlas that it is a part of.
    pub(super) root: u32,
    /// Its neighbours, as in [`Atlas::across`].
    across: [u32; 3],
    /// Index of its longest edge.
    longest: u8,
}

/// A point of the surface.
pub(super) struct Point {
    /// Its place on the undisplaced surface.
    base: DVec3,
    /// The normal there, of any length.
    normal: Vec3,
    /// Its displaced place.
    pub(super) at: Vec3,
}

/// The triangles of a surface.
pub(super) struct Forest<'a> {
    relief: &'a Relief<'a>,
    pub(super) pieces: Vec<Piece>,
    pub(super) points: Vec<Point>,
}

/// Bytes of memory for a triangle, its share of the points, its state, both in the finished mesh, and room for growing lists.
pub const BYTES_PER_TRIANGLE: u64 = 320;

impl<'a> Forest<'a> {
    /// The triangles of the atlas. `normals` are those of its vertices.
    pub(super) fn new(relief: &'a Relief<'a>, normals: &[Vec3]) -> Self {
        let Atlas { mesh, uvs, across, .. } = relief.atlas;
        // The mean height of all corners at a vertex, as charts may differ.
        let mut heights = vec![(0.0, 0.0); mesh.positions.len()];
        for (triangle, uvs) in mesh.triangles.iter().zip(uvs) {
            for (vertex, uv) in triangle.iter().zip(uvs) {
                let (sum, count): &mut (f64, f64) = &mut heights[*vertex as usize];
                *sum += relief.at(relief.in_texels(uv.as_dvec2()));
                *count += 1.0;
            }
        }
        let mut forest = Self { relief, pieces: Vec::new(), points: Vec::new() };
        for ((base, normal), (sum, count)) in mesh.positions.iter().zip(normals).zip(heights) {
            forest.add_point(base.as_dvec3(), *normal, sum / f64::max(count, 1.0));
        }
        forest.pieces = (0..mesh.triangles.len())
            .map(|n| forest.piece(mesh.triangles[n], uvs[n], index_u32(n), across[n]))
            .collect();
        forest
    }

    fn add_point(&mut self, base: DVec3, normal: Vec3, height: f64) -> u32 {
        let at = (base + normal.as_dvec3().normalize_or_zero() * height).as_vec3();
        self.points.push(Point { base, normal, at });
        index_u32(self.points.len() - 1)
    }

    fn piece(&self, corners: [u32; 3], uvs: [Vec2; 3], root: u32, across: [u32; 3]) -> Piece {
        // The length of an edge, then the numbers of its points: a total order that neighbours agree on.
        let rank = |k: usize| {
            let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
            let [p, q] = [a, b].map(|point| self.points[point as usize].base);
            (p.distance_squared(q), a.max(b), a.min(b))
        };
        let over =
            |a: (f64, u32, u32), b: (f64, u32, u32)| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))).is_gt();
        let longest = (1..3).fold(0, |best, k| if over(rank(k), rank(best)) { k } else { best });
        Piece { corners, uvs, root, across, longest: [0, 1, 2][longest] }
    }

    /// The longest edge of a triangle in mm, on the undisplaced surface.
    pub(super) fn longest(&self, piece: usize) -> f64 {
        let Piece { corners, longest, .. } = self.pieces[piece];
        let [a, b] = [1, 2].map(|k| self.points[corners[(usize::from(longest) + k) % 3] as usize].base);
        a.distance(b)
    }

    /// A triangle as it is measured.
    pub(super) fn facet(&self, piece: usize) -> Facet {
        let Piece { corners, uvs, .. } = self.pieces[piece];
        let points = corners.map(|point| &self.points[point as usize]);
        let in_texels = |uv: Vec2| self.relief.in_texels(uv.as_dvec2());
        Facet {
            texels: uvs.map(in_texels),
            beyond: [0, 1, 2].map(|k| self.beyond(piece, k).map(|ends| ends.map(in_texels))),
            base: points.map(|point| point.base),
            normal: points.map(|point| point.normal.as_dvec3()),
            at: points.map(|point| point.at.as_dvec3()),
        }
    }

    /// The ends of an edge on the chart beyond it, if that is another one.
    fn beyond(&self, piece: usize, edge: usize) -> Option<[Vec2; 2]> {
        let Piece { uvs, across, .. } = &self.pieces[piece];
        let across = across[edge];
        let other = self.pieces.get((across >> 2) as usize).filter(|_| across != END)?;
        let its = (across & 3) as usize;
        let ends = [other.uvs[(its + 2) % 3], other.uvs[(its + 1) % 3]];
        (ends != [uvs[(edge + 1) % 3], uvs[(edge + 2) % 3]]).then_some(ends)
    }

    /// The distance of a triangle to the surface; infinite if an edge is longer than `edge` mm. The second value is
    /// false if the triangle is too small to be halved.
    pub(super) fn measure(&self, piece: usize, edge: f64) -> (f64, bool) {
        if self.longest(piece) > edge {
            return (f64::INFINITY, true);
        }
        let facet = self.facet(piece);
        (facet.worst(self.relief).0, facet.longest() > LEAST)
    }

    /// Halves a triangle. The triangle beyond its longest edge is halved first if it has a longer edge, and so on. Adds
    /// the numbers of all changed triangles to `changed`.
    pub(super) fn halve(&mut self, piece: usize, changed: &mut Vec<u32>) {
        loop {
            let mut at = piece;
            loop {
                let edge = usize::from(self.pieces[at].longest);
                let across = self.pieces[at].across[edge];
                if across == END {
                    self.cut(at, None, changed);
                    break;
                }
                let (other, its) = ((across >> 2) as usize, across & 3);
                if u32::from(self.pieces[other].longest) == its {
                    self.cut(at, Some(other), changed);
                    if other == piece {
                        return;
                    }
                    break;
                }
                at = other;
            }
            if at == piece {
                return;
            }
        }
    }

    /// Cuts one or two triangles at their common longest edge.
    fn cut(&mut self, one: usize, other: Option<usize>, changed: &mut Vec<u32>) {
        let from = self.pieces[one];
        let k = usize::from(from.longest);
        let (b, c) = ((k + 1) % 3, (k + 2) % 3);
        let [p, q] = [b, c].map(|k| &self.points[from.corners[k] as usize]);
        let (base, normal) = (0.5 * (p.base + q.base), 0.5 * (p.normal + q.normal));
        let read = |uv: Vec2| self.relief.at(self.relief.in_texels(uv.as_dvec2()));
        let own = read(middle(from.uvs[b], from.uvs[c]));
        let height = self.beyond(one, k).map_or(own, |[d, e]| 0.5 * (own + read(middle(d, e))));
        let point = self.add_point(base, normal, height);
        let first = self.split(one, point, changed);
        if let Some(other) = other {
            let second = self.split(other, point, changed);
            // Each half lies beyond the edge of the half at the other end: edge 0 of both.
            for (a, b) in [(first[0], second[1]), (first[1], second[0])] {
                self.pieces[a].across[0] = 4 * index_u32(b);
                self.pieces[b].across[0] = 4 * index_u32(a);
            }
        }
    }

    /// Splits a triangle at a point on its longest edge. The halves have the point as their last and their second
    /// corner, and the corner opposite of the edge as their first.
    fn split(&mut self, piece: usize, point: u32, changed: &mut Vec<u32>) -> [usize; 2] {
        let Piece { corners, uvs, root, across, longest } = self.pieces[piece];
        let k = usize::from(longest);
        let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
        let uv = middle(uvs[b], uvs[c]);
        let added = self.pieces.len();
        let numbers = [4 * index_u32(piece), 4 * index_u32(added)];
        let one =
            self.piece([corners[a], corners[b], point], [uvs[a], uvs[b], uv], root, [END, numbers[1] + 2, across[c]]);
        let two =
            self.piece([corners[a], point, corners[c]], [uvs[a], uv, uvs[c]], root, [END, across[b], numbers[0] + 1]);
        for (beyond, number) in [(across[c], numbers[0] + 2), (across[b], numbers[1] + 1)] {
            if beyond != END {
                self.pieces[(beyond >> 2) as usize].across[(beyond & 3) as usize] = number;
            }
        }
        self.pieces[piece] = one;
        self.pieces.push(two);
        changed.extend([piece, added].map(index_u32));
        [piece, added]
    }

    /// The displaced surface as a mesh, with the UVs and the parts of the atlas.
    pub(super) fn mesh(&self) -> Mesh {
        let of = &self.relief.atlas.mesh;
        Mesh {
            positions: self.points.iter().map(|point| point.at).collect(),
            triangles: self.pieces.iter().map(|piece| piece.corners).collect(),
            uvs: self.pieces.iter().map(|piece| piece.uvs).collect(),
            parts: self.pieces.iter().filter_map(|piece| of.parts.get(piece.root as usize).copied()).collect(),
            part_names: of.part_names.clone(),
            ..Mesh::default()
        }
    }
}

/// The longest edge of a triangle, in texels, that is too small to be halved.
const LEAST: f64 = 0.25;

fn middle(a: Vec2, b: Vec2) -> Vec2 {
    0.5 * (a + b)
}
