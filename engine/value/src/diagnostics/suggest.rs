//! Suggestions for unknown words.

/// Longer words, in bytes, are not compared: comparing takes long, and such words are not typing errors.
const LONGEST: usize = 64;
/// The most candidates listed if none is near.
const LISTED: usize = 16;

/// The candidate nearest to `word`, if any is close enough. Candidates that begin with `word`, or contain it between
/// underscores (or the other way round), precede candidates with a slightly different spelling.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = word.to_lowercase();
    let near = |c: &'a str| nearness(&lower, c).map(|near| (near, c));
    candidates.into_iter().filter_map(near).min().map(|(_, c)| c)
}

/// The distance of a candidate for sorting; `None` if it is too far away.
fn nearness(lower: &str, candidate: &str) -> Option<(bool, usize)> {
    if lower.len() > LONGEST || candidate.len() > LONGEST {
        return None;
    }
    let candidate = candidate.to_lowercase();
    let apart = lower.len().abs_diff(candidate.len());
    if is_part(lower, &candidate) || is_part(&candidate, lower) {
        return Some((false, apart));
    }
    let most = 1 + candidate.len().min(lower.len()) / 4;
    // A character has at most four bytes, and the distance is at least the difference in characters.
    if apart > 4 * most {
        return None;
    }
    let distance = strsim::damerau_levenshtein(lower, &candidate);
    (distance <= most).then_some((true, distance))
}

/// Returns true if a word begins with `part`, or contains it between underscores.
fn is_part(part: &str, word: &str) -> bool {
    let begins = part.len() > 2 && word.starts_with(part);
    let between = |at: usize| {
        let (before, after) = (&word[..at], &word[at + part.len()..]);
        (before.is_empty() || before.ends_with('_')) && (after.is_empty() || after.starts_with('_'))
    };
    begins || (!part.is_empty() && word.match_indices(part).any(|(at, _)| between(at)))
}

/// A line of help for an unknown word: the nearest candidate, or else all candidates.
pub fn suggest(word: &str, what: &str, candidates: &[&str]) -> String {
    if let Some(near) = did_you_mean(word, candidates.iter().copied()) {
        return format!("did you mean `{near}`?");
    }
    let short = |text: &str| text.chars().take(LONGEST).collect::<String>();
    match candidates.len() {
        0 => format!("there is no {what} here"),
        n if n <= LISTED => {
            format!("{what}s: {}", candidates.iter().map(|c| format!("`{}`", short(c))).collect::<Vec<_>>().join(", "))
        }
        n => format!("there are {n} {what}s; none is near `{}`", short(word)),
    }
}

/// Shortens a text to fit into a line of a message.
pub fn shorten(text: &str) -> String {
    let line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(60).collect();
    if line.chars().count() < text.chars().count() { format!("{line}…") } else { line }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_words_are_suggested() {
        assert_eq!(did_you_mean("Perlim", ["Perlin", "Worley"]), Some("Perlin"));
        assert_eq!(did_you_mean("stifness", ["stiffness", "lattice"]), Some("stiffness"));
        assert_eq!(did_you_mean("zebra", ["Perlin", "Worley"]), None);
    }

    #[test]
    fn parts_of_words_come_first() {
        assert_eq!(did_you_mean("size", ["tile", "size_mm", "resolution", "seed"]), Some("size_mm"));
        assert_eq!(did_you_mean("width", ["length", "max_width", "width_limit"]), Some("max_width"));
        assert_eq!(did_you_mean("poisson", ["PoissonPoints", "Poison"]), Some("PoissonPoints"));
        assert_eq!(did_you_mean("pitch_mm", ["patch_mm", "pitch"]), Some("pitch"));
        assert_eq!(did_you_mean("b", ["a", "b_value"]), Some("b_value"));
        // Two leading letters are too few, and a part must be complete.
        assert_eq!(did_you_mean("si", ["size_mm"]), None);
        assert_eq!(did_you_mean("ize", ["size_mm"]), None);
    }

    #[test]
    fn ignores_very_long_words() {
        let (word, near) = ("a".repeat(1 << 20), "a".repeat((1 << 20) + 1));
        assert_eq!(did_you_mean(&word, [near.as_str()]), None);
        assert!(suggest(&word, "node", &[&near]).len() < 200);
    }
}
