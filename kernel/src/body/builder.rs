//! Hands a body out, vertex by vertex and triangle by triangle, and measures it.
use super::tiles::Tiles;
use std::io;

/// A vertex of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Its number, counted from 0 in the order in which vertices are handed out.
    pub number: u32,
    /// Its place in mm, z up.
    pub at: [f32; 3],
}

/// Takes the vertices and triangles of a body. Each vertex comes before the triangles that use it.
pub trait Receiver {
    /// Takes the next vertex, in mm.
    ///
    /// # Errors
    /// The body cannot be written, or the work is cancelled.
    fn vertex(&mut self, at: [f32; 3]) -> io::Result<()>;

    /// Takes the next triangle, counter-clockwise seen from outside.
    ///
    /// # Errors
    /// As [`vertex`](Self::vertex).
    fn triangle(&mut self, corners: [Vertex; 3]) -> io::Result<()>;
}

/// Figures of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Number of triangles.
    pub triangles: u64,
    /// Number of vertices.
    pub vertices: u64,
    /// Volume in mm³.
    pub volume: f64,
    /// Surface in mm².
    pub area: f64,
    /// The steepest facet of the relief against its base, in degrees, and its place in mm.
    pub steepest: (f64, [f64; 3]),
    /// The share of the relief's area in facets that are steeper than allowed.
    pub over_limit: f64,
    /// The least and the greatest coordinate.
    pub bounds: [[f32; 3]; 2],
}

/// A sum of many numbers, with the part that rounding loses (Neumaier 1974).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    pub(super) fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        let lost = if self.sum.abs() >= value.abs() { (self.sum - sum) + value } else { (value - sum) + self.sum };
        (self.sum, self.lost) = (sum, self.lost + lost);
    }

    pub(super) fn total(self) -> f64 {
        self.sum + self.lost
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Numbers vertices, and sums up the figures.
pub(super) struct Builder<'r> {
    receiver: &'r mut dyn Receiver,
    figures: Figures,
    volume: Sum,
    area: Sum,
    /// The area of the relief, and that of its facets over the limit.
    relief: [Sum; 2],
    /// The cosine of the steepest slope that is allowed.
    limit: f64,
    /// The least cosine of a facet against its base.
    flattest: (f64, [f64; 3]),
}

impl<'r> Builder<'r> {
    /// A builder that counts facets steeper than `limit` degrees.
    pub(super) fn new(receiver: &'r mut dyn Receiver, limit: f64) -> Self {
        let bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let figures = Figures { bounds, ..Figures::default() };
        let (volume, area) = (Sum::default(), Sum::default());
        // Rounding does not count.
        let limit = libm::cos(limit.to_radians()) - 1e-9;
        Self { receiver, figures, volume, area, relief: [Sum::default(); 2], limit, flattest: (1.0, [0.0; 3]) }
    }

    pub(super) fn vertex(&mut self, at: [f32; 3]) -> io::Result<Vertex> {
        let number = u32::try_from(self.figures.vertices).map_err(|_| io::Error::other("too many vertices"))?;
        // Adding 0 turns -0 into 0.
        let at = at.map(|x| x + 0.0);
        self.figures.vertices += 1;
        for axis in 0..3 {
            let [least, greatest] = &mut self.figures.bounds;
            least[axis] = least[axis].min(at[axis]);
            greatest[axis] = greatest[axis].max(at[axis]);
        }
        self.receiver.vertex(at)?;
        Ok(Vertex { number, at })
    }

    pub(super) fn triangle(&mut self, corners: [Vertex; 3]) -> io::Result<()> {
        self.measured(corners).map(drop)
    }

    /// Adds a triangle; returns twice its area as a vector outwards.
    fn measured(&mut self, corners: [Vertex; 3]) -> io::Result<[f64; 3]> {
        let [a, b, c] = corners.map(|vertex| vertex.at.map(f64::from));
        let normal = cross(minus(b, a), minus(c, a));
        self.volume.add(dot(a, cross(b, c)) / 6.0);
        self.area.add(0.5 * dot(normal, normal).sqrt());
        self.figures.triangles += 1;
        self.receiver.triangle(corners)?;
        Ok(normal)
    }

    /// Adds a triangle of the relief. `up` gives the direction away from the base at a place.
    fn facet(&mut self, corners: [Vertex; 3], up: &dyn Fn([f64; 3]) -> [f64; 3]) -> io::Result<()> {
        let normal = self.measured(corners)?;
        let [a, b, c] = corners.map(|vertex| vertex.at.map(f64::from));
        let middle = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
        let up = up(middle);
        let cosine = dot(normal, up) / (dot(normal, normal) * dot(up, up)).sqrt();
        let area = 0.5 * dot(normal, normal).sqrt();
        self.relief[0].add(area);
        if cosine < self.limit {
            self.relief[1].add(area);
        }
        if cosine < self.flattest.0 {
            self.flattest = (cosine, middle);
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Figures {
        let steepest = (libm::acos(self.flattest.0.clamp(-1.0, 1.0)).to_degrees(), self.flattest.1);
        let [relief, over] = self.relief.map(Sum::total);
        let over_limit = if relief > 0.0 { over / relief } else { 0.0 };
        Figures { volume: self.volume.total(), area: self.area.total(), steepest, over_limit, ..self.figures }
    }
}

/// The vertices on the rims of a surface, with their columns or rows, rising.
#[derive(Default)]
pub(super) struct Rims {
    pub(super) top: Vec<(usize, Vertex)>,
    pub(super) bottom: Vec<(usize, Vertex)>,
    pub(super) left: Vec<(usize, Vertex)>,
    pub(super) right: Vec<(usize, Vertex)>,
}

/// How a surface lies in space.
pub(super) struct Lay<'a> {
    /// The number of repeats of the field in each direction.
    pub(super) repeats: [usize; 2],
    /// True if the last column is the first one.
    pub(super) closed: bool,
    /// The place of a sample, by its column and row, counted through all repeats, and its height.
    pub(super) place: &'a dyn Fn(usize, usize, f32) -> [f32; 3],
    /// The direction away from the base.
    pub(super) up: &'a dyn Fn([f64; 3]) -> [f64; 3],
}

/// Hands out a surface, block by block. Blocks share the vertices on their sides.
pub(super) fn surface(tiles: &Tiles, lay: &Lay<'_>, builder: &mut Builder<'_>) -> io::Result<Rims> {
    let [across, down] = tiles.count();
    let [wide, high] = [&tiles.columns, &tiles.rows].map(|cuts| cuts[cuts.len() - 1]);
    let columns = wide * lay.repeats[0];
    let none = Vertex { number: u32::MAX, at: [0.0; 3] };
    let (mut above, mut below) = (vec![none; columns + 1], vec![none; columns + 1]);
    let (mut left, mut right) = ([none; 65], [none; 65]);
    let mut first = [none; 65];
    let mut rims = Rims::default();
    let (blocks, lines) = (across * lay.repeats[0], down * lay.repeats[1]);
    for line in 0..lines {
        let meshes = tiles.line(line % down)?;
        for block in 0..blocks {
            let mesh = &meshes[block % across];
            let from = block / across * wide + tiles.columns[block % across];
            let top = line / down * high + tiles.rows[line % down];
            let [width, height] = mesh.size;
            let last = lay.closed && block + 1 == blocks;
            let mut vertices = Vec::with_capacity(mesh.spots.len());
            for ([x, y], z) in mesh.spots.iter().zip(&mesh.heights) {
                let (column, row) = (from + usize::from(*x), top + usize::from(*y));
                let shared = if *y == 0 && line > 0 {
                    Some(above[column])
                } else if *x == 0 && block > 0 {
                    Some(left[usize::from(*y)])
                } else if *x == width && last {
                    Some(first[usize::from(*y)])
                } else {
                    None
                };
                let vertex = match shared {
                    Some(vertex) => vertex,
                    None => builder.vertex((lay.place)(column, row, *z))?,
                };
                if *y == height {
                    below[column] = vertex;
                }
                if *x == width {
                    right[usize::from(*y)] = vertex;
                }
                if *x == 0 && block == 0 {
                    first[usize::from(*y)] = vertex;
                    if !lay.closed && (*y > 0 || line == 0) {
                        rims.left.push((row, vertex));
                    }
                }
                if !lay.closed && *x == width && block + 1 == blocks && (*y > 0 || line == 0) {
                    rims.right.push((row, vertex));
                }
                if *x > 0 || block == 0 {
                    if *y == 0 && line == 0 {
                        rims.top.push((column, vertex));
                    }
                    if *y == height && line + 1 == lines {
                        rims.bottom.push((column, vertex));
                    }
                }
                vertices.push(vertex);
            }
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|corner| vertices[usize::from(corner)]);
                builder.facet([a, c, b], lay.up)?;
            }
            std::mem::swap(&mut left, &mut right);
        }
        std::mem::swap(&mut above, &mut below);
    }
    for rim in [&mut rims.top, &mut rims.bottom, &mut rims.left, &mut rims.right] {
        rim.sort_unstable_by_key(|(at, _)| *at);
    }
    Ok(rims)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_keep_small_numbers() {
        let mut sum = Sum::default();
        [1e16, 1.0, -1e16, 3.0].into_iter().for_each(|value| sum.add(value));
        assert_eq!(sum.total(), 4.0);
    }
}
