//! `render --view`: pictures of the materials of a graph on a shape, instead of the graph's own outputs.
use crate::quit::Quit;
use clap::{Args, ValueEnum};
use shibo_graph::Graph;
use shibo_node::registry::Registry;

/// A picture of each material on a shape.
#[derive(Args, Clone, Debug)]
pub(crate) struct ViewArgs {
    /// Draw each material on this shape, in light; other outputs are left out. Files are named OUTPUT_SHAPE.
    #[arg(long, value_name = "SHAPE", conflicts_with_all = ["node", "target", "region", "part", "combined"])]
    view: Option<Shape>,
    /// Light around the shape.
    #[arg(long, value_name = "NAME", default_value = "studio", requires = "view")]
    environment: Light,
}

/// Shapes.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Shape {
    Ball,
    Cube,
    Plane,
    /// The mesh of the graph's own exports
    Mesh,
}

/// Environments.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Light {
    /// Soft boxes in a gray room.
    Studio,
    /// A cloudy sky.
    Overcast,
    /// A room with one window.
    Window,
    /// The sun in a blue sky.
    Sky,
}

impl ViewArgs {
    /// Returns true if shapes are drawn.
    pub(crate) const fn is_given(&self) -> bool {
        self.view.is_some()
    }

    /// Replaces the outputs of the graph, or the `named` ones.
    pub(crate) fn replace_outputs(&self, graph: &mut Graph, registry: &Registry, named: &[String]) -> Result<(), Quit> {
        let Some(shape) = self.view else { return Ok(()) };
        let (shape, suffix, mesh) = match shape {
            Shape::Ball => ("Ball", "ball", None),
            Shape::Cube => ("Cube", "cube", None),
            Shape::Plane => ("Plane", "plane", None),
            Shape::Mesh => ("Ball", "mesh", Some("mesh")),
        };
        let light = match self.environment {
            Light::Studio => "Studio",
            Light::Overcast => "Overcast",
            Light::Window => "Window",
            Light::Sky => "Sky",
        };
        let params = [("shape", shape), ("environment", light)];
        graph.show_by(registry, ("View", "material", mesh, &params), (suffix, named)).map_err(Quit::Usage)
    }
}
