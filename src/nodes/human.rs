//! The manual as text for people.
use crate::terminal::{Style, Text};
use shibo_bridge::manual::Found;
use shibo_ide::manual::doc::{DocBlock, blocks, summary};
use shibo_ide::manual::spelling;
use shibo_ide::manual::words::{FAMILIES, WORDS};
use shibo_node::registry::Registry;
use shibo_node::{FieldInfo, KindInfo, ParamInfo, Role};

/// List of all kinds by family.
pub(super) fn families(page: &mut Text, registry: &Registry, width: usize) {
    let widest = registry.kinds().map(str::len).max().unwrap_or(0);
    for (name, doc) in registry.families() {
        page.styled(Style::Bold, name).end();
        paragraph(page, doc, "  ", width);
        let kinds = registry.kinds().filter_map(|kind| registry.info(kind)).filter(|info| info.family == *name);
        for info in kinds {
            row(page, &info.kind, &summary(&info.doc), widest, width);
        }
        page.end();
    }
    for (family, about) in FAMILIES {
        page.styled(Style::Bold, family).end();
        paragraph(page, about, "  ", width);
        for word in WORDS.iter().filter(|word| word.family == family) {
            row(page, word.name, &summary(&word.doc), widest, width);
        }
        page.end();
    }
    page.push(
        "`shibo nodes KIND` shows the manual of one, `shibo nodes WORDS` what fits some words, also those of other",
    )
    .end();
    page.push("programs.").end();
}

/// A kind and its summary.
fn row(page: &mut Text, kind: &str, text: &str, widest: usize, width: usize) {
    let indent = " ".repeat(widest + 6);
    let room = width.max(widest + 26);
    let options = textwrap::Options::new(room).initial_indent(&indent).subsequent_indent(&indent);
    let lines = textwrap::fill(text, options);
    page.push("    ").styled(Style::Accent, &format!("{kind:widest$}  "));
    page.push(lines.get(widest + 6..).unwrap_or_default()).end();
}

/// Results of a search.
pub(super) fn found(page: &mut Text, found: &[Found<'_>], width: usize) {
    let widest = found.iter().map(|found| found.kind.len()).max().unwrap_or(0);
    for one in found {
        let names = one.elsewhere.as_ref().map(|names| format!(" Elsewhere: {names}"));
        row(page, one.kind, &format!("{}{}", one.summary, names.unwrap_or_default()), widest, width);
    }
}

/// A manual that belongs to no kind.
pub(super) fn text(page: &mut Text, name: &str, family: &str, doc: &str, width: usize) {
    page.styled(Style::Bold, name).styled(Style::Dim, &format!("  {family}")).end().end();
    document(page, doc, "  ", width);
}

/// Manual of a kind.
pub(super) fn node(page: &mut Text, info: &KindInfo, width: usize) {
    page.styled(Style::Bold, &info.kind).styled(Style::Dim, &format!("  {}", info.family)).end().end();
    document(page, &info.doc, "  ", width);
    page.end().styled(Style::Bold, "Written").end();
    signature(page, info, width);
    if info.ports().next().is_some() {
        page.end().styled(Style::Bold, "Ports").end();
    }
    for (field, port) in info.ports() {
        entry(page, field, &spelling::port(port), "", width);
    }
    if info.params().next().is_some() {
        page.end().styled(Style::Bold, "Parameters").end();
    }
    for (field, param) in info.params() {
        parameter(page, field, param, "", width);
    }
    page.end().styled(Style::Bold, "Outputs").end();
    for (i, output) in info.outputs.iter().enumerate() {
        let main = if i == 0 { ", the main output" } else { "" };
        let ty = spelling::output(output, str::to_owned);
        page.push("  ").styled(Style::Accent, output.name).styled(Style::Dim, &format!("  {ty}{main}")).end();
        paragraph(page, output.doc, "      ", width);
    }
}

/// The node as written in a graph, with its defaults.
fn signature(page: &mut Text, info: &KindInfo, width: usize) {
    let arguments: Vec<String> = info
        .fields
        .iter()
        .filter_map(|field| match &field.role {
            Role::Port(port) if port.list => Some(format!("{}: [\"…\", \"…\"]", field.name)),
            Role::Port(port) if port.required => Some(format!("{}: \"…\"", field.name)),
            Role::Port(_) => None,
            Role::Param(param) if param.required => Some(format!("{}: \"…\"", field.name)),
            Role::Param(param) => Some(format!("{}: {}", field.name, param.written)),
        })
        .collect();
    let one_line = format!("{}({})", info.kind, arguments.join(", "));
    if one_line.chars().count() + 2 <= width {
        page.push("  ").push(&one_line).end();
        return;
    }
    page.push(&format!("  {}(", info.kind)).end();
    for argument in arguments {
        page.push(&format!("    {argument},")).end();
    }
    page.push("  )").end();
}

/// A parameter with its options; for a list of structs, the fields of a struct.
fn parameter(page: &mut Text, field: &FieldInfo, param: &ParamInfo, indent: &str, width: usize) {
    let mut facts = vec![param.ty.to_string(), spelling::default(param)];
    let range = spelling::range(param);
    if !range.is_empty() {
        facts.push(range);
    }
    entry(page, field, &facts.join(", "), indent, width);
    for choice in &param.choices {
        point(page, &format!("{choice}: {}", choice.doc), &format!("{indent}      "), width);
    }
    for inner in &param.fields {
        let indent = format!("{indent}      ");
        match &inner.role {
            Role::Port(port) => entry(page, inner, &spelling::port(port), &indent, width),
            Role::Param(param) => parameter(page, inner, param, &indent, width),
        }
    }
}

fn entry(page: &mut Text, field: &FieldInfo, facts: &str, indent: &str, width: usize) {
    page.push(indent).push("  ").styled(Style::Accent, &field.name);
    page.styled(Style::Dim, &format!("  {facts}")).end();
    document(page, &field.doc, &format!("{indent}      "), width);
}

fn document(page: &mut Text, doc: &str, indent: &str, width: usize) {
    let mut after_item = true;
    for (i, block) in blocks(doc).iter().enumerate() {
        let item = matches!(block, DocBlock::Item(_));
        if i > 0 && !(item && after_item) {
            page.end();
        }
        after_item = item;
        match block {
            DocBlock::Paragraph(text) => paragraph(page, text, indent, width),
            DocBlock::Item(text) => point(page, text, indent, width),
            DocBlock::Code(lines) => lines.iter().for_each(|line| {
                page.push(&format!("{indent}  {line}")).end();
            }),
        }
    }
}

/// An item of a list.
fn point(page: &mut Text, text: &str, indent: &str, width: usize) {
    let (first, rest) = (format!("{indent}- "), format!("{indent}  "));
    let options = textwrap::Options::new(width.max(40)).initial_indent(&first).subsequent_indent(&rest);
    page.push(&textwrap::fill(text, options)).end();
}

fn paragraph(page: &mut Text, text: &str, indent: &str, width: usize) {
    let options = textwrap::Options::new(width.max(40)).initial_indent(indent).subsequent_indent(indent);
    page.push(&textwrap::fill(text, options)).end();
}
