//! Reads graph files and their imports.
use super::cancel::Cancel;
use super::document::Document;
use super::functions::{Call, FunctionDecl};
use super::gate::Gate;
use super::imports;
use super::params::Callable;
use super::part::{Entry, Src};
use super::read;
use super::report::Report;
use super::text_file::{Fault, read_text};
use super::{Limits, LoadOptions};
use crate::diagnostics::{Code, Diagnostic, FileId, Problem, SourceMap, Span};
use crate::node::DynNode;
use crate::registry::Library;
use crate::syntax::{NodeKind, Tree};
use crate::value::files::FileHandle;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A graph file that was read.
pub(super) struct Doc {
    /// Its path.
    pub(super) path: PathBuf,
    /// The content of the file.
    pub(super) document: Document,
    /// For each import and each local graph, its index; `None` after an error.
    pub(super) imports: Vec<Option<usize>>,
    /// The functions of shipped graphs that it calls, once all documents are read.
    pub(super) calls: Vec<Call>,
    /// The text is a graph, possibly with a few mistakes.
    pub(super) readable: bool,
    /// The text is valid RON.
    pub(super) sound: bool,
}

impl Doc {
    /// The folder that paths in it are relative to.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}

/// Checks of the files that nodes read. A picture used in many places is checked once.
#[derive(Default)]
pub(super) struct FileChecks {
    known: BTreeMap<(String, Vec<u8>, Vec<PathBuf>), Vec<Problem>>,
}

impl FileChecks {
    /// The problems with the files of a node of this kind.
    pub(super) fn of(&mut self, kind: &str, node: &dyn DynNode, files: &[(&'static str, FileHandle)]) -> &[Problem] {
        let paths = files.iter().map(|(_, file)| file.path().to_owned()).collect();
        let known = self.known.entry((kind.to_owned(), node.canonical(), paths));
        known.or_insert_with(|| node.check_files(files))
    }
}

/// All graph files of a run. An imported file precedes the files that import it.
pub(super) struct Files<'a> {
    pub(super) limits: &'a Limits,
    pub(super) sources: SourceMap,
    pub(super) report: Report,
    pub(super) docs: Vec<Doc>,
    /// All paths that were looked at.
    pub(super) looked_at: Vec<PathBuf>,
    pub(super) file_checks: FileChecks,
    /// The graphs that can be imported by name.
    library: Option<&'a dyn Library>,
    /// Texts that replace the content of files.
    overlay: BTreeMap<PathBuf, Arc<str>>,
    /// Additional folders for imports.
    paths: Vec<PathBuf>,
    /// Decides which files may be read.
    pub(super) gate: &'a Gate,
    pub(super) cancel: &'a Cancel,
    /// The index of each file; `None` while its imports are being read.
    by_path: BTreeMap<PathBuf, Option<usize>>,
}

/// Returns true for the text of a file `*.json` that is an object.
fn is_json(path: &Path, text: &str) -> bool {
    path.extension().is_some_and(|ending| ending == "json") && text.starts_with('{')
}

impl<'a> Files<'a> {
    /// Starts without files.
    pub(super) fn new(options: &'a LoadOptions, library: Option<&'a dyn Library>) -> Self {
        Self {
            limits: &options.limits,
            library,
            overlay: options.overlay.iter().map(|(path, text)| (options.gate.identity(path), text.clone())).collect(),
            paths: options.import_paths.clone(),
            gate: &options.gate,
            cancel: &options.cancel,
            sources: SourceMap::default(),
            report: Report::new(options.brief),
            docs: Vec::new(),
            looked_at: Vec::new(),
            file_checks: FileChecks::default(),
            by_path: BTreeMap::new(),
        }
    }

    /// Reads the main file and all its imports; `text` replaces the content of the file, if given.
    pub(super) fn read_main(&mut self, path: &Path, text: Option<String>) -> Option<usize> {
        let named = path.to_str().and_then(|path| path.strip_prefix(imports::LIBRARY));
        let of_library = named.and_then(|name| imports::in_library(name, self.library));
        let path = of_library.as_deref().unwrap_or(path);
        if of_library.is_none() {
            self.looked_at.push(path.to_owned());
        }
        let text = match text.map_or_else(|| self.read(path), Ok) {
            Ok(text) => text,
            Err(fault) => {
                let file = self.sources.add(path, fault.prefix);
                let at = self.sources.text(file).len();
                self.report.push(Diagnostic::new(fault.code, Span { file, start: at, end: at }, fault.message));
                return None;
            }
        };
        if is_json(path, &text) {
            let file = self.sources.add(path, text);
            let message = "the graph is in the JSON form; graphs are RON";
            let error = Diagnostic::new(Code::Syntax, Span { file, start: 0, end: 1 }, message);
            self.report.push(error.help(format!("`shibo fmt --to ron {}` converts it", path.display())));
            return None;
        }
        let identity = self.gate.identity(path);
        self.by_path.insert(identity.clone(), None);
        // The main graph must be the first text.
        let file = self.sources.add(path, text.clone());
        self.paths.extend(imports::search_paths(
            (path, self.gate),
            &mut self.looked_at,
            &mut self.sources,
            &mut self.report,
        ));
        let doc = self.read_document(path, (file, text.into()), 0);
        self.by_path.insert(identity, Some(doc));
        Some(doc)
    }

    /// The text that replaces the content of a file.
    fn laid_over(&self, path: &Path) -> Option<&Arc<str>> {
        (!self.overlay.is_empty()).then(|| self.overlay.get(&self.gate.identity(path))).flatten()
    }

    /// The text of a file on disk or in the library.
    fn read(&self, path: &Path) -> Result<String, Fault> {
        if let Some(text) = self.laid_over(path) {
            let long = text.len() as u64 > self.limits.max_file_bytes;
            return if long { Err(Fault::too_large(path, self.limits.max_file_bytes)) } else { Ok(text.to_string()) };
        }
        let text = |library: &dyn Library, inside: &str| library.text(inside).map(str::to_owned);
        match imports::within(path) {
            Some(inside) => self
                .library
                .and_then(|library| text(library, &inside))
                .ok_or_else(|| Fault::new(Code::FileNotFound, format!("there is no file `{}`", path.display()))),
            None => read_text(&self.gate.pass(path)?, self.limits.max_file_bytes),
        }
    }

    fn read_document(&mut self, path: &Path, (file, text): (FileId, Arc<str>), depth: usize) -> usize {
        let (path, document, imports) = (path.to_owned(), Document::default(), Vec::new());
        let mut doc = Doc { path, document, imports, calls: Vec::new(), readable: false, sound: false };
        if self.cancel.is_cancelled() {
            self.docs.push(doc);
            return self.docs.len() - 1;
        }
        let src = Src::new(file, Tree::parse_nested(text, self.limits.max_nesting));
        let errors = src.tree().errors();
        errors.iter().for_each(|error| self.report.push(error.located(file)));
        self.report.spare(file, src.tree());
        doc.sound = errors.is_empty();
        // A broken text without parentheses may be an unfinished graph: do not report its form.
        let is_graph = src.tree().value().is_some_and(|value| value.kind() == NodeKind::Parens);
        if let Some(whole) = src.whole().filter(|_| doc.sound || is_graph) {
            doc.readable = true;
            doc.document = Document::read(&whole, &mut self.report);
        }
        for i in 0..doc.document.imports.len() {
            let import = self.import(&doc, i, depth);
            doc.imports.push(import);
        }
        doc.document.callable = Arc::new(self.callable(&doc));
        // A local graph may use the imports of its file and the local graphs above it.
        let mut graphs = std::mem::take(&mut doc.document.graphs);
        // Each of them knows the names of all above.
        read::at_most(&mut graphs, self.limits.max_imports, |(entry, _)| &entry.key, "graphs", &mut self.report);
        for (entry, mut document) in graphs {
            document.inherit(&doc.document);
            let (path, imports) = (doc.path.clone(), doc.imports.clone());
            doc.document.make_usable(&entry.name, imports.len());
            self.docs.push(Doc { path, document, imports, calls: Vec::new(), readable: true, sound: doc.sound });
            doc.imports.push(Some(self.docs.len() - 1));
        }
        self.docs.push(doc);
        self.docs.len() - 1
    }

    /// The functions of a graph, and those of its imports with the name of the import before them.
    fn callable(&self, doc: &Doc) -> Callable {
        let named = |decl: &FunctionDecl| (decl.function.name.clone(), decl.function.clone());
        let own = doc.document.functions.iter().map(named);
        let imported = doc.document.imports.iter().zip(&doc.imports).flat_map(|(entry, other)| {
            let functions = other.and_then(|other| self.docs.get(other)).map(|other| other.document.functions.iter());
            let named = functions.into_iter().flatten().map(named);
            named.map(|(name, function)| (format!("{}.{name}", entry.name), function))
        });
        own.chain(imported).collect()
    }

    fn import(&mut self, doc: &Doc, index: usize, depth: usize) -> Option<usize> {
        let entry = &doc.document.imports[index];
        let name = read::text(&entry.value, "an import", &mut self.report)?;
        let path = self.path_of(doc, entry, &name)?;
        let identity = self.gate.identity(&path);
        match self.by_path.get(&identity) {
            Some(Some(known)) => return Some(*known),
            Some(None) => {
                let message = format!("`{name}` imports itself, directly or by way of others");
                self.report.push(entry.value.error(Code::Cycle, message));
                return None;
            }
            None => {}
        }
        if depth >= self.limits.max_import_depth || self.by_path.len() > self.limits.max_imports {
            let message = format!(
                "too many imports; there may be {}, nested {} deep",
                self.limits.max_imports, self.limits.max_import_depth
            );
            self.report.push(entry.value.error(Code::TooLarge, message));
            return None;
        }
        let text = match self.read(&path) {
            Ok(text) => text,
            Err(fault) => {
                let error = entry.value.error(fault.code, fault.message);
                let missing = fault.code == Code::FileNotFound;
                let help = missing.then(|| imports::help(&name, &self.paths, self.library));
                self.report.push(help.map_or(error.clone(), |help| error.help(help)));
                return None;
            }
        };
        self.by_path.insert(identity.clone(), None);
        let file = self.sources.add(path.clone(), text.clone());
        let imported = self.read_document(&path, (file, text.into()), depth + 1);
        self.by_path.insert(identity, Some(imported));
        Some(imported)
    }

    /// The file that the import `name` refers to.
    fn path_of(&mut self, doc: &Doc, entry: &Entry, name: &str) -> Option<PathBuf> {
        if let Some(name) = name.strip_prefix(imports::LIBRARY) {
            let found = imports::in_library(name, self.library);
            if found.is_none() {
                let names = self.library.map_or(Vec::new(), |library| library.names());
                let message = format!("no graph `{}` comes with the program", read::shorten(name));
                self.report.unknown(entry.value.error(Code::FileNotFound, message), name, "graph", names);
            }
            return found;
        }
        let is_file = |path: &Path| self.gate.has(path) || self.laid_over(path).is_some();
        let found = imports::find(name, doc.folder(), (&self.paths, &is_file), self.library);
        self.looked_at.extend(found.missing);
        if imports::within(&found.path).is_none() {
            self.looked_at.push(found.path.clone());
        }
        Some(found.path)
    }
}
