//! The preset with the found values.
use super::drawn::ron;
use super::{Fitted, Fitting, Refused};
use crate::Amount;
use shibo_bridge::page::edits::changed;
use shibo_bridge::{GraphText, Tools};
use shibo_engine::session::Failure;
use shibo_graph::{LoadOptions, load_text};
use shibo_ide::actions::put_preset;
use shibo_ide::{Cx, Workspace};
use std::path::Path;

/// The name of the preset for a photograph: that of the file.
pub fn name_for(photo: &Path) -> String {
    let stem = photo.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let allowed = |c: char| if c.is_alphanumeric() || matches!(c, '_' | '-' | ' ') { c } else { '_' };
    let name: String = stem.chars().map(allowed).collect();
    if name.trim().is_empty() { "fitted".to_owned() } else { name }
}

/// A preset for a graph file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Its name.
    pub name: String,
    /// The comment above it, without `//`.
    pub comment: String,
    /// Names and values of parameters, as RON.
    pub values: Vec<(String, String)>,
}

impl Fitting<'_> {
    /// Parameters and their values as RON: those of the unknowns, and those of the start other than the graph's own.
    pub fn values(&self, amounts: &[Amount], combination: usize) -> Vec<(String, String)> {
        let found = self.setup.written.iter().zip(amounts);
        let found = found.map(|(param, amount)| (param.name.clone(), ron(*amount)));
        let held = self.setup.combinations.get(combination).into_iter().flatten().cloned();
        found.chain(held).collect()
    }
}

impl Fitted<'_> {
    /// The found values, and values of the start other than the graph's own.
    pub fn preset(&self) -> Preset {
        let amounts: Vec<Amount> = self.fit.found.iter().map(|found| found.amount).collect();
        let (name, comment) = (self.fitting.request.preset.clone(), self.comment());
        Preset { name, comment, values: self.fitting.values(&amounts, self.fit.combination) }
    }

    fn comment(&self) -> String {
        let (fitting, distance) = (self.fitting, self.fit.distance.distance);
        let width = match (fitting.photo.given_mm, fitting.setup.hidden()[0]) {
            (Some(width), _) => format!("{width} mm wide"),
            (None, Some(at)) => match self.fit.found.get(at).map(|found| found.amount) {
                Some(Amount::Number(width)) => format!("about {width} mm wide"),
                _ => String::new(),
            },
            (None, None) => String::new(),
        };
        let name = &fitting.photo.name;
        match self.fit.floor {
            Some(floor) if floor.distance > 0.0 => {
                format!("fitted to {name}, {width}: {:.1} × the floor", distance / floor.distance)
            }
            _ => format!("fitted to {name}, {width}: interrupted at distance {distance:.2}"),
        }
    }
}

impl Preset {
    /// The text of a graph with the preset; all other text stays byte for byte.
    ///
    /// # Errors
    ///
    /// Fails if the name cannot be that of a preset, and if the graph would not load with it.
    pub fn put(&self, file: &GraphText, tools: &Tools) -> Result<String, Refused> {
        let mut world =
            Workspace::new(tools.registry.clone(), Vec::new()).with_import_paths(tools.import_paths.clone());
        let opened = world.open(&file.path, file.text.as_str());
        let cx = Cx { world: &world, file: &opened };
        let edits = put_preset(cx, &self.name, &self.comment, &self.values).map_err(Refused::Usage)?;
        let text = changed(&file.text, edits);
        let options = LoadOptions {
            preset: Some(self.name.clone()),
            import_paths: tools.import_paths.clone(),
            ..LoadOptions::default()
        };
        let loaded = load_text(&file.path, &text, &tools.registry, &options);
        match loaded.graph {
            Some(_) => Ok(text),
            None => Err(Refused::Graph(Failure::Errors(loaded.diagnostics), loaded.sources)),
        }
    }

    /// The preset as it is written.
    pub fn lines(&self) -> String {
        let values: Vec<String> = self.values.iter().map(|(name, value)| format!("\"{name}\": {value}")).collect();
        format!("    // {}\n    \"{}\": {{ {} }},", self.comment, self.name, values.join(", "))
    }
}
