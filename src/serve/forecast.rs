//! Progress of an evaluation: the nodes that will run, weighted by the time that they took before.
use super::stage::Stage;
use serde_json::{Value as Json, json};
use shibo_bridge::scene::{Scene, lock};
use shibo_engine::eval::{NodeState, NodeStats};
use std::collections::HashMap;
use std::sync::Mutex;
use std::time::Instant;

/// Time that a node without a known cost counts as, in seconds, if no cost is known at all.
const UNKNOWN: f64 = 1.0;

/// A node that reports its own progress: its name, and the share that is done.
type Step = (String, f64);

/// The work of one evaluation.
pub(crate) struct Forecast {
    began: Instant,
    /// Expected seconds by node; 0 for nodes whose result is known.
    costs: Vec<f64>,
    /// True for nodes with a measured cost.
    known: Vec<bool>,
    step: Mutex<Option<Step>>,
    /// Seconds by node at the last report, and the share reported then.
    last: Mutex<(Vec<f64>, f64)>,
}

impl Forecast {
    /// Creates the forecast of a scene. `made` tells whether a node's result is known.
    pub(crate) fn new(scene: &Scene, costs: &HashMap<String, f64>, made: impl Fn(usize) -> bool) -> Self {
        let graph = &scene.graph;
        let needed = graph.needed_by(&graph.outputs);
        let runs: Vec<bool> = (0..graph.nodes.node_count()).map(|node| needed[node] && !made(node)).collect();
        let measured: Vec<Option<f64>> =
            graph.nodes.node_weights().map(|node| costs.get(&node.name).copied()).collect();
        let of_runs: Vec<f64> =
            runs.iter().zip(&measured).filter(|(runs, _)| **runs).filter_map(|(_, cost)| *cost).collect();
        let mean = if of_runs.is_empty() { UNKNOWN } else { of_runs.iter().sum::<f64>() / of_runs.len() as f64 };
        Self {
            began: Instant::now(),
            costs: runs
                .iter()
                .zip(&measured)
                .map(|(runs, cost)| if *runs { cost.unwrap_or(mean) } else { 0.0 })
                .collect(),
            known: measured.iter().map(Option::is_some).collect(),
            step: Mutex::default(),
            last: Mutex::default(),
        }
    }

    /// Records the progress of a node.
    pub(crate) fn step(&self, name: &str, done: u64, total: u64) {
        *lock(&self.step) = (done < total).then(|| (name.to_owned(), done as f64 / total.max(1) as f64));
    }

    /// The progress for pages: the node that is computed, the share of all work, and the seconds so far. `pictures` is
    /// the share of pictures that are made.
    pub(crate) fn report(&self, stats: &[NodeStats], pictures: f64) -> Json {
        let step = lock(&self.step).clone();
        let share = self.share(stats, step.as_ref(), pictures);
        let mut last = lock(&self.last);
        let seconds: Vec<f64> = stats.iter().map(|stat| stat.seconds).collect();
        let grown = |node: usize| seconds[node] - last.0.get(node).copied().unwrap_or(0.0);
        let busiest =
            (0..seconds.len()).max_by(|a, b| grown(*a).total_cmp(&grown(*b))).filter(|node| grown(*node) > 0.0);
        let name = step.as_ref().map(|(name, _)| name.clone()).or_else(|| busiest.map(|node| stats[node].name.clone()));
        // The share never goes back.
        let share = share.max(last.1);
        *last = (seconds, share);
        json!({ "node": name, "part": step.map(|(_, part)| part), "share": share, "seconds": self.began.elapsed().as_secs_f64() })
    }

    fn share(&self, stats: &[NodeStats], step: Option<&Step>, pictures: f64) -> f64 {
        let total: f64 = self.costs.iter().sum();
        if total <= 0.0 {
            return pictures;
        }
        let done = stats.iter().zip(&self.costs).zip(&self.known).map(|((stat, cost), known)| {
            let running = step.filter(|(name, _)| *name == stat.name).map(|(_, part)| cost * part);
            // Objects are computed at once, and have no pixels.
            let whole = running.is_none() && stat.state == NodeState::Computed && stat.pixels == 0;
            let own = if whole {
                *cost
            } else if *known {
                stat.seconds.min(*cost)
            } else {
                cost * pictures
            };
            running.unwrap_or(0.0).max(own)
        });
        (done.sum::<f64>() / total).min(1.0)
    }
}

impl Stage {
    /// The forecast of an evaluation.
    pub(crate) fn forecast(&self, scene: &Scene) -> Forecast {
        let made = lock(&self.made);
        let index = |node: usize| petgraph::graph::NodeIndex::new(node);
        Forecast::new(scene, &lock(&self.costs), |node| made.contains_key(&scene.keys.output(index(node), 0)))
    }
}
