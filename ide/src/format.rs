//! Formats a text with the smallest possible change.
use super::rename::Edit;
use shibo_graph::syntax;
use std::ops::Range;

/// Edits that format a text; `None` if it has syntax errors.
pub fn format_all(text: &str) -> Option<Vec<Edit>> {
    let formatted = syntax::format(text).ok()?;
    Some(change(text, &(0..text.len()), &formatted).into_iter().collect())
}

/// Lays out a changed text if the text before the change was laid out; other texts stay as they are.
pub fn keep_layout(before: &str, after: String) -> String {
    if is_laid_out(before) { syntax::format(&after).unwrap_or(after) } else { after }
}

/// Edits that give a laid-out text the layout again after other edits; `None` if these edits keep it already.
pub(crate) fn settled(text: &str, edited: &str) -> Option<Edit> {
    let formatted = syntax::format(edited).ok().filter(|formatted| formatted != edited)?;
    change(text, &(0..text.len()), &formatted)
}

/// Returns true if a text is in the usual layout.
pub(crate) fn is_laid_out(text: &str) -> bool {
    syntax::format(text).is_ok_and(|formatted| formatted == text)
}

/// Edits that format a part of a text, and lines that must change with it.
pub fn format_part(text: &str, part: Range<usize>) -> Option<Vec<Edit>> {
    let formatted = syntax::format_range(text, part).ok()?;
    Some(formatted.and_then(|(range, formatted)| change(text, &range, &formatted)).into_iter().collect())
}

/// Replaces only lines that differ, so that the cursor stays in place on all others.
pub fn change(text: &str, range: &Range<usize>, new: &str) -> Option<Edit> {
    let old = text.get(range.clone())?;
    if old == new {
        return None;
    }
    let lines = |a: &str, b: &str| -> usize {
        let same =
            a.split_inclusive('\n').zip(b.split_inclusive('\n')).take_while(|(a, b)| a == b && a.ends_with('\n'));
        same.map(|(line, _)| line.len()).sum()
    };
    let before = lines(old, new);
    let (rest_old, rest_new) = (&old[before..], &new[before..]);
    let after: usize = rest_old
        .split_inclusive('\n')
        .rev()
        .zip(rest_new.split_inclusive('\n').rev())
        .take_while(|(a, b)| a == b)
        .map(|(line, _)| line.len())
        .sum();
    // A blank line may be counted from both ends, so the count is limited.
    let after = after.min(rest_old.len()).min(rest_new.len());
    let start = range.start + before;
    let text = rest_new[..rest_new.len() - after].to_owned();
    Some(Edit { range: start..range.end - after, text })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_layout_of_laid_out_texts() {
        let text = "(\n  nodes: {\n    \"a\": Perlin(size: 4),\n  },\n)\n";
        let wide = |text: &str| text.replace("size: 4", &format!("note: \"{}\", size: 4", "x".repeat(100)));
        let laid = keep_layout(text, wide(text));
        assert_eq!(laid, syntax::format(&wide(text)).unwrap());
        assert!(laid.lines().count() > text.lines().count(), "{laid}");
        let loose = text.replace(": 4", ":4");
        assert_eq!(keep_layout(&loose, wide(text)), wide(text));
        let broken = "(\n  nodes: {".to_owned();
        assert_eq!(keep_layout(text, broken.clone()), broken);
    }

    #[test]
    fn changes_only_differing_lines() {
        let edit = |old: &str, new: &str| {
            let edit = change(old, &(0..old.len()), new);
            if let Some(edit) = &edit {
                let mut text = old.to_owned();
                text.replace_range(edit.range.clone(), &edit.text);
                assert_eq!(text, new);
            }
            edit.map(|edit| (edit.range, edit.text))
        };
        assert_eq!(edit("a\nb\nc\n", "a\nb\nc\n"), None);
        assert_eq!(edit("a\nb\nc\n", "a\nx\nc\n"), Some((2..4, "x\n".into())));
        assert_eq!(edit("a\n\n\nb", "a\n\nb").map(|e| e.1), Some(String::new()));
        assert_eq!(edit("a", "a\n"), Some((0..1, "a\n".into())));
        assert_eq!(edit("x\nx\n", "x\n").map(|e| e.0.len()), Some(2));
    }
}
