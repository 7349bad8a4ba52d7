//! The files that graphs and nodes read: on disk, or in memory where there is no disk. All crates of the engine, the
//! nodes and the library read input files only through [`Files`].
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Cursor, ErrorKind, Read, Seek};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// File systems have coarse clocks: a file changed less than this before it was read may change again without changing
/// its times.
const COARSE: Duration = Duration::from_secs(2);

/// The kind of thing that a path names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A regular file. Only such files are opened, because opening a pipe could block forever.
    Regular,
    /// A folder.
    Folder,
    /// Something else, with its name in messages.
    Other(&'static str),
}

impl FileKind {
    /// The name in messages, with an article.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Regular => "a file",
            Self::Folder => "a folder",
            Self::Other(name) => name,
        }
    }
}

/// Facts about a file that are known without reading it. Equal facts mean equal content, unless the file
/// [may hide a change](Self::may_hide_a_change).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// The kind of thing that the path names.
    pub kind: FileKind,
    /// The length in bytes.
    pub length: u64,
    modified: Option<SystemTime>,
    changed: Option<SystemTime>,
    /// Device and inode number, where the system has them.
    identity: [u64; 2],
}

impl Facts {
    /// The facts of a file on disk with this metadata.
    pub fn of(metadata: &fs::Metadata) -> Self {
        let (changed, identity) = unix(metadata);
        let (kind, length) = (kind_of(metadata.file_type()), metadata.len());
        Self { kind, length, modified: metadata.modified().ok(), changed, identity }
    }

    /// The facts of a file whose metadata another library has read. `modified` is the time of the last change of its content,
    /// `changed` that of its content or its metadata, and `identity` the numbers of its device and its inode; zeros where the
    /// system has none.
    pub const fn new(
        (kind, length): (FileKind, u64),
        modified: Option<SystemTime>,
        changed: Option<SystemTime>,
        identity: [u64; 2],
    ) -> Self {
        Self { kind, length, modified, changed, identity }
    }

    /// The facts of something in memory, whose content never changes.
    const fn unchanging(kind: FileKind, length: u64) -> Self {
        Self::new((kind, length), None, None, [0; 2])
    }

    /// True for a regular file.
    pub fn is_file(&self) -> bool {
        self.kind == FileKind::Regular
    }

    /// Returns true if a change after `read`, the time the content was read, could leave the facts unchanged.
    pub fn may_hide_a_change(&self, read: SystemTime) -> bool {
        let near = |time: SystemTime| read.duration_since(time).unwrap_or_else(|e| e.duration()) < COARSE;
        [self.modified, self.changed].into_iter().flatten().any(near)
    }
}

#[cfg(unix)]
fn unix(metadata: &fs::Metadata) -> (Option<SystemTime>, [u64; 2]) {
    use std::os::unix::fs::MetadataExt;
    let seconds = u64::try_from(metadata.ctime()).ok();
    let nanos = u64::try_from(metadata.ctime_nsec()).unwrap_or(0);
    let changed = seconds.map(|s| SystemTime::UNIX_EPOCH + Duration::from_secs(s) + Duration::from_nanos(nanos));
    (changed, [metadata.dev(), metadata.ino()])
}

#[cfg(not(unix))]
fn unix(_metadata: &fs::Metadata) -> (Option<SystemTime>, [u64; 2]) {
    (None, [0; 2])
}

fn kind_of(kind: fs::FileType) -> FileKind {
    if kind.is_file() {
        return FileKind::Regular;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return FileKind::Other("a named pipe");
        }
        if kind.is_socket() {
            return FileKind::Other("a socket");
        }
        if kind.is_block_device() || kind.is_char_device() {
            return FileKind::Other("a device");
        }
    }
    if kind.is_dir() { FileKind::Folder } else { FileKind::Other("something else than a file") }
}

/// An opened file.
pub trait Content: Read + Seek + Send {}

impl<T: Read + Seek + Send> Content for T {}

/// A place from which files are read.
pub trait Files: fmt::Debug + Send + Sync {
    /// The facts of a file.
    ///
    /// # Errors
    /// When the file does not exist or cannot be read.
    fn facts(&self, path: &Path) -> io::Result<Facts>;

    /// Opens a file. The caller has seen in the facts that it is a regular file.
    ///
    /// # Errors
    /// When the file cannot be read.
    fn open(&self, path: &Path) -> io::Result<Box<dyn Content>>;

    /// A path that is equal for all paths to one file. The file need not exist, but its folder should.
    fn identity(&self, path: &Path) -> PathBuf;

    /// The names in a folder, in any order.
    ///
    /// # Errors
    /// When there is no such folder, or it cannot be read.
    fn names(&self, folder: &Path) -> io::Result<Vec<OsString>>;

    /// The real path of a file that may be read; `None` for a file outside, whether it exists or not. A file that does not exist
    /// keeps its path.
    fn real(&self, path: &Path) -> Option<PathBuf> {
        Some(path.to_owned())
    }

    /// The folders above a folder, nearest first.
    fn above(&self, folder: &Path) -> Vec<PathBuf> {
        plain(folder).ancestors().skip(1).map(Path::to_owned).collect()
    }
}

/// The files of the machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl Files for Disk {
    fn facts(&self, path: &Path) -> io::Result<Facts> {
        Ok(Facts::of(&fs::metadata(path)?))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Content>> {
        Ok(Box::new(File::open(path)?))
    }

    fn identity(&self, path: &Path) -> PathBuf {
        let beside = || Some(path.parent()?.canonicalize().ok()?.join(path.file_name()?));
        path.canonicalize().ok().or_else(beside).unwrap_or_else(|| path.to_owned())
    }

    fn names(&self, folder: &Path) -> io::Result<Vec<OsString>> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        Ok(fs::read_dir(folder)?.flatten().map(|entry| entry.file_name()).collect())
    }

    fn above(&self, folder: &Path) -> Vec<PathBuf> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let whole = plain(&std::path::absolute(folder).unwrap_or_default());
        whole.ancestors().skip(1).map(Path::to_owned).collect()
    }
}

/// The content of a file in memory.
#[derive(Clone)]
struct Bytes(Arc<dyn AsRef<[u8]> + Send + Sync>);

impl AsRef<[u8]> for Bytes {
    fn as_ref(&self) -> &[u8] {
        (*self.0).as_ref()
    }
}

/// Files in memory. They do not change, and there are no others.
#[derive(Clone, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, Bytes>,
}

impl fmt::Debug for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.files.keys()).finish()
    }
}

impl Memory {
    /// Adds a file. Folders of its path need not be added.
    #[must_use]
    pub fn with(mut self, path: impl AsRef<Path>, content: impl AsRef<[u8]> + Send + Sync + 'static) -> Self {
        self.files.insert(plain(path.as_ref()), Bytes(Arc::new(content)));
        self
    }
}

impl Files for Memory {
    fn facts(&self, path: &Path) -> io::Result<Facts> {
        let path = plain(path);
        match self.files.get(&path) {
            Some(bytes) => Ok(Facts::unchanging(FileKind::Regular, bytes.as_ref().len() as u64)),
            None if self.files.keys().any(|file| file.starts_with(&path)) => Ok(Facts::unchanging(FileKind::Folder, 0)),
            None => Err(ErrorKind::NotFound.into()),
        }
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn Content>> {
        let bytes = self.files.get(&plain(path)).ok_or(ErrorKind::NotFound)?;
        Ok(Box::new(Cursor::new(bytes.clone())))
    }

    fn identity(&self, path: &Path) -> PathBuf {
        plain(path)
    }

    fn names(&self, folder: &Path) -> io::Result<Vec<OsString>> {
        let folder = plain(folder);
        let inside = self.files.keys().filter_map(|file| file.strip_prefix(&folder).ok()?.iter().next());
        // Names of one folder are neighbours in the sorted map.
        let mut names: Vec<OsString> = inside.map(OsString::from).collect();
        names.dedup();
        if names.is_empty() { Err(ErrorKind::NotFound.into()) } else { Ok(names) }
    }
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut whole = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(whole.pop()),
            Component::CurDir => {}
            part => whole.push(part),
        }
    }
    whole
}

/// A file that may be read. A handle gives access to this file alone.
#[derive(Clone, Debug)]
pub struct FileHandle {
    files: Arc<dyn Files>,
    path: PathBuf,
}

impl FileHandle {
    /// The file at a path of `files`.
    pub fn new(files: Arc<dyn Files>, path: impl Into<PathBuf>) -> Self {
        Self { files, path: path.into() }
    }

    /// A file with this content. Messages name it by `path`.
    pub fn in_memory(path: impl Into<PathBuf>, content: impl AsRef<[u8]> + Send + Sync + 'static) -> Self {
        let path = path.into();
        Self::new(Arc::new(Memory::default().with(&path, content)), path)
    }

    /// The path, which identifies the file in messages and among the files of a graph.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path, for messages.
    pub fn display(&self) -> std::path::Display<'_> {
        self.path.display()
    }

    /// Its facts, without reading it.
    ///
    /// # Errors
    /// When the file does not exist or cannot be read.
    pub fn facts(&self) -> io::Result<Facts> {
        self.files.facts(&self.path)
    }

    /// Opens a regular file.
    ///
    /// # Errors
    /// When it is none, or it cannot be read.
    pub fn open(&self) -> io::Result<Box<dyn Content>> {
        self.opened().map(|(content, _)| content)
    }

    /// Opens a regular file; also returns its length.
    fn opened(&self) -> io::Result<(Box<dyn Content>, u64)> {
        let facts = self.facts()?;
        if !facts.is_file() {
            return Err(io::Error::other("it is not a regular file"));
        }
        Ok((self.files.open(&self.path)?, facts.length))
    }

    /// The whole content of a regular file of at most `limit` bytes.
    ///
    /// # Errors
    /// [`ErrorKind::FileTooLarge`] for a longer file; other errors when it cannot be read or is no regular file.
    pub fn bytes(&self, limit: u64) -> io::Result<Vec<u8>> {
        self.bytes_until(limit, &|| {})
    }

    /// Like [`bytes`](Self::bytes). Calls `check` after each 4 MiB; it may unwind to cancel.
    ///
    /// # Errors
    /// As [`bytes`](Self::bytes).
    pub fn bytes_until(&self, limit: u64, check: &dyn Fn()) -> io::Result<Vec<u8>> {
        /// Bytes read between two checks.
        const PIECE: u64 = 4 << 20;
        let too_large = || io::Error::from(ErrorKind::FileTooLarge);
        let (content, length) = self.opened()?;
        if length > limit {
            return Err(too_large());
        }
        let mut bytes = Vec::new();
        let capacity = usize::try_from(length).map_err(io::Error::other)?.saturating_add(1);
        bytes.try_reserve_exact(capacity).map_err(io::Error::other)?;
        let mut content = content.take(limit.saturating_add(1));
        while content.by_ref().take(PIECE).read_to_end(&mut bytes)? > 0 {
            check();
        }
        if bytes.len() as u64 > limit { Err(too_large()) } else { Ok(bytes) }
    }
}

/// The file of the machine at a path.
impl<P: AsRef<Path> + ?Sized> From<&P> for FileHandle {
    fn from(path: &P) -> Self {
        Self::new(Arc::new(Disk), path.as_ref())
    }
}

impl From<&FileHandle> for FileHandle {
    fn from(file: &FileHandle) -> Self {
        file.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> Memory {
        Memory::default().with("a/./b/../one.txt", b"first").with("a/c/two", vec![7_u8; 9]).with("three", "")
    }

    #[test]
    fn memory_has_files_and_their_folders() {
        let files = memory();
        let facts = |path: &str| files.facts(Path::new(path)).map(|facts| (facts.kind, facts.length)).ok();
        assert_eq!(facts("a/one.txt"), Some((FileKind::Regular, 5)));
        assert_eq!(facts("a/c/../c/two"), Some((FileKind::Regular, 9)));
        assert_eq!(facts("a/c"), Some((FileKind::Folder, 0)));
        assert_eq!(facts("a/on"), None);
        let names = |path: &str| files.names(Path::new(path)).ok();
        assert_eq!(names("a"), Some(vec!["c".into(), "one.txt".into()]));
        assert_eq!(names(""), Some(vec!["a".into(), "three".into()]));
        assert_eq!(names("b"), None);
        assert_eq!(files.identity(Path::new("./a/x/../y")), Path::new("a/y"));
        assert_eq!(files.above(Path::new("a/./c")), [Path::new("a"), Path::new("")]);
        assert!(files.above(Path::new("")).is_empty());
    }

    #[test]
    fn folders_of_the_machine_have_folders_above() {
        let above = Disk.above(Path::new("here/a/../b"));
        assert_eq!(above.first(), std::path::absolute("here").ok().as_ref());
        assert_eq!(above.last().and_then(|top| top.parent()), None);
        assert!(Disk.above(Path::new("")).len() > 1);
    }

    #[test]
    fn handles_read_at_most_the_limit() {
        let files: Arc<dyn Files> = Arc::new(memory());
        let file = FileHandle::new(files.clone(), "a/one.txt");
        assert_eq!(file.bytes(5).unwrap(), b"first");
        assert_eq!(file.bytes(4).unwrap_err().kind(), ErrorKind::FileTooLarge);
        assert!(!file.facts().unwrap().may_hide_a_change(SystemTime::UNIX_EPOCH));
        let folder = FileHandle::new(files.clone(), "a");
        assert!(folder.bytes(9).unwrap_err().to_string().contains("not a regular file"));
        assert_eq!(FileHandle::new(files, "b").open().err().map(|error| error.kind()), Some(ErrorKind::NotFound));
        assert_eq!(FileHandle::in_memory("shibo:/x", b"static").bytes(u64::MAX).unwrap(), b"static");
    }
}
