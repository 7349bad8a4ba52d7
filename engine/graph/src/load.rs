//! Loads a graph: all steps, in order.
use super::calls;
use super::canvas::{self, Asked};
use super::command_line::{check_preset, resolution, seed, set};
use super::defaults;
use super::document::NodeDecl;
use super::each;
use super::files::{Doc, Files};
use super::linker::Linker;
use super::params::{Facts, ParamDecl, Params};
use super::part::{Shape, SyntaxValue};
use super::presets::presets;
use super::read;
use super::report::Report;
use super::subst::is_driven;
use super::{Graph, GraphParam, LoadOptions, Loaded};
use crate::diagnostics::{Code, Diagnostic, FileId, SourceMap, Span};
use crate::picture::contained;
use crate::registry::Registry;
use crate::value::Canvas;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Loads the graph file at `path` and all its imports.
pub fn load(path: &Path, registry: &Registry, options: &LoadOptions) -> Loaded {
    run(path, None, registry, options)
}

/// Loads a graph from `text` instead of the content of the file, which need not exist.
pub fn load_text(path: &Path, text: &str, registry: &Registry, options: &LoadOptions) -> Loaded {
    run(path, Some(text.to_owned()), registry, options)
}

/// Loads a graph. A panic is a defect of the program and is reported as an error in the file.
fn run(path: &Path, text: Option<String>, registry: &Registry, options: &LoadOptions) -> Loaded {
    contained(|| whole(path, text.clone(), registry, options)).unwrap_or_else(|said| {
        let mut sources = SourceMap::default();
        let file = sources.add(path, text.unwrap_or_default());
        let message = format!("this graph cannot be read, because of a defect: {said}");
        let error = Diagnostic::new(Code::BadValue, Span { file, start: 0, end: 0 }, message);
        let diagnostics = vec![error.help("please report it with the graph")];
        Loaded { graph: None, diagnostics, sources, files: vec![path.to_owned()] }
    })
}

fn whole(path: &Path, text: Option<String>, registry: &Registry, options: &LoadOptions) -> Loaded {
    let mut files = Files::new(options, registry.library());
    let graph = files.read_main(path, text).and_then(|main| link(main, &mut files, registry, options));
    let errors = files.report.errors();
    let is_cancelled = options.cancel.is_cancelled();
    let diagnostics = if is_cancelled { Vec::new() } else { files.report.finish() };
    let graph = graph.filter(|_| errors == 0 && !is_cancelled).map(|mut graph| {
        graph.sources = files.sources.clone();
        graph.warnings.clone_from(&diagnostics);
        graph
    });
    let mut looked_at = files.looked_at;
    let mut seen = std::collections::BTreeSet::new();
    looked_at.retain(|path| seen.insert(path.clone()));
    Loaded { graph, diagnostics, sources: files.sources, files: looked_at }
}

/// Links the main graph, then each import by itself, so that unused graphs are checked too.
fn link(main: usize, files: &mut Files<'_>, registry: &Registry, options: &LoadOptions) -> Option<Graph> {
    if options.newest {
        files.docs.iter_mut().for_each(|doc| doc.document.pins = None);
    }
    for pins in files.docs.iter().filter_map(|doc| doc.document.pins.as_ref()) {
        pins.check(registry, &mut files.report);
    }
    let calls = calls::of_all(&files.docs);
    files.docs.iter_mut().zip(calls).for_each(|(doc, calls)| doc.calls = calls);
    let sizes = sizes(&files.docs, options.limits.max_nodes, &mut files.report);
    if !files.docs[main].readable {
        link_imports(main, files, registry, &sizes, 0);
        return None;
    }
    let doc = &files.docs[main];
    let mut params = defaults::params(doc, None, &mut files.report);
    for (name, value) in presets(doc, options.preset.as_deref(), &mut files.report) {
        params.give(name, value);
    }
    check_preset(doc, options, &mut files.sources, &mut files.report);
    let settings = set(doc, options, &mut params, &mut files.sources, &mut files.report);
    let seed = seed(doc, options, &mut files.sources, &mut files.report);
    let (mut canvas, asked) = canvas_of(doc, seed, &mut params, &mut files.report);
    let typed = resolution(options, &mut files.sources, &mut files.report);
    canvas::resize(&mut canvas, typed.as_ref().unwrap_or(&asked), typed.is_some(), &mut files.report);
    let mut linked = None;
    let mut instances = 0;
    if sizes[main].is_some() {
        let mut linker = linker(files, registry, &sizes, canvas, 0);
        (linker.settings, linker.working_dir) = (&settings, &options.working_dir);
        linker.declare(main, String::new(), params.clone(), None);
        linker.fill(0, &[]);
        linker.check_settings();
        linker.link();
        if linker.cancel.is_cancelled() {
            return None;
        }
        let outputs = linker.outputs(true);
        instances = linker.scopes.len();
        if linker.report.errors() == 0 {
            let (uses, calls) = (linker.uses(), linker.calls());
            linked = linker.into_nodes().map(|nodes| (nodes, outputs, uses, calls));
        }
    }
    link_imports(main, files, registry, &sizes, instances);
    let (nodes, outputs, uses, calls) = linked?;
    let doc = &files.docs[main];
    let start = Span { file: FileId(0), start: 0, end: 0 };
    Some(Graph {
        path: doc.path.clone(),
        family: doc.document.family.clone(),
        sources: SourceMap::default(),
        canvas,
        nodes,
        outputs,
        uses,
        calls,
        params: graph_params(doc, &params),
        presets: doc.document.presets.iter().map(|(entry, _)| entry.name.clone()).collect(),
        warnings: Vec::new(),
        canvas_span: doc.document.canvas.as_ref().map_or(start, SyntaxValue::span),
        imports: imports(&files.docs),
    })
}

/// The places of all imports, and the imported files.
fn imports(docs: &[Doc]) -> Vec<(Span, PathBuf)> {
    let of = |doc: &Doc| {
        let meant = doc.imports.iter().map(|import| docs.get((*import)?).map(|other| other.path.clone()));
        let pairs = doc.document.imports.iter().zip(meant.collect::<Vec<_>>());
        pairs.filter_map(|(entry, path)| Some((entry.value.span(), path?))).collect::<Vec<_>>()
    };
    docs.iter().flat_map(of).collect()
}

/// The canvas, with `seed` if given, and then the parameters that depend on it.
fn canvas_of(doc: &Doc, seed: Option<u64>, params: &mut Params, report: &mut Report) -> (Canvas, Asked) {
    let mut before = params.clone();
    defaults::follow(doc, &mut before, &mut Report::default());
    let (mut canvas, asked) = canvas::read(doc.document.canvas.as_ref(), &before, report);
    canvas.seed = seed.unwrap_or(canvas.seed);
    defaults::settle(doc, params, Facts::of(&canvas), report);
    (canvas, asked)
}

fn linker<'a>(
    files: &'a mut Files<'_>,
    registry: &'a Registry,
    sizes: &'a [Option<usize>],
    canvas: Canvas,
    first_instance: usize,
) -> Linker<'a> {
    Linker {
        registry,
        docs: &files.docs,
        sizes,
        report: &mut files.report,
        looked_at: &mut files.looked_at,
        file_checks: &mut files.file_checks,
        gate: files.gate,
        cancel: files.cancel,
        canvas,
        settings: &[],
        working_dir: Path::new(""),
        scopes: Vec::new(),
        inlines: BTreeMap::new(),
        flats: Vec::new(),
        checks: Vec::new(),
        laid: BTreeMap::new(),
        selected: BTreeMap::new(),
        choosers: Vec::new(),
        chosen: BTreeMap::new(),
        first_instance,
        defaults: BTreeMap::new(),
    }
}

fn link_imports(
    main: usize,
    files: &mut Files<'_>,
    registry: &Registry,
    sizes: &[Option<usize>],
    mut instances: usize,
) {
    for index in 0..files.docs.len() {
        if files.cancel.is_cancelled() {
            return;
        }
        let doc = &files.docs[index];
        if index == main || !doc.readable || sizes[index].is_none() {
            continue;
        }
        files.report.enter(instances, None);
        let mut params = defaults::params(doc, None, &mut files.report);
        presets(doc, None, &mut files.report);
        let (canvas, _) = canvas_of(doc, None, &mut params, &mut files.report);
        let mut linker = linker(files, registry, sizes, canvas, instances);
        linker.declare(index, String::new(), params, None);
        linker.fill(0, &[]);
        linker.link();
        if linker.cancel.is_cancelled() {
            return;
        }
        linker.outputs(false);
        instances += linker.scopes.len();
    }
}

/// The number of nodes of each document including its sub-graphs; `None`, and an error, if there are too many.
fn sizes(docs: &[Doc], limit: usize, report: &mut Report) -> Vec<Option<usize>> {
    let mut sizes = Vec::with_capacity(docs.len());
    // An imported file precedes the files that import it.
    for doc in docs {
        let size = size(doc, docs, &sizes, limit, report);
        sizes.push(size);
    }
    sizes
}

fn size(doc: &Doc, docs: &[Doc], sizes: &[Option<usize>], limit: usize, report: &mut Report) -> Option<usize> {
    let mut total = 0_usize;
    for node in &doc.document.nodes {
        let graph = match &node.kind {
            Some(kind) if matches!(kind.str(), "Use" | each::KIND) => {
                node.args.as_deref().and_then(|args| read::get(args, "graph"))
            }
            _ => None,
        };
        let index = graph.and_then(|graph| match graph.shape() {
            Shape::Text(name) => doc.document.import(&name),
            _ => None,
        });
        let used = index.and_then(|index| *doc.imports.get(index)?);
        let document = used.and_then(|used| docs.get(used)).map(|used| &used.document);
        // Each input may need a conversion, and each output a layout node.
        let laid_out = node.args.as_deref().is_some_and(|args| read::get(args, "canvas").is_some());
        let inputs = document.map_or(0, |used| used.inputs.len() + if laid_out { used.outputs.len() } else { 0 });
        let nodes = match used.and_then(|used| sizes.get(used)) {
            // A graph that uses a too large graph is too large itself; report only the first.
            Some(None) => return None,
            Some(Some(nodes)) => copies(node).saturating_mul(*nodes + inputs).max(1),
            None => 1,
        };
        // Every word with brackets among the values may be a node without a name.
        let nodes = nodes + node.args.iter().flatten().map(|arg| arg.value.calls()).sum::<usize>();
        total = total.saturating_add(nodes);
        if total > limit {
            let message = format!("the graph has more than {limit} nodes, those of its sub-graphs included");
            let place = graph.or(doc.document.nodes_part.as_ref())?;
            report.push(place.error(Code::TooLarge, message));
            return None;
        }
    }
    Some(total)
}

/// The most instances of a sub-graph that a node makes.
fn copies(node: &NodeDecl) -> usize {
    if node.kind.as_ref().is_none_or(|kind| kind.str() != each::KIND) {
        return 1;
    }
    let over = node.args.as_deref().and_then(|args| read::get(args, "over")).map(SyntaxValue::shape);
    let written = (1..=each::MOST).find(|n| matches!(over, Some(Shape::Number(over)) if over == *n as f64));
    written.unwrap_or(each::MOST) + 1
}

fn graph_params(doc: &Doc, params: &Params) -> Vec<GraphParam> {
    let decls = doc.document.params.iter().filter_map(|(_, decl)| decl.as_ref());
    let param = |decl: &ParamDecl| {
        let value = params.get(&decl.name).flatten()?;
        let default = params.default_of(&decl.name).filter(|_| is_driven(&decl.default));
        Some(GraphParam {
            name: decl.name.clone(),
            ty: decl.ty.name(),
            value: value.text.clone(),
            default: default.map_or(decl.default.str(), |value| &value.text).to_owned(),
            range: decl.range,
            unit: decl.unit.clone(),
            group: decl.group.clone(),
            doc: decl.doc.clone(),
            options: decl.options.clone(),
            span: decl.default.span(),
        })
    };
    decls.filter_map(param).collect()
}

impl Loaded {
    /// Returns true if there is an error, and thus no graph.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|diagnostic| !diagnostic.warning)
    }
}
