//! The source's reference picture of bands: nuclei on a jittered grid, a rectangle on each.
//!
//! Source: JP4905282B2 §8, claims 9 to 11, fig. 23. Bands become [`Stroke`]s of depth 1, so the picture is drawn at any
//! resolution by [`crate::strokes::StrokeSet`]: `Hard` with [`Profile::Flat`], `Gaussian` with the source's σ = U/6.
//! Lengths are mm, angles radians from +x towards +y.

use crate::ground::hash::Hash;
use crate::ground::math;
use crate::strokes::{Profile, Stroke};
use glam::{DVec2, Vec2};

/// Placement of nuclei. The source's claim 10 and its flow chart differ, and both leave edges empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Nuclei {
    /// Everywhere within reach of the canvas; on a periodic canvas the distance is fitted so that a whole number fits.
    /// The default, since claim 10 leaves a strip of F/2 along two edges empty.
    #[default]
    Cover,
    /// `X = F i + F Rnd`, `Y = F j + F Rnd` for i = 1..=I, j = 1..=J with the largest I, J on the canvas (claim 10).
    Claim,
    /// Rows until Y passes the canvas, in each row points until X does, jitter included (fig. 23).
    FlowChart,
}

/// Parameters of the bands; ranges are drawn from uniformly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandSpec {
    /// Size of the canvas, > 0.
    pub size: Vec2,
    /// Distance F of nuclei (the source says "spatial frequency"), > 0.
    pub pitch: f32,
    /// Angles θ1, θ2; the source advises less than 30° between them.
    pub angle: [f32; 2],
    /// Widths U1, U2.
    pub width: [f32; 2],
    /// Lengths H1, H2, along the angle.
    pub length: [f32; 2],
}

/// A rectangle around a nucleus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// The nucleus.
    pub centre: Vec2,
    /// Direction of its length.
    pub angle: f32,
    /// Its width U.
    pub width: f32,
    /// Its length H.
    pub length: f32,
}

/// Nuclei of claim 10: by rows, `columns · rows` of them; number n draws 2n (Y), then 2n + 1 (X).
pub fn claim(pitch: f32, columns: u32, rows: u32, hash: Hash) -> Vec<Vec2> {
    let place = |n: u32| nucleus(pitch, n % columns + 1, n / columns + 1, u64::from(n), hash);
    (0..columns * rows).map(place).collect()
}

/// Nuclei of the flow chart (fig. 23): each try draws two numbers, also those that end a row.
pub fn flow_chart(pitch: f32, most: Vec2, hash: Hash) -> Vec<Vec2> {
    let mut nuclei = Vec::new();
    let mut n = 0;
    for j in 1.. {
        for i in 1.. {
            let at = nucleus(pitch, i, j, n, hash);
            n += 1;
            if at.y > most.y {
                return nuclei;
            }
            if at.x > most.x {
                break;
            }
            nuclei.push(at);
        }
    }
    nuclei
}

/// The nucleus of cell (i, j) from draws 2n and 2n + 1.
fn nucleus(pitch: f32, i: u32, j: u32, n: u64, hash: Hash) -> Vec2 {
    let pitch = f64::from(pitch);
    let rnd = DVec2::new(hash.unit(2 * n + 1), hash.unit(2 * n)) - 0.5;
    (DVec2::new(f64::from(i), f64::from(j)) * pitch + rnd * pitch).as_vec2()
}

/// Nuclei that leave no gaps: a grid of half-open cells with one nucleus each, including a margin of `reach` mm around
/// the canvas; on a periodic canvas whole cells and no margin. A cell's random numbers depend on its position only.
pub fn cover(pitch: f32, size: Vec2, reach: f32, periodic: bool, hash: Hash) -> Vec<Vec2> {
    let fitted = (size / pitch).round().max(Vec2::ONE);
    let cell = if periodic { size / fitted } else { Vec2::splat(pitch) };
    let (low, high) = if periodic {
        (Vec2::ZERO, fitted)
    } else {
        ((Vec2::splat(-reach) / cell).floor(), ((size + reach) / cell).ceil())
    };
    let (low, high) = (low.as_ivec2(), high.as_ivec2());
    let at = |x: i32, y: i32| {
        let hash = hash.with(u64::from(y.cast_unsigned())).with(u64::from(x.cast_unsigned()));
        let rnd = Vec2::new(hash.unit_f32(1), hash.unit_f32(0));
        (Vec2::new(x as f32, y as f32) + rnd) * cell
    };
    (low.y..high.y).flat_map(|y| (low.x..high.x).map(move |x| at(x, y))).collect()
}

/// One band per nucleus: number n draws 3n (θ), 3n + 1 (U), 3n + 2 (H).
pub fn bands(nuclei: &[Vec2], spec: &BandSpec, hash: Hash) -> Vec<Band> {
    let draw = |[from, to]: [f32; 2], n: u64| from + (to - from) * hash.unit_f32(n);
    let band = |(n, &centre): (u64, &Vec2)| Band {
        centre,
        angle: draw(spec.angle, 3 * n),
        width: draw(spec.width, 3 * n + 1),
        length: draw(spec.length, 3 * n + 2),
    };
    (0u64..).zip(nuclei).map(band).collect()
}

/// Nuclei and bands on a canvas, with separate streams of random numbers.
pub fn place(spec: &BandSpec, nuclei: Nuclei, periodic: bool, hash: Hash) -> Vec<Band> {
    let (of_nuclei, of_bands) = (hash.with(0), hash.with(1));
    let reach = 0.5 * Vec2::new(spec.length[0].max(spec.length[1]), spec.width[0].max(spec.width[1])).length();
    let cells = (spec.size / spec.pitch).floor().max(Vec2::ZERO).as_uvec2();
    let nuclei = match nuclei {
        Nuclei::Cover => cover(spec.pitch, spec.size, reach, periodic, of_nuclei),
        Nuclei::Claim => claim(spec.pitch, cells.x, cells.y, of_nuclei),
        Nuclei::FlowChart => flow_chart(spec.pitch, spec.size, of_nuclei),
    };
    bands(&nuclei, spec, of_bands)
}

/// The bands as strokes of depth 1 along their length.
pub fn strokes(bands: &[Band]) -> Vec<Stroke> {
    let stroke = |b: &Band| {
        let half = Vec2::new(math::cos(b.angle), math::sin(b.angle)) * (0.5 * b.length);
        Stroke { ends: [b.centre - half, b.centre + half], half_width: 0.5 * b.width, depth: 1.0 }
    };
    bands.iter().map(stroke).collect()
}

/// The source's Gaussian gradation: σ = U/6, cut at the band's edge.
pub const GAUSSIAN: Profile = Profile::Gaussian { sigma: 1.0 / 6.0, cutoff: 0.5 };
