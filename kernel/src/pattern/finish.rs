//! Output planes of pieces: gaps, bevels, ids, coordinates and angles.
use super::layout::{Grid, LaidPiece};
use crate::ground::number::narrow;
use crate::ground::window::{Frame, WindowExt as _};
use glam::DVec2;
use shibo_macros::choice;

/// The cross-section of a bevelled edge.
#[choice]
pub enum BevelProfile {
    /// Straight.
    #[default]
    Chamfer,
    /// A quarter of a circle, flat at the top.
    Round,
    /// Flat at the top and at the foot.
    Smooth,
}

impl BevelProfile {
    /// Height at a fraction of the bevel, 0..1.
    #[inline]
    pub fn at(self, t: f64) -> f64 {
        let t = t.clamp(0.0, 1.0);
        match self {
            Self::Chamfer => t,
            Self::Round => (t * (2.0 - t)).sqrt(),
            Self::Smooth => t * t * (3.0 - 2.0 * t),
        }
    }
}

/// The edges of pieces, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    /// The gap between pieces.
    pub gap: f64,
    /// Width of the bevel.
    pub bevel: f64,
    /// The cross-section of the bevel.
    pub profile: BevelProfile,
    /// Radius of the corners of rectangles.
    pub radius: f64,
}

/// The output plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FinishPlane {
    /// The bevel minus 1, times this depth in mm.
    Height(f32),
    /// 0 in the gap, 1 on the piece, and the profile in between.
    Bevel,
    /// 1 in the gap.
    Gap,
    /// Ids of pieces.
    Ids,
    /// Angle of the long side in degrees.
    Angle,
}

impl Finish {
    /// mm inside the edge of a piece, negative in the gap.
    #[inline]
    pub fn inside(&self, piece: &LaidPiece) -> f64 {
        let q = DVec2::from(piece.edges.map(|e| self.radius + 0.5 * self.gap - e));
        self.radius - q.max(DVec2::ZERO).length() - q.max_element().min(0.0)
    }

    #[inline]
    fn bevel(&self, inside: f64, pixel: f64) -> f64 {
        let width = self.bevel.max(pixel);
        self.profile.at((inside + 0.5 * (width - self.bevel)) / width)
    }
}

/// The angle of a direction in degrees, -180..180.
pub fn degrees(direction: DVec2) -> f64 {
    let angle = libm::atan2(direction.y, direction.x).to_degrees();
    // Makes right angles exact.
    if (angle - angle.round()).abs() < 1e-9 { angle.round() } else { angle }
}

/// Visits the pixels of a window with the piece at each.
#[inline(always)]
fn each(grid: &Grid, frame: &Frame, mut visit: impl FnMut(usize, DVec2, &LaidPiece)) {
    let rect = frame.window;
    let mut k = 0;
    // The piece found last, and the corner of its unit square.
    let mut known: Option<(DVec2, LaidPiece)> = None;
    for (_, y) in (0..rect.rows()).zip(rect.y..) {
        for (_, x) in (0..rect.columns()).zip(rect.x..) {
            let at = grid.fit.to_unit * DVec2::from(frame.center(x, y));
            let inside = |corner: DVec2| at.cmpge(corner).all() && at.cmplt(corner + 1.0).all();
            let again = known.filter(|(corner, _)| inside(*corner)).and_then(|(_, piece)| grid.piece_again(at, &piece));
            let piece = again.unwrap_or_else(|| {
                let piece = grid.piece(at);
                known = Some((at.floor(), piece));
                piece
            });
            visit(k, at, &piece);
            k += 1;
        }
    }
}

/// Fills a window. O(pixels).
pub fn fill(grid: &Grid, finish: &Finish, plane: FinishPlane, frame: &Frame, out: &mut [f32]) {
    let pixel = (frame.step[0] * frame.step[1]).sqrt();
    let angles = grid.directions.map(|d| narrow(degrees(d)));
    match plane {
        FinishPlane::Height(depth) => each(grid, frame, |k, _, piece| {
            out[k] = depth * narrow(finish.bevel(finish.inside(piece), pixel) - 1.0);
        }),
        FinishPlane::Bevel => each(grid, frame, |k, _, piece| {
            out[k] = narrow(finish.bevel(finish.inside(piece), pixel));
        }),
        FinishPlane::Gap => each(grid, frame, |k, _, piece| {
            out[k] = narrow((0.5 - finish.inside(piece) / pixel).clamp(0.0, 1.0));
        }),
        FinishPlane::Ids => {
            let mut known = None;
            each(grid, frame, |k, _, piece| {
                let key = (piece.cell, piece.number);
                out[k] = match known {
                    Some((same, number)) if same == key => number,
                    _ => known.insert((key, id(grid.fit.id(piece.cell, piece.number)))).1,
                };
            });
        }
        FinishPlane::Angle => each(grid, frame, |k, _, piece| out[k] = angles[piece.direction]),
    }
}

/// An id below 2^24 as fields store it.
#[inline]
pub fn id(number: u32) -> f32 {
    number as f32
}

/// Fills a window with coordinates within pieces: mm from the middle, along the long side and across it.
pub fn local(grid: &Grid, frame: &Frame, [along, across]: [&mut [f32]; 2]) {
    each(grid, frame, |k, at, piece| {
        let away = grid.fit.from_unit * (at - piece.center);
        let direction = grid.directions[piece.direction];
        along[k] = narrow(direction.dot(away));
        across[k] = narrow(direction.perp_dot(away));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::layout::{Layout, PieceSpec};
    use shibo_value::Tiling;
    use shibo_value::Window;

    fn bricks(angle: f64) -> Grid {
        let pieces =
            PieceSpec { layout: Layout::Stack, size: DVec2::new(9.0, 4.0), gap: 1.0, stagger: 0.0, slant: 1.0 };
        pieces.lay(angle.to_radians().sin_cos(), (DVec2::splat(40.0), Tiling::BOTH)).unwrap()
    }

    #[test]
    fn gaps_and_bevels_are_where_they_should_be() {
        let finish = Finish { gap: 1.0, bevel: 2.0, profile: BevelProfile::Chamfer, radius: 0.0 };
        // Pixels of 0.1 mm along the middle of a brick, starting at its border: centres at 0.05, 0.15 …
        let frame = Frame::new(Window::of(0, 24, 50, 1), [0.1, 0.1]);
        let (mut gap, mut height) = ([0.0; 50], [0.0; 50]);
        fill(&bricks(0.0), &finish, FinishPlane::Gap, &frame, &mut gap);
        fill(&bricks(0.0), &finish, FinishPlane::Height(3.0), &frame, &mut height);
        for k in 0..50 {
            let x = 0.05 + 0.1 * f64::from(u8::try_from(k).unwrap());
            let want = (0.5 - (x - 0.5) / 0.1).clamp(0.0, 1.0);
            assert!((f64::from(gap[k]) - want).abs() < 1e-5, "{x}");
            // y is 2.45 mm, which is 1.95 mm inside the piece, so the bevel of the long side is not quite complete
            // there.
            let want = 3.0 * (((x - 0.5) / 2.0).clamp(0.0, 1.0).min(0.975) - 1.0);
            assert!((f64::from(height[k]) - want).abs() < 1e-5, "{x} {} {want}", height[k]);
        }
    }

    #[test]
    fn reused_pieces_equal_looked_up_pieces() {
        for layout in [Layout::Stack, Layout::Herringbone, Layout::Running, Layout::Versailles] {
            let pieces = PieceSpec { layout, size: DVec2::new(9.0, 4.0), gap: 1.0, stagger: 0.3, slant: 1.0 };
            let grid = pieces.lay(33_f64.to_radians().sin_cos(), (DVec2::splat(40.0), Tiling::BOTH)).unwrap();
            let frame = Frame::new(Window::of(-20, -9, 150, 90), [0.3, 0.3]);
            each(&grid, &frame, |k, at, piece| assert_eq!(*piece, grid.piece(at), "{layout:?} {k}"));
        }
    }

    #[test]
    fn corners_are_round() {
        let finish = Finish { gap: 0.0, bevel: 0.0, profile: BevelProfile::Round, radius: 1.0 };
        let piece =
            |x: f64, y: f64| LaidPiece { cell: [0, 0], number: 0, center: DVec2::ZERO, direction: 0, edges: [x, y] };
        assert!((finish.inside(&piece(0.0, 0.0)) - (1.0 - 2f64.sqrt())).abs() < 1e-12);
        assert!((finish.inside(&piece(0.5, 3.0)) - 0.5).abs() < 1e-12);
        assert!((finish.inside(&piece(2.0, 3.0)) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn measures_coordinates_from_the_middle_along_the_long_side() {
        for angle in [0.0, 90.0, -90.0] {
            let grid = bricks(angle);
            let frame = Frame::new(Window::of(0, 0, 40, 40), [1.0, 1.0]);
            let (mut x, mut y) = (vec![0.0; 1600], vec![0.0; 1600]);
            local(&grid, &frame, [&mut x, &mut y]);
            let most = |v: &[f32]| v.iter().copied().fold(0.0, f32::max);
            assert_eq!((most(&x), most(&y)), (4.5, 2.0), "{angle}");
            let mut angles = vec![0.0; 1600];
            fill(
                &grid,
                &Finish { gap: 1.0, bevel: 0.0, profile: BevelProfile::Chamfer, radius: 0.0 },
                FinishPlane::Angle,
                &frame,
                &mut angles,
            );
            assert!(angles.iter().all(|a| f64::from(*a) == angle));
            // One pixel along the long side is one mm of the coordinate, and never mirrored.
            let along = |k: usize| DVec2::new(f64::from(x[k]), f64::from(y[k]));
            let turn = DVec2::from_angle(angle.to_radians());
            let (right, down) = (along(41 + 1) - along(41), along(41 + 40) - along(41));
            if right.length() < 1.5 && down.length() < 1.5 {
                assert!((right - DVec2::new(turn.x, -turn.y)).length() < 1e-6, "{right}");
                assert!((down - DVec2::new(turn.y, turn.x)).length() < 1e-6, "{down}");
            }
        }
    }
}
