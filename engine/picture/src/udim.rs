//! Sets of files, one for each UDIM tile: in the name of a set, `<UDIM>` stands for the number of the tile. Tile 1001
//! is the first one, its right neighbour is 1002, and the one above it is 1011.
use super::value::files::Files;
use std::path::{Path, PathBuf};

/// Placeholder for the number.
const MARK: &str = "<UDIM>";
/// Number of tiles in a row.
const ACROSS: u32 = 10;

/// A file of a set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UdimFile {
    /// The number of its tile, 1001 to 2000.
    pub number: u32,
    /// The file.
    pub path: PathBuf,
}

impl UdimFile {
    /// Column and row of the tile, from 0. Columns go to the right, rows upwards.
    #[must_use]
    pub fn place(&self) -> [u32; 2] {
        [(self.number - 1001) % ACROSS, (self.number - 1001) / ACROSS]
    }
}

/// The parts of the file name before and after the placeholder; `None` if a path names a single file.
fn parts(path: &Path) -> Option<(&str, &str)> {
    path.file_name()?.to_str()?.split_once(MARK)
}

/// True if a path names a set.
#[must_use]
pub fn is_udim(path: &Path) -> bool {
    parts(path).is_some()
}

/// The file of the set `set` at a path; `None` for other files.
#[must_use]
pub fn udim_file(set: &Path, path: &Path) -> Option<UdimFile> {
    let (start, end) = parts(set)?;
    let digits = path.file_name()?.to_str()?.strip_prefix(start)?.strip_suffix(end)?;
    let number = digits.parse().ok().filter(|number| digits.len() == 4 && (1001..=2000).contains(number))?;
    Some(UdimFile { number, path: path.to_owned() })
}

/// The files of a set, by number.
///
/// # Errors
/// When the folder cannot be read.
pub fn udim_files(files: &dyn Files, set: &Path) -> std::io::Result<Vec<UdimFile>> {
    let names = files.names(set.parent().unwrap_or(Path::new("")))?;
    // Paths get the folder of the set.
    let mut found: Vec<UdimFile> =
        names.into_iter().filter_map(|name| udim_file(set, &set.with_file_name(name))).collect();
    found.sort_by_key(|file| file.number);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::files::Disk;

    #[test]
    fn finds_the_files_of_a_set() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "a.1002.png",
            "a.1001.png",
            "a.1011.png",
            "a.0999.png",
            "a.10001.png",
            "a.+100.png",
            "b.1001.png",
            "a.1003.jpg",
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let set = folder.path().join("a.<UDIM>.png");
        let files = udim_files(&Disk, &set).unwrap();
        assert_eq!(
            files.iter().map(|file| (file.number, file.place())).collect::<Vec<_>>(),
            [(1001, [0, 0]), (1002, [1, 0]), (1011, [0, 1])]
        );
        assert_eq!(files[1].path, folder.path().join("a.1002.png"));
        assert!(is_udim(&set) && !is_udim(&files[0].path));
    }
}
