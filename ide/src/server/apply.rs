//! Changes of texts that the editor makes for the server, so that they can be undone there.
use super::convert;
use super::state::Server;
use crate::rename::Edit;
use lsp_server::RequestId;
use serde_json::json;
use std::path::Path;

impl Server {
    /// The text of a file that is open in the editor.
    pub fn open_text(&self, path: &Path) -> Option<&str> {
        Some(&self.documents.values().find(|document| document.file.path == path)?.file.text)
    }

    /// Asks the editor to change an open text; `label` names the change. Returns the number of the request.
    ///
    /// # Errors
    /// The reason why the editor cannot be asked.
    pub fn apply(&mut self, path: &Path, label: &str, edits: &[Edit]) -> Result<RequestId, String> {
        if !self.client.applies {
            return Err("this editor takes no changes from outside".to_owned());
        }
        let document = self.documents.values().find(|document| document.file.path == path);
        let document = document.ok_or_else(|| "the editor has closed the file".to_owned())?;
        let (uri, edits) = (document.uri.clone(), convert::text_edits(edits, &document.lines));
        // With a version, an editor whose text has changed meanwhile refuses.
        let edit = if self.client.versions {
            let document = json!({ "uri": uri, "version": document.version });
            json!({ "documentChanges": [{ "textDocument": document, "edits": edits }] })
        } else {
            json!({ "changes": { uri.as_str(): edits } })
        };
        Ok(self.ask("workspace/applyEdit", json!({ "label": label, "edit": edit })))
    }
}
