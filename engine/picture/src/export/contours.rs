//! Contour lines of a height, as SVG and as DXF.
mod dxf;

use super::decl::{FieldDecl, HEIGHT, NumberForm, Numbers, Takes, names, number};
use super::heights::{HeightMap, Heights, Maker, Part, Stop, refused, stopped, text_file, told};
use super::lines::{Line, Rimmed, simplified, svg_path};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::value::diagnostics::Code;
use crate::{WriteError, write_svg};
use glam::DVec2;
use std::fmt::Write;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// True for DXF.
const FORMATS: [(&str, bool); 2] = [("Svg", false), ("Dxf", true)];

/// The most levels of a file.
const MOST: f64 = 10_000.0;

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
                        "The difference between levels in mm. Levels are multiples of it.",
                        [1e-3, 100.0],
                        &[0.1],
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
        Plan::one(if options.word("format", &FORMATS) { "dxf" } else { "svg" })
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

    fn traced(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Level>, WriteError> {
        let rimmed = Rimmed::of(map)?;
        let level = |height: f64| {
            let mut lines = rimmed.lines(map, height, stop).ok_or_else(|| stopped(folder))?;
            lines.iter_mut().for_each(|line| line.points = simplified(line, self.tolerance));
            Ok(Level { height, lines })
        };
        self.levels(map)?
            .into_iter()
            .map(level)
            .filter(|level| !matches!(level, Ok(level) if level.lines.is_empty()))
            .collect()
    }
}

impl Maker for LineMaker {
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError> {
        let levels = self.traced(map, folder, stop)?;
        let (extension, text) =
            if self.dxf { ("dxf", dxf::text(&levels, map.size_mm.y)) } else { ("svg", svg(&levels, map)) };
        let path = folder.join(format!("{}.{extension}", self.stem));
        Ok(vec![Part::File(text_file(&path, &text)?)])
    }
}

/// Lines in mm with y down, and a group for each level.
fn svg(levels: &[Level], map: &HeightMap) -> String {
    let mut text = write_svg::opened(DVec2::ZERO, map.size_mm);
    text.push_str(
        "<g fill=\"none\" stroke=\"black\" stroke-width=\"0.05\">
",
    );
    for level in levels {
        let height = told(level.height);
        let data = svg_path(&level.lines);
        let _ = writeln!(text, "<g id=\"level_{height}\" data-height-mm=\"{height}\"><path d=\"{data}\"/></g>");
    }
    text.push_str("</g>\n</svg>\n");
    text
}
