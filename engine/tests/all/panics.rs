//! Nodes whose code panics: the session reports the panic once, at the node, and continues.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, RenderRequest, Session, Settings};
use shibo_graph::{LoadOptions, Loaded, load_text};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, Node, Output, Outputs};
use shibo_value::{Field, FieldSource, Given, Grid, Pictures, Read, Stop, Tile, Tiling, Type, Window};
use std::path::Path;

/// The function in which a node panics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
enum Where {
    #[default]
    Nowhere,
    Evaluate,
    Fill,
    Inputs,
    Prepare,
    Load,
}

/// A node that panics in a chosen function.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
#[serde(default)]
struct Panics {
    at: Where,
}

impl<'de> Deserialize<'de> for Panics {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Default, Deserialize)]
        #[serde(default)]
        struct Plain {
            at: Where,
        }
        let Plain { at } = Plain::deserialize(deserializer)?;
        assert_ne!(at, Where::Load, "the test panics");
        Ok(Self { at })
    }
}

impl Node for Panics {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Nothing.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        assert_ne!(self.at, Where::Evaluate, "the test panics");
        Ok(Outputs::one(Field::new(Type::Gray, Tiling::NONE, Source(self.at))))
    }
}

struct Source(Where);

impl FieldSource for Source {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        assert_ne!(self.0, Where::Inputs, "the test panics");
        Vec::new()
    }

    fn prepare(&self, _grid: &Grid, _pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        assert_ne!(self.0, Where::Prepare, "the test panics");
        Ok(None)
    }

    fn fill(&self, _given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        assert_ne!(self.0, Where::Fill, "the test panics");
        out.data_mut().fill(0.5);
        Ok(())
    }
}

fn registry() -> Registry {
    Registry::new([Family { name: "Test", doc: "For tests.", kinds: vec![Kind::of::<Panics>()] }])
}

fn load(at: Where) -> Loaded {
    let text = format!(
        "(canvas: (size_mm: 600, resolution: 600), nodes: {{\n  \"bad\": Panics(at: {at:?}) }}, outputs: {{ \"out\": \"bad\" }})"
    );
    load_text(Path::new("panics.ron"), &text, &registry(), &LoadOptions::default())
}

#[test]
fn reports_panics_at_the_node() {
    let session = Session::new(registry(), &Settings { threads: 2, ..Settings::default() }).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let request = RenderRequest { dir: folder.path().to_path_buf(), ..RenderRequest::default() };
    for at in [Where::Evaluate, Where::Fill, Where::Inputs, Where::Prepare, Where::Nowhere] {
        let graph = load(at).graph.unwrap();
        let done = session.render(&graph, &request, &CancelToken::default(), &Silent);
        if at == Where::Nowhere {
            // The session still works.
            assert_eq!(done.unwrap().files.len(), 1);
            continue;
        }
        let Err(Failure::Errors(errors)) = done else { panic!("{at:?}: {done:?}") };
        let [error] = &errors[..] else { panic!("told more than once: {errors:?}") };
        assert!(error.message.contains("defect") && error.message.contains("the test panics"), "{error:?}");
        assert!(error.message.contains("panics.rs:"), "the place in the source: {error:?}");
        assert_eq!(graph.sources.position(error.span.file, error.span.start).line, 2, "{at:?}: {error:?}");
        assert_eq!(folder.path().read_dir().unwrap().count(), 0, "{at:?}");
    }
}

#[test]
fn reports_panics_while_loading_as_errors_of_the_file() {
    let loaded = load(Where::Load);
    assert!(loaded.graph.is_none());
    let [error] = &loaded.diagnostics[..] else { panic!("{:?}", loaded.diagnostics) };
    assert!(error.message.contains("defect") && error.message.contains("the test panics"), "{error:?}");
    assert_eq!(loaded.files, [Path::new("panics.ron")]);
    assert!(load(Where::Nowhere).graph.is_some());
}
