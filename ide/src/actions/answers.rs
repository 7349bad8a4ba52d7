//! Edits a pinned text as the answers of the table of changes say. Source: LASTING §1, *The table of changes*.
use super::super::diagnose::Finding;
use super::super::file::{File, Section};
use super::super::format::change;
use super::super::names::{Symbol, occurrences};
use super::super::rename::Edit;
use super::super::view::{Body, Value};
use super::super::world::{Cx, World};
use super::pin::{pinned, pinned_at};
use super::{Action, ActionKind, apply};
use crate::insert::{append, remove};
use shibo_node::changes::{Answer, Change, Look, Thing};
use shibo_node::{KindInfo, Role};
use std::path::Path;

/// A text that follows the changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Answered {
    /// The new text.
    pub text: String,
    /// The changes after which pictures differ all the same: the number, and the name of the first node that it alters.
    pub differing: Vec<(u32, String)>,
}

/// Edits a text that is pinned at the change `from` as the answers of the changes up to `to` say. Kinds in `hold` of its
/// pins stay as they are. The pin is not raised.
pub fn answered(world: &dyn World, path: &Path, text: &str, (from, to): (u32, u32)) -> Answered {
    let mut result = Answered { text: text.to_owned(), differing: Vec::new() };
    for change in world.registry().changes().since(from).filter(|change| change.change <= to) {
        let file = File::new(path, result.text.as_str());
        let mut edits = Vec::new();
        let mut altered = None;
        for scope in file.scopes() {
            let found = follow(Cx { world, file: &scope }, change, &mut edits);
            altered = altered.or(found);
        }
        if let Some(node) = altered.filter(|_| change.look == Look::Look && !(change.answer.is_some() && change.exact))
        {
            result.differing.push((change.change, node));
        }
        result.text = apply(&result.text, &edits);
    }
    result
}

/// Takes the newest versions of nodes, where a finding says that the program does not have an earlier one.
pub(super) fn newest(cx: Cx<'_>, findings: &[Finding]) -> Option<Action> {
    let mends = findings.iter().position(|finding| finding.code == "changed-kind")?;
    let (path, text) = (&cx.file.path, &cx.file.text);
    let newest = cx.registry().changes().newest();
    let answered = answered(cx.world, path, text, (pinned_at(text)?, newest));
    let new = pinned(&answered.text, Some(newest))?;
    let edit = change(text, &(0..text.len()), &new)?;
    let title = format!("Take the versions of change {newest}");
    Some(Action { mends: Some(mends), ..Action::new(title, ActionKind::Fix, cx.file, vec![edit]) })
}

/// Adds the edits that a change asks for in a graph. Returns the name of the first node that the change alters.
fn follow(cx: Cx<'_>, change: &Change, edits: &mut Vec<Edit>) -> Option<String> {
    let mut first = None;
    match change.thing() {
        Thing::Kind(kind) if !is_held(cx.file, kind) => {
            for item in cx.file.entries(Section::Nodes) {
                let (Some(key), Some(value)) = (&item.key, &item.value) else { continue };
                let named = value.word().is_some_and(|word| cx.file.at(&word) == kind);
                let written = |field: &str| Some(cx.file.at(&value.body()?.value(field)?.range));
                if named && change.touches.includes(written) {
                    first.get_or_insert_with(|| key.name.clone());
                    edits.extend(change.answer.iter().flat_map(|answer| answer_of(cx, value, answer)));
                }
            }
        }
        Thing::Graph(name) => {
            let shipped = format!("shibo:{name}");
            let uses = cx.file.entries(Section::Imports).iter();
            let import = uses
                .filter(|item| item.value.as_ref().and_then(Value::text) == Some(&shipped))
                .find_map(|item| item.name());
            first = import.map(str::to_owned);
            if let (Some(import), Some(Answer::Outputs(names))) = (import, &change.answer) {
                let is_use = |node: &str| {
                    let value = cx.file.entry(Section::Nodes, node).and_then(|item| item.value.as_ref());
                    value.and_then(Value::body).and_then(|body| body.value("graph")).and_then(Value::text)
                        == Some(import)
                };
                for found in occurrences(cx) {
                    if let Symbol::Port(node, output) = &found.symbol
                        && let Some(new) = names.get(output)
                        && is_use(node)
                    {
                        edits.push(Edit { range: found.range.clone(), text: new.clone() });
                    }
                }
            }
        }
        Thing::All => first = cx.file.entries(Section::Nodes).iter().find_map(|item| item.name()).map(str::to_owned),
        Thing::Kind(_) => {}
    }
    first
}

/// True if the pins of the file hold a version of a kind.
fn is_held(file: &File, kind: &str) -> bool {
    let whole = file.whole();
    let pins = whole.body().and_then(|body| body.value("pins")).and_then(Value::body);
    pins.and_then(|pins| pins.value("hold")).and_then(Value::body).is_some_and(|hold| hold.get(kind).is_some())
}

/// The edits of a node.
fn answer_of(cx: Cx<'_>, node: &Value, answer: &Answer) -> Vec<Edit> {
    let (Some(body), Some(word)) = (node.body(), node.word()) else { return Vec::new() };
    match answer {
        Answer::Set { field, .. } if body.get(field).is_some() => Vec::new(),
        Answer::Set { field, value } => append(cx.file, body, &format!("{field}: {value}")),
        Answer::Rename { field, to } => {
            let key = body.get(field).and_then(|item| item.key.as_ref());
            key.map(|key| Edit { range: key.range.clone(), text: to.clone() }).into_iter().collect()
        }
        Answer::RenameKind { to } => vec![Edit { range: word, text: to.clone() }],
        Answer::Scale { field, by } => body.value(field).map(|value| scaled(cx, value, *by)).unwrap_or_default(),
        Answer::Remove { field } => body.get(field).map(|item| remove(cx.file, body, item)).into_iter().collect(),
        Answer::Formula(formula) => {
            let kind = cx.world.registry().info(cx.file.at(&word));
            let text = filled(cx, body, kind, formula);
            text.map(|text| Edit { range: node.range.clone(), text }).into_iter().collect()
        }
        // Only shipped graphs have other outputs.
        Answer::Outputs(_) => Vec::new(),
    }
}

/// Multiplies the numbers of a value. A reference and a formula become a product.
fn scaled(cx: Cx<'_>, value: &Value, by: f64) -> Vec<Edit> {
    if let Some(number) = cx.file.at(&value.range).parse::<f64>().ok().filter(|number| number.is_finite()) {
        return vec![Edit { range: value.range.clone(), text: shibo_node::spell_number(number * by) }];
    }
    if value.text().is_some() {
        let text = format!("\"= {} * {}\"", operand(cx.file.at(&value.range)), shibo_node::spell_number(by));
        return vec![Edit { range: value.range.clone(), text }];
    }
    let items = value.body().map_or(&[][..], |body| &body.items);
    items.iter().filter_map(|item| item.value.as_ref()).flat_map(|item| scaled(cx, item, by)).collect()
}

/// A formula whose `{field}` stand for the values of a node's fields. `None` where a value is unknown.
fn filled(cx: Cx<'_>, body: &Body, kind: Option<&KindInfo>, formula: &str) -> Option<String> {
    let mut parts = formula.split('{');
    let mut text = parts.next()?.to_owned();
    for part in parts {
        let (field, rest) = part.split_once('}')?;
        let default = || match &kind?.field(field)?.role {
            Role::Param(param) => Some(param.written.clone()),
            Role::Port(port) => port.default.map(shibo_node::spell_number),
        };
        text += &body.value(field).map(|value| operand(cx.file.at(&value.range))).or_else(default)?;
        text += rest;
    }
    Some(format!("\"= {text}\""))
}

/// A value as part of a formula.
fn operand(written: &str) -> String {
    let Some(text) = written.strip_prefix('"').and_then(|text| text.strip_suffix('"')) else {
        return written.to_owned();
    };
    match text.trim_start().strip_prefix('=') {
        Some(formula) => format!("({})", formula.trim()),
        None => text.strip_prefix('$').unwrap_or(text).to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Workspace;
    use crate::diagnose::Severity;
    use shibo_node::registry::Registry;
    use std::sync::Arc;

    /// A table after change 2 of the real one.
    fn registry(line: &'static str) -> Arc<Registry> {
        let head =
            r#"(change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone),"#;
        let table = format!("[{head} (change: 2, {line}, look: Look, what: \"new\", worst: 0.1, keeps: Gone)]");
        Arc::new(shibo_library::registry().with_changes(Box::leak(table.into_boxed_str())))
    }

    fn follow(line: &'static str, nodes: &str) -> (String, usize) {
        let text = format!("(version: 1, pins: 1, imports: {{ \"g\": \"shibo:goat\" }}, nodes: {{ {nodes} }})");
        let world = Workspace::new(registry(line), Vec::new());
        let answered = answered(&world, Path::new("a.ron"), &text, (1, 2));
        let nodes = answered.text.split("nodes: { ").nth(1).unwrap().trim_end_matches(" })").to_owned();
        (nodes, answered.differing.len())
    }

    #[test]
    fn follows_each_answer() {
        for (line, before, after, differing) in [
            (
                r#"kind: "Blur", version: 2, touches: All, answer: Set(field: "radius", value: "3"), exact: true"#,
                r#""a": Blur(input: "b"), "b": Blur(radius: 2)"#,
                r#""a": Blur(input: "b", radius: 3), "b": Blur(radius: 2)"#,
                0,
            ),
            (
                r#"kind: "Blur", version: 2, touches: Given(["radius"]), answer: Rename(field: "radius", to: "size")"#,
                r#""a": Blur(input: "b"), "b": Blur(radius: 2)"#,
                r#""a": Blur(input: "b"), "b": Blur(size: 2)"#,
                1,
            ),
            (
                r#"kind: "Blur", version: 2, touches: All, answer: RenameKind(to: "Soften"), exact: true"#,
                r#""a": Blur(radius: 2)"#,
                r#""a": Soften(radius: 2)"#,
                0,
            ),
            (
                r#"kind: "Blur", version: 2, touches: All, answer: Scale(field: "radius", by: 0.5), exact: true"#,
                r#""a": Blur(radius: 3), "b": Blur(radius: "$p"), "c": Blur(radius: "= p + 1"), "d": Blur(radius: (2, 4))"#,
                r#""a": Blur(radius: 1.5), "b": Blur(radius: "= p * 0.5"), "c": Blur(radius: "= (p + 1) * 0.5"), "d": Blur(radius: (1, 2))"#,
                0,
            ),
            (
                r#"kind: "Blur", version: 2, touches: All, answer: Remove(field: "radius")"#,
                r#""a": Blur(radius: 3, input: "b")"#,
                r#""a": Blur(input: "b")"#,
                1,
            ),
            (
                r#"kind: "Invert", version: 2, touches: All, answer: Formula("1 - {input}"), exact: true"#,
                r#""a": Invert(input: "b"), "c": Invert(input: "= b * 2")"#,
                r#""a": "= 1 - b", "c": "= 1 - (b * 2)""#,
                0,
            ),
            (
                r#"graph: "goat", version: 2, touches: Outputs(["lit"]), answer: Outputs({ "lit": "shown" }), exact: true"#,
                r#""u": Use(graph: "g"), "a": Blur(input: "u.lit"), "b": "= u.lit * 2""#,
                r#""u": Use(graph: "g"), "a": Blur(input: "u.shown"), "b": "= u.shown * 2""#,
                0,
            ),
            (r#"kind: "Blur", version: 2, touches: All"#, r#""a": Blur()"#, r#""a": Blur()"#, 1),
            (r#"kind: "Blur", version: 2, touches: Given(["radius"])"#, r#""a": Blur()"#, r#""a": Blur()"#, 0),
        ] {
            assert_eq!(follow(line, before), (after.to_owned(), differing), "{line}");
        }
    }

    #[test]
    fn kinds_that_a_pin_holds_stay() {
        let text = r#"(pins: (change: 1, hold: { "Blur": 1 }), nodes: { "a": Blur() })"#;
        let line = r#"kind: "Blur", version: 2, touches: All, answer: Set(field: "radius", value: "3")"#;
        let world = Workspace::new(registry(line), Vec::new());
        let answered = answered(&world, Path::new("a.ron"), text, (1, 2));
        assert_eq!((answered.text.as_str(), answered.differing.len()), (text, 0));
    }

    #[test]
    fn an_editor_takes_the_newest_versions() {
        let text = "(\n  pins: 1,\n  nodes: {\n    \"a\": Blur(),\n  },\n)\n";
        let line = r#"kind: "Blur", version: 2, touches: All, answer: Set(field: "radius", value: "3")"#;
        let mut world = Workspace::new(registry(line), Vec::new());
        let file = world.open(Path::new("a.ron"), text);
        let range = text.find("Blur").map(|at| at..at + 4).unwrap();
        let finding = Finding {
            range,
            severity: Severity::Error,
            code: "changed-kind".to_owned(),
            message: "gone".to_owned(),
            help: None,
            related: Vec::new(),
            unneeded: false,
            deprecated: false,
        };
        let action = newest(Cx { world: &world, file: &file }, &[finding]).unwrap();
        let after = apply(text, &action.edits[&file.path]);
        assert_eq!(after, text.replace("pins: 1", "pins: 2").replace("Blur()", "Blur(radius: 3)"));
    }
}
