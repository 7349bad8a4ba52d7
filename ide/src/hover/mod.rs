//! Information about the place under the cursor.
mod formula;

use super::docs;
use super::evaluate;
use super::expect::Expect;
use super::file::{File, Section};
use super::formula::FormulaText;
use super::functions;
use super::names::{self, Symbol};
use super::types::Types;
use super::view::{Item, Shape, Value};
use super::walk::{Spot, trail};
use super::world::{Cx, is_use};
use shibo_node::parse_color;
use shibo_picture::{SampleKind, header};
use shibo_value::{Accepts, Channel};
use std::fmt::Write;
use std::ops::Range;
use std::path::Path;

/// Hover text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hover {
    /// Range it is about.
    pub range: Range<usize>,
    /// Markdown text.
    pub markdown: String,
}

/// Preview and statistics of an evaluated node.
#[derive(Clone, Debug, Default)]
pub struct Evaluated {
    /// Address of its picture.
    pub picture: Option<String>,
    /// Size of its data, and its run time.
    pub about: String,
}

/// Looks up existing pictures. A missing picture may be made for the next request, but the hover does not wait for it.
pub trait Pictures {
    /// Address of the picture of a kind.
    fn kind(&self, kind: &str) -> Option<String>;

    /// Preview and statistics of a node of a file.
    fn node(&self, path: &Path, node: &str) -> Option<Evaluated>;

    /// The same for a node of a changed text of a file.
    fn node_in(&self, path: &Path, text: &str, node: &str) -> Option<Evaluated>;

    /// Address of a thumbnail of a picture file.
    fn file(&self, path: &Path) -> Option<String>;
}

/// Hover text for a position.
pub fn hover(cx: Cx<'_>, at: usize, pictures: &dyn Pictures) -> Option<Hover> {
    let file = cx.file.scope_at(at);
    let cx = cx.with(&file);
    let trail = trail(cx, at);
    let level = trail.last()?;
    match trail.spot {
        Spot::Key(item) => {
            let key = item.key.as_ref()?;
            let markdown = key_text(cx, level.inside, &key.name, pictures)?;
            Some(Hover { range: key.range.clone(), markdown })
        }
        Spot::Value(expect, value) => {
            let is_reference = value.text().is_some_and(|text| text.starts_with(['$', '=']));
            if let Some(markdown) = given_text(cx, expect, trail.entry()).filter(|_| !is_reference) {
                return Some(Hover { range: value.range.clone(), markdown });
            }
            if let Some(word) = value.word().filter(|word| word.start <= at && at <= word.end) {
                let markdown = word_text(cx, expect, cx.file.at(&word), pictures)?;
                return Some(Hover { range: word, markdown });
            }
            match &value.shape {
                Shape::Text(text) => match FormulaText::of(cx, expect, value) {
                    Some(text) => formula::hover(cx, expect, &text, at, pictures),
                    None => in_text(cx, value, text, at, pictures),
                },
                Shape::Number(_) => number_text(expect).map(|markdown| Hover { range: value.range.clone(), markdown }),
                _ => None,
            }
        }
        _ => None,
    }
}

/// Text for a key.
fn key_text(cx: Cx<'_>, inside: Expect<'_>, name: &str, pictures: &dyn Pictures) -> Option<String> {
    if let Some(field) = docs::fields(inside).iter().find(|field| field.name == name) {
        let owner = if let Expect::Kind(info) = inside { info.kind.as_str() } else { "an entry of the list" };
        return Some(docs::field(owner, field));
    }
    if let Some(field) = inside.fields().into_iter().find(|field| field.name == name) {
        return Some(format!("**{name}**: {}", field.manual()));
    }
    match inside {
        Expect::Section(Section::Nodes | Section::Inputs) => node_text(cx, name, None, pictures),
        Expect::Section(Section::Params) | Expect::Entry(Section::Presets, _) => param_text(cx, name),
        Expect::Section(Section::Outputs) => {
            let value = cx.file.entry(Section::Outputs, name)?.value.as_ref()?;
            let from = value.text().or_else(|| cx.file.text_of(value, "from"))?;
            let (node, port) = from.split_once('.').map_or((from, None), |(n, p)| (n, Some(p)));
            let Some(text) = node_text(cx, node, port, pictures) else {
                let ty = Types::new(cx).of_text(from).map_or("?", Accepts::name);
                return Some(format!("output **{name}**: `{ty}`"));
            };
            Some(format!("output **{name}**\n\n{text}"))
        }
        Expect::With(import, None) => {
            let file = cx.imported(import)?;
            let inner = Cx { world: cx.world, file: &file };
            param_text(inner, name).or_else(|| node_text(inner, name, None, pictures))
        }
        Expect::Section(Section::Imports | Section::Graphs) => graph_text(cx, name),
        Expect::Section(Section::Presets) => preset_text(cx.file, name),
        Expect::Section(Section::Functions) => {
            let found = functions::find(cx, super::file::head_name(name))?;
            Some(function_text(&found))
        }
        _ => None,
    }
}

/// Text for the value of a parameter of a graph: its default, or its value in a preset or in `with`.
fn given_text(cx: Cx<'_>, expect: Expect<'_>, entry: Option<(Section, &Item)>) -> Option<String> {
    match expect {
        Expect::Preset(name) => param_text(cx, name),
        Expect::With(import, Some(name)) => {
            let file = cx.imported(import)?;
            param_text(Cx { world: cx.world, file: &file }, name)
        }
        Expect::Param(_, Some("default")) => param_text(cx, entry?.1.name()?),
        _ => None,
    }
}

/// Text for a word, a kind or a choice.
fn word_text(cx: Cx<'_>, expect: Expect<'_>, word: &str, pictures: &dyn Pictures) -> Option<String> {
    if expect.takes_nodes() {
        if let Some(info) = cx.kind(word) {
            return Some(docs::kind(info, pictures.kind(word).as_deref()));
        }
        if let Some(doc) = crate::manual::words::doc(word) {
            return Some(format!("### {word}\n\n{doc}"));
        }
    }
    match expect {
        Expect::Value(field, param) => {
            let choice = param.choices.iter().find(|choice| choice.name == word)?;
            Some(docs::choice(choice, &field.name))
        }
        Expect::Entry(Section::Inputs, _) => Accepts::from_name(word).map(|ty| format!("an input of type `{ty}`")),
        Expect::Entry(Section::Params, _) => Some(format!("a parameter of type `{word}`")),
        _ => None,
    }
}

/// Text for a number: the manual of its field.
fn number_text(expect: Expect<'_>) -> Option<String> {
    match expect {
        Expect::Value(field, _) | Expect::Port(field, ..) => {
            Some(format!("**{}**: {}", field.name, docs::takes(field)))
        }
        _ => None,
    }
}

/// Hover text for a place between quotes.
fn in_text(cx: Cx<'_>, value: &Value, text: &str, at: usize, pictures: &dyn Pictures) -> Option<Hover> {
    if text.starts_with('#') && parse_color(text).is_some() {
        let [r, g, b] = parse_color(text)?;
        let markdown = format!("`{text}` is ({r:.4}, {g:.4}, {b:.4}), scene-linear");
        return Some(Hover { range: value.range.clone(), markdown });
    }
    named(cx, at, pictures)
}

/// Hover text for the name at a position.
fn named(cx: Cx<'_>, at: usize, pictures: &dyn Pictures) -> Option<Hover> {
    let found = names::at(cx, at)?;
    let markdown = match &found.symbol {
        Symbol::Node(name) => {
            let after = found.literal.1.get(found.within.end..).and_then(|rest| rest.strip_prefix('.'));
            let port = after.and_then(|after| after.split(|c: char| c != '_' && !c.is_ascii_alphanumeric()).next());
            let port = port.filter(|port| Types::new(cx).ports(name).iter().any(|known| known.is_called(port)));
            node_text(cx, name, port, pictures)?
        }
        Symbol::Port(node, port) => node_text(cx, node, Some(port), pictures)?,
        Symbol::Part(path) => part_text(cx, path),
        Symbol::Param(name) => param_text(cx, name)?,
        Symbol::Import(name) => graph_text(cx, name)?,
        Symbol::Graph(path) => {
            let found = cx.world.import(&cx.file.path, path)?;
            let file = cx.world.file(&found)?;
            format!("`{}`\n\n{}", found.display(), comment(&file.text))
        }
        Symbol::File(path) => picture_text(&cx.file.folder().join(path), pictures)?,
        Symbol::GivenPreset(import, name) => {
            let file = cx.imported(import)?;
            preset_text(&file, name)?
        }
        _ => return None,
    };
    Some(Hover { range: found.range, markdown })
}

/// Text for a channel or components of a value.
fn part_text(cx: Cx<'_>, path: &str) -> String {
    let ty = Types::new(cx).of(path).map_or("?", Accepts::name);
    let channel = path.rsplit('.').next().and_then(Channel::from_name);
    let default = channel.map_or(String::new(), |channel| {
        format!("\n\nThe channel of the material; {} where the material has none.", channel.default_text())
    });
    format!("**{path}**: `{ty}`{default}")
}

/// Text for a function.
fn function_text(function: &functions::Function) -> String {
    let body = function.compiled().map_or(String::new(), |of| format!("\n\n```\n{}\n```", of.body.trim()));
    let doc = if function.doc.is_empty() { String::new() } else { format!("\n\n{}", function.doc) };
    format!("`{}`{doc}{body}", function.call)
}

/// Text for a node or an input.
pub fn node_text(cx: Cx<'_>, name: &str, port: Option<&str>, pictures: &dyn Pictures) -> Option<String> {
    let types = Types::new(cx);
    if let Some(item) = cx.file.entry(Section::Inputs, name) {
        let ty = cx.file.head(item).unwrap_or("?");
        let doc = item.value.as_ref().and_then(|value| cx.file.text_of(value, "doc")).unwrap_or_default();
        return Some(format!("input **{name}**: `{ty}`\n\n{doc}"));
    }
    let item = cx.file.entry(Section::Nodes, name)?;
    let formula = item.value.as_ref().and_then(Value::text);
    let kind = cx.file.head(item).unwrap_or("?");
    let ports = types.ports(name);
    let mut text = String::new();
    let shown = port.map_or_else(|| ports.first(), |port| ports.iter().find(|p| p.is_called(port)));
    let ty = shown.and_then(|p| p.ty).map_or("?", Accepts::name);
    let dot = port.map_or(String::new(), |port| format!(".{port}"));
    let _ = match formula {
        Some(formula) => writeln!(text, "**{name}**: `{ty}`\n\n```\n{formula}\n```"),
        None => writeln!(text, "**{name}{dot}**: `{ty}`, by `{kind}`"),
    };
    if let Some(port) = shown.filter(|port| !port.doc.is_empty() && formula.is_none()) {
        let unit = port.unit.map_or(String::new(), |unit| format!(" In {unit}."));
        let _ = writeln!(text, "\n{}{unit}", port.doc);
    }
    if ports.len() > 1 {
        let list = ports.iter().map(|p| format!("`.{}` {}", p.name, p.ty.map_or("?", Accepts::name)));
        let _ = writeln!(text, "\nOutputs: {}", list.collect::<Vec<_>>().join(", "));
    }
    // Nodes of a local graph have pictures only where the graph is used.
    let is_whole = cx.file.local_name().is_none();
    let known = is_whole.then(|| pictures.node(&cx.file.path, &format!("{name}{dot}"))).flatten();
    if let Some(known) = known {
        if !known.about.is_empty() {
            let _ = writeln!(text, "\n{}", known.about);
        }
        if let Some(url) = known.picture {
            let _ = writeln!(text, "\n![{name}]({url})");
        }
    }
    let import = item.value.as_ref().filter(|_| is_use(kind)).and_then(|v| cx.file.text_of(v, "graph"));
    match import.and_then(|import| graph_text(cx, import)) {
        Some(graph) => drop(writeln!(text, "\n---\n{graph}")),
        None if formula.is_some() => {}
        None => drop(writeln!(text, "\n{}", docs::first_sentence(kind, cx.kind(kind)))),
    }
    Some(text)
}

/// Text for a parameter of the graph.
fn param_text(cx: Cx<'_>, name: &str) -> Option<String> {
    let item = cx.file.entry(Section::Params, name)?;
    let value = item.value.as_ref()?;
    let ty = cx.file.head(item).unwrap_or("?");
    let body = value.body();
    let written = |field: &str| body.and_then(|b| b.value(field)).map(|v| cx.file.at(&v.range).to_owned());
    let unit = cx.file.text_of(value, "unit").map_or(String::new(), |unit| format!(" {unit}"));
    let known = evaluate::param(cx, name).map(|v| evaluate::spell(&v)).or_else(|| written("default"))?;
    let mut text = format!("**${name}**: `{ty}` = **{known}{unit}**");
    if let Some(range) = written("range") {
        let _ = write!(text, ", range {range}");
    }
    let options: Vec<String> = cx.file.options(name).iter().map(|option| format!("`{option}`")).collect();
    if !options.is_empty() {
        let _ = write!(text, ", one of {}", options.join(", "));
    }
    if let Some(doc) = cx.file.text_of(value, "doc") {
        let _ = write!(text, "\n\n{doc}");
    }
    Some(text)
}

/// Text for a preset of a graph.
fn preset_text(file: &File, name: &str) -> Option<String> {
    let body = file.entry(Section::Presets, name)?.value.as_ref()?;
    Some(format!("preset **{name}**\n\n```ron\n{}\n```", file.at(&body.range)))
}

/// Text for the graph of an import.
fn graph_text(cx: Cx<'_>, import: &str) -> Option<String> {
    let file = cx.imported(import)?;
    let list = |section: Section| file.names(section).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let mut text = match cx.import_path(import) {
        Some(path) => format!("import **{import}**: `{}`\n\n{}", path.display(), comment(&file.text)),
        None => {
            let item = cx.file.entry(Section::Graphs, import)?;
            format!("local graph **{import}**\n\n{}", functions::comment_above(&cx.file.whole(), item))
        }
    };
    for (section, what) in [
        (Section::Inputs, "Inputs"),
        (Section::Params, "Parameters"),
        (Section::Presets, "Presets"),
        (Section::Outputs, "Outputs"),
    ] {
        let names = list(section);
        if !names.is_empty() {
            let _ = write!(text, "\n\n{what}: {names}");
        }
    }
    Some(text)
}

/// Comment at the beginning of a file.
fn comment(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("//"));
    lines.map(str::trim).filter(|line| !line.contains("shibo ")).collect::<Vec<_>>().join(" ")
}

/// Text for a picture file.
fn picture_text(path: &Path, pictures: &dyn Pictures) -> Option<String> {
    let bytes = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?.len();
    let mut text = format!("`{}`", path.display());
    match header(path) {
        Ok(header) => {
            let kind = match header.kind {
                SampleKind::U8 => "8 bit",
                SampleKind::U16 => "16 bit",
                SampleKind::F16 => "16 bit float",
                SampleKind::F32 => "32 bit float",
                SampleKind::U32 => "32 bit",
                SampleKind::I8 => "8 bit signed",
                SampleKind::I16 => "16 bit signed",
                SampleKind::I32 => "32 bit signed",
            };
            let (width, height, channels) = (header.width, header.height, header.channels);
            let plural = if channels == 1 { "" } else { "s" };
            let _ = write!(text, "\n\n{width} × {height}, {channels} channel{plural}, {kind}, {} KiB", bytes >> 10);
            if let Some(url) = pictures.file(path) {
                let _ = write!(text, "\n\n![picture]({url})");
            }
        }
        Err(_) => drop(write!(text, "\n\n{} KiB", bytes >> 10)),
    }
    Some(text)
}
