//! The files that nodes read, and the check that their content still matches the keys.
//!
//! The key of a result contains the hashes of the files that its node reads, computed before the run begins. The node
//! reads its files later: when it is evaluated, or when the first tile of one of its fields is filled. If a file
//! changes in between, the result does not belong to the key. The files are therefore compared with their hashes again
//! after they were read; a result computed from changed files is refused with an error and never stored.
use super::lock;
use crate::diagnostics::{Code, Problem};
use crate::value::clock::time_of_day;
use crate::value::files::{Facts, FileHandle};
use crate::value::{
    Cost, Field, FieldSource, Given, Grid, Material, PictureFields, Pictures, Read, Stop, Tile, Value, Window,
};
use std::io;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

/// A file of a node, as it was when the keys were derived.
#[derive(Debug)]
pub(super) struct KeyedFile {
    /// The parameter that names the file.
    field: &'static str,
    file: FileHandle,
    hash: [u8; 32],
    /// The facts of the file with that content, and the time when it was read.
    seen: Mutex<(Facts, SystemTime)>,
}

impl KeyedFile {
    /// Reads the file that the parameter `field` names.
    pub(super) fn read(field: &'static str, file: &FileHandle) -> io::Result<Self> {
        let now = time_of_day();
        let (seen, hash) = (Mutex::new((file.facts()?, now)), hash(file)?);
        Ok(Self { field, file: file.clone(), hash, seen })
    }

    /// The parameter that names the file.
    pub(super) fn field(&self) -> &'static str {
        self.field
    }

    /// The file.
    pub(super) fn file(&self) -> &FileHandle {
        &self.file
    }

    /// The hash of the content.
    pub(super) fn hash(&self) -> &[u8; 32] {
        &self.hash
    }

    /// Returns true if the content still has the hash. The content is read again only if the facts are inconclusive.
    fn is_unchanged(&self) -> bool {
        let now = time_of_day();
        let Some(facts) = self.file.facts().ok().filter(Facts::is_file) else { return false };
        let mut seen = lock(&self.seen);
        if seen.0 == facts && !facts.may_hide_a_change(seen.1) {
            return true;
        }
        let unchanged = hash(&self.file).is_ok_and(|hash| hash == self.hash);
        if unchanged {
            *seen = (facts, now);
        }
        unchanged
    }

    fn problem(&self, message: String) -> Problem {
        Problem::new(Code::BadFile, message).at(self.field)
    }

    fn check(&self) -> Result<(), Stop> {
        if self.is_unchanged() {
            return Ok(());
        }
        let message = format!("`{}` was changed after the run had begun", self.file.display());
        Err(self.problem(message).help("run it again").into())
    }
}

fn hash(file: &FileHandle) -> io::Result<[u8; 32]> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file.open()?)?;
    Ok(*hasher.finalize().as_bytes())
}

/// State of a node's files: the content that its fields read is not verified yet.
const UNKNOWN: u8 = 0;
/// Verified: the fields read the content that the keys state and hold it in memory, so the files may change from now
/// on.
const PROVEN: u8 = 1;
/// Refused: the fields may have read other content and hold it in memory.
const REFUSED: u8 = 2;

/// The files of an evaluated node, and whether the content its fields read was verified.
pub(super) struct NodeFiles {
    files: Arc<[KeyedFile]>,
    state: AtomicU8,
}

impl NodeFiles {
    /// Starts with files that were not read yet.
    pub(super) fn new(files: Arc<[KeyedFile]>) -> Arc<Self> {
        Arc::new(Self { files, state: AtomicU8::new(UNKNOWN) })
    }

    /// Runs `work`, which reads the files, and checks the files afterwards. Changed files take precedence over an error
    /// of `work`: a file that is being written is easily taken for a damaged one.
    pub(super) fn evaluate<T>(&self, work: impl FnOnce() -> Result<T, Stop>) -> Result<T, Stop> {
        match work() {
            Err(Stop::Cancelled) => Err(Stop::Cancelled),
            result => self.check().and(result),
        }
    }

    fn check(&self) -> Result<(), Stop> {
        self.files.iter().try_for_each(KeyedFile::check)
    }

    /// Runs work on a field, which may read the files unless another field of the node has read them before.
    fn fill<T>(&self, work: impl FnOnce() -> Result<T, Stop>) -> Result<T, Stop> {
        if self.state.load(Ordering::Acquire) == PROVEN {
            return work();
        }
        self.check()?;
        if let (REFUSED, Some(file)) = (self.state.load(Ordering::Acquire), self.files.first()) {
            let message = format!("`{}` was changed while it was read", file.file.display());
            return Err(file.problem(message).help("start the program again").into());
        }
        let result = work();
        if matches!(result, Err(Stop::Cancelled)) {
            return result;
        }
        let checked = self.check();
        let state = if checked.is_ok() { PROVEN } else { REFUSED };
        match self.state.compare_exchange(UNKNOWN, state, Ordering::AcqRel, Ordering::Acquire) {
            Err(PROVEN) => result,
            _ => checked.and(result),
        }
    }

    /// Wraps the fields of a value of the node, so that their reading of files is checked.
    pub(super) fn supervise(self: &Arc<Self>, value: &Value) -> Value {
        let field = |field: &Field| match field.as_constant() {
            Some(_) => field.clone(),
            None => field.clone().wrapped(|field| Supervised { field, files: self.clone() }),
        };
        match value {
            Value::Field(one) => Value::Field(field(one)),
            Value::Picture(picture) => Value::Picture(Arc::new(PictureFields {
                gray: field(&picture.gray),
                rgb: field(&picture.rgb),
                is_gray: picture.is_gray,
            })),
            Value::Material(material) => Value::Material(Arc::new(Material::new(
                material.channels().iter().map(|(channel, one)| (*channel, field(one))),
            ))),
            other => other.clone(),
        }
    }
}

/// A field whose node reads files.
struct Supervised {
    field: Field,
    files: Arc<NodeFiles>,
}

impl FieldSource for Supervised {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.field.source().inputs(grid, window)
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.field.source().later(grid, window)
    }

    fn narrow(&self, given: &Given<'_>, grid: &Grid, window: Window) -> Vec<Window> {
        self.field.source().narrow(given, grid, window)
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        self.files.fill(|| self.field.source().fill(given, out))
    }

    fn cost(&self) -> Cost {
        self.field.source().cost()
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        self.field.source().whole(grid)
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        self.field.source().prepare(grid, pictures)
    }

    fn reaches_by(&self) -> Option<&'static str> {
        self.field.source().reaches_by()
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        self.field.source().prepare_bytes(grid)
    }

    fn bytes(&self) -> usize {
        self.field.source().bytes()
    }
}
