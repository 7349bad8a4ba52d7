//! A prepared fit: it renders the graph at values that the search asks for, on several threads.
use super::drawn::drawn;
use super::photo::Photo;
use super::setup::Setup;
use super::{Bench, Fitted, Refused, Request};
use crate::turns::finish;
use crate::{Ask, Outcome, Problem, Renders, Status, fit_in_turns};
use shibo_bridge::GraphText;
use shibo_engine::session::Failure;
use shibo_graph::{Graph, load_text};
use shibo_picture::Picture;
use shibo_value::Resolution;
use shibo_value::clock::Stopwatch;
use shibo_value::diagnostics::SourceMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Called after each render, by any thread: with the number of finished renders, and the state at the begin of their batch.
pub type Watch<'w> = &'w (dyn Fn(usize, &Status) + Sync);

/// The name of a preset, or `None` for the graph as it is, and the distance of its values from the photograph. The distance is `None` if
/// the graph refuses the values.
pub type StartDistance<'n> = (Option<&'n str>, Option<f64>);

/// A graph and a photograph, ready to be fitted.
pub struct Fitting<'f> {
    pub(super) bench: Bench<'f>,
    pub(super) request: &'f Request,
    pub(super) photo: &'f Photo,
    pub(super) setup: Setup,
    /// Processor time and time since the fit was prepared.
    clocks: (Stopwatch, Stopwatch),
}

impl<'f> Fitting<'f> {
    /// Prepares a fit of the graph in `file`, which was loaded as `graph`.
    ///
    /// # Errors
    ///
    /// Fails if the request does not suit the graph, and if the graph cannot be rendered as it is.
    pub fn of(
        bench: Bench<'f>,
        file: &GraphText,
        graph: &Graph,
        photo: &'f Photo,
        request: &'f Request,
    ) -> Result<Self, Refused> {
        let clocks = (Stopwatch::process(), Stopwatch::wall());
        let setup = Setup::of(bench, (graph, file), photo, request)?;
        let fitting = Self { bench, request, photo, setup, clocks };
        // A graph that fails as it is fails as in `render`.
        if let Some(ask) = fitting.start(0) {
            match fitting.picture(&ask) {
                Ok(_) | Err((Failure::Cancelled, _)) => {}
                Err((failure, sources)) => return Err(Refused::Graph(failure, sources)),
            }
        }
        Ok(fitting)
    }

    /// Faults of the photograph that spoil a fit, each with a remedy.
    pub fn warnings(&self) -> Vec<String> {
        self.photo.warnings(&self.setup.gauge, self.setup.stretched)
    }

    /// The photograph.
    pub fn photo(&self) -> &Photo {
        self.photo
    }

    /// The output that is compared.
    pub fn output(&self) -> &str {
        &self.setup.output
    }

    /// Pixels of a side that are compared.
    pub fn side(&self) -> u32 {
        self.setup.side()
    }

    /// The number of parameters that are fitted.
    pub fn parameters(&self) -> usize {
        self.setup.written.len()
    }

    /// True if numbers from the smallest to the largest are shown as black to white.
    pub fn is_stretched(&self) -> bool {
        self.setup.stretched
    }

    /// Searches for the values. After a cancellation the best values so far are the result.
    ///
    /// # Errors
    ///
    /// Fails if there is no result: all values were refused, or the fit was cancelled before the first render.
    pub fn run(&self, watch: Watch<'_>) -> Result<Fitted<'_>, Refused> {
        finish(self.searched(Watched { fitting: self, watch, at_once: usize::MAX }))
    }

    /// Like [`run`](Self::run), on one thread. The future gives its caller a turn after each picture: see
    /// [`fit_in_turns`](crate::fit_in_turns).
    ///
    /// # Errors
    ///
    /// Fails as [`run`](Self::run) does.
    pub async fn run_in_turns(&self, watch: Watch<'_>) -> Result<Fitted<'_>, Refused> {
        self.searched(Watched { fitting: self, watch, at_once: 1 }).await
    }

    async fn searched(&self, renders: Watched<'_>) -> Result<Fitted<'_>, Refused> {
        let problem = Problem {
            unknowns: self.setup.unknowns.clone(),
            starts: self.setup.starts.clone(),
            target: self.target(),
            scale: self.setup.gauge.scale().clone(),
            renders: self.request.renders.map(|count| count as usize),
            seed: self.request.seed,
        };
        let fit = fit_in_turns(&problem, &renders).await?;
        Ok(Fitted { fitting: self, fit, cpu: self.clocks.0.elapsed().as_secs_f64() })
    }

    /// The values to begin with, each with its distance from the photograph.
    ///
    /// # Errors
    ///
    /// Fails if it is cancelled.
    pub fn starts(&self, watch: Watch<'_>) -> Result<Vec<StartDistance<'_>>, Refused> {
        let asks: Vec<Ask> = (0..self.setup.starts.len()).filter_map(|at| self.start(at)).collect();
        let target = self.target();
        let distance = |outcome: Outcome| match outcome {
            Outcome::Made(numbers) => Ok(Some(self.setup.gauge.scale().distance(&numbers, &target).0)),
            Outcome::Refused => Ok(None),
            Outcome::Cancelled => Err(Refused::Cancelled),
        };
        let outcomes = Watched { fitting: self, watch, at_once: usize::MAX }.render(&asks, &Status::default());
        let names = std::iter::once(None).chain(self.setup.presets.iter().map(|name| Some(name.as_str())));
        names.zip(outcomes).map(|(name, outcome)| Ok((name, distance(outcome)?))).collect()
    }

    fn target(&self) -> Vec<f64> {
        self.setup.gauge.numbers(&self.photo.picture, self.setup.stretched)
    }

    /// The values of a start, at a seed.
    fn start(&self, at: usize) -> Option<Ask> {
        let start = self.setup.starts.get(at)?;
        Some(Ask { amounts: start.amounts.clone(), combination: start.combination, seed: 1 })
    }

    /// The graph as it is, at a seed; `None` if it is refused.
    pub fn picture_of_start(&self, seed: u32) -> Option<Picture> {
        self.picture(&Ask { seed, ..self.start(0)? }).ok()
    }

    /// The picture at some values, at twice the pixels of the gauge.
    pub(super) fn picture(&self, ask: &Ask) -> Result<Picture, (Failure, SourceMap)> {
        let options = self.setup.options(ask, Resolution::Longer(2 * self.setup.side()));
        let session = self.bench.session;
        let loaded = load_text(&self.setup.path, &self.setup.text, session.registry(), &options);
        let Some(graph) = loaded.graph else { return Err((Failure::Errors(loaded.diagnostics), loaded.sources)) };
        let made = drawn(session, &graph, &self.setup.output, self.bench.cancel);
        made.map_err(|failure| (failure, loaded.sources))
    }

    fn outcome(&self, ask: &Ask) -> Outcome {
        if self.bench.cancel.is_cancelled() {
            return Outcome::Cancelled;
        }
        match self.picture(ask) {
            Ok(picture) => Outcome::Made(self.setup.gauge.numbers(&picture, self.setup.stretched)),
            Err((Failure::Cancelled, _)) => Outcome::Cancelled,
            Err(_) => Outcome::Refused,
        }
    }
}

impl Fitted<'_> {
    /// The picture of the found values at a seed; `None` if it is refused.
    pub fn picture(&self, seed: u32) -> Option<Picture> {
        let amounts = self.fit.found.iter().map(|found| found.amount).collect();
        self.fitting.picture(&Ask { amounts, combination: self.fit.combination, seed }).ok()
    }
}

/// A fit whose progress is watched.
struct Watched<'w> {
    fitting: &'w Fitting<'w>,
    watch: Watch<'w>,
    /// The most pictures of a call.
    at_once: usize,
}

impl Renders for Watched<'_> {
    fn render(&self, asks: &[Ask], status: &Status) -> Vec<Outcome> {
        let outcomes: Vec<Mutex<Option<Outcome>>> = asks.iter().map(|_| Mutex::new(None)).collect();
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || {
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(ask) = asks.get(at) else { break };
                let outcome = self.fitting.outcome(ask);
                *outcomes[at].lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
                (self.watch)(status.done + done.fetch_add(1, Ordering::Relaxed) + 1, status);
            }
        };
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if self.fitting.request.threads == 0 { cores } else { self.fitting.request.threads };
        std::thread::scope(|scope| {
            for _ in 1..threads.min(asks.len()) {
                scope.spawn(work);
            }
            work();
        });
        let taken = |outcome: Mutex<Option<Outcome>>| outcome.into_inner().unwrap_or_else(PoisonError::into_inner);
        outcomes.into_iter().map(|outcome| taken(outcome).unwrap_or(Outcome::Cancelled)).collect()
    }

    fn at_once(&self) -> usize {
        self.at_once
    }

    fn is_late(&self) -> bool {
        self.fitting.request.seconds.is_some_and(|most| self.fitting.clocks.1.elapsed().as_secs_f64() > most)
    }
}
