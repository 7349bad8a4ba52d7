//! Faults that people and programs make in graphs, for tests.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::testing::Dice;
use shibo_graph::syntax::{Node, NodeKind, TokenKind, Tree};
use shibo_node::registry::Registry;
use shibo_node::{ParamType, Role};
use std::ops::Range;

/// A graph in which faults are made.
pub(crate) struct Site<'a> {
    pub(crate) registry: &'a Registry,
    pub(crate) tree: Tree,
}

/// A fault: a range and the text in its place.
pub(crate) type Change = (Range<usize>, String);
/// All places where a fault can be made.
pub(crate) type Fault = fn(&Site<'_>, &mut Dice) -> Vec<Change>;

/// The sorts of faults.
pub(crate) const FAULTS: [(&str, Fault); 43] = [
    ("kind misspelt", |s, d| each(s, s.kinds(), |word| typo(word, d))),
    ("kind in lower case", |s, _| each(s, s.kinds(), |word| Some(word.to_lowercase()))),
    ("kind in snake case", |s, _| each(s, s.kinds(), |word| Some(snake(word)))),
    ("kind in plural", |s, _| each(s, s.kinds(), |word| Some(format!("{word}s")))),
    ("field misspelt", |s, d| each(s, s.fields(), |word| typo(word, d))),
    ("field in capitals", |s, _| each(s, s.fields(), |word| Some(capital(word)))),
    ("field in camel case", |s, _| each(s, s.fields(), camel)),
    ("field as elsewhere", |s, _| each(s, s.fields(), elsewhere)),
    ("choice misspelt", |s, d| each(s, s.choices(), |word| typo(word, d))),
    ("choice in lower case", |s, _| each(s, s.choices(), |word| Some(word.to_lowercase()))),
    ("choice in quotes", |s, _| each(s, s.choices(), |word| Some(format!("\"{word}\"")))),
    ("choice as in Rust", |s, _| each(s, s.choices(), |word| Some(format!("Mode::{word}")))),
    ("wire misspelt", |s, d| each(s, s.wires(), |word| typo(word, d))),
    ("wire in capitals", |s, _| each(s, s.wires(), |word| Some(word.to_uppercase()))),
    ("wire in camel case", |s, _| each(s, s.wires(), camel)),
    ("wire without quotes", |s, _| s.wires().into_iter().map(|r| (r.start - 1..r.end + 1, s.at(&r))).collect()),
    ("parameter misspelt", |s, d| each(s, s.params(), |word| typo(word, d))),
    ("parameter without sign", |s, _| s.params().into_iter().map(|r| (r.start - 1..r.start, String::new())).collect()),
    ("function misspelt", |s, d| each(s, s.functions(), |word| typo(word, d))),
    ("formula without equals sign", |s, _| s.find("\"= $").map(|at| (at + 1..at + 3, String::new())).collect()),
    ("formula without quotes", |s, _| s.texts("\"= $").map(|r| (r.clone(), s.at(&(r.start + 3..r.end - 1)))).collect()),
    ("section misspelt", |s, _| {
        let wrong = [("nodes", "nods"), ("nodes", "node"), ("outputs", "output"), ("params", "parameters")];
        let places = |(right, wrong): &(&str, &str)| {
            let key = s.tree.value()?.entry(right)?.key()?;
            Some((key.range(), (*wrong).to_owned()))
        };
        wrong.iter().filter_map(places).collect()
    }),
    ("import forgotten", |s, _| {
        let imports = s.tree.value().unwrap().entry("imports").and_then(Node::value);
        imports
            .into_iter()
            .flat_map(Node::entries)
            .map(|entry| {
                let comma = s.tree.text()[entry.range().end..].starts_with(',');
                (entry.range().start..entry.range().end + usize::from(comma), String::new())
            })
            .collect()
    }),
    ("import misspelt", |s, d| each(s, s.within("graph: \""), |word| typo(word, d))),
    ("number with mm", |s, _| each(s, s.numbers("mm"), |word| Some(format!("{word}mm")))),
    ("number with cm", |s, _| each(s, s.numbers("mm"), |word| Some(format!("{}cm", word.parse::<f64>().ok()? / 10.0)))),
    ("number with degrees", |s, _| each(s, s.numbers("°"), |word| Some(format!("{word}°")))),
    ("number in quotes", |s, _| each(s, s.numbers(""), |word| Some(format!("\"{word}\"")))),
    ("field as in JSON", |s, _| each(s, s.fields(), |word| Some(format!("\"{word}\"")))),
    ("node as in JSON", |s, _| s.calls(&|kind, inside| format!("{{ \"type\": \"{kind}\", {inside} }}"))),
    ("node as in Rust", |s, _| s.calls(&|kind, inside| format!("{kind} {{ {inside} }}"))),
    ("field as in Python", |s, _| s.fields().into_iter().map(|r| (r.end..r.end + 2, "=".to_owned())).collect()),
    ("semicolon", |s, _| each(s, s.tokens(TokenKind::Comma), |_| Some(";".to_owned()))),
    ("comment as in Python", |s, _| s.tree.comments().map(|r| (r.start..r.start + 2, "#".to_owned())).collect()),
    ("word as in Python", |s, _| {
        let truth = s.tokens(TokenKind::Ident).into_iter().filter(|r| matches!(s.at(r).as_str(), "true" | "false"));
        each(s, truth.collect(), |word| Some(capital(word)))
    }),
    ("single quotes", |s, _| {
        each(s, s.tokens(TokenKind::Str), |word| Some(format!("'{}'", word.strip_prefix('"')?.strip_suffix('"')?)))
    }),
    ("fence", |s, _| vec![(0..s.tree.text().len(), format!("```ron\n{}```\n", s.tree.text()))]),
    ("bracket lost at the end", |s, _| each(s, s.brackets(")"), |_| Some(String::new()))),
    ("bracket lost at the start", |s, _| each(s, s.brackets("("), |_| Some(" ".to_owned()))),
    ("comma lost", |s, _| each(s, s.tokens(TokenKind::Comma), |_| Some(String::new()))),
    ("colon lost", |s, _| each(s, s.tokens(TokenKind::Colon), |_| Some(String::new()))),
    ("quote lost", |s, d| {
        let ends = |r: Range<usize>| if d.below(2) == 0 { r.start..r.start + 1 } else { r.end - 1..r.end };
        s.texts("\"").map(ends).map(|r| (r, String::new())).collect()
    }),
    ("copy", |s, _| {
        let entries = s.nodes().into_iter().filter(|r| s.tree.text()[r.end..].starts_with(",\n"));
        entries.map(|r| (r.end..r.end, format!(",\n    {}", s.at(&r)))).collect()
    }),
];

/// Faults that a script would make in the raw text: one bracket of each sort is removed, also in formulas, or a line of imports.
pub(crate) const RAW: [(&str, Fault); 7] = [
    ("( removed", |s, _| s.raw("(")),
    (") removed", |s, _| s.raw(")")),
    ("{ removed", |s, _| s.raw("{")),
    ("} removed", |s, _| s.raw("}")),
    ("[ removed", |s, _| s.raw("[")),
    ("] removed", |s, _| s.raw("]")),
    ("line of imports removed", |s, _| {
        let Some(imports) = s.tree.value().unwrap().entry("imports") else { return Vec::new() };
        let (text, range) = (s.tree.text(), imports.range());
        let start = text[..range.start].rfind('\n').map_or(0, |at| at + 1);
        let mut lines = Vec::new();
        let mut at = start;
        while at < range.end {
            let end = text[at..].find('\n').map_or(text.len(), |len| at + len + 1);
            lines.push((at..end, String::new()));
            at = end;
        }
        // The first and the last of several lines have brackets.
        if lines.len() > 1 { lines.drain(1..lines.len() - 1).collect() } else { lines }
    }),
];

/// Changes of the texts at these ranges.
fn each(site: &Site<'_>, ranges: Vec<Range<usize>>, mut change: impl FnMut(&str) -> Option<String>) -> Vec<Change> {
    let of = |range: Range<usize>| {
        let text = site.at(&range);
        let new = change(&text)?;
        (new != text).then_some((range, new))
    };
    ranges.into_iter().filter_map(of).collect()
}

/// The text with a random fault of a sort; `None` if there is no place for it.
pub(crate) fn spoil(registry: &Registry, text: &str, fault: Fault, dice: &mut Dice) -> Option<String> {
    let site = Site { registry, tree: Tree::parse(text) };
    let places = fault(&site, dice);
    let (range, new) = places.get(dice.below(places.len()))?;
    let mut spoilt = text.to_owned();
    spoilt.replace_range(range.clone(), new);
    Some(spoilt)
}

impl Site<'_> {
    fn at(&self, range: &Range<usize>) -> String {
        self.tree.text()[range.clone()].to_owned()
    }

    fn find<'s>(&'s self, what: &'s str) -> impl Iterator<Item = usize> + 's {
        self.tree.text().match_indices(what).map(|(at, _)| at)
    }

    /// Removes a sign, wherever it stands.
    fn raw(&self, sign: &str) -> Vec<Change> {
        self.find(sign).map(|at| (at..at + sign.len(), String::new())).collect()
    }

    fn tokens(&self, kind: TokenKind) -> Vec<Range<usize>> {
        self.tree.tokens().iter().filter(|token| token.kind() == kind).map(|token| token.range()).collect()
    }

    fn texts<'s>(&'s self, begin: &'s str) -> impl Iterator<Item = Range<usize>> + 's {
        self.tokens(TokenKind::Str)
            .into_iter()
            .filter(move |range| self.at(range).starts_with(begin) && range.len() > 4)
    }

    fn brackets(&self, bracket: &str) -> Vec<Range<usize>> {
        let tokens = self.tree.tokens().iter().map(|token| token.range());
        tokens.filter(|range| self.at(range) == bracket).collect()
    }

    /// The texts behind these words, without quotes.
    fn within(&self, before: &str) -> Vec<Range<usize>> {
        let end = |at: usize| self.tree.text()[at..].find('"').map(|len| at..at + len);
        self.find(before).filter_map(|at| end(at + before.len())).collect()
    }

    /// The calls of kinds in `nodes`, with their entries.
    fn called(&self) -> Vec<Node<'_>> {
        let known = |node: &Node<'_>| node.name().is_some_and(|name| self.registry.info(name).is_some());
        self.tree.nodes().filter(|node| node.kind() == NodeKind::Call && known(node)).collect()
    }

    fn kinds(&self) -> Vec<Range<usize>> {
        self.called().iter().map(|node| node.tokens()[0].range()).collect()
    }

    fn calls(&self, write: &dyn Fn(&str, &str) -> String) -> Vec<Change> {
        let write = |node: &Node<'_>| {
            let (name, body) = (node.name()?, node.body()?);
            let inside = &self.tree.text()[body.range().start + 1..body.range().end - 1];
            (!inside.contains('(') && !inside.is_empty()).then(|| (node.range(), write(name, inside)))
        };
        self.called().iter().filter_map(write).collect()
    }

    /// The fields of nodes with their roles.
    fn given(&self) -> Vec<(Node<'_>, Role)> {
        let mut given = Vec::new();
        for node in self.called() {
            let (Some(info), Some(body)) = (node.name().and_then(|name| self.registry.info(name)), node.body()) else {
                continue;
            };
            for entry in body.entries() {
                let field = entry.key_text().and_then(|name| info.field(&name));
                given.extend(field.map(|field| (entry, field.role.clone())));
            }
        }
        given
    }

    fn fields(&self) -> Vec<Range<usize>> {
        self.given().iter().map(|(entry, _)| entry.key().unwrap().range()).collect()
    }

    fn values(&self, wanted: &dyn Fn(&Role) -> bool, kind: NodeKind) -> Vec<Range<usize>> {
        let given = self.given();
        let values = given.iter().filter(|(_, role)| wanted(role)).filter_map(|(entry, _)| entry.value());
        values.filter(|value| value.kind() == kind).map(Node::range).collect()
    }

    fn choices(&self) -> Vec<Range<usize>> {
        let is_choice = |role: &Role| matches!(role, Role::Param(param) if !param.choices.is_empty());
        self.values(&is_choice, NodeKind::Word)
            .into_iter()
            .filter(|r| !matches!(self.at(r).as_str(), "true" | "false"))
            .collect()
    }

    /// The names of nodes in ports.
    fn wires(&self) -> Vec<Range<usize>> {
        let texts = self.values(&|role| matches!(role, Role::Port(_)), NodeKind::Text).into_iter();
        let names = texts.map(|r| r.start + 1..r.end - 1);
        names.filter(|r| shibo_graph::syntax::is_name(&self.at(r)) && r.len() > 2).collect()
    }

    /// The names of parameters behind `$`.
    fn params(&self) -> Vec<Range<usize>> {
        let text = self.tree.text();
        let end =
            |at: usize| text[at..].find(|c: char| !(c == '_' || c.is_ascii_alphanumeric())).map(|len| at..at + len);
        let inside = |range: &Range<usize>| !self.tree.is_comment(range.start) && range.len() > 2;
        self.find("$").filter_map(|at| end(at + 1)).filter(inside).collect()
    }

    fn functions(&self) -> Vec<Range<usize>> {
        let names = ["clamp(", "min(", "max(", "mix(", "smoothstep(", "abs(", "sqrt(", "random("];
        let found = names.iter().flat_map(|name| self.find(name).map(|at| at..at + name.len() - 1));
        let in_formula = |r: &Range<usize>| {
            self.tree.covering(r.clone()).kind() == NodeKind::Text && self.tree.text()[..r.start].ends_with([' ', '('])
        };
        found.filter(in_formula).collect()
    }

    fn numbers(&self, unit: &str) -> Vec<Range<usize>> {
        let has_unit = |role: &Role| match role {
            Role::Param(param) => {
                matches!(param.ty, ParamType::Number | ParamType::Integer)
                    && (unit.is_empty() || param.bounds.unit.as_deref() == Some(unit))
            }
            Role::Port(_) => false,
        };
        self.values(&has_unit, NodeKind::Number)
    }

    fn nodes(&self) -> Vec<Range<usize>> {
        self.tree.value().unwrap().entry("nodes").unwrap().value().unwrap().entries().map(Node::range).collect()
    }
}

/// A word with a typing error: two letters exchanged, one left out, doubled, or replaced.
fn typo(word: &str, dice: &mut Dice) -> Option<String> {
    let mut letters: Vec<char> = word.chars().collect();
    if letters.len() < 4 {
        return None;
    }
    let at = 1 + dice.below(letters.len() - 2);
    match dice.below(4) {
        0 => letters.swap(at, at + 1),
        1 => drop(letters.remove(at)),
        2 => letters.insert(at, letters[at]),
        _ => letters[at] = if letters[at] == 'e' { 'a' } else { 'e' },
    }
    Some(letters.into_iter().collect())
}

fn snake(word: &str) -> String {
    let mut out = String::new();
    for (at, c) in word.chars().enumerate() {
        if c.is_uppercase() && at > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

fn camel(word: &str) -> Option<String> {
    let mut parts = word.split('_');
    let first = parts.next()?.to_owned();
    word.contains('_').then(|| parts.fold(first, |out, part| out + &capital(part)))
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

/// The word of another program for a field.
fn elsewhere(word: &str) -> Option<String> {
    let words = [
        ("size", "scale"),
        ("amount", "strength"),
        ("input", "in"),
        ("radius", "sigma"),
        ("angle", "rotation"),
        ("mode", "blend_mode"),
        ("octaves", "detail"),
        ("pitch", "spacing"),
        ("opacity", "alpha"),
        ("gain", "persistence"),
        ("roughness", "rough"),
        ("base_color", "albedo"),
        ("width", "thickness"),
        ("seed", "random_seed"),
    ];
    words.iter().find(|(here, _)| *here == word).map(|(_, there)| (*there).to_owned())
}
