//! Layouts of pieces: the piece at a point, and the distances to its edges.
use super::fit::{Fit, Wanted};
use glam::DVec2;
use shibo_macros::choice;

/// The arrangement of pieces.
#[choice]
pub enum Layout {
    /// Rows, every second one shifted by `stagger`.
    #[default]
    Running,
    /// Rows and columns.
    Stack,
    /// Pieces at right angles, with each end at the side of another piece. The length must be a whole number of widths.
    Herringbone,
    /// Squares of parallel pieces, alternately turned. The length must be a whole number of widths.
    BasketWeave,
    /// Columns of slanted pieces that meet in points.
    Chevron,
    /// Hexagons with corners of 120°; regular where the length is 1.1547 times the width.
    Hexagonal,
    /// Four sizes in groups of twelve pieces, without crosses; `size` is that of the largest, three modules by two.
    Versailles,
}

/// Sizes of pieces in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceSpec {
    /// The arrangement.
    pub layout: Layout,
    /// Length and width.
    pub size: DVec2,
    /// The gap between pieces.
    pub gap: f64,
    /// Shift of every second row of `Running`, as a fraction of the pitch.
    pub stagger: f64,
    /// The tangent of the slant of `Chevron` pieces.
    pub slant: f64,
}

/// A piece, as seen from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaidPiece {
    /// The lattice cell that it belongs to.
    pub cell: [i64; 2],
    /// Its index within the cell.
    pub number: u32,
    /// Its middle in units.
    pub center: DVec2,
    /// Index of its long side's direction in [`Grid::directions`].
    pub direction: usize,
    /// Distances in mm to the middle of the gap at its ends and at its sides; the least of all for pieces that are not
    /// rectangles.
    pub edges: [f64; 2],
}

/// A layout on the canvas.
#[derive(Clone, Debug)]
pub struct Grid {
    rule: Rule,
    /// The units.
    pub fit: Fit,
    /// Directions of long sides: unit vectors on the canvas.
    pub directions: [DVec2; 2],
    /// Distances in mm between lines of equal u and of equal v.
    pitch: [f64; 2],
    /// The same for the falling and the rising slanted sides.
    slanted: [f64; 2],
}

/// A layout in units.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    Running(f64),
    Stack,
    /// Number of widths in a length.
    Herringbone(i64),
    BasketWeave(i64),
    /// The rise of a piece.
    Chevron(f64),
    /// Shift of the sloping sides from the middle row to the next, and their position in the middle row.
    Hexagonal(f64, f64),
    Versailles,
}

/// Column, row, width and height of the pieces of a group of 6 × 6 modules.
const VERSAILLES: [[i64; 4]; 12] = [
    [0, 0, 1, 2],
    [1, 0, 2, 3],
    [3, 0, 1, 1],
    [4, 4, 2, 3],
    [3, 1, 2, 2],
    [5, 1, 1, 1],
    [5, 2, 2, 2],
    [1, 3, 1, 1],
    [2, 3, 2, 2],
    [4, 3, 1, 1],
    [0, 4, 2, 2],
    [2, 5, 2, 1],
];

impl PieceSpec {
    /// Number of widths in a length, for layouts that need a whole number.
    pub fn ratio(&self) -> i64 {
        #[expect(clippy::cast_possible_truncation, reason = "limited before")]
        let ratio = ((self.size.x + self.gap) / (self.size.y + self.gap)).round().clamp(1.0, 64.0) as i64;
        ratio
    }

    /// Depth of the points of hexagons including the gap, mm.
    fn point(&self) -> f64 {
        (self.size.y + self.gap) * 0.5 / 3f64.sqrt()
    }

    fn rule(&self) -> (Rule, Wanted) {
        let pitch = self.size + self.gap;
        let square = |ratio: i64| DVec2::new(pitch.x / ratio as f64, pitch.y);
        let (rule, units, basis, pieces) = match self.layout {
            Layout::Running if self.stagger > 0.0 && self.stagger < 1.0 => {
                (Rule::Running(self.stagger), pitch, [[1.0, 0.0], [0.0, 2.0]], 2)
            }
            Layout::Running | Layout::Stack => (Rule::Stack, pitch, [[1.0, 0.0], [0.0, 1.0]], 1),
            Layout::Herringbone => {
                let k = self.ratio();
                let unit = DVec2::splat((square(k).x + pitch.y) * 0.5);
                (Rule::Herringbone(k), unit, [[2.0 * k as f64, 0.0], [1.0, 1.0]], 2)
            }
            Layout::BasketWeave => {
                let k = self.ratio();
                let (unit, side) = (DVec2::splat((square(k).x + pitch.y) * 0.5), k as f64);
                let pieces = u32::try_from(2 * k).unwrap_or(2);
                (Rule::BasketWeave(k), unit, [[2.0 * side, 0.0], [side, side]], pieces)
            }
            Layout::Chevron => {
                let cos = 1.0 / (1.0 + self.slant * self.slant).sqrt();
                let units = DVec2::new(pitch.x * cos, pitch.y / cos);
                (Rule::Chevron(self.slant * units.x / units.y), units, [[2.0, 0.0], [0.0, 1.0]], 2)
            }
            Layout::Hexagonal => {
                let (point, length) = (self.point(), self.size.x + self.gap * 2.0 / 3f64.sqrt());
                let units = DVec2::new(length - point, pitch.y);
                let rule = Rule::Hexagonal(2.0 * point / units.x, 0.5 * length / units.x);
                (rule, units, [[1.0, 0.5], [0.0, 1.0]], 1)
            }
            Layout::Versailles => (Rule::Versailles, pitch / DVec2::new(3.0, 2.0), [[6.0, 0.0], [0.0, 6.0]], 12),
        };
        (rule, Wanted { units, basis: basis.map(DVec2::from), turn: (0.0, 1.0), pieces })
    }

    /// Layout on a canvas, turned by an angle with this sine and cosine; `None` if it has too many pieces.
    pub fn lay(&self, turn: (f64, f64), canvas: (DVec2, shibo_value::Tiling)) -> Option<Grid> {
        let (rule, wanted) = self.rule();
        let fit = Fit::new(&Wanted { turn, ..wanted }, canvas)?;
        let (directions, slope) = match rule {
            Rule::Chevron(rise) => ([DVec2::new(1.0, rise), DVec2::new(1.0, -rise)], rise),
            Rule::Hexagonal(slope, _) => ([DVec2::X, DVec2::Y], slope),
            _ => ([DVec2::X, DVec2::Y], 0.0),
        };
        let slanted = match rule {
            Rule::Hexagonal(..) => [DVec2::new(1.0, slope), DVec2::new(1.0, -slope)],
            _ => [DVec2::new(-slope, 1.0), DVec2::new(slope, 1.0)],
        };
        Some(Grid {
            rule,
            fit,
            directions: directions.map(|d| fit.direction(d)),
            pitch: [DVec2::X, DVec2::Y].map(|g| fit.spacing(g)),
            slanted: slanted.map(|g| fit.spacing(g)),
        })
    }

    /// The actual length and width of pieces on the canvas.
    pub fn laid(&self, grid: &Grid) -> DVec2 {
        let units = grid.fit.units();
        match grid.rule {
            Rule::Running(_) | Rule::Stack => units - self.gap,
            Rule::Herringbone(k) | Rule::BasketWeave(k) => units * DVec2::new(k as f64, 1.0) - self.gap,
            Rule::Chevron(rise) => {
                let length = (grid.fit.from_unit * DVec2::new(1.0, rise)).length();
                DVec2::new(length, grid.slanted[0]) - self.gap
            }
            Rule::Hexagonal(_, middle) => {
                DVec2::new(units.x * 2.0 * middle - self.gap * 2.0 / 3f64.sqrt(), grid.pitch[1] - self.gap)
            }
            Rule::Versailles => units * DVec2::new(3.0, 2.0) - self.gap,
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "far fewer units than 2^63")]
fn floor(x: f64) -> i64 {
    x.floor() as i64
}

impl Grid {
    /// The piece at a point given in units.
    #[inline]
    pub fn piece(&self, p: DVec2) -> LaidPiece {
        match self.rule {
            Rule::Stack => {
                let (i, j) = (floor(p.x), floor(p.y));
                self.rectangle(p, [i, j], 0, DVec2::new(i as f64, j as f64), DVec2::ONE)
            }
            Rule::Running(stagger) => {
                let j = floor(p.y);
                let shift = if j.rem_euclid(2) == 1 { stagger } else { 0.0 };
                let i = floor(p.x - shift);
                let corner = DVec2::new(i as f64 + shift, j as f64);
                self.rectangle(p, [i, j.div_euclid(2)], u32::from(j.rem_euclid(2) == 1), corner, DVec2::ONE)
            }
            Rule::Herringbone(k) => {
                let (i, j) = (floor(p.x), floor(p.y));
                let c = (i - j).rem_euclid(2 * k);
                let (corner, number, size) = if c < k {
                    ([i - c, j], 0, DVec2::new(k as f64, 1.0))
                } else {
                    ([i, j - (2 * k - 1 - c)], 1, DVec2::new(1.0, k as f64))
                };
                let cell = [(corner[0] - corner[1]).div_euclid(2 * k), corner[1]];
                self.rectangle(p, cell, number, DVec2::new(corner[0] as f64, corner[1] as f64), size)
            }
            Rule::BasketWeave(k) => self.basket(p, k),
            Rule::Chevron(rise) => self.chevron(p, rise),
            Rule::Hexagonal(slope, middle) => self.hexagon(p, slope, middle),
            Rule::Versailles => self.versailles(p),
        }
    }

    /// The piece at a point in the same unit square as the point of `before`, for layouts in which a unit square lies
    /// in one piece.
    #[inline]
    pub fn piece_again(&self, p: DVec2, before: &LaidPiece) -> Option<LaidPiece> {
        let size = match self.rule {
            Rule::Stack => DVec2::ONE,
            Rule::Herringbone(k) if before.direction == 0 => DVec2::new(k as f64, 1.0),
            Rule::Herringbone(k) => DVec2::new(1.0, k as f64),
            _ => return None,
        };
        let inside = 0.5 * size - (p - before.center).abs();
        Some(LaidPiece { edges: [inside.x * self.pitch[0], inside.y * self.pitch[1]], ..*before })
    }

    #[inline]
    fn rectangle(&self, p: DVec2, cell: [i64; 2], number: u32, corner: DVec2, size: DVec2) -> LaidPiece {
        let center = corner + 0.5 * size;
        let inside = 0.5 * size - (p - center).abs();
        let upright = size.y > size.x;
        let edges = [inside.x * self.pitch[0], inside.y * self.pitch[1]];
        LaidPiece { cell, number, center, direction: usize::from(upright), edges }
    }

    fn basket(&self, p: DVec2, k: i64) -> LaidPiece {
        let side = k as f64;
        let (bi, bj) = (floor(p.x / side), floor(p.y / side));
        let odd = (bi + bj).rem_euclid(2) == 1;
        let cell = [(bi - bj).div_euclid(2), bj];
        let (corner, row, size) = if odd {
            let i = floor(p.x);
            ([i, bj * k], i - bi * k, DVec2::new(1.0, side))
        } else {
            let j = floor(p.y);
            ([bi * k, j], j - bj * k, DVec2::new(side, 1.0))
        };
        let number = u32::try_from(if odd { k + row } else { row }).unwrap_or(0);
        self.rectangle(p, cell, number, DVec2::new(corner[0] as f64, corner[1] as f64), size)
    }

    fn chevron(&self, p: DVec2, rise: f64) -> LaidPiece {
        let i = floor(p.x);
        let f = p.x - i as f64;
        let odd = i.rem_euclid(2) == 1;
        let v = p.y - rise * if odd { 1.0 - f } else { f };
        let j = floor(v);
        let (ends, sides) = (0.5 - (f - 0.5).abs(), 0.5 - (v - j as f64 - 0.5).abs());
        LaidPiece {
            cell: [i.div_euclid(2), j],
            number: u32::from(odd),
            center: DVec2::new(i as f64 + 0.5, j as f64 + 0.5 + 0.5 * rise),
            direction: usize::from(odd),
            edges: [ends * self.pitch[0], sides * self.slanted[usize::from(odd)]],
        }
    }

    fn hexagon(&self, p: DVec2, slope: f64, middle: f64) -> LaidPiece {
        let first = floor(p.x);
        let in_column = |i: i64| {
            let j = floor(p.y - 0.5 * i as f64 + 0.5);
            let center = DVec2::new(i as f64, 0.5 * i as f64 + j as f64);
            let d = p - center;
            let level = (0.5 - d.y.abs()) * self.pitch[1];
            let falls = (middle - (d.x + slope * d.y).abs()) * self.slanted[0];
            let rises = (middle - (d.x - slope * d.y).abs()) * self.slanted[1];
            let edge = level.min(falls).min(rises);
            LaidPiece { cell: [i, j], number: 0, center, direction: 0, edges: [edge; 2] }
        };
        let (a, b) = (in_column(first), in_column(first + 1));
        if b.edges[0] > a.edges[0] { b } else { a }
    }

    fn versailles(&self, p: DVec2) -> LaidPiece {
        let (i, j) = (floor(p.x), floor(p.y));
        for (number, [x, y, w, h]) in (0u32..).zip(VERSAILLES) {
            let (dx, dy) = ((i - x).rem_euclid(6), (j - y).rem_euclid(6));
            if dx < w && dy < h {
                let corner = [i - dx, j - dy];
                let cell = corner.map(|c| c.div_euclid(6));
                let corner = DVec2::new(corner[0] as f64, corner[1] as f64);
                return self.rectangle(p, cell, number, corner, DVec2::new(w as f64, h as f64));
            }
        }
        unreachable!("the pieces cover a group")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::Tiling;
    use std::collections::BTreeMap;

    const ALL: [Layout; 7] = [
        Layout::Running,
        Layout::Stack,
        Layout::Herringbone,
        Layout::BasketWeave,
        Layout::Chevron,
        Layout::Hexagonal,
        Layout::Versailles,
    ];

    fn pieces(layout: Layout) -> PieceSpec {
        PieceSpec { layout, size: DVec2::new(5.5, 2.5), gap: 0.5, stagger: 0.5, slant: 1.0 }
    }

    /// Samples a canvas of 36 × 36 mm: the number of points in each piece, and its middle on the canvas.
    fn areas(grid: &Grid, steps: u32) -> BTreeMap<u32, (u32, DVec2)> {
        let mut found = BTreeMap::new();
        for k in 0..steps * steps {
            let at = (DVec2::new(f64::from(k % steps), f64::from(k / steps)) + 0.5) * 36.0 / f64::from(steps);
            let piece = grid.piece(grid.fit.to_unit * at);
            assert!(piece.edges[0] > -1e-9 && piece.edges[1] > -1e-9, "{piece:?} at {at}");
            let middle = (grid.fit.from_unit * piece.center).rem_euclid(DVec2::splat(36.0));
            let entry = found.entry(grid.fit.id(piece.cell, piece.number)).or_insert((0, middle));
            entry.0 += 1;
            let apart = (middle - entry.1 + 54.0).rem_euclid(DVec2::splat(36.0)) - 18.0;
            assert!(apart.length() < 1e-6, "two pieces have one number: {piece:?}");
        }
        found
    }

    #[test]
    fn pieces_partition_the_canvas_at_any_angle() {
        for layout in ALL {
            for angle in [0.0f64, 45.0, 90.0, 20.0] {
                let of = pieces(layout);
                let grid = of.lay(angle.to_radians().sin_cos(), (DVec2::splat(36.0), Tiling::BOTH)).unwrap();
                let found = areas(&grid, 360);
                let ids: Vec<u32> = found.keys().copied().collect();
                assert_eq!(ids, (1..=u32::try_from(ids.len()).unwrap()).collect::<Vec<_>>(), "{layout:?} {angle}");
                if layout == Layout::Versailles {
                    continue;
                }
                let share = 360.0 * 360.0 / found.len() as f64;
                let even = found.values().all(|(n, _)| (f64::from(*n) - share).abs() < 0.12 * share);
                assert!(even, "{layout:?} {angle}: {share} {:?}", found.values().map(|f| f.0).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn counts_and_sizes_are_those_of_the_canvas() {
        // Pitches of 6 × 3 mm on 36 mm: 6 × 12 pieces.
        for (layout, count) in [
            (Layout::Running, 72),
            (Layout::Stack, 72),
            (Layout::Herringbone, 72),
            (Layout::BasketWeave, 72),
            // Modules of 1.5 mm (from size (4, 2.5)) fit 24 times: 4 × 4 groups.
            (Layout::Versailles, 192),
        ] {
            let size = if layout == Layout::Versailles { DVec2::new(4.0, 2.5) } else { DVec2::new(5.5, 2.5) };
            let of = PieceSpec { size, ..pieces(layout) };
            let grid = of.lay((0.0, 1.0), (DVec2::splat(36.0), Tiling::BOTH)).unwrap();
            assert_eq!(areas(&grid, 360).len(), count, "{layout:?}");
            assert!((of.laid(&grid) - size).length() < 1e-9, "{layout:?}");
        }
        let mut sizes = [0; 7];
        VERSAILLES.iter().for_each(|[_, _, w, h]| sizes[usize::try_from(w * h).unwrap()] += 1);
        assert_eq!(sizes, [0, 4, 2, 0, 4, 0, 2]);
    }

    #[test]
    fn edges_are_measured_in_mm() {
        let none = (DVec2::splat(36.0), Tiling::NONE);
        let grid = pieces(Layout::Running).lay((0.0, 1.0), none).unwrap();
        // The second row is shifted by 3 mm: its piece goes from 3 to 9, and from 3 to 6.
        let piece = grid.piece(grid.fit.to_unit * DVec2::new(4.0, 5.2));
        assert!((piece.edges[0] - 1.0).abs() < 1e-9 && (piece.edges[1] - 0.8).abs() < 1e-9, "{piece:?}");
        assert!((grid.fit.from_unit * piece.center - DVec2::new(6.0, 4.5)).length() < 1e-9);
        // Chevron at 45°: the long side goes down to the right, and the width across is 3 mm.
        let grid = pieces(Layout::Chevron).lay((0.0, 1.0), none).unwrap();
        let piece = grid.piece(grid.fit.to_unit * DVec2::new(1.0, 1.0 + 1e-9));
        assert!(piece.edges[1].abs() < 1e-6 && (grid.directions[0] - DVec2::splat(0.5f64.sqrt())).length() < 1e-9);
        let piece = grid.piece(grid.fit.to_unit * DVec2::new(1.0, 1.0 + 1.5 * 2f64.sqrt()));
        assert!((piece.edges[1] - 1.5).abs() < 1e-6, "{piece:?}");
        // A regular hexagon, 3 mm across including its gap: 1.5 mm to every side.
        let regular = PieceSpec { size: DVec2::new(2.5 * 2.0 / 3f64.sqrt(), 2.5), ..pieces(Layout::Hexagonal) };
        let grid = regular.lay((0.0, 1.0), none).unwrap();
        for angle in [30.0f64, 90.0, 150.0, 210.0, 330.0] {
            let at = DVec2::from_angle(angle.to_radians()) * 1.2;
            assert!((grid.piece(grid.fit.to_unit * at).edges[0] - 0.3).abs() < 1e-9, "{angle}");
        }
        assert!((grid.piece(DVec2::ZERO).edges[0] - 1.5).abs() < 1e-9);
    }
}
