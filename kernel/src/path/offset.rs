//! Parallel curves of a path.
//!
//! Each straight piece is moved to the side; where the path turns away, an arc joins two moved pieces. Parts of these
//! lines that lie nearer to the path than the offset are cut away. They begin and end where lines cross: lines on the
//! right, on the left, or around the ends of open curves. O(pieces · (pieces near each + log pieces)).
use super::index::Index;
use super::nearest::Nearest;
use super::pen::{Pen, TOLERANCE};
use crate::ground::number::index_u32;
use glam::DVec2;
use shibo_value::{Path, Polyline};

/// By how much less than the offset the distance from the path may be by rounding, mm. Arcs are made of straight pieces
/// that touch them from outside, so no line lies nearer to the piece that it was made from.
const SLACK: f64 = 1e-7;

/// Length of the shortest curve that is kept, mm; open ones must also be longer than a share of the offset. Where lines
/// cross at a small angle, short pieces of both are left over, because arcs are made of straight pieces.
const SHORTEST: f64 = 8.0 * TOLERANCE;
const SHORTEST_OPEN: f64 = 0.05;

/// A straight piece of a moved line.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: DVec2,
    to: DVec2,
    /// The piece that follows, and its shift by whole canvases.
    next: Option<(u32, DVec2)>,
    /// True on the side that is wanted; other pieces only cut.
    wanted: bool,
}

/// A place where a piece crosses another one.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// Share of the way along the piece, 0..1.
    at: f64,
    /// The other piece, its share, and the shift of its copy.
    other: u32,
    other_at: f64,
    shift: DVec2,
}

/// Part of a piece between two crossings: the piece, and the index of the crossing at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    piece: u32,
    number: usize,
}

/// The places at `distance` mm from a path, on its right if `distance` is above 0, else on its left; `None` if stopped.
/// Places nearer to any curve of the path than that are left out, so curves may be cut, joined or gone. They run in the
/// direction of the path.
pub fn offset(path: &Path, distance: f64, stop: &dyn Fn() -> bool) -> Option<Path> {
    if distance == 0.0 || path.is_empty() {
        return Some(path.clone());
    }
    let mut lines = Lines::default();
    for curve in &path.curves {
        lines.add(curve, distance);
    }
    lines.cross(path, stop)?;
    let nearest = Nearest::new(path);
    let reach = distance.abs() - SLACK;
    let mut pen = Pen::default();
    lines.follow(&|p| reach <= 0.0 || !nearest.is_within(p, reach), &mut pen, stop)?;
    let mut made = pen.finish(path.size_mm, path.periodic);
    let shortest = |closed: bool| if closed { SHORTEST } else { SHORTEST + SHORTEST_OPEN * distance.abs() };
    made.curves.retain(|curve| curve.length() > shortest(curve.closed));
    Some(made)
}

/// Moved lines.
#[derive(Debug, Default)]
struct Lines {
    pieces: Vec<Piece>,
    /// The crossings of each piece, in order.
    crossings: Vec<Vec<Crossing>>,
}

impl Lines {
    /// Adds the lines on both sides of a curve, and around its ends if it is open.
    fn add(&mut self, curve: &Polyline, distance: f64) {
        let around = curve.closed.then(|| curve.points[curve.points.len() - 1] - curve.points[0]);
        self.line(&moved(curve, distance), around, true);
        self.line(&moved(curve, -distance), around, false);
        if around.is_none() {
            let last = curve.points.len() - 1;
            for [end, before] in [[0, 1], [last, last - 1]].map(|ends| ends.map(|n| curve.points[n])) {
                let side = (end - before).normalize_or_zero().perp() * distance.abs();
                let mut cap = vec![end + side];
                arc(end, side, -side, -1.0, &mut cap);
                cap.push(end - side);
                self.line(&cap, None, false);
            }
        }
    }

    fn line(&mut self, points: &[DVec2], around: Option<DVec2>, wanted: bool) {
        let first = index_u32(self.pieces.len());
        for pair in points.windows(2).filter(|pair| pair[0] != pair[1]) {
            let next = Some((index_u32(self.pieces.len()) + 1, DVec2::ZERO));
            self.pieces.push(Piece { from: pair[0], to: pair[1], next, wanted });
        }
        let count = self.pieces.len();
        if let Some(last) = self.pieces.get_mut(first as usize..).and_then(<[Piece]>::last_mut) {
            last.next = around.map(|shift| (first, shift));
        }
        self.crossings.resize(count, Vec::new());
    }

    /// Finds all crossings; `None` if stopped.
    fn cross(&mut self, path: &Path, stop: &dyn Fn() -> bool) -> Option<()> {
        let boxes: Vec<[DVec2; 2]> = self.pieces.iter().map(|piece| [piece.from, piece.to]).collect();
        let index = Index::new(&boxes, (path.size_mm, path.periodic));
        for (n, piece) in self.pieces.iter().enumerate() {
            if n % 256 == 0 && stop() {
                return None;
            }
            let (low, high) = (piece.from.min(piece.to), piece.from.max(piece.to));
            for near in index.near(low, high) {
                let m = near.id as usize;
                let other = &self.pieces[m];
                let used = m > n && (piece.wanted || other.wanted);
                let follows = |a: &Piece, b: u32, shift: DVec2| {
                    a.next.is_some_and(|(next, by)| next == b && by.distance(shift) < 1e-6)
                };
                if !used || follows(piece, near.id, near.shift) || follows(other, index_u32(n), -near.shift) {
                    continue;
                }
                let Some((at, other_at)) = crossing([piece.from, piece.to], [other.from, other.to], near.shift) else {
                    continue;
                };
                let of = |other, at, other_at, shift| Crossing { at, other, other_at, shift };
                self.crossings[n].push(of(near.id, at, other_at, near.shift));
                self.crossings[m].push(of(index_u32(n), other_at, at, -near.shift));
            }
        }
        for list in &mut self.crossings {
            list.sort_by(|a, b| a.at.total_cmp(&b.at).then(a.other.cmp(&b.other)));
        }
        Some(())
    }

    /// Draws the wanted parts that lie far enough from the path; `None` if stopped.
    fn follow(&self, is_far: &dyn Fn(DVec2) -> bool, pen: &mut Pen, stop: &dyn Fn() -> bool) -> Option<()> {
        let mut good: Vec<Vec<bool>> = Vec::with_capacity(self.pieces.len());
        for (n, piece) in self.pieces.iter().enumerate() {
            if n % 256 == 0 && stop() {
                return None;
            }
            let shares = |k: usize| {
                let list = &self.crossings[n];
                let from = k.checked_sub(1).map_or(0.0, |k| list[k].at);
                (from, list.get(k).map_or(1.0, |crossing| crossing.at))
            };
            let far = |k: usize| {
                let (from, to) = shares(k);
                piece.wanted && is_far(piece.from.lerp(piece.to, 0.5 * (from + to)))
            };
            good.push((0..=self.crossings[n].len()).map(far).collect());
        }
        let all = || good.iter().enumerate().flat_map(|(n, parts)| (0..parts.len()).map(move |k| (n, k)));
        let mut entered: Vec<Vec<bool>> = good.iter().map(|parts| vec![false; parts.len()]).collect();
        for (n, number) in all().filter(|(n, k)| good[*n][*k]) {
            if let Some((next, _)) = self.next(Part { piece: index_u32(n), number }, &good) {
                entered[next.piece as usize][next.number] = true;
            }
        }
        let open = all().filter(|(n, k)| !entered[*n][*k]).collect::<Vec<_>>();
        let mut left = good.clone();
        for (n, number) in open.into_iter().chain(all()) {
            let first = Part { piece: index_u32(n), number };
            let (mut at, start) = (Some((first, DVec2::ZERO)), self.ends(first)[0]);
            if left[n][number] {
                pen.move_to(start);
            }
            while let Some((part, shift)) = at.filter(|(part, _)| left[part.piece as usize][part.number]) {
                left[part.piece as usize][part.number] = false;
                at = self.next(part, &good).map(|(next, by)| (next, shift + by));
                // A closed line ends exactly where it began, or whole canvases away.
                pen.line_to(match at {
                    Some((next, shift)) if next == first => start + shift,
                    _ => self.ends(part)[1] + shift,
                });
            }
        }
        Some(())
    }

    fn ends(&self, part: Part) -> [DVec2; 2] {
        let (piece, list) = (&self.pieces[part.piece as usize], &self.crossings[part.piece as usize]);
        let place = |crossing: Option<&Crossing>, end: DVec2| crossing.map_or(end, |c| piece.from.lerp(piece.to, c.at));
        let before = part.number.checked_sub(1).and_then(|k| list.get(k));
        [place(before, piece.from), place(list.get(part.number), piece.to)]
    }

    /// The good part after this one, and its shift: of the line that crosses there, or else of the same line. No two parts
    /// are followed by the same one.
    fn next(&self, part: Part, good: &[Vec<bool>]) -> Option<(Part, DVec2)> {
        let is_good = |part: &Part| good[part.piece as usize][part.number];
        let Some(crossing) = self.crossings[part.piece as usize].get(part.number) else {
            let next = self.pieces[part.piece as usize].next;
            return next.map(|(piece, shift)| (Part { piece, number: 0 }, shift)).filter(|(part, _)| is_good(part));
        };
        let list = &self.crossings[crossing.other as usize];
        let same = |c: &Crossing| c.other == part.piece && c.at == crossing.other_at && c.shift == -crossing.shift;
        let number = list.iter().position(same)?;
        let (before, after) =
            (Part { piece: crossing.other, number }, Part { piece: crossing.other, number: number + 1 });
        if is_good(&after) {
            return Some((after, crossing.shift));
        }
        let goes_on = Part { piece: part.piece, number: part.number + 1 };
        (is_good(&goes_on) && !is_good(&before)).then_some((goes_on, DVec2::ZERO))
    }
}

/// The pieces of a curve moved to the right by `distance` mm, joined by arcs.
fn moved(curve: &Polyline, distance: f64) -> Vec<DVec2> {
    let pieces: Vec<[DVec2; 2]> = curve.points.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let way = |k: usize| (pieces[k][1] - pieces[k][0]).normalize_or_zero();
    let side = |k: usize| way(k).perp() * distance;
    let count = pieces.len();
    let mut out = Vec::with_capacity(count + 2);
    if !curve.closed {
        out.push(pieces[0][0] + side(0));
    }
    for k in 0..if curve.closed { count } else { count - 1 } {
        let next = (k + 1) % count;
        let (a, b, corner) = (side(k), side(next), pieces[k][1]);
        // Where the moved pieces meet, or would meet.
        let miter = (a + b) / (1.0 + way(k).dot(way(next)));
        let bend = way(k).perp_dot(way(next)) * distance;
        let turns_away = bend < 0.0 || (bend == 0.0 && way(k).dot(way(next)) < 0.0);
        let short = |k: usize| 0.5 * pieces[k][0].distance(pieces[k][1]);
        let fits = if turns_away {
            miter.length() - distance.abs() < TOLERANCE
        } else {
            (miter - a).length() < short(k).min(short(next))
        };
        if miter.is_finite() && fits {
            out.push(corner + miter);
        } else {
            out.push(corner + a);
            if turns_away {
                arc(corner, a, b, -distance.signum(), &mut out);
            }
            out.push(corner + b);
        }
    }
    if curve.closed {
        // The line begins where its last joint ends.
        out.insert(0, out[out.len() - 1] + pieces[0][0] - pieces[count - 1][1]);
    } else {
        out.push(pieces[count - 1][1] + side(count - 1));
    }
    out
}

/// Adds points between two ends of an arc, given from its centre: the corners of a line that touches the arc from outside.
/// `turn` is 1 for an arc from +x towards +y, else -1.
fn arc(center: DVec2, from: DVec2, to: DVec2, turn: f64, out: &mut Vec<DVec2>) {
    let angle = libm::atan2(from.perp_dot(to), from.dot(to)) * turn;
    let angle = if angle < 0.0 { angle + std::f64::consts::TAU } else { angle };
    let most = 2.0 * libm::acos(1.0 / (1.0 + TOLERANCE / from.length()));
    let steps = (angle / most.max(1e-3)).ceil().max(2.0);
    let outside = 1.0 / libm::cos(0.5 * angle / steps);
    let mut k = 0.5;
    while k < steps {
        let (sin, cos) = libm::sincos(turn * angle * k / steps);
        out.push(center + DVec2::new(cos, sin).rotate(from) * outside);
        k += 1.0;
    }
}

/// The shares at which two pieces cross, the second one shifted. Pieces that share an end cross one of the pieces that
/// meet there once, as rounding decides both in the same way.
fn crossing([a, b]: [DVec2; 2], other: [DVec2; 2], shift: DVec2) -> Option<(f64, f64)> {
    let [c, d] = other.map(|p| p + shift);
    let side = |from: DVec2, to: DVec2, p: DVec2| (to - from).perp_dot(p - from);
    let (of_c, of_d, of_a, of_b) = (side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b));
    if (of_c >= 0.0) == (of_d >= 0.0) || (of_a >= 0.0) == (of_b >= 0.0) {
        return None;
    }
    Some(((of_a / (of_a - of_b)).clamp(0.0, 1.0), (of_c / (of_c - of_d)).clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::Tiling;

    fn path(curves: &[(&[(f64, f64)], bool)], tiling: Tiling) -> Path {
        let mut pen = Pen::default();
        for (points, closed) in curves {
            let mut points = points.iter().map(|(x, y)| DVec2::new(*x, *y));
            pen.move_to(points.next().unwrap());
            points.for_each(|p| pen.line_to(p));
            if *closed {
                pen.close();
            }
        }
        pen.finish(DVec2::new(40.0, 30.0), tiling)
    }

    fn made(path: &Path, distance: f64) -> Path {
        let made = offset(path, distance, &|| false).unwrap();
        // Every point lies at the distance, on the right side.
        let nearest = Nearest::new(path);
        for p in made.curves.iter().flat_map(|curve| &curve.points) {
            let beside = nearest.at(*p, 2.0 * distance.abs()).unwrap();
            let more = beside.distance - distance.abs();
            assert!(more > -1e-6 && more < 1.01 * TOLERANCE, "{p} {beside:?}");
            let length = path.curves[beside.curve as usize].length();
            let is_beyond = !(0.0..=length).contains(&beside.along);
            assert!(is_beyond || beside.across * distance > 0.0, "{p} {beside:?}");
        }
        made
    }

    fn lengths(path: &Path) -> Vec<(bool, f64)> {
        path.curves.iter().map(|curve| (curve.closed, (curve.length() * 100.0).round() / 100.0)).collect()
    }

    const SQUARE: &[(f64, f64)] = &[(10.0, 10.0), (20.0, 10.0), (20.0, 20.0), (10.0, 20.0)];

    #[test]
    fn squares_grow_with_round_corners_and_shrink_with_sharp_ones() {
        // Clockwise in the picture, so the inside is on the right.
        let square = path(&[(SQUARE, true)], Tiling::BOTH);
        assert_eq!(lengths(&made(&square, 2.0)), [(true, 24.0)]);
        assert_eq!(made(&square, 2.0).curves[0].points.len(), 5);
        let round = made(&square, -2.0);
        assert!(round.curves[0].closed);
        assert!((round.curves[0].length() - 40.0 - 4.0 * std::f64::consts::PI).abs() < 0.01);
        assert_eq!(lengths(&made(&square, 5.1)), []);
        assert_eq!(offset(&square, 0.0, &|| false), Some(square.clone()));
        assert_eq!(offset(&square, 1.0, &|| true), None);
    }

    #[test]
    fn a_narrow_waist_cuts_a_curve_in_two() {
        let glass: &[(f64, f64)] = &[(5.0, 5.0), (25.0, 5.0), (16.0, 15.0), (25.0, 25.0), (5.0, 25.0), (14.0, 15.0)];
        let glass = path(&[(glass, true)], Tiling::NONE);
        let two = made(&glass, 1.5);
        assert_eq!(two.curves.iter().map(|curve| curve.closed).collect::<Vec<_>>(), [true, true]);
        assert_eq!(made(&glass, 0.5).curves.len(), 1);
    }

    #[test]
    fn open_curves_stay_open() {
        let l = path(&[(&[(5.0, 20.0), (15.0, 20.0), (15.0, 10.0)], false)], Tiling::NONE);
        let quarter = 0.5 * std::f64::consts::PI;
        let outer = made(&l, 1.0);
        assert!((outer.curves[0].length() - 20.0 - quarter).abs() < 0.01 && !outer.curves[0].closed);
        assert_eq!(lengths(&made(&l, -1.0)), [(false, 18.0)]);
        // A hook whose end lies near its beginning: the line is cut by the disc around the end.
        let hook = &[(5.0, 20.0), (25.0, 20.0), (25.0, 10.0), (12.0, 10.0), (12.0, 18.5)];
        let hook = made(&path(&[(hook, false)], Tiling::NONE), -1.0);
        assert!(hook.curves.iter().all(|curve| !curve.closed) && hook.curves.len() == 2, "{:?}", lengths(&hook));
    }

    #[test]
    fn lines_around_the_canvas_and_across_its_border_go_on() {
        let wave: &[(f64, f64)] = &[(0.0, 15.0), (10.0, 20.0), (30.0, 10.0), (40.0, 15.0)];
        let wave = made(&path(&[(wave, false)], Tiling::BOTH), 3.0);
        let [curve] = &wave.curves[..] else { panic!("{:?}", lengths(&wave)) };
        let way = *curve.points.last().unwrap() - curve.points[0];
        assert!(curve.closed && way.abs_diff_eq(DVec2::new(40.0, 0.0), 1e-9), "{way}");
        // Two copies of a square that overlap across the border become one line around the canvas.
        let wide: &[(f64, f64)] = &[(2.0, 10.0), (38.0, 10.0), (38.0, 20.0), (2.0, 20.0)];
        let wide = made(&path(&[(wide, true)], Tiling::BOTH), -2.5);
        assert_eq!(wide.curves.iter().map(|curve| curve.closed).collect::<Vec<_>>(), [true, true]);
        for curve in &wide.curves {
            let way = *curve.points.last().unwrap() - curve.points[0];
            assert!((way.x.abs() - 40.0).abs() < 1e-6 && way.y.abs() < 1e-6, "{way}");
        }
    }

    #[test]
    fn smooth_curves_may_bend_more_than_the_offset() {
        // An ellipse whose tips have a radius of 1.33 mm; the line inside at 3 mm has two sharp corners.
        let point = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / 400.0;
            (20.0 + 12.0 * angle.cos(), 15.0 + 4.0 * angle.sin())
        };
        let points: Vec<(f64, f64)> = (0..400).map(point).collect();
        let ellipse = path(&[(&points, true)], Tiling::BOTH);
        for distance in [0.5, 1.3, 1.4, 3.0, 3.9, -0.5, -3.0] {
            let made = made(&ellipse, distance);
            assert_eq!(made.curves.iter().map(|c| c.closed).collect::<Vec<_>>(), [true], "{distance}");
        }
        assert!(made(&ellipse, 4.1).curves.is_empty());
    }

    #[test]
    fn noise_gives_whole_lines() {
        let hash = crate::ground::hash::Hash::new(9);
        let corner = |k: u64| {
            let radius = 4.0 + 6.0 * hash.unit(k);
            (DVec2::new(20.0, 15.0) + DVec2::from_angle(k as f64 * std::f64::consts::TAU / 60.0) * radius).into()
        };
        let points: Vec<(f64, f64)> = (0..60).map(corner).collect();
        let star = path(&[(&points, true)], Tiling::BOTH);
        for distance in [0.1, 0.4, 1.0, 2.5, -0.1, -0.7, -3.0, -6.0] {
            let made = made(&star, distance);
            assert!(made.curves.iter().all(|curve| curve.closed), "{distance}: {:?}", lengths(&made));
        }
    }
}
