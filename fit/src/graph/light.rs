//! The light of a picture: a `Relief` of the graph, whose direction can be an unknown.
use shibo_graph::Graph;
use shibo_ide::{Cx, Section};

/// The direction of the light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Light {
    /// Found with the other values.
    #[default]
    Auto,
    /// That of the graph.
    Graph,
    /// Azimuth and elevation in degrees.
    From(f64, f64),
}

impl std::str::FromStr for Light {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        light(text)
    }
}

/// Parses `auto`, `graph`, or two angles.
fn light(text: &str) -> Result<Light, String> {
    match text {
        "auto" => return Ok(Light::Auto),
        "graph" => return Ok(Light::Graph),
        _ => {}
    }
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[azimuth, elevation]) if azimuth.abs() <= 360.0 && (1.0..=90.0).contains(&elevation) => {
            Ok(Light::From(azimuth, elevation))
        }
        _ => {
            Err("write auto, graph, or AZIMUTH,ELEVATION in degrees: azimuth -360 to 360, elevation 1 to 90".to_owned())
        }
    }
}

/// The node that lights an output.
pub(super) struct Relief {
    pub(super) node: String,
    pub(super) azimuth: f64,
    pub(super) elevation: f64,
    /// Its elevation has an effect.
    pub(super) has_lamp: bool,
}

/// The `Relief` of an output, if it is a node of this file.
pub(super) fn relief(graph: &Graph, output: &str, cx: Cx<'_>) -> Option<Relief> {
    let output = graph.outputs.iter().find(|one| one.name == output)?;
    let node = &graph.nodes[output.node];
    let item = cx.file.entry(Section::Nodes, &node.name)?;
    let body = item.value.as_ref()?.body()?;
    if node.kind != "Relief" {
        return None;
    }
    let given = |name: &str| body.value(name).map(|value| cx.file.at(&value.range));
    let number = |name: &str, usual: f64| given(name).and_then(|text| text.parse().ok()).unwrap_or(usual);
    let has_lamp =
        given("environment").is_none_or(|text| text.trim_matches('"') == "Lamp") && given("panorama").is_none();
    Some(Relief {
        node: node.name.clone(),
        azimuth: number("azimuth", 225.0),
        elevation: number("elevation", 40.0),
        has_lamp,
    })
}
