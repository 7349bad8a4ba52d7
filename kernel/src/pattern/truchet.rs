//! Truchet tiles: squares with the same motif, turned at random.
//!
//! Source: S. Truchet, "Mémoire sur les combinaisons" (1704); the arcs are those of C. S. Smith, "The tiling patterns
//! of Sebastian Truchet" (1987).
use super::finish::{BevelProfile, degrees, id};
use super::fit::{Fit, Wanted};
use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use crate::ground::window::{Frame, WindowExt as _};
use glam::DVec2;
use shibo_macros::choice;
use shibo_value::Tiling;

/// The motif of a tile.
#[choice]
pub enum Motif {
    /// Two quarters of a circle about opposite corners, through the middles of the sides.
    #[default]
    Arcs,
    /// Two straight lines from middle to middle, across the same corners.
    Lines,
    /// One half, cut along a diagonal. It has no bands, so `width` has no effect.
    Triangles,
}

/// Tiles on the canvas.
#[derive(Clone, Debug)]
pub struct Tiles {
    motif: Motif,
    /// Half the width of the bands, mm.
    half_width: f64,
    profile: BevelProfile,
    /// Height of the bands, mm.
    height: f64,
    hash: Hash,
    /// The fit with tiles as units.
    pub fit: Fit,
    directions: [DVec2; 4],
}

/// The output plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TruchetPlane {
    /// Height, mm.
    Height,
    /// 1 on the bands.
    Mask,
    /// Distance to the edge of the bands, mm; negative inside.
    Distance,
    /// Ids of tiles.
    Ids,
    /// The turn of the tile, degrees.
    Angle,
}

impl Tiles {
    /// Tiles of `size` mm with bands of `width` mm; `None` if there are too many.
    pub fn new(
        motif: Motif,
        [size, width, height]: [f64; 3],
        profile: BevelProfile,
        turn: (f64, f64),
        canvas: (DVec2, Tiling),
        hash: Hash,
    ) -> Option<Self> {
        let wanted = Wanted { units: DVec2::splat(size), basis: [DVec2::X, DVec2::Y], turn, pieces: 1 };
        let fit = Fit::new(&wanted, canvas)?;
        let directions = [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y].map(|d| fit.direction(d));
        Some(Self { motif, half_width: 0.5 * width, profile, height, hash, fit, directions })
    }

    /// Id of the tile at a point, its number of quarter turns, and the position of the point in it, -½..½.
    fn tile(&self, p: DVec2) -> (u32, usize, DVec2) {
        let cell = p.floor();
        #[expect(clippy::cast_possible_truncation, reason = "far fewer tiles than 2^63")]
        let number = self.fit.id([cell.x as i64, cell.y as i64], 0);
        let quarters = usize::from(self.hash.u64(u64::from(number)).to_le_bytes()[7] >> 6);
        (number, quarters, p - cell - 0.5)
    }

    /// Undoes a number of quarter turns.
    fn back(quarters: usize, q: DVec2) -> DVec2 {
        match quarters {
            0 => q,
            1 => DVec2::new(q.y, -q.x),
            2 => -q,
            _ => DVec2::new(-q.y, q.x),
        }
    }

    /// Distance to the edge of the bands, mm; negative inside.
    fn distance(&self, p: DVec2) -> f64 {
        let (_, quarters, q) = self.tile(p);
        let q = Self::back(quarters, q);
        let unit = self.fit.units().min_element();
        match self.motif {
            Motif::Arcs => {
                let from = |corner: DVec2| ((q - corner).length() - 0.5).abs();
                from(DVec2::splat(-0.5)).min(from(DVec2::splat(0.5))) * unit - self.half_width
            }
            Motif::Lines => {
                let sum = (q.x + q.y).abs();
                (sum - 0.5).abs() * std::f64::consts::FRAC_1_SQRT_2 * unit - self.half_width
            }
            Motif::Triangles => {
                // For triangles the distance to the diagonal. The sides do not count, because the figure may continue
                // beyond them.
                (q.x + q.y) * std::f64::consts::FRAC_1_SQRT_2 * unit
            }
        }
    }

    /// Fills a window. O(pixels).
    pub fn fill(&self, plane: TruchetPlane, frame: &Frame, out: &mut [f32]) {
        let rect = frame.window;
        let pixel = (frame.step[0] * frame.step[1]).sqrt();
        let mut out = out.iter_mut();
        for (_, y) in (0..rect.rows()).zip(rect.y..) {
            for ((_, x), out) in (0..rect.columns()).zip(rect.x..).zip(&mut out) {
                let p = self.fit.to_unit * DVec2::from(frame.center(x, y));
                *out = match plane {
                    TruchetPlane::Height => {
                        let rise = if self.motif == Motif::Triangles { pixel } else { self.half_width.max(pixel) };
                        narrow(self.height * self.profile.at(-self.distance(p) / rise))
                    }
                    TruchetPlane::Mask => narrow((0.5 - self.distance(p) / pixel).clamp(0.0, 1.0)),
                    TruchetPlane::Distance => narrow(self.distance(p)),
                    TruchetPlane::Ids => id(self.tile(p).0),
                    TruchetPlane::Angle => narrow(degrees(self.directions[self.tile(p).1])),
                };
            }
        }
    }

    /// Fills a window with coordinates within tiles: mm from the middle, turned with the tile.
    pub fn local(&self, frame: &Frame, [along, across]: [&mut [f32]; 2]) {
        let rect = frame.window;
        let mut k = 0;
        for (_, y) in (0..rect.rows()).zip(rect.y..) {
            for (_, x) in (0..rect.columns()).zip(rect.x..) {
                let p = self.fit.to_unit * DVec2::from(frame.center(x, y));
                let (_, quarters, q) = self.tile(p);
                let (away, direction) = (self.fit.from_unit * q, self.directions[quarters]);
                along[k] = narrow(direction.dot(away));
                across[k] = narrow(direction.perp_dot(away));
                k += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::Window;

    fn tiles(motif: Motif) -> Tiles {
        let canvas = (DVec2::splat(40.0), Tiling::BOTH);
        Tiles::new(motif, [5.0, 1.0, 1.0], BevelProfile::Round, (0.0, 1.0), canvas, Hash::new(3)).unwrap()
    }

    #[test]
    fn bands_continue_across_the_sides() {
        for motif in [Motif::Arcs, Motif::Lines] {
            let tiles = tiles(motif);
            for k in 0..64 {
                let (i, j) = (f64::from(k % 8), f64::from(k / 8));
                for t in [0.1, 0.45, 0.5, 0.55, 0.9] {
                    let (left, right) = (DVec2::new(i + 1.0 - 1e-9, j + t), DVec2::new(i + 1.0 + 1e-9, j + t));
                    let near = (t - 0.5f64).abs() * 5.0;
                    for side in [left, right] {
                        // On a side, the only band is in the middle.
                        let d = tiles.distance(side) + 0.5;
                        let want = if motif == Motif::Arcs { near } else { near * 0.5f64.sqrt() };
                        assert!((d - want).abs() < 1e-6, "{motif:?} {side}: {d} {want}");
                    }
                }
            }
        }
    }

    #[test]
    fn all_turns_occur_and_repeat() {
        let tiles = tiles(Motif::Triangles);
        let frame = Frame::new(Window::of(-16, -16, 32, 32), [2.5, 2.5]);
        let [mut angle, mut x, mut y] = [(); 3].map(|()| vec![0.0; 1024]);
        tiles.fill(TruchetPlane::Angle, &frame, &mut angle);
        tiles.local(&frame, [&mut x, &mut y]);
        for turn in [0.0, 90.0, 180.0, -90.0] {
            assert!(angle.iter().filter(|a| (**a - turn).abs() < 1e-4 || (**a + turn).abs() > 359.0).count() > 60);
        }
        for k in 0..512 {
            assert_eq!(angle[k], angle[k + 512], "16 rows of 2.5 mm further down");
        }
        assert!(x.iter().chain(&y).all(|v| v.abs() == 1.25));
    }
}
