//! Loads a graph file that may be half written.
use super::files::{FileState, hex, sha256};
use crate::serve::{TextsByPath, Values, tried};
use shibo_bridge::page::edits::FieldEdit;
use shibo_graph::{self as graph, Limits, LoadOptions, Loaded};
use shibo_ide::identity;
use shibo_node::registry::Registry;
use shibo_value::diagnostics::{Code, Diagnostic, Origin};
use std::fs::{self, Metadata};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Delay for errors of a file that is missing or ends too early, since it is probably being written.
const UNFINISHED: Duration = Duration::from_millis(1000);
/// Shorter delay once the writing program has closed the file.
const UNFINISHED_CLOSED: Duration = Duration::from_millis(500);
/// Delay for other errors: the file may be half old and half new.
const DOUBTFUL: Duration = Duration::from_millis(120);
/// Shorter delay once the writing program has closed the file.
const DOUBTFUL_CLOSED: Duration = Duration::from_millis(30);

/// Result of reading a graph file.
pub(super) struct Reading {
    /// Hash of the file, if it could be read.
    pub(super) sha256: Option<String>,
    /// State of the file when it was read.
    pub(super) state: FileState,
    /// Metadata just before reading.
    pub(super) before: Option<Metadata>,
    /// The graph or its errors.
    pub(super) loaded: Loaded,
    /// The text, if the file is text.
    pub(super) text: Option<String>,
    /// Texts of the editor that replace files.
    pub(super) unsaved: TextsByPath,
    /// Texts of the editor that their files have by now.
    pub(super) saved: TextsByPath,
    /// Names of parameter values that were dropped because the graph no longer accepts them.
    pub(super) refused: Vec<String>,
    /// Values of nodes that were dropped, and why.
    pub(super) refused_edits: Vec<(FieldEdit, String)>,
}

/// Reads and checks the graph file. `texts` of an editor replace the files that the graph reads.
pub(super) fn load(path: &Path, registry: &Registry, values: &Values, texts: &TextsByPath) -> Reading {
    let before = fs::metadata(path).ok();
    let limits = Limits::default();
    let bytes = before.as_ref().filter(|m| m.is_file()).and_then(|_| read(path, limits.max_file_bytes).ok());
    let state = match (&bytes, &before) {
        (Some(bytes), _) => FileState::Content(sha256(bytes)),
        (None, Some(_)) => FileState::Unreadable,
        (None, None) => FileState::Missing,
    };
    let own = texts.get(&identity(path));
    let text = match own {
        Some(text) => Some(text.to_string()),
        None => bytes.filter(|b| b.len() as u64 <= limits.max_file_bytes).and_then(|b| String::from_utf8(b).ok()),
    };
    let overlay = text.as_deref().map_or_else(TextsByPath::new, |text| replacing(path, text, registry, texts));
    let (shown, refused_edits) = text
        .as_deref()
        .map(|text| tried(path, text, registry, values, &overlay))
        .map_or_else(Default::default, |(text, refused)| (Some(text), refused));
    let mut options = LoadOptions { limits, overlay, ..values.clone().options() };
    let mut refused = Vec::new();
    let loaded = loop {
        let loaded = match &shown {
            Some(text) => graph::load_text(path, text, registry, &options),
            None => graph::load(path, registry, &options),
        };
        // Values set for an earlier text may no longer fit; they are dropped then.
        let before = options.set.len() + usize::from(options.preset.is_some());
        refused.extend(refuse(&loaded, &mut options));
        if options.set.len() + usize::from(options.preset.is_some()) == before {
            break loaded;
        }
    };
    let sha256 = match (own, &state) {
        (Some(text), _) => Some(hex(&sha256(text.as_bytes()))),
        (None, FileState::Content(hash)) => Some(hex(hash)),
        (None, _) => None,
    };
    drop(shown);
    let is_saved = |path: &PathBuf, text: &mut Arc<str>| fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes());
    let mut unsaved = options.overlay;
    let saved = unsaved.extract_if(.., is_saved).collect();
    Reading { sha256, state, before, loaded, text, unsaved, saved, refused, refused_edits }
}

/// The texts that replace files which the graph reads. Other paths are never looked at.
fn replacing(path: &Path, text: &str, registry: &Registry, texts: &TextsByPath) -> TextsByPath {
    let own = texts.get_key_value(&identity(path));
    let mut overlay: TextsByPath = own.map(|(path, text)| (path.clone(), text.clone())).into_iter().collect();
    while overlay.len() < texts.len() {
        let before = overlay.len();
        let options = LoadOptions { overlay: overlay.clone(), ..Values::default().options() };
        let files = graph::load_text(path, text, registry, &options).files;
        let read = files.iter().filter_map(|file| texts.get_key_value(&identity(file)));
        overlay.extend(read.map(|(path, text)| (path.clone(), text.clone())));
        // A text may import further files.
        if overlay.len() == before {
            break;
        }
    }
    overlay
}

/// Reads at most one byte more than allowed.
fn read(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Removes the erroneous values from the options.
fn refuse(loaded: &Loaded, options: &mut LoadOptions) -> Vec<String> {
    let mut refused = Vec::new();
    for error in loaded.diagnostics.iter().filter(|d| !d.warning) {
        match loaded.sources.origin(error.span.file) {
            Origin::Preset => refused.extend(options.preset.take()),
            Origin::Param { name } => {
                if let Some(at) = options.set.iter().position(|(n, _)| n == name) {
                    refused.push(options.set.remove(at).0);
                }
            }
            Origin::File | Origin::Resolution => {}
        }
    }
    refused
}

impl Reading {
    /// Delay before errors are reported, since the file may be half written; `closed`: the writing program has closed
    /// it.
    pub(super) fn hold(&self, closed: bool) -> Duration {
        if !self.loaded.has_errors() {
            return Duration::ZERO;
        }
        match (self.is_unfinished(), closed) {
            (true, true) => UNFINISHED_CLOSED,
            (true, false) => UNFINISHED,
            (false, true) => DOUBTFUL_CLOSED,
            (false, false) => DOUBTFUL,
        }
    }

    /// Returns whether a file is missing or ends too early.
    pub(super) fn is_unfinished(&self) -> bool {
        let ends_early = |error: &Diagnostic| error.unfinished || error.code == Code::FileNotFound;
        let errors = self.loaded.diagnostics.iter().filter(|d| !d.warning);
        self.sha256.is_none() || errors.into_iter().any(ends_early)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRAPH: &str = "(\n  version: 1,\n  canvas: (size_mm: 8, resolution: 16),\n  params: { \"size\": Number(default: 2.0, range: (1, 4), doc: \"Size\") },\n  \
        presets: { \"fine\": { \"size\": 1 } },\n  nodes: { \"a\": Perlin(size: \"$size\") },\n  outputs: { \"a\": \"a\" },\n)\n";

    fn reading(text: &str, values: &Values) -> Reading {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.ron");
        fs::write(&path, text).unwrap();
        load(&path, &crate::library::registry(), values, &TextsByPath::new())
    }

    #[test]
    fn treats_every_prefix_as_unfinished() {
        let whole = reading(GRAPH, &Values::default());
        assert!(!whole.loaded.has_errors(), "{:?}", whole.loaded.diagnostics);
        assert_eq!(whole.hold(false), Duration::ZERO);
        let end = GRAPH.trim_end().len();
        for cut in 0..end {
            let part = reading(&GRAPH[..cut], &Values::default());
            assert!(part.loaded.has_errors() && part.is_unfinished(), "{cut}: {:?}", part.loaded.diagnostics);
        }
    }

    #[test]
    fn reports_errors_in_the_middle_soon() {
        let part = reading(&GRAPH.replace("Perlin", "Perlim"), &Values::default());
        assert!(!part.is_unfinished());
        assert_eq!(part.hold(true), DOUBTFUL_CLOSED);
        assert!(reading(&GRAPH.replace("size_mm:", "size_mm"), &Values::default()).hold(true) <= UNFINISHED_CLOSED);
    }

    #[test]
    fn drops_values_that_no_longer_fit() {
        let set = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let values =
            Values { preset: Some("none".into()), set: vec![set("size", "9"), set("gone", "1")], ..Values::default() };
        let part = reading(GRAPH, &values);
        assert!(!part.loaded.has_errors());
        assert_eq!(part.refused.len(), 3, "{:?}", part.refused);
        let fits =
            reading(GRAPH, &Values { preset: Some("fine".into()), set: vec![set("size", "3")], ..Values::default() });
        assert_eq!(fits.loaded.graph.unwrap().params[0].value, "3");
    }
}
