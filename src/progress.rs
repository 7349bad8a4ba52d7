//! Progress bars and progress for programs.
use crate::terminal::{Terminal, escape};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use shibo_engine::eval::{Event, Observer};
use shibo_value::diagnostics::Diagnostic;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Messages while a command works.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ProgressArgs {
    /// Print errors and warnings only.
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// Print progress on stdout, for a program that runs the command.
    #[arg(long, value_name = "FORM")]
    progress: Option<Form>,
}

/// Format of the progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Sessions of `OpenJobDescription`.
    Openjd,
}

/// Shows the progress of a run, and collects its warnings.
pub(crate) struct Progress<'t> {
    terminal: &'t Terminal,
    quiet: bool,
    form: Option<Form>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    nodes: BTreeMap<String, ProgressBar>,
    /// Bar of the whole command.
    all: Option<ProgressBar>,
    warnings: Vec<Diagnostic>,
    /// Time and text of the last line printed.
    told: Option<(Instant, String)>,
}

impl<'t> Progress<'t> {
    /// Progress on `terminal`; no bars if `quiet`.
    pub(crate) fn new(terminal: &'t Terminal, quiet: bool) -> Self {
        Self { terminal, quiet, form: None, state: Mutex::default() }
    }

    /// Progress as set on the command line.
    pub(crate) fn with(terminal: &'t Terminal, args: &ProgressArgs) -> Self {
        Self { form: args.progress, ..Self::new(terminal, args.quiet) }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes the bars and returns the warnings.
    pub(crate) fn finish(&self) -> Vec<Diagnostic> {
        let mut state = self.lock();
        state.nodes.values().chain(&state.all).for_each(ProgressBar::finish_and_clear);
        state.nodes.clear();
        state.all = None;
        std::mem::take(&mut state.warnings)
    }

    fn bar(&self, name: &str, unit: &str) -> ProgressBar {
        let bar = self.terminal.bars().add(ProgressBar::new(0));
        let template = format!("{{prefix:>20!}} {{bar:32}} {{pos}}/{{len}} {unit} {{elapsed}}, {{eta}} left");
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style);
        }
        bar.set_prefix(escape(name));
        // The tick delays the bar, so that very short work shows none.
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// Prints the share done, once a second and at the end: of a node as a status, of the rows as progress.
    fn tell(&self, node: Option<&str>, done: u64, total: u64) {
        let percent = 100.0 * done as f64 / total.max(1) as f64;
        let line = match node {
            Some(node) => format!("openjd_status: {node} {percent:.0} %"),
            None => format!("openjd_progress: {percent:.1}"),
        };
        let last = node.is_none() && done >= total;
        let mut state = self.lock();
        let due = state
            .told
            .as_ref()
            .is_none_or(|(at, before)| *before != line && (last || at.elapsed() >= Duration::from_secs(1)));
        if due {
            state.told = Some((Instant::now(), line.clone()));
            let mut page = self.terminal.page();
            page.push(&line).end();
            // Progress is optional, so a closed stdout is ignored.
            let _ = self.terminal.print(&page);
        }
    }

    fn node(&self, name: String, done: u64, total: u64) {
        let mut state = self.lock();
        if done >= total {
            if let Some(bar) = state.nodes.remove(&name) {
                bar.finish_and_clear();
            }
            return;
        }
        let bar = state.nodes.entry(name).or_insert_with_key(|name| self.bar(name, ""));
        bar.set_length(total);
        bar.set_position(done);
    }

    /// Shows the progress of the whole command, counted in `unit`.
    pub(crate) fn of_all(&self, done: u64, total: u64, unit: &str) {
        if self.form.is_some() {
            return self.tell(None, done, total);
        }
        if self.quiet || self.terminal.bars().is_hidden() {
            return;
        }
        let mut state = self.lock();
        let bar = state.all.get_or_insert_with(|| self.bar("writing", unit));
        bar.set_length(total);
        bar.set_position(done);
    }
}

impl Observer for Progress<'_> {
    fn event(&self, event: Event) {
        match event {
            Event::Warning(warning) => self.lock().warnings.push(warning),
            Event::Node { name, done, total } if self.form.is_some() => self.tell(Some(&name), done, total),
            Event::Rows { done, total } => self.of_all(done, total, "rows"),
            _ if self.quiet || self.terminal.bars().is_hidden() => {}
            Event::Node { name, done, total } => self.node(name, done, total),
            _ => {}
        }
    }
}
