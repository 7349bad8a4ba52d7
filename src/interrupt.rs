//! Handles Ctrl-C and SIGTERM: the first signal ends the run cleanly, a second one at once.
use shibo_engine::eval::CancelToken;

/// Lets signals cancel `token`. If that is not possible, the run continues and can only be killed.
///
/// SIGHUP is left alone, so that `nohup` works.
#[cfg(unix)]
pub(crate) fn cancel_on_signals(token: &CancelToken) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    let token = token.clone();
    std::thread::spawn(move || {
        for _ in signals.forever() {
            if token.is_cancelled() {
                // The next run removes the files left behind.
                std::process::exit(1);
            }
            token.cancel();
        }
    });
}

/// Signals are handled on Unix only.
#[cfg(not(unix))]
pub(crate) fn cancel_on_signals(_token: &CancelToken) {}

/// Runs `first` at the first signal; a second one ends the process at once.
#[cfg(unix)]
pub(crate) fn on_signals(first: impl FnOnce() + Send + 'static) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        let mut signals = signals.forever();
        if signals.next().is_some() {
            first();
        }
        if signals.next().is_some() {
            std::process::exit(1);
        }
    });
}

/// Signals are handled on Unix only.
#[cfg(not(unix))]
pub(crate) fn on_signals(_first: impl FnOnce() + Send + 'static) {}
