//! Synthesis on a surface, end to end: stage by stage, by the preset, and wrong combinations.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use serde_json::Value as Json;

const GROUND: &str = r#"    "ground": Worley(size: 12, jitter: 0.8),
    "exemplar": Exemplar(input: "ground", size: (32, 32), size_mm: 32),
    "ring": MeshShape(shape: Torus),
    "atlas": MeshAtlas(mesh: "ring"),
    "flow": TangentField(mesh: "ring", from: Around),
    "jacobian": JacobianFromMesh(atlas: "atlas", frames: "flow", scale: 1.2),
    "surface": IndirectionMap(atlas: "atlas", size: 100, levels: 4, jumps: Nearest),
"#;

const PRESET: &str = r#"    "preset": SynthesizeSurface(exemplar: "exemplar", atlas: "atlas", frames: "flow", scale: 1.2, preset: Patent,
      size: 100, start_size: 8, jitter: JITTER),
"#;

/// Start coordinates, then for each finer level: upsampling, jitter, correction.
fn stages(jitter: &str) -> String {
    let mut nodes = "    \"c3\": StartCoords(surface: \"surface\", exemplar: \"exemplar\", levels: 3),\n".to_string();
    for level in (0..3).rev() {
        nodes += &format!(
            r#"    "u{level}": UpsampleCoords(coords: "c{}", surface: "surface", jacobian: "jacobian"),
    "j{level}": JitterCoords(coords: "u{level}", surface: "surface", amount: {jitter}),
    "c{level}": CorrectCoords(coords: "j{level}", exemplar: "exemplar", surface: "surface", jacobian: "jacobian", passes: 2),
"#,
            level + 1
        );
    }
    nodes
}

fn write(desk: &Desk, nodes: &str) {
    let canvas = "size_mm: 100, resolution: 100, tile: None, seed: 1";
    let outputs = r#"outputs: { "out": "shown" }"#;
    let shown = r#"    "shown": SampleExemplar(coords: "c0", input: "ground"),"#;
    desk.write(
        "a.ron",
        format!("(\n  version: 1,\n  canvas: ({canvas}),\n  nodes: {{\n{nodes}{shown}\n  }},\n  {outputs},\n)\n"),
    );
}

fn dump(desk: &Desk, node: &str) -> Json {
    desk.shibo(&format!("dump a.ron {node} --no-cache")).expect(0).json()
}

/// Rows C18 and C24: the stages one by one, with `surface` at each, give the same coordinates as the source's preset.
#[test]
fn stages_on_a_surface_equal_the_preset() {
    let desk = Desk::new();
    write(&desk, &(GROUND.to_string() + &PRESET.replace("JITTER", "0") + &stages("0")));
    let (preset, staged) = (dump(&desk, "preset"), dump(&desk, "c0"));
    let coords = |json: &Json| json["coords"].as_array().unwrap().clone();
    let there = coords(&preset).iter().filter(|at| !at.is_null()).count();
    assert!(there > 2000 && there < 10_000, "{there}");
    assert_eq!(coords(&preset), coords(&staged));
    assert_eq!((&preset["coherence"], &preset["seam"]), (&staged["coherence"], &staged["seam"]));
    assert!(staged["seam"]["pairs"].as_u64().unwrap() > 100);
    let coarse = dump(&desk, "c2");
    assert_eq!((coarse["spacing"].as_u64(), coarse["size"].to_string()), (Some(4), "[25,25]".into()));
    // Jitter gives another texture.
    write(&desk, &(GROUND.to_string() + &PRESET.replace("JITTER", "0") + &stages("2")));
    let varied = dump(&desk, "c0");
    let same = coords(&varied).iter().zip(coords(&staged)).filter(|(a, b)| !a.is_null() && **a == *b).count();
    assert!(same * 2 < there, "{same} of {there}");
}

/// Each level shows the texture, at its own fineness.
#[test]
fn levels_in_between_show_the_texture_on_a_surface_too() {
    let desk = Desk::new();
    let ramp = GROUND.replace("Worley(size: 12, jitter: 0.8)", "Gradient()");
    // Without corrections, coordinates stay as upsampled from the first ones: affine within a triangle.
    let nodes = r#"    "c1": StartCoords(surface: "surface", exemplar: "exemplar", levels: 1),
    "c0": UpsampleCoords(coords: "c1", surface: "surface", jacobian: "jacobian"),
    "coarse": SampleExemplar(coords: "c1", input: "ground"),
"#;
    write(&desk, &(ramp + nodes));
    for node in ["coarse", "shown"] {
        let values = dump(&desk, node)["values"].clone();
        let values: Vec<f64> = values.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        assert!(values.iter().all(|v| (0.0..=1.0).contains(v)) && values.len() == 10_000, "{node}");
    }
}

/// Stages that do not fit together are refused, with a remedy.
#[test]
fn stages_that_do_not_share_a_surface_are_refused() {
    let desk = Desk::new();
    let refused = |nodes: &str, words: &[&str]| {
        write(&desk, &(GROUND.to_string() + nodes));
        let said = desk.shibo("render a.ron --no-cache").expect(1).stderr;
        words.iter().for_each(|word| assert!(said.contains(word), "{word}: {said}"));
    };
    let start = r#"    "c1": StartCoords(surface: "surface", exemplar: "exemplar", levels: 1),
"#;
    refused(
        &(start.replace(", exemplar: \"exemplar\"", "")
            + r#"    "c0": UpsampleCoords(coords: "c1", surface: "surface"),"#),
        &["on a surface the size of the exemplar's pixels must be known", "connect the exemplar"],
    );
    refused(
        &(start.replace("levels: 1", "levels: 5") + r#"    "c0": UpsampleCoords(coords: "c1", surface: "surface"),"#),
        &["no level of spacing 32; its coarsest is 8", "set `levels: 6` or more"],
    );
    refused(
        &(start.to_string() + r#"    "c0": UpsampleCoords(coords: "c1"),"#),
        &["these coordinates lie on a surface", "connect the IndirectionMap of StartCoords"],
    );
    let other = r#"    "other": IndirectionMap(atlas: "atlas", size: 80),
    "c0": CorrectCoords(coords: "c1", exemplar: "exemplar", surface: "other"),"#;
    refused(&(start.to_string() + other), &["50x50 coordinates at spacing 2, where the surface has 40x40 pixels"]);
    let given = start.replace("levels: 1", "levels: 1, coords: [(1, 2)]");
    refused(
        &(given + r#"    "c0": UpsampleCoords(coords: "c1", surface: "surface"),"#),
        &["1 coordinates; the surface's level has 50x50 pixels"],
    );
}

/// S-21: the texture ends at lines where combed directions turn, as at the end of the surface; a message gives the
/// length of these lines.
#[test]
fn ends_of_combed_directions_are_told_with_their_length() {
    let desk = Desk::new();
    let nodes = GROUND.replace("shape: Torus", "shape: Sphere").replace("from: Around", "from: Smooth, symmetry: 2")
        + r#"    "c0": SynthesizeSurface(exemplar: "exemplar", atlas: "atlas", frames: "flow", size: 100),
    "cut": IndirectionMap(atlas: "atlas", frames: "flow", size: 100, gutter: 2),
"#;
    write(&desk, &nodes);
    let ends = dump(&desk, "flow")["ends_mm"].as_f64().unwrap();
    assert!(ends > 5.0, "{ends}");
    let said = desk.shibo("render a.ron --no-cache").expect(0).stderr;
    assert!(said.contains(&format!("turn along {ends:.0} mm of lines")), "{said}");
    let listed = |node: &str| dump(&desk, node)["levels"][0]["jumps"].as_array().unwrap().len();
    assert!(listed("cut") < listed("surface"), "{} {}", listed("cut"), listed("surface"));
}
