//! Moves the selected nodes into a new graph file, and uses that graph in their place.
use super::super::file::Section;
use super::super::formula::{formulas, local_names};
use super::super::functions::called_by;
use super::super::insert::{add_to, free_name, remove};
use super::super::names::{Reference, Symbol, occurrences, references};
use super::super::rename::{Edit, sort};
use super::super::types::Types;
use super::super::view::Item;
use super::super::world::Cx;
use super::{Action, ActionKind};
use shibo_value::{Accepts, Type};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::ops::Range;

/// Sections whose names the graph shares.
const NAMES: [Section; 2] = [Section::Nodes, Section::Inputs];

/// Contents of the new graph.
struct Plan<'a> {
    cx: Cx<'a>,
    /// Entries that move.
    moved: BTreeSet<usize>,
    /// References from moved entries to nodes that stay, with the name and type of the new input.
    inputs: BTreeMap<String, (String, Accepts)>,
    /// Parameters read by moved entries.
    params: BTreeSet<String>,
    /// References from outside to moved entries, with the name of the new output.
    outputs: BTreeMap<String, String>,
}

/// Returns the action if several nodes are selected.
pub(super) fn extract(cx: Cx<'_>, selected: &Range<usize>) -> Option<Action> {
    let body = cx.file.section(Section::Nodes)?;
    let chosen = |item: &Item| item.range.start < selected.end && selected.start < item.range.end && item.key.is_some();
    let moved: BTreeSet<usize> = (0..body.items.len()).filter(|i| chosen(&body.items[*i])).collect();
    if selected.is_empty() || moved.is_empty() || moved.len() == body.items.len() {
        return None;
    }
    let plan = Plan::new(cx, moved)?;
    let last = plan.moved.last().and_then(|index| body.items[*index].name()).unwrap_or("part");
    let name = plan.name(last);
    let path = cx.file.folder().join(format!("{name}.ron"));
    let node = free_name(cx.file, &NAMES, &format!("{name}_part"));
    if formulas(cx).iter().any(|(_, formula)| local_names(formula).any(|local| local == node)) {
        return None;
    }
    let mut edits = plan.edits(&name, &node);
    sort(&mut edits);
    let title = format!("Extract {} nodes to the sub-graph `{name}.ron`", plan.moved.len());
    let action = Action::new(title, ActionKind::Extract, cx.file, edits);
    Some(Action { creates: vec![(path, plan.text())], ..action })
}

impl<'a> Plan<'a> {
    fn new(cx: Cx<'a>, moved: BTreeSet<usize>) -> Option<Self> {
        let mut plan = Self { cx, moved, inputs: BTreeMap::new(), params: BTreeSet::new(), outputs: BTreeMap::new() };
        // Objects have no literals that could be defaults of inputs, so the nodes that make them move too.
        while let Some(more) = plan.look() {
            // An input of this graph cannot move.
            plan.moved.insert(more?);
        }
        plan.part_outputs();
        let body = cx.file.section(Section::Nodes)?;
        let uses_import =
            plan.moved.iter().any(|index| cx.file.head(&body.items[*index]).is_some_and(super::super::world::is_use));
        let calls_import = occurrences(cx)
            .iter()
            .any(|one| matches!(one.symbol, Symbol::GivenFunction(..)) && plan.inside(one.range.start));
        (!uses_import && !calls_import && !plan.is_hidden() && plan.moved.len() < body.items.len()).then_some(plan)
    }

    /// Returns whether a local name of a moved formula hides a new input, or a formula has escapes.
    fn is_hidden(&self) -> bool {
        formulas(self.cx).iter().any(|(text, formula)| {
            let hides = local_names(formula).any(|local| self.inputs.values().any(|(new, _)| new == local));
            text.place.is_none() || (hides && self.inside(text.literal.start))
        })
    }

    fn inside(&self, at: usize) -> bool {
        let items = self.cx.file.entries(Section::Nodes);
        self.moved.iter().any(|index| items[*index].range.contains(&at))
    }

    /// Collects inputs and outputs. Returns `Some` if another node has to move too, with `None` inside if that node
    /// cannot move.
    fn look(&mut self) -> Option<Option<usize>> {
        let types = Types::new(self.cx);
        (self.inputs, self.params, self.outputs) = Default::default();
        for found in occurrences(self.cx).into_iter().filter(|found| !found.declares) {
            if let (Symbol::Param(name), true) = (&found.symbol, self.inside(found.range.start)) {
                self.params.insert(name.clone());
            }
        }
        for Reference { node, says, range, .. } in references(self.cx) {
            let index = self.cx.file.position(Section::Nodes, &node);
            let moves = index.is_some_and(|index| self.moved.contains(&index));
            match (self.inside(range.start), moves) {
                (true, false) => {
                    let ty = types.of(&says);
                    let Some(ty) = ty.filter(|ty| default(*ty).is_some()) else { return Some(index) };
                    let input = self.input_name(&says);
                    self.inputs.insert(says, (input, ty));
                }
                (false, true) => {
                    // Not `node_port`, which may be the file name of a channel.
                    let output = says.split_once('.').map(|(node, port)| format!("{port}_of_{node}"));
                    self.outputs.insert(says.clone(), output.unwrap_or(says));
                }
                _ => {}
            }
        }
        None
    }

    /// Picks a name for the input of a reference that no node or parameter of the new graph can have.
    fn input_name(&self, says: &str) -> String {
        let plain = says.replace('.', "_");
        let node = plain != says && self.cx.file.entry(Section::Nodes, &plain).is_some();
        let taken = node || self.cx.file.entry(Section::Params, &plain).is_some();
        if taken { format!("{plain}_in") } else { plain }
    }

    /// Renames outputs that coincide with file names of each other's channels, such as `skin` and `skin_height`.
    fn part_outputs(&mut self) {
        let names: Vec<String> = self.outputs.values().cloned().collect();
        let channel = |a: &str, b: &str| b.strip_prefix(a).is_some_and(|rest| rest.starts_with('_'));
        if names.iter().any(|a| names.iter().any(|b| channel(a, b))) {
            self.outputs.values_mut().for_each(|name| name.push_str("_out"));
        }
    }

    /// Picks a name for the import and the file.
    fn name(&self, wanted: &str) -> String {
        let exists = |name: &str| self.cx.file.folder().join(format!("{name}.ron")).exists();
        let numbered = (2..).map(|n| format!("{wanted}_{n}"));
        let free = |name: &String| !exists(name) && self.cx.file.entry(Section::Imports, name).is_none();
        std::iter::once(wanted.to_owned()).chain(numbered).find(free).unwrap_or_default()
    }

    /// Text of the new graph.
    fn text(&self) -> String {
        let file = self.cx.file;
        let mut out = String::from("(\n  version: 1,\n");
        let canvas = file.body().and_then(|body| body.get("canvas")).map(|item| file.at(&item.range));
        if let Some(canvas) = canvas.filter(|canvas| !canvas.contains(['$', '='])) {
            let _ = writeln!(out, "  {canvas},");
        }
        if !self.inputs.is_empty() {
            out.push_str("\n  inputs: {\n");
            for (name, ty) in self.inputs.values() {
                let default = default(*ty).unwrap_or_default();
                let _ = writeln!(out, "    \"{name}\": {}({default}),", ty.name());
            }
            out.push_str("  },\n");
        }
        if !self.params.is_empty() {
            out.push_str("\n  params: {\n");
            let declared = self.declarations();
            for text in declared {
                let _ = writeln!(out, "    {text},");
            }
            out.push_str("  },\n");
        }
        let functions = self.functions();
        if !functions.is_empty() {
            out.push_str("\n  functions: {\n");
            for text in functions {
                let _ = writeln!(out, "    {text},");
            }
            out.push_str("  },\n");
        }
        out.push_str("\n  nodes: {\n");
        let items = file.entries(Section::Nodes);
        for index in &self.moved {
            let range = items[*index].range.clone();
            let _ = writeln!(out, "    {},", self.rewritten(&range));
        }
        out.push_str("  },\n\n  outputs: {\n");
        for (from, name) in &self.outputs {
            let _ = writeln!(out, "    \"{name}\": \"{from}\",");
        }
        out.push_str("  },\n)\n");
        out
    }

    /// Declarations of the parameters, and of the parameters read by their defaults.
    fn declarations(&self) -> Vec<&'a str> {
        let file = self.cx.file;
        let mut wanted: Vec<String> = self.params.iter().cloned().collect();
        let mut all = BTreeSet::new();
        while let Some(name) = wanted.pop() {
            let Some(item) = file.entry(Section::Params, &name) else { continue };
            if all.insert(name) {
                let text = file.at(&item.range);
                wanted.extend(super::super::names::params_in(text).into_iter().map(|r| text[r].to_owned()));
            }
        }
        let entries = file.entries(Section::Params).iter();
        entries
            .filter(|item| item.name().is_some_and(|name| all.contains(name)))
            .map(|item| file.at(&item.range))
            .collect()
    }

    /// Declarations of the functions that moved entries call.
    fn functions(&self) -> Vec<&'a str> {
        let file = self.cx.file;
        let found = occurrences(self.cx).into_iter().filter(|found| self.inside(found.range.start));
        let names = found.filter_map(|found| match found.symbol {
            Symbol::Function(name) => Some(name),
            _ => None,
        });
        let all = called_by(self.cx, names.collect());
        let entries = file.entries(Section::Functions).iter().enumerate();
        entries.filter(|(index, _)| all.contains(index)).map(|(_, item)| file.at(&item.range)).collect()
    }

    /// Text of a moved entry with references replaced by inputs.
    fn rewritten(&self, range: &Range<usize>) -> String {
        let mut edits = Vec::new();
        for found in references(self.cx) {
            let input = self.inputs.get(&found.says).filter(|_| range.contains(&found.range.start));
            if let Some((input, _)) = input {
                let (place, text) = found.replaced(input);
                edits.push(Edit { range: place.start - range.start..place.end - range.start, text });
            }
        }
        super::apply(self.cx.file.at(range), &edits)
    }

    /// Edits of this file.
    fn edits(&self, name: &str, node: &str) -> Vec<Edit> {
        let file = self.cx.file;
        let mut given: Vec<String> =
            self.inputs.iter().map(|(from, (input, _))| format!("\"{input}\": \"{from}\"")).collect();
        given.extend(self.params.iter().map(|param| format!("\"{param}\": \"${param}\"")));
        let with = if given.is_empty() { String::new() } else { format!(", with: {{ {} }}", given.join(", ")) };
        let entry = format!("\"{node}\": Use(graph: \"{name}\"{with})");
        let mut edits = add_to(file, Section::Imports, &format!("\"{name}\": \"{name}.ron\""));
        let Some(body) = file.section(Section::Nodes) else { return edits };
        for (i, index) in self.moved.iter().enumerate() {
            let item = &body.items[*index];
            edits.push(if i == 0 {
                Edit { range: item.range.clone(), text: entry.clone() }
            } else {
                remove(file, body, item)
            });
        }
        for found in references(self.cx).into_iter().filter(|found| !self.inside(found.range.start)) {
            if let Some(output) = self.outputs.get(&found.says) {
                let (range, text) = found.replaced(&format!("{node}.{output}"));
                edits.push(Edit { range, text });
            }
        }
        edits
    }
}

/// Declaration of the default of an input of this type, if it has a literal.
fn default(ty: Accepts) -> Option<&'static str> {
    match ty {
        Accepts::One(Type::Gray) | Accepts::Number | Accepts::Direction => Some("default: 0.5"),
        ty if Accepts::Field.fits(ty) => Some("default: 0.5"),
        Accepts::One(Type::Rgb) | Accepts::Color => Some("default: \"#808080\""),
        Accepts::One(Type::Material) => Some(""),
        _ => None,
    }
}
