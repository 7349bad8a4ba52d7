//! `shibo fit --among`: ranks shipped graphs by the distance of their presets from a photograph, and fits the nearest ones.
use super::progress::Progress;
use super::{FitArgs, photo, quit, session};
use crate::check::FormatArg;
use crate::interrupt;
use crate::library;
use crate::quit::Quit;
use crate::terminal::Terminal;
use serde_json::{Value as Json, json};
use shibo_bridge::{GraphText, Tools};
use shibo_engine::eval::CancelToken;
use shibo_fit::graph::{Bench, Fitting, Photo, Refused, Request};
use shibo_graph::{Graph, LoadOptions};
use shibo_value::diagnostics::did_you_mean;
use std::path::PathBuf;

/// Rows of the table.
const ROWS: usize = 10;
/// Graphs that are fitted.
const FITTED: usize = 3;
/// Renders of each fit, if `--renders` is not given.
const RENDERS: u32 = 60;
/// The family of graphs that show methods and are no materials.
const STUDY: &str = "study";

/// A graph at the preset that is nearest to the photograph.
struct Row {
    graph: &'static str,
    preset: Option<String>,
    distance: f64,
}

/// Runs the command.
pub(super) fn run(args: &FitArgs, request: &Request, tools: &Tools, terminal: &Terminal) -> Result<(), Quit> {
    let graphs = chosen(&args.among)?;
    let photo = photo(args, terminal)?;
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let session = session(args, tools)?;
    let bench = Bench { tools, session: &session, cancel: &cancel };
    let progress = Progress::new(args, terminal);
    let mut request = Request { renders: request.renders.or(Some(RENDERS)), ..request.clone() };
    // Presets are compared in the light of the graph: its direction is found by the fits.
    let (mut rows, mut refused) = (Vec::new(), Vec::new());
    for (at, graph) in graphs.iter().enumerate() {
        progress.show(&format!("{} of {} graphs: {}", at + 1, graphs.len(), graph.name));
        match ranked(bench, graph, &photo, &request) {
            Ok(row) => rows.push(row),
            Err(Refused::Cancelled) => return Err(quit(Refused::Cancelled, terminal)),
            Err(reason) => refused.push((graph.name, why(reason))),
        }
    }
    rows.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    if rows.is_empty() {
        let reason = refused.first().map(|(name, why)| format!(": `{name}`: {why}")).unwrap_or_default();
        return Err(Quit::failed(format!("no graph can be compared with the photograph{reason}")));
    }
    let mut fits = Vec::new();
    for row in rows.iter().take(FITTED) {
        let (file, graph) = opened(bench, row.graph).map_err(|refused| quit(refused, terminal))?;
        request.preset.clone_from(&super::request(args).preset);
        let fitting = Fitting::of(bench, &file, &graph, &photo, &request).map_err(|refused| quit(refused, terminal))?;
        match fitting.run(&|done, status| progress.tell(done, status)) {
            Ok(fitted) => fits.push((row, fitted.json(), fitted.preset().lines())),
            Err(Refused::Cancelled) => break,
            Err(refused) => terminal.warning(&format!("`{}`: {}", row.graph, why(refused))),
        }
        if cancel.is_cancelled() {
            break;
        }
    }
    progress.finish();
    match args.format {
        FormatArg::Json => {
            let ranking: Vec<Json> = rows
                .iter()
                .map(|row| json!({ "graph": row.graph, "preset": row.preset, "distance": row.distance }))
                .collect();
            let fits: Vec<Json> = fits.iter().map(|(row, fit, _)| json!({ "graph": row.graph, "fit": fit })).collect();
            let refused: Vec<Json> =
                refused.iter().map(|(name, why)| json!({ "graph": name, "reason": why })).collect();
            terminal.json(&json!({ "ranking": ranking, "fits": fits, "refused": refused }))?;
        }
        FormatArg::Human => terminal.data(&page(args, &rows, &fits, &refused))?,
    }
    if cancel.is_cancelled() { Err(Quit::Interrupted) } else { Ok(()) }
}

/// The shipped graphs of these names and families.
fn chosen(names: &[String]) -> Result<Vec<library::Graph>, Quit> {
    let all: Vec<library::Graph> = library::graphs().into_iter().filter(|graph| !graph.is_part()).collect();
    let family = |graph: &library::Graph| graph.family().unwrap_or_default();
    let is_family = |name: &str| all.iter().any(|graph| family(graph) == name);
    let is_graph = |name: &str| all.iter().any(|graph| graph.name == name);
    // A family comes before a graph of the same name, and a graph before a word of a family.
    let is_of = |graph: &library::Graph, name: &str| match name {
        _ if is_family(name) => family(graph) == name,
        _ if is_graph(name) => graph.name == name,
        _ => family(graph).split(" and ").any(|word| word == name),
    };
    for name in names.iter().filter(|name| *name != "all") {
        if all.iter().any(|graph| is_of(graph, name)) {
            continue;
        }
        let mut families: Vec<&str> = all.iter().filter_map(library::Graph::family).collect();
        families.sort_unstable();
        families.dedup();
        let known = all.iter().map(|graph| graph.name).chain(families.iter().copied());
        let help = did_you_mean(name, known).map_or_else(
            || format!("the families are: {}", families.join(", ")),
            |near| format!("did you mean `{near}`?"),
        );
        return Err(Quit::Usage(format!("no shipped graph or family is called `{name}`; {help}")));
    }
    let wanted = |graph: &library::Graph| {
        names.iter().any(|name| is_of(graph, name) || (name == "all" && graph.family() != Some(STUDY)))
    };
    Ok(all.iter().filter(|graph| wanted(graph)).copied().collect())
}

/// A shipped graph and its text.
fn opened(bench: Bench<'_>, name: &str) -> Result<(GraphText, Graph), Refused> {
    let path = PathBuf::from(format!("shibo:{name}"));
    let loaded = shibo_graph::load(&path, bench.session.registry(), &LoadOptions::default());
    let text = loaded.sources.text(shibo_value::diagnostics::FileId(0)).to_string();
    match loaded.graph {
        Some(graph) => Ok((GraphText { path: graph.path.clone(), text }, graph)),
        None => Err(Refused::Graph(shibo_engine::session::Failure::Errors(loaded.diagnostics), loaded.sources)),
    }
}

/// The nearest preset of a graph.
fn ranked(bench: Bench<'_>, of: &library::Graph, photo: &Photo, request: &Request) -> Result<Row, Refused> {
    let (file, graph) = opened(bench, of.name)?;
    let fitting = Fitting::of(bench, &file, &graph, photo, request)?;
    let starts = fitting.starts(&|_, _| {})?;
    let near = starts.into_iter().filter_map(|(preset, distance)| Some((preset, distance?)));
    let (preset, distance) = near
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or_else(|| Refused::Unfit("all presets are refused at this size of the canvas".to_owned()))?;
    Ok(Row { graph: of.name, preset: preset.map(ToOwned::to_owned), distance })
}

/// The reason why a graph is left out, on one line.
fn why(refused: Refused) -> String {
    match refused {
        Refused::Usage(message) | Refused::Unfit(message) => message,
        Refused::Graph(failure, _) => failure.to_string(),
        Refused::Cancelled => "cancelled".to_owned(),
    }
}

/// The table, and the fits.
fn page(args: &FitArgs, rows: &[Row], fits: &[(&Row, Json, String)], refused: &[(&str, String)]) -> String {
    let width = rows.iter().take(ROWS).map(|row| row.graph.len()).max().unwrap_or(0).max(5);
    let mut page = format!("{:width$}  nearest preset    distance   fitted\n", "graph");
    for row in rows.iter().take(ROWS) {
        let preset = row.preset.as_deref().unwrap_or("(as it is)");
        page += &format!("{:width$}  {preset:16}  {:8.2}", row.graph, row.distance);
        if let Some((_, fit, _)) = fits.iter().find(|(fitted, ..)| fitted.graph == row.graph) {
            let distance = fit["distance"].as_f64().unwrap_or_default();
            page += &format!("   {distance:.2}");
            if let Some(floor) = fit["floor"].as_f64().filter(|floor| *floor > 0.0) {
                page += &format!(" ({:.1} × the floor)", distance / floor);
            }
        }
        page += "\n";
    }
    if rows.len() > ROWS {
        page += &format!("and {} more\n", rows.len() - ROWS);
    }
    for (name, why) in refused {
        page += &format!("{name}: left out: {why}\n");
    }
    let distance = |fit: &Json| fit["distance"].as_f64().unwrap_or(f64::INFINITY);
    if let Some((row, _, lines)) = fits.iter().min_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1))) {
        let photo = args.photo.display();
        page += &format!(
            "\n{} comes nearest, at the preset\n{lines}\n`shibo fit GRAPH {photo}` with a copy of it finds better values\n",
            row.graph
        );
    }
    page
}
