//! Directions of anisotropy in files for other programs: highlights stretch across brush lines there too, for numbers
//! and pictures.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::export::text;
use crate::support::Desk;
use serde_json::Value as Json;
use std::f32::consts::FRAC_PI_2;

/// A material with `ANISOTROPY` on 60 pixels of one millimetre.
const GRAPH: &str = r#"(
  canvas: (size_mm: (60, 4), resolution: (60, 4), tile: None),
  nodes: {
    "angle": "= 3 * x - 90",
    "m": Material(metallic: 1, ANISOTROPY),
  },
  outputs: {
    "g": Gltf(material: "m", embed: false), "x": MaterialX(material: "m"), "s": MaterialX(material: "m", shading: StandardSurface),
    "u": Usd(material: "m"), "o": Obj(material: "m"), "b": Preset(material: "m", target: Blender),
    "ue": Preset(material: "m", target: Unreal), "un": Preset(material: "m", target: Unity), "gd": Preset(material: "m", target: Godot),
  },
)"#;

fn written(anisotropy: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("ANISOTROPY", anisotropy));
    desk.shibo("render a.ron -o out -q").expect(0);
    desk
}

/// The anisotropy in the glTF file.
fn gltf(desk: &Desk, file: &str) -> Json {
    let document: Json = serde_json::from_str(&text(desk, file)).unwrap();
    document["materials"][0]["extensions"]["KHR_materials_anisotropy"].clone()
}

/// The vector stored in red and green, and the other two channels.
fn vector(desk: &Desk, file: &str, x: u32) -> [f32; 4] {
    let [r, g, b, a] = image::open(desk.path(file)).unwrap().to_rgba32f().get_pixel(x, 2).0;
    [2.0 * r - 1.0, 2.0 * g - 1.0, b, a]
}

#[track_caller]
fn has(text: &str, part: &str) {
    assert!(text.contains(part), "{part} is not in\n{text}");
}

#[test]
fn converts_an_angle_that_is_a_number() {
    // Brush lines fall to the right by 30°, so highlights rise to the right by 60°.
    let desk = written("anisotropy: 0.5, anisotropy_angle: 30");
    let said = gltf(&desk, "out/g.gltf");
    assert_eq!(said["anisotropyStrength"], 0.5);
    assert!((said["anisotropyRotation"].as_f64().unwrap() - 60.0_f64.to_radians()).abs() < 1e-9, "{said}");
    has(&text(&desk, "out/x.mtlx"), "name=\"amount\" type=\"float\" value=\"120\"");
    has(&text(&desk, "out/s.mtlx"), "name=\"specular_rotation\" type=\"float\" value=\"0.333333\"");
    has(&text(&desk, "out/u.usda"), "float inputs:amount = 120\n");
    has(&text(&desk, "out/o.mtl"), "aniso 0.5\nanisor 0.166667\n");
    let script = text(&desk, "out/b_blender.py");
    for part in [
        "\"Anisotropic Rotation\": (30,),",
        "value = (((90.0 - value[0]) / 360.0) % 1.0,)",
        "tangent.direction_type = \"UV_MAP\"",
        "links.new(tangent.outputs[\"Tangent\"], surface.inputs[\"Tangent\"])",
    ] {
        has(&script, part);
    }
}

#[test]
fn converts_an_angle_that_is_a_picture() {
    let desk = written("anisotropy: 0.5, anisotropy_angle: \"angle\"");
    for x in [4, 30, 47] {
        let angle = (3.0 * (x as f32 + 0.5) - 90.0).to_radians();
        // Across the brush lines, y up.
        let [right, up] = [angle.sin(), angle.cos()];
        let [u, v, strength, _] = vector(&desk, "out/g_anisotropy.png", x);
        assert!((u - right).abs() < 0.01 && (v - up).abs() < 0.01 && (strength - 0.5).abs() < 0.01, "{x}: {u} {v}");
        let [u, v, _, strength] = vector(&desk, "out/gd_flow.png", x);
        assert!((u - right).abs() < 0.01 && (v - up).abs() < 0.01 && (strength - 0.5).abs() < 0.01, "{x}: {u} {v}");
        let [u, v, level, _] = vector(&desk, "out/un_TangentMap.png", x);
        assert!((u - right).abs() < 1e-3 && (v - up).abs() < 1e-3 && (level - 0.5).abs() < 1e-3, "{x}: {u} {v}");
        let [u, v, ..] = vector(&desk, "out/ue_Tangent.png", x);
        assert!((u - right).abs() < 1e-3 && (v + up).abs() < 1e-3, "{x}: {u} {v}");
    }
    assert_eq!(gltf(&desk, "out/g.gltf")["anisotropyRotation"], Json::Null, "the texture says all");
    let turned = "<add name=\"turn\" type=\"float\">\n      <input name=\"in1\" type=\"float\" nodename=\"anisotropy_angle\"/>\n      \
                  <input name=\"in2\" type=\"float\" value=\"90\"/>";
    let open = text(&desk, "out/x.mtlx");
    has(&open, turned);
    has(&open, "name=\"amount\" type=\"float\" nodename=\"turn\"");
    let standard = text(&desk, "out/s.mtlx");
    has(&standard, turned);
    has(
        &standard,
        "<input name=\"in1\" type=\"float\" nodename=\"turn\"/>\n      <input name=\"in2\" type=\"float\" value=\"0.002778\"/>",
    );
    let usd = text(&desk, "out/u.usda");
    has(&usd, "uniform token info:id = \"ND_add_float\"");
    has(&usd, "float inputs:in2 = 90\n");
    let script = text(&desk, "out/b_blender.py");
    has(&script, "turn.operation = \"MULTIPLY_ADD\"");
    has(&script, "turn.inputs[2].default_value = 90.0 / 360.0");
    has(&text(&desk, "out/ue_unreal.py"), "(\"ue_Tangent.png\", \"normal\")");
}

/// Without an angle, brush lines run along x; other programs assume another direction.
#[test]
fn states_the_angle_of_a_material_without_one() {
    let desk = written("anisotropy: 0.5");
    let said = gltf(&desk, "out/g.gltf");
    assert!((said["anisotropyRotation"].as_f64().unwrap() - f64::from(FRAC_PI_2)).abs() < 1e-6, "{said}");
    has(&text(&desk, "out/x.mtlx"), "name=\"amount\" type=\"float\" value=\"90\"");
    has(&text(&desk, "out/s.mtlx"), "name=\"specular_rotation\" type=\"float\" value=\"0.25\"");
    has(&text(&desk, "out/o.mtl"), "anisor 0.25\n");
    has(&text(&desk, "out/b_blender.py"), "\"Anisotropic Rotation\": (0,),");
    for (file, up) in [("out/gd_flow.png", 1.0), ("out/un_TangentMap.png", 1.0), ("out/ue_Tangent.png", -1.0)] {
        let [u, v, ..] = vector(&desk, file, 9);
        assert!(u.abs() < 0.01 && (v - up).abs() < 0.01, "{file}: {u} {v}");
    }
    let plain = written("roughness: 0.5");
    assert!(!text(&plain, "out/x.mtlx").contains("rotate3d") && !text(&plain, "out/o.mtl").contains("aniso"));
    assert_eq!(gltf(&plain, "out/g.gltf"), Json::Null);
}

/// The shipped woods have highlights across their fibres.
#[test]
fn woods_shine_across_their_fibres() {
    let desk = Desk::new();
    let graph = concat!(env!("CARGO_MANIFEST_DIR"), "/graphs/oak.ron");
    let render = |target: &str, out: &str| {
        desk.run(["render", graph, "--as", target, "--resolution", "48", "--out", out, "-q"]).expect(0);
        desk.names(out)
    };
    let one = |names: &[String], end: &str| names.iter().find(|name| name.ends_with(end)).unwrap().clone();
    let angles = one(&render("blender", "b"), "_anisotropy_angle.exr");
    let angles = exr::prelude::read_first_flat_layer_from_file(desk.path(format!("b/{angles}"))).unwrap();
    let angles: Vec<f32> = angles.layer_data.channel_data.list[0].sample_data.values_as_f32().collect();
    let vectors = one(&render("gltf-files", "g"), "_anisotropy.png");
    let vectors = image::open(desk.path(format!("g/{vectors}"))).unwrap().to_rgba32f();
    assert_eq!(vectors.pixels().len(), angles.len());
    for (pixel, angle) in vectors.pixels().zip(angles) {
        // Component of the vector along the fibres, y up.
        let (right, down) = (angle.to_radians().cos(), angle.to_radians().sin());
        let along = (2.0 * pixel.0[0] - 1.0) * right - (2.0 * pixel.0[1] - 1.0) * down;
        assert!(along.abs() < 0.02, "{pixel:?} along {angle}°");
    }
}
