//! [`FloodFill`]: the connected pieces of a mask.
//!
//! Joins runs of pixels row by row, see [`kernel::flood`](shibo_kernel::region::flood). Every number depends on the
//! whole mask, which is read once per resolution. Cost: O(pixels), and 8 bytes of memory a pixel.
use super::region_coordinates::Coordinates;
use super::whole::whole;
use glam::{DVec2, UVec2};
use shibo_kernel::region::flood;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, FieldSource, Given, Grid, Pictures, Read, Resolution, Stop, Tile, Tiling, Type, Window};

/// Numbers the pieces of a mask. A piece is a set of pixels of at least ½ that are connected by their sides.
///
/// A whole-picture operation. Pieces are numbered from 1 by their first pixels in reading order; pixels below ½ have
/// number 0. Where the mask tiles, a piece that leaves on one side continues on the other. At another resolution,
/// pieces as thin as a pixel may join or split, which changes the numbers of other pieces; set `resolution` to keep
/// numbers stable.
///
/// ```ron
/// "cells": Worley(size: 5),
/// "pieces": Threshold(input: "cells.border", level: 0.35),
/// "found": FloodFill(mask: "pieces"),
/// "tone": RegionRandom(ids: "found", range: (0.2, 1)),
/// "example": "= tone * pieces",
/// ```
///
/// Elsewhere: Substance Designer *Flood Fill*; Material Maker *Fill*; Houdini *Connectivity*.
#[node]
pub struct FloodFill {
    /// The mask.
    pub mask: In<Gray>,
    /// Resolution at which pieces are found: pixels along the longer side of the canvas. By default that of the output.
    #[schemars(range(min = 1, max = 65536))]
    pub resolution: Option<u32>,
}

/// Maximum number of pieces that numbers in fields can distinguish.
const MOST: usize = (1 << 24) - 1;

/// The field of the numbers of pieces.
struct Filled {
    mask: Field,
    /// The canvas, mm.
    size: DVec2,
    resolution: Option<u32>,
}

/// The pixel, of `side` pixels, in which `at` (in pixels) lies.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the picture")]
fn pixel(at: f64, side: usize, wraps: bool) -> usize {
    let whole = if wraps { at.floor().rem_euclid(side as f64) } else { at.floor().clamp(0.0, side as f64 - 1.0) };
    (whole as usize).min(side - 1)
}

impl FieldSource for Filled {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let Some(labels) = given.prepared() else { return Ok(()) };
        let Tiling { x: wraps_x, y: wraps_y } = self.mask.tiling();
        let (grid, window) = (out.grid, out.window);
        let (width, height) = (labels.width(), labels.height());
        let columns: Vec<usize> = (window.x..window.right())
            .map(|x| pixel(grid.center(x, 0).x / labels.grid.step.x, width, wraps_x))
            .collect();
        for (row, y) in (window.y..window.bottom()).enumerate() {
            let from = labels.row(0, pixel(grid.center(0, y).y / labels.grid.step.y, height, wraps_y));
            out.row_mut(0, row).iter_mut().zip(&columns).for_each(|(out, x)| *out = from[*x]);
        }
        Ok(())
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, window) = whole(self.size, grid, self.resolution);
        vec![Read::new(&self.mask, &grid, window)]
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (grid, window) = whole(self.size, grid, self.resolution);
        let mask = pictures.read(0, window)?;
        pictures.check()?;
        let mut labels = Tile::new(grid, window, 1);
        let Tiling { x, y } = self.mask.tiling();
        let count = flood::label(mask.plane(0), mask.width(), [x, y], labels.plane_mut(0));
        if count > MOST {
            let message = format!("the mask has {count} pieces; at most {MOST} can be numbered");
            return Err(Problem::new(Code::TooLarge, message).at("mask").help("blur it, or set `resolution`").into());
        }
        Ok(Some(labels))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        PIXEL_BYTES * whole(self.size, grid, self.resolution).1.len() as u64
    }
}

/// Bytes per pixel while pieces are numbered.
const PIXEL_BYTES: u64 = 10;

impl Node for FloodFill {
    const OUTPUTS: &'static [Output] = &[
        Output::new("ids", Type::Ids, "The number of the piece, from 1; 0 outside of the mask."),
        Output::new("local", Type::Vec2, "The place within the piece, from the middle of its bounding box.")
            .in_unit("mm"),
        Output::new("size", Type::Gray, "The area of the piece.").in_unit("mm²"),
        Output::new("center", Type::Vec2, "The middle of the piece's bounding box.").in_unit("mm"),
        Output::new("box", Type::Vec2, "Width and height of the bounding box.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn whole_bytes(&self, pixels: UVec2, canvas: &CanvasFacts) -> u64 {
        let pixels = self.resolution.map_or(pixels, |longer| Resolution::Longer(longer).of(canvas.size_mm()));
        PIXEL_BYTES * u64::from(pixels.x) * u64::from(pixels.y)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (mask, size) = (cx.get(&self.mask)?, cx.size_mm());
        let tiling = mask.tiling();
        let filled = Field::new(Type::Ids, tiling, Filled { mask, size, resolution: self.resolution });
        let ids = cx.shared_field("pieces", filled);
        let coordinates = Coordinates { ids: ids.clone(), size, ..Coordinates::default() };
        Ok(Outputs::one(ids)
            .with("local", coordinates.local())
            .with("size", coordinates.area())
            .with("center", coordinates.center())
            .with("box", coordinates.extent()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{canvas, port};

    /// A disc of 4 mm radius about `center`, on a canvas of 32 mm that repeats as `tiling` says.
    fn disc(center: DVec2, tiling: Tiling) -> Field {
        Field::generate(Type::Gray, tiling, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let mut away = grid.center(window.x + k % width, window.y + k / width) - center;
                if tiling.x {
                    away.x -= 32.0 * (away.x / 32.0).round();
                }
                if tiling.y {
                    away.y -= 32.0 * (away.y / 32.0).round();
                }
                *v = if away.length() < 4.0 { 1.0 } else { 0.0 };
            }
            Ok(())
        })
    }

    fn node() -> FloodFill {
        FloodFill { mask: port(0), ..FloodFill::default() }
    }

    #[test]
    fn pieces_conform() {
        conforms(&node(), &[disc(DVec2::new(1.0, 31.0), Tiling::BOTH).into()]);
        conforms(&node(), &[crate::conform::gray().into()]);
        conforms(&FloodFill { resolution: Some(23), ..node() }, &[crate::conform::gray().into()]);
    }

    #[test]
    fn a_piece_across_the_border_is_one() {
        let center = DVec2::new(1.0, 31.0);
        for (tiling, pieces) in [(Tiling::BOTH, 1.0), (Tiling { x: true, y: false }, 1.0), (Tiling::NONE, 1.0)] {
            let inputs = [disc(center, tiling).into()];
            let show = |output| part(&field(&node(), &inputs, output), &canvas(), 0, 0, 64, 64);
            let (ids, local, area) = (show("ids"), show("local"), show("size"));
            assert_eq!(ids.data().iter().copied().fold(0.0, f32::max), pieces);
            // Places relative to the middle of the piece, near the lower left corner.
            let at = |tile: &Tile, channel: usize, x: usize, y: usize| tile.row(channel, y)[x];
            assert_eq!(at(&ids, 0, 1, 62), 1.0);
            let whole = std::f64::consts::PI * 16.0;
            let want = match (tiling.x, tiling.y) {
                (true, true) => (whole, -0.25, 0.25),
                // The piece is cut off: columns up to 5 mm and rows from 27 mm are left.
                (true, false) => (f64::NAN, -0.25, 1.75),
                _ => (f64::NAN, -1.75, 1.75),
            };
            if want.0.is_finite() {
                assert!((f64::from(at(&area, 0, 1, 62)) - want.0).abs() < 2.0, "{}", at(&area, 0, 1, 62));
            }
            let got = (f64::from(at(&local, 0, 1, 62)), f64::from(at(&local, 1, 1, 62)));
            assert!((got.0 - want.1).abs() < 0.3 && (got.1 - want.2).abs() < 0.3, "{tiling:?}: {got:?}");
        }
    }

    #[test]
    fn measures_boxes_and_middles_of_rectangles() {
        // 6 × 3 mm around (9, 20), and 2 × 8 mm across the border around (32, 4).
        let mask = Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width).rem_euclid(DVec2::splat(32.0));
                let one = (at.x - 9.0).abs() < 3.0 && (at.y - 20.0).abs() < 1.5;
                let other = (at.x < 1.0 || at.x > 31.0) && (at.y - 4.0).abs() < 4.0;
                *v = if one || other { 1.0 } else { 0.0 };
            }
            Ok(())
        });
        let inputs = [mask.into()];
        let show = |output| part(&field(&node(), &inputs, output), &canvas(), 0, 0, 64, 64);
        let values = |output, x: usize, y: usize| {
            let tile = show(output);
            (0..tile.channels()).map(|c| tile.row(c, y)[x]).collect::<Vec<_>>()
        };
        // Numbered by the first pixel in reading order.
        assert_eq!([values("ids", 18, 40), values("ids", 0, 8), values("ids", 63, 8)], [[2.0], [1.0], [1.0]]);
        assert_eq!((values("size", 18, 40), values("size", 0, 8)), (vec![18.0], vec![16.0]));
        assert_eq!((values("center", 18, 40), values("center", 63, 8)), (vec![9.0, 20.0], vec![0.0, 4.0]));
        assert_eq!((values("box", 18, 40), values("box", 63, 8)), (vec![6.0, 3.0], vec![2.0, 8.0]));
        assert_eq!((values("local", 18, 40), values("local", 63, 8)), (vec![0.25, 0.25], vec![-0.25, 0.25]));
    }
}
