//! Changes as text for people.
use super::Listed;
use crate::report::count;
use crate::terminal::{Style, Terminal, Text};
use shibo_bridge::diff::{Change, ChangeKind};
use shibo_bridge::pictures::{PictureChange, PictureDiff};

/// Widest column of names.
const NAMES: usize = 40;
/// Longest text of a value in characters.
const LONGEST: usize = 60;
/// Characters before a difference in a long value.
const BEFORE: usize = 16;

/// The changes of all graphs. Graphs are separated by an empty line.
pub(super) fn page(graphs: &[Listed], size: Option<u32>, terminal: &Terminal) -> Text {
    let mut page = terminal.page();
    for (index, graph) in graphs.iter().enumerate() {
        if index > 0 {
            page.end();
        }
        page.styled(Style::Bold, &graph.path).end();
        for note in &graph.notes {
            page.push("  ").push(note).end();
        }
        for error in &graph.diff.unreadable {
            page.push("  cannot be read in part, ").push(error).end();
        }
        for import in &graph.imports {
            page.push(&format!("  imports {}, which changed", import.display())).end();
        }
        for line in graph.lines.iter().flat_map(|lines| lines.lines()) {
            page.push(line).end();
        }
        let names: Vec<String> = graph.diff.changes.iter().map(|change| name(&change.path)).collect();
        let width = names.iter().map(|name| name.chars().count()).filter(|width| *width <= NAMES).max().unwrap_or(0);
        for (change, name) in graph.diff.changes.iter().zip(&names) {
            page.push("  ")
                .styled(Style::Accent, &format!("{name:width$}"))
                .push(&format!("  {}", words(change)))
                .end();
        }
        let nothing = graph.diff.changes.is_empty() && graph.imports.is_empty() && graph.lines.is_none();
        if nothing && graph.diff.unreadable.is_empty() && graph.notes.is_empty() {
            page.push("  no change").end();
        }
        if let (Some(pictures), Some(size)) = (&graph.pictures, size) {
            list(&mut page, pictures, size);
        }
    }
    page
}

/// The pictures that differ.
fn list(page: &mut Text, pictures: &[PictureDiff], size: u32) {
    let differing: Vec<&PictureDiff> = pictures.iter().filter(|one| one.change != PictureChange::Same).collect();
    let (count, all) = (differing.len(), pictures.len());
    let verb = if count == 1 { "changes" } else { "change" };
    page.push(&format!("pictures at {size} pixels: {count} of {all} {verb}")).end();
    let width = differing.iter().map(|one| one.name.chars().count()).max().unwrap_or(0);
    for one in differing {
        let unit = one.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
        let mut parts = Vec::new();
        match one.change {
            PictureChange::Added => parts.push("new".to_owned()),
            PictureChange::Removed => parts.push("removed".to_owned()),
            _ => {}
        }
        if let (Some(mean), Some(max)) = (one.mean, one.max) {
            parts.push(format!("mean {}, at most {}{unit}", short(mean), short(max)));
        }
        if !one.words.is_empty() {
            parts.push(one.words.join(", "));
        }
        page.push("  ")
            .styled(Style::Accent, &format!("{:width$}", one.name))
            .push(&format!("  {}", parts.join("; ")))
            .end();
    }
}

/// A number with two digits that count.
fn short(value: f64) -> String {
    let digits = (0..12).find(|digits| value == 0.0 || value * 10_f64.powi(*digits) >= 10.0).unwrap_or(12);
    format!("{value:.*}", usize::try_from(digits).unwrap_or(0))
}

/// A path as text: `nodes.tree.branches[2].length`.
pub(crate) fn name(path: &[String]) -> String {
    let mut name = String::new();
    for part in path {
        if part.bytes().all(|byte| byte.is_ascii_digit()) && !name.is_empty() {
            name += &format!("[{part}]");
        } else {
            name += if name.is_empty() { "" } else { "." };
            name += part;
        }
    }
    if name.is_empty() { "graph".to_owned() } else { name }
}

pub(crate) fn words(change: &Change) -> String {
    let unit = change.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
    let (before, after) = (flat(change.before.as_deref()), flat(change.after.as_deref()));
    if change.path.is_empty() {
        let lines = |text: &Option<String>| count(text.as_deref().unwrap_or_default().lines().count() as u64, "line");
        return match change.change {
            ChangeKind::Added => format!("new, {}", lines(&change.after)),
            _ => format!("removed, {}", lines(&change.before)),
        };
    }
    match change.change {
        ChangeKind::Changed => {
            let (before, after) = shortened(&before, &after);
            format!("{before} → {after}{unit}")
        }
        ChangeKind::Added => format!("new: {}{unit}", shortened("", &after).1),
        ChangeKind::Removed => {
            let counts =
                change.default.as_ref().map(|default| format!("; the default {} counts now", flat(Some(default))));
            format!("removed (was {}{unit}{})", shortened(&before, "").0, counts.unwrap_or_default())
        }
        ChangeKind::Renamed => {
            let references = count(change.references.unwrap_or(0) as u64, "reference");
            format!("renamed from {before}; {references}")
        }
        ChangeKind::Comment => match (&change.before, &change.after) {
            (Some(_), Some(_)) => {
                let (before, after) = shortened(&before, &after);
                format!("{before} → {after}")
            }
            (None, _) => format!("new: {}", shortened("", &after).1),
            _ => format!("removed: {}", shortened(&before, "").0),
        },
    }
}

/// A text in one line.
fn flat(text: Option<&str>) -> String {
    text.unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Shortens two texts to the parts where they differ.
fn shortened(before: &str, after: &str) -> (String, String) {
    let texts = [before, after].map(|text| text.chars().collect::<Vec<char>>());
    let [one, other] = &texts;
    let same = one.iter().zip(other).take_while(|(a, b)| a == b).count();
    let long = texts.iter().any(|text| text.len() > LONGEST);
    let start = if long && !one.is_empty() && !other.is_empty() { same.saturating_sub(BEFORE) } else { 0 };
    // A word is not cut at its beginning.
    let start = (start..same).find(|&at| at == 0 || one.get(at - 1) == Some(&' ')).unwrap_or(start);
    let cut = |text: &[char]| {
        let shown: String = text.iter().skip(start).take(LONGEST).collect();
        let head = if start > 0 { "…" } else { "" };
        let tail = if text.len() > start + LONGEST { "…" } else { "" };
        format!("{head}{shown}{tail}")
    };
    (cut(one), cut(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shortens_long_values_around_difference() {
        let long = "= $depth * (forms - 0.1 * $pitch * grain.grooves - 0.035 * $pitch * fading - 0.025 * pores)";
        let (before, after) = shortened(long, &long.replace("0.025", "0.03"));
        assert_eq!((before.as_str(), after.as_str()), ("…* fading - 0.025 * pores)", "…* fading - 0.03 * pores)"));
        assert_eq!(shortened("0.62", "0.7"), ("0.62".to_owned(), "0.7".to_owned()));
        assert_eq!(shortened("", &"x".repeat(99)).1.chars().count(), LONGEST + 1);
    }

    #[test]
    fn names_elements_of_lists() {
        let path = ["nodes", "tree", "branches", "2", "length"].map(str::to_owned);
        assert_eq!(name(&path), "nodes.tree.branches[2].length");
        assert_eq!(name(&[]), "graph");
    }
}
