//! Point sets: the end points of the virtual springs.
//!
//! Source: JP4905282B2 §3, claims 1, 6, 7. The source's own sets are a regular grid and that grid jittered by `d ·
//! Rnd`; it allows hexagons, random points and "any algorithm with an almost uniform distribution", for which
//! [`super::poisson`] is recommended. Lengths are mm, y points down; random numbers are drawn by index.

use super::links::{GridShape, Links};
use crate::ground::hash::Hash;
use crate::ground::number::index_u32;
use crate::ground::stop::{NEVER, Until};
use glam::{DVec2, IVec2, Vec2};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A grid of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSpec {
    /// Size of the canvas, > 0.
    pub size: Vec2,
    /// Wanted distance of columns and of rows, > 0; rounded to the nearest one that divides the canvas.
    pub pitch: Vec2,
    /// Shift of every second row, 0..1 of a column; ½ makes a grid of triangles.
    pub stagger: f32,
    /// Points move by up to half this share of the pitch in x and in y; 1 is the source's `d · Rnd`.
    pub jitter: f32,
    /// Border points stay, because jitter would break the rectangle; they still use their random numbers. No effect on
    /// a periodic grid, which has no border.
    pub keep_border: bool,
    /// Opposite edges of the canvas join: columns and rows divide it, and the number of rows is even if they are
    /// staggered.
    pub periodic: bool,
}

/// The points of a grid, by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct GridPoints {
    /// The points.
    pub points: Vec<Vec2>,
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// The pitch fitted to the canvas.
    pub pitch: Vec2,
}

impl GridPoints {
    /// The shape for [`super::links::grid_links`].
    pub fn shape(&self, eight: bool, periodic: bool) -> GridShape {
        GridShape { nx: self.nx, ny: self.ny, eight, periodic }
    }
}

/// Numbers of columns and rows of [`grid`], without allocating it.
pub fn grid_counts(spec: &GridSpec) -> (usize, usize) {
    let cells = (spec.size.as_dvec2() / spec.pitch.as_dvec2()).round().max(DVec2::ONE);
    let (cx, cy) = (count(cells.x), count(cells.y));
    match (spec.periodic, spec.stagger != 0.0) {
        (false, _) => (cx + 1, cy + 1),
        (true, true) => (cx.max(2), count(2.0 * (cells.y / 2.0).round()).max(2)),
        (true, false) => (cx.max(2), cy.max(2)),
    }
}

/// A grid: points `(i dx, j dy)` with `a = (n - 1) d` on a bounded canvas, its border points on the contour;
/// staggered rows shrink dx so that all stay inside. Point n draws numbers 2n (x) and 2n + 1 (y). O(n).
pub fn grid(spec: &GridSpec, hash: Hash) -> GridPoints {
    let (nx, ny) = grid_counts(spec);
    let size = spec.size.as_dvec2();
    let stagger = f64::from(spec.stagger);
    let pitch = if spec.periodic {
        size / DVec2::new(nx as f64, ny as f64)
    } else {
        size / DVec2::new((nx - 1) as f64 + stagger, (ny - 1) as f64)
    };
    let place = |n: usize| {
        let (i, j) = (n % nx, n / nx);
        let shift = if j % 2 == 1 { stagger } else { 0.0 };
        let at = DVec2::new(i as f64 + shift, j as f64) * pitch;
        let border = i == 0 || j == 0 || i + 1 == nx || j + 1 == ny;
        if spec.keep_border && border && !spec.periodic {
            return at.as_vec2();
        }
        let rnd = DVec2::new(hash.unit(2 * n as u64), hash.unit(2 * n as u64 + 1)) - 0.5;
        (at + pitch * rnd * f64::from(spec.jitter)).as_vec2()
    };
    GridPoints { points: (0..nx * ny).into_par_iter().map(place).collect(), nx, ny, pitch: pitch.as_vec2() }
}

/// `count` points anywhere; point n draws numbers 2n (x) and 2n + 1 (y). O(n).
pub fn random(count: usize, size: Vec2, hash: Hash) -> Vec<Vec2> {
    let size = size.as_dvec2();
    let point = |n: u64| (DVec2::new(hash.unit(2 * n), hash.unit(2 * n + 1)) * size).as_vec2();
    (0..count as u64).into_par_iter().map(point).collect()
}

/// True for points at most `margin` mm from the edge of the canvas, or outside: the fixed points. A small tolerance is
/// added so that points meant to lie on the contour count at margin 0.
pub fn border(points: &[Vec2], size: Vec2, margin: f32) -> Vec<bool> {
    let margin = margin + 1e-5 * size.min_element();
    points.iter().map(|p| p.min(size - *p).min_element() <= margin).collect()
}

/// A tiling by hexagons, in cells of 3 edges by 2 rows, each with 4 corners: at 1 and 2 edges in even rows, at ½ and 2½
/// in odd ones.
struct Hexagons {
    /// An edge by a row, in mm.
    unit: DVec2,
    columns: i32,
    rows: i32,
    /// Size of the canvas in half edges and rows.
    turn: IVec2,
    /// Upper bound of the corners' x; infinity on a periodic canvas.
    end: f64,
}

impl Hexagons {
    fn new(size: Vec2, edge: f32, periodic: bool) -> Self {
        let (edge, size) = (f64::from(edge), size.as_dvec2());
        let row = edge * 0.75f64.sqrt();
        let fit =
            |length: f64, unit: f64| if periodic { (length / unit).round().max(1.0) } else { (length / unit).floor() };
        let (cx, cy) = (fit(size.x, 3.0 * edge), fit(size.y, 2.0 * row));
        let unit = if periodic { size / DVec2::new(3.0 * cx, 2.0 * cy) } else { DVec2::new(edge, row) };
        let (columns, rows) =
            if periodic { (cx, 2.0 * cy) } else { (cx + 1.0, (size.y / row * (1.0 + 1e-9)).floor() + 1.0) };
        let turn = IVec2::new(2 * coordinate(3.0 * cx), coordinate(2.0 * cy));
        let end = if periodic { f64::INFINITY } else { size.x * (1.0 + 1e-9) };
        Self { unit, columns: coordinate(columns), rows: coordinate(rows), turn, end }
    }

    /// The corners in a row: their x in half edges, and their positions.
    fn row(&self, y: i32) -> impl Iterator<Item = (i32, DVec2)> {
        let corners = (0..self.columns).flat_map(move |c| if y % 2 == 0 { [2, 4] } else { [1, 5] }.map(|x| 6 * c + x));
        let placed = corners.map(move |x| (x, DVec2::new(f64::from(x) * 0.5, f64::from(y)) * self.unit));
        placed.filter(|(_, place)| place.x <= self.end)
    }
}

/// The shape of the grid whose points, by rows, are those of [`hexagons`], if all rows have the same number: their
/// edges are links to the right, of every second point, and down.
pub fn hexagon_grid(size: Vec2, edge: f32, periodic: bool) -> Option<GridShape> {
    let tiling = Hexagons::new(size, edge, periodic);
    let [even, odd] = [0, 1].map(|y| tiling.row(y).count());
    let ny = usize::try_from(tiling.rows).ok()?;
    (even == odd).then_some(GridShape { nx: even, ny, eight: false, periodic })
}

/// The corners of a tiling by regular hexagons of edge `edge` that lie on the canvas, and its edges as links.
/// Two sides of each hexagon are parallel to x. On a periodic canvas the hexagons are stretched a little so
/// that a whole number fits. Points by rows; links sorted. O(n log n).
pub fn hexagons(size: Vec2, edge: f32, periodic: bool) -> (Vec<Vec2>, Links) {
    hexagons_until(size, edge, periodic, NEVER)
}

/// Like [`hexagons`]; returns fewer points and links if stopped.
pub fn hexagons_until(size: Vec2, edge: f32, periodic: bool, until: Until<'_>) -> (Vec<Vec2>, Links) {
    let tiling = Hexagons::new(size, edge, periodic);
    let turn = tiling.turn;
    let mut sites = BTreeMap::new();
    let mut points = Vec::new();
    for y in 0..tiling.rows {
        if until() {
            break;
        }
        for (x, place) in tiling.row(y) {
            sites.insert((x, y), index_u32(points.len()));
            points.push(place.as_vec2());
        }
    }
    let mut links = Vec::new();
    for (&(x, y), &from) in &sites {
        if from.is_multiple_of(1 << 12) && until() {
            break;
        }
        // Its neighbours in the same row and in the row below.
        let left = matches!((y % 2 == 0, x.rem_euclid(6)), (true, 2) | (false, 5));
        let (beside, aside) = (if left { 2 } else { -2 }, if left { -1 } else { 1 });
        for (dx, dy) in [(beside, 0), (aside, 1)] {
            let to = IVec2::new(x + dx, y + dy);
            let wrap = if periodic { to.div_euclid(turn) } else { IVec2::ZERO };
            let home = to - wrap * turn;
            let Some(&to) = sites.get(&(home.x, home.y)) else { continue };
            if beside > 0 || dy == 1 {
                links.push(([from, to], [wrap.x.signum() as i8, wrap.y.signum() as i8]));
            }
        }
    }
    if until() {
        return (points, Links::default());
    }
    links.sort_unstable();
    let wraps = if periodic { links.iter().map(|l| l.1).collect() } else { Vec::new() };
    (points, Links { pairs: links.into_iter().map(|l| l.0).collect(), wraps })
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a rounded count ≥ 0; casts saturate")]
fn count(value: f64) -> usize {
    value as usize
}

#[expect(clippy::cast_possible_truncation, reason = "a small whole number; casts saturate")]
fn coordinate(value: f64) -> i32 {
    value as i32
}
