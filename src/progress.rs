//! Progress bars.
use crate::terminal::{Terminal, escape};
use indicatif::{ProgressBar, ProgressStyle};
use shibo_engine::diagnostics::Diagnostic;
use shibo_engine::eval::{Event, Observer};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Shows how far a run has come, and keeps its warnings.
pub(crate) struct Progress<'t> {
    terminal: &'t Terminal,
    quiet: bool,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    nodes: BTreeMap<String, ProgressBar>,
    rows: Option<ProgressBar>,
    warnings: Vec<Diagnostic>,
}

impl<'t> Progress<'t> {
    /// Progress on `terminal`; no bars if `quiet`.
    pub(crate) fn new(terminal: &'t Terminal, quiet: bool) -> Self {
        Self { terminal, quiet, state: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes the bars and gives the warnings.
    pub(crate) fn finish(&self) -> Vec<Diagnostic> {
        let mut state = self.lock();
        state.nodes.values().chain(&state.rows).for_each(ProgressBar::finish_and_clear);
        state.nodes.clear();
        state.rows = None;
        std::mem::take(&mut state.warnings)
    }

    fn bar(&self, name: &str, unit: &str) -> ProgressBar {
        let bar = self.terminal.bars().add(ProgressBar::new(0));
        let template = format!("{{prefix:>20!}} {{bar:32}} {{pos}}/{{len}} {unit} {{elapsed}}");
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style);
        }
        bar.set_prefix(escape(name));
        // Work that is over at once gets no bar.
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
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

    fn rows(&self, done: u64, total: u64) {
        let mut state = self.lock();
        let bar = state.rows.get_or_insert_with(|| self.bar("writing", "rows"));
        bar.set_length(total);
        bar.set_position(done);
    }
}

impl Observer for Progress<'_> {
    fn event(&self, event: Event) {
        match event {
            Event::Warning(warning) => self.lock().warnings.push(warning),
            _ if self.quiet || self.terminal.bars().is_hidden() => {}
            Event::Node { name, done, total } => self.node(name, done, total),
            Event::Rows { done, total } => self.rows(done, total),
            _ => {}
        }
    }
}
