//! Converts answers to the types of the protocol.
use super::state::Server;
use super::text::Lines;
use crate::rename::{Edit, Edits};
use crate::structure::Entry;
use crate::tokens::Token;
use crate::{Completion, Section, Sort};
use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionItemLabelDetails, CompletionItemTag, CompletionTextEdit, CreateFile,
    CreateFileOptions, DocumentChangeOperation, DocumentChanges, DocumentSymbol, InsertTextFormat, OneOf,
    OptionalVersionedTextDocumentIdentifier, ResourceOp, SemanticToken, SymbolKind, TextDocumentEdit, TextEdit,
    WorkspaceEdit,
};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Encodes tokens as differences to the previous token; tokens over several lines are left out.
pub(crate) fn tokens(tokens: &[(std::ops::Range<usize>, Token)], lines: &Lines) -> Vec<SemanticToken> {
    let (mut line, mut start) = (0, 0);
    let mut all = Vec::with_capacity(tokens.len());
    for (range, token) in tokens {
        let span = lines.span(range);
        if span.start.line != span.end.line || span.start == span.end {
            continue;
        }
        let down = span.start.line - line;
        let right = if down == 0 { span.start.character.saturating_sub(start) } else { span.start.character };
        (line, start) = (span.start.line, span.start.character);
        let token_type = Token::ALL.iter().position(|t| t == token).and_then(|i| u32::try_from(i).ok());
        all.push(SemanticToken {
            delta_line: down,
            delta_start: right,
            length: span.end.character - span.start.character,
            token_type: token_type.unwrap_or_default(),
            token_modifiers_bitset: u32::from(*token == Token::Node),
        });
    }
    all
}

/// Converts a completion; `index` is its rank.
pub(crate) fn completion(one: &Completion, index: usize, lines: &Lines, uri: &str, snippets: bool) -> CompletionItem {
    let kind = match one.sort {
        Sort::Kind => CompletionItemKind::CLASS,
        Sort::Node => CompletionItemKind::VARIABLE,
        Sort::Field => CompletionItemKind::FIELD,
        Sort::Choice => CompletionItemKind::ENUM_MEMBER,
        Sort::Param => CompletionItemKind::CONSTANT,
        Sort::Function => CompletionItemKind::FUNCTION,
        Sort::File => CompletionItemKind::FILE,
        Sort::Folder => CompletionItemKind::FOLDER,
        Sort::Color => CompletionItemKind::COLOR,
        Sort::Name => CompletionItemKind::MODULE,
        Sort::Value => CompletionItemKind::VALUE,
    };
    let (text, format) = match (one.snippet, snippets) {
        (true, true) => (one.insert.clone(), InsertTextFormat::SNIPPET),
        (true, false) => (plain(&one.insert), InsertTextFormat::PLAIN_TEXT),
        (false, _) => (one.insert.clone(), InsertTextFormat::PLAIN_TEXT),
    };
    let quoted = text.starts_with('"');
    CompletionItem {
        label: one.label.clone(),
        kind: Some(kind),
        label_details: Some(CompletionItemLabelDetails { detail: None, description: Some(short(&one.detail)) }),
        detail: (!one.detail.is_empty()).then(|| one.detail.clone()),
        sort_text: Some(format!("{index:05}")),
        filter_text: one.elsewhere.clone().or_else(|| quoted.then(|| format!("\"{}", one.label))),
        insert_text_format: Some(format),
        text_edit: Some(CompletionTextEdit::Edit(TextEdit::new(lines.span(&one.replace), text))),
        tags: one.deprecated.then(|| vec![CompletionItemTag::DEPRECATED]),
        data: Some(json!({ "uri": uri, "topic": one.topic })),
        ..CompletionItem::default()
    }
}

/// Shortens a text to a few words.
fn short(text: &str) -> String {
    if text.chars().count() > 48 { text.chars().take(47).chain(['…']).collect() } else { text.to_owned() }
}

/// Snippet text without placeholders.
fn plain(snippet: &str) -> String {
    let mut out = String::new();
    let mut chars = snippet.chars().peekable();
    while let Some(c) = chars.next() {
        if c != '$' {
            out.push(c);
            continue;
        }
        if chars.next_if_eq(&'{').is_some() {
            // `${1:text}` becomes `text`.
            let inner: String = chars.by_ref().take_while(|c| *c != '}').collect();
            out.push_str(inner.split_once(':').map_or("", |(_, text)| text));
        } else {
            while chars.next_if(char::is_ascii_digit).is_some() {}
        }
    }
    out
}

/// Converts an entry of the outline.
#[expect(deprecated, reason = "the protocol still has the field")]
pub(crate) fn symbol(entry: &Entry, lines: &Lines) -> DocumentSymbol {
    let children: Vec<DocumentSymbol> = entry.children.iter().map(|child| symbol(child, lines)).collect();
    DocumentSymbol {
        name: if entry.name.is_empty() { "\"\"".to_owned() } else { entry.name.clone() },
        detail: (!entry.detail.is_empty()).then(|| entry.detail.clone()),
        kind: symbol_kind(entry),
        tags: None,
        deprecated: None,
        range: lines.span(&entry.range),
        selection_range: lines.span(&entry.name_range),
        children: (!children.is_empty()).then_some(children),
    }
}

/// Symbol kind of an entry of the outline.
pub(crate) fn symbol_kind(entry: &Entry) -> SymbolKind {
    match entry.section {
        None => SymbolKind::NAMESPACE,
        Some(Section::Nodes) if entry.uses => SymbolKind::MODULE,
        Some(Section::Nodes) => SymbolKind::FUNCTION,
        Some(Section::Params) => SymbolKind::CONSTANT,
        Some(Section::Presets) => SymbolKind::ENUM_MEMBER,
        Some(Section::Inputs) => SymbolKind::INTERFACE,
        Some(Section::Imports) => SymbolKind::PACKAGE,
        Some(Section::Graphs) => SymbolKind::MODULE,
        Some(Section::Functions) => SymbolKind::METHOD,
        Some(Section::Outputs) => SymbolKind::EVENT,
    }
}

pub(crate) fn text_edits(edits: &[Edit], lines: &Lines) -> Vec<TextEdit> {
    edits.iter().map(|edit| TextEdit::new(lines.span(&edit.range), edit.text.clone())).collect()
}

/// Edits of several files, after the creation of new files. `None` if a file has no address.
pub(crate) fn workspace_edit(server: &Server, edits: &Edits, creates: &[(PathBuf, String)]) -> Option<WorkspaceEdit> {
    let mut operations = Vec::new();
    let mut changes = BTreeMap::new();
    for (path, text) in creates {
        let (uri, _) = server.address(path)?;
        let options = CreateFileOptions { overwrite: Some(false), ignore_if_exists: Some(false) };
        let create = CreateFile { uri: uri.clone(), options: Some(options), annotation_id: None };
        operations.push(DocumentChangeOperation::Op(ResourceOp::Create(create)));
        let start = lsp_types::Range::default();
        let edit = OneOf::Left(TextEdit::new(start, text.clone()));
        let text_document = OptionalVersionedTextDocumentIdentifier { uri, version: None };
        operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits: vec![edit] }));
    }
    for (path, edits) in edits {
        let (uri, version) = server.address(path)?;
        let edits = text_edits(edits, &server.lines(path)?);
        if creates.is_empty() {
            changes.insert(uri.as_str().to_owned(), edits);
            continue;
        }
        let text_document = OptionalVersionedTextDocumentIdentifier { uri, version };
        let edits = edits.into_iter().map(OneOf::Left).collect();
        operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits }));
    }
    if creates.is_empty() {
        return serde_json::from_value(json!({ "changes": changes })).ok();
    }
    let operations = Some(DocumentChanges::Operations(operations));
    Some(WorkspaceEdit { document_changes: operations, ..WorkspaceEdit::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn converts_snippets_to_plain_text() {
        assert_eq!(plain("Blur(input: \"$1\"$0)"), "Blur(input: \"\")");
        assert_eq!(plain("Number(default: ${1:0.5}, doc: \"$2\")$0"), "Number(default: 0.5, doc: \"\")");
    }
}
