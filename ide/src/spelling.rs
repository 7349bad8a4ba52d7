//! Typing errors.
use super::manual::elsewhere::squash;

/// Longer words, in bytes, are not compared.
pub(crate) const LONGEST: usize = 64;

/// Returns whether a word is meant as a name: another case, a plural, or one typing error.
pub(crate) fn is_misspelt(wrong: &str, name: &str) -> bool {
    if wrong.len() > LONGEST || name.len() > LONGEST || wrong.is_empty() || wrong == name {
        return false;
    }
    let (a, b) = (squash(wrong), squash(name));
    a.trim_end_matches('s') == b.trim_end_matches('s') || distance(&a, &b) <= 1
}

/// Typing errors between two words: letters added, left out, replaced, or two exchanged.
pub(crate) fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows: [Vec<usize>; 3] = [vec![0; b.len() + 1], vec![0; b.len() + 1], (0..=b.len()).collect()];
    for i in 1..=a.len() {
        rows.rotate_left(1);
        rows[2][0] = i;
        for j in 1..=b.len() {
            let other = usize::from(a[i - 1] != b[j - 1]);
            let mut best = (rows[1][j] + 1).min(rows[2][j - 1] + 1).min(rows[1][j - 1] + other);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[0][j - 2] + 1);
            }
            rows[2][j] = best;
        }
    }
    rows[2][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_typing_errors() {
        assert_eq!(distance("nodes", "nods"), 1);
        assert_eq!(distance("ndoes", "nodes"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert!(is_misspelt("nods", "nodes") && is_misspelt("Node", "nodes") && !is_misspelt("codec", "nodes"));
    }
}
