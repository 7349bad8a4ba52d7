//! Points from a file with one point per line, in mm: `x,y` on the canvas or `x,y,z` in space.
use crate::quit::Quit;
use anyhow::{Context, bail};
use glam::{DVec2, DVec3};
use std::path::Path;

/// Maximum file size in bytes.
const MOST: u64 = 8 << 20;

/// Points in mm.
#[derive(Debug, PartialEq)]
pub(super) enum Points {
    Canvas(Vec<DVec2>),
    Space(Vec<DVec3>),
}

/// Reads the points of a file; either all have two numbers or all have three.
pub(super) fn read(path: &Path) -> Result<Points, Quit> {
    Ok(text(path)
        .and_then(|text| parse(&text))
        .with_context(|| format!("cannot read points from `{}`", path.display()))?)
}

fn text(path: &Path) -> anyhow::Result<String> {
    let meta = std::fs::metadata(path)?;
    // Opening a pipe would block until another program writes to it.
    if !meta.is_file() {
        bail!("it is not a regular file");
    }
    if meta.len() > MOST {
        bail!("it has {} MiB; at most {} MiB are read", meta.len() >> 20, MOST >> 20);
    }
    String::from_utf8(std::fs::read(path)?).context("it is not UTF-8 text")
}

fn parse(text: &str) -> anyhow::Result<Points> {
    let (mut plane, mut space) = (Vec::new(), Vec::new());
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    for (i, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let numbers = numbers(line).with_context(|| format!("line {}", i + 1))?;
        match numbers[..] {
            [x, y] if space.is_empty() => plane.push(DVec2::new(x, y)),
            [x, y, z] if plane.is_empty() => space.push(DVec3::new(x, y, z)),
            [_, _] | [_, _, _] => bail!("line {}: {} numbers, after lines of another kind", i + 1, numbers.len()),
            _ => bail!("line {}: `x,y` or `x,y,z` is expected; found {} numbers", i + 1, numbers.len()),
        }
    }
    Ok(if space.is_empty() { Points::Canvas(plane) } else { Points::Space(space) })
}

fn numbers(line: &str) -> anyhow::Result<Vec<f64>> {
    let number = |word: &str| match word.trim().parse::<f64>() {
        Ok(n) if n.is_finite() => Ok(n),
        _ => bail!("`{}` is not a finite number", word.trim()),
    };
    line.split(',').map(number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_points() {
        let points = parse("\u{feff}1,2\r\n\n -0.5 , 1e-3\n").unwrap();
        assert_eq!(points, Points::Canvas(vec![DVec2::new(1.0, 2.0), DVec2::new(-0.5, 0.001)]));
        assert_eq!(parse("1,2,3").unwrap(), Points::Space(vec![DVec3::new(1.0, 2.0, 3.0)]));
        for (text, line) in
            [("1,2\nx,1", 2), ("1", 1), ("1,2\n1,2,3", 2), ("1,2\n\n1,inf", 3), ("1,\n", 1), ("1,2,3\n1,2", 2)]
        {
            let error = format!("{:#}", parse(text).unwrap_err());
            assert!(error.starts_with(&format!("line {line}: ")), "{error}");
        }
    }
}
