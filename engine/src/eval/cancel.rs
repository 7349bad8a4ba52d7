//! A way to stop an evaluation from another thread.
use crate::value::Stop;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Shared by the evaluation and by the code that may stop it.
#[derive(Clone, Debug, Default)]
pub struct CancelToken(Arc<State>);

#[derive(Debug, Default)]
struct State {
    cancelled: AtomicBool,
    /// Number of checks so far, for counting tokens.
    asked: Option<AtomicU64>,
    /// The check at which a counting token cancels itself; 0 for never.
    last: u64,
}

impl CancelToken {
    /// A token that counts its checks and cancels itself at check number `last`; never if `last` is 0. A test can thus
    /// stop work at the same place every time, however fast the machine is.
    pub fn counting(last: u64) -> Self {
        Self(Arc::new(State { asked: Some(AtomicU64::new(0)), last, ..State::default() }))
    }

    /// Number of checks so far; 0 for a token that does not count.
    pub fn asked(&self) -> u64 {
        self.0.asked.as_ref().map_or(0, |asked| asked.load(Ordering::Relaxed))
    }

    /// Requests a stop. Running work ends within about a millisecond.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// Returns true if the work was cancelled.
    pub fn is_cancelled(&self) -> bool {
        if let Some(asked) = &self.0.asked
            && asked.fetch_add(1, Ordering::Relaxed) + 1 == self.0.last
        {
            self.cancel();
        }
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// Fails if the work was cancelled.
    ///
    /// # Errors
    /// [`Stop::Cancelled`].
    pub fn check(&self) -> Result<(), Stop> {
        if self.is_cancelled() { Err(Stop::Cancelled) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancels_counting_token_at_its_check() {
        let token = CancelToken::counting(3);
        let asked: Vec<bool> = (0..4).map(|_| token.is_cancelled()).collect();
        assert_eq!((asked, token.asked()), (vec![false, false, true, true], 4));
        let free = CancelToken::counting(0);
        assert!((0..9).all(|_| free.check().is_ok()) && free.asked() == 9);
        let plain = CancelToken::default();
        assert!(plain.check().is_ok() && plain.asked() == 0);
    }
}
