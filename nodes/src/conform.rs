//! Checks that must hold for every field of every node, for use in unit tests.
use crate::testing::{OnCanvas, Plain, canvas, outputs};
use shibo_node::Node;
use shibo_value::{Canvas, Evaluator, Field, Tile, Tiling, Type, Value, Window};

/// Renders a window of a field on the grid of the canvas.
pub(crate) fn part(field: &Field, canvas: &Canvas, x: i32, y: i32, width: u32, height: u32) -> Tile {
    Plain.raster(field, &canvas.grid(canvas.resolution), Window { x, y, width, height }).unwrap()
}

/// A node's output, which must be a field.
pub(crate) fn field<N: Node>(node: &N, inputs: &[Value], output: &str) -> Field {
    let main = N::OUTPUTS.first().is_some_and(|o| o.name == output);
    let outputs = outputs(node, inputs, &canvas()).unwrap();
    let Some(Value::Field(field)) = outputs.take(output, main).cloned() else { panic!("{output} is no field") };
    field
}

/// Checks that a node's fields are finite, do not depend on the window, and repeat in the directions that they state;
/// and that a field states at least the directions that the node states.
pub(crate) fn conforms<N: Node>(node: &N, inputs: &[Value]) {
    let canvas = canvas();
    assert!(node.check_on(&canvas).is_empty());
    for output in N::OUTPUTS {
        let field = field(node, inputs, output.name);
        let promised = inputs.iter().fold(node.tiling_on(&canvas), |tiling, input| match input {
            Value::Field(input) => tiling.and(input.tiling()),
            _ => tiling,
        });
        assert!(field.tiling().covers(promised), "{}", output.name);
        let whole = part(&field, &canvas, -65, -7, 197, 75);
        assert!(whole.data().iter().all(|v| v.is_finite()), "{}", output.name);
        for (x, y, width, height) in [(-65, -7, 1, 1), (-3, 5, 37, 11), (61, -1, 71, 3), (5, 67, 66, 1)] {
            let mut crop = part(&field, &canvas, x, y, width, height);
            let small = crop.clone();
            crop.copy_from(&whole, 0, 0);
            assert_eq!(bits(&small), bits(&crop), "{} at {x}, {y}", output.name);
        }
        if field.tiling() == Tiling::BOTH {
            repeats(&field, &canvas, output.name);
        }
    }
}

fn bits(tile: &Tile) -> Vec<u32> {
    tile.data().iter().map(|v| v.to_bits()).collect()
}

/// Checks that a field repeats. Because positions are rounded, up to one pixel in two hundred may lie on the other side
/// of an edge.
fn repeats(field: &Field, canvas: &Canvas, name: &str) {
    let here = part(field, canvas, 0, 0, 64, 64);
    let there = part(field, canvas, 64, -64, 64, 64);
    let pairs = here.data().iter().zip(there.data());
    let different = pairs.filter(|(a, b)| (*a - *b).abs() > 1e-3 * (1.0 + a.abs())).count();
    assert!(different <= here.data().len() / 200, "{name}: {different} values do not repeat");
}

/// A field that takes values in -0.5..1.5 and repeats.
pub(crate) fn gray() -> Field {
    pattern(Type::Gray)
}

/// The same field with three different channels.
pub(crate) fn rgb() -> Field {
    pattern(Type::Rgb)
}

fn pattern(ty: Type) -> Field {
    Field::generate(ty, Tiling::BOTH, |out: &mut Tile, _| {
        let window = out.window;
        for (channel, factor) in (0..out.channels()).zip([7, 11, 13]) {
            for (row, y) in (0..out.height()).zip(window.y..) {
                for (value, x) in out.row_mut(channel, row).iter_mut().zip(window.x..) {
                    let step = i16::try_from((x * factor + y * 5).rem_euclid(64)).unwrap();
                    *value = f32::from(step) / 32.0 - 0.5;
                }
            }
        }
        Ok(())
    })
}

/// Pairs of values, pixel by pixel, of a field that reads no other field and of a field computed from it.
pub(crate) fn pairs(input: &Field, output: &Field) -> Vec<(f32, f32)> {
    let canvas = canvas();
    let values = |field: &Field| part(field, &canvas, 0, 0, 64, 64).data().to_vec();
    values(input).into_iter().zip(values(output)).collect()
}
