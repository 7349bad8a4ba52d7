//! The graphs that ship with Shibo, and the kinds of nodes: what graph files may refer to by name. Programs that load
//! graphs begin with [`registry`].
use shibo_node::registry::{Family, Library, Registry};
use std::sync::Arc;

/// All files of the folder `graphs`, by their paths in it.
static FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/library.rs"));

/// Files that the examples in the manuals of nodes read, by name: a picture, a drawing and a mesh. They are put beside
/// the graph of the example.
pub static EXAMPLE_FILES: [(&str, &[u8]); 3] = [
    ("cube.obj", include_bytes!("../examples/cube.obj")),
    ("leaf.svg", include_bytes!("../examples/leaf.svg")),
    ("ramp.png", include_bytes!("../examples/ramp.png")),
];

/// The table of changes of the kinds and graphs that ship with the program.
pub const CHANGES: &str = include_str!("../changes.ron");

/// Folder of the sub-graphs that other graphs may use.
const PARTS: &str = "lib/";
const EXTENSION: &str = ".ron";

/// All nodes, and the graphs that ship with the program.
pub fn registry() -> Registry {
    registry_with([])
}

/// The same with families of nodes from other crates. Give the result a fingerprint of their code ([`Registry::with_code`]),
/// so that a cache never returns results of another version.
pub fn registry_with(more: impl IntoIterator<Item = Family>) -> Registry {
    shibo_nodes::registry_with(more).with_library(Arc::new(Shipped)).with_changes(CHANGES)
}

/// A graph that ships with the program.
#[derive(Clone, Copy, Debug)]
pub struct Graph {
    /// The name after `shibo:`.
    pub name: &'static str,
    /// Path within the library.
    pub path: &'static str,
    /// Text of the graph file.
    pub text: &'static str,
}

impl Graph {
    /// True for a sub-graph that other graphs use.
    pub fn is_part(&self) -> bool {
        self.path.starts_with(PARTS)
    }

    /// Description: the first sentence of the first comment.
    pub fn doc(&self) -> &'static str {
        let line = self.text.lines().next().and_then(|line| line.strip_prefix("//")).unwrap_or_default().trim();
        line.split_once(". ").map_or(line, |(first, _)| first).trim_end_matches('.')
    }

    /// The family of its material, such as `stone`; shipped graphs give it in a line of its own.
    pub fn family(&self) -> Option<&'static str> {
        self.text.lines().find_map(|line| line.strip_prefix("  family: \"")?.strip_suffix("\","))
    }
}

/// All graphs that ship with the program; graphs to render come before sub-graphs.
pub fn graphs() -> Vec<Graph> {
    let graph = |(path, bytes): &(&'static str, &'static [u8])| {
        let name = path.strip_prefix(PARTS).unwrap_or(path).strip_suffix(EXTENSION)?;
        let text = std::str::from_utf8(bytes).ok()?;
        (!name.contains('/')).then_some(Graph { name, path, text })
    };
    let mut graphs: Vec<Graph> = FILES.iter().filter_map(graph).collect();
    graphs.sort_by_key(|graph| (graph.is_part(), graph.name));
    graphs
}

fn content(path: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
}

/// The files that ship with the program.
struct Shipped;

impl Library for Shipped {
    fn names(&self) -> Vec<&str> {
        graphs().into_iter().map(|graph| graph.name).collect()
    }

    fn find(&self, name: &str) -> Option<String> {
        let paths = [format!("{name}{EXTENSION}"), format!("{PARTS}{name}{EXTENSION}")];
        paths.into_iter().find(|path| content(path).is_some())
    }

    fn text(&self, path: &str) -> Option<&str> {
        content(path).and_then(|bytes| std::str::from_utf8(bytes).ok())
    }

    fn file(&self, path: &str) -> Option<&'static [u8]> {
        content(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_node::changes::{Changes, Thing};
    use std::collections::BTreeMap;

    #[test]
    fn graphs_are_found_by_name() {
        let shipped = Shipped;
        assert_eq!(shipped.find("walnut").as_deref(), Some("walnut.ron"));
        assert_eq!(shipped.find("wrinkles").as_deref(), Some("lib/wrinkles.ron"));
        assert_eq!(shipped.find("nothing"), None);
        let graphs = graphs();
        assert!(graphs.len() > 30 && graphs.iter().all(|graph| graph.doc().len() > 8), "{graphs:?}");
        let names: std::collections::BTreeSet<_> = graphs.iter().map(|graph| graph.name).collect();
        assert_eq!(names.len(), graphs.len(), "two graphs of one name");
    }

    /// The version of a kind is that of its last line in the table.
    #[test]
    fn changes_name_things_that_exist_and_their_versions() {
        let changes = Changes::read(CHANGES).unwrap();
        let registry = registry();
        assert_eq!(registry.changes(), &changes);
        let last: BTreeMap<Thing<'_>, u32> = changes.since(0).map(|line| (line.thing(), line.version)).collect();
        for (thing, version) in last {
            match thing {
                Thing::Kind(kind) => assert_eq!(registry.info(kind).map(|info| info.version), Some(version), "{kind}"),
                Thing::Graph(graph) => assert!(
                    graphs().iter().any(|shipped| shipped.path.strip_suffix(EXTENSION) == Some(graph)),
                    "{graph}"
                ),
                Thing::All => {}
            }
        }
    }
}
