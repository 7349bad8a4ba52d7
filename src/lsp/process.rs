//! The parts of the language server that need a process: threads, pages, and copies of files.
use super::follow::Follower;
use super::pages::Pages;
use super::pictures::Painter;
use crate::environment;
use lsp_server::{Message, RequestId};
use shibo_bridge::write::whole_with_folders;
use shibo_ide::Workspace;
use shibo_ide::hover::Pictures;
use shibo_ide::server::{Command, Host, Job, PictureForm};
use shibo_value::Key;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

/// Requests that the editor has cancelled.
pub(super) type Cancelled = Arc<Mutex<HashSet<RequestId>>>;

/// The process that runs the server.
pub(super) struct Process {
    /// Sends messages to the editor.
    pub(super) out: Box<dyn Fn(Message)>,
    pub(super) checker: Sender<Job>,
    pub(super) painter: Painter,
    pub(super) pages: Pages,
    pub(super) follower: Follower,
    pub(super) cancelled: Cancelled,
}

impl Host for Process {
    fn send(&self, message: Message) {
        (self.out)(message);
    }

    fn check(&self, job: Job) {
        self.follower.note(&job);
        // Without the checker thread there are no diagnostics, but everything else works.
        let _ = self.checker.send(job);
    }

    fn pictures<'a>(&'a self, workspace: &'a Workspace) -> Box<dyn Pictures + 'a> {
        Box::new(self.painter.of(workspace))
    }

    fn set_form(&self, form: PictureForm) {
        self.painter.set_form(form);
    }

    fn runs_commands(&self) -> bool {
        true
    }

    fn run(&self, command: Command) {
        let (pages, follower) = (self.pages.clone(), self.follower.clone());
        thread::spawn(move || match command {
            Command::Render(path, output) => pages.render(&path, &output),
            Command::Show(path, target) => pages.show(&path, &target),
            Command::Follow(path) => follower.follow(&path),
            Command::Unfollow(path) => follower.unfollow(&path),
        });
    }

    fn follows(&self, path: &Path) -> bool {
        self.follower.follows(path)
    }

    fn copy(&self, name: &str, content: &[u8]) -> Option<PathBuf> {
        // Versions of the program that run at the same time have their own copies.
        let hash = Key::of("library", &[content]).to_string();
        let path = environment::editor_dir().join(format!("{}-{name}", &hash[..16]));
        let is_there = std::fs::read(&path).is_ok_and(|found| found == content);
        (is_there || whole_with_folders(&path, content).is_ok()).then_some(path)
    }

    fn is_cancelled(&self, id: &RequestId) -> bool {
        self.cancelled.lock().unwrap_or_else(PoisonError::into_inner).remove(id)
    }
}
