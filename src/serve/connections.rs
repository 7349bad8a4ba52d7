//! Accepts connections to the page. The number of connections that have not yet shown the token is bounded; a new one
//! replaces the oldest, so other programs cannot lock the user out of the page.
use axum::{Extension, Router};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;

/// Maximum number of open connections that have shown the token; further ones are closed.
const KNOWN: usize = 256;
/// Maximum number of connections without the token, and how many of these may be older than `HELLO`.
const STRANGERS: usize = 320;
const SILENT: usize = 32;
/// Age at which a connection that has not sent the token is suspicious.
const HELLO: Duration = Duration::from_millis(500);
/// Maximum size of a request head in bytes.
const HEAD: usize = 32 << 10;
/// Timeout for a request to arrive, and for an idle connection.
const ARRIVAL: Duration = Duration::from_secs(15);

/// Records whether any request on this connection had the token; shared by all its requests.
#[derive(Clone, Debug, Default)]
pub(super) struct Acquaintance(Arc<AtomicBool>);

impl Acquaintance {
    /// Records that a request had the token.
    pub(super) fn make(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_made(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Open connections.
#[derive(Default)]
struct Open {
    strangers: VecDeque<(Acquaintance, AbortHandle, Instant)>,
    known: Vec<AbortHandle>,
}

impl Open {
    /// Makes room for one more connection; returns whether there is room.
    fn make_room(&mut self) -> bool {
        self.known.retain(|handle| !handle.is_finished());
        let known = &mut self.known;
        self.strangers.retain(|(acquaintance, handle, _)| {
            if acquaintance.is_made() && !handle.is_finished() {
                known.push(handle.clone());
            }
            !acquaintance.is_made() && !handle.is_finished()
        });
        // The oldest connections are at the front.
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

/// Serves the connections of `listener` for ever.
pub(super) async fn accept(listener: TcpListener, app: Router) {
    let mut open = Open::default();
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(_) => {
                // The process has most likely no file handles left; closing connections frees some.
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
    // The browser may close the connection at any time, so errors are ignored.
    let _ = connection.await;
}
