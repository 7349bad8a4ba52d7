//! Solves for the smoothest field of directions that keeps to wishes: conjugate gradients, preconditioned by the
//! diagonal and by a [`coarse`](super::coarse) level.
//!
//! Minimises `Σ w |u_i - r_ij u_j|² + Σ λ_i |u_i - u⁰_i|²`. Sums are made in chunks of fixed size, in a fixed order, so
//! that results do not depend on the number of threads.
use super::coarse::{Coarse, Rows};
use super::connection::{Connection, times, unit};
use crate::ground::stop::Until;
use glam::DVec2;
use rayon::prelude::*;

/// Number of values per chunk of a sum.
const PIECE: usize = 2048;

/// A system of equations.
pub struct System {
    starts: Vec<u32>,
    /// The other vertex, and the factor on its value.
    entries: Vec<(u32, DVec2)>,
    diagonal: Vec<f64>,
    coarse: Option<Coarse>,
}

/// Stopping criteria.
#[derive(Clone, Copy)]
pub struct Accuracy {
    /// Residual, relative to the right-hand side.
    pub residual: f64,
    /// Maximum number of rounds.
    pub rounds: usize,
}

impl System {
    /// Builds the system of a field of symmetry `n`, with a pull on each vertex.
    pub fn new(connection: &Connection, symmetry: f64, pull: &[f64]) -> Self {
        let entry = |b: &super::connection::Beside| (b.vertex, unit(symmetry * b.carried) * b.weight);
        let weight = |v: usize| connection.beside(v).iter().map(|b| b.weight).sum::<f64>() + pull[v];
        let starts = connection.starts.clone();
        let entries: Vec<_> = connection.beside.par_iter().with_min_len(1024).map(entry).collect();
        let diagonal: Vec<f64> = (0..pull.len()).into_par_iter().with_min_len(1024).map(weight).collect();
        let coarse = Coarse::new(Rows { starts: &starts, entries: &entries, diagonal: &diagonal });
        Self { starts, entries, diagonal, coarse }
    }

    fn apply(&self, u: &[DVec2], out: &mut [DVec2]) {
        out.par_iter_mut().with_min_len(PIECE).enumerate().for_each(|(v, out)| {
            let entries = &self.entries[self.starts[v] as usize..self.starts[v + 1] as usize];
            let beside = entries.iter().fold(DVec2::ZERO, |sum, (other, by)| sum + times(*by, u[*other as usize]));
            *out = u[v] * self.diagonal[v] - beside;
        });
    }

    /// Solves for the right-hand side, starting from `u`. If stopped, the result must not be used.
    pub fn solve(&self, right: &[DVec2], u: &mut [DVec2], accuracy: Accuracy, until: Until<'_>) {
        let n = u.len();
        let mut product = vec![DVec2::ZERO; n];
        self.apply(u, &mut product);
        let mut rest: Vec<DVec2> = right.iter().zip(&product).map(|(b, p)| *b - *p).collect();
        let scaled = |rest: &[DVec2]| -> Vec<DVec2> {
            let own = |(r, d): (&DVec2, &f64)| if *d > 0.0 { *r / *d } else { DVec2::ZERO };
            let mut out: Vec<DVec2> = rest.iter().zip(&self.diagonal).map(own).collect();
            if let Some(coarse) = &self.coarse {
                coarse.add(rest, &mut out);
            }
            out
        };
        let mut ahead = scaled(&rest);
        let mut direction = ahead.clone();
        let mut slope = dot(&rest, &ahead);
        let goal = accuracy.residual * accuracy.residual * dot(right, &scaled(right));
        for round in 0..accuracy.rounds {
            if slope <= goal || (round % 16 == 0 && until()) {
                break;
            }
            self.apply(&direction, &mut product);
            let curve = dot(&direction, &product);
            if curve <= 0.0 {
                break;
            }
            let step = slope / curve;
            u.iter_mut().zip(&direction).for_each(|(u, d)| *u += *d * step);
            rest.iter_mut().zip(&product).for_each(|(r, p)| *r -= *p * step);
            ahead = scaled(&rest);
            let next = dot(&rest, &ahead);
            let keep = next / slope;
            direction.iter_mut().zip(&ahead).for_each(|(d, a)| *d = *a + *d * keep);
            slope = next;
        }
    }
}

/// The dot product of two lists, summed in a fixed order.
pub fn dot(a: &[DVec2], b: &[DVec2]) -> f64 {
    let piece = |(a, b): (&[DVec2], &[DVec2])| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let pieces: Vec<f64> = a.par_chunks(PIECE).zip(b.par_chunks(PIECE)).map(piece).collect();
    pieces.iter().sum()
}
