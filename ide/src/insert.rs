//! Inserts and removes entries.
use super::file::{File, Section};
use super::rename::Edit;
use super::view::{Body, Item};

/// Indentation of the line at a position.
pub(crate) fn indent(text: &str, at: usize) -> &str {
    let start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    let line = &text[start..];
    &line[..line.len() - line.trim_start_matches([' ', '\t']).len()]
}

/// Position after the comma that follows an item, if there is one; comments in between are skipped like blanks.
pub(crate) fn after_comma(text: &str, from: usize, end: usize) -> Option<usize> {
    let mut at = from;
    loop {
        let rest = text.get(at..end)?;
        let trimmed = rest.trim_start();
        at += rest.len() - trimmed.len();
        if trimmed.starts_with(',') {
            return Some(at + 1);
        }
        if !trimmed.starts_with("//") {
            return None;
        }
        at += trimmed.find('\n').unwrap_or(trimmed.len());
    }
}

/// The end of a comment on the rest of the line, which belongs to the entry before it; `at` if there is none.
fn past_comment(text: &str, at: usize) -> usize {
    let rest = text[at..].split('\n').next().unwrap_or_default();
    if rest.trim_start().starts_with("//") { at + rest.trim_end_matches('\r').len() } else { at }
}

/// Adds an entry after the last one in brackets. It has a line of its own if the last one has.
pub(crate) fn append(file: &File, body: &Body, entry: &str) -> Vec<Edit> {
    let text = &file.text;
    let inside = body.inside();
    let begins_line = |at: usize| text[..at].trim_end_matches([' ', '\t']).ends_with('\n');
    let Some(last) = body.items.last() else {
        let blank = if body.bracket == b'{' { " " } else { "" };
        return vec![Edit { range: inside, text: format!("{blank}{entry}{blank}") }];
    };
    let wide = begins_line(last.range.start) && begins_line(inside.end);
    let deep = indent(text, last.range.start).to_owned();
    match (after_comma(text, last.range.end, inside.end), wide) {
        (Some(comma), true) => {
            let at = past_comment(text, comma);
            vec![Edit { range: at..at, text: format!("\n{deep}{entry},") }]
        }
        (Some(comma), false) => vec![Edit { range: comma..comma, text: format!(" {entry}") }],
        (None, true) => {
            let (end, at) = (last.range.end, past_comment(text, last.range.end));
            if at == end {
                return vec![Edit { range: end..end, text: format!(",\n{deep}{entry},") }];
            }
            let comma = Edit { range: end..end, text: ",".to_owned() };
            vec![comma, Edit { range: at..at, text: format!("\n{deep}{entry},") }]
        }
        (None, false) => vec![Edit { range: last.range.end..last.range.end, text: format!(", {entry}") }],
    }
}

/// Adds an entry to a section; a missing section is inserted before `nodes`.
pub(crate) fn add_to(file: &File, section: Section, entry: &str) -> Vec<Edit> {
    if let Some(body) = file.section(section) {
        return append(file, body, entry);
    }
    let Some(nodes) = file.home(section).and_then(|body| body.get(Section::Nodes.key())) else { return Vec::new() };
    let at = nodes.range.start;
    let deep = indent(&file.text, at);
    let text = if section == Section::Imports {
        format!("{}: {{ {entry} }},\n{deep}", section.key())
    } else {
        format!("{}: {{\n{deep}  {entry},\n{deep}}},\n{deep}", section.key())
    };
    vec![Edit { range: at..at, text }]
}

/// Adds an entry above another one and the comment of that.
pub(crate) fn put_above(file: &File, item: &Item, entry: &str) -> Edit {
    let text = &file.text;
    let line = text[..item.range.start].rfind('\n').map_or(0, |at| at + 1);
    let deep = indent(text, item.range.start);
    if text[line..item.range.start].trim().is_empty() {
        let above = text[..line].lines().rev().take_while(|line| line.trim_start().starts_with("//"));
        let start = above.last().map_or(line, |first| first.as_ptr() as usize - text.as_ptr() as usize);
        return Edit { range: start..start, text: format!("{deep}{entry},\n") };
    }
    Edit { range: item.range.start..item.range.start, text: format!("{entry}, ") }
}

/// Removes an item with its comma, and with its line if the line has nothing else.
pub(crate) fn remove(file: &File, body: &Body, item: &Item) -> Edit {
    let text = &file.text;
    let mut end = after_comma(text, item.range.end, body.inside().end).unwrap_or(item.range.end);
    let mut start = item.range.start;
    let line = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let alone_before = text[line..start].trim().is_empty() && line > body.range.start;
    // In a text with syntax errors, the item may end after its body.
    let rest = text.get(end..body.inside().end).unwrap_or_default();
    let newline = rest.find('\n').filter(|i| rest[..*i].trim().is_empty());
    match newline {
        Some(newline) if alone_before => {
            start = line;
            end += newline + 1;
        }
        _ => end += rest.len() - rest.trim_start_matches(' ').len(),
    }
    Edit { range: start..end, text: String::new() }
}

/// Derives a name from `wanted` that is free in these sections.
pub(crate) fn free_name(file: &File, sections: &[Section], wanted: &str) -> String {
    let taken = |name: &str| sections.iter().any(|section| file.entry(*section, name).is_some());
    let numbered = (2..).map(|n| format!("{wanted}_{n}"));
    std::iter::once(wanted.to_owned()).chain(numbered).find(|name| !taken(name)).unwrap_or_default()
}
