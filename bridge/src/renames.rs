//! Names that changed while the content stayed equal.
use crate::shape::canonical;
use crate::side::{NewNames, Side};
use shibo_graph::syntax::{Node, NodeKind};
use shibo_ide::Section;
use shibo_ide::names::Symbol;
use std::collections::{BTreeMap, BTreeSet};

/// A thing that has the same content under a new name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Rename {
    /// The local graph that contains it; `None` for the file itself.
    pub(crate) local: Option<String>,
    /// Its section.
    pub(crate) section: Section,
    pub(crate) before: String,
    pub(crate) after: String,
}

impl Rename {
    /// The symbol before.
    pub(crate) fn symbol(&self) -> Symbol {
        symbol(self.section, self.before.clone())
    }
}

/// The symbol of a name that a section declares.
pub(crate) fn symbol(section: Section, name: String) -> Symbol {
    match section {
        Section::Nodes | Section::Inputs => Symbol::Node(name),
        Section::Params => Symbol::Param(name),
        Section::Imports | Section::Graphs => Symbol::Import(name),
        Section::Functions => Symbol::Function(name),
        Section::Outputs => Symbol::Output(name),
        Section::Presets => Symbol::Preset(name),
    }
}

/// Declarations of a section: name without the values of a function, and the value.
fn declared<'t>(graph: Node<'t>, section: Section) -> Vec<(String, Node<'t>)> {
    let entries = graph.entry(section.key()).and_then(Node::value).into_iter().flat_map(Node::entries);
    let mut found: Vec<_> =
        entries.filter_map(|entry| Some((name_in(section, &entry.key_text()?).to_owned(), entry.value()?))).collect();
    let mut seen = BTreeSet::new();
    found.retain(|(name, _)| seen.insert(name.clone()));
    found
}

/// The name that a key of a section declares: that of a function is the part before its values.
pub(crate) fn name_in(section: Section, key: &str) -> &str {
    if section == Section::Functions { key.split('(').next().unwrap_or_default().trim() } else { key }
}

/// Things of one version that the other version has under new names, with equal content.
///
/// Things with equal content are taken in the order of the text, or not at all if `unique`. Names that a renamed thing reads
/// may be renamed too, so the search is repeated with the names found so far.
pub(crate) fn renames(before: &Side, after: &Side, unique: bool) -> Vec<Rename> {
    let (mut before_graphs, after_graphs) = (before.graphs(), after.graphs());
    before_graphs.retain(|(name, _)| after_graphs.iter().any(|(other, _)| other == name));
    let mut found = Vec::new();
    for (local, graph) in before_graphs {
        let Some((_, other)) = after_graphs.iter().find(|(name, _)| *name == local) else { continue };
        of_graph((before, graph), *other, local, unique, &mut found);
    }
    found
}

fn of_graph(
    (side, graph): (&Side, Node<'_>),
    other: Node<'_>,
    local: Option<String>,
    unique: bool,
    found: &mut Vec<Rename>,
) {
    let mut gone: Vec<(Section, String, Node<'_>)> = Vec::new();
    let mut new: BTreeMap<(Section, String), Vec<String>> = BTreeMap::new();
    for section in Section::ALL {
        let (was, is) = (declared(graph, section), declared(other, section));
        let names = |list: &[(String, Node<'_>)]| list.iter().map(|(name, _)| name.clone()).collect::<BTreeSet<_>>();
        let (old_names, new_names) = (names(&was), names(&is));
        gone.extend(
            was.into_iter().filter(|(name, _)| !new_names.contains(name)).map(|(name, value)| (section, name, value)),
        );
        // The last one first, so that equal ones are taken in order.
        for (name, value) in is.into_iter().rev().filter(|(name, _)| !old_names.contains(name)) {
            new.entry((section, canonical(value))).or_default().push(name);
        }
    }
    if gone.is_empty() || new.is_empty() {
        return;
    }
    let places = places(side, local.as_deref());
    let mut names: BTreeMap<Symbol, String> = BTreeMap::new();
    loop {
        let mut some = false;
        let texts: Vec<String> = gone.iter().map(|(.., value)| with_names(*value, &places, &names)).collect();
        let count = |section: Section, text: &str| {
            gone.iter().zip(&texts).filter(|((other, ..), other_text)| *other == section && *other_text == text).count()
        };
        let mut pairs = Vec::new();
        for (index, ((section, name, _), text)) in gone.iter().zip(&texts).enumerate() {
            let Some(candidates) = new.get_mut(&(*section, text.clone())) else { continue };
            if unique && (candidates.len() != 1 || count(*section, text) != 1) {
                continue;
            }
            let Some(after) = candidates.pop() else { continue };
            pairs.push((index, Rename { local: local.clone(), section: *section, before: name.clone(), after }));
        }
        for (index, rename) in pairs.into_iter().rev() {
            gone.remove(index);
            names.insert(rename.symbol(), rename.after.clone());
            found.push(rename);
            some = true;
        }
        if !some {
            break;
        }
    }
    found.sort();
}

/// Names in the literals of a graph, by the start of the literal: symbols and their bytes in the content.
type Places = BTreeMap<usize, Vec<(std::ops::Range<usize>, Symbol)>>;

fn places(side: &Side, local: Option<&str>) -> Places {
    let mut places = Places::new();
    for found in side.names(local) {
        places.entry(found.literal.0.start).or_default().push((found.within, found.symbol));
    }
    places
}

/// The canonical text of a value in which symbols have new names.
fn with_names(value: Node<'_>, places: &Places, names: &BTreeMap<Symbol, String>) -> String {
    if names.is_empty() {
        return canonical(value);
    }
    let start = value.range().start;
    let mut text = value.text().to_owned();
    let mut literals: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    for node in value.descendants().filter(|node| node.kind() == NodeKind::Text) {
        let Some(found) = places.get(&node.range().start) else { continue };
        let Some(mut says) = node.string().filter(|_| found.iter().any(|(_, symbol)| names.contains_key(symbol)))
        else {
            continue;
        };
        for (within, symbol) in found.iter().rev() {
            if let Some(new) = names.get(symbol)
                && says.get(within.clone()).is_some()
            {
                says.replace_range(within.clone(), new);
            }
        }
        literals.push((node.range().start - start..node.range().end - start, shibo_ide::names::quote(&says)));
    }
    for (range, says) in literals.into_iter().rev() {
        text.replace_range(range, &says);
    }
    let tree = shibo_graph::syntax::Tree::parse(text);
    tree.value().map_or_else(String::new, canonical)
}

/// The new names of all renamed things.
pub(crate) fn new_names(renames: &[Rename]) -> NewNames {
    let mut names = NewNames::new();
    for rename in renames {
        names.entry(rename.local.clone()).or_default().insert(rename.symbol(), rename.after.clone());
    }
    names
}
