//! Seams: positions of stitches and holes along a path.
use crate::ground::hash::Hash;
use glam::{DMat2, DVec2};
use shibo_value::{Path, Polyline};

/// The arrangement of stitches along curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// Distance between stitches, mm; adjusted so that a whole number of stitches fits each curve.
    pub pitch: f64,
    /// Length of a stitch, as a fraction of the pitch.
    pub length: f64,
    /// Sine and cosine of the angle between a stitch and the path.
    pub tilt: (f64, f64),
    /// The irregularity of stitches, 0..1.
    pub jitter: f64,
}

/// A stitch: its two ends, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    /// The point where the thread comes out of the ground.
    pub from: DVec2,
    /// The point where the thread goes in again.
    pub to: DVec2,
    /// The initial twist of its strands, in turns, 0..1.
    pub phase: f64,
    /// Its height relative to others, -1..1.
    pub lift: f64,
}

/// Stitches, and their holes: each a slit between two points, which may be equal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sewn {
    /// The stitches, in order.
    pub stitches: Vec<Stitch>,
    /// The holes.
    pub holes: Vec<[DVec2; 2]>,
}

/// Number of stitches for a curve of this length in mm.
pub fn count(length: f64, pitch: f64) -> f64 {
    (length / pitch).round().max(1.0)
}

impl Seam {
    /// Sews along all curves. Stitch n of curve c draws the numbers of `hash.with(c).with(n)`. O(pieces + stitches).
    pub fn sew(&self, path: &Path, hash: Hash) -> Sewn {
        let mut sewn = Sewn::default();
        for (c, curve) in (0..).zip(&path.curves) {
            self.sew_one(curve, hash.with(c), &mut sewn);
        }
        sewn
    }

    fn sew_one(&self, curve: &Polyline, hash: Hash, sewn: &mut Sewn) {
        let along = Along::new(curve);
        let count = count(along.length(), self.pitch);
        let pitch = along.length() / count;
        let first = sewn.stitches.len();
        let turn = DMat2::from_cols(DVec2::new(self.tilt.1, self.tilt.0), DVec2::new(-self.tilt.0, self.tilt.1));
        let mut k = 0.0;
        let mut number = 0;
        while k < count {
            let draw = |n: u64| (2.0 * hash.with(number).unit(n) - 1.0) * self.jitter;
            let middle = (k + 0.5 + 0.08 * draw(0)) * pitch;
            let half = 0.5 * self.length * pitch * (1.0 + 0.07 * draw(1));
            let (a, b) = (along.at(middle - half), along.at(middle + half));
            // At a sharp corner both ends may be the same point.
            let way = (b - a).normalize_or(DVec2::X);
            let half = 0.5 * a.distance(b);
            // The irregularity turns it by up to 8°.
            let uneven = DVec2::new(1.0, 0.14 * draw(2)).normalize();
            let half_way = turn * uneven.rotate(way) * half;
            let middle = 0.5 * (a + b) + way.perp() * (0.03 * pitch * draw(3));
            let phase = hash.with(number).unit(4);
            sewn.stitches.push(Stitch { from: middle - half_way, to: middle + half_way, phase, lift: draw(5) });
            k += 1.0;
            number += 1;
        }
        self.holes(curve, pitch, first, sewn);
    }

    /// Adds the holes. Two ends that are closer than half a pitch share a hole.
    fn holes(&self, curve: &Polyline, pitch: f64, first: usize, sewn: &mut Sewn) {
        let stitches = &sewn.stitches[first..];
        let (Some(begin), Some(end)) = (stitches.first(), stitches.last()) else { return };
        let mut between = |a: DVec2, b: DVec2| {
            if a.distance(b) < 0.5 * pitch {
                sewn.holes.push([a, b]);
            } else {
                sewn.holes.extend([[a; 2], [b; 2]]);
            }
        };
        stitches.windows(2).for_each(|pair| between(pair[0].to, pair[1].from));
        if curve.closed {
            let around = curve.points.last().copied().unwrap_or_default() - curve.points[0];
            between(end.to, begin.from + around);
        } else {
            sewn.holes.extend([[begin.from; 2], [end.to; 2]]);
        }
    }
}

/// A curve parametrised by its length.
struct Along<'a> {
    curve: &'a Polyline,
    /// Length in mm up to each of its points.
    lengths: Vec<f64>,
}

impl<'a> Along<'a> {
    fn new(curve: &'a Polyline) -> Self {
        let mut sum = 0.0;
        let mut lengths = vec![0.0];
        lengths.extend(curve.points.windows(2).map(|pair| {
            sum += pair[0].distance(pair[1]);
            sum
        }));
        Self { curve, lengths }
    }

    fn length(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0)
    }

    /// The point at a length in mm. A closed curve continues around, an open one is extended straight.
    fn at(&self, along: f64) -> DVec2 {
        let (points, length) = (&self.curve.points, self.length());
        let (mut along, mut shift) = (along, DVec2::ZERO);
        if self.curve.closed && length > 0.0 {
            let rounds = (along / length).floor();
            along -= rounds * length;
            shift = (points[points.len() - 1] - points[0]) * rounds;
        }
        let after = self.lengths.partition_point(|l| *l <= along).clamp(1, points.len() - 1);
        let (from, to) = (points[after - 1], points[after]);
        let piece = self.lengths[after] - self.lengths[after - 1];
        from + (to - from) * ((along - self.lengths[after - 1]) / piece) + shift
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::pen::Pen;
    use shibo_value::Tiling;

    fn line(points: &[(f64, f64)], tiling: Tiling) -> Path {
        let mut pen = Pen::default();
        pen.move_to(points[0].into());
        points[1..].iter().for_each(|p| pen.line_to((*p).into()));
        pen.finish(DVec2::splat(20.0), tiling)
    }

    const SEAM: Seam = Seam { pitch: 3.0, length: 0.8, tilt: (0.0, 1.0), jitter: 0.0 };

    #[test]
    fn stitches_fit_an_open_line() {
        // 10 mm make three stitches of 3⅓ mm.
        let sewn = SEAM.sew(&line(&[(2.0, 5.0), (12.0, 5.0)], Tiling::NONE), Hash::new(1));
        assert_eq!(sewn.stitches.len(), 3);
        let p = 10.0 / 3.0;
        for (k, stitch) in (0..).zip(&sewn.stitches) {
            let middle = 2.0 + (f64::from(k) + 0.5) * p;
            assert!(stitch.from.distance(DVec2::new(middle - 0.4 * p, 5.0)) < 1e-12, "{stitch:?}");
            assert!(stitch.to.distance(DVec2::new(middle + 0.4 * p, 5.0)) < 1e-12);
        }
        // Two shared ones between stitches, and one at each end.
        assert_eq!(sewn.holes.len(), 4);
        assert!((sewn.holes[0][1].x - sewn.holes[0][0].x - 0.2 * p).abs() < 1e-12);
        // With long gaps each end has its own hole.
        let sewn = Seam { length: 0.4, ..SEAM }.sew(&line(&[(2.0, 5.0), (12.0, 5.0)], Tiling::NONE), Hash::new(1));
        assert_eq!(sewn.holes.len(), 6);
    }

    #[test]
    fn a_line_round_the_canvas_joins() {
        let path = line(&[(-4.0, 3.0), (16.0, 3.0)], Tiling::BOTH);
        assert!(path.curves[0].closed);
        let sewn = Seam { tilt: (0.28, 0.96), ..SEAM }.sew(&path, Hash::new(1));
        assert_eq!((sewn.stitches.len(), sewn.holes.len()), (7, 7));
        let p = 20.0 / 7.0;
        // Each stitch is the previous one shifted by a pitch; the last hole leads to the first stitch, one canvas
        // further.
        for pair in sewn.stitches.windows(2) {
            assert!((pair[1].from - pair[0].from).distance(DVec2::new(p, 0.0)) < 1e-12);
        }
        let way = sewn.stitches[0].to - sewn.stitches[0].from;
        assert!(way.distance(DVec2::new(0.96, 0.28) * 0.8 * p) < 1e-12);
        assert!(sewn.holes[6][1].distance(sewn.stitches[0].from + DVec2::new(20.0, 0.0)) < 1e-12);
        assert!(
            sewn.holes.iter().all(|[a, b]| (a.distance(*b) - sewn.holes[0][0].distance(sewn.holes[0][1])).abs() < 1e-9)
        );
    }

    #[test]
    fn jitter_is_small_and_deterministic() {
        let path = line(&[(0.0, 0.0), (10.0, 0.0), (10.0, 12.0)], Tiling::NONE);
        let (even, seam) = (SEAM.sew(&path, Hash::new(3)), Seam { jitter: 1.0, ..SEAM });
        let uneven = seam.sew(&path, Hash::new(3));
        assert_eq!(uneven, seam.sew(&path, Hash::new(3)));
        assert_ne!(uneven, seam.sew(&path, Hash::new(4)));
        for (a, b) in even.stitches.iter().zip(&uneven.stitches) {
            assert!(a.from != b.from && a.from.distance(b.from) < 0.7 && a.to.distance(b.to) < 0.7);
        }
    }
}
