//! Commits a set of files together.
use crate::atomic::remove;
use crate::{AtomicFile, WriteError};
use std::io::ErrorKind;

/// Gives complete files their names. `parts` refer to no other file; `documents` refer to files before them.
///
/// Existing documents are removed first, and the new ones are written last. So a document never refers to files of
/// another run, even if the program is killed in between. In that case the document is missing until the next run.
///
/// # Errors
/// If the system refuses. If it refuses to remove a document, nothing has changed.
pub(super) fn commit(parts: Vec<AtomicFile>, documents: Vec<AtomicFile>) -> Result<(), WriteError> {
    // Remove documents before the files that they refer to.
    for document in documents.iter().rev() {
        match remove(document.target()) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(WriteError::at(document.target(), error)),
            _ => {}
        }
    }
    parts.into_iter().chain(documents).try_for_each(|file| {
        let path = file.target().to_owned();
        file.commit().map_err(|error| WriteError::at(&path, error))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::path::Path;

    fn text(folder: &Path, name: &str) -> Option<String> {
        std::fs::read_to_string(folder.join(name)).ok()
    }

    fn file(folder: &Path, name: &str, text: &str) -> AtomicFile {
        let mut file = AtomicFile::create(folder.join(name)).unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file
    }

    const PARTS: [&str; 3] = ["a.png", "b.png", "c.png"];
    const DOCUMENTS: [&str; 2] = ["m.mtl", "m.obj"];

    /// A folder with the set of one run, and the files of the next run, complete but without names.
    fn two_runs() -> (tempfile::TempDir, Vec<AtomicFile>, Vec<AtomicFile>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        PARTS.iter().chain(&DOCUMENTS).for_each(|name| std::fs::write(path.join(name), "old").unwrap());
        let new = |name: &&str| file(path, name, "new");
        let (parts, documents) = (PARTS.iter().map(new).collect(), DOCUMENTS.iter().map(new).collect());
        (folder, parts, documents)
    }

    #[test]
    fn replaces_all_files() {
        let (folder, parts, documents) = two_runs();
        commit(parts, documents).unwrap();
        for name in PARTS.iter().chain(&DOCUMENTS) {
            assert_eq!(text(folder.path(), name).as_deref(), Some("new"), "{name}");
        }
        assert_eq!(folder.path().read_dir().unwrap().count(), 5, "nothing else is left");
    }

    /// However early the commit fails, no remaining document refers to parts of two runs. Each name in turn is made to
    /// fail.
    #[test]
    fn documents_never_name_parts_of_another_run() {
        for (stop, name) in PARTS.iter().chain(&DOCUMENTS).enumerate() {
            let (folder, parts, documents) = two_runs();
            let path = folder.path();
            std::fs::remove_file(path.join(name)).unwrap();
            std::fs::create_dir(path.join(name)).unwrap();
            commit(parts, documents).unwrap_err();
            let found = |name: &&str| text(path, name).unwrap_or_default();
            let parts: Vec<String> = PARTS.iter().filter(|part| *part != name).map(found).collect();
            for document in DOCUMENTS.iter().filter(|document| *document != name) {
                let same = parts.iter().all(|part| Some(part) == text(path, document).as_ref());
                assert!(same || text(path, document).is_none(), "{document} is there after {stop} names: {parts:?}");
            }
        }
    }

    #[test]
    fn keeps_the_old_set_if_a_document_cannot_be_taken_away() {
        let (folder, parts, documents) = two_runs();
        std::fs::remove_file(folder.path().join("m.obj")).unwrap();
        std::fs::create_dir(folder.path().join("m.obj")).unwrap();
        commit(parts, documents).unwrap_err();
        for name in ["a.png", "b.png", "c.png", "m.mtl"] {
            assert_eq!(text(folder.path(), name).as_deref(), Some("old"), "{name}");
        }
    }
}
