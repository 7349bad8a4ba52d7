//! [`Mirror`]: shows one half of a picture twice.
//!
//! A pixel of the mirrored half shows the pixel at the same distance on the other side of the axis. Only the canvas is
//! read, so the result is symmetric about the axis and about the line half a canvas away, and repeats even if the input
//! does not. The axis lies between pixels or in the middle of a pixel. Cost: O(pixels), bound by memory.
use shibo_node::{AnyField, Context, Fact, In, Node, Output, Outputs, Xy, choice, node};
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};

/// The half of a picture that is shown twice.
#[choice]
pub enum MirrorAxis {
    /// The left half; the right one is its mirror image
    #[default]
    Left,
    /// The right half; the left one is its mirror image
    Right,
    /// The upper half; the lower one is its mirror image
    Top,
    /// The lower half; the upper one is its mirror image
    Bottom,
    /// The upper left quarter, mirrored into all four
    TopLeft,
}

/// Replaces one half of a field by the mirror image of the other: book-matched veneer, symmetric ornaments.
///
/// Across the axis the result repeats with the canvas even if the input does not. Normals are mirrored with the
/// picture; green is up.
///
/// ```ron
/// "noise": Fractal(size: 12, octaves: 6),
/// "colors": GradientMap(input: "noise", stops: [(0.3, "#3a2416"), (0.5, "#a8713c"), (0.7, "#e5c08a")]),
/// "example": Mirror(input: "colors", keep: Left),
/// ```
///
/// Elsewhere: Substance Designer *Mirror*, Material Maker *Mirror*, Blender *Flip*, Houdini *Flip*.
#[node]
pub struct Mirror {
    /// Field to mirror.
    pub input: In<AnyField>,
    /// Part that is shown twice.
    #[default(MirrorAxis::Left)]
    pub keep: MirrorAxis,
    /// Position of the axis; the middle of the canvas if not given. The parts on both sides are half a canvas wide.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub axis: Option<Xy>,
}

/// For each direction, across and down: true if the kept half lies before the axis; `None` if nothing is mirrored.
fn sides(keep: MirrorAxis) -> [Option<bool>; 2] {
    match keep {
        MirrorAxis::Left => [Some(true), None],
        MirrorAxis::Right => [Some(false), None],
        MirrorAxis::Top => [None, Some(true)],
        MirrorAxis::Bottom => [None, Some(false)],
        MirrorAxis::TopLeft => [Some(true); 2],
    }
}

/// Mirroring in one direction of a grid.
#[derive(Clone, Copy)]
struct Folded {
    /// The mirror image of pixel x is pixel `sum` − x.
    sum: i32,
    /// Pixels per canvas.
    pixels: i32,
    /// True if the kept half lies before the axis; `None` if nothing is mirrored.
    before: Option<bool>,
}

impl Folded {
    /// The pixel that shows at `at`, and true if it is mirrored.
    fn source(self, at: i32) -> (i32, bool) {
        let Some(before) = self.before else { return (at, false) };
        // Twice the distance from the axis, in -pixels..pixels.
        let twice = 2 * i64::from(at) - i64::from(self.sum);
        let pixels = i64::from(self.pixels);
        let twice = (twice + pixels).rem_euclid(2 * pixels) - pixels;
        let mirrored = if before { twice > 0 } else { twice < 0 };
        let twice = if mirrored { -twice } else { twice };
        (i32::try_from((i64::from(self.sum) + twice).div_euclid(2)).unwrap_or(at), mirrored)
    }

    /// The pixels to read for `count` pixels from `start` on: the first, and their number.
    fn reads(self, start: i32, count: u32) -> (i32, u32) {
        let all = || (start..).take(count as usize).map(|at| self.source(at).0);
        let (low, high) = (all().min().unwrap_or(start), all().max().unwrap_or(start));
        (low, high.abs_diff(low) + 1)
    }
}

struct Mirrored {
    input: Field,
    size: glam::DVec2,
    axis: glam::DVec2,
    keep: MirrorAxis,
}

impl Mirrored {
    #[expect(clippy::cast_possible_truncation, reason = "limited to the pixels of a canvas")]
    fn axes(&self, grid: &Grid) -> [Folded; 2] {
        let before = sides(self.keep);
        [0, 1].map(|k| {
            let sum = (2.0 * (self.axis[k] - grid.origin[k]) / grid.step[k] - 1.0).round().clamp(-1e9, 1e9);
            let pixels = (self.size[k] / grid.step[k]).round().clamp(1.0, 1e9);
            Folded { sum: sum as i32, pixels: pixels as i32, before: before[k] }
        })
    }
}

impl FieldSource for Mirrored {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let [across, down] = self.axes(grid);
        let ((x, width), (y, height)) = (across.reads(window.x, window.width), down.reads(window.y, window.height));
        vec![Read::new(&self.input, grid, Window { x, y, width, height })]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, window, [across, down]) = (given.tile(0), out.window, self.axes(&out.grid));
        let columns: Vec<(i32, bool)> = (window.x..window.right()).map(|x| across.source(x)).collect();
        let normal = self.input.ty() == Type::Normal;
        for channel in 0..out.channels() {
            for (row, y) in (window.y..window.bottom()).enumerate() {
                let (from, upside_down) = down.source(y);
                let line = input.row(channel, from.abs_diff(input.window.y) as usize);
                for (out, (x, mirrored)) in out.row_mut(channel, row).iter_mut().zip(&columns) {
                    let value = line[x.abs_diff(input.window.x) as usize];
                    let turned = normal && ((channel == 0 && *mirrored) || (channel == 1 && upside_down));
                    *out = if turned { 1.0 - value } else { value };
                }
            }
        }
        Ok(())
    }
}

impl Node for Mirror {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The mirrored field.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn makes_tile(&self, _port: &str) -> bool {
        self.keep == MirrorAxis::TopLeft
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, size) = (cx.get(&self.input)?, cx.size_mm());
        let axis = self.axis.map_or(0.5 * size, |axis| glam::DVec2::new(axis.x, axis.y));
        let [x, y] = sides(self.keep).map(|side| side.is_some());
        let tiling = Tiling { x: x || input.tiling().x, y: y || input.tiling().y };
        let ty = input.ty();
        Ok(Outputs::one(Field::new(ty, tiling, Mirrored { input, size, axis, keep: self.keep })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, crop, field, lumps, port, raster};

    /// A field that counts pixels.
    fn count() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = (window.x + k % width) as f32 + 1000.0 * (window.y + k / width) as f32;
            }
            Ok(())
        })
    }

    #[test]
    fn halves_are_shown_twice() {
        let at = |keep, axis: Option<Xy>, x: usize, y: usize| {
            let node = Mirror { input: port(0), keep, axis };
            raster(&field(&node, &[count().into()]), &canvas()).row(0, y)[x]
        };
        assert_eq!([5, 31, 32, 63].map(|x| at(MirrorAxis::Left, None, x, 2)), [2005.0, 2031.0, 2031.0, 2000.0]);
        assert_eq!([0, 31, 32, 40].map(|x| at(MirrorAxis::Right, None, x, 0)), [63.0, 32.0, 32.0, 40.0]);
        assert_eq!([0, 31, 32, 63].map(|y| at(MirrorAxis::Top, None, 1, y)), [1.0, 31001.0, 31001.0, 1.0]);
        assert_eq!(at(MirrorAxis::TopLeft, None, 60, 61), 2003.0);
        // The axis lies in the middle of pixel 10; half a canvas away is pixel 42.
        let axis = Some(Xy::new(5.25, 0.0));
        assert_eq!([9, 10, 11, 40].map(|x| at(MirrorAxis::Left, axis, x, 0)), [9.0, 10.0, 9.0, -20.0]);
    }

    #[test]
    fn repeats_for_any_input() {
        for keep in [MirrorAxis::Left, MirrorAxis::Right, MirrorAxis::Top, MirrorAxis::Bottom, MirrorAxis::TopLeft] {
            for axis in [None, Some(Xy::new(3.1, 40.0))] {
                let node = Mirror { input: port(0), keep, axis };
                check_field(&field(&node, &[count().into()]));
                check_field(&field(&node, &[lumps().to_rgb().into()]));
            }
        }
        let normal = Field::constant(Type::Normal, &[0.75, 0.75, 0.9]);
        let node = Mirror { input: port(0), keep: MirrorAxis::TopLeft, axis: None };
        let turned = crop(&field(&node, &[normal.into()]), &canvas(), Window { x: 40, y: 40, width: 1, height: 1 });
        assert_eq!(turned.data(), [0.25, 0.25, 0.9]);
    }
}
