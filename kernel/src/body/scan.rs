//! The largest distance between a triangle and the height field, at samples and where edges cross lines between samples.
use super::patch::{Facet, Patch, Spot};
use std::cmp::Ordering;

/// The worst place of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Worst {
    /// The distance relative to the allowed one: above 1 the triangle must be divided.
    pub(super) share: f64,
    /// The sample that is to become a vertex.
    pub(super) spot: Spot,
}

impl Worst {
    pub(super) const NONE: Self = Self { share: 0.0, spot: [0, 0] };

    /// The larger one of two; of equal ones, the one in the lower row, then column.
    #[inline]
    pub(super) fn or(self, other: Self) -> Self {
        let later = (other.spot[1], other.spot[0]) < (self.spot[1], self.spot[0]);
        if other.share > self.share || (other.share == self.share && later) { other } else { self }
    }
}

/// Samples that are vertices already.
pub(super) trait Taken {
    /// True if the sample is a vertex.
    fn taken(&self, column: usize, row: usize) -> bool;
}

/// Collects the worst place.
struct Search<'a, T> {
    patch: &'a Patch,
    taken: &'a T,
    /// The largest distance in mm so far.
    distance: f64,
    spot: [usize; 2],
}

impl<T: Taken> Search<'_, T> {
    #[inline]
    fn sample(&mut self, distance: f64, spot: [usize; 2]) {
        let earlier = (spot[1], spot[0]) < (self.spot[1], self.spot[0]);
        if distance > self.distance || (distance == self.distance && earlier) {
            (self.distance, self.spot) = (distance, spot);
        }
    }

    /// A crossing between two neighbouring samples, `part` of the way from `a` to `b`. The nearer one is taken. If it
    /// lies on a side of the block, or is a vertex already, the other one is.
    #[inline]
    fn crossing(&mut self, distance: f64, part: f64, a: [usize; 2], b: [usize; 2]) {
        if distance < self.distance {
            return;
        }
        if part <= 0.0 {
            return self.sample(distance, a);
        }
        if part >= 1.0 {
            return self.sample(distance, b);
        }
        let (near, far) = if part <= 0.5 { (a, b) } else { (b, a) };
        let [near_taken, far_taken] = [near, far].map(|[column, row]| self.taken.taken(column, row));
        let near_side = self.patch.on_side(near[0], near[1]);
        let spot = match (near_taken, far_taken) {
            // Two neighbouring vertices are joined by an edge, so no other edge crosses between them.
            (true, true) => return,
            (true, false) => far,
            (false, true) => near,
            (false, false) if near_side => far,
            (false, false) => near,
        };
        self.sample(distance, spot);
    }

    /// The crossings of an edge with rows and columns of samples. Samples on the edge are crossings too.
    fn edge(&mut self, a: Spot, b: Spot) {
        let patch = self.patch;
        // Both triangles of an edge compute the same numbers.
        let (a, b) = if (a[1], a[0]) <= (b[1], b[0]) { (a, b) } else { (b, a) };
        let ([ax, ay], [bx, by]) = (patch.place(a).map(f64::from), patch.place(b).map(f64::from));
        let (ah, bh) = (patch.of(a), patch.of(b));
        let (dx, dy, dh) = (bx - ax, by - ay, bh - ah);
        let ([ac, ar], [bc, br]) = (a.map(usize::from), b.map(usize::from));
        let (columns, rows) = (ac.abs_diff(bc), br - ar);
        let is_evenly_spaced = dx.abs() == 2.0 * columns as f64 && dy == 2.0 * rows as f64;
        if is_evenly_spaced && (columns == 0 || rows == 0 || columns == rows) {
            return self.along_samples([a, b], columns.max(rows));
        }
        if br > ar + 1 {
            let (slope, rise) = (dx / dy, dh / dy);
            for row in ar + 1..br {
                let down = f64::from(patch.down[row]) - ay;
                let (column, part) = patch.column(ax + down * slope);
                let line = patch.row(row);
                let (low, high) = (f64::from(line[column]), f64::from(line[column + 1]));
                let distance = (ah + down * rise - (low + (high - low) * part)).abs();
                self.crossing(distance, part, [column, row], [column + 1, row]);
            }
        }
        let (from, to) = (ac.min(bc), ac.max(bc));
        if to > from + 1 {
            let (slope, rise) = (dy / dx, dh / dx);
            for column in from + 1..to {
                let along = f64::from(patch.across[column]) - ax;
                let (row, part) = patch.row_at(ay + along * slope);
                let (low, high) = (patch.at(column, row), patch.at(column, row + 1));
                let distance = (ah + along * rise - (low + (high - low) * part)).abs();
                self.crossing(distance, part, [column, row], [column, row + 1]);
            }
        }
    }

    /// The samples on an edge of `steps` evenly spaced samples in a row, a column or a diagonal. All of its crossings are
    /// samples.
    fn along_samples(&mut self, [a, b]: [Spot; 2], steps: usize) {
        let (first, last) = (self.patch.of(a), self.patch.of(b));
        let rise = (last - first) / steps as f64;
        let (from, to) = (a.map(usize::from), b.map(usize::from));
        for step in 1..steps {
            let at = [0, 1].map(|axis| match from[axis].cmp(&to[axis]) {
                Ordering::Less => from[axis] + step,
                Ordering::Equal => from[axis],
                Ordering::Greater => from[axis] - step,
            });
            self.sample((first + step as f64 * rise - self.patch.at(at[0], at[1])).abs(), at);
        }
    }

    /// The samples inside a triangle, row by row. Those on its edges are found as crossings.
    fn inside(&mut self, plane: &Plane, corners: [Spot; 3]) {
        let patch = self.patch;
        let [top, middle, bottom] = sorted(corners);
        let places = [top, middle, bottom].map(|spot| patch.place(spot).map(f64::from));
        let rows = [top, middle, bottom].map(|spot| usize::from(spot[1]));
        if rows[2] <= rows[0] + 1 {
            return;
        }
        let long = (places[2][0] - places[0][0]) / (places[2][1] - places[0][1]);
        for row in rows[0] + 1..rows[2] {
            let y = f64::from(patch.down[row]);
            let first = places[0][0] + (y - places[0][1]) * long;
            let (from, to) = if row < rows[1] { (0, 1) } else { (1, 2) };
            let second = if row == rows[1] {
                places[1][0]
            } else {
                let short = (places[to][0] - places[from][0]) / (places[to][1] - places[from][1]);
                places[from][0] + (y - places[from][1]) * short
            };
            let (left, right) = if first < second { (first, second) } else { (second, first) };
            let start = patch.column(left).0 + 1;
            let (end, part) = patch.column(right);
            let end = end + usize::from(part > 0.0);
            let base = plane.height + (y - plane.at[1]) * plane.slope[1] - plane.at[0] * plane.slope[0];
            let line = patch.row(row);
            let samples = patch.across[start..end.max(start)].iter().zip(&line[start..end.max(start)]);
            for ((across, value), column) in samples.zip(start..) {
                let height = base + f64::from(*across) * plane.slope[0];
                let distance = (height - f64::from(*value)).abs();
                if distance >= self.distance {
                    self.sample(distance, [column, row]);
                }
            }
        }
    }
}

/// Corners sorted by row, then column.
fn sorted(mut corners: [Spot; 3]) -> [Spot; 3] {
    corners.sort_unstable_by_key(|spot| (spot[1], spot[0]));
    corners
}

/// The plane of a triangle, over half steps.
struct Plane {
    at: [f64; 2],
    height: f64,
    slope: [f64; 2],
}

impl Plane {
    fn new(patch: &Patch, corners: [Spot; 3]) -> Self {
        let [a, b, c] = corners;
        let [p, q, r] = corners.map(|spot| patch.place(spot).map(f64::from));
        let (u, v) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let (height, du, dv) = (patch.of(a), patch.of(b) - patch.of(a), patch.of(c) - patch.of(a));
        let area = u[0] * v[1] - u[1] * v[0];
        let slope = [(du * v[1] - dv * u[1]) / area, (dv * u[0] - du * v[0]) / area];
        Self { at: p, height, slope }
    }
}

/// The worst place of a triangle with some area.
pub(super) fn worst<T: Taken>(patch: &Patch, taken: &T, corners: [Spot; 3]) -> Worst {
    let mut search = Search { patch, taken, distance: 0.0, spot: [usize::MAX; 2] };
    let [a, b, c] = corners;
    search.edge(a, b);
    search.edge(b, c);
    search.edge(c, a);
    // A triangle with a sample inside spans two intervals in both directions.
    let spans = |axis: usize| {
        let [a, b, c] = corners.map(|spot| spot[axis]);
        a.max(b).max(c) - a.min(b).min(c)
    };
    let plane = Plane::new(patch, corners);
    if spans(0) > 1 && spans(1) > 1 {
        search.inside(&plane, corners);
    }
    let tolerance = &patch.tolerance;
    let rounding = tolerance.shift(plane.slope);
    if tolerance.bend.is_none() {
        return search.found(rounding);
    }
    let facet = spread(patch, &plane, corners);
    let heights = search.found(rounding + tolerance.bow(&facet));
    let share = tolerance.sagitta(&facet);
    if share <= heights.share { heights } else { heights.or(bowed(patch, taken, corners, share)) }
}

impl<T> Search<'_, T> {
    /// The place that was found. All distances grow by what rounding and the bow of the facet add, in mm.
    fn found(&self, more: f64) -> Worst {
        let error = self.patch.tolerance.error;
        if self.distance > 0.0 {
            let spot = self.spot.map(|at| u8::try_from(at).unwrap_or(0));
            return Worst { share: (self.distance + more) / error, spot };
        }
        // No sample helps.
        Worst { share: (more / error).min(1.0), ..Worst::NONE }
    }
}

/// The extent of a triangle.
fn spread(patch: &Patch, plane: &Plane, corners: [Spot; 3]) -> Facet {
    let (mut least, mut greatest) = ([i32::MAX; 2], [i32::MIN; 2]);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for spot in corners {
        let (place, height) = (patch.place(spot), patch.of(spot));
        for axis in 0..2 {
            (least[axis], greatest[axis]) = (least[axis].min(place[axis]), greatest[axis].max(place[axis]));
        }
        (low, high) = (low.min(height), high.max(height));
    }
    let size = [0, 1].map(|axis| f64::from(greatest[axis] - least[axis]));
    Facet { size, slope: plane.slope, extent: (low, high) }
}

/// Finds a sample that divides the widest edge of a triangle. `share` is the bow of the triangle, relative to its limit.
fn bowed<T: Taken>(patch: &Patch, taken: &T, corners: [Spot; 3], share: f64) -> Worst {
    let [a, b, c] = corners;
    let wide = |(a, b): &(Spot, Spot)| a[0].abs_diff(b[0]);
    let mut edge = (a, b);
    for other in [(b, c), (c, a)] {
        if wide(&other) > wide(&edge) {
            edge = other;
        }
    }
    let (a, b) = (edge.0.min(edge.1), edge.0.max(edge.1));
    let column = (usize::from(a[0]) + usize::from(b[0])) / 2;
    let middle = (usize::from(a[1]) + usize::from(b[1])) / 2;
    let rows = [middle, middle + 1].into_iter().filter(|row| *row <= patch.height);
    // A row beside the edge, if the middle is a vertex already.
    let near = rows.chain(middle.checked_sub(1));
    let free = near.into_iter().find(|row| !taken.taken(column, *row));
    match free {
        Some(row) if wide(&edge) > 1 => Worst { share, spot: [column, row].map(|at| u8::try_from(at).unwrap_or(0)) },
        _ => Worst::NONE,
    }
}
