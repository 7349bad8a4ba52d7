//! Shared ownership in chains of any length.
use std::cell::RefCell;
use std::sync::Arc;

thread_local! {
    /// Values to be dropped after the current drop on this thread.
    static LATER: RefCell<Option<Vec<Box<dyn Send>>>> = const { RefCell::new(None) };
}

/// An `Arc` whose drop does not recurse. Fields and solids own their inputs, in chains of many thousands, so a
/// recursive drop would overflow the stack.
pub(super) struct Link<T: ?Sized + Send + Sync + 'static>(Option<Arc<T>>);

impl<T: ?Sized + Send + Sync + 'static> Link<T> {
    pub(super) const fn new(shared: Arc<T>) -> Self {
        Self(Some(shared))
    }

    pub(super) fn get(&self) -> &T {
        self.0.as_deref().expect("taken only by drop")
    }

    /// The address in memory: the same for all clones, as long as one of them lives.
    pub(super) fn address(&self) -> usize {
        self.0.as_ref().map_or(0, |shared| Arc::as_ptr(shared).cast::<()>().addr())
    }
}

impl<T: ?Sized + Send + Sync + 'static> Clone for Link<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T: ?Sized + Send + Sync + 'static> Drop for Link<T> {
    fn drop(&mut self) {
        let Some(last) = self.0.take().filter(|shared| Arc::strong_count(shared) == 1) else { return };
        // When a thread ends, its list no longer exists. Values are then dropped directly.
        let _ = LATER.try_with(|later| {
            let mut list = later.borrow_mut();
            if let Some(list) = list.as_mut() {
                list.push(Box::new(last));
                return;
            }
            *list = Some(Vec::new());
            drop(list);
            drop(last);
            loop {
                // The list must not be borrowed during a drop, which may add to it.
                let next = later.borrow_mut().as_mut().and_then(Vec::pop);
                if next.is_none() {
                    break;
                }
            }
            *later.borrow_mut() = None;
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Chain(#[expect(dead_code, reason = "held, not read")] Option<Link<Chain>>);

    #[test]
    fn long_chains_are_dropped_on_a_small_stack() {
        let build = || (0..1_000_000).fold(None, |before, _| Some(Link::new(Arc::new(Chain(before)))));
        let thread = std::thread::Builder::new().stack_size(64 << 10);
        thread.spawn(move || drop(build())).unwrap().join().unwrap();
    }
}
