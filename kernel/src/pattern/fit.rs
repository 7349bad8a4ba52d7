//! Fits the lattice of a pattern to the canvas.
//!
//! The pattern is given by the size of its units in mm and an angle. On a canvas that tiles, the sides of the canvas
//! must be lattice vectors of the pattern: among all pairs near the given ones, the pair is chosen that changes sizes
//! and angles least. Lengths in mm are measured on the canvas afterwards, so gaps keep their width. Where the canvas
//! does not tile, units are exact; where it tiles in one direction only, a side of a thousand units replaces the other
//! side.
use glam::{DMat2, DVec2};
use shibo_value::Tiling;

/// The wanted pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Size of a unit in mm along the pattern's axes.
    pub units: DVec2,
    /// Two lattice vectors in units; the turn from the first to the second is like that from u to v.
    pub basis: [DVec2; 2],
    /// Sine and cosine of the angle, from +x towards +y.
    pub turn: (f64, f64),
    /// Number of pieces in a cell of the lattice.
    pub pieces: u32,
}

/// A pattern's units on the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// From mm to units.
    pub to_unit: DMat2,
    /// From units to mm.
    pub from_unit: DMat2,
    names: Names,
    pieces: u32,
}

/// Largest id of a piece.
pub const MOST_PIECES: f64 = 16_777_215.0;

impl Fit {
    /// Lays a pattern on a canvas of `size` mm; `None` if it has more pieces than there are ids.
    pub fn new(wanted: &Wanted, (size, tiling): (DVec2, Tiling)) -> Option<Self> {
        let (sin, cos) = wanted.turn;
        let back = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
        let to_unit = DMat2::from_diagonal(1.0 / wanted.units) * back;
        let pieces = wanted.pieces.max(1);
        if tiling == Tiling::NONE {
            // Pieces at this distance have the same id.
            let side = (MOST_PIECES / f64::from(pieces)).sqrt().floor();
            let names = Names { across: whole(side), skew: 0, down: whole(side) };
            return Some(Self { to_unit, from_unit: to_unit.inverse(), names, pieces });
        }
        let basis = DMat2::from_cols(wanted.basis[0], wanted.basis[1]);
        let long = 1024.0 * wanted.units.max_element();
        let side = |size: f64, tiles: bool| if tiles { size } else { (2.0 * size).max(long) };
        let sides = DMat2::from_diagonal(DVec2::new(side(size.x, tiling.x), side(size.y, tiling.y)));
        let real = basis.inverse() * to_unit * sides;
        let needed = real.determinant().abs() * f64::from(pieces);
        if needed.is_nan() || needed > 1.5 * MOST_PIECES {
            return None;
        }
        let lattice = nearest(real, |whole| {
            // The map from mm of the fitted pattern to mm of the wanted one.
            let change = to_unit.inverse() * basis * whole * sides.inverse();
            distortion(change) + distortion(change.inverse())
        })?;
        let to_unit = basis * lattice * sides.inverse();
        if lattice.determinant().abs() * f64::from(pieces) > MOST_PIECES {
            return None;
        }
        Some(Self { to_unit, from_unit: to_unit.inverse(), names: Names::new(lattice), pieces })
    }

    /// Id of a piece, from 1: the same for all its copies on the canvas.
    pub fn id(&self, cell: [i64; 2], piece: u32) -> u32 {
        let number = self.names.number(cell) * i64::from(self.pieces) + i64::from(piece) + 1;
        u32::try_from(number).unwrap_or(u32::MAX)
    }

    /// Size of a unit in mm along the pattern's axes.
    pub fn units(&self) -> DVec2 {
        DVec2::new(self.from_unit.x_axis.length(), self.from_unit.y_axis.length())
    }

    /// The unit vector on the canvas for a direction in units.
    pub fn direction(&self, units: DVec2) -> DVec2 {
        (self.from_unit * units).normalize()
    }

    /// Distance in mm between consecutive lines on which `gradient · (u, v)` is an integer.
    pub fn spacing(&self, gradient: DVec2) -> f64 {
        1.0 / (self.to_unit.transpose() * gradient).length()
    }
}

fn distortion(change: DMat2) -> f64 {
    let off = change - DMat2::IDENTITY;
    off.x_axis.length_squared() + off.y_axis.length_squared()
}

/// Integers near `real`, with a determinant of the same sign, at least cost.
fn nearest(real: DMat2, cost: impl Fn(DMat2) -> f64) -> Option<DMat2> {
    let rounded = real.to_cols_array().map(f64::round);
    let mut best: Option<(f64, DMat2)> = None;
    for change in 0..625u32 {
        let mut numbers = rounded;
        for (k, number) in (0u32..).zip(&mut numbers) {
            *number += f64::from((change / 5u32.pow(k)) % 5) - 2.0;
        }
        let whole = DMat2::from_cols_array(&numbers);
        if whole.determinant() * real.determinant().signum() < 0.5 {
            continue;
        }
        let cost = cost(whole);
        if best.is_none_or(|(least, _)| cost < least * (1.0 - 1e-9)) {
            best = Some((cost, whole));
        }
    }
    best.map(|(_, whole)| whole)
}

/// Indices for the cells of a torus: the lattice of (across, 0) and (skew, down).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Names {
    across: i64,
    skew: i64,
    down: i64,
}

impl Names {
    /// For the torus whose sides are the columns of `lattice`, which are integers.
    fn new(lattice: DMat2) -> Self {
        let [a, b, c, d] = lattice.to_cols_array().map(whole);
        let (down, s, t) = euclid(b, d);
        let across = ((a * d - b * c) / down.max(1)).abs().max(1);
        Self { across, skew: (s * a + t * c).rem_euclid(across), down: down.max(1) }
    }

    fn number(&self, [i, j]: [i64; 2]) -> i64 {
        let turns = j.div_euclid(self.down);
        let column = (i - turns * self.skew).rem_euclid(self.across);
        (j - turns * self.down) * self.across + column
    }
}

/// The greatest common divisor of two numbers, and its Bézout coefficients.
fn euclid(a: i64, b: i64) -> (i64, i64, i64) {
    if b == 0 {
        return (a.abs(), if a < 0 { -1 } else { 1 }, 0);
    }
    let (g, s, t) = euclid(b, a.rem_euclid(b));
    (g, t, s - a.div_euclid(b) * t)
}

#[expect(clippy::cast_possible_truncation, reason = "whole numbers below 2^31")]
fn whole(x: f64) -> i64 {
    x as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn turned(degrees: f64) -> (f64, f64) {
        degrees.to_radians().sin_cos()
    }

    #[test]
    fn keeps_patterns_that_fit_the_canvas() {
        let basis = [DVec2::new(1.0, 0.0), DVec2::new(0.0, 2.0)];
        let wanted = Wanted { units: DVec2::new(10.0, 5.0), basis, turn: (0.0, 1.0), pieces: 2 };
        let fit = Fit::new(&wanted, (DVec2::new(40.0, 60.0), Tiling::BOTH)).unwrap();
        assert!((fit.units() - wanted.units).length() < 1e-12);
        // Seven rows become eight, because six would be further away.
        let fit = Fit::new(&wanted, (DVec2::new(41.0, 36.0), Tiling::BOTH)).unwrap();
        assert!((fit.units() - DVec2::new(10.25, 4.5)).length() < 1e-12, "{}", fit.units());
        let free = Fit::new(&wanted, (DVec2::new(41.0, 36.0), Tiling::NONE)).unwrap();
        assert_eq!(free.units(), wanted.units);
    }

    #[test]
    fn the_canvas_is_a_vector_of_the_lattice_at_any_angle() {
        let size = DVec2::new(50.0, 40.0);
        for basis in [[DVec2::new(4.0, 0.0), DVec2::new(1.0, 1.0)], [DVec2::new(1.0, 0.5), DVec2::new(0.0, 1.0)]] {
            for angle in [0.0, 45.0, -30.0, 170.0, 13.0] {
                let wanted = Wanted { units: DVec2::new(2.0, 2.2), basis, turn: turned(angle), pieces: 1 };
                let fit = Fit::new(&wanted, (size, Tiling::BOTH)).unwrap();
                let inverse = DMat2::from_cols(basis[0], basis[1]).inverse();
                for side in [DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y)] {
                    let vector = inverse * (fit.to_unit * side);
                    assert!((vector - vector.round()).length() < 1e-9, "{vector}");
                }
                assert!((fit.units() / wanted.units - 1.0).abs().max_element() < 0.12, "{angle}: {}", fit.units());
                let direction = fit.direction(DVec2::X);
                let off = direction.angle_to(DVec2::from_angle(angle.to_radians())).to_degrees();
                assert!(off.abs() < 6.0, "{angle}: {off}");
            }
        }
    }

    #[test]
    fn every_cell_of_the_torus_has_its_number() {
        for lattice in [[4.0, 0.0, 0.0, 6.0], [3.0, 1.0, -2.0, 5.0], [0.0, -3.0, 4.0, 2.0]] {
            let lattice = DMat2::from_cols_array(&lattice);
            let (names, count) = (Names::new(lattice), lattice.determinant().abs());
            let mut seen = BTreeSet::new();
            for i in -20..20 {
                for j in -20..20 {
                    let number = names.number([i, j]);
                    seen.insert(number);
                    for side in [lattice.x_axis, lattice.y_axis] {
                        assert_eq!(number, names.number([i + whole(side.x), j + whole(side.y)]));
                    }
                }
            }
            assert_eq!(seen.len() as f64, count);
            assert_eq!((seen.first(), seen.last()), (Some(&0), Some(&(whole(count) - 1))));
        }
    }
}
