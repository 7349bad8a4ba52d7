//! Streamlines: evenly spaced lines that follow a direction field.
//!
//! After B. Jobard and W. Lefer, *Creating Evenly-Spaced Streamlines of Arbitrary Density* (1997): a line grows from
//! its seed in both directions until it comes too close to another one. Here seeds are tried in a fixed random order.
//! O(length of all lines / step).
use super::pen::Pen;
use glam::DVec2;
use shibo_value::{Stop, Tiling};

/// Parameters of streamlines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Streams {
    /// Distance between lines, mm.
    pub spacing: f64,
    /// Maximum length of a line, mm.
    pub length: f64,
    /// Minimum length of a line, mm.
    pub shortest: f64,
    /// The canvas, mm.
    pub size: DVec2,
    /// Directions in which the canvas repeats.
    pub tiling: Tiling,
}

/// Number of steps per spacing.
const STEPS: f64 = 5.0;

/// Minimum distance to another line, as a fraction of the spacing.
const CLOSE: f64 = 0.6;

/// The unit direction at a point, or 0 where lines end; `before` is the direction at the previous point.
pub type Heading<'a> = &'a dyn Fn(DVec2, Option<DVec2>) -> DVec2;

/// A point of a line.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: DVec2,
    line: usize,
    /// Number of steps from the seed, negative against the field.
    serial: i32,
}

/// The points of all lines, in cells.
struct Taken {
    cells: Vec<Vec<Spot>>,
    count: [i32; 2],
    cell: DVec2,
    spec: Streams,
}

impl Taken {
    #[expect(clippy::cast_possible_truncation, reason = "the caller bounds the number of cells")]
    fn new(spec: Streams) -> Self {
        let count = (spec.size / spec.spacing).floor().max(DVec2::ONE);
        let cells = vec![Vec::new(); count.element_product() as u32 as usize];
        Self { cells, count: [count.x as i32, count.y as i32], cell: spec.size / count, spec }
    }

    /// Index of a cell; `None` outside of the canvas in directions without repeats.
    fn number(&self, [x, y]: [i32; 2]) -> Option<usize> {
        let bring = |i: i32, n: i32, wraps: bool| {
            if wraps { Some(i.rem_euclid(n)) } else { Some(i).filter(|i| (0..n).contains(i)) }
        };
        let (x, y) = (bring(x, self.count[0], self.spec.tiling.x)?, bring(y, self.count[1], self.spec.tiling.y)?);
        usize::try_from(y * self.count[0] + x).ok()
    }

    #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
    fn cell(&self, p: DVec2) -> [i32; 2] {
        let at = (p / self.cell).floor();
        [at.x as i32, at.y as i32]
    }

    /// True if no line is nearer than `radius`, ignoring nearby points of its own line.
    fn free(&self, p: DVec2, radius: f64, own: Option<(usize, i32)>) -> bool {
        let [x, y] = self.cell(p);
        let size = self.spec.size;
        (-1..=1).flat_map(|j| (-1..=1).map(move |i| [x + i, y + j])).filter_map(|cell| self.number(cell)).all(|cell| {
            self.cells[cell].iter().all(|spot| {
                if own.is_some_and(|(line, serial)| line == spot.line && (serial - spot.serial).abs() < 12) {
                    return true;
                }
                let mut way = p - spot.at;
                let whole = (way / size).round() * size;
                way.x -= if self.spec.tiling.x { whole.x } else { 0.0 };
                way.y -= if self.spec.tiling.y { whole.y } else { 0.0 };
                way.length() >= radius
            })
        })
    }

    fn inside(&self, p: DVec2) -> bool {
        let within = p.cmpge(DVec2::ZERO) & p.cmple(self.spec.size);
        (within.x || self.spec.tiling.x) && (within.y || self.spec.tiling.y)
    }
}

impl Streams {
    /// Number of cells of the search grid; the caller should limit it.
    pub fn cells(&self) -> f64 {
        (self.size / self.spacing).max(DVec2::ONE).element_product()
    }

    /// Draws lines from seeds, in their order.
    ///
    /// # Errors
    /// Errors of `check`, which is called before every line.
    pub fn draw(
        &self,
        seeds: impl Iterator<Item = DVec2>,
        heading: Heading<'_>,
        check: &dyn Fn() -> Result<(), Stop>,
        pen: &mut Pen,
    ) -> Result<(), Stop> {
        let mut taken = Taken::new(*self);
        for (line, seed) in seeds.enumerate() {
            if line % 256 == 0 {
                check()?;
            }
            if !taken.free(seed, 0.95 * self.spacing, None) || heading(seed, None) == DVec2::ZERO {
                continue;
            }
            let mut spots = vec![seed];
            self.grow((seed, line, 1), heading, &mut taken, &mut spots);
            spots.reverse();
            self.grow((seed, line, -1), heading, &mut taken, &mut spots);
            let length: f64 = spots.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
            if length < self.shortest {
                for p in &spots {
                    let number = taken.number(taken.cell(*p));
                    number.into_iter().for_each(|cell| taken.cells[cell].retain(|spot| spot.line != line));
                }
                continue;
            }
            // From the end against the field to the end along it.
            let mut spots = spots.into_iter().rev();
            spots.next().into_iter().for_each(|p| pen.move_to(p));
            spots.for_each(|p| pen.line_to(p));
        }
        Ok(())
    }

    /// Follows the field from a seed or, with -1, goes against it, by the midpoint rule.
    fn grow(
        &self,
        (seed, line, way): (DVec2, usize, i32),
        heading: Heading<'_>,
        taken: &mut Taken,
        out: &mut Vec<DVec2>,
    ) {
        let step = self.spacing / STEPS;
        let add = |taken: &mut Taken, at: DVec2, serial: i32| {
            if let Some(cell) = taken.number(taken.cell(at)) {
                taken.cells[cell].push(Spot { at, line, serial });
            }
        };
        if way > 0 {
            add(taken, seed, 0);
        }
        let (mut at, mut before) = (seed, heading(seed, None) * f64::from(way));
        let (mut gone, mut serial) = (step, way);
        while gone <= 0.5 * self.length {
            let first = heading(at, Some(before));
            let middle = heading(at + first * (0.5 * step), Some(first));
            let to = at + middle * step;
            if first == DVec2::ZERO || middle == DVec2::ZERO || !taken.inside(to) {
                return;
            }
            if !taken.free(to, CLOSE * self.spacing, Some((line, serial))) {
                return;
            }
            add(taken, to, serial);
            out.push(to);
            (at, before) = (to, middle);
            gone += step;
            serial += way;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use shibo_value::Path;

    fn lines(spec: Streams, heading: Heading<'_>) -> Path {
        let hash = Hash::new(3);
        let seeds = (0..3000).map(|n| DVec2::new(hash.unit(2 * n), hash.unit(2 * n + 1)) * spec.size);
        let mut pen = Pen::default();
        spec.draw(seeds, heading, &|| Ok(()), &mut pen).unwrap();
        pen.finish(spec.size, spec.tiling)
    }

    const SPEC: Streams =
        Streams { spacing: 1.0, length: 12.0, shortest: 2.0, size: DVec2::new(20.0, 16.0), tiling: Tiling::BOTH };

    #[test]
    fn lines_follow_the_field_and_keep_apart() {
        let along = |p: DVec2, before: Option<DVec2>| {
            let way = (p - DVec2::new(10.0, -9.0)).perp().normalize();
            if before.is_some_and(|before| before.dot(way) < 0.0) { -way } else { way }
        };
        let spec = Streams { tiling: Tiling::NONE, ..SPEC };
        let path = lines(spec, &along);
        assert!(path.curves.len() > 20, "{}", path.curves.len());
        for (n, curve) in path.curves.iter().enumerate() {
            assert!(curve.length() > 1.999 && curve.length() < 12.001);
            // Circles around one centre.
            let radius = |p: &DVec2| p.distance(DVec2::new(10.0, -9.0));
            assert!(curve.points.iter().all(|p| (radius(p) - radius(&curve.points[0])).abs() < 0.01));
            for other in &path.curves[..n] {
                let near = |p: &DVec2| other.points.iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
                assert!(curve.points.iter().all(|p| near(p) > 0.599), "{n}");
            }
        }
        // The lines fill the canvas.
        let covered: f64 = path.curves.iter().map(|c| c.length()).sum::<f64>() / (20.0 * 16.0);
        assert!(covered > 0.6, "{covered}");
    }

    #[test]
    fn lines_cross_the_border_and_end_without_a_field() {
        let path = lines(SPEC, &|_, before| before.unwrap_or(DVec2::X));
        assert!(path.curves.iter().any(|c| c.points.iter().any(|p| p.x < 0.0 || p.x > 20.0)));
        let path = lines(SPEC, &|p, before| if p.x < 10.0 { DVec2::ZERO } else { before.unwrap_or(DVec2::Y) });
        assert!(!path.is_empty() && path.pieces().all(|[a, b]| a.x >= 10.0 && b.x >= 10.0));
    }
}
