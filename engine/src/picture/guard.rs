//! Calls of decoders and of nodes that may panic.
use super::limits::ReadError;
use std::any::Any;
use std::cell::Cell;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, Once, PoisonError};

thread_local! {
    /// How many guarded calls this thread is in.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Counts a guarded call, also where it is left by a panic.
struct Inside;

impl Inside {
    fn enter() -> Self {
        DEPTH.with(|depth| depth.set(depth.get() + 1));
        Self
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        DEPTH.with(|depth| depth.set(depth.get() - 1));
    }
}

/// Messages of the last contained panics, and their places in the source: a caught panic does not know its place.
static PLACES: Mutex<VecDeque<(String, String)>> = Mutex::new(VecDeque::new());
/// So many are kept.
const KEPT: usize = 64;

/// Puts a panic hook before the one of the program, once: it notes the messages of threads that are in a guarded call instead of
/// printing them, and hands on all others.
fn install_hook() {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let others = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            // A thread that ends has no counter any more, and is in no call.
            if DEPTH.try_with(Cell::get).unwrap_or(0) == 0 {
                return others(panic);
            }
            let place = panic.location().map_or(String::new(), |place| format!("{}:{}", place.file(), place.line()));
            let mut places = PLACES.lock().unwrap_or_else(PoisonError::into_inner);
            places.truncate(KEPT - 1);
            places.push_front((text(panic.payload()), place));
        }));
    });
}

/// The message of a panic.
fn text(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied().or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("it gave no reason").to_owned()
}

/// Runs code that may have a defect. A panic is not printed: its message, with the place in the source, is the error, and the process
/// goes on. Data that the call changes must be valid at any time, or not be used again.
///
/// # Errors
/// The message of a panic, on one line.
pub fn contained<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    install_hook();
    let _inside = Inside::enter();
    catch_unwind(AssertUnwindSafe(call)).map_err(|payload| {
        let text = text(&*payload);
        let places = PLACES.lock().unwrap_or_else(PoisonError::into_inner);
        let place = places.iter().find(|(said, _)| *said == text).map(|(_, place)| format!(" ({place})"));
        format!("{}{}", text.replace('\n', " "), place.unwrap_or_default())
    })
}

/// Marks a thread of a pool whose panics are contained by the thread that waits for it: none is printed.
pub(crate) fn contain_thread() {
    install_hook();
    DEPTH.with(|depth| depth.set(depth.get() + 1));
}

/// Runs code of a library that may panic on data that it was not made for. A panic gives `None`: the process continues, and
/// the message of the panic is not printed.
///
/// `call` must not wait for other threads. A thread that waits in a pool takes up other work meanwhile, and a panic of
/// that work would be silent too.
pub fn caught<T>(call: impl FnOnce() -> T) -> Option<T> {
    contained(call).ok()
}

/// Runs a decoder. None is known to panic on files that pass the checks before. If one does, the file is taken to be
/// corrupt.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Result<T, ReadError>) -> Result<T, ReadError> {
    caught(decode).unwrap_or_else(|| Err(ReadError::corrupt("its decoder gave up")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;
    use std::sync::Barrier;

    const CHILD: &str = "SHIBO_TEST_GUARD";

    fn quiet(message: &'static str) -> Result<(), ReadError> {
        guarded(|| panic!("{message}"))
    }

    /// What the child process does: panics in and out of guarded calls, on several threads at once.
    fn panics() {
        let (before, after) = (Barrier::new(2), Barrier::new(2));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                // This thread stays in its guarded call while the other one panics.
                let _ = guarded::<()>(|| {
                    before.wait();
                    after.wait();
                    panic!("quiet one")
                });
            });
            before.wait();
            assert!(catch_unwind(|| panic!("loud beside it")).is_err());
            after.wait();
        });
        // One within another: the inner one leaves the outer one guarded.
        let outer: Result<(), _> = guarded(|| {
            assert!(quiet("quiet inner").is_err());
            panic!("quiet outer")
        });
        assert!(outer.is_err());
        rayon::scope(|scope| (0..8).for_each(|_| scope.spawn(|_| assert!(quiet("quiet pooled").is_err()))));
        assert!(catch_unwind(|| panic!("loud at the end")).is_err());
    }

    #[test]
    fn contained_panics_tell_what_and_where() {
        assert_eq!(contained(|| 7), Ok(7));
        let said = contained(|| panic!("one\ntwo {}", 3)).unwrap_err();
        assert!(said.starts_with("one two 3 (") && said.contains("guard.rs:"), "{said}");
        // Also those of other threads, whose panics arrive here.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).start_handler(|_| contain_thread()).build().unwrap();
        let said = contained(|| pool.install(|| rayon::join(|| panic!("in a pool"), || ()))).unwrap_err();
        assert!(said.starts_with("in a pool (") && said.contains("guard.rs:"), "{said}");
        assert_eq!(contained(|| std::panic::panic_any(7)).unwrap_err().split(" (").next(), Some("it gave no reason"));
    }

    #[test]
    fn only_guarded_panics_are_silent() {
        if std::env::var_os(CHILD).is_some() {
            return panics();
        }
        let name = "picture::guard::tests::only_guarded_panics_are_silent";
        let mut child = Command::new(std::env::current_exe().unwrap());
        let output = child.args([name, "--exact", "--nocapture"]).env(CHILD, "1").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        assert!(said.contains("loud beside it") && said.contains("loud at the end"), "{said}");
        assert!(!said.contains("quiet"), "{said}");
        assert_eq!(said.matches("panicked at").count(), 2, "the hook is called once for each: {said}");
    }
}
