//! Three-way merge of sequences: of lines, and of the elements of lists.
use similar::{Algorithm, DiffOp, capture_diff_slices};
use std::hash::Hash;
use std::ops::Range;

/// The version that a part of the result comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Take {
    /// All three are equal, only ours changed, or both changed alike.
    Ours,
    /// Only theirs changed.
    Theirs,
    /// Both changed differently.
    Conflict,
}

/// A part of the three sequences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) base: Range<usize>,
    pub(crate) ours: Range<usize>,
    pub(crate) theirs: Range<usize>,
    pub(crate) take: Take,
}

/// For each element of `base`, the equal element of `side`.
fn matches<T: Eq + Hash + Ord>(base: &[T], side: &[T]) -> Vec<Option<usize>> {
    let mut matches = vec![None; base.len()];
    for op in capture_diff_slices(Algorithm::Myers, base, side) {
        if let DiffOp::Equal { old_index, new_index, len } = op {
            (0..len).for_each(|index| matches[old_index + index] = Some(new_index + index));
        }
    }
    matches
}

/// Divides three sequences into parts that are taken from one side or conflict.
pub(crate) fn three<T: Eq + Hash + Ord>(base: &[T], ours: &[T], theirs: &[T]) -> Vec<Part> {
    let (in_ours, in_theirs) = (matches(base, ours), matches(base, theirs));
    let mut parts: Vec<Part> = Vec::new();
    let (mut b, mut o, mut t) = (0, 0, 0);
    while b < base.len() || o < ours.len() || t < theirs.len() {
        // The next element that is in all three.
        let common = (b..base.len()).find_map(|at| Some((at, in_ours[at]?, in_theirs[at]?)));
        let (next_b, next_o, next_t) = common.unwrap_or((base.len(), ours.len(), theirs.len()));
        if (next_b, next_o, next_t) == (b, o, t) {
            parts.push(Part { base: b..b + 1, ours: o..o + 1, theirs: t..t + 1, take: Take::Ours });
            (b, o, t) = (b + 1, o + 1, t + 1);
            continue;
        }
        let (old, our, their) = (&base[b..next_b], &ours[o..next_o], &theirs[t..next_t]);
        let take = match () {
            () if their == old || our == their => Take::Ours,
            () if our == old => Take::Theirs,
            () => Take::Conflict,
        };
        parts.push(Part { base: b..next_b, ours: o..next_o, theirs: t..next_t, take });
        (b, o, t) = (next_b, next_o, next_t);
    }
    parts
}

/// Merges lines. Returns the text, and the number of conflicts marked in it.
pub(crate) fn lines(base: &str, ours: &str, theirs: &str, marker: usize) -> (String, usize) {
    let split = |text: &'_ str| text.split_inclusive('\n').map(str::to_owned).collect::<Vec<_>>();
    let (base, ours, theirs) = (split(base), split(ours), split(theirs));
    let (mut out, mut conflicts) = (String::new(), 0);
    let line_end = |text: &mut String| {
        if !text.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
    };
    for part in three(&base, &ours, &theirs) {
        match part.take {
            Take::Ours => out.extend(ours[part.ours].iter().map(String::as_str)),
            Take::Theirs => out.extend(theirs[part.theirs].iter().map(String::as_str)),
            Take::Conflict => {
                conflicts += 1;
                let sections = [
                    ("<", " ours", &ours[part.ours]),
                    ("|", " base", &base[part.base]),
                    ("=", "", &theirs[part.theirs]),
                ];
                for (sign, name, lines) in sections {
                    line_end(&mut out);
                    out += &format!("{}{name}\n", sign.repeat(marker));
                    out.extend(lines.iter().map(String::as_str));
                }
                line_end(&mut out);
                out += &format!("{} theirs\n", ">".repeat(marker));
            }
        }
    }
    (out, conflicts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merges_lines() {
        let base = "a\nb\nc\nd\n";
        assert_eq!(lines(base, "a\nb1\nc\nd\n", "a\nb\nc\nd1\n", 7), ("a\nb1\nc\nd1\n".to_owned(), 0));
        assert_eq!(lines(base, "a\nc\nd\n", "a\nc\nd\ne", 7), ("a\nc\nd\ne".to_owned(), 0));
        let (text, conflicts) = lines(base, "a\nb1\nc\nd", "a\nb2\nc\nd\n", 8);
        assert_eq!(conflicts, 1);
        assert!(text.contains("a\n<<<<<<<< ours\nb1\n|||||||| base\nb\n========\nb2\n>>>>>>>> theirs\nc\n"), "{text}");
    }

    #[test]
    fn merges_any_sequences() {
        // All sequences of up to three of two elements, against each other.
        let all: Vec<Vec<u8>> = (0..15_u8)
            .map(|n| {
                let len = (n + 1).ilog2();
                (0..len).map(|bit| (n + 1) >> bit & 1).collect()
            })
            .collect();
        for base in &all {
            for ours in &all {
                for theirs in &all {
                    let parts = three(base, ours, theirs);
                    let joined = |range: fn(&Part) -> Range<usize>, from: &[u8]| {
                        parts.iter().flat_map(|part| from[range(part)].to_vec()).collect::<Vec<_>>()
                    };
                    assert_eq!(&joined(|part| part.ours.clone(), ours), ours);
                    assert_eq!(&joined(|part| part.theirs.clone(), theirs), theirs);
                    if ours == base || theirs == base {
                        assert!(parts.iter().all(|part| part.take != Take::Conflict), "{base:?} {ours:?} {theirs:?}");
                    }
                }
            }
        }
    }
}
