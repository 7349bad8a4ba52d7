//! Completion of fields and keys.
use super::super::docs;
use super::super::expect::Expect;
use super::super::file::{File, Section};
use super::super::habits::signature;
use super::super::names::quote;
use super::super::view::Body;
use super::super::world::Cx;
use super::{Ask, Completion, Sort, Topic};
use shibo_node::{FieldInfo, ParamType, Role};
use std::collections::HashMap;
use std::sync::Arc;

/// Latest place of the default among the options of a choice, from 0.
const LATEST: usize = 3;

impl<'a> Ask<'a> {
    /// Keys allowed in brackets; `named` if a colon follows already.
    pub(super) fn keys(&self, inside: Expect<'a>, body: &'a Body, named: bool) -> Vec<Completion> {
        match inside {
            Expect::Kind(_) | Expect::Struct(_) => self.fields(inside, body, named),
            Expect::With(import, None) => self.given(import, body, named),
            Expect::Entry(Section::Presets, _) => {
                let params: Vec<&str> = self.cx.file.names(Section::Params).collect();
                let presets = self.cx.file.entries(Section::Presets).iter();
                let others: Vec<&Body> = presets.filter_map(|item| item.value.as_ref()?.body()).collect();
                let scores = self.usual(body, (&params, &others), |_, _| (0.0, 0.0));
                let free = params.iter().zip(scores).filter(|(name, _)| body.get(name).is_none() || named);
                free.map(|(name, score)| self.key(name, Sort::Param, "a parameter", named, score)).collect()
            }
            Expect::Section(Section::Functions) if !named && !self.quoted => {
                let offer = self.offer("name(x)", Sort::Function, "a new function", Topic::Text(String::new()), 0.0);
                vec![Completion { insert: "\"${1:name}(${2:x})\": \"$0\"".to_owned(), snippet: true, ..offer }]
            }
            Expect::Section(Section::Outputs) => {
                let new = ["material", "lit", "height", "color", "normal", "mask"];
                let free = new.iter().filter(|name| body.get(name).is_none()).enumerate();
                free.map(|(i, name)| self.key(name, Sort::Name, "a new output", named, i as f64)).collect()
            }
            _ => {
                let fields = inside.fields().into_iter().map(|field| (field.name, field.doc)).enumerate();
                let near = |i: usize, name: &str| i as f64 + self.apart(body, &|n| plain_index(inside, n), name);
                let free = fields.filter(|(_, (name, _))| named || body.get(name).is_none());
                free.map(|(i, (name, doc))| {
                    let offer = self.offer(name, Sort::Field, doc, Topic::Text(doc.to_owned()), near(i, name));
                    let insert = if named { name.to_owned() } else { format!("{name}: ") };
                    Completion { insert, ..offer }
                })
                .collect()
            }
        }
    }

    /// A completion for a key in quotes.
    fn key(&self, name: &str, sort: Sort, detail: &str, named: bool, score: f64) -> Completion {
        let offer = self.offer(name, sort, detail, Topic::Text(String::new()), score);
        let insert = match (named, self.quoted) {
            (_, true) => name.to_owned(),
            (true, false) => quote(name),
            (false, false) => format!("{}: ", quote(name)),
        };
        Completion { insert, ..offer }
    }

    /// Fields of a kind that are still missing.
    fn fields(&self, inside: Expect<'a>, body: &'a Body, named: bool) -> Vec<Completion> {
        let fields = docs::fields(inside);
        let kind = if let Expect::Kind(info) = inside { info.kind.as_str() } else { "" };
        let present =
            |field: &FieldInfo| body.get(&field.name).is_some_and(|item| !contains(item.range.clone(), self.at));
        let index = |name: &str| fields.iter().position(|field| field.name == name);
        let elsewhere = self.used_elsewhere(kind);
        let before = self.before(body);
        let mut found = Vec::new();
        for (i, field) in fields.iter().enumerate().filter(|(_, field)| named || !present(field)) {
            let habits = self.cx.world.habits();
            let required = match &field.role {
                Role::Port(port) => port.required,
                Role::Param(param) => param.required,
            };
            let mut score = 0.05 * i as f64 + self.apart(body, &index, &field.name);
            score -= if required { 8.0 } else { 0.0 };
            score -= 3.0 * habits.field(kind, &field.name);
            score -= 1.2 * (1.0 + habits.next(kind, before, &field.name)).ln();
            score -= 1.5 * (1.0 + elsewhere.get(field.name.as_str()).copied().unwrap_or_default()).ln();
            let topic = Topic::Field(kind.to_owned(), field.name.clone());
            let offer = self.offer(&field.name, Sort::Field, &docs::takes(field), topic, score);
            let (insert, snippet) = if named { (field.name.clone(), false) } else { field_snippet(field) };
            found.push(Completion { insert, snippet, deprecated: docs::deprecated(&field.doc), ..offer });
        }
        if !kind.is_empty() && (named || body.get("note").is_none()) {
            let offer = self.offer("note", Sort::Field, "a text for readers", Topic::Text(String::new()), 20.0);
            found.push(Completion { insert: if named { "note".into() } else { "note: ".into() }, ..offer });
        }
        found
    }

    /// Distance of a field from its position in the order of declaration: 0 if it belongs between the fields around the
    /// cursor.
    fn apart(&self, body: &Body, index: &dyn Fn(&str) -> Option<usize>, name: &str) -> f64 {
        let Some(own) = index(name) else { return 0.0 };
        let place = |item: &super::super::view::Item| item.name().and_then(index);
        let before = body.items.iter().filter(|item| item.range.end <= self.at).filter_map(place).max();
        let after = body.items.iter().filter(|item| item.range.start >= self.at).filter_map(place).min();
        let early = before.is_some_and(|before| own < before);
        let late = after.is_some_and(|after| own > after);
        f64::from(u8::from(early)) * 1.5 + f64::from(u8::from(late)) * 2.5
    }

    /// Scores of the names `all` in a list that may have them: names that are usual in the `others` of such lists come first, most
    /// of all those that follow the same name there. `elsewhere` gives two counts of other graphs, for the name before the cursor
    /// and a name: lists with the name, and lists in which it follows. The weights are fitted to the shipped graphs.
    fn usual(
        &self,
        body: &Body,
        (all, others): (&[&str], &[&Body]),
        elsewhere: impl Fn(&str, &str) -> (f64, f64),
    ) -> Vec<f64> {
        let before = self.before(body);
        let places: HashMap<&str, usize> = all.iter().enumerate().map(|(place, name)| (*name, place)).collect();
        let mut counts: Vec<(f64, f64)> = all.iter().map(|name| elsewhere(before, name)).collect();
        for other in others.iter().filter(|other| other.range != body.range) {
            let mut last = "";
            for name in other.items.iter().filter_map(|item| item.name()) {
                if let Some(place) = places.get(name) {
                    counts[*place].0 += 1.0;
                    counts[*place].1 += f64::from(u8::from(last == before));
                }
                last = name;
            }
        }
        let place = |name: &str| places.get(name).copied();
        let score = |(i, (uses, follows)): (usize, (f64, f64))| {
            let order = 0.01 * i as f64 + self.apart(body, &place, all[i]);
            order - 1.5 * (2.2 + uses).ln() - 6.0 * (1.0 + follows).ln()
        };
        counts.into_iter().enumerate().map(score).collect()
    }

    /// The name before the cursor in a list; empty at its beginning.
    fn before<'b>(&self, body: &'b Body) -> &'b str {
        let before = body.items.iter().rev().filter(|item| item.range.end <= self.at);
        before.filter_map(|item| item.name()).next().unwrap_or_default()
    }

    /// Number of the file's other nodes of a kind that have each field.
    fn used_elsewhere(&self, kind: &str) -> HashMap<&'a str, f64> {
        let mut counts = HashMap::new();
        let file = self.cx.file;
        for item in file.entries(Section::Nodes).iter().filter(|item| file.head(item) == Some(kind)) {
            if contains(item.range.clone(), self.at) {
                continue;
            }
            for name in super::super::file::File::args(item).iter().filter_map(|arg| arg.name()) {
                *counts.entry(name).or_insert(0.0) += 1.0;
            }
        }
        counts
    }

    /// Parameters and inputs of an imported graph that have no value yet.
    fn given(&self, import: &str, body: &'a Body, named: bool) -> Vec<Completion> {
        let Some(file) = self.cx.imported(import) else { return Vec::new() };
        let inner = Cx { world: self.cx.world, file: &file };
        let inputs = file.names(Section::Inputs).map(|name| (name, Section::Inputs));
        let params = file.names(Section::Params).map(|name| (name, Section::Params));
        let all: Vec<(&str, Section)> = inputs.chain(params).collect();
        let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
        let (own, graph) = (self.cx.file, self.cx.file.stem_of(import));
        let nodes = own.entries(Section::Nodes).iter().filter_map(|item| item.value.as_ref());
        let same = nodes.filter(|node| own.text_of(node, "graph") == Some(import));
        let others: Vec<&Body> = same.filter_map(|node| node.body()?.value("with")?.body()).collect();
        let habits = self.cx.world.habits();
        let scores = self.usual(body, (&names, &others), |before, name| habits.given(graph, before, name));
        let mut found = Vec::new();
        for ((name, section), score) in all.iter().zip(scores) {
            if !named && body.get(name).is_some_and(|item| !contains(item.range.clone(), self.at)) {
                continue;
            }
            let what = if *section == Section::Inputs { "input" } else { "parameter" };
            let item = inner.file.entry(*section, name);
            let head = item.and_then(|item| inner.file.head(item)).unwrap_or_default();
            let doc = item.and_then(|item| inner.file.text_of(item.value.as_ref()?, "doc")).unwrap_or_default();
            let detail = format!("{what}, {head}");
            let offer = self.key(name, Sort::Field, &detail, named, score);
            found.push(Completion { topic: Topic::Text(doc.to_owned()), ..offer });
        }
        found
    }

    /// Options of a choice; those that usually occur with the present fields come first.
    pub(super) fn choices(&self, expect: Expect<'a>) -> Vec<Completion> {
        let words = docs::words(expect);
        let habits = self.cx.world.habits();
        let owner = self.owner(expect);
        let args = self.trail.node().map_or(&[][..], |level| &level.body.items[..]);
        let of_param = |word: &str| match expect {
            Expect::Value(_, param) => param.choices.iter().find(|choice| choice.name == word),
            _ => None,
        };
        let mut found = self.declared_options(expect);
        for (i, (word, doc)) in words.iter().enumerate() {
            let usual = owner.map_or(0.0, |(kind, field)| habits.choice(kind, field, &signature(args, field), word));
            let score = 0.05 * i as f64 - 2.0 * (1.0 + usual).ln();
            let detail = doc.lines().next().unwrap_or_default();
            let offer = self.offer(word, Sort::Choice, detail, Topic::Text(doc.clone()), score);
            let takes = of_param(word).is_some_and(|choice| choice.has_arguments) && !self.before_bracket();
            found.push(if takes {
                Completion { insert: format!("{word}($0)"), snippet: true, ..offer }
            } else {
                offer
            });
        }
        // The default need not be written, so graphs have it seldom; still it is one of the first that users look for.
        found.sort_by(|a, b| a.score.total_cmp(&b.score));
        let default = |one: &Completion| matches!(expect, Expect::Value(_, param) if param.written == one.label);
        if let Some(index) = found.iter().position(default)
            && index > LATEST
        {
            found[index].score = found[LATEST - 1].score;
        }
        found
    }

    /// The parameter that gets a value here, in a preset or in `with`, and its graph.
    fn given_param(&self, expect: Expect<'a>) -> Option<(Arc<File>, &'a str)> {
        let (file, name) = match expect {
            Expect::Preset(name) => (Arc::new(self.cx.file.clone()), name),
            Expect::With(import, Some(name)) => (self.cx.imported(import)?, name),
            _ => return None,
        };
        file.entry(Section::Params, name).is_some().then_some((file, name))
    }

    /// Type of the parameter that gets a value here.
    pub(super) fn declared(&self, expect: Expect<'a>) -> Option<String> {
        let (file, name) = self.given_param(expect)?;
        file.head(file.entry(Section::Params, name)?).map(str::to_owned)
    }

    /// Options of the choice parameter that gets a value here; it belongs to this graph or to an imported one.
    pub(super) fn declared_options(&self, expect: Expect<'a>) -> Vec<Completion> {
        let Some((file, name)) = self.given_param(expect) else { return Vec::new() };
        let options = file.options(name).into_iter().enumerate();
        let detail = format!("an option of {name}");
        let topic = || Topic::Text(String::new());
        options
            .map(|(i, word)| self.offer_text(&word, Sort::Choice, &detail, topic(), 0.05 * i as f64 - 20.0))
            .collect()
    }

    /// Returns whether a bracket follows the replaced text.
    fn before_bracket(&self) -> bool {
        self.cx.file.text[self.replace.end..].trim_start().starts_with('(')
    }
}

fn contains(range: std::ops::Range<usize>, at: usize) -> bool {
    range.start <= at && at <= range.end
}

fn plain_index(inside: Expect<'_>, name: &str) -> Option<usize> {
    inside.fields().iter().position(|field| field.name == name)
}

/// Snippet of a field with the delimiters of its value.
fn field_snippet(field: &FieldInfo) -> (String, bool) {
    let name = &field.name;
    match &field.role {
        Role::Port(port) if port.list => (format!("{name}: [$0]"), true),
        Role::Port(port) if docs::only_wires(port) => (format!("{name}: \"$0\""), true),
        Role::Port(_) => (format!("{name}: "), false),
        Role::Param(param) => match param.ty {
            ParamType::Path | ParamType::Text => (format!("{name}: \"$0\""), true),
            ParamType::List => (format!("{name}: [$0]"), true),
            _ => (format!("{name}: "), false),
        },
    }
}
