//! Jobs of slots: those of one slot run in order, those of different slots at the same time.
use super::Bridge;
use shibo_bridge::host::{Host, Job, Message};
use shibo_bridge::scene::lock;
use shibo_engine::eval::CancelToken;
use shibo_picture::contained;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread::Scope;
use std::time::Duration;

/// Maximum number of slots with work.
const MOST_LANES: usize = 64;
/// Maximum number of jobs.
const MOST_JOBS: usize = 1024;

/// A job's id, its slot, and the way to stop it.
type Known = (u64, Option<String>, CancelToken);

#[derive(Default)]
struct State {
    /// The jobs that wait, by slot. A slot with a thread is in the map. Jobs without a slot share one.
    lanes: BTreeMap<Option<String>, VecDeque<Box<Job>>>,
    /// All unfinished jobs, by number.
    known: BTreeMap<u64, Known>,
    count: u64,
}

/// All slots with work.
#[derive(Default)]
pub(super) struct Lanes {
    state: Mutex<State>,
    done: Condvar,
}

impl Lanes {
    /// Starts a job, or lets it wait for those of its slot, which are stopped. False if there are too many jobs.
    pub(super) fn put<'s>(&self, scope: &'s Scope<'s, '_>, bridge: &'s Bridge<'_>, job: Box<Job>) -> bool {
        let mut state = lock(&self.state);
        let slot = job.slot().map(str::to_owned);
        let is_new = !state.lanes.contains_key(&slot);
        if state.known.len() >= MOST_JOBS || is_new && state.lanes.len() >= MOST_LANES {
            return false;
        }
        if slot.is_some() {
            state.known.values().filter(|(_, other, _)| *other == slot).for_each(|(.., token)| token.cancel());
        }
        let number = state.count;
        state.count += 1;
        state.known.insert(number, (job.id(), slot.clone(), job.token().clone()));
        state.lanes.entry(slot.clone()).or_default().push_back(job);
        if is_new {
            scope.spawn(move || work(bridge, &slot));
        }
        true
    }

    /// Stops the jobs of a request.
    pub(super) fn cancel(&self, id: u64) {
        lock(&self.state).known.values().filter(|(of, ..)| *of == id).for_each(|(.., token)| token.cancel());
    }

    pub(super) fn cancel_all(&self) {
        lock(&self.state).known.values().for_each(|(.., token)| token.cancel());
    }

    /// Waits until all jobs are done, at most this long; true if they are done.
    pub(super) fn wait(&self, longest: Duration) -> bool {
        let state = lock(&self.state);
        let waited = self.done.wait_timeout_while(state, longest, |state| !state.lanes.is_empty());
        waited.unwrap_or_else(PoisonError::into_inner).0.lanes.is_empty()
    }

    /// The next job of a slot; without one, the slot's thread ends.
    fn next(&self, slot: &Option<String>) -> Option<Box<Job>> {
        let mut state = lock(&self.state);
        let next = state.lanes.get_mut(slot).and_then(VecDeque::pop_front);
        if next.is_none() {
            state.lanes.remove(slot);
            self.done.notify_all();
        }
        next
    }

    /// Forgets the oldest job of a slot with this id.
    fn forget(&self, slot: &Option<String>, id: u64) {
        let mut state = lock(&self.state);
        let number = state.known.iter().find(|(_, known)| known.0 == id && known.1 == *slot).map(|(number, _)| *number);
        if let Some(number) = number {
            state.known.remove(&number);
        }
    }
}

/// Does the jobs of a slot.
fn work(bridge: &Bridge<'_>, slot: &Option<String>) {
    while let Some(mut job) = bridge.lanes.next(slot) {
        let id = job.id();
        loop {
            let step = contained(|| job.step(&|event: Message| bridge.send(event.json.into())));
            let step =
                step.unwrap_or_else(|said| Some(Host::refused(id, "defect", &format!("there is a defect: {said}"))));
            let Some(message) = step else { break };
            let (is_last, is_complete) = (message.is_last(), message.json.contains_key("ok"));
            let place = message.place.clone();
            let json = bridge.files.complete(slot.as_deref(), message).unwrap_or_else(|error| {
                job.token().cancel();
                // The other program does not have this picture.
                if let (Some(slot), Some(place)) = (slot, &place) {
                    lock(&bridge.host).forget(slot, place);
                }
                Host::refused(id, "file", &format!("a picture cannot be written: {error}")).json.into()
            });
            let failed = json.get("error").is_some();
            if is_last || failed {
                bridge.files.end(slot.as_deref(), is_complete);
                bridge.lanes.forget(slot, id);
            }
            bridge.send(json);
            if is_last || failed {
                break;
            }
        }
    }
}
