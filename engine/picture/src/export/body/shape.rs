//! Makes a body of a height: takes its options, finds triangles within the limits, and writes the files.
use super::super::heights::{HeightMap, Part, Stop, place, refused, refused_at, told};
use super::super::spool::{Opposite, Spool, Turned};
use super::super::target::{Options, Source};
use super::files::{Body, unwritten};
use super::report::{Facts, grouped, json, line, model_json, model_line};
use super::tool::Milled;
use super::{FORMS, Format, MOST, OVER, PATTERNS, files_of};
use crate::WriteError;
use crate::value::diagnostics::{Code, Problem};
use glam::DVec2;
use shibo_kernel::body::{Figures, Heights, MOST_ERROR, Mesher, Pattern, Receiver, Rows, Store, Tiles, Tolerance};
use std::fmt;
use std::io;
use std::path::Path;

/// A body with more than this share of all triangles, one in `NOISE`, shows fine noise.
const NOISE: u64 = 10;

/// The options that all bodies have.
#[derive(Clone, Debug)]
pub(in super::super) struct Common {
    pub(in super::super) stem: String,
    pub(in super::super) error: f64,
    triangles: f64,
    coarsen: bool,
    pattern: Pattern,
    pub(in super::super) mould: bool,
    wall: f64,
    /// The slope in degrees that the report measures.
    pub(in super::super) steepest: f64,
    /// The diameter of the milling tool in mm; 0 for none.
    tool: f64,
    format: Format,
    report: bool,
}

/// The numbers of a shape after its heights are known.
pub(in super::super) struct Made<'a> {
    /// The samples.
    pub(in super::super) heights: Heights<'a>,
    /// The bend of the field, and what rounding to the numbers of the file does.
    pub(in super::super) tolerance: Tolerance,
    /// The wall at height 0, in mm.
    pub(in super::super) wall: f64,
    /// The radius of a roll.
    pub(in super::super) radius: Option<f64>,
    /// How the samples were turned: from a place on them to a place on the picture.
    pub(in super::super) on_picture: Box<dyn Fn([f64; 2]) -> DVec2>,
}

/// A height as a body takes it: turned, and for a mould opposite and mirrored.
pub(in super::super) struct Canvas<'a> {
    /// The heights, row by row.
    pub(in super::super) rows: &'a dyn Rows,
    /// Samples across and down.
    pub(in super::super) size: [usize; 2],
    /// Size of a sample in mm.
    pub(in super::super) pixel: [f64; 2],
    /// The canvas in mm.
    pub(in super::super) size_mm: [f64; 2],
    /// Directions in which the height repeats.
    pub(in super::super) wraps: [bool; 2],
    /// The path of the main file.
    path: &'a Path,
}

impl Canvas<'_> {
    /// The error of heights that cannot be read.
    pub(in super::super) fn unread(&self, error: io::Error) -> WriteError {
        WriteError::at(self.path, error)
    }
}

/// A body of a certain shape.
pub(in super::super) trait Shape: fmt::Debug + Send + Sync {
    /// The kind of output.
    fn kind(&self) -> &'static str;

    /// True if the canvas is turned to the left.
    fn is_turned(&self) -> bool {
        false
    }

    /// Takes the samples of a canvas.
    ///
    /// # Errors
    /// The height does not suit the shape, or cannot be read.
    fn samples<'a>(&self, canvas: &Canvas<'a>, common: &Common) -> Result<Made<'a>, WriteError>;

    /// Number of triangles of the body.
    fn triangles(&self, made: &Made<'_>, tiles: &Tiles) -> u64;

    /// Number of triangles of a relief that uses all samples.
    fn most_triangles(&self, made: &Made<'_>) -> u64;

    /// Hands the body out.
    ///
    /// # Errors
    /// Those of the receiver.
    fn build(&self, made: &Made<'_>, tiles: &Tiles, receiver: &mut dyn Receiver) -> io::Result<Figures>;
}

/// Writes a mesh to a file, and its report if there are `findings` for it. `build` hands the mesh out.
///
/// # Errors
/// The system refuses, or the work was stopped.
pub(in super::super) fn write_model(
    build: &dyn Fn(&mut dyn Receiver) -> io::Result<Figures>,
    (path, format, stop): (&Path, Format, Stop<'_>),
    (stem, closed, findings): (&str, bool, Option<&[Problem]>),
) -> Result<Vec<Part>, WriteError> {
    let failed = |error| unwritten(path, error);
    let mut body = Body::create(path, format, stop).map_err(failed)?;
    let figures = build(&mut body).map_err(failed)?;
    let mut parts = vec![Part::File(body.finish(path).map_err(failed)?), Part::Note(model_line(&figures, closed))];
    if let Some(findings) = findings {
        let path = path.with_file_name(format!("{stem}_report.json"));
        parts.push(Part::document(&path, &model_json(stem, &figures, closed, findings))?);
    }
    Ok(parts)
}

impl Common {
    pub(in super::super) fn new(source: &Source<'_>, options: &Options) -> Self {
        let number = |name: &str| options.number(name).unwrap_or_default();
        Self {
            stem: source.place.stem.clone(),
            error: number("error"),
            triangles: number("triangles"),
            coarsen: options.word("over", &OVER),
            pattern: options.word("pattern", &PATTERNS),
            mould: options.word("form", &FORMS),
            wall: number("wall"),
            steepest: number("steepest"),
            tool: number("tool"),
            format: Self::format(options),
            report: options.is("report"),
        }
    }

    /// The format that options state.
    pub(in super::super) fn format(options: &Options) -> Format {
        options.word("format", &Format::ALL)
    }

    /// The names of the files.
    pub(in super::super) fn names(&self) -> Vec<String> {
        files_of(&self.stem, self.format, self.report)
    }

    /// Makes the files of a shape.
    ///
    /// # Errors
    /// The height does not suit the shape, the body needs too many triangles, or the system refuses.
    pub(in super::super) fn make(
        &self,
        shape: &dyn Shape,
        map: &HeightMap,
        folder: &Path,
        stop: Stop<'_>,
    ) -> Result<Vec<Part>, WriteError> {
        let [name, ..] = &self.names()[..] else { return Ok(Vec::new()) };
        let path = folder.join(name);
        let turn = shape.is_turned();
        let axes = |pair: [f64; 2]| if turn { [pair[1], pair[0]] } else { pair };
        let size = map.size.as_usizevec2().to_array();
        let turned = Turned { of: map.rows(), size };
        let (rows, size): (&dyn Rows, _) = if turn { (&turned, [size[1], size[0]]) } else { (map.rows(), size) };
        let opposite = Opposite { of: rows, width: size[0] };
        let made = shape.samples(
            &Canvas {
                rows: if self.mould { &opposite } else { rows },
                size,
                pixel: axes(map.pixel.to_array()),
                size_mm: axes(map.size_mm.to_array()),
                wraps: if turn { [map.wraps[1], map.wraps[0]] } else { map.wraps },
                path: &path,
            },
            self,
        )?;
        let thinnest = self.thinnest(&made)?;
        self.check_rounding(&made)?;
        let failed = |error| unwritten(&path, error);
        let stores = || -> Box<dyn Store> { Box::new(Spool::new(&path)) };
        let mesher = Mesher::new(&made.heights, self.pattern, made.tolerance, &stores, stop).map_err(failed)?;
        let allowed = whole(self.triangles);
        let mut advice = advice(&made, map, self.error);
        let mill = || Milled::new((&made.heights, &*made.on_picture), (self.tool, self.error), (&failed, stop));
        let milled = (self.tool > 0.0).then(mill).transpose()?;
        advice.extend(milled.as_ref().and_then(|milled| milled.advice(self.error)));
        let tiles = mesher.within(self.error, whole(MOST)).map_err(failed)?;
        let needed = tiles.as_ref().map(|tiles| shape.triangles(&made, tiles));
        let tiles = match tiles.filter(|_| needed.is_some_and(|needed| needed <= allowed)) {
            Some(tiles) => tiles,
            None => {
                let fits = |tiles: &Tiles| shape.triangles(&made, tiles) <= allowed;
                let found = mesher.fitting(self.error, allowed, fits).map_err(failed)?;
                self.coarser((needed, shape.most_triangles(&made)), found, &mut advice)?
            }
        };
        let mut body = Body::create(&path, self.format, stop).map_err(failed)?;
        let figures = shape.build(&made, &tiles, &mut body).map_err(failed)?;
        let file = body.finish(&path).map_err(failed)?;
        if figures.over_limit > 0.0 && self.steepest < 90.0 {
            let share = told(100.0 * figures.over_limit);
            let [x, y, z] = figures.steepest.1.map(told);
            let message = format!(
                "{share} % of the relief is steeper than {}°; the steepest facet has {}°, at ({x}, {y}, {z}) mm of the body",
                told(self.steepest),
                told(figures.steepest.0),
            );
            advice.push(Problem::new(Code::Advice, message).at("steepest").at_mm(figures.steepest.1));
        }
        let (least, greatest, _) = made.heights.extent();
        let facts = Facts {
            kind: shape.kind(),
            error: tiles.error(),
            height: (least, greatest),
            thinnest,
            pitch: map.pixel.to_array(),
            radius: made.radius,
            tool: milled.map(|milled| milled.json()),
        };
        let mut parts = vec![Part::File(file), Part::Note(line(&figures, &facts))];
        if self.report {
            let findings: Vec<Problem> = map.findings.iter().chain(&advice).cloned().collect();
            let text = json(self, &figures, &facts, &findings);
            let path = folder.join(format!("{}_report.json", self.stem));
            parts.push(Part::document(&path, &text)?);
        }
        parts.extend(advice.into_iter().map(Part::Advice));
        Ok(parts)
    }

    /// Refuses an error below the rounding of the numbers in files.
    fn check_rounding(&self, made: &Made<'_>) -> Result<(), WriteError> {
        let rounding = made.tolerance.rounding();
        if rounding <= 0.5 * self.error {
            return Ok(());
        }
        let least = 2.1 * rounding;
        if least > MOST_ERROR {
            let (low, high, _) = made.heights.extent();
            let message = format!(
                "the body is too large: the file rounds its places by up to {rounding:.1e} mm; the heights range from \
                 {low:.1e} to {high:.1e} mm"
            );
            return Err(refused(Code::TooLarge, message, "make the height smaller, or the canvas"));
        }
        let message = format!("the file rounds places by up to {rounding:.2e} mm, and `error` is {} mm", self.error);
        Err(refused_at("error", Code::BadValue, message, format!("write `error: {least:.1e}` or more")))
    }

    /// The thinnest wall and its place on the picture.
    fn thinnest(&self, made: &Made<'_>) -> Result<(f64, [f64; 2]), WriteError> {
        let (least, _, [column, row]) = made.heights.extent();
        let wall = made.wall + f64::from(least);
        let at = (made.on_picture)(made.heights.place(column, row));
        if wall >= self.wall && wall > 0.0 {
            return Ok((wall, at.to_array()));
        }
        let message =
            format!("the wall is {} mm thick at {}; {} mm are the least", told(wall), place(at), told(self.wall));
        let (option, help) = if made.radius.is_some() {
            ("bore", "make the bore smaller, or put more repeats `around`")
        } else {
            ("thickness", "raise `thickness`, or reduce the depth of the height")
        };
        Err(refused_at(option, Code::ThinWall, message, help))
    }

    /// The triangles of a larger error, or the reason why there are none.
    fn coarser(
        &self,
        (needed, most): (Option<u64>, u64),
        found: Option<(f64, Tiles)>,
        advice: &mut Vec<Problem>,
    ) -> Result<Tiles, WriteError> {
        let allowed = grouped(whole(self.triangles));
        let count = needed.map_or_else(|| format!("more than {}", grouped(whole(MOST))), grouped);
        let message = format!("{} mm needs {count} triangles; {allowed} are allowed", self.error);
        let triangles = needed.filter(|needed| *needed <= whole(MOST)).map(rounded_up);
        let triangles = triangles.map(|triangles| format!("`triangles: {triangles}`"));
        // Noise as fine as the samples takes most triangles, and no printer shows it.
        let is_noise = needed.is_none_or(|needed| needed > most / NOISE);
        let smooth = if is_noise { ", or smooth fine noise with `Blur`" } else { "" };
        match found {
            Some((error, tiles)) if self.coarsen => {
                let problem = Problem::new(Code::Advice, format!("{message}, so the error is {error} mm"));
                advice.push(if is_noise {
                    problem.help("smooth fine noise of the height with `Blur`")
                } else {
                    problem
                });
                Ok(tiles)
            }
            Some((error, _)) => {
                let remedies: Vec<String> = triangles.into_iter().chain([format!("`error: {error}`")]).collect();
                let help = format!("write {}{smooth}", remedies.join(", or "));
                Err(refused_at("triangles", Code::OverBudget, message, help))
            }
            None => {
                let help = match triangles {
                    Some(triangles) => format!("write {triangles}; no error needs few enough"),
                    None => "no error needs few enough: use fewer tiles".to_owned(),
                };
                Err(refused_at("triangles", Code::OverBudget, message, help))
            }
        }
    }
}

/// Hints about the heights.
fn advice(made: &Made<'_>, map: &HeightMap, error: f64) -> Vec<Problem> {
    let (least, greatest, _) = made.heights.extent();
    let range = f64::from(greatest) - f64::from(least);
    let mut advice = Vec::new();
    let mut advise = |message: String| advice.push(Problem::new(Code::Advice, message));
    if range > 0.1 * map.size_mm.min_element() {
        let message = "heights are in mm; multiply them if they are numbers from 0 to 1";
        advise(format!(
            "the height has a range of {} mm on {} mm: {message}",
            told(range),
            told(map.size_mm.min_element())
        ));
    }
    let pitch = map.pixel.max_element();
    if 4.0 * pitch < error {
        let message = "a lower `--resolution` gives the same body";
        advise(format!("samples are {} mm apart, and `error` is {} mm: {message}", told(pitch), told(error)));
    }
    advice
}

/// Number of triangles of all samples of a canvas, times its repeats.
pub(in super::super) fn of_all_samples(made: &Made<'_>, [across, down]: [usize; 2]) -> u64 {
    let [columns, rows] = made.heights.size();
    2 * (columns as u64 * rows as u64).saturating_mul(across as u64 * down as u64)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number within its range")]
fn whole(number: f64) -> u64 {
    number as u64
}

/// A number rounded up to two digits.
fn rounded_up(number: u64) -> u64 {
    let mut unit = 1;
    while number / unit >= 100 {
        unit *= 10;
    }
    number.div_ceil(unit) * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_up_to_two_digits() {
        assert_eq!([7, 99, 101, 8_012_345].map(rounded_up), [7, 99, 110, 8_100_000]);
    }
}
