//! Information about a place in a formula: the name there, or the part that an operator or a bracket makes.
use super::super::evaluate;
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::formula::{self, FormulaText, Inferred, Role, alone, literal};
use super::super::functions;
use super::super::types::Types;
use super::super::world::Cx;
use super::{Hover, Pictures, function_text, named};
use shibo_graph::syntax::formula::{Formula, PartKind, WordKind};
use shibo_value::Accepts;
use shibo_value::expression::Value;
use std::fmt::Write;

/// Name of the node that is added to a graph for the picture of a part.
const PART: &str = "_part_of_formula";

/// Hover text for a position in a formula.
pub(super) fn hover(
    cx: Cx<'_>,
    expect: Expect<'_>,
    text: &FormulaText<'_>,
    at: usize,
    pictures: &dyn Pictures,
) -> Option<Hover> {
    let formula = text.parse();
    let word = text.offset(at).and_then(|offset| formula.word_at(offset));
    let Some(index) = word else { return whole(cx, expect, text).or_else(|| named(cx, at, pictures)) };
    let range = text.in_file(&formula.words()[index].range)?;
    if let Some(markdown) = of_word(cx, text, &formula, index) {
        return Some(Hover { range, markdown });
    }
    if matches!(formula.words()[index].kind, WordKind::Name | WordKind::Param) {
        let mut found = named(cx, at, pictures)?;
        if text.role == Role::Value {
            found.markdown.push_str(&result(cx, expect, text));
        }
        return Some(found);
    }
    let number = formula.words()[index].kind == WordKind::Number;
    if text.role == Role::Value && number {
        return whole(cx, expect, text);
    }
    let part = formula.part_of(index).filter(|_| !number)?;
    let part = match formula.parts()[part].kind {
        PartKind::Let => formula.locals().iter().find(|local| formula.part_of(local.word) == Some(part))?.value,
        _ => part,
    };
    let range = text.in_file(&formula.parts()[part].range)?;
    Some(Hover { range, markdown: of_part(cx, text, &formula, part, pictures) })
}

/// Text for a function, a local name, a position or a constant.
fn of_word(cx: Cx<'_>, text: &FormulaText<'_>, formula: &Formula, index: usize) -> Option<String> {
    let word = &formula.words()[index];
    let says = formula.word(index);
    if word.kind != WordKind::Name {
        return None;
    }
    if formula.is_call(index) {
        let found = functions::called(cx, says);
        let texts: Vec<String> = found.iter().map(function_text).collect();
        return (!texts.is_empty()).then(|| texts.join("\n\n---\n"));
    }
    let first = says.split('.').next().unwrap_or_default();
    if let Some(local) = formula.local(first, word.range.start) {
        let value = formula.at(&formula.parts()[local.value].range);
        let found = Types::new(cx).parts(formula, text.role);
        let ty = found.get(local.value).and_then(|of| of.ty()).map_or("?", Accepts::name);
        return Some(format!("local name **{first}**: `{ty}`\n\n```\n{value}\n```"));
    }
    if let Role::Function(name) = text.role {
        let is_value = text.values(cx).contains(&first);
        return match functions::find(cx, name).filter(|_| is_value) {
            Some(function) => Some(format!("**{first}**, a value of `{}`", function.call)),
            None => known(says),
        };
    }
    let is_node = [Section::Nodes, Section::Inputs].into_iter().any(|section| cx.file.entry(section, first).is_some());
    if is_node && text.role == Role::Point { None } else { known(says) }
}

/// Text for a position, the canvas or a constant.
fn known(name: &str) -> Option<String> {
    let constant = || functions::of_language().find(|one| one.name == name).map(|one| one.doc);
    let doc = formula::manual(name).map(str::to_owned).or_else(constant)?;
    Some(format!("`{name}`\n\n{doc}"))
}

/// Text for a part: its type, its value if it is a constant, and its picture.
fn of_part(cx: Cx<'_>, text: &FormulaText<'_>, formula: &Formula, part: usize, pictures: &dyn Pictures) -> String {
    let says = formula.at(&formula.parts()[part].range).split_whitespace().collect::<Vec<_>>().join(" ");
    let of = Types::new(cx).parts(formula, text.role).get(part).copied().unwrap_or(Inferred::Unknown);
    let mut out = format!("`{says}`");
    let sound = !formula.is_faulty();
    let value = evaluate::value(cx, &format!("={}", alone(formula, part)));
    let value = value.filter(|value| sound && !matches!(value, Value::Word(_)));
    match (value, of.ty()) {
        (Some(value), _) => drop(write!(out, " is **{}**", evaluate::spell(&value))),
        (None, Some(ty)) => drop(write!(out, ": `{ty}`")),
        (None, None) => {}
    }
    let has_picture = sound && text.role == Role::Point && matches!(of, Inferred::Numbers(..));
    if let Some(known) = has_picture.then(|| preview(cx, formula, part, pictures)).flatten() {
        if !known.about.is_empty() {
            let _ = write!(out, "\n\n{}", known.about);
        }
        if let Some(url) = known.picture {
            let _ = write!(out, "\n\n![part]({url})");
        }
    }
    out
}

/// Preview of a part: of a node with its formula, which is added to the graph.
fn preview(cx: Cx<'_>, formula: &Formula, part: usize, pictures: &dyn Pictures) -> Option<super::Evaluated> {
    // Nodes of a local graph have pictures only where the graph is used.
    if cx.file.local_name().is_some() {
        return None;
    }
    let at = cx.file.section(Section::Nodes)?.inside().start;
    let mut changed = cx.file.text.to_string();
    changed.insert_str(at, &format!(" \"{PART}\": {},", literal(&alone(formula, part))));
    pictures.node_in(&cx.file.path, &changed, PART)
}

/// Text for a formula of one value, outside its names.
fn whole(cx: Cx<'_>, expect: Expect<'_>, text: &FormulaText<'_>) -> Option<Hover> {
    let shown = if text.role == Role::Value { result(cx, expect, text) } else { String::new() };
    (!shown.is_empty()).then(|| Hover { range: text.literal.clone(), markdown: shown.trim().to_owned() })
}

/// Value of a formula with its unit.
fn result(cx: Cx<'_>, expect: Expect<'_>, text: &FormulaText<'_>) -> String {
    let unit = match expect {
        Expect::Value(_, param) => param.bounds.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}")),
        _ => String::new(),
    };
    let value = evaluate::value(cx, text.content);
    value.map_or(String::new(), |v| format!("\n\n`{}` is **{}{unit}**", text.content, evaluate::spell(&v)))
}
