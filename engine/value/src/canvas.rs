//! The canvas of a graph, and the sampling grids that cover it.
use glam::{DVec2, UVec2};
use serde::{Deserialize, Serialize};

/// Directions in which something repeats with the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Tiling {
    /// Left and right edges match.
    pub x: bool,
    /// Top and bottom edges match.
    pub y: bool,
}

impl Tiling {
    /// Repeats in neither direction.
    pub const NONE: Self = Self { x: false, y: false };
    /// Repeats in both directions.
    pub const BOTH: Self = Self { x: true, y: true };

    /// Repeats in the directions in which both do.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self { x: self.x && other.x, y: self.y && other.y }
    }

    /// True if it repeats in every direction in which `other` does.
    pub const fn covers(self, other: Self) -> bool {
        (self.x || !other.x) && (self.y || !other.y)
    }
}

/// The tiling of the canvas as written in a graph file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum TileMode {
    /// In both directions.
    #[default]
    Both,
    /// Left and right edges match.
    X,
    /// Top and bottom edges match.
    Y,
    /// Not at all.
    None,
}

impl TileMode {
    /// All of them, by name.
    pub const ALL: [(&'static str, Self); 4] =
        [("Both", Self::Both), ("X", Self::X), ("Y", Self::Y), ("None", Self::None)];

    /// As directions.
    pub const fn tiling(self) -> Tiling {
        match self {
            Self::Both => Tiling::BOTH,
            Self::X => Tiling { x: true, y: false },
            Self::Y => Tiling { x: false, y: true },
            Self::None => Tiling::NONE,
        }
    }
}

/// The resolution of pictures of the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resolution {
    /// Number of pixels along the longer side; the other side follows from the shape of the canvas.
    Longer(u32),
    /// Width and height, for any shape of the canvas.
    Exact(UVec2),
}

impl Resolution {
    /// Width and height of a picture of a canvas of this size.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the range of pixels")]
    pub fn of(self, size_mm: DVec2) -> UVec2 {
        match self {
            Self::Exact(size) => size,
            Self::Longer(longer) => {
                let sides = size_mm / size_mm.max_element() * f64::from(longer);
                let side = |side: f64| side.round().clamp(1.0, f64::from(longer.max(1))) as u32;
                UVec2::new(side(sides.x), side(sides.y))
            }
        }
    }

    /// True if pixels are square on a canvas of this size, apart from rounding.
    pub fn fits(self, size_mm: DVec2) -> bool {
        let size = self.of(size_mm).as_dvec2();
        let apart = size - DVec2::new(size.y * size_mm.x / size_mm.y, size.x * size_mm.y / size_mm.x);
        apart.abs().min_element() < 1.0
    }
}

/// The surface that a graph describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Canvas {
    /// Width and height in mm.
    pub size_mm: DVec2,
    /// Width and height of pictures in pixels. Objects never depend on it.
    pub resolution: UVec2,
    /// The directions in which the result must repeat.
    pub tile: Tiling,
    /// The seed of all random numbers.
    pub seed: u64,
}

impl Canvas {
    /// The largest width or height of a picture in pixels.
    pub const MAX_RESOLUTION: u32 = 65_536;
    /// The largest width or height of a canvas in mm.
    pub const MAX_SIZE_MM: f64 = 1.0e6;

    /// The grid of a picture of the whole canvas at `resolution`.
    pub fn grid(&self, resolution: UVec2) -> Grid {
        Grid { origin: DVec2::ZERO, step: self.size_mm / resolution.as_dvec2(), period: Some(resolution), shown: None }
    }
}

/// Positions of the pixels of a picture: the centre of pixel `(i, j)` is at `origin + (i + ½, j + ½) · step` mm.
///
/// Pixels have integer coordinates, including negative ones: a grid has no edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The outer corner of pixel (0, 0) in mm.
    pub origin: DVec2,
    /// The size of a pixel in mm.
    pub step: DVec2,
    /// Size of the canvas in pixels, if that is a whole number: fields that repeat are read only within one period.
    pub period: Option<UVec2>,
    /// Size in mm of the visible part from the origin on, for a grid without a period, if it is known. Little is read
    /// beyond it, so blocks are small there.
    pub shown: Option<DVec2>,
}

impl Grid {
    /// The centre of a pixel in mm.
    pub fn center(&self, x: i32, y: i32) -> DVec2 {
        self.origin + (DVec2::new(f64::from(x), f64::from(y)) + 0.5) * self.step
    }

    /// The grid whose pixel (0, 0) has its centre at `point`, with the same pixel size.
    #[must_use]
    pub fn centered_at(&self, point: DVec2) -> Self {
        Self { origin: point - 0.5 * self.step, step: self.step, period: None, shown: None }
    }

    /// Pixels that cover `mm` millimetres, rounded up, in x and y, limited to the maximum of a [`Window`].
    #[expect(clippy::cast_possible_truncation, reason = "limited to the pixels of a window")]
    pub fn pixels(&self, mm: f64) -> (i32, i32) {
        let count = |step: f64| (mm / step).ceil().min(f64::from(Window::FARTHEST)) as i32;
        (count(self.step.x), count(self.step.y))
    }

    /// Size in pixels of the picture that starts at (0, 0), if it is known: one period, or the visible part of a grid
    /// without one.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the pixels of a window")]
    pub fn picture(&self) -> Option<UVec2> {
        let side = |pixels: f64| pixels.round().clamp(1.0, f64::from(Window::FARTHEST)) as u32;
        self.period.or_else(|| self.shown.map(|mm| (mm / self.step).to_array().map(side).into()))
    }

    /// The smaller side of a pixel in mm.
    pub fn min_step(&self) -> f64 {
        self.step.x.min(self.step.y)
    }

    /// A form that can be compared and hashed.
    pub fn id(&self) -> GridId {
        let shown = self.shown.unwrap_or(DVec2::ZERO);
        GridId {
            words: [self.origin.x, self.origin.y, self.step.x, self.step.y, shown.x, shown.y].map(f64::to_bits),
            period: self.period.map_or([0, 0], |p| p.to_array()),
        }
    }
}

/// The identity of a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GridId {
    words: [u64; 6],
    period: [u32; 2],
}

impl GridId {
    /// The identity as bytes, the same on every machine.
    pub fn bytes(&self) -> [u8; 56] {
        let mut bytes = [0; 56];
        let words = self.words.iter().flat_map(|word| word.to_le_bytes());
        let period = self.period.iter().flat_map(|word| word.to_le_bytes());
        bytes.iter_mut().zip(words.chain(period)).for_each(|(to, from)| *to = from);
        bytes
    }
}

/// A rectangle of pixels of a [`Grid`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Window {
    /// The leftmost column.
    pub x: i32,
    /// The topmost row.
    pub y: i32,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

impl Window {
    /// Maximum distance of a window from pixel (0, 0).
    pub const FARTHEST: i32 = 1 << 29;

    /// The window of a whole picture.
    pub const fn full(size: UVec2) -> Self {
        Self { x: 0, y: 0, width: size.x, height: size.y }
    }

    /// The number of pixels.
    pub const fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// True if there is no pixel.
    pub const fn is_empty(&self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// Adds `dx` columns on both sides and `dy` rows above and below, limited to [`Self::FARTHEST`].
    #[must_use]
    pub const fn grow(&self, dx: i32, dy: i32) -> Self {
        let (x, width) = grown(self.x, self.width, dx);
        let (y, height) = grown(self.y, self.height, dy);
        Self { x, y, width, height }
    }

    /// Its two halves across the longer side.
    #[must_use]
    pub const fn halves(&self) -> [Self; 2] {
        let (w, h) = (self.width / 2, self.height / 2);
        if self.width > self.height {
            let right = Self { x: self.x + w.cast_signed(), width: self.width - w, ..*self };
            [Self { width: w, ..*self }, right]
        } else {
            let below = Self { y: self.y + h.cast_signed(), height: self.height - h, ..*self };
            [Self { height: h, ..*self }, below]
        }
    }

    /// The smallest window that contains this one and `other`.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let (right, bottom) = (self.right().max(other.right()), self.bottom().max(other.bottom()));
        Self { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) }
    }

    /// The common pixels of this window and `other`; the two must overlap.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let (right, bottom) = (self.right().min(other.right()), self.bottom().min(other.bottom()));
        Self { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) }
    }

    /// The common pixels of this window and `other`, if there are any.
    #[must_use]
    pub fn overlap(&self, other: &Self) -> Option<Self> {
        let apart =
            self.right() <= other.x || other.right() <= self.x || self.bottom() <= other.y || other.bottom() <= self.y;
        (!apart && !self.is_empty() && !other.is_empty()).then(|| self.intersection(other))
    }

    /// True if all of `other` lies within.
    pub const fn contains(&self, other: &Self) -> bool {
        self.x <= other.x && self.y <= other.y && other.right() <= self.right() && other.bottom() <= self.bottom()
    }

    /// One past the last column.
    pub const fn right(&self) -> i32 {
        self.x + self.width.cast_signed()
    }

    /// One past the last row.
    pub const fn bottom(&self) -> i32 {
        self.y + self.height.cast_signed()
    }
}

/// Extends `count` pixels from `start` on by `more` on both sides; returns the new start and count.
const fn grown(start: i32, count: u32, more: i32) -> (i32, u32) {
    const fn within(at: i32) -> i32 {
        let far = Window::FARTHEST;
        if at < -far {
            -far
        } else if at > far {
            far
        } else {
            at
        }
    }
    let first = within(start.saturating_sub(more));
    let end = within(start.saturating_add(count.cast_signed()).saturating_add(more));
    (first, end.abs_diff(first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_the_growth_of_windows() {
        let window = Window { x: -3, y: 5, width: 10, height: 20 };
        assert_eq!(window.grow(2, 0), Window { x: -5, y: 5, width: 14, height: 20 });
        let far = Window::FARTHEST;
        let all = Window { x: -far, y: 5, width: 2 * far.unsigned_abs(), height: 20 };
        assert_eq!(window.grow(i32::MAX, 0), all);
        assert_eq!(all.grow(far, 0), all);
        assert_eq!(all.right(), far);
    }

    #[test]
    fn one_number_keeps_the_shape_of_the_canvas() {
        let of = |longer: u32, x: f64, y: f64| Resolution::Longer(longer).of(DVec2::new(x, y)).to_array();
        assert_eq!(of(1024, 100.0, 100.0), [1024, 1024]);
        assert_eq!(of(1024, 60.0, 30.0), [1024, 512]);
        assert_eq!(of(1000, 30.0, 90.0), [333, 1000]);
        assert_eq!(of(100, 1e6, 1.0), [100, 1]);
        assert_eq!(Resolution::Exact(UVec2::new(7, 9)).of(DVec2::ONE).to_array(), [7, 9]);
    }

    #[test]
    fn rejects_only_resolutions_that_distort_pixels() {
        let fits = |w: u32, h: u32, x: f64, y: f64| Resolution::Exact(UVec2::new(w, h)).fits(DVec2::new(x, y));
        assert!(fits(64, 64, 5.0, 5.0) && fits(2048, 1024, 200.0, 100.0));
        assert!(fits(1000, 333, 90.0, 30.0) && fits(1000, 334, 90.0, 30.0) && fits(100, 1, 1e6, 1.0));
        assert!(!fits(1024, 1024, 60.0, 30.0) && !fits(512, 1024, 200.0, 100.0) && !fits(8, 4, 5.0, 5.0));
        assert!(Resolution::Longer(77).fits(DVec2::new(3.0, 1000.0)));
    }
}
