//! A part of the canvas that is drawn in place of the whole.
use super::Refusal;
use glam::{DVec2, UVec2};
use shibo_value::Window;

/// The longest side of the whole picture of which a part is drawn, in pixels.
const MOST: f64 = 8192.0;
/// Part of a millimetre by which a region may reach beyond the canvas because of rounded numbers.
const SLACK: f64 = 1e-6;

/// A part of the canvas: its upper left corner and its size in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Region {
    start: DVec2,
    size: DVec2,
    /// The longest side of the picture of the whole canvas in pixels.
    pub(super) longest: u32,
}

impl Region {
    /// The region `[x, y, width, height]` in mm of a canvas of this size, `side` pixels long in the picture.
    pub(super) fn new(mm: [f64; 4], canvas: DVec2, side: u32) -> Result<Self, Refusal> {
        let [x, y, width, height] = mm;
        let (start, size) = (DVec2::new(x, y), DVec2::new(width, height));
        let refused = |message: String, help: String| Err(Refusal::new("out-of-range", message, help));
        let whole = format!("the canvas is {} × {} mm", canvas.x, canvas.y);
        if !mm.iter().all(|number| number.is_finite()) || size.min_element() <= 0.0 {
            let message = "`region` is `[x, y, width, height]` in mm; width and height must be greater than 0";
            return refused(message.to_owned(), whole);
        }
        if start.min_element() < -SLACK || (start + size - canvas).max_element() > SLACK {
            let message = format!("`region` reaches from ({x}, {y}) to ({}, {}) mm", x + width, y + height);
            return refused(message, format!("{whole}; the region must lie within it"));
        }
        let longest = (f64::from(side) * canvas.max_element() / size.max_element()).round();
        if longest > MOST {
            let least = f64::from(side) * canvas.max_element() / MOST;
            let message = format!("`region` is {} mm long, which is too small for {side} pixels", size.max_element());
            return refused(message, format!("take a region of at least {least:.3} mm, or a smaller `size`"));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and MOST")]
        let longest = longest.max(1.0) as u32;
        Ok(Self { start, size, longest })
    }

    /// The pixels of the region in a picture of the whole canvas; at least one.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the pixels of the picture")]
    pub(super) fn window(&self, canvas: DVec2, picture: UVec2) -> Window {
        let scale = picture.as_dvec2() / canvas;
        let last = picture.saturating_sub(UVec2::ONE).as_dvec2();
        let start = (self.start * scale).round().clamp(DVec2::ZERO, last);
        let size = (self.size * scale).round().clamp(DVec2::ONE, picture.as_dvec2() - start);
        Window { x: start.x as i32, y: start.y as i32, width: size.x as u32, height: size.y as u32 }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    #[test]
    fn regions_are_enlarged_to_the_size() {
        let canvas = DVec2::new(40.0, 20.0);
        let region = Region::new([10.0, 5.0, 10.0, 5.0], canvas, 256).unwrap();
        assert_eq!(region.longest, 1024);
        let window = region.window(canvas, UVec2::new(1024, 512));
        assert_eq!(window, Window { x: 256, y: 128, width: 256, height: 128 });
        let whole = Region::new([0.0, 0.0, 40.0, 20.0], canvas, 64).unwrap();
        assert_eq!((whole.longest, whole.window(canvas, UVec2::new(64, 32))), (64, Window::full(UVec2::new(64, 32))));
        // The last pixel, and a region that is thinner than one.
        let thin = Region::new([39.99, 0.0, 0.01, 20.0], canvas, 64).unwrap();
        let window = thin.window(canvas, UVec2::new(128, 64));
        assert_eq!(window, Window { x: 127, y: 0, width: 1, height: 64 });
    }

    #[test]
    fn regions_lie_within_the_canvas() {
        let canvas = DVec2::new(40.0, 20.0);
        for bad in [
            [0.0, 0.0, 0.0, 5.0],
            [0.0, 0.0, 5.0, -5.0],
            [f64::NAN, 0.0, 5.0, 5.0],
            [0.0, 0.0, f64::INFINITY, 5.0],
            [-1.0, 0.0, 5.0, 5.0],
            [36.0, 0.0, 5.0, 5.0],
            [0.0, 16.0, 5.0, 5.0],
            [0.0, 0.0, 1e300, 1e300],
            [0.0, 0.0, 0.1, 0.1],
        ] {
            assert_eq!(Region::new(bad, canvas, 256).unwrap_err().code, "out-of-range", "{bad:?}");
        }
        let small = Region::new([0.0, 0.0, 0.1, 0.1], canvas, 256).unwrap_err();
        assert!(small.help.contains("1.250 mm"), "{small:?}");
        assert!(Region::new([0.0, 0.0, 1.25, 0.1], canvas, 256).is_ok());
    }
}
