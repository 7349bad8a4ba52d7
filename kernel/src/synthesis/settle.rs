//! The correction of one pixel along any Jacobian, given its neighbours; shared by the plane and surfaces.
//!
//! See the module `aniso` for the method.
use super::analysis::Hood;
use super::candidates::distance;
use super::coverage::Factors;
use super::jacobian::{self, Jacobian, OCTANTS};
use super::pca::DIMS;
use super::table::Table;
use crate::ground::simd;
use crate::ground::window::index;

/// A position in exemplar pixels.
pub type Position = [f32; 2];

/// The terms of the cost, as in the isometric corrector.
pub struct Terms<'a> {
    /// Cost factor κ of candidates that look alike, compared with coherent ones.
    pub kappa: f32,
    /// True if three predictions are averaged per Δ.
    pub averaged: bool,
    /// Factors for even use.
    pub factors: Option<&'a Factors>,
    /// Target guide values by pixel; empty for none.
    pub guide: &'a [f32],
    /// Weight of `guide`.
    pub guide_weight: f32,
    /// Pixels that must not change; empty for none.
    pub fixed: &'a [bool],
}

/// Neighbour offsets and directions under a Jacobian.
pub(super) struct Geometry<'a> {
    pub(super) table: &'a Table,
    /// `h J o` for the first four neighbours of [`OCTANTS`]; the others are opposite.
    pub(super) steps: [Position; 4],
    /// The octants of `J⁻¹` times each of [`OCTANTS`] and, for a neighbourhood of 24, each of [`KNIGHTS`].
    pub(super) toward: [usize; 16],
}

impl<'a> Geometry<'a> {
    #[inline(always)]
    pub(super) fn new(tables: &[&'a Table], h: usize, j: &Jacobian) -> Self {
        let mut table = tables[0];
        let area = jacobian::det(j).abs() * (h * h) as f32;
        // Choose the power of two nearest to h √|det J|.
        for finer in &tables[1..] {
            let middle = (finer.h * finer.h) as f32 * 2.0;
            if area >= middle {
                break;
            }
            table = finer;
        }
        let spacing = h as f32;
        let mut steps = [[0.0; 2]; 4];
        for (step, o) in steps.iter_mut().zip(OCTANTS) {
            let [x, y] = jacobian::apply(j, [o[0] as f32, o[1] as f32]);
            *step = [x * spacing, y * spacing];
        }
        // Up to a positive factor, J⁻¹ is sign(det) times the adjugate.
        let sign = if jacobian::det(j) < 0.0 { -1.0 } else { 1.0 };
        let mut toward = [0; 16];
        let mut fill = simd::inlined(
            #[inline(always)]
            |first: usize, directions: &[[i32; 2]; 8]| {
                for (k, direction) in directions.iter().enumerate().take(4) {
                    let [x, y] = [direction[0] as f32, direction[1] as f32];
                    let towards = [(j[3] * x - j[1] * y) * sign, (j[0] * y - j[2] * x) * sign];
                    let octant = jacobian::octant(f64::from(towards[0]), f64::from(towards[1]));
                    (toward[first + k], toward[first + k + 4]) = (octant, (octant + 4) & 7);
                }
            },
        );
        fill(0, &OCTANTS);
        if table.hood() == Hood::Square5 {
            fill(8, &KNIGHTS);
        }
        Self { table, steps, toward }
    }

    /// `h J o` for a neighbour.
    #[inline(always)]
    pub(super) fn step(&self, octant: usize) -> Position {
        let [x, y] = self.steps[octant & 3];
        if octant < 4 { [x, y] } else { [-x, -y] }
    }
}

/// The directions of a neighbourhood of 24 that are not among [`OCTANTS`], in the same order.
const KNIGHTS: [[i32; 2]; 8] = [[2, 1], [1, 2], [-1, 2], [-2, 1], [-2, -1], [-1, -2], [1, -2], [2, -1]];

/// An entry of a neighbourhood: its offset, the octants whose neighbours predict it, and their number.
type Place = ([i32; 2], [usize; 3], usize);

/// The entries of a neighbourhood, in the order of the tables.
const fn places<const N: usize>() -> [Place; N] {
    let mut places = [([0, 0], [0; 3], 0); N];
    let reach = if N == 24 { 2 } else { 1 };
    let (mut n, mut y) = (0, -reach);
    while y <= reach {
        let mut x = -reach;
        while x <= reach {
            let wanted = if N == 4 { x != 0 && y != 0 } else { x != 0 || y != 0 };
            if wanted {
                let mut directions = [0; 3];
                let mut k = 0;
                while k < 8 {
                    let (o, v) = (OCTANTS[k], KNIGHTS[k]);
                    if o[0] * y == o[1] * x && o[0] * x + o[1] * y > 0 {
                        directions[0] = k;
                    }
                    if v[0] == x && v[1] == y {
                        directions[0] = k + 8;
                    }
                    k += 1;
                }
                directions[1] = if x > 0 { 0 } else { 4 };
                directions[2] = if y > 0 { 2 } else { 6 };
                places[n] = ([x, y], directions, if x == 0 || y == 0 { 1 } else { 3 });
                n += 1;
            }
            x += 1;
        }
        y += 1;
    }
    places
}

/// Compares a pixel with the exemplar.
pub(super) struct Matcher<'a> {
    pub(super) terms: &'a Terms<'a>,
}

/// Cost terms of a pixel: the factors for even use, by bin, and the target guide value.
pub(super) type Known<'a> = (Option<&'a [f32]>, Option<f32>);

impl Matcher<'_> {
    /// Best position of a pixel with position `own`, given the predictions of its neighbours.
    #[inline(always)]
    pub(super) fn settle(
        &self,
        geometry: &Geometry<'_>,
        own: Position,
        near: &[Position; 8],
        known: Known<'_>,
    ) -> Position {
        let table = geometry.table;
        let here = table.cell(own);
        let mut cells = [here; 8];
        for (cell, p) in cells.iter_mut().zip(near) {
            *cell = table.cell(*p);
        }
        let guided = table.has_guide() && known.1.is_some();
        let mut same = !guided && table.is_valid(table.padded(here));
        for toward in &geometry.toward[..8] {
            same &= cells[*toward] == here;
        }
        if same && table.hood() == Hood::Square5 {
            for toward in &geometry.toward[8..] {
                same &= cells[*toward] == here;
            }
        }
        if same {
            return own;
        }
        let wanted = match table.hood() {
            Hood::Diagonal4 => self.neighbourhood::<4>(geometry, &cells),
            Hood::Square3 => self.neighbourhood::<8>(geometry, &cells),
            Hood::Square5 => self.neighbourhood::<24>(geometry, &cells),
        };
        self.best(geometry, (own, here), &wanted, (near, &cells), known)
    }

    #[inline(always)]
    fn neighbourhood<const N: usize>(&self, geometry: &Geometry<'_>, cells: &[[i32; 2]; 8]) -> [f32; DIMS] {
        let table = geometry.table;
        let spacing = index(table.h);
        let mut wanted = [0.0f32; DIMS];
        let places = const { places::<N>() };
        for ((delta, octants, count), matrix) in places.into_iter().zip(table.matrix().chunks_exact(DIMS)) {
            let seen = simd::inlined(
                #[inline(always)]
                |octant: usize| {
                    let [x, y] = cells[geometry.toward[octant]];
                    table.appearance_at([x + delta[0] * spacing, y + delta[1] * spacing])
                },
            );
            let mut mean = *seen(octants[0]);
            if count == 3 && self.terms.averaged {
                let (across, down) = (seen(octants[1]), seen(octants[2]));
                for ((mean, a), b) in mean.iter_mut().zip(across).zip(down) {
                    *mean = (*mean + (a + b)) * (1.0 / 3.0);
                }
            }
            for (v, row) in mean.iter().zip(matrix) {
                wanted.iter_mut().zip(row).for_each(|(wanted, m)| *wanted += v * m);
            }
        }
        wanted
    }

    #[inline(always)]
    fn best(
        &self,
        geometry: &Geometry<'_>,
        (own, here): (Position, [i32; 2]),
        wanted: &[f32; DIMS],
        (near, cells): (&[Position; 8], &[[i32; 2]; 8]),
        (factors, guide): (Option<&[f32]>, Option<f32>),
    ) -> Position {
        let (terms, table) = (self.terms, geometry.table);
        let cost = simd::inlined(
            #[inline(always)]
            |at: u32| {
                let mut cost = distance(wanted, table.hood_at(at));
                if let Some(guide) = guide {
                    let off = guide - table.guide(at);
                    cost += terms.guide_weight * (off * off);
                }
                if let Some(factors) = factors {
                    cost *= factors[table.bin_at(at)];
                }
                cost
            },
        );
        let at = table.padded(here);
        let (mut best, mut least) = (own, cost(at));
        let alike = simd::inlined(
            #[inline(always)]
            |position: Position, cell: [i32; 2], at: u32, best: &mut Position, least: &mut f32| {
                for second in table.alike(at) {
                    let cost = terms.kappa * cost(second);
                    if cost < *least {
                        let [x, y] = table.pixel(second);
                        *best = [x as f32 + (position[0] - cell[0] as f32), y as f32 + (position[1] - cell[1] as f32)];
                        *least = cost;
                    }
                }
            },
        );
        alike(own, here, at, &mut best, &mut least);
        let mut last = here;
        // The order is that of directions in the exemplar, so that the orientation of the output decides no tie.
        for toward in &geometry.toward[..8] {
            let (position, cell) = (&near[*toward], &cells[*toward]);
            if *cell == here || *cell == last {
                continue;
            }
            last = *cell;
            let at = table.padded(*cell);
            let cost = cost(at);
            if cost == f32::INFINITY {
                continue;
            }
            if cost < least {
                (best, least) = (*position, cost);
            }
            alike(*position, *cell, at, &mut best, &mut least);
        }
        table.wrapped(best)
    }
}
