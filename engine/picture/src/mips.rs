//! Mip levels: a picture at half the size, a quarter, and so on down to one pixel, computed row by row.
//!
//! Each level is the box average of the level before, in linear values; sizes are rounded down. The average is taken of
//! moments. For a normal, this is the vector, normalized when a level is written. For a roughness, this is the square
//! of the distribution's width; part of the variance of the slopes that were averaged away is added (after M. Olano and
//! D. Baker, "LEAN Mapping", 2010). So a bumpy surface keeps its reflectance at a distance.
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The filter from channels of a picture to channels of the smaller levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MipFilter {
    /// One channel: the mean.
    Mean,
    /// Three channels, a normal as ½ + ½n: the direction of the mean.
    Normal,
    /// One channel, a roughness, widened by the variance of the normals that were averaged away. The normal is the
    /// three planes from this index on, counted among all planes that the writer gets.
    Roughness {
        /// The first plane of the normal.
        normal: usize,
    },
}

impl MipFilter {
    /// Number of channels of the picture that it makes.
    pub const fn channels(self) -> usize {
        match self {
            Self::Normal => 3,
            Self::Mean | Self::Roughness { .. } => 1,
        }
    }

    const fn moments(self) -> usize {
        match self {
            Self::Mean => 1,
            Self::Normal => 3,
            Self::Roughness { .. } => 4,
        }
    }

    /// Appends the moments of a row. `planes` holds all planes; those of this filter begin at `first`.
    fn take<'a>(self, planes: &[&'a [f32]], first: usize, out: &mut Vec<Cow<'a, [f32]>>) {
        match self {
            Self::Mean => out.push(Cow::Borrowed(planes[first])),
            Self::Normal => out.extend((first..first + 3).map(|c| planes[c].iter().map(|v| 2.0 * v - 1.0).collect())),
            Self::Roughness { normal } => {
                let slope = |c: usize| {
                    let pairs = planes[normal + c].iter().zip(planes[normal + 2]);
                    pairs.map(|(v, z)| (2.0 * v - 1.0) / (2.0 * z - 1.0).max(STEEPEST)).collect::<Vec<f32>>()
                };
                let (x, y) = (slope(0), slope(1));
                let square = x.iter().zip(&y).map(|(x, y)| x * x + y * y).collect();
                let width = planes[first].iter().map(|r| r.powi(4)).collect();
                out.extend([width, Cow::Owned(x), Cow::Owned(y), square]);
            }
        }
    }

    /// Appends the channels that the moments stand for.
    fn give<'a>(self, moments: &'a [Vec<f32>], out: &mut Vec<Cow<'a, [f32]>>) {
        match self {
            Self::Mean => out.push(Cow::Borrowed(&moments[0])),
            Self::Normal => {
                let [x, y, z] = moments else { return };
                let unit: Vec<f32> = x.iter().zip(y).zip(z).map(|((x, y), z)| (x * x + y * y + z * z).sqrt()).collect();
                let scaled = |plane: &Vec<f32>, level: f32| {
                    // Opposite normals have no mean; the surface then counts as flat.
                    let one = |(v, length): (&f32, &f32)| 0.5 + 0.5 * if *length > 1e-6 { v / length } else { level };
                    plane.iter().zip(&unit).map(one).collect()
                };
                out.extend([scaled(x, 0.0), scaled(y, 0.0), scaled(z, 1.0)]);
            }
            Self::Roughness { .. } => {
                let [width, x, y, square] = moments else { return };
                let slopes = x.iter().zip(y).zip(square);
                let lost = slopes.map(|((x, y), square)| (square - x * x - y * y).max(0.0));
                out.push(
                    width
                        .iter()
                        .zip(lost)
                        .map(|(width, lost)| (width + WIDENING * lost).sqrt().sqrt().min(1.0))
                        .collect(),
                );
            }
        }
    }
}

/// Fraction of the slope variance that is added to the squared width of the distribution. For a Beckmann distribution
/// this is 1. GGX, which renderers use, has longer tails, which lose light at grazing angles: ½ keeps the shape of
/// highlights and loses less light. A distant sphere with slopes of 0.2 reflects within 2 % of the exact value, with
/// slopes of 0.3 within 3.5 %.
const WIDENING: f32 = 0.5;

/// The least z of a normal: steeper slopes than 20 would outweigh all others.
const STEEPEST: f32 = 0.05;

/// The sizes of all levels, beginning with the picture itself.
pub(super) fn sizes(width: u32, height: u32) -> Vec<(u32, u32)> {
    let last = width.max(height).max(1).ilog2();
    (0..=last).map(|level| ((width >> level).max(1), (height >> level).max(1))).collect()
}

/// Computes the rows of all smaller levels from those of the picture.
pub(super) struct Pyramid {
    filters: Vec<MipFilter>,
    levels: Vec<Level>,
}

/// A level under construction.
struct Level {
    width: usize,
    /// Height of the previous level.
    from_height: u32,
    height: u32,
    /// Number of rows of the previous level that have arrived.
    come: u32,
    /// The partial sum of moments for the next row.
    sum: Vec<Vec<f32>>,
}

impl Pyramid {
    pub(super) fn new(filters: &[MipFilter], width: u32, height: u32) -> Self {
        let sizes = sizes(width, height);
        let moments: usize = filters.iter().map(|filter| filter.moments()).sum();
        let level = |pair: &[(u32, u32)]| Level {
            width: pair[1].0 as usize,
            from_height: pair[0].1,
            height: pair[1].1,
            come: 0,
            sum: vec![vec![0.0; pair[1].0 as usize]; moments],
        };
        Self { filters: filters.to_vec(), levels: sizes.windows(2).map(level).collect() }
    }

    /// Takes the next row of the picture, with all planes, and passes on the rows that it completes: the index of the
    /// level and its channels.
    pub(super) fn push(&mut self, planes: &[&[f32]], mut made: impl FnMut(usize, &[Cow<'_, [f32]>])) {
        let mut moments = Vec::new();
        let mut first = 0;
        for filter in &self.filters {
            filter.take(planes, first, &mut moments);
            first += filter.channels();
        }
        for (index, level) in self.levels.iter_mut().enumerate() {
            let Some(row) = level.add(&moments) else { return };
            let mut channels = Vec::new();
            let mut first = 0;
            for filter in &self.filters {
                filter.give(&row[first..first + filter.moments()], &mut channels);
                first += filter.moments();
            }
            made(index + 1, &channels);
            drop(channels);
            moments = row.into_iter().map(Cow::Owned).collect();
        }
    }
}

impl Level {
    /// Takes a row of the previous level; returns a row of this level if that completes it.
    fn add(&mut self, row: &[Cow<'_, [f32]>]) -> Option<Vec<Vec<f32>>> {
        let narrow: Vec<Vec<f32>> = row.iter().map(|plane| halved(plane, self.width)).collect();
        let y = self.come;
        self.come += 1;
        if self.from_height == 1 {
            return Some(narrow);
        }
        let whole = exact(self.from_height);
        let part = |count: u32| exact(count) / whole;
        if self.from_height.is_multiple_of(2) {
            self.weigh(&narrow, 0.5);
            return (y % 2 == 1).then(|| self.complete());
        }
        // Each row of this level covers slightly more than two rows, so a row between two of them is shared.
        let next = y / 2;
        if y % 2 == 1 {
            self.weigh(&narrow, part(self.height));
            return None;
        }
        let done = (next > 0).then(|| {
            self.weigh(&narrow, part(next));
            self.complete()
        });
        if next < self.height {
            self.weigh(&narrow, part(self.height - next));
        }
        done
    }

    fn weigh(&mut self, row: &[Vec<f32>], weight: f32) {
        for (sum, plane) in self.sum.iter_mut().zip(row) {
            sum.iter_mut().zip(plane).for_each(|(sum, v)| *sum += weight * v);
        }
    }

    fn complete(&mut self) -> Vec<Vec<f32>> {
        let empty = vec![vec![0.0; self.width]; self.sum.len()];
        std::mem::replace(&mut self.sum, empty)
    }
}

/// A row scaled down to `width`, half of its own width rounded down.
fn halved(row: &[f32], width: usize) -> Vec<f32> {
    if row.len() == width {
        return row.to_vec();
    }
    if row.len() == 2 * width {
        return row.as_chunks::<2>().0.iter().map(|[a, b]| 0.5 * (a + b)).collect();
    }
    let length = row.len();
    let part = |count: usize| {
        exact(u32::try_from(count).unwrap_or(u32::MAX)) / exact(u32::try_from(length).unwrap_or(u32::MAX))
    };
    let middle = part(width);
    (0..width).map(|i| row[2 * i] * part(width - i) + row[2 * i + 1] * middle + row[2 * i + 2] * part(i + 1)).collect()
}

#[expect(clippy::cast_precision_loss, reason = "a weight need not be exact beyond 24 bits")]
fn exact(count: u32) -> f32 {
    count as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All levels of a picture of one plane.
    fn levels(width: u32, height: u32, pixel: impl Fn(u32, u32) -> f32) -> Vec<Vec<f32>> {
        let mut pyramid = Pyramid::new(&[MipFilter::Mean], width, height);
        let mut made = vec![Vec::new(); sizes(width, height).len()];
        for y in 0..height {
            let row: Vec<f32> = (0..width).map(|x| pixel(x, y)).collect();
            pyramid.push(&[&row], |level, channels| made[level].extend(channels[0].iter()));
        }
        made
    }

    #[test]
    fn keeps_the_mean_at_levels_of_any_size() {
        for (width, height) in [(8, 8), (7, 5), (1, 9), (9, 1), (13, 64), (1, 1), (100, 3), (31, 33)] {
            let sizes = sizes(width, height);
            assert_eq!(*sizes.last().unwrap(), (1, 1));
            let made = levels(width, height, |x, y| (x * 7 + y * y) as f32);
            let mean = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
            let whole: Vec<f32> = (0..height).flat_map(|y| (0..width).map(move |x| (x * 7 + y * y) as f32)).collect();
            for (level, (w, h)) in sizes.iter().enumerate().skip(1) {
                assert_eq!(made[level].len(), (w * h) as usize, "{width}x{height} level {level}");
                // Box filters of equal area keep the mean.
                let (got, expected) = (mean(&made[level]), mean(&whole));
                assert!((got - expected).abs() < 1e-4 * expected.max(1.0), "{width}x{height}: {got} for {expected}");
            }
        }
        // Computed by hand: five columns to two, each two and a half wide.
        let made = &levels(5, 1, |x, _| [1.0, 2.0, 3.0, 4.0, 5.0][x as usize])[1];
        assert!((made[0] - 1.8).abs() < 1e-6 && (made[1] - 4.2).abs() < 1e-6, "{made:?}");
    }

    #[test]
    fn normalizes_normals_and_widens_roughness_by_lost_slopes() {
        // Two slopes of ±1 side by side average to a flat surface, with a slope variance of 1.
        let tilt = 0.5_f32.sqrt();
        let x = [0.5 + 0.5 * tilt, 0.5 - 0.5 * tilt];
        let (y, z) = ([0.5; 2], [0.5 + 0.5 * tilt; 2]);
        let mut pyramid = Pyramid::new(&[MipFilter::Roughness { normal: 1 }, MipFilter::Normal], 2, 1);
        let mut seen = Vec::new();
        pyramid.push(&[&[0.3, 0.3], &x, &y, &z], |level, channels| {
            seen.push((level, channels.iter().map(|plane| plane.to_vec()).collect::<Vec<_>>()))
        });
        let [(1, channels)] = &seen[..] else { panic!("{seen:?}") };
        assert!((channels[0][0] - (0.3_f32.powi(4) + 0.5).powf(0.25)).abs() < 1e-6, "{channels:?}");
        assert_eq!([channels[1][0], channels[2][0], channels[3][0]], [0.5, 0.5, 1.0]);

        // A flat surface keeps its roughness.
        let mut pyramid = Pyramid::new(&[MipFilter::Roughness { normal: 1 }], 2, 1);
        pyramid.push(&[&[0.3, 0.3], &[0.5; 2], &[0.5; 2], &[1.0; 2]], |_, channels| {
            assert!((channels[0][0] - 0.3).abs() < 1e-6);
        });
    }

    fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// The GGX normal distribution.
    fn facets(cosine: f64, roughness: f64) -> f64 {
        let a2 = roughness.powi(4);
        a2 / (std::f64::consts::PI * (cosine * cosine * (a2 - 1.0) + 1.0).powi(2))
    }

    /// The radiance that a dielectric reflects from `light` towards the viewer above, times the cosine: GGX with
    /// Schlick's Fresnel term over a diffuse base of albedo ½.
    fn reflected(normal: [f64; 3], roughness: f64, light: [f64; 3]) -> f64 {
        let half = [light[0], light[1], light[2] + 1.0];
        let half = half.map(|v| v / dot(half, half).sqrt());
        let (nl, nv, nh) = (dot(normal, light), normal[2], dot(normal, half));
        if nl <= 0.0 || nv <= 0.0 {
            return 0.0;
        }
        let a2 = roughness.powi(4);
        let shadow = 0.5 / (nl * (nv * nv * (1.0 - a2) + a2).sqrt() + nv * (nl * nl * (1.0 - a2) + a2).sqrt());
        let fresnel = 0.04 + 0.96 * (1.0 - half[2]).powi(5);
        nl * (facets(nh, roughness) * shadow * fresnel + (1.0 - fresnel) * 0.5 / std::f64::consts::PI)
    }

    /// The normals of a bumpy patch with slopes up to `slope`, and its last level: the mean normal and the roughness.
    fn patch(slope: f32, roughness: f32) -> (Vec<[f64; 3]>, [f64; 3], f64) {
        let side = 32_u32;
        let mut pyramid = Pyramid::new(&[MipFilter::Roughness { normal: 1 }, MipFilter::Normal], side, side);
        let (mut texel, mut normals) = (Vec::new(), Vec::new());
        for y in 0..side {
            let mut planes = [vec![roughness; side as usize], vec![], vec![], vec![]];
            for x in 0..side {
                let (x, y) = (x as f32, y as f32);
                let (sx, sy) = (slope * (x * 0.8).sin(), slope * (y * 0.59 + 0.3 * x).cos());
                let length = (sx * sx + sy * sy + 1.0).sqrt();
                let normal = [sx / length, sy / length, 1.0 / length];
                normals.push(normal.map(f64::from));
                (0..3).for_each(|c| planes[c + 1].push(0.5 + 0.5 * normal[c]));
            }
            let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
            pyramid.push(&planes, |level, channels| {
                if level == 5 {
                    texel = channels.iter().map(|plane| f64::from(plane[0])).collect();
                }
            });
        }
        (normals, [texel[1], texel[2], texel[3]].map(|v| 2.0 * v - 1.0), texel[0])
    }

    #[test]
    fn keeps_the_reflectance_of_a_distant_bumpy_sphere() {
        // Light from all directions except straight behind: points along a spiral around the sphere.
        let light = |i: i32| {
            let (turn, z) = (f64::from(i) * 2.399_963, 1.0 - f64::from(2 * i + 1) / 40.0);
            [(1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z]
        };
        let around: Vec<[f64; 3]> = (0..39).map(light).collect();
        for (slope, roughness, most) in [(0.1, 0.3_f32, 0.02), (0.2, 0.2, 0.02), (0.2, 0.5, 0.02), (0.3, 0.3, 0.035)] {
            let (normals, mean, wide) = patch(slope, roughness);
            for lights in [&around[..], &[[0.0, 0.6, 0.8]]] {
                let (mut exact, mut filtered) = (0.0, 0.0);
                // The sphere seen from above: points of a disk.
                for i in 0..400 {
                    let at = [f64::from(i % 20) / 9.5 - 1.0, f64::from(i / 20) / 9.5 - 1.0];
                    let r2 = at[0] * at[0] + at[1] * at[1];
                    if r2 > 0.95 {
                        continue;
                    }
                    let n = [at[0], at[1], (1.0 - r2).sqrt()];
                    // A frame whose third axis is the normal of the sphere.
                    let t = [1.0 - n[0] * n[0] / (1.0 + n[2]), -n[0] * n[1] / (1.0 + n[2]), -n[0]];
                    let b = [t[1], 1.0 - n[1] * n[1] / (1.0 + n[2]), -n[1]];
                    let turned = |m: [f64; 3]| [0, 1, 2].map(|c| m[0] * t[c] + m[1] * b[c] + m[2] * n[c]);
                    for &light in lights {
                        let fine = normals.iter().map(|m| reflected(turned(*m), f64::from(roughness), light));
                        exact += fine.sum::<f64>() / normals.len() as f64;
                        filtered += reflected(turned(mean), wide, light);
                    }
                }
                let error = (filtered / exact - 1.0).abs();
                assert!(error < most, "{slope}, {roughness}, {} lights: {filtered} for {exact}", lights.len());
            }
        }
    }

    #[test]
    fn highlights_keep_their_width() {
        for (slope, roughness) in [(0.2, 0.2_f32), (0.3, 0.3), (0.3, 0.4)] {
            let (normals, mean, wide) = patch(slope, roughness);
            // The brightness of the patch when the half vector is tilted by this angle.
            let (mut plain, mut widened) = (0.0, 0.0);
            for degrees in (0_i32..40).step_by(2) {
                let angle = f64::from(degrees).to_radians();
                let half = [angle.sin(), 0.0, angle.cos()];
                let fine = normals.iter().map(|m| facets(dot(*m, half), f64::from(roughness)));
                let exact = fine.sum::<f64>() / normals.len() as f64;
                plain += (facets(dot(mean, half), f64::from(roughness)) - exact).abs() * angle.sin();
                widened += (facets(dot(mean, half), wide) - exact).abs() * angle.sin();
            }
            assert!(widened < 0.6 * plain, "{slope}, {roughness}: {widened} and {plain}");
        }
    }
}
