//! Tests of the whole method on closures instead of pictures.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::random::Random;
use crate::*;
use std::future::Future;
use std::pin::pin;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Context, Poll, Waker};

/// Numbers that depend smoothly on three unknowns and a colour, with noise from the seed.
fn numbers(amounts: &[Amount], seed: u32) -> Vec<f64> {
    let number = |k: usize| match amounts[k] {
        Amount::Number(value) => value,
        Amount::Color(_) => 0.0,
    };
    let (size, grain, depth) = (libm::log(number(0)), number(1).to_radians(), number(2));
    let Amount::Color([r, g, b]) = amounts[3] else { return Vec::new() };
    let mut random = Random::new(u64::from(seed), 1);
    let smooth = |k: usize| {
        let k = k as f64;
        0.4 * size * libm::cos(k)
            + 0.3 * depth * libm::sin(1.3 * k)
            + 0.2 * libm::cos(2.0 * grain - k) * (0.5 + depth)
            + 0.3 * (r * libm::cos(2.1 * k) + g * libm::sin(0.7 * k) + b * libm::cos(0.9 * k))
            + 0.1 * size * depth
    };
    (0..60).map(|k| smooth(k) + 0.02 * random.normal()).collect()
}

fn unknowns() -> Unknowns {
    let unknown = |name: &str, kind| Unknown { name: name.to_owned(), kind };
    Unknowns(vec![
        unknown("size", Kind::Number { low: 0.5, high: 4.0 }),
        unknown("grain", Kind::Angle { low: -90.0, turn: 180.0 }),
        unknown("depth", Kind::Number { low: 0.0, high: 1.0 }),
        unknown("color", Kind::Color),
        unknown("idle", Kind::Number { low: 0.0, high: 1.0 }),
    ])
}

fn hidden() -> Vec<Amount> {
    vec![
        Amount::Number(2.5),
        Amount::Number(60.0),
        Amount::Number(0.7),
        Amount::Color([0.3, 0.2, 0.6]),
        Amount::Number(0.5),
    ]
}

fn problem() -> Problem {
    let start = |color| Start {
        amounts: vec![
            Amount::Number(1.0),
            Amount::Number(0.0),
            Amount::Number(0.5),
            Amount::Color(color),
            Amount::Number(0.5),
        ],
        combination: 0,
    };
    Problem {
        unknowns: unknowns(),
        starts: vec![start([0.3, 0.3, 0.4]), start([0.6, 0.5, 0.4])],
        target: numbers(&hidden(), 12345),
        scale: shibo_bridge::compare::Scale::usual([12; 5]),
        renders: None,
        seed: 1,
    }
}

/// Renders by the closure; refuses where `refuses`, and cancels after some renders.
struct Closure {
    refuses: fn(&Ask) -> bool,
    left: AtomicUsize,
    at_once: usize,
}

impl Renders for Closure {
    fn render(&self, asks: &[Ask], _: &Status) -> Vec<Outcome> {
        asks.iter()
            .map(|ask| {
                if self.left.load(Ordering::Relaxed) == 0 {
                    return Outcome::Cancelled;
                }
                self.left.fetch_sub(1, Ordering::Relaxed);
                if (self.refuses)(ask) { Outcome::Refused } else { Outcome::Made(numbers(&ask.amounts, ask.seed)) }
            })
            .collect()
    }

    fn at_once(&self) -> usize {
        self.at_once
    }
}

fn closure(refuses: fn(&Ask) -> bool, left: usize) -> Closure {
    Closure { refuses, left: AtomicUsize::new(left), at_once: usize::MAX }
}

fn fitted(refuses: fn(&Ask) -> bool, left: usize) -> Result<Fit, Failure> {
    fit(&problem(), &closure(refuses, left))
}

/// The error of each found value as a share of its range.
fn errors(fit: &Fit) -> Vec<f64> {
    let unknowns = unknowns();
    let amounts: Vec<Amount> = fit.found.iter().map(|found| found.amount).collect();
    let (found, right) = (unknowns.point(&amounts), unknowns.point(&hidden()));
    let apart = |at: usize| {
        let apart = (found[at] - right[at]).abs();
        if at == 1 { apart.min(1.0 - apart) } else { apart }
    };
    unknowns.ranges().into_iter().map(|range| range.map(apart).fold(0.0, f64::max)).collect()
}

#[test]
fn finds_hidden_values_and_names_those_without_effect() {
    let fit = fitted(|_| false, usize::MAX).unwrap();
    let errors = errors(&fit);
    assert!(errors[..4].iter().all(|error| *error < 0.06), "{errors:?} {fit:?}");
    assert!(fit.found[..3].iter().all(|found| found.determined) && !fit.found[4].determined, "{fit:?}");
    // It stays where it was.
    assert!(errors[4] < 0.1, "{errors:?}");
    let floor = fit.floor.unwrap().distance;
    assert!(fit.distance.distance < 1.5 * floor && fit.starts[0].unwrap() > 3.0 * floor, "{fit:?}");
    for (found, error) in fit.found.iter().zip(&errors) {
        assert!(*error <= 3.0 * found.share, "{found:?} {error}");
    }
}

#[test]
fn same_seed_gives_the_same_bits() {
    assert_eq!(fitted(|_| false, usize::MAX).unwrap(), fitted(|_| false, usize::MAX).unwrap());
}

#[test]
fn refused_samples_are_no_points_of_the_model() {
    // Half of the cube is refused; the hidden values are beside it.
    let refuses = |ask: &Ask| matches!(ask.amounts[2], Amount::Number(depth) if depth < 0.5);
    let fit = fitted(refuses, usize::MAX).unwrap();
    assert!(fit.refused > 20, "{}", fit.refused);
    assert!(errors(&fit)[..4].iter().all(|error| *error < 0.08), "{:?} {fit:?}", errors(&fit));
    assert_eq!(fitted(|_| true, usize::MAX), Err(Failure::AllRefused));
}

#[test]
fn cancelling_keeps_the_best_so_far() {
    assert_eq!(fitted(|_| false, 0), Err(Failure::Cancelled));
    let start = fitted(|_| false, 1).unwrap();
    assert!(start.cancelled && start.floor.is_none() && start.distance.distance > 0.0);
    let early = fitted(|_| false, 65).unwrap();
    assert!(early.cancelled && early.distance.distance < 0.5 * start.distance.distance, "{early:?}");
}

#[test]
fn takes_the_combination_of_the_best_start() {
    let mut problem = problem();
    problem.starts.push(Start { amounts: hidden(), combination: 1 });
    let refuses = |ask: &Ask| ask.combination == 0 && ask.seed.is_multiple_of(2);
    let fit = fit(&problem, &closure(refuses, usize::MAX)).unwrap();
    assert_eq!((fit.combination, fit.starts.len()), (1, 3));
}

/// A fit that renders one picture at a time, and its turns.
fn in_turns(left: usize) -> (Result<Fit, Failure>, usize) {
    let (problem, renders) = (problem(), Closure { at_once: 1, ..closure(|_| false, left) });
    let (mut work, mut turns) = (pin!(fit_in_turns(&problem, &renders)), 0);
    loop {
        match work.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(done) => return (done, turns),
            Poll::Pending => turns += 1,
        }
    }
}

#[test]
fn turns_change_no_bit() {
    let (fit, turns) = in_turns(usize::MAX);
    let fit = fit.unwrap();
    assert_eq!(turns, fit.renders, "a turn after each picture");
    assert_eq!(fit, fitted(|_| false, usize::MAX).unwrap());
    // A cancelled fit ends without rendering the rest.
    let (early, turns) = in_turns(65);
    let early = early.unwrap();
    assert_eq!((early.cancelled, turns, early.renders), (true, 65, 66));
    assert_eq!(in_turns(0), (Err(Failure::Cancelled), 0));
}
