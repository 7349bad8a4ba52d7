//! The form of the briefs for agents, `tests/briefs/briefs.ron`.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// A brief, as tests/briefs/README.md describes it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Brief {
    name: String,
    text: String,
    outputs: BTreeMap<String, String>,
    size_mm: (f64, f64),
    tile: String,
    #[serde(default)]
    color: Option<(String, Vec<(u8, u8)>)>,
    #[serde(default)]
    range: Option<(String, f64, f64)>,
    #[serde(default)]
    params: Vec<String>,
    #[serde(default)]
    fewest: usize,
}

#[test]
fn briefs_have_their_form() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/briefs/briefs.ron");
    let options = shibo_node::ron_options();
    let briefs: Vec<Brief> = options.from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let names: BTreeSet<&str> = briefs.iter().map(|brief| brief.name.as_str()).collect();
    assert_eq!((briefs.len(), names.len()), (30, 30));
    for brief in &briefs {
        let name = &brief.name;
        assert!(shibo_graph::syntax::is_name(name), "{name}");
        assert!((40..400).contains(&brief.text.len()), "{name}: {} bytes", brief.text.len());
        assert!(brief.size_mm.0 > 0.0 && brief.size_mm.1 > 0.0, "{name}");
        assert!(["Both", "X", "Y", "None"].contains(&brief.tile.as_str()), "{name}: {}", brief.tile);
        assert!(!brief.outputs.is_empty(), "{name}");
        for (output, ty) in &brief.outputs {
            assert!(["Material", "Gray", "Rgb"].contains(&ty.as_str()), "{name}: {output} is {ty}");
        }
        let known = |measured: &str| {
            let (output, channel) = measured.split_once('.').unwrap_or((measured, ""));
            let channels = ["base_color", "height", "metallic", "roughness"];
            brief.outputs.get(output).is_some_and(|ty| (ty == "Material") == channels.contains(&channel))
        };
        if let Some((measured, ranges)) = &brief.color {
            assert!(known(measured) && ranges.len() == 3, "{name}: {measured}");
            assert!(ranges.iter().all(|(least, most)| least < most), "{name}: {ranges:?}");
        }
        if let Some((measured, least, most)) = &brief.range {
            assert!(known(measured) && least <= most, "{name}: {measured}");
        }
        assert!(brief.params.iter().all(|param| shibo_graph::syntax::is_name(param)), "{name}");
        assert!(brief.fewest < 20, "{name}");
    }
}
