//! Tests of the nodes of formulas.
use super::{Formula, SolidFormula};
use crate::conform::{conforms, field, gray, part, rgb};
use crate::testing::OnCanvas as _;
use crate::testing::{canvas, outputs, port};
use glam::DVec3;
use shibo_value::expression::{FIRST_INPUT, Meaning, Names, PLACES, compile};
use shibo_value::{Field, Given, Key, Solid, Tile, Tiling, Type, Value, Window};
use std::sync::Mutex;

/// Names `a`, `b` and so on for inputs with these numbers of components, and the places.
struct Inputs(Vec<usize>);

impl Names for Inputs {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        if let Some(first) = PLACES.iter().position(|place| *place == name) {
            return Some(Meaning::Planes { first, count: 1 });
        }
        let input = ["a", "b", "c"].iter().position(|input| *input == name)?;
        Some(Meaning::Planes { first: FIRST_INPUT + 4 * input, count: *self.0.get(input)? })
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(0)
    }
}

fn program(text: &str, components: Vec<usize>) -> String {
    compile(text, &mut Inputs(components)).unwrap().encode()
}

fn of_fields(text: &str, inputs: &[Field], inner: bool) -> Formula {
    let program = program(text, inputs.iter().map(Field::channels).collect());
    Formula { inputs: (0..).take(inputs.len()).map(port).collect(), program, inner }
}

fn result(text: &str, inputs: &[Field], inner: bool) -> Field {
    let node = of_fields(text, inputs, inner);
    let inputs: Vec<Value> = inputs.iter().cloned().map(Value::from).collect();
    conforms(&node, &inputs);
    field(&node, &inputs, "result")
}

fn values(field: &Field) -> Vec<f32> {
    part(field, &canvas(), 0, 0, 64, 64).data().to_vec()
}

#[test]
fn formulas_are_computed_for_every_pixel() {
    let (a, b) = (values(&gray()), values(&rgb()));
    let number = Field::constant(Type::Gray, &[3.0]);
    let found = values(&result("if(a > 0.5, 2 * a, -a) + b", &[gray(), number.clone()], false));
    assert!(a.iter().zip(found).all(|(a, f)| f == if *a > 0.5 { 2.0 * a } else { -a } + 3.0));
    let mixed = values(&result("a * b + (1, 2, 3)", &[gray(), rgb()], false));
    assert!(mixed.iter().enumerate().all(|(k, f)| *f == a[k % 4096] * b[k] + (1 + k / 4096) as f32));
    let places = values(&result("(x, y, u - v)", &[], false));
    assert_eq!((places[5 * 64], places[63], places[4096 + 3 * 64]), (0.25, 31.75, 1.75));
    assert_eq!(result("a ^ 2 + 1", &[number], false).as_constant(), Some(&[10.0][..]));
    assert_eq!(result("(1, 2) * 3", &[], false).as_constant(), Some(&[3.0, 6.0][..]));
}

#[test]
fn formulas_tell_where_they_tile() {
    let tiling = |text: &str| {
        let tiling = of_fields(text, &[], false).tiling_on(&canvas());
        [tiling.x, tiling.y]
    };
    for (text, expected) in [
        ("1", [true, true]),
        ("x", [false, true]),
        ("v * 2", [true, false]),
        ("sin(360 * 3 * u) * cos(-720 * v + 20)", [true, true]),
        ("sin(100 * u)", [false, true]),
        ("sin(x * 360 / 8)", [true, true]),
        ("abs(sin(180 * u))", [false, true]),
        ("fract(4 * u + 1.5) + x % 8", [true, true]),
        ("x % 8 < y % 16", [true, true]),
        ("x % 7", [false, true]),
        ("(floor(u * 8) + floor(v * 8)) % 2", [true, true]),
        ("random(floor(u * 8))", [false, true]),
        ("random(floor(u * 8) % 8)", [true, true]),
        ("if(u < 2, 1, 2)", [false, true]),
        ("noise(8 * u, 8 * v)", [true, true]),
        ("noise(x / 5, y / 4)", [false, true]),
        ("noise(x / 4, y / 4) + noise(4 * u + 4 * v, 4 * v - 4 * u)", [true, true]),
    ] {
        assert_eq!(tiling(text), expected, "{text}");
        result(text, &[], false);
    }
}

/// A field with a key, as the engine gives one to each.
fn keyed() -> Field {
    gray().keyed(Key::of("gray", &[]))
}

#[test]
fn fused_formulas_have_the_same_values() {
    // The first formula is not finite where `a` is 0.5; between fields, that counts as 0.
    let steps = result("floor(a * 8) / 8", &[keyed()], true);
    let (first, second) = ("0.1 / (a - 0.5) + sin(u * 360)", "b * a - a + exp(b) * a");
    let of = |inner: bool| {
        let before = result(first, std::slice::from_ref(&steps), inner);
        result(second, &[before, keyed()], false)
    };
    let (fused, separate) = (of(true), of(false));
    let reads = |field: &Field| {
        let grid = canvas().grid(canvas().resolution);
        field.source().inputs(&grid, Window { x: 0, y: 0, width: 8, height: 8 }).len()
    };
    assert_eq!((reads(&fused), reads(&separate)), (1, 2));
    assert_eq!(values(&fused), values(&separate));
}

#[test]
fn formulas_tile_although_an_input_grows() {
    // Too expensive to be fused where several formulas read it.
    let grows = "noise(8 * u, 8 * v) + 8 * u";
    let of = |inner: bool| result("noise(a, 8 * v)", &[result(grows, &[], inner).keyed(Key::of("grows", &[]))], false);
    let (fused, separate) = (of(true), of(false));
    assert_eq!((fused.tiling(), separate.tiling()), (Tiling::BOTH, Tiling::BOTH));
    assert_eq!(values(&fused), values(&separate));
    let grown = result("floor(a) + b.x", &[result(grows, &[], false), rgb()], false);
    assert_eq!(result("fract(a / 8)", &[grown], false).tiling(), Tiling::BOTH);
    assert_eq!(result("fract(a / 7)", &[result(grows, &[], false)], false).tiling(), Tiling { x: false, y: true });
}

#[test]
fn reports_where_a_formula_is_not_finite() {
    let field = result("1 / (x - 0.75)", &[], false);
    let canvas = canvas();
    let warnings = Mutex::new(Vec::new());
    let warn = |problem: shibo_value::diagnostics::Problem| warnings.lock().unwrap().push(problem.message);
    let mut tile = Tile::new(canvas.grid(canvas.resolution), Window { x: 0, y: 2, width: 8, height: 2 }, 1);
    field.source().fill(&Given::new(&[], None, &|| false).warning(&warn), &mut tile).unwrap();
    assert_eq!((tile.row(0, 0)[0], tile.row(0, 0)[1], tile.row(0, 1)[2]), (-2.0, 0.0, 2.0));
    let found = warnings.into_inner().unwrap();
    assert!(found.len() == 1 && found[0].contains("x = 0.750, y = 1.250 mm"), "{found:?}");
}

/// A window that begins beyond the canvas, as the ones of filters do, names a place on the canvas if there is one.
#[test]
fn places_that_are_not_finite_lie_on_the_canvas() {
    let field = result("log(x - 1)", &[], false);
    let canvas = canvas();
    let fill = |window: Window| {
        let warnings = Mutex::new(Vec::new());
        let warn = |problem: shibo_value::diagnostics::Problem| warnings.lock().unwrap().push(problem);
        let mut tile = Tile::new(canvas.grid(canvas.resolution), window, 1);
        field.source().fill(&Given::new(&[], None, &|| false).warning(&warn), &mut tile).unwrap();
        let [problem] = &warnings.into_inner().unwrap()[..] else { panic!("not one warning") };
        *problem.at_mm.clone().unwrap()
    };
    // Pixels have 0.5 mm.
    assert_eq!(fill(Window { x: -3, y: -2, width: 8, height: 5 }), [0.25, 0.25, 0.0]);
    assert_eq!(fill(Window { x: -3, y: 1, width: 8, height: 5 }), [0.25, 0.75, 0.0]);
    assert_eq!(fill(Window { x: 0, y: 1, width: 8, height: 5 }), [0.25, 0.75, 0.0]);
    assert_eq!(fill(Window { x: -3, y: 1, width: 3, height: 1 }), [-1.25, 0.75, 0.0], "no pixel of the canvas");
    assert_eq!(fill(Window { x: -9, y: -9, width: 4, height: 4 }), [-4.25, -4.25, 0.0], "far from the canvas");
}

#[test]
fn formulas_of_solids_are_computed_at_points() {
    let made = |text: &str, inputs: &[Solid], inner: bool| {
        let program = program(text, inputs.iter().map(Solid::channels).collect());
        let node = SolidFormula { inputs: (0..).take(inputs.len()).map(port).collect(), program, inner };
        let inputs: Vec<Value> = inputs.iter().cloned().map(Value::from).collect();
        let outputs = outputs(&node, &inputs, &canvas()).unwrap();
        let Some(Value::Solid(vector)) = outputs.take("vector", false).cloned() else { panic!("no vector") };
        let Some(Value::Solid(solid)) = outputs.take("result", true).cloned() else { panic!("no solid") };
        assert_eq!(vector.ty(), Type::SolidVector);
        solid
    };
    let points = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 0.0)];
    let place = made("(point.x, point.y, point.z)", &[], false);
    assert_eq!(place.ty(), Type::SolidColor);
    assert_eq!(place.at(&points), [1.0, -1.0, 2.0, 0.5, 3.0, 0.0]);
    let of = |inner: bool| {
        let first = made("1 / a.z + point.y", std::slice::from_ref(&place), inner);
        made("a * 2 + b.x", &[first, place.clone()], false)
    };
    assert_eq!(of(true).at(&points), of(false).at(&points));
    assert_eq!(of(true).at(&points)[1], -1.0);
}
