//! Connections to the page. Those that have not shown the token yet are few, and the oldest of them makes room for a new one, so
//! strangers never keep anybody from the page.
use axum::{Extension, Router};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;

/// The most connections at a time that have shown the token; further ones are closed.
const KNOWN: usize = 256;
/// The most that have not, and how many of them may be older than `HELLO`.
const STRANGERS: usize = 320;
const SILENT: usize = 32;
/// The time after which a connection without a request with the token is suspicious.
const HELLO: Duration = Duration::from_millis(500);
/// The most bytes of the head of a request.
const HEAD: usize = 32 << 10;
/// How long a request may take to arrive, and an idle connection may stay.
const ARRIVAL: Duration = Duration::from_secs(15);

/// Whether a request with the token came by a connection. All its requests share it.
#[derive(Clone, Debug, Default)]
pub(super) struct Acquaintance(Arc<AtomicBool>);

impl Acquaintance {
    /// A request had the token.
    pub(super) fn make(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_made(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The connections at work.
#[derive(Default)]
struct Open {
    strangers: VecDeque<(Acquaintance, AbortHandle, Instant)>,
    known: Vec<AbortHandle>,
}

impl Open {
    /// Makes room for one more; whether there is some.
    fn make_room(&mut self) -> bool {
        self.known.retain(|handle| !handle.is_finished());
        let known = &mut self.known;
        self.strangers.retain(|(acquaintance, handle, _)| {
            if acquaintance.is_made() && !handle.is_finished() {
                known.push(handle.clone());
            }
            !acquaintance.is_made() && !handle.is_finished()
        });
        // The oldest are in front.
        let mut silent = self.strangers.iter().take_while(|(_, _, since)| since.elapsed() > HELLO).count();
        while silent > SILENT || self.strangers.len() >= STRANGERS {
            if let Some((_, oldest, _)) = self.strangers.pop_front() {
                oldest.abort();
            }
            silent = silent.saturating_sub(1);
        }
        self.known.len() < KNOWN
    }
}

/// Answers what comes to `listener`, for ever.
pub(super) async fn accept(listener: TcpListener, app: Router) {
    let mut open = Open::default();
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(_) => {
                // Out of file handles, most likely: some will be closed.
                open.make_room();
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            }
        };
        if !open.make_room() {
            continue;
        }
        let acquaintance = Acquaintance::default();
        let task = tokio::spawn(answer(stream, app.clone().layer(Extension(acquaintance.clone()))));
        open.strangers.push_back((acquaintance, task.abort_handle(), Instant::now()));
    }
}

async fn answer(stream: TcpStream, app: Router) {
    let _ = stream.set_nodelay(true);
    let connection = hyper::server::conn::http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(ARRIVAL)
        .max_buf_size(HEAD)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(app));
    // The browser may close the connection at any time.
    let _ = connection.await;
}
