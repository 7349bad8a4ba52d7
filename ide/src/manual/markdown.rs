//! The reference page, `docs/nodes.md`.
use super::spelling;
use super::words::{FAMILIES, WORDS, Word};
use shibo_node::registry::Registry;
use shibo_node::{FieldInfo, KindInfo, ParamInfo, Role};
use std::collections::BTreeMap;
use std::fmt::Write;

const HEAD: &str = "\
# Nodes

<!-- Made by `shibo nodes --format markdown`; change the doc comments in `nodes/`, or `engine/graph/src/schema.rs`, and run
     `BLESS=1 cargo test --release --test shipped docs`. -->

Every kind of node, by family. Ports take the name of another node (`\"node\"`, or `\"node.port\"` for one of its further
outputs); ports of type `Gray` also take a number, those of type `Rgb` a number or a colour. Every parameter has a default
and can be left out, unless it says otherwise. Lengths are millimetres, angles degrees. The pictures show the node called `example` of the source
below them on a canvas of 40 × 40 mm.
";

/// The whole page.
pub fn reference(registry: &Registry) -> String {
    let mut page = String::from(HEAD);
    let mut anchors = Anchors::default();
    anchors.of("Nodes");
    // Anchors of repeated headings are numbered in order.
    let mut contents = String::new();
    let mut body = String::new();
    for (family, doc) in registry.families() {
        let kinds: Vec<&KindInfo> =
            registry.kinds().filter_map(|kind| registry.info(kind)).filter(|info| info.family == *family).collect();
        let _ = write!(contents, "- [{family}](#{}): ", anchors.of(family));
        let links: Vec<String> = kinds.iter().map(|i| format!("[{}](#{})", i.kind, anchors.of(&i.kind))).collect();
        let _ = writeln!(contents, "{}", links.join(", "));
        let _ = writeln!(body, "\n## {family}\n\n{doc}");
        kinds.iter().for_each(|info| {
            let _ = write!(body, "\n{}", node(info));
        });
    }
    for (family, about) in FAMILIES {
        let words: Vec<&Word> = WORDS.iter().filter(|word| word.family == family).collect();
        let _ = write!(contents, "- [{family}](#{}): ", anchors.of(family));
        let links: Vec<_> = words.iter().map(|word| format!("[{0}](#{1})", word.name, anchors.of(word.name))).collect();
        let _ = writeln!(contents, "{}", links.join(", "));
        let _ = writeln!(body, "\n## {family}\n\n{about}");
        for word in words {
            let _ = write!(body, "\n### {}\n\n{}\n", word.name, word.doc.trim());
        }
    }
    let _ = write!(page, "\n{contents}{body}");
    page
}

/// Section of one kind.
pub fn node(info: &KindInfo) -> String {
    let mut out = String::new();
    let kind = &info.kind;
    let _ = writeln!(out, "### {kind}\n\n![{kind}](nodes/{kind}.png)\n\n{}", info.doc.trim());
    if info.ports().next().is_some() {
        let _ = writeln!(out, "\n| port | type | |\n|---|---|---|");
    }
    for (field, port) in info.ports() {
        let _ = writeln!(out, "| `{}` | {} | {} |", field.name, cell(&spelling::port(port)), cell(&field.doc));
    }
    if info.params().next().is_some() {
        let _ = writeln!(out, "\n| parameter | type | default | range | |\n|---|---|---|---|---|");
    }
    for (field, param) in info.params() {
        parameter(&mut out, &field.name, field, param);
    }
    let _ = writeln!(out, "\n| output | type | |\n|---|---|---|");
    for output in info.outputs {
        let ty = spelling::output(output, |port| format!("`{port}`"));
        let _ = writeln!(out, "| `{}` | {ty} | {} |", output.name, cell(output.doc));
    }
    out
}

/// Row of a parameter with its options; for a list of structs, also a row for each field.
fn parameter(out: &mut String, name: &str, field: &FieldInfo, param: &ParamInfo) {
    let default = if param.required { "must be given".to_owned() } else { format!("`{}`", cell(&param.written)) };
    let mut doc = cell(&field.doc);
    for choice in &param.choices {
        let _ = write!(doc, "<br>`{choice}`: {}", cell(&choice.doc));
    }
    let _ = writeln!(out, "| `{name}` | {} | {default} | {} | {doc} |", param.ty, cell(&spelling::range(param)));
    for field in &param.fields {
        let name = format!("{name}.{}", field.name);
        match &field.role {
            Role::Port(port) => {
                let _ =
                    writeln!(out, "| `{name}` | port: {} | | | {} |", cell(&spelling::port(port)), cell(&field.doc));
            }
            Role::Param(param) => parameter(out, &name, field, param),
        }
    }
}

/// Escapes text for a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// Anchors that hosting sites make from headings: lower case, dashes, numbered if repeated.
#[derive(Default)]
struct Anchors(BTreeMap<String, usize>);

impl Anchors {
    fn of(&mut self, heading: &str) -> String {
        let slug: String = heading
            .to_lowercase()
            .chars()
            .filter_map(|c| match c {
                ' ' => Some('-'),
                c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
                _ => None,
            })
            .collect();
        let seen = self.0.entry(slug.clone()).or_insert(0);
        *seen += 1;
        if *seen == 1 { slug } else { format!("{slug}-{}", *seen - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_unique() {
        let mut anchors = Anchors::default();
        assert_eq!(anchors.of("Tone and colour"), "tone-and-colour");
        assert_eq!(anchors.of("Material"), "material");
        assert_eq!(anchors.of("Material"), "material-1");
    }
}
