//! Presets: named sets of values for parameters.
use super::files::Doc;
use super::params::Values;
use super::read;
use super::report::Report;
use crate::diagnostics::Code;
use std::collections::BTreeMap;

/// Checks the presets of a document; returns the values of those named in `wanted`, with later presets overriding
/// earlier ones.
pub(super) fn presets(doc: &Doc, wanted: Option<&str>, report: &mut Report) -> Values {
    let mut known = BTreeMap::new();
    for (preset, values) in &doc.document.presets {
        let params: &mut Values = known.entry(preset.name.as_str()).or_default();
        for entry in values {
            let Some(decl) = doc.document.param(&entry.name) else {
                let names = doc.document.params.iter().map(|(param, _)| param.name.as_str());
                let message = format!("there is no parameter `{}`", read::shorten(&entry.name));
                report.unknown(entry.key.error(Code::UnknownParam, message), &entry.name, "parameter", names);
                continue;
            };
            let Some(decl) = decl else { continue };
            params.insert(entry.name.clone(), decl.value(&entry.value, false, doc.folder(), report));
        }
    }
    let wanted = wanted.into_iter().flat_map(preset_names);
    wanted.filter_map(|name| known.get(name)).flat_map(|values| values.clone()).collect()
}

/// The presets in `a+b`, later ones last.
pub(super) fn preset_names(text: &str) -> impl Iterator<Item = &str> {
    text.split('+').map(str::trim)
}
