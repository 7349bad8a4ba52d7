//! Splits the text of an OBJ into statements, numbers and names.
//!
//! Lines end in LF, CR LF or CR; a `\` at the end joins a line to the next one. Text is UTF-8 or, failing that,
//! Latin-1.
use super::ReadError;
use std::borrow::Cow;
use std::rc::Rc;

/// Maximum length of the part of a statement that a message shows.
const SHOWN: usize = 60;
/// Maximum length of a statement of several lines, in bytes.
const MOST_JOINED: usize = 16 << 20;

/// The statements of a file, each with the number of its first line.
pub(super) struct Statements<'a> {
    rest: Option<&'a [u8]>,
    line: usize,
}

impl<'a> Statements<'a> {
    pub(super) const fn new(file: &'a [u8]) -> Self {
        Self { rest: Some(file), line: 0 }
    }

    /// The next line without its line ending.
    fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest?;
        self.line += 1;
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
        let Some(end) = end else {
            self.rest = None;
            return Some(rest);
        };
        let two = rest[end..].starts_with(b"\r\n");
        self.rest = rest.get(end + 1 + usize::from(two)..);
        Some(&rest[..end])
    }
}

/// The line without a `\` at its end that joins it to the next one; `None` if there is no such `\`.
fn joined(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\")
}

impl<'a> Iterator for Statements<'a> {
    type Item = Result<(usize, Cow<'a, [u8]>), ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        let line = self.line()?;
        let number = self.line;
        // In comments and names a `\` at the end joins nothing: paths of Windows may end so.
        let begin = match joined(line) {
            Some(begin) if matches!(keyword(line), b"v" | b"vt" | b"vn" | b"f" | b"l" | b"p") => begin,
            _ => return Some(Ok((number, Cow::Borrowed(line)))),
        };
        let mut whole = begin.to_vec();
        while let Some(line) = self.line() {
            let part = joined(line);
            whole.push(b' ');
            whole.extend_from_slice(part.unwrap_or(line));
            if whole.len() > MOST_JOINED {
                let message = format!("line {number}: a statement has more than {} MiB", MOST_JOINED >> 20);
                return Some(Err(ReadError::TooLarge(message)));
            }
            if part.is_none() {
                break;
            }
        }
        Some(Ok((number, Cow::Owned(whole))))
    }
}

/// The first word of a statement.
pub(super) fn keyword(statement: &[u8]) -> &[u8] {
    let text = statement.trim_ascii_start();
    &text[..text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len())]
}

/// The error for an invalid statement.
pub(super) fn fault(number: usize, statement: &[u8], what: &str) -> ReadError {
    let text = String::from_utf8_lossy(statement.trim_ascii());
    let more = if text.chars().count() > SHOWN { " …" } else { "" };
    let shown: String = text.chars().take(SHOWN).collect();
    ReadError::Bad(format!("line {number}: `{shown}{more}`: {what}"))
}

/// The words after the keyword, up to a comment.
pub(super) fn words(statement: &[u8]) -> impl Iterator<Item = &[u8]> {
    // Some programs write NaN as `1.#QNAN`, which is no comment.
    let comment = (0..statement.len()).find(|n| statement[*n] == b'#' && (*n == 0 || statement[*n - 1] != b'.'));
    let text = &statement[..comment.unwrap_or(statement.len())];
    text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).skip(1)
}

/// A number, which need not be finite.
fn number(word: &[u8]) -> Option<f32> {
    let text = std::str::from_utf8(word).ok()?;
    let parsed = text.parse().ok();
    let none = || {
        let text = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        (text.starts_with("nan(") || text.contains(".#")).then_some(f32::NAN)
    };
    parsed.or_else(none)
}

/// The numbers of a statement, at most `N`, and how many there are.
pub(super) fn numbers<const N: usize>(statement: &[u8]) -> Option<([f32; N], usize)> {
    let (mut found, mut count) = ([0.0; N], 0);
    for word in words(statement) {
        *found.get_mut(count)? = number(word)?;
        count += 1;
    }
    Some((found, count))
}

/// A whole number other than 0, with no more digits than an index needs.
pub(super) fn index(word: &[u8]) -> Option<i64> {
    let (back, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    let whole = !digits.is_empty() && digits.len() <= 18 && digits.iter().all(u8::is_ascii_digit);
    let value = whole.then(|| digits.iter().fold(0_i64, |sum, digit| 10 * sum + i64::from(digit - b'0')))?;
    (value != 0).then_some(if back { -value } else { value })
}

/// The name after a keyword: the rest of the statement, in which `#` is an ordinary character.
pub(super) fn name(statement: &[u8]) -> Rc<str> {
    let text = statement.trim_ascii();
    let rest = text[keyword(text).len()..].trim_ascii();
    match std::str::from_utf8(rest) {
        Ok(name) => name.into(),
        Err(_) => rest.iter().map(|byte| char::from(*byte)).collect::<String>().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(file: &[u8]) -> Vec<(usize, String)> {
        let text = |(number, text): (usize, Cow<'_, [u8]>)| (number, String::from_utf8_lossy(&text).into_owned());
        Statements::new(file).map(|statement| text(statement.unwrap())).collect()
    }

    #[test]
    fn splits_lines_at_all_ends_and_joins_them() {
        let wanted = [(1, "v 1"), (2, ""), (3, "f 1   2   3"), (6, "# c:\\"), (7, "o a\\"), (8, "v 2")];
        let wanted = wanted.map(|(number, text)| (number, text.to_owned()));
        for end in ["\n", "\r\n", "\r"] {
            let file = ["v 1", "", "f 1 \\", " 2 \\ ", " 3", "# c:\\", "o a\\", "v 2"].join(end);
            assert_eq!(statements(file.as_bytes()), wanted, "{end:?}");
        }
        assert_eq!(statements(b"f 1 \\"), [(1, "f 1 ".to_owned())]);
        assert_eq!(statements(b""), [(1, String::new())]);
    }

    #[test]
    fn refuses_statements_of_endless_lines() {
        let file = b"f 1 2 3 \\\n".repeat(MOST_JOINED / 8);
        assert!(matches!(Statements::new(&file).next(), Some(Err(ReadError::TooLarge(_)))));
    }

    #[test]
    fn reads_numbers_up_to_a_comment() {
        assert_eq!(numbers::<3>(b"v 1 -2e1 +.5 # 4"), Some(([1.0, -20.0, 0.5], 3)));
        assert_eq!(numbers::<3>(b"v 1#2"), Some(([1.0, 0.0, 0.0], 1)));
        assert_eq!(numbers::<3>(b"v 1 2 3 4"), None);
        assert_eq!(numbers::<3>(b"v 1 x"), None);
        for word in ["nan", "-nan", "nan(ind)", "-nan(snan)", "1.#QNAN", "-1.#IND", "1.#INF"] {
            let (found, count) = numbers::<3>(format!("v {word} 1").as_bytes()).unwrap();
            assert!(count == 2 && found[0].is_nan(), "{word}");
        }
    }

    #[test]
    fn reads_names_in_utf8_and_latin1() {
        assert_eq!(&*name("o  Stuhl #3 ä ".as_bytes()), "Stuhl #3 ä");
        assert_eq!(&*name(b"usemtl St\xfchl"), "St\u{fc}hl");
        assert_eq!(&*name(b"g"), "");
    }
}
