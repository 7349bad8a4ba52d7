//! [`SimulateMeshSprings`]: simulates the springs of leather on a surface.
//!
//! Beyond the source, whose springs are in the plane (JP4905282B2 §4 to §6); on a plane the motion is the same. See
//! [`kernel::mesh::net`](shibo_kernel::mesh::net). Cost: O(steps · links).
use super::at_points::AtPoints;
use glam::{DVec3, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::means::{Means, Sample};
use shibo_kernel::mesh::net::{NetMotion, Springs, Stopped, simulate};
use shibo_kernel::mesh::slide;
use shibo_kernel::mesh::sow::{Sown, normal};
use shibo_kernel::mesh::{bake, fields};
use shibo_kernel::springs::{Integrator, Rest};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Linear, Node, Output, Outputs, Range, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Field, Stop, SurfaceNet, Tiling, Type};
use std::sync::{Arc, LazyLock};

/// The points of a surface that are held in place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum MeshBoundary {
    /// All points move.
    Free,
    /// Points at most this many mm from an open edge of the surface are held.
    Ends(f64),
    /// Points at most a pitch from an open edge of the surface are held; a closed surface has none.
    #[default]
    Auto,
}

/// Turns the links of a surface into springs and lets them move its points: stiff springs make small cells, soft ones
/// large cells, as in leather stretched over the form.
///
/// `DefineSprings` and `SimulateSprings`, the nodes for the plane, explain the parameters.
///
/// ```ron
/// "ball": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "points": MeshPoints(atlas: "atlas", pitch: 4),
/// "links": ConnectMeshPoints(net: "points"),
/// "bends": BakeCurvature(atlas: "atlas", radius: 12),
/// "moved": SimulateMeshSprings(net: "links", atlas: "atlas", field: "bends", stiffness: (1, 5)),
/// "relinked": ConnectMeshPoints(net: "moved"),
/// "example": DrawMeshWrinkles(net: "relinked", atlas: "atlas", width: (0.5, 1.2), depth: 0.4),
/// ```
///
/// Elsewhere: Houdini *Vellum* springs constrained to a surface; Blender and Substance have none.
#[node]
pub struct SimulateMeshSprings {
    /// The points and links.
    pub net: In<SurfaceNet>,
    /// The atlas of their mesh.
    pub atlas: In<Atlas>,
    /// Field on the atlas that controls the springs, 0..1. If not given, all springs are those of a field of 0.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub field: Option<In<Gray>>,
    /// Field on the atlas; points are held where it is above ½.
    pub held: Option<In<Gray>>,
    /// Stiffness where the field is 0 and stiffness where it is 1. One number: the same everywhere.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6))]
    #[default(Linear::new(1.0, 5.0))]
    pub stiffness: Linear,
    /// The length at rest.
    #[schemars(extend("minimum" = -100.0, "maximum" = 100.0))]
    #[default(Rest::Zero)]
    pub rest: Rest,
    /// Length of a time step.
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0.0))]
    #[default(0.1)]
    pub step: f64,
    /// Number of steps: how far the pattern develops.
    #[schemars(range(min = 0, max = 100_000))]
    #[default(60)]
    pub steps: u32,
    /// Drag of points: a force against their motion, this factor times their speed.
    #[schemars(range(min = 0, max = 1e6))]
    #[default(4.0)]
    pub drag: f64,
    /// Damping of links: a force against the stretching of a link, this factor times the speed at which the link grows.
    #[schemars(range(min = 0, max = 1e6))]
    pub damping: f64,
    /// Integration of position and velocity.
    #[default(Integrator::SemiImplicit)]
    pub integrator: Integrator,
    /// The force beyond which springs break; a pair gives each spring a random limit between the two. If not given, no
    /// spring breaks.
    #[schemars(extend("minimum" = 0.0))]
    pub break_force: Option<Range>,
    /// The points that are held in place.
    #[schemars(extend("minimum" = 0.0, "unit" = "mm"))]
    #[default(MeshBoundary::Auto)]
    pub boundary: MeshBoundary,
    /// Another seed gives springs other limits.
    pub seed: u64,
}

impl Node for SimulateMeshSprings {
    const OUTPUTS: &'static [Output] = &[
        Output::new(
            "net",
            Type::SurfaceNet,
            "The points where they are in the end, with all their links; those of broken springs are marked.",
        ),
        Output::new(
            "stretch",
            Type::Gray,
            "The length of links as a share of that before the motion: the mean of those within 1.5 pitches. 1 where there are \
             none.",
        ),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (net, atlas) = (cx.get(&self.net)?, cx.get(&self.atlas)?);
        if net.mesh.triangles != atlas.mesh.triangles || net.mesh.positions != atlas.mesh.positions {
            let message = "atlas is that of another mesh than the one on which the points lie";
            let help = "give `MeshPoints` and this node the same atlas";
            return Err(Problem::new(Code::BadValue, message).at("atlas").help(help).into());
        }
        if net.links.is_empty() && net.positions.len() > 1 {
            let message = "the points have no links: nothing moves";
            let help = "link them with `ConnectMeshPoints(net: …)`";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("net").help(help));
        }
        let of_points = |port: &In<Gray>, name: &str| -> Result<Vec<f64>, Stop> {
            let read = AtPoints::read(cx, &atlas, net.pitch, (&cx.get(port)?, name))?;
            Ok((0..net.positions.len()).map(|n| read.at(&atlas, net.triangles[n] as usize, weights(&net, n))).collect())
        };
        let scalars = self.field.as_ref().map(|port| of_points(port, "field")).transpose()?;
        let held = self.held.as_ref().map(|port| of_points(port, "held")).transpose()?;
        let along = |link: &[u32; 2]| {
            scalars.as_ref().map_or(0.0, |values| 0.5 * (values[link[0] as usize] + values[link[1] as usize]))
        };
        let stiffness: Vec<f64> = net.links.iter().map(|link| self.stiffness.at(along(link)).max(0.0)).collect();
        let fixed = self.fixed(&net, &atlas, held.as_deref());
        let (rest, limit) = (self.rest(&net), self.limits(cx, net.links.len()));
        let springs = Springs { links: &net.links, stiffness: &stiffness, rest: &rest, limit: &limit, fixed: &fixed };
        let motion = NetMotion {
            step: self.step,
            steps: self.steps,
            drag: self.drag,
            damping: self.damping,
            semi_implicit: self.integrator == Integrator::SemiImplicit,
            farthest: 0.5 * net.pitch,
        };
        let total = u64::from(self.steps);
        let mut progress = |step: u32| cx.evaluator.progress(u64::from(step), total);
        let until = || cx.check().is_err();
        let state = simulate(&atlas, (&net.positions, &net.triangles), &springs, &motion, (&until, &mut progress));
        let state = state.map_err(|stopped| match stopped {
            Stopped::Cancelled => Stop::Cancelled,
            Stopped::Diverged(step) => self.explain(step).into(),
        })?;
        let mut moved = SurfaceNet { positions: state.places, triangles: state.triangles, ..SurfaceNet::clone(&net) };
        moved.normals = (0..moved.positions.len()).map(|n| normal_of(&moved, &atlas, n)).collect();
        if state.broken.contains(&true) {
            moved.broken = state.broken;
        }
        let stretch = stretch(&atlas, &moved);
        Ok(Outputs::one(moved).with("stretch", stretch))
    }
}

/// Radius over which the value of a link is averaged, in pitches.
const REACH: f64 = 1.5;

/// The stretch of the links around each texel: their length divided by their length at the start.
fn stretch(atlas: &Arc<Atlas>, net: &SurfaceNet) -> Field {
    let sample = |link: usize| {
        let [a, b] = net.links[link].map(|n| n as usize);
        let before = net.lengths[link];
        Sample {
            place: ((net.positions[a] + net.positions[b]) * 0.5).as_vec3(),
            normal: (net.normals[a] + net.normals[b]).normalize_or_zero(),
            value: if before > 0.0 { narrow(net.span(link).length()) / before } else { 1.0 },
        }
    };
    let samples: Vec<Sample> = (0..net.links.len()).map(sample).collect();
    let radius = narrow(REACH * net.pitch).max(f32::MIN_POSITIVE);
    // Sorted when the first texel is computed.
    let means = LazyLock::new(move || Means::new(samples, radius));
    fields::baked(Type::Gray, atlas, move |texels, mut planes| {
        if let [out] = &mut planes[..] {
            let planes = bake::places_and_normals(texels);
            let [places, normals] = planes.each_ref().map(|of| of.each_ref().map(Vec::as_slice));
            means.fill(places, normals, 1.0, out);
        }
    })
}

/// The barycentric weights of a point in its triangle.
fn weights(net: &SurfaceNet, point: usize) -> [f64; 3] {
    let corners = net.mesh.corners(net.triangles[point] as usize);
    slide::weights(corners, net.positions[point]).unwrap_or([1.0, 0.0, 0.0])
}

fn normal_of(net: &SurfaceNet, atlas: &Atlas, point: usize) -> Vec3 {
    let sown = Sown { place: net.positions[point], triangle: net.triangles[point], weights: weights(net, point) };
    normal(&net.mesh, &atlas.smooth, &sown)
}

impl SimulateMeshSprings {
    /// The length at rest of each spring.
    fn rest(&self, net: &SurfaceNet) -> Vec<f64> {
        let lengths = || (0..net.links.len()).map(|link| net.span(link).length());
        match self.rest {
            Rest::Zero => vec![0.0; net.links.len()],
            Rest::InitialMinus(factor) => lengths().map(|length| length - net.pitch * factor).collect(),
            Rest::Source => {
                let mean = lengths().sum::<f64>() / net.links.len().max(1) as f64;
                lengths().map(|length| length - mean).collect()
            }
        }
    }

    /// The force beyond which each spring breaks; empty if none can break.
    fn limits(&self, cx: &Context<'_>, links: usize) -> Vec<f64> {
        let Some(range) = self.break_force else { return Vec::new() };
        let hash = Hash::new(cx.seed(self.seed));
        (0..links as u64).map(|n| range.at(hash.unit(n))).collect()
    }

    fn fixed(&self, net: &SurfaceNet, atlas: &Atlas, held: Option<&[f64]>) -> Vec<bool> {
        let margin = match self.boundary {
            MeshBoundary::Free => None,
            MeshBoundary::Ends(margin) => Some(margin),
            MeshBoundary::Auto => Some(net.pitch),
        };
        let ends = margin.map(|_| ends(atlas)).unwrap_or_default();
        let near = |point: usize| {
            let close = |[a, b]: &[DVec3; 2]| {
                let (d, along) = (net.positions[point] - *a, *b - *a);
                let share = (d.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                d.distance(along * share) <= margin.unwrap_or(0.0)
            };
            ends.iter().any(close)
        };
        let held = |point: usize| held.is_some_and(|held| held[point] > 0.5);
        (0..net.positions.len()).map(|point| held(point) || near(point)).collect()
    }

    fn explain(&self, step: u32) -> Problem {
        let message = format!("the motion diverges in step {step}: a point would go more than half a pitch at once");
        let help =
            format!("lower step (it is {}) or stiffness, or raise drag to about 6 · stiffness · step", self.step);
        Problem::new(Code::Diverged, message).at("step").help(help)
    }
}

/// The open edges of a surface.
fn ends(atlas: &Atlas) -> Vec<[DVec3; 2]> {
    let of = |triangle: usize| {
        let corners = atlas.mesh.corners(triangle);
        let open = (0..3).filter(move |edge| atlas.across(triangle, *edge).is_none());
        open.map(move |edge| [corners[(edge + 1) % 3], corners[(edge + 2) % 3]])
    };
    (0..atlas.mesh.triangles.len()).flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{ConnectMeshPoints, MeshAtlas, MeshForm, MeshPoints, MeshShape};
    use crate::testing::{canvas, check_field, outputs, port, raster};
    use shibo_value::Value;

    /// The stretch on a ball after `steps` steps, and the field of texels that lie on its surface.
    fn stretched(steps: u32) -> (Field, Field) {
        let made =
            |node: &dyn Fn() -> Result<Outputs, Stop>, name: &str| node().unwrap().take(name, true).unwrap().clone();
        let shape = MeshShape { shape: MeshForm::Sphere, segments: 24, ..MeshShape::default() };
        let mesh = made(&|| outputs(&shape, &[], &canvas()), "mesh");
        let node = MeshAtlas { mesh: port(0), page: 256, ..MeshAtlas::default() };
        let laid = outputs(&node, &[mesh], &canvas()).unwrap();
        let [atlas, mask] = ["atlas", "mask"].map(|name| laid.take(name, name == "atlas").unwrap().clone());
        let sown = MeshPoints { atlas: port(0), pitch: 5.0, ..MeshPoints::default() };
        let net = made(&|| outputs(&sown, std::slice::from_ref(&atlas), &canvas()), "net");
        let linked = ConnectMeshPoints { net: port(0), ..ConnectMeshPoints::default() };
        let net = made(&|| outputs(&linked, std::slice::from_ref(&net), &canvas()), "net");
        let node = SimulateMeshSprings { net: port(0), atlas: port(1), steps, ..SimulateMeshSprings::default() };
        let moved = outputs(&node, &[net, atlas], &canvas()).unwrap();
        let (Some(Value::Field(stretch)), Value::Field(mask)) = (moved.take("stretch", false), mask) else {
            panic!("no fields")
        };
        (stretch.clone(), mask)
    }

    #[test]
    fn stretch_averages_nearby_links() {
        let (still, mask) = stretched(0);
        let on = |field: &Field| {
            let (values, mask) = (raster(field, &canvas()), raster(&mask, &canvas()));
            let inside = values.data().iter().zip(mask.data()).filter(|(_, mask)| **mask > 0.5);
            inside.map(|(value, _)| *value).collect::<Vec<f32>>()
        };
        assert!(on(&still).iter().all(|v| (v - 1.0).abs() < 1e-5));
        let (moved, _) = stretched(40);
        let values = on(&moved);
        let (low, high) = values.iter().fold((f32::MAX, 0.0_f32), |(low, high), v| (low.min(*v), high.max(*v)));
        // A closed surface keeps its area: links shrink at some places and stretch at others.
        assert!((0.4..0.97).contains(&low) && (1.03..2.5).contains(&high), "{low} to {high}");
        check_field(&moved);
    }
}
