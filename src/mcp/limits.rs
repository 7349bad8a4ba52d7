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
    running: Semaphore,
    /// Calls that run or wait.
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
    pub(super) fn new(seconds: u32) -> Self {
        let longest = Duration::from_secs(u64::from(seconds));
        Self { running: Semaphore::new(RUNNING), all: AtomicUsize::new(0), longest }
    }

    /// Runs the work of a call on a thread of its own, until it is done, takes too long, or `cancelled` ends.
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
            let _running = self.running.acquire().await;
            let work = tokio::task::spawn_blocking(move || work(&token));
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
