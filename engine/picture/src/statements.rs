//! The conversion that a file states for its samples.
use super::conversion::{ColorSpace, Conversion};
use super::curve::Curve;
use super::primaries::from_chromaticities;
use super::{Header, SampleKind, icc};

impl Conversion {
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
