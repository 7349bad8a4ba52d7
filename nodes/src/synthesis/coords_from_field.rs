//! [`CoordsFromField`]: coordinates from a picture written by [`CoordsToField`](super::CoordsToField) or by another
//! program.
//!
//! Source: JP5149288B2 II, claim 1 (row C2): synthesis may start from any earlier result. Cost: O(pixels).
use super::coords_to_field::CoordUnit;
use glam::{DVec2, IVec2, UVec2};
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Fact, FilePath, In, Node, Output, Outputs, Vec2Field, node};
use shibo_picture::{self as picture, FileError, ReadLimits};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{CoordMap, Exemplar, Grid, Stop, Type, Window};
use std::sync::Arc;

/// Coordinates from a field of vectors or from a file: to show an earlier result again, or to continue from it.
///
/// The first number is the column in the exemplar, the second the row. A file is an EXR with the channels `X` and `Y`
/// over the whole canvas, as an output of coordinates writes it; the size of the exemplar recorded in it must be that
/// of `exemplar`.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "exemplar": Exemplar(input: "cells.border", size: (64, 64)),
/// "made": Synthesize(exemplar: "exemplar", size: (128, 128)),
/// "field": CoordsToField(coords: "made"),
/// "coords": CoordsFromField(input: "field", exemplar: "exemplar", size: (128, 128)),
/// "example": SampleExemplar(coords: "coords", input: "cells.border"),
/// ```
#[node]
pub struct CoordsFromField {
    /// The field, if no `file` is given.
    pub input: Option<In<Vec2Field>>,
    /// The file, relative to the graph file.
    pub file: Option<FilePath>,
    /// The exemplar to which coordinates refer.
    pub exemplar: In<Exemplar>,
    /// Unit of the coordinates.
    pub unit: CoordUnit,
    /// Columns and rows over the canvas. By default those of the file, or such that pixels have the size of the
    /// exemplar's pixels.
    #[schemars(extend("minimum" = 1.0, "maximum" = 16384.0))]
    pub size: Option<(u32, u32)>,
}

impl CoordsFromField {
    /// The values of a field at the centres of `size` pixels over the canvas: the column numbers, then the row numbers.
    fn of_field(
        &self,
        cx: &Context<'_>,
        input: &In<Vec2Field>,
        exemplar: &Exemplar,
    ) -> Result<(UVec2, Vec<f32>), Stop> {
        let (field, canvas) = (cx.get(input)?, cx.size_mm());
        let own = || (canvas / exemplar.frame.pitch).round().clamp(DVec2::ONE, DVec2::splat(16_384.0)).as_uvec2();
        let size = self.size.map(UVec2::from).unwrap_or_else(own);
        self.fits(cx, size)?;
        let grid = Grid { origin: DVec2::ZERO, step: canvas / size.as_dvec2(), period: Some(size), shown: None };
        Ok((size, cx.evaluator.raster(&field, &grid, Window::full(size))?.data().to_vec()))
    }

    /// The same from a file.
    fn of_file(&self, cx: &Context<'_>, path: &FileHandle, exemplar: &Exemplar) -> Result<(UVec2, Vec<f32>), Stop> {
        let failed = |error: FileError| {
            let code = if error.reason.is_not_found() { Code::FileNotFound } else { Code::BadFile };
            let help = "it must be an EXR with the channels `X` and `Y`, as an output of coordinates is written";
            Problem::new(code, error.to_string()).at("file").help(help)
        };
        if let Some(told) = picture::text(path, CoordMap::EXEMPLAR).map_err(failed)? {
            let [w, h] = exemplar.frame.size.to_array();
            if told != format!("{w} {h}") {
                let told = told.replace(' ', "x");
                let message =
                    format!("`file` holds coordinates in an exemplar of `{told}` pixels; this one has `{w}x{h}`");
                let help = "connect the exemplar that they were found in, or give this one as many pixels by `size`";
                return Err(Problem::new(Code::BadValue, message).at("exemplar").help(help).into());
            }
        }
        let header = picture::header_layer(path, "X").map_err(failed)?;
        let size = UVec2::new(header.width, header.height);
        if self.size.is_some_and(|wanted| UVec2::from(wanted) != size) {
            let message = format!("`file` has `{}x{}` coordinates", size.x, size.y);
            return Err(Problem::new(Code::BadValue, message).at("size").help("leave `size` out").into());
        }
        self.fits(cx, size)?;
        let limits = ReadLimits { max_bytes_decoded: cx.evaluator.memory(), ..ReadLimits::default() };
        let mut data = picture::read_layer(path, "X", &limits).map_err(failed)?.planes;
        data.extend(picture::read_layer(path, "Y", &limits).map_err(failed)?.planes);
        Ok((size, data))
    }

    fn fits(&self, cx: &Context<'_>, size: UVec2) -> Result<(), Problem> {
        let bytes = u64::from(size.x) * u64::from(size.y) * 24;
        if bytes <= cx.evaluator.memory() {
            return Ok(());
        }
        let message = format!("`{}x{}` coordinates take {} MiB", size.x, size.y, bytes >> 20);
        let (at, help) =
            if self.file.is_some() { ("file", "raise --memory") } else { ("size", "set `size`, or raise --memory") };
        Err(Problem::new(Code::TooLarge, message).at(at).help(help))
    }
}

impl Node for CoordsFromField {
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] = &[Output::new("coords", Type::CoordMap, "The coordinates.")];

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.file.iter().map(|file| ("file", file)).collect()
    }

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        match (&self.input, &self.file) {
            (Some(_), Some(_)) => {
                let problem = Problem::new(Code::BadValue, "both `input` and `file` are given").at("file");
                vec![problem.help("leave one of them out")]
            }
            (None, None) => {
                let problem = Problem::new(Code::MissingInput, "there are no coordinates to read").at("input");
                vec![problem.help("connect `input`, or name a `file`")]
            }
            _ => Vec::new(),
        }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let exemplar = cx.get(&self.exemplar)?;
        let (size, data) = match (cx.file("file"), &self.input) {
            (Some(path), _) => self.of_file(cx, path, &exemplar)?,
            (None, Some(input)) => self.of_field(cx, input, &exemplar)?,
            (None, None) => {
                return Err(Problem::new(Code::MissingInput, "there are no coordinates to read").at("input").into());
            }
        };
        let pitch = cx.size_mm() / size.as_dvec2();
        let scale = match self.unit {
            CoordUnit::Pixels => DVec2::ONE,
            CoordUnit::Share => exemplar.frame.size.as_dvec2(),
        };
        let at = |(u, v): (&f32, &f32)| [narrow(f64::from(*u) * scale.x), narrow(f64::from(*v) * scale.y)];
        let (columns, rows) = data.split_at(data.len() / 2);
        let coords: Vec<[f32; 2]> = columns.iter().zip(rows).map(at).collect();
        if let Some(p) = coords.iter().position(|c| !(c[0].abs() < 1e6 && c[1].abs() < 1e6)) {
            let (x, y) = (p % size.x as usize, p / size.x as usize);
            let port = if self.file.is_some() { "file" } else { "input" };
            let message = format!("`{port}` is no coordinate at pixel ({x}, {y}): it is {:?}", coords[p]);
            let help = "coordinates must be finite, and below a million pixels";
            return Err(Problem::new(Code::NotFinite, message).at(port).help(help).into());
        }
        Ok(Outputs::one(CoordMap {
            size,
            start: IVec2::ZERO,
            pitch,
            periodic: cx.tiling(),
            spacing: 1,
            coords: Arc::new(coords),
            exemplar: Some(exemplar.frame),
            coherence: 0.0,
            coverage: 0.0,
            surface: None,
        }))
    }
}
