use super::block::LOCAL;
use super::list::{List, Sorted};
use super::moving::Moving;
use super::net::{BreakOn, Broken, Integrator, Mass, Motion, Net, SpringError};
use super::simulate::simulate;
use super::step::Stepper;
use super::wide;
use crate::ground::hash::Hash;
use crate::ground::real::Real;
use crate::leather::delaunay::delaunay;
use crate::leather::links::Links;
use crate::leather::points;
use glam::Vec2;

const SIZE: f32 = 40.0;

fn motion<T: Real>(steps: u32) -> Motion<T> {
    Motion {
        step: T::of(0.05),
        steps,
        integrator: Integrator::Explicit,
        drag: T::of(0.5),
        break_on: BreakOn::Either,
        settle: T::ZERO,
    }
}

/// A periodic net of random points whose springs use all features.
struct Case<T> {
    points: Vec<[T; 2]>,
    links: Links,
    stiffness: Vec<T>,
    rest: Vec<T>,
    threshold: Vec<T>,
    damping: Vec<T>,
    pushes: Vec<bool>,
    fixed: Vec<bool>,
}

impl<T: Real> Case<T> {
    fn new(count: usize) -> Self {
        let places = points::random(count, Vec2::splat(SIZE), Hash::new(3));
        let links = delaunay(&places, Vec2::splat(SIZE), true);
        let hash = Hash::new(4);
        let number = |l: usize, from: f64, to: f64| T::of(from + f64::from(hash.unit_f32(l as u64)) * (to - from));
        let all = |from, to| (0..links.pairs.len()).map(|l| number(l, from, to)).collect();
        Self {
            points: places.iter().map(|p| p.to_array().map(|v| T::of(f64::from(v)))).collect(),
            stiffness: all(2.0, 5.0),
            rest: all(0.1, 0.9),
            threshold: all(1.0, 6.0),
            damping: all(0.1, 0.5),
            pushes: (0..links.pairs.len()).map(|l| l % 7 == 0).collect(),
            fixed: (0..count).map(|p| p % 31 == 0).collect(),
            links,
        }
    }

    fn net(&self) -> Net<'_, T> {
        Net {
            links: &self.links.pairs,
            wraps: &self.links.wraps,
            size: [T::of(f64::from(SIZE)); 2],
            stiffness: &self.stiffness,
            rest: &self.rest,
            ..Net::default()
        }
    }
}

type End<T> = ([Vec<[T; 2]>; 2], Vec<Broken>);

/// Runs with blocks of `block` points and strides of `stride` steps.
fn run<T: Real>(points: &[[T; 2]], net: &Net<'_, T>, block: usize, stride: u32) -> End<T> {
    let motion = motion(13);
    let list = List::cut(net, &motion, &Sorted::new(points, net), block, stride).expect("room");
    let (mut list, mut broken, mut step) = (Box::new(list), Vec::new(), 0);
    while step < motion.steps {
        let steps = stride.min(motion.steps - step);
        assert_eq!(list.advance(step, steps, &mut broken).len(), steps as usize);
        step += steps;
    }
    broken.sort_unstable();
    (list.finish(), broken)
}

fn blocks_and_strides_change_no_bit<T: Real + std::fmt::Debug>() {
    let case = Case::<T>::new(3000);
    let light = |p: [T; 2]| if p[0] < T::of(20.0) { T::ONE } else { T::of(1.5) };
    let plain = case.net();
    let breaking = Net { threshold: &case.threshold, fixed: &case.fixed, mass: Mass::Live(&light), ..plain };
    let damped = Net { damping: &case.damping, pushes: &case.pushes, threshold: &case.threshold, ..plain };
    for (net, breaks) in [(plain, false), (breaking, true), (damped, true)] {
        let whole = run(&case.points, &net, 4096, 1);
        assert_eq!(!whole.1.is_empty(), breaks);
        assert!(!breaks || whole.1.iter().any(|b| b.step > 4), "some break later than in the first stride");
        for (block, stride) in [(24, 2), (64, 1), (2048, 2), (256, 4), (100, 3), (512, 6)] {
            assert_eq!(run(&case.points, &net, block, stride), whole, "blocks of {block}, strides of {stride}");
        }
    }
}

#[test]
fn blocks_and_strides_change_no_bit_in_f32() {
    blocks_and_strides_change_no_bit::<f32>();
}

#[test]
fn blocks_and_strides_change_no_bit_in_f64() {
    blocks_and_strides_change_no_bit::<f64>();
}

#[test]
fn wide_loops_have_the_bits_of_plain_ones() {
    let case = Case::<f32>::new(3000);
    let none = vec![0.0; case.rest.len()];
    for threshold in [&[][..], &case.threshold] {
        let wide = Net { threshold, ..case.net() };
        // Springs with dampers, even of 0, use the plain loops.
        let plain = Net { damping: &none, ..wide };
        assert_eq!(run(&case.points, &wide, 512, 1), run(&case.points, &plain, 512, 1));
    }
}

#[test]
fn moves_points_equally_in_groups_and_alone() {
    let hash = Hash::new(9);
    let pairs = |seed: u64, count: usize| -> Vec<[f32; 2]> {
        let number = |i: u64| hash.unit_f32(2 * (seed + i));
        (0..count as u64).map(|i| [number(i), number(i + 1_000_000)]).collect()
    };
    let pulls: Box<[[f32; 2]; LOCAL]> = pairs(0, LOCAL).try_into().expect("as many");
    let weight = pairs(100_000, 24);
    for (integrator, each) in (0..24).map(|i| ([Integrator::Explicit, Integrator::SemiImplicit][i % 2], i / 2)) {
        let motion = Motion { integrator, ..motion(1) };
        let incoming: Vec<u16> = (0..24 * each).map(|i| u16::try_from(i * 40_503 % LOCAL).expect("below")).collect();
        for weight in [None, Some(&weight[..])] {
            let [mut force, x, v] = [200_000, 300_000, 400_000].map(|seed| pairs(seed, 24));
            let mut ends = [[x.clone(), v.clone()], [x, v]];
            let [wide, plain] = &mut ends;
            let [x, v] = wide;
            let moving = Moving { force: &mut force.clone(), weight, alike: 0.7, x, v };
            if !wide::settle(&incoming, each, moving, &motion, &pulls) {
                continue;
            }
            let [x, v] = plain;
            Moving { force: &mut force, weight, alike: 0.7, x, v }.settle(&incoming, each, &motion, &pulls);
            assert_eq!(ends[0], ends[1], "{each} each");
        }
    }
}

/// Some points of a group have springs with offsets, and all points of the next groups: no spring is skipped.
#[test]
fn handles_offsets_that_begin_anywhere() {
    let points: Vec<[f64; 2]> = (0..2048).map(|i| [f64::from(i), 0.0]).collect();
    let mut links = Links::default();
    for i in 0..2048 {
        let next = (i + 1) % 2048;
        links.pairs.push([i, next]);
        links.wraps.push([i8::from(next == 0), 0]);
        for _ in 0..if i < 700 { 0 } else { 1 + i % 3 } {
            links.pairs.push([i, next]);
            links.wraps.push([i8::from(next == 0), 1]);
        }
    }
    let (stiffness, rest) = (vec![0.3; links.pairs.len()], vec![0.5; links.pairs.len()]);
    let net = Net {
        links: &links.pairs,
        wraps: &links.wraps,
        size: [2048.0, 2.0],
        stiffness: &stiffness,
        rest: &rest,
        ..Net::default()
    };
    assert_eq!(run(&points, &net, 2048, 1), run(&points, &net, 64, 1));
}

/// All points are linked with all: no block of the usual size has room for the springs.
#[test]
fn dense_nets_take_smaller_blocks() {
    let count = 400u32;
    let start: Vec<[f64; 2]> = points::random(count as usize, Vec2::splat(SIZE), Hash::new(5))
        .iter()
        .map(|p| p.to_array().map(f64::from))
        .collect();
    let pairs: Vec<[u32; 2]> = (0..count).flat_map(|a| (0..a).map(move |b| [a, b])).collect();
    let (stiffness, rest) = (vec![0.01; pairs.len()], vec![10.0; pairs.len()]);
    let net = Net { links: &pairs, stiffness: &stiffness, rest: &rest, ..Net::default() };
    let all = List::cut(&net, &motion(1), &Sorted::new(&start, &net), 2048, 1);
    assert!(matches!(all.err(), Some(SpringError::Crowded { .. })));
    let out = simulate(&start, &net, &motion(1), &mut |_| true).expect("stable");
    for (i, (from, to)) in start.iter().zip(&out.positions).enumerate() {
        let mut force = [0.0; 2];
        for other in start.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, p)| p) {
            let d = [other[0] - from[0], other[1] - from[1]];
            let length = d[0].hypot(d[1]);
            let pull = 0.01 * (length - 10.0) / length;
            force = [force[0] + pull * d[0], force[1] + pull * d[1]];
        }
        for axis in 0..2 {
            assert!((from[axis] + 0.5 * force[axis] * 0.05 * 0.05 - to[axis]).abs() < 1e-9);
        }
    }
}
