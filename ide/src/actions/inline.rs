//! Replaces a `Use` by the nodes of its sub-graph.
use super::super::file::{File, Section};
use super::super::names::{Symbol, occurrences, quote};
use super::super::rename::{Edit, sort};
use super::super::view::{Shape, Value};
use super::super::walk::trail;
use super::super::world::Cx;
use super::insert::{add_to, free_name};
use super::refactor::is_literal;
use super::{Action, ActionKind, apply};
use std::collections::BTreeMap;
use std::ops::Range;

/// Replacement of a parameter of the sub-graph.
enum Becomes {
    /// Text for the whole value, and the text for use in an expression, if there is one.
    Text(String, Option<String>),
    /// A parameter of the outer graph.
    Param(String),
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
    let reads_files =
        occurrences(Cx { world: cx.world, file: &inner }).iter().any(|o| matches!(o.symbol, Symbol::File(_)));
    if !plain || reads_files || !inner.entries(Section::Imports).is_empty() {
        return None;
    }
    let given: BTreeMap<&str, &Value> = args
        .value("with")
        .and_then(Value::body)
        .map(|body| body.items.iter().filter_map(|i| Some((i.name()?, i.value.as_ref()?))).collect())
        .unwrap_or_default();
    let job = Job { cx, name, inner: &inner, given };
    let (params, mut edits) = job.params();
    let nodes = job.nodes(&params)?;
    edits.push(Edit { range: item.range.clone(), text: nodes });
    edits.extend(job.readers());
    sort(&mut edits);
    let title = format!("Put the nodes of `{import}` in the place of `{name}`");
    Some(Action::new(title, ActionKind::Inline, cx.file, edits))
}

struct Job<'a, 'f> {
    cx: Cx<'a>,
    name: &'a str,
    inner: &'f File,
    given: BTreeMap<&'a str, &'a Value>,
}

impl Job<'_, '_> {
    fn inner(&self) -> Cx<'_> {
        Cx { world: self.cx.world, file: self.inner }
    }

    /// Name of a sub-graph node in the outer graph.
    fn node(&self, name: &str) -> String {
        free_name(self.cx.file, &[Section::Nodes, Section::Inputs], &format!("{}_{name}", self.name))
    }

    /// Replacements of the parameters, and edits that declare new parameters.
    fn params(&self) -> (BTreeMap<String, Becomes>, Vec<Edit>) {
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
                    Some(Shape::Text(says)) => self.with_params(&says, &params),
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
            let deep = super::insert::indent(
                &self.cx.file.text,
                self.cx.file.entries(Section::Params).first().map_or(0, |i| i.range.start),
            );
            add_to(self.cx.file, Section::Params, &declared.join(&format!(",\n{deep}")))
        };
        (params, edits)
    }

    /// Returns whether a per-pixel formula reads a parameter. An expression in a formula would be evaluated again, with
    /// another precision.
    fn in_formula(&self, name: &str) -> bool {
        occurrences(self.inner()).iter().any(|found| {
            matches!(&found.symbol, Symbol::Param(param) if param == name) && !found.literal.1.starts_with(['$', '='])
        })
    }

    /// Text of the nodes with new names, and with parameters and inputs replaced by values.
    fn nodes(&self, params: &BTreeMap<String, Becomes>) -> Option<String> {
        let body = self.inner.section(Section::Nodes)?;
        let (first, last) = (body.items.first()?, body.items.last()?);
        let whole = first.range.start..last.range.end;
        let mut edits: BTreeMap<usize, Edit> = BTreeMap::new();
        for found in occurrences(self.inner()) {
            let (literal, says) = &found.literal;
            if !(whole.start <= literal.start && literal.end <= whole.end) {
                continue;
            }
            let at = literal.start - whole.start..literal.end - whole.start;
            let text = match &found.symbol {
                Symbol::Node(name) if found.declares => quote(&self.node(name)),
                Symbol::Node(name) => self.reference(name, says)?,
                Symbol::Param(_) => self.with_params(says, params),
                _ => continue,
            };
            edits.insert(at.start, Edit { range: at, text });
        }
        let text = apply(self.inner.at(&whole), &edits.into_values().collect::<Vec<_>>());
        // Formulas in node parameters are handled like expressions.
        (!text.contains("\"$$")).then_some(text)
    }

    /// Translates a reference of the sub-graph, to a node or to the argument of an input.
    fn reference(&self, name: &str, says: &str) -> Option<String> {
        if self.inner.entry(Section::Nodes, name).is_some() {
            return Some(quote(&says.replacen(name, &self.node(name), 1)));
        }
        let value = self.given.get(name).copied().map(|value| (value, self.cx.file));
        let item = self.inner.entry(Section::Inputs, name)?;
        let default = item.value.as_ref().and_then(|v| v.body()?.value("default")).map(|value| (value, self.inner));
        let (value, file) = value.or(default)?;
        match (&value.shape, std::ptr::eq(file, self.inner)) {
            // The default of the input is a node of the sub-graph.
            (Shape::Text(says), true) if !says.starts_with(['#', '$', '=']) => {
                let node = says.split('.').next()?;
                Some(quote(&says.replacen(node, &self.node(node), 1)))
            }
            (Shape::Call { .. }, true) => None,
            _ => Some(file.at(&value.range).to_owned()),
        }
    }

    /// Replaces the parameters in a text by values.
    fn with_params(&self, says: &str, params: &BTreeMap<String, Becomes>) -> String {
        if let Some(name) = says.strip_prefix('$')
            && let Some(becomes) = params.get(name)
        {
            return match becomes {
                Becomes::Text(text, _) => text.clone(),
                Becomes::Param(new) => format!("\"${new}\""),
            };
        }
        let mut out = says.to_owned();
        for range in super::super::names::params_in(says).into_iter().rev() {
            let text = match params.get(&says[range.clone()]) {
                Some(Becomes::Text(_, Some(text))) => text.clone(),
                Some(Becomes::Param(new)) => format!("${new}"),
                _ => continue,
            };
            out.replace_range(range.start - 1..range.end, &text);
        }
        quote(&out)
    }

    /// Redirects readers of the outputs of the `Use` to the nodes.
    fn readers(&self) -> Vec<Edit> {
        let mut edits = Vec::new();
        for found in occurrences(self.cx).into_iter().filter(|found| !found.declares) {
            let (literal, says) = &found.literal;
            let Symbol::Node(name) = &found.symbol else { continue };
            if name != self.name {
                continue;
            }
            let output = says.split_once('.').map(|(_, output)| output);
            let item = match output {
                Some(output) => self.inner.entry(Section::Outputs, output),
                None => self.inner.entries(Section::Outputs).first(),
            };
            let value = item.and_then(|item| item.value.as_ref());
            let from = value.and_then(|v| v.text().or_else(|| self.inner.text_of(v, "from")));
            if let Some(text) = from.and_then(|from| self.reference(from.split('.').next()?, from)) {
                edits.push(Edit { range: literal.clone(), text });
            }
        }
        edits
    }
}
