//! Drafts of weaving: the threads that lie on top at each crossing.

/// A draft: rows from the top, `true` where the warp lies over the weft. It repeats.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    over: Vec<bool>,
    /// Number of warp threads after which it repeats.
    pub warp: u32,
    /// Number of weft threads after which it repeats.
    pub weft: u32,
}

/// Maximum number of threads of a draft, each way.
pub const MOST: usize = 256;

/// Names of drafts, for messages.
pub const NAMES: &str = "plain, basket, twill 2/1, twill 2/2, twill 3/1, herringbone, satin, sateen";

impl Draft {
    /// The draft with these rows.
    fn of(warp: usize, weft: usize, over: impl Fn(usize, usize) -> bool) -> Self {
        let all = (0..weft).flat_map(|j| (0..warp).map(move |i| (i, j))).map(|(i, j)| over(i, j)).collect();
        let count = crate::ground::number::index_u32;
        Self { over: all, warp: count(warp), weft: count(weft) }
    }

    /// Reads a draft: a name, or rows of `x` (warp over) and `.` (weft over), separated by `/` or by new lines.
    pub fn read(text: &str) -> Result<Self, String> {
        let name = text.trim();
        match name {
            "plain" => return Ok(Self::of(2, 2, |i, j| (i + j) % 2 == 0)),
            "basket" => return Ok(Self::of(4, 4, |i, j| (i / 2 + j / 2) % 2 == 0)),
            "satin" => return Ok(Self::of(5, 5, |i, j| (i + 5 * 3 - 2 * j % 5) % 5 != 0)),
            "sateen" => return Ok(Self::of(5, 5, |i, j| (i + 5 * 3 - 2 * j % 5) % 5 == 0)),
            "herringbone" => {
                return Ok(Self::of(16, 4, |i, j| (if i < 8 { j + i } else { j + 15 + 2 - i }) % 4 < 2));
            }
            _ => {}
        }
        if let Some(steps) = name.strip_prefix("twill ") {
            let numbers: Vec<usize> = steps.split('/').filter_map(|n| n.trim().parse().ok()).collect();
            return match numbers[..] {
                [over @ 1..=24, under @ 1..=24] => {
                    let all = over + under;
                    Ok(Self::of(all, all, |i, j| (i + j) % all < over))
                }
                _ => Err(format!("draft is `{name}`; write `twill 2/1`, with numbers from 1 to 24")),
            };
        }
        rows("draft", text, "x", ".")
    }

    /// The draft of a loom: for each warp thread its shaft, for each treadle the shafts that it lifts, and for each weft
    /// thread its treadle. Shafts and treadles are the digits 1 to 9 and the letters a to f.
    pub fn of_loom(threading: &str, tie_up: &str, treadling: &str) -> Result<Self, String> {
        let shafts = digits("threading", threading)?;
        let treadles = digits("treadling", treadling)?;
        let ties: Vec<&str> = tie_up.split('/').collect();
        let ties: Vec<Vec<u32>> = ties.iter().map(|t| digits("tie_up", t)).collect::<Result<_, _>>()?;
        if let Some(treadle) = treadles.iter().find(|t| **t as usize > ties.len()) {
            return Err(format!("treadling has treadle {treadle}; tie_up has only {}", ties.len()));
        }
        Ok(Self::of(shafts.len(), treadles.len(), |i, j| ties[treadles[j] as usize - 1].contains(&shafts[i])))
    }

    /// True if the warp thread `i` lies over the weft thread `j`.
    pub fn over(&self, i: i64, j: i64) -> bool {
        let (w, h) = (i64::from(self.warp), i64::from(self.weft));
        let place = j.rem_euclid(h) * w + i.rem_euclid(w);
        usize::try_from(place).ok().and_then(|n| self.over.get(n)).copied().unwrap_or(false)
    }
}

/// Reads rows of two characters.
fn rows(name: &str, text: &str, yes: &str, no: &str) -> Result<Draft, String> {
    let wanted =
        format!("write rows of `{yes}` (warp over) and `{no}` (weft over), separated by `/`, or one of {NAMES}");
    let rows: Vec<Vec<char>> = text
        .split(['/', '\n'])
        .map(|row| row.chars().filter(|c| !c.is_whitespace()).collect::<Vec<char>>())
        .filter(|row| !row.is_empty())
        .collect();
    let Some(first) = rows.first() else { return Err(format!("{name} is empty; {wanted}")) };
    let columns = first.len();
    if rows.len() > MOST || columns > MOST {
        let (w, h) = (columns, rows.len());
        return Err(format!("{name} has {w} × {h} crossings; at most {MOST} × {MOST} are woven"));
    }
    for (number, row) in (1..).zip(&rows) {
        if row.len() != columns {
            let has = row.len();
            return Err(format!("row {number} of {name} has {has} crossings; the first row has {columns}"));
        }
        if let Some((k, c)) = (1..).zip(row).find(|(_, c)| !yes.contains(**c) && !no.contains(**c)) {
            return Err(format!("row {number} of {name} has `{c}` at place {k}; {wanted}"));
        }
    }
    Ok(Draft::of(columns, rows.len(), |i, j| yes.contains(rows[j][i])))
}

/// Reads shafts or treadles.
fn digits(name: &str, text: &str) -> Result<Vec<u32>, String> {
    let letters: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
    if letters.is_empty() || letters.len() > MOST {
        let n = letters.len();
        return Err(format!("{name} has {n} numbers; it takes 1 to {MOST}, such as `1234`"));
    }
    let read = (1..).zip(&letters).map(|(place, c)| match c.to_digit(16) {
        Some(d @ 1..) => Ok(d),
        _ => Err(format!("{name} has `{c}` at place {place}; write digits 1 to 9 or letters a to f")),
    });
    read.collect()
}

/// Reads a sequence of colours: letters a to z, which become 0 to 25.
pub fn sequence(name: &str, text: &str) -> Result<Vec<u32>, String> {
    let letters: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
    if letters.is_empty() || letters.len() > MOST {
        let n = letters.len();
        return Err(format!("{name} has {n} letters; it takes 1 to {MOST}, such as `aabb`"));
    }
    let read = (1..).zip(&letters).map(|(place, c)| match c {
        'a'..='z' => Ok(u32::from(*c) - u32::from('a')),
        _ => Err(format!("{name} has `{c}` at place {place}; write letters from a to z, one for each thread")),
    });
    read.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(draft: &Draft) -> String {
        let row = |j: u32| (0..draft.warp).map(|i| if draft.over(i.into(), j.into()) { 'x' } else { '.' }).collect();
        (0..draft.weft).map(row).collect::<Vec<String>>().join("/")
    }

    #[test]
    fn drafts_are_read() {
        let read = |text: &str| picture(&Draft::read(text).unwrap());
        assert_eq!(read("plain"), "x./.x");
        assert_eq!(read("twill 2/1"), "xx./x.x/.xx");
        assert_eq!(read("x.. / .x. / ..x"), "x../.x./..x");
        // Each row and column of a satin has one crossing that differs.
        for (name, count) in [("satin", 4), ("sateen", 1)] {
            let draft = Draft::read(name).unwrap();
            for k in 0..5 {
                assert_eq!((0..5).filter(|n| draft.over(*n, k)).count(), count);
                assert_eq!((0..5).filter(|n| draft.over(k, *n)).count(), count);
            }
        }
        let herringbone = Draft::read("herringbone").unwrap();
        assert!((0..16).all(|i| (0..4).filter(|j| herringbone.over(i, *j)).count() == 2));
        assert_eq!((herringbone.warp, herringbone.weft), (16, 4));
        assert_eq!(picture(&Draft::of_loom("1234", "12/23/34/41", "1234").unwrap()), "xx../.xx./..xx/x..x");
        assert_eq!(sequence("warp_colors", "aab").unwrap(), [0, 0, 1]);
    }

    #[test]
    fn faults_of_drafts_are_told_with_their_place() {
        assert!(Draft::read("xx/x?").unwrap_err().starts_with("row 2 of draft has `?` at place 2; write rows of `x`"));
        assert_eq!(Draft::read("xx/x").unwrap_err(), "row 2 of draft has 1 crossings; the first row has 2");
        assert!(Draft::read("twill 9000/1").unwrap_err().contains("write `twill 2/1`"));
        assert!(Draft::read("").unwrap_err().contains("empty"));
        assert!(Draft::read(&"x".repeat(300)).unwrap_err().contains("at most 256"));
        assert_eq!(Draft::of_loom("12", "1/2", "13").unwrap_err(), "treadling has treadle 3; tie_up has only 2");
        assert!(Draft::of_loom("102", "1/2", "1").unwrap_err().contains("`0` at place 2"));
        assert!(sequence("warp_colors", "aB").unwrap_err().contains("`B` at place 2"));
    }
}
