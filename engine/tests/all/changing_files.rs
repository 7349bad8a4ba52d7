//! Files that change between loading a graph and evaluating it. A result is never stored under the key of another
//! content.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Keys, MemoryStore, Silent};
use shibo_engine::session::{Failure, RenderRequest, Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, FilePath, Node, Output, Outputs};
use shibo_picture::{ReadLimits, read};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tile, Tiling, Type, Value, Window};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

const VALUE: Output = Output::new("value", Type::Gray, "The number in the file.");

fn number(path: &Path) -> Result<f32, Problem> {
    let wrong = |message: String| Problem::new(Code::BadFile, message).at("path");
    let text = fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    text.parse().map_err(|_| wrong(format!("`{text}` is no number")))
}

fn path(cx: &Context<'_>) -> PathBuf {
    cx.file("path").unwrap().path().to_owned()
}

/// The number in a file, read when the node is evaluated.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Early {
    path: FilePath,
}

impl Node for Early {
    const OUTPUTS: &'static [Output] = &[VALUE];

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        vec![("path", &self.path)]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(Field::constant(Type::Gray, &[number(&path(cx))?])))
    }
}

/// Number in a file, read when the first tile is filled, and then kept.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
struct Late {
    path: FilePath,
    /// Written to the file just before the file is read, as if by another program; 0 writes nothing.
    intruder: u16,
}

impl Node for Late {
    const OUTPUTS: &'static [Output] = &[VALUE];

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        vec![("path", &self.path)]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (path, intruder) = (path(cx), self.intruder);
        let known = OnceLock::new();
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::NONE, move |out: &mut Tile, _| {
            let value = known.get_or_init(|| {
                if intruder > 0 {
                    fs::write(&path, intruder.to_string()).unwrap();
                }
                number(&path)
            });
            out.data_mut().fill(value.clone()?);
            Ok(())
        })))
    }
}

fn registry() -> Registry {
    Registry::new([Family { name: "Test", doc: "For tests.", kinds: vec![Kind::of::<Early>(), Kind::of::<Late>()] }])
}

/// A folder with a file that holds a number, and a graph that reads it.
struct Desk {
    folder: tempfile::TempDir,
    graph: Graph,
    store: Arc<MemoryStore>,
}

impl Desk {
    fn new(node: &str, number: u16) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("number"), number.to_string()).unwrap();
        let text = format!(
            "(canvas: (size_mm: 8, resolution: 8), nodes: {{ \"it\": {node} }}, \
             outputs: {{ \"out\": File(from: \"it\", format: Exr, depth: F32) }})"
        );
        let loaded = load_text(&folder.path().join("graph.ron"), &text, &registry(), &LoadOptions::default());
        let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
        Self { folder, graph, store: Arc::new(MemoryStore::new(1 << 20)) }
    }

    fn write(&self, number: u16) {
        fs::write(self.folder.path().join("number"), number.to_string()).unwrap();
    }

    /// A session, and the store that all sessions share.
    fn session(&self) -> Session {
        let settings = Settings { threads: 2, ..Settings::default() };
        Session::with_store(registry(), &settings, Some(Box::new(self.store.clone()))).unwrap()
    }

    /// The number in the rendered picture.
    fn rendered(&self) -> Result<f32, Failure> {
        let request = RenderRequest { dir: self.folder.path().join("out"), ..RenderRequest::default() };
        self.session().render(&self.graph, &request, &CancelToken::default(), &Silent)?;
        Ok(read(&request.dir.join("out.exr"), &ReadLimits::default()).unwrap().planes[0])
    }

    /// Number in a pixel, under keys that were derived earlier.
    fn seen(&self, session: &Session, keys: &Keys, x: i32) -> Result<f32, Failure> {
        let output = &self.graph.outputs[0];
        session.look(&self.graph, keys, &CancelToken::default(), &Silent, |look| {
            let Some(Value::Field(field)) = look.value(output.node, output.output)? else { panic!("no field") };
            let window = Window { x, y: 0, width: 1, height: 1 };
            Ok(look.raster(&field, &self.graph.canvas.grid(self.graph.canvas.resolution), window)?.data()[0])
        })
    }
}

/// The message of a refused result; its span must be the parameter that names the file.
#[track_caller]
fn refused(desk: &Desk, result: Result<f32, Failure>) -> String {
    let Err(Failure::Errors(errors)) = result else { panic!("{result:?}") };
    let [error] = &errors[..] else { panic!("{errors:?}") };
    assert_eq!((error.code, error.span), (Code::BadFile, desk.graph.nodes[desk.graph.outputs[0].node].fields[0].1));
    error.message.clone()
}

#[test]
fn rereads_a_file_that_changed_before_the_run() {
    for node in ["Early(path: \"number\")", "Late(path: \"number\")"] {
        let desk = Desk::new(node, 1);
        // The graph was loaded with 1 in the file, and is rendered with other numbers.
        for number in [2, 3, 1, 2, 1] {
            desk.write(number);
            assert_eq!(desk.rendered(), Ok(f32::from(number)), "{node}");
        }
    }
}

#[test]
fn refuses_results_of_files_changed_during_the_run() {
    for node in ["Early(path: \"number\")", "Late(path: \"number\")"] {
        let desk = Desk::new(node, 1);
        let session = desk.session();
        let keys = session.keys(&desk.graph).unwrap();
        for _ in 0..2 {
            desk.write(2);
            let message = refused(&desk, desk.seen(&session, &keys, 0));
            assert!(message.ends_with("number` was changed after the run had begun"), "{message}");
        }
        fs::remove_file(desk.folder.path().join("number")).unwrap();
        refused(&desk, desk.seen(&session, &keys, 0));
        // The same content again, in a new file.
        desk.write(1);
        assert_eq!(desk.seen(&session, &keys, 0), Ok(1.0), "{node}");
        assert_eq!(desk.rendered(), Ok(1.0), "{node}");
    }
}

#[test]
fn keeps_content_read_before_a_change() {
    let desk = Desk::new("Late(path: \"number\")", 1);
    let session = desk.session();
    let keys = session.keys(&desk.graph).unwrap();
    assert_eq!(desk.seen(&session, &keys, 0), Ok(1.0));
    desk.write(2);
    // Outside the tile that is in memory.
    assert_eq!(desk.seen(&session, &keys, 3000), Ok(1.0));
    assert_eq!(desk.rendered(), Ok(2.0));
}

#[test]
fn refuses_a_file_changed_while_it_is_read() {
    let desk = Desk::new("Late(path: \"number\", intruder: 9)", 1);
    let session = desk.session();
    let keys = session.keys(&desk.graph).unwrap();
    let message = refused(&desk, desk.seen(&session, &keys, 0));
    assert!(message.contains("was changed after the run had begun"), "{message}");
    // The node keeps the other content, so restoring the old content does not help.
    desk.write(1);
    let message = refused(&desk, desk.seen(&session, &keys, 0));
    assert!(message.contains("was changed while it was read"), "{message}");
    // The result was not stored: a new session reads the current content.
    desk.write(9);
    assert_eq!(desk.rendered(), Ok(9.0));
}
