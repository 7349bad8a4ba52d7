//! A graph file as written: its sections by name, each with its place. Names are not resolved yet.
use super::exports;
use super::formula_text::FormulaText;
use super::functions::{self, FunctionDecl};
use super::output_decl::OutputDecl;
use super::params::{self, Callable, ParamDecl};
use super::part::{Entry, Shape, SyntaxValue};
use super::pins::Pins;
use super::read::{self, choice, mismatch, shorten};
use super::report::Report;
use super::schema;
use super::storage::{self, Storage};
use crate::diagnostics::Code;
use crate::export::{TARGETS, target_named};
use crate::picture::{Depth, Format};
use crate::value::{Accepts, Type};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The beginning of messages about the form and the sections of a file. Such an error hides the errors of a whole section.
pub const GRAPH_FILE: &str = "a graph file";
/// The message of the error about a graph without nodes.
pub const NO_NODES: &str = "the graph has no `nodes`";

/// A graph file as written.
#[derive(Debug, Default)]
pub(super) struct Document {
    /// `pins`; `None` after an error, too.
    pub(super) pins: Option<Pins>,
    /// `family`.
    pub(super) family: Option<String>,
    /// `canvas`.
    pub(super) canvas: Option<SyntaxValue>,
    /// `imports`: names and paths.
    pub(super) imports: Vec<Entry>,
    /// `params`; the declarations in error are `None`.
    pub(super) params: Vec<(Entry, Option<ParamDecl>)>,
    /// `presets`.
    pub(super) presets: Vec<(Entry, Vec<Entry>)>,
    /// `inputs`.
    pub(super) inputs: Vec<InputDecl>,
    /// `nodes`.
    pub(super) nodes: Vec<NodeDecl>,
    /// `outputs`.
    pub(super) outputs: Vec<OutputDecl>,
    /// `functions`, and for a local graph those of its file.
    pub(super) functions: Arc<Vec<FunctionDecl>>,
    /// True for a graph that is defined in a file.
    pub(super) is_local: bool,
    /// The functions that formulas in its parameters call.
    pub(super) callable: Arc<Callable>,
    /// The values of all fields except `graphs`.
    pub(super) values: Vec<SyntaxValue>,
    /// `graphs`: names, and the graphs defined in the file; taken out once they have an index of their own.
    pub(super) graphs: Vec<(Entry, Document)>,
    /// The place of `nodes`.
    pub(super) nodes_part: Option<SyntaxValue>,
    /// The graphs that nodes may use: imports, then graphs of the file.
    usable: Names,
    param_names: Names,
    input_names: Names,
    output_names: Names,
}

/// The index of each name in a list.
#[derive(Clone, Debug, Default)]
struct Names(BTreeMap<String, usize>);

impl Names {
    fn of<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let mut first = BTreeMap::new();
        for (index, name) in names.enumerate() {
            first.entry(name.to_owned()).or_insert(index);
        }
        Self(first)
    }
}

/// An input of a sub-graph.
#[derive(Debug)]
pub(super) struct InputDecl {
    pub(super) name: String,
    pub(super) kind: SyntaxValue,
    /// `None` after an error.
    pub(super) ty: Option<Accepts>,
    pub(super) default: Option<SyntaxValue>,
}

/// A node as written.
#[derive(Debug)]
pub(super) struct NodeDecl {
    pub(super) name: String,
    /// The kind word.
    pub(super) kind: Option<SyntaxValue>,
    /// Its arguments; `None` after an error.
    pub(super) args: Option<Vec<Entry>>,
    /// The text of a formula in place of a kind and its arguments.
    pub(super) formula: Option<SyntaxValue>,
    /// References to its name mean this node; false for the second node of the same name.
    pub(super) named: bool,
}

impl Document {
    /// Reads a document from the value of a whole text.
    pub(super) fn read(whole: &SyntaxValue, report: &mut Report) -> Self {
        let Some(fields) = read::fields(whole, GRAPH_FILE, schema::ROOT, report) else { return Self::default() };
        let mut document = Self::of_fields(whole, &fields, report);
        let graphs = read::get(&fields, "graphs").map(|part| read::map(part, "graphs", report)).unwrap_or_default();
        for entry in read::unique(graphs, "graph", report) {
            read::check_name(&entry.key, &entry.name, "a graph", report);
            if let Some(import) = document.imports.iter().find(|import| import.name == entry.name) {
                let message = format!("`{}` is already the name of an import", shorten(&entry.name));
                let error = entry.key.error(Code::DuplicateKey, message);
                report
                    .push(error.related(import.key.span(), "the import is here").help("give one of them another name"));
                continue;
            }
            let what = format!("graph `{}`", shorten(&entry.name));
            if let Some(fields) = read::fields(&entry.value, &what, schema::LOCAL, report) {
                let local = Self::of_fields(&entry.value, &fields, report);
                document.graphs.push((entry, local));
            }
        }
        document
    }

    /// Reads the sections of a graph.
    fn of_fields(whole: &SyntaxValue, fields: &[Entry], report: &mut Report) -> Self {
        if let Some(version) = read::get(fields, "version") {
            check_version(version, report);
        }
        let pins = read::get(fields, "pins").and_then(|part| Pins::read(part, report));
        let section = |name: &str, report: &mut Report| {
            read::get(fields, name).map(|part| read::map(part, name, report)).unwrap_or_default()
        };
        let unique = |name: &str, one: &str, report: &mut Report| read::unique(section(name, report), one, report);
        let mut document = Self {
            canvas: read::get(fields, "canvas").cloned(),
            pins,
            family: read::get(fields, "family").and_then(|part| family(part, report)),
            nodes_part: read::get(fields, "nodes").cloned(),
            values: fields.iter().filter(|field| field.name != "graphs").map(|field| field.value.clone()).collect(),
            ..Self::default()
        };
        document.imports = unique("imports", "import", report);
        for import in &document.imports {
            read::check_name(&import.key, &import.name, "an import", report);
        }
        for entry in unique("params", "param", report) {
            let decl = params::declare(&entry, report);
            document.params.push((entry, decl));
        }
        for entry in unique("presets", "preset", report) {
            let values = read::unique(read::map(&entry.value, "presets", report), "parameter", report);
            document.presets.push((entry, values));
        }
        document.inputs = unique("inputs", "input", report).iter().map(|entry| input(entry, report)).collect();
        document.read_nodes(section("nodes", report), report);
        document.outputs = unique("outputs", "output", report).iter().map(|entry| output(entry, report)).collect();
        let mut functions = section("functions", report);
        // The check of a function follows all calls.
        read::at_most(&mut functions, functions::MOST_OF_FILE, |entry| &entry.key, "functions", report);
        document.functions = Arc::new(functions.iter().filter_map(|entry| functions::declare(entry, report)).collect());
        document.usable = Names::of(document.imports.iter().map(|entry| entry.name.as_str()));
        document.param_names = Names::of(document.params.iter().map(|(entry, _)| entry.name.as_str()));
        document.input_names = Names::of(document.inputs.iter().map(|input| input.name.as_str()));
        document.output_names = Names::of(document.outputs.iter().map(|output| output.name.as_str()));
        if document.nodes_part.is_none() {
            let start = whole.sub_span(0, whole.str().chars().next().map_or(0, char::len_utf8));
            let diagnostic = crate::diagnostics::Diagnostic::new(Code::MissingInput, start, NO_NODES);
            report.push(diagnostic.help("write `nodes: { \"name\": Kind() }`"));
        }
        document
    }

    /// The index of the import or the local graph of that name.
    pub(super) fn import(&self, name: &str) -> Option<usize> {
        self.usable.0.get(name).copied()
    }

    /// The names of imports and local graphs.
    pub(super) fn usable(&self) -> impl Iterator<Item = &str> {
        self.usable.0.keys().map(String::as_str)
    }

    /// Makes a local graph usable; `index` is its place after the imports.
    pub(super) fn make_usable(&mut self, name: &str, index: usize) {
        self.usable.0.insert(name.to_owned(), index);
    }

    /// Gives a local graph what its file has so far: graphs to use, and functions.
    pub(super) fn inherit(&mut self, file: &Self) {
        self.usable = file.usable.clone();
        self.functions = file.functions.clone();
        self.is_local = true;
        self.callable = file.callable.clone();
    }

    /// The index of the input of that name.
    pub(super) fn input(&self, name: &str) -> Option<usize> {
        self.input_names.0.get(name).copied()
    }

    /// The output of that name.
    pub(super) fn output(&self, name: &str) -> Option<&OutputDecl> {
        self.output_names.0.get(name).and_then(|index| self.outputs.get(*index))
    }

    /// The parameter of that name, if there is one; its declaration is `None` after an error.
    pub(super) fn param(&self, name: &str) -> Option<Option<&ParamDecl>> {
        let index = self.param_names.0.get(name)?;
        self.params.get(*index).map(|(_, decl)| decl.as_ref())
    }

    fn read_nodes(&mut self, entries: Vec<Entry>, report: &mut Report) {
        let mut first = BTreeMap::new();
        for input in &self.inputs {
            first.insert(input.name.clone(), input.kind.span());
        }
        for entry in entries {
            read::check_name(&entry.key, &entry.name, "a node", report);
            let named = !first.contains_key(&entry.name);
            if let Some(span) = first.get(&entry.name) {
                let message = format!("node `{}` is given twice", shorten(&entry.name));
                let error = entry.key.error(Code::DuplicateKey, message).related(*span, "it is given here first");
                report.push(error.help("give one of them another name"));
            } else {
                first.insert(entry.name.clone(), entry.key.span());
            }
            self.nodes.push(node(&entry, named, report));
        }
    }
}

fn check_version(part: &SyntaxValue, report: &mut Report) {
    match part.shape() {
        Shape::Number(1.0) => {}
        Shape::Number(_) => {
            let message = format!("version is `{}`; this program reads version 1", shorten(part.str()));
            let help = "a newer file needs a newer program";
            report.push(part.error(Code::UnknownVersion, message).help(help));
        }
        _ => report.push(mismatch(part, "`version`", "the number 1")),
    }
}

/// The most characters of a family.
const MOST_FAMILY: usize = 40;

/// The family of a graph: words in lower case.
fn family(part: &SyntaxValue, report: &mut Report) -> Option<String> {
    let name = read::text(part, "family", report)?;
    let good = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
    if name.len() <= MOST_FAMILY && name.split(' ').all(good) {
        return Some(name);
    }
    let message = format!("`{}` cannot be the name of a family", shorten(&name));
    let help = format!("a family is words of the letters a to z, at most {MOST_FAMILY} characters: `\"stone\"`");
    report.push(part.error(Code::BadName, message).help(help));
    None
}

/// A node, written as `Kind(field: value)` or as a formula.
pub(super) fn node(entry: &Entry, named: bool, report: &mut Report) -> NodeDecl {
    let mut decl = NodeDecl { name: entry.name.clone(), kind: None, args: None, formula: None, named };
    if FormulaText::of(&entry.value).is_some() {
        decl.formula = Some(entry.value.clone());
        decl.args = Some(Vec::new());
        return decl;
    }
    let Some((kind, body)) = entry.value.head() else {
        let forms = "a kind with its fields, `Kind(a: 1)`, or a formula, `\"= a + b\"`";
        let error = mismatch(&entry.value, &format!("node `{}`", entry.name), forms);
        report.push(match entry.value.shape() {
            Shape::Text(text) => error.help(format!("write `\"= {}\"` for the same value", shorten(&text))),
            _ => error,
        });
        return decl;
    };
    decl.args = match body.as_ref().map(SyntaxValue::shape) {
        None => Some(Vec::new()),
        Some(Shape::Named(args)) => Some(read::unique(args, "field", report)),
        Some(_) => {
            let body = body.as_ref().unwrap_or(&entry.value);
            let error = mismatch(body, &format!("`{}`", kind.str()), "given named fields, `Kind(name: value)`");
            report.push(error.help(format!("`shibo nodes {}` tells its fields", shorten(kind.str()))));
            None
        }
    };
    decl.kind = Some(kind);
    decl
}

fn input(entry: &Entry, report: &mut Report) -> InputDecl {
    read::check_name(&entry.key, &entry.name, "an input", report);
    let mut decl = InputDecl { name: entry.name.clone(), kind: entry.value.clone(), ty: None, default: None };
    let Some((word, body)) = entry.value.head() else {
        let what = format!("input `{}`", entry.name);
        report.push(mismatch(&entry.value, &what, "a type with a default, `Gray(default: 0.5)`"));
        return decl;
    };
    let Some(ty) = Accepts::from_name(word.str()) else {
        let names: Vec<_> = Accepts::all().map(Accepts::name).collect();
        let message = format!("there is no type `{}`", shorten(word.str()));
        report.unknown(word.error(Code::UnknownVariant, message), word.str(), "type", names);
        return decl;
    };
    let fields = match &body {
        Some(body) => match read::fields(body, &format!("input `{}`", entry.name), schema::INPUT, report) {
            Some(fields) => fields,
            None => return decl,
        },
        None => Vec::new(),
    };
    if let Some(doc) = read::get(&fields, "doc") {
        read::text(doc, "doc", report);
    }
    decl.default = read::get(&fields, "default").cloned();
    decl.kind = word.clone();
    decl.ty = Some(ty);
    // A material without channels serves as default; fields have no such default.
    if decl.default.is_none() && decl.ty != Some(Accepts::One(Type::Material)) {
        let message = format!("input `{}` has no `default`", entry.name);
        let help = "a graph with inputs must also run by itself: give a literal, or the name of a node as a stand-in";
        report.push(word.error(Code::MissingInput, message).help(help));
        decl.ty = None;
    }
    decl
}

fn output(entry: &Entry, report: &mut Report) -> OutputDecl {
    let mut decl = OutputDecl {
        name: entry.name.clone(),
        key: entry.key.clone(),
        from: None,
        format: None,
        depth: None,
        combined: false,
        range: None,
        storage: Storage::default(),
        export: None,
        mesh: None,
    };
    let body = match (entry.value.shape(), entry.value.head()) {
        (Shape::Text(_), _) => {
            decl.from = Some(entry.value.clone());
            return decl;
        }
        (_, Some((word, Some(body)))) if word.str() == "File" => (word, body),
        (_, Some((word, Some(body)))) if let Some(target) = target_named(word.str()) => {
            exports::read(&mut decl, &word, target, &body, report);
            return decl;
        }
        _ => {
            let what = format!("output `{}`", entry.name);
            let names: Vec<_> = TARGETS.iter().map(|target| target.info().name).collect();
            let (last, names) =
                names.split_last().map_or(("", String::new()), |(last, names)| (*last, names.join(", ")));
            let forms =
                format!("\"node\", \"node.port\", File(from: \"node\"), or for other programs {names} or {last}");
            let error = mismatch(&entry.value, &what, &forms);
            report.push(match entry.value.shape() {
                Shape::Word(word) => error.help(format!("write `\"{}\"`", shorten(&word))),
                _ => error,
            });
            return decl;
        }
    };
    let (word, body) = body;
    let Some(fields) = read::fields(&body, "`File`", schema::output("File"), report) else { return decl };
    decl.from = read::get(&fields, "from").filter(|from| read::text(from, "from", report).is_some()).cloned();
    if read::get(&fields, "from").is_none() {
        let help = "write `from: \"node\"`";
        report.push(word.error(Code::MissingInput, "`File` has no `from`").help(help));
    }
    let formats = Format::ALL.map(|format| (format.name(), format));
    let depths = Depth::ALL.map(|depth| (depth.name(), depth));
    decl.format = read::get(&fields, "format").and_then(|part| choice(part, "format", &formats, report));
    decl.depth = read::get(&fields, "depth").and_then(|part| choice(part, "depth", &depths, report));
    let combined = [("true", true), ("false", false)];
    decl.combined =
        read::get(&fields, "combined").and_then(|part| choice(part, "combined", &combined, report)).unwrap_or_default();
    decl.storage = storage::read(&fields, decl.format, report);
    if let Some(part) = read::get(&fields, "range") {
        let is_word = matches!(part.shape(), Shape::Word(_));
        decl.storage.fit = is_word && choice(part, "range", &[("Fit", true)], report).unwrap_or_default();
        decl.range = if is_word { None } else { params::range(part, report) };
    }
    if let (Some(format), Some(depth), Some(part)) = (decl.format, decl.depth, read::get(&fields, "depth")) {
        check_depth(format, depth, part, report);
    }
    decl
}

/// Checks that a format can hold the samples.
fn check_depth(format: Format, depth: Depth, part: &SyntaxValue, report: &mut Report) {
    let possible = format.depths();
    if !possible.contains(&depth) {
        let words: Vec<_> = possible.iter().map(|d| format!("`{d}`")).collect();
        let message = format!("`{format}` cannot hold `{depth}`");
        report.push(part.error(Code::BadValue, message).help(if words.is_empty() {
            "it holds lines; leave `depth` out".to_owned()
        } else {
            format!("depths of `{format}`: {}", words.join(", "))
        }));
    }
}
