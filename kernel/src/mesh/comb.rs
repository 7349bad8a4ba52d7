//! Singular points of a field of directions, and the choice among equivalent directions.
use super::connection::{Connection, wrapped};
use crate::ground::number::index_u32;
use shibo_value::Mesh;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;

/// The triangles around which a field rotates, with their index in `n`ths of a turn; `angles` are `n` times the
/// directions. On a closed surface the indices add up to `n` times its Euler characteristic.
pub fn singular(mesh: &Mesh, connection: &Connection, angles: &[f64], n: f64) -> Vec<(u32, i8)> {
    let index = |triangle: &[u32; 3]| -> i8 {
        let (mut turned, mut holonomy) = (0.0, 0.0);
        for k in 0..3 {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            // Start at the lower vertex, so that both sides of an edge compute the same difference.
            let (low, high) = (from.min(to), from.max(to));
            let carried = connection.carried(low, high);
            let off = wrapped(angles[high as usize] - angles[low as usize] - n * carried);
            let sign = if from == low { 1.0 } else { -1.0 };
            turned += sign * off;
            holonomy += sign * carried;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a few turns")]
        let index = ((turned + n * wrapped(holonomy)) / TAU).round() as i8;
        index
    };
    let found = mesh.triangles.iter().enumerate().map(|(t, triangle)| (index_u32(t), index(triangle)));
    found.filter(|(_, index)| *index != 0).collect()
}

/// For each edge of a mesh the number of `n`ths of a turn by which the field changes along it.
pub type Turns = Vec<[u8; 3]>;

/// Chooses among equivalent directions so that neighbours fit, over a spanning tree of the edges, best fits first. The
/// input angles belong to `n`th powers. Edges outside the tree where the choice does not close get a turn.
pub fn comb(mesh: &Mesh, connection: &Connection, mut angles: Vec<f64>, symmetry: u8) -> (Vec<f64>, Turns) {
    let n = f64::from(symmetry);
    // The input angles belong to `n`th powers.
    angles.iter_mut().for_each(|angle| *angle /= n);
    if symmetry <= 1 {
        return (angles, Vec::new());
    }
    let step = TAU / n;
    let mut done = vec![false; angles.len()];
    let mut open = BinaryHeap::new();
    for first in 0..angles.len() {
        if done[first] {
            continue;
        }
        open.push((Reverse(0u64), Reverse(index_u32(first)), index_u32(first)));
        while let Some((_, Reverse(vertex), from)) = open.pop() {
            let v = vertex as usize;
            if done[v] {
                continue;
            }
            done[v] = true;
            if from != vertex {
                let wanted = angles[from as usize] + connection.carried(from, vertex);
                angles[v] += ((wanted - angles[v]) / step).round() * step;
            }
            for beside in connection.beside(v).iter().filter(|b| !done[b.vertex as usize]) {
                let off = angles[v] + connection.carried(vertex, beside.vertex) - angles[beside.vertex as usize];
                let misfit = (off - (off / step).round() * step).abs();
                open.push((Reverse(misfit.to_bits()), Reverse(beside.vertex), vertex));
            }
        }
    }
    let turn = |from: u32, to: u32| -> u8 {
        let (low, high) = (from.min(to), from.max(to));
        let off = angles[high as usize] - angles[low as usize] - connection.carried(low, high);
        let sign = if from == low { 1.0 } else { -1.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the symmetry")]
        let turns = (sign * (off / step).round()).rem_euclid(n) as u8;
        turns
    };
    let turns: Turns = mesh.triangles.iter().map(|t| [0, 1, 2].map(|k| turn(t[(k + 1) % 3], t[(k + 2) % 3]))).collect();
    let none = turns.iter().all(|turns| *turns == [0; 3]);
    (angles, if none { Vec::new() } else { turns })
}
