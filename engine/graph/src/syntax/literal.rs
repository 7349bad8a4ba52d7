//! Numbers, strings and names.
//!
//! Forms that are rare in graphs, such as `0x1F`, `3u8` and texts with escapes, are read by `ron`, token by token.
use serde::de::IgnoredAny;

/// Returns true if `ron` can read a literal.
pub(super) fn is_good(literal: &str) -> bool {
    ron::Options::default().from_str::<IgnoredAny>(literal).is_ok()
}

/// The length of the number at the start of `text`, and whether it is valid; 0 if there is none.
pub(super) fn number_len(text: &str) -> (usize, bool) {
    let bytes = text.as_bytes();
    let sign = usize::from(text.starts_with(['+', '-']));
    let based = ["0x", "0b", "0o"].iter().any(|base| text[sign..].starts_with(base));
    let mut len = sign;
    while let Some(&byte) = bytes.get(len) {
        let exponent = matches!(byte, b'+' | b'-') && len > sign && matches!(bytes[len - 1], b'e' | b'E') && !based;
        let range = byte == b'.' && bytes.get(len + 1) == Some(&b'.');
        if range || !(byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_') || exponent) {
            break;
        }
        len += 1;
    }
    let run = &text[..len];
    if is_plain(&run[sign..]) {
        return (len, true);
    }
    if !run.bytes().any(|byte| byte.is_ascii_digit()) {
        let word = is_number_word(&run[sign..]);
        return if word { (len, true) } else { (0, false) };
    }
    if is_a_number(run) {
        return (len, true);
    }
    // `2mm` is a number followed by a word.
    let digits = |c: char| c.is_ascii_digit() || matches!(c, '.' | '_');
    let plain = run[sign..].find(|c| !digits(c)).map_or(len, |end| sign + end);
    if plain < len && is_plain(&run[sign..plain]) { (plain, true) } else { (len, false) }
}

fn is_a_number(run: &str) -> bool {
    match ron::Options::default().from_str::<IgnoredAny>(run) {
        Ok(_) => true,
        // A number that is too large is still a number; its reader reports the range.
        Err(error) => matches!(error.code, ron::Error::IntegerOutOfBounds),
    }
}

/// Returns true for digits with at most one decimal point.
fn is_plain(digits: &str) -> bool {
    let points = digits.bytes().filter(|&byte| byte == b'.').count();
    points <= 1 && digits.len() > points && digits.bytes().all(|byte| byte == b'.' || byte.is_ascii_digit())
}

/// Returns true if a word without a sign is a number.
pub(super) fn is_number_word(word: &str) -> bool {
    number_word(word).is_some()
}

/// The value of a number in RON, including underscores, bases and suffixes; `None` for other words.
pub fn number(word: &str) -> Option<f64> {
    let (sign, digits) = match word.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, word.strip_prefix('+').unwrap_or(word)),
    };
    if let Some(value) = number_word(digits) {
        return Some(sign * value);
    }
    for (prefix, base) in [("0x", 16), ("0b", 2), ("0o", 8)] {
        if let Some(rest) = digits.strip_prefix(prefix) {
            return radix(rest, base).map(|value| sign * value);
        }
    }
    let plain: String = digits.chars().filter(|&c| c != '_').collect();
    let end = plain.find(['i', 'u', 'f']).unwrap_or(plain.len());
    plain[..end].parse::<f64>().ok().map(|value| sign * value)
}

/// The start of a number's type suffix, as in `3u8` and `2.5f32`.
pub(crate) fn suffix(word: &str) -> Option<usize> {
    let unsigned = word.trim_start_matches(['+', '-']);
    let begin = word.len() - unsigned.len();
    let at = match unsigned.as_bytes() {
        [b'0', b'x' | b'b' | b'o', ..] => unsigned.find(['i', 'u']),
        [b'0'..=b'9' | b'.', ..] => unsigned.find(['i', 'u', 'f']),
        _ if number_word(unsigned).is_some() => Some(3),
        _ => None,
    };
    at.map(|at| begin + at).filter(|&at| at < word.len())
}

/// The value of a number written as a word, without its sign.
fn number_word(word: &str) -> Option<f64> {
    match word {
        "inf" | "inff32" | "inff64" => Some(f64::INFINITY),
        "NaN" | "NaNf32" | "NaNf64" => Some(f64::NAN),
        _ => None,
    }
}

/// Returns true if a number is written as infinity, with or without a sign. A number that is merely too large, such as
/// `1e400`, is not.
pub fn is_infinity(word: &str) -> bool {
    let unsigned = word.strip_prefix(['+', '-']).unwrap_or(word);
    number_word(unsigned).is_some_and(f64::is_infinite)
}

fn radix(digits: &str, base: u32) -> Option<f64> {
    let digits = digits.split(['i', 'u']).next()?;
    let mut value = 0.0;
    for c in digits.chars().filter(|&c| c != '_') {
        value = value * f64::from(base) + f64::from(c.to_digit(base)?);
    }
    Some(value)
}

/// Returns true if `name` is a valid name of a node, an input, a parameter or an import.
pub fn is_name(name: &str) -> bool {
    let first = name.bytes().next();
    first.is_some_and(|b| b == b'_' || b.is_ascii_alphabetic())
        && name.bytes().all(|b| b == b'_' || b.is_ascii_alphanumeric())
}

/// The text of a string literal; if one quote is missing, the text without the other.
pub fn decode(literal: &str) -> Option<String> {
    let body = match literal.strip_prefix('"') {
        Some(body) => Some(body.strip_suffix('"').unwrap_or(body)),
        None => literal.strip_suffix('"').filter(|body| !body.contains('"')),
    };
    match body {
        Some(body) if !body.contains('\\') => Some(body.to_owned()),
        _ => ron::Options::default().from_str(literal).ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_ron_does() {
        assert_eq!(number("1_000.5"), Some(1000.5));
        assert_eq!(number("-0x1F"), Some(-31.0));
        assert_eq!(number("3u8"), Some(3.0));
        assert_eq!(number("-inf"), Some(f64::NEG_INFINITY));
        assert_eq!(number("1e400"), Some(f64::INFINITY));
        assert!(number("NaN").is_some_and(f64::is_nan));
        assert!(["inf", "-inf", "+inff32"].into_iter().all(is_infinity));
        assert!(!["1e400", "NaN", "--inf", "infinity"].into_iter().any(is_infinity));
        assert_eq!(number("x"), None);
    }

    #[test]
    fn finds_type_suffixes_of_numbers() {
        let cut = |word: &str| suffix(word).map(|at| word[..at].to_owned());
        assert_eq!(cut("3f32").as_deref(), Some("3"));
        assert_eq!(cut("-2.5f64").as_deref(), Some("-2.5"));
        assert_eq!(cut("0x1Fu8").as_deref(), Some("0x1F"));
        assert_eq!(cut("inff32").as_deref(), Some("inf"));
        assert!(["3", "-1.5e3", "0xff", "inf", "b'x'"].into_iter().all(|word| suffix(word).is_none()));
    }

    #[test]
    fn numbers_end_where_a_word_begins() {
        let cut = |text: &str| number_len(text);
        assert_eq!(cut("12.5, 3"), (4, true));
        assert_eq!(cut("2mm"), (1, true));
        assert_eq!(cut("1..2"), (1, true));
        assert_eq!(cut("-1.5e-3)"), (7, true));
        assert_eq!(cut("300u8"), (5, true));
        assert_eq!(cut("1.2.3"), (5, false));
        assert_eq!(cut("-x"), (0, false));
        assert_eq!(cut("-inf"), (4, true));
    }
}
