//! Conversion from the samples of a file to the working space, linear Rec. 709. The user's choice has priority, then
//! the file's own statements, then the convention for such files.
use super::color::AP1_TO_REC709;
use super::curve::Curve;
use super::primaries::Matrix;
use super::{Picture, SampleKind};
use rayon::prelude::*;

/// The meaning of the samples of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// Colour, encoded by the sRGB curve.
    Srgb,
    /// Colour, proportional to light.
    Linear,
    /// Colour of ACEScg: AP1 primaries, proportional to light.
    AcesCg,
    /// Data, not colour: heights, masks, normals.
    Raw,
}

/// The conversion from the samples of a picture to linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct Conversion {
    /// The curves of red, green and blue; the first one is used for grey.
    pub(super) curves: [Curve; 3],
    /// Applied after the curves.
    pub(super) matrix: Matrix,
}

/// Number of samples that a thread processes at a time.
const CHUNK: usize = 1 << 16;

impl From<ColorSpace> for Conversion {
    fn from(space: ColorSpace) -> Self {
        let curve = if space == ColorSpace::Srgb { Curve::Srgb } else { Curve::Linear };
        Self::of(curve, (space == ColorSpace::AcesCg).then_some(AP1_TO_REC709))
    }
}

impl Conversion {
    pub(super) fn of(curve: Curve, matrix: Matrix) -> Self {
        Self { curves: [curve.clone(), curve.clone(), curve], matrix }
    }

    /// Converts the samples in place; opacity is unchanged.
    pub fn apply(&self, picture: &mut Picture) {
        let (pixels, channels) = (picture.pixels(), usize::from(picture.data_channels()));
        let max = match picture.source {
            SampleKind::U8 => Some(255),
            SampleKind::U16 => Some(65535),
            _ => None,
        };
        let planes = picture.planes[..pixels * channels].chunks_exact_mut(pixels);
        let mut tables: Vec<(&Curve, Vec<f32>)> = Vec::new();
        for (curve, plane) in self.curves.iter().chain(std::iter::repeat(&self.curves[2])).zip(planes) {
            match max {
                _ if *curve == Curve::Linear => {}
                Some(max) => {
                    if tables.iter().all(|(known, _)| *known != curve) {
                        let codes = (0..=max).map(|code| light(curve, f32::from(code) / f32::from(max)));
                        tables.push((curve, codes.collect()));
                    }
                    let table = tables.iter().find(|(known, _)| *known == curve).map_or(&[][..], |(_, table)| table);
                    by_table(plane, (curve, table), max);
                }
                None => plane.par_iter_mut().for_each(|sample| *sample = light(curve, *sample)),
            }
        }
        if let Some(matrix) = self.matrix.filter(|_| channels >= 3) {
            mix(&mut picture.planes[..3 * pixels], &matrix);
        }
    }
}

/// Divides colours by their opacity. Colours of fully transparent pixels are unchanged.
pub fn divide_by_alpha(picture: &mut Picture) {
    if !picture.has_alpha {
        return;
    }
    let (pixels, integers) = (picture.pixels(), !picture.source.is_float());
    let (colors, alpha) = picture.planes.split_at_mut(pixels * usize::from(picture.channels - 1));
    for plane in colors.chunks_exact_mut(pixels) {
        let parts = plane.par_chunks_mut(CHUNK).zip(alpha.par_chunks(CHUNK));
        parts.for_each(|(plane, alpha)| {
            for (sample, alpha) in plane.iter_mut().zip(alpha).filter(|(_, alpha)| **alpha > 0.0 && **alpha < 1.0) {
                let whole = *sample / alpha;
                *sample = if integers { whole.min(1.0) } else { whole };
            }
        });
    }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to the precision of a sample is meant")]
fn light(curve: &Curve, sample: f32) -> f32 {
    curve.at(f64::from(sample)) as f32
}

/// Integer pictures have few distinct values, so a table look-up replaces the power function. A sample between two
/// table entries was divided by its opacity and is converted exactly.
fn by_table(samples: &mut [f32], (curve, table): (&Curve, &[f32]), max: u16) {
    samples.par_chunks_mut(CHUNK).for_each(|chunk| {
        for sample in chunk {
            let code = code_of(*sample, max);
            let exact = f32::from(code) / f32::from(max) == *sample;
            *sample = match table.get(usize::from(code)).filter(|_| exact) {
                Some(light) => *light,
                None => light(curve, *sample),
            };
        }
    });
}

#[expect(clippy::cast_possible_truncation, reason = "samples of integer pictures lie in 0..1; the cast saturates")]
#[expect(clippy::cast_sign_loss, reason = "the cast saturates at 0")]
fn code_of(sample: f32, max: u16) -> u16 {
    (sample * f32::from(max) + 0.5) as u16
}

fn mix(planes: &mut [f32], matrix: &[[f32; 3]; 3]) {
    let pixels = planes.len() / 3;
    let (red, rest) = planes.split_at_mut(pixels);
    let (green, blue) = rest.split_at_mut(pixels);
    let parts = red.par_chunks_mut(CHUNK).zip(green.par_chunks_mut(CHUNK)).zip(blue.par_chunks_mut(CHUNK));
    parts.for_each(|((red, green), blue)| {
        for ((r, g), b) in red.iter_mut().zip(green).zip(blue) {
            let color = [*r, *g, *b];
            [*r, *g, *b] = matrix.map(|row| row[0] * color[0] + row[1] * color[1] + row[2] * color[2]);
        }
    });
}

#[cfg(test)]
mod tests;
