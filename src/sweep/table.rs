//! `sweep.csv`: a row for every file, so that a second run knows what is there.
use crate::quit::Quit;
use crate::write;
use std::collections::HashMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The table in a folder.
pub(crate) struct Table {
    path: PathBuf,
    head: Vec<String>,
    known: HashMap<String, Vec<String>>,
    /// Whether the file holds nothing but whole rows of this sweep.
    clean: bool,
    /// The rows of this run, in its order.
    rows: Vec<Vec<String>>,
}

impl Table {
    /// The table in `dir` for a sweep through `names`. Rows of another sweep are forgotten, and one that was not written to
    /// its end, too.
    pub(crate) fn open(dir: &Path, names: &[&str]) -> Self {
        let head: Vec<String> =
            ["file"].iter().chain(names).chain(&["key", "seconds"]).map(ToString::to_string).collect();
        let path = dir.join("sweep.csv");
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
        let rows = reader.records().map_while(Result::ok).map(|row| row.iter().map(str::to_owned).collect::<Vec<_>>());
        let mut rows: Vec<Vec<String>> = rows.collect();
        let clean = rows.first() == Some(&head) && lines(&rows) == text.as_bytes();
        if !clean {
            // The last row might be cut within a value.
            rows.pop();
        }
        let rows = if rows.first() == Some(&head) { rows.split_off(1) } else { Vec::new() };
        let rows = rows.into_iter().filter(|row| row.len() == head.len());
        let known = rows.map(|row| (row[0].clone(), row)).collect();
        Self { path, head, known, clean, rows: Vec::new() }
    }

    /// Whether a file was made for this key and is still there; if so, its row stays.
    pub(crate) fn has(&self, file: &Path, key: &str) -> bool {
        let row = self.known.get(&name(file));
        row.is_some_and(|row| row[row.len() - 2] == key)
            && file.metadata().is_ok_and(|meta| meta.is_file() && meta.len() > 0)
    }

    /// Takes over the row of a file that is there.
    pub(crate) fn keep(&mut self, file: &Path) {
        self.rows.extend(self.known.get(&name(file)).cloned());
    }

    /// Adds the rows of files that were just written, so that a run that is killed later does not make them again.
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
            // What was known stays until it is made anew.
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

    /// Brings the rows into their order, unless they are.
    pub(crate) fn finish(&self) -> Result<(), Quit> {
        let mut all = vec![self.head.clone()];
        all.extend(self.rows.iter().cloned());
        let text = lines(&all);
        if std::fs::read(&self.path).is_ok_and(|before| before == text) {
            return Ok(());
        }
        self.replace(&text)
    }

    fn replace(&self, text: &[u8]) -> Result<(), Quit> {
        write::whole(&self.path, text).map_err(|e| failed(&self.path, &e))
    }
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
        // Memory takes everything.
        let _ = writer.write_record(row);
    }
    writer.into_inner().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_survives_being_torn() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        std::fs::write(file("a,1.png"), "a").unwrap();
        std::fs::write(file("b.png"), "b").unwrap();
        let mut table = Table::open(dir.path(), &["seed"]);
        table.add(&[(file("a,1.png"), "k1".into())], &[("seed", "1")], 0.5).unwrap();
        table.add(&[(file("b.png"), "k2".into())], &[("seed", "x,\n\"y")], 1.0).unwrap();
        table.finish().unwrap();
        let whole = std::fs::read(file("sweep.csv")).unwrap();
        let again = Table::open(dir.path(), &["seed"]);
        assert!(again.has(&file("a,1.png"), "k1") && again.has(&file("b.png"), "k2"));
        assert!(!again.has(&file("a,1.png"), "k2") && !again.has(&file("none"), "k1"));
        assert!(!Table::open(dir.path(), &["other"]).has(&file("b.png"), "k2"));
        for length in 0..whole.len() {
            std::fs::write(file("sweep.csv"), &whole[..length]).unwrap();
            let mut table = Table::open(dir.path(), &["seed"]);
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
