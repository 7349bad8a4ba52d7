//! Textures that cut solids along a shape: the material's cuts follow the surface of the shape instead of a board, so
//! that rings run through the shape and pores open where its surface meets them.
use crate::scene::{Cutter, Scene, Target, cutters, instead, upstream};
use glam::{DVec2, DVec3, UVec2};
use petgraph::graph::NodeIndex;
use serde::Deserialize;
use shibo_engine::session::{Failure, Look};
use shibo_graph::Input;
use shibo_kernel::ground::number::narrow;
use shibo_nodes::cut_material;
use shibo_value::{Channel, Cut, Field, Grid, Key, PictureFields, Solid, Tile, Tiling, Type, Value, Window};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

/// Longest side of a texture in pixels.
const LONGEST: u32 = 2048;
/// Cube faces have an even number of pixels, so that no 2×2 block lies on two faces.
const FACES: u32 = 12;
/// Distance of a shape's middle from the pith if the graph cuts no board, as a share of its radius.
const BESIDE: f64 = 0.7;

/// A shape around the origin, of about radius 1, y up. Texture coordinates go once around each shape.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SolidShape {
    /// A sphere.
    Sphere,
    /// Six faces in three columns and two rows.
    Cube,
    /// A turned leg.
    Leg,
}

impl SolidShape {
    /// Position of a point of the texture.
    fn at(self, u: f64, v: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(TAU * u);
        match self {
            Self::Sphere => {
                let (flat, up) = libm::sincos(0.5 * TAU * v);
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
                    (0.28 + 0.1 * libm::cos(4.2 * y) + 0.05 * libm::cos(13.0 * y)) * (1.0 - y.powi(16)).max(0.0).sqrt();
                DVec3::new(radius * sin, y, radius * cos)
            }
        }
    }
}

/// Position of a shape in the trunk: mm per unit length, and its middle.
#[derive(Clone, Copy, Debug)]
struct Placed {
    shape: SolidShape,
    radius: f64,
    middle: DVec3,
}

impl Placed {
    /// Width and height of the texture in mm, where it is not stretched.
    fn size(self) -> DVec2 {
        self.radius
            * match self.shape {
                SolidShape::Sphere => DVec2::new(TAU, PI),
                SolidShape::Cube => DVec2::new(4.8, 3.2),
                SolidShape::Leg => DVec2::new(TAU * 0.32, 2.0),
            }
    }

    /// Number of texture pixels for a longer side of about `side`, and the grid that covers them.
    fn grid(self, side: u32) -> (UVec2, Grid) {
        let size = self.size();
        let wide = (side.clamp(FACES, LONGEST) / FACES * FACES).max(FACES);
        let share = size.y / size.x;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most a little more than `wide`"
        )]
        let high = ((f64::from(wide) * share / 4.0).round() * 4.0) as u32;
        let pixels = UVec2::new(wide, high.clamp(4, LONGEST));
        (pixels, Grid { origin: DVec2::ZERO, step: size / pixels.as_dvec2(), period: None, shown: None })
    }

    /// The cut along the surface of the shape.
    fn cut(self) -> Cut {
        let size = self.size();
        let place = Field::generate(Type::Rgb, Tiling::NONE, move |out: &mut Tile, _| {
            let (grid, window, width) = (out.grid, out.window, out.width().max(1));
            for (axis, plane) in out.planes_mut().into_iter().enumerate() {
                for (i, value) in plane.iter_mut().enumerate() {
                    let to = |start: i32, n: usize| start.saturating_add(i32::try_from(n).unwrap_or(i32::MAX));
                    let at = grid.center(to(window.x, i % width), to(window.y, i / width)) / size;
                    let p = self.shape.at(at.x, at.y) * self.radius;
                    // The trunk stands upright: its z is the shape's y.
                    *value = narrow((self.middle + DVec3::new(p.x, -p.z, p.y))[axis]);
                }
            }
            Ok(())
        });
        // The turned parts of a leg are wider than its average.
        let stretch = if matches!(self.shape, SolidShape::Leg) { 1.35 } else { 1.0 };
        let cut = Cut::new(self.key(), place, move |grid: &Grid| stretch * grid.step.max_element());
        cut.with_level_rows(!matches!(self.shape, SolidShape::Cube))
    }

    fn key(self) -> Key {
        let numbers = [self.radius, self.middle.x, self.middle.y, self.middle.z];
        let bits: Vec<u8> = numbers.iter().flat_map(|n| n.to_bits().to_le_bytes()).collect();
        Key::of("worn", &[format!("{:?}", self.shape).as_bytes(), &bits])
    }
}

/// Returns a texture of a shape, whose longer side has about `side` pixels, and the field that it shows: a target or a channel of it,
/// with all solids cut along the shape. For a target that uses no cut, the texture is the colour of the nearest solid, and there are
/// no other channels.
///
/// # Errors
/// Fails if a value cannot be made.
pub fn worn(
    look: &Look<'_>,
    scene: &Scene,
    target: &Target,
    shape: SolidShape,
    side: u32,
) -> Result<Option<(Field, Tile)>, Failure> {
    let cutters = cutters(&scene.graph, target.node);
    let radius = 0.5 * scene.graph.canvas.size_mm.max_element();
    let placed = Placed { shape, radius, middle: middle(look, scene, &cutters, radius)? };
    let (size, grid) = placed.grid(side);
    let cut = placed.cut();
    let drawn = |field: &Field| {
        let mut tile = look.raster(field, &grid, Window::full(size))?;
        if target.channel == Some(Channel::AnisotropyAngle) {
            // Fibres are upright, where angles jump from -90 to 90; since the page averages neighbours, the jump is
            // moved to 0.
            tile.data_mut().iter_mut().for_each(|angle| *angle = angle.rem_euclid(180.0));
        }
        Ok(Some((field.clone(), tile)))
    };
    // Boards side by side are a pattern of the canvas, which a shape does not have.
    let board = |(index, _): &Cutter| {
        let node = &scene.graph.nodes[*index];
        let pieces = node.slots.iter().zip(&node.inputs);
        !pieces.into_iter().any(|(slot, input)| slot == "ids" && matches!(input, Input::Wire { .. }))
    };
    if !cutters.is_empty() && cutters.iter().all(board) {
        let mut others = HashMap::new();
        for (index, slot) in cutters {
            let Input::Wire { node, output } = scene.graph.nodes[index].inputs[slot] else { continue };
            let shown = match look.value(node, output)? {
                Some(Value::Solid(solid)) => Value::Field(solid.cut(&cut)),
                Some(Value::SolidMaterial(material)) => cut_material(&material, &cut).into(),
                _ => continue,
            };
            others.insert((index, 0), shown);
        }
        let keys = |node, output| scene.keys.output(node, output);
        let at = (target.node, target.output);
        match (instead(look, &scene.graph, &keys, at, (&others, placed.key()))?, target.channel) {
            (Some(Value::Material(material)), channel) => {
                let field = material.get(channel.unwrap_or(Channel::BaseColor));
                return field.map_or(Ok(None), drawn);
            }
            (Some(Value::Field(field)), None) if field.ty() == Type::Rgb => return drawn(&field),
            (Some(Value::Picture(picture)), None) => {
                let PictureFields { rgb, .. } = &*picture;
                return drawn(rgb);
            }
            _ => {}
        }
    }
    if target.channel.is_some_and(|channel| channel != Channel::BaseColor) {
        return Ok(None);
    }
    match solid_of(look, scene, target.node)? {
        Some(solid) => drawn(&solid.cut(&cut)),
        None => Ok(None),
    }
}

/// Middle of the board that the graph cuts, or else a position beside the pith.
fn middle(look: &Look<'_>, scene: &Scene, cutters: &[Cutter], radius: f64) -> Result<DVec3, Failure> {
    let beside = DVec3::new(BESIDE * radius, 0.0, 1.05 * radius);
    let place = cutters.iter().find_map(|(index, _)| {
        let outputs = scene.graph.nodes[*index].node.outputs();
        outputs.iter().position(|output| output.name == "place").map(|at| (*index, at))
    });
    let Some((node, output)) = place else { return Ok(beside) };
    let Some(Value::Field(field)) = look.value(node, output)? else { return Ok(beside) };
    let grid = scene.graph.canvas.grid(UVec2::ONE);
    let tile = look.raster(&field, &grid, Window::full(UVec2::ONE))?;
    Ok(DVec3::from_array([0, 1, 2].map(|c| tile.plane(c).first().map_or(0.0, |v| f64::from(*v)))))
}

/// The nearest upstream solid with a colour, or else the last solid of the graph.
fn solid_of(look: &Look<'_>, scene: &Scene, from: NodeIndex) -> Result<Option<Solid>, Failure> {
    let graph = &scene.graph;
    let colored =
        |index: NodeIndex| Some((index, graph.nodes[index].outputs.iter().position(|ty| *ty == Type::SolidColor)?));
    let near = upstream(graph, from).into_iter().find_map(colored);
    let Some((node, output)) = near.or_else(|| graph.nodes.node_indices().rev().find_map(colored)) else {
        return Ok(None);
    };
    Ok(look.value(node, output)?.and_then(|value| if let Value::Solid(solid) = value { Some(solid) } else { None }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_cover_the_shapes() {
        for i in 0..100_u32 {
            let (u, v) = (f64::from(i % 10) / 10.0 + 0.05, f64::from(i / 10) / 10.0 + 0.05);
            assert!((SolidShape::Sphere.at(u, v).length() - 1.0).abs() < 1e-9);
            let cube = SolidShape::Cube.at(u, v).abs();
            assert!((cube.max_element() - 0.8).abs() < 1e-9, "{cube}");
            let leg = SolidShape::Leg.at(u, v);
            assert!(leg.y.abs() < 1.0 && leg.x * leg.x + leg.z * leg.z < 0.25, "{leg}");
        }
        // Adjacent faces of the cube meet.
        let near = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-6, "{a} {b}");
        let e = 1e-9;
        near(SolidShape::Cube.at(1.0 / 3.0 - e, 0.25), DVec3::new(0.8, 0.0, 0.8));
        near(SolidShape::Cube.at(2.0 / 3.0 + e, 0.25), DVec3::new(0.8, 0.0, 0.8));
    }
}
