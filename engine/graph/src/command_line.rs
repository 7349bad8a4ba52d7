//! Values from the command line: preset, parameters, seed and resolution.
use super::LoadOptions;
use super::canvas::{self, Asked};
use super::files::Doc;
use super::linker::Setting;
use super::params::{ParamDecl, Params};
use super::part::{PieceOrigin, Src, SyntaxValue};
use super::presets::preset_names;
use super::read::shorten;
use super::report::Report;
use super::ron_text::ron_string;
use crate::diagnostics::{Code, Diagnostic, Origin, SourceMap, Span};
use crate::syntax::Tree;
use crate::value::{Canvas, Resolution};
use glam::UVec2;
use std::cell::Cell;

/// The name of the canvas seed among the given values.
const SEED: &str = "seed";

pub(super) fn check_preset(doc: &Doc, options: &LoadOptions, sources: &mut SourceMap, report: &mut Report) {
    let Some(wanted) = &options.preset else { return };
    let names = doc.document.presets.iter().map(|(entry, _)| entry.name.as_str());
    for name in preset_names(wanted).filter(|name| !names.clone().any(|known| known == *name)) {
        let span = sources.add_argument(Origin::Preset, "--preset ", wanted);
        let message = format!("there is no preset `{}`", shorten(name));
        report.unknown(Diagnostic::new(Code::UnknownVariant, span, message), name, "preset", names.clone());
    }
}

/// Sets parameters from the command line. Returns the settings of instances.
pub(super) fn set(
    doc: &Doc,
    options: &LoadOptions,
    params: &mut Params,
    sources: &mut SourceMap,
    report: &mut Report,
) -> Vec<Setting> {
    let mut settings = Vec::new();
    for (name, value) in &options.set {
        let origin = Origin::Param { name: name.clone() };
        if let Some((instance, param)) = name.rsplit_once(['.', '/']) {
            let span = sources.add_argument(origin, &format!("--set {name}="), value);
            settings.push(Setting {
                prefix: format!("{}/", instance.replace('.', "/")),
                param: param.to_owned(),
                value: value.clone(),
                span,
                path: Span { start: "--set ".len(), end: "--set ".len() + name.len(), ..span },
                used: Cell::new(false),
            });
            continue;
        }
        let Some(decl) = doc.document.param(name) else {
            if name == SEED {
                continue;
            }
            let span = sources.add_argument(origin, "--set ", &format!("{name}={value}"));
            let names = doc.document.params.iter().map(|(entry, _)| entry.name.as_str());
            let message = format!("there is no parameter `{}`", shorten(name));
            let span = Span { end: span.start + name.len(), ..span };
            report.unknown(Diagnostic::new(Code::UnknownParam, span, message), name, "parameter", names);
            continue;
        };
        let span = sources.add_argument(origin, &format!("--set {name}="), value);
        let read = decl.and_then(|decl| decl.value(&argument(decl, value, span), true, &options.working_dir, report));
        params.give(name.clone(), read);
    }
    settings
}

/// The canvas seed from the command line: `--set seed=`, unless a parameter has that name.
pub(super) fn seed(doc: &Doc, options: &LoadOptions, sources: &mut SourceMap, report: &mut Report) -> Option<u64> {
    let (name, value) = options.set.iter().rev().find(|(name, _)| name == SEED)?;
    if doc.document.param(name).is_some() {
        return None;
    }
    let span = sources.add_argument(Origin::Param { name: name.clone() }, &format!("--set {name}="), value);
    canvas::seed(&given(value, value.to_owned(), span).or_else(|| given(value, ron_string(value), span))?, report)
}

/// Parses a value given at `span`, where it is written as `value`.
fn given(value: &str, text: String, span: Span) -> Option<SyntaxValue> {
    let piece = PieceOrigin { end: text.len(), span, copied: text == value, related: Vec::new(), given: true };
    Src::made(span.file, text, vec![piece]).whole()
}

/// Parses a command-line value: RON, or bare text for a text parameter.
pub(super) fn argument(decl: &ParamDecl, value: &str, span: Span) -> SyntaxValue {
    let ron = Tree::parse(value).errors().is_empty();
    let bare = decl.takes_bare_text() && !(ron && value.trim_start().starts_with(['"', '(', 'r']));
    let text = if bare || !ron { ron_string(value) } else { value.to_owned() };
    // A text without tokens, such as a comment, is no value.
    given(value, text, span).or_else(|| given(value, ron_string(value), span)).unwrap_or_else(|| decl.default.clone())
}

/// The resolution from the command line, if valid.
pub(super) fn resolution(options: &LoadOptions, sources: &mut SourceMap, report: &mut Report) -> Option<Asked> {
    let resolution = options.resolution?;
    let (text, size) = match resolution {
        Resolution::Longer(longer) => (longer.to_string(), UVec2::splat(longer)),
        Resolution::Exact(size) => (format!("{}x{}", size.x, size.y), size),
    };
    let span = sources.add_argument(Origin::Resolution, "--resolution ", &text);
    if size.max_element() > Canvas::MAX_RESOLUTION {
        report.push(Diagnostic::new(Code::TooLarge, span, canvas::too_large(&text)));
    } else if size.min_element() == 0 {
        let message = format!("resolution is `{text}`; it must be at least 1 pixel");
        report.push(Diagnostic::new(Code::OutOfRange, span, message));
    } else {
        return Some(Asked { resolution, span: Some(span) });
    }
    None
}
