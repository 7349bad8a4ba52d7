//! Decides when to read files that are being written: an event is a hint, and one save causes many events.
use std::time::{Duration, Instant};

/// After this time without an event the save is probably complete.
const QUIET: Duration = Duration::from_millis(15);
/// Shorter wait after an event that ends a save: a file was closed or moved into place.
const CLOSED: Duration = Duration::from_millis(3);
/// The files are compared after this time even if events continue.
const CAP: Duration = Duration::from_millis(200);

/// Events since the files were last compared.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Settle {
    /// Times of the first and the last event, and whether the last one ended a save.
    touched: Option<(Instant, Instant, bool)>,
}

impl Settle {
    /// Records an event; `closed`: it ended a save.
    pub(super) fn touch(&mut self, now: Instant, closed: bool) {
        let first = self.touched.map_or(now, |(first, ..)| first);
        self.touched = Some((first, now, closed));
    }

    /// Time at which to compare the files.
    pub(super) fn due(&self) -> Option<Instant> {
        self.touched.map(|(first, last, closed)| (last + if closed { CLOSED } else { QUIET }).min(first + CAP))
    }

    /// Resets when the files are compared; returns whether the last event ended a save.
    pub(super) fn clear(&mut self) -> bool {
        self.touched.take().is_some_and(|(.., closed)| closed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_save_after_it_ends() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut settle = Settle::default();
        assert_eq!(settle.due(), None);
        settle.touch(at(0), false);
        assert_eq!(settle.due(), Some(at(15)));
        settle.touch(at(10), false);
        assert_eq!(settle.due(), Some(at(25)));
        settle.touch(at(12), true);
        assert_eq!(settle.due(), Some(at(15)));
        assert!(settle.clear());
        assert_eq!(settle.due(), None);
    }

    #[test]
    fn reads_file_despite_continuous_events() {
        let start = Instant::now();
        let at = |ms| start + Duration::from_millis(ms);
        let mut settle = Settle::default();
        (0..30).for_each(|i| settle.touch(at(i * 10), false));
        assert_eq!(settle.due(), Some(at(200)));
    }
}
