//! Topology of a mesh: merging vertices, neighbours of triangles, orientation, and vertex normals.
//!
//! Edge `k` of a triangle lies opposite its corner `k`: it leads from corner `k + 1` to corner `k + 2`. Topology uses
//! only integers; geometry is computed in `f64`. Cost: O(n log d), d the largest number of triangles around a vertex.
use crate::ground::number::index_u32;
use crate::ground::stop::Watch;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use shibo_value::{Atlas, Mesh};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Marks the end of the surface.
const END: u32 = Atlas::END;

/// Neighbours of triangles across their edges.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// For each edge of each triangle: four times the neighbour's index, plus the index of the same edge there;
    /// [`Atlas::END`] where the surface ends, and where more than two triangles meet.
    pub across: Vec<[u32; 3]>,
    /// Number of edges of more than two triangles.
    pub crowded: usize,
    /// Number of edges between two triangles with opposite orientation. They count as ends.
    pub twisted: usize,
}

/// The two vertices of an edge, in the order of the triangle.
fn ends(triangle: &[u32; 3], edge: usize) -> [u32; 2] {
    [triangle[(edge + 1) % 3], triangle[(edge + 2) % 3]]
}

/// The neighbours of all triangles, whatever their orientation, and the number of crowded edges.
fn neighbours(triangles: &[[u32; 3]], watch: &Watch<'_>) -> (Vec<[u32; 3]>, usize) {
    let vertices = triangles.iter().flatten().max().map_or(0, |most| *most as usize + 1);
    // The edges by their lower vertex.
    let mut starts = vec![0u32; vertices + 1];
    let edges = |n: usize| (0..3).map(move |k| (n, k));
    for (n, k) in watch.over((0..triangles.len()).flat_map(edges)) {
        let [a, b] = ends(&triangles[n], k);
        starts[a.min(b) as usize + 1] += 1;
    }
    for v in 0..vertices {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut of = vec![(0u32, 0u32); 3 * triangles.len()];
    for (n, k) in watch.over((0..triangles.len()).flat_map(edges)) {
        let [a, b] = ends(&triangles[n], k);
        let to = &mut next[a.min(b) as usize];
        of[*to as usize] = (a.max(b), 4 * index_u32(n) + index_u32(k));
        *to += 1;
    }
    let mut across = vec![[END; 3]; triangles.len()];
    let mut crowded = 0;
    for v in watch.over(0..vertices) {
        let here = &mut of[starts[v] as usize..starts[v + 1] as usize];
        here.sort_unstable();
        for same in here.chunk_by(|a, b| a.0 == b.0) {
            match *same {
                [(_, one), (_, other)] if one >> 2 != other >> 2 => {
                    across[(one >> 2) as usize][(one & 3) as usize] = other;
                    across[(other >> 2) as usize][(other & 3) as usize] = one;
                }
                [_] => {}
                _ => crowded += 1,
            }
        }
    }
    (across, crowded)
}

/// Returns whether two triangles have the same orientation: then they run along their common edge in opposite
/// directions.
fn agree(triangles: &[[u32; 3]], n: usize, k: usize, across: u32) -> bool {
    let [a, b] = ends(&triangles[n], k);
    ends(&triangles[(across >> 2) as usize], (across & 3) as usize) == [b, a]
}

/// Computes the neighbours of all triangles.
pub fn topology(triangles: &[[u32; 3]]) -> Topology {
    watched(triangles, &Watch::never())
}

/// Like [`topology`], but can be cancelled: unwinds when `watch` says so.
pub fn watched(triangles: &[[u32; 3]], watch: &Watch<'_>) -> Topology {
    let (mut across, crowded) = neighbours(triangles, watch);
    let mut twisted = 0;
    for (n, of) in watch.over(across.iter_mut().enumerate()) {
        for (k, other) in of.iter_mut().enumerate() {
            if *other != END && !agree(triangles, n, k, *other) {
                *other = END;
                twisted += 1;
            }
        }
    }
    Topology { across, crowded, twisted: twisted / 2 }
}

/// Flips triangles so that each connected component has one orientation: that of its majority. Returns the number of
/// flipped triangles. One-sided components, such as a Möbius strip, keep edges where the two sides meet:
/// [`Topology::twisted`] counts them.
pub fn orient(mesh: &mut Mesh, watch: &Watch<'_>) -> usize {
    let (across, _) = neighbours(&mesh.triangles, watch);
    let mut turn: Vec<Option<bool>> = vec![None; mesh.triangles.len()];
    let mut piece = Vec::new();
    let mut turned = 0;
    for first in watch.over(0..mesh.triangles.len()) {
        if turn[first].is_some() {
            continue;
        }
        turn[first] = Some(false);
        piece.clear();
        piece.push(first);
        let mut at = 0;
        while at < piece.len() {
            let n = piece[at];
            at += 1;
            watch.tick();
            for (k, &other) in across[n].iter().enumerate().filter(|(_, other)| **other != END) {
                let neighbour = (other >> 2) as usize;
                if turn[neighbour].is_none() {
                    let same = agree(&mesh.triangles, n, k, other);
                    turn[neighbour] = turn[n].map(|turn| turn == same);
                    piece.push(neighbour);
                }
            }
        }
        let count = piece.iter().filter(|n| turn[**n] == Some(true)).count();
        let most = 2 * count > piece.len();
        turned += if most { piece.len() - count } else { count };
        for &n in watch.over(&piece) {
            if turn[n] == Some(most) {
                continue;
            }
            mesh.triangles[n].swap(1, 2);
            if let Some(uvs) = mesh.uvs.get_mut(n) {
                uvs.swap(1, 2);
            }
            if let Some(normals) = mesh.normals.get_mut(n) {
                normals.swap(1, 2);
            }
        }
    }
    turned
}

/// The bits of a position; 0 and -0 are the same.
fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// For each position the index of its representative: the first one at the same position or, with a `distance` in mm,
/// the first one kept within that distance.
fn representatives(positions: &[Vec3], distance: f64, watch: &Watch<'_>) -> Vec<u32> {
    if distance <= 0.0 {
        let mut first = HashMap::with_capacity(positions.len());
        return (0..).zip(watch.over(positions)).map(|(n, p)| *first.entry(bits(*p)).or_insert(n)).collect();
    }
    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates; far cells are full ones at worst")]
    let cell = |p: DVec3| (p / distance).floor().to_array().map(|c| c as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let mut find = |n: u32| {
        let p = positions[n as usize].as_dvec3();
        let here = cell(p);
        let mut best: Option<u32> = None;
        for around in (0..27).map(|i| [i % 3, i / 3 % 3, i / 9]) {
            let at: [i64; 3] = std::array::from_fn(|k| here[k].saturating_add(around[k] - 1));
            let near = |m: &u32| positions[*m as usize].as_dvec3().distance(p) <= distance;
            let found = cells.get(&at).and_then(|cell| cell.iter().copied().find(near));
            best = best.into_iter().chain(found).min();
        }
        best.unwrap_or_else(|| {
            match cells.entry(here) {
                Entry::Occupied(mut cell) => cell.get_mut().push(n),
                Entry::Vacant(cell) => drop(cell.insert(vec![n])),
            }
            n
        })
    };
    watch.over(0..index_u32(positions.len())).map(&mut find).collect()
}

/// Merges vertices at the same position or, with a `distance` in mm, those within that distance of the first of them.
/// Then drops triangles without area and unused vertices. Returns the number of dropped triangles.
pub fn weld(mesh: &mut Mesh, distance: f64, watch: &Watch<'_>) -> usize {
    let stand_in = representatives(&mesh.positions, distance, watch);
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = stand_in[*v as usize]);
    let [low, high] = mesh.bounds();
    let least = 2e-12 * (high - low).length_squared();
    keep(mesh, |n, mesh| {
        watch.tick();
        let [a, b, c] = mesh.triangles[n];
        a != b && b != c && c != a && mesh.cross(n).length() > least
    })
}

/// Keeps the triangles for which `stays` returns true, and their vertices. Returns the number of dropped triangles.
pub fn keep(mesh: &mut Mesh, stays: impl Fn(usize, &Mesh) -> bool) -> usize {
    let keep: Vec<bool> = (0..mesh.triangles.len()).map(|n| stays(n, mesh)).collect();
    let dropped = keep.iter().filter(|keep| !**keep).count();
    if dropped > 0 {
        retain(&mut mesh.triangles, &keep);
        retain(&mut mesh.uvs, &keep);
        retain(&mut mesh.normals, &keep);
        retain(&mut mesh.parts, &keep);
        retain(&mut mesh.polygons, &keep);
    }
    drop_unused(mesh);
    dropped
}

/// Keeps the entries whose `keep` is true.
fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    list.retain(|_| keep.next().is_none_or(|keep| *keep));
}

/// Drops unused vertices.
fn drop_unused(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    mesh.triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    if used.iter().all(|used| *used) {
        return;
    }
    let mut count = 0;
    let number = |used: &bool| {
        let number = count;
        count += u32::from(*used);
        number
    };
    let numbers: Vec<u32> = used.iter().map(number).collect();
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = numbers[*v as usize]);
    retain(&mut mesh.positions, &used);
}

/// Number of triangles between two checks of a cancellation.
const AT_ONCE: usize = 1 << 14;

/// The normal of each vertex, of length 1: the sum of the normals of its triangles, weighted by their angles. If they
/// cancel out, the normal of its lowest triangle.
pub fn smooth_normals(mesh: &Mesh) -> Vec<Vec3> {
    watched_normals(mesh, &Watch::never())
}

/// Like [`smooth_normals`], but can be cancelled: unwinds when `watch` says so.
pub fn watched_normals(mesh: &Mesh, watch: &Watch<'_>) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let mut first = vec![None; mesh.positions.len()];
    let of = |n: usize| {
        let corners = mesh.corners(n);
        let angle = |k: usize| {
            let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
            libm::atan2(a.cross(b).length(), a.dot(b))
        };
        (mesh.cross(n).normalize_or_zero(), [angle(0), angle(1), angle(2)])
    };
    // Sum in the order of the triangles.
    for some in (0..mesh.triangles.len()).step_by(AT_ONCE) {
        watch.check();
        let some = some..mesh.triangles.len().min(some + AT_ONCE);
        let weighted: Vec<(DVec3, [f64; 3])> = some.clone().into_par_iter().map(of).collect();
        for (triangle, (normal, angles)) in mesh.triangles[some].iter().zip(weighted) {
            for (vertex, angle) in triangle.iter().zip(angles) {
                sums[*vertex as usize] += normal * angle;
                first[*vertex as usize].get_or_insert(normal);
            }
        }
    }
    let one = |(sum, first): (&DVec3, &Option<DVec3>)| {
        watch.tick();
        let first = first.unwrap_or(DVec3::Z);
        if sum.length() > 1e-9 { sum.normalize_or(first).as_vec3() } else { first.as_vec3() }
    };
    sums.iter().zip(&first).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples;

    #[test]
    fn triangles_of_a_cube_find_each_other() {
        let cube = samples::cube();
        let topology = topology(&cube.triangles);
        assert_eq!((cube.positions.len(), topology.crowded, topology.twisted), (8, 0, 0));
        for (n, of) in topology.across.iter().enumerate() {
            for (k, &other) in of.iter().enumerate() {
                assert_ne!(other, END);
                let (m, l) = ((other >> 2) as usize, (other & 3) as usize);
                assert_eq!(topology.across[m][l], 4 * index_u32(n) + index_u32(k));
                let [a, b] = ends(&cube.triangles[n], k);
                assert_eq!(ends(&cube.triangles[m], l), [b, a]);
            }
        }
    }

    #[test]
    fn crowded_and_twisted_edges_are_ends() {
        let crowded = topology(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert_eq!((crowded.crowded, crowded.twisted), (1, 0));
        assert!(crowded.across.iter().flatten().all(|other| *other == END));
        let twisted = topology(&[[0, 1, 2], [0, 1, 3]]);
        assert_eq!((twisted.crowded, twisted.twisted), (0, 1));
        assert!(twisted.across.iter().flatten().all(|other| *other == END));
        // A triangle with the same edge twice is not its own neighbour.
        assert_eq!(topology(&[[0, 1, 0]]).across, [[END; 3]]);
    }

    #[test]
    fn restores_flipped_triangles() {
        let cube = samples::cube();
        let mut mesh = cube.clone();
        for n in [1, 4, 5, 9] {
            mesh.triangles[n].swap(1, 2);
            mesh.uvs[n].swap(1, 2);
        }
        assert_eq!(orient(&mut mesh, &Watch::never()), 4);
        assert_eq!(mesh, cube);
        // The orientation of the majority.
        for n in [1, 4, 5, 9, 0, 2, 3, 6] {
            mesh.triangles[n].swap(1, 2);
        }
        assert_eq!(orient(&mut mesh, &Watch::never()), 4);
        assert_eq!(topology(&mesh.triangles).twisted, 0);
        assert!(mesh.cross(0).dot(cube.cross(0)) < 0.0);
    }

    #[test]
    fn a_moebius_strip_has_one_side() {
        let n = 10;
        let vertex = |i: u32, side: u32| if i < n { 2 * i + side } else { 1 - side };
        let quad = |i: u32| {
            let [a, b, c, d] = [vertex(i, 0), vertex(i + 1, 0), vertex(i + 1, 1), vertex(i, 1)];
            [[a, b, c], [a, c, d]]
        };
        let triangles: Vec<[u32; 3]> = (0..n).flat_map(quad).collect();
        let mut mesh = Mesh { positions: vec![Vec3::ZERO; 20], triangles, ..Mesh::default() };
        orient(&mut mesh, &Watch::never());
        assert_eq!(topology(&mesh.triangles).twisted, 1);
    }

    #[test]
    fn welds_vertices_at_same_position() {
        let mut mesh = samples::cube();
        let corners: Vec<Vec3> =
            mesh.triangles.iter().flatten().map(|v| mesh.positions[*v as usize]).map(|p| p * -0.0 + p).collect();
        mesh.triangles = (0..12).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        mesh.positions = corners;
        mesh.positions.push(Vec3::ONE);
        let unwelded = mesh.clone();
        assert_eq!(weld(&mut mesh, 0.0, &Watch::never()), 0);
        assert_eq!(mesh.positions.len(), 8);
        // Nearly the same position.
        let mut shaken = unwelded;
        shaken.positions.iter_mut().enumerate().for_each(|(n, p)| p.x += if n % 2 == 0 { 0.004 } else { 0.0 });
        let mut loose = shaken.clone();
        assert_eq!((weld(&mut loose, 0.0, &Watch::never()), weld(&mut shaken, 0.01, &Watch::never())), (0, 0));
        assert!(loose.positions.len() > 8);
        assert_eq!(shaken.positions.len(), 8);
        assert_eq!(shaken.triangles, mesh.triangles);
    }

    #[test]
    fn triangles_without_area_are_dropped() {
        let mut mesh = samples::cube();
        let before = mesh.clone();
        mesh.triangles.insert(3, [0, 1, 1]);
        mesh.uvs.insert(3, [glam::Vec2::ZERO; 3]);
        mesh.parts.insert(3, 0);
        let (n, middle) = (index_u32(mesh.positions.len()), 0.5 * (mesh.positions[0] + mesh.positions[1]));
        mesh.positions.push(middle);
        mesh.triangles.push([0, 1, n]);
        mesh.uvs.push([glam::Vec2::ZERO; 3]);
        mesh.parts.push(0);
        assert_eq!(weld(&mut mesh, 0.0, &Watch::never()), 2);
        assert_eq!(mesh, before);
    }

    #[test]
    fn normals_of_a_cube_point_out_of_its_corners() {
        let cube = samples::cube();
        for (p, n) in cube.positions.iter().zip(smooth_normals(&cube)) {
            assert!(n.distance((*p - samples::CUBE_MIDDLE).normalize()) < 1e-6, "{n}");
        }
    }
}
