//! The resources: manuals of nodes, pages of the documentation, shipped graphs, and the schema.
use crate::library;
use rmcp::model::{Resource, ResourceTemplate};
use shibo_bridge::{Tools, schema};
use shibo_ide::manual::markdown;

const SCHEMA: &str = "shibo://schema";
const MANUAL: &str = "shibo://manual/";
const DOCS: &str = "shibo://docs/";
const GRAPH: &str = "shibo://graph/";

macro_rules! pages {
    ($($name:literal: $doc:literal,)*) => {
        /// The pages of the documentation: name, description and text.
        const PAGES: &[(&str, &str, &str)] = &[$(($name, $doc, include_str!(concat!("../../docs/", $name, ".md"))),)*];
    };
}

pages! {
    "graph-file": "The language of graph files.",
    "composing": "Graphs in other graphs.",
    "leather": "Leather by the spring method.",
    "wood": "Wood from grown trees.",
    "synthesis": "More of a picture by exemplar synthesis.",
    "deposits": "Layers, fronts, bent solids and growth.",
    "fracture": "Cracks, flakes and plates.",
    "yarn": "Cloth, knits, braids and ropes.",
    "react": "Patterns of reaction and diffusion.",
    "surfaces": "Materials on meshes.",
    "hybrids": "Photographs and procedures together.",
    "interchange": "Files for other programs.",
    "lasting": "Graphs in a team, and as JSON.",
}

/// The resources that are listed: pages, graphs and the schema. Manuals are found by their template.
pub(super) fn list(tools: &Tools) -> Vec<Resource> {
    let page = |(name, doc, _): &(&str, &str, &str)| {
        Resource::new(format!("{DOCS}{name}"), *name).with_description(*doc).with_mime_type("text/markdown")
    };
    let graph = |name: &str| Resource::new(format!("{GRAPH}{name}"), name).with_mime_type("text/plain");
    let names = tools.registry.library().map_or(Vec::new(), |library| library.names());
    let schema = Resource::new(SCHEMA, "schema")
        .with_description("The JSON Schema of graphs in the JSON form.")
        .with_mime_type("application/schema+json");
    std::iter::once(schema).chain(PAGES.iter().map(page)).chain(names.into_iter().map(graph)).collect()
}

/// The templates of resources.
pub(super) fn templates() -> Vec<ResourceTemplate> {
    let manual = ResourceTemplate::new(format!("{MANUAL}{{node}}"), "manual");
    vec![manual.with_description("The manual of a kind of nodes.").with_mime_type("text/markdown")]
}

/// The text of a resource and its MIME type.
pub(super) fn read(tools: &Tools, uri: &str) -> Option<(String, &'static str)> {
    if uri == SCHEMA {
        return Some((schema(tools).to_string(), "application/schema+json"));
    }
    if let Some(kind) = uri.strip_prefix(MANUAL) {
        return tools.registry.info(kind).map(|info| (markdown::node(info), "text/markdown"));
    }
    if let Some(name) = uri.strip_prefix(DOCS) {
        let page = PAGES.iter().find(|(page, ..)| *page == name);
        return page.map(|(.., text)| ((*text).to_owned(), "text/markdown"));
    }
    let name = uri.strip_prefix(GRAPH)?;
    let graph = library::graphs()
        .into_iter()
        .find(|graph| graph.name == name || graph.path.strip_suffix(".ron") == Some(name))?;
    Some((graph.text.to_owned(), "text/plain"))
}
