//! The preset that a fit writes.
use super::drawn::ron;
use super::{Done, FitArgs};
use crate::quit::Quit;
use crate::write::{self, Refused};
use shibo_ide::actions::{apply, put_preset};
use shibo_ide::format::keep_layout;
use shibo_ide::rename::Edit;
use shibo_ide::{Cx, Workspace};
use std::path::Path;
use std::sync::Arc;

/// The name of the preset.
pub(super) fn name(args: &FitArgs) -> String {
    if let Some(name) = &args.preset {
        return name.clone();
    }
    let stem = args.photo.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let allowed = |c: char| if c.is_alphanumeric() || matches!(c, '_' | '-' | ' ') { c } else { '_' };
    let name: String = stem.chars().map(allowed).collect();
    if name.trim().is_empty() { "fitted".to_owned() } else { name }
}

/// The values of the preset: the found ones, and values of the start other than the graph's own.
fn values(done: &Done<'_>) -> Vec<(String, String)> {
    let setup = done.setup;
    let found = setup.written.iter().zip(&done.fit.found).map(|(param, found)| (param.name.clone(), ron(found.amount)));
    let held = setup.combinations.get(done.fit.combination).into_iter().flatten().cloned();
    found.chain(held).collect()
}

/// The comment above the preset.
fn comment(done: &Done<'_>) -> String {
    let width = match (done.photo.width_mm, done.setup.hidden()[0]) {
        (Some(_), _) => format!("{} mm wide", done.args.width_mm.unwrap_or_default()),
        (None, Some(at)) => match done.fit.found.get(at).map(|found| found.amount) {
            Some(shibo_fit::Amount::Number(width)) => format!("about {width} mm wide"),
            _ => String::new(),
        },
        (None, None) => String::new(),
    };
    let name: String = done.photo.name.chars().filter(|c| !crate::terminal::is_unsafe(*c)).collect();
    match done.fit.floor {
        Some(floor) if floor.distance > 0.0 => {
            format!("fitted to {name}, {width}: {:.1} × the floor", done.fit.distance.distance / floor.distance)
        }
        _ => format!("fitted to {name}, {width}: interrupted at distance {:.2}", done.fit.distance.distance),
    }
}

/// The name of the preset, and the text with it.
pub(super) fn text(done: &Done<'_>, before: &str) -> Result<(String, String), Quit> {
    let mut workspace = Workspace::new(Arc::new(crate::library::registry()), Vec::new())
        .with_import_paths(crate::environment::import_paths().to_vec());
    let file = workspace.open(&done.setup.path, before);
    let cx = Cx { world: &workspace, file: &file };
    let name = name(done.args);
    let edits = put_preset(cx, &name, &comment(done), &values(done)).map_err(Quit::Usage)?;
    // Inserted lines use the line ending of the file.
    let ends = |edit: Edit| Edit { text: edit.text.replace('\n', "\r\n"), ..edit };
    let edits: Vec<Edit> = if before.contains("\r\n") { edits.into_iter().map(ends).collect() } else { edits };
    Ok((name, keep_layout(before, apply(before, &edits))))
}

/// The preset as it is written.
pub(super) fn lines(done: &Done<'_>, name: &str) -> String {
    let values: Vec<String> = values(done).iter().map(|(name, value)| format!("\"{name}\": {value}")).collect();
    format!("    // {}\n    \"{name}\": {{ {} }},", comment(done), values.join(", "))
}

/// Writes the file, or says why it was left alone.
pub(super) fn write(path: &Path, before: &str, after: &str) -> Result<(), String> {
    let shown = path.display();
    write::change(path, before, after).map_err(|refused| match refused {
        Refused::Changed => format!("`{shown}` was saved meanwhile, and left alone; the preset is above"),
        Refused::Failed(error) => format!("cannot write `{shown}`: {error}; the preset is above"),
    })
}
