//! Materials for other programs, end to end: documents, pictures, scripts. Whether these programs read them is tested by
//! `tests/readers/run`.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod support;

use image::DynamicImage;
use std::collections::BTreeSet;
use support::Desk;

/// A bump of 2 mm in the middle of 60 × 30 mm.
const GRAPH: &str = r##"(
  canvas: (size_mm: (60, 30), resolution: (64, 32), tile: TILE, seed: 3),
  nodes: {
    "height": Expression(formula: "2 * exp(-((x - 30) * (x - 30) + (y - 15) * (y - 15)) / 40)"),
    "rough": Remap(input: "height", from: (0, 2), to: (0.25, 0.75)),
    "metal": Remap(input: "height", from: (0, 2), to: (1, 0)),
    "normal": HeightToNormal(input: "height"),
    "open": Remap(input: "height", from: (0, 2), to: (0.5, 1)),
    "skin": Material(base_color: "#804020", roughness: "rough", metallic: "metal", normal: "normal", height: "height", ao: "open",
                     coat: 0.25, anisotropy: 0.5, anisotropy_angle: "height"),
  },
  outputs: OUTPUTS,
)"##;

fn desk(tile: &str, outputs: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("TILE", tile).replace("OUTPUTS", outputs));
    desk
}

/// The names of the files in a folder.
fn files(desk: &Desk, folder: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(desk.path(folder)).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

fn text(desk: &Desk, file: &str) -> String {
    std::fs::read_to_string(desk.path(file)).unwrap()
}

fn picture(desk: &Desk, file: &str) -> DynamicImage {
    image::open(desk.path(file)).unwrap()
}

/// The samples of a pixel, from 0 to 1.
fn pixel(picture: &DynamicImage, x: u32, y: u32) -> [f32; 4] {
    picture.to_rgba32f().get_pixel(x, y).0
}

#[test]
fn a_document_of_materialx_names_its_pictures() {
    let desk = desk(
        "Both",
        "{ \"m\": MaterialX(material: \"skin\"), \"s\": MaterialX(material: \"skin\", shading: StandardSurface) }",
    );
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    assert!(said.contains("no texture for the channel `ao`"), "{said}");
    let names = files(&desk, "out");
    for file in ["m.mtlx", "s.mtlx", "m_roughness.png", "m_metallic.png", "m_normal.png", "m_height.exr"] {
        assert!(names.contains(file), "{file}: {names:?}");
    }
    // What is the same everywhere is a number.
    assert!(!names.contains("m_coat.png") && !names.contains("m_base_color.png"), "{names:?}");
    let document = text(&desk, "out/m.mtlx");
    for part in [
        "version=\"1.39\"",
        "<open_pbr_surface name=\"m_surface\" type=\"surfaceshader\">",
        "name=\"realworldimagesize\" type=\"vector2\" value=\"0.06, 0.03\" unittype=\"distance\" unit=\"meter\"",
        "name=\"coat_weight\" type=\"float\" value=\"0.25\"",
        "value=\"m_height.exr\"",
        "name=\"scale\" type=\"float\" value=\"0.001\"",
        "<rotate3d name=\"tangent_turned\" type=\"vector3\">",
    ] {
        assert!(document.contains(part), "{part} is not in\n{document}");
    }
    let standard = text(&desk, "out/s.mtlx");
    assert!(standard.contains("<standard_surface ") && standard.contains("name=\"metalness\""), "{standard}");
    assert!(standard.contains("name=\"specular_rotation\"") && !standard.contains("geometry_tangent"), "{standard}");
}

/// Where the canvas ends, so does the picture: coordinates are scaled, and its top left lies at theirs.
#[test]
fn a_canvas_that_ends_is_shown_once_in_its_size() {
    let desk = desk("None", "{ \"m\": MaterialX(material: \"skin\"), \"u\": Usd(material: \"skin\") }");
    desk.shibo("render a.ron -o out -q").expect(0);
    let document = text(&desk, "out/m.mtlx");
    assert!(document.contains("name=\"in2\" type=\"vector2\" value=\"16.666667, 33.333333\""), "{document}");
    assert!(document.contains("name=\"uaddressmode\" type=\"string\" value=\"clamp\""), "{document}");
    let usd = text(&desk, "out/u.usda");
    for part in [
        "metersPerUnit = 1",
        "upAxis = \"Y\"",
        "float2 inputs:scale = (16.666667, 33.333333)",
        "float2 inputs:translation = (0, -32.333333)",
        "token inputs:wrapS = \"clamp\"",
        "float4 inputs:scale = (0.001, 0.001, 0.001, 1)",
        "uniform token info:id = \"ND_open_pbr_surface_surfaceshader\"",
        "asset inputs:file = @./u_roughness.png@",
    ] {
        assert!(usd.contains(part), "{part} is not in\n{usd}");
    }
}

/// The light falls on the right side: the slope above the middle of a bump leans up on the canvas, so its normal has a
/// positive y, which Unreal stores turned over.
#[test]
fn each_program_gets_its_own_normals_and_packing() {
    let targets = ["Unreal", "Unity", "Godot", "Blender", "Arnold", "RenderMan"];
    let outputs: Vec<String> =
        targets.iter().map(|t| format!("\"{}\": Preset(material: \"skin\", target: {t})", t.to_lowercase())).collect();
    let desk = desk("Both", &format!("{{ {} }}", outputs.join(", ")));
    desk.shibo("render a.ron -o out -q").expect(0);
    let (x, above) = (32, 13);
    let green = |file: &str| pixel(&picture(&desk, file), x, above)[1];
    assert!(green("out/godot_normal.png") > 0.57 && green("out/blender_normal.png") > 0.57);
    assert!((green("out/godot_normal.png") + green("out/unreal_Normal.png") - 1.0).abs() < 1e-3);
    assert!((green("out/godot_normal.png") - green("out/unity_NormalMap.png")).abs() < 1e-4);
    let rough = pixel(&picture(&desk, "out/godot_roughness.png"), x, 15)[0];
    let [ao, orm, metal, _] = pixel(&picture(&desk, "out/unreal_ORM.png"), x, 15);
    assert!((orm - rough).abs() < 1e-3 && ao > 0.9 && metal < 0.1, "{ao} {orm} {metal}");
    let mask = pixel(&picture(&desk, "out/unity_MaskMap.png"), x, 15);
    let want = [metal, ao, 1.0, 1.0 - rough];
    assert!(mask.iter().zip(want).all(|(a, b)| (a - b).abs() < 0.005), "{mask:?} {want:?}");
    let names = files(&desk, "out");
    for file in ["unreal_unreal.py", "blender_blender.py", "arnold_specular_roughness.exr", "renderman_bumpNormal.exr"]
    {
        assert!(names.contains(file), "{file}: {names:?}");
    }
    let script = text(&desk, "out/blender_blender.py");
    assert!(script.contains("(16.666667, 33.333333, 1.0)") && !script.contains('@'), "{script}");
    // Renderers take colours and normals as linear floats.
    let image = exr::prelude::read_first_flat_layer_from_file(desk.path("out/arnold_normal.exr")).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let stored =
        channels.iter().find(|c| c.name.eq("G")).unwrap().sample_data.value_by_flat_index((above * 64 + x) as usize);
    assert!((stored.to_f32() - green("out/godot_normal.png")).abs() < 1e-3, "{stored:?}");
}

#[test]
fn fields_are_packed_into_one_picture() {
    let desk = desk("Both", "{ \"p\": Pack(r: \"rough\", b: \"metal\", a: \"open\") }");
    desk.shibo("render a.ron -o out -q").expect(0);
    let packed = picture(&desk, "out/p.png");
    let [r, g, b, a] = pixel(&packed, 32, 15);
    assert!((r - 0.75).abs() < 0.02 && g == 0.0 && b < 0.05 && a > 0.95, "{r} {g} {b} {a}");
    let [r, _, b, a] = pixel(&packed, 0, 0);
    assert!((r - 0.25).abs() < 0.01 && b > 0.98 && (a - 0.5).abs() < 0.01, "{r} {b} {a}");
}

/// Any graph with a material can be exported without being edited.
#[test]
fn as_writes_the_materials_of_any_graph() {
    let desk = desk("Both", "{ \"m\": \"skin\", \"same\": \"skin\", \"h\": \"height\" }");
    desk.shibo("render a.ron -o out -q --as usd").expect(0);
    let names = files(&desk, "out");
    assert!(names.contains("m.usda") && names.contains("m_roughness.png"), "{names:?}");
    assert!(!names.iter().any(|name| name.starts_with("same") || name.starts_with('h')), "{names:?}");
    // Every file that was written is told, and a second run makes the same.
    let said = desk.shibo("render a.ron -o out --as usd").expect(0).stderr;
    assert_eq!(said.matches("wrote ").count(), names.len(), "{said}");
    desk.write("b.ron", "(canvas: (size_mm: 10), nodes: { \"n\": Perlin() }, outputs: { \"n\": \"n\" })");
    let error = desk.shibo("render b.ron --as gltf").expect(2).stderr;
    assert!(error.contains("no output that is a material"), "{error}");
}

#[test]
fn mistakes_are_told_at_their_places() {
    let desk = desk(
        "Both",
        "{ \"a\": MaterialX(material: \"rough\"), \"b\": Preset(material: \"skin\", target: Unreall), \"c\": Preset(material: \"skin\"), \
         \"d\": Pack(r: \"normal\"), \"e\": Pack(), \"f\": Usd(mesh: \"skin\", material: \"skin\"), \"g\": Usd(), \
         \"h\": MaterialX(material: \"skin\"), \"h_roughness\": \"rough\" }",
    );
    let error = desk.shibo("check a.ron").expect(1).stderr;
    for part in [
        "`MaterialX` takes a material; `rough` is Gray",
        "there is no target `Unreall`",
        "did you mean `Unreal`?",
        "`Preset` has no `target`",
        "`Pack` takes fields of one number each; `normal` is Normal",
        "`Pack` has no field",
        "`mesh` must be an atlas; `skin` is Material",
        "`Usd` has no `material`",
        "`h_roughness` would overwrite a file of the output `h`",
    ] {
        assert!(error.contains(part), "{part} is not in\n{error}");
    }
}

/// A name that is taken by a folder stops the export; no picture of it is there then.
#[test]
fn an_export_that_fails_leaves_nothing() {
    let desk = desk("Both", "{ \"m\": MaterialX(material: \"skin\") }");
    std::fs::create_dir_all(desk.path("out/m.mtlx")).unwrap();
    desk.shibo("render a.ron -o out").expect(1);
    assert_eq!(files(&desk, "out").into_iter().collect::<Vec<_>>(), ["m.mtlx"]);
    let error = desk.shibo("render a.ron -o out --region 0,0,8,8").expect(2).stderr;
    assert!(error.contains("whole pictures"), "{error}");
}
