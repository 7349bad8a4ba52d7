//! [`Terraces`]: steps with soft edges. Cost: O(pixels).
use shibo_engine::node::{Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_engine::value::{Field, Halo, Stop, Tile, Type};

/// Cuts a height into level steps, as contour lines do on a model of a landscape.
///
/// ```ron
/// "hills": Fractal(size: 16),
/// "example": Terraces(input: "hills", steps: 6, softness: 0.2),
/// ```
#[node]
pub struct Terraces {
    /// The height, 0..1.
    pub input: In<Gray>,
    /// The number of steps.
    #[schemars(range(min = 1, max = 1000))]
    #[default(8)]
    pub steps: u32,
    /// The share of a step that is its slope; 0 gives cliffs, 1 gives the input back.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.25)]
    pub softness: f64,
}

impl Node for Terraces {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The height in steps.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (steps, softness) = (f64::from(self.steps), self.softness);
        let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
            for (out, value) in out.data_mut().iter_mut().zip(input.data()) {
                *out = terrace(*value, steps, softness);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Gray, [input], Halo::NONE, fill)))
    }
}

/// One height in steps.
#[expect(clippy::cast_possible_truncation, reason = "fields are single precision")]
fn terrace(value: f32, steps: f64, softness: f64) -> f32 {
    let level = f64::from(value) * steps;
    let share = level - level.floor();
    let slope = if softness > 0.0 { ((share - 1.0) / softness + 1.0).clamp(0.0, 1.0) } else { 0.0 };
    ((level.floor() + slope) / steps) as f32
}

#[cfg(test)]
mod tests {
    use super::terrace;

    #[test]
    fn terraces_are_level_and_joined_by_slopes() {
        assert_eq!(terrace(0.3, 4.0, 0.0), 0.25);
        assert_eq!(terrace(0.3, 4.0, 0.5), 0.25);
        assert_eq!(terrace(0.4375, 4.0, 0.5), 0.375);
        assert_eq!(terrace(0.3, 4.0, 1.0), 0.3);
    }
}
