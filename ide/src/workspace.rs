//! Files of the editor: open texts, and all other files as they are on disk.
use super::file::File;
use super::habits::Habits;
use super::world::World;
use shibo_graph::{Cancel, Gate, LoadOptions, import_path};
use shibo_node::registry::Registry;
use shibo_value::files::{Facts, FileKind};
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};

/// Files larger than this number of bytes are not read as graphs.
const LARGEST: u64 = 8 << 20;
/// Maximum number of files in a workspace.
const FILES: usize = 20_000;
/// Folders that contain no graphs of the user.
const SKIPPED: [&str; 3] = ["target", "node_modules", "shibo-library"];
/// Prefix of the paths of library graphs.
const LIBRARY: &str = "shibo:";

/// Statistics of the library graphs; empty until they are needed.
type LazyHabits = Arc<OnceLock<Habits>>;

/// The statistics for the registry that was used last. They take 50 ms, so all its workspaces share them.
static HABITS: Mutex<Option<(Weak<Registry>, LazyHabits)>> = Mutex::new(None);

fn habits_of(registry: &Arc<Registry>) -> LazyHabits {
    let registry = Arc::downgrade(registry);
    let mut last = HABITS.lock().unwrap_or_else(PoisonError::into_inner);
    let known = last.as_ref().filter(|(of, _)| of.ptr_eq(&registry)).map(|(_, habits)| habits.clone());
    known.unwrap_or_else(|| last.insert((registry, Arc::default())).1.clone())
}

/// State of a file on disk when it was last read.
struct Seen {
    facts: Facts,
    file: Arc<File>,
}

#[derive(Default)]
struct Known {
    /// Resolved imports, by file and name.
    imports: HashMap<(PathBuf, String), Option<PathBuf>>,
    /// Files checked on disk since the last change.
    current: HashMap<PathBuf, Option<Arc<File>>>,
    /// Files as read.
    files: HashMap<PathBuf, Seen>,
    /// Files of the workspace.
    all: Option<Arc<Vec<PathBuf>>>,
}

/// The files and the node kinds.
pub struct Workspace {
    registry: Arc<Registry>,
    roots: Vec<PathBuf>,
    import_paths: Vec<PathBuf>,
    gate: Gate,
    open: HashMap<PathBuf, Arc<File>>,
    known: Mutex<Known>,
    habits: LazyHabits,
    cancel: Cancel,
}

impl Workspace {
    /// Creates a workspace of folders.
    pub fn new(registry: Arc<Registry>, roots: Vec<PathBuf>) -> Self {
        let habits = habits_of(&registry);
        Self {
            registry,
            roots,
            import_paths: Vec::new(),
            gate: Gate::default(),
            open: HashMap::new(),
            known: Mutex::default(),
            habits,
            cancel: Cancel::default(),
        }
    }

    /// Adds folders that are searched for imports after the folder of the graph.
    #[must_use]
    pub fn with_import_paths(self, import_paths: Vec<PathBuf>) -> Self {
        Self { import_paths, ..self }
    }

    /// Reads only the files that a gate lets pass.
    #[must_use]
    pub fn with_gate(self, gate: Gate) -> Self {
        Self { gate, ..self }
    }

    /// Ends long work early once it is cancelled.
    #[must_use]
    pub fn with_cancel(self, cancel: Cancel) -> Self {
        Self { cancel, ..self }
    }

    /// Replaces the gate.
    pub fn set_gate(&mut self, gate: Gate) {
        self.gate = gate;
        self.known().files.clear();
        self.rescan();
    }

    /// Replaces the statistics of the library graphs by others.
    #[cfg(test)]
    pub fn with_habits(self, habits: Habits) -> Self {
        Self { habits: Arc::new(OnceLock::from(habits)), ..self }
    }

    /// Opens a file with this text.
    pub fn open(&mut self, path: &Path, text: impl Into<Arc<str>>) -> Arc<File> {
        let path = self.identity(path);
        let file = Arc::new(File::new(path.clone(), text));
        self.open.insert(path, file.clone());
        self.refresh();
        file
    }

    /// Opens a parsed file.
    pub fn insert(&mut self, file: Arc<File>) {
        self.open.insert(file.path.clone(), file);
        self.refresh();
    }

    /// Closes a file.
    pub fn close(&mut self, path: &Path) {
        self.open.remove(&self.identity(path));
        self.refresh();
    }

    /// Texts of open files.
    pub fn texts(&self) -> BTreeMap<PathBuf, Arc<str>> {
        self.open.values().map(|file| (file.path.clone(), file.text.clone())).collect()
    }

    /// Marks the state on disk as outdated.
    pub fn refresh(&self) {
        let mut known = self.known();
        known.imports.clear();
        known.current.clear();
    }

    /// Marks the list of files as outdated.
    pub fn rescan(&self) {
        self.known().all = None;
        self.refresh();
    }

    /// The folders.
    pub fn roots(&self) -> &[PathBuf] {
        &self.roots
    }

    /// Replaces the folders.
    pub fn set_roots(&mut self, roots: Vec<PathBuf>) {
        self.roots = roots;
        self.rescan();
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn read(&self, path: &Path) -> Option<Arc<File>> {
        if let Some(inside) = path.to_str().and_then(|path| path.strip_prefix(LIBRARY)) {
            let text = self.registry.library()?.text(inside.trim_start_matches('/'))?;
            return Some(Arc::new(File::new(path, text)));
        }
        let source = self.gate.file(path)?;
        let facts = source.facts().ok().filter(|facts| facts.is_file() && facts.length <= LARGEST)?;
        if let Some(seen) = self.known().files.get(source.path()).filter(|seen| seen.facts == facts) {
            return Some(seen.file.clone());
        }
        let text = String::from_utf8(source.bytes(LARGEST).ok()?).ok()?;
        let file = Arc::new(File::new(source.path(), text));
        self.known().files.insert(source.path().to_owned(), Seen { facts, file: file.clone() });
        Some(file)
    }

    /// A path that is equal for all paths to one file, as [`identity`] is for those of the machine.
    fn identity(&self, path: &Path) -> PathBuf {
        if !is_library(path) && self.gate.has(path) { self.gate.identity(path) } else { lexical(path) }
    }

    /// Graph files in the folders.
    fn all(&self) -> Arc<Vec<PathBuf>> {
        if let Some(all) = &self.known().all {
            return all.clone();
        }
        let mut found = Vec::new();
        let mut folders: Vec<PathBuf> = self.roots.clone();
        while let Some(folder) = folders.pop() {
            let Ok(entries) = fs::read_dir(&folder) else { continue };
            for entry in entries.flatten() {
                let name = entry.file_name().to_string_lossy().into_owned();
                let Ok(ty) = entry.file_type() else { continue };
                if ty.is_dir() && !name.starts_with('.') && !SKIPPED.contains(&name.as_str()) {
                    folders.push(entry.path());
                } else if name.ends_with(".ron") && found.len() < FILES {
                    found.push(identity(&entry.path()));
                }
            }
        }
        found.sort();
        found.dedup();
        let found = Arc::new(found);
        self.known().all = Some(found.clone());
        found
    }
}

impl World for Workspace {
    fn registry(&self) -> &Registry {
        &self.registry
    }

    fn file(&self, path: &Path) -> Option<Arc<File>> {
        let path = self.identity(path);
        if let Some(open) = self.open.get(&path) {
            return Some(open.clone());
        }
        if let Some(current) = self.known().current.get(&path) {
            return current.clone();
        }
        let found = self.read(&path);
        self.known().current.insert(path, found.clone());
        found
    }

    fn import(&self, from: &Path, name: &str) -> Option<PathBuf> {
        let key = (from.to_owned(), name.to_owned());
        if let Some(known) = self.known().imports.get(&key) {
            return known.clone();
        }
        let open = |path: &Path| self.open.contains_key(&self.identity(path));
        let found = import_path(from, name, (self.registry.library(), &self.import_paths, &self.gate), &open);
        let found = found.map(|path| self.identity(&path));
        self.known().imports.insert(key, found.clone());
        found
    }

    fn graphs(&self) -> Vec<Arc<File>> {
        let mut paths: Vec<PathBuf> = self.all().to_vec();
        paths.extend(self.open.keys().cloned());
        paths.sort();
        paths.dedup();
        paths.iter().filter_map(|path| self.file(path)).filter(|file| file.is_graph()).collect()
    }

    fn folder(&self, path: &Path) -> Vec<(String, bool)> {
        let is_folder = |name: &str| {
            let facts = self.gate.file(&path.join(name)).and_then(|file| file.facts().ok());
            facts.is_some_and(|facts| facts.kind == FileKind::Folder)
        };
        let names = self.gate.names(path).into_iter().filter_map(|name| name.into_string().ok()).take(FILES);
        let mut names: Vec<(String, bool)> =
            names.map(|name| (is_folder(&name), name)).map(|(folder, name)| (name, folder)).collect();
        names.sort();
        names
    }

    fn habits(&self) -> &Habits {
        self.habits.get_or_init(|| {
            let files: Vec<File> =
                shibo_library::graphs().iter().map(|graph| File::new(graph.path, graph.text)).collect();
            Habits::of(&self.registry, &files)
        })
    }

    fn options(&self) -> LoadOptions {
        LoadOptions {
            import_paths: self.import_paths.clone(),
            overlay: self.texts(),
            gate: self.gate.clone(),
            cancel: self.cancel.clone(),
            ..LoadOptions::default()
        }
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }
}

/// Canonical path, without links, `.` and `..`, so that equal paths mean the same file.
pub fn identity(path: &Path) -> PathBuf {
    if is_library(path) {
        return lexical(path);
    }
    path.canonicalize().unwrap_or_else(|_| lexical(path))
}

fn is_library(path: &Path) -> bool {
    path.starts_with(LIBRARY) || path.to_str().is_some_and(|path| path.starts_with(LIBRARY))
}

fn lexical(path: &Path) -> PathBuf {
    let mut clean = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if clean.file_name().is_some() => drop(clean.pop()),
            part => clean.push(part),
        }
    }
    clean
}
