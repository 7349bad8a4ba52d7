//! Bodies with a relief: the options, limits, report and files that plates and rolls have in common.
mod files;
mod report;
mod shape;
mod tool;

pub(super) use shape::{Canvas, Common, Made, Shape, of_all_samples, write_model};

use super::decl::{FieldDecl, Takes, count, names, number};
use shibo_kernel::body::{MOST_ERROR, Pattern};

/// The most triangles of a file.
const MOST: f64 = 4e8;

/// The formats of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// STL, binary.
    Stl,
    /// 3MF.
    ThreeMf,
    /// PLY, binary.
    Ply,
    /// Wavefront OBJ, without a material.
    Obj,
}

impl Format {
    pub(super) const ALL: [(&'static str, Self); 4] =
        [("Stl", Self::Stl), ("ThreeMf", Self::ThreeMf), ("Ply", Self::Ply), ("Obj", Self::Obj)];

    pub(super) const fn extension(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::ThreeMf => "3mf",
            Self::Ply => "ply",
            Self::Obj => "obj",
        }
    }
}

/// The names of the files of a body: the body itself, and its report if wanted.
pub(super) fn files_of(stem: &str, format: Format, reports: bool) -> Vec<String> {
    let body = format!("{stem}.{}", format.extension());
    [body].into_iter().chain(reports.then(|| format!("{stem}_report.json"))).collect()
}

/// Names of the patterns.
pub(super) const PATTERNS: [(&str, Pattern); 2] = [("Fewest", Pattern::Fewest), ("Even", Pattern::Even)];
/// Names of the forms; true for a mould.
pub(super) const FORMS: [(&str, bool); 2] = [("Relief", false), ("Mould", true)];
/// Names of the answers to too many triangles; true for a larger error.
pub(super) const OVER: [(&str, bool); 2] = [("Refuse", false), ("Coarsen", true)];

pub(super) const ERROR: FieldDecl =
    number("error", "The largest distance between the body and the height, in mm.", [1e-4, MOST_ERROR], &[0.01]);
pub(super) const TRIANGLES: FieldDecl =
    count("triangles", "The most triangles of the file.", [100.0, MOST], &[5_000_000.0]);
pub(super) const OVERFLOW: FieldDecl = FieldDecl::new(
    "over",
    "For a body that needs more triangles: `Refuse` writes nothing, `Coarsen` takes a larger error.",
    Takes::Words(|| names(&OVER)),
);
pub(super) const PATTERN: FieldDecl = FieldDecl::new(
    "pattern",
    "The form of the triangles. `Fewest` needs half as many; `Even` has no narrow ones, for moulds.",
    Takes::Words(|| names(&PATTERNS)),
);
pub(super) const FORM: FieldDecl = FieldDecl::new(
    "form",
    "`Mould` is the body that presses the relief: with opposite heights, and mirrored left to right.",
    Takes::Words(|| names(&FORMS)),
);
pub(super) const WALL: FieldDecl = number("wall", "The thinnest wall that is allowed, in mm.", [0.0, 100.0], &[0.4]);
pub(super) const STEEPEST: FieldDecl = number(
    "steepest",
    "The steepest slope that is allowed, in degrees: the report has the share of the area that is steeper.",
    [0.1, 90.0],
    &[90.0],
);
pub(super) const TOOL: FieldDecl = number(
    "tool",
    "The diameter of a milling tool with a ball end, in mm; 0 for none. A warning and the report tell the material that it cannot reach.",
    [0.0, 100.0],
    &[0.0],
);
pub(super) const FORMAT: FieldDecl =
    FieldDecl::new("format", "The format of the file.", Takes::Words(|| names(&Format::ALL)));
pub(super) const REPORT: FieldDecl =
    FieldDecl::new("report", "Writes the figures of the body into `NAME_report.json`.", Takes::Truth(false));
