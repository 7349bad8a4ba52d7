//! Facts of the canvas: a node declares each fact that its result depends on, and reads no other.
use crate::kinds::{another, bytes, graph, it, session};
use glam::{DVec2, UVec2};
use shibo_engine::eval::{CancelToken, Silent, encode};
use shibo_engine::session::{Failure, Look};
use shibo_graph::{Graph, Input};
use shibo_node::registry::Registry;
use shibo_node::{Call, Fact, KindInfo, Role};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Canvas, Cut, Evaluator, Field, Grid, Key, Stop, Tile, Tiling, Type, Value, Window};
use std::sync::Arc;

/// The engine for a node that is evaluated outside its graph, with another canvas.
struct Beside<'r>(&'r Look<'r>);

impl Evaluator for Beside<'_> {
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        self.0.raster(field, grid, window).map_err(|failure| match failure {
            Failure::Cancelled => Stop::Cancelled,
            other => Problem::new(Code::BadValue, format!("{other:?}")).into(),
        })
    }

    fn check(&self) -> Result<(), Stop> {
        Ok(())
    }

    fn progress(&self, _done: u64, _total: u64) {}

    fn memory(&self) -> u64 {
        1 << 30
    }

    fn warn(&self, _problem: Problem) {}
}

/// The fields of a value; for a solid, a plane cut through it.
pub fn shown(value: &Value) -> Vec<Field> {
    let Value::Solid(solid) = value else { return value.fields() };
    let place = Field::generate(Type::Rgb, Tiling::NONE, |out: &mut Tile, _| {
        let (grid, window) = (out.grid, out.window);
        let width = window.width.cast_signed();
        let mut planes = out.planes_mut();
        for i in 0..window.len() {
            let pixel = i32::try_from(i).unwrap();
            let at = grid.center(window.x + pixel % width, window.y + pixel / width).as_vec2();
            planes.iter_mut().zip([at.x, 0.5 * at.x + 3.0, at.y]).for_each(|(plane, v)| plane[i] = v);
        }
        Ok(())
    });
    vec![solid.cut(&Cut::new(Key::of("plane", &[]), place, |grid: &Grid| grid.step.max_element()))]
}

/// Outputs of the node `it` for these inputs, evaluated with `canvas`. Fields are sampled on the graph's own grid.
fn made(look: &Look<'_>, graph: &Graph, inputs: &[Value], canvas: &Canvas) -> Result<Vec<u8>, String> {
    let node = &graph.nodes[it(graph)];
    let evaluator = Beside(look);
    let call = Call { kind: &node.kind, canvas, inputs, files: &node.files, evaluator: &evaluator };
    let outputs = node.node.evaluate(&call).map_err(|stop| format!("{stop:?}"))?;
    let mut all = format!("{:?}", node.node.tiling(canvas)).into_bytes();
    for (i, output) in node.node.outputs().iter().enumerate() {
        let value = outputs.take(output.name, i == 0).ok_or("an output is missing")?;
        all.extend(encode(value).unwrap_or_default());
        for field in shown(value) {
            let size = graph.canvas.resolution;
            let tile = look.raster(&field, &graph.canvas.grid(size), Window::full(size));
            let tile = tile.map_err(|failure| format!("{failure:?}"))?;
            all.extend(format!("{:?}", field.tiling()).bytes());
            all.extend(tile.data().iter().flat_map(|v| v.to_bits().to_le_bytes()));
        }
    }
    Ok(all)
}

/// The canvas with one fact changed, in several ways.
fn changes(canvas: &Canvas) -> Vec<(Fact, Canvas)> {
    let size = |by: DVec2| (Fact::Size, Canvas { size_mm: canvas.size_mm * by, ..*canvas });
    let tile = |tile| (Fact::Tile, Canvas { tile, ..*canvas });
    vec![
        size(DVec2::splat(1.25)),
        size(DVec2::new(1.0, 2.0)),
        tile(Tiling::NONE),
        tile(Tiling { x: true, y: false }),
        (Fact::Seed, Canvas { seed: canvas.seed + 1, ..*canvas }),
    ]
}

/// A node gives the same result for all canvases that agree in its declared facts, or in `declared` if given.
pub fn declares_what_it_reads(
    registry: &Arc<Registry>,
    info: &KindInfo,
    declared: Option<&[Fact]>,
) -> Result<(), String> {
    let graph = graph(registry, info, UVec2::splat(24), None)?;
    let node = &graph.nodes[it(&graph)];
    let declared = declared.unwrap_or(node.node.facts());
    let session = session(registry, 1);
    let fail = |failure: Failure| format!("{failure:?}");
    let keys = session.keys(&graph).map_err(fail)?;
    let compare = |look: &Look<'_>| -> Result<Result<(), String>, Failure> {
        let mut inputs = Vec::new();
        for input in &node.inputs {
            inputs.push(match input {
                Input::Wire { node, output } => look.value(*node, *output)?.unwrap(),
                Input::Constant(field) => Value::Field(field.clone()),
            });
        }
        let plain = made(look, &graph, &inputs, &graph.canvas);
        let differs =
            |(fact, canvas): &(Fact, Canvas)| !declared.contains(fact) && made(look, &graph, &inputs, canvas) != plain;
        let found = changes(&graph.canvas).into_iter().find(differs).map(|(fact, _)| fact.name());
        let complaint =
            found.map(|fact| format!("its result depends on {fact} of the canvas, which it does not declare"));
        Ok(complaint.map_or(plain.clone().map(drop), Err))
    };
    session.look(&graph, &keys, &CancelToken::default(), &Silent, compare).map_err(fail)?
}

/// With any parameters, a node reads no undeclared fact: the engine would report it.
pub fn reads_only_declared_facts(registry: &Arc<Registry>, info: &KindInfo) -> Result<(), String> {
    let session = session(registry, 1);
    for field in &info.fields {
        let Role::Param(param) = &field.role else { continue };
        let choices = param.choices.iter().filter(|choice| !choice.has_arguments).map(|choice| choice.name.clone());
        for value in another(param).into_iter().chain(choices) {
            // Contradicting or unusable parameters are covered by other tests.
            let made = graph(registry, info, UVec2::splat(16), Some((&field.name, &value)))
                .and_then(|graph| bytes(&session, &graph, 16));
            if let Err(complaint) = made.map(drop)
                && complaint.contains("does not declare")
            {
                return Err(format!("`{}: {value}`: {complaint}", field.name));
            }
        }
    }
    Ok(())
}
