//! Tests of several stages of the method together, as graphs connect them.
use super::define_mass::{Refresh, SamplePoint};
use super::draw_wrinkles::VaryBy;
use super::simulate_springs::Boundary;
use super::*;
use crate::testing::OnCanvas as _;
use crate::testing::{canvas, outputs, port, raster};
use glam::Vec2;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::lines::{Reduction, Sample};
use shibo_kernel::springs::Integrator;
use shibo_node::{Linear, Node, Range};
use shibo_value::diagnostics::Code;
use shibo_value::{Canvas, Field, Lattice, Segments, SpringNet, Stop, Tiling, Type, Value};
use std::sync::Arc;

fn make(node: &impl Node, inputs: &[Value], output: &str) -> Value {
    outputs(node, inputs, &canvas()).unwrap().take(output, output.is_empty()).cloned().unwrap()
}

fn refused(node: &impl Node, inputs: &[Value]) -> (Code, String) {
    match outputs(node, inputs, &canvas()) {
        Err(Stop::Failed(problem)) => (problem.code, problem.field.clone().unwrap_or_default()),
        other => panic!("{:?}", other.map(|_| ())),
    }
}

/// 0 in the left half of the canvas, 1 in the right.
fn halves() -> Value {
    Value::Field(Field::generate(Type::Gray, Tiling::NONE, |out, _| {
        let (grid, window, width) = (out.grid, out.window, out.width());
        for (i, v) in out.plane_mut(0).iter_mut().enumerate() {
            let x = grid.origin.x + (f64::from(window.x) + (i % width) as f64 + 0.5) * grid.step.x;
            *v = f32::from(u8::from(x >= 16.0));
        }
        Ok(())
    }))
}

fn constant(value: f32) -> Value {
    Value::Field(Field::constant(Type::Gray, &[value]))
}

fn lattice(pitch: f64) -> Value {
    let points = make(&PoissonPoints { pitch, ..PoissonPoints::default() }, &[], "");
    make(&ConnectNeighbors { points: port(0), ..ConnectNeighbors::default() }, &[points], "")
}

fn springs(node: &DefineSprings, field: Option<Value>) -> (Value, Arc<SpringNet>) {
    let node = DefineSprings { lattice: port(0), field: field.is_some().then(|| port(1)), ..node.clone() };
    let inputs: Vec<Value> = std::iter::once(lattice(2.0)).chain(field).collect();
    let value = make(&node, &inputs, "");
    let Value::SpringNet(net) = value.clone() else { panic!() };
    (value, net)
}

fn simulation() -> SimulateSprings {
    SimulateSprings {
        springs: port(0),
        step: 0.1,
        steps: 60,
        drag: 4.0,
        integrator: Integrator::SemiImplicit,
        boundary: Boundary::Periodic,
        ..SimulateSprings::default()
    }
}

fn moved(node: &SimulateSprings, inputs: &[Value]) -> Arc<Lattice> {
    match make(node, inputs, "") {
        Value::Lattice(lattice) => lattice,
        other => panic!("{other:?}"),
    }
}

fn field(value: &Value) -> Field {
    match value {
        Value::Field(field) => field.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn spread_makes_springs_differ_within_bounds() {
    let node = DefineSprings { stiffness: Linear::new(4.0, 4.0), spread: 0.5, ..DefineSprings::default() };
    let (_, net) = springs(&node, None);
    let low = net.stiffness.iter().copied().fold(f32::INFINITY, f32::min);
    let high = net.stiffness.iter().copied().fold(0.0, f32::max);
    assert!((2.0..2.2).contains(&low) && (5.8..=6.0).contains(&high), "{low} {high}");
    let (_, alike) = springs(&DefineSprings { spread: 0.0, ..node }, None);
    assert!(alike.stiffness.iter().all(|k| *k == 4.0) && alike.damping.is_empty());
}

#[test]
fn dampers_follow_the_field_and_slow_the_motion() {
    let node = DefineSprings { damping: Linear::new(0.0, 3.0), ..DefineSprings::default() };
    let (_, net) = springs(&node, Some(halves()));
    assert_eq!(net.damping.iter().copied().fold(0.0, f32::max), 3.0);
    assert_eq!(net.damping.iter().copied().fold(9.0, f32::min), 0.0);
    let (value, _) = springs(&DefineSprings { damping: Linear::new(1.0, 1.0), ..node }, Some(halves()));
    let (plain, _) = springs(&DefineSprings::default(), Some(halves()));
    let few = SimulateSprings { steps: 10, drag: 0.0, ..simulation() };
    let speed = |net: Value| {
        let lattice = moved(&few, &[net]);
        lattice.velocities.as_ref().unwrap().iter().map(|v| v.length()).sum::<f32>()
    };
    assert!(speed(value) < 0.95 * speed(plain));
}

#[test]
fn masses_come_from_the_field() {
    let (value, _) = springs(&DefineSprings::default(), None);
    let node =
        DefineMass { springs: port(0), field: Some(port(1)), mass: Linear::new(1.0, 5.0), ..DefineMass::default() };
    let masses = |node: &DefineMass, field: Value| match make(node, &[value.clone(), field], "") {
        Value::SpringNet(net) => net,
        other => panic!("{other:?}"),
    };
    let net = masses(&node, halves());
    for (mass, p) in net.mass.iter().zip(&net.lattice.points.positions) {
        if (p.x - 16.0).abs() > 0.5 {
            assert_eq!(*mass, if p.x < 16.0 { 1.0 } else { 5.0 }, "{p}");
        }
    }
    let inverted = masses(&DefineMass { invert: true, ..node.clone() }, halves());
    assert!(inverted.mass.iter().zip(&net.mass).all(|(a, b)| (a + b - 6.0).abs() < 1e-5));
    let near = DefineMass { sample: SamplePoint::Near(3.0), ..node.clone() };
    assert!(masses(&near, halves()).mass.iter().any(|m| *m > 1.5 && *m < 4.5));
    let sum = DefineMass { sample: SamplePoint::Near(1.0), reduce: Reduction::Sum, ..node.clone() };
    assert!(masses(&sum, constant(1.0)).mass.iter().all(|m| *m > 10.0));
    let spread = DefineMass { spread: 0.5, ..node.clone() };
    let spread = masses(&spread, constant(0.0));
    assert!(spread.mass.iter().all(|m| (0.5..=1.5).contains(m)) && spread.mass.iter().any(|m| *m < 0.6));
    let zero = DefineMass { mass: Linear::new(1.0, 0.5), ..node };
    let wrong = [value.clone(), constant(3.0)];
    assert_eq!(refused(&zero, &wrong), (Code::OutOfRange, "mass".into()));
}

#[test]
fn masses_can_be_read_in_every_step() {
    let (value, _) = springs(&DefineSprings::default(), Some(halves()));
    let node =
        DefineMass { springs: port(0), field: Some(port(1)), mass: Linear::new(1.0, 5.0), ..DefineMass::default() };
    let run = |refresh, field: Value| {
        let net = make(&DefineMass { refresh, ..node.clone() }, &[value.clone(), field], "");
        moved(&simulation(), &[net]).points.positions.clone()
    };
    assert_eq!(run(Refresh::Once, constant(0.5)), run(Refresh::EveryStep, constant(0.5)));
    let (once, live) = (run(Refresh::Once, halves()), run(Refresh::EveryStep, halves()));
    let most = once.iter().zip(&live).map(|(a, b)| (*a - *b).length()).fold(0.0, f32::max);
    assert!(most > 1e-3, "{most}");
    let spread = DefineMass { refresh: Refresh::EveryStep, spread: 0.5, ..node };
    assert_eq!(spread.check_on(&canvas())[0].field.as_deref(), Some("spread"));
}

#[test]
fn bodies_keep_apart() {
    let node = DefineSprings { stiffness: Linear::new(1.0, 12.0), ..DefineSprings::default() };
    let (value, _) = springs(&node, Some(halves()));
    let nearest = |lattice: &Lattice| {
        (0..lattice.links.len()).map(|l| lattice.span(&lattice.points.positions, l).length()).fold(9.0, f32::min)
    };
    let without = nearest(&moved(&simulation(), std::slice::from_ref(&value)));
    let node = SimulateSprings { body: 1.4, body_stiffness: 300.0, drag: 8.0, step: 0.02, steps: 500, ..simulation() };
    let with = nearest(&moved(&node, std::slice::from_ref(&value)));
    assert!(without < 0.7 && with > 1.05, "{without} {with}");
    let huge = SimulateSprings { body: 20.0, ..node };
    assert_eq!(refused(&huge, &[value]), (Code::TooLarge, "body".into()));
}

#[test]
fn fixed_boundary_holds_edge_of_any_set() {
    let canvas = Canvas { tile: Tiling::NONE, ..canvas() };
    let take = |outputs: shibo_node::Outputs| outputs.take("", true).cloned().unwrap();
    let poisson = PoissonPoints { pitch: 2.0, ..PoissonPoints::default() };
    let hexagons = HexPoints { edge: 1.0, jitter: 0.0, ..HexPoints::default() };
    let grid = GridPoints { jitter: 1.0, keep_border: false, ..GridPoints::default() };
    let sets = [outputs(&poisson, &[], &canvas), outputs(&hexagons, &[], &canvas), outputs(&grid, &[], &canvas)];
    for (points, reach) in sets.into_iter().zip([2.0, 1.0, 0.0]) {
        let points = take(points.unwrap());
        let Value::Points(before) = points.clone() else { panic!() };
        let links = ConnectNeighbors { points: port(0), ..ConnectNeighbors::default() };
        let lattice = take(outputs(&links, &[points], &canvas).unwrap());
        let node = DefineSprings { lattice: port(0), ..DefineSprings::default() };
        let net = take(outputs(&node, &[lattice], &canvas).unwrap());
        let node = SimulateSprings { boundary: Boundary::Fixed(0.0), ..simulation() };
        let Value::Lattice(after) = take(outputs(&node, &[net], &canvas).unwrap()) else { panic!() };
        let on_edge = |p: &Vec2| p.min(Vec2::splat(32.0) - *p).min_element() <= reach + 1e-3;
        let still = |n: &usize| after.points.positions[*n] == before.positions[*n];
        let held = (0..before.len()).filter(still).count();
        let expected = before.regular().iter().filter(|p| on_edge(p)).count();
        assert!(held >= expected && held < expected + 3 && expected > 30, "{held} {expected}");
    }
}

/// A wider margin never holds fewer points, and a very narrow one holds the same points as a margin of 0.
#[test]
fn the_edge_holds_more_points_the_wider_its_margin() {
    let take = |outputs: shibo_node::Outputs| outputs.take("", true).cloned().unwrap();
    let held = |points: &Value, canvas: &Canvas, margin: f64| {
        let links = ConnectNeighbors { points: port(0), ..ConnectNeighbors::default() };
        let lattice = take(outputs(&links, std::slice::from_ref(points), canvas).unwrap());
        let node = DefineSprings { lattice: port(0), ..DefineSprings::default() };
        let net = take(outputs(&node, &[lattice], canvas).unwrap());
        let node = SimulateSprings { boundary: Boundary::Fixed(margin), steps: 20, ..simulation() };
        let (Value::Lattice(after), Value::Points(before)) = (take(outputs(&node, &[net], canvas).unwrap()), points)
        else {
            panic!()
        };
        (0..before.len()).filter(|n| after.points.positions[*n] == before.positions[*n]).count()
    };
    let (once, everywhere) = (Canvas { tile: Tiling::NONE, ..canvas() }, canvas());
    let grid = GridPoints { jitter: 1.0, keep_border: false, ..GridPoints::default() };
    let staggered = GridPoints { stagger: 0.5, ..grid.clone() };
    let poisson = PoissonPoints { pitch: 2.0, ..PoissonPoints::default() };
    let counts = |points: Value, canvas: &Canvas| [0.0, 0.001, 1.0, 6.0].map(|margin| held(&points, canvas, margin));
    for points in [outputs(&grid, &[], &once), outputs(&staggered, &[], &once), outputs(&poisson, &[], &once)] {
        let [none, narrow, wide, wider] = counts(take(points.unwrap()), &once);
        assert!(none > 30 && narrow == none && wide >= narrow && wider > wide, "{none} {narrow} {wide} {wider}");
    }
    // A set that repeats has no edge: only a margin above 0 holds points.
    let [none, narrow, wide, wider] = counts(take(outputs(&poisson, &[], &everywhere).unwrap()), &everywhere);
    assert!(none < 2 && narrow < 2 && wide > 20 && wider > wide, "{none} {narrow} {wide} {wider}");
}

#[test]
fn limits_can_be_read_in_every_way() {
    let (value, _) = springs(&DefineSprings { stiffness: Linear::new(5.0, 5.0), ..DefineSprings::default() }, None);
    let node = SimulateSprings { break_field: Some(port(1)), break_force: Some(Range::new(0.0, 1e6)), ..simulation() };
    let broken = |node: &SimulateSprings| moved(node, &[value.clone(), halves()]).broken.len();
    let smooth = broken(&node);
    // Springs are weak where the mean of the field around them is 0: the wider the mean, the farther from the bright
    // half.
    let near = broken(&SimulateSprings { sample: Sample::Near(4.0), ..node.clone() });
    assert!(near > 0 && near + 20 < smooth, "{near} {smooth}");
    let coarse = broken(&SimulateSprings { sample: Sample::Line, sample_resolution: Some((1, 1)), ..node.clone() });
    assert_eq!(coarse, 0, "the one sample lies in the bright half");
    // Sums of many pixels exceed 1; limits are clamped there.
    let sum = broken(&SimulateSprings { reduce: Reduction::Sum, sample: Sample::Near(4.0), ..node });
    assert!(sum <= near, "{sum} {near}");
}

#[test]
fn boundary_follows_the_canvas() {
    let end = |tile: Tiling, boundary: Boundary| {
        let canvas = Canvas { tile, ..canvas() };
        let make =
            |outputs: Result<shibo_node::Outputs, shibo_value::Stop>| outputs.unwrap().take("", true).cloned().unwrap();
        let points = make(outputs(&PoissonPoints { pitch: 2.0, ..PoissonPoints::default() }, &[], &canvas));
        let links = ConnectNeighbors { points: port(0), ..ConnectNeighbors::default() };
        let lattice = make(outputs(&links, &[points], &canvas));
        let node = DefineSprings { lattice: port(0), ..DefineSprings::default() };
        let net = make(outputs(&node, &[lattice], &canvas));
        match make(outputs(&SimulateSprings { boundary, ..simulation() }, &[net], &canvas)) {
            Value::Lattice(lattice) => lattice.points.positions.clone(),
            other => panic!("{other:?}"),
        }
    };
    let (joined, held) = (end(Tiling::BOTH, Boundary::Periodic), end(Tiling::NONE, Boundary::Fixed(0.0)));
    assert_eq!(end(Tiling::BOTH, Boundary::Canvas), joined);
    assert_eq!(end(Tiling::NONE, Boundary::Canvas), held);
    assert_ne!(end(Tiling::NONE, Boundary::Free), held);
}

#[test]
fn springs_break_where_the_field_is_weak() {
    let (value, _) = springs(&DefineSprings { stiffness: Linear::new(5.0, 5.0), ..DefineSprings::default() }, None);
    let node = SimulateSprings { break_field: Some(port(1)), break_force: Some(Range::new(0.0, 1e6)), ..simulation() };
    let lattice = moved(&node, &[value.clone(), halves()]);
    assert!(!lattice.broken.is_empty());
    for (link, _) in &lattice.broken {
        let start = lattice.points.regular();
        let middle = start[lattice.links[*link as usize][0] as usize] + 0.5 * lattice.span(start, *link as usize);
        assert!(middle.x < 17.5 || middle.x > 30.5, "{middle}");
    }
    let Value::Lattice(broken) = make(&node, &[value.clone(), halves()], "broken") else { panic!() };
    assert_eq!(broken.links.len(), lattice.broken.len());
    assert!(broken.alive().iter().all(|alive| !alive), "`only: Broken` takes all of them");
    let alone = SimulateSprings { break_force: None, ..node.clone() };
    assert_eq!(alone.check_on(&canvas())[0].field.as_deref(), Some("break_field"));
    let share = field(&make(&node, &[value.clone(), halves()], "breakage"));
    let tile = raster(&share, &canvas());
    assert!(tile.data().iter().all(|v| (-1e-4..=1.0001).contains(v)));
    assert!(tile.row(0, 32)[16] > 0.9 && tile.row(0, 32)[48] < 0.1);
}

#[test]
fn stretch_is_relative_to_start() {
    let (value, _) =
        springs(&DefineSprings { stiffness: Linear::new(1.0, 10.0), ..DefineSprings::default() }, Some(halves()));
    let stretch = field(&make(&simulation(), std::slice::from_ref(&value), "stretch"));
    let tile = raster(&stretch, &canvas());
    // Stiff springs on the right contracted and stretched the soft ones on the left.
    let mean = |from: usize, to: usize| {
        (0..64).flat_map(|y| tile.row(0, y)[from..to].to_vec()).sum::<f32>() / (64 * (to - from)) as f32
    };
    assert!(mean(8, 24) > 1.05 && mean(40, 56) < 0.95, "{} {}", mean(8, 24), mean(40, 56));
    crate::testing::check_field(&stretch);
    let still = field(&make(&SimulateSprings { steps: 0, ..simulation() }, &[value], "stretch"));
    assert!(raster(&still, &canvas()).data().iter().all(|v| (*v - 1.0).abs() < 1e-5));
}

#[test]
fn widths_and_depths_follow_a_field() {
    let segments = make(&PlaceWrinkles { lattice: port(0), ..PlaceWrinkles::default() }, &[lattice(2.0)], "");
    let node = DrawWrinkles {
        segments: port(0),
        vary_field: Some(port(1)),
        vary_by: VaryBy::Field,
        mix: 1.0,
        width: Range::new(0.2, 0.8),
        ..DrawWrinkles::default()
    };
    let Value::Segments(drawn) = make(&node, &[segments.clone(), halves()], "segments") else { panic!() };
    let drawn: &Segments = &drawn;
    for ([a, b], width) in drawn.ends.iter().zip(&drawn.width) {
        let x = ((*a + *b) * 0.5).x.rem_euclid(32.0);
        if (x - 16.0).abs() > 0.6 && x > 0.6 && x < 31.4 {
            assert_eq!(*width, if x < 16.0 { narrow(0.2) } else { narrow(0.8) }, "{x}");
        }
    }
    let wrong = DrawWrinkles { vary_field: None, ..node.clone() };
    assert_eq!(wrong.check_on(&canvas())[0].field.as_deref(), Some("vary_by"));
    let unread = DrawWrinkles { vary_by: VaryBy::Length, ..node };
    assert_eq!(unread.check_on(&canvas())[0].field.as_deref(), Some("vary_field"));
}

#[test]
fn radius_links_that_would_join_all_are_refused() {
    let points = make(&RandomPoints { count: 60_000, ..RandomPoints::default() }, &[], "");
    let node = |radius| ConnectNeighbors { points: port(0), neighbors: Neighbors::Radius(radius) };
    assert_eq!(refused(&node(9.0), std::slice::from_ref(&points)), (Code::TooLarge, "neighbors".into()));
    assert_eq!(refused(&node(16.0), std::slice::from_ref(&points)), (Code::OutOfRange, "neighbors".into()));
    let Value::Lattice(lattice) = make(&node(0.2), &[points], "") else { panic!() };
    let longest =
        (0..lattice.links.len()).map(|l| lattice.span(&lattice.points.positions, l).length()).fold(0.0, f32::max);
    assert!((0.19..=0.2).contains(&longest), "{longest}");
}

#[test]
fn hexagons_have_three_neighbours() {
    let points = make(&HexPoints { jitter: 0.4, ..HexPoints::default() }, &[], "");
    let node = ConnectNeighbors { points: port(0), neighbors: Neighbors::HexEdges };
    let Value::Lattice(lattice) = make(&node, std::slice::from_ref(&points), "") else { panic!() };
    let mut degree = vec![0; lattice.points.len()];
    lattice.links.iter().flatten().for_each(|&p| degree[p as usize] += 1);
    assert!(degree.iter().all(|d| *d == 3));
    // A complete tiling that repeats is a grid with some of its links; a part of the tiling is not.
    let points_of = |lattice: &Lattice| lattice.grid.map(|grid| (grid.columns * grid.rows) as usize);
    assert_eq!((lattice.regular, points_of(&lattice)), (true, Some(lattice.points.len())));
    let area = WorkArea { points: port(0), area: port(1), ..WorkArea::default() };
    let part = make(&area, &[points.clone(), halves()], "");
    let Value::Lattice(part) = make(&node, &[part], "") else { panic!() };
    assert_eq!((part.regular, part.grid), (true, None));
    assert!(part.links.len() > part.points.len() && part.points.len() < lattice.points.len());
    let wrong = ConnectNeighbors { points: port(0), neighbors: Neighbors::Four };
    assert_eq!(refused(&wrong, &[points]), (Code::BadValue, "neighbors".into()));
    let Value::Segments(segments) =
        make(&PlaceWrinkles { lattice: port(0), ..PlaceWrinkles::default() }, &[Value::Lattice(lattice.clone())], "")
    else {
        panic!()
    };
    let length = |[a, b]: &[Vec2; 2]| (*b - *a).length();
    assert!((length(&segments.ends[0]) - lattice.span(&lattice.points.positions, 0).length()).abs() < 1e-5);
}

#[test]
fn fields_that_are_not_finite_are_named_with_the_place() {
    let bad = Value::Field(Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
        out.plane_mut(0).fill(0.5);
        let last = out.window.len() - 1;
        out.plane_mut(0)[last] = f32::NAN;
        Ok(())
    }));
    let node = DefineSprings { lattice: port(0), field: Some(port(1)), ..DefineSprings::default() };
    match outputs(&node, &[lattice(2.0), bad], &canvas()) {
        Err(Stop::Failed(problem)) => {
            assert_eq!((problem.code, problem.field.as_deref()), (Code::NotFinite, Some("field")));
            assert!(problem.message.contains("`NaN` at (31.750, 31.750) mm"), "{}", problem.message);
        }
        other => panic!("{:?}", other.map(|_| ())),
    }
}

#[test]
fn thin_grooves_can_keep_their_depth() {
    let segments = make(&PlaceWrinkles { lattice: port(0), ..PlaceWrinkles::default() }, &[lattice(4.0)], "");
    let node = DrawWrinkles {
        segments: port(0),
        width: Range::new(1e-3, 1e-3),
        depth: Range::new(1.0, 1.0),
        ..DrawWrinkles::default()
    };
    let deepest = |node: &DrawWrinkles| {
        let height = field(&make(node, std::slice::from_ref(&segments), ""));
        raster(&height, &canvas()).data().iter().copied().fold(0.0, f32::min)
    };
    assert!(deepest(&node) > -0.01);
    assert!(deepest(&DrawWrinkles { fade: false, ..node }) < -0.95);
}
