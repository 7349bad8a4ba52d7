//! The defaults of parameters. A default may refer to other parameters and to the canvas: it is computed after them,
//! and recomputed wherever they get other values.
use super::files::Doc;
use super::params::{Facts, ParamDecl, ParamValue, Params, Values};
use super::report::Report;
use super::subst::{is_driven, refers_to, substitute};
use crate::diagnostics::Code;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The parameters of a document with their defaults. Without the facts of a canvas, defaults that depend on the canvas
/// are [late](Params::late).
pub(super) fn params(doc: &Doc, facts: Option<Facts>, report: &mut Report) -> Params {
    let mut params = Params::new(Arc::new(plain(doc, report)));
    params.facts = facts;
    params.functions = doc.document.callable.clone();
    if has_derived(doc) {
        let mut silent = Report::default();
        let values = derive(doc, &mut params, if facts.is_some() { report } else { &mut silent });
        let mut defaults = plain(doc, &mut silent);
        defaults.extend(values);
        params.set_defaults(Arc::new(defaults));
    }
    params
}

/// Recomputes the defaults that refer to other parameters, after those were given values.
pub(super) fn follow(doc: &Doc, params: &mut Params, report: &mut Report) {
    if has_derived(doc) {
        for (name, value) in derive(doc, params, report) {
            params.give(name, value);
        }
    }
}

/// Recomputes all defaults once the canvas is known.
pub(super) fn settle(doc: &Doc, params: &mut Params, facts: Facts, report: &mut Report) {
    params.facts = Some(facts);
    params.late.clear();
    if has_derived(doc) {
        let defaults = self::params(doc, Some(facts), report);
        let all = doc.document.params.iter().map(|(entry, _)| entry.name.clone());
        let values = all.map(|name| (name.clone(), defaults.default_of(&name).cloned())).collect();
        params.set_defaults(Arc::new(values));
        follow(doc, params, report);
    }
}

/// Returns true if any default refers to something.
fn has_derived(doc: &Doc) -> bool {
    doc.document.params.iter().any(|(_, decl)| decl.as_ref().is_some_and(|decl| is_driven(&decl.default)))
}

/// The defaults without references; `None` for the others.
fn plain(doc: &Doc, report: &mut Report) -> Values {
    let value = |decl: &ParamDecl, report: &mut Report| {
        (!is_driven(&decl.default)).then(|| decl.value(&decl.default, false, doc.folder(), report)).flatten()
    };
    let params = doc.document.params.iter();
    params.map(|(entry, decl)| (entry.name.clone(), decl.as_ref().and_then(|decl| value(decl, report)))).collect()
}

/// The values of defaults with references, each after the ones it refers to; parameters that were given a value are
/// left out.
fn derive(doc: &Doc, params: &mut Params, report: &mut Report) -> Vec<(String, Option<ParamValue>)> {
    let decls: BTreeMap<&str, &ParamDecl> = doc
        .document
        .params
        .iter()
        .filter_map(|(_, decl)| decl.as_ref())
        .filter(|decl| is_driven(&decl.default) && !params.is_given(&decl.name))
        .map(|decl| (decl.name.as_str(), decl))
        .collect();
    // For each default, the number of unresolved references; and the defaults that refer to it.
    let mut waits: BTreeMap<&str, usize> = BTreeMap::new();
    let mut readers: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (&name, decl) in &decls {
        let mut others = refers_to(&decl.default);
        others.sort_unstable();
        others.dedup();
        let others: Vec<&str> =
            others.iter().filter_map(|other| decls.get_key_value(other.as_str()).map(|(k, _)| *k)).collect();
        waits.insert(name, others.len());
        others.into_iter().for_each(|other| readers.entry(other).or_default().push(name));
    }
    let mut ready: Vec<&str> = waits.iter().filter(|(_, count)| **count == 0).map(|(name, _)| *name).collect();
    let mut values = Vec::with_capacity(decls.len());
    let mut working = params.clone();
    while let Some(name) = ready.pop() {
        waits.remove(name);
        working.asked_early.set(false);
        let value = decls.get(name).and_then(|decl| {
            let put_in = substitute(&decl.default, &working, report)?;
            let folder = put_in.base.as_deref().unwrap_or_else(|| doc.folder());
            decl.value(&put_in.part, false, folder, report)
        });
        if working.asked_early.get() {
            working.late.insert(name.to_owned());
            params.late.insert(name.to_owned());
        } else {
            working.give(name.to_owned(), value.clone());
            values.push((name.to_owned(), value));
        }
        for reader in readers.remove(name).unwrap_or_default() {
            if let Some(count) = waits.get_mut(reader) {
                *count -= 1;
                if *count == 0 {
                    ready.push(reader);
                }
            }
        }
    }
    for name in waits.into_keys() {
        if let Some(decl) = decls.get(name) {
            let message = format!("the default of `{name}` needs itself");
            report.push(decl.default.error(Code::Cycle, message).help("write a value for one of these parameters"));
        }
        values.push((name.to_owned(), None));
    }
    values
}
