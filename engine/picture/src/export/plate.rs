//! A plate with a relief, for printers and mills.
use super::body::{
    Canvas, Common, ERROR, FORM, FORMAT, Made, OVERFLOW, PATTERN, REPORT, STEEPEST, Shape, TOOL, TRIANGLES, WALL,
    of_all_samples,
};
use super::decl::{FieldDecl, HEIGHT, NumberForm, Numbers, Takes, number};
use super::heights::{HeightMap, Heights, Maker, Part, Stop, refused};
use super::target::{ExportTarget, Files, OptionValue, Options, Plan, Source, TargetInfo};
use crate::WriteError;
use crate::value::diagnostics::Code;
use glam::DVec2;
use shibo_kernel::body::{self, Figures, Receiver, Tiles, Tolerance};
use std::io;
use std::path::Path;
use std::sync::Arc;

/// The target.
pub(super) struct Plate;

impl ExportTarget for Plate {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Plate",
                title: "a plate",
                doc: "A plate with a height as its relief: a closed body for printers and mills.",
                fields: &[
                    HEIGHT,
                    number("thickness", "The distance from the bottom to height 0, in mm.", [0.05, 1000.0], &[3.0]),
                    FieldDecl::new(
                        "tiles",
                        "The number of canvases across and down. More than one needs a height that tiles.",
                        Takes::Numbers(Numbers::new(NumberForm::Counts, [1.0, 1000.0], &[1.0, 1.0])),
                    ),
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
                variants: &[
                    ("stl", "A plate with the relief of the material, as STL", &[]),
                    (
                        "3mf",
                        "A plate with the relief of the material, as 3MF",
                        &[("format", OptionValue::Word("ThreeMf"))],
                    ),
                    ("ply", "A plate with the relief of the material, as PLY", &[("format", OptionValue::Word("Ply"))]),
                ],
            }
        }
    }

    fn is_body(&self) -> bool {
        true
    }

    fn plan(&self, options: &Options) -> Plan {
        Plan::body(Common::format(options).extension(), options.is("report"))
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let tiles = options.numbers("tiles").unwrap_or(&[1.0, 1.0]);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers within their range")]
        let tiles = [tiles[0] as usize, tiles[1] as usize];
        let thickness = options.number("thickness").unwrap_or_default();
        let maker = PlateMaker { common: Common::new(source, options), thickness, tiles };
        Ok(Files::Heights(Heights::of(source, Arc::new(maker))))
    }
}

#[derive(Clone, Debug)]
struct PlateMaker {
    common: Common,
    thickness: f64,
    tiles: [usize; 2],
}

impl Maker for PlateMaker {
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

impl Shape for PlateMaker {
    fn kind(&self) -> &'static str {
        "Plate"
    }

    fn samples<'a>(&self, canvas: &Canvas<'a>, common: &Common) -> Result<Made<'a>, WriteError> {
        for (axis, side) in ["left to right", "top to bottom"].into_iter().enumerate() {
            if self.tiles[axis] > 1 && !canvas.wraps[axis] {
                let message = format!("the height does not tile from {side}, and `tiles` repeats it there");
                let help = "make it on a canvas that tiles, with nodes that keep it so, or leave `tiles` out";
                return Err(refused(Code::DoesNotTile, message, help));
            }
        }
        let heights = body::Heights::of_canvas(canvas.rows, canvas.size, canvas.pixel, canvas.wraps);
        let heights = heights.map_err(|error| canvas.unread(error))?;
        let (_, greatest, _) = heights.extent();
        let [width, height] = heights.size_mm();
        let across = [self.tiles[0] as f64 * width, self.tiles[1] as f64 * height];
        let up = self.thickness + f64::from(greatest).abs();
        let tolerance = Tolerance::flat(common.error).rounded(&heights, up, across);
        let mould = common.mould;
        let on_picture = move |[x, y]: [f64; 2]| DVec2::new(if mould { width - x } else { x }, y);
        Ok(Made { heights, tolerance, wall: self.thickness, radius: None, on_picture: Box::new(on_picture) })
    }

    fn triangles(&self, _: &Made<'_>, tiles: &Tiles) -> u64 {
        body::Plate::triangles(tiles, self.tiles)
    }

    fn most_triangles(&self, made: &Made<'_>) -> u64 {
        of_all_samples(made, self.tiles)
    }

    fn build(&self, made: &Made<'_>, tiles: &Tiles, receiver: &mut dyn Receiver) -> io::Result<Figures> {
        let (thickness, repeats, steepest) = (self.thickness, self.tiles, self.common.steepest);
        body::Plate { heights: &made.heights, tiles, thickness, repeats, steepest }.build(receiver)
    }
}
