//! The evaluation thread: makes the outputs of the newest graph, first as coarse and then as sharp pictures.
use super::status_reporter::StatusReporter;
use crate::report;
use crate::serve::{Forecast, Stage};
use shibo_bridge::scene::{COARSE, PictureInfo, Preview, Scene, Target, WHOLE};
use shibo_engine::eval::{CancelToken, Event, NodeState, NodeStats, Observer};
use shibo_engine::session::{Failure, Look};
use shibo_graph::Graph;
use shibo_picture::contained;
use shibo_value::diagnostics::{Code, Diagnostic, SourceMap, Span};
use shibo_value::{Channel, Type, Value};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which the disk cache is trimmed to its maximum size during evaluations.
const TRIM: Duration = Duration::from_secs(20);
/// Delay before progress of some work is reported, and the time between two reports.
const PROGRESS: Duration = Duration::from_millis(200);

/// A graph to evaluate.
pub(super) struct Job {
    /// Number of the graph.
    pub(super) generation: u64,
    /// Hash of the graph file.
    pub(super) sha256: String,
    /// The graph.
    pub(super) graph: Graph,
    /// Description of the change.
    pub(super) cause: String,
    /// Time at which the change was noticed.
    pub(super) since: Instant,
}

#[derive(Default)]
struct Slot {
    next: Option<(Job, CancelToken)>,
    running: Option<CancelToken>,
    closed: bool,
}

/// Holds the next job; a newer one replaces it.
#[derive(Default)]
pub(super) struct LatestJob {
    slot: Mutex<Slot>,
    changed: Condvar,
}

impl LatestJob {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a job; the running job is cancelled, and a waiting one is dropped.
    pub(super) fn put(&self, job: Job, stage: &Stage) {
        let mut slot = self.lock();
        if let Some(running) = &slot.running {
            running.cancel();
        }
        slot.next = Some((job, CancelToken::default()));
        drop(slot);
        self.changed.notify_all();
        if let Some(scene) = stage.scene() {
            scene.cancel_views();
        }
    }

    /// Cancels the running job, and drops a waiting one.
    pub(super) fn stop(&self) {
        let mut slot = self.lock();
        slot.next = None;
        if let Some(running) = &slot.running {
            running.cancel();
        }
    }

    /// Closes: no more jobs follow.
    pub(super) fn close(&self) {
        let mut slot = self.lock();
        slot.closed = true;
        if let Some(running) = &slot.running {
            running.cancel();
        }
        drop(slot);
        self.changed.notify_all();
    }

    fn take(&self) -> Option<(Job, CancelToken)> {
        let mut slot = self.lock();
        slot.running = None;
        loop {
            if slot.closed {
                return None;
            }
            if let Some((job, token)) = slot.next.take() {
                slot.running = Some(token.clone());
                return Some((job, token));
            }
            slot = self.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// Evaluates jobs until `desk` is closed.
pub(super) fn evaluate(desk: &LatestJob, stage: &Arc<Stage>, teller: &StatusReporter<'_>) {
    let mut trimmed = Instant::now();
    while let Some((job, cancel)) = desk.take() {
        stage.set_busy(true);
        let of = Of::new(&job);
        let evaluation =
            Evaluation { stage, teller, since: job.since, first: Mutex::default(), pictures: Mutex::default() };
        if let Err(said) = contained(|| evaluation.run(job, &of, &cancel)) {
            // A panic fails only this graph.
            let error =
                Diagnostic::new(Code::BadValue, of.span, format!("this cannot be shown, because of a defect: {said}"));
            evaluation.failed(Failure::Errors(vec![error.help("please report it with the graph")]), &of);
        }
        stage.set_busy(false);
        if trimmed.elapsed() > TRIM {
            trimmed = Instant::now();
            let stage = stage.clone();
            // Trimming a large folder is slow and runs in the background.
            std::thread::spawn(move || stage.session.trim());
        }
    }
}

/// The graph of a report.
struct Of {
    generation: u64,
    sha256: String,
    span: Span,
    sources: SourceMap,
}

impl Of {
    fn new(job: &Job) -> Self {
        let Job { generation, sha256, graph, .. } = job;
        let (sha256, sources) = (sha256.clone(), graph.sources.clone());
        Self { generation: *generation, sha256, span: graph.canvas_span, sources }
    }
}

struct Evaluation<'a> {
    stage: &'a Stage,
    teller: &'a StatusReporter<'a>,
    since: Instant,
    /// Time at which the first, coarse pictures were shown.
    first: Mutex<Option<Duration>>,
    /// Pixels of the pictures that are made, and of all pictures.
    pictures: Mutex<(f64, f64)>,
}

/// Collects warnings and the progress of nodes.
struct Watching<'a> {
    forecast: &'a Forecast,
    warnings: Mutex<Vec<Diagnostic>>,
}

impl Observer for Watching<'_> {
    fn event(&self, event: Event) {
        match event {
            Event::Node { name, done, total } => self.forecast.step(&name, done, total),
            Event::Warning(warning) => {
                self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(warning);
            }
            _ => {}
        }
    }
}

impl Evaluation<'_> {
    fn run(&self, job: Job, of: &Of, cancel: &CancelToken) {
        let keys = match self.stage.session.keys(&job.graph) {
            Ok(keys) => keys,
            Err(failure) => return self.failed(failure, of),
        };
        let scene = Arc::new(Scene::new(job.generation, job.sha256, job.graph, keys));
        let forecast = self.stage.forecast(&scene);
        let observer = Watching { forecast: &forecast, warnings: Mutex::default() };
        let result = self.stage.session.look(&scene.graph, &scene.keys, cancel, &observer, |look| {
            self.reported(look, &forecast, || self.outputs(look, &scene))?;
            Ok(look.stats())
        });
        let warnings = observer.warnings.into_inner().unwrap_or_else(PoisonError::into_inner);
        match result {
            Ok(stats) => self.finished(&scene, stats, &warnings, &job.cause),
            Err(failure) => self.failed(failure, of),
        }
    }

    /// Runs `work`, and reports its progress meanwhile.
    fn reported<T>(&self, look: &Look<'_>, forecast: &Forecast, work: impl FnOnce() -> T) -> T {
        let (over, ended) = channel::<()>();
        std::thread::scope(|scope| {
            scope.spawn(move || {
                while ended.recv_timeout(PROGRESS) == Err(RecvTimeoutError::Timeout) {
                    self.stage.progress(&forecast.report(&look.stats(), self.share()));
                }
            });
            // The thread ends when the sender is dropped, also after a panic.
            let _over = over;
            work()
        })
    }

    /// The share of pictures that are made, by their pixels.
    fn share(&self) -> f64 {
        let (made, all) = *self.pictures.lock().unwrap_or_else(PoisonError::into_inner);
        made / all.max(1.0)
    }

    /// Shows all outputs, coarse and then sharp; the target shown last comes first.
    fn outputs(&self, look: &Look<'_>, scene: &Arc<Scene>) -> Result<(), Failure> {
        let mut names: Vec<&str> = scene.graph.outputs.iter().map(|output| output.name.as_str()).collect();
        let focus = self.stage.focus();
        let focused = focus.as_deref().and_then(|name| scene.target(name));
        let is_focus = |name: &&str| {
            let target = scene.target(name);
            focused.as_ref().zip(target).is_some_and(|(f, t)| (f.node, f.output) == (t.node, t.output))
        };
        names.sort_by_key(|name| !is_focus(name));
        let mut adopted = false;
        let pixels = |longest| scene.size(longest).as_dvec2().element_product();
        let sizes = if scene.size(WHOLE) == scene.size(COARSE) { &[COARSE][..] } else { &[COARSE, WHOLE] };
        let all = sizes.iter().map(|longest| pixels(*longest)).sum::<f64>() * names.len() as f64;
        *self.pictures.lock().unwrap_or_else(PoisonError::into_inner) = (0.0, all);
        for &longest in sizes {
            for name in &names {
                for target in self.targets(look, scene, name)? {
                    self.picture(look, scene, name, &target, longest, &mut adopted)?;
                }
                self.pictures.lock().unwrap_or_else(PoisonError::into_inner).0 += pixels(longest);
            }
            self.first.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| self.since.elapsed());
        }
        if !adopted {
            self.stage.adopt(scene);
        }
        Ok(())
    }

    /// Targets shown for an output: itself, or the channels of a material.
    fn targets(&self, look: &Look<'_>, scene: &Scene, name: &str) -> Result<Vec<Target>, Failure> {
        let Some(whole) = scene.target(name) else { return Ok(Vec::new()) };
        let ty = scene.graph.outputs.iter().find(|o| o.name == *name).map(|o| o.ty);
        if ty != Some(Type::Material) {
            return Ok(vec![whole]);
        }
        let Some(Value::Material(material)) = look.value(whole.node, whole.output)? else { return Ok(Vec::new()) };
        let channel = |channel: &Channel| scene.target(&format!("{name}.{}", channel.name()));
        Ok(material.channels().iter().filter_map(|(c, _)| channel(c)).collect())
    }

    fn picture(
        &self,
        look: &Look<'_>,
        scene: &Arc<Scene>,
        output: &str,
        target: &Target,
        longest: u32,
        adopted: &mut bool,
    ) -> Result<(), Failure> {
        let is_sharp = |shown: &PictureInfo| shown.is_final;
        if scene.shown.lock().unwrap_or_else(PoisonError::into_inner).get(&target.name).is_some_and(is_sharp) {
            return Ok(());
        }
        let Some(Preview::Field(field, manner)) = scene.sight(look, target)? else { return Ok(()) };
        // An unchanged picture is already in the store, at full size.
        let stored = match scene.known(&self.stage.store, target, &field, scene.size(WHOLE)) {
            Some(sharp) => sharp,
            None => scene.picture(look, &self.stage.store, target, (&field, manner), scene.size(longest))?,
        };
        let shown = scene.shown(target, manner.unit, stored);
        let first = !*adopted;
        if first {
            scene.begin(&shown);
            self.stage.adopt(scene);
            *adopted = true;
        }
        self.stage.show(scene, output, &shown);
        self.tell(scene, output, target, &shown);
        Ok(())
    }

    /// Reports a material once, with its first channel.
    fn tell(&self, scene: &Scene, output: &str, target: &Target, shown: &PictureInfo) {
        let whole = scene.target(output);
        if target.name != output && self.is_first_channel(scene, whole.as_ref(), target) {
            self.teller.shown(&scene.sha256, output, shown);
        }
        self.teller.shown(&scene.sha256, &target.name, shown);
    }

    fn is_first_channel(&self, scene: &Scene, whole: Option<&Target>, target: &Target) -> bool {
        let Some(whole) = whole else { return false };
        let shown = scene.shown.lock().unwrap_or_else(PoisonError::into_inner);
        let channels = Channel::ALL.iter().map(|c| format!("{}.{}", whole.name, c.name()));
        channels.into_iter().find(|name| shown.contains_key(name)).as_deref() == Some(&target.name)
    }

    fn finished(&self, scene: &Scene, stats: Vec<NodeStats>, warnings: &[Diagnostic], cause: &str) {
        let all = self.since.elapsed();
        let first = self.first.lock().unwrap_or_else(PoisonError::into_inner).unwrap_or(all);
        let ran: Vec<&str> = stats.iter().filter(|s| s.state == NodeState::Computed).map(|s| s.name.as_str()).collect();
        self.teller.done(cause, &ran, stats.len(), first, all);
        if !warnings.is_empty() {
            report::show(self.teller.terminal, warnings, &scene.graph.sources);
            self.stage.advise(warnings, &scene.graph.sources);
        }
        self.stage.done(scene, stats, first.as_secs_f64() * 1000.0, all.as_secs_f64() * 1000.0);
    }

    fn failed(&self, failure: Failure, of: &Of) {
        let errors = match failure {
            Failure::Cancelled => return,
            Failure::Errors(errors) => errors,
            Failure::File(message) | Failure::Usage(message) => {
                vec![Diagnostic::new(Code::BadFile, of.span, message)]
            }
        };
        self.stage.fail(of.generation, &errors, &of.sources);
        self.teller.errors(Some(&of.sha256), &errors, &of.sources);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::serve::defective;
    use crate::terminal::Terminal;

    fn job(generation: u64, bad: bool) -> Job {
        let (graph, sha256) = (defective::graph(bad), format!("{generation}"));
        Job { generation, sha256, graph, cause: "saved".into(), since: Instant::now() }
    }

    /// Waits until a condition holds; returns false on timeout.
    fn soon(holds: impl Fn() -> bool) -> bool {
        let end = Instant::now() + Duration::from_secs(30);
        while !holds() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(5));
        }
        holds()
    }

    #[test]
    fn shows_save_after_panic() {
        let (stage, desk, terminal) = (defective::stage(), LatestJob::default(), Terminal::new());
        let teller = StatusReporter { terminal: &terminal, log: false };
        let (told, shown) = std::thread::scope(|scope| {
            scope.spawn(|| evaluate(&desk, &stage, &teller));
            desk.put(job(1, true), &stage);
            let told = soon(|| !stage.errors().is_empty()).then(|| stage.errors());
            desk.put(job(2, false), &stage);
            let shown = soon(|| stage.scene().is_some_and(|scene| scene.generation == 2) && stage.errors().is_empty());
            desk.close();
            (told, shown)
        });
        let told = told.expect("the panic is told");
        assert!(told.len() == 1 && told[0].to_string().contains("the test panics"), "{told:?}");
        assert!(shown, "the next save is shown");
    }
}
