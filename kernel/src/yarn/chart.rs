//! Charts of knitting: a letter for each stitch.
use std::fmt::Write as _;

/// A stitch of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stitch {
    /// The loop comes through to the front.
    Knit,
    /// The loop goes through to the back.
    Purl,
    /// A knit stitch whose column moves to another one.
    Cross(Cross),
}

/// A stitch where columns cross.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cross {
    /// From this column of the picture to the one below the crossing, in stitches.
    pub from: i32,
    /// True if the column lies in front above the crossing.
    pub front: bool,
    /// Number of stitches that cross as many.
    pub span: u32,
}

/// A chart: rows from the top, all of the same length.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chart {
    /// Stitches, row by row.
    pub stitches: Vec<Stitch>,
    /// Number of stitches in a row.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
}

/// Maximum number of rows, and of stitches in a row.
pub const MOST: usize = 256;

/// Named charts.
pub const NAMED: [(&str, &str); 7] = [
    ("stocking", "k"),
    ("reverse", "p"),
    ("rib", "kkpp"),
    ("garter", "k/p"),
    ("moss", "kp/pk"),
    ("basket", "kkkkpppp/kkkkpppp/kkkkpppp/kkkkpppp/ppppkkkk/ppppkkkk/ppppkkkk/ppppkkkk"),
    ("cable", "ppkkkkpp/ppkkkkpp/ppkkkkpp/pp cccc pp/ppkkkkpp/ppkkkkpp"),
];

impl Chart {
    /// Reads a chart: a name, or rows of letters, separated by `/` or by new lines.
    pub fn read(text: &str) -> Result<Self, String> {
        let name = text.trim();
        let text = NAMED.iter().find(|(known, _)| *known == name).map_or(text, |(_, rows)| rows);
        let rows: Vec<&str> = text.split(['/', '\n']).filter(|row| !row.trim().is_empty()).collect();
        if rows.is_empty() {
            return Err(format!("chart has no stitches; {}", wanted()));
        }
        if rows.len() > MOST {
            return Err(format!("chart has {} rows; at most {MOST} are knitted", rows.len()));
        }
        let (mut stitches, mut columns) = (Vec::new(), 0);
        for (number, row) in (1..).zip(&rows) {
            let read = read_row(row).map_err(|why| format!("row {number} of the chart {why}"))?;
            if number == 1 {
                columns = read.len();
            } else if read.len() != columns {
                let (has, first) = (read.len(), columns);
                return Err(format!("row {number} of the chart has {has} stitches; the first row has {first}"));
            }
            stitches.extend(read);
        }
        if columns > MOST {
            return Err(format!("chart has {columns} stitches in a row; at most {MOST} are knitted"));
        }
        Ok(Self { stitches, columns: crate::ground::number::index_u32(columns), rows: count(rows.len()) })
    }

    /// The stitch of a place; the chart repeats.
    pub fn at(&self, column: i64, row: i64) -> Stitch {
        let (c, r) = (i64::from(self.columns), i64::from(self.rows));
        let place = row.rem_euclid(r) * c + column.rem_euclid(c);
        usize::try_from(place).ok().and_then(|n| self.stitches.get(n)).copied().unwrap_or(Stitch::Knit)
    }
}

fn count(n: usize) -> u32 {
    crate::ground::number::index_u32(n)
}

/// A description of the expected text.
fn wanted() -> String {
    let mut text = "write letters `k` (knit), `p` (purl), `c` and `C` (crossings), rows separated by `/`".to_owned();
    let names = NAMED.map(|(name, _)| name).join(", ");
    let _ = write!(text, ", or one of the names {names}");
    text
}

/// Reads the stitches of a row.
fn read_row(row: &str) -> Result<Vec<Stitch>, String> {
    let mut stitches = Vec::new();
    let letters: Vec<char> = row.chars().collect();
    let mut k = 0;
    while let Some(letter) = letters.get(k) {
        let run = letters[k..].iter().take_while(|other| *other == letter).count();
        match letter {
            'k' => stitches.extend(vec![Stitch::Knit; run]),
            'p' => stitches.extend(vec![Stitch::Purl; run]),
            'c' | 'C' => {
                if run % 2 == 1 {
                    let place = stitches.len() + 1;
                    return Err(format!(
                        "crosses {run} stitches from stitch {place} on; write an even number of `{letter}`, such as 4, \
                         and separate crossings by a space"
                    ));
                }
                let half = run / 2;
                for n in 0..run {
                    let left = n < half;
                    // Above the crossing, the left half comes from the right.
                    let from = i32::try_from(half).unwrap_or(0) * if left { 1 } else { -1 };
                    let front = left == (*letter == 'C');
                    stitches.push(Stitch::Cross(Cross { from, front, span: count(half) }));
                }
            }
            _ if letter.is_whitespace() => {}
            _ => {
                let place = stitches.len() + 1;
                return Err(format!("has the letter `{letter}` as stitch {place}; {}", wanted()));
            }
        }
        if stitches.len() > 2 * MOST {
            return Err(format!("has more than {MOST} stitches"));
        }
        k += run;
    }
    Ok(stitches)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_are_read() {
        let chart = Chart::read("kp/pk").unwrap();
        assert_eq!((chart.columns, chart.rows), (2, 2));
        assert_eq!([chart.at(0, 0), chart.at(3, -1), chart.at(0, 1)], [Stitch::Knit, Stitch::Knit, Stitch::Purl]);
        for (name, _) in NAMED {
            Chart::read(name).unwrap();
        }
        let Stitch::Cross(cross) = Chart::read("pccccp").unwrap().at(1, 0) else { panic!() };
        assert_eq!(cross, Cross { from: 2, front: false, span: 2 });
        assert_eq!(Chart::read("cc cc").unwrap().columns, 4);
    }

    #[test]
    fn faults_of_charts_are_told_with_their_place() {
        let fault = |text: &str| Chart::read(text).unwrap_err();
        assert!(
            fault("kk/kx").starts_with("row 2 of the chart has the letter `x` as stitch 2; write letters `k` (knit)")
        );
        assert_eq!(fault("kk/k"), "row 2 of the chart has 1 stitches; the first row has 2");
        assert!(fault(" / ").starts_with("chart has no stitches"));
        assert!(fault("kccck").contains("crosses 3 stitches from stitch 2 on"));
        assert!(fault(&"k".repeat(300)).contains("at most 256"));
        assert!(fault(&"k".repeat(1000)).contains("more than 256"));
        assert!(fault(&"k".repeat(1_000_000)).contains("256"));
        assert!(fault(&"k/".repeat(300)).contains("300 rows; at most 256"));
    }
}
