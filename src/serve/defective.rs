//! Test helpers: a node that panics, and a stage for graphs that contain it.
use super::stage::Stage;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, Node, Output, Outputs};
use shibo_value::{Field, Stop, Tile, Tiling, Type};
use std::path::Path;
use std::sync::Arc;

/// Makes a grey picture, or panics.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Panics {
    bad: bool,
}

impl Node for Panics {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Grey.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        let bad = self.bad;
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::NONE, move |out: &mut Tile, _| {
            assert!(!bad, "the test panics");
            out.data_mut().fill(0.5);
            Ok(())
        })))
    }
}

/// A registry with this node only.
pub(crate) fn registry() -> Registry {
    Registry::new([Family { name: "Test", doc: "For tests.", kinds: vec![Kind::of::<Panics>()] }])
}

/// The text of a graph with the node.
pub(crate) fn text(bad: bool) -> String {
    format!(
        "(canvas: (size_mm: 8, resolution: 8), nodes: {{ \"it\": Panics(bad: {bad}) }}, outputs: {{ \"out\": \"it\" }})"
    )
}

/// The loaded graph of [`text`].
pub(crate) fn graph(bad: bool) -> Graph {
    let loaded = load_text(Path::new("a.ron"), &text(bad), &registry(), &LoadOptions::default());
    loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics))
}

/// A stage for graphs with the node.
pub(crate) fn stage() -> Arc<Stage> {
    let settings = Settings { threads: 2, memory: 64 << 20, ..Settings::default() };
    let session = Session::new(registry(), &settings).unwrap();
    Arc::new(Stage::new(session, "a.ron".into()))
}
