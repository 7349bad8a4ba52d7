//! Points in CSV files, one per line.
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use std::str::FromStr;

/// The largest coordinate that files and graphs may contain.
pub(crate) const FARTHEST: f64 = 1e7;

/// Reads a file of at most `most` lines with N finite numbers each, in the format that `form` describes. `field` is the
/// parameter that names the file.
pub(crate) fn read<T: FromStr + Copy + Into<f64>, const N: usize>(
    file: &FileHandle,
    (field, form): (&str, &str),
    most: usize,
) -> Result<Vec<[T; N]>, Problem> {
    let bad = |line: u64, what: &str| {
        let message =
            format!("`{}`, line {line}: {what}; it must be `{form}` in mm, within ±{FARTHEST:e}", file.display());
        Problem::new(Code::BadFile, message).at(field)
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(file.open().map_err(|e| bad(0, &e.to_string()))?);
    let mut points = Vec::new();
    for record in reader.records() {
        let line = |e: &csv::Error| e.position().map_or(0, csv::Position::line);
        let record = record.map_err(|e| bad(line(&e), "it is not readable as CSV"))?;
        let at = record.position().map_or(0, csv::Position::line);
        let number = |text: &str| text.parse::<T>().ok().filter(|v| (*v).into().abs() <= FARTHEST);
        let numbers: Option<Vec<T>> = record.iter().map(number).collect();
        match numbers.and_then(|numbers| <[T; N]>::try_from(numbers).ok()) {
            Some(point) => points.push(point),
            None => return Err(bad(at, &format!("it is not {N} finite numbers"))),
        }
        if points.len() > most {
            return Err(bad(at, &format!("there are more than {most} points")));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_files_that_are_not_text() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
        assert_eq!(read::<f64, 3>(&(&path).into(), ("file", "x,y,z"), 9).unwrap_err().code, Code::BadFile);
    }

    #[test]
    fn reads_lines_or_names_the_faulty_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            super::read::<f32, 2>(&(&path).into(), ("file", "x,y"), 3)
        };
        assert_eq!(read("# places\n1, 2\n\n3.5,-4\n").unwrap(), [[1.0, 2.0], [3.5, -4.0]]);
        for (text, line, words) in [
            ("1,2\n1,x", 2, "it is not 2 finite numbers; it must be `x,y` in mm"),
            ("1,2,3", 1, "not 2 finite numbers"),
            ("1\n", 1, "not 2 finite numbers"),
            ("1,2\n3,inf", 2, "not 2 finite numbers"),
            ("1,2\n1e7,-1.1e7", 2, "within ±1e7"),
            ("0,0\n0,1\n0,2\n0,3", 4, "more than 3 points"),
        ] {
            let problem = read(text).unwrap_err();
            assert_eq!((problem.code, problem.field.as_deref()), (Code::BadFile, Some("file")));
            assert!(
                problem.message.contains(&format!("line {line}: ")) && problem.message.contains(words),
                "{text}: {}",
                problem.message
            );
        }
    }
}
