//! Commands of the editor, and messages of threads.
use super::answer::{Answer, Refusal};
use super::event::Jump;
use super::server::Server;
use crate::serve::open_browser;
use lsp_server::ErrorCode;
use lsp_types::{ExecuteCommandParams, MessageType, Position, Range, ShowDocumentParams, ShowMessageParams, Uri};
use serde_json::Value as Json;
use shibo_ide::lens::node_at;
use shibo_ide::{Cx, File, Section, World, identity};
use std::path::Path;
use std::str::FromStr;
use std::thread;

impl Server {
    /// Runs a command. The answer is immediate; slow work is done by a thread.
    pub(super) fn execute(&self, params: ExecuteCommandParams) -> Answer {
        let bad = |text: &str| Refusal(ErrorCode::InvalidParams, text.to_owned());
        let uri = params.arguments.first().and_then(Json::as_str).and_then(|uri| Uri::from_str(uri).ok());
        let uri = uri.ok_or_else(|| bad("the first argument is the address of a graph file"))?;
        let path = super::uris::path(&uri);
        let pages = self.pages.clone();
        let name = self.named(&uri, params.arguments.get(1));
        match params.command.as_str() {
            "shibo.render" => {
                let name = name.ok_or_else(|| bad("the second argument is the name of an output"))?;
                thread::spawn(move || pages.render(&path, &name));
            }
            "shibo.preview" => {
                let target = name.unwrap_or_default();
                thread::spawn(move || pages.show(&path, &target));
            }
            "shibo.show" => {
                let node =
                    name.ok_or_else(|| bad("the second argument is the name of a node, or a position in one"))?;
                if !self.is_saved(&path, &node) {
                    let message =
                        format!("`{node}` is not in the saved file yet: save the file, then the page can show it");
                    self.tell("window/showMessage", ShowMessageParams { typ: MessageType::INFO, message });
                    return Ok(Json::Null);
                }
                thread::spawn(move || pages.show(&path, &format!("@{node}")));
            }
            other => return Err(Refusal(ErrorCode::InvalidParams, format!("there is no command `{other}`"))),
        }
        Ok(Json::Null)
    }

    /// Returns false if a node is in the text of the editor and is missing in the file on disk, which the page shows.
    fn is_saved(&self, path: &Path, node: &str) -> bool {
        let name = node.split(['.', '/']).next().unwrap_or_default();
        let has = |file: &File| file.entry(Section::Nodes, name).is_some();
        let Ok(saved) = std::fs::read_to_string(path) else { return true };
        let open = self.workspace.file(path).is_some_and(|file| has(&file));
        !open || has(&File::new(path, saved))
    }

    /// Name given to a command, as a text or as a cursor position.
    fn named(&self, uri: &Uri, argument: Option<&Json>) -> Option<String> {
        let argument = argument?;
        if let Some(name) = argument.as_str() {
            return Some(name.to_owned());
        }
        let position: Position = serde_json::from_value(argument.clone()).ok()?;
        let file = self.file_of(uri)?;
        let at = self.lines(&file.path)?.offset(position);
        node_at(Cx { world: &self.workspace, file: &file }, at)
    }

    /// Handles a message from a thread.
    pub(super) fn jump(&mut self, jump: &Jump) {
        match jump {
            Jump::To(path, line, column) => {
                let Some((uri, _)) = self.address(&identity(path)) else { return };
                // Columns count characters. Usually only names precede a kind, so columns are mostly the same in all
                // encodings.
                let at = Position::new(line.saturating_sub(1), column.saturating_sub(1));
                let selection = Some(Range::new(at, at));
                if self.client.shows {
                    let params = ShowDocumentParams { uri, external: Some(false), take_focus: Some(true), selection };
                    self.ask("window/showDocument", params);
                }
            }
            Jump::Open(url) => {
                if let (true, Ok(uri)) = (self.client.shows, Uri::from_str(url)) {
                    let params =
                        ShowDocumentParams { uri, external: Some(true), take_focus: Some(false), selection: None };
                    self.ask("window/showDocument", params);
                } else {
                    open_browser(url);
                }
            }
            Jump::Say(kind, text) => {
                self.tell("window/showMessage", ShowMessageParams { typ: *kind, message: text.clone() });
            }
        }
    }
}
