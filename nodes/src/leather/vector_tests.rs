//! Compares springs simulated through the nodes with reference values: the parameters of a graph give the numbers of
//! the source.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the vectors are f64, the nodes f32")]
use super::define_mass::{Refresh, SamplePoint};
use super::simulate_springs::Boundary;
use super::*;
use crate::testing::{outputs, port};
use glam::{DVec2, UVec2, Vec2};
use serde_json::Value as Json;
use shibo_kernel::leather::lines::{Reduction, Sample};
use shibo_kernel::springs::{BreakOn, Integrator};
use shibo_node::{Linear, Node, Range, Xy};
use shibo_value::{Canvas, Field, Lattice, Points, Segments, SpringNet, Tiling, Type, Value};
use std::sync::Arc;

const CANVAS: Canvas = Canvas { size_mm: DVec2::splat(4.0), resolution: UVec2::splat(64), tile: Tiling::NONE, seed: 1 };

fn numbers(list: &Json) -> Vec<f64> {
    list.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn places(list: &Json) -> Vec<Vec2> {
    list.as_array().unwrap().iter().map(|p| DVec2::from_slice(&numbers(p)).as_vec2()).collect()
}

fn make(node: &impl Node, inputs: &[Value]) -> Value {
    outputs(node, inputs, &CANVAS).unwrap().take("", true).cloned().unwrap()
}

/// One of the pictures of 20 × 20 pixels.
fn picture(all: &Json, name: &str) -> Value {
    let rows = all["fields_20x20"][name].as_array().unwrap();
    let values: Vec<f32> = rows.iter().flat_map(numbers).map(|v| v as f32).collect();
    Value::Field(Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
        let (grid, window, width) = (out.grid, out.window, out.width() as i32);
        for (n, v) in (0..).zip(out.plane_mut(0)) {
            let at = (grid.center(window.x + n % width, window.y + n / width) * 5.0).as_usizevec2();
            *v = values[at.y * 20 + at.x];
        }
        Ok(())
    }))
}

/// The lattice of a case: 5 × 5 points, jittered where the case has points of its own.
fn lattice(case: &Json) -> Value {
    let grid = GridPoints { pitch: Xy::new(1.0, 1.0), jitter: 0.0, ..GridPoints::default() };
    let mut points = make(&grid, &[]);
    if let (Value::Points(regular), true) = (&points, case["start"].is_array()) {
        let jittered = Points {
            positions: places(&case["start"]),
            regular: Some(regular.positions.clone()),
            ..Points::clone(regular)
        };
        points = Value::Points(Arc::new(jittered));
    }
    let neighbors = if case["options"]["diag"] == true { Neighbors::Eight } else { Neighbors::Four };
    make(&ConnectNeighbors { points: port(0), neighbors }, &[points])
}

/// Springs and masses with the options of the case.
fn springs(all: &Json, case: &Json) -> Arc<SpringNet> {
    let options = &case["options"];
    let field = picture(all, options["field"].as_str().unwrap());
    let vary = options["vary"].as_str().unwrap_or("k");
    let sum = options["how"] == "sum";
    let node = DefineSprings {
        lattice: port(0),
        field: Some(port(1)),
        stiffness: match (vary, sum) {
            ("L", _) => Linear::new(5.0, 5.0),
            (_, true) => Linear::new(4.0, 4.5),
            _ => Linear::new(4.0, 8.0),
        },
        rest_length: if vary.contains('L') { Linear::new(-0.3, 0.5) } else { Linear::new(0.0, 0.0) },
        damping: options["damper"].as_f64().map_or(Linear::new(0.0, 0.0), |c| Linear::new(c, c)),
        sample: Sample::Line,
        reduce: if sum { Reduction::Sum } else { Reduction::Mean },
        sample_resolution: Some((20, 20)),
        ..DefineSprings::default()
    };
    let Value::SpringNet(net) = make(&node, &[lattice(case), field.clone()]) else { panic!() };
    if !vary.starts_with('m') {
        return net;
    }
    // With masses from a field, the springs of the source have random stiffnesses; take the numbers of the case.
    let stiffness = numbers(&case["k"]).into_iter().map(|k| k as f32).collect();
    let net = Value::SpringNet(Arc::new(SpringNet { stiffness, ..SpringNet::clone(&net) }));
    let node = DefineMass {
        springs: port(0),
        field: Some(port(1)),
        mass: Linear::new(0.5, 2.0),
        sample: SamplePoint::Point,
        refresh: if vary == "m_live" { Refresh::EveryStep } else { Refresh::Once },
        sample_resolution: Some((20, 20)),
        ..DefineMass::default()
    };
    let Value::SpringNet(net) = make(&node, &[net, field]) else { panic!() };
    net
}

fn near(found: &[f32], expected: &[f64], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((f64::from(*found) - expected).abs() < 2e-5, "{what}: {found} {expected}");
    }
}

#[test]
fn nodes_match_reference_values_of_the_source() {
    let all: Json = serde_json::from_str(include_str!("../../../kernel/tests/vectors/leather.json")).unwrap();
    let mut seen = 0;
    for case in all["lattices"].as_array().unwrap() {
        let (name, options) = (case["name"].as_str().unwrap(), &case["options"]);
        let net = springs(&all, case);
        near(&net.stiffness, &numbers(&case["k"]), name);
        near(&net.rest_length, &numbers(&case["L"]), name);
        if case["m"].is_array() && !net.mass.is_empty() {
            near(&net.mass, &numbers(&case["m"]), name);
        }
        // Skip cases with a separate limit per spring, which here come from a field or from random numbers; and masses
        // read in every step, which depend on rounding at the edges of pixels.
        if case["Fth"].is_array() || name == "m every step" {
            continue;
        }
        let node = SimulateSprings {
            springs: port(0),
            step: case["delta"].as_f64().unwrap(),
            steps: case["K"].as_u64().unwrap() as u32,
            integrator: Integrator::Explicit,
            drag: options["drag"].as_f64().unwrap_or(0.0),
            boundary: Boundary::Fixed(0.0),
            break_force: case["Fth"].as_f64().map(|f| Range::new(f, f)),
            break_on: if options["break_on"] == "tension" { BreakOn::Tension } else { BreakOn::Either },
            ..SimulateSprings::default()
        };
        let moved = make(&node, &[Value::SpringNet(net)]);
        let Value::Lattice(lattice) = &moved else { panic!() };
        let lattice: &Lattice = lattice;
        let expected = places(&case["positions"]);
        let far = lattice.points.positions.iter().zip(&expected).map(|(a, b)| (*a - *b).length()).fold(0.0, f32::max);
        assert!(far < 2e-3, "{name}: {far}");
        let broken: Vec<[u64; 2]> = lattice.broken.iter().map(|(l, step)| [u64::from(*l), u64::from(*step)]).collect();
        let number = |b: &Json, key: &str| b[key].as_u64().unwrap();
        let list = case["broken"].as_array().unwrap();
        let mut expected: Vec<_> = list.iter().map(|b| [number(b, "link"), number(b, "step")]).collect();
        expected.sort_unstable_by_key(|[link, step]| (*step, *link));
        let mut found = broken;
        found.sort_unstable_by_key(|[link, step]| (*step, *link));
        assert_eq!(found, expected, "{name}");
        let node = PlaceWrinkles { lattice: port(0), length_scale: Some(1.0), clip: true, ..PlaceWrinkles::default() };
        let Value::Segments(segments) = make(&node, &[moved]) else { panic!() };
        let segments: &Segments = &segments;
        let expected: Vec<Vec<f64>> = case["clipped"].as_array().unwrap().iter().map(numbers).collect();
        assert_eq!(segments.len(), expected.len(), "{name}");
        for ([a, b], e) in segments.ends.iter().zip(&expected) {
            let ends = [a.x, a.y, b.x, b.y];
            assert!(ends.iter().zip(e).all(|(a, e)| (f64::from(*a) - e).abs() < 6e-3), "{name}: {ends:?} {e:?}");
        }
        seen += 1;
    }
    assert_eq!(seen, 11);
}
