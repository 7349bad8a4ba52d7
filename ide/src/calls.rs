//! Sources and readers of the entries of graphs, also in other files. In the words of editors, a reader calls its source.
use super::file::{File, Section, head_name};
use super::names::{Symbol, occurrences};
use super::navigate::{self, Thing, everywhere, meaning};
use super::structure::{self, Entry};
use super::types::Types;
use super::view::Item;
use super::walk::trail;
use super::world::Cx;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// The sections whose entries feed others.
const SECTIONS: [Section; 5] = [Section::Params, Section::Inputs, Section::Nodes, Section::Outputs, Section::Functions];

/// A parameter, an input, a node, an output or a function of a graph.
#[derive(Clone, Debug)]
pub struct GraphEntry {
    /// The graph.
    pub file: Arc<File>,
    /// Section of the entry.
    pub section: Section,
    /// Name; that of a function without brackets.
    pub name: String,
}

/// An entry at the other end of a reference, and the places of the references.
#[derive(Clone, Debug)]
pub struct Call {
    /// The entry.
    pub entry: GraphEntry,
    /// Ranges in the file of the entry that reads.
    pub ranges: Vec<Range<usize>>,
}

impl GraphEntry {
    /// The entry that declares a thing.
    fn of(thing: &Thing) -> Option<Self> {
        let (sections, name): (&[Section], _) = match &thing.symbol {
            Symbol::Node(name) => (&[Section::Nodes, Section::Inputs], name),
            Symbol::Param(name) => (&[Section::Params], name),
            Symbol::Output(name) => (&[Section::Outputs], name),
            Symbol::Function(name) => (&[Section::Functions], name),
            _ => return None,
        };
        let section = *sections.iter().find(|section| thing.file.entry(**section, name).is_some())?;
        Some(Self { file: thing.file.clone(), section, name: name.clone() })
    }

    /// The entry around a position of a graph.
    fn around(cx: Cx<'_>, file: &Arc<File>, at: usize) -> Option<Self> {
        let (section, item) = trail(cx.with(file), at).entry()?;
        let name = item.name().filter(|_| SECTIONS.contains(&section))?;
        let name = if section == Section::Functions { head_name(name) } else { name };
        Some(Self { file: file.clone(), section, name: name.to_owned() })
    }

    fn thing(&self) -> Thing {
        let name = self.name.clone();
        let symbol = match self.section {
            Section::Params => Symbol::Param(name),
            Section::Outputs => Symbol::Output(name),
            Section::Functions => Symbol::Function(name),
            _ => Symbol::Node(name),
        };
        Thing { file: self.file.clone(), symbol }
    }

    fn item(&self) -> Option<&Item> {
        self.file.entry(self.section, &self.name)
    }

    /// The entry as the outline shows it.
    pub fn outline(&self, cx: Cx<'_>) -> Option<Entry> {
        let cx = cx.with(&self.file);
        structure::child(cx, &Types::new(cx), self.section, self.item()?)
    }
}

/// Calls in the order of their first references.
#[derive(Default)]
struct Calls {
    list: Vec<Call>,
    known: BTreeMap<(PathBuf, Option<String>, Section, String), usize>,
}

impl Calls {
    fn add(&mut self, entry: Option<GraphEntry>, range: Range<usize>) {
        let Some(entry) = entry else { return };
        let GraphEntry { file, section, name } = &entry;
        let key = (file.path.clone(), file.local_name().map(str::to_owned), *section, name.clone());
        let index = *self.known.entry(key).or_insert(self.list.len());
        match self.list.get_mut(index) {
            Some(call) if call.ranges.contains(&range) => {}
            Some(call) => call.ranges.push(range),
            None => self.list.push(Call { entry, ranges: vec![range] }),
        }
    }
}

/// The entry at a position: the one that is named there, or else the one around it.
pub fn entry_at(cx: Cx<'_>, file: &File, at: usize) -> Option<GraphEntry> {
    let named = navigate::thing(cx, file, at).and_then(|(_, thing)| GraphEntry::of(&thing));
    named.or_else(|| GraphEntry::around(cx, &Arc::new(file.scope_at(at)), at))
}

/// The entries that read an entry. A `Use` reads the outputs of its graph.
pub fn readers(cx: Cx<'_>, entry: &GraphEntry) -> Vec<Call> {
    let thing = entry.thing();
    let mut calls = Calls::default();
    for (file, one) in everywhere(cx, &thing) {
        // A value that is given to a parameter or an input feeds it.
        if !one.declares && !matches!(one.symbol, Symbol::Given(..)) {
            calls.add(GraphEntry::around(cx, &file, one.range.start), one.range);
        }
    }
    if entry.section == Section::Outputs {
        for file in navigate::readers(cx, &thing) {
            for (graph, range) in used(cx.with(&file), &(0..file.text.len())) {
                if graph.is_same(&thing.file) {
                    calls.add(GraphEntry::around(cx, &file, range.start), range);
                }
            }
        }
    }
    calls.list
}

/// The entries that an entry reads. A parameter or an input of a graph reads what its users give it.
pub fn sources(cx: Cx<'_>, entry: &GraphEntry) -> Vec<Call> {
    let mut calls = Calls::default();
    let Some(item) = entry.item() else { return Vec::new() };
    let inner = cx.with(&entry.file);
    if let Some(value) = &item.value {
        for (found, range) in read_in(inner, &value.range) {
            calls.add(Some(found), range);
        }
        for (graph, range) in used(inner, &value.range) {
            for name in graph.names(Section::Outputs) {
                let output = GraphEntry { file: graph.clone(), section: Section::Outputs, name: name.to_owned() };
                calls.add(Some(output), range.clone());
            }
        }
    }
    if matches!(entry.section, Section::Params | Section::Inputs) {
        let place = item.key.as_ref().map_or(item.range.clone(), |key| key.range.clone());
        for (file, one) in
            everywhere(cx, &entry.thing()).into_iter().filter(|(_, o)| matches!(o.symbol, Symbol::Given(..)))
        {
            let outer = cx.with(&file);
            let given = trail(outer, one.range.start).last().and_then(|level| level.item?.value.as_ref());
            let found = given.map_or(Vec::new(), |value| read_in(outer, &value.range));
            // A number is given by the node itself.
            if found.is_empty() {
                calls.add(GraphEntry::around(cx, &file, one.range.start), place.clone());
            }
            found.into_iter().for_each(|(found, _)| calls.add(Some(found), place.clone()));
        }
    }
    calls.list
}

/// The entries named in a part of a graph, and where.
fn read_in(cx: Cx<'_>, part: &Range<usize>) -> Vec<(GraphEntry, Range<usize>)> {
    let inside = occurrences(cx).into_iter().filter(|one| !one.declares && part.contains(&one.range.start));
    let read = inside.filter(|one| !matches!(one.symbol, Symbol::Given(..) | Symbol::Import(_)));
    read.filter_map(|one| Some((GraphEntry::of(&meaning(cx, &one.symbol)?)?, one.range))).collect()
}

/// The graphs that the nodes in a part of a graph use, and where they name them.
fn used(cx: Cx<'_>, part: &Range<usize>) -> Vec<(Arc<File>, Range<usize>)> {
    let inside = occurrences(cx).into_iter().filter(|one| !one.declares && part.contains(&one.range.start));
    let graphs = inside.filter_map(|one| match &one.symbol {
        // In a formula, an import stands before the name of a function.
        Symbol::Import(name) if *name == *one.literal.1 => Some((cx.imported(name)?, one.range)),
        _ => None,
    });
    graphs.collect()
}
