//! Actions on formulas: a part becomes a node, and a formula node is put where its value is read.
use super::super::expect::Expect;
use super::super::file::{File, Section};
use super::super::formula::{FormulaText, Inferred, Role, Space, alone, free_names, literal, local_names, put};
use super::super::insert::{append, put_above, remove};
use super::super::names::{self, Occurrence, Symbol, occurrences};
use super::super::rename::{Edit, sort};
use super::super::types::Types;
use super::super::view::Value;
use super::super::walk::{Spot, trail};
use super::super::world::Cx;
use super::{Action, ActionKind};
use shibo_graph::syntax::formula::{Formula, PartKind, begins};
use std::ops::Range;

/// Longest text of a part in a title.
const LONGEST: usize = 40;

/// Makes a node of the selected part of a formula, or of the part at the cursor.
pub(super) fn name_part(cx: Cx<'_>, selected: &Range<usize>) -> Option<Action> {
    let trail = trail(cx, selected.start);
    let Spot::Value(expect, value) = trail.spot else { return None };
    let text = FormulaText::of(cx, expect, value).filter(|text| text.role == Role::Point)?;
    let formula = text.parse();
    let part = chosen(&formula, &text, selected).filter(|_| !formula.is_faulty())?;
    let is_node = matches!(expect, Expect::Entry(Section::Nodes, _));
    // Brackets around a part go with it.
    let outer = formula.parts()[part].parent.filter(|parent| formula.parts()[*parent].kind == PartKind::Bracket);
    let replaced = outer.unwrap_or(part);
    let is_whole = formula.root() == Some(replaced);
    let of = Types::new(cx).parts(&formula, text.role).get(part).copied();
    if (is_whole && is_node) || matches!(of, Some(Inferred::Numbers(2 | 4, Space::Solid) | Inferred::Word)) {
        return None;
    }
    let entry = trail.entry();
    let owner = entry.and_then(|(_, item)| item.name()).unwrap_or("part");
    let name = free_name(cx.file, &formula, &format!("{owner}_part"));
    let node = format!("\"{name}\": {}", literal(&alone(&formula, part)));
    let mut edits = match entry {
        Some((Section::Nodes, item)) => vec![put_above(cx.file, item, &node)],
        _ => append(cx.file, cx.file.section(Section::Nodes)?, &node),
    };
    edits.push(if is_whole {
        Edit { range: text.literal.clone(), text: format!("\"{name}\"") }
    } else {
        Edit { range: text.in_file(&formula.parts()[replaced].range)?, text: name.clone() }
    });
    sort(&mut edits);
    let says = shortened(formula.at(&formula.parts()[part].range));
    Some(Action::new(format!("Name this part as node `{name}`: {says}"), ActionKind::Extract, cx.file, edits))
}

/// The part that is selected, or that the word at the cursor makes; `None` for single words.
fn chosen(formula: &Formula, text: &FormulaText<'_>, selected: &Range<usize>) -> Option<usize> {
    let start = text.offset(selected.start)?;
    let part = if selected.is_empty() {
        formula.part_of(formula.word_at(start)?)?
    } else {
        let end = text.offset(selected.end)?;
        let says = text.says().get(start..end)?;
        let start = start + says.len() - says.trim_start().len();
        formula.covering(&(start..start + says.trim().len()))?
    };
    // Inside brackets, the part is the value there.
    let part = match formula.parts()[part].kind {
        PartKind::Bracket | PartKind::Let => formula.operands(part).first().copied()?,
        _ => part,
    };
    let made = [PartKind::Sign, PartKind::Binary, PartKind::Call, PartKind::Vector, PartKind::Letters];
    made.contains(&formula.parts()[part].kind).then_some(part)
}

/// A name that no node or input has, and no name in the formula.
fn free_name(file: &File, formula: &Formula, wanted: &str) -> String {
    let sections = [Section::Nodes, Section::Inputs];
    let names: Vec<&str> = local_names(formula).chain(free_names(formula, &[])).collect();
    let is_free = |name: &String| {
        sections.iter().all(|section| file.entry(*section, name).is_none()) && !names.contains(&name.as_str())
    };
    let numbered = (2..).map(|n| format!("{wanted}_{n}"));
    std::iter::once(wanted.to_owned()).chain(numbered).find(is_free).unwrap_or_default()
}

fn shortened(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// Puts a formula node where its value is read: at the reference at a position, or at its single reader if the position is
/// on its name.
pub(super) fn put_in_place(cx: Cx<'_>, at: usize) -> Option<Action> {
    let found = names::at(cx, at)?;
    let Symbol::Node(name) = &found.symbol else { return None };
    let item = cx.file.entry(Section::Nodes, name)?;
    let node = item.value.as_ref().filter(|value| value.text().is_some_and(|text| begins(text).is_some()))?;
    let all = occurrences(cx);
    let mut readers = all.iter().filter(|one| !one.declares && one.symbol == found.symbol);
    let first = readers.next()?;
    let is_single = readers.next().is_none();
    let place = if found.declares { Some(first).filter(|_| is_single)? } else { &found };
    let own = item.range.start <= place.range.start && place.range.end <= item.range.end;
    let mut edits = if own { None } else { replaced(cx, place, node) }?;
    if is_single {
        edits.push(remove(cx.file, cx.file.section(Section::Nodes)?, item));
    }
    sort(&mut edits);
    Some(Action::new(format!("Put `{name}` in place"), ActionKind::Inline, cx.file, edits))
}

/// Edits that put the formula `node` in the place of a reference.
fn replaced(cx: Cx<'_>, place: &Occurrence, node: &Value) -> Option<Vec<Edit>> {
    let Spot::Value(expect, value) = trail(cx, place.literal.0.start + 1).spot else { return None };
    let says = node.text()?;
    let inner = &says[begins(says)?..];
    if let Some(text) = FormulaText::of(cx, expect, value) {
        let outer = text.parse();
        let word = outer.word_at(text.offset(place.range.start)?)?;
        let put = put(&outer, word, place.range.len(), inner)?;
        let start = text.in_file(&outer.words().first()?.range)?.start;
        let mut edits = vec![Edit { range: text.in_file(&outer.words()[word].range)?, text: put.text }];
        if !put.definitions.is_empty() {
            edits.push(Edit { range: start..start, text: put.definitions });
        }
        return Some(edits);
    }
    let holds = expect.reference(cx).is_some() && !matches!(expect, Expect::Use(..));
    let content = value.text().filter(|_| holds && !place.is_escaped())?;
    let text = if content.len() == place.within.len() {
        cx.file.at(&node.range).to_owned()
    } else {
        let put = put(&Formula::parse(content), 0, place.within.end, inner)?;
        literal(&format!("{}{}", put.definitions, put.text))
    };
    Some(vec![Edit { range: value.range.clone(), text }])
}
