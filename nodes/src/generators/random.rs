//! [`Random`]: a random number. Cost: none.
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_node::{Context, Fact, Node, Output, Outputs, Range, node};
use shibo_value::{Field, Stop, Type};

/// A random number, the same everywhere. It changes with the seed of the canvas or of an instance.
///
/// It can be connected to any port that takes a field, so each `Use` of a graph gets its own tint or angle. Parameters
/// draw random numbers by expressions: `"= 3 + 2 * random(1)"`.
///
/// ```ron
/// "angle": Random(range: (0, 90), seed: 5),
/// "noise": WhiteNoise(size: 0.4),
/// "example": DirectionalBlur(input: "noise", angle: "angle", length: 8),
/// ```
///
/// Elsewhere: Substance Designer *Rand* (function); Blender *Random Value*; Houdini *Random*.
#[node]
pub struct Random {
    /// Smallest and largest value.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Range::new(0.0, 1.0))]
    pub range: Range,
    /// True for whole numbers only; the largest one may be drawn too.
    pub whole: bool,
    /// Another seed gives another number.
    pub seed: u64,
}

impl Random {
    fn draw(&self, t: f64) -> f64 {
        if !self.whole {
            return self.range.at(t);
        }
        // If no whole number lies in the range, the one below it.
        let (low, high) = (self.range.lo.ceil(), self.range.hi.floor());
        if low > high { self.range.lo.floor() } else { (low + (t * (high - low + 1.0)).floor()).min(high) }
    }
}

impl Node for Random {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The number, the same everywhere.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let value = self.draw(Hash::new(cx.seed(self.seed)).unit(0));
        Ok(Outputs::one(Field::constant(Type::Gray, &[narrow(value)])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::field;

    #[test]
    fn numbers_lie_in_the_range_and_depend_on_the_seed() {
        let drawn = |node: Random| {
            conforms(&node, &[]);
            field(&node, &[]).as_constant().unwrap()[0]
        };
        let all: Vec<f32> =
            (0..200).map(|seed| drawn(Random { range: Range::new(2.0, 4.0), seed, ..Random::default() })).collect();
        assert!(all.iter().all(|v| (2.0..4.0).contains(v)));
        assert!((all.iter().sum::<f32>() / 200.0 - 3.0).abs() < 0.15, "spread evenly");
    }

    #[test]
    fn whole_numbers_are_equally_likely() {
        let node = Random { range: Range::new(-1.2, 2.5), whole: true, ..Random::default() };
        // The values -1, 0, 1 and 2: a quarter of 0..1 each.
        assert_eq!(
            [0.0, 0.24, 0.26, 0.51, 0.74, 0.76, 0.9999].map(|t| node.draw(t)),
            [-1.0, -1.0, 0.0, 1.0, 1.0, 2.0, 2.0]
        );
        assert_eq!(Random { range: Range::new(2.1, 2.9), ..node }.draw(0.5), 2.0);
    }
}
