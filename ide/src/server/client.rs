//! Capabilities of the editor.
use lsp_types::{ClientCapabilities, ResourceOperationKind};

/// Capabilities of the editor.
#[derive(Clone, Copy, Debug, Default)]
pub struct Client {
    /// Supports snippets.
    pub(crate) snippets: bool,
    /// Can create files in a workspace edit.
    pub(crate) creates: bool,
    /// Can show files and pages.
    pub shows: bool,
}

impl Client {
    pub(crate) fn of(capabilities: &ClientCapabilities) -> Self {
        let item =
            || capabilities.text_document.as_ref()?.completion.as_ref()?.completion_item.as_ref()?.snippet_support;
        let edit = || capabilities.workspace.as_ref()?.workspace_edit.as_ref()?.resource_operations.as_ref();
        let show = || capabilities.window.as_ref()?.show_document.as_ref();
        Self {
            snippets: item().unwrap_or(false),
            creates: edit().is_some_and(|operations| operations.contains(&ResourceOperationKind::Create)),
            shows: show().is_some_and(|show| show.support),
        }
    }
}
