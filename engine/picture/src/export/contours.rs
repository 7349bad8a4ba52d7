//! Contour lines of a height, as SVG and as DXF.
mod dxf;

use super::decl::{FieldDecl, HEIGHT, NumberForm, Numbers, Takes, names, number};
use super::heights::{HeightMap, Heights, Maker, Part, Stop, file_of, refused, told};
use super::lines::{Line, Rimmed, simplified, write_path};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::value::diagnostics::{Code, Problem};
use crate::{WriteError, write_svg};
use glam::DVec2;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

/// True for DXF.
const FORMATS: [(&str, bool); 2] = [("Svg", false), ("Dxf", true)];

/// The most levels of a file.
const MOST: f64 = 10_000.0;

/// The most levels that a warning names.
const NAMED: usize = 3;

/// The target.
pub(super) struct Contours;

impl ExportTarget for Contours {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Contours",
                title: "contour lines",
                doc: "Contour lines of a height, for plotters and CAD.",
                fields: &[
                    HEIGHT,
                    number(
                        "step",
                        "The difference between levels in mm; 0.1 without `levels`. Levels are multiples of it.",
                        [1e-3, 100.0],
                        &[],
                    ),
                    FieldDecl::new(
                        "levels",
                        "The levels in mm, instead of `step`.",
                        Takes::Numbers(Numbers::new(NumberForm::Rising, [-1e6, 1e6], &[])),
                    ),
                    number(
                        "tolerance",
                        "The greatest distance of simplified lines from the exact ones, in mm.",
                        [0.0, 1.0],
                        &[0.005],
                    ),
                    FieldDecl::new("format", "The format of the file.", Takes::Words(|| names(&FORMATS))),
                ],
                variants: &[],
            }
        }
    }

    fn plan(&self, options: &Options) -> Plan {
        let extension = if options.word("format", &FORMATS) { "dxf" } else { "svg" };
        // Levels that are written may have no lines, which each run tells.
        Plan { cached: options.numbers("levels").is_none(), ..Plan::one(extension) }
    }

    fn check(&self, options: &Options) -> Option<Problem> {
        let both = options.number("step").is_some() && options.numbers("levels").is_some();
        let problem = || Problem::new(Code::BadValue, "`step` and `levels` both tell the levels").at("step");
        both.then(|| problem().help("leave `step` or `levels` out"))
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let maker = LineMaker {
            stem: source.place.stem.clone(),
            step: options.number("step").unwrap_or(0.1),
            levels: options.numbers("levels").map(<[f64]>::to_vec),
            tolerance: options.number("tolerance").unwrap_or(0.0),
            dxf: options.word("format", &FORMATS),
        };
        Ok(Files::Heights(Heights::of(source, Arc::new(maker))))
    }
}

#[derive(Clone, Debug)]
struct LineMaker {
    stem: String,
    step: f64,
    levels: Option<Vec<f64>>,
    tolerance: f64,
    dxf: bool,
}

/// The lines of a level.
struct Level {
    height: f64,
    lines: Vec<Line>,
}

impl LineMaker {
    fn levels(&self, map: &HeightMap) -> Result<Vec<f64>, WriteError> {
        if let Some(levels) = &self.levels {
            return Ok(levels.clone());
        }
        let (least, greatest) = map.range();
        let (first, last) = ((least / self.step).ceil(), (greatest / self.step).floor());
        if last - first >= MOST {
            let message =
                format!("`step: {}` gives {} levels; at most {MOST} are allowed", self.step, last - first + 1.0);
            let help = format!("write `step: {}` or more", told((greatest - least) / MOST + 5e-5));
            return Err(refused(Code::TooLarge, message, help));
        }
        #[expect(clippy::cast_possible_truncation, reason = "multiples within the heights")]
        let multiples = first as i64..=last as i64;
        Ok(multiples.map(|k| k as f64 * self.step).collect())
    }

    /// The levels and their lines; levels without lines are left out.
    fn traced(&self, map: &HeightMap, heights: &[f64], stop: Stop<'_>) -> Result<Option<Vec<Level>>, WriteError> {
        let mut levels = Vec::new();
        let whole = Rimmed::of(map)?.levels(map, heights, stop, &mut |level, mut lines| {
            lines.iter_mut().for_each(|line| line.points = simplified(line, self.tolerance));
            if !lines.is_empty() {
                levels.push(Level { height: heights[level], lines });
            }
        });
        Ok(whole.map(|()| levels))
    }

    /// A warning about levels that have no lines, if there are some that one expects.
    fn advice(&self, map: &HeightMap, levels: &[Level]) -> Option<Problem> {
        let (least, greatest) = map.range();
        let range = format!("the heights range from {} to {} mm", told(least), told(greatest));
        let Some(wanted) = &self.levels else {
            let message = format!("no multiple of `step`, {} mm, has a line: {range}", told(self.step));
            let help = "write a smaller `step`, or `levels` within the heights";
            return levels.is_empty().then(|| Problem::new(Code::Advice, message).help(help));
        };
        let is_missing = |height: &&f64| levels.binary_search_by(|level| level.height.total_cmp(height)).is_err();
        let missing: Vec<String> = wanted.iter().filter(is_missing).map(|height| told(*height)).collect();
        let (named, others) = missing.split_at(missing.len().min(NAMED));
        let message = match (named, others.len()) {
            ([], _) => return None,
            ([one], 0) => format!("the level {one} mm has no line: {range}"),
            (_, 0) => format!("the levels {} mm have no lines: {range}", named.join(", ")),
            (_, more) => format!("the levels {} mm and {more} others have no lines: {range}", named.join(", ")),
        };
        Some(Problem::new(Code::Advice, message).help("write `levels` within the heights, in mm"))
    }
}

impl Maker for LineMaker {
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError> {
        let path = folder.join(format!("{}.{}", self.stem, if self.dxf { "dxf" } else { "svg" }));
        let levels = self.traced(map, &self.levels(map)?, stop)?;
        let levels = levels.ok_or_else(|| WriteError::at(&path, io::ErrorKind::Interrupted.into()))?;
        let file = file_of(&path, |out| {
            if self.dxf { out.write_all(dxf::text(&levels, map.size_mm.y).as_bytes()) } else { svg(&levels, map, out) }
        })?;
        Ok([Part::File(file)].into_iter().chain(self.advice(map, &levels).map(Part::Advice)).collect())
    }
}

/// Writes lines in mm with y down, and a group for each level.
fn svg(levels: &[Level], map: &HeightMap, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(write_svg::opened(DVec2::ZERO, map.size_mm).as_bytes())?;
    out.write_all(b"<g fill=\"none\" stroke=\"black\" stroke-width=\"0.05\">\n")?;
    for level in levels {
        let height = told(level.height);
        write!(out, "<g id=\"level_{height}\" data-height-mm=\"{height}\"><path d=\"")?;
        write_path(out, &level.lines)?;
        out.write_all(b"\"/></g>\n")?;
    }
    out.write_all(b"</g>\n</svg>\n")
}

#[cfg(test)]
mod tests;
