//! Limits of calls: how many run, how many wait, and how long one may take.
use shibo_bridge::agents::Refusal;
use shibo_engine::eval::CancelToken;
use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;
use tokio::sync::Semaphore;

/// The most calls that run at once.
const RUNNING: usize = 4;
/// The most calls that wait.
const WAITING: usize = 32;

/// The calls of a server.
pub(super) struct Limits {
    running: Arc<Semaphore>,
    /// Calls that run or wait for their turn, and are not answered yet.
    all: AtomicUsize,
    longest: Duration,
}

/// Counts a call while it exists, and cancels its work when it ends early.
struct Counted<'a>(&'a AtomicUsize, CancelToken);

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
        self.1.cancel();
    }
}

impl Limits {
    /// Limits of calls that take at most `longest`.
    pub(super) fn new(longest: Duration) -> Self {
        Self { running: Arc::new(Semaphore::new(RUNNING)), all: AtomicUsize::new(0), longest }
    }

    /// Runs the work of a call on a thread of its own, until it is done, takes too long, or `cancelled` ends. The work of a call that
    /// was answered early keeps its place until it has stopped, so never more than [`RUNNING`] calls compute.
    pub(super) async fn call<T: Send + 'static>(
        self: Arc<Self>,
        cancelled: impl Future<Output = ()>,
        work: impl FnOnce(&CancelToken) -> T + Send + 'static,
    ) -> Result<T, Refusal> {
        let before = self.all.fetch_add(1, Ordering::Relaxed);
        let counted = Counted(&self.all, CancelToken::default());
        if before >= RUNNING + WAITING {
            return Err(Refusal::new("busy", "too many calls wait", "call again when others have answered"));
        }
        let token = counted.1.clone();
        let run = async {
            let place = self.running.clone().acquire_owned().await;
            let work = tokio::task::spawn_blocking(move || {
                let _place = place;
                work(&token)
            });
            match tokio::time::timeout(self.longest, work).await {
                Ok(done) => done.map_err(|_| Refusal::new("defect", "the call failed", "please report it")),
                Err(_) => {
                    let message = format!("the call took longer than {} s", self.longest.as_secs());
                    Err(Refusal::new(
                        "too-long",
                        message,
                        "ask for a smaller picture, or start the server with `--seconds`",
                    ))
                }
            }
        };
        tokio::select! {
            done = run => done,
            () = cancelled => Err(Refusal::new("cancelled", "the call was cancelled", "")),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;
    use std::future::pending;
    use std::sync::atomic::AtomicBool;
    use tokio::time::{sleep, timeout};

    const SHORT: Duration = Duration::from_millis(50);
    const LONG: Duration = Duration::from_secs(20);

    fn code<T>(done: Result<T, Refusal>) -> String {
        done.err().map(|refusal| refusal.code).unwrap_or_default()
    }

    fn block_on<T>(work: impl Future<Output = T>) -> T {
        tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap().block_on(work)
    }

    /// Work that does not listen to its token and ends with a signal.
    fn deaf(end: &Arc<AtomicBool>) -> impl FnOnce(&CancelToken) + Send + 'static {
        let end = end.clone();
        move |_| {
            while !end.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    #[test]
    fn work_of_refused_and_cancelled_calls_keeps_its_place() {
        block_on(async {
            let (limits, end) = (Arc::new(Limits::new(SHORT)), Arc::new(AtomicBool::new(false)));
            for call in 0..RUNNING {
                let done = if call % 2 == 0 {
                    limits.clone().call(pending(), deaf(&end)).await
                } else {
                    // Half of the time that it may take, so its work has begun.
                    limits.clone().call(sleep(SHORT / 2), deaf(&end)).await
                };
                assert_eq!(code(done), if call % 2 == 0 { "too-long" } else { "cancelled" });
            }
            let next = timeout(4 * SHORT, limits.clone().call(pending(), |_| ())).await;
            assert!(next.is_err(), "a fifth call computes while four others do");
            end.store(true, Ordering::Relaxed);
            let next = timeout(LONG, limits.call(pending(), |_| 7)).await.unwrap();
            assert_eq!(next, Ok(7));
        });
    }

    #[test]
    fn work_learns_that_its_call_has_ended() {
        block_on(async {
            let limits = Arc::new(Limits::new(SHORT));
            let (stopped, mut stops) = tokio::sync::mpsc::unbounded_channel();
            let work = || {
                let stopped = stopped.clone();
                move |token: &CancelToken| {
                    while !token.is_cancelled() {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                    let _ = stopped.send(());
                }
            };
            assert_eq!(code(limits.clone().call(pending(), work()).await), "too-long");
            timeout(LONG, stops.recv()).await.unwrap().unwrap();
            assert_eq!(code(limits.clone().call(sleep(SHORT / 2), work()).await), "cancelled");
            timeout(LONG, stops.recv()).await.unwrap().unwrap();
            let _ = timeout(SHORT / 2, limits.call(pending(), work())).await;
            timeout(LONG, stops.recv()).await.unwrap().unwrap();
        });
    }

    #[test]
    fn more_calls_than_may_wait_are_refused() {
        block_on(async {
            let (limits, end) = (Arc::new(Limits::new(LONG)), Arc::new(AtomicBool::new(false)));
            let call = |_| tokio::spawn(limits.clone().call(pending(), deaf(&end)));
            let calls: Vec<_> = (0..RUNNING + WAITING).map(call).collect();
            while limits.all.load(Ordering::Relaxed) < RUNNING + WAITING {
                sleep(Duration::from_millis(1)).await;
            }
            assert_eq!(code(limits.clone().call(pending(), |_| ()).await), "busy");
            end.store(true, Ordering::Relaxed);
            for call in calls {
                assert_eq!(call.await.unwrap(), Ok(()));
            }
        });
    }
}
