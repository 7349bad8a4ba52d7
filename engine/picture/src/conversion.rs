//! Conversion from the samples of a file to the working space, linear Rec. 709. The user's choice has priority, then
//! the file's own statements, then the convention for such files.
use super::color::AP1_TO_REC709;
use super::curve::Curve;
use super::primaries::{Matrix, from_chromaticities};
use super::{Header, Picture, SampleKind, icc};
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
    fn of(curve: Curve, matrix: Matrix) -> Self {
        Self { curves: [curve.clone(), curve.clone(), curve], matrix }
    }

    /// The conversion that a file states for its own samples. Also returns a message for each statement that cannot be
    /// used, with the assumption that replaces it.
    ///
    /// The first statement in this order is used: `cICP`, an ICC profile, `sRGB`, then gamma and chromaticities.
    /// Without a statement, colours in 8-bit and 16-bit integers are sRGB, float colours are linear, and everything
    /// else is data. A single channel is colour only if an ICC profile says so.
    #[must_use]
    pub fn of_file(header: &Header) -> (Self, Vec<String>) {
        let channels = header.channels - u8::from(header.has_alpha);
        let integers = matches!(header.kind, SampleKind::U8 | SampleKind::U16);
        let usual = Self::from(if channels >= 3 && integers { ColorSpace::Srgb } else { ColorSpace::Raw });
        let floats = matches!(header.kind, SampleKind::F16 | SampleKind::F32);
        if channels == 2 || !(integers || floats) {
            return (usual, Vec::new());
        }
        let mut unused = Vec::new();
        let mut found = None;
        for saying in [cicp, of_profile, srgb, gamma] {
            match saying(header, channels) {
                Some(Err(why)) => unused.push(why),
                Some(Ok(conversion)) => {
                    found = Some(conversion);
                    break;
                }
                None => {}
            }
        }
        let assumed = match (&found, channels >= 3, integers) {
            (Some(_), ..) => "what else it says of its colours is used instead",
            (None, true, true) => "its colours are taken as sRGB",
            (None, true, false) => "its colours are taken as linear Rec. 709",
            (None, false, _) => "its samples are taken as they are",
        };
        let unused = unused.into_iter().map(|why| format!("{why}; {assumed}")).collect();
        (found.unwrap_or(usual), unused)
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

/// A statement of a file about its samples: none, a usable one, or the reason why it is not usable.
type Saying = Option<Result<Conversion, String>>;

fn cicp(header: &Header, channels: u8) -> Saying {
    let [primaries, curve, matrix, full] = header.told.cicp.filter(|_| channels >= 3)?;
    let chromaticities = match primaries {
        1 => [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329],
        5 => [0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 0.3127, 0.329],
        6 | 7 => [0.63, 0.34, 0.31, 0.595, 0.155, 0.07, 0.3127, 0.329],
        9 => [0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329],
        10 => [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0 / 3.0, 1.0 / 3.0],
        11 => [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.314, 0.351],
        12 => [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329],
        22 => [0.63, 0.34, 0.295, 0.605, 0.155, 0.077, 0.3127, 0.329],
        _ => return Some(Err(format!("its `cICP` names primaries `{primaries}`, which are not known"))),
    };
    let curve = match curve {
        1 | 6 | 14 | 15 => Curve::Rec709,
        4 => Curve::Gamma(2.2),
        5 => Curve::Gamma(2.8),
        8 => Curve::Linear,
        13 => Curve::Srgb,
        16 => Curve::Pq,
        18 => Curve::Hlg,
        _ => return Some(Err(format!("its `cICP` names curve `{curve}`, which is not known"))),
    };
    if matrix != 0 || full != 1 {
        return Some(Err("its `cICP` is that of video, not of RGB in its full range".into()));
    }
    from_chromaticities(chromaticities).map(|matrix| Ok(Conversion::of(curve, matrix)))
}

fn of_profile(header: &Header, channels: u8) -> Saying {
    let found = match (&header.icc, &header.told.broken_profile) {
        (Some(bytes), _) => icc::conversion(bytes, channels.min(3)),
        (None, Some(why)) => Err(why.clone()),
        (None, None) => return None,
    };
    Some(found.map_err(|why| format!("its ICC profile {why}")))
}

fn srgb(header: &Header, channels: u8) -> Saying {
    (header.told.srgb && channels >= 3).then(|| Ok(ColorSpace::Srgb.into()))
}

/// `gAMA` and `cHRM` of PNG, and the chromaticities of EXR.
fn gamma(header: &Header, channels: u8) -> Saying {
    /// 1/2.2, the gamma that marks sRGB files.
    const OF_SRGB: std::ops::RangeInclusive<u32> = 45_450..=45_460;
    let told = &header.told;
    if channels < 3 || (told.gamma.is_none() && told.chromaticities.is_none()) {
        return None;
    }
    let curve = match told.gamma {
        None if header.kind.is_float() => Curve::Linear,
        None => Curve::Srgb,
        Some(gamma) if OF_SRGB.contains(&gamma) => Curve::Srgb,
        Some(100_000) => Curve::Linear,
        Some(gamma @ 10_000..=1_000_000) => Curve::Gamma(100_000.0 / f64::from(gamma)),
        Some(gamma) => return Some(Err(format!("its `gAMA` is {gamma}, which is the power of no picture"))),
    };
    let matrix = match told.chromaticities {
        Some(chromaticities) => from_chromaticities(chromaticities.map(f64::from)),
        None => Some(None),
    };
    let wrong = || "its chromaticities are those of no colours".to_owned();
    Some(matrix.ok_or_else(wrong).map(|matrix| Conversion::of(curve, matrix)))
}

#[cfg(test)]
mod tests;
