//! The progress of a fit on a terminal.
use super::FitArgs;
use crate::report::count;
use crate::terminal::{Terminal, escape};
use indicatif::{ProgressBar, ProgressStyle};
use shibo_fit::Status;
use shibo_fit::graph::{Fitting, Photo};
use shibo_value::clock::Stopwatch;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Shows finished renders, the best distance so far, and an estimate of the time left.
pub(super) struct Progress<'p> {
    args: &'p FitArgs,
    terminal: &'p Terminal,
    clock: Stopwatch,
    bar: Option<ProgressBar>,
    /// When the last line was printed.
    told: Mutex<Duration>,
}

impl<'p> Progress<'p> {
    pub(super) fn new(args: &'p FitArgs, terminal: &'p Terminal) -> Self {
        let bar = (!args.quiet && !terminal.bars().is_hidden()).then(|| {
            let bar = terminal.bars().add(ProgressBar::new_spinner());
            if let Ok(style) = ProgressStyle::with_template(" {msg}") {
                bar.set_style(style);
            }
            bar
        });
        Self { args, terminal, clock: Stopwatch::wall(), bar, told: Mutex::default() }
    }

    /// Prints a line about the photograph and the unknowns.
    pub(super) fn announce(&self, fitting: &Fitting<'_>, photo: &Photo) {
        if self.args.quiet {
            return;
        }
        let [width, height] = photo.size();
        let size = match photo.width_mm() {
            Some(mm) => format!("{mm:.0} mm"),
            None => "of unknown size".to_owned(),
        };
        let (side, name, output) = (fitting.side(), photo.name(), fitting.output());
        let parameters = count(fitting.parameters() as u64, "parameter");
        self.terminal.say(&format!(
            "{name}: {width} × {height} px, {size}; fitted at {side} × {side} against `{output}`, {parameters}"
        ));
        if self.args.seconds.is_some() {
            self.terminal.say("with --seconds the result depends on the speed of the machine; --renders does not");
        }
    }

    pub(super) fn finish(&self) {
        self.bar.iter().for_each(ProgressBar::finish_and_clear);
    }

    pub(super) fn tell(&self, done: usize, status: &Status) {
        if self.args.quiet {
            return;
        }
        let elapsed = self.clock.elapsed().as_secs_f64();
        let left = elapsed / done.max(1) as f64 * status.planned.saturating_sub(done) as f64;
        let left = self.args.seconds.map_or(left, |most| left.min((most - elapsed).max(0.0)));
        let distance = match (status.best.as_ref().map(|best| best.distance), status.floor) {
            (Some(best), Some(floor)) if floor > 0.0 => format!(" · {:.1} × floor", best / floor),
            (Some(best), _) => format!(" · distance {best:.2}"),
            _ => String::new(),
        };
        let planned = status.planned;
        self.show(&format!(
            "{done} of {planned} renders{distance} · about {left:.0} s left · Ctrl-C keeps the best so far"
        ));
    }

    /// Shows a line: in place of the last one, or once a second where the terminal cannot do that.
    pub(super) fn show(&self, line: &str) {
        if self.args.quiet {
            return;
        }
        if let Some(bar) = &self.bar {
            bar.set_message(escape(line));
            return;
        }
        let elapsed = self.clock.elapsed();
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if elapsed.saturating_sub(*told) >= Duration::from_secs(1) {
            *told = elapsed;
            self.terminal.say(&format!(" {line}"));
        }
    }
}
