//! Transfer curves from stored samples to linear light.
use super::color::decode;
use libm::pow;

/// The luminance of reference white in cd/m² (ITU-R BT.2408) for signals with absolute luminance; it is mapped to 1.
const WHITE: f64 = 203.0;

/// A curve from a stored sample to linear light. 1 is the largest sample of an integer picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Curve {
    /// Samples are linear.
    Linear,
    /// IEC 61966-2-1.
    Srgb,
    /// A power function.
    Gamma(f64),
    /// The most general parametric curve of ICC, with g, a, b, c, d, e, f: `(a·x + b)^g + e` from `d` on, and `c·x + f`
    /// below.
    Parametric([f64; 7]),
    /// A table with equal spacing, at least two values; 65535 stands for 1.
    Table(Vec<u16>),
    /// The inverse of the camera curve of ITU-R BT.709.
    Rec709,
    /// SMPTE ST 2084, relative to reference white.
    Pq,
    /// Scene light of HLG (ITU-R BT.2100), relative to reference white.
    Hlg,
}

impl Curve {
    /// The linear value of a sample; the curve is mirrored for negative samples.
    pub(super) fn at(&self, sample: f64) -> f64 {
        if sample < 0.0 { -self.of(-sample) } else { self.of(sample) }
    }

    fn of(&self, x: f64) -> f64 {
        match self {
            Self::Linear => x,
            Self::Srgb => decode(x),
            Self::Gamma(gamma) => pow(x, *gamma),
            Self::Parametric([g, a, b, c, d, e, f]) => {
                if x >= *d {
                    pow((a * x + b).max(0.0), *g) + e
                } else {
                    c * x + f
                }
            }
            Self::Table(values) => between(values, x),
            Self::Rec709 => {
                if x < 0.081 {
                    x / 4.5
                } else {
                    pow((x + 0.099) / 1.099, 1.0 / 0.45)
                }
            }
            Self::Pq => pq(x),
            Self::Hlg => hlg(x) / hlg(0.75),
        }
    }

    /// Replaces a rounded form of a known curve by the exact curve.
    pub(super) fn recognized(self) -> Self {
        const SAMPLES: u16 = 512;
        let near = |exact: &Self, most: f64| {
            let mut samples = (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES));
            samples.all(|x| (self.at(x) - exact.at(x)).abs() < most)
        };
        [(Self::Srgb, 5e-4), (Self::Linear, 1e-5)]
            .into_iter()
            .find_map(|(exact, most)| near(&exact, most).then_some(exact))
            .unwrap_or(self)
    }

    /// True for plausible curves of pictures: increasing, and ending near 1.
    pub(super) fn is_sane(&self) -> bool {
        let values: Vec<f64> = (0..=64_u8).map(|k| self.at(f64::from(k) / 64.0)).collect();
        values.iter().all(|value| (-0.5..=2.0).contains(value)) && values[64] - values[0] > 0.1
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place within the table")]
#[expect(clippy::cast_precision_loss, reason = "tables are short")]
fn between(values: &[u16], x: f64) -> f64 {
    let last = values.len() - 1;
    // A NaN becomes 0.
    let place = (x * last as f64).min(last as f64).max(0.0);
    let (index, part) = (place as usize, place - place.floor());
    let value = |index: usize| f64::from(values[index.min(last)]) / 65535.0;
    value(index) + part * (value(index + 1) - value(index))
}

fn pq(x: f64) -> f64 {
    const M1: f64 = 2610.0 / 16384.0;
    const M2: f64 = 2523.0 / 32.0;
    const C: [f64; 3] = [3424.0 / 4096.0, 2413.0 / 128.0, 2392.0 / 128.0];
    let power = pow(x.min(1.0), 1.0 / M2);
    pow((power - C[0]).max(0.0) / (C[1] - C[2] * power), 1.0 / M1) * (10_000.0 / WHITE)
}

fn hlg(x: f64) -> f64 {
    const A: f64 = 0.178_832_77;
    const C: f64 = 0.559_910_73;
    if x <= 0.5 { x * x / 3.0 } else { (libm::exp((x - C) / A) + 1.0 - 4.0 * A) / 12.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn near(curve: &Curve, x: f64, expected: f64) {
        let value = curve.at(x);
        assert!((value - expected).abs() < 1e-4 * expected.abs().max(1.0), "{curve:?}: {value}, not {expected}");
    }

    #[test]
    fn follows_the_standards() {
        near(&Curve::Gamma(2.2), 0.5, 0.217_638);
        near(&Curve::Gamma(2.2), -0.5, -0.217_638);
        near(&Curve::Rec709, 0.5, 0.259_589);
        // BT.2408: reference white is at 58 % of PQ and 75 % of HLG.
        near(&Curve::Pq, 0.580_689, 1.0);
        near(&Curve::Pq, 1.0, 10_000.0 / 203.0);
        near(&Curve::Hlg, 0.75, 1.0);
        near(&Curve::Hlg, 0.5, 1.0 / 12.0 / 0.264_963);
        near(&Curve::Table(vec![0, 16384, 65535]), 0.75, (16384.0 + 65535.0) / 2.0 / 65535.0);
        near(&Curve::Table(vec![0, 65535]), 7.0, 1.0);
    }

    #[test]
    fn recognizes_srgb() {
        let parametric = [2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045, 0.0, 0.0];
        assert_eq!(Curve::Parametric(parametric).recognized(), Curve::Srgb);
        assert_eq!(Curve::Gamma(1.0).recognized(), Curve::Linear);
        assert_eq!(Curve::Gamma(2.2).recognized(), Curve::Gamma(2.2));
    }

    #[test]
    fn rejects_curves_that_are_not_of_pictures() {
        let wrong = [
            Curve::Gamma(-1.0),
            Curve::Gamma(0.0),
            Curve::Table(vec![7, 7]),
            Curve::Parametric([1.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ];
        assert!(wrong.iter().all(|curve| !curve.is_sane()));
        assert!(Curve::Srgb.is_sane() && Curve::Gamma(2.6).is_sane());
    }
}
