//! Runs work without holding the GIL: other Python threads run, Ctrl-C stops the work, and progress is reported.
use pyo3::prelude::*;
use shibo_engine::eval::{CancelToken, Event, Observer};
use shibo_engine::session::Failure;
use shibo_value::diagnostics::Diagnostic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{self, Thread};
use std::time::Duration;

/// Interval for checking signals and reporting progress.
const TICK: Duration = Duration::from_millis(50);

/// The result of the work, and its warnings.
pub(crate) type Done<T> = (Result<T, Failure>, Vec<Diagnostic>);

/// Progress of a node: its name, the steps done, and all steps.
type Step = (String, u64, u64);

#[derive(Default)]
struct Told {
    warnings: Mutex<Vec<Diagnostic>>,
    step: Mutex<Option<Step>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Observer for Told {
    fn event(&self, event: Event) {
        match event {
            Event::Node { name, done, total } => *lock(&self.step) = Some((name.to_string(), done, total)),
            Event::Warning(warning) => lock(&self.warnings).push(warning),
            _ => {}
        }
    }
}

/// Wakes a thread when dropped, also during a panic.
struct Wake<'a>(&'a AtomicBool, Thread);

impl Drop for Wake<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
        self.1.unpark();
    }
}

/// Runs `work` on another thread, and regularly calls `progress` with the name of a node, its steps done and all its
/// steps. An exception of `progress`, or a signal, cancels the work and is returned.
pub(crate) fn for_result<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&CancelToken, &dyn Observer) -> Result<T, Failure> + Send,
) -> PyResult<Done<T>> {
    let (cancel, told, done) = (CancelToken::default(), Told::default(), AtomicBool::new(false));
    let caller = thread::current();
    let mut stopped = None;
    let result = thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let _wake = Wake(&done, caller);
            work(&cancel, &told)
        });
        while !done.load(Ordering::Acquire) {
            py.detach(|| thread::park_timeout(TICK));
            if stopped.is_none()
                && let Err(error) = py.check_signals().and_then(|()| tell(progress, &told))
            {
                cancel.cancel();
                stopped = Some(error);
            }
        }
        py.detach(|| worker.join())
    });
    if let Some(error) = stopped {
        return Err(error);
    }
    let result = result.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    Ok((result, told.warnings.into_inner().unwrap_or_else(PoisonError::into_inner)))
}

fn tell(progress: Option<&Bound<'_, PyAny>>, told: &Told) -> PyResult<()> {
    let Some(progress) = progress else { return Ok(()) };
    let Some(step) = lock(&told.step).take() else { return Ok(()) };
    progress.call1(step).map(drop)
}
