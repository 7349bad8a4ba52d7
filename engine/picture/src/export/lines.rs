//! Level lines of a height on the canvas, in mm with y down.
use super::heights::{HeightMap, Stop, refused};
use crate::WriteError;
use crate::value::diagnostics::Code;
use crate::value::{Polyline, Tiling};
use glam::{DVec2, UVec2};
use shibo_kernel::path::contour::Mask;
use std::io::{self, Write};

/// The most samples of a height whose level lines are made.
const MOST: u64 = 1 << 27;

/// Distance in pixels within which a point lies on the rim.
const RIM: f64 = 1e-3;

/// A line; the end of a closed one is its beginning.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    pub points: Vec<DVec2>,
    pub closed: bool,
}

/// Samples at pixel centres, and a row of samples around them on the rim of the canvas.
pub(super) struct Rimmed(Mask);

impl Rimmed {
    /// The samples of `map` with values on the rim; `rim` makes them of the pixel at the rim and the one across the canvas.
    fn samples(map: &HeightMap, rim: impl Fn(f32, f32) -> f32) -> Result<(Vec<f32>, UVec2), WriteError> {
        let size = map.size + 2;
        if u64::from(size.x) * u64::from(size.y) > MOST {
            let message = format!(
                "level lines are made of at most {MOST} samples; the height has {} × {}",
                map.size.x, map.size.y
            );
            return Err(refused(Code::TooLarge, message, "lower the resolution, for example with `--resolution`"));
        }
        let (w, h) = (map.size.x, map.size.y);
        let mut values = Vec::with_capacity(size.x as usize * size.y as usize);
        let mut wide = |row: &[f32]| {
            let (first, last) = (row[0], row[row.len() - 1]);
            values.push(rim(first, last));
            values.extend_from_slice(row);
            values.push(rim(last, first));
        };
        let across = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| rim(*a, *b)).collect::<Vec<_>>();
        wide(&across(map.row(0), map.row(h - 1)));
        (0..h).for_each(|y| wide(map.row(y)));
        wide(&across(map.row(h - 1), map.row(0)));
        debug_assert_eq!(values.len(), (w as usize + 2) * (h as usize + 2));
        Ok((values, size))
    }

    fn new((values, size): (Vec<f32>, UVec2)) -> Self {
        Self(Mask::new(values, size, DVec2::ONE, Tiling::NONE))
    }

    /// The samples with those on the rim: the mean of the pixels that meet there where the height repeats, else the
    /// nearest pixel.
    pub(super) fn of(map: &HeightMap) -> Result<Self, WriteError> {
        let (mut values, size) = Self::samples(map, |own, _| own)?;
        let (w, h) = (size.x as usize, size.y as usize);
        let mut meet = |a: usize, b: usize| {
            let mean = 0.5 * (values[a] + values[b]);
            (values[a], values[b]) = (mean, mean);
        };
        if map.wraps[0] {
            (0..h).for_each(|y| meet(y * w, y * w + w - 1));
        }
        if map.wraps[1] {
            (0..w).for_each(|x| meet(x, (h - 1) * w + x));
        }
        Ok(Self::new((values, size)))
    }

    /// Hands out the lines on which the samples have the values `levels`, which rise, in mm; and the index of the level.
    /// `None` if stopped.
    pub(super) fn levels(
        &self,
        map: &HeightMap,
        levels: &[f64],
        stop: Stop<'_>,
        each: &mut dyn FnMut(usize, Vec<Line>),
    ) -> Option<()> {
        let inner = map.size.as_dvec2();
        let axis = |u: f64, inner: f64| match u - 0.5 {
            u if u < 1.0 => 0.5 * u.max(0.0),
            u if u > inner => inner - 0.5 * (inner + 1.0 - u).max(0.0),
            u => u - 0.5,
        };
        let mm = |p: DVec2| DVec2::new(axis(p.x, inner.x), axis(p.y, inner.y)) * map.pixel;
        self.traced(levels, stop, mm, each)
    }

    /// Hands out the lines, whose points `mm` moves from samples to mm.
    fn traced(
        &self,
        levels: &[f64],
        stop: Stop<'_>,
        mm: impl Fn(DVec2) -> DVec2,
        each: &mut dyn FnMut(usize, Vec<Line>),
    ) -> Option<()> {
        let line = |curve: &Polyline| {
            let mut points: Vec<DVec2> = curve.points.iter().map(|p| mm(*p)).collect();
            points.dedup();
            Line { points, closed: curve.closed }
        };
        self.0.levels(levels, &|| stop(), &mut |level, found| {
            each(level, found.curves.iter().map(line).filter(|line| line.points.len() > 1).collect());
        })
    }
}

/// The closed outlines of the areas below a level; areas at the rim of the canvas end there. `None` if stopped.
pub(super) fn outlines(map: &HeightMap, level: f64, stop: Stop<'_>) -> Result<Option<Vec<Line>>, WriteError> {
    // A value on the other side of the level, as far away, closes the outline half-way to it: on the rim.
    let beyond = |own: f32, _: f32| {
        #[expect(clippy::cast_possible_truncation, reason = "heights are f32")]
        let across = (2.0 * level - f64::from(own)) as f32;
        own.max(across)
    };
    // Samples on the rim stand for samples half a pixel farther out.
    let inner = map.size.as_dvec2();
    // Rounding moves points a little off the rim.
    let axis = |u: f64, inner: f64| match u - 1.0 {
        u if u < RIM => 0.0,
        u if u > inner - RIM => inner,
        u => u,
    };
    let mm = |p: DVec2| DVec2::new(axis(p.x, inner.x), axis(p.y, inner.y)) * map.pixel;
    let (mut lines, tolerance) = (None, 0.1 * map.pixel.min_element());
    let rimmed = Rimmed::new(Rimmed::samples(map, beyond)?);
    let whole = rimmed.traced(&[level], stop, mm, &mut |_, found| lines = Some(found));
    let Some(mut lines) = whole.and(lines) else { return Ok(None) };
    for line in &mut lines {
        if stop() {
            return Ok(None);
        }
        line.points = with_corners(&line.points, map);
        line.points = simplified(line, tolerance);
    }
    Ok(Some(lines))
}

/// Adds the corner of the canvas between points on both of its sides that are a pixel apart.
fn with_corners(points: &[DVec2], map: &HeightMap) -> Vec<DVec2> {
    let far = map.size.as_dvec2() * map.pixel;
    let on_rim = |p: DVec2| [p.x == 0.0 || p.x == far.x, p.y == 0.0 || p.y == far.y];
    let mut all = Vec::with_capacity(points.len() + 4);
    for (k, p) in points.iter().enumerate() {
        let before = if k == 0 { *p } else { points[k - 1] };
        if (*p - before).abs().cmple(map.pixel).all() {
            match (on_rim(before), on_rim(*p)) {
                ([true, false], [false, true]) => all.push(DVec2::new(before.x, p.y)),
                ([false, true], [true, false]) => all.push(DVec2::new(p.x, before.y)),
                _ => {}
            }
        }
        all.push(*p);
    }
    all
}

/// The points that are left if none of the others is farther than `tolerance` from the line: D. Douglas, T. Peucker,
/// "Algorithms for the reduction of the number of points required to represent a digitized line" (1973).
pub(super) fn simplified(line: &Line, tolerance: f64) -> Vec<DVec2> {
    let points = &line.points;
    if points.len() < 3 {
        return points.clone();
    }
    let mut kept = vec![false; points.len()];
    let last = points.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    if line.closed {
        // The ends are one point, so the line is divided at the point farthest away.
        let far = |k: &usize| points[*k].distance_squared(points[0]);
        let middle = (1..last).max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(last);
        kept[middle] = true;
        open = vec![(0, middle), (middle, last)];
    }
    while let Some((from, to)) = open.pop() {
        let (mut worst, mut at) = (tolerance, None);
        for k in from + 1..to {
            let off = distance(points[k], points[from], points[to]);
            if off > worst {
                (worst, at) = (off, Some(k));
            }
        }
        if let Some(k) = at {
            kept[k] = true;
            open.extend([(from, k), (k, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

/// Distance of a point from a straight piece.
fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let way = b - a;
    let share = if way == DVec2::ZERO { 0.0 } else { ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0) };
    p.distance(a + share * way)
}

/// Writes lines as the data of an SVG path, to 1/1000 mm.
pub(super) fn write_path(out: &mut dyn Write, lines: &[Line]) -> io::Result<()> {
    for line in lines {
        let points = if line.closed { &line.points[..line.points.len() - 1] } else { &line.points[..] };
        for (k, p) in points.iter().enumerate() {
            write!(out, "{}{:.3} {:.3}", if k == 0 { 'M' } else { 'L' }, p.x, p.y)?;
        }
        if line.closed {
            out.write_all(b"Z")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_corners_and_drops_points_near_the_line() {
        let square = [(0.0, 0.0), (1.0, 0.001), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)];
        let line = |closed| Line { points: square.map(|(x, y)| DVec2::new(x, y)).to_vec(), closed };
        for closed in [true, false] {
            let kept = simplified(&line(closed), 0.01);
            assert_eq!(
                kept,
                [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (0.0, 0.0)].map(|(x, y)| DVec2::new(x, y))
            );
        }
        assert_eq!(simplified(&line(true), 0.0).len(), 6, "a point on the line is no corner");
    }

    /// Points that are dropped lie within the tolerance of the line that is left.
    #[test]
    fn never_leaves_the_tolerance() {
        let wave = |k: u32| DVec2::new(f64::from(k) * 0.1, (f64::from(k) * 0.7).sin() + (f64::from(k) * 0.13).cos());
        let line = Line { points: (0..300).map(wave).collect(), closed: false };
        for tolerance in [0.001, 0.05, 0.4] {
            let kept = simplified(&line, tolerance);
            for p in &line.points {
                let off = kept.windows(2).map(|pair| distance(*p, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
                assert!(off <= tolerance + 1e-12, "{off}");
            }
        }
    }
}
