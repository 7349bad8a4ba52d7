//! Renames nodes, parameters, inputs, outputs, imports, presets, functions and local names at all their uses.
use super::capture;
use super::file::{File, Section};
use super::functions;
use super::names::{Occurrence, Symbol, quote};
use super::navigate::{Thing, everywhere, thing};
use super::world::Cx;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

/// Replacement of a range of text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// Bytes to replace.
    pub range: Range<usize>,
    /// New text.
    pub text: String,
}

/// Sorts edits by position; edits at one position keep their order.
pub fn sort(edits: &mut [Edit]) {
    edits.sort_by_key(|edit| (edit.range.start, edit.range.end));
}

/// Applies edits that do not overlap to a text.
pub fn apply(text: &str, edits: &[Edit]) -> String {
    let mut edits: Vec<Edit> = edits.to_vec();
    sort(&mut edits);
    let mut out = String::with_capacity(text.len());
    let mut at = 0;
    for edit in edits {
        out.push_str(text.get(at..edit.range.start).unwrap_or_default());
        out.push_str(&edit.text);
        at = edit.range.end.max(at);
    }
    out.push_str(text.get(at..).unwrap_or_default());
    out
}

/// Edits of several files.
pub type Edits = BTreeMap<PathBuf, Vec<Edit>>;

/// Range and name of the symbol that can be renamed at a position.
pub fn prepare(cx: Cx<'_>, file: &File, at: usize) -> Result<(Range<usize>, String), String> {
    let Some((found, thing)) = thing(cx, file, at) else {
        return Err("there is no name of a node, parameter, input, output, preset or import here".to_owned());
    };
    check_place(cx, &thing)?;
    let name = name_of(&thing.symbol).to_owned();
    Ok((found.range, name))
}

/// Edits that rename the symbol at a position everywhere.
pub fn rename(cx: Cx<'_>, file: &File, at: usize, name: &str) -> Result<Edits, String> {
    prepare(cx, file, at)?;
    let Some((_, thing)) = thing(cx, file, at) else { return Ok(Edits::new()) };
    check_name(&thing, name)?;
    if name_of(&thing.symbol) == name {
        return Ok(Edits::new());
    }
    if let Some(clash) = clash(&thing, name).or_else(|| capture::captured(cx, &thing, name)) {
        return Err(clash);
    }
    let mut edits = Edits::new();
    // Several names in one text with escapes are replaced by one edit.
    let mut escaped: BTreeMap<(PathBuf, usize), Vec<Occurrence>> = BTreeMap::new();
    for (file, found) in everywhere(cx, &thing) {
        let path = file.path.clone();
        if found.is_escaped() {
            escaped.entry((path, found.range.start)).or_default().push(found);
        } else {
            edits.entry(path).or_default().push(Edit { range: found.range, text: name.to_owned() });
        }
    }
    for ((path, _), places) in escaped {
        let Some((range, says)) = places.first().map(|first| first.literal.clone()) else { continue };
        let mut says = says.to_string();
        places.iter().rev().for_each(|place| says.replace_range(place.within.clone(), name));
        edits.entry(path).or_default().push(Edit { range, text: quote(&says) });
    }
    edits.values_mut().for_each(|edits| sort(edits));
    Ok(edits)
}

fn name_of(symbol: &Symbol) -> &str {
    match symbol {
        Symbol::Node(name)
        | Symbol::Param(name)
        | Symbol::Import(name)
        | Symbol::Function(name)
        | Symbol::Local(_, name)
        | Symbol::GivenFunction(_, name)
        | Symbol::Part(name)
        | Symbol::Output(name)
        | Symbol::Preset(name)
        | Symbol::Port(_, name)
        | Symbol::Given(_, name)
        | Symbol::GivenPreset(_, name)
        | Symbol::Graph(name)
        | Symbol::File(name) => name,
    }
}

/// Rejects symbols of library graphs, which are read-only, and names without a declaration.
fn check_place(cx: Cx<'_>, thing: &Thing) -> Result<(), String> {
    let name = name_of(&thing.symbol);
    if thing.file.path.to_string_lossy().starts_with("shibo:") {
        return Err(format!("`{name}` belongs to a graph that comes with the program, which cannot be changed"));
    }
    if super::navigate::declaration(cx, thing).is_none() {
        return Err(format!("`{name}` is not declared in `{}`", thing.file.path.display()));
    }
    Ok(())
}

fn check_name(thing: &Thing, name: &str) -> Result<(), String> {
    let word = name.starts_with(|c: char| c == '_' || c.is_ascii_alphabetic())
        && name.chars().all(|c| c == '_' || c.is_ascii_alphanumeric());
    let free = matches!(thing.symbol, Symbol::Output(_) | Symbol::Preset(_));
    if word || (free && !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-'))) {
        return Ok(());
    }
    Err(format!("`{name}` cannot be a name: a name is letters, digits and `_`, and does not begin with a digit"))
}

/// Reason why a name is not possible for a symbol, if any.
fn clash(thing: &Thing, name: &str) -> Option<String> {
    let sections: &[(Section, &str)] = match &thing.symbol {
        // Inputs share their names with nodes and parameters.
        Symbol::Node(own) if thing.file.entry(Section::Inputs, own).is_some() => {
            &[(Section::Nodes, "a node"), (Section::Inputs, "an input"), (Section::Params, "a parameter")]
        }
        Symbol::Node(_) => &[(Section::Nodes, "a node"), (Section::Inputs, "an input")],
        Symbol::Param(_) => &[(Section::Params, "a parameter"), (Section::Inputs, "an input")],
        Symbol::Import(_) => &[(Section::Imports, "an import"), (Section::Graphs, "a graph")],
        Symbol::Function(_) if functions::is_of_language(name) => {
            return Some(format!("`{name}` is a function of the language"));
        }
        Symbol::Function(_) => &[(Section::Functions, "a function")],
        Symbol::Output(_) => &[(Section::Outputs, "an output")],
        Symbol::Preset(_) => &[(Section::Presets, "a preset")],
        _ => &[],
    };
    let taken = sections.iter().find(|(section, _)| thing.file.entry(*section, name).is_some());
    taken.map(|(_, what)| format!("there is {what} `{name}` already in `{}`", thing.file.path.display()))
}
