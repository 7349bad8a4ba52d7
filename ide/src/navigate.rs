//! Navigation from a name to its declaration and uses, in this file and in others.
use super::file::{File, Section};
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
    /// A node, parameter, import, output or preset of that file.
    pub symbol: Symbol,
}

/// Meaning of the name at a position; for a name after a dot, the output of the sub-graph.
pub fn thing(cx: Cx<'_>, file: &Arc<File>, at: usize) -> Option<(Occurrence, Thing)> {
    let found = names::at(cx, at)?;
    let thing = meaning(cx, file, &found.symbol)?;
    Some((found, thing))
}

/// Meaning of a symbol of a file.
pub fn meaning(cx: Cx<'_>, file: &Arc<File>, symbol: &Symbol) -> Option<Thing> {
    let here = |symbol| Some(Thing { file: file.clone(), symbol });
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
        Symbol::Port(node, port) => Some(Thing { file: cx.used(node)?, symbol: Symbol::Output(port.clone()) }),
        Symbol::Graph(_) | Symbol::File(_) => None,
        symbol => here(symbol.clone()),
    }
}

/// Declaration of the name at a position; an import leads to its file.
pub fn definition(cx: Cx<'_>, file: &Arc<File>, at: usize) -> Option<(Range<usize>, FileRange)> {
    let found = names::at(cx, at)?;
    let path = match &found.symbol {
        Symbol::Graph(name) => cx.world.import(&cx.file.path, name),
        Symbol::File(name) => Some(cx.file.folder().join(name)),
        Symbol::Import(name) if !found.declares => {
            let item = cx.file.entry(Section::Imports, name)?;
            let range = item.key.as_ref()?.range.clone();
            return Some((found.range, FileRange { path: cx.file.path.clone(), range, declares: true }));
        }
        _ => None,
    };
    if let Some(path) = path {
        return Some((found.range, FileRange { path, range: 0..0, declares: true }));
    }
    // Outputs of library kinds have no declaration in a file, so the node itself is used.
    let thing = meaning(cx, file, &found.symbol).or_else(|| match &found.symbol {
        Symbol::Port(node, _) => Some(Thing { file: file.clone(), symbol: Symbol::Node(node.clone()) }),
        _ => None,
    })?;
    let range = declaration(&thing)?;
    Some((found.range, FileRange { path: thing.file.path.clone(), range, declares: true }))
}

/// Range of a declaration.
pub fn declaration(thing: &Thing) -> Option<Range<usize>> {
    let (sections, name): (&[Section], &str) = match &thing.symbol {
        Symbol::Node(name) => (&[Section::Nodes, Section::Inputs], name),
        Symbol::Param(name) => (&[Section::Params], name),
        Symbol::Import(name) => (&[Section::Imports], name),
        Symbol::Output(name) => (&[Section::Outputs], name),
        Symbol::Preset(name) => (&[Section::Presets], name),
        _ => return None,
    };
    let item = sections.iter().find_map(|section| thing.file.entry(*section, name))?;
    Some(item.key.as_ref()?.range.clone())
}

/// All occurrences of the name at a position: in this file, and in all workspace graphs that import the declaring file.
pub fn references(cx: Cx<'_>, file: &Arc<File>, at: usize) -> Vec<FileRange> {
    let Some((_, thing)) = thing(cx, file, at) else { return Vec::new() };
    let mut places = Vec::new();
    for (file, found) in everywhere(cx, &thing) {
        places.push(FileRange { path: file.path.clone(), range: found.range, declares: found.declares });
    }
    places
}

/// Occurrences of the name at a position in this file.
pub fn highlight(cx: Cx<'_>, at: usize) -> Vec<(Range<usize>, bool)> {
    let Some(found) = names::at(cx, at) else { return Vec::new() };
    let same = occurrences(cx).into_iter().filter(|o| o.symbol == found.symbol);
    same.map(|o| (o.range, o.declares)).collect()
}

/// All occurrences of a thing: in its own file, and in the workspace graphs that import it.
pub fn everywhere(cx: Cx<'_>, thing: &Thing) -> Vec<(Arc<File>, Occurrence)> {
    let mut found = Vec::new();
    let mut files = vec![thing.file.clone()];
    let shared = matches!(thing.symbol, Symbol::Node(_) | Symbol::Param(_) | Symbol::Output(_) | Symbol::Preset(_));
    if shared {
        files.extend(importers(cx, &thing.file));
    }
    for file in files {
        let inner = Cx { world: cx.world, file: &file };
        let own = file.path == thing.file.path;
        for one in occurrences(inner) {
            let same = if own && one.symbol == thing.symbol {
                true
            } else if own && !matches!(one.symbol, Symbol::Given(..) | Symbol::GivenPreset(..) | Symbol::Port(..)) {
                false
            } else {
                meaning(inner, &file, &one.symbol)
                    .is_some_and(|m| m.file.path == thing.file.path && m.symbol == thing.symbol)
                    && !matches!(one.symbol, Symbol::Node(_) | Symbol::Param(_))
            };
            if same {
                found.push((file.clone(), one));
            }
        }
    }
    found
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
