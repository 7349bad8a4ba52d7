//! Overlays for the mesh of the lit view: charts and parts of its triangles, chart borders, and directions on the
//! surface.
use super::mesh::PageMesh;
use crate::scene::Scene;
use glam::DVec3;
use serde_json::{Value as Data, json};
use shibo_engine::session::{Failure, Look};
use shibo_value::{Atlas, Carried, Frames, Mesh, Shapes};
use std::sync::Arc;

/// Height of lines above the surface, in page units (the farthest point of the mesh is at distance 1).
const LIFT: f64 = 0.003;

/// Transforms positions in mm to the page units of [`PageMesh`].
struct Page<'a> {
    mesh: &'a Mesh,
    atlas: &'a Atlas,
    per_mm: f64,
    middle: DVec3,
}

impl Page<'_> {
    /// Appends a position as three numbers of a JSON list.
    fn put(&self, place: DVec3, out: &mut Vec<f32>) {
        let DVec3 { x, y, z } = (place - self.middle) * self.per_mm;
        #[expect(clippy::cast_possible_truncation, reason = "for the screen")]
        out.extend([x, z, -y].map(|v| v as f32));
    }

    /// Position of a vertex, raised a little above the surface.
    fn lifted(&self, vertex: u32) -> DVec3 {
        let vertex = vertex as usize;
        self.mesh.positions[vertex].as_dvec3() + self.atlas.smooth[vertex].as_dvec3() * (LIFT / self.per_mm)
    }

    /// Edges of triangles as lines, each edge once.
    fn edges(&self, edges: impl Iterator<Item = (usize, usize)>) -> Vec<f32> {
        let mut pairs: Vec<[u32; 2]> = edges
            .map(|(triangle, k)| {
                let corners = self.mesh.triangles[triangle];
                let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
                [a.min(b), a.max(b)]
            })
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut out = Vec::with_capacity(6 * pairs.len());
        pairs.as_flattened().iter().for_each(|vertex| self.put(self.lifted(*vertex), &mut out));
        out
    }

    /// Directions at vertices as lines.
    fn strokes(&self, frames: &Frames) -> Vec<f32> {
        let count = frames.t.len();
        let length = 0.35 * (self.mesh.area() / Shapes::<DVec3>::thinned(count).len().max(1) as f64).sqrt();
        let mut out = Vec::new();
        for n in Shapes::<DVec3>::thinned(count) {
            let Ok(vertex) = u32::try_from(n) else { break };
            let (at, t) = (self.lifted(vertex), frames.t[n].as_dvec3().normalize_or_zero() * length);
            [at - t, at + t].into_iter().for_each(|end| self.put(end, &mut out));
        }
        out
    }
}

/// Returns the overlays of the scene's mesh; `None` if it has none. Triangles are in the order of [`PageMesh`], by parts; lines list the
/// coordinates of their ends, points their coordinates.
///
/// # Errors
/// Fails if the mesh cannot be made.
pub fn marks(look: &Look<'_>, scene: &Scene) -> Result<Option<Data>, Failure> {
    let Some((node, output)) = scene.mesh() else { return Ok(None) };
    let Some(atlas) = look.value(node, output)?.and_then(Atlas::unwrap) else { return Ok(None) };
    let frames = frames(look, scene, &atlas);
    let PageMesh { triangles: order, per_mm, middle, .. } = PageMesh::of(&atlas);
    let page = Page {
        mesh: &atlas.mesh,
        atlas: &atlas,
        per_mm: f64::from(per_mm),
        middle: DVec3::from(middle.map(f64::from)),
    };
    let part = |triangle: &u32| atlas.mesh.parts.get(*triangle as usize).copied().unwrap_or(0);
    let all = 0..atlas.mesh.triangles.len();
    let borders = all.flat_map(|n| [0, 1, 2].map(|k| (n, k))).filter(|(n, k)| !atlas.is_inner(*n, *k));
    let mut singular = Vec::new();
    for (triangle, _) in frames.iter().flat_map(|frames| &frames.singular) {
        let corners = atlas.mesh.triangles[*triangle as usize];
        page.put(corners.iter().map(|vertex| page.lifted(*vertex)).sum::<DVec3>() / 3.0, &mut singular);
    }
    Ok(Some(json!({
        "charts": order.iter().map(|n| atlas.charts[*n as usize]).collect::<Vec<_>>(),
        "triangles": order,
        "parts": order.iter().map(part).collect::<Vec<_>>(),
        "names": atlas.mesh.part_names,
        "seams": page.edges(borders),
        "strokes": frames.as_ref().map_or_else(Vec::new, |frames| page.strokes(frames)),
        "ends": frames.as_ref().map_or_else(Vec::new, |frames| page.edges(frames.ends().into_iter())),
        "singular": singular,
    })))
}

/// The graph's first field of directions on this mesh; `None` if it cannot be made.
fn frames(look: &Look<'_>, scene: &Scene, atlas: &Atlas) -> Option<Arc<Frames>> {
    let nodes = &scene.graph.nodes;
    let all = nodes
        .node_indices()
        .filter_map(|node| Some((node, nodes[node].outputs.iter().position(|ty| *ty == Frames::TYPE)?)));
    let made = all.filter_map(|(node, output)| look.value(node, output).ok().flatten().and_then(Frames::unwrap));
    let same = |frames: &Arc<Frames>| {
        Arc::ptr_eq(&frames.mesh, &atlas.mesh)
            || (frames.mesh.triangles == atlas.mesh.triangles && frames.mesh.positions == atlas.mesh.positions)
    };
    made.into_iter().find(same)
}
