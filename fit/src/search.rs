//! The search: design, rounds of model and renders, answer.
use crate::answer::{Found, Level, found};
use crate::cma::{Effort, minimise};
use crate::random::Random;
use crate::ridge::Model;
use crate::samples::{Samples, squared};
use crate::turns::finish;
use crate::{Failure, Kind, Problem, Renders, sobol};

/// Most presets that are rendered as starts.
const STARTS: usize = 24;
/// Largest distance of a colour of the design from that of a start, in each channel.
const COLOR_REACH: f64 = 0.25;
/// Renders of the answer at several seeds.
const LAST: usize = 4;
/// Points of the design that are rendered at more seeds, and how many.
const SEEDED: (usize, usize) = (3, 2);
/// Rounds after which the best point is rendered at more seeds, counted from 0.
const SEED_ROUNDS: [usize; 2] = [1, 3];

/// Penalty on the square of a coordinate's distance from the nearest start. It holds a value that changes little in the picture.
/// A value that the photograph determines moves by a few hundredths of that distance at most.
const PULL: f64 = 0.1;

/// The result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The found values, in the order of the unknowns.
    pub found: Vec<Found>,
    /// The combination of all that is no unknown.
    pub combination: usize,
    /// The distance of the answer from the photograph: the mean over some seeds.
    pub distance: Level,
    /// The distance between seeds of the answer. `None` if the fit was cancelled.
    pub floor: Option<Level>,
    /// The distance of each start; `None` where the graph refused it.
    pub starts: Vec<Option<f64>>,
    /// Pairs of unknowns that do the same: their places, and the correlation of their errors.
    pub pairs: Vec<(usize, usize, f64)>,
    /// All renders.
    pub renders: usize,
    /// Renders that the graph refused.
    pub refused: usize,
    /// True if the fit was cancelled.
    pub cancelled: bool,
}

/// The renders of each part of a fit.
struct Budget {
    design: usize,
    round: usize,
    rounds: usize,
}

impl Budget {
    fn of(problem: &Problem) -> Self {
        let n = problem.unknowns.coordinates();
        let starts = problem.starts.len().min(STARTS);
        let round = (n + 4).clamp(6, 14);
        let usual = (8 + 6 * n).clamp(24, 96).max(starts + 8);
        let extra = SEEDED.0 * SEEDED.1 + LAST;
        let Some(all) = problem.renders else { return Self { design: usual, round, rounds: 7 } };
        // A design of somewhat less than half of all, then rounds as long as renders are left.
        let design = (all * 9 / 20).max(starts + 1).min(usual);
        let left = all.saturating_sub(design + extra);
        let mut budget = Self { design, round, rounds: (left / round).min(12) };
        while budget.all() > all && budget.rounds > 0 {
            budget.rounds -= 1;
        }
        budget
    }

    fn all(&self) -> usize {
        let seeded = SEED_ROUNDS.iter().filter(|round| **round < self.rounds).count() * (LAST - 1);
        self.design + SEEDED.0 * SEEDED.1 + self.rounds * self.round + seeded + LAST
    }
}

/// Finds the values with which the renders are nearest to the photograph.
///
/// # Errors
/// Nothing could be rendered.
pub fn fit(problem: &Problem, renders: &(dyn Renders + Sync)) -> Result<Fit, Failure> {
    finish(fit_in_turns(problem, renders))
}

/// Like [`fit`]. The future gives its caller a turn after each call of [`Renders::render`]: it is pending until it is polled again, and uses no
/// waker.
///
/// # Errors
/// Nothing could be rendered.
pub async fn fit_in_turns(problem: &Problem, renders: &(dyn Renders + Sync)) -> Result<Fit, Failure> {
    let budget = Budget::of(problem);
    let mut samples = Samples::new(problem, renders, budget.all());
    let begun = design(&mut samples, &budget).await;
    let Some(combination) = begun.combination else {
        return Err(if samples.cancelled { Failure::Cancelled } else { Failure::AllRefused });
    };
    let origin = begun.nearest(&samples, combination);
    let mut search = Search { random: Random::new(problem.seed, 99), samples, combination, origin };
    let (best, model) = search.rounds(&budget).await;
    Ok(search.answer(best, model, &begun.starts).await)
}

/// The renders of the starts, and the combination that is nearest.
struct Begun {
    starts: Vec<Option<usize>>,
    combination: Option<usize>,
}

impl Begun {
    /// The point of the start of this combination that is nearest to the photograph.
    fn nearest(&self, samples: &Samples<'_>, combination: usize) -> Option<Vec<f64>> {
        let made = self.starts.iter().flatten().copied();
        let of = made.filter(|index| samples.made[*index].combination == combination);
        let nearest = of.min_by(|a, b| samples.distance(*a).total_cmp(&samples.distance(*b)))?;
        Some(samples.made[nearest].point.clone())
    }
}

/// Renders the starts, then points that fill the cube with the combination of the best start.
async fn design(samples: &mut Samples<'_>, budget: &Budget) -> Begun {
    let problem = samples.problem;
    let unknowns = &problem.unknowns;
    let known: Vec<(Vec<f64>, usize)> =
        problem.starts.iter().take(STARTS).map(|start| (unknowns.point(&start.amounts), start.combination)).collect();
    let starts = samples.render(&known).await;
    let combination = samples.ranked(None).first().map(|best| samples.made[*best].combination);
    let first = combination.or_else(|| problem.starts.first().map(|start| start.combination));
    let Some(first) = first.filter(|_| !samples.cancelled) else { return Begun { starts, combination } };
    let mut random = Random::new(problem.seed, 7);
    let colors: Vec<_> =
        unknowns.0.iter().zip(unknowns.ranges()).filter(|(unknown, _)| unknown.kind == Kind::Color).collect();
    let mut points = sobol::points(budget.design.saturating_sub(known.len()), unknowns.coordinates(), problem.seed);
    for point in &mut points {
        let near = &known[random.below(known.len())].0;
        for at in colors.iter().flat_map(|(_, range)| range.clone()) {
            point[at] = (near[at] + COLOR_REACH * (2.0 * point[at] - 1.0)).clamp(0.0, 1.0);
        }
    }
    let points: Vec<(Vec<f64>, usize)> = points.into_iter().map(|point| (point, first)).collect();
    samples.render(&points).await;
    let best: Vec<usize> = samples.ranked(Some(first)).into_iter().take(SEEDED.0).collect();
    for index in &best {
        let again = vec![(samples.made[*index].point.clone(), first); SEEDED.1];
        let mut group = vec![*index];
        group.extend(samples.render(&again).await.into_iter().flatten());
        samples.group(group);
    }
    Begun { starts, combination: samples.ranked(Some(first)).first().map(|_| first) }
}

struct Search<'p> {
    samples: Samples<'p>,
    random: Random,
    combination: usize,
    /// The start from which values should not go without a reason.
    origin: Option<Vec<f64>>,
}

impl Search<'_> {
    /// The rounds; returns the best point, with the last model.
    async fn rounds(&mut self, budget: &Budget) -> (Vec<f64>, Option<Model>) {
        let first =
            self.samples.ranked(Some(self.combination)).first().map(|index| self.samples.made[*index].point.clone());
        let mut best = first.unwrap_or_default();
        let (mut reached, mut idle) = (0, 0);
        for round in 0..budget.rounds {
            if self.samples.is_over() {
                break;
            }
            let Some(model) = self.samples.model(self.combination, &best) else { break };
            let before = self.value(&model, &best);
            let minima = self.minima(&model, &best, round);
            let Some((value, minimum)) = minima.first().cloned() else { break };
            let spread = 0.12 * libm::pow(0.75, round as f64);
            let mut points = vec![minimum.clone()];
            points.extend(minima.get(1).map(|(_, second)| second.clone()));
            while points.len() < budget.round {
                let near: Vec<f64> = minimum.iter().map(|at| at + spread * self.random.normal()).collect();
                points.push(self.samples.unknowns().inside(&near));
            }
            let asked: Vec<(Vec<f64>, usize)> = points.into_iter().map(|point| (point, self.combination)).collect();
            let made = self.samples.render(&asked).await;
            let Some(&at) = made.first() else { break };
            if self.samples.cancelled {
                // The minimum of this round counts only if it was rendered.
                if at.is_some() {
                    best = minimum;
                }
                break;
            }
            idle = if value > 0.98 * before { idle + 1 } else { 0 };
            if let Some(at) = at {
                best = minimum;
                if SEED_ROUNDS.contains(&round) {
                    let again = vec![(best.clone(), self.combination); LAST - 1];
                    let mut group = vec![at];
                    group.extend(self.samples.render(&again).await.into_iter().flatten());
                    self.samples.group(group);
                }
                let near = self.samples.status.floor.is_some_and(|floor| self.samples.distance(at) <= 1.05 * floor);
                reached = if near { reached + 1 } else { 0 };
            }
            if reached >= 2 || (idle >= 2 && round >= 4) {
                break;
            }
        }
        if self.samples.cancelled {
            return (best.clone(), self.samples.model(self.combination, &best));
        }
        let model = self.samples.model(self.combination, &best);
        if let Some(model) = model.as_ref().filter(|_| budget.rounds > 0)
            && let Some((_, minimum)) = self.minima(model, &best, budget.rounds).first()
        {
            best.clone_from(minimum);
        }
        (best, model)
    }

    /// The distance of the modelled numbers from the photograph, with penalties.
    fn value(&self, model: &Model, point: &[f64]) -> f64 {
        let samples = &self.samples;
        let inside = samples.unknowns().inside(point);
        let outside: f64 = point
            .iter()
            .zip(&inside)
            .zip(samples.unknowns().periodic())
            .map(|((a, b), periodic)| if periodic { 0.0 } else { (a - b).abs() })
            .sum();
        let features = samples.unknowns().features(&inside);
        let distance = samples.scale.distance(&model.numbers(&features), &samples.problem.target).0;
        distance + samples.penalty(&features) + 2.0 * outside + self.pull(&inside)
    }

    /// The penalty for leaving the start.
    fn pull(&self, point: &[f64]) -> f64 {
        let Some(origin) = &self.origin else { return 0.0 };
        let coordinates = point.iter().zip(origin).zip(self.samples.unknowns().periodic());
        let squares = coordinates.map(|((at, origin), periodic)| {
            let apart = at - origin;
            let apart = if periodic { apart - apart.round() } else { apart };
            apart * apart
        });
        PULL * squares.sum::<f64>()
    }

    /// The minima of the model from three starts, the smallest first. Minima that are near a smaller one are left out.
    fn minima(&mut self, model: &Model, best: &[f64], round: usize) -> Vec<(f64, Vec<f64>)> {
        let n = best.len() as f64;
        let mut starts = vec![best.to_vec()];
        for index in self.samples.ranked(Some(self.combination)) {
            let point = &self.samples.made[index].point;
            if starts.len() < 3 && starts.iter().all(|start| squared(start, point) > 0.01 * n) {
                starts.push(point.clone());
            }
        }
        let effort = Effort { population: 24, generations: 60, spread: if round == 0 { 0.2 } else { 0.12 } };
        let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
        let mut random = self.random.clone();
        for start in &starts {
            let (value, point) = minimise(start, effort, &mut random, &mut |point| self.value(model, point));
            found.push((value, self.samples.unknowns().inside(&point)));
        }
        self.random = random;
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut distinct: Vec<(f64, Vec<f64>)> = Vec::new();
        for one in found {
            if distinct.iter().all(|(_, other)| squared(other, &one.1) > 4e-4 * n) {
                distinct.push(one);
            }
        }
        distinct
    }

    /// Renders the best point at several seeds. If another rendered point is clearly nearer, that is the answer.
    async fn answer(mut self, best: Vec<f64>, model: Option<Model>, starts: &[Option<usize>]) -> Fit {
        let (mut values, mut pairs) = found(&self.samples, model.as_ref(), &best);
        let mut level = None;
        if !self.samples.cancelled {
            level = self.seeded(&self.rounded(&values)).await;
            let lowest = self.samples.ranked(Some(self.combination)).first().copied();
            let floor = self.samples.status.floor.unwrap_or(0.0);
            let worse = |index: usize| {
                let point = &self.samples.made[index].point;
                let found = self.samples.unknowns().inside(point);
                (self.samples.distance(index) + floor
                    < level.map_or(f64::INFINITY, |(apart, _): (Level, _)| apart.distance))
                .then_some(found)
            };
            if let Some(point) = lowest.and_then(worse) {
                let other = found(&self.samples, model.as_ref(), &point);
                let again = self.seeded(&self.rounded(&other.0)).await;
                let nearer = |a: Level, b: Option<(Level, Level)>| b.is_none_or(|(b, _)| a.distance < b.distance);
                if again.is_some_and(|(again, _)| nearer(again, level)) {
                    ((values, pairs), level) = (other, again);
                }
            }
        }
        let level = level.or_else(|| {
            // Nothing new could be rendered: the best render so far.
            let index = *self.samples.ranked(Some(self.combination)).first()?;
            let point = self.samples.made[index].point.clone();
            (values, pairs) = found(&self.samples, model.as_ref(), &point);
            let (distance, blocks) = self.samples.apart(&[index]);
            Some((Level { distance, blocks }, Level::default()))
        });
        let (distance, floor) = level.unwrap_or_default();
        let cancelled = self.samples.cancelled;
        let start = |index: &Option<usize>| index.map(|index| self.samples.distance(index));
        Fit {
            found: values,
            combination: self.combination,
            distance,
            floor: (floor != Level::default()).then_some(floor),
            starts: starts.iter().map(start).collect(),
            pairs,
            renders: self.samples.status.done,
            refused: self.samples.refused.len(),
            cancelled,
        }
    }

    fn rounded(&self, values: &[Found]) -> Vec<f64> {
        let amounts: Vec<_> = values.iter().map(|value| value.amount).collect();
        self.samples.unknowns().point(&amounts)
    }

    /// The distance of a point from the photograph and between its seeds; `None` if it is refused at one of them.
    async fn seeded(&mut self, point: &[f64]) -> Option<(Level, Level)> {
        let asked = vec![(point.to_vec(), self.combination); LAST];
        let made: Option<Vec<usize>> = self.samples.render(&asked).await.into_iter().collect();
        let made = made?;
        self.samples.group(made.clone());
        let ((distance, blocks), (floor, of_floor)) = (self.samples.apart(&made), self.samples.floor(&made));
        Some((Level { distance, blocks }, Level { distance: floor, blocks: of_floor }))
    }
}
