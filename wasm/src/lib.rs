//! Shibo as a WebAssembly module: the requests of `shibo_bridge::host` as calls in memory. A host such as Node or a browser
//!
//! 1. gets memory with [`alloc`], writes a request there (JSON in UTF-8), and calls [`ask`];
//! 2. calls [`step`] until it returns 0. Each result is the address of an answer or event;
//! 3. gives the memory of the request back with [`free`].
//!
//! An answer is the length of its JSON and that of its bytes, both as little-endian `u32`, then the JSON, then the bytes. It is valid
//! until the next call. The module imports two functions from `shibo`: `now`, a clock in milliseconds, and `told`, which gets the
//! message of a panic. A panic ends the instance: the host must make a new one.
#![cfg(target_family = "wasm")]

use shibo_bridge::Tools;
use shibo_bridge::host::{Host, Serial};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Session, Settings};
use shibo_fit::page::Photographs;
use shibo_graph::Gate;
use shibo_value::clock;
use shibo_value::files::Memory;
use std::cell::RefCell;
use std::sync::Arc;
use std::time::Duration;

/// Bytes for results; nodes may take as many again.
const MEMORY: u64 = 512 << 20;

#[link(wasm_import_module = "shibo")]
// SAFETY: the documentation of the module requires both functions with these types. `now` has no other conditions.
unsafe extern "C" {
    safe fn now() -> f64;
    fn told(text: *const u8, length: usize);
}

/// The host, and its last answer.
struct State {
    host: Serial,
    answer: Vec<u8>,
}

thread_local! {
    static STATE: RefCell<Option<State>> = const { RefCell::new(None) };
}

/// Tells the host the message of a panic.
fn tell(message: &str) {
    // SAFETY: address and length are those of a text that lives during the call, and the host only reads it.
    unsafe { told(message.as_ptr(), message.len()) }
}

fn start() -> State {
    std::panic::set_hook(Box::new(|panic| tell(&panic.to_string())));
    clock::set_host(|| Duration::from_secs_f64(now().max(0.0) / 1000.0));
    let registry = Arc::new(shibo_library::registry());
    let settings = Settings { threads: 1, memory: MEMORY, ..Settings::default() };
    let session = Session::new(registry.clone(), &settings).unwrap_or_else(|error| panic!("{error}"));
    let gate = Gate::of(Memory::default());
    let tools = Tools { registry, import_paths: Vec::new(), gate, cancel: CancelToken::default() };
    State { host: Serial::new(Host::new(session, tools).with(Arc::new(Photographs::default()))), answer: Vec::new() }
}

fn with<T>(work: impl FnOnce(&mut State) -> T) -> T {
    STATE.with_borrow_mut(|state| work(state.get_or_insert_with(start)))
}

/// Memory for a request of `length` bytes.
#[unsafe(no_mangle)] // SAFETY: no other symbol of the module has this name.
pub extern "C" fn alloc(length: usize) -> *mut u8 {
    Box::into_raw(vec![0_u8; length].into_boxed_slice()).cast()
}

/// Gives memory back.
///
/// # Safety
/// `at` and `length` must be those of a call of [`alloc`], and the memory must not be used any more.
#[unsafe(no_mangle)] // SAFETY: no other symbol of the module has this name.
pub unsafe extern "C" fn free(at: *mut u8, length: usize) {
    // SAFETY: the caller gives a slice that `alloc` made and that no code uses any more.
    drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(at, length)) });
}

/// Takes a request. It may come before the work of others is done.
///
/// # Safety
/// `at` must be the address of `length` bytes that [`alloc`] gave.
#[unsafe(no_mangle)] // SAFETY: no other symbol of the module has this name.
pub unsafe extern "C" fn ask(at: *const u8, length: usize) {
    // SAFETY: the caller gives initialised memory of `alloc`, and it does not change during this call: there is one thread.
    let request = unsafe { std::slice::from_raw_parts(at, length) };
    with(|state| state.host.ask(request));
}

/// The address of the next answer or event; 0 after the last one of all requests.
#[unsafe(no_mangle)] // SAFETY: no other symbol of the module has this name.
pub extern "C" fn step() -> *const u8 {
    with(|state| {
        let Some(message) = state.host.step() else { return std::ptr::null() };
        let json = serde_json::Value::from(message.json).to_string();
        let bytes = message.bytes.unwrap_or_default();
        state.answer.clear();
        for part in [json.as_bytes(), &bytes] {
            state.answer.extend(u32::try_from(part.len()).unwrap_or(u32::MAX).to_le_bytes());
        }
        state.answer.extend(json.as_bytes());
        state.answer.extend(bytes);
        state.answer.as_ptr()
    })
}
