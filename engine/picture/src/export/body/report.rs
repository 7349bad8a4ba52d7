//! Texts about a body: the line at the end of a render, and the report.
use super::super::heights::told;
use super::Common;
use crate::value::diagnostics::Problem;
use serde_json::{Value as Json, json};
use shibo_kernel::body::Figures;

/// Facts of a finished body.
pub(in super::super) struct Facts {
    /// The kind of output, such as `Plate`.
    pub(in super::super) kind: &'static str,
    /// The largest distance to the height, in mm.
    pub(in super::super) error: f64,
    /// The least and the greatest height, in mm.
    pub(in super::super) height: (f32, f32),
    /// The thinnest wall in mm, and its place on the picture.
    pub(in super::super) thinnest: (f64, [f64; 2]),
    /// The distance of samples in mm.
    pub(in super::super) pitch: [f64; 2],
    /// The radius of a roll at height 0, in mm.
    pub(in super::super) radius: Option<f64>,
    /// The material that the milling tool leaves, if one is stated.
    pub(in super::super) tool: Option<Json>,
}

/// A whole number with a comma after each three digits.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a volume is positive and far below 2^64")]
fn whole(value: f64) -> u64 {
    value.round() as u64
}

/// The line at the end of a render.
pub(super) fn line(figures: &Figures, facts: &Facts) -> String {
    // The error is rounded up, so that the line never promises too much.
    let error = (facts.error * 1e4 - 1e-6).ceil() / 1e4;
    format!("{} triangles, error {error:.4} mm, {}, closed", grouped(figures.triangles), volume(figures))
}

fn volume(figures: &Figures) -> String {
    match figures.volume {
        volume if volume < 100.0 => format!("{volume:.2} mm³"),
        volume => format!("{} mm³", grouped(whole(volume))),
    }
}

/// The line of a mesh. One that is not closed has no volume.
pub(super) fn model_line(figures: &Figures, closed: bool) -> String {
    let size = size(figures).map(told).join(" × ");
    let end = if closed { format!("{}, closed", volume(figures)) } else { "open".to_owned() };
    format!("{} triangles, {size} mm, {end}", grouped(figures.triangles))
}

/// The report of a mesh as JSON.
pub(super) fn model_json(stem: &str, figures: &Figures, closed: bool, findings: &[Problem]) -> String {
    let report = json!({
        "output": stem,
        "kind": "Model",
        "size_mm": size(figures),
        "triangles": figures.triangles,
        "vertices": figures.vertices,
        "volume_mm3": closed.then_some(figures.volume),
        "area_mm2": figures.area,
        "closed": closed,
        "findings": listed(findings),
    });
    format!("{report:#}\n")
}

/// Warnings as JSON.
fn listed(findings: &[Problem]) -> Vec<Json> {
    let one = |Problem { code, at_mm, message, .. }: &Problem| json!({ "code": code.as_str(), "at_mm": at_mm, "message": message });
    findings.iter().map(one).collect()
}

fn size(figures: &Figures) -> [f64; 3] {
    let [low, high] = figures.bounds.map(|corner| corner.map(f64::from));
    [0, 1, 2].map(|axis| high[axis] - low[axis])
}

/// The report as JSON.
pub(super) fn json(common: &Common, figures: &Figures, facts: &Facts, findings: &[Problem]) -> String {
    let report = json!({
        "output": common.stem,
        "kind": facts.kind,
        "form": if common.mould { "Mould" } else { "Relief" },
        "size_mm": size(figures),
        "triangles": figures.triangles,
        "vertices": figures.vertices,
        "error_mm": facts.error,
        "volume_mm3": figures.volume,
        "area_mm2": figures.area,
        "height_mm": [facts.height.0, facts.height.1],
        "steepest_deg": figures.steepest.0,
        "steepest_at_mm": figures.steepest.1,
        "limit_deg": common.steepest,
        "over_limit_share": figures.over_limit,
        "thinnest_mm": facts.thinnest.0,
        "thinnest_at_mm": facts.thinnest.1,
        "pitch_mm": facts.pitch,
        "closed": true,
        "radius_mm": facts.radius,
        "tool": facts.tool,
        "findings": listed(findings),
    });
    format!("{report:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_digits_and_rounds_the_error_up() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
        let figures = Figures { triangles: 276_464, volume: 10_805.4, ..Figures::default() };
        let facts = |error| Facts {
            kind: "Plate",
            error,
            height: (0.0, 1.0),
            thinnest: (3.0, [0.0; 2]),
            pitch: [0.1; 2],
            radius: None,
            tool: None,
        };
        assert_eq!(line(&figures, &facts(0.01)), "276,464 triangles, error 0.0100 mm, 10,805 mm³, closed");
        assert!(line(&figures, &facts(0.010_01)).contains("0.0101"));
        assert!(line(&Figures { volume: 3.2149, ..figures }, &facts(0.01)).contains("3.21 mm³"));
    }
}
