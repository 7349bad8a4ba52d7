//! Fits the weights of the ranks of names in formulas: a multinomial logistic regression over the holes of the shipped graphs.
use super::super::complete::ranked;
use super::super::complete::ranks::{FACTS, Ranked, TYPE, WEIGHTS};
use super::super::{Cx, Workspace};
use super::holes::{Cut, holes};
use super::{graphs, habits_without, registry};
use std::sync::Arc;

/// A hole: the classes and facts of all offers, and the index of the deleted one.
struct Example {
    names: Vec<Ranked>,
    wanted: usize,
}

type Weights = [[f64; 5]; FACTS];

impl Example {
    fn sums(&self, weights: &Weights) -> Vec<f64> {
        let sum = |one: &Ranked| {
            one.facts.iter().zip(weights).map(|(fact, of)| fact * of[one.class as usize]).sum::<f64>() - one.unfit
        };
        self.names.iter().map(sum).collect()
    }

    /// True if the deleted name is among the first three.
    fn is_first(&self, weights: &Weights) -> bool {
        let sums = self.sums(weights);
        sums.iter().filter(|sum| **sum > sums[self.wanted]).count() < 3
    }
}

/// Examples of the graphs with an even index, and of the others. One in four names is deleted in each way.
fn examples() -> [Vec<Example>; 2] {
    let mut found = [Vec::new(), Vec::new()];
    let registry = Arc::new(registry());
    for (number, graph) in shibo_library::graphs().iter().enumerate() {
        let mut workspace = Workspace::new(registry.clone(), vec![graphs()]).with_habits(habits_without(graph.path));
        let path = graphs().join(graph.path);
        let file = workspace.open(&path, graph.text);
        for (hole, cut) in holes(Cx { world: &workspace, file: &file }).iter().zip(Cut::ALL.into_iter().cycle()) {
            let (text, at) = hole.text(&file, cut, "");
            let holed = workspace.open(&path, text);
            let names = ranked(Cx { world: &workspace, file: &holed }, at);
            let wanted = names.iter().position(|one| one.label == hole.wanted);
            found[number % 2].extend(wanted.map(|wanted| Example { names, wanted }));
        }
    }
    found
}

/// Adam on the mean negative logarithm of the likelihood, in batches of 64 examples.
#[allow(clippy::needless_range_loop, reason = "four tables have the same indices")]
fn fitted(examples: &[Example], start: &Weights) -> Weights {
    const ROUNDS: usize = 6;
    let mut weights = *start;
    let (mut mean, mut square) = ([[0.0; 5]; FACTS], [[0.0; 5]; FACTS]);
    let mut steps = 0;
    for round in 0..ROUNDS {
        let rate = 0.06 * (1.0 - round as f64 / ROUNDS as f64);
        // Neighbours in a batch come from different graphs.
        let count = examples.len().div_ceil(64);
        for batch in 0..count {
            let mut slope = weights.map(|of| of.map(|weight| 1e-4 * weight));
            let mut size = 0.0;
            for example in examples.iter().skip(batch).step_by(count) {
                size += 1.0;
                let sums = example.sums(&weights);
                let most = sums.iter().copied().fold(f64::MIN, f64::max);
                let total: f64 = sums.iter().map(|sum| (sum - most).exp()).sum();
                for (index, (one, sum)) in example.names.iter().zip(sums).enumerate() {
                    let error = (sum - most).exp() / total - f64::from(u8::from(index == example.wanted));
                    for (slope, fact) in slope.iter_mut().zip(&one.facts).filter(|_| error.abs() > 1e-6) {
                        slope[one.class as usize] += error * fact / 64.0;
                    }
                }
            }
            assert!(size > 0.0);
            steps += 1;
            for fact in (0..FACTS).filter(|fact| *fact != TYPE) {
                for class in 0..5 {
                    let slope = slope[fact][class];
                    mean[fact][class] = 0.9 * mean[fact][class] + 0.1 * slope;
                    square[fact][class] = 0.999 * square[fact][class] + 0.001 * slope * slope;
                    let [mean, square] = [
                        mean[fact][class] / (1.0 - 0.9_f64.powi(steps)),
                        square[fact][class] / (1.0 - 0.999_f64.powi(steps)),
                    ];
                    weights[fact][class] -= rate * mean / (square.sqrt() + 1e-8);
                }
            }
        }
    }
    weights
}

fn share(examples: &[Example], weights: &Weights) -> f64 {
    100.0 * examples.iter().filter(|one| one.is_first(weights)).count() as f64 / examples.len() as f64
}

/// Fitted weights are hardly better than those of the program. Prints them, and the shares among the first three. After a change of the
/// facts, take the weights that it prints.
#[test]
fn fits_weights() {
    let [mut even, odd] = examples();
    let half = fitted(&even, &WEIGHTS);
    let [now, fit] = [&WEIGHTS, &half].map(|weights| [&even, &odd].map(|graphs| share(graphs, weights)));
    println!("first three, % of fitted graphs and of the others: now {now:.1?}, fitted to half {fit:.1?}");
    even.extend(odd);
    let all = fitted(&even, &half);
    for of in all {
        println!("    [{}],", of.map(|weight| format!("{weight:.2}")).join(", "));
    }
    let [now, fit] = [&WEIGHTS, &all].map(|weights| share(&even, weights));
    println!("all graphs: now {now:.1}, fitted {fit:.1}");
    assert!(fit - now < 2.0, "the weights of the program give {now:.1} %, fitted ones {fit:.1} %");
}
