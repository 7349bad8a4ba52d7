//! The page of a film: the canvas, or several, with a margin and its marks.
use glam::{DVec2, UVec2};

/// Size of a page and its marks.
#[derive(Clone, Debug)]
pub(super) struct Page {
    /// The canvases in mm.
    pub inner: DVec2,
    /// Width of the margin in mm.
    pub margin: f64,
}

/// A filled rectangle: two opposite corners in mm.
pub(super) type Rectangle = [DVec2; 2];

impl Page {
    /// The whole page in mm.
    pub(super) fn size(&self) -> DVec2 {
        self.inner + 2.0 * self.margin
    }

    /// Centres of the crosses: upper left, upper right, lower left, lower right.
    pub(super) fn crosses(&self) -> [DVec2; 4] {
        let (near, far) = (DVec2::splat(0.5 * self.margin), self.size() - 0.5 * self.margin);
        [near, DVec2::new(far.x, near.y), DVec2::new(near.x, far.y), far]
    }

    /// The marks of film `number`, counted from 1, of `count`: a cross in each corner, the third with doubled lines, and
    /// as many squares as the number. Without margin there are none.
    pub(super) fn marks(&self, number: usize, count: usize) -> Vec<Rectangle> {
        let mut marks = Vec::new();
        if self.margin == 0.0 {
            return marks;
        }
        let (arm, thin) = (0.35 * self.margin, 0.01 * self.margin);
        for (k, at) in self.crosses().into_iter().enumerate() {
            let offsets = if k == 2 { &[-0.08, 0.08][..] } else { &[0.0][..] };
            for offset in offsets {
                let shift = offset * self.margin;
                marks.push([at + DVec2::new(-arm, shift - thin), at + DVec2::new(arm, shift + thin)]);
                marks.push([at + DVec2::new(shift - thin, -arm), at + DVec2::new(shift + thin, arm)]);
            }
        }
        let pitch = (0.4 * self.margin).min(self.inner.x / (count + 1) as f64);
        for k in 0..number {
            let at = DVec2::new(self.margin + (k as f64 + 0.25) * pitch, 0.5 * self.margin);
            marks.push([at - DVec2::new(0.0, 0.25 * pitch), at + DVec2::new(0.5 * pitch, 0.25 * pitch)]);
        }
        marks
    }
}

/// Marks a rectangle in a row of pixels. `y` is the row, `pixel` the size of a pixel in mm. A rectangle covers at least a
/// pixel in each direction.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels of a page")]
pub(super) fn draw([low, high]: &Rectangle, y: u32, pixel: DVec2, row: &mut [u8]) {
    let first = (*low / pixel).round().max(DVec2::ZERO);
    let last = (*high / pixel).round().max(first + 1.0);
    if (first.y..last.y).contains(&f64::from(y)) {
        let last = (last.x as usize).min(row.len());
        row[(first.x as usize).min(last)..last].fill(1);
    }
}

/// Margin in pixels.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "pixels of a page")]
pub(super) fn margin_pixels(margin: f64, pixel: DVec2) -> UVec2 {
    let count = |length: f64| (margin / length).round().clamp(0.0, 1e6) as u32;
    UVec2::new(count(pixel.x), count(pixel.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_differ_in_their_squares_alone() {
        let page = Page { inner: DVec2::new(60.0, 40.0), margin: 10.0 };
        let (first, third) = (page.marks(1, 8), page.marks(3, 8));
        assert_eq!(first[..10], third[..10], "ten lines of crosses, of which one is doubled");
        assert_eq!((first.len(), third.len()), (11, 13));
        for [low, high] in page.marks(8, 8) {
            assert!(low.cmplt(high).all() && low.min_element() > 0.0 && high.cmplt(page.size()).all());
            assert!(high.y < 10.0 || low.y > 50.0, "marks lie in the margin");
        }
        assert!(Page { margin: 0.0, ..page }.marks(3, 8).is_empty());
    }

    #[test]
    fn thin_lines_keep_a_pixel() {
        let mut row = [0; 8];
        let line = [DVec2::new(1.02, 0.0), DVec2::new(1.04, 4.0)];
        draw(&line, 2, DVec2::splat(0.5), &mut row);
        assert_eq!(row, [0, 0, 1, 0, 0, 0, 0, 0]);
        draw(&line, 8, DVec2::splat(0.5), &mut row);
        assert_eq!(row.iter().sum::<u8>(), 1);
    }
}
