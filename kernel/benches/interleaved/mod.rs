//! Interleaved measurements: several kinds of work run in short slices, one after another, again and again, so that
//! other load on the machine affects all of them equally. Medians of many slices can be compared, unlike single runs.
use cpu_time::ProcessTime;
use std::sync::{Condvar, Mutex, PoisonError};

/// Minimum CPU seconds of a slice.
const SLICE: f64 = 0.025;
/// Number of warm-up slices, which are not counted.
const WARM: usize = 2;

/// Work in units: before each unit it calls the function with the number of units done, and ends when the function
/// returns false.
pub(crate) type Work<'w> = Box<dyn FnOnce(&mut (dyn FnMut(u32) -> bool + Send)) + Send + 'w>;

/// The running work, and the measurements.
struct State {
    turn: usize,
    /// Number of kinds of work that are ready.
    ready: usize,
    done: bool,
    times: Vec<Vec<f64>>,
}

/// Ends the measurement when one kind of work ends, also by a panic, so that no other waits forever.
struct Leave<'s>(&'s Mutex<State>, &'s Condvar);

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).done = true;
        self.1.notify_all();
    }
}

/// CPU seconds of all threads per unit, by work and round.
pub(crate) fn interleaved(all: Vec<Work<'_>>, rounds: usize) -> Vec<Vec<f64>> {
    let count = all.len();
    let state = State { turn: 0, ready: 0, done: false, times: vec![Vec::new(); count] };
    let (state, changed) = (Mutex::new(state), Condvar::new());
    std::thread::scope(|scope| {
        for (me, work) in all.into_iter().enumerate() {
            let (state, changed) = (&state, &changed);
            scope.spawn(move || {
                let _leave = Leave(state, changed);
                let mut begun: Option<(ProcessTime, u32)> = None;
                work(&mut |units: u32| {
                    let lock = || state.lock().unwrap_or_else(PoisonError::into_inner);
                    if let Some((at, first)) = begun {
                        let seconds = at.elapsed().as_secs_f64();
                        if seconds < SLICE || units == first {
                            return true;
                        }
                        let mut state = lock();
                        state.times[me].push(seconds / f64::from(units - first));
                        state.turn = (me + 1) % count;
                        state.done |= me + 1 == count && state.times[me].len() == rounds + WARM;
                    } else {
                        lock().ready += 1;
                    }
                    changed.notify_all();
                    let waits = |state: &mut State| !state.done && (state.ready < count || state.turn != me);
                    let state = changed.wait_while(lock(), waits).unwrap_or_else(PoisonError::into_inner);
                    begun = Some((ProcessTime::now(), units));
                    !state.done
                });
            });
        }
    });
    let state = state.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.times.into_iter().map(|times| times.into_iter().skip(WARM).collect()).collect()
}

/// The median, between the first and the third quartile.
pub(crate) fn quartiles(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    [1, 2, 3].map(|quarter| values[(values.len() - 1) * quarter / 4])
}
