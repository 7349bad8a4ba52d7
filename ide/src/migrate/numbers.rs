//! Random numbers in formulas: their seeds, and the numbers of pieces.
use super::words::{Base, Word, closing};

/// The formula with a seed in each call of `random`, `hash` and `noise`; and whether there is one.
pub(super) fn seeded(words: &[Word], seed: &[Word]) -> (Vec<Word>, bool) {
    let mut seeded = Vec::with_capacity(words.len());
    // For each open bracket, whether a seed belongs at its end.
    let mut open = Vec::new();
    let mut random = false;
    for (at, word) in words.iter().enumerate() {
        match word {
            Word::Open => {
                let before = at.checked_sub(1).map(|before| &words[before]);
                let takes = matches!(before, Some(Word::Function(name)) if is_random(name));
                random |= takes;
                open.push(takes);
            }
            Word::Close if open.pop() == Some(true) => {
                seeded.push(Word::Comma);
                seeded.extend_from_slice(seed);
            }
            _ => {}
        }
        seeded.push(word.clone());
    }
    (seeded, random)
}

fn is_random(function: &str) -> bool {
    matches!(function, "random" | "hash" | "noise")
}

/// The formula with numbers of pieces only in places that take them: as a whole argument of `random` or `hash`, and
/// beside `==` and `!=`. `random(ids + 0.5)` becomes `hash(ids, 0.5)`; the flag is true if there was such a sum.
///
/// # Errors
/// The name of numbers of pieces that another place reads.
pub(super) fn apart(words: &[Word], is_ids: &dyn Fn(&str) -> bool) -> Result<(Vec<Word>, bool), String> {
    let mut apart = words.to_vec();
    let mut changed = false;
    let mut open: Vec<usize> = Vec::new();
    for at in 0..words.len() {
        match &words[at] {
            Word::Open => open.push(at),
            Word::Close => drop(open.pop()),
            Word::Name(name) => {
                let Base::Text(text) = &name.base else { continue };
                if !is_ids(text) {
                    continue;
                }
                let before = at.checked_sub(1).map(|before| &words[before]);
                let after = words.get(at + 1);
                let compared = |word: Option<&Word>| matches!(word, Some(Word::Operator("==" | "!=")));
                let function = open.last().and_then(|open| open.checked_sub(1));
                let hashed =
                    function.filter(|at| matches!(&words[*at], Word::Function(f) if f == "random" || f == "hash"));
                let begins = matches!(before, Some(Word::Open | Word::Comma));
                match (hashed, after) {
                    _ if compared(before) || compared(after) => {}
                    (Some(_), Some(Word::Close | Word::Comma)) if begins => {}
                    (Some(function), Some(Word::Operator("+"))) if begins && ends_alone(words, function, at) => {
                        apart[function] = Word::Function("hash".to_owned());
                        apart[at + 1] = Word::Comma;
                        changed = true;
                    }
                    _ => return Err(text.clone()),
                }
            }
            _ => {}
        }
    }
    Ok((apart, changed))
}

/// True if nothing but the first argument of `random`, or a seed, follows in the call.
fn ends_alone(words: &[Word], function: usize, at: usize) -> bool {
    let first = words[function + 1..at].iter().all(|word| *word == Word::Open);
    first && closing(words, function + 1).is_some()
}

#[cfg(test)]
mod tests {
    use super::super::formula::Formula;
    use super::super::words::{Name, write};
    use super::*;

    fn text(words: &[Word]) -> String {
        write(words, &|name: &Name| if let Base::Text(text) = &name.base { text.clone() } else { String::new() })
    }

    #[test]
    fn adds_seed_to_random_numbers() {
        let words = Formula::read("random(a) + max(noise(x, hash(b)), 1)").expect("a formula").words;
        let seed = Formula::read("$seed + 1").expect("a formula").words;
        let (words, random) = seeded(&words, &seed);
        let expected = "random(a, $seed + 1) + max(noise(x, hash(b, $seed + 1), $seed + 1), 1)";
        assert_eq!((text(&words).as_str(), random), (expected, true));
        assert!(!seeded(&Formula::read("a + 1").expect("a formula").words, &seed).1);
    }

    #[test]
    fn keeps_numbers_of_pieces_apart() {
        let of = |formula: &str| {
            let words = Formula::read(formula).expect("a formula").words;
            apart(&words, &|name| name == "ids").map(|(words, changed)| (text(&words), changed))
        };
        let same = |text: &str| Ok((text.to_owned(), false));
        assert_eq!(of("random(ids) * hash(1, ids) + (ids == 3)"), same("random(ids) * hash(1, ids) + (ids == 3)"));
        assert_eq!(of("random(ids + 0.5)"), Ok(("hash(ids, 0.5)".to_owned(), true)));
        assert_eq!(of("random(ids + 0.5 * other)"), Ok(("hash(ids, 0.5 * other)".to_owned(), true)));
        for wrong in ["ids % 3", "ids", "max(ids, 1)", "random(2 * ids)", "(ids)"] {
            assert_eq!(of(wrong), Err("ids".to_owned()), "{wrong}");
        }
    }
}
