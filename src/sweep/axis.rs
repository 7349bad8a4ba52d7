//! Axes of a sweep: names with values, and all their combinations.
use crate::args::assignment;

/// Maximum number of combinations.
pub(crate) const MOST: usize = 100_000;

/// A parameter name and its values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Axis {
    pub(crate) name: String,
    pub(crate) values: Vec<String>,
}

/// Parses `NAME=1..100`, `NAME=0.6..1.2/4` or `NAME=one,other`.
pub(crate) fn axis(text: &str) -> Result<Axis, String> {
    let (name, values) = assignment(text).map_err(|_| "write NAME=VALUES: seed=1..100, pitch=0.6..1.2/4 or a,b,c")?;
    let values = match values.split_once("..") {
        Some((from, to)) if !values.contains(',') => range(from.trim(), to.trim())?,
        _ => list(&values)?,
    };
    let mut sorted: Vec<&String> = values.iter().collect();
    sorted.sort();
    if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("`{name}` has the value `{}` twice", pair[0]));
    }
    Ok(Axis { name, values })
}

fn range(from: &str, to: &str) -> Result<Vec<String>, String> {
    let too_many = || format!("a sweep has at most {MOST} variants");
    let Some((to, count)) = to.split_once('/') else {
        let whole = |text: &str| {
            text.parse::<i64>().map_err(|_| format!("`{text}` is no whole number; for others write FROM..TO/COUNT"))
        };
        let (from, to) = (whole(from)?, whole(to)?);
        if from > to {
            return Err(format!("the range from {from} to {to} is empty; write the lower number first"));
        }
        if to.abs_diff(from) >= MOST as u64 {
            return Err(too_many());
        }
        return Ok((from..=to).map(|value| value.to_string()).collect());
    };
    let number =
        |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite()).ok_or(format!("`{text}` is no number"));
    let (from, to) = (number(from)?, number(to)?);
    let count: usize = count.trim().parse().map_err(|_| format!("`{count}` is no number of values"))?;
    match count {
        0 => Err("a range has at least one value".into()),
        1 => Ok(vec![from.to_string()]),
        _ if count > MOST => Err(too_many()),
        _ => Ok((0..count).map(|i| between(from, to, i as f64 / (count - 1) as f64)).collect()),
    }
}

/// Interpolates, and formats with at most twelve digits.
fn between(from: f64, to: f64, part: f64) -> String {
    let value = from * (1.0 - part) + to * part;
    format!("{value:.11e}").parse().unwrap_or(value).to_string()
}

/// Splits values at commas outside brackets and quotes.
fn list(text: &str) -> Result<Vec<String>, String> {
    let mut values = vec![String::new()];
    let (mut depth, mut quoted) = (0_i32, false);
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            '(' | '[' if !quoted => depth += 1,
            ')' | ']' if !quoted => depth -= 1,
            _ => {}
        }
        match values.last_mut() {
            Some(value) if c != ',' || depth > 0 || quoted => value.push(c),
            _ => values.push(String::new()),
        }
    }
    let values: Vec<String> = values.iter().map(|value| value.trim().to_owned()).collect();
    if values.iter().any(String::is_empty) { Err("a value is missing between commas".into()) } else { Ok(values) }
}

/// A range of variants, counted from 1: the first and the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Variants {
    pub(crate) first: usize,
    pub(crate) last: usize,
}

/// Parses `7` or `5-8`.
pub(crate) fn variants(text: &str) -> Result<Variants, String> {
    let number = |text: &str| text.parse().ok().filter(|n| *n > 0);
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last => Ok(Variants { first, last }),
        _ => Err("write I or I-J, counted from 1: 7 or 5-8".into()),
    }
}

/// Values of a variant, one for each name.
pub(crate) fn variant(axes: &[Axis], mut number: usize) -> Vec<(&str, &str)> {
    let mut values = Vec::with_capacity(axes.len());
    for axis in axes.iter().rev() {
        values.push((axis.name.as_str(), axis.values[number % axis.values.len()].as_str()));
        number /= axis.values.len();
    }
    values.reverse();
    values
}

/// Number of variants.
pub(crate) fn count(axes: &[Axis]) -> Result<usize, String> {
    for (i, axis) in axes.iter().enumerate() {
        if axes[..i].iter().any(|other| other.name == axis.name) {
            return Err(format!("`{}` is swept twice; write all its values behind one --sweep", axis.name));
        }
    }
    let count = axes.iter().try_fold(1_usize, |count, axis| count.checked_mul(axis.values.len()));
    let most = count.filter(|count| *count <= MOST);
    most.ok_or_else(|| format!("these are more than {MOST} variants; sweep fewer values, or in several runs"))
}

/// Prefix of the file names of a variant. Different variants get different prefixes, even if case is ignored: a hash
/// replaces a value that cannot be written verbatim or could run into the next one.
pub(crate) fn prefix(values: &[(&str, &str)]) -> String {
    let one = |(name, value): &(&str, &str)| format!("{}-{}", word(name), word(value));
    values.iter().map(|pair| one(pair) + "_").collect()
}

fn word(text: &str) -> String {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
    let kept: String =
        text.chars().map(|c| if plain(c) { c } else { c.to_ascii_lowercase() }).filter(|c| plain(*c)).collect();
    if kept == text && text.len() <= 40 && !text.starts_with('.') {
        return kept;
    }
    use sha2::{Digest, Sha256};
    let hash: String = Sha256::digest(text.as_bytes()).iter().take(4).map(|byte| format!("{byte:02x}")).collect();
    let short: String = kept.chars().take(24).collect();
    format!("{}~{hash}", short.trim_start_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<String> {
        axis(text).unwrap_or_else(|e| panic!("{text}: {e}")).values
    }

    #[test]
    fn parses_axis_values() {
        assert_eq!(values("seed=1..4"), ["1", "2", "3", "4"]);
        assert_eq!(values("seed=-1..1"), ["-1", "0", "1"]);
        assert_eq!(values("pitch=0.6..1.2/4"), ["0.6", "0.8", "1", "1.2"]);
        assert_eq!(values("pitch=1..0/3"), ["1", "0.5", "0"]);
        assert_eq!(values("pitch=2..9/1"), ["2"]);
        assert_eq!(values("p= a, b "), ["a", "b"]);
        assert_eq!(values("p=(1,2),(3,4)"), ["(1,2)", "(3,4)"]);
        assert_eq!(values("p=\"a,b\",c"), ["\"a,b\"", "c"]);
        let wrong = [
            "",
            "p",
            "p=",
            "p=a,,b",
            "p=1..x",
            "p=2..1",
            "p=1.5..2",
            "p=1..2/0",
            "p=1..2/x",
            "p=a,a",
            "=1",
            "p=1..999999",
            "p=0..1/999999",
            "p=1..inf/3",
            "p=0..0/2",
        ];
        wrong.iter().for_each(|text| assert!(axis(text).is_err(), "{text}"));
    }

    #[test]
    fn visits_each_combination_once() {
        let axes = [axis("a=1..3").unwrap(), axis("b=x,y").unwrap()];
        assert_eq!(count(&axes), Ok(6));
        let all: Vec<_> = (0..6).map(|i| variant(&axes, i)).collect();
        assert_eq!(all[0], [("a", "1"), ("b", "x")]);
        assert_eq!(all[1], [("a", "1"), ("b", "y")]);
        assert_eq!(all[5], [("a", "3"), ("b", "y")]);
        assert!(count(&[axes[0].clone(), axes[0].clone()]).is_err());
        let many = axis("c=1..1000").unwrap();
        let other = Axis { name: "d".into(), ..many.clone() };
        assert!(count(&[many, other]).is_err());
    }

    #[test]
    fn names_never_collide() {
        let values = [
            "1", "1_q-2", "2_q-3", "3", "A", "a", "a b", "a/b", "../x", ".", "ä", "#ff0000", "#FF0000", "ff0000", "x~1",
        ];
        let mut seen = std::collections::BTreeSet::new();
        for p in values {
            for q in values {
                let name = prefix(&[("p", p), ("q", q)]).to_lowercase();
                assert!(!name.contains(['/', '\\', ' ', '#']), "{name}");
                assert!(seen.insert(name.clone()), "{name}");
            }
        }
        assert_eq!(prefix(&[("seed", "1"), ("pitch", "0.6")]), "seed-1_pitch-0.6_");
        assert!(prefix(&[("x", &"9".repeat(500))]).len() < 60);
    }
}
