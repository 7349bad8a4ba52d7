//! Values in the texts of nodes that a page has set, tried beside the unsaved texts of an editor.
use super::buffers::TextsByPath;
use super::values::Values;
use shibo_bridge::page::edits::{self, FieldEdit};
use shibo_graph::{LoadOptions, load_text};
use shibo_node::registry::Registry;
use std::borrow::Cow;
use std::path::Path;

/// Puts the edits of a page into the text of a graph file; also returns the edits that do not fit it, with reasons. If
/// the text itself has mistakes, it stays as it is. The texts of `overlay` replace files.
pub(crate) fn tried<'t>(
    path: &Path,
    text: &'t str,
    registry: &Registry,
    values: &Values,
    overlay: &TextsByPath,
) -> (Cow<'t, str>, Vec<(FieldEdit, String)>) {
    if values.edits.is_empty() {
        return (text.into(), Vec::new());
    }
    // The values of parameters are tried by themselves.
    let options = LoadOptions { overlay: overlay.clone(), ..Values::default().options() };
    let load = |text: &str| load_text(path, text, registry, &options);
    match load(text).graph {
        Some(base) => edits::tried(text, &base, &values.edits, &load),
        None => (text.into(), Vec::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"(
  canvas: (size_mm: 8, resolution: 64),
  nodes: { "noise": Perlin(size: 2, seed: 1) },
  outputs: { "noise": "noise" },
)"#;

    /// A preset that is gone is no reason to leave the edits out.
    #[test]
    fn tries_values_of_nodes_beside_those_of_parameters_that_are_gone() {
        let edit = FieldEdit { node: "noise".into(), field: "seed".into(), index: None, value: "9".into() };
        let values = Values { edits: vec![edit], preset: Some("gone".into()), ..Values::default() };
        let with = |text: &str| {
            let (text, refused) =
                tried(Path::new("a.ron"), text, &crate::library::registry(), &values, &TextsByPath::new());
            (text.into_owned(), refused.len())
        };
        assert_eq!(with(TEXT), (TEXT.replace("seed: 1", "seed: 9"), 0));
        let broken = TEXT.replace("Perlin", "Perlim");
        assert_eq!(with(&broken), (broken.clone(), 0));
    }
}
