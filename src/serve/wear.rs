//! Solids on shapes: the colour of a solid at the points of the shape itself, so that rings go through it.
use super::data::Query2;
use super::handlers::{App, No};
use super::scene::Scene;
use super::sights::single;
use axum::extract::{Query, State};
use axum::http::{HeaderName, header};
use axum::response::{IntoResponse, Response};
use glam::DVec3;
use petgraph::Direction;
use petgraph::graph::NodeIndex;
use rayon::prelude::*;
use serde::Deserialize;
use shibo_engine::picture::SrgbEncoder;
use shibo_engine::session::{Failure, Look};
use shibo_engine::value::{Solid, Type, Value};
use std::collections::{HashSet, VecDeque};
use std::f64::consts::TAU;

/// The longest side of a texture.
const LONGEST: u32 = 1024;
/// Where the middle of a shape lies beside the pith, as a share of its radius.
const BESIDE: f64 = 0.7;

/// A shape, around the origin, of about radius 1, y up. Texture coordinates go once around each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Shape {
    Sphere,
    /// Six faces in three columns and two rows.
    Cube,
    /// A turned leg.
    Leg,
}

/// What a query says.
#[derive(Debug, Deserialize)]
pub(super) struct Worn {
    g: u64,
    t: String,
    shape: Shape,
    s: u32,
}

impl Shape {
    /// The place of a point of the texture.
    fn at(self, u: f64, v: f64) -> DVec3 {
        let (sin, cos) = (TAU * u).sin_cos();
        match self {
            Self::Sphere => {
                let (flat, up) = (0.5 * TAU * v).sin_cos();
                DVec3::new(flat * sin, up, flat * cos)
            }
            Self::Cube => {
                let (column, row) = ((3.0 * u).floor().clamp(0.0, 2.0), (2.0 * v).floor().clamp(0.0, 1.0));
                let (a, b) = (2.0 * (3.0 * u - column) - 1.0, 2.0 * (2.0 * v - row) - 1.0);
                0.8 * match (row < 0.5, column < 0.5, column < 1.5) {
                    (true, true, _) => DVec3::new(a, -b, 1.0),
                    (true, false, true) => DVec3::new(-a, -b, -1.0),
                    (true, false, false) => DVec3::new(1.0, -b, -a),
                    (false, true, _) => DVec3::new(-1.0, -b, a),
                    (false, false, true) => DVec3::new(a, 1.0, b),
                    (false, false, false) => DVec3::new(a, -1.0, -b),
                }
            }
            Self::Leg => {
                let y = 1.0 - 2.0 * v;
                let radius =
                    (0.28 + 0.1 * (4.2 * y).cos() + 0.05 * (13.0 * y).cos()) * (1.0 - y.powi(16)).max(0.0).sqrt();
                DVec3::new(radius * sin, y, radius * cos)
            }
        }
    }
}

/// Whether the graph has solids that have a colour.
pub(super) fn has_solid(scene: &Scene) -> bool {
    scene.graph.nodes.node_weights().any(|node| node.outputs.contains(&Type::SolidColor))
}

/// The colour of the solid that a target is made of, as a texture of a shape; see `map`.
pub(super) async fn wear(State(app): State<App>, query: Query2<Worn>) -> Result<Response, No> {
    let Query(Worn { g, t, shape, s }) = query?;
    let scene = app.scene(g)?;
    let target = scene.target(&t).ok_or(No::Nothing)?;
    let side = s.clamp(1, LONGEST);
    let bytes = app
        .look(&scene, move |look, _, scene| {
            let Some((node, output)) = solid_of(scene, target.node) else { return Ok(None) };
            let Some(Value::Solid(solid)) = look.value(node, output)? else { return Ok(None) };
            texture(look, scene, &solid, shape, side).map(Some)
        })
        .await?;
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (HeaderName::from_static("x-map"), format!("{side} {side} rgba8")),
    ];
    Ok((head, bytes.ok_or(No::Nothing)?).into_response())
}

/// The nearest solid with a colour before a node, or else the last of the graph.
fn solid_of(scene: &Scene, from: NodeIndex) -> Option<(NodeIndex, usize)> {
    let graph = &scene.graph;
    let colored =
        |index: NodeIndex| Some((index, graph.nodes[index].outputs.iter().position(|ty| *ty == Type::SolidColor)?));
    let mut queue = VecDeque::from([from]);
    let mut seen = HashSet::from([from]);
    while let Some(index) = queue.pop_front() {
        if let Some(found) = colored(index) {
            return Some(found);
        }
        let mut before: Vec<NodeIndex> = graph.nodes.neighbors_directed(index, Direction::Incoming).collect();
        before.sort();
        queue.extend(before.into_iter().filter(|next| seen.insert(*next)));
    }
    graph.nodes.node_indices().rev().find_map(colored)
}

fn texture(look: &Look<'_>, scene: &Scene, solid: &Solid, shape: Shape, side: u32) -> Result<Vec<u8>, Failure> {
    let radius = 0.5 * scene.graph.canvas.size_mm.max_element();
    let middle = DVec3::new(BESIDE * radius, 0.0, 1.05 * radius);
    let pixel = single(4.0 * radius / f64::from(side));
    let srgb = SrgbEncoder::new();
    let count = side as usize;
    let mut bytes = vec![255; count * count * 4];
    bytes.par_chunks_mut(count * 4).zip(0..side).for_each(|(row, y)| {
        if look.is_over() {
            return;
        }
        let share = |n: u32| (f64::from(n) + 0.5) / f64::from(side);
        // The trunk stands upright: its z is the shape's y.
        let places: Vec<DVec3> = (0..side)
            .map(|x| shape.at(share(x), share(y)) * radius)
            .map(|p| middle + DVec3::new(p.x, -p.z, p.y))
            .collect();
        let planes = [0, 1, 2].map(|axis| places.iter().map(|p| single(p[axis])).collect::<Vec<f32>>());
        let values = solid.quads(&[&planes[0], &planes[1], &planes[2]], pixel);
        for (c, plane) in values.chunks_exact(count).take(3).enumerate() {
            for (pixel, v) in row.chunks_exact_mut(4).zip(plane) {
                pixel[c] = srgb.code(*v);
            }
        }
    });
    if look.is_over() { Err(Failure::Cancelled) } else { Ok(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_cover_the_shapes() {
        for i in 0..100_u32 {
            let (u, v) = (f64::from(i % 10) / 10.0 + 0.05, f64::from(i / 10) / 10.0 + 0.05);
            assert!((Shape::Sphere.at(u, v).length() - 1.0).abs() < 1e-9);
            let cube = Shape::Cube.at(u, v).abs();
            assert!((cube.max_element() - 0.8).abs() < 1e-9, "{cube}");
            let leg = Shape::Leg.at(u, v);
            assert!(leg.y.abs() < 1.0 && leg.x.hypot(leg.z) < 0.5, "{leg}");
        }
        // Neighbouring faces of the cube meet.
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-6, "{a} {b}");
        let e = 1e-9;
        near(Shape::Cube.at(1.0 / 3.0 - e, 0.25), DVec3::new(0.8, 0.0, 0.8));
        near(Shape::Cube.at(2.0 / 3.0 + e, 0.25), DVec3::new(0.8, 0.0, 0.8));
    }
}
