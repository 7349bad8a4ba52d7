//! Fixes of imports: graphs that a node uses without importing them, and paths of files.
use super::super::diagnose::Finding;
use super::super::file::{File, Section};
use super::super::insert::add_to;
use super::super::rename::Edit;
use super::super::world::{Cx, is_use};
use super::{Applies, Fix};
use shibo_graph::syntax::{Node, NodeKind};
use std::collections::BTreeSet;

/// Most graphs that are read for one name; those with a like name come first.
const READ: usize = 400;
/// Most graphs that are imported at once.
const FORGOTTEN: usize = 16;
/// Most nodes that are read for the use of a graph.
const USES: usize = 50;
/// Most graphs offered for a name.
const OFFERED: usize = 4;

/// A graph that may be meant by a name.
struct Meant {
    path: String,
    /// True if no other graph can be meant.
    sure: bool,
    /// True if the file has the name.
    named: bool,
}

/// The requests that the nodes of a file make of a graph that is not imported.
#[derive(Default)]
struct Asked {
    /// Parameters and inputs.
    with: BTreeSet<String>,
    presets: BTreeSet<String>,
    outputs: BTreeSet<String>,
    /// Names of the nodes that use it.
    nodes: BTreeSet<String>,
}

/// Imports a graph that a node uses without importing it. With others that were forgotten, if there are any.
/// The second value tells whether the file of the first fix has the name.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding) -> (Vec<Fix>, bool) {
    let written = cx.file.at(&finding.range).trim_matches('"');
    let name = stem(written);
    let whole = cx.file.whole();
    let locals: BTreeSet<String> = cx.file.locals().filter_map(|local| local.local_name().map(str::to_owned)).collect();
    let is_known = |name: &str| cx.file.entry(Section::Imports, name).is_some() || locals.contains(name);
    if name.is_empty() || is_known(&name) {
        return (Vec::new(), false);
    }
    let found = meant(cx, written);
    let named = found.first().is_some_and(|meant| meant.named);
    let level = |sure: bool| if sure { Applies::Sure } else { Applies::Likely };
    let single = |meant: &Meant| {
        let mut edits = add_to(cx.file, Section::Imports, &entry(&name, &meant.path));
        if name != written {
            edits.push(Edit { range: finding.range.clone(), text: format!("\"{name}\"") });
        }
        Fix::new(format!("Import `{}`", meant.path), level(meant.sure), edits)
    };
    let mut fixes: Vec<Fix> = Vec::new();
    // All of them at once: edits of one place cannot be made one by one.
    let forgotten: BTreeSet<String> = used(&whole).map(|(name, _)| name).filter(|name| !is_known(name)).collect();
    if name == written && (2..=FORGOTTEN).contains(&forgotten.len()) && forgotten.contains(&name) && !found.is_empty() {
        let all: Vec<(&String, Meant)> =
            forgotten.iter().filter_map(|name| Some((name, meant(cx, name).into_iter().next()?))).collect();
        let sure = all.iter().all(|(_, meant)| meant.sure);
        let entries: Vec<String> = all.iter().map(|(name, meant)| entry(&stem(name), &meant.path)).collect();
        let plain = all.iter().all(|(name, _)| stem(name) == **name);
        if plain && all.len() > 1 {
            let edits = add_to(cx.file, Section::Imports, &entries.join(", "));
            let title = format!("Import {}", entries.join(", "));
            let title: String = title.chars().take(80).collect();
            fixes.push(Fix::new(title, level(sure), edits));
        }
    }
    fixes.extend(found.iter().take(OFFERED).map(single));
    (fixes, named)
}

fn entry(name: &str, path: &str) -> String {
    format!("\"{name}\": \"{path}\"")
}

/// The name of a graph by its path.
fn stem(path: &str) -> String {
    let name = path.trim_start_matches("shibo:").rsplit('/').next().unwrap_or_default();
    name.trim_end_matches(".ron").to_owned()
}

/// The nodes of a file that use graphs: names of the graphs, and the calls.
fn used(file: &File) -> impl Iterator<Item = (String, Node<'_>)> {
    let calls = file.tree.nodes().filter(|node| node.kind() == NodeKind::Call && node.name().is_some_and(is_use));
    let name = |node: Node<'_>| Some(unquoted(node.body()?.entry("graph")?.value()?)?.to_owned());
    calls.filter_map(move |node| Some((name(node)?, node)))
}

fn unquoted(node: Node<'_>) -> Option<&str> {
    node.text().strip_prefix('"')?.strip_suffix('"')
}

/// Requests of a file for a graph.
fn asked(file: &File, graph: &str) -> Asked {
    let mut asked = Asked::default();
    for (_, node) in used(file).filter(|(name, _)| name == graph).take(USES) {
        let Some(body) = node.body() else { continue };
        let with = body.entry("with").and_then(Node::value);
        asked.with.extend(with.into_iter().flat_map(Node::entries).filter_map(Node::key_text));
        let preset = body.entry("preset").and_then(Node::value).and_then(unquoted).unwrap_or_default();
        asked
            .presets
            .extend(preset.split('+').filter(|name| !name.contains('$') && !name.is_empty()).map(str::to_owned));
        let own = file.tree.nodes().find(|entry| entry.value().is_some_and(|value| value.range() == node.range()));
        if let Some(name) = own.and_then(Node::key_text) {
            outputs(file, &name, &mut asked.outputs);
            asked.nodes.insert(name);
        }
    }
    asked
}

/// The outputs of a node that the texts of a file name.
fn outputs(file: &File, node: &str, found: &mut BTreeSet<String>) {
    let text: &str = &file.text;
    let is_part = |c: char| c == '_' || c == '.' || c == '$' || c.is_alphanumeric();
    for (at, _) in text.match_indices(&format!("{node}.")) {
        let rest = &text[at + node.len() + 1..];
        let end = rest.find(|c: char| !(c == '_' || c.is_alphanumeric())).unwrap_or(rest.len());
        let begins = !text[..at].ends_with(is_part) && !file.tree.is_comment(at);
        if begins && end > 0 && !rest.starts_with(|c: char| c.is_ascii_digit()) {
            found.insert(rest[..end].to_owned());
        }
    }
}

/// The graphs that a name may mean, best first. Each has all names for which the nodes ask.
fn meant(cx: Cx<'_>, written: &str) -> Vec<Meant> {
    let name = stem(written);
    let own = cx.file.path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let asked = asked(cx.file, written);
    let evidence = asked.with.len() + asked.presets.len() + asked.outputs.len();
    let parts = |name: &str, other: &str| name.split('_').all(|part| other.split('_').any(|word| word == part));
    let likeness = |path: String| {
        let other = stem(&path);
        let likeness = match () {
            () if other == name => 0,
            // The node `"calf": Use(graph: "hide")` means `calf`.
            () if asked.nodes.contains(&other) => 1,
            () if parts(&name, &other) || parts(&other, &name) => 2,
            () if evidence > 1 => 3,
            () => return None,
        };
        Some((likeness, path.starts_with("shibo:"), path))
    };
    let graphs = graph_paths(cx, written).into_iter().filter(|path| is_graph(path) && path != own);
    // A likeness, whether the graph is shipped, and a path.
    let mut found: Vec<(usize, bool, String)> = graphs.filter_map(likeness).collect();
    found.sort_by_key(|(likeness, ..)| *likeness);
    found.truncate(READ);
    found.retain(|(_, _, path)| fits(cx, path, &asked));
    found.sort_by_key(|(likeness, shipped, _)| (*likeness, *shipped));
    // `oak` may also mean `oak_cuts.ron`.
    let first = found.first().map(|(_, shipped, _)| *shipped);
    let sole = found.iter().skip(1).all(|(likeness, shipped, _)| *likeness > 2 || Some(*shipped) != first);
    let meant = |(index, (likeness, _, path)): (usize, (usize, bool, String))| Meant {
        sure: index == 0 && likeness == 0 && sole,
        named: likeness == 0,
        path,
    };
    found.into_iter().enumerate().map(meant).collect()
}

/// Returns true if a graph has all that is asked of it.
fn fits(cx: Cx<'_>, path: &str, asked: &Asked) -> bool {
    let file = cx.world.import(&cx.file.path, path).and_then(|path| cx.world.file(&path));
    let Some(file) = file.filter(|file| file.is_graph()) else { return false };
    let has = |sections: &[Section], name: &String| sections.iter().any(|of| file.entry(*of, name).is_some());
    asked.with.iter().all(|name| has(&[Section::Params, Section::Inputs], name))
        && asked.presets.iter().all(|name| has(&[Section::Presets], name))
        && asked.outputs.iter().all(|name| has(&[Section::Outputs], name))
}

/// Paths of graphs that may be meant: those in the folder of a written path, in `lib`, and those of the library.
pub(super) fn graph_paths(cx: Cx<'_>, written: &str) -> Vec<String> {
    let mut paths = Vec::new();
    let parent = written.rsplit_once('/').map_or("", |(parent, _)| parent);
    for folder in [parent, "lib", ""] {
        for (name, is_folder) in cx.world.folder(&cx.file.folder().join(folder)) {
            let path = if folder.is_empty() { name } else { format!("{folder}/{name}") };
            if !is_folder && !paths.contains(&path) {
                paths.push(path);
            }
        }
    }
    let shipped = shibo_library::graphs();
    paths.extend(shipped.iter().map(|graph| format!("shibo:{}", graph.path.trim_end_matches(".ron"))));
    paths
}

/// Returns true for the path of a graph rather than of a picture.
pub(super) fn is_graph(path: &str) -> bool {
    path.starts_with("shibo:") || path.ends_with(".ron")
}
