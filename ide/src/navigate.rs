//! Navigation from a name to its declaration and uses, in this file and in others.
use super::file::{File, Section};
use super::functions::{self, Head};
use super::names::{self, Occurrence, Symbol, occurrences};
use super::world::Cx;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// A range in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRange {
    /// Path of the file.
    pub path: PathBuf,
    /// Range of bytes.
    pub range: Range<usize>,
    /// True if the range declares something.
    pub declares: bool,
}

/// A named thing and the file that declares it.
#[derive(Clone, Debug)]
pub struct Thing {
    /// The file.
    pub file: Arc<File>,
    /// A node, parameter, import, output, preset, function or local name of that file.
    pub symbol: Symbol,
}

/// Meaning of the name at a position; for a name after a dot, the output of the sub-graph.
pub fn thing(cx: Cx<'_>, file: &File, at: usize) -> Option<(Occurrence, Thing)> {
    let file = file.scope_at(at);
    let cx = cx.with(&file);
    let found = names::at(cx, at)?;
    let thing = meaning(cx, &found.symbol)?;
    Some((found, thing))
}

/// Meaning of a symbol of a graph.
pub fn meaning(cx: Cx<'_>, symbol: &Symbol) -> Option<Thing> {
    let of = |file: File, symbol| Some(Thing { file: Arc::new(file), symbol });
    match symbol {
        Symbol::Given(import, name) => {
            let other = cx.imported(import)?;
            let input = other.entry(Section::Inputs, name).is_some();
            let symbol = if input { Symbol::Node(name.clone()) } else { Symbol::Param(name.clone()) };
            Some(Thing { file: other, symbol })
        }
        Symbol::GivenPreset(import, name) => {
            Some(Thing { file: cx.imported(import)?, symbol: Symbol::Preset(name.clone()) })
        }
        Symbol::GivenFunction(import, name) => of(cx.imported(import)?.whole(), Symbol::Function(name.clone())),
        Symbol::Port(node, port) => Some(Thing { file: cx.used(node)?, symbol: Symbol::Output(port.clone()) }),
        Symbol::Graph(_) | Symbol::File(_) | Symbol::Part(_) => None,
        Symbol::Import(_) | Symbol::Function(_) => of(cx.file.whole(), symbol.clone()),
        symbol => of(cx.file.clone(), symbol.clone()),
    }
}

/// Declaration of the name at a position; an import leads to its file.
pub fn definition(cx: Cx<'_>, file: &File, at: usize) -> Option<(Range<usize>, FileRange)> {
    let file = file.scope_at(at);
    let cx = cx.with(&file);
    let found = names::at(cx, at)?;
    let path = match &found.symbol {
        Symbol::Graph(name) => cx.world.import(&cx.file.path, name),
        Symbol::File(name) => Some(cx.file.folder().join(name)),
        _ => None,
    };
    if let Some(path) = path {
        return Some((found.range, FileRange { path, range: 0..0, declares: true }));
    }
    // Outputs of library kinds have no declaration in a file, so the node itself is used.
    let thing = meaning(cx, &found.symbol).or_else(|| match &found.symbol {
        Symbol::Port(node, _) => Some(Thing { file: Arc::new(file.clone()), symbol: Symbol::Node(node.clone()) }),
        _ => None,
    })?;
    let range = declaration(cx, &thing)?;
    Some((found.range, FileRange { path: thing.file.path.clone(), range, declares: true }))
}

/// Range of a declaration.
pub fn declaration(cx: Cx<'_>, thing: &Thing) -> Option<Range<usize>> {
    let (sections, name): (&[Section], &str) = match &thing.symbol {
        Symbol::Node(name) => (&[Section::Nodes, Section::Inputs], name),
        Symbol::Param(name) => (&[Section::Params], name),
        Symbol::Import(name) => (&[Section::Imports, Section::Graphs], name),
        Symbol::Output(name) => (&[Section::Outputs], name),
        Symbol::Preset(name) => (&[Section::Presets], name),
        Symbol::Function(name) => {
            let item = thing.file.entry(Section::Functions, name)?;
            return functions::in_head(&thing.file, item, &Head::of(item.name()?).name);
        }
        Symbol::Local(..) => {
            let mut all = occurrences(cx.with(&thing.file)).into_iter();
            return all.find(|one| one.declares && one.symbol == thing.symbol).map(|one| one.range);
        }
        _ => return None,
    };
    let item = sections.iter().find_map(|section| thing.file.entry(*section, name))?;
    Some(item.key.as_ref()?.range.clone())
}

/// All occurrences of the name at a position: in this file, and in all workspace graphs that import the declaring file.
pub fn references(cx: Cx<'_>, file: &File, at: usize) -> Vec<FileRange> {
    let Some((_, thing)) = thing(cx, file, at) else { return Vec::new() };
    let mut places = Vec::new();
    for (file, found) in everywhere(cx, &thing) {
        places.push(FileRange { path: file.path.clone(), range: found.range, declares: found.declares });
    }
    places
}

/// Occurrences of the name at a position in this file.
pub fn highlight(cx: Cx<'_>, at: usize) -> Vec<(Range<usize>, bool)> {
    let file = cx.file.scope_at(at);
    let Some(found) = names::at(cx.with(&file), at) else { return Vec::new() };
    let scopes = if is_shared(&found.symbol) { file.scopes().collect() } else { vec![file] };
    let all = scopes.iter().flat_map(|scope| occurrences(cx.with(scope)));
    all.filter(|o| o.symbol == found.symbol).map(|o| (o.range, o.declares)).collect()
}

/// Returns whether all graphs of a file share a name.
fn is_shared(symbol: &Symbol) -> bool {
    matches!(symbol, Symbol::Import(_) | Symbol::Function(_))
}

/// All occurrences of a thing: in its own file, and in the workspace graphs that import it.
pub fn everywhere(cx: Cx<'_>, thing: &Thing) -> Vec<(Arc<File>, Occurrence)> {
    let mut found = Vec::new();
    for file in readers(cx, thing) {
        let inner = cx.with(&file);
        let own = file.is_same(&thing.file);
        for one in occurrences(inner) {
            let same = match &one.symbol {
                symbol if own && *symbol == thing.symbol => true,
                symbol if is_shared(symbol) => *symbol == thing.symbol && file.path == thing.file.path,
                Symbol::Given(..) | Symbol::GivenPreset(..) | Symbol::GivenFunction(..) | Symbol::Port(..) => {
                    meaning(inner, &one.symbol).is_some_and(|m| m.file.is_same(&thing.file) && m.symbol == thing.symbol)
                }
                _ => false,
            };
            if same {
                found.push((file.clone(), one));
            }
        }
    }
    found
}

/// The graphs that may name a thing: its own, and those that can use it.
pub fn readers(cx: Cx<'_>, thing: &Thing) -> Vec<Arc<File>> {
    let own = &thing.file;
    let all = |file: &File| file.scopes().map(Arc::new).collect::<Vec<_>>();
    let given = matches!(
        thing.symbol,
        Symbol::Node(_) | Symbol::Param(_) | Symbol::Output(_) | Symbol::Preset(_) | Symbol::Function(_)
    );
    let within = is_shared(&thing.symbol) || (given && own.local_name().is_some());
    let mut files = if within { all(own) } else { vec![own.clone()] };
    if given && own.local_name().is_none() {
        files.extend(importers(cx, own).iter().flat_map(|file| all(file)));
    }
    files
}

/// Workspace graphs that import a file.
fn importers(cx: Cx<'_>, file: &Arc<File>) -> Vec<Arc<File>> {
    let imports = |other: &Arc<File>| {
        other.path != file.path
            && other.entries(Section::Imports).iter().any(|item| {
                let name = item.value.as_ref().and_then(|value| value.text());
                name.and_then(|name| cx.world.import(&other.path, name)).is_some_and(|path| path == file.path)
            })
    };
    cx.world.graphs().into_iter().filter(imports).collect()
}
