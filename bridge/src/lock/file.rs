//! `shibo.lock`: the pictures of the graphs in a folder, as they were when the graphs were pinned.
use super::sample::{Look, Sample};
use serde::{Deserialize, Serialize};
use shibo_node::ron_options;
use std::collections::BTreeMap;

/// The name of the file.
pub const LOCK: &str = "shibo.lock";

/// The largest file that is read, in bytes.
pub const MOST_BYTES: u64 = 16 << 20;

/// The graphs of a folder, by the names of their files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Lock(pub BTreeMap<String, Entry>);

/// A graph as it was when it was pinned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The change whose versions of nodes made the pictures.
    pub pins: u32,
    /// The text, without comments, layout and the order of named things, as 16 hexadecimal digits.
    pub text: String,
    /// Files and imported graphs, by their paths from the folder, as 16 hexadecimal digits of their content.
    #[serde(default)]
    pub files: BTreeMap<String, String>,
    /// The pictures by their names.
    #[serde(default)]
    pub pictures: BTreeMap<String, Sample>,
}

impl Lock {
    /// Reads the text of a file.
    ///
    /// # Errors
    /// The place and the reason, as a message.
    pub fn read(text: &str) -> Result<Self, String> {
        ron_options().from_str(text).map_err(|error| format!("{}: {}", error.span.start, error.code))
    }

    /// The text of a file: sorted, and a line for each picture, so that versions of the file can be compared.
    pub fn written(&self) -> String {
        let mut out = String::from(
            "// The pictures of pinned graphs. `shibo pin` writes this file, `shibo verify` reads it.\n{\n",
        );
        for (name, entry) in &self.0 {
            out += &format!("    {name:?}: (\n        pins: {}, text: {:?},\n", entry.pins, entry.text);
            if !entry.files.is_empty() {
                out += "        files: {\n";
                entry.files.iter().for_each(|(path, hash)| out += &format!("            {path:?}: {hash:?},\n"));
                out += "        },\n";
            }
            out += "        pictures: {\n";
            for (name, sample) in &entry.pictures {
                let look: Vec<String> = sample.look.iter().map(described).collect();
                let look = if look.is_empty() { String::new() } else { format!(", look: [{}]", look.join(", ")) };
                out += &format!("            {name:?}: (bits: {:?}{look}),\n", sample.bits);
            }
            out += "        },\n    ),\n";
        }
        out + "}\n"
    }
}

fn described(look: &Look) -> String {
    format!("({:?}, {:?}, {:?}, {:?}, {:?})", look.0, look.1, look.2, look.3, look.4)
}

/// Merges two changed versions of a file. Entries that one side changed are taken. Entries that both sides changed in
/// different ways are left out, so that `shibo verify` calls them not pinned. Source: LASTING §3.
pub fn merge(base: &Lock, ours: &Lock, theirs: &Lock) -> Lock {
    let names = base.0.keys().chain(ours.0.keys()).chain(theirs.0.keys());
    let mut merged = Lock::default();
    for name in names {
        let [base, ours, theirs] = [base, ours, theirs].map(|lock| lock.0.get(name));
        let taken = match (ours == base, theirs == base) {
            (true, _) => theirs,
            (_, true) => ours,
            _ if ours == theirs => ours,
            _ => None,
        };
        if let Some(entry) = taken {
            merged.0.insert(name.clone(), entry.clone());
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(bits: &str) -> Entry {
        let look = vec![Look(118.2, 21.4, 6.1, 8.0, 9.7), Look(0.0, -1.0, 0.25, 1e-3, 3e7)];
        let pictures = [("lit".to_owned(), Sample { bits: bits.to_owned(), look })].into();
        Entry { pins: 4, text: "0123".into(), files: [("a \"b\".png".to_owned(), "4567".to_owned())].into(), pictures }
    }

    fn lock(entries: &[(&str, &str)]) -> Lock {
        Lock(entries.iter().map(|(name, bits)| ((*name).to_owned(), entry(bits))).collect())
    }

    #[test]
    fn reads_what_it_writes() {
        let lock = lock(&[("b.ron", "1"), ("a.ron", "2")]);
        let text = lock.written();
        assert_eq!(Lock::read(&text), Ok(lock), "{text}");
        assert!(
            text.contains(r#"            "lit": (bits: "2", look: [(118.2, 21.4, 6.1, 8.0, 9.7), (0.0, -1.0"#),
            "{text}"
        );
        assert_eq!(Lock::read(&Lock::default().written()), Ok(Lock::default()));
        for wrong in ["", "[]", "{ \"a\": () }", "{ \"a\": (pins: 1, text: \"\", pixels: {}) }"] {
            assert!(Lock::read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn merges_entries_that_one_side_changed() {
        let base = lock(&[("same", "0"), ("ours", "0"), ("theirs", "0"), ("both", "0"), ("alike", "0"), ("gone", "0")]);
        let ours = lock(&[("same", "0"), ("ours", "1"), ("theirs", "0"), ("both", "1"), ("alike", "3"), ("gone", "0")]);
        let theirs =
            lock(&[("same", "0"), ("ours", "0"), ("theirs", "2"), ("both", "2"), ("alike", "3"), ("new", "2")]);
        let expected = lock(&[("same", "0"), ("ours", "1"), ("theirs", "2"), ("alike", "3"), ("new", "2")]);
        assert_eq!(merge(&base, &ours, &theirs), expected);
    }
}
