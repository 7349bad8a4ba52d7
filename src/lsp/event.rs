//! Events for the main loop.
use lsp_server::Message;
use lsp_types::MessageType;
use std::path::PathBuf;
use std::sync::mpsc::Sender;

/// Event for the main loop.
pub(super) enum Event {
    /// A message of the editor.
    Message(Message),
    /// A message of a thread, such as a click on a node of a page.
    Jump(Jump),
    /// A page changes a followed text.
    Edit(PageEdit),
    /// The connection to the editor is closed.
    Gone,
}

/// Message from a thread.
pub(super) enum Jump {
    /// A node was clicked: file, line and column from 1; columns count characters.
    To(PathBuf, u32, u32),
    /// A page is to be opened in the browser.
    Open(String),
    /// A message for the user.
    Say(MessageType, String),
}

/// A change of a followed text that a page asks for.
pub(super) struct PageEdit {
    /// The file.
    pub(super) path: PathBuf,
    /// SHA-256 of the text before the change.
    pub(super) base: String,
    /// The text after the change.
    pub(super) text: String,
    /// Receives the reason why the change is not made, if it is not.
    pub(super) answer: Sender<Result<(), String>>,
}
