//! The call hierarchy: sources and readers of an entry of a graph.
use super::answer::{Answer, json};
use super::convert;
use super::state::{Server, read};
use crate::calls::{self, Call, GraphEntry};
use crate::navigate::FileRange;
use crate::{Cx, Section, World};
use lsp_types::{
    CallHierarchyIncomingCall, CallHierarchyIncomingCallsParams, CallHierarchyItem, CallHierarchyOutgoingCall,
    CallHierarchyOutgoingCallsParams, CallHierarchyPrepareParams, Range as Span,
};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The entry of an item, which the editor sends back.
#[derive(Debug, Serialize, Deserialize)]
struct Data {
    path: PathBuf,
    /// Name of a local graph.
    graph: Option<String>,
    /// Key of the section.
    section: String,
    name: String,
}

/// Answers with the entry at a position.
pub(crate) fn prepare(server: &Server, params: CallHierarchyPrepareParams) -> Answer {
    let (document, at) = server.place(&params.text_document_position_params)?;
    let found = calls::entry_at(server.cx(document), &document.file, at);
    let items: Option<Vec<_>> = found.and_then(|entry| Some(vec![item(server, &entry)?]));
    json(items)
}

/// Answers with the readers of an item.
pub(crate) fn incoming(server: &Server, params: CallHierarchyIncomingCallsParams) -> Answer {
    let readers =
        entry(server, params.item.data).map_or(Vec::new(), |entry| calls::readers(cx(server, &entry), &entry));
    let call = |call: &Call| {
        let from_ranges = spans(server, &call.entry.file.path, &call.ranges)?;
        Some(CallHierarchyIncomingCall { from: item(server, &call.entry)?, from_ranges })
    };
    json(readers.iter().filter_map(call).collect::<Vec<_>>())
}

/// Answers with the entries that an item reads.
pub(crate) fn outgoing(server: &Server, params: CallHierarchyOutgoingCallsParams) -> Answer {
    let Some(entry) = entry(server, params.item.data) else { return json(Vec::<Json>::new()) };
    let call = |call: &Call| {
        let from_ranges = spans(server, &entry.file.path, &call.ranges)?;
        Some(CallHierarchyOutgoingCall { to: item(server, &call.entry)?, from_ranges })
    };
    json(calls::sources(cx(server, &entry), &entry).iter().filter_map(call).collect::<Vec<_>>())
}

fn cx<'a>(server: &'a Server, entry: &'a GraphEntry) -> Cx<'a> {
    Cx { world: &server.workspace, file: &entry.file }
}

fn spans(server: &Server, path: &Path, ranges: &[Range<usize>]) -> Option<Vec<Span>> {
    let lines = server.lines(path)?;
    Some(ranges.iter().map(|range| lines.span(range)).collect())
}

/// The item of an entry; `None` for a file without an address.
fn item(server: &Server, entry: &GraphEntry) -> Option<CallHierarchyItem> {
    let shown = entry.outline(cx(server, entry))?;
    let path = entry.file.path.clone();
    let lines = server.lines(&path)?;
    let copy = server.unpacked(FileRange { path: path.clone(), range: shown.range.clone(), declares: true });
    let (uri, _) = server.address(&copy.path)?;
    let graph = entry.file.local_name().map(str::to_owned);
    let data = Data { path, graph, section: entry.section.key().to_owned(), name: entry.name.clone() };
    Some(CallHierarchyItem {
        kind: convert::symbol_kind(&shown),
        tags: None,
        detail: (!shown.detail.is_empty()).then_some(shown.detail),
        uri,
        range: lines.span(&shown.range),
        selection_range: lines.span(&shown.name_range),
        name: shown.name,
        data: serde_json::to_value(data).ok(),
    })
}

/// The entry of an item, in the present text; `None` if it is gone.
fn entry(server: &Server, data: Option<Json>) -> Option<GraphEntry> {
    let Data { path, graph, section, name } = read(data?)?;
    let section = Section::ALL.into_iter().find(|known| known.key() == section)?;
    let file = server.workspace.file(&path)?;
    let scope = file.scopes().find(|scope| scope.local_name() == graph.as_deref())?;
    scope.entry(section, &name)?;
    Some(GraphEntry { file: Arc::new(scope), section, name })
}
