//! Entries that a program writes: a preset with a comment above it, and parameters that it adds to a text to drive the canvas or nodes.
use super::super::file::{File, Section};
use super::super::insert::{add_to, append, indent};
use super::super::names::quote;
use super::super::rename::Edit;
use super::super::world::Cx;
use super::assign::{check_preset_name, preset_of};

/// Adds a preset with these values, given as RON, or replaces the preset of that name. A line `comment` stands above it where the
/// presets have lines of their own; it replaces a comment there that begins with the same word.
///
/// # Errors
/// A wrong name, or a parameter that the file does not declare.
pub fn put_preset(cx: Cx<'_>, name: &str, comment: &str, values: &[(String, String)]) -> Result<Vec<Edit>, String> {
    check_preset_name(name)?;
    let body = preset_of(cx, values)?;
    let text = &cx.file.text;
    if let Some(item) = cx.file.entry(Section::Presets, name) {
        let value = item.value.as_ref().map_or(item.range.clone(), |value| value.range.clone());
        let mut edits = vec![Edit { range: value, text: body }];
        let line = text[..item.range.start].rfind('\n').map_or(0, |at| at + 1);
        let deep = &text[line..item.range.start];
        if deep.trim().is_empty() && line > 0 {
            let above = text[..line - 1].rfind('\n').map_or(0, |at| at + 1);
            let word = comment.split(' ').next().unwrap_or_default();
            let own = text[above..line - 1].trim().strip_prefix("// ").is_some_and(|said| said.starts_with(word));
            let range = if own { above..line - 1 } else { line..line };
            let end = if own { "" } else { "\n" };
            // A carriage return before the line break stays.
            let range = if own && text[range.clone()].ends_with('\r') { range.start..range.end - 1 } else { range };
            edits.push(Edit { range, text: format!("{deep}// {comment}{end}") });
        }
        return Ok(edits);
    }
    let entry = format!("{}: {body}", quote(name));
    let entry = match lines(cx.file) {
        Some(deep) => format!("// {comment}\n{deep}{entry}"),
        None => entry,
    };
    Ok(add_to(cx.file, Section::Presets, &entry))
}

/// The indentation of presets with lines of their own; `None` if they share a line.
fn lines(file: &File) -> Option<String> {
    let text = &file.text;
    let Some(body) = file.section(Section::Presets) else {
        let nodes = file.home(Section::Presets)?.get(Section::Nodes.key())?;
        return Some(format!("{}  ", indent(text, nodes.range.start)));
    };
    let last = body.items.last()?;
    let begins = |at: usize| text[..at].trim_end_matches([' ', '\t']).ends_with('\n');
    (begins(last.range.start) && begins(body.inside().end)).then(|| indent(text, last.range.start).to_owned())
}

/// Adds parameters, given as entries `"name": Number(…)`, and sets fields of the canvas and of nodes, given as RON.
///
/// # Errors
/// A node that the file does not have, or a text that is no graph.
pub fn driven(
    cx: Cx<'_>,
    params: &str,
    canvas: &[(&str, &str)],
    fields: &[(&str, &str, &str)],
) -> Result<Vec<Edit>, String> {
    let none = || "the file is no graph".to_owned();
    let mut edits = add_to(cx.file, Section::Params, params);
    let top = cx.file.body().ok_or_else(none)?;
    match top.get("canvas").and_then(|item| item.value.as_ref()?.body()) {
        Some(body) => {
            for (name, value) in canvas {
                match body.value(name) {
                    Some(given) => edits.push(Edit { range: given.range.clone(), text: (*value).to_owned() }),
                    None => edits.extend(append(cx.file, body, &format!("{name}: {value}"))),
                }
            }
        }
        None if canvas.is_empty() => {}
        None => {
            let nodes = top.get(Section::Nodes.key()).ok_or_else(none)?;
            let set: Vec<String> = canvas.iter().map(|(name, value)| format!("{name}: {value}")).collect();
            let at = nodes.range.start;
            edits.push(Edit { range: at..at, text: format!("canvas: ({}), ", set.join(", ")) });
        }
    }
    for (node, name, value) in fields {
        let item = cx.file.entry(Section::Nodes, node).and_then(|item| item.value.as_ref()?.body());
        let body = item.ok_or_else(|| format!("the file has no node `{node}`"))?;
        match body.value(name) {
            Some(given) => edits.push(Edit { range: given.range.clone(), text: (*value).to_owned() }),
            // A second field at the end is joined to the first one.
            None => match edits
                .iter_mut()
                .find(|edit| edit.range.start == edit.range.end && body.range.contains(&edit.range.start))
            {
                Some(edit) => edit.text += &format!(", {name}: {value}"),
                None => edits.extend(append(cx.file, body, &format!("{name}: {value}"))),
            },
        }
    }
    Ok(edits)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::super::apply;
    use super::*;
    use crate::Workspace;
    use std::path::Path;
    use std::sync::Arc;

    const TEXT: &str = "(
  canvas: (size_mm: 40), // kept
  params: { \"a\": Number(default: 1.0, range: (0, 9)), \"b\": Color(default: \"#102030\") },
  presets: {
    \"old\": { \"a\": 2.0 },
  },
  nodes: { \"n\": Relief(azimuth: 3) },
)
";

    fn edited(text: &str, of: impl Fn(Cx<'_>) -> Result<Vec<Edit>, String>) -> Result<String, String> {
        let mut workspace = Workspace::new(Arc::new(shibo_library::registry()), Vec::new());
        let file = workspace.open(Path::new("a.ron"), text);
        Ok(apply(text, &of(Cx { world: &workspace, file: &file })?))
    }

    #[test]
    fn puts_presets_and_keeps_all_other_text() {
        let values = [("a".to_owned(), "3".to_owned()), ("b".to_owned(), "\"#ffffff\"".to_owned())];
        let put = |text: &str, name: &str, comment: &str| edited(text, |cx| put_preset(cx, name, comment, &values));
        let new = put(TEXT, "new", "fitted to x: 1").unwrap();
        let entry = "    // fitted to x: 1\n    \"new\": { \"a\": 3.0, \"b\": \"#ffffff\" },\n";
        assert_eq!(new.replace(entry, ""), TEXT);
        // A comment at the end of the line stays with its entry.
        let noted = TEXT.replace("{ \"a\": 2.0 },", "{ \"a\": 2.0 } // own");
        let kept = put(&noted, "new", "fitted to x: 1").unwrap();
        assert_eq!(kept.replace(entry, ""), noted.replace("} // own", "}, // own"));
        // The second time, the comment is replaced too.
        let again = put(&new, "new", "fitted to y: 2").unwrap();
        assert_eq!(again, new.replace("fitted to x: 1", "fitted to y: 2"));
        let other = put(TEXT, "old", "fitted to x: 1").unwrap();
        assert_eq!(other, TEXT.replace("    \"old\": { \"a\": 2.0 }", &entry[..entry.len() - 2].replace("new", "old")));
        let inline = put("(params: { \"a\": Number(default: 1), \"b\": Color(default: \"#fff\") }, presets: { \"p\": {} }, nodes: {})", "q", "c").unwrap();
        assert!(inline.contains("\"p\": {}, \"q\": { \"a\": 3, ") && !inline.contains("//"), "{inline}");
        let missing =
            put("(params: { \"a\": Number(default: 1), \"b\": Color(default: \"#fff\") },\n  nodes: {})", "q", "c")
                .unwrap();
        assert!(missing.contains("  presets: {\n    // c\n    \"q\": { "), "{missing}");
        assert!(put(TEXT, "a/b", "c").is_err());
        assert!(edited(TEXT, |cx| put_preset(cx, "p", "c", &[("z".into(), "1".into())])).is_err());
    }

    #[test]
    fn drives_canvas_and_nodes_by_parameters() {
        let fields = [("n", "azimuth", "\"$x\""), ("n", "elevation", "\"$y\""), ("n", "exposure", "2")];
        let text = edited(TEXT, |cx| {
            driven(cx, "\"x\": Number(default: 1)", &[("size_mm", "\"$x\""), ("seed", "3")], &fields)
        });
        let text = text.unwrap();
        assert!(text.contains("canvas: (size_mm: \"$x\", seed: 3), // kept"), "{text}");
        assert!(text.contains("Relief(azimuth: \"$x\", elevation: \"$y\", exposure: 2)"), "{text}");
        assert!(text.contains("\"x\": Number(default: 1)"), "{text}");
        assert!(edited(TEXT, |cx| driven(cx, "", &[], &[("m", "azimuth", "1")])).is_err());
    }
}
