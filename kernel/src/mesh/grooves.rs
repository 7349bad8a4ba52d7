//! Grooves on a surface, as a function of a position and its normal, so that both sides of a border between charts show
//! the same.
use super::cubes::Cubes;
use crate::ground::math::{exp, hypot};
use crate::ground::number::narrow;
use crate::strokes::{Combine, Profile, StrokeStyle};
use glam::{DVec3, Vec3};

/// A straight groove in the tangent plane at its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Groove {
    /// Middle in mm.
    pub middle: Vec3,
    /// Normal at the middle, of length 1.
    pub normal: Vec3,
    /// Direction, of length 1.
    pub along: Vec3,
    /// Half the length in mm.
    pub half_length: f32,
    /// Half the width in mm.
    pub half_width: f32,
    /// Depth.
    pub depth: f32,
}

/// Many grooves, indexed by their positions.
#[derive(Clone, Debug)]
pub struct Grooves {
    grooves: Vec<Groove>,
    style: StrokeStyle,
    cubes: Cubes,
    deepest: f32,
}

impl Grooves {
    /// Builds the index; grooves may be drawn up to `pixel` mm wider than their width.
    pub fn new(grooves: Vec<Groove>, style: StrokeStyle, pixel: f32) -> Self {
        let margin = pixel * style.min_width.max(1.0);
        let reach = |g: &Groove| g.half_length + (g.half_width + margin) * cut(style.profile);
        let side = grooves.iter().map(reach).fold(f32::MIN_POSITIVE, f32::max);
        let cubes = Cubes::new(grooves.iter().map(|groove| (groove.middle, reach(groove))), side);
        let deepest = grooves.iter().map(|groove| groove.depth).fold(0.0, f32::max);
        Self { grooves, style, cubes, deepest }
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.grooves) + self.cubes.bytes()
    }

    /// Fills `out` with the depths at positions with these normals, `pixel` mm apart; with the cross-section alone if
    /// `mask`.
    pub fn fill(&self, places: [&[f32]; 3], normals: [&[f32]; 3], (pixel, mask): (f32, bool), out: &mut [f32]) {
        self.cubes.around(places, |n, place, list| {
            let normal = Vec3::from_array(normals.map(|plane| plane[n]));
            out[n] = self.value(list, place, normal, pixel, mask);
        });
    }

    fn value(&self, list: &[u32], place: Vec3, normal: Vec3, pixel: f32, mask: bool) -> f32 {
        let mut sum = 0.0_f32;
        for groove in list.iter().map(|n| &self.grooves[*n as usize]) {
            let value = section(groove, &self.style, place, normal, pixel) * if mask { 1.0 } else { groove.depth };
            sum = match self.style.combine {
                Combine::Max => sum.max(value),
                Combine::Add | Combine::Screen => sum + value,
            };
        }
        let most = if mask { 1.0 } else { self.deepest };
        if mask || self.style.combine == Combine::Screen { sum.min(most) } else { sum }
    }
}

/// The end of a cross-section, in half widths.
fn cut(profile: Profile) -> f32 {
    if let Profile::Gaussian { cutoff, .. } = profile { 2.0 * cutoff } else { 1.0 }
}

/// The cross-section of a groove at a position, 0..1, with its taper and fading.
fn section(groove: &Groove, style: &StrokeStyle, place: Vec3, normal: Vec3, pixel: f32) -> f32 {
    // The other side of a thin wall has no groove.
    if groove.normal.dot(normal) <= 0.5 {
        return 0.0;
    }
    let d = place - groove.middle;
    let along = d.dot(groove.along);
    let across = d.dot(groove.normal.cross(groove.along));
    let e = (along.abs() / groove.half_length.max(f32::MIN_POSITIVE)).min(1.0);
    let own = groove.half_width * (1.0 - style.taper * e * e).max(0.0).sqrt();
    let drawn = own.max(0.5 * style.min_width * pixel);
    if drawn <= 0.0 {
        return 0.0;
    }
    let over = (along.abs() - groove.half_length).max(0.0);
    let (t, ends) = match (style.profile, style.round_caps) {
        (Profile::Brush, _) => (hypot(across / drawn, along / groove.half_length.max(drawn)), 1.0),
        (_, true) => (hypot(across, over) / drawn, 1.0),
        (_, false) => (across.abs() / drawn, soft(groove.half_length - along.abs(), pixel)),
    };
    let fade = if style.fade { own / drawn } else { 1.0 };
    let e4 = (e * e) * (e * e);
    profile(style.profile, t, drawn / pixel) * ends * fade * (1.0 - style.tip * e4)
}

/// 1 inside and 0 outside of an edge that is one pixel wide.
fn soft(inside: f32, pixel: f32) -> f32 {
    (inside / pixel + 0.5).clamp(0.0, 1.0)
}

/// The profile at distance `t` from the middle line, in half widths of `half` pixels each.
fn profile(profile: Profile, t: f32, half: f32) -> f32 {
    match profile {
        Profile::Flat | Profile::Brush => soft((1.0 - t) * half, 1.0),
        Profile::Linear => (1.0 - t).max(0.0),
        Profile::Smooth => {
            let left = (1.0 - t * t).max(0.0);
            left * left
        }
        Profile::Gaussian { sigma, cutoff } => {
            let x = 0.5 * t;
            if x < cutoff { exp(-0.5 * (x / sigma) * (x / sigma)) } else { 0.0 }
        }
    }
}

/// Makes a groove across the middle of a link: perpendicular to its chord, in the tangent plane; `None` if it has no
/// direction.
pub fn across(ends: [DVec3; 2], normals: [Vec3; 2], length_scale: f64, [width, depth]: [f32; 2]) -> Option<Groove> {
    let chord = ends[1] - ends[0];
    let normal = (normals[0] + normals[1]).as_dvec3().try_normalize()?;
    let along = normal.cross(chord).try_normalize()?;
    Some(Groove {
        middle: ((ends[0] + ends[1]) * 0.5).as_vec3(),
        normal: normal.as_vec3(),
        along: along.as_vec3(),
        half_length: narrow(0.5 * length_scale * chord.length()),
        half_width: 0.5 * width,
        depth,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strokes::CrossSection;

    fn style() -> StrokeStyle {
        StrokeStyle { round_caps: true, ..StrokeStyle::default() }
    }

    fn value(grooves: &Grooves, place: Vec3, normal: Vec3) -> f32 {
        let (p, n) = (place.to_array().map(|v| [v]), normal.to_array().map(|v| [v]));
        let mut out = [0.0];
        grooves.fill([&p[0], &p[1], &p[2]], [&n[0], &n[1], &n[2]], (0.01, false), &mut out);
        out[0]
    }

    #[test]
    fn grooves_lie_across_their_links() {
        let ends = [DVec3::new(-2.0, 1.0, 5.0), DVec3::new(2.0, 1.0, 5.0)];
        let groove = across(ends, [Vec3::Z; 2], 0.5, [0.4, 0.3]).unwrap();
        assert_eq!((groove.middle, groove.along.abs(), groove.half_length), (Vec3::new(0.0, 1.0, 5.0), Vec3::Y, 1.0));
        let grooves = Grooves::new(vec![groove], style(), 0.01);
        let at = |x: f32, y: f32| value(&grooves, Vec3::new(x, y, 5.0), Vec3::Z);
        assert!((at(0.0, 1.0) - 0.3).abs() < 1e-6 && (at(0.0, 1.9) - 0.3).abs() < 1e-6);
        // The bell profile of the plane: σ is a quarter of the width.
        assert!((at(0.1, 1.0) - 0.3 * (-0.5_f32).exp()).abs() < 1e-4);
        assert_eq!((at(0.0, 3.0), at(0.5, 1.0)), (0.0, 0.0));
        // The other side of a wall has no groove.
        assert_eq!(value(&grooves, Vec3::new(0.0, 1.0, 5.0), -Vec3::Z), 0.0);
    }

    #[test]
    fn ignores_sizes_of_cells() {
        let groove = |n: i32| {
            let x = f64::from(n) * 0.7;
            across([DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 0.5, 0.2)], [Vec3::Z; 2], 1.0, [0.3, 0.2]).unwrap()
        };
        for combine in [Combine::Max, Combine::Add, Combine::Screen] {
            let style = StrokeStyle { combine, profile: CrossSection::Linear.with_sigma(0.25), ..style() };
            let [fine, coarse] = [0.01, 3.0].map(|pixel| Grooves::new((0..20).map(groove).collect(), style, pixel));
            for k in 0..400 {
                let place = Vec3::new(0.04 * k as f32, 0.3 + 0.001 * k as f32, 0.05);
                assert_eq!(value(&fine, place, Vec3::Z), value(&coarse, place, Vec3::Z));
            }
        }
    }
}
