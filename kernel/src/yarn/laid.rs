//! Threads on the canvas, and their drawing.
//!
//! A segment of a thread covers the points between the planes across its ends, so segments share no points where the
//! thread bends less than its radius. Between its ends the line is a cubic. Each pixel keeps the two highest threads
//! and blends them by their coverage. O(pixels of segments near).
use super::lines::Line;
use super::section::{Spun, Yarn};
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::number::{index_u32, narrow};
use crate::ground::window::{Frame, WindowExt as _, index};
use crate::path::index::{Index, Near, each};
use glam::{DVec2, DVec3, Vec2};
use shibo_value::Tiling;

/// A point of a thread.
#[derive(Clone, Copy, Debug)]
struct Point {
    at: DVec2,
    /// Unit vector along the thread.
    way: DVec2,
    z: f64,
    /// Rise per mm on the canvas.
    slope: f64,
    /// Place along the thread, mm.
    s: f64,
    /// Relative width.
    fat: f64,
}

/// A segment from a point to the next one; mm, from its first point.
#[derive(Clone, Copy, Debug)]
struct Segment {
    first: DVec2,
    chord: Vec2,
    length: f32,
    /// Directions of the thread, heights, slopes, and relative widths at both ends.
    ways: [Vec2; 2],
    z: [f32; 2],
    slopes: [f32; 2],
    fat: [f32; 2],
    /// Places along the thread.
    s: [f64; 2],
    thread: u32,
    part: u32,
}

/// Threads on a canvas, sorted into bins.
#[derive(Clone, Debug)]
pub struct Laid {
    segments: Vec<Segment>,
    threads: Vec<Spun>,
    index: Index,
    size: DVec2,
    /// Largest half width.
    reach: f64,
    /// Height of the highest place, mm.
    pub top: f64,
}

/// The place of a point on a segment.
#[derive(Clone, Copy, Debug)]
struct Local {
    /// Along the thread, mm.
    s: f64,
    /// Across it, mm.
    v: f32,
    /// Height of the axis, mm.
    z: f32,
    /// Direction of the thread.
    way: Vec2,
    /// Relative width.
    fat: f32,
}

/// One pixel of the threads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bit {
    /// Height, mm; 0 where there is no thread.
    pub height: f32,
    /// Coverage, 0..1.
    pub mask: f32,
    /// Number of the segment, from 1; 0 where there is no thread.
    pub segment: u32,
}

/// Details of a pixel, of the thread that shows there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Detail {
    /// Number of the thread, from 1; 0 where there is none.
    pub thread: u32,
    /// Number of the part of the thread.
    pub part: u32,
    /// Place along the thread, mm.
    pub along: f32,
    /// Place across it, -1..1.
    pub across: f32,
    /// Direction of the fibres.
    pub direction: Vec2,
    /// 1 on the crowns of plies, 0 in creases.
    pub crown: f32,
    /// 0 between fibres, 1 on them.
    pub fiber: f32,
}

impl Segment {
    fn new([a, b]: [&Point; 2], thread: u32, part: u32) -> Self {
        let chord = b.at - a.at;
        let both = |of: fn(&Point) -> f64| [narrow(of(a)), narrow(of(b))];
        Self {
            first: a.at,
            chord: chord.as_vec2(),
            length: narrow(chord.length()),
            ways: [a.way.as_vec2(), b.way.as_vec2()],
            z: both(|p| p.z),
            slopes: both(|p| p.slope),
            fat: both(|p| p.fat),
            s: [a.s, b.s],
            thread,
            part,
        }
    }

    /// Two corners of a rectangle that contains the segment of a thread of this half width, from its first end.
    fn bounds(&self, half: f32, pixel: f32) -> [Vec2; 2] {
        let half = half * self.fat[0].max(self.fat[1]) + pixel;
        let [a, b] = self.ways.map(|way| way.perp() * half);
        let ends = [a, -a, self.chord + b, self.chord - b];
        // Between its ends the outline bends outwards.
        let bend = 0.5 * (1.0 - self.ways[0].dot(self.ways[1])) * half + 0.2 * self.length + pixel;
        let low = ends.into_iter().reduce(Vec2::min).unwrap_or_default();
        let high = ends.into_iter().reduce(Vec2::max).unwrap_or_default();
        [low - bend, high + bend]
    }

    /// The place of a point, given from the first end; `None` if it lies before or behind the segment.
    #[inline(always)]
    fn local(&self, p: Vec2) -> Option<Local> {
        let [a, b] = self.ways;
        let (before, behind) = (p.dot(a), (self.chord - p).dot(b));
        let whole = before + behind;
        if before < 0.0 || behind < 0.0 || whole <= 0.0 {
            return None;
        }
        let t = before / whole;
        // A cubic with the directions of the ends.
        let (t2, t3) = (t * t, t * t * t);
        let (start, end, up) = (self.length * (t3 - 2.0 * t2 + t), self.length * (t3 - t2), 3.0 * t2 - 2.0 * t3);
        let at = self.chord * up + a * start + b * end;
        let z = self.z[0] + (self.z[1] - self.z[0]) * up + self.slopes[0] * start + self.slopes[1] * end;
        let way = (a + (b - a) * t).normalize_or(Vec2::X);
        let fat = self.fat[0] + (self.fat[1] - self.fat[0]) * up;
        let s = self.s[0] + (self.s[1] - self.s[0]) * f64::from(t);
        Some(Local { s, v: way.perp_dot(p - at), z, way, fat })
    }
}

/// A candidate for a pixel.
#[derive(Clone, Copy, Default)]
struct Layer {
    height: f32,
    mask: f32,
    /// Index of the near segment plus 1; 0 for none.
    near: u32,
}

impl Laid {
    /// Lays lines of yarns on a canvas of `size` mm, on which they repeat. The lowest place has height 0.
    pub fn new(lines: &[Line], yarns: &[Yarn], size: DVec2, hash: Hash) -> Self {
        let (mut segments, mut threads, mut boxes) = (Vec::new(), Vec::new(), Vec::new());
        let mut points = Vec::new();
        let mut low = f64::INFINITY;
        let (mut high, mut reach) = (0.0_f64, 0.0_f64);
        for (number, line) in lines.iter().enumerate() {
            let Some(yarn) = yarns.get(line.yarn) else { continue };
            points.clear();
            let length = append(line, &mut points);
            let spun = Spun::new(*yarn, length, hash.with(number as u64));
            for point in &mut points {
                point.fat = spun.fat(point.s, length);
                low = low.min(point.z - yarn.thickness * point.fat);
                high = high.max(point.z + yarn.thickness * point.fat);
                reach = reach.max(yarn.width * point.fat);
            }
            for (pair, part) in points.windows(2).zip(&line.parts) {
                segments.push(Segment::new([&pair[0], &pair[1]], index_u32(threads.len()), *part));
                boxes.push([pair[0].at, pair[1].at]);
            }
            threads.push(spun);
        }
        let low = if low.is_finite() { low } else { 0.0 };
        segments.iter_mut().for_each(|segment: &mut Segment| segment.z = segment.z.map(|z| z - narrow(low)));
        let index = Index::new(&boxes, (size, Tiling::BOTH));
        Self { segments, threads, index, size, reach, top: high - low }
    }

    /// Number of threads.
    pub fn count(&self) -> usize {
        self.threads.len()
    }

    /// Draws the threads into a window, row by row, and overwrites `out`.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn fill(&self, stop: &dyn Fn() -> bool, frame: &Frame, out: &mut [Bit]) {
        let pixel = narrow((frame.step[0] * frame.step[1]).sqrt());
        let around = self.reach + f64::from(pixel);
        let found = self.index.near_window(frame, around);
        let mut layers = vec![[Layer::default(); 2]; out.len()];
        for (n, near) in (1_u32..).zip(&found) {
            if n % 64 == 0 && stop() {
                return;
            }
            let segment = &self.segments[near.id as usize];
            let spun = &self.threads[segment.thread as usize];
            let first = segment.first + near.shift;
            let (half, thick) = (narrow(spun.yarn.width), narrow(spun.yarn.thickness));
            let [low, high] = segment.bounds(half, pixel);
            each(frame, first + low.as_dvec2(), first + high.as_dvec2(), &mut |k, p| {
                let Some(local) = segment.local((p - first).as_vec2()) else { return };
                let half = half * local.fat;
                let mask = math::saturate((half - local.v.abs()) / pixel + 0.5);
                let old = &mut layers[k];
                if mask <= 0.0 || (old[0].mask >= 1.0 && local.z + local.fat * thick <= old[0].height) {
                    return;
                }
                let height = local.z + local.fat * spun.skin(local.s, local.v / half, pixel).top;
                put(old, Layer { height, mask, near: n });
            });
        }
        let columns = frame.window.columns().max(1);
        for (k, (out, layers)) in out.iter_mut().zip(&layers).enumerate() {
            let at = (frame.window.x + index(k % columns), frame.window.y + index(k / columns));
            *out = self.joined(layers, &found, (DVec2::from(frame.center(at.0, at.1)), pixel));
        }
    }

    /// The blend of the two highest threads of a pixel, with their fibres.
    fn joined(&self, layers: &[Layer; 2], found: &[Near], (p, pixel): (DVec2, f32)) -> Bit {
        let mut bit = Bit::default();
        let hidden = usize::from(layers[0].mask >= 1.0);
        for layer in layers[..2 - hidden].iter().rev().filter(|layer| layer.near > 0) {
            let near = found[layer.near as usize - 1];
            let segment = &self.segments[near.id as usize];
            let Some(local) = segment.local((p - segment.first - near.shift).as_vec2()) else { continue };
            let spun = &self.threads[segment.thread as usize];
            let mut height = layer.height;
            if spun.yarn.relief > 0.0 {
                let x = local.v / (local.fat * narrow(spun.yarn.width));
                let fiber = spun.fiber(local.s, &spun.skin(local.s, x, pixel), pixel);
                height += narrow(spun.yarn.relief) * fiber * math::saturate(1.0 - x * x);
            }
            let height = height.max(0.0);
            let shows = layer.mask >= 0.5 || bit.segment == 0;
            bit = Bit {
                height: math::lerp(bit.height, height, layer.mask),
                mask: 1.0 - (1.0 - bit.mask) * (1.0 - layer.mask),
                segment: if shows { near.id + 1 } else { bit.segment },
            };
        }
        bit
    }

    /// Details at a point of the segment that shows there, with the number that [`Self::fill`] gives.
    pub fn detail(&self, segment: u32, p: DVec2, pixel: f32) -> Detail {
        let Some(segment) = segment.checked_sub(1).and_then(|n| self.segments.get(n as usize)) else {
            return Detail { direction: Vec2::X, ..Detail::default() };
        };
        let middle = 0.5 * segment.chord;
        let away = p - segment.first - middle.as_dvec2();
        let place = (away - (away / self.size).round() * self.size).as_vec2() + middle;
        // Rounding may move the point past an end.
        let local = segment.local(place).or_else(|| segment.local(middle));
        let Some(local) = local else { return Detail { direction: Vec2::X, ..Detail::default() } };
        let spun = &self.threads[segment.thread as usize];
        let x = math::clamp(local.v / (local.fat * narrow(spun.yarn.width)), -1.0, 1.0);
        let skin = spun.skin(local.s, x, pixel);
        let fiber = spun.fiber(local.s, &skin, pixel);
        let turned = (local.way + local.way.perp() * spun.slant(&skin)).normalize_or(Vec2::X);
        Detail {
            thread: segment.thread + 1,
            part: segment.part,
            along: narrow(local.s),
            across: x,
            direction: turned,
            crown: math::saturate(skin.crown),
            fiber: math::saturate(0.5 + 0.5 * fiber),
        }
    }
}

/// Adds the points of a line and its first repeat; returns its length in mm.
fn append(line: &Line, points: &mut Vec<Point>) -> f64 {
    let n = line.points.len();
    let at = |k: usize| {
        let turns = (k / n) as f64;
        line.points[k % n] + DVec3::new(line.period.x * turns, line.period.y * turns, 0.0)
    };
    let mut s = 0.0;
    for k in n..=2 * n {
        let shift = DVec3::new(line.period.x, line.period.y, 0.0);
        let [before, here, next] = [k - 1, k, k + 1].map(|k| at(k) - shift);
        let step = next - before;
        let flat = step.truncate();
        let way = flat.normalize_or(line.period.normalize_or(DVec2::X));
        let slope = step.z / flat.length().max(1e-9);
        points.push(Point { at: here.truncate(), way, z: here.z, slope: slope.clamp(-4.0, 4.0), s, fat: 1.0 });
        s += (next - here).length();
    }
    // The last point repeats the first one, and adds no length.
    points.last().map_or(s, |last| last.s)
}

/// Adds a candidate to the two of a pixel.
#[inline(always)]
fn put(layers: &mut [Layer; 2], new: Layer) {
    if layers[0].near == 0 || new.height > layers[0].height {
        layers[1] = layers[0];
        layers[0] = new;
    } else if layers[1].near == 0 || new.height > layers[1].height {
        layers[1] = new;
    }
}
