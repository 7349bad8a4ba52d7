//! Replaces a `Use` by the nodes of its sub-graph.
use super::super::file::{File, Section};
use super::super::formula::{Role, formulas, literal, local_names, put};
use super::super::insert::{add_to, free_name};
use super::super::names::{Symbol, occurrences, params_in, quote, references};
use super::super::rename::{Edit, sort};
use super::super::view::{Shape, Value};
use super::super::walk::trail;
use super::super::world::Cx;
use super::refactor::is_literal;
use super::{Action, ActionKind, apply};
use shibo_graph::syntax::formula::{Formula, WordKind, begins};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Replacement of a parameter of the sub-graph.
enum Becomes {
    /// Text for the whole value, and the text for use in a formula, if there is one.
    Text(String, Option<String>),
    /// A parameter of the outer graph.
    Param(String),
}

/// A value in the outer graph.
enum Term {
    /// A path.
    Path(String),
    /// A formula without its equals sign.
    Formula(String),
    /// Another literal, such as a colour.
    Literal(String),
}

/// Returns the action if the `Use` at a position can be inlined.
pub(super) fn inline(cx: Cx<'_>, at: usize) -> Option<Action> {
    let trail = trail(cx, at);
    let (Section::Nodes, item) = trail.entry()? else { return None };
    let (name, value) = (item.name()?, item.value.as_ref()?);
    let args = value.body()?;
    if cx.file.word(value)? != "Use" {
        return None;
    }
    // An instance with its own seed, layout or preset is more than its nodes, so it cannot be inlined.
    let plain = args.items.iter().all(|arg| matches!(arg.name(), Some("graph" | "with" | "note")));
    let import = cx.file.text_of(value, "graph")?;
    let inner = cx.imported(import)?;
    // A local graph shares the imports, graphs and functions of its file.
    let is_local = inner.local_name().is_some();
    let shares = |section: Section| is_local || inner.entries(section).is_empty();
    let reads_files = occurrences(cx.with(&inner)).iter().any(|o| matches!(o.symbol, Symbol::File(_)));
    if !plain || (reads_files && !is_local) || !shares(Section::Imports) || !shares(Section::Graphs) {
        return None;
    }
    let given: BTreeMap<&str, &Value> = args
        .value("with")
        .and_then(Value::body)
        .map(|body| body.items.iter().filter_map(|i| Some((i.name()?, i.value.as_ref()?))).collect())
        .unwrap_or_default();
    let prefix = if is_local { String::new() } else { format!("{import}.") };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for found in references(cx.with(&inner)) {
        *counts.entry(found.node).or_default() += 1;
    }
    let shared = counts.into_iter().filter(|(_, count)| *count > 1).map(|(name, _)| name).collect();
    let job = Job { cx, name, inner: &inner, given, prefix, shared };
    let (params, mut edits) = job.params();
    let nodes = job.nodes(&params)?;
    edits.push(Edit { range: item.range.clone(), text: nodes });
    edits.extend(job.readers(&params)?);
    sort(&mut edits);
    let title = format!("Put the nodes of `{import}` in the place of `{name}`");
    Some(Action::new(title, ActionKind::Inline, cx.file, edits))
}

struct Job<'a, 'f> {
    cx: Cx<'a>,
    name: &'a str,
    inner: &'f File,
    given: BTreeMap<&'a str, &'a Value>,
    /// Text before the names of the sub-graph's functions.
    prefix: String,
    /// Inputs of the sub-graph with several readers.
    shared: BTreeSet<String>,
}

type Params = BTreeMap<String, Becomes>;

impl Job<'_, '_> {
    fn inner(&self) -> Cx<'_> {
        self.cx.with(self.inner)
    }

    /// Name of a sub-graph node in the outer graph.
    fn node(&self, name: &str) -> String {
        free_name(self.cx.file, &[Section::Nodes, Section::Inputs], &format!("{}_{name}", self.name))
    }

    /// Replacements of the parameters, and edits that declare new parameters.
    fn params(&self) -> (Params, Vec<Edit>) {
        let mut params = BTreeMap::new();
        let mut declared = Vec::new();
        for item in self.inner.entries(Section::Params) {
            let (Some(name), Some(value)) = (item.name(), item.value.as_ref()) else { continue };
            let given = self.given.get(name).map(|value| (*value, self.cx.file));
            let default = value.body().and_then(|body| body.value("default")).map(|value| (value, self.inner));
            let Some((value, file)) = given.or(default) else { continue };
            let text = file.at(&value.range).to_owned();
            let follows = given.is_none() && text.contains('$');
            let becomes = match &value.shape {
                Shape::Text(says) if says.starts_with('$') && !follows => Becomes::Text(text, Some(says.clone())),
                Shape::Text(says) if says.starts_with('=') && !follows && !self.in_formula(name) => {
                    let formula = says[1..].trim().to_owned();
                    Becomes::Text(text, Some(format!("({formula})")))
                }
                _ if is_literal(value) => Becomes::Text(text.clone(), Some(text)),
                _ => {
                    let sections = [Section::Params, Section::Inputs];
                    let new = free_name(self.cx.file, &sections, &format!("{}_{name}", self.name));
                    declared.push((item, new.clone(), text, follows.then(|| value.shape.clone())));
                    Becomes::Param(new)
                }
            };
            params.insert(name.to_owned(), becomes);
        }
        // All replacements are known now, so a default that depends on other parameters can use them.
        let declared: Vec<String> = declared
            .into_iter()
            .map(|(item, new, text, follows)| {
                let default = match follows {
                    Some(Shape::Text(says)) => self.with_params(&says, &params).unwrap_or(text),
                    _ => text,
                };
                let within = |range: &Range<usize>| range.start - item.range.start..range.end - item.range.start;
                let mut edits = Vec::new();
                if let Some(old) = item.value.as_ref().and_then(|v| v.body()?.value("default")) {
                    edits.push(Edit { range: within(&old.range), text: default });
                }
                if let Some(key) = &item.key {
                    edits.push(Edit { range: within(&key.range), text: quote(&new) });
                }
                apply(self.inner.at(&item.range), &edits)
            })
            .collect();
        let edits = if declared.is_empty() {
            Vec::new()
        } else {
            let deep = super::super::insert::indent(
                &self.cx.file.text,
                self.cx.file.entries(Section::Params).first().map_or(0, |i| i.range.start),
            );
            add_to(self.cx.file, Section::Params, &declared.join(&format!(",\n{deep}")))
        };
        (params, edits)
    }

    /// Text of the nodes with new names, and with parameters and inputs replaced by values.
    fn nodes(&self, params: &Params) -> Option<String> {
        let body = self.inner.section(Section::Nodes)?;
        let (first, last) = (body.items.first()?, body.items.last()?);
        let whole = first.range.start..last.range.end;
        let mut edits: BTreeMap<usize, Edit> = BTreeMap::new();
        let mut add = |place: &Range<usize>, text: String| {
            let range = place.start - whole.start..place.end - whole.start;
            edits.insert(range.start, Edit { range, text });
        };
        let inside = |place: &Range<usize>| whole.start <= place.start && place.end <= whole.end;
        let formulas = formulas(self.inner());
        for (text, _) in formulas.iter().filter(|(text, _)| inside(&text.literal)) {
            let formula = self.translated(text.says(), text.role, params)?;
            match &text.place {
                Some(_) => add(&text.in_file(&(0..text.says().len()))?, formula),
                None => add(&text.literal, quote(&format!("={formula}"))),
            }
        }
        let translated: BTreeSet<usize> = formulas.iter().map(|(text, _)| text.literal.start).collect();
        for found in occurrences(self.inner()) {
            let (literal, says) = &found.literal;
            if !inside(literal) || translated.contains(&literal.start) {
                continue;
            }
            let text = match &found.symbol {
                Symbol::Node(name) if found.declares => quote(&self.node(name)),
                Symbol::Node(name) => wire(&self.term(name, params)?, &says[found.within.end..])?,
                Symbol::Param(_) => self.with_params(says, params)?,
                _ => continue,
            };
            add(literal, text);
        }
        let nodes = apply(self.inner.at(&whole), &edits.into_values().collect::<Vec<_>>());
        let text = self.shared_nodes(params)? + &nodes;
        // Formulas in node parameters are handled like expressions.
        (!text.contains("\"$$")).then_some(text)
    }

    /// Nodes for formulas that are given to an input with several readers.
    fn shared_nodes(&self, params: &Params) -> Option<String> {
        let item = self.cx.file.entry(Section::Nodes, self.name)?;
        let deep = super::super::insert::indent(&self.cx.file.text, item.range.start);
        let mut text = String::new();
        for input in self.inner.entries(Section::Inputs) {
            let name = input.name().filter(|name| self.shared.contains(*name));
            let default = || input.value.as_ref()?.body()?.value("default").map(|value| term_of(self.inner, value));
            let given = name.and_then(|name| self.given.get(name)).map(|value| term_of(self.cx.file, value));
            let formula = match (name, given, default()) {
                (Some(_), Some(Term::Formula(formula)), _) => formula,
                (Some(_), None, Some(Term::Formula(formula))) => self.translated(&formula, Role::Point, params)?,
                _ => continue,
            };
            let node = quote(&self.node(input.name().unwrap_or_default()));
            text.push_str(&format!("{node}: {},\n{deep}", literal(formula.trim())));
        }
        Some(text)
    }

    /// The value of a node or an input of the sub-graph, in the outer graph.
    fn term(&self, name: &str, params: &Params) -> Option<Term> {
        if self.inner.entry(Section::Nodes, name).is_some() {
            return Some(Term::Path(self.node(name)));
        }
        let shared = self.shared.contains(name);
        if let Some(value) = self.given.get(name) {
            let term = term_of(self.cx.file, value);
            return Some(if shared && matches!(term, Term::Formula(_)) { Term::Path(self.node(name)) } else { term });
        }
        let item = self.inner.entry(Section::Inputs, name)?;
        let default = item.value.as_ref()?.body()?.value("default")?;
        match term_of(self.inner, default) {
            // The default of the input is a node of the sub-graph.
            Term::Path(path) => {
                let end = path.find('.').unwrap_or(path.len());
                self.inner.entry(Section::Nodes, &path[..end])?;
                Some(Term::Path(format!("{}{}", self.node(&path[..end]), &path[end..])))
            }
            Term::Formula(_) if shared => Some(Term::Path(self.node(name))),
            Term::Formula(formula) => Some(Term::Formula(self.translated(&formula, Role::Point, params)?)),
            Term::Literal(_) if matches!(default.shape, Shape::Call { .. }) => None,
            Term::Literal(text) if text.contains('$') => {
                Some(Term::Literal(self.with_params(default.text()?, params)?))
            }
            literal => Some(literal),
        }
    }

    /// A formula of the sub-graph as one of the outer graph.
    fn translated(&self, says: &str, role: Role<'_>, params: &Params) -> Option<String> {
        let formula = Formula::parse(says);
        let (mut out, mut definitions) = (says.to_owned(), String::new());
        for (index, word) in formula.words().iter().enumerate().rev() {
            let text = formula.word(index);
            let first = text.split('.').next()?;
            let is_value = [Section::Nodes, Section::Inputs].iter().any(|s| self.inner.entry(*s, first).is_some());
            let free = word.kind == WordKind::Name && formula.local(first, word.range.start).is_none();
            let new = match word.kind {
                WordKind::Param => {
                    let becomes = match params.get(&first[1..]) {
                        Some(Becomes::Text(_, Some(text))) if text.starts_with('-') => format!("({text})"),
                        Some(Becomes::Text(_, Some(text))) => text.clone(),
                        Some(Becomes::Text(_, None)) => return None,
                        Some(Becomes::Param(new)) => format!("${new}"),
                        None => continue,
                    };
                    format!("{becomes}{}", &text[first.len()..])
                }
                WordKind::Name if formula.is_call(index) => {
                    let own = self.inner.position(Section::Functions, text).is_some();
                    format!("{}{text}", if own { self.prefix.as_str() } else { "" })
                }
                WordKind::Name if free && is_value && role == Role::Point => {
                    let (before, new) = inside(&formula, index, first.len(), &self.term(first, params)?)?;
                    // A value that is read twice needs its definitions once.
                    if !definitions.contains(&before) {
                        definitions.insert_str(0, &before);
                    }
                    new
                }
                _ => continue,
            };
            out.replace_range(word.range.clone(), &new);
        }
        if !definitions.is_empty() {
            let blank = out.len() - out.trim_start().len();
            out.insert_str(blank, &definitions);
        }
        Some(out)
    }

    /// Replaces the parameters in a text by values.
    fn with_params(&self, says: &str, params: &Params) -> Option<String> {
        if let Some(becomes) = says.strip_prefix('$').and_then(|name| params.get(name)) {
            return Some(match becomes {
                Becomes::Text(text, _) => text.clone(),
                Becomes::Param(new) => format!("\"${new}\""),
            });
        }
        if let Some(begin) = begins(says) {
            let formula = self.translated(&says[begin..], Role::Value, params)?;
            return Some(quote(&format!("={formula}")));
        }
        let mut out = says.to_owned();
        for range in params_in(says).into_iter().rev() {
            let text = match params.get(&says[range.clone()]) {
                Some(Becomes::Text(_, Some(text))) => text.clone(),
                Some(Becomes::Param(new)) => format!("${new}"),
                _ => continue,
            };
            out.replace_range(range.start - 1..range.end, &text);
        }
        Some(quote(&out))
    }

    /// Returns whether a per-pixel formula of a node reads a parameter. An expression in it would be evaluated again, with
    /// another precision.
    fn in_formula(&self, name: &str) -> bool {
        occurrences(self.inner()).iter().any(|found| {
            matches!(&found.symbol, Symbol::Param(param) if param == name) && !found.literal.1.starts_with(['$', '='])
        })
    }

    /// The value of an output of the `Use`.
    fn output(&self, name: Option<&str>, params: &Params) -> Option<Term> {
        let item = match name {
            Some(name) => self.inner.entry(Section::Outputs, name),
            None => self.inner.entries(Section::Outputs).first(),
        };
        let value = item?.value.as_ref()?;
        let from = value.text().or_else(|| self.inner.text_of(value, "from"))?;
        if let Some(begin) = begins(from) {
            return Some(Term::Formula(self.translated(&from[begin..], Role::Point, params)?));
        }
        let end = from.find('.').unwrap_or(from.len());
        match self.term(&from[..end], params)? {
            Term::Path(path) => Some(Term::Path(format!("{path}{}", &from[end..]))),
            term if end == from.len() => Some(term),
            _ => None,
        }
    }

    /// Redirects readers of the outputs of the `Use` to the nodes. `None` if one of them cannot read the value.
    fn readers(&self, params: &Params) -> Option<Vec<Edit>> {
        let formulas = formulas(self.cx);
        let mut edits = Vec::new();
        for found in references(self.cx).into_iter().filter(|found| found.node == self.name) {
            let (literal, says) = &found.literal;
            let term = self.output(found.says.split_once('.').map(|(_, output)| output), params)?;
            match formulas.iter().find(|(text, _)| text.literal == *literal) {
                Some((text, formula)) => {
                    let word = formula.word_at(text.offset(found.range.start)?)?;
                    let (before, new) = inside(formula, word, found.within.len(), &term)?;
                    let start = text.in_file(&formula.words().first()?.range)?.start;
                    edits.push(Edit { range: text.in_file(&formula.words()[word].range)?, text: new });
                    let before = Edit { range: start..start, text: before };
                    if !before.text.is_empty() && !edits.contains(&before) {
                        edits.push(before);
                    }
                }
                None => {
                    let text = wire(&term, &says[found.within.end..])?;
                    edits.push(Edit { range: literal.clone(), text });
                }
            }
        }
        Some(edits)
    }
}

/// The value that is written in a file.
fn term_of(file: &File, value: &Value) -> Term {
    match &value.shape {
        Shape::Text(says) if !says.starts_with(['#', '$', '=']) => Term::Path(says.clone()),
        Shape::Text(says) => match begins(says) {
            Some(begin) => Term::Formula(says[begin..].trim().to_owned()),
            None => Term::Literal(file.at(&value.range).to_owned()),
        },
        _ => Term::Literal(file.at(&value.range).to_owned()),
    }
}

/// The literal of a wire that takes a value, or the part of it after `rest`.
fn wire(term: &Term, rest: &str) -> Option<String> {
    match term {
        Term::Path(path) => Some(quote(&format!("{path}{rest}"))),
        Term::Formula(formula) if rest.is_empty() => Some(literal(formula)),
        Term::Formula(formula) => {
            let hole = format!("hole{rest}");
            let put = put(&Formula::parse(&hole), 0, "hole".len(), formula)?;
            Some(literal(&format!("{}{}", put.definitions, put.text)))
        }
        Term::Literal(text) => rest.is_empty().then(|| text.clone()),
    }
}

/// The text for a word of a formula whose first `base` bytes mean a value, and definitions for the beginning.
fn inside(outer: &Formula, word: usize, base: usize, term: &Term) -> Option<(String, String)> {
    let says = outer.word(word);
    match term {
        Term::Path(path) => {
            let first = path.split('.').next()?;
            let hidden = local_names(outer).any(|local| local == first);
            (!hidden).then(|| (String::new(), format!("{path}{}", &says[base..])))
        }
        Term::Formula(inner) | Term::Literal(inner) => {
            let inner = inner
                .strip_prefix("\"$")
                .and_then(|name| name.strip_suffix('"'))
                .map(|name| format!("${name}"))
                .unwrap_or_else(|| inner.clone());
            let put = put(outer, word, base, &inner)?;
            Some((put.definitions, put.text))
        }
    }
}
