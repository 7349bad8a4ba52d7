//! Joins segments with common ends into lines.
//!
//! Two segments that meet become one line. Where more segments meet, a line continues with the segment that turns it
//! least, if the turn is less than 60°; the straightest pairs are joined first. O(n log n).
use super::pen::Pen;
use glam::DVec2;
use shibo_value::Segments;
use std::collections::BTreeMap;

/// Maximum distance in mm of ends that count as the same point.
const SAME: f64 = 1e-3;

/// The cosine of the largest turn where more than two segments meet.
const STRAIGHT: f64 = 0.5;

/// If more ends meet at a point, none are joined.
const MOST_ENDS: usize = 64;

/// An end of a segment: the index of the segment, and 0 or 1 for its first or second end.
type End = (usize, usize);

/// Joins segments and draws the lines.
pub fn draw(segments: &Segments, pen: &mut Pen) {
    let size = segments.size_mm;
    let ends: Vec<[DVec2; 2]> = segments.ends.iter().map(|e| e.map(|p| p.as_dvec2())).collect();
    let partners = partners(&ends, segments);
    let mut used = vec![false; ends.len()];
    let open = (0..ends.len()).flat_map(|n| [(n, 0), (n, 1)]).filter(|(n, end)| partners[*n][*end].is_none());
    let all: Vec<End> = open.chain((0..ends.len()).map(|n| (n, 0))).collect();
    for (first, begin) in all {
        if used[first] {
            continue;
        }
        let start = ends[first][begin];
        pen.move_to(start);
        let (mut at, mut from) = ((first, begin), start);
        loop {
            let (n, begin) = at;
            used[n] = true;
            let to = from + ends[n][1 - begin] - ends[n][begin];
            match partners[n][1 - begin] {
                Some(next) if !used[next.0] => {
                    pen.line_to(to);
                    (at, from) = (next, to);
                }
                Some(next) if next.0 == first => {
                    // A closed line: it ends exactly where it began, or whole canvases away.
                    let whole = ((to - start) / size).round() * size;
                    pen.line_to(if (to - start - whole).length() < 0.1 { start + whole } else { to });
                    break;
                }
                _ => {
                    pen.line_to(to);
                    break;
                }
            }
        }
    }
}

/// For each end of each segment, the end that it is joined to.
fn partners(ends: &[[DVec2; 2]], segments: &Segments) -> Vec<[Option<End>; 2]> {
    let mut places: BTreeMap<[i64; 2], Vec<End>> = BTreeMap::new();
    for (n, pair) in ends.iter().enumerate() {
        for (k, p) in pair.iter().enumerate().filter(|(_, p)| p.is_finite()) {
            places.entry(place(*p, segments)).or_default().push((n, k));
        }
    }
    let mut partners = vec![[None; 2]; ends.len()];
    for meeting in places.values().filter(|meeting| (2..=MOST_ENDS).contains(&meeting.len())) {
        let way = |(n, k): End| (ends[n][1 - k] - ends[n][k]).normalize_or_zero();
        let mut pairs: Vec<(f64, End, End)> = Vec::new();
        for (i, a) in meeting.iter().enumerate() {
            pairs.extend(meeting[i + 1..].iter().map(|b| (-way(*a).dot(way(*b)), *a, *b)));
        }
        pairs.retain(|(straight, a, b)| a.0 != b.0 && (meeting.len() == 2 || *straight > STRAIGHT));
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, a, b) in pairs {
            if partners[a.0][a.1].is_none() && partners[b.0][b.1].is_none() {
                partners[a.0][a.1] = Some(b);
                partners[b.0][b.1] = Some(a);
            }
        }
    }
    partners
}

/// The cell of a point, the same for all copies on a periodic canvas.
#[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
fn place(p: DVec2, segments: &Segments) -> [i64; 2] {
    let axis = |p: f64, size: f64, repeats: bool| {
        let cells = (size / SAME).round().max(1.0);
        let cell = (p / size * cells).round();
        (if repeats { cell.rem_euclid(cells) } else { cell }) as i64
    };
    let (size, tiling) = (segments.size_mm, segments.periodic);
    [axis(p.x, size.x, tiling.x), axis(p.y, size.y, tiling.y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;
    use shibo_value::Tiling;

    fn joined(ends: &[[f32; 4]], tiling: Tiling) -> Vec<(usize, bool, f64)> {
        let segments = Segments {
            ends: ends.iter().map(|e| [Vec2::new(e[0], e[1]), Vec2::new(e[2], e[3])]).collect(),
            length_ratio: Vec::new(),
            stretch: Vec::new(),
            width: Vec::new(),
            size_mm: DVec2::splat(10.0),
            periodic: tiling,
        };
        let mut pen = Pen::default();
        draw(&segments, &mut pen);
        let path = pen.finish(segments.size_mm, tiling);
        path.curves.iter().map(|c| (c.points.len(), c.closed, (c.length() * 1e3).round() / 1e3)).collect()
    }

    #[test]
    fn segments_that_meet_are_lines() {
        // An L of three segments in any order and direction, and a separate line.
        let l = [[4.0, 1.0, 1.0, 1.0], [4.0, 5.0, 4.0, 3.0], [4.0, 1.0, 4.0, 3.0], [7.0, 7.0, 8.0, 7.0]];
        assert_eq!(joined(&l, Tiling::NONE), [(4, false, 7.0), (2, false, 1.0)]);
        // A square.
        let square = [[1.0, 1.0, 3.0, 1.0], [3.0, 3.0, 3.0, 1.0], [3.0, 3.0, 1.0, 3.0], [1.0, 1.0, 1.0, 3.0]];
        assert_eq!(joined(&square, Tiling::NONE), [(5, true, 8.0)]);
    }

    #[test]
    fn lines_cross_straight() {
        let cross = [[1.0, 5.0, 5.0, 5.0], [5.0, 5.0, 5.0, 1.0], [9.0, 5.5, 5.0, 5.0], [5.0, 5.0, 5.2, 9.0]];
        let got = joined(&cross, Tiling::NONE);
        assert_eq!(got.iter().map(|c| c.0).collect::<Vec<_>>(), [3, 3]);
        // A T: the line of the stem ends at the junction.
        let got = joined(&[[1.0, 5.0, 5.0, 5.0], [5.0, 5.0, 9.0, 5.0], [5.0, 5.0, 5.0, 9.0]], Tiling::NONE);
        assert_eq!(got, [(3, false, 8.0), (2, false, 4.0)]);
    }

    #[test]
    fn lines_continue_across_the_border() {
        let ring = [[2.0, 3.0, 8.0, 4.0], [8.0, 4.0, 12.0, 3.0]];
        let got = joined(&ring, Tiling::BOTH);
        assert_eq!((got.len(), got[0].0, got[0].1), (1, 3, true));
        assert!(!joined(&ring, Tiling::NONE)[0].1);
    }
}
