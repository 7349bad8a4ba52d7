//! Code actions at a selection.
use super::answer::{Answer, Refusal};
use super::convert;
use super::state::Server;
use crate::actions::{Action, ActionKind, actions as offered};
use crate::diagnose::{Finding, Severity};
use lsp_server::ErrorCode;
use lsp_types::{
    CodeAction, CodeActionContext, CodeActionKind, CodeActionParams, CodeActionTriggerKind, Command, Diagnostic,
    NumberOrString,
};
use serde_json::{Value as Json, json};

/// Answers a request for code actions.
pub(crate) fn actions(server: &Server, params: &CodeActionParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let selected = document.lines.range(params.range);
    let told: Vec<&Diagnostic> =
        params.context.diagnostics.iter().filter(|d| d.source.as_deref() == Some("shibo")).collect();
    let findings: Vec<Finding> = told.iter().map(|d| finding(server, params, d)).collect::<Result<_, _>>()?;
    let mut list = Vec::new();
    for action in offered(server.cx(document), &selected, &findings) {
        let kind = kind(action.kind);
        let wanted = params.context.only.as_ref().is_none_or(|only| {
            only.iter().any(|only| only == &CodeActionKind::EMPTY || kind.as_str().starts_with(only.as_str()))
        });
        if !wanted || (!action.creates.is_empty() && !server.client.creates) {
            continue;
        }
        list.extend(code_action(server, &action, kind, &told));
    }
    list.extend(follow(server, params));
    serde_json::to_value(list).map_err(|error| Refusal(ErrorCode::InternalError, error.to_string()))
}

/// The action that shows the text on its page as it is typed, or that ends this. It is offered on demand only, as it fits any place.
fn follow(server: &Server, params: &CodeActionParams) -> Option<CodeAction> {
    let CodeActionContext { only, trigger_kind, .. } = &params.context;
    if !server.host.runs_commands() || only.is_some() || *trigger_kind == Some(CodeActionTriggerKind::AUTOMATIC) {
        return None;
    }
    let uri = &params.text_document.uri;
    let file = &server.document(uri).ok()?.file;
    if !file.is_graph() {
        return None;
    }
    let (title, command) = if server.host.follows(&file.path) {
        ("Stop following in the page", "shibo.unfollow")
    } else {
        ("Follow in the page", "shibo.follow")
    };
    let command = Command::new(title.to_owned(), command.to_owned(), Some(vec![json!(uri)]));
    Some(CodeAction { title: title.to_owned(), command: Some(command), ..CodeAction::default() })
}

fn code_action(server: &Server, action: &Action, kind: CodeActionKind, told: &[&Diagnostic]) -> Option<CodeAction> {
    Some(CodeAction {
        title: action.title.clone(),
        is_preferred: action.is_preferred.then_some(true),
        kind: Some(kind),
        diagnostics: action.mends.and_then(|index| Some(vec![(*told.get(index)?).clone()])),
        edit: Some(convert::workspace_edit(server, &action.edits, &action.creates)?),
        ..CodeAction::default()
    })
}

fn kind(kind: ActionKind) -> CodeActionKind {
    match kind {
        ActionKind::Fix => CodeActionKind::QUICKFIX,
        ActionKind::Extract => CodeActionKind::REFACTOR_EXTRACT,
        ActionKind::Inline => CodeActionKind::REFACTOR_INLINE,
        ActionKind::Rewrite => CodeActionKind::REFACTOR_REWRITE,
        ActionKind::Tidy => CodeActionKind::SOURCE,
    }
}

/// Restores a finding from the diagnostic that the editor sends back.
fn finding(server: &Server, params: &CodeActionParams, told: &Diagnostic) -> Result<Finding, Refusal> {
    let document = server.document(&params.text_document.uri)?;
    let data = told.data.clone().unwrap_or_default();
    let text = |key: &str| data[key].as_str().map(str::to_owned);
    // Some editors drop the data; the message then has the help on its second line.
    let (message, help) = match told.message.split_once('\n') {
        Some((message, help)) => (message.to_owned(), Some(help.to_owned())),
        None => (told.message.clone(), None),
    };
    let code = match &told.code {
        Some(NumberOrString::String(code)) => code.clone(),
        _ => String::new(),
    };
    let own = &params.text_document.uri;
    let related = told.related_information.iter().flatten().filter(|related| related.location.uri == *own);
    let path = server.document(own)?.file.path.clone();
    let related = related.map(|one| (path.clone(), document.lines.range(one.location.range), one.message.clone()));
    Ok(Finding {
        range: document.lines.range(told.range),
        severity: Severity::Error,
        unneeded: data["unneeded"] == Json::Bool(true) || code == "unused",
        code,
        message: text("message").unwrap_or(message),
        help: text("help").or(help),
        related: related.collect(),
        deprecated: false,
    })
}
