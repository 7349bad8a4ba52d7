//! Commands of the editor.
use super::answer::{Answer, Refusal};
use super::host::Command;
use super::state::Server;
use crate::lens::node_at;
use crate::{Cx, File, Section, World, identity};
use lsp_server::ErrorCode;
use lsp_types::{ExecuteCommandParams, MessageType, Position, ShowMessageParams, Uri};
use serde_json::Value as Json;
use std::path::Path;
use std::str::FromStr;

impl Server {
    /// Runs a command. The answer is immediate; slow work is done by the host.
    pub(crate) fn execute(&self, params: ExecuteCommandParams) -> Answer {
        if !self.host.runs_commands() {
            return Err(Refusal(ErrorCode::MethodNotFound, "no command can run here".to_owned()));
        }
        let bad = |text: &str| Refusal(ErrorCode::InvalidParams, text.to_owned());
        let uri = params.arguments.first().and_then(Json::as_str).and_then(|uri| Uri::from_str(uri).ok());
        let uri = uri.ok_or_else(|| bad("the first argument is the address of a graph file"))?;
        let path = super::uris::path(&uri);
        let name = self.named(&uri, params.arguments.get(1));
        match params.command.as_str() {
            "shibo.render" => {
                let name = name.ok_or_else(|| bad("the second argument is the name of an output"))?;
                self.host.run(Command::Render(path, name));
            }
            "shibo.preview" => {
                self.host.run(Command::Show(path, name.unwrap_or_default()));
            }
            "shibo.show" => {
                let node =
                    name.ok_or_else(|| bad("the second argument is the name of a node, or a position in one"))?;
                if !self.is_shown(&path, &node) {
                    let message =
                        format!("`{node}` is not in the saved file yet: save the file, or follow its text in the page");
                    self.tell("window/showMessage", ShowMessageParams { typ: MessageType::INFO, message });
                    return Ok(Json::Null);
                }
                self.host.run(Command::Show(path, format!("@{node}")));
            }
            "shibo.follow" | "shibo.unfollow" => {
                let path = self.document(&uri)?.file.path.clone();
                let follow = params.command == "shibo.follow";
                self.host.run(if follow { Command::Follow(path) } else { Command::Unfollow(path) });
            }
            other => return Err(Refusal(ErrorCode::InvalidParams, format!("there is no command `{other}`"))),
        }
        Ok(Json::Null)
    }

    /// Returns false if a node is in the text of the editor and is missing in the file on disk, which the page shows.
    fn is_shown(&self, path: &Path, node: &str) -> bool {
        if self.host.follows(&identity(path)) {
            return true;
        }
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
}
