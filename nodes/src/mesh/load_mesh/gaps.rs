//! Faces without UVs or normals in a file where other faces have them.
use glam::Vec3;
use shibo_kernel::ground::stop::Watch;
use shibo_kernel::mesh::topology;
use shibo_value::Mesh;
use shibo_value::diagnostics::{Code, Problem};

/// Counts the faces of the file that have a triangle for which `of` holds, and all faces.
fn faces(mesh: &Mesh, of: impl Fn(usize) -> bool) -> [usize; 2] {
    let polygon = |n: usize| mesh.polygons.get(n).map_or(n, |polygon| *polygon as usize);
    let count = |of: &dyn Fn(usize) -> bool| {
        let mut found: Vec<usize> = (0..mesh.triangles.len()).filter(|n| of(*n)).map(polygon).collect();
        found.sort_unstable();
        found.dedup();
        found.len()
    };
    [count(&of), count(&|_| true)]
}

/// Gives triangles without UVs those of a single point, so that they have no place in a picture. Returns a warning with
/// their number. If no triangle has UVs, the mesh gets none.
pub(super) fn uvs(mesh: &mut Mesh) -> Option<Problem> {
    let Some(point) = mesh.uvs.iter().find(|uvs| uvs[0].is_finite()).map(|uvs| uvs[0]) else {
        mesh.uvs = Vec::new();
        return None;
    };
    let [bare, all] = faces(mesh, |n| !mesh.uvs[n][0].is_finite());
    if bare == 0 {
        return None;
    }
    mesh.uvs.iter_mut().filter(|uvs| !uvs[0].is_finite()).for_each(|uvs| *uvs = [point; 3]);
    let message = format!("{bare} of {all} faces have no UVs and get no place in the picture");
    let help = "give them UVs, or take `charts: New` in `MeshAtlas`";
    Some(Problem::new(Code::Advice, message).at("path").help(help))
}

/// Gives corners without a normal that of the surface around their vertex, and returns a warning with the number of
/// such faces. If no corner has a normal, the mesh gets none.
pub(super) fn normals(mesh: &mut Mesh, watch: &Watch<'_>) -> Option<Problem> {
    if mesh.normals.as_flattened().iter().all(|normal| *normal == Vec3::ZERO) {
        mesh.normals = Vec::new();
        return None;
    }
    let [bare, all] = faces(mesh, |n| mesh.normals[n].contains(&Vec3::ZERO));
    if bare == 0 {
        return None;
    }
    let smooth = topology::watched_normals(mesh, watch);
    for (normals, triangle) in mesh.normals.iter_mut().zip(&mesh.triangles) {
        for (normal, vertex) in normals.iter_mut().zip(triangle) {
            if *normal == Vec3::ZERO {
                *normal = smooth[*vertex as usize];
            }
        }
    }
    let message = format!("{bare} of {all} faces lack normals; those of the surface around them are taken");
    Some(Problem::new(Code::Advice, message).at("path"))
}
