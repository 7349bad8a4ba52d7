//! Fields made from another one pixel by pixel.
use shibo_value::{Field, Halo, Tile, Type};

/// Applies `f` to each value of a field of numbers.
pub(super) fn each(input: &Field, f: impl Fn(f32) -> f32 + Send + Sync + 'static) -> Field {
    let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
        out.data_mut().iter_mut().zip(input.data()).for_each(|(out, value)| *out = f(*value));
        Ok(())
    };
    Field::map(Type::Gray, [input.clone()], Halo::NONE, fill).overwriting()
}
