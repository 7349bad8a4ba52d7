//! Work that gives its caller a turn now and then. A caller without threads can pass messages on meanwhile.
use std::future::{Future, poll_fn};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

/// Gives the caller a turn.
pub(crate) fn pause() -> impl Future<Output = ()> + Send {
    let mut paused = false;
    poll_fn(move |_| if std::mem::replace(&mut paused, true) { Poll::Ready(()) } else { Poll::Pending })
}

/// Does work that waits for nothing but turns, without a break.
pub(crate) fn finish<T>(work: impl Future<Output = T>) -> T {
    let (mut work, mut context) = (pin!(work), Context::from_waker(Waker::noop()));
    loop {
        if let Poll::Ready(done) = work.as_mut().poll(&mut context) {
            return done;
        }
    }
}
