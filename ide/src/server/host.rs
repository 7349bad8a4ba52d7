//! The parts of a language server that depend on the program that runs it.
use super::checker::Job;
use super::options::PictureForm;
use crate::Workspace;
use crate::hover::Pictures;
use lsp_server::{Message, RequestId};
use std::path::{Path, PathBuf};

/// A command of the editor that takes time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Renders an output of a file.
    Render(PathBuf, String),
    /// Shows a target of a file: an output, `@NODE`, or the first output for an empty name.
    Show(PathBuf, String),
    /// Shows the text of a file on its page as it is typed.
    Follow(PathBuf),
    /// Ends that.
    Unfollow(PathBuf),
}

/// The program that runs a server.
pub trait Host {
    /// Sends a message to the editor.
    fn send(&self, message: Message);

    /// Passes a new text to the checker.
    fn check(&self, job: Job);

    /// Pictures for hovers.
    fn pictures<'a>(&'a self, workspace: &'a Workspace) -> Box<dyn Pictures + 'a>;

    /// Sets the form of pictures in hovers.
    fn set_form(&self, _form: PictureForm) {}

    /// Returns whether commands can run.
    fn runs_commands(&self) -> bool {
        false
    }

    /// Begins a command; does not wait for its end.
    fn run(&self, _command: Command) {}

    /// Returns whether a page shows the text of a file as it is typed.
    fn follows(&self, _path: &Path) -> bool {
        false
    }

    /// The path of a copy of a library file, which an editor can open; `None` if there is no copy.
    fn copy(&self, _name: &str, _content: &[u8]) -> Option<PathBuf> {
        None
    }

    /// Returns whether the editor has cancelled a request.
    fn is_cancelled(&self, _id: &RequestId) -> bool {
        false
    }
}

/// Hovers without pictures.
pub struct NoPictures;

impl Pictures for NoPictures {
    fn kind(&self, _kind: &str) -> Option<String> {
        None
    }

    fn node(&self, _path: &Path, _node: &str) -> Option<crate::hover::Evaluated> {
        None
    }

    fn node_in(&self, _path: &Path, _text: &str, _node: &str) -> Option<crate::hover::Evaluated> {
        None
    }

    fn file(&self, _path: &Path) -> Option<String> {
        None
    }
}
