//! Names inside exported files: valid for each format, and unique where names identify things.
use std::collections::{HashMap, HashSet};

/// Turns a name into one that MaterialX and USD accept.
pub(super) fn identifier(name: &str) -> String {
    let mut out: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !out.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        out.insert(0, '_');
    }
    out
}

/// Turns a name into one word of a line of OBJ.
pub(super) fn word(name: &str) -> String {
    let safe = |c: char| if c.is_whitespace() || c.is_control() || c == '#' { '_' } else { c };
    let word: String = name.chars().map(safe).collect();
    if word.is_empty() { "mesh".to_owned() } else { word }
}

/// Makes names unique and different from `taken`: a repeated name gets a number, `a_2`.
pub(super) fn unique(names: impl IntoIterator<Item = String>, taken: &[&str]) -> Vec<String> {
    let mut used: HashSet<String> = taken.iter().map(ToString::to_string).collect();
    let mut counts: HashMap<String, u32> = HashMap::new();
    let alone = |name: String| {
        let count = counts.entry(name.clone()).or_insert(1);
        let mut own = name.clone();
        while !used.insert(own.clone()) {
            *count += 1;
            own = format!("{name}_{count}");
        }
        own
    };
    names.into_iter().map(alone).collect()
}

/// Escapes a text for a quoted string of Python or JSON.
pub(super) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn makes_names_unique() {
        let of = |names: &[&str], taken: &[&str]| unique(names.iter().map(|name| identifier(name)), taken);
        assert_eq!(of(&["a b", "a_b", "a.b"], &[]), ["a_b", "a_b_2", "a_b_3"]);
        assert_eq!(of(&["右脚", "左脚"], &[]), ["__", "___2"]);
        assert_eq!(of(&["Materials", "1"], &["Materials"]), ["Materials_2", "_1"]);
        // A generated name never equals a given one.
        assert_eq!(of(&["a", "a_2", "a", "a"], &[]), ["a", "a_2", "a_3", "a_4"]);
        assert_eq!(of(&["", "a", "a", "a_2"], &[]), ["_", "a", "a_2", "a_2_2"]);
        assert_eq!(unique(["a b", "a_b", "右 脚", "#"].map(word), &[]), ["a_b", "a_b_2", "右_脚", "_"]);
        // Repeated names do not take quadratic time.
        assert_eq!(unique(vec!["a".to_owned(); 60_000], &[]).last().map(String::as_str), Some("a_60000"));
    }

    #[test]
    fn quotes_as_python_reads() {
        assert_eq!(quoted("a \"b\" \\ é\u{301}\n"), "\"a \\\"b\\\" \\\\ é\u{301}\\n\"");
    }
}
