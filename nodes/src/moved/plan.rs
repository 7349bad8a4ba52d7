//! The grid of pixels on which a moved field reads its input.
use super::Moved;
use glam::{DMat2, DVec2, UVec2};
use shibo_kernel::filter::resample;
use shibo_value::{Canvas, Grid, TILE, Tiling, Type, Window};

/// If more canvases than this lie side by side in the picture, the step is adjusted so that a whole number of pixels
/// makes the canvas.
const CANVASES: f64 = 8.0;

/// How the pixels of the input lie relative to those of the result: pixel (x, y) shows the place `start` + `map`·(x,
/// y), counted in pixels of `grid` from the centre of its pixel (0, 0).
pub(super) struct ReadPlan {
    pub(super) grid: Grid,
    start: DVec2,
    pub(super) map: DMat2,
    /// True if pixels are mapped to whole pixels, which are then copied.
    pub(super) whole: bool,
    /// Period of the input in pixels, where it repeats.
    repeats: [Option<u32>; 2],
}

/// True if pixels map to whole pixels, as with whole shifts and rotations by multiples of 90°.
fn is_whole(map: DMat2) -> bool {
    map.abs_diff_eq(rounded(map), 1e-6)
}

fn rounded(map: DMat2) -> DMat2 {
    DMat2::from_cols(map.x_axis.round(), map.y_axis.round())
}

fn is_near(a: DVec2, b: DVec2) -> bool {
    (a - b).abs().max_element() < 1e-6
}

/// Size of the bounding box of a mapped rectangle of `size`.
fn spread(map: DMat2, size: DVec2) -> DVec2 {
    map.x_axis.abs() * size.x + map.y_axis.abs() * size.y
}

impl ReadPlan {
    pub(super) fn new(moved: &Moved, grid: &Grid) -> Self {
        let tiling = moved.input.tiling();
        let first = moved.to_input(grid.center(0, 0));
        if moved.inverse == DMat2::IDENTITY {
            let pixels = ((moved.shift - moved.pivot) / grid.step).round();
            if is_near((moved.shift - moved.pivot) / grid.step, pixels) && pixels.abs().max_element() < 1e8 {
                return Self::of(*grid, -pixels, DMat2::IDENTITY, tiling);
            }
        }
        // Maps pixels of the result to mm of the input; `step` is how far one pixel reaches there.
        let map = moved.inverse * DMat2::from_diagonal(grid.step);
        let mut step = DVec2::new(map.row(0).length(), map.row(1).length());
        let straight = map.x_axis.y == 0.0 && map.y_axis.x == 0.0 && map.x_axis.x > 0.0 && map.y_axis.y > 0.0;
        let picture = grid.picture().map(|pixels| pixels.as_dvec2());
        let canvases = picture.unwrap_or(DVec2::splat(TILE.into())) * step / moved.size;
        let fine = |step: f64, size: f64| if size < step { step } else { size / (size / step - 1e-6).ceil() };
        if tiling == Tiling::BOTH && (!straight || canvases.max_element() > CANVASES) {
            // A whole number of pixels per canvas, so that every repeat is read in the same way.
            step = moved.size / (moved.size / step - 1e-6).ceil().max(DVec2::ONE);
        } else if !straight {
            step = DVec2::new(fine(step.x, moved.size.x), fine(step.y, moved.size.y));
        }
        let pixels = DMat2::from_diagonal(1.0 / step) * map;
        let wide = picture.map(|picture| spread(pixels, picture));
        // Compute at most one repeat, and only if it has no more than four times as many pixels as are shown.
        let repeats = period(step, moved.size).filter(|_| tiling == Tiling::BOTH);
        let repeats = repeats.filter(|period| wide.is_none_or(|wide| period.as_dvec2().cmple(2.0 * wide + 0.5).all()));
        if let Some((grid, start)) = moved.native(step, first).filter(|_| !straight && !is_whole(pixels)) {
            return Self::of(grid, start, DMat2::from_diagonal(1.0 / grid.step) * map, tiling);
        }
        match repeats {
            Some(period) => Self::repeating(moved, (first, pixels), period, tiling),
            None => Self::shown((first, pixels), step, picture, tiling),
        }
    }

    fn of(grid: Grid, start: DVec2, map: DMat2, tiling: Tiling) -> Self {
        let whole = is_whole(map) && start == start.round();
        let map = if whole { rounded(map) } else { map };
        let repeats = grid.period.map(|period| [tiling.x.then_some(period.x), tiling.y.then_some(period.y)]);
        Self { grid, start, map, whole, repeats: repeats.unwrap_or_default() }
    }

    /// Plan on a grid with `period` pixels per canvas: the pixels of the canvas itself, if the map hits them.
    fn repeating(moved: &Moved, (first, map): (DVec2, DMat2), period: UVec2, tiling: Tiling) -> Self {
        let step = moved.size / period.as_dvec2();
        let canvas = Grid { origin: DVec2::ZERO, step, period: Some(period), shown: None };
        let (at, count) = (first / step - 0.5, period.as_dvec2());
        if is_whole(map) && is_near(at, at.round()) {
            return Self::of(canvas, at.round() - count * (at.round() / count).floor(), map, tiling);
        }
        Self::of(Grid { period: Some(period), ..canvas.centered_at(first) }, DVec2::ZERO, map, tiling)
    }

    /// Plan on a grid that starts at the first pixel under the picture.
    fn shown((first, map): (DVec2, DMat2), step: DVec2, picture: Option<DVec2>, tiling: Tiling) -> Self {
        let low =
            picture.map_or(DVec2::ZERO, |p| (map.x_axis * p.x).min(DVec2::ZERO) + (map.y_axis * p.y).min(DVec2::ZERO));
        let low = if is_near(low, low.round()) { low.round() } else { low.floor() };
        let grid = Grid { origin: DVec2::ZERO, step, period: None, shown: None }.centered_at(first + low * step);
        let shown = picture.map(|picture| spread(map, picture) * step);
        Self::of(Grid { shown, ..grid }, -low, map, tiling)
    }

    /// Start of a row of the result.
    #[inline(always)]
    pub(super) fn row(&self, y: i32) -> DVec2 {
        self.start + self.map.y_axis * f64::from(y)
    }

    /// The pixel whose centre lies at or before a place, reduced to the first repeat in the directions of `wraps`; and
    /// the distance from that centre to the place.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates; windows hold what is read")]
    pub(super) fn pixel(&self, at: DVec2, wraps: [bool; 2]) -> ([i32; 2], DVec2) {
        let pixel = at.floor();
        let mut read = pixel;
        for axis in 0..2 {
            if let Some(count) = self.repeats[axis].filter(|_| wraps[axis]).map(f64::from) {
                read[axis] -= count * (read[axis] / count).floor();
            }
        }
        ([read.x as i32, read.y as i32], at - pixel)
    }

    /// True if the pixels that are read for a window are exactly the pixels of the window, in the same order.
    pub(super) fn copies(&self, window: Window) -> bool {
        self.whole && self.map == DMat2::IDENTITY && self.wraps(window) == [false; 2]
    }

    /// The directions in which one repeat holds all pixels that are read for a window.
    pub(super) fn wraps(&self, window: Window) -> [bool; 2] {
        let (_, size) = self.under(window);
        std::array::from_fn(|axis| self.repeats[axis].is_some_and(|count| size[axis] > f64::from(count)))
    }

    /// The first pixel that lies under a window, and the number of pixels under it.
    fn under(&self, window: Window) -> (DVec2, DVec2) {
        let at = |x: i32, y: i32| self.map.x_axis * f64::from(x) + self.row(y);
        let (right, bottom) = (window.right() - 1, window.bottom() - 1);
        let corners = [at(window.x, window.y), at(right, window.y), at(window.x, bottom), at(right, bottom)];
        let low = corners.into_iter().fold(DVec2::MAX, DVec2::min).floor();
        let high = corners.into_iter().fold(DVec2::MIN, DVec2::max).floor();
        (low, high - low + 1.0)
    }

    /// The window of the input that is read for a window, including the halo of the resampling.
    #[expect(clippy::cast_possible_truncation, reason = "limited to what windows can hold")]
    pub(super) fn reads(&self, window: Window, ty: Type) -> Window {
        // The nearest pixel may be the next one.
        let halo = if self.whole {
            0
        } else if ty == Type::Ids {
            1
        } else {
            resample::HALO as i32
        };
        let ((low, size), wraps) = (self.under(window), self.wraps(window));
        let far = f64::from(Window::FARTHEST);
        let axis = |axis: usize| match self.repeats[axis].filter(|_| wraps[axis]) {
            Some(count) => (0, count),
            None => {
                let (from, to) = (low[axis].clamp(-far, far), (low[axis] + size[axis]).clamp(-far, far));
                (from as i32, (to as i32).abs_diff(from as i32))
            }
        };
        let ((x, width), (y, height)) = (axis(0), axis(1));
        Window { x, y, width, height }.grow(halo, halo)
    }
}

/// Number of pixels of this size that make the canvas, if it is whole.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the pixels of a picture")]
fn period(step: DVec2, size: DVec2) -> Option<UVec2> {
    let (pixels, most) = (size / step, f64::from(Canvas::MAX_RESOLUTION));
    let near = pixels.round();
    let good = is_near(pixels, near) && near.min_element() >= 1.0 && near.max_element() <= most;
    good.then(|| UVec2::new(near.x as u32, near.y as u32))
}
