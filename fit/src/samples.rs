//! Rendered points, and how far the numbers of seeds differ.
use crate::random::hash;
use crate::ridge::{Model, Sample};
use crate::turns::pause;
use crate::{Ask, Best, Outcome, Problem, Renders, Status, Unknowns};
use shibo_bridge::compare::Scale;

/// Most samples of a model.
const MOST: usize = 140;
/// Samples near the best point count as this many.
const NEAR: f64 = 4.0;

/// A rendered point.
pub(crate) struct Rendered {
    pub(crate) point: Vec<f64>,
    pub(crate) combination: usize,
    pub(crate) features: Vec<f64>,
    pub(crate) numbers: Vec<f64>,
}

/// All renders so far.
pub(crate) struct Samples<'p> {
    pub(crate) problem: &'p Problem,
    renders: &'p (dyn Renders + Sync),
    pub(crate) made: Vec<Rendered>,
    /// Features of points that the graph refused.
    pub(crate) refused: Vec<Vec<f64>>,
    pub(crate) status: Status,
    pub(crate) cancelled: bool,
    pub(crate) scale: Scale,
    /// Renders of equal values at several seeds: indices of `made`.
    groups: Vec<Vec<usize>>,
}

impl<'p> Samples<'p> {
    pub(crate) fn new(problem: &'p Problem, renders: &'p (dyn Renders + Sync), planned: usize) -> Self {
        Self {
            problem,
            renders,
            made: Vec::new(),
            refused: Vec::new(),
            status: Status { planned, ..Status::default() },
            cancelled: false,
            scale: problem.scale.clone(),
            groups: Vec::new(),
        }
    }

    pub(crate) fn unknowns(&self) -> &'p Unknowns {
        &self.problem.unknowns
    }

    /// Renders points, each at a seed of its own; the indices of those that were made, `None` for others. The caller of the search gets a
    /// turn after each portion.
    pub(crate) async fn render(&mut self, points: &[(Vec<f64>, usize)]) -> Vec<Option<usize>> {
        if self.cancelled {
            return vec![None; points.len()];
        }
        let asks: Vec<Ask> = points
            .iter()
            .enumerate()
            .map(|(k, (point, combination))| Ask {
                amounts: self.unknowns().amounts(point),
                combination: *combination,
                seed: (hash(self.problem.seed, (self.status.done + k) as u64) >> 33) as u32,
            })
            .collect();
        let mut outcomes = Vec::with_capacity(asks.len());
        for portion in asks.chunks(self.renders.at_once().max(1)) {
            outcomes.extend(self.renders.render(portion, &self.status));
            self.status.done += portion.len();
            if outcomes.contains(&Outcome::Cancelled) {
                break;
            }
            pause().await;
        }
        let mut found = Vec::with_capacity(points.len());
        for ((point, combination), outcome) in points.iter().zip(outcomes) {
            let features = self.unknowns().features(point);
            found.push(match outcome {
                Outcome::Made(numbers) if numbers.iter().all(|number| number.is_finite()) => {
                    let (point, combination) = (point.clone(), *combination);
                    self.made.push(Rendered { point, combination, features, numbers });
                    let index = self.made.len() - 1;
                    let distance = self.distance(index);
                    if self.status.best.as_ref().is_none_or(|best| distance < best.distance) {
                        self.status.best = Some(self.best(index));
                    }
                    Some(index)
                }
                Outcome::Made(_) | Outcome::Refused => {
                    self.refused.push(features);
                    None
                }
                Outcome::Cancelled => {
                    self.cancelled = true;
                    None
                }
            });
        }
        found.resize(points.len(), None);
        found
    }

    pub(crate) fn is_over(&self) -> bool {
        self.cancelled || self.renders.is_late()
    }

    /// The distance of a render from the photograph.
    pub(crate) fn distance(&self, index: usize) -> f64 {
        self.scale.distance(&self.made[index].numbers, &self.problem.target).0
    }

    fn best(&self, index: usize) -> Best {
        let Rendered { point, combination, .. } = &self.made[index];
        let amounts = self.unknowns().amounts(point);
        Best { distance: self.distance(index), amounts, combination: *combination }
    }

    /// The renders of a combination, nearest to the photograph first.
    pub(crate) fn ranked(&self, combination: Option<usize>) -> Vec<usize> {
        let mut ranked: Vec<(f64, usize)> = (0..self.made.len())
            .filter(|index| combination.is_none_or(|one| self.made[*index].combination == one))
            .map(|index| (self.distance(index), index))
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        ranked.into_iter().map(|(_, index)| index).collect()
    }

    /// Adds renders of equal values; the scale follows from all groups.
    pub(crate) fn group(&mut self, group: Vec<usize>) {
        if group.len() < 2 {
            return;
        }
        self.groups.push(group);
        let count = self.problem.target.len();
        let mut variances = vec![0.0; count];
        for group in &self.groups {
            let share = 1.0 / (group.len() - 1) as f64 / self.groups.len() as f64;
            for (number, variance) in variances.iter_mut().enumerate() {
                let mean = group.iter().map(|at| self.made[*at].numbers[number]).sum::<f64>() / group.len() as f64;
                let apart =
                    |at: &usize| (self.made[*at].numbers[number] - mean) * (self.made[*at].numbers[number] - mean);
                *variance += share * group.iter().map(apart).sum::<f64>();
            }
        }
        self.scale = self.problem.scale.of_seeds(&variances);
        self.status.best = self.ranked(None).first().map(|best| self.best(*best));
        self.status.floor = self.groups.last().map(|group| self.floor(group).0);
    }

    /// The mean distance between renders of a group, and that of each block.
    pub(crate) fn floor(&self, group: &[usize]) -> (f64, [f64; 5]) {
        let (mut all, mut blocks, mut count) = (0.0, [0.0; 5], 0.0_f64);
        for (k, one) in group.iter().enumerate() {
            for other in &group[k + 1..] {
                let (distance, parts) = self.scale.distance(&self.made[*one].numbers, &self.made[*other].numbers);
                all += distance;
                blocks.iter_mut().zip(parts.blocks()).for_each(|(sum, part)| *sum += part);
                count += 1.0;
            }
        }
        let count = count.max(1.0);
        (all / count, blocks.map(|block| block / count))
    }

    /// The mean distance of a group from the photograph, and that of each block.
    pub(crate) fn apart(&self, group: &[usize]) -> (f64, [f64; 5]) {
        let (mut all, mut blocks) = (0.0, [0.0; 5]);
        for one in group {
            let (distance, parts) = self.scale.distance(&self.made[*one].numbers, &self.problem.target);
            all += distance;
            blocks.iter_mut().zip(parts.blocks()).for_each(|(sum, part)| *sum += part);
        }
        let count = group.len().max(1) as f64;
        (all / count, blocks.map(|block| block / count))
    }

    /// The model of the samples nearest to a point; `None` without samples.
    pub(crate) fn model(&self, combination: usize, near: &[f64]) -> Option<Model> {
        let here = self.unknowns().features(near);
        let mut order: Vec<(f64, usize)> = (0..self.made.len())
            .filter(|index| self.made[*index].combination == combination)
            .map(|index| (squared(&self.made[index].features, &here), index))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.truncate(MOST);
        let close = order.len() / 4;
        let sample = |(rank, (_, index)): (usize, &(f64, usize))| Sample {
            features: &self.made[*index].features,
            numbers: &self.made[*index].numbers,
            weight: if rank < close { NEAR } else { 1.0 },
        };
        let samples: Vec<Sample<'_>> = order.iter().enumerate().map(sample).collect();
        (!samples.is_empty()).then(|| Model::of(&samples, self.unknowns().coordinates(), &self.scale))
    }

    /// A penalty for features that are nearer to a refused point than to a good one.
    pub(crate) fn penalty(&self, features: &[f64]) -> f64 {
        if self.refused.is_empty() {
            return 0.0;
        }
        let nearest = |least: f64, place: &[f64]| least.min(squared(place, features));
        let bad = self.refused.iter().fold(f64::INFINITY, |least, place| nearest(least, place)).sqrt();
        let good = self.made.iter().fold(f64::INFINITY, |least, one| nearest(least, &one.features)).sqrt();
        3.0 * ((good - bad) / (good + bad + 1e-9)).max(0.0)
    }
}

pub(crate) fn squared(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum()
}
