//! Diagnostics: checks the newest texts and sends the findings to the editor.
use super::text::{Encoding, Lines};
use super::uris;
use crate::diagnose::{Finding, Severity, by_file, hints};
use crate::news::advice;
use crate::{Cx, File, Workspace, World, identity};
use lsp_server::{Message, Notification};
use lsp_types::{
    Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location, NumberOrString,
    PublishDiagnosticsParams, Uri,
};
use serde_json::json;
use shibo_graph::{Gate, LoadOptions, Loaded, load_text};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// Message to the checker.
pub enum Job {
    /// A file has a new text.
    Text {
        /// The editor's address of the file.
        uri: Uri,
        /// The version of the text.
        version: i32,
        /// The parsed text.
        file: Arc<File>,
    },
    /// A file was closed.
    Close(PathBuf),
    /// The folders of the workspace.
    Roots(Vec<PathBuf>),
}

/// An open file.
struct Open {
    uri: Uri,
    version: i32,
    file: Arc<File>,
}

/// Result of checking a file.
struct Checked {
    /// Findings by file, each with the text to which their ranges refer.
    found: BTreeMap<PathBuf, (Arc<str>, Vec<Finding>)>,
    /// Files that the check read, with their state then.
    seen: Vec<(PathBuf, Option<(SystemTime, u64)>)>,
}

/// The checker.
pub struct Checker {
    workspace: Workspace,
    encoding: Encoding,
    send: Box<dyn Fn(Message) + Send>,
    open: BTreeMap<PathBuf, Open>,
    checked: BTreeMap<PathBuf, Checked>,
    /// Files with published diagnostics.
    told: BTreeSet<PathBuf>,
    /// Open files that are to be checked.
    due: BTreeSet<PathBuf>,
    working_dir: PathBuf,
}

impl Checker {
    /// Creates a checker that sends messages to the editor through `send`. It reads pictures relative to `working_dir` too.
    pub fn new(
        workspace: Workspace,
        working_dir: PathBuf,
        encoding: Encoding,
        send: impl Fn(Message) + Send + 'static,
    ) -> Self {
        Self {
            workspace,
            working_dir,
            encoding,
            send: Box::new(send),
            open: BTreeMap::new(),
            checked: BTreeMap::new(),
            told: BTreeSet::new(),
            due: BTreeSet::new(),
        }
    }

    /// Takes a job: [`check_next`](Self::check_next) has the texts that are due then. A panic is logged in the editor, and the next
    /// text is still checked.
    pub fn take(&mut self, job: Job) {
        self.safely(|checker| checker.note(job));
    }

    /// Checks a text that is due; returns false if there is none.
    pub fn check_next(&mut self) -> bool {
        let Some(path) = self.due.pop_first() else { return false };
        self.safely(|checker| checker.check(&path));
        true
    }

    /// Returns whether a text is due.
    pub fn is_due(&self) -> bool {
        !self.due.is_empty()
    }

    /// Makes open files due if their check read a file that has changed on disk.
    pub fn look(&mut self) {
        self.safely(|checker| checker.due = checker.changed_on_disk());
    }

    /// Gives the texts other files.
    pub fn set_gate(&mut self, gate: Gate) {
        self.workspace.set_gate(gate);
        self.due = self.open.keys().cloned().collect();
    }

    fn safely(&mut self, step: impl FnOnce(&mut Self)) {
        let _ = catch_unwind(AssertUnwindSafe(|| step(self)));
    }

    fn note(&mut self, job: Job) {
        match job {
            Job::Text { uri, version, file } => {
                let path = file.path.clone();
                self.workspace.insert(file.clone());
                self.open.insert(path.clone(), Open { uri, version, file });
                self.due.extend(self.readers(&path));
                self.due.insert(path);
            }
            Job::Close(path) => {
                self.workspace.close(&path);
                self.open.remove(&path);
                self.due.extend(self.readers(&path));
                self.due.remove(&path);
                if let Some(checked) = self.checked.remove(&path) {
                    let files: Vec<PathBuf> = checked.found.into_keys().chain([path]).collect();
                    files.iter().for_each(|path| self.publish(path));
                }
            }
            Job::Roots(roots) => self.workspace.set_roots(roots),
        }
    }

    /// Open files whose check read `path`.
    fn readers(&self, path: &Path) -> Vec<PathBuf> {
        let reads = |checked: &Checked| checked.seen.iter().any(|(seen, _)| seen == path);
        let readers = self.checked.iter().filter(|(own, checked)| *own != path && reads(checked));
        readers.map(|(path, _)| path.clone()).filter(|path| self.open.contains_key(path)).collect()
    }

    /// Open files whose check read a file that has changed on disk.
    fn changed_on_disk(&mut self) -> BTreeSet<PathBuf> {
        let changed = |checked: &Checked| {
            checked.seen.iter().any(|(path, state)| !self.open.contains_key(path) && state_of(path) != *state)
        };
        let due: BTreeSet<PathBuf> =
            self.checked.iter().filter(|(_, checked)| changed(checked)).map(|(path, _)| path.clone()).collect();
        if !due.is_empty() {
            self.workspace.refresh();
        }
        due
    }

    fn check(&mut self, path: &Path) {
        let Some(open) = self.open.get(path) else { return };
        let file = open.file.clone();
        let mut found: BTreeMap<PathBuf, (Arc<str>, Vec<Finding>)> = BTreeMap::new();
        let mut seen = Vec::new();
        if file.is_meant_as_graph(&|kind| self.workspace.registry().info(kind).is_some()) {
            let Loaded { graph, diagnostics, sources, files } =
                load_text(path, &file.text, self.workspace.registry(), &self.options());
            let mut all = diagnostics;
            all.extend(graph.iter().flat_map(|graph| advice(self.workspace.registry(), graph)));
            let texts = sources.sources().len();
            debug_assert!(texts > 0, "the file itself is a source");
            for (path, findings) in by_file(&all, &sources) {
                let text = sources.sources().iter().find(|source| source.path == path).map(|s| s.text.clone());
                found.insert(identity(&path), (text.unwrap_or_default(), findings));
            }
            let cx = Cx { world: &self.workspace, file: &file };
            let own = found.entry(path.to_owned()).or_insert_with(|| (file.text.clone(), Vec::new()));
            own.1.extend(hints(cx));
            seen = files.iter().map(|path| (identity(path), state_of(path))).collect();
            let pictures = graph.iter().flat_map(|graph| graph.nodes.node_weights()).flat_map(|node| &node.files);
            seen.extend(pictures.map(|(_, file)| (identity(file.path()), state_of(file.path()))));
        }
        let before = self.checked.insert(path.to_owned(), Checked { found, seen });
        let mut files: BTreeSet<PathBuf> = before.into_iter().flat_map(|checked| checked.found.into_keys()).collect();
        files.extend(self.checked.get(path).into_iter().flat_map(|checked| checked.found.keys().cloned()));
        files.insert(path.to_owned());
        files.iter().for_each(|path| self.publish(path));
    }

    fn options(&self) -> LoadOptions {
        LoadOptions { working_dir: self.working_dir.clone(), ..self.workspace.options() }
    }

    /// Publishes all findings in a file, from all checks.
    fn publish(&mut self, path: &Path) {
        let mut lists: Vec<&(Arc<str>, Vec<Finding>)> = Vec::new();
        lists.extend(self.checked.get(path).and_then(|checked| checked.found.get(path)));
        let others = self.checked.iter().filter(|(own, _)| *own != path);
        lists.extend(others.filter_map(|(_, checked)| checked.found.get(path)));
        let open = self.open.get(path);
        let Some(uri) = open.map(|open| open.uri.clone()).or_else(|| uris::uri(path)) else { return };
        let mut seen = BTreeSet::new();
        let mut diagnostics = Vec::new();
        let mut lines: Option<Lines> = None;
        let mut related = BTreeMap::new();
        for (text, findings) in lists {
            // Ranges from a check of an older text do not fit this one.
            if open.is_some_and(|open| open.file.text != *text) {
                continue;
            }
            let lines = lines.get_or_insert_with(|| Lines::new(text.clone(), self.encoding));
            for finding in findings {
                if seen.insert((finding.range.start, finding.range.end, finding.severity, finding.message.clone())) {
                    diagnostics.push(self.diagnostic(finding, lines, &mut related));
                }
            }
        }
        if diagnostics.is_empty() && open.is_none() && !self.told.remove(path) {
            return;
        }
        if !diagnostics.is_empty() {
            self.told.insert(path.to_owned());
        }
        let params = PublishDiagnosticsParams { uri, diagnostics, version: open.map(|open| open.version) };
        let method = "textDocument/publishDiagnostics".to_owned();
        (self.send)(Message::Notification(Notification::new(method, params)));
    }

    /// A finding as a diagnostic; `known` keeps the lines of files with related places.
    fn diagnostic(&self, finding: &Finding, lines: &Lines, known: &mut BTreeMap<PathBuf, Lines>) -> Diagnostic {
        let severity = match finding.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Hint => DiagnosticSeverity::HINT,
        };
        let tags = [
            finding.unneeded.then_some(DiagnosticTag::UNNECESSARY),
            finding.deprecated.then_some(DiagnosticTag::DEPRECATED),
        ];
        let tags: Vec<DiagnosticTag> = tags.into_iter().flatten().collect();
        let help = finding.help.as_ref().map_or(String::new(), |help| format!("\n{help}"));
        let related = finding.related.iter().filter_map(|(path, range, message)| {
            if !known.contains_key(path) {
                let file = self.workspace.file(path)?;
                known.insert(path.clone(), Lines::new(file.text.clone(), self.encoding));
            }
            let lines = known.get(path)?;
            let uri = self.open.get(path).map(|open| open.uri.clone()).or_else(|| uris::uri(path))?;
            Some(DiagnosticRelatedInformation {
                location: Location::new(uri, lines.span(range)),
                message: message.clone(),
            })
        });
        let related: Vec<_> = related.collect();
        Diagnostic {
            range: lines.span(&finding.range),
            severity: Some(severity),
            code: Some(NumberOrString::String(finding.code.clone())),
            source: Some("shibo".to_owned()),
            message: format!("{}{help}", finding.message),
            related_information: (!related.is_empty()).then_some(related),
            tags: (!tags.is_empty()).then_some(tags),
            data: Some(json!({ "message": finding.message, "help": finding.help, "unneeded": finding.unneeded })),
            code_description: None,
        }
    }
}

/// Modification time and size of a file.
fn state_of(path: &Path) -> Option<(SystemTime, u64)> {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}
