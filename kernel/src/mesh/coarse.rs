//! The coarse level of a system of directions: groups of neighbouring vertices that turn together.
//!
//! This is the second level of an additive preconditioner: it carries values over long distances in one round, for
//! which a solver by neighbours needs many. In a group every vertex follows the first one by the connection; the
//! equations of the groups are few enough to be solved exactly. Groups and sums are made in a fixed order.
use super::connection::times;
use glam::DVec2;

/// Approximate number of groups.
const GROUPS: usize = 512;
/// A vertex whose pull exceeds that of its neighbours by this factor takes part in no group.
const FIRM: f64 = 10.0;
/// Marks a vertex without a group.
const NONE: u32 = u32::MAX;

fn conjugate(a: DVec2) -> DVec2 {
    DVec2::new(a.x, -a.y)
}

/// The rows of a system: the offsets of the entries of each vertex, the entries, and the diagonal.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    /// Offset of the entries of each vertex, plus the end.
    pub starts: &'a [u32],
    /// The other vertex, and the factor on its value.
    pub entries: &'a [(u32, DVec2)],
    /// Factor on the vertex' own value.
    pub diagonal: &'a [f64],
}

impl<'a> Rows<'a> {
    fn of(&self, vertex: usize) -> &'a [(u32, DVec2)] {
        &self.entries[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    /// Returns whether the given directions hold a vertex, rather than its neighbours.
    fn firm(&self, vertex: usize) -> bool {
        self.diagonal[vertex] > FIRM * self.of(vertex).iter().map(|(_, by)| by.length()).sum::<f64>()
    }
}

/// The groups and the factorised matrix of their equations.
pub struct Coarse {
    /// The group of each vertex.
    group: Vec<u32>,
    /// Rotation from a group's value to each vertex' value; of length 1.
    carried: Vec<DVec2>,
    /// The rows of L in L·D·Lᴴ, without the ones of its diagonal.
    lower: Vec<Vec<DVec2>>,
    diagonal: Vec<f64>,
}

impl Coarse {
    /// Builds the groups of a system; `None` for a small system, which needs none.
    pub fn new(rows: Rows<'_>) -> Option<Self> {
        let count = rows.diagonal.len();
        if count < 4 * GROUPS {
            return None;
        }
        let (mut group, mut carried) = grow(rows, count.div_ceil(GROUPS));
        join(rows, &mut group, &mut carried, count.div_ceil(3 * GROUPS));
        let groups = renumber(&mut group);
        let (lower, diagonal) = factors(matrix(rows, &group, &carried, groups));
        Some(Self { group, carried, lower, diagonal })
    }

    /// Adds the solution of the groups' equations for the residual `rest` to `out`.
    pub fn add(&self, rest: &[DVec2], out: &mut [DVec2]) {
        let mut x = vec![DVec2::ZERO; self.diagonal.len()];
        for ((group, carried), rest) in self.group.iter().zip(&self.carried).zip(rest) {
            if *group != NONE {
                x[*group as usize] += times(conjugate(*carried), *rest);
            }
        }
        for (i, row) in self.lower.iter().enumerate() {
            let known = row.iter().zip(&x).fold(DVec2::ZERO, |sum, (l, x)| sum + times(*l, *x));
            x[i] -= known;
        }
        x.iter_mut().zip(&self.diagonal).for_each(|(x, d)| *x = if *d > 0.0 { *x / *d } else { DVec2::ZERO });
        for (i, row) in self.lower.iter().enumerate().rev() {
            let own = x[i];
            x.iter_mut().zip(row).for_each(|(x, l)| *x -= times(conjugate(*l), own));
        }
        for ((group, carried), out) in self.group.iter().zip(&self.carried).zip(out) {
            if *group != NONE {
                *out += times(*carried, x[*group as usize]);
            }
        }
    }
}

/// Grows groups of up to `most` vertices, each from the lowest free vertex.
fn grow(rows: Rows<'_>, most: usize) -> (Vec<u32>, Vec<DVec2>) {
    let count = rows.diagonal.len();
    let mut group = vec![NONE; count];
    let mut carried = vec![DVec2::X; count];
    let mut next = 0;
    let firm: Vec<bool> = (0..count).map(|v| rows.firm(v)).collect();
    for first in 0..count {
        if group[first] != NONE || firm[first] {
            continue;
        }
        let mut members = vec![first];
        group[first] = next;
        let mut at = 0;
        while at < members.len() {
            let vertex = members[at];
            at += 1;
            for (other, by) in rows.of(vertex) {
                let other = *other as usize;
                if members.len() < most && group[other] == NONE && !firm[other] {
                    group[other] = next;
                    carried[other] = times(conjugate(by.normalize_or(DVec2::X)), carried[vertex]);
                    members.push(other);
                }
            }
        }
        next += 1;
    }
    (group, carried)
}

/// Joins each group of fewer than `least` vertices to an adjacent one.
fn join(rows: Rows<'_>, group: &mut [u32], carried: &mut [DVec2], least: usize) {
    let mut members: Vec<Vec<usize>> = Vec::new();
    for (v, group) in group.iter().enumerate().filter(|(_, group)| **group != NONE) {
        members.resize_with(members.len().max(*group as usize + 1), Vec::new);
        members[*group as usize].push(v);
    }
    for own in 0..members.len() {
        if members[own].len() >= least {
            continue;
        }
        let mut ways = members[own].iter().flat_map(|v| rows.of(*v).iter().map(move |way| (*v, way)));
        let beside = |other: u32| group[other as usize] != NONE && group[other as usize] as usize != own;
        let Some((vertex, (other, by))) = ways.find(|(_, (other, _))| beside(*other)) else { continue };
        let to = group[*other as usize];
        let wanted = times(by.normalize_or(DVec2::X), carried[*other as usize]);
        let turn = times(conjugate(carried[vertex]), wanted);
        for v in std::mem::take(&mut members[own]) {
            group[v] = to;
            carried[v] = times(carried[v], turn);
            members[to as usize].push(v);
        }
    }
}

/// Numbers groups by their first vertices, and returns their number.
fn renumber(group: &mut [u32]) -> usize {
    let most = group.iter().filter(|group| **group != NONE).max().map_or(0, |most| *most as usize + 1);
    let mut names = vec![NONE; most];
    let mut count = 0;
    for group in group.iter_mut().filter(|group| **group != NONE) {
        let name = &mut names[*group as usize];
        if *name == NONE {
            *name = count;
            count += 1;
        }
        *group = *name;
    }
    count as usize
}

/// The lower half of the matrix of the groups, by rows.
fn matrix(rows: Rows<'_>, group: &[u32], carried: &[DVec2], groups: usize) -> Vec<Vec<DVec2>> {
    let mut lower: Vec<Vec<DVec2>> = (1..=groups).map(|length| vec![DVec2::ZERO; length]).collect();
    for (v, own) in group.iter().enumerate().filter(|(_, group)| **group != NONE) {
        let own = *own as usize;
        lower[own][own].x += rows.diagonal[v];
        for (other, by) in rows.of(v) {
            let to = group[*other as usize];
            if to != NONE && to as usize <= own {
                lower[own][to as usize] -= times(conjugate(carried[v]), times(*by, carried[*other as usize]));
            }
        }
    }
    lower
}

/// Factorises a Hermitian matrix into L, without the ones of its diagonal, and D.
fn factors(mut lower: Vec<Vec<DVec2>>) -> (Vec<Vec<DVec2>>, Vec<f64>) {
    let mut diagonal: Vec<f64> = Vec::with_capacity(lower.len());
    let largest = lower.iter().filter_map(|row| row.last()).map(|own| own.x).fold(0.0, f64::max);
    for i in 0..lower.len() {
        let (done, rest) = lower.split_at_mut(i);
        let row = &mut rest[0];
        // First compute L·D, then L.
        for j in 0..i {
            let known = row[..j].iter().zip(&done[j]).fold(DVec2::ZERO, |sum, (a, l)| sum + times(*a, conjugate(*l)));
            row[j] -= known;
        }
        let own = row.pop().unwrap_or_default().x;
        let mut left = own;
        for (entry, d) in row.iter_mut().zip(&diagonal) {
            let scaled = if *d > 0.0 { *entry / *d } else { DVec2::ZERO };
            left -= entry.dot(scaled);
            *entry = scaled;
        }
        // Values below this are rounding errors of a group that nothing holds.
        diagonal.push(if left > 1e-12 * largest { left } else { 0.0 });
    }
    (lower, diagonal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::connection::unit;

    /// A ring of vertices, each connected to the next two on both sides; one vertex is held.
    fn ring(count: usize) -> (Vec<u32>, Vec<(u32, DVec2)>, Vec<f64>) {
        let mut starts = vec![0];
        let mut entries = Vec::new();
        let number = |n: usize| u32::try_from(n % count).expect("small");
        for v in 0..count {
            let mut own: Vec<(u32, DVec2)> = Vec::new();
            for step in [1, 2] {
                own.push((number(v + step), unit(0.1 * step as f64)));
                own.push((number(v + count - step), unit(-0.1 * step as f64)));
            }
            own.sort_by_key(|entry| entry.0);
            entries.extend(own);
            starts.push(u32::try_from(entries.len()).expect("small"));
        }
        let mut diagonal = vec![4.0; count];
        diagonal[7] = 400.0;
        (starts, entries, diagonal)
    }

    /// The groups' part is a projection: fields that are constant on groups are found exactly.
    #[test]
    fn solves_values_constant_on_groups_in_one_step() {
        let (starts, entries, diagonal) = ring(5000);
        let rows = Rows { starts: &starts, entries: &entries, diagonal: &diagonal };
        let coarse = Coarse::new(rows).expect("a large system");
        let groups = coarse.diagonal.len();
        assert!((GROUPS / 3..=GROUPS).contains(&groups), "{groups}");
        assert_eq!(coarse.group[7], NONE);
        let value = |group: u32| DVec2::new(1.0, 0.25 * f64::from(group % 7));
        let shown: Vec<DVec2> = coarse
            .group
            .iter()
            .zip(&coarse.carried)
            .map(|(group, carried)| if *group == NONE { DVec2::ZERO } else { times(*carried, value(*group)) })
            .collect();
        let product = |v: usize| {
            rows.of(v).iter().fold(shown[v] * diagonal[v], |sum, (other, by)| sum - times(*by, shown[*other as usize]))
        };
        let rest: Vec<DVec2> = (0..5000).map(product).collect();
        let mut found = vec![DVec2::ZERO; 5000];
        coarse.add(&rest, &mut found);
        for (found, shown) in found.iter().zip(&shown) {
            assert!(found.distance(*shown) < 1e-6, "{found} {shown}");
        }
    }

    #[test]
    fn small_systems_need_no_groups() {
        let (starts, entries, diagonal) = ring(1000);
        assert!(Coarse::new(Rows { starts: &starts, entries: &entries, diagonal: &diagonal }).is_none());
    }
}
