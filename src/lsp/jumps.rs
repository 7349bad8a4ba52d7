//! Messages of threads for the editor.
use super::event::Jump;
use crate::serve::open_browser;
use lsp_types::{Position, Range, ShowDocumentParams, ShowMessageParams, Uri};
use shibo_ide::identity;
use shibo_ide::server::Server;
use std::str::FromStr;

/// Handles a message from a thread.
pub(super) fn handle(server: &mut Server, jump: &Jump) {
    match jump {
        Jump::To(path, line, column) => {
            let Some((uri, _)) = server.address(&identity(path)) else { return };
            // Columns count characters. Usually only names precede a kind, so columns are mostly the same in all
            // encodings.
            let at = Position::new(line.saturating_sub(1), column.saturating_sub(1));
            let selection = Some(Range::new(at, at));
            if server.client.shows {
                let params = ShowDocumentParams { uri, external: Some(false), take_focus: Some(true), selection };
                server.ask("window/showDocument", params);
            }
        }
        Jump::Open(url) => {
            if let (true, Ok(uri)) = (server.client.shows, Uri::from_str(url)) {
                let params = ShowDocumentParams { uri, external: Some(true), take_focus: Some(false), selection: None };
                server.ask("window/showDocument", params);
            } else {
                open_browser(url);
            }
        }
        Jump::Say(kind, text) => {
            server.tell("window/showMessage", ShowMessageParams { typ: *kind, message: text.clone() });
        }
    }
}
