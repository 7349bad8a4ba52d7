//! Points from a file: one `x,y` in mm a line.
use crate::quit::Quit;
use anyhow::{Context, bail};
use glam::DVec2;
use std::path::Path;

/// The largest file, in bytes.
const MOST: u64 = 8 << 20;

/// Reads the points of a file.
pub(super) fn read(path: &Path) -> Result<Vec<DVec2>, Quit> {
    Ok(text(path)
        .and_then(|text| parse(&text))
        .with_context(|| format!("cannot read points from `{}`", path.display()))?)
}

fn text(path: &Path) -> anyhow::Result<String> {
    let meta = std::fs::metadata(path)?;
    // Opening a pipe would wait for somebody to write.
    if !meta.is_file() {
        bail!("it is not a regular file");
    }
    if meta.len() > MOST {
        bail!("it has {} MiB; at most {} MiB are read", meta.len() >> 20, MOST >> 20);
    }
    String::from_utf8(std::fs::read(path)?).context("it is not UTF-8 text")
}

fn parse(text: &str) -> anyhow::Result<Vec<DVec2>> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    lines
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(i, line)| point(line).with_context(|| format!("line {}", i + 1)))
        .collect()
}

fn point(line: &str) -> anyhow::Result<DVec2> {
    let mut numbers = Vec::new();
    for word in line.split(',') {
        let word = word.trim();
        match word.parse::<f64>() {
            Ok(n) if n.is_finite() => numbers.push(n),
            _ => bail!("`{word}` is not a finite number"),
        }
    }
    match numbers[..] {
        [x, y] => Ok(DVec2::new(x, y)),
        _ => bail!("a field is taken at `x,y`; found {} numbers", numbers.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read() {
        let points = parse("\u{feff}1,2\r\n\n -0.5 , 1e-3\n").unwrap();
        assert_eq!(points, [DVec2::new(1.0, 2.0), DVec2::new(-0.5, 0.001)]);
        for (text, line) in [("1,2\nx,1", 2), ("1", 1), ("1,2,3", 1), ("1,2\n\n1,inf", 3), ("1,\n", 1)] {
            let error = format!("{:#}", parse(text).unwrap_err());
            assert!(error.starts_with(&format!("line {line}: ")), "{error}");
        }
    }
}
