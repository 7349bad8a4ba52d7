//! Answers to requests.
use super::answer::{Answer, Refusal, json};
use super::convert;
use super::state::{Server, read};
use super::text::Lines;
use super::{actions, calls, uris};
use crate::{self as ide, File, Topic, World, colors, format, hover, inlay, lens, navigate, rename, structure, tokens};
use lsp_server::ErrorCode;
use lsp_types::{
    CodeActionParams, CodeLens, CodeLensParams, Color, ColorInformation, ColorPresentation, ColorPresentationParams,
    Command, CompletionItem, CompletionList, CompletionParams, DocumentColorParams, DocumentFormattingParams,
    DocumentHighlight, DocumentHighlightKind, DocumentHighlightParams, DocumentLink, DocumentLinkParams,
    DocumentRangeFormattingParams, DocumentSymbolParams, Documentation, ExecuteCommandParams, FoldingRange,
    FoldingRangeKind, FoldingRangeParams, GotoDefinitionParams, Hover, HoverContents, HoverParams, InlayHint,
    InlayHintKind, InlayHintLabel, InlayHintParams, Location, MarkupContent, MarkupKind, ParameterInformation,
    ParameterLabel, PrepareRenameResponse, ReferenceParams, RenameParams, SelectionRange, SelectionRangeParams,
    SemanticTokens, SemanticTokensParams, SemanticTokensRangeParams, SignatureHelp, SignatureHelpParams,
    SignatureInformation, SymbolInformation, TextDocumentPositionParams, TextEdit, Uri, WorkspaceSymbolParams,
};
use serde::de::DeserializeOwned;
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Maximum number of workspace symbols in one answer.
const SYMBOLS: usize = 500;

/// Answers a request.
pub(crate) fn answer(server: &mut Server, method: &str, params: Json) -> Answer {
    match method {
        "textDocument/completion" => completion(server, wanted(params)?),
        "completionItem/resolve" => resolve(server, wanted(params)?),
        "textDocument/hover" => hover(server, wanted(params)?),
        "textDocument/signatureHelp" => signature(server, wanted(params)?),
        "textDocument/definition" => definition(server, wanted(params)?),
        "textDocument/references" => references(server, wanted(params)?),
        "textDocument/documentHighlight" => highlight(server, wanted(params)?),
        "textDocument/prepareCallHierarchy" => calls::prepare(server, wanted(params)?),
        "callHierarchy/incomingCalls" => calls::incoming(server, wanted(params)?),
        "callHierarchy/outgoingCalls" => calls::outgoing(server, wanted(params)?),
        "textDocument/prepareRename" => prepare_rename(server, wanted(params)?),
        "textDocument/rename" => rename(server, wanted(params)?),
        "textDocument/codeAction" => actions::actions(server, &wanted::<CodeActionParams>(params)?),
        "textDocument/documentColor" => color(server, wanted(params)?),
        "textDocument/colorPresentation" => color_presentation(server, wanted(params)?),
        "textDocument/inlayHint" => inlays(server, wanted(params)?),
        "textDocument/documentSymbol" => symbols(server, wanted(params)?),
        "workspace/symbol" => workspace_symbols(server, wanted(params)?),
        "textDocument/foldingRange" => folds(server, wanted(params)?),
        "textDocument/selectionRange" => selections(server, wanted(params)?),
        "textDocument/documentLink" => links(server, wanted(params)?),
        "textDocument/semanticTokens/full" => semantic_tokens(server, wanted(params)?),
        "textDocument/semanticTokens/range" => semantic_tokens_in(server, wanted(params)?),
        "textDocument/codeLens" => lenses(server, wanted(params)?),
        "textDocument/formatting" => formatted(server, wanted(params)?),
        "textDocument/rangeFormatting" => formatted_part(server, wanted(params)?),
        "workspace/executeCommand" => server.execute(wanted::<ExecuteCommandParams>(params)?),
        _ => Err(Refusal(ErrorCode::MethodNotFound, format!("there is no request `{method}`"))),
    }
}

fn wanted<T: DeserializeOwned>(params: Json) -> Result<T, Refusal> {
    read(params).ok_or_else(|| Refusal(ErrorCode::InvalidParams, "the request is malformed".to_owned()))
}

fn markdown(value: String) -> MarkupContent {
    MarkupContent { kind: MarkupKind::Markdown, value }
}

fn completion(server: &Server, params: CompletionParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position)?;
    let uri = document.uri.as_str();
    let snippets = server.client.snippets;
    let offers = ide::complete(server.cx(document), at);
    let item = |(i, one)| convert::completion(one, i, &document.lines, uri, snippets);
    let items = offers.iter().enumerate().map(item).collect();
    // Incomplete, so that the editor asks again and the ranking follows each typed letter.
    json(CompletionList { is_incomplete: true, items })
}

fn resolve(server: &Server, mut item: CompletionItem) -> Answer {
    let data = item.data.clone().unwrap_or_default();
    let topic: Option<Topic> = read(data["topic"].clone());
    let uri: Option<Uri> = read(data["uri"].clone());
    if let (Some(topic), Some(uri)) = (topic, uri)
        && let Ok(document) = server.document(&uri)
    {
        let text = ide::manual(server.cx(document), &topic, &*server.host.pictures(&server.workspace));
        item.documentation = (!text.is_empty()).then(|| Documentation::MarkupContent(markdown(text)));
    }
    json(item)
}

fn hover(server: &Server, params: HoverParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position_params)?;
    let found = hover::hover(server.cx(document), at, &*server.host.pictures(&server.workspace));
    json(found.map(|found| Hover {
        contents: HoverContents::Markup(markdown(found.markdown)),
        range: Some(document.lines.span(&found.range)),
    }))
}

fn signature(server: &Server, params: SignatureHelpParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position_params)?;
    let Some(found) = ide::signature(server.cx(document), at) else { return json(Json::Null) };
    let active = found.active.and_then(|i| u32::try_from(i).ok());
    // Offsets in labels count UTF-16 units.
    let units = |at: usize| {
        let count = found.label.get(..at).map_or(0, |text| text.encode_utf16().count());
        u32::try_from(count).unwrap_or(u32::MAX)
    };
    let parameters = found.fields.iter().map(|(range, doc)| ParameterInformation {
        label: ParameterLabel::LabelOffsets([units(range.start), units(range.end)]),
        documentation: Some(Documentation::MarkupContent(markdown(doc.clone()))),
    });
    let signature = SignatureInformation {
        label: found.label.clone(),
        documentation: Some(Documentation::MarkupContent(markdown(found.doc.clone()))),
        parameters: Some(parameters.collect()),
        active_parameter: active,
    };
    json(SignatureHelp { signatures: vec![signature], active_signature: Some(0), active_parameter: active })
}

/// The lines of files that were read for an answer.
type Known = BTreeMap<PathBuf, Lines>;

fn location(server: &Server, place: &navigate::FileRange, known: &mut Known) -> Option<Location> {
    let (uri, _) = server.address(&place.path)?;
    if place.range.is_empty() {
        return Some(Location::new(uri, lsp_types::Range::default()));
    }
    if !known.contains_key(&place.path) {
        known.insert(place.path.clone(), server.lines(&place.path)?);
    }
    Some(Location::new(uri, known.get(&place.path)?.span(&place.range)))
}

fn definition(server: &Server, params: GotoDefinitionParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position_params)?;
    let found = navigate::definition(server.cx(document), &document.file, at);
    let found = found.map(|(_, place)| server.unpacked(place));
    json(found.and_then(|place| location(server, &place, &mut Known::new())))
}

fn references(server: &Server, params: ReferenceParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position)?;
    let mut places = navigate::references(server.cx(document), &document.file, at);
    places.retain(|place| params.context.include_declaration || !place.declares);
    let mut known = Known::new();
    json(places.iter().filter_map(|place| location(server, place, &mut known)).collect::<Vec<_>>())
}

fn highlight(server: &Server, params: DocumentHighlightParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position_params)?;
    let found = navigate::highlight(server.cx(document), at).into_iter().map(|(range, declares)| DocumentHighlight {
        range: document.lines.span(&range),
        kind: Some(if declares { DocumentHighlightKind::WRITE } else { DocumentHighlightKind::READ }),
    });
    json(found.collect::<Vec<_>>())
}

fn prepare_rename(server: &Server, params: TextDocumentPositionParams) -> Answer {
    let (document, at) = server.place(&params)?;
    let (range, placeholder) = rename::prepare(server.cx(document), &document.file, at).map_err(Refusal::because)?;
    json(PrepareRenameResponse::RangeWithPlaceholder { range: document.lines.span(&range), placeholder })
}

fn rename(server: &Server, params: RenameParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position)?;
    server.workspace.rescan();
    let edits = rename::rename(server.cx(document), &document.file, at, &params.new_name).map_err(Refusal::because)?;
    json(convert::workspace_edit(server, &edits, &[]))
}

fn color(server: &Server, params: DocumentColorParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let swatches = colors::swatches(server.cx(document)).into_iter().map(|(range, [red, green, blue])| {
        ColorInformation { range: document.lines.span(&range), color: Color { red, green, blue, alpha: 1.0 } }
    });
    json(swatches.collect::<Vec<_>>())
}

fn color_presentation(server: &Server, params: ColorPresentationParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let range = document.lines.range(params.range);
    let Color { red, green, blue, .. } = params.color;
    let text = colors::written(server.cx(document), &range, [red, green, blue]);
    let edit = TextEdit::new(document.lines.span(&range), text.clone());
    json([ColorPresentation { label: text, text_edit: Some(edit), additional_text_edits: None }])
}

fn inlays(server: &Server, params: InlayHintParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let range = document.lines.range(params.range);
    let found = inlay::inlays(server.cx(document), &range, server.options.inlay_hints);
    let hints = found.into_iter().map(|one| InlayHint {
        position: document.lines.position(one.at),
        label: InlayHintLabel::String(one.text),
        kind: one.is_type.then_some(InlayHintKind::TYPE),
        text_edits: None,
        tooltip: None,
        padding_left: Some(false),
        padding_right: Some(false),
        data: None,
    });
    json(hints.collect::<Vec<_>>())
}

fn symbols(server: &Server, params: DocumentSymbolParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let outline = structure::outline(server.cx(document));
    json(outline.iter().map(|entry| convert::symbol(entry, &document.lines)).collect::<Vec<_>>())
}

#[expect(deprecated, reason = "the protocol still has the field")]
fn workspace_symbols(server: &Server, params: WorkspaceSymbolParams) -> Answer {
    let wanted = params.query.to_lowercase();
    let mut found = Vec::new();
    for file in server.workspace.graphs() {
        let Some(((uri, _), lines)) = server.address(&file.path).zip(server.lines(&file.path)) else { continue };
        let sections = structure::outline(ide::Cx { world: &server.workspace, file: &file });
        for entry in sections.iter().flat_map(|section| &section.children) {
            if found.len() < SYMBOLS && entry.name.to_lowercase().contains(&wanted) {
                found.push(SymbolInformation {
                    name: entry.name.clone(),
                    kind: convert::symbol_kind(entry),
                    tags: None,
                    deprecated: None,
                    location: Location::new(uri.clone(), lines.span(&entry.name_range)),
                    container_name: file.path.file_name().map(|name| name.to_string_lossy().into_owned()),
                });
            }
        }
    }
    json(found)
}

fn folds(server: &Server, params: FoldingRangeParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let folds = structure::folds(server.cx(document)).into_iter().filter_map(|(range, comment)| {
        let span = document.lines.span(&range);
        // The fold keeps the line of a closing bracket visible.
        let closes = document.file.text[..range.end].ends_with([')', ']', '}']);
        let end_line = if closes && !comment { span.end.line.saturating_sub(1) } else { span.end.line };
        (end_line > span.start.line).then_some(FoldingRange {
            start_line: span.start.line,
            end_line,
            kind: Some(if comment { FoldingRangeKind::Comment } else { FoldingRangeKind::Region }),
            ..FoldingRange::default()
        })
    });
    json(folds.collect::<Vec<_>>())
}

fn selections(server: &Server, params: SelectionRangeParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let one = |position| {
        let at = document.lines.offset(position);
        let ranges = structure::selections(server.cx(document), at);
        let around = ranges.iter().rev().fold(None, |parent: Option<Box<SelectionRange>>, range| {
            Some(Box::new(SelectionRange { range: document.lines.span(range), parent }))
        });
        let here = lsp_types::Range::new(position, position);
        around.map_or(SelectionRange { range: here, parent: None }, |range| *range)
    };
    json(params.positions.into_iter().map(one).collect::<Vec<_>>())
}

fn links(server: &Server, params: DocumentLinkParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let links = structure::links(server.cx(document)).into_iter().filter_map(|(range, path)| {
        let (target, _) = server.address(&path)?;
        let range = document.lines.span(&range);
        Some(DocumentLink { range, target: Some(target), tooltip: None, data: None })
    });
    json(links.collect::<Vec<_>>())
}

fn semantic_tokens(server: &Server, params: SemanticTokensParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let found = tokens::tokens(server.cx(document));
    json(SemanticTokens { result_id: None, data: convert::tokens(&found, &document.lines) })
}

fn semantic_tokens_in(server: &Server, params: SemanticTokensRangeParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let part = document.lines.range(params.range);
    let mut found = tokens::tokens(server.cx(document));
    found.retain(|(range, _)| range.start <= part.end && part.start <= range.end);
    json(SemanticTokens { result_id: None, data: convert::tokens(&found, &document.lines) })
}

fn lenses(server: &Server, params: CodeLensParams) -> Answer {
    if server.options.code_lens == Some(false) || !server.host.runs_commands() {
        return json(Vec::<CodeLens>::new());
    }
    let document = server.document(&params.text_document.uri)?;
    let lens = |one: lens::Lens| {
        let (title, command) = match one.act {
            lens::Act::Render => ("render", "shibo.render"),
            lens::Act::Preview => ("preview", "shibo.preview"),
            lens::Act::Show => ("show in preview", "shibo.show"),
        };
        let arguments = Some(vec![json!(document.uri), json!(one.name)]);
        let command = Command { title: title.to_owned(), command: command.to_owned(), arguments };
        CodeLens { range: document.lines.span(&one.range), command: Some(command), data: None }
    };
    json(lens::lenses(server.cx(document)).into_iter().map(lens).collect::<Vec<_>>())
}

fn formatted(server: &Server, params: DocumentFormattingParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let edits = document.file.is_graph().then(|| format::format_all(&document.file.text)).flatten();
    json(convert::text_edits(&edits.unwrap_or_default(), &document.lines))
}

fn formatted_part(server: &Server, params: DocumentRangeFormattingParams) -> Answer {
    let document = server.document(&params.text_document.uri)?;
    let part = document.lines.range(params.range);
    let edits = document.file.is_graph().then(|| format::format_part(&document.file.text, part)).flatten();
    json(convert::text_edits(&edits.unwrap_or_default(), &document.lines))
}

impl Server {
    /// Replaces a library graph, which the editor cannot open, by a copy.
    pub(super) fn unpacked(&self, place: navigate::FileRange) -> navigate::FileRange {
        let inside = place.path.to_str().and_then(|path| path.strip_prefix("shibo:"));
        let library = self.workspace.registry().library();
        let Some((inside, library)) = inside.zip(library) else { return place };
        let Some(content) = library.file(inside.trim_start_matches('/')) else { return place };
        let name = inside.rsplit('/').next().unwrap_or(inside);
        match self.host.copy(name, content) {
            Some(path) => navigate::FileRange { path, ..place },
            None => place,
        }
    }

    /// The file of an address, open or on disk.
    pub(crate) fn file_of(&self, uri: &Uri) -> Option<Arc<File>> {
        let open = self.documents.get(uri.as_str()).map(|document| document.file.clone());
        open.or_else(|| self.workspace.file(&uris::path(uri)))
    }
}
