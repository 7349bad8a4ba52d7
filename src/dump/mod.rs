//! `shibo dump`: prints the result of a node as JSON.
mod at;
mod data;

use crate::args::{EngineArgs, ValueArgs, resolution};
use crate::find;
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::Progress;
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use at::Points;
use clap::{Args, ValueEnum};
use data::{Data, FieldData};
use glam::DVec3;
use petgraph::graph::NodeIndex;
use petgraph::visit::{Dfs, Reversed, Walker};
use rayon::prelude::*;
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use shibo_value::{Atlas, Carried, Field, Nearest, Number, Resolution, Tile, Value, Window};
use std::path::PathBuf;
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  shibo dump calf.ron points                           points, as [x, y] in mm
  shibo dump calf.ron moved.stretch                    another output of a node
  shibo dump calf.ron height --resolution 64           a field, by rows
  shibo dump calf.ron height --at places.csv           the same at points, one x,y in mm a line
  shibo dump oak.ron time --at places.csv              a solid at points, one x,y,z in mm a line
  shibo dump bowl.ron wood --at places.csv             a field of a mesh where its surface is nearest to x,y,z";

/// Print what a node makes, as JSON.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct DumpArgs {
    /// The graph file.
    graph: PathBuf,
    /// The node, or one of its outputs; nodes inside a sub-graph are USE/NODE.
    #[arg(value_name = "NODE[.PORT]")]
    node: String,
    /// Output format.
    #[arg(long, default_value = "json")]
    format: FormatArg,
    /// The pixels at which fields are taken, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    resolution: Option<Resolution>,
    /// Evaluate a field or a solid at the points of a file, one per line in mm: `x,y` on the canvas, `x,y,z` in space
    /// for a solid or a field of a mesh. A field that depends on whole pictures, or on distant pixels, has the value
    /// of the pixel there.
    #[arg(long, value_name = "FILE")]
    at: Option<PathBuf>,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// Output format.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Json,
}

/// Context for evaluating a field.
struct Source<'a> {
    session: &'a Session,
    graph: &'a Graph,
    cancel: &'a CancelToken,
    progress: &'a Progress<'a>,
}

/// Runs the command.
pub(crate) fn run(args: &DumpArgs, terminal: &Terminal) -> Result<(), Quit> {
    let FormatArg::Json = args.format;
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let registry = library::registry();
    let graph = open::graph(open::load(&args.graph, &registry, &args.values, args.resolution), terminal)?;
    let place = find::output(&graph, &args.node)?;
    let points = args.at.as_deref().map(at::read).transpose()?;
    let (session, shared) = open::opened(registry, &args.engine, terminal)?;
    let progress = Progress::new(terminal, false);
    let source = Source { session: &session, graph: &graph, cancel: &cancel, progress: &progress };
    let data = session.value(&graph, place, &cancel, &progress).and_then(|value| match &points {
        Some(points) => source.at((&value, place.0), points),
        None => source.data(&value),
    });
    open::closed(shared, terminal);
    report::show(terminal, &progress.finish(), &graph.sources);
    let data = data.map_err(|failure| open::failed(failure, &graph.sources, terminal))?;
    terminal.json(&data)
}

impl Source<'_> {
    fn data(&self, value: &Value) -> Result<Data, Failure> {
        if let Some(data) = value.data() {
            return Ok(Data::Object(data));
        }
        if let Some(field) = value.field() {
            return Ok(Data::Field(FieldData { ty: value.ty().name(), ..self.field(&field)? }));
        }
        match value {
            Value::Material(material) => {
                let one = |(channel, field): &(shibo_value::Channel, Field)| Ok((channel.name(), self.field(field)?));
                Ok(Data::material(material.channels().iter().map(one).collect::<Result<_, Failure>>()?))
            }
            Value::Solid(solid) => {
                let message = format!("a {} has values at points only; give some with `--at FILE.csv`", solid.ty());
                Err(Failure::Usage(message))
            }
            other => Err(Failure::Usage(format!("a {} cannot be printed", other.ty()))),
        }
    }

    fn field(&self, field: &Field) -> Result<FieldData, Failure> {
        let size = self.graph.canvas.resolution;
        let window = (self.graph.canvas.grid(size), Window::full(size));
        let (tiles, _) = self.session.rasters(self.graph, field, &[window], self.cancel, self.progress)?;
        Ok(FieldData {
            ty: field.ty().name(),
            size: Some(size.to_array()),
            channels: field.channels(),
            values: tiles.iter().flat_map(interleaved).collect(),
        })
    }

    /// Values of a result at points; a value of a field stands for the pixel around the point, see
    /// [`Session::at_points`].
    fn at(&self, (value, node): (&Value, NodeIndex), points: &Points) -> Result<Data, Failure> {
        if let Value::Solid(solid) = value {
            return match points {
                Points::Space(points) => Ok(Data::solid(solid, &solid.at(points))),
                Points::Canvas(none) if none.is_empty() => Ok(Data::solid(solid, &[])),
                Points::Canvas(_) => {
                    Err(Failure::Usage("a solid is taken at points in space: give one `x,y,z` a line".to_owned()))
                }
            };
        }
        let Some(field) = value.field() else {
            return Err(Failure::Usage(format!("`--at` takes a field or a solid, and this is a {}", value.ty())));
        };
        let points = match points {
            Points::Canvas(points) => points.clone(),
            Points::Space(points) => {
                let atlas = self.atlas(node)?;
                let surface = Nearest::new(&atlas);
                let nearest = |point: &DVec3| match self.cancel.is_cancelled() {
                    true => Err(Failure::Cancelled),
                    false => Ok(surface.at(*point).unwrap_or_default()),
                };
                points.par_iter().map(nearest).collect::<Result<_, _>>()?
            }
        };
        let values = self.session.at_points(self.graph, &field, &points, self.cancel, self.progress)?;
        let values = values.into_iter().map(Number).collect();
        Ok(Data::Field(FieldData { ty: value.ty().name(), size: None, channels: field.channels(), values }))
    }

    /// The one atlas on which a node depends.
    fn atlas(&self, node: NodeIndex) -> Result<Arc<Atlas>, Failure> {
        let nodes = &self.graph.nodes;
        let is_atlas = |index: &NodeIndex| nodes[*index].outputs.first() == Some(&Atlas::TYPE);
        let upstream = Dfs::new(Reversed(nodes), node).iter(Reversed(nodes));
        let found: Vec<NodeIndex> = upstream.filter(is_atlas).collect();
        let [one] = found[..] else {
            let names: Vec<String> = found.iter().map(|index| format!("`{}`", nodes[*index].name)).collect();
            let message = match &names[..] {
                [] => "this field is not that of a mesh: give one `x,y` a line".to_owned(),
                _ => format!("this field rests on several meshes ({}): give one `x,y` a line", names.join(", ")),
            };
            return Err(Failure::Usage(message));
        };
        let value = self.session.value(self.graph, (one, 0), self.cancel, self.progress)?;
        Atlas::unwrap(value).ok_or_else(|| Failure::Usage(format!("`{}` is not an atlas", nodes[one].name)))
    }
}

/// Values of a tile, channels innermost.
fn interleaved(tile: &Tile) -> impl Iterator<Item = Number> {
    let pixels = tile.window.len();
    (0..pixels).flat_map(move |i| (0..tile.channels()).map(move |c| Number(tile.plane(c)[i])))
}
