//! The manual in Markdown for editors, from the doc comments of nodes.
use super::expect::Expect;
use crate::manual::doc::summary;
use crate::manual::{markdown, spelling, words};
use shibo_node::{Choice, FieldInfo, KindInfo, ParamInfo, PortInfo, Role};
use shibo_picture::export::Takes;
use std::fmt::Write;

/// Manual of a kind; `picture` is the address of its picture.
pub(crate) fn kind(info: &KindInfo, picture: Option<&str>) -> String {
    let manual = markdown::node(info);
    let line = format!("![{0}](nodes/{0}.png)\n\n", info.kind);
    manual.replacen(&line, &picture.map(|url| format!("![{}]({url})\n\n", info.kind)).unwrap_or_default(), 1)
}

/// First sentence of a kind's manual, including `Use` and `Each`.
pub(crate) fn first_sentence(kind: &str, info: Option<&KindInfo>) -> String {
    let doc = info.map(|info| info.doc.as_str()).or_else(|| words::doc(kind));
    summary(doc.unwrap_or_default())
}

/// Short description of the values that a field takes.
pub(crate) fn takes(field: &FieldInfo) -> String {
    match &field.role {
        Role::Port(port) => spelling::port(port),
        Role::Param(param) => param_takes(param),
    }
}

fn param_takes(param: &ParamInfo) -> String {
    let range = spelling::range(param);
    let range = if range.is_empty() { String::new() } else { format!(", {range}") };
    format!("{}{range}, {}", param.ty, spelling::default(param))
}

/// Manual of a field of `owner`.
pub(crate) fn field(owner: &str, field: &FieldInfo) -> String {
    let mut text = format!("**{}** of `{owner}`: {}\n\n{}\n", field.name, takes(field), field.doc.trim());
    if let Role::Param(param) = &field.role {
        for choice in &param.choices {
            let _ = writeln!(text, "- `{choice}`: {}", choice.doc.replace('\n', " "));
        }
        for inner in &param.fields {
            let _ = writeln!(text, "- `{}` ({}): {}", inner.name, takes(inner), inner.doc.replace('\n', " "));
        }
    }
    text
}

/// Manual of an option.
pub(crate) fn choice(choice: &Choice, of: &str) -> String {
    format!("`{choice}`, a choice of **{of}**\n\n{}\n", choice.doc.trim())
}

/// Fields of a kind, or of a struct in a list.
pub(crate) fn fields(inside: Expect<'_>) -> &[FieldInfo] {
    match inside {
        Expect::Kind(info) => &info.fields,
        Expect::Struct(param) => &param.fields,
        _ => &[],
    }
}

/// Options allowed in a place, with their manuals.
pub(crate) fn words(expect: Expect<'_>) -> Vec<(String, String)> {
    let plain = |words: Vec<&str>| words.into_iter().map(|word| (word.to_owned(), String::new())).collect();
    match expect {
        Expect::Value(_, param) => param.choices.iter().map(|c| (c.name.clone(), c.doc.clone())).collect(),
        Expect::Param("Bool", Some("default")) => plain(vec!["true", "false"]),
        _ => plain(expect.takes().map(Takes::words).unwrap_or_default()),
    }
}

/// Returns whether a port takes only wires, of one type without literals.
pub(crate) fn only_wires(port: &PortInfo) -> bool {
    use shibo_value::{Accepts, Type};
    !matches!(port.ty, Accepts::One(Type::Gray | Type::Rgb) | Accepts::Number | Accepts::Color | Accepts::Direction)
        && !Accepts::Field.fits(port.ty)
}

/// Returns whether a manual marks its subject as deprecated.
pub(crate) fn deprecated(doc: &str) -> bool {
    doc.trim_start().starts_with("Deprecated")
}
