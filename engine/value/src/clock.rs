//! The clocks of the engine. All crates of the engine, the kernel, the nodes and the library read time only here, because
//! WebAssembly has no clock of its own: there, the host gives one.
use std::time::{Duration, SystemTime};

/// Measures the time since it was made.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    read: fn() -> Duration,
    start: Duration,
}

impl Stopwatch {
    fn new(read: fn() -> Duration) -> Self {
        Self { read, start: read() }
    }

    /// Measures the CPU time of all threads of the process.
    pub fn process() -> Self {
        Self::new(system::process)
    }

    /// Measures the CPU time of the thread that calls this. The same thread must read it.
    pub fn thread() -> Self {
        Self::new(system::thread)
    }

    /// Measures real time.
    pub fn wall() -> Self {
        Self::new(system::wall)
    }

    /// The time since this was made.
    pub fn elapsed(&self) -> Duration {
        (self.read)().saturating_sub(self.start)
    }
}

/// The CPU time of the process since a fixed moment.
pub fn process_time() -> Duration {
    system::process()
}

/// The time of day; the start of 1970 where there is none.
pub fn time_of_day() -> SystemTime {
    system::time_of_day()
}

#[cfg(not(all(target_family = "wasm", target_os = "unknown")))]
mod system {
    use cpu_time::{ProcessTime, ThreadTime};
    use std::sync::OnceLock;
    use std::time::{Duration, Instant, SystemTime};

    pub(super) fn process() -> Duration {
        ProcessTime::now().as_duration()
    }

    pub(super) fn thread() -> Duration {
        ThreadTime::now().as_duration()
    }

    pub(super) fn wall() -> Duration {
        static START: OnceLock<Instant> = OnceLock::new();
        START.get_or_init(Instant::now).elapsed()
    }

    pub(super) fn time_of_day() -> SystemTime {
        SystemTime::now()
    }
}

#[cfg(all(target_family = "wasm", target_os = "unknown"))]
pub use system::set_host;

#[cfg(all(target_family = "wasm", target_os = "unknown"))]
mod system {
    use std::sync::OnceLock;
    use std::time::{Duration, SystemTime};

    static HOST: OnceLock<fn() -> Duration> = OnceLock::new();

    /// Sets the host's clock, such as `performance.now`. The first call counts. Without a host's clock no time passes.
    pub fn set_host(now: fn() -> Duration) {
        HOST.get_or_init(|| now);
    }

    pub(super) fn wall() -> Duration {
        HOST.get().map_or(Duration::ZERO, |now| now())
    }

    // One thread does all the work, so all clocks agree.
    pub(super) use wall as process;
    pub(super) use wall as thread;

    pub(super) fn time_of_day() -> SystemTime {
        SystemTime::UNIX_EPOCH
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_work_and_waiting() {
        let watches = [Stopwatch::process(), Stopwatch::thread(), Stopwatch::wall()];
        std::thread::sleep(Duration::from_millis(30));
        let [_, thread, wall] = watches.map(|watch| watch.elapsed());
        assert!(wall >= Duration::from_millis(30) && thread < wall, "{thread:?} {wall:?}");
        assert!(process_time() > Duration::ZERO);
    }
}
