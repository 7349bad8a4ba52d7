//! `render --sweep`: renders the variants of a graph, which share common results. Files of an earlier run are left as
//! they are.
mod axis;
mod font;
mod sheet;
mod table;

pub(crate) use axis::{Axis, Variants, axis, count, variants};

use crate::args::ValueArgs;
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::Progress;
use crate::quit::Quit;
use crate::render::{RenderArgs, request_of, show_nodes};
use crate::report;
use crate::terminal::Terminal;
pub(crate) use sheet::{Layout, SIDE, Sheet};
use shibo_engine::eval::{CancelToken, Event, Observer, Silent};
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use shibo_node::registry::Registry;
use shibo_value::diagnostics::Diagnostic;
use shibo_value::{Channel, Key, Resolution, Tile, Type, Value, Window};
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use table::Table;

/// Maximum number of values per name that are tried before rendering.
const TRIED: usize = 16;

/// A run through all variants.
struct Sweep<'a> {
    args: &'a RenderArgs,
    terminal: &'a Terminal,
    session: Session,
    cancel: CancelToken,
    count: usize,
    /// Variants to render, counted from 0.
    wanted: Range<usize>,
    told: Told<'a>,
}

/// Shows each warning once, although many variants cause it.
struct Told<'a> {
    terminal: &'a Terminal,
    warnings: Mutex<Vec<Diagnostic>>,
    seen: Mutex<BTreeSet<String>>,
}

impl Observer for Told<'_> {
    fn event(&self, event: Event) {
        if let Event::Warning(warning) = event {
            self.warnings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(warning);
        }
    }
}

impl Told<'_> {
    fn show(&self, graph: &Graph) {
        let mut seen = self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut warnings = self.warnings.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        // The same source range with other values is the same warning.
        let new = |warning: &Diagnostic| seen.insert(format!("{:?} {:?}", warning.code, warning.span));
        let shown: Vec<Diagnostic> = warnings.drain(..).filter(new).collect();
        report::show(self.terminal, &shown, &graph.sources);
    }
}

/// Runs the command.
pub(crate) fn run(args: &RenderArgs, terminal: &Terminal) -> Result<(), Quit> {
    let axes = &args.sweep;
    let count = axis::count(axes).map_err(Quit::Usage)?;
    let wanted = match args.variants {
        Some(Variants { last, .. }) if last > count => {
            let count = report::count(count as u64, "variant");
            return Err(Quit::Usage(format!("the sweep has {count}, so there is no number {last}")));
        }
        Some(Variants { first, last }) => first - 1..last,
        None => 0..count,
    };
    let set: Vec<&str> = args.set.iter().map(|(name, _)| name.as_str()).collect();
    if let Some(axis) = axes.iter().find(|axis| set.contains(&axis.name.as_str())) {
        return Err(Quit::Usage(format!("`{}` is both set and swept; leave one of them out", axis.name)));
    }
    if !args.preset.is_empty() && (args.preset.len() > 1 || axes.iter().any(|axis| axis.name == "preset")) {
        return Err(Quit::Usage("name one preset with --preset, or several with `--sweep preset=a,b`".into()));
    }
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let registry = library::registry();
    try_values(args, terminal, &registry)?;
    let (session, shared) = open::opened(registry, &args.engine, terminal)?;
    let told = Told { terminal, warnings: Mutex::default(), seen: Mutex::default() };
    let sweep = Sweep { args, terminal, session, cancel, count, wanted, told };
    let done = sweep.all();
    open::closed(shared, terminal);
    done
}

/// Loads the graph with the values of a variant.
fn graph(args: &RenderArgs, values: &[(&str, &str)], registry: &Registry, terminal: &Terminal) -> Result<Graph, Quit> {
    let mut set = args.set.clone();
    let mut preset = args.preset.first().cloned();
    for (name, value) in values {
        if *name == "preset" {
            preset = Some((*value).to_owned());
        } else {
            set.push(((*name).to_owned(), (*value).to_owned()));
        }
    }
    let loaded = open::load(&args.graph, registry, &ValueArgs { set, preset, newest: args.newest }, args.resolution);
    let mut graph = match loaded.graph {
        Some(graph) => graph,
        None => {
            report::show(terminal, &loaded.diagnostics, &loaded.sources);
            return Err(Quit::Shown);
        }
    };
    show_nodes(&mut graph, args)?;
    args.target.as_ref().map_or(Ok(()), |target| target.replace_outputs(&mut graph, !args.output.is_empty()))?;
    args.view.replace_outputs(&mut graph, registry, &args.output)?;
    Ok(graph)
}

/// Reports wrong names and values before hours of work: tries some values of each name, including the first and the
/// last. Shows warnings of the first variant only.
fn try_values(args: &RenderArgs, terminal: &Terminal, registry: &Registry) -> Result<(), Quit> {
    let first = axis::variant(&args.sweep, 0);
    let found = graph(args, &first, registry, terminal)?;
    report::show(terminal, &found.warnings, &found.sources);
    for (i, axis) in args.sweep.iter().enumerate() {
        let last = axis.values.len() - 1;
        let tried: BTreeSet<usize> = (0..TRIED).map(|n| last * n / (TRIED - 1)).filter(|n| *n > 0).collect();
        for n in tried {
            let mut values = first.clone();
            values[i].1 = &axis.values[n];
            graph(args, &values, registry, terminal)?;
        }
    }
    Ok(())
}

impl Sweep<'_> {
    fn all(&self) -> Result<(), Quit> {
        let args = self.args;
        let names: Vec<&str> = args.sweep.iter().map(|axis| axis.name.as_str()).collect();
        std::fs::create_dir_all(&args.out)
            .map_err(|e| Quit::failed(format!("cannot make the folder `{}`: {e}", args.out.display())))?;
        let mut table = Table::open(&args.out, &names, args.variants);
        let (mut made, mut known) = (0, 0);
        let mut keys = Vec::new();
        let progress = Progress::with(self.terminal, &args.progress);
        let begun = Instant::now();
        for number in self.wanted.clone() {
            let values = axis::variant(&args.sweep, number);
            let graph = graph(args, &values, self.session.registry(), self.terminal)?;
            let files = self.files(&graph, &values)?;
            keys.extend(files.iter().flat_map(|(_, key)| key.bytes()));
            if files.iter().all(|(file, key)| table.has(file, key)) {
                files.iter().for_each(|(file, _)| table.keep(file));
                known += 1;
            } else {
                let seconds = self.render(&graph, &values)?;
                table.add(&files, &values, seconds)?;
                made += 1;
                self.say(&values, files.len(), (number + 1, made), begun.elapsed());
            }
            let done = number + 1 - self.wanted.start;
            progress.of_all(done as u64, self.wanted.len() as u64, "variants");
        }
        progress.finish();
        table.finish()?;
        if !args.progress.quiet {
            let list = table.path().display();
            let (made, were) = (report::count(made as u64, "variant"), if known == 1 { "was" } else { "were" });
            self.terminal.say(&format!("{made} rendered, {known} {were} there already; {list} lists them"));
        }
        args.sheet.as_ref().map_or(Ok(()), |path| self.sheet(path, &Key::of("sheet 2", &[&keys]).to_string()))
    }

    fn say(&self, values: &[(&str, &str)], files: usize, (number, made): (usize, usize), took: Duration) {
        if !self.args.progress.quiet {
            let left = took.as_secs_f64() / made as f64 * (self.wanted.end - number) as f64;
            let (count, label, files) = (self.count, label(values), report::count(files as u64, "file"));
            self.terminal.say(&format!("{number}/{count} {label}: wrote {files}; about {} left", time(left)));
        }
    }

    /// Files of a variant, and the keys of their content.
    fn files(&self, graph: &Graph, values: &[(&str, &str)]) -> Result<Vec<(PathBuf, String)>, Quit> {
        let request = request_of(self.args, graph, (&self.args.out, axis::prefix(values)), false);
        let files = self.session.files(graph, &request, &self.cancel, &Silent);
        let files = files.map_err(|failure| self.failed(failure, graph))?;
        Ok(files.into_iter().map(|(path, key)| (path, key.to_string())).collect())
    }

    /// Renders a variant; returns the seconds taken.
    fn render(&self, graph: &Graph, values: &[(&str, &str)]) -> Result<f64, Quit> {
        let request = request_of(self.args, graph, (&self.args.out, axis::prefix(values)), false);
        let start = Instant::now();
        let done = self.session.render(graph, &request, &self.cancel, &self.told);
        self.told.show(graph);
        done.map_err(|failure| self.failed(failure, graph))?;
        Ok(start.elapsed().as_secs_f64())
    }

    fn failed(&self, failure: Failure, graph: &Graph) -> Quit {
        if failure == Failure::Cancelled {
            return Quit::failed("interrupted; the same command goes on from here");
        }
        open::failed(failure, &graph.sources, self.terminal)
    }

    /// Makes the contact sheet unless it exists.
    fn sheet(&self, path: &std::path::Path, key: &str) -> Result<(), Quit> {
        let path = sheet::path(path, &self.args.out);
        if sheet::is_there(&path, key) {
            return Ok(());
        }
        let layout = Layout::of(&self.args.sweep, self.count, label);
        let matrix = matches!(layout, Layout::Matrix { .. });
        let mut sheet = Sheet::create(&path, layout, key)?;
        for number in 0..self.count {
            let values = axis::variant(&self.args.sweep, number);
            let graph = graph(self.args, &values, self.session.registry(), self.terminal)?;
            let tile = self.small(&graph).map_err(|failure| self.failed(failure, &graph))?;
            // In a matrix, the labels of row and column give the values.
            sheet.add(tile, if matrix { String::new() } else { label(&values) })?;
        }
        sheet.finish()?;
        if !self.args.progress.quiet {
            self.terminal.say(&format!("wrote {}", path.display()));
        }
        Ok(())
    }

    /// Small picture of a variant: the first coloured output, or the colour of a material.
    fn small(&self, graph: &Graph) -> Result<Option<Tile>, Failure> {
        let named = |name: &str| {
            self.args.output.iter().any(|wanted| wanted == name || wanted.starts_with(&format!("{name}.")))
        };
        let wanted: Vec<_> = graph.outputs.iter().filter(|o| self.args.output.is_empty() || named(&o.name)).collect();
        let of = |ty: Type| wanted.iter().find(|output| output.ty == ty).copied();
        let Some(output) = of(Type::Rgb).or_else(|| of(Type::Material)).or_else(|| wanted.first().copied()) else {
            return Ok(None);
        };
        let value = self.session.value(graph, (output.node, output.output), &self.cancel, &Silent)?;
        let field = match &value {
            Value::Material(material) => Some(material.or_default(Channel::BaseColor)),
            value => value.field(),
        };
        let Some(field) = field.map(|field| field.to_rgb()) else { return Ok(None) };
        let pixels = Resolution::Longer(sheet::SIDE).of(graph.canvas.size_mm);
        let wanted = [(graph.canvas.grid(pixels), Window::full(pixels))];
        let (mut tiles, _) = self.session.rasters(graph, &field, &wanted, &self.cancel, &Silent)?;
        Ok(tiles.pop())
    }
}

/// Label of a variant.
fn label(values: &[(&str, &str)]) -> String {
    values.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

fn time(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
