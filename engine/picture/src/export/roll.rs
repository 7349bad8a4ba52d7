//! A roll with a relief, for embossing.
use super::body::{
    Canvas, Common, ERROR, FORM, FORMAT, Made, OVERFLOW, PATTERN, REPORT, STEEPEST, Shape, TOOL, TRIANGLES, WALL,
    of_all_samples,
};
use super::decl::{FieldDecl, HEIGHT, Takes, count, names, number};
use super::heights::{HeightMap, Heights, Maker, Part, Stop, refused, told};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::WriteError;
use crate::value::diagnostics::{Code, Problem};
use glam::DVec2;
use shibo_kernel::body::{self, Figures, Receiver, Tiles, Tolerance};
use std::f64::consts::TAU;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Names of the directions; true if the canvas is turned.
const DIRECTIONS: [(&str, bool); 2] = [("X", false), ("Y", true)];
/// The most columns of samples round a roll.
const MOST_COLUMNS: f64 = 1e6;
/// The least number of columns round a roll.
const LEAST_COLUMNS: f64 = 24.0;

/// The target.
pub(super) struct Roll;

impl ExportTarget for Roll {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Roll",
                title: "a roll",
                doc: "A roll with a height as its relief, without a seam: a closed body for embossing.",
                fields: &[
                    HEIGHT,
                    count("around", "The number of canvases round the roll. It must be written.", [1.0, 10_000.0], &[]),
                    count("along", "The number of canvases along the roll.", [1.0, 1000.0], &[1.0]),
                    FieldDecl::new(
                        "direction",
                        "The direction of the canvas that goes round, which must tile. `Y` turns the picture to the left.",
                        Takes::Words(|| names(&DIRECTIONS)),
                    ),
                    number("bore", "The diameter of the bore in mm; 0 for a solid roll.", [0.0, 1e6], &[0.0]),
                    ERROR,
                    TRIANGLES,
                    OVERFLOW,
                    PATTERN,
                    FORM,
                    WALL,
                    STEEPEST,
                    TOOL,
                    FORMAT,
                    REPORT,
                ],
                variants: &[],
            }
        }
    }

    fn is_body(&self) -> bool {
        true
    }

    fn plan(&self, options: &Options) -> Plan {
        Plan::body(Common::format(options).extension(), options.is("report"))
    }

    fn check(&self, options: &Options) -> Option<Problem> {
        let missing = Problem::new(Code::MissingInput, "`Roll` has no `around`, the number of canvases round the roll");
        options.number("around").is_none().then(|| missing.help("write `around: 5`"))
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers within their range")]
        let repeats = ["around", "along"].map(|name| options.number(name).unwrap_or(1.0) as usize);
        let maker = RollMaker {
            common: Common::new(source, options),
            repeats,
            turned: options.word("direction", &DIRECTIONS),
            bore: options.number("bore").unwrap_or_default(),
        };
        Ok(Files::Heights(Heights::of(source, Arc::new(maker))))
    }
}

#[derive(Clone, Debug)]
struct RollMaker {
    common: Common,
    repeats: [usize; 2],
    turned: bool,
    bore: f64,
}

impl Maker for RollMaker {
    fn names(&self) -> Vec<String> {
        self.common.names()
    }

    fn spools(&self) -> bool {
        true
    }

    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError> {
        self.common.make(self, map, folder, stop)
    }
}

impl RollMaker {
    /// The number of columns of samples for a pixel, so that chords between neighbouring columns are within the error.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number is at least 1 and limited")]
    fn finer(&self, columns: f64, radius: f64, extent: (f64, f64), steepest: f64) -> Result<usize, WriteError> {
        let tolerance = Tolerance::round(self.common.error, radius, columns as usize);
        let share = tolerance.chord(steepest, extent);
        let finer = share.sqrt().max(LEAST_COLUMNS / columns).ceil().max(1.0);
        if columns * finer > MOST_COLUMNS {
            let message =
                format!("the roll has {} columns of samples; at most 1,000,000 are possible", columns * finer);
            return Err(refused(Code::TooLarge, message, "lower the resolution or `around`, or raise `error`"));
        }
        Ok(finer as usize)
    }
}

impl Shape for RollMaker {
    fn kind(&self) -> &'static str {
        "Roll"
    }

    fn is_turned(&self) -> bool {
        self.turned
    }

    fn samples<'a>(&self, canvas: &Canvas<'a>, common: &Common) -> Result<Made<'a>, WriteError> {
        let [around, along] = self.repeats;
        let directions = if self.turned { ["Y", "X"] } else { ["X", "Y"] };
        for (axis, direction) in directions.into_iter().enumerate() {
            if (axis == 0 || along > 1) && !canvas.wraps[axis] {
                let how = if axis == 0 { "round" } else { "along" };
                let message = format!("the height does not tile in {direction}, which goes {how} the roll");
                let help = "make it on a canvas that tiles, with nodes that keep it so";
                return Err(refused(Code::DoesNotTile, message, help));
            }
        }
        let (size, pixel, [width, height]) = (canvas.size, canvas.pixel, canvas.size_mm);
        let radius = around as f64 * width / TAU;
        if self.bore >= 2.0 * radius {
            let message =
                format!("the bore of {} mm is no smaller than the roll, {} mm", told(self.bore), told(2.0 * radius));
            return Err(refused(Code::BadValue, message, "make the bore smaller, or put more repeats `around`"));
        }
        let round = |finer: usize| {
            let heights = body::Heights::round(canvas.rows, size, pixel, canvas.wraps[1], finer);
            heights.map_err(|error| canvas.unread(error))
        };
        let plain = round(1)?;
        let (least, greatest, _) = plain.extent();
        let (least, greatest) = (f64::from(least), f64::from(greatest));
        if radius + least <= 0.0 {
            let message =
                format!("the height goes {} mm down, and the roll has a radius of {} mm", told(-least), told(radius));
            return Err(refused(Code::BadValue, message, "put more repeats `around`, or reduce the height"));
        }
        let finer = self.finer((around * size[0]) as f64, radius, (least, greatest), plain.steepest())?;
        let heights = if finer == 1 { plain } else { round(finer)? };
        let columns = around * size[0] * finer;
        let tolerance = Tolerance::round(common.error, radius, columns);
        let tolerance = tolerance.rounded(&heights, radius + greatest, [0.0, along as f64 * height]);
        let (mould, is_turned) = (common.mould, self.turned);
        let on_picture = move |[x, y]: [f64; 2]| {
            let x = x + 0.5 * pixel[0];
            let x = if mould { width - x } else { x };
            if is_turned { DVec2::new(height - y, x) } else { DVec2::new(x, y) }
        };
        Ok(Made {
            heights,
            tolerance,
            wall: radius - 0.5 * self.bore,
            radius: Some(radius),
            on_picture: Box::new(on_picture),
        })
    }

    fn triangles(&self, made: &Made<'_>, tiles: &Tiles) -> u64 {
        self.roll(made, tiles).triangles()
    }

    fn most_triangles(&self, made: &Made<'_>) -> u64 {
        of_all_samples(made, self.repeats)
    }

    fn build(&self, made: &Made<'_>, tiles: &Tiles, receiver: &mut dyn Receiver) -> io::Result<Figures> {
        self.roll(made, tiles).build(receiver)
    }
}

impl RollMaker {
    fn roll<'a>(&self, made: &'a Made<'a>, tiles: &'a Tiles) -> body::Roll<'a> {
        let (repeats, bore) = (self.repeats, self.bore);
        let (error, steepest) = (self.common.error, self.common.steepest);
        body::Roll { heights: &made.heights, tiles, repeats, bore, error, steepest }
    }
}
