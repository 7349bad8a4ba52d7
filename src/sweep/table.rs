//! `sweep.csv`: a row for every file, so that a later run knows the existing files. Runs that render only some
//! variants, on several machines at once, have their own tables such as `sweep.5-8.csv`; a run of all variants merges
//! these.
use super::Variants;
use crate::quit::Quit;
use shibo_bridge::write;
use std::collections::HashMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The table of a folder.
pub(crate) struct Table {
    path: PathBuf,
    head: Vec<String>,
    known: HashMap<String, Vec<String>>,
    /// True if the file contains only complete rows of this sweep.
    clean: bool,
    /// Rows of this run, in its order.
    rows: Vec<Vec<String>>,
    /// Tables of some variants to merge.
    parts: Vec<PathBuf>,
}

impl Table {
    /// Opens the table in `dir` for a sweep through `names`, or for some of its variants. Rows of another sweep and
    /// incomplete rows are dropped.
    pub(crate) fn open(dir: &Path, names: &[&str], some: Option<Variants>) -> Self {
        let head: Vec<String> =
            ["file"].iter().chain(names).chain(&["key", "seconds"]).map(ToString::to_string).collect();
        let whole = dir.join("sweep.csv");
        let (path, parts) = match some {
            Some(Variants { first, last }) => (dir.join(format!("sweep.{first}-{last}.csv")), Vec::new()),
            None => (whole.clone(), tables(dir)),
        };
        // Other tables belong to other sweeps or to the user.
        let parts: Vec<PathBuf> = parts.into_iter().filter(|path| is_of(path, &head)).collect();
        let others = parts.iter().chain((path != whole).then_some(&whole));
        let others: Vec<_> = others.flat_map(|path| read(path, &head).0).collect();
        let (rows, clean) = read(&path, &head);
        let known = others.into_iter().chain(rows).map(|row| (row[0].clone(), row)).collect();
        Self { path, head, known, clean, rows: Vec::new(), parts }
    }

    /// Path of the file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
    /// Returns whether a file was made for this key and still exists.
    pub(crate) fn has(&self, file: &Path, key: &str) -> bool {
        let row = self.known.get(&name(file));
        row.is_some_and(|row| row[row.len() - 2] == key)
            && file.metadata().is_ok_and(|meta| meta.is_file() && meta.len() > 0)
    }

    /// Adopts the earlier row of an existing file.
    pub(crate) fn keep(&mut self, file: &Path) {
        self.rows.extend(self.known.get(&name(file)).cloned());
    }

    /// Adds rows of files just written, so that these are not made again if the run is killed later.
    pub(crate) fn add(
        &mut self,
        files: &[(PathBuf, String)],
        values: &[(&str, &str)],
        seconds: f64,
    ) -> Result<(), Quit> {
        let row = |(file, key): &(PathBuf, String)| {
            let values = values.iter().map(|(_, value)| (*value).to_owned());
            let end = [key.clone(), format!("{seconds:.3}")];
            std::iter::once(name(file)).chain(values).chain(end).collect::<Vec<_>>()
        };
        let rows: Vec<Vec<String>> = files.iter().map(row).collect();
        if !self.clean {
            // Earlier rows stay until their files are made again.
            let mut all = vec![self.head.clone()];
            let mut known: Vec<_> = self.known.values().cloned().collect();
            known.sort();
            all.extend(known);
            self.replace(&lines(&all))?;
            self.clean = true;
        }
        let text = lines(&rows);
        let written = OpenOptions::new().append(true).open(&self.path).and_then(|mut file| file.write_all(&text));
        written.map_err(|e| failed(&self.path, &e))?;
        self.rows.extend(rows);
        Ok(())
    }

    /// Sorts the rows unless they are in order.
    pub(crate) fn finish(&self) -> Result<(), Quit> {
        let mut all = vec![self.head.clone()];
        all.extend(self.rows.iter().cloned());
        let text = lines(&all);
        if !std::fs::read(&self.path).is_ok_and(|before| before == text) {
            self.replace(&text)?;
        }
        // The merged tables are no longer needed; failing to remove one does no harm.
        self.parts.iter().for_each(|part| drop(std::fs::remove_file(part)));
        Ok(())
    }

    fn replace(&self, text: &[u8]) -> Result<(), Quit> {
        write::whole_with_folders(&self.path, text).map_err(|e| failed(&self.path, &e))
    }
}

/// Tables of some variants in a folder.
fn tables(dir: &Path) -> Vec<PathBuf> {
    let is_table = |path: &PathBuf| {
        let name = name(path);
        let span = name.strip_prefix("sweep.").and_then(|name| name.strip_suffix(".csv"));
        span.is_some_and(|span| span.contains('-') && super::variants(span).is_ok())
    };
    let mut found: Vec<PathBuf> =
        dir.read_dir().into_iter().flatten().flatten().map(|entry| entry.path()).filter(is_table).collect();
    found.sort();
    found
}

/// Returns true if a file is a table with this head.
fn is_of(path: &Path, head: &[String]) -> bool {
    let file = std::fs::symlink_metadata(path).is_ok_and(|meta| meta.is_file());
    file && std::fs::read(path).is_ok_and(|text| text.starts_with(&lines(&[head.to_vec()])))
}

/// Complete rows of a table with this head, and true if the file contains nothing else.
fn read(path: &Path, head: &[String]) -> (Vec<Vec<String>>, bool) {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
    let rows = reader.records().map_while(Result::ok).map(|row| row.iter().map(str::to_owned).collect::<Vec<_>>());
    let mut rows: Vec<Vec<String>> = rows.collect();
    let ours = rows.first().is_some_and(|row| row == head);
    let clean = ours && lines(&rows) == text.as_bytes();
    if !clean {
        // The last row might be cut within a value.
        rows.pop();
    }
    let rows = if ours && !rows.is_empty() { rows.split_off(1) } else { Vec::new() };
    (rows.into_iter().filter(|row| row.len() == head.len()).collect(), clean)
}

fn failed(path: &Path, error: &std::io::Error) -> Quit {
    Quit::failed(format!("cannot write `{}`: {error}", path.display()))
}

fn name(file: &Path) -> String {
    file.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned())
}

fn lines(rows: &[Vec<String>]) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        // Writing into memory does not fail.
        let _ = writer.write_record(row);
    }
    writer.into_inner().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merges_tables_of_some_variants() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        for (first, seed) in [(1, "5"), (2, "6"), (3, "7")] {
            let name = format!("{seed}.png");
            std::fs::write(file(&name), "a").unwrap();
            let some = Some(Variants { first, last: first });
            let mut table = Table::open(dir.path(), &["seed"], some);
            table.add(&[(file(&name), "k".into())], &[("seed", seed)], 0.5).unwrap();
            table.finish().unwrap();
        }
        // A table that was cut, and a table of another sweep.
        std::fs::write(file("sweep.3-3.csv"), "file,seed,key,seconds\n7.png,7,k").unwrap();
        std::fs::write(file("sweep.4-9.csv"), "file,other,key,seconds\n9.png,7,k,1\n").unwrap();
        std::fs::write(file("sweep.mine.csv"), "").unwrap();
        let mut all = Table::open(dir.path(), &["seed"], None);
        assert!(all.has(&file("5.png"), "k") && all.has(&file("6.png"), "k") && !all.has(&file("7.png"), "k"));
        all.keep(&file("5.png"));
        all.keep(&file("6.png"));
        all.finish().unwrap();
        let mut names: Vec<String> = dir.path().read_dir().unwrap().map(|e| name(&e.unwrap().path())).collect();
        names.sort();
        assert_eq!(names, ["5.png", "6.png", "7.png", "sweep.4-9.csv", "sweep.csv", "sweep.mine.csv"]);
        assert!(Table::open(dir.path(), &["seed"], Some(Variants { first: 1, last: 2 })).has(&file("6.png"), "k"));
    }

    #[test]
    fn keeps_complete_rows_of_cut_table() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        std::fs::write(file("a,1.png"), "a").unwrap();
        std::fs::write(file("b.png"), "b").unwrap();
        let mut table = Table::open(dir.path(), &["seed"], None);
        table.add(&[(file("a,1.png"), "k1".into())], &[("seed", "1")], 0.5).unwrap();
        table.add(&[(file("b.png"), "k2".into())], &[("seed", "x,\n\"y")], 1.0).unwrap();
        table.finish().unwrap();
        let whole = std::fs::read(file("sweep.csv")).unwrap();
        let again = Table::open(dir.path(), &["seed"], None);
        assert!(again.has(&file("a,1.png"), "k1") && again.has(&file("b.png"), "k2"));
        assert!(!again.has(&file("a,1.png"), "k2") && !again.has(&file("none"), "k1"));
        assert!(!Table::open(dir.path(), &["other"], None).has(&file("b.png"), "k2"));
        for length in 0..whole.len() {
            std::fs::write(file("sweep.csv"), &whole[..length]).unwrap();
            let mut table = Table::open(dir.path(), &["seed"], None);
            for (name, key, seed, seconds) in [("a,1.png", "k1", "1", 0.5), ("b.png", "k2", "x,\n\"y", 1.0)] {
                if table.has(&file(name), key) {
                    table.keep(&file(name));
                } else {
                    table.add(&[(file(name), key.into())], &[("seed", seed)], seconds).unwrap();
                }
            }
            table.finish().unwrap();
            assert_eq!(std::fs::read(file("sweep.csv")).unwrap(), whole, "{length}");
        }
    }
}
