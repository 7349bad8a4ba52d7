//! Two pictures of a material compared: size, direction, contrast, colour, and a distance that does not depend on where things lie.
#![allow(clippy::disallowed_methods, reason = "no picture that is written is made here")]
mod fourier;
mod gauge;
mod plane;
mod spectrum;
mod stats;
#[cfg(test)]
mod tests;

use fourier::{Spectrum, periodic};
pub use gauge::{Gauge, Uneven};
use plane::{Colors, flatten, oklab, part, resample, shown};
use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};
use shibo_picture::Picture;
use spectrum::{quarters, size_and_turn};
use stats::{Bank, Stats};
pub use stats::{Parts, Scale};

/// Pixels of the compared pictures; finer pictures are scaled.
const PIXELS: f64 = 256.0;
/// Fewest pixels of a picture that can be compared.
const LEAST: usize = 32;
/// Fewest pixels of a picture whose halves tell how much places differ.
const HALVES: usize = 128;
/// A peak of the correlation this many times its deviation is a shift.
const PEAK: f64 = 12.0;

/// Two pictures and their widths.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct CompareRequest {
    /// Width of A in mm; that of B if not given.
    pub width_mm_a: Option<f64>,
    /// Width of B in mm; that of A if not given. Without both, the pictures are equally wide.
    pub width_mm_b: Option<f64>,
}

/// A measured difference.
#[cfg_attr(feature = "agents", derive(schemars::JsonSchema))]
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured<T> {
    /// The difference of A from B.
    pub value: T,
    /// Its standard error. That of a factor is a factor.
    pub error: f64,
}

/// The differences of A from B. `None` where a difference cannot be measured.
#[cfg_attr(feature = "agents", derive(schemars::JsonSchema))]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Distance of the statistics; 0 for equal pictures.
    pub distance: f64,
    /// Distance between the halves of B.
    pub floor: Option<f64>,
    /// Distance by block.
    pub parts: Parts,
    /// Factor by which A is coarser.
    pub size: Option<Measured<f64>>,
    /// Degrees by which A is turned counter-clockwise, -90..90.
    pub turn: Option<Measured<f64>>,
    /// Contrast of the lightness, as a factor.
    pub contrast: Option<Measured<f64>>,
    /// Difference of the mean in OKLab, in hundredths: lightness, green to red, blue to yellow.
    pub color: Option<Measured<[f64; 3]>>,
    /// Contrast of fine detail over all contrast, as a factor.
    pub detail: Option<Measured<f64>>,
    /// Height of highlights over the contrast, as a factor.
    pub gloss: Option<Measured<f64>>,
    /// Shift to the right and down, in shares of the width, if the pictures show one place.
    pub shift: Option<Measured<[f64; 2]>>,
    /// The differences that one would see, in words.
    pub words: Vec<String>,
}

/// Compares two pictures. The message of an error names the picture and the remedy.
pub fn compare(a: &Picture, b: &Picture, request: &CompareRequest) -> Result<Comparison, String> {
    let (a, b) = aligned(&shown(a), &shown(b), request)?;
    let bank = &mut Bank::default();
    let (of_a, of_b) = (Stats::of(&a, bank), Stats::of(&b, bank));
    let (distance, parts) = of_a.distance(&of_b);
    let side = b[0].width;
    let floor = (side >= HALVES).then(|| {
        let mut half = |x: usize| Stats::of(&part(&b, [x, 0], [side / 2, side]), bank);
        half(0).distance(&half(side - side / 2)).0
    });
    let (size, turn) = size_and_turn(&a, &b);
    let (tones_a, tones_b) = (Tones::of(&a, &of_a), Tones::of(&b, &of_b));
    let mut tones = |colors: &Colors| Tones::of(colors, &Stats::of(colors, bank));
    let of_quarters: Vec<(Tones, Tones)> =
        quarters(&a).iter().zip(&quarters(&b)).map(|(a, b)| (tones(a), tones(b))).collect();
    let factor = |of: fn(&Tones) -> f64| {
        let values: Vec<f64> = of_quarters.iter().map(|(a, b)| of(a) - of(b)).collect();
        let good = [&tones_a, &tones_b].iter().all(|tones| tones.deviation > 1e-4);
        good.then(|| Measured { value: libm::exp(of(&tones_a) - of(&tones_b)), error: libm::exp(error(&values)) })
    };
    let color = [0, 1, 2].map(|channel: usize| 100.0 * (tones_a.mean[channel] - tones_b.mean[channel]));
    let color_errors = [0, 1, 2].map(|channel: usize| {
        error(&of_quarters.iter().map(|(a, b)| 100.0 * (a.mean[channel] - b.mean[channel])).collect::<Vec<_>>())
    });
    let known =
        |(value, error): (f64, f64), good: bool| (good && value.is_finite()).then_some(Measured { value, error });
    let contrasts = [&tones_a, &tones_b].iter().all(|tones| tones.deviation > 1e-4);
    let mut comparison = Comparison {
        distance,
        floor,
        parts,
        size: known(size, contrasts && size.1 < 2.0),
        turn: known(turn, contrasts && turn.1 < 45.0),
        contrast: factor(|tones| libm::log(tones.deviation.max(1e-9))),
        color: Some(Measured {
            value: color,
            error: color_errors.iter().map(|error| error * error).sum::<f64>().sqrt(),
        }),
        detail: factor(|tones| tones.detail),
        gloss: factor(|tones| tones.gloss),
        shift: shift(&a, &b),
        words: Vec::new(),
    };
    comparison.words = words(&comparison);
    Ok(comparison)
}

/// Both pictures at one size of pixels, cut to equal squares around their middles.
#[expect(clippy::cast_possible_truncation, reason = "sizes of pictures, bounded above")]
fn aligned(a: &Colors, b: &Colors, request: &CompareRequest) -> Result<(Colors, Colors), String> {
    let width_a = request.width_mm_a.or(request.width_mm_b).unwrap_or(1.0);
    let width_b = request.width_mm_b.or(request.width_mm_a).unwrap_or(1.0);
    if ![width_a, width_b].iter().all(|width| width.is_finite() && *width > 0.0) {
        return Err("the width of a picture must be above 0 mm".to_owned());
    }
    let pixel = (width_a / a[0].width as f64).max(width_b / b[0].width as f64).max(width_a.max(width_b) / PIXELS);
    let scaled = |colors: &Colors, width: f64| resample(colors, ((width / pixel).round() as usize).max(16));
    let (a, b) = (scaled(a, width_a), scaled(b, width_b));
    let side = [&a, &b].iter().flat_map(|colors| [colors[0].width, colors[0].height]).min().unwrap_or(0);
    if side < LEAST {
        return Err(format!(
            "the pictures have {side} pixels in common, and at least {LEAST} are needed: take larger ones"
        ));
    }
    let cut =
        |colors: &Colors| part(colors, [(colors[0].width - side) / 2, (colors[0].height - side) / 2], [side, side]);
    Ok((cut(&a), cut(&b)))
}

/// Tones of a picture.
struct Tones {
    /// The mean in OKLab.
    mean: [f64; 3],
    /// Standard deviation of the lightness.
    deviation: f64,
    /// Logarithm of the height of highlights over the deviation.
    gloss: f64,
    /// Logarithm of the contrast of fine detail over the deviation.
    detail: f64,
}

impl Tones {
    fn of(colors: &Colors, stats: &Stats) -> Self {
        let lab = oklab(colors);
        let flat = flatten(&lab[0]);
        let deviation = flat.deviation();
        let high = flat.quantile(0.995) - flat.quantile(0.5);
        let log = |value: f64| libm::log((value / deviation.max(1e-6)).max(1e-6));
        let detail = stats.detail() - libm::log(deviation.max(1e-6));
        Self { mean: [0, 1, 2].map(|channel: usize| lab[channel].mean()), deviation, gloss: log(high), detail }
    }
}

/// Standard error of the mean of values from places.
fn error(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (squares / (count - 1.0) / count).sqrt()
}

/// The shift of A against B, by the peak of their phase correlation.
fn shift(a: &Colors, b: &Colors) -> Option<Measured<[f64; 2]>> {
    let spectrum = |colors: &Colors| Spectrum::of(&periodic(&oklab(colors)[0].centred()));
    let (mut product, other) = (spectrum(a), spectrum(b));
    for (value, other) in product.values.iter_mut().zip(&other.values) {
        let both = *value * other.conj();
        *value = if both.norm() > 1e-12 { both / both.norm() } else { Complex64::ZERO };
    }
    let peaks = product.inverse();
    let square: f64 = peaks.values.iter().map(|value| value.re * value.re).sum();
    let deviation = (square / peaks.values.len() as f64).sqrt();
    let at = (0..peaks.values.len()).max_by(|x, y| peaks.values[*x].re.total_cmp(&peaks.values[*y].re))?;
    if deviation <= 0.0 || peaks.values[at].re < PEAK * deviation {
        return None;
    }
    let share = |index: usize, count: usize| {
        let signed = if index > count / 2 { index as f64 - count as f64 } else { index as f64 };
        signed / count as f64
    };
    let value = [share(at % peaks.width, peaks.width), share(at / peaks.width, peaks.height)];
    Some(Measured { value, error: 0.5 / peaks.width as f64 })
}

/// The differences that one would see.
fn words(found: &Comparison) -> Vec<String> {
    let mut words = Vec::new();
    let mut factor = |measured: Option<Measured<f64>>, least: f64, say: &dyn Fn(f64) -> String| {
        if let Some(Measured { value, error }) = measured
            && libm::log(value).abs() > libm::log(least).max(2.0 * libm::log(error))
        {
            words.push(say(value));
        }
    };
    factor(found.size, 1.06, &|size| {
        format!("too {} by {:.2}×", if size > 1.0 { "coarse" } else { "fine" }, size.max(1.0 / size))
    });
    factor(found.contrast, 1.08, &|contrast| {
        format!("too {}: contrast {contrast:.2}×", if contrast > 1.0 { "contrasty" } else { "flat" })
    });
    factor(found.detail, 1.15, &|detail| {
        format!("too {}: fine detail {detail:.2}×", if detail > 1.0 { "sharp" } else { "soft" })
    });
    factor(found.gloss, 1.25, &|gloss| {
        format!("too {}: highlights {gloss:.2}×", if gloss > 1.0 { "glossy" } else { "matt" })
    });
    if let Some(Measured { value, error }) = found.turn
        && value.abs() > (2.0 * error).max(4.0)
        && error < 15.0
    {
        words.push(format!(
            "turned by {:.0}° {}",
            value.abs(),
            if value > 0.0 { "counter-clockwise" } else { "clockwise" }
        ));
    }
    if let Some(Measured { value: [lightness, red, yellow], .. }) = found.color {
        if lightness.abs() > 1.5 {
            words.push(format!(
                "too {} by {:.0} of 100",
                if lightness > 0.0 { "light" } else { "dark" },
                lightness.abs()
            ));
        }
        if libm::hypot(red, yellow) > 1.0 {
            let hues =
                [(red, "red", "green"), (yellow, "yellow", "blue")].into_iter().filter(|(value, ..)| value.abs() > 0.7);
            let hues: Vec<&str> = hues.map(|(value, more, less)| if value > 0.0 { more } else { less }).collect();
            words.push(format!("too {}", hues.join(" and ")));
        }
    }
    if let Some(Measured { value: [x, y], error }) = found.shift
        && libm::hypot(x, y) > 2.0 * error
    {
        words.push(format!("shifted by {:.1} % of the width to the right and {:.1} % down", 100.0 * x, 100.0 * y));
    }
    if words.is_empty() {
        words.push("no difference that one would see".to_owned());
    }
    words
}
