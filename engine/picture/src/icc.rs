//! ICC profiles of a matrix and curves. `moxcms` parses them; they are evaluated here, with functions that give the
//! same bits on every machine.
use super::conversion::Conversion;
use super::curve::Curve;
use super::guard::guarded;
use super::limits::ReadError;
use super::primaries::{Matrix, from_colorants};
use moxcms::{ColorProfile, DataColorSpace, ParsingOptions, ToneReprCurve};

/// Maximum size of a profile in bytes; large ones, of printers, have a few MiB.
pub(super) const MOST_BYTES: usize = 4 << 20;
/// Maximum number of entries of a profile: usual ones have about 20, and each may be as long as the file.
const MOST_TAGS: u32 = 100;

/// The conversion to linear Rec. 709 by a profile, for a picture with one channel or three.
///
/// # Errors
/// The reason why the profile is not used, as `is …`.
pub(super) fn conversion(bytes: &[u8], channels: u8) -> Result<Conversion, String> {
    if bytes.len() > MOST_BYTES {
        return Err(too_large());
    }
    let tags = bytes.get(128..).and_then(<[u8]>::first_chunk).map_or(0, |count| u32::from_be_bytes(*count));
    if tags > MOST_TAGS {
        return Err(format!("has {tags} entries; {MOST_TAGS} are read"));
    }
    let options = ParsingOptions { max_profile_size: MOST_BYTES + 1, ..ParsingOptions::default() };
    let parse = || ColorProfile::new_from_slice_with_options(bytes, options).map_err(ReadError::corrupt);
    let profile = guarded(parse).map_err(|_| "is damaged".to_owned())?;
    match (profile.color_space, channels) {
        (DataColorSpace::Rgb, 3) => Ok(Conversion { curves: curves(&profile)?, matrix: matrix(&profile)? }),
        (DataColorSpace::Gray, 1) => {
            let curve = curve(profile.gray_trc.as_ref())?;
            Ok(Conversion { curves: [curve.clone(), curve.clone(), curve], matrix: None })
        }
        (DataColorSpace::Rgb, _) => Err("is one of RGB, and the picture is grey".into()),
        (DataColorSpace::Gray, _) => Err("is one of grey, and the picture has colours".into()),
        _ => Err("is neither one of RGB nor one of grey".into()),
    }
}

/// Reason for not using a profile larger than [`MOST_BYTES`].
pub(super) fn too_large() -> String {
    format!("is larger than {} MiB", MOST_BYTES >> 20)
}

fn matrix(profile: &ColorProfile) -> Result<Matrix, String> {
    if profile.pcs != DataColorSpace::Xyz {
        return Err(tables());
    }
    let colorants = [profile.red_colorant, profile.green_colorant, profile.blue_colorant];
    from_colorants(colorants.map(|color| [color.x, color.y, color.z]))
        .ok_or_else(|| "has primaries of no colours".into())
}

fn curves(profile: &ColorProfile) -> Result<[Curve; 3], String> {
    let [red, green, blue] =
        [&profile.red_trc, &profile.green_trc, &profile.blue_trc].map(|stored| curve(stored.as_ref()));
    Ok([red?, green?, blue?])
}

fn tables() -> String {
    "is made of tables for all channels together, not of a matrix and curves".into()
}

fn curve(stored: Option<&ToneReprCurve>) -> Result<Curve, String> {
    let curve = match stored.ok_or_else(tables)? {
        ToneReprCurve::Lut(values) => match values[..] {
            [] => Curve::Linear,
            // Fixed-point number with 8 fraction bits.
            [gamma] => Curve::Gamma(f64::from(gamma) / 256.0),
            _ => Curve::Table(values.clone()),
        },
        ToneReprCurve::Parametric(numbers) => parametric(numbers)?,
    };
    if curve.is_sane() { Ok(curve.recognized()) } else { Err("has curves that do not rise from black to white".into()) }
}

/// The parametric curves of ICC by their number of parameters (ICC.1:2022, table 68).
fn parametric(numbers: &[f32]) -> Result<Curve, String> {
    let all = match *numbers {
        [g] => [g, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [g, a, b] => [g, a, b, 0.0, -b / a, 0.0, 0.0],
        [g, a, b, c] => [g, a, b, 0.0, -b / a, c, c],
        [g, a, b, c, d] => [g, a, b, c, d, 0.0, 0.0],
        [g, a, b, c, d, e, f] => [g, a, b, c, d, e, f],
        _ => return Err("is damaged".into()),
    };
    Ok(Curve::Parametric(all.map(f64::from)))
}
