//! Edits a pinned text as the answers of the table of changes say. Source: LASTING §1, *The table of changes*.
use super::super::diagnose::Finding;
use super::super::expect::Expect;
use super::super::file::{File, Section};
use super::super::format::change;
use super::super::formula::formulas;
use super::super::names::{Symbol, occurrences};
use super::super::rename::Edit;
use super::super::view::{Body, Item, Value};
use super::super::walk::{Visit, walk};
use super::super::world::{Cx, World};
use super::pin::{held, is_held, pinned, pinned_at};
use super::{Action, ActionKind, apply};
use crate::insert::{append, remove};
use shibo_node::changes::{Answer, Change, Look, Thing};
use shibo_node::registry::Library;
use shibo_node::{KindInfo, Role};
use std::path::Path;

/// The help of advice about a version that `shibo migrate` raises.
pub const MIGRATE: &str = "`shibo migrate FILE` takes the newest version";

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
        let (mut edits, mut differs) = (Vec::new(), None);
        for scope in file.scopes() {
            let followed = follow(Cx { world, file: &scope }, change);
            edits.extend(followed.edits);
            differs = differs.or(followed.differs);
        }
        result.differing.extend(differs.map(|node| (change.change, node)));
        result.text = apply(&result.text, &edits);
    }
    result
}

/// Takes the newest versions of nodes, where a finding says that the program does not have an earlier one, or advises that
/// there is a newer one. A version that the pins hold is released instead.
pub(super) fn newest(cx: Cx<'_>, findings: &[Finding]) -> Option<Action> {
    let gone = findings.iter().position(|finding| finding.code == "changed-kind");
    let is_advice = |finding: &Finding| finding.help.as_deref() == Some(MIGRATE);
    let mends = gone.or_else(|| findings.iter().position(is_advice))?;
    let (path, text) = (&cx.file.path, &cx.file.text);
    if let Some(action) = text.get(findings[mends].range.clone()).and_then(|kind| released(cx, kind)) {
        return Some(Action { mends: Some(mends), ..action });
    }
    let newest = cx.registry().changes().newest();
    let answered = answered(cx.world, path, text, (pinned_at(text)?, newest));
    let new = pinned(&answered.text, Some(newest))?;
    let edit = change(text, &(0..text.len()), &new)?;
    let title = format!("Take the versions of change {newest}");
    let action = Action::new(title, ActionKind::Fix, cx.file, vec![edit]);
    // A graph without an error keeps its picture unless its author asks for the new one.
    Some(Action { mends: Some(mends), is_preferred: gone.is_some(), ..action })
}

/// Removes a kind from the versions that the pins hold. `None` if they do not hold it.
fn released(cx: Cx<'_>, kind: &str) -> Option<Action> {
    let hold = held(cx.file)?;
    let edit = remove(cx.file, &hold, hold.get(kind)?);
    Some(Action::new(format!("Remove `{kind}` from `hold`"), ActionKind::Fix, cx.file, vec![edit]))
}

/// The effect of a change on a graph.
#[derive(Default)]
struct Followed {
    /// The edits that answer it.
    edits: Vec<Edit>,
    /// The name of the first node that looks different all the same.
    differs: Option<String>,
}

impl Followed {
    /// Adds a node that the change alters, and the edits that answer it; `None` if no edit can.
    fn add(&mut self, cx: Cx<'_>, change: &Change, node: &Value, edits: Option<Vec<Edit>>) {
        let is_exact = change.exact && edits.is_some();
        if change.look == Look::Look && !is_exact {
            self.differs.get_or_insert_with(|| name_of(cx, node));
        }
        // A node within a node that is replaced goes with it.
        let is_free = |edit: &Edit| {
            !self.edits.iter().any(|other| edit.range.start < other.range.end && other.range.start < edit.range.end)
        };
        let free: Vec<Edit> = edits.into_iter().flatten().filter(is_free).collect();
        self.edits.extend(free);
    }
}

/// The edits that a change asks for in a graph, and the first node that it alters all the same.
fn follow(cx: Cx<'_>, change: &Change) -> Followed {
    let mut followed = Followed::default();
    let mut nodes = Nodes(Vec::new());
    walk(cx, &mut nodes);
    match change.thing() {
        Thing::Kind(kind) if is_held(cx.file, kind) => {}
        Thing::Kind(kind) => {
            for node in nodes.0.into_iter().filter(|node| cx.file.word(node) == Some(kind)) {
                let written = |field: &str| Some(cx.file.at(&node.body()?.value(field)?.range));
                if change.touches.includes(written) {
                    let edits = change.answer.as_ref().and_then(|answer| answer_of(cx, node, answer));
                    followed.add(cx, change, node, edits);
                }
            }
        }
        Thing::Graph(name) => {
            let library = cx.registry().library();
            let means = |path: &str| is_shipped(library, path, name);
            let is_import = |item: &&Item| item.value.as_ref().and_then(Value::text).is_some_and(means);
            let imports: Vec<&str> =
                cx.file.entries(Section::Imports).iter().filter(is_import).filter_map(Item::name).collect();
            let is_use = |node: &Value| {
                let graph = node.body().and_then(|body| body.value("graph")).and_then(Value::text);
                graph.is_some_and(|graph| imports.contains(&graph))
            };
            let names = match &change.answer {
                Some(Answer::Outputs(names)) => Some(names),
                _ => None,
            };
            for node in nodes.0.into_iter().filter(|node| is_use(node) && is_given(cx, node, change)) {
                followed.add(cx, change, node, names.map(|_| Vec::new()));
            }
            if change.look == Look::Look && change.touches.includes(|_| None) {
                followed.differs = followed.differs.or_else(|| caller(cx, &imports));
            }
            for found in names.iter().flat_map(|_| occurrences(cx)) {
                let Symbol::Port(node, output) = &found.symbol else { continue };
                let user = cx.file.entry(Section::Nodes, node).and_then(|item| item.value.as_ref());
                if let Some(new) = names.and_then(|names| names.get(output)).filter(|_| user.is_some_and(is_use)) {
                    followed.edits.push(Edit { range: found.range.clone(), text: new.clone() });
                }
            }
        }
        Thing::All => {
            if let Some(first) = nodes.0.first() {
                followed.add(cx, change, first, None);
            }
        }
    }
    followed
}

/// All nodes of a graph, also those that stand in ports.
struct Nodes<'a>(Vec<&'a Value>);

impl<'a> Visit<'a> for Nodes<'a> {
    fn key(&mut self, _inside: Expect<'a>, _item: &'a Item) {}

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        if expect.takes_nodes() && value.word().is_some() {
            self.0.push(value);
        }
    }
}

/// The name of a node; of one without a name, that of the node around it, or its kind.
fn name_of(cx: Cx<'_>, node: &Value) -> String {
    name_at(cx, node.range.start).or_else(|| cx.file.word(node)).unwrap_or_default().to_owned()
}

/// The name of the node around a place.
fn name_at(cx: Cx<'_>, at: usize) -> Option<&str> {
    let around = |item: &&Item| item.range.contains(&at);
    cx.file.entries(Section::Nodes).iter().find(around).and_then(Item::name)
}

/// The name of the first node with a formula that calls a function of one of these imports; for a formula elsewhere, that of the
/// function.
fn caller(cx: Cx<'_>, imports: &[&str]) -> Option<String> {
    let is_of = |name: &&str| name.rsplit_once('.').is_some_and(|(import, _)| imports.contains(&import));
    formulas(cx).iter().find_map(|(text, formula)| {
        let mut calls = (0..formula.words().len()).filter(|word| formula.is_call(*word)).map(|word| formula.word(word));
        let called = calls.find(is_of)?;
        Some(name_at(cx, text.literal.start).unwrap_or(called).to_owned())
    })
}

/// True if a change can alter a use of a shipped graph, by the values that the use gives.
fn is_given(cx: Cx<'_>, user: &Value, change: &Change) -> bool {
    let body = user.body();
    let with = body.and_then(|body| body.value("with")).and_then(Value::body);
    change.touches.includes(|field| match with.and_then(|with| with.value(field)) {
        Some(value) => Some(cx.file.at(&value.range)),
        // A preset may give any value.
        None => body?.get("preset").map(|_| "$"),
    })
}

/// True if an import means the shipped graph that the table of changes calls `name`.
fn is_shipped(library: Option<&dyn Library>, import: &str, name: &str) -> bool {
    let Some(import) = import.strip_prefix("shibo:") else { return false };
    let import = import.trim_start_matches('/');
    let found = library.and_then(|library| library.find(import.strip_suffix(".ron").unwrap_or(import)));
    found.is_some_and(|path| path.strip_suffix(".ron") == Some(name))
}

/// The edits of a node; `None` if no edit can answer the change.
fn answer_of(cx: Cx<'_>, node: &Value, answer: &Answer) -> Option<Vec<Edit>> {
    let (body, word) = (node.body()?, node.word()?);
    Some(match answer {
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
            let text = filled(cx, body, kind, formula)?;
            vec![Edit { range: node.range.clone(), text }]
        }
        // Only shipped graphs have other outputs.
        Answer::Outputs(_) => return None,
    })
}

/// Multiplies the numbers of a value. A reference and a formula become a product.
fn scaled(cx: Cx<'_>, value: &Value, by: f64) -> Vec<Edit> {
    if let Some(number) = cx.file.at(&value.range).parse::<f64>().ok().filter(|number| number.is_finite()) {
        return vec![Edit { range: value.range.clone(), text: shibo_node::spell_number(number * by) }];
    }
    if value.text().is_some() {
        let text = format!("\"= {} * {}\"", operand(cx, value), shibo_node::spell_number(by));
        return vec![Edit { range: value.range.clone(), text }];
    }
    let items = value.body().map_or(&[][..], |body| &body.items);
    items.iter().filter_map(|item| item.value.as_ref()).flat_map(|item| scaled(cx, item, by)).collect()
}

/// A formula whose `{field}` stand for the values of a node's fields. `None` where a value is unknown, or a node.
fn filled(cx: Cx<'_>, body: &Body, kind: Option<&KindInfo>, formula: &str) -> Option<String> {
    let mut parts = formula.split('{');
    let mut text = parts.next()?.to_owned();
    for part in parts {
        let (field, rest) = part.split_once('}')?;
        let default = || match &kind?.field(field)?.role {
            Role::Param(param) => Some(param.written.clone()),
            Role::Port(port) => port.default.map(shibo_node::spell_number),
        };
        text += &match body.value(field) {
            Some(value) if value.word().is_some() => return None,
            Some(value) => operand(cx, value),
            None => default()?,
        };
        text += rest;
    }
    Some(format!("\"= {text}\""))
}

/// A value as part of a formula.
fn operand(cx: Cx<'_>, value: &Value) -> String {
    let Some(text) = value.text() else { return cx.file.at(&value.range).to_owned() };
    match text.trim_start().strip_prefix('=') {
        Some(formula) => format!("({})", formula.trim()),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Workspace;
    use crate::diagnose::{Severity, by_file};
    use shibo_graph::{LoadOptions, load_text};
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
                r#""a": Blur(radius: 3), "b": Blur(radius: "$p"), "c": Blur(radius: r"= $p + 1"), "d": Blur(radius: (2, 4))"#,
                r#""a": Blur(radius: 1.5), "b": Blur(radius: "= $p * 0.5"), "c": Blur(radius: "= ($p + 1) * 0.5"), "d": Blur(radius: (1, 2))"#,
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
            // Nodes in ports have no name.
            (
                r#"kind: "Blur", version: 2, touches: All, answer: Set(field: "radius", value: "3"), exact: true"#,
                r#""a": Invert(input: Blur(input: Blur(input: "b")))"#,
                r#""a": Invert(input: Blur(input: Blur(input: "b", radius: 3), radius: 3))"#,
                0,
            ),
            (
                r#"kind: "Invert", version: 2, touches: All, answer: Formula("1 - {input}"), exact: true"#,
                r#""a": Invert(input: Blur(input: "b")), "c": Blur(input: Invert(input: "b"))"#,
                r#""a": Invert(input: Blur(input: "b")), "c": Blur(input: "= 1 - b")"#,
                1,
            ),
            (r#"graph: "goat", version: 2, touches: All"#, r#""a": "= g.f(x)""#, r#""a": "= g.f(x)""#, 1),
            (r#"kind: "Blur", version: 2, touches: All"#, r#""a": Blur()"#, r#""a": Blur()"#, 1),
            (r#"kind: "Blur", version: 2, touches: Given(["radius"])"#, r#""a": Blur()"#, r#""a": Blur()"#, 0),
        ] {
            assert_eq!(follow(line, before), (after.to_owned(), differing), "{line}");
        }
    }

    #[test]
    fn callers_of_functions_of_shipped_graphs_are_found() {
        let line = r#"graph: "denim", version: 2, touches: All"#;
        for (text, differs) in [
            (r#"nodes: { "r": Blur(), "b": Blur(radius: "= 2 * d.float(1)") }"#, Some("b")),
            (r#"params: { "p": Number(default: "= d.float(1)") }, nodes: { "r": Blur() }"#, Some("d.float")),
            (r#"nodes: { "b": "= e.float(x) + float(x)" }"#, None),
            (r#"functions: { "f(x)": "d.float(x)" }, nodes: { "b": "= f(x)" }"#, Some("d.float")),
        ] {
            let text = format!(r#"(pins: 1, imports: {{ "d": "shibo:denim", "e": "shibo:goat" }}, {text})"#);
            let world = Workspace::new(registry(line), Vec::new());
            let answered = answered(&world, Path::new("a.ron"), &text, (1, 2));
            let found = answered.differing.iter().map(|(_, node)| node.as_str()).next();
            assert_eq!(found, differs, "{text}");
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
    fn uses_of_shipped_graphs_are_found() {
        let line = r#"graph: "lib/wrinkles", version: 2, touches: Given(["depth"])"#;
        let imports = r#""a": "shibo:wrinkles", "b": "shibo:lib/wrinkles.ron", "c": "shibo:goat""#;
        for (nodes, differs) in [
            (r#""u": Use(graph: "a"), "v": Use(graph: "b", with: { "depth": 2 })"#, Some("v")),
            (r#""u": Use(graph: "a", preset: "old")"#, Some("u")),
            (r#""p": PlacePieces(), "u": Each(graph: "a", ids: "p.ids", over: 2, with: { "depth": 2 })"#, Some("u")),
            (r#""blurred": Blur(input: Use(graph: "b", with: { "depth": 2 }))"#, Some("blurred")),
            (r#""u": Use(graph: "a"), "v": Use(graph: "c", with: { "depth": 2 })"#, None),
            // A value that is given changes no function.
            (r#""f": "= a.ridge(x)""#, None),
        ] {
            let text = format!("(pins: 1, imports: {{ {imports} }}, nodes: {{ {nodes} }})");
            let world = Workspace::new(registry(line), Vec::new());
            let answered = answered(&world, Path::new("a.ron"), &text, (1, 2));
            let found = answered.differing.iter().map(|(_, node)| node.as_str()).collect::<Vec<_>>();
            assert_eq!((answered.text.as_str(), found), (text.as_str(), differs.into_iter().collect()), "{nodes}");
        }
    }

    /// A finding at the first `word` of a text.
    fn finding(text: &str, word: &str, code: &str, help: Option<&str>) -> Finding {
        let start = text.find(word).unwrap();
        Finding {
            range: start..start + word.len(),
            severity: Severity::Warning,
            code: code.to_owned(),
            message: "gone".to_owned(),
            help: help.map(str::to_owned),
            related: Vec::new(),
            unneeded: false,
            deprecated: false,
        }
    }

    #[test]
    fn an_editor_releases_versions_that_are_held() {
        let line = r#"kind: "Blur", version: 2, touches: All"#;
        for (before, after) in [
            (r#"hold: { "Blur": 1, "Invert": 1 }"#, r#"hold: { "Invert": 1 }"#),
            (r#"hold: { "Blur": 1 }"#, "hold: { }"),
        ] {
            let text = format!("(pins: (change: 2, {before}), nodes: {{ \"a\": Blur() }})");
            let mut world = Workspace::new(registry(line), Vec::new());
            let file = world.open(Path::new("a.ron"), text.as_str());
            let start = text.find("Blur()").unwrap();
            let found = Finding { range: start..start + 4, ..finding(&text, "Blur", "changed-kind", None) };
            let action = newest(Cx { world: &world, file: &file }, &[found]).unwrap();
            assert_eq!(action.title, "Remove `Blur` from `hold`");
            assert_eq!(apply(&text, &action.edits[&file.path]), text.replace(before, after));
        }
    }

    #[test]
    fn an_editor_offers_newer_versions_that_it_advises() {
        let text = "(pins: 1, nodes: { \"a\": Blur() })";
        let mut world = Workspace::new(registry(r#"kind: "Blur", version: 2, touches: All"#), Vec::new());
        let file = world.open(Path::new("a.ron"), text);
        let cx = Cx { world: &world, file: &file };
        let action = newest(cx, &[finding(text, "Blur", "advice", Some(MIGRATE))]).unwrap();
        assert_eq!(apply(text, &action.edits[&file.path]), text.replace("pins: 1", "pins: 2"));
        assert!(!action.is_preferred, "the picture may change");
        assert!(newest(cx, &[finding(text, "Blur", "advice", None)]).is_none());
    }

    #[test]
    fn an_editor_takes_newer_functions() {
        let text = r#"(pins: 1, imports: { "d": "shibo:denim" }, nodes: { "a": "= d.float(x)" })"#;
        let registry = registry(r#"graph: "denim", version: 2, touches: All"#);
        let loaded = load_text(Path::new("a.ron"), text, &registry, &LoadOptions::default());
        let findings = by_file(&loaded.diagnostics, &loaded.sources).remove(Path::new("a.ron")).unwrap();
        let found: Vec<_> = findings.iter().map(|one| (one.code.as_str(), &text[one.range.clone()])).collect();
        assert_eq!(found, [("changed-kind", "d.float")]);
        let mut world = Workspace::new(registry, Vec::new());
        let file = world.open(Path::new("a.ron"), text);
        let action = newest(Cx { world: &world, file: &file }, &findings).unwrap();
        assert_eq!(apply(text, &action.edits[&file.path]), text.replace("pins: 1", "pins: 2"));
        assert!(action.is_preferred);
    }

    #[test]
    fn an_editor_takes_the_newest_versions() {
        let text = "(\n  pins: 1,\n  nodes: {\n    \"a\": Blur(),\n  },\n)\n";
        let line = r#"kind: "Blur", version: 2, touches: All, answer: Set(field: "radius", value: "3")"#;
        let mut world = Workspace::new(registry(line), Vec::new());
        let file = world.open(Path::new("a.ron"), text);
        let finding = finding(text, "Blur", "changed-kind", None);
        let action = newest(Cx { world: &world, file: &file }, &[finding]).unwrap();
        let after = apply(text, &action.edits[&file.path]);
        assert_eq!(after, text.replace("pins: 1", "pins: 2").replace("Blur()", "Blur(radius: 3)"));
    }
}
