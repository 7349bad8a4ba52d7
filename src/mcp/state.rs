//! State that the calls of a server share.
use super::McpArgs;
use crate::environment;
use crate::library;
use crate::serve::Store;
use shibo_bridge::Tools;
use shibo_bridge::agents::{Folders, Refusal};
use shibo_engine::session::{Session, Settings};
use std::sync::OnceLock;

/// Memory for encoded pictures in bytes.
const PICTURES: u64 = 32 << 20;
/// Bytes of the cache on disk.
const DISK: u64 = 1 << 30;

/// State that all calls share.
pub(super) struct State {
    pub(super) tools: Tools,
    pub(super) folders: Folders,
    pub(super) store: Store,
    settings: Settings,
    session: OnceLock<Option<Session>>,
}

impl State {
    pub(super) fn new(args: &McpArgs) -> Result<Self, String> {
        let folders = Folders::open(&args.read, &args.write)?;
        let tools = Tools { import_paths: Vec::new(), gate: folders.gate(), ..library::tools() };
        let cache_dir = environment::cache_dir().and_then(|dir| Some(dir.parent()?.join("shibo-mcp")));
        let (threads, memory) = (usize::from(args.threads), u64::from(args.memory) << 20);
        Ok(Self {
            tools,
            folders,
            store: Store::new(PICTURES),
            settings: Settings { threads, memory, cache_dir, disk: DISK },
            session: OnceLock::new(),
        })
    }

    /// The session, which starts with the first picture.
    pub(super) fn session(&self) -> Result<&Session, Refusal> {
        let session = self.session.get_or_init(|| Session::new(self.tools.registry.clone(), &self.settings).ok());
        session.as_ref().ok_or_else(|| Refusal::new("defect", "threads cannot be started", "lower `--threads`"))
    }
}
