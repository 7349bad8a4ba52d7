//! Requests one after the other, for a transport without threads.
use super::{Asked, Host, Job, Message};
use serde_json::json;
use shibo_graph::Gate;
use shibo_ide::server::Single;
use shibo_value::files::Memory;
use std::collections::VecDeque;

/// A host and its unfinished jobs. A request may come before the jobs are done: its answer comes between two pictures.
pub struct Serial {
    host: Host,
    ready: VecDeque<Message>,
    jobs: VecDeque<Box<Job>>,
    language: Single,
}

impl Serial {
    /// A host that answers one request after the other.
    pub fn new(host: Host) -> Self {
        let tools = host.tools();
        let language = Single::new(tools.registry.clone(), tools.import_paths.clone(), Gate::of(Memory::default()));
        Self { host, ready: VecDeque::new(), jobs: VecDeque::new(), language }
    }

    /// Takes a request, a JSON object.
    pub fn ask(&mut self, request: &[u8]) {
        match self.host.ask(request) {
            Asked::Answer(answer) | Asked::Free { answer, .. } => self.ready.push_back(answer),
            Asked::Job(job) => {
                let older = self.jobs.iter().filter(|other| other.slot().is_some() && other.slot() == job.slot());
                older.for_each(|other| other.token().cancel());
                self.jobs.push_back(job);
            }
            Asked::Cancel { of, answer } => {
                self.jobs.iter().filter(|job| job.id() == of).for_each(|job| job.token().cancel());
                self.ready.push_back(answer);
            }
            Asked::Lsp { id, message, files } => {
                if let Some(files) = files {
                    self.language.set_gate(Gate::of(files));
                }
                self.ready.push_back(match self.language.ask(message) {
                    Ok(answer) => {
                        let messages: Vec<_> = answer.into_iter().collect();
                        Host::answered(id, json!({ "messages": messages }))
                    }
                    Err(error) => {
                        let why = format!("`message` is no message of the language server protocol: {error}");
                        Host::refused(id, "bad-request", &why)
                    }
                });
            }
        }
    }

    /// The next answer or event; `None` after the last one of all requests.
    pub fn step(&mut self) -> Option<Message> {
        if let Some(message) = self.ready.pop_front() {
            return Some(message);
        }
        // The diagnostics of a new text come before pictures.
        if let Some(told) = self.language.told() {
            let mut message = Message::event("lsp");
            message.put("message", told);
            return Some(message);
        }
        // A cancelled job ends before others go on.
        let at = self.jobs.iter().position(|job| job.token().is_cancelled()).unwrap_or(0);
        let message = self.jobs.get_mut(at)?.step(&|_| {})?;
        if message.is_last() {
            self.jobs.remove(at);
        }
        Some(message)
    }
}
