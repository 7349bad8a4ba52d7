//! Pieces in their own coordinates.
use super::pieces::{Pieces, Reach};
use glam::DVec2;

/// A picture of numbered pieces.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Ids.
    pub ids: &'a [f32],
    /// Pixels in a row.
    pub width: usize,
    /// The size of a pixel, mm.
    pub step: DVec2,
    /// Directions in which it wraps around.
    pub wrap: [bool; 2],
}

impl Picture<'_> {
    /// Width and height in pixels.
    fn size(&self) -> DVec2 {
        let width = self.width.max(1);
        DVec2::new(width as f64, (self.ids.len() / width) as f64)
    }

    /// The size in mm in the directions that wrap, and 0 in others.
    pub fn period(&self) -> DVec2 {
        let size = self.size() * self.step;
        DVec2::new(if self.wrap[0] { size.x } else { 0.0 }, if self.wrap[1] { size.y } else { 0.0 })
    }

    /// The middles of the bounding boxes of pieces, mm.
    pub fn middles(&self, [x, y]: &[Vec<Reach>; 2]) -> Vec<DVec2> {
        let (middle, period) = (|r: &Reach| r.start as f64 + 0.5 * r.length as f64, self.period());
        let wrapped = |at: f64, period: f64| if period > 0.0 { at.rem_euclid(period) } else { at };
        let both = |(x, y): (&Reach, &Reach)| {
            let at = DVec2::new(middle(x), middle(y)) * self.step;
            DVec2::new(wrapped(at.x, period.x), wrapped(at.y, period.y))
        };
        x.iter().zip(y).map(both).collect()
    }

    /// Calls `body(piece, away, pixels)` for runs of pixels, with the vector in mm from the piece's middle to the
    /// middle of the run, and its number of pixels.
    fn each(&self, pieces: &Pieces, middles: &[DVec2], mut body: impl FnMut(usize, DVec2, f64)) {
        let period = self.period();
        pieces.each(self.ids, self.width, |piece, y, from, to| {
            let at = DVec2::new(0.5 * (from + to) as f64, y as f64 + 0.5) * self.step;
            let left = DVec2::new((from as f64 + 0.5) * self.step.x, at.y);
            let right = DVec2::new((to as f64 - 0.5) * self.step.x, at.y);
            // A run that crosses the point opposite to the middle is split there.
            let ends = [left, right].map(|end| nearest(end - middles[piece], period));
            if ends[0].x <= ends[1].x {
                return body(piece, nearest(left - middles[piece], period) + (at - left), (to - from) as f64);
            }
            for x in from..to {
                let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * self.step;
                body(piece, nearest(at - middles[piece], period), 1.0);
            }
        });
    }

    /// Angle of the long side of each piece in radians, from +x towards +y, -π/2..π/2: the axis with the least moment
    /// of inertia. 0 for a piece with equal moments in all directions.
    pub fn long_sides(&self, pieces: &Pieces, middles: &[DVec2]) -> Vec<f64> {
        let mut sums = vec![[0.0; 6]; pieces.ids.len()];
        self.each(pieces, middles, |piece, at, n| {
            let spread = (n * n - 1.0) / 12.0 * self.step.x * self.step.x;
            let terms = [1.0, at.x, at.y, at.x * at.x + spread, at.y * at.y, at.x * at.y];
            sums[piece].iter_mut().zip(terms).for_each(|(sum, term)| *sum += n * term);
        });
        let angle = |[n, x, y, xx, yy, xy]: &[f64; 6]| {
            let (x, y) = (x / n, y / n);
            let (xx, yy, xy) = (xx / n - x * x, yy / n - y * y, xy / n - x * y);
            let (sin, cos) = (2.0 * xy, xx - yy);
            if libm::hypot(sin, cos) < 1e-3 * (xx + yy) { 0.0 } else { 0.5 * libm::atan2(sin, cos) }
        };
        sums.iter().map(angle).collect()
    }

    /// Extents of pieces from their middles along axes whose x is turned by `angles` (radians): the least and the
    /// largest x, and y.
    pub fn extents(&self, pieces: &Pieces, middles: &[DVec2], angles: &[f64]) -> Vec<[f64; 4]> {
        let axes: Vec<DVec2> = angles.iter().map(|a| DVec2::new(libm::cos(*a), libm::sin(*a))).collect();
        let mut extents = vec![[f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY]; axes.len()];
        self.each(pieces, middles, |piece, at, n| {
            let half = DVec2::new(0.5 * (n - 1.0) * self.step.x, 0.0);
            // The corners of pixels reach farther than their middles.
            let axis = axes[piece];
            let corner = 0.5 * (axis.abs() * self.step).element_sum();
            let across = 0.5 * (axis.perp().abs() * self.step).element_sum();
            let e = &mut extents[piece];
            for at in [at - half, at + half] {
                let (x, y) = (axis.dot(at), axis.perp_dot(at));
                *e = [e[0].min(x - corner), e[1].max(x + corner), e[2].min(y - across), e[3].max(y + across)];
            }
        });
        extents
    }
}

/// The shortest vector equivalent to `away` under `period`; a period of 0 means no repeat.
#[inline]
pub fn nearest(away: DVec2, period: DVec2) -> DVec2 {
    let one = |d: f64, period: f64| if period > 0.0 { d - period * (d / period).round() } else { d };
    DVec2::new(one(away.x, period.x), one(away.y, period.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::pieces::reaches;
    use std::f64::consts::PI;

    /// Angle of an axis without orientation, in -π/2..π/2.
    fn axis(angle: f64) -> f64 {
        angle - PI * (angle / PI).round()
    }

    /// Measures a bar of 20 × 4 mm, turned and moved across the border: its long side, middle and extents.
    #[test]
    fn a_bar_is_measured() {
        for (degrees, center, wrap) in [
            (0.0_f64, DVec2::new(20.0, 16.0), false),
            (30.0, DVec2::new(20.0, 16.0), false),
            (-50.0, DVec2::new(1.0, 31.0), true),
            (90.0, DVec2::new(30.0, 2.0), true),
        ] {
            let (n, step) = (160, 0.25);
            let direction = DVec2::from_angle(degrees.to_radians());
            let ids: Vec<f32> = (0..n * n)
                .map(|i| {
                    let at = DVec2::new((i % n) as f64 + 0.5, (i / n) as f64 + 0.5) * step - center;
                    let at = if wrap { nearest(at, DVec2::splat(40.0)) } else { at };
                    let inside = direction.dot(at).abs() < 10.0 && direction.perp_dot(at).abs() < 2.0;
                    if inside { 7.0 } else { 0.0 }
                })
                .collect();
            let picture = Picture { ids: &ids, width: n, step: DVec2::splat(step), wrap: [wrap; 2] };
            let pieces = Pieces::of(&ids);
            assert!((pieces.area[1] as f64 * step * step - 80.0).abs() < 2.0);
            let middles = picture.middles(&reaches(&pieces, &ids, n, [wrap; 2]));
            assert!(nearest(middles[1] - center, picture.period()).length() < 0.3, "{:?}", middles[1]);
            let angle = picture.long_sides(&pieces, &middles)[1];
            assert!(axis(angle - degrees.to_radians()).abs() < 0.02, "{degrees} {}", angle.to_degrees());
            let extents = picture.extents(&pieces, &middles, &[0.0, degrees.to_radians()])[1];
            for (got, want) in extents.into_iter().zip([-10.0, 10.0, -2.0, 2.0]) {
                assert!((got - want).abs() < 0.5, "{degrees}: {extents:?}");
            }
        }
    }
}
