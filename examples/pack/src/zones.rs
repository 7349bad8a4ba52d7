//! [`Zones`]: a zone plate. Cost: O(pixels).
use shibo_engine::node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_engine::value::{Field, Given, Stop, Tile, Tiling, Type};

/// Rings that become narrower outwards: a test for aliasing.
///
/// ```ron
/// "example": Zones(width: 4),
/// ```
#[node]
pub struct Zones {
    /// The radius of the innermost ring.
    #[schemars(range(min = 0.01, max = 1000), extend("unit" = "mm"))]
    #[default(4.0)]
    pub width: f64,
}

impl Node for Zones {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The rings, 0..1.")];
    // The facts of the canvas that the result depends on. They become part of the key in the cache.
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (middle, width) = (0.5 * cx.size_mm(), self.width);
        // The engine asks for windows of a field. A pixel depends on its place alone, so all windows have the same bits.
        let fill = move |out: &mut Tile, _: &Given<'_>| {
            let (grid, window) = (out.grid, out.window);
            for (row, y) in (window.y..window.bottom()).enumerate() {
                for (value, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                    let turns = grid.center(x, y).distance_squared(middle) / (width * width);
                    *value = math::single(math::ring(turns));
                }
            }
            Ok(())
        };
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::NONE, fill).overwriting()))
    }
}

mod math {
    /// A wave between 0 and 1 with a period of 2, made of parabolas. The system's sine has other bits on other systems.
    pub(super) fn ring(turns: f64) -> f64 {
        let share = 2.0 * turns.rem_euclid(1.0) - 1.0;
        let bump = 0.5 * (1.0 - share * share);
        if turns.rem_euclid(2.0) < 1.0 { 0.5 + bump } else { 0.5 - bump }
    }

    /// The nearest single-precision number: fields are single precision.
    #[expect(clippy::cast_possible_truncation, reason = "the number is between 0 and 1")]
    pub(super) fn single(value: f64) -> f32 {
        value as f32
    }
}

#[cfg(test)]
mod tests {
    use super::math::ring;

    #[test]
    fn ring_repeats_every_two_turns() {
        for (turns, value) in [(0.0, 0.5), (0.5, 1.0), (1.0, 0.5), (1.5, 0.0), (2.0, 0.5), (8.5, 1.0)] {
            assert_eq!(ring(turns), value, "at {turns}");
        }
    }
}
