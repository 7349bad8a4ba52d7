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
    /// Changes texts for the server.
    pub(crate) applies: bool,
    /// Compares the version of a text before it changes it.
    pub(crate) versions: bool,
}

impl Client {
    pub(crate) fn of(capabilities: &ClientCapabilities) -> Self {
        let item =
            || capabilities.text_document.as_ref()?.completion.as_ref()?.completion_item.as_ref()?.snippet_support;
        let workspace = capabilities.workspace.as_ref();
        let edit = workspace.and_then(|workspace| workspace.workspace_edit.as_ref());
        let operations = edit.and_then(|edit| edit.resource_operations.as_ref());
        let show = || capabilities.window.as_ref()?.show_document.as_ref();
        Self {
            snippets: item().unwrap_or(false),
            creates: operations.is_some_and(|operations| operations.contains(&ResourceOperationKind::Create)),
            shows: show().is_some_and(|show| show.support),
            applies: workspace.and_then(|workspace| workspace.apply_edit).unwrap_or(false),
            versions: edit.and_then(|edit| edit.document_changes).unwrap_or(false),
        }
    }
}
