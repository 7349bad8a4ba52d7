//! Fixes of names that do not exist: the nearest names of those that may stand there.
use super::super::complete::complete;
use super::super::diagnose::Finding;
use super::super::expect::Expect;
use super::super::file::{File, Section};
use super::super::names::params_in;
use super::super::rename::{Edit, apply};
use super::super::spelling::{LONGEST, distance};
use super::super::world::Cx;
use super::imports::{self, graph_paths, is_graph};
use super::meanings::meanings;
use super::{Applies, Fix, value_at};
use crate::manual::elsewhere::{self, squash};
use shibo_graph::syntax::is_name;
use std::collections::HashSet;
use std::ops::Range;

/// Most names offered for a word.
const OFFERED: usize = 4;
/// Fewest letters of a word with two typing errors.
const LONG: usize = 7;

/// Fixes of an unknown name.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let says = cx.file.at(&finding.range);
    let start = finding.range.start;
    match finding.code.as_str() {
        "file-not-found" => return files(cx, finding),
        "unknown-param" if says.contains('$') => return params(cx, finding),
        "unknown-field" => {
            if let Some(fix) = renamed_section(cx, finding) {
                return vec![fix];
            }
        }
        "unknown-port" => return ports(cx, finding),
        _ => {}
    }
    let quoted = says.starts_with(['"', '\'']);
    let at = start + usize::from(quoted);
    let word = word_at(&cx.file.text, at);
    let mut found = Vec::new();
    let is_param = |name: &str| cx.file.entry(Section::Params, name).is_some();
    if matches!(finding.code.as_str(), "unknown-node" | "bad-expression") && is_param(cx.file.at(&word)) {
        let text = format!("${}", cx.file.at(&word));
        found.push(Fix::replace(Applies::Sure, word.clone(), text));
    }
    let is_formula = finding.code == "bad-expression";
    let mut names = names_at(cx, at, is_formula);
    names.retain(|name| is_name(name));
    found.extend(nearest(cx, finding, &word, &names));
    if let Some((Expect::Use(_, _, Some("graph")), _)) = value_at(cx, at) {
        let (mut imports, named) = imports::fixes(cx, finding);
        if named {
            std::mem::swap(&mut found, &mut imports);
        }
        found.extend(imports);
    }
    found
}

/// The names that completion offers at a position, best first.
pub(super) fn names_at(cx: Cx<'_>, at: usize, is_formula: bool) -> Vec<String> {
    let (mut names, mut seen): (Vec<String>, HashSet<String>) = (Vec::new(), HashSet::new());
    let mut offers = complete(cx, at);
    if is_formula && offers.is_empty() {
        offers = complete(cx, at + 1);
    }
    for one in offers {
        let name = one.label.split('(').next().unwrap_or_default().trim().trim_matches('"').to_owned();
        if !name.is_empty() && seen.insert(name.clone()) {
            names.push(name);
        }
    }
    names
}

/// The word of letters, digits and `_` at a position.
pub(super) fn word_at(text: &str, at: usize) -> Range<usize> {
    let rest = text.get(at..).unwrap_or_default();
    let len = rest.find(|c: char| !(c == '_' || c.is_alphanumeric())).unwrap_or(rest.len());
    at..at + len
}

/// The names nearest to a word, best first.
fn nearest(cx: Cx<'_>, finding: &Finding, word: &Range<usize>, names: &[String]) -> Vec<Fix> {
    let wrong = cx.file.at(word);
    let mut ranked = ranked(wrong, names.iter().map(String::as_str));
    if finding.code == "unknown-kind" {
        for kind in elsewhere::kinds(cx.registry(), wrong) {
            if !ranked.iter().any(|(_, name)| *name == kind) {
                ranked.push((Near::Elsewhere, kind));
            }
        }
        ranked.sort_by_key(|(near, _)| *near);
    }
    let is_sole = is_sole(wrong, &ranked);
    let level = |index: usize| if index == 0 && is_sole { Applies::Sure } else { Applies::Likely };
    let fix = |(index, (_, name)): (usize, &(Near, &str))| Fix::replace(level(index), word.clone(), *name);
    ranked.iter().take(OFFERED).enumerate().map(fix).collect()
}

/// Likeness of a name to a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Near {
    /// The same letters in another case, or with other signs between words.
    Same,
    /// The same letters but for the plural, or in another order of words.
    Form,
    /// A number of typing errors.
    Typed(usize),
    /// The name of the same thing in another program.
    Elsewhere,
    /// One contains the other.
    Part(usize),
}

/// Names like a word, best first. Of equals the earlier one is first.
fn ranked<'n>(wrong: &str, names: impl Iterator<Item = &'n str>) -> Vec<(Near, &'n str)> {
    let mut found: Vec<(Near, &str)> = names.filter_map(|name| Some((near(wrong, name)?, name))).collect();
    found.sort_by_key(|(near, _)| *near);
    found
}

/// The name that is most like a word.
pub(super) fn nearest_name<'n>(wrong: &str, names: &[&'n str]) -> Option<&'n str> {
    ranked(wrong, names.iter().copied()).first().map(|(_, name)| *name)
}

/// Returns true if the first name is the only one that can be meant.
fn is_sole(wrong: &str, ranked: &[(Near, &str)]) -> bool {
    let second = ranked.get(1).map(|(near, _)| *near);
    match ranked.first() {
        Some((Near::Same, _)) => second != Some(Near::Same),
        Some((Near::Form, _)) => second != Some(Near::Form),
        Some((Near::Typed(errors), _)) => {
            let far = |near: Near| !matches!(near, Near::Typed(other) if other <= *errors + 1);
            let long = wrong.chars().count() >= if *errors > 1 { LONG } else { 4 };
            *errors <= 2 && long && second.is_none_or(far)
        }
        Some((Near::Elsewhere | Near::Part(_), _)) | None => false,
    }
}

fn near(wrong: &str, name: &str) -> Option<Near> {
    if wrong.len() > LONGEST || name.len() > LONGEST || wrong.is_empty() || wrong == name {
        return None;
    }
    let (a, b) = (squash(wrong), squash(name));
    if a == b {
        return Some(Near::Same);
    }
    if a.trim_end_matches('s') == b.trim_end_matches('s') {
        return Some(Near::Form);
    }
    if meanings(&a).contains(&name) {
        return Some(Near::Elsewhere);
    }
    let errors = distance(&a, &b);
    if errors <= 1 + a.len().min(b.len()) / 4 {
        return Some(Near::Typed(errors));
    }
    let short = a.len().min(b.len());
    (short > 2 && (a.contains(&b) || b.contains(&a))).then_some(Near::Part(a.len().abs_diff(b.len())))
}

/// Parameters that do not exist, as `$name` in a text.
fn params(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let (says, start) = (cx.file.at(&finding.range), finding.range.start);
    let names: Vec<String> = cx.file.names(Section::Params).map(str::to_owned).collect();
    let unknown = params_in(says).into_iter().find(|range| !names.iter().any(|name| *name == says[range.clone()]));
    if let Some(range) = unknown {
        return nearest(cx, finding, &(start + range.start..start + range.end), &names);
    }
    // All names are right, so the text is a formula without its equals sign.
    let is_text = says.starts_with("\"$");
    let edit = Edit { range: start + 1..start + 1, text: "= ".to_owned() };
    if is_text { vec![Fix::new("Make it a formula", Applies::Sure, vec![edit])] } else { Vec::new() }
}

/// Outputs that a node does not have.
fn ports(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let (says, start) = (cx.file.at(&finding.range), finding.range.start);
    let dot = says.find('.').map_or(start, |dot| start + dot + 1);
    let word = word_at(&cx.file.text, dot);
    let last = |name: String| name.rsplit('.').next().unwrap_or_default().to_owned();
    let names: Vec<String> = names_at(cx, dot, false).into_iter().map(last).collect();
    let mut found = nearest(cx, finding, &word, &names);
    if names.len() == 1 && found.is_empty() {
        found.push(Fix::replace(Applies::Likely, word.clone(), names[0].clone()));
    }
    if dot > start {
        let range = dot - 1..word.end;
        found.push(Fix::new("Take the first output", Applies::Likely, vec![Edit { range, text: String::new() }]));
    }
    found
}

/// Files with a similar name.
fn files(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let says = cx.file.at(&finding.range);
    if says.len() < 3 || !says.starts_with('"') || !says.ends_with('"') {
        return Vec::new();
    }
    let range = finding.range.start + 1..finding.range.end - 1;
    let written = cx.file.at(&range);
    let mut names = graph_paths(cx, written);
    if is_graph(written) {
        names.retain(|name| is_graph(name));
    }
    nearest(cx, finding, &range, &names)
}

/// A field of the top level that is a misspelt section, if the graph lacks that section.
pub(super) fn renamed_section(cx: Cx<'_>, finding: &Finding) -> Option<Fix> {
    let body = cx.file.body()?;
    let is_known = |name: &str| shibo_graph::schema::ROOT.iter().any(|field| field.name == name);
    let unknown = body.items.iter().filter_map(|item| item.key.as_ref()).filter(|key| !is_known(&key.name));
    let lacks = |name: &&str| body.get(name).is_none();
    let wanted: Vec<&str> = shibo_graph::schema::ROOT.iter().map(|field| field.name).filter(lacks).collect();
    for key in unknown {
        let about = key.range == finding.range || (finding.code == "missing-input" && cx.file.local_name().is_none());
        let ranked = ranked(&key.name, wanted.iter().copied());
        let Some((_, name)) = ranked.first().filter(|_| about) else { continue };
        let level = if is_sole(&key.name, &ranked) { Applies::Sure } else { Applies::Likely };
        if finding.code != "missing-input" || *name == Section::Nodes.key() {
            return Some(Fix::replace(level, key.range.clone(), *name));
        }
    }
    None
}

/// The name nearest to a word that would be offered if a text stood in a place instead.
pub(super) fn nearest_as(cx: Cx<'_>, range: &Range<usize>, text: &str, quoted: bool) -> Vec<(bool, String)> {
    let edited = apply(&cx.file.text, &[Edit { range: range.clone(), text: text.to_owned() }]);
    let file = File::new(cx.file.path.clone(), edited);
    let names = names_at(Cx { world: cx.world, file: &file }, range.start + usize::from(quoted), false);
    let word = text.trim_matches('"');
    if names.iter().any(|name| name == word) {
        return vec![(true, word.to_owned())];
    }
    let ranked = ranked(word, names.iter().map(String::as_str));
    let is_sole = is_sole(word, &ranked);
    let name = |(index, (_, name)): (usize, &(Near, &str))| (index == 0 && is_sole, (*name).to_owned());
    ranked.iter().take(2).enumerate().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_typing_errors() {
        assert_eq!(distance("perlin", "perlim"), 1);
        assert_eq!(distance("perlin", "pelrin"), 1);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("wrinkles", "wrinkels"), 1);
    }

    #[test]
    fn ranks_names() {
        let first = |wrong: &str, names: &[&'static str]| {
            let ranked = ranked(wrong, names.iter().copied());
            ranked.first().map(|(_, name)| (*name, is_sole(wrong, &ranked)))
        };
        assert_eq!(first("perlinNoise", &["Worley", "PerlinNoise"]), Some(("PerlinNoise", true)));
        assert_eq!(first("sise", &["size", "seed"]), Some(("size", true)));
        assert_eq!(first("scale", &["size", "seed"]), Some(("size", false)));
        assert_eq!(first("widthmin", &["width_max", "width_min"]), Some(("width_min", true)));
        assert_eq!(first("zebra", &["size"]), None);
    }
}
