//! The capabilities of the server, for the answer to `initialize`.
use super::text::Encoding;
use crate::tokens::Token;
use lsp_types::SemanticTokenType;
use serde_json::{Value as Json, json};

/// Commands that the server runs.
const COMMANDS: [&str; 5] = ["shibo.render", "shibo.preview", "shibo.show", "shibo.follow", "shibo.unfollow"];

/// Capabilities of the server.
pub(crate) fn capabilities(encoding: Encoding, runs_commands: bool) -> Json {
    let legend: Vec<SemanticTokenType> = Token::ALL.iter().map(|token| token_type(*token)).collect();
    let mut all = json!({
        "positionEncoding": encoding.kind(),
        "textDocumentSync": { "openClose": true, "change": 2, "save": { "includeText": false } },
        "completionProvider": {
            "triggerCharacters": ["\"", "$", ".", ":", "(", "=", "/", "#", "["],
            "resolveProvider": true,
            "completionItem": { "labelDetailsSupport": true },
        },
        "hoverProvider": true,
        "signatureHelpProvider": { "triggerCharacters": ["(", ","] },
        "definitionProvider": true,
        "referencesProvider": true,
        "documentHighlightProvider": true,
        "callHierarchyProvider": true,
        "renameProvider": { "prepareProvider": true },
        "codeActionProvider": {
            "codeActionKinds": ["quickfix", "refactor.extract", "refactor.inline", "refactor.rewrite", "source"],
        },
        "colorProvider": true,
        "inlayHintProvider": true,
        "documentSymbolProvider": true,
        "workspaceSymbolProvider": true,
        "foldingRangeProvider": true,
        "selectionRangeProvider": true,
        "documentLinkProvider": {},
        "semanticTokensProvider": {
            "legend": { "tokenTypes": legend, "tokenModifiers": ["declaration"] },
            "full": true,
            "range": true,
        },
        "documentFormattingProvider": true,
        "documentRangeFormattingProvider": true,
        "workspace": { "workspaceFolders": { "supported": true, "changeNotifications": true } },
    });
    if runs_commands {
        all["codeLensProvider"] = json!({});
        all["executeCommandProvider"] = json!({ "commands": COMMANDS });
    }
    all
}

/// Standard token type, for which editors have colours.
fn token_type(token: Token) -> SemanticTokenType {
    match token {
        Token::Section => SemanticTokenType::KEYWORD,
        Token::Kind => SemanticTokenType::CLASS,
        Token::Field => SemanticTokenType::PROPERTY,
        Token::Node => SemanticTokenType::FUNCTION,
        Token::Reference => SemanticTokenType::VARIABLE,
        Token::Port => SemanticTokenType::METHOD,
        Token::Param => SemanticTokenType::PARAMETER,
        Token::Choice => SemanticTokenType::ENUM_MEMBER,
        Token::Function => SemanticTokenType::MACRO,
        Token::Unit => SemanticTokenType::COMMENT,
        Token::Number => SemanticTokenType::NUMBER,
        Token::Operator => SemanticTokenType::OPERATOR,
        Token::Local => SemanticTokenType::PARAMETER,
        Token::Place => SemanticTokenType::ENUM_MEMBER,
        Token::Keyword => SemanticTokenType::KEYWORD,
    }
}
