//! A membrane over a mask that pressure raises: −Δh = 1 inside of the mask, h = 0 on its border.
//!
//! The border lies between pixels, where the field crosses its threshold, so that h does not depend on the resolution
//! (F. Gibou et al., "A second-order-accurate symmetric discretization of the Poisson equation on irregular domains",
//! 2002). The equations are solved by conjugate gradients; a cycle of the multigrid method is their preconditioner, as
//! in A. McAdams, E. Sifakis, J. Teran, "A parallel multigrid Poisson solver for fluids simulation on large grids"
//! (2010). Unlike there, links of coarse grids are sums of those of the finer one, so walls and holes thinner than a
//! coarse cell still count. Sums over all pixels are added row by row, so results do not depend on the threads.
//!
//! A region without a border has no solution: if all pixels lie inside of the mask, h is 0.
mod level;
mod transfer;

use crate::ground::number::narrow;
use crate::ground::stop::Until;
use level::Level;
use rayon::prelude::*;
use transfer::Transfer;

/// Bytes of memory for each pixel.
pub const PIXEL_BYTES: u64 = 64;

/// The part of a link within the mask is at least this share of a pixel, so that equations stay well-conditioned.
const NEAREST: f32 = 0.02;

/// The share of the pressure that may be left unbalanced, root mean square.
const LEFT: f64 = 5e-3;

/// Most cycles. Masks with many thin walls need about ten.
const CYCLES: usize = 40;

/// A grid of the multigrid method with its vectors.
struct Storey {
    level: Level,
    transfer: Transfer,
    x: Vec<f32>,
    b: Vec<f32>,
    other: Vec<f32>,
}

/// The membrane over a picture of `width` pixels in a row that are `step` mm apart. A pixel lies inside if its value is
/// above `threshold`. Where the picture does not repeat (`wrap`), its edges are no border: the membrane is level there.
/// The result is h in mm² by rows; `None` if stopped.
pub fn membrane(
    field: &[f32],
    width: usize,
    threshold: f32,
    step: [f64; 2],
    wrap: [bool; 2],
    until: Until<'_>,
) -> Option<Vec<f32>> {
    let width = width.max(1);
    let height = field.len() / width;
    let inside = |v: f32| v > threshold;
    if height == 0 || field.iter().all(|v| inside(*v)) || !field.iter().any(|v| inside(*v)) {
        return Some(vec![0.0; field.len()]);
    }
    let fine = finest(field, width, threshold, step, wrap);
    let area = narrow(step[0] * step[1]);
    let mut b = vec![0.0; fine.len()];
    for (b, row) in b.chunks_exact_mut(width + 2).zip(field.chunks_exact(width)) {
        b[1..=width].iter_mut().zip(row).for_each(|(b, v)| *b = if inside(*v) { 1.0 } else { 0.0 });
        fine.close(b);
    }
    let mut storeys = storeys(fine);
    let h = solve(&mut storeys, b, until)?;
    let rows = h.chunks_exact(width + 2).flat_map(|row| &row[1..=width]);
    Some(rows.zip(field).map(|(h, v)| if inside(*v) { (area * h).max(0.0) } else { 0.0 }).collect())
}

/// The equations of the pixels.
fn finest(field: &[f32], width: usize, threshold: f32, step: [f64; 2], wrap: [bool; 2]) -> Level {
    let height = field.len() / width;
    let stride = width + 2;
    let empty = vec![0.0; stride * height];
    let mut level = Level { width, height, wrap, right: empty.clone(), down: empty.clone(), diagonal: empty };
    let (across, down) = (narrow(step[1] / step[0]), narrow(step[0] / step[1]));
    let wide = [wrap[0] && width > 1, wrap[1] && height > 1];
    // The value above the threshold; limited, so that ratios are numbers.
    let over = |x: usize, y: usize| {
        let v = field[y * width + x] - threshold;
        if v.is_nan() { -1.0 } else { v.clamp(-1e30, 1e30) }
    };
    let rows = level.right.par_chunks_mut(stride).zip(level.down.par_chunks_mut(stride));
    rows.zip(level.diagonal.par_chunks_mut(stride)).enumerate().for_each(|(y, ((right, under), diagonal))| {
        for x in 0..width {
            let own = over(x, y);
            if own <= 0.0 {
                diagonal[x + 1] = 1.0;
                continue;
            }
            let mut link = |weight: f32, next: Option<f32>| {
                let Some(next) = next else { return 0.0 };
                if next > 0.0 {
                    diagonal[x + 1] += weight;
                    return weight;
                }
                diagonal[x + 1] += weight / (own / (own - next)).clamp(NEAREST, 1.0);
                0.0
            };
            let east = if x + 1 < width { Some(x + 1) } else { wide[0].then_some(0) };
            let west = if x > 0 { Some(x - 1) } else { wide[0].then_some(width - 1) };
            let south = if y + 1 < height { Some(y + 1) } else { wide[1].then_some(0) };
            let north = if y > 0 { Some(y - 1) } else { wide[1].then_some(height - 1) };
            right[x + 1] = link(across, east.map(|x| over(x, y)));
            link(across, west.map(|x| over(x, y)));
            under[x + 1] = link(down, south.map(|y| over(x, y)));
            link(down, north.map(|y| over(x, y)));
        }
        if wide[0] {
            right[0] = right[width];
        }
    });
    level
}

/// All grids, down to a single cell.
fn storeys(fine: Level) -> Vec<Storey> {
    let mut storeys = Vec::new();
    let mut next = Some(fine);
    while let Some(level) = next {
        let vector = vec![0.0; level.len()];
        let coarser = (level.width > 1 || level.height > 1).then(|| level.coarser());
        let transfer = Transfer::new(&level);
        storeys.push(Storey { level, transfer, x: vector.clone(), b: vector.clone(), other: vector });
        next = coarser;
    }
    storeys
}

/// One cycle: approximates the solution of the first grid for its `b`, as its `x`.
fn cycle(storeys: &mut [Storey]) {
    let (first, rest) = storeys.split_at_mut(1);
    let Storey { level, transfer, x, b, other } = &mut first[0];
    level.first(b, other);
    level.relax(other, b, x, false);
    if let Some(next) = rest.first_mut() {
        level.residual(x, b, other);
        transfer.coarsen(level, other, &next.level, &mut next.b);
        cycle(rest);
        transfer.refine(&rest[0].level, &rest[0].x, level, x);
    }
    level.relax(x, b, other, false);
    level.relax(other, b, x, true);
}

/// Σ a · b over the cells of a grid, row by row.
fn dot(level: &Level, a: &[f32], b: &[f32]) -> f64 {
    let (stride, width) = (level.stride(), level.width);
    let of_row = |(a, b): (&[f32], &[f32])| {
        let pairs = a[1..=width].iter().zip(&b[1..=width]);
        pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>()
    };
    let rows: Vec<f64> = a.par_chunks(stride).zip(b.par_chunks(stride)).map(of_row).collect();
    rows.iter().sum()
}

/// to += factor · from.
fn add(to: &mut [f32], factor: f64, from: &[f32]) {
    let factor = narrow(factor);
    let add = |(to, from): (&mut [f32], &[f32])| to.iter_mut().zip(from).for_each(|(to, from)| *to += factor * from);
    to.par_chunks_mut(1 << 14).zip(from.par_chunks(1 << 14)).for_each(add);
}

/// The solution of the finest grid for `b`, by conjugate gradients.
fn solve(storeys: &mut [Storey], b: Vec<f32>, until: Until<'_>) -> Option<Vec<f32>> {
    let size = b.len();
    let (mut h, mut search, mut rest) = (vec![0.0; size], vec![0.0; size], b);
    let enough = LEFT * LEFT * dot(&storeys[0].level, &rest, &rest);
    let mut before = 0.0;
    for round in 0..CYCLES {
        if until() {
            return None;
        }
        storeys[0].b.copy_from_slice(&rest);
        cycle(storeys);
        let Storey { level, x, other, .. } = &mut storeys[0];
        let now = dot(level, &rest, x);
        if now <= 0.0 || now.is_nan() {
            break;
        }
        if round == 0 {
            search.copy_from_slice(x);
        } else {
            let factor = narrow(now / before);
            search.par_chunks_mut(1 << 14).zip(x.par_chunks(1 << 14)).for_each(|(search, x)| {
                search.iter_mut().zip(x).for_each(|(search, x)| *search = x + factor * *search);
            });
        }
        level.product(&search, other);
        let bend = dot(level, &search, other);
        if bend <= 0.0 || bend.is_nan() {
            break;
        }
        add(&mut h, now / bend, &search);
        add(&mut rest, -now / bend, other);
        before = now;
        if dot(level, &rest, &rest) <= enough {
            break;
        }
    }
    Some(h)
}

#[cfg(test)]
mod tests;
