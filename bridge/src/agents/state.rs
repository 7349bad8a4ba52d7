//! State that the operations of a server share.
use super::{Folders, Refusal};
use crate::Tools;
use crate::scene::Store;
use shibo_engine::session::{Session, Settings};
use std::sync::OnceLock;

/// Memory for encoded pictures in bytes.
const PICTURES: u64 = 32 << 20;

/// State that all operations of a server share.
pub struct State {
    /// The kinds of nodes. Graphs read only files in `folders`.
    pub tools: Tools,
    /// The folders that may be used.
    pub folders: Folders,
    pub(super) store: Store,
    settings: Settings,
    session: OnceLock<Option<Session>>,
}

impl State {
    /// State without results. `settings` are those of the session, which starts with the first picture.
    pub fn new(tools: Tools, folders: Folders, settings: Settings) -> Self {
        let tools = Tools { gate: folders.gate(), ..tools };
        Self { tools, folders, store: Store::new(PICTURES), settings, session: OnceLock::new() }
    }

    /// The session.
    ///
    /// # Errors
    /// Fails if its threads cannot be started.
    pub(super) fn session(&self) -> Result<&Session, Refusal> {
        let session = self.session.get_or_init(|| Session::new(self.tools.registry.clone(), &self.settings).ok());
        session.as_ref().ok_or_else(|| Refusal::new("defect", "threads cannot be started", "lower `--threads`"))
    }
}
