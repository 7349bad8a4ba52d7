//! Cancellation of long work.
//!
//! Kernels call an [`Until`] about every millisecond. Once it returns true, they return early with an incomplete
//! result, which the caller must drop. Work inside a library that cannot call it is left by unwinding, see
//! [`unwind_when`].

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Returns true if the work should stop.
pub type Until<'a> = &'a (dyn Fn() -> bool + Sync);

/// Never stops.
pub const NEVER: Until<'static> = &|| false;

/// Number of calls between two checks: less than a millisecond of a triangulation.
const CALLS: u32 = 1 << 13;

/// The payload of the unwinding.
struct Stopped;

/// Checks for cancellation in callbacks of a library, or in loops over many small items.
pub struct Watch<'a> {
    until: Until<'a>,
    calls: Cell<u32>,
}

impl Watch<'_> {
    /// A watch that never stops.
    pub fn never() -> Self {
        Self { until: NEVER, calls: Cell::new(0) }
    }

    /// The same items, with a [`tick`](Self::tick) before each.
    pub fn over<I: IntoIterator>(&self, items: I) -> impl Iterator<Item = I::Item> {
        items.into_iter().inspect(|_| self.tick())
    }

    /// Checks immediately, for code that decides itself how often to check. Does not return if the work should stop.
    pub fn check(&self) {
        if (self.until)() {
            resume_unwind(Box::new(Stopped));
        }
    }

    /// Checks once every few thousand calls; for callbacks. Does not return if the work should stop.
    pub fn tick(&self) {
        let calls = self.calls.get().wrapping_add(1);
        self.calls.set(calls);
        if calls.is_multiple_of(CALLS) && (self.until)() {
            // Not a panic: no message is printed and no hook runs.
            resume_unwind(Box::new(Stopped));
        }
    }
}

/// The result of `work`, or `None` if it was stopped because `until` was true. Data that `work` changes must not be
/// used in that case.
pub fn unwind_when<T>(until: Until<'_>, work: impl FnOnce(&Watch<'_>) -> T) -> Option<T> {
    let watch = Watch { until, calls: Cell::new(0) };
    match catch_unwind(AssertUnwindSafe(|| work(&watch))) {
        Ok(result) => Some(result),
        Err(payload) if payload.is::<Stopped>() => None,
        Err(payload) => resume_unwind(payload),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_endless_work() {
        let endless = |watch: &Watch<'_>| {
            let mut list: Vec<u32> = (0..100_000).rev().collect();
            loop {
                list.sort_unstable_by(|a, b| {
                    watch.tick();
                    a.cmp(b)
                });
                list.reverse();
            }
        };
        let calls = std::sync::atomic::AtomicU32::new(0);
        let until = || calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 40;
        assert_eq!(unwind_when::<u32>(&until, endless), None);
        assert_eq!(unwind_when(NEVER, |watch| watch.tick()), Some(()));
    }
}
