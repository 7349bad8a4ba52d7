//! Materials for other programs, end to end: documents, pictures, scripts. `tests/readers/run` checks that the programs
//! read them.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use image::DynamicImage;
use std::collections::BTreeSet;

/// A bump of 2 mm in the middle of 60 × 30 mm.
pub(crate) const GRAPH: &str = r##"(
  canvas: (size_mm: (60, 30), resolution: (64, 32), tile: TILE, seed: 3),
  nodes: {
    "height": "= 2 * exp(-((x - 30) * (x - 30) + (y - 15) * (y - 15)) / 40)",
    "rough": Remap(input: "height", from: (0, 2), to: (0.25, 0.75)),
    "metal": Remap(input: "height", from: (0, 2), to: (1, 0)),
    "normal": HeightToNormal(input: "height"),
    "open": Remap(input: "height", from: (0, 2), to: (0.5, 1)),
    "skin": Material(base_color: "#804020", roughness: "rough", metallic: "metal", normal: "normal", height: "height", ao: "open",
                     coat: 0.25, anisotropy: 0.5, anisotropy_angle: "height"),
  },
  outputs: OUTPUTS,
)"##;

pub(crate) fn desk(tile: &str, outputs: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("TILE", tile).replace("OUTPUTS", outputs));
    desk
}

/// The names of the files in a folder.
pub(crate) fn files(desk: &Desk, folder: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(desk.path(folder)).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

pub(crate) fn text(desk: &Desk, file: &str) -> String {
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
    // A constant channel is a number.
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

/// A canvas that does not tile shows once: coordinates are scaled, and its top left corner keeps its place.
#[test]
fn shows_non_tiling_canvas_once_at_real_size() {
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

/// Above the middle of a bump the slope leans towards the top of the canvas, so its normal has a positive y; Unreal
/// stores y flipped.
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
    // Godot reads the roughness of the coat from green, and the strength of anisotropy from opacity. Brush lines run
    // nearly along x, so highlights stretch along y.
    let coat = pixel(&picture(&desk, "out/godot_clearcoat.png"), x, 15);
    let flow = pixel(&picture(&desk, "out/godot_flow.png"), x, 15);
    assert!((coat[0] - 0.25).abs() < 0.01 && coat[1] < 0.1 && coat[3] > 0.99, "{coat:?}");
    assert!((flow[0] - 0.52).abs() < 0.02 && flow[1] > 0.99 && (flow[3] - 0.5).abs() < 0.01, "{flow:?}");
    let names = files(&desk, "out");
    for file in ["unreal_unreal.py", "blender_blender.py", "arnold_specular_roughness.exr", "renderman_bumpNormal.exr"]
    {
        assert!(names.contains(file), "{file}: {names:?}");
    }
    let script = text(&desk, "out/blender_blender.py");
    assert!(script.contains("(16.666667, 33.333333, 1.0)") && !script.contains('@'), "{script}");
    // Renderers read colours and normals as linear floats.
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

/// The key of a pack depends on each of its fields: a cached picture is not used after a change of the last one.
#[test]
fn packs_are_made_again_after_a_change_of_any_field() {
    let outputs = "{ \"p\": Pack(r: \"rough\", b: \"metal\") }";
    let desk = desk("Both", outputs);
    let blue = || {
        desk.shibo("render a.ron -o out -q").expect(0);
        pixel(&picture(&desk, "out/p.png"), 32, 15)[2]
    };
    assert!(blue() < 0.05);
    let changed = GRAPH.replace("to: (1, 0)", "to: (0, 1)");
    desk.write("a.ron", changed.replace("TILE", "Both").replace("OUTPUTS", outputs));
    assert!(blue() > 0.95);
}

/// Every graph with a material can be exported without an edit.
#[test]
fn exports_materials_of_any_graph() {
    let desk = desk("Both", "{ \"m\": \"skin\", \"same\": \"skin\", \"h\": \"height\" }");
    desk.shibo("render a.ron -o out -q --as usd").expect(0);
    let names = files(&desk, "out");
    assert!(names.contains("m.usda") && names.contains("m_roughness.png"), "{names:?}");
    assert!(!names.iter().any(|name| name.starts_with("same") || name.starts_with('h')), "{names:?}");
    // Every written file is listed, and a second run writes the same files.
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
         \"h\": MaterialX(material: \"skin\"), \"h_roughness\": \"rough\", \"i\": Usd(material: \"skin\", packed: 1), \
         \"j\": Usd(material: \"skin\", packed: true), \"j_roughness\": \"rough\" }",
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
        "`packed` must be one of `true`, `false`",
    ] {
        assert!(error.contains(part), "{part} is not in\n{error}");
    }
    assert!(!error.contains("`j_roughness` would"), "the pictures of a USDZ lie in it: {error}");
}

/// A folder in the place of the document stops the export, and no picture is left.
#[test]
fn an_export_that_fails_leaves_nothing() {
    let desk = desk("Both", "{ \"m\": MaterialX(material: \"skin\") }");
    std::fs::create_dir_all(desk.path("out/m.mtlx")).unwrap();
    desk.shibo("render a.ron -o out").expect(1);
    assert_eq!(files(&desk, "out").into_iter().collect::<Vec<_>>(), ["m.mtlx"]);
    let error = desk.shibo("render a.ron -o out --region 0,0,8,8").expect(2).stderr;
    assert!(error.contains("whole pictures"), "{error}");
}

/// The samples of a channel in an EXR, level by level.
fn levels(desk: &Desk, file: &str, channel: &str) -> Vec<Vec<f32>> {
    use exr::prelude::*;
    let reader = read().no_deep_data().all_resolution_levels().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_file(desk.path(file)).unwrap();
    let list = &image.layer_data.channel_data.list;
    let found =
        list.iter().find(|c| c.name.to_string() == channel).unwrap_or_else(|| panic!("{file} has no {channel}"));
    found.sample_data.levels_as_slice().iter().map(|level| level.values_as_f32().collect()).collect()
}

#[test]
fn mip_levels_widen_roughness() {
    let outputs = r#"{
        "m": File(from: "skin", format: Exr, depth: F32, mip: true),
        "kept": File(from: "skin", format: Exr, depth: F32, mip: true, widen_roughness: false),
        "one": File(from: "skin", format: Exr, depth: F32, mip: true, combined: true),
        "flat": File(from: "skin", format: Exr, depth: F32),
        "plain": File(from: "rough", mip: true),
    }"#;
    let desk = desk("Both", outputs);
    desk.shibo("render a.ron -o out").expect(0);
    let flat = levels(&desk, "out/flat_roughness.exr", "Y");
    assert_eq!(flat.len(), 1);
    let wide = levels(&desk, "out/m_roughness.exr", "Y");
    let kept = levels(&desk, "out/kept_roughness.exr", "Y");
    // 64 × 32, …, 1 × 1.
    assert_eq!(wide.iter().map(Vec::len).collect::<Vec<_>>(), [2048, 512, 128, 32, 8, 2, 1]);
    assert_eq!((&wide[0], &kept[0]), (&flat[0], &flat[0]), "the picture itself is the same");
    let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
    assert!((kept[6][0] - mean(&flat[0])).abs() < 1e-5);
    // Normals are averaged: alpha² grows by half the variance of the slopes.
    let normal: Vec<Vec<f32>> = ["R", "G", "B"].map(|c| levels(&desk, "out/flat_normal.exr", c).remove(0)).into();
    let slope =
        |c: usize| (0..2048).map(|i| (2.0 * normal[c][i] - 1.0) / (2.0 * normal[2][i] - 1.0)).collect::<Vec<f32>>();
    let (x, y) = (slope(0), slope(1));
    let square = mean(&x.iter().zip(&y).map(|(x, y)| x * x + y * y).collect::<Vec<_>>());
    let lost = square - mean(&x).powi(2) - mean(&y).powi(2);
    let expected = (mean(&flat[0].iter().map(|r| r.powi(4)).collect::<Vec<_>>()) + 0.5 * lost).powf(0.25).min(1.0);
    assert!((wide[6][0] - expected).abs() < 1e-4, "{} instead of {expected}", wide[6][0]);
    // The combined file has the same channels.
    assert_eq!(levels(&desk, "out/one.exr", "roughness"), wide);
    let normals: Vec<Vec<Vec<f32>>> =
        ["X", "Y", "Z"].map(|c| levels(&desk, "out/one.exr", &format!("normal.{c}"))).into();
    for level in 0..7 {
        for i in 0..normals[0][level].len() {
            let length: f32 = normals.iter().map(|plane| (2.0 * plane[level][i] - 1.0).powi(2)).sum();
            assert!((length - 1.0).abs() < 1e-4, "level {level}: {length}");
        }
    }
    assert_eq!(levels(&desk, "out/plain.exr", "Y").len(), 7, "a file with levels is an EXR");

    let said = desk.shibo("render a.ron -o arnold --as arnold").expect(0);
    assert!(said.stderr.contains("ao"), "{}", said.stderr);
    let rough = levels(&desk, "arnold/m_specular_roughness.exr", "Y");
    assert_eq!(rough.len(), 7);
    assert!(rough[6][0] > kept[6][0] + 0.005, "{} and {}", rough[6][0], kept[6][0]);
}

#[test]
fn colours_and_normals_are_stored_as_asked_for() {
    let outputs = r#"{
        "gl": File(from: "skin", format: Png),
        "dx": File(from: "skin", format: Png, normal: DirectX),
        "aces": File(from: "skin", format: Exr, depth: F32, color_space: AcesCg),
        "light": File(from: "skin", format: Png, depth: U16, color_space: LinearRec709),
    }"#;
    let desk = desk("Both", outputs);
    desk.shibo(
        "render a.ron -o out --output gl.normal --output dx.normal --output aces.base_color --output light.base_color",
    )
    .expect(0);
    let (up, down) = (picture(&desk, "out/gl_normal.png"), picture(&desk, "out/dx_normal.png"));
    for (x, y) in [(30, 10), (33, 20), (20, 15)] {
        let (up, down) = (pixel(&up, x, y), pixel(&down, x, y));
        assert!((up[1] + down[1] - 1.0).abs() < 1e-4 && up[0] == down[0] && up[2] == down[2], "{up:?} {down:?}");
    }
    assert!((pixel(&up, 32, 10)[1] - pixel(&down, 32, 10)[1]).abs() > 0.05, "above the bump it faces up");
    // #804020 in linear light.
    let linear = [0.215_86, 0.051_27, 0.014_44];
    let light = pixel(&picture(&desk, "out/light_base_color.png"), 3, 3);
    assert!((0..3).all(|c| (light[c] - linear[c]).abs() < 1e-3), "{light:?}");
    // The rows of the matrix of S-2014-004, multiplied by hand.
    let aces = ["R", "G", "B"].map(|c| levels(&desk, "out/aces_base_color.exr", c)[0][0]);
    let expected = [0.150_44, 0.062_33, 0.022_63];
    assert!((0..3).all(|c| (aces[c] - expected[c]).abs() < 2e-4), "{aces:?}");
    use exr::prelude::*;
    let meta = MetaData::read_from_file(desk.path("out/aces_base_color.exr"), false).unwrap();
    let primaries = meta.headers[0].shared_attributes.chromaticities.unwrap();
    assert_eq!((primaries.red.0, primaries.white.1), (0.713, 0.337_67));

    // Reading the file gives the original values.
    desk.write("b.ron", r#"(canvas: (size_mm: 60, resolution: 8), nodes: { "i": Image(path: "out/aces_base_color.exr", color_space: AcesCg) },
        outputs: { "c": File(from: "i", format: Exr, depth: F32) })"#);
    desk.shibo("render b.ron -o out").expect(0);
    let back = ["R", "G", "B"].map(|c| levels(&desk, "out/c.exr", c)[0][0]);
    assert!((0..3).all(|c| (back[c] - linear[c]).abs() < 2e-4), "{back:?}");
}

/// The entries of a USDZ: name, offset of the content, and content.
fn entries(desk: &Desk, file: &str) -> Vec<(String, u64, Vec<u8>)> {
    let mut package = zip::ZipArchive::new(std::fs::File::open(desk.path(file)).unwrap()).unwrap();
    let count = package.len();
    let entry = |index| {
        let mut entry = package.by_index(index).unwrap();
        assert_eq!(entry.compression(), zip::CompressionMethod::Stored);
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
        (entry.name().unwrap().into_owned(), entry.data_start().unwrap(), content)
    };
    (0..count).map(entry).collect()
}

#[test]
fn a_usdz_holds_the_stage_and_its_pictures() {
    let outputs = r#"{ "u": Usd(material: "skin", packed: true), "v": Usd(material: "skin", packed: false) }"#;
    let desk = desk("Both", outputs);
    let render = |how: &str| {
        desk.shibo(&format!("render a.ron -o out {how}")).expect(0);
        std::fs::read(desk.path("out/u.usdz")).unwrap()
    };
    let first = render("--no-cache --threads 1");
    assert_eq!(first, render("--cache-dir cache"));
    assert_eq!(first, render("--cache-dir cache"), "from the cache");
    let entries = entries(&desk, "out/u.usdz");
    let names: Vec<&str> = entries.iter().map(|(name, ..)| name.as_str()).collect();
    let mut apart = files(&desk, "out");
    apart.retain(|name| name.starts_with("v"));
    assert_eq!(names[0], "u.usda");
    assert_eq!(names.iter().map(|name| name.replacen('u', "v", 1)).collect::<BTreeSet<_>>(), apart);
    for (name, at, content) in &entries {
        assert_eq!(at % 64, 0, "{name}");
        if !name.ends_with("usda") {
            let beside = std::fs::read(desk.path(format!("out/{}", name.replacen('u', "v", 1)))).unwrap();
            assert_eq!(*content, beside, "{name}");
        }
    }
    // The name of the output is part of the document, so another name is no hit in the cache.
    desk.write("b.ron", text(&desk, "a.ron").replace("\"u\":", "\"w\":"));
    desk.shibo("render b.ron -o out --cache-dir cache --output w").expect(0);
    assert_eq!(self::entries(&desk, "out/w.usdz")[0].0, "w.usda");
    desk.shibo("render a.ron -o as --as usdz --output v -q").expect(0);
    assert_eq!(files(&desk, "as").into_iter().collect::<Vec<_>>(), ["v.usdz"]);
}

#[test]
fn simple_shapes_wear_a_material() {
    let outputs = r#"{ "a": Gltf(material: "skin", mesh: Sphere), "b": Gltf(material: "skin", mesh: Cylinder),
        "c": Usd(material: "skin", mesh: Cube) }"#;
    let desk = desk("Both", outputs);
    desk.shibo("render a.ron -o out").expect(0);
    for (file, name) in [("out/a.glb", "sphere"), ("out/b.glb", "cylinder")] {
        let bytes = std::fs::read(desk.path(file)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains(&format!("\"name\":\"{name}\"")) && text.contains("KHR_texture_transform"), "{file}");
    }
    let usd = text(&desk, "out/c.usda");
    assert!(usd.contains("def Mesh \"cube\"") && usd.contains("UsdTransform2d"), "{usd}");
}

#[test]
#[cfg(unix)]
fn an_interrupted_export_leaves_nothing_behind() {
    for target in ["gltf", "usd", "usdz", "materialx", "unreal", "arnold", "blender"] {
        let desk = desk("Both", r#"{ "m": "skin" }"#);
        desk.shibo(&format!("render a.ron --as {target} -o out")).expect(0);
        let before = files(&desk, "out");
        let contents: Vec<Vec<u8>> =
            before.iter().map(|file| std::fs::read(desk.path(format!("out/{file}"))).unwrap()).collect();
        let args = ["render", "a.ron", "--as", target, "--resolution", "16000", "--no-cache", "--compress", "best"];
        let mut command = desk.command(args);
        let mut child =
            command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap();
        let start = std::time::Instant::now();
        while !files(&desk, "out").iter().any(|name| name.ends_with(".tmp")) {
            assert!(start.elapsed() < std::time::Duration::from_secs(60), "{target}: nothing is written");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let code = child.wait().unwrap().code();
        let mut said = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
        assert_eq!(code, Some(1), "{target}: {said}");
        assert_eq!(files(&desk, "out"), before, "{target}");
        for (file, content) in before.iter().zip(contents) {
            assert_eq!(std::fs::read(desk.path(format!("out/{file}"))).unwrap(), content, "{target}: {file}");
        }
    }
}
