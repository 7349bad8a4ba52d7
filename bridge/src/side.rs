//! One version of a graph: its text, tree and names.
use crate::{GraphText, Tools};
use shibo_graph::syntax::{Node, Tree};
use shibo_ide::names::{Occurrence, Symbol, occurrences, quote};
use shibo_ide::{Cx, File, Section, Workspace};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// New names of the symbols of each graph in a file; the key is the name of a local graph, or `None` for the file itself.
pub(crate) type NewNames = BTreeMap<Option<String>, BTreeMap<Symbol, String>>;

/// One version of a graph.
pub(crate) struct Side {
    file: Arc<File>,
    world: Workspace,
}

impl Side {
    /// Parses a text.
    pub(crate) fn new(tools: &Tools, graph: &GraphText) -> Self {
        let mut world =
            Workspace::new(tools.registry.clone(), Vec::new()).with_import_paths(tools.import_paths.clone());
        let file = world.open(&graph.path, graph.text.as_str());
        Self { file, world }
    }

    pub(crate) fn text(&self) -> &str {
        &self.file.text
    }

    pub(crate) fn tree(&self) -> &Tree {
        &self.file.tree
    }

    /// The files that the imports of the graph name.
    pub(crate) fn imports(&self) -> Vec<PathBuf> {
        let cx = Cx { world: &self.world, file: &self.file };
        let names = self.file.entries(Section::Imports).iter().filter_map(|item| item.key.as_ref());
        names.filter_map(|key| cx.import_path(&key.name)).collect()
    }

    /// The line of a byte, counted from 1.
    pub(crate) fn line(&self, at: usize) -> usize {
        self.text()[..at.min(self.text().len())].matches('\n').count() + 1
    }

    /// The values of the graphs in the file: of the file itself, and of its local graphs by name.
    pub(crate) fn graphs(&self) -> Vec<(Option<String>, Node<'_>)> {
        let Some(top) = self.tree().value() else { return Vec::new() };
        let locals = top.entry("graphs").and_then(Node::value).into_iter().flat_map(Node::entries);
        let locals = locals.filter_map(|entry| Some((Some(entry.key_text()?), entry.value()?)));
        std::iter::once((None, top)).chain(locals).collect()
    }

    /// All names of a graph of the file.
    pub(crate) fn names(&self, local: Option<&str>) -> Vec<Occurrence> {
        let scope = self.file.scopes().find(|scope| scope.local_name() == local);
        scope.map_or_else(Vec::new, |scope| occurrences(Cx { world: &self.world, file: &scope }))
    }

    /// The text with new names for symbols. `None` if a name would mean something else where a formula has the same local name.
    pub(crate) fn renamed(&self, names: &NewNames) -> Option<String> {
        let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
        for (local, names) in names {
            let mut escaped: BTreeMap<usize, Vec<(Occurrence, &String)>> = BTreeMap::new();
            for found in self.names(local.as_deref()) {
                if let Symbol::Local(_, name) = &found.symbol
                    && names.values().any(|new| new == name)
                {
                    return None;
                }
                let Some(new) = names.get(&found.symbol) else { continue };
                if found.is_escaped() {
                    escaped.entry(found.range.start).or_default().push((found, new));
                } else {
                    edits.push((found.range, new.clone()));
                }
            }
            for places in escaped.into_values() {
                let Some((range, says)) = places.first().map(|(first, _)| first.literal.clone()) else { continue };
                let mut says = says.to_string();
                places.iter().rev().for_each(|(place, new)| says.replace_range(place.within.clone(), new));
                edits.push((range, quote(&says)));
            }
        }
        edits.sort_by_key(|(range, _)| range.start);
        let mut text = self.text().to_owned();
        for (range, new) in edits.iter().rev() {
            text.replace_range(range.clone(), new);
        }
        Some(text)
    }
}
