//! Materials on meshes as glTF, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use serde_json::{Value as Json, json};

/// The JSON document and the binary part of a GLB.
fn parts(glb: &[u8]) -> (Json, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&glb[..4], word(4), word(8)), (&b"glTF"[..], 2, glb.len()));
    let json = word(12);
    assert_eq!((&glb[16..20], json % 4), (&b"JSON"[..], 0));
    let binary = word(20 + json);
    assert_eq!((&glb[24 + json..28 + json], binary % 4, 28 + json + binary), (&b"BIN\0"[..], 0, glb.len()));
    (serde_json::from_slice(&glb[20..20 + json]).unwrap(), glb[28 + json..].to_vec())
}

fn number(json: &Json) -> usize {
    usize::try_from(json.as_u64().unwrap()).unwrap()
}

/// The bytes of a buffer view.
fn view(document: &Json, binary: &[u8], index: &Json) -> Vec<u8> {
    let view = &document["bufferViews"][number(index)];
    let [from, length] = ["byteOffset", "byteLength"].map(|key| number(&view[key]));
    binary[from..from + length].to_vec()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

/// The picture of a texture reference in the document.
fn picture(document: &Json, binary: &[u8], used: &Json) -> image::DynamicImage {
    let texture = &document["textures"][number(&used["index"])];
    let image = &document["images"][number(&texture["source"])];
    assert_eq!(image["mimeType"], "image/png");
    image::load_from_memory(&view(document, binary, &image["bufferView"])).unwrap()
}

const GRAPH: &str = r##"(
  canvas: (size_mm: (40, 20), resolution: (64, 32), tile: X, seed: 3),
  nodes: {
    "color": GradientMap(input: "lumps", stops: [(0, "#202020"), (1, "#e08040")]),
    "lumps": Perlin(size: 8),
    "rough": Remap(input: "lumps", to: (0.3, 0.7)),
    "normal": HeightToNormal(input: "lumps"),
    "skin": Material(base_color: "color", roughness: "rough", normal: "normal", coat: 0.25, MORE),
  },
  outputs: OUTPUTS,
)"##;

fn desk(more: &str, outputs: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("MORE", more).replace("OUTPUTS", outputs));
    desk
}

#[test]
fn a_material_becomes_a_file_with_its_textures() {
    let desk = desk("ao: \"rough\"", r#"{ "skin": Gltf(material: "skin"), "maps": "skin" }"#);
    desk.shibo("render a.ron -o out").expect(0);
    let (document, binary) = parts(&std::fs::read(desk.path("out/skin.glb")).unwrap());
    let material = &document["materials"][0];
    assert_eq!(document["asset"]["version"], "2.0");
    let base = &material["pbrMetallicRoughness"];
    // The same pictures as from an ordinary output, packed as glTF requires.
    let [color, rough, normal] = ["base_color", "roughness", "normal"]
        .map(|channel| image::open(desk.path(format!("out/maps_{channel}.png"))).unwrap());
    assert_eq!(picture(&document, &binary, &base["baseColorTexture"]).to_rgb8(), color.to_rgb8());
    let packed = picture(&document, &binary, &base["metallicRoughnessTexture"]).to_rgb8();
    for (packed, rough) in packed.pixels().zip(rough.to_luma8().pixels()) {
        assert_eq!(packed.0, [rough.0[0], rough.0[0], 0]);
    }
    assert_eq!(base["metallicFactor"], 0.0);
    assert_eq!(material["occlusionTexture"]["index"], base["metallicRoughnessTexture"]["index"]);
    let own = picture(&document, &binary, &material["normalTexture"]);
    assert_eq!(own.to_rgb16(), normal.to_rgb16());
    // A constant channel is a number.
    let coat = &material["extensions"]["KHR_materials_clearcoat"];
    assert_eq!(coat, &json!({ "clearcoatFactor": 0.25, "clearcoatRoughnessFactor": 0.0 }));
    // The plane is a metre wide: the canvas of 40 mm repeats 25 times, in x only.
    let transform = &base["baseColorTexture"]["extensions"]["KHR_texture_transform"];
    assert_eq!(transform, &json!({ "scale": [25.0, 50.0] }));
    let sampler = &document["samplers"][0];
    assert_eq!((&sampler["wrapS"], &sampler["wrapT"]), (&json!(10497), &json!(33071)));
    assert_eq!(document["extensionsUsed"], json!(["KHR_materials_clearcoat", "KHR_texture_transform"]));
    let positions = &document["accessors"][0];
    assert_eq!((&positions["min"], &positions["max"]), (&json!([-0.5, 0.0, -0.5]), &json!([0.5, 0.0, 0.5])));
    // The triangles face up.
    let at = floats(&view(&document, &binary, &json!(0)));
    let indices = view(&document, &binary, &json!(4));
    let corner: Vec<glam::Vec3> = indices
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes(b.try_into().unwrap()) as usize)
        .map(|i| glam::Vec3::from_slice(&at[3 * i..]))
        .collect();
    for triangle in corner.chunks_exact(3) {
        assert!((triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).y > 0.0);
    }
}

#[test]
fn repeats_glb_with_equal_bytes() {
    let desk = desk("", r#"{ "skin": Gltf(material: "skin", mesh: Plane) }"#);
    let render = |how: &str| {
        desk.shibo(&format!("render a.ron -o out {how}")).expect(0);
        std::fs::read(desk.path("out/skin.glb")).unwrap()
    };
    let first = render("--no-cache --threads 1");
    assert_eq!(first, render("--cache-dir cache"));
    assert_eq!(first, render("--cache-dir cache"));
    let left: Vec<_> = std::fs::read_dir(desk.path("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["skin.glb"]);
}

#[test]
fn reports_wrong_gltf_arguments_with_places() {
    for (output, code, words) in [
        (r#"Gltf(material: "lumps")"#, "type-mismatch", "`Gltf` takes a material; `lumps` is Gray"),
        (r#"Gltf(material: "skin", mesh: "lumps")"#, "type-mismatch", "`mesh` must be an atlas; `lumps` is Gray"),
        (r#"Gltf(material: "skin", mesh: "lump")"#, "unknown-node", "lump"),
        (r#"Gltf(material: "skin", mesh: Plan)"#, "unknown-variant", "there is no mesh `Plan`"),
        ("Gltf()", "missing-input", "`Gltf` has no `material`"),
        (r#"Gltf(material: "skin", meshes: Plane)"#, "unknown-field", "meshes"),
    ] {
        let desk = desk("", &format!("{{ \"skin\": {output} }}"));
        let checked = desk.shibo("check a.ron --format json").expect(1).json();
        let error = &checked["errors"][0];
        assert!(error["code"] == code && error["message"].as_str().unwrap().contains(words), "{output}: {error}");
        assert_eq!(error["line"], 10, "{error}");
    }
    let desk = desk("", r#"{ "skin": Gltf(material: "skin") }"#);
    let refused = desk.shibo("render a.ron --region 0,0,16,16").expect(2);
    assert!(refused.stderr.contains("whole pictures"), "{}", refused.stderr);
    // A channel without a place in the format is reported.
    let desk = self::desk("subsurface: 0.5", r#"{ "skin": Gltf(material: "skin") }"#);
    let told = desk.shibo("render a.ron -o out").expect(0);
    assert!(told.stderr.contains("no texture for the channel `subsurface`"), "{}", told.stderr);
}

/// The names of the files in a folder.
fn names(desk: &Desk, folder: &str) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(desk.path(folder))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn writes_gltf_with_separate_files() {
    let desk = desk("", r#"{ "skin": Gltf(material: "skin", embed: false), "one": Gltf(material: "skin") }"#);
    let told = desk.shibo("render a.ron -o out").expect(0).stderr;
    let files =
        ["skin.bin", "skin.gltf", "skin_base_color.png", "skin_normal.png", "skin_occlusion_roughness_metallic.png"];
    assert_eq!(names(&desk, "out"), [&["one.glb"], &files[..]].concat());
    assert!(files.iter().all(|file| told.contains(file)), "{told}");
    let document: Json = serde_json::from_slice(&std::fs::read(desk.path("out/skin.gltf")).unwrap()).unwrap();
    let (one, binary) = parts(&std::fs::read(desk.path("out/one.glb")).unwrap());
    assert_eq!(document["buffers"][0]["uri"], "skin.bin");
    let mesh = std::fs::read(desk.path("out/skin.bin")).unwrap();
    assert_eq!((number(&document["buffers"][0]["byteLength"]), &mesh[..]), (mesh.len(), &binary[..mesh.len()]));
    for (apart, within) in document["images"].as_array().unwrap().iter().zip(one["images"].as_array().unwrap()) {
        let file = std::fs::read(desk.path(format!("out/{}", apart["uri"].as_str().unwrap()))).unwrap();
        assert_eq!(file, view(&one, &binary, &within["bufferView"]), "{apart}");
    }
    let [apart, within] = [&document, &one].map(|document| &document["materials"][0]["pbrMetallicRoughness"]);
    assert_eq!(apart, within);

    // All files are written or none: here a folder occupies the name of the mesh.
    let before = std::fs::read(desk.path("out/skin.gltf")).unwrap();
    std::fs::remove_file(desk.path("out/skin.bin")).unwrap();
    std::fs::create_dir(desk.path("out/skin.bin")).unwrap();
    desk.write("a.ron", std::fs::read_to_string(desk.path("a.ron")).unwrap().replace("seed: 3", "seed: 4"));
    let pictures = || files.map(|file| std::fs::read(desk.path(format!("out/{file}"))).ok());
    let old = pictures();
    desk.shibo("render a.ron -o out --output skin").expect(1);
    assert_eq!((pictures(), std::fs::read(desk.path("out/skin.gltf")).unwrap()), (old, before));
    assert_eq!(names(&desk, "out").len(), 6);

    let desk = self::desk("", r#"{ "skin": "skin", "skin_ao": Gltf(material: "skin") }"#);
    desk.shibo("render a.ron -o out --as gltf-files -q --output skin").expect(0);
    assert_eq!(names(&desk, "out"), files);
}

#[test]
fn stores_only_colours_as_jpeg() {
    let outputs = r#"{ "skin": Gltf(material: "skin", colors: Jpeg), "low": Gltf(material: "skin", colors: Jpeg, quality: 5),
        "exact": Gltf(material: "skin"), "apart": Gltf(material: "skin", colors: Jpeg, embed: false),
        "usd": Usd(material: "skin", colors: Jpeg, quality: 100) }"#;
    let desk = desk("emission: \"color\"", outputs);
    desk.shibo("render a.ron -o out -q").expect(0);
    let [skin, low, exact] =
        ["skin", "low", "exact"].map(|name| parts(&std::fs::read(desk.path(format!("out/{name}.glb"))).unwrap()));
    let color = |(document, binary): &(Json, Vec<u8>)| {
        let index = number(&document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"]);
        let image = &document["images"][number(&document["textures"][index]["source"])];
        (image["mimeType"].as_str().unwrap().to_owned(), view(document, binary, &image["bufferView"]))
    };
    let [(kind, jpeg), (_, small), (exact_kind, png)] = [&skin, &low, &exact].map(color);
    assert_eq!((kind.as_str(), exact_kind.as_str()), ("image/jpeg", "image/png"));
    assert!(small.len() < jpeg.len(), "{} {}", small.len(), jpeg.len());
    let (jpeg, png) =
        (image::load_from_memory(&jpeg).unwrap().to_rgb8(), image::load_from_memory(&png).unwrap().to_rgb8());
    let far = jpeg.as_raw().iter().zip(png.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
    assert!(far / (png.len() as f64) < 3.0, "{far}");
    let kinds: Vec<&str> =
        skin.0["images"].as_array().unwrap().iter().map(|i| i["mimeType"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["image/jpeg", "image/png", "image/png", "image/jpeg"], "colour, surface, normal, emission");
    let names = names(&desk, "out");
    for file in
        ["apart_base_color.jpg", "apart_emission.jpg", "apart_normal.png", "usd_base_color.jpg", "usd_emission.jpg"]
    {
        assert!(names.iter().any(|name| name == file), "{file}: {names:?}");
    }
    let usd = std::fs::read_to_string(desk.path("out/usd.usda")).unwrap();
    assert!(usd.contains("asset inputs:file = @./usd_base_color.jpg@") && !usd.contains("base_color.png"), "{usd}");
    assert_eq!(usd.matches("colorSpace = \"srgb_texture\"").count(), 2, "{usd}");
    assert_eq!(usd.matches("sourceColorSpace = \"sRGB\"").count(), 2, "{usd}");

    // A picture with opacity stays PNG.
    let desk = self::desk("opacity: \"rough\"", r#"{ "skin": Gltf(material: "skin", colors: Jpeg) }"#);
    desk.shibo("render a.ron -o out -q").expect(0);
    let (document, _) = parts(&std::fs::read(desk.path("out/skin.glb")).unwrap());
    assert_eq!(document["images"][0]["mimeType"], "image/png");

    for (said, words) in [
        ("colors: Jpeg, quality: 0", "`quality` must be a number from 1 to 100"),
        ("colors: Jpeg, quality: 101", "`quality` must be a number from 1 to 100"),
        ("colors: Jpeg, quality: \"high\"", "`quality` must be a number from 1 to 100"),
        ("quality: 90", "`quality` is that of JPEG"),
        ("colors: Jpg", "there is no colors `Jpg`"),
        ("embed: 0", "`embed` must be one of `true`, `false`"),
    ] {
        let desk = self::desk("", &format!("{{ \"skin\": Gltf(material: \"skin\", {said}) }}"));
        let error = desk.shibo("check a.ron").expect(1).stderr;
        assert!(error.contains(words), "{said}: {error}");
    }
}
