//! The material that a milling tool with a ball end leaves on a relief.
//!
//! The tool goes as low as its ball allows at every place. The surface that it leaves is the closing of the height by the
//! ball, see [`envelope`](crate::surface::envelope). Beyond a side of the canvas that does not repeat, the tool goes down
//! to the lowest height.
//!
//! The canvas is divided into blocks, and each is computed from the pixels around it, so the memory does not depend on the
//! size of the canvas. Cost: O(pixels · square of the reach in pixels) at most; less on heights that differ little.
use super::heights::{Heights, whole};
use crate::ground::number::narrow;
use crate::ground::window::{View, WindowExt};
use crate::surface::envelope::{Foot, Profile, lower, range};
use rayon::prelude::*;
use shibo_value::Window;
use std::io;

/// Pixels along the side of a block.
const BLOCK: usize = 256;
/// The farthest reach of the tool in pixels. It bounds the memory for a block.
pub const MOST_REACH: usize = 512;
/// Bytes of the blocks that are computed at the same time, if there are several.
const AT_ONCE: usize = 128 << 20;
/// Bytes for each pixel of a block and its surroundings: its height, the lowest place of the tool, and the samples of
/// an envelope.
const PIXEL: usize = 24;

/// The material that a tool leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Left {
    /// The greatest height of material above the relief, in mm.
    pub greatest: f32,
    /// The pixel with the most material; of several, the first one row by row: column and row.
    pub at: [usize; 2],
    /// The share of the pixels with more material than the tolerance.
    pub share: f64,
}

/// The contribution of a block: the greatest height with its pixel, and the number of pixels over the tolerance.
type Part = (f32, [usize; 2], u64);

impl Heights<'_> {
    /// The reach of a ball of this radius, in mm: the distance up to which it is lower than the relief is deep.
    fn reach_mm(&self, radius: f64) -> f64 {
        let (least, greatest, _) = self.extent();
        let depth = f64::from(greatest) - f64::from(least);
        if depth < radius { (depth * (2.0 * radius - depth)).sqrt() } else { radius }
    }

    /// The reach of a ball of this radius in pixels, in x and y. [`left_by_ball`](Self::left_by_ball) needs at most
    /// [`MOST_REACH`].
    pub fn reach_of_ball(&self, radius: f64) -> [usize; 2] {
        Foot::reach(self.reach_mm(radius), self.pixel_mm())
    }

    /// The material that a ball of `radius` mm leaves, and the share of the pixels with more than `tolerance` mm of it.
    ///
    /// # Errors
    /// Those of the rows; an interrupted call if `stop` returned true.
    pub fn left_by_ball(&self, radius: f64, tolerance: f64, stop: &(dyn Fn() -> bool + Sync)) -> io::Result<Left> {
        self.left_in_blocks(radius, tolerance, BLOCK, stop)
    }

    pub(super) fn left_in_blocks(
        &self,
        radius: f64,
        tolerance: f64,
        side: usize,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> io::Result<Left> {
        let foot = Foot::new(Profile::Ball(radius), self.reach_mm(radius), self.pixel_mm());
        let reach = self.reach_of_ball(radius);
        let [width, height] = self.count;
        let starts = (0..height).step_by(side).flat_map(|y| (0..width).step_by(side).map(move |x| [x, y]));
        let blocks: Vec<[usize; 2]> = starts.collect();
        let bytes = PIXEL * (side + 4 * reach[0]) * (side + 4 * reach[1]);
        let (mut greatest, mut at, mut over) = (0.0_f32, [0; 2], 0);
        for group in blocks.chunks((AT_ONCE / bytes).max(1)) {
            if stop() {
                return Err(io::ErrorKind::Interrupted.into());
            }
            let part = |[x, y]: &[usize; 2]| {
                let own = Window::of(whole(*x), whole(*y), side.min(width - x), side.min(height - y));
                self.left_in(own, (&foot, reach), narrow(tolerance))
            };
            for (most, place, count) in group.par_iter().map(part).collect::<io::Result<Vec<Part>>>()? {
                let is_first = most == greatest && most > 0.0 && (place[1], place[0]) < (at[1], at[0]);
                if most > greatest || is_first {
                    (greatest, at) = (most, place);
                }
                over += count;
            }
        }
        let share = over as f64 / (width as f64 * height as f64);
        Ok(Left { greatest, at, share })
    }

    /// The material in a block of pixels.
    fn left_in(&self, own: Window, (foot, reach): (&Foot, [usize; 2]), tolerance: f32) -> io::Result<Part> {
        let tips = own.with_halo(reach);
        let all = tips.with_halo(reach);
        // The upper envelope of the heights is the lower one of their opposites.
        let mut heights = self.pixels_around(all)?;
        heights.iter_mut().for_each(|v| *v = -*v);
        let heights = View::new(&heights, all);
        let mut lowest = vec![0.0; tips.len()];
        lower(&heights, tips, foot, range(&heights, all), &mut lowest);
        lowest.iter_mut().for_each(|v| *v = -*v);
        let lowest = View::new(&lowest, tips);
        let mut surface = vec![0.0; own.len()];
        lower(&lowest, own, foot, range(&lowest, tips), &mut surface);
        let (mut greatest, mut at, mut over) = (0.0_f32, [0; 2], 0);
        for (row, surface) in surface.chunks_exact(own.columns()).enumerate() {
            let line = heights.row(own.x, own.y + whole(row), own.columns());
            for (column, (surface, opposite)) in surface.iter().zip(line).enumerate() {
                let left = surface + opposite;
                over += u64::from(left > tolerance);
                if left > greatest {
                    let [x, y] = [own.x, own.y].map(|start| usize::try_from(start).unwrap_or(0));
                    (greatest, at) = (left, [x + column, y + row]);
                }
            }
        }
        Ok((greatest, at, over))
    }

    /// The heights of the pixels of a window, which may lie beyond the canvas.
    fn pixels_around(&self, window: Window) -> io::Result<Vec<f32>> {
        let [width, height] = self.count;
        let beyond = self.extent().0;
        let mut values = vec![beyond; window.len()];
        let inside = |at: i32, count: usize, repeats: bool| match usize::try_from(at) {
            Ok(at) if at < count => Some(at),
            _ if repeats => usize::try_from(at.rem_euclid(whole(count))).ok(),
            _ => None,
        };
        for (line, y) in values.chunks_exact_mut(window.columns()).zip(window.y..) {
            let Some(row) = inside(y, height, self.repeats[1]) else { continue };
            let mut from = 0;
            while from < line.len() {
                let left = line.len() - from;
                let Some(column) = inside(window.x + whole(from), width, self.repeats[0]) else {
                    // Before the canvas, up to its first column; after it, to the end.
                    from += usize::try_from(-(window.x + whole(from))).map_or(left, |before| before.clamp(1, left));
                    continue;
                };
                let count = left.min(width - column);
                self.pixels.read(row * width + column, &mut line[from..from + count])?;
                from += count;
            }
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small numbers")]
    use super::*;

    const GO: &(dyn Fn() -> bool + Sync) = &|| false;

    /// Heights from 0 to 1 that look random.
    fn rough(width: usize, height: usize) -> Vec<f32> {
        let value = |n: usize| ((n * 7919 + n * n * 104_729) % 1009) as f32 / 1009.0;
        (0..width * height).map(value).collect()
    }

    /// The same by the definition, for each pixel.
    fn slowly(values: &[f32], size: [usize; 2], pixel: f64, repeats: bool, radius: f64) -> Vec<f32> {
        let [w, h] = size.map(|n| i32::try_from(n).unwrap());
        let least = values.iter().copied().fold(f32::INFINITY, f32::min);
        let far = (radius / pixel).floor() as i32;
        let at = |x: i32, y: i32| {
            let (inside, (x, y)) = match repeats {
                true => (true, (x.rem_euclid(w), y.rem_euclid(h))),
                false => ((0..w).contains(&x) && (0..h).contains(&y), (x, y)),
            };
            if inside { values[(y * w + x) as usize] } else { least }
        };
        let lifts: Vec<(i32, i32, f32)> = (-far..=far)
            .flat_map(|dy| (-far..=far).map(move |dx| (dx, dy)))
            .filter_map(|(dx, dy)| {
                let distance = f64::from(dx).hypot(f64::from(dy)) * pixel;
                (distance <= radius).then(|| (dx, dy, (radius - (radius * radius - distance * distance).sqrt()) as f32))
            })
            .collect();
        let tip = |x: i32, y: i32| {
            lifts.iter().map(|(dx, dy, lift)| at(x + dx, y + dy) - lift).fold(f32::NEG_INFINITY, f32::max)
        };
        let surface = |x: i32, y: i32| {
            lifts.iter().map(|(dx, dy, lift)| tip(x + dx, y + dy) + lift).fold(f32::INFINITY, f32::min)
        };
        (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| surface(x, y) - at(x, y)).collect()
    }

    #[test]
    fn finds_the_same_material_as_the_definition_in_blocks_of_any_size() {
        let size = [23, 17];
        let values = rough(size[0], size[1]);
        for (repeats, radius) in [(false, 1.3), (true, 1.3), (false, 0.7), (true, 2.5)] {
            let exact = slowly(&values, size, 0.5, repeats, radius);
            let most = exact.iter().copied().fold(0.0, f32::max);
            let over = exact.iter().filter(|left| **left > 0.1).count();
            let heights = Heights::of_canvas(&values, size, [0.5; 2], [repeats; 2]).unwrap();
            for side in [5, 8, 256] {
                let left = heights.left_in_blocks(radius, 0.1, side, GO).unwrap();
                assert!((left.greatest - most).abs() < 1e-5, "{repeats} {radius} {side}: {left:?}, not {most}");
                let [x, y] = left.at;
                assert!((exact[y * size[0] + x] - most).abs() < 1e-5, "{repeats} {radius} {side}: {left:?}");
                let share = over as f64 / exact.len() as f64;
                assert!((left.share - share).abs() < 2.5 / exact.len() as f64, "{left:?}, not {share}");
            }
            assert!(most > 0.2 && over > 0);
        }
    }

    /// A groove of 1 mm between places of height 0: a ball of radius 0.2 mm reaches its floor, one of 2 mm does not.
    #[test]
    fn small_tools_leave_nothing() {
        let values: Vec<f32> = (0..60 * 20).map(|n| if (20..30).contains(&(n % 60)) { -0.5 } else { 0.0 }).collect();
        let heights = Heights::of_canvas(&values, [60, 20], [0.1; 2], [false, true]).unwrap();
        let wide = heights.left_by_ball(2.0, 0.01, GO).unwrap();
        // In the middle the ball goes down to 2 − √(2² − 0.5²) = 0.06 mm, and less far beside the walls.
        assert!((0.43..0.5).contains(&wide.greatest), "{wide:?}");
        assert_eq!(wide.at, [20, 0], "the first pixel beside a wall");
        assert!((wide.share - 10.0 / 60.0).abs() < 1e-9, "{wide:?}");
        // Beside the walls the ball of 0.2 mm leaves 0.2 mm.
        let close = heights.left_by_ball(0.2, 0.25, GO).unwrap();
        assert!((close.greatest - 0.2).abs() < 0.01 && close.share <= 0.0, "{close:?}");
        // No sample lies within the reach of a needle.
        assert_eq!(heights.left_by_ball(1e-3, 0.01, GO).unwrap(), Left::default());
        assert!(heights.left_by_ball(0.2, 0.3, &|| true).is_err());
    }
}
