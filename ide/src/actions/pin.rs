//! Writes, replaces and removes the pin of a graph.
use super::super::file::File;
use super::super::insert::{after_comma, indent, put_above, remove};
use super::super::rename::Edit;
use super::super::view::Body;

/// The text of a graph pinned at a change, or without a pin for `None`. Versions that the pin holds stay. `None` if the
/// text is no graph.
pub fn pinned(text: &str, change: Option<u32>) -> Option<String> {
    let file = File::new("", text);
    let body = file.body()?;
    let edit = match (body.get("pins"), change) {
        (None, None) => return Some(text.to_owned()),
        (Some(pins), None) => remove(&file, body, pins),
        (Some(pins), Some(change)) => {
            let value = pins.value.as_ref()?;
            let number = value.body().and_then(|body| body.value("change")).unwrap_or(value);
            Edit { range: number.range.clone(), text: change.to_string() }
        }
        (None, Some(change)) => add(&file, body, &format!("pins: {change}"))?,
    };
    let mut text = text.to_owned();
    text.replace_range(edit.range, &edit.text);
    Some(text)
}

/// The change at which a text is pinned.
pub fn pinned_at(text: &str) -> Option<u32> {
    if !text.contains("pins") {
        return None;
    }
    let file = File::new("", text);
    let pins = file.body()?.value("pins")?;
    let number = pins.body().and_then(|body| body.value("change")).unwrap_or(pins);
    file.at(&number.range).parse().ok()
}

/// True if the pins of a text hold a version of a kind.
pub fn is_held(file: &File, kind: &str) -> bool {
    held(file).is_some_and(|hold| hold.get(kind).is_some())
}

/// The versions that the pins of a text hold.
pub(super) fn held(file: &File) -> Option<Body> {
    let whole = file.whole();
    let pins = whole.body()?.value("pins")?.body()?;
    pins.value("hold")?.body().cloned()
}

/// Adds an entry behind `version`, or above the first one.
fn add(file: &File, body: &Body, entry: &str) -> Option<Edit> {
    let Some(version) = body.get("version") else { return Some(put_above(file, body.items.first()?, entry)) };
    let (text, end) = (&file.text, version.range.end);
    let line = text[..version.range.start].rfind('\n').map_or(0, |at| at + 1);
    let wide = text[line..version.range.start].trim().is_empty();
    let (comma, at) = match after_comma(text, end, body.inside().end) {
        Some(at) => ("", at),
        None => (",", end),
    };
    let before = if wide { format!("\n{}", indent(text, version.range.start)) } else { " ".to_owned() };
    Some(Edit { range: at..at, text: format!("{comma}{before}{entry},") })
}

#[cfg(test)]
mod tests {
    use super::pinned;

    #[test]
    fn writes_replaces_and_removes_pins() {
        for (before, after) in [
            ("(\n  version: 1, // one\n  nodes: {},\n)", "(\n  version: 1,\n  pins: 7, // one\n  nodes: {},\n)"),
            ("(version: 1, nodes: {})", "(version: 1, pins: 7, nodes: {})"),
            ("(nodes: {}, version: 1)", "(nodes: {}, version: 1, pins: 7,)"),
            ("// A.\n(\n  // Nodes.\n  nodes: {},\n)", "// A.\n(\n  pins: 7,\n  // Nodes.\n  nodes: {},\n)"),
            ("(nodes: {})", "(pins: 7, nodes: {})"),
            ("(pins: 3, nodes: {})", "(pins: 7, nodes: {})"),
            ("(pins: (change: 3, hold: { \"A\": 2 }))", "(pins: (change: 7, hold: { \"A\": 2 }))"),
        ] {
            let text = pinned(before, Some(7)).unwrap();
            assert_eq!(text, after);
            assert_eq!(pinned(&text, Some(7)).unwrap(), text, "a second pin changes nothing");
            assert!(!pinned(&text, None).unwrap().contains("pins"), "{text}");
        }
        assert_eq!(pinned("(nodes: {})", None).as_deref(), Some("(nodes: {})"));
        for text in ["", "(", "\"x\"", "()"] {
            assert_eq!(pinned(text, Some(1)), None, "{text}");
        }
    }
}
