//! The unknowns of a fit, as coordinates from 0 to 1.

/// The kind of an unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A number between two bounds. Bounds above 0 that are far apart make a logarithmic coordinate.
    Number {
        /// The smallest value.
        low: f64,
        /// The largest value.
        high: f64,
    },
    /// A direction in degrees that means the same after `turn` degrees: 180 or 360.
    Angle {
        /// The smallest value.
        low: f64,
        /// Degrees after which the direction repeats.
        turn: f64,
    },
    /// A colour as shown on a screen: three coordinates.
    Color,
}

/// A quantity that a fit changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: Kind,
}

/// A value of an unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// A number, or degrees.
    Number(f64),
    /// Red, green and blue as shown on a screen, 0..1.
    Color([f64; 3]),
}

/// All that a fit changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unknowns(pub Vec<Unknown>);

impl Kind {
    /// Returns true if the coordinate is that of the logarithm.
    pub fn is_logarithmic(self) -> bool {
        matches!(self, Self::Number { low, high } if low > 0.0 && high / low > 3.0)
    }

    /// Coordinates of the kind.
    pub fn coordinates(self) -> usize {
        if self == Self::Color { 3 } else { 1 }
    }

    fn amount(self, at: &[f64]) -> Amount {
        match self {
            Self::Color => Amount::Color([0, 1, 2].map(|channel: usize| at[channel].clamp(0.0, 1.0))),
            Self::Angle { low, turn } => Amount::Number(low + turn * wrapped(at[0])),
            Self::Number { low, high } if self.is_logarithmic() => {
                let log = libm::log(low) + at[0].clamp(0.0, 1.0) * (libm::log(high) - libm::log(low));
                Amount::Number(libm::exp(log).clamp(low, high))
            }
            Self::Number { low, high } => Amount::Number((low + at[0].clamp(0.0, 1.0) * (high - low)).clamp(low, high)),
        }
    }

    fn place(self, amount: Amount) -> Vec<f64> {
        match (self, amount) {
            (Self::Color, Amount::Color(rgb)) => rgb.to_vec(),
            (Self::Color, Amount::Number(grey)) => vec![grey; 3],
            (Self::Angle { low, turn }, Amount::Number(value)) => vec![wrapped((value - low) / turn)],
            (Self::Number { low, high }, Amount::Number(value)) if self.is_logarithmic() => {
                let share = (libm::log(value.max(low)) - libm::log(low)) / (libm::log(high) - libm::log(low));
                vec![share.clamp(0.0, 1.0)]
            }
            (Self::Number { low, high }, Amount::Number(value)) => vec![((value - low) / (high - low)).clamp(0.0, 1.0)],
            (_, Amount::Color(_)) => vec![0.5],
        }
    }

    /// The error in the unit of the value, for an error of a coordinate near an amount.
    pub(crate) fn error(self, amount: Amount, share: f64) -> f64 {
        match (self, amount) {
            (Self::Angle { turn, .. }, _) => share * turn,
            (Self::Number { low, high }, Amount::Number(value)) if self.is_logarithmic() => {
                value * share * (libm::log(high) - libm::log(low))
            }
            (Self::Number { low, high }, _) => share * (high - low),
            (Self::Color, _) => share,
        }
    }
}

/// A coordinate of an angle within 0..1.
pub(crate) fn wrapped(value: f64) -> f64 {
    value - value.floor()
}

impl Unknowns {
    /// Coordinates of all unknowns.
    pub fn coordinates(&self) -> usize {
        self.0.iter().map(|unknown| unknown.kind.coordinates()).sum()
    }

    /// The coordinates of each unknown, as ranges.
    pub fn ranges(&self) -> Vec<std::ops::Range<usize>> {
        let mut from = 0;
        let next = |unknown: &Unknown| {
            from += unknown.kind.coordinates();
            from - unknown.kind.coordinates()..from
        };
        self.0.iter().map(next).collect()
    }

    /// The values at a point.
    pub fn amounts(&self, point: &[f64]) -> Vec<Amount> {
        self.0.iter().zip(self.ranges()).map(|(unknown, range)| unknown.kind.amount(&point[range])).collect()
    }

    /// The point of these values.
    pub fn point(&self, amounts: &[Amount]) -> Vec<f64> {
        self.0.iter().zip(amounts).flat_map(|(unknown, amount)| unknown.kind.place(*amount)).collect()
    }

    /// For each coordinate, true if it repeats.
    pub(crate) fn periodic(&self) -> Vec<bool> {
        let of = |unknown: &Unknown| vec![matches!(unknown.kind, Kind::Angle { .. }); unknown.kind.coordinates()];
        self.0.iter().flat_map(of).collect()
    }

    /// The point inside the cube: angles are wrapped, other coordinates clipped.
    pub(crate) fn inside(&self, point: &[f64]) -> Vec<f64> {
        let keep = |(value, periodic): (&f64, bool)| if periodic { wrapped(*value) } else { value.clamp(0.0, 1.0) };
        point.iter().zip(self.periodic()).map(keep).collect()
    }

    /// The features of a point for the model: centred coordinates, and cosine and sine of angles.
    pub(crate) fn features(&self, point: &[f64]) -> Vec<f64> {
        let mut features = Vec::with_capacity(point.len() + 4);
        for (value, periodic) in point.iter().zip(self.periodic()) {
            if periodic {
                let angle = std::f64::consts::TAU * value;
                features.extend([0.5 * libm::cos(angle), 0.5 * libm::sin(angle)]);
            } else {
                features.push(value - 0.5);
            }
        }
        features
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_and_points_mean_the_same() {
        let unknown = |name: &str, kind| Unknown { name: name.to_owned(), kind };
        let unknowns = Unknowns(vec![
            unknown("size", Kind::Number { low: 0.4, high: 3.0 }),
            unknown("grain", Kind::Angle { low: -90.0, turn: 180.0 }),
            unknown("tint", Kind::Color),
            unknown("depth", Kind::Number { low: 0.0, high: 2.0 }),
        ]);
        let amounts = [Amount::Number(1.1), Amount::Number(-30.0), Amount::Color([0.1, 0.5, 0.9]), Amount::Number(0.5)];
        let point = unknowns.point(&amounts);
        assert_eq!((point.len(), unknowns.coordinates()), (6, 6));
        for (a, b) in unknowns.amounts(&point).iter().zip(&amounts) {
            match (a, b) {
                (Amount::Number(a), Amount::Number(b)) => assert!((a - b).abs() < 1e-12),
                (a, b) => assert_eq!(a, b),
            }
        }
        assert!(unknowns.0[0].kind.is_logarithmic() && !unknowns.0[3].kind.is_logarithmic());
        // Angles go on at the other end.
        let turned = unknowns.inside(&[0.0, 1.25, 0.0, 0.0, 0.0, 2.0]);
        assert_eq!((turned[1], turned[5]), (0.25, 1.0));
        assert_eq!(unknowns.features(&point).len(), 7);
    }
}
