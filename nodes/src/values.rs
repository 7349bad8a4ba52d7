//! Fields made from others value by value.
use shibo_value::{Field, Halo, Tile};

/// Weights of linear red, green and blue in luminance (Rec. 709).
pub(crate) const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Applies `f` to each value of a field.
pub(crate) fn each(input: &Field, f: impl Fn(f32) -> f32 + Send + Sync + 'static) -> Field {
    let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
        out.data_mut().iter_mut().zip(input.data()).for_each(|(out, value)| *out = f(*value));
        Ok(())
    };
    Field::map(input.ty(), [input.clone()], Halo::NONE, fill).overwriting()
}

/// Applies `f` to the values of two fields of the same type.
pub(crate) fn pairs(inputs: [&Field; 2], f: impl Fn(f32, f32) -> f32 + Send + Sync + 'static) -> Field {
    let fill = move |out: &mut Tile, [a, b]: [&Tile; 2]| {
        out.data_mut().iter_mut().zip(a.data().iter().zip(b.data())).for_each(|(out, (a, b))| *out = f(*a, *b));
        Ok(())
    };
    Field::map(inputs[0].ty(), inputs.map(Field::clone), Halo::NONE, fill).overwriting()
}
