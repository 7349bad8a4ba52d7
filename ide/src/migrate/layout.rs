//! Lays out a formula that is too long for one line.
use super::formula::Formula;
use super::words::{Name, POWER, PRODUCT, Word, binding, write};

/// Width of a factor that does not end a line.
const SHORT: usize = 20;

/// The text of a formula in lines of at most `width` characters. The first line begins at `column`, the others at
/// `indent`. Lines break where the loosest operator, or a comma, allows it.
pub(super) fn lines(
    formula: &Formula,
    name_of: &dyn Fn(&Name) -> String,
    (column, indent, width): (usize, usize, usize),
) -> String {
    let pieces = pieces(formula, name_of);
    let mut text = String::new();
    let (mut at, mut room) = (0, width.saturating_sub(column));
    while at < pieces.len() {
        let mut length = 0;
        let fitting = pieces[at..].iter().take_while(|piece| {
            length += piece.text.chars().count();
            length - piece.trailing() <= room
        });
        let fitting = at + fitting.count().max(1);
        let end = if fitting == pieces.len() { fitting } else { break_before(&pieces, at, fitting, room) };
        let line: String = pieces[at..end].iter().map(|piece| piece.text.as_str()).collect();
        if at > 0 {
            text.push('\n');
            text.extend(std::iter::repeat_n(' ', indent));
        }
        text.push_str(line.trim());
        (at, room) = (end, width.saturating_sub(indent));
    }
    text
}

/// A part of the text between two places where a line may break.
struct Piece {
    text: String,
    /// How tightly the place before it binds: brackets first, then operators.
    rank: (usize, u8),
}

impl Piece {
    fn trailing(&self) -> usize {
        self.text.len() - self.text.trim_end().len()
    }
}

fn pieces(formula: &Formula, name_of: &dyn Fn(&Name) -> String) -> Vec<Piece> {
    let mut pieces = vec![Piece { text: String::new(), rank: (0, 0) }];
    let mut depth = 0_usize;
    let mut after_comma = false;
    // For each open bracket, where the text since the last place to break in it begins.
    let mut starts = vec![0];
    let mut at = 0;
    for word in &formula.words {
        let width = at - starts.last().copied().unwrap_or(0);
        let rank = match word {
            // A short factor stays with the next one.
            Word::Operator(operator) if binding(operator) == PRODUCT && width < SHORT => Some((depth + 1, POWER)),
            Word::Operator(operator) => Some((depth, binding(operator))),
            _ if after_comma => Some((depth, 0)),
            _ => None,
        };
        pieces.extend(rank.map(|rank| Piece { text: String::new(), rank }));
        let text = write(std::slice::from_ref(word), name_of);
        match word {
            Word::Open => {
                depth += 1;
                starts.push(at);
            }
            Word::Close => {
                depth = depth.saturating_sub(1);
                starts.pop();
            }
            _ if rank.is_some() => starts.last_mut().into_iter().for_each(|start| *start = at),
            _ => {}
        }
        at += text.chars().count();
        after_comma = matches!(word, Word::Comma | Word::Semicolon);
        if let Some(piece) = pieces.last_mut() {
            piece.text.push_str(&text);
        }
    }
    pieces
}

/// The piece before which a line breaks. The line begins with the piece at `first` and has room for the pieces before
/// `fitting`. Prefers the least nested piece, then the loosest, then the last. No line should be short.
fn break_before(pieces: &[Piece], first: usize, fitting: usize, room: usize) -> usize {
    let mut width = 0;
    let mut best: Option<(bool, (usize, u8), usize)> = None;
    for at in first + 1..=fitting.min(pieces.len() - 1) {
        width += pieces[at - 1].text.chars().count();
        let found = (width * 6 < room, pieces[at].rank, at);
        if best.is_none_or(|best| (found.0, found.1) <= (best.0, best.1)) {
            best = Some(found);
        }
    }
    best.map_or(fitting, |(_, _, at)| at)
}

#[cfg(test)]
mod tests {
    use super::super::words::Base;
    use super::*;

    fn laid(text: &str, width: usize) -> String {
        let formula = Formula::read(text).expect("a formula");
        let name_of = |name: &Name| if let Base::Text(text) = &name.base { text.clone() } else { String::new() };
        lines(&formula, &name_of, (4, 2, width))
    }

    #[test]
    fn breaks_at_loosest_operator() {
        assert_eq!(laid("a + b * c", 20), "a + b * c");
        assert_eq!(laid("aaaa * bbbb + cccc * dddd - eeee", 24), "aaaa * bbbb\n  + cccc * dddd - eeee");
        assert_eq!(laid("max(aaaa * bbbb, cccc, dddd)", 24), "max(aaaa * bbbb,\n  cccc, dddd)");
        assert_eq!(laid("a_long_name_that_does_not_fit", 10), "a_long_name_that_does_not_fit");
        assert_eq!(laid("let r = aaaa; let s = bbbb; cccc", 24), "let r = aaaa;\n  let s = bbbb; cccc");
    }

    #[test]
    fn keeps_words_in_order() {
        let text = "mix(a.b, (1, 2, 3), smoothstep(0.1, 0.2, x)) ^ 2 + if(a < b && c, -d, !e) * 3";
        for width in 1..100 {
            assert_eq!(laid(text, width).split_whitespace().collect::<Vec<_>>().join(" "), text);
        }
    }
}
