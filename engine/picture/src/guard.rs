//! Guarded calls: contain panics of decoders and of nodes.
use super::limits::ReadError;
use std::any::Any;
use std::cell::Cell;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, Once, PoisonError};

thread_local! {
    /// The nesting depth of guarded calls in this thread.
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Counts a guarded call until it ends, by a panic too.
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

/// Messages of the last contained panics, and their source locations: a caught panic does not know its location.
static PLACES: Mutex<VecDeque<(String, String)>> = Mutex::new(VecDeque::new());
/// Number of messages kept.
const KEPT: usize = 64;

/// Installs a panic hook in front of the program's hook, once. It records the messages of threads inside a guarded call
/// instead of printing them, and passes all others on.
fn install_hook() {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let others = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            // A thread that is ending has no counter any more, so it is not in a guarded call. In WebAssembly no call contains a
            // panic.
            if cfg!(panic = "abort") || DEPTH.try_with(Cell::get).unwrap_or(0) == 0 {
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

/// Runs code that may have a defect. A panic is not printed: its message, with the source location, becomes the error,
/// and the process continues. Data that the call changes must be valid at any time, or must not be used again.
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

/// Marks a thread of a pool. Its panics are not printed, because the thread that waits for it contains them.
pub fn contain_thread() {
    install_hook();
    DEPTH.with(|depth| depth.set(depth.get() + 1));
}

/// Runs code of a library that may panic on invalid data. A panic gives `None`: the process continues, and the message
/// is not printed.
///
/// `call` must not wait for other threads. A thread that waits in a pool executes other work meanwhile, and a panic of
/// that work would be silent too.
pub fn caught<T>(call: impl FnOnce() -> T) -> Option<T> {
    contained(call).ok()
}

/// Runs a decoder. Decoders should not panic on files that passed the checks. If one does, the file is reported as
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

    /// The work of the child process: panics inside and outside of guarded calls, on several threads at once.
    fn panics() {
        let (before, after) = (Barrier::new(2), Barrier::new(2));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                // This thread stays in its guarded call while another thread panics.
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
        // Nested calls: after the inner call the outer one is still guarded.
        let outer: Result<(), _> = guarded(|| {
            assert!(quiet("quiet inner").is_err());
            panic!("quiet outer")
        });
        assert!(outer.is_err());
        rayon::scope(|scope| (0..8).for_each(|_| scope.spawn(|_| assert!(quiet("quiet pooled").is_err()))));
        assert!(catch_unwind(|| panic!("loud at the end")).is_err());
    }

    #[test]
    fn contained_panics_report_message_and_location() {
        assert_eq!(contained(|| 7), Ok(7));
        let said = contained(|| panic!("one\ntwo {}", 3)).unwrap_err();
        assert!(said.starts_with("one two 3 (") && said.contains("guard.rs:"), "{said}");
        // Panics of pool threads are contained, too.
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
        let name = "guard::tests::only_guarded_panics_are_silent";
        let mut child = Command::new(std::env::current_exe().unwrap());
        let output = child.args([name, "--exact", "--nocapture"]).env(CHILD, "1").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        assert!(said.contains("loud beside it") && said.contains("loud at the end"), "{said}");
        assert!(!said.contains("quiet"), "{said}");
        assert_eq!(said.matches("panicked at").count(), 2, "the hook is called once for each: {said}");
    }
}
