//! Points from a file: one `x,y` or `x,y,z` in mm a line.
use crate::quit::Quit;
use anyhow::{Context, bail};
use glam::DVec3;
use std::path::Path;

/// The largest file, in bytes.
const MOST: u64 = 8 << 20;

/// Reads the points of a file, `dimensions` numbers each; z is 0 if there are two.
pub(super) fn read(path: &Path, dimensions: usize) -> Result<Vec<DVec3>, Quit> {
    Ok(text(path)
        .and_then(|text| parse(&text, dimensions))
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

fn parse(text: &str, dimensions: usize) -> anyhow::Result<Vec<DVec3>> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    lines
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(i, line)| point(line, dimensions).with_context(|| format!("line {}", i + 1)))
        .collect()
}

fn point(line: &str, dimensions: usize) -> anyhow::Result<DVec3> {
    let mut numbers = Vec::new();
    for word in line.split(',') {
        let word = word.trim();
        match word.parse::<f64>() {
            Ok(n) if n.is_finite() => numbers.push(n),
            _ => bail!("`{word}` is not a finite number"),
        }
    }
    match (&numbers[..], dimensions) {
        (&[x, y], 2) => Ok(DVec3::new(x, y, 0.0)),
        (&[x, y, z], 3) => Ok(DVec3::new(x, y, z)),
        (_, 2) => bail!("a field is taken at `x,y`; found {} numbers", numbers.len()),
        _ => bail!("a solid is taken at `x,y,z`; found {} numbers", numbers.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read() {
        let points = parse("\u{feff}1,2\r\n\n -0.5 , 1e-3\n", 2).unwrap();
        assert_eq!(points, [DVec3::new(1.0, 2.0, 0.0), DVec3::new(-0.5, 0.001, 0.0)]);
        assert_eq!(parse("1,2,3", 3).unwrap(), [DVec3::new(1.0, 2.0, 3.0)]);
        assert!(parse("1,2", 3).is_err());
        for (text, line) in [("1,2\nx,1", 2), ("1", 1), ("1,2,3", 1), ("1,2\n\n1,inf", 3), ("1,\n", 1)] {
            let error = format!("{:#}", parse(text, 2).unwrap_err());
            assert!(error.starts_with(&format!("line {line}: ")), "{error}");
        }
    }
}
