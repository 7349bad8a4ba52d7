//! Work areas of any shape: tests points against the contour, and clips segments at it.
//!
//! Source: JP4905282B2 §3, §5 and §7. The shape is an [`Area`], which holds distances from its contour.
use super::segments::Segment;
use glam::Vec2;
use shibo_value::Area;

/// The indices of the points inside. O(n).
pub fn inside(points: &[Vec2], area: &Area) -> Vec<u32> {
    let index = |i: usize| u32::try_from(i).ok();
    let within = |(i, p): (usize, &Vec2)| if area.distance_at(*p) >= 0.0 { index(i) } else { None };
    points.iter().enumerate().filter_map(within).collect()
}

/// True for points at most `margin` mm inside the contour, and for those outside.
pub fn near_contour(points: &[Vec2], area: &Area, margin: f32) -> Vec<bool> {
    points.iter().map(|p| area.distance_at(*p) <= margin).collect()
}

/// Clips segments at the contour and keeps the parts inside; a segment that leaves and comes back becomes several. The
/// contour is searched for in steps of half a sample, and then interpolated from the distances on both sides of it. O(n
/// · length).
pub fn clip(segments: &[Segment], area: &Area) -> Vec<Segment> {
    let reach = 0.5 * area.step().min_element();
    let mut cut = Vec::with_capacity(segments.len());
    for segment in segments {
        let [a, b] = segment.ends;
        let steps = ((b - a).length() / reach).ceil().clamp(1.0, 65_536.0);
        let mut before = (0.0f32, area.distance_at(a));
        let mut from = (before.1 >= 0.0).then_some(0.0);
        let mut step = 1.0;
        while step <= steps {
            let t = step / steps;
            let now = (t, area.distance_at(a + (b - a) * t));
            // Interpolate the zero of the distance between the two samples.
            let cross = || before.0 + (t - before.0) * (before.1 / (before.1 - now.1));
            match from {
                None if now.1 >= 0.0 => from = Some(cross()),
                Some(start) if now.1 < 0.0 => {
                    cut.extend(piece(segment, start, cross()));
                    from = None;
                }
                _ => {}
            }
            before = now;
            step += 1.0;
        }
        cut.extend(from.and_then(|start| piece(segment, start, 1.0)));
    }
    cut
}

/// The part of a segment between two shares of its length; `None` if it is empty.
fn piece(segment: &Segment, from: f32, to: f32) -> Option<Segment> {
    let [a, b] = segment.ends;
    let at = |t: f32| {
        if t <= 0.0 {
            a
        } else if t >= 1.0 {
            b
        } else {
            a + (b - a) * t
        }
    };
    (from < to).then(|| Segment { ends: [at(from), at(to)], ..*segment })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, UVec2};
    use shibo_value::Tiling;

    /// A disc of radius 3 in the middle of 8 × 8 mm.
    fn disc() -> Area {
        let at = |i: u32| Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) / 8.0;
        let distance = (0..64 * 64).map(|i| 3.0 - (at(i) - 4.0).length()).collect();
        Area { size: UVec2::splat(64), distance, size_mm: DVec2::splat(8.0), periodic: Tiling::NONE }
    }

    #[test]
    fn separates_points_by_position() {
        let points = [Vec2::splat(4.0), Vec2::new(4.0, 6.9), Vec2::ZERO];
        assert_eq!(inside(&points, &disc()), [0, 1]);
        assert_eq!(near_contour(&points, &disc(), 0.2), [false, true, true]);
    }

    #[test]
    fn segments_end_at_the_contour() {
        let segment = |a: [f32; 2], b: [f32; 2]| Segment { ends: [a.into(), b.into()], link: 7 };
        let through = clip(&[segment([0.0, 4.0], [8.0, 4.0])], &disc());
        assert_eq!(through.len(), 1);
        let [a, b] = through[0].ends;
        assert!((a - Vec2::new(1.0, 4.0)).length() < 0.01 && (b - Vec2::new(7.0, 4.0)).length() < 0.01);
        assert_eq!(through[0].link, 7);
        let within = segment([3.0, 3.0], [4.0, 5.0]);
        assert_eq!(clip(&[within], &disc()), [within]);
        assert!(clip(&[segment([0.0, 0.5], [8.0, 0.5])], &disc()).is_empty());
    }

    #[test]
    fn splits_segment_that_comes_back() {
        let ring = Area { distance: disc().distance.iter().map(|d| d.min(2.0 - d)).collect(), ..disc() };
        let cut = clip(&[Segment { ends: [Vec2::new(0.0, 4.0), Vec2::new(8.0, 4.0)], link: 0 }], &ring);
        assert_eq!(cut.len(), 2);
        assert!((cut[0].ends[1].x - 3.0).abs() < 0.01 && (cut[1].ends[0].x - 5.0).abs() < 0.01, "{cut:?}");
    }
}
