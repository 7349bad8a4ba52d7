//! The times of test programs and tests.
use std::fmt;

/// The number of tests that a report shows.
const SLOWEST: usize = 10;

/// The time of a test, or of a whole test program.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    program: String,
    /// The test; `None` for the program.
    test: Option<String>,
    seconds: f64,
}

impl Entry {
    /// The time of a whole program.
    pub(crate) fn program(program: &str, seconds: f64) -> Self {
        Self { program: program.to_owned(), test: None, seconds }
    }

    /// The time of a test, from a line that libtest prints: `test name ... ok <0.123s>`.
    pub(crate) fn test(program: &str, line: &str) -> Option<Self> {
        let (name, result) = line.trim_end().strip_prefix("test ")?.split_once(" ... ")?;
        let seconds = result.rsplit_once('<')?.1.strip_suffix("s>")?.parse().ok()?;
        let name = name.trim_end_matches(" - should panic");
        Some(Self { program: program.to_owned(), test: Some(name.to_owned()), seconds })
    }
}

/// An entry as a line of the file that collects them.
pub(crate) fn line(entry: &Entry) -> String {
    format!("{}\t{}\t{}\n", entry.seconds, entry.program, entry.test.as_deref().unwrap_or_default())
}

/// The times of all programs and tests of a run.
#[derive(Debug, Default)]
pub(crate) struct Report {
    programs: Vec<Entry>,
    tests: Vec<Entry>,
}

impl Report {
    /// Reads the lines that [`line()`] wrote.
    pub(crate) fn read(text: &str) -> Self {
        let mut report = Self::default();
        for line in text.lines() {
            let [seconds, program, test] = line.split('\t').collect::<Vec<_>>()[..] else { continue };
            let Ok(seconds) = seconds.parse() else { continue };
            let test = (!test.is_empty()).then(|| test.to_owned());
            let list = if test.is_some() { &mut report.tests } else { &mut report.programs };
            list.push(Entry { program: program.to_owned(), test, seconds });
        }
        for list in [&mut report.programs, &mut report.tests] {
            list.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        }
        report
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.programs.is_empty() {
            return Ok(());
        }
        writeln!(f, "\nTest programs, slowest first:")?;
        for entry in &self.programs {
            let count = self.tests.iter().filter(|test| test.program == entry.program).count();
            writeln!(f, "{:9.1} s  {}, {count} tests", entry.seconds, entry.program)?;
        }
        writeln!(f, "The slowest of {} tests:", self.tests.len())?;
        for entry in self.tests.iter().take(SLOWEST) {
            writeln!(f, "{:9.1} s  {}: {}", entry.seconds, entry.program, entry.test.as_deref().unwrap_or_default())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_lines_of_libtest() {
        let time = |line: &str| Entry::test("cli", line).map(|entry| (entry.test.unwrap_or_default(), entry.seconds));
        assert_eq!(time("test a::b ... ok <0.303s>\n"), Some(("a::b".to_owned(), 0.303)));
        assert_eq!(time("test a - should panic ... FAILED <12.000s>"), Some(("a".to_owned(), 12.0)));
        for other in ["test a ... ignored", "test result: ok. 3 passed", "running 4 tests", "test of <1s>", ""] {
            assert_eq!(time(other), None, "{other}");
        }
    }

    #[test]
    fn shows_the_slowest_first() {
        let tests = (0..12).filter_map(|i| Entry::test("cli", &format!("test t{i} ... ok <{i}.5s>")));
        let text: String =
            tests.chain([Entry::program("cli", 80.0), Entry::program("nodes", 90.0)]).map(|e| line(&e)).collect();
        let shown = Report::read(&text).to_string();
        let lines: Vec<&str> = shown.lines().filter(|line| line.starts_with(' ')).map(str::trim_start).collect();
        assert_eq!(lines[..3], ["90.0 s  nodes, 0 tests", "80.0 s  cli, 12 tests", "11.5 s  cli: t11"]);
        assert_eq!(lines.len(), 2 + SLOWEST);
    }
}
