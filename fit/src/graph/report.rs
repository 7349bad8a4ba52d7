//! The report of a fit: in words, and as JSON.
use super::Fitted;
use super::drawn::ron;
use crate::{Amount, End, Found};
use serde_json::{Map, Value as Data, json};
use std::path::Path;

const BLOCKS: [(&str, &str); 5] = [
    ("color", "colours"),
    ("energy", "contrast by wavelength and direction"),
    ("shape", "how dark grooves and bright ridges are"),
    ("corr", "how structures meet"),
    ("phase", "which side of edges is steep"),
];

/// A block whose distance is above the floor by this factor and by this amount is not reached.
const REACHED: (f64, f64) = (2.0, 0.3);

/// The blocks that the fit does not reach.
fn unreached(done: &Fitted<'_>) -> Vec<usize> {
    let fit = &done.fit;
    let Some(floor) = fit.floor else { return Vec::new() };
    (0..BLOCKS.len()).filter(|at| fit.distance.blocks[*at] > REACHED.0 * floor.blocks[*at] + REACHED.1).collect()
}

/// The smallest distance of a preset.
fn nearest<'d>(done: &'d Fitted<'_>) -> Option<(f64, &'d str)> {
    let presets = done.fit.starts.iter().skip(1).zip(&done.fitting.setup.presets);
    presets.filter_map(|(distance, name)| Some(((*distance)?, name.as_str()))).min_by(|a, b| a.0.total_cmp(&b.0))
}

fn number(value: f64, error: f64) -> String {
    let places = (-error.clamp(1e-6, 1e6).log10().floor()).clamp(0.0, 6.0);
    #[expect(clippy::cast_possible_truncation, reason = "between 0 and 6")]
    let places = places as usize;
    format!("{value:.places$}")
}

impl Fitted<'_> {
    /// The report for people. `file` is the file that got the preset; without it, the report has the preset.
    pub fn page(&self, file: Option<&Path>) -> String {
        page(self, file)
    }

    /// The report for programs.
    pub fn json(&self) -> Data {
        json(self)
    }
}

fn page(done: &Fitted<'_>, file: Option<&Path>) -> String {
    let (name, lines) = (&done.fitting.request.preset, done.preset().lines());
    let (fit, setup) = (&done.fit, &done.fitting.setup);
    let mut page = match file {
        Some(file) => format!("{}: preset \"{name}\" written ({} values)\n", file.display(), setup.written.len()),
        None => format!("preset \"{name}\":\n{lines}\n"),
    };
    let start = fit.starts.first().copied().flatten();
    let mut about = Vec::new();
    if let Some(floor) = fit.floor {
        about.push(format!("two seeds of one recipe differ by {:.2}", floor.distance));
        about.push(format!("this differs from the photograph by {:.2}", fit.distance.distance));
    }
    about.extend(start.map(|start| format!("the graph as it is by {start:.2}")));
    about.extend(nearest(done).map(|(distance, name)| format!("the nearest preset, \"{name}\", by {distance:.2}")));
    let about = about.join("; ");
    page += &match fit.floor {
        Some(floor) => format!("  {:.1} × the floor ({about})\n", fit.distance.distance / floor.distance.max(1e-9)),
        None => format!("  interrupted at distance {:.2} ({about})\n", fit.distance.distance),
    };
    let widest = setup.written.iter().map(|param| param.name.chars().count()).max().unwrap_or(0).max(5);
    for (param, found) in setup.written.iter().zip(&fit.found) {
        let unit = param.unit.as_ref().map(|unit| if unit == "°" { unit.clone() } else { format!(" {unit}") });
        page += &format!("  {:widest$}  {}\n", param.name, value(found, unit.as_deref().unwrap_or("")));
    }
    page += &light(done, widest);
    if let Some(found) = setup.hidden()[0].and_then(|at| fit.found.get(at)) {
        page += &format!("  {:widest$}  {}\n", "width", value(found, " mm"));
        page += "  the width was not given, so lengths are correct only relative to each other\n";
    }
    for (name, reason) in &setup.left {
        page += &format!("  {name:widest$}  {reason}\n");
    }
    let label = |at: usize| label(&setup.unknowns.0[at].name);
    for (one, other, correlation) in &fit.pairs {
        let how = if *correlation < 0.0 { "do the same" } else { "undo each other" };
        page += &format!("  {} and {} {how}: the photograph hardly tells them apart\n", label(*one), label(*other));
    }
    for (param, found) in setup.written.iter().zip(&fit.found).filter(|(_, found)| found.determined) {
        let (word, range) = match (found.end, param.range) {
            (Some(End::Low), Some((low, _))) => ("less", low),
            (Some(End::High), Some((_, high))) => ("more", high),
            _ => continue,
        };
        page += &format!("  `{}` wants {word} than {range}: the graph cannot go farther\n", param.name);
    }
    let missed: Vec<&str> = unreached(done).into_iter().map(|at| BLOCKS[at].1).collect();
    match (fit.floor, missed.is_empty()) {
        (None, _) => {}
        (_, true) => page += "  not reached: nothing\n",
        (_, false) => page += &format!("  not reached: {}\n", missed.join("; ")),
    }
    if setup.output == "lit" && setup.written.iter().any(|param| param.ty == "Color") {
        page += "  one photograph cannot separate colour from relief: shadows may be part of the colours\n";
    }
    page
}

/// The name of an unknown for people.
fn label(name: &str) -> String {
    match name {
        "fit_width_mm" => "the width".to_owned(),
        "fit_azimuth" => "the azimuth of the light".to_owned(),
        "fit_elevation" => "the elevation of the light".to_owned(),
        name => format!("`{name}`"),
    }
}

fn value(found: &Found, unit: &str) -> String {
    match found.amount {
        Amount::Color(_) => {
            let weakly = if found.determined { "" } else { "  (weakly determined)" };
            format!("{}{weakly}", ron(found.amount).trim_matches('"'))
        }
        Amount::Number(value) => {
            let (shown, error) = (number(value, found.error), number(found.error, found.error));
            if found.determined {
                return format!("{shown}{unit}  ± {error}");
            }
            let (low, high) = (number(value - found.error, found.error), number(value + found.error, found.error));
            format!("not determined by this photograph: {shown}{unit}, anything from {low} to {high} looks alike")
        }
    }
}

fn light(done: &Fitted<'_>, widest: usize) -> String {
    let [_, azimuth, elevation] = done.fitting.setup.hidden().map(|at| at.and_then(|at| done.fit.found.get(at)));
    let Some(azimuth) = azimuth else { return String::new() };
    let angle = |found: &Found| match found.amount {
        Amount::Number(value) => number(value, found.error.max(1.0)),
        Amount::Color(_) => String::new(),
    };
    let high = elevation.map(|elevation| format!(", {}° high", angle(elevation))).unwrap_or_default();
    format!("  {:widest$}  from {}°{high} (only for this comparison)\n", "light", angle(azimuth))
}

fn json(done: &Fitted<'_>) -> Data {
    let (fit, setup) = (&done.fit, &done.fitting.setup);
    let plain = |found: Option<&Found>| match found.map(|found| found.amount) {
        Some(Amount::Number(value)) => Some(value),
        _ => None,
    };
    let [width, azimuth, elevation] = setup.hidden().map(|at| at.and_then(|at| fit.found.get(at)));
    let mut parameters = Map::new();
    for (param, found) in setup.written.iter().zip(&fit.found) {
        let value = match found.amount {
            Amount::Number(value) => json!(value),
            Amount::Color(_) => json!(ron(found.amount).trim_matches('"')),
        };
        let end = found.end.map(|end| if end == End::Low { "low" } else { "high" });
        parameters.insert(
            param.name.clone(),
            json!({
                "value": value, "error": found.error, "error_share": found.share, "determined": found.determined,
                "unit": param.unit, "end": end,
            }),
        );
    }
    let held = setup.combinations.get(fit.combination).into_iter().flatten();
    let held: Map<String, Data> = held.map(|(name, value)| (name.clone(), json!(value))).collect();
    let pairs: Vec<Data> = fit
        .pairs
        .iter()
        .map(|(one, other, correlation)| {
            json!([setup.unknowns.0[*one].name, setup.unknowns.0[*other].name, correlation])
        })
        .collect();
    json!({
        "preset": done.fitting.request.preset,
        "distance": fit.distance.distance,
        "floor": fit.floor.map(|floor| floor.distance),
        "start": fit.starts.first().copied().flatten(),
        "nearest_preset": nearest(done).map(|(distance, name)| json!({ "name": name, "distance": distance })),
        "renders": fit.renders,
        "refused": fit.refused,
        "cpu_s": done.cpu,
        "width_mm": plain(width).or(done.fitting.photo.width_mm),
        "width_fitted": width.is_some(),
        "light": azimuth.map(|found| json!({ "azimuth": plain(Some(found)), "elevation": plain(elevation) })),
        "unreached": unreached(done).into_iter().map(|at| BLOCKS[at].0).collect::<Vec<_>>(),
        "pairs": pairs,
        "held": held,
        "interrupted": fit.cancelled,
        "parameters": parameters,
    })
}
