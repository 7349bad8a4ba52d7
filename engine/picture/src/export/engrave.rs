//! Greys for a laser whose depths were measured: each height becomes the grey that burns its depth.
use super::decl::{FieldDecl, HEIGHT, NumberForm, Numbers, Takes, count, names};
use super::films::DATUM;
use super::heights::{HeightMap, Heights, Maker, Part, Stop, place, refused, told};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::value::diagnostics::{Code, Problem};
use crate::{Depth, Format, PictureSpec, WriteError, Writer};
use std::io;
use std::path::Path;
use std::sync::Arc;

const FORMATS: [(&str, Format); 2] = [("Png", Format::Png), ("Tiff", Format::Tiff)];

const DEPTHS: [(&str, Depth); 2] = [("U8", Depth::U8), ("U16", Depth::U16)];

/// Names of the grey of the greatest depth; true for white.
const DEEP: [(&str, bool); 2] = [("Black", false), ("White", true)];

/// Rows that are converted together.
const ROWS: u32 = 256;

/// The target.
pub(super) struct Engrave;

impl ExportTarget for Engrave {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Engrave",
                title: "a laser",
                doc: "The greys with which a laser engraves a height.",
                fields: &[
                    HEIGHT,
                    FieldDecl::new(
                        "calibration",
                        "Depths in mm and the greys that burn them, 0 for none and 1 for the most: `[(0, 0), (0.05, 0.3)]`.",
                        Takes::Numbers(Numbers::new(NumberForm::Pairs, [0.0, 1e4], &[0.0, 0.0, 1.0, 1.0])),
                    ),
                    FieldDecl::new(
                        "deep",
                        "The colour of the greatest depth in the file.",
                        Takes::Words(|| names(&DEEP)),
                    ),
                    DATUM,
                    count(
                        "passes",
                        "The number of passes, each of which burns an equal share of the depth.",
                        [1.0, 1000.0],
                        &[1.0],
                    ),
                    FieldDecl::new("depth", "The type of the samples.", Takes::Words(|| names(&DEPTHS))),
                    FieldDecl::new("format", "The format of the file.", Takes::Words(|| names(&FORMATS))),
                ],
                variants: &[],
            }
        }
    }

    fn plan(&self, options: &Options) -> Plan {
        // A datum that is written may leave a blank picture, which each run tells.
        Plan { cached: options.number("datum").is_none(), ..Plan::one(options.word("format", &FORMATS).extension()) }
    }

    fn check(&self, options: &Options) -> Option<Problem> {
        let greys = options.numbers("calibration")?.chunks_exact(2).map(|pair| pair[1]);
        let over = greys.into_iter().find(|grey| *grey > 1.0)?;
        let message = format!("`calibration` has the grey {over}; greys range from 0 to 1");
        Some(Problem::new(Code::OutOfRange, message).at("calibration").help("divide levels of 0 to 255 by 255"))
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let calibration = options.numbers("calibration").unwrap_or(&[0.0, 0.0, 1.0, 1.0]);
        let maker = GreyMaker {
            stem: source.place.stem.clone(),
            calibration: calibration.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect(),
            white: options.word("deep", &DEEP),
            datum: options.number("datum"),
            passes: options.number("passes").unwrap_or(1.0),
            depth: options.word("depth", &DEPTHS),
            format: options.word("format", &FORMATS),
        };
        Ok(Files::Heights(Heights::of(source, Arc::new(maker))))
    }
}

#[derive(Clone, Debug)]
struct GreyMaker {
    stem: String,
    calibration: Vec<(f64, f64)>,
    white: bool,
    datum: Option<f64>,
    passes: f64,
    depth: Depth,
    format: Format,
}

impl GreyMaker {
    fn name(&self) -> String {
        format!("{}.{}", self.stem, self.format.extension())
    }

    /// The sample of a depth of one pass: piecewise linear between the measured depths.
    fn grey(&self, depth: f64) -> f32 {
        let after = self.calibration.partition_point(|(known, _)| *known < depth);
        let (Some(before), Some(next)) = (self.calibration.get(after.saturating_sub(1)), self.calibration.get(after))
        else {
            return self.sample(self.calibration.last().map_or(1.0, |(_, grey)| *grey));
        };
        if after == 0 {
            return self.sample(next.1);
        }
        let share = (depth - before.0) / (next.0 - before.0);
        self.sample(before.1 + share * (next.1 - before.1))
    }

    #[expect(clippy::cast_possible_truncation, reason = "samples are f32")]
    fn sample(&self, grey: f64) -> f32 {
        (if self.white { grey } else { 1.0 - grey }) as f32
    }

    /// Refuses a height that is deeper than the calibration.
    fn check(&self, map: &HeightMap, datum: f64) -> Result<(), WriteError> {
        let ((lowest, least), deepest) = (map.lowest(), self.calibration.last().map_or(0.0, |(depth, _)| *depth));
        let most = datum - least;
        if most <= deepest * self.passes * (1.0 + 1e-6) {
            return Ok(());
        }
        let each = if self.passes > 1.0 { format!(", {} passes", self.passes) } else { String::new() };
        let message = format!(
            "the height is {} mm deep at {}, and the calibration ends at {} mm{each}",
            told(most),
            place(lowest),
            told(deepest)
        );
        let help = if deepest > 0.0 {
            format!(
                "write `passes: {}`, measure a greater depth for `calibration`, or scale the height",
                (most / deepest).ceil()
            )
        } else {
            "add a measured depth to `calibration`".to_owned()
        };
        Err(refused(Code::TooDeep, message, help))
    }
}

impl Maker for GreyMaker {
    fn names(&self) -> Vec<String> {
        Vec::new()
    }

    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError> {
        let datum = self.datum.unwrap_or(map.range().1);
        self.check(map, datum)?;
        let path = folder.join(self.name());
        let size = (map.size.x, map.size.y);
        let mut spec = PictureSpec::bilevel(size, self.format, map.pixel.as_vec2().to_array());
        (spec.depth, spec.compression, spec.metadata) = (self.depth, map.compression, map.metadata.clone());
        spec.metadata.push(("shibo:depth_mm".to_owned(), told(datum - map.range().0)));
        spec.metadata.push(("shibo:passes".to_owned(), self.passes.to_string()));
        let mut writer = Writer::create(&path, &spec)?;
        let mut greys = Vec::new();
        for first in (0..size.1).step_by(ROWS as usize) {
            if stop() {
                return Err(WriteError::at(&path, io::ErrorKind::Interrupted.into()));
            }
            let rows = ROWS.min(size.1 - first);
            let heights = &map.values[first as usize * size.0 as usize..][..rows as usize * size.0 as usize];
            greys.clear();
            greys.extend(heights.iter().map(|v| self.grey((datum - f64::from(*v)).max(0.0) / self.passes)));
            writer.write_rows(&[&greys], rows)?;
        }
        let mut parts = vec![Part::File(writer.finish_unnamed()?.0)];
        if self.datum.is_some() && map.range().0 >= datum {
            let message = format!("no height lies below the datum of {} mm: the picture is blank", told(datum));
            let help = format!("write a `datum` above {}, or leave it out", told(map.range().0));
            parts.push(Part::Advice(Problem::new(Code::Advice, message).help(help)));
        }
        Ok(parts)
    }
}

#[cfg(test)]
mod tests {
    use super::super::heights::tests::{map, problem};
    use super::*;

    fn maker() -> GreyMaker {
        GreyMaker {
            stem: "a".to_owned(),
            calibration: vec![(0.0, 0.0), (0.05, 0.3), (0.2, 1.0)],
            white: true,
            datum: None,
            passes: 1.0,
            depth: Depth::U16,
            format: Format::Png,
        }
    }

    #[test]
    fn greys_burn_the_measured_depths() {
        let grey = |depth| maker().grey(depth);
        assert_eq!([grey(0.0), grey(0.05), grey(0.2)], [0.0, 0.3, 1.0]);
        assert!((grey(0.125) - 0.65).abs() < 1e-6 && (grey(0.025) - 0.15).abs() < 1e-6);
        assert_eq!(GreyMaker { white: false, ..maker() }.grey(0.05), 0.7);
        // Greys rise with the depth, so that depths can be read back from them.
        assert!((0..200).all(|k| grey(f64::from(k) * 0.001) < grey(f64::from(k + 1) * 0.001)));
    }

    #[test]
    fn refuses_depths_beyond_the_calibration() {
        let folder = tempfile::tempdir().unwrap();
        let deep = map(2, &[0.0, -0.1, -0.1, -0.5]);
        let problem = problem(maker().make(&deep, folder.path(), &|| false));
        assert_eq!(problem.code, Code::TooDeep);
        assert!(problem.message.contains("0.5 mm deep at (1.50, 1.50) mm"), "{problem}");
        assert!(problem.help.is_some_and(|help| help.contains("passes: 3")));
        assert!(GreyMaker { passes: 3.0, ..maker() }.make(&deep, folder.path(), &|| false).is_ok());
        assert!(GreyMaker { datum: Some(-0.4), ..maker() }.make(&deep, folder.path(), &|| false).is_ok());
        assert_eq!(folder.path().read_dir().unwrap().count(), 0, "files without names are removed");
    }
}
