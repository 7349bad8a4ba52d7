//! Changes of pages that the editor makes, so that they can be undone there.
use super::event::PageEdit;
use crate::serve::sha256;
use lsp_server::{RequestId, Response};
use shibo_ide::format::change;
use shibo_ide::server::Server;
use std::collections::HashMap;
use std::sync::mpsc::Sender;

/// The changes that the editor has not answered yet.
#[derive(Default)]
pub(super) struct Edits(HashMap<RequestId, Sender<Result<(), String>>>);

impl Edits {
    /// Asks the editor to make a change.
    pub(super) fn ask(&mut self, server: &mut Server, edit: PageEdit) {
        match begin(server, &edit) {
            Ok(Some(id)) => drop(self.0.insert(id, edit.answer)),
            Ok(None) => drop(edit.answer.send(Ok(()))),
            Err(why) => drop(edit.answer.send(Err(why))),
        }
    }

    /// Takes an answer of the editor.
    pub(super) fn take(&mut self, response: &Response) {
        let Some(answer) = self.0.remove(&response.id) else { return };
        let result = match &response.response_result {
            Ok(result) if result["applied"] == true => Ok(()),
            Ok(result) => Err(result["failureReason"].as_str().unwrap_or("the editor refuses the change").to_owned()),
            Err(error) => Err(error.message.clone()),
        };
        let _ = answer.send(result);
    }
}

/// Sends the request, if the change changes anything.
fn begin(server: &mut Server, edit: &PageEdit) -> Result<Option<RequestId>, String> {
    let open = server.open_text(&edit.path).ok_or("the editor has closed the file")?;
    if sha256(open) != edit.base {
        return Err("the text in the editor has changed meanwhile".to_owned());
    }
    match change(open, &(0..open.len()), &edit.text) {
        Some(change) => server.apply(&edit.path, "Save of the page", &[change]).map(Some),
        None => Ok(None),
    }
}
