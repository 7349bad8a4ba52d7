//! Renders the graph at values that the fit asks for, on several threads, and shows the progress.
use super::FitArgs;
use super::drawn::drawn;
use super::photo::Photo;
use super::setup::Setup;
use crate::report::count;
use crate::terminal::{Terminal, escape};
use indicatif::{ProgressBar, ProgressStyle};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Session};
use shibo_fit::{Ask, Outcome, Renders, Status};
use shibo_graph::load_text;
use shibo_picture::Picture;
use shibo_value::Resolution;
use shibo_value::clock::Stopwatch;
use shibo_value::diagnostics::SourceMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Renders and measures.
pub(super) struct Evaluator<'e> {
    args: &'e FitArgs,
    pub(super) session: &'e Session,
    setup: &'e Setup,
    cancel: &'e CancelToken,
    terminal: &'e Terminal,
    clock: Stopwatch,
    threads: usize,
    bar: Option<ProgressBar>,
    /// When the last line of progress was printed.
    told: Mutex<Duration>,
}

impl<'e> Evaluator<'e> {
    pub(super) fn new(
        args: &'e FitArgs,
        session: &'e Session,
        setup: &'e Setup,
        cancel: &'e CancelToken,
        terminal: &'e Terminal,
        clock: Stopwatch,
    ) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if args.threads == 0 { cores } else { usize::from(args.threads) };
        let bar = (!args.quiet && !terminal.bars().is_hidden()).then(|| {
            let bar = terminal.bars().add(ProgressBar::new_spinner());
            if let Ok(style) = ProgressStyle::with_template(" {msg}") {
                bar.set_style(style);
            }
            bar
        });
        Self { args, session, setup, cancel, terminal, clock, threads, bar, told: Mutex::default() }
    }

    /// Prints a line about the photograph and the unknowns.
    pub(super) fn announce(&self, photo: &Photo) {
        if self.args.quiet {
            return;
        }
        let [width, height] = photo.size;
        let size = match photo.width_mm {
            Some(mm) => format!("{mm:.0} mm"),
            None => "of unknown size".to_owned(),
        };
        let side = self.setup.gauge.side();
        let parameters = count(self.setup.written.len() as u64, "parameter");
        self.terminal.say(&format!(
            "{}: {width} × {height} px, {size}; fitted at {side} × {side} against `{}`, {parameters}",
            photo.name, self.setup.output
        ));
        if self.args.seconds.is_some() {
            self.terminal.say("with --seconds the result depends on the speed of the machine; --renders does not");
        }
    }

    pub(super) fn finish(&self) {
        self.bar.iter().for_each(ProgressBar::finish_and_clear);
    }

    /// Renders the first start, to show errors of the graph as they are.
    pub(super) fn try_start(&self) -> Result<(), (Failure, SourceMap)> {
        let Some(start) = self.setup.starts.first() else { return Ok(()) };
        let ask = Ask { amounts: start.amounts.clone(), combination: start.combination, seed: 1 };
        match self.picture(&ask) {
            Err((Failure::Cancelled, _)) | Ok(_) => Ok(()),
            Err(failed) => Err(failed),
        }
    }

    /// The picture at some values, at twice the pixels of the gauge.
    pub(super) fn picture(&self, ask: &Ask) -> Result<Picture, (Failure, SourceMap)> {
        let options = self.setup.options(ask, Resolution::Longer(2 * self.setup.side()));
        let loaded = load_text(&self.setup.path, &self.setup.text, self.session.registry(), &options);
        let Some(graph) = loaded.graph else { return Err((Failure::Errors(loaded.diagnostics), loaded.sources)) };
        let made = drawn(self.session, &graph, &self.setup.output, self.cancel);
        made.map_err(|failure| (failure, loaded.sources))
    }

    fn outcome(&self, ask: &Ask) -> Outcome {
        if self.cancel.is_cancelled() {
            return Outcome::Cancelled;
        }
        match self.picture(ask) {
            Ok(picture) => Outcome::Made(self.setup.gauge.numbers(&picture, self.setup.stretched)),
            Err((Failure::Cancelled, _)) => Outcome::Cancelled,
            Err(_) => Outcome::Refused,
        }
    }

    fn tell(&self, done: usize, status: &Status) {
        if self.args.quiet {
            return;
        }
        let elapsed = self.clock.elapsed();
        let left = elapsed.as_secs_f64() / done.max(1) as f64 * status.planned.saturating_sub(done) as f64;
        let left = self.args.seconds.map_or(left, |most| left.min((most - elapsed.as_secs_f64()).max(0.0)));
        let distance = match (status.best, status.floor) {
            (Some(best), Some(floor)) if floor > 0.0 => format!(" · {:.1} × floor", best / floor),
            (Some(best), _) => format!(" · distance {best:.2}"),
            _ => String::new(),
        };
        let line = format!(
            "{done} of {} renders{distance} · about {left:.0} s left · Ctrl-C keeps the best so far",
            status.planned
        );
        if let Some(bar) = &self.bar {
            bar.set_message(escape(&line));
            return;
        }
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if elapsed.saturating_sub(*told) >= Duration::from_secs(1) {
            *told = elapsed;
            self.terminal.say(&format!(" {line}"));
        }
    }
}

impl Renders for Evaluator<'_> {
    fn render(&self, asks: &[Ask], status: &Status) -> Vec<Outcome> {
        let outcomes: Vec<Mutex<Option<Outcome>>> = asks.iter().map(|_| Mutex::new(None)).collect();
        let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || {
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(ask) = asks.get(at) else { break };
                let outcome = self.outcome(ask);
                *outcomes[at].lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
                self.tell(status.done + done.fetch_add(1, Ordering::Relaxed) + 1, status);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..self.threads.min(asks.len()) {
                scope.spawn(work);
            }
            work();
        });
        let taken = |outcome: Mutex<Option<Outcome>>| outcome.into_inner().unwrap_or_else(PoisonError::into_inner);
        outcomes.into_iter().map(|outcome| taken(outcome).unwrap_or(Outcome::Cancelled)).collect()
    }

    fn is_late(&self) -> bool {
        self.args.seconds.is_some_and(|most| self.clock.elapsed().as_secs_f64() > most)
    }
}
