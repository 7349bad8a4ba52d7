//! Strands: lines that follow a field of directions and curl, cut into straight strokes.
use crate::ground::math::{cos_degrees, sin_degrees};
use crate::strokes::Stroke;
use glam::Vec2;

/// Settings of a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strand {
    /// Its middle, mm.
    pub middle: Vec2,
    /// Its angle to the field, degrees.
    pub angle: f32,
    /// Its length, mm.
    pub length: f32,
    /// Rotation in degrees per mm.
    pub curl: f32,
    /// Half its width in the middle, mm.
    pub half_width: f32,
    /// Its depth in the middle, mm.
    pub depth: f32,
}

/// Taper of strands: half widths are multiplied by √(1 - width·e²) and depths by 1 - depth·e⁴, e from -1 to 1 along
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Taper of the width.
    pub width: f32,
    /// Taper of the depth.
    pub depth: f32,
}

impl Strand {
    /// Cuts it into `pieces` strokes of equal length. `field` returns the angle at a position, in degrees; angles that
    /// differ by 180° are equivalent. O(pieces).
    pub fn strokes(&self, pieces: usize, ends: Ends, field: &dyn Fn(Vec2) -> f32, out: &mut Vec<Stroke>) {
        let half = pieces.div_ceil(2).max(1);
        let step = self.length / (2 * half) as f32;
        for way in [1.0f32, -1.0] {
            let (mut at, mut before) = (self.middle, None);
            for k in 0..half {
                let along = step * (k as f32 + 0.5) * way;
                let heading = |p: Vec2, before: Option<Vec2>| {
                    let angle = field(p) + self.angle + self.curl * along;
                    let heading = Vec2::new(cos_degrees(angle), sin_degrees(angle));
                    // Lines have no sign: continue in the previous direction.
                    let start = heading * way;
                    before.map_or(start, |before: Vec2| if before.dot(heading) < 0.0 { -heading } else { heading })
                };
                let first = heading(at, before);
                let heading = heading(at + first * (0.5 * step), Some(first));
                let to = at + heading * step;
                let e = (k as f32 + 0.5) / half as f32;
                let e2 = e * e;
                out.push(Stroke {
                    ends: [at, to],
                    half_width: self.half_width * (1.0 - ends.width * e2).max(0.0).sqrt(),
                    depth: self.depth * (1.0 - ends.depth * e2 * e2),
                });
                (at, before) = (to, Some(heading));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand(curl: f32) -> Strand {
        Strand { middle: Vec2::new(3.0, 4.0), angle: 30.0, length: 10.0, curl, half_width: 0.5, depth: 2.0 }
    }

    const ENDS: Ends = Ends { width: 1.0, depth: 1.0 };

    #[test]
    fn a_straight_strand_is_a_line() {
        let mut out = Vec::new();
        strand(0.0).strokes(8, ENDS, &|_| 0.0, &mut out);
        let way = Vec2::from_angle(30f32.to_radians());
        assert_eq!(out.len(), 8);
        assert!((out[3].ends[1] - (Vec2::new(3.0, 4.0) + way * 5.0)).length() < 1e-5);
        assert!((out[7].ends[1] - (Vec2::new(3.0, 4.0) - way * 5.0)).length() < 1e-5);
        assert!(out[0].half_width > 0.49 && out[3].half_width < 0.25 && out[3].depth < 1.0);
    }

    #[test]
    fn curl_makes_an_arc_and_fields_are_followed() {
        let mut out = Vec::new();
        // 9° in a mm: an arc of radius 1 / (9°) = 6.366 mm.
        strand(9.0).strokes(40, ENDS, &|_| 0.0, &mut out);
        let normal = Vec2::from_angle(30f32.to_radians()).perp();
        let center = Vec2::new(3.0, 4.0) + normal * 6.3662;
        assert!(out.iter().all(|s| ((s.ends[1] - center).length() - 6.3662).abs() < 0.01));
        // A field around the origin whose angle jumps by 180° between halves.
        out.clear();
        let round = |p: Vec2| (p.perp().to_angle().to_degrees()).rem_euclid(180.0);
        let strand = Strand { middle: Vec2::new(2.0, 0.0), angle: 0.0, length: 12.0, ..strand(0.0) };
        strand.strokes(200, ENDS, &round, &mut out);
        assert!(out.iter().all(|s| (s.ends[1].length() - 2.0).abs() < 0.01), "{:?}", out.last());
        let (a, b) = (out[99].ends[1], out[199].ends[1]);
        assert!((a - b).length() < 1.0, "nearly round from both sides: {a} {b}");
    }
}
