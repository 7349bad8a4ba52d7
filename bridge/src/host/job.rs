//! Work that takes time: renders and exports.
use super::look::LookAt;
use super::others::{Step, Steps};
use super::render::Render;
use super::sample::Samples;
use super::shape::Shaping;
use super::shared::{Around, Shared};
use super::write::Write;
use super::{Message, Refusal, last};
use crate::scene::lock;
use serde_json::json;
use shibo_engine::eval::{CancelToken, Event, Observer};
use shibo_value::clock::Stopwatch;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Minimum time between two progress events.
const PROGRESS: Duration = Duration::from_millis(100);

pub(super) enum Work {
    Render(Box<Render>),
    Write(Box<Write>),
    Sample(Box<Samples>),
    Look(Box<LookAt>),
    Shape(Box<Shaping>),
    Other(Box<dyn Steps>),
}

/// A request that is worked on.
pub struct Job {
    id: u64,
    slot: Option<String>,
    cancel: CancelToken,
    /// `None` after the last message.
    work: Option<Work>,
    shared: Arc<Shared>,
}

impl Job {
    pub(super) fn new(id: u64, slot: Option<String>, work: Work, shared: Arc<Shared>) -> Self {
        Self { id, slot, cancel: CancelToken::default(), work: Some(work), shared }
    }

    /// The id of the request.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// The slot of a render that has one. Jobs of a slot run in order, and a newer one cancels those before it.
    pub fn slot(&self) -> Option<&str> {
        self.slot.as_deref()
    }

    /// The token that stops the job: its next message is then the error `cancelled`, or the result so far of work that has one.
    pub fn token(&self) -> &CancelToken {
        &self.cancel
    }

    /// The next message; `None` after the last one, which has `ok` or `error`. Events of progress go to `told` meanwhile, from any
    /// thread.
    pub fn step(&mut self, told: &(dyn Fn(Message) + Sync)) -> Option<Message> {
        let telling = Telling { id: self.id, told, watch: Stopwatch::wall(), due: Mutex::new(PROGRESS) };
        let around = Around { shared: &self.shared, cancel: &self.cancel, observer: &telling };
        let work = self.work.as_mut()?;
        let made = match work {
            // Work that is cancelled may have a result.
            Work::Other(steps) => match steps.step(&self.cancel, &telling) {
                Ok(Step::Event(event)) => Ok(Some(event)),
                Ok(Step::Done(answer)) => {
                    self.work = None;
                    return Some(last(self.id, Ok(answer)));
                }
                Err(refusal) => Err(refusal),
            },
            _ if self.cancel.is_cancelled() => Err(Refusal::cancelled()),
            Work::Render(render) => render.step(&around),
            Work::Write(write) => write.step(&around),
            Work::Sample(samples) => samples.step(&around),
            Work::Look(look) => look.step(&around),
            Work::Shape(shape) => shape.step(&around),
        };
        let done = match made {
            Ok(Some(mut message)) => {
                message.put("id", self.id);
                return Some(message);
            }
            Ok(None) => Ok(match work {
                Work::Render(render) => render.done(),
                Work::Write(write) => write.done(),
                Work::Sample(samples) => samples.done(),
                Work::Look(look) => look.done(),
                Work::Shape(_) | Work::Other(_) => json!({}),
            }),
            Err(refusal) => Err(refusal),
        };
        self.work = None;
        Some(last(self.id, done))
    }
}

/// Passes progress on, not too often.
struct Telling<'a> {
    id: u64,
    told: &'a (dyn Fn(Message) + Sync),
    watch: Stopwatch,
    /// The time from which the next event is passed on.
    due: Mutex<Duration>,
}

impl Observer for Telling<'_> {
    fn event(&self, event: Event) {
        let (node, done, of) = match event {
            Event::Node { name, done, total } => (Some(name), done, total),
            Event::Rows { done, total } => (None, done, total),
            _ => return,
        };
        let now = self.watch.elapsed();
        let mut due = lock(&self.due);
        if now < *due {
            return;
        }
        *due = now + PROGRESS;
        drop(due);
        let mut message = Message::event("progress");
        message.put("id", self.id);
        message.put("node", node);
        message.put("done", done);
        message.put("of", of);
        (self.told)(message);
    }
}
