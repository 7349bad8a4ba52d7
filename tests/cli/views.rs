//! Materials on shapes, and light from a panorama.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, samples};

/// A glazed material, a colour, and a lit picture.
const GLAZED: &str = r##"(
  version: 1,
  canvas: (size_mm: 20, resolution: 48, tile: Both, seed: 1),
  params: { "color": Color(default: "#1d4b52") },
  presets: { "red": { "color": "#8a1d1d" } },
  nodes: {
    "bumps": Perlin(size: 6),
    "glazed": Material(base_color: "$color", height: "= bumps * 0.2", roughness: 0.2),
    "lit": Relief(material: "glazed", environment: Studio),
  },
  outputs: { "glazed": "glazed", "lit": "lit" },
)"##;

#[test]
fn shapes_show_every_material() {
    let desk = Desk::new();
    desk.write("a.ron", GLAZED);
    for shape in ["ball", "cube", "plane"] {
        desk.shibo(&format!("render a.ron --view {shape} -o {shape}")).expect(0);
        assert_eq!(desk.names(shape), [format!("glazed_{shape}.png")]);
        let (width, pixels) = samples(&desk.path(format!("{shape}/glazed_{shape}.png")));
        assert_eq!(width, 48);
        assert!(pixels.iter().max() > pixels.iter().min());
    }
    // Light, presets and the named output change the picture or choose it.
    desk.shibo("render a.ron --view ball --environment sky --output glazed -o sky").expect(0);
    desk.shibo("render a.ron --view ball --preset red -o red").expect(0);
    let ball = desk.read("ball/glazed_ball.png");
    assert!(ball != desk.read("sky/glazed_ball.png") && ball != desk.read("red/glazed_ball.png"));
    // Sheets take shapes, too.
    desk.shibo("render a.ron --view ball --sweep preset=red --sheet sheet.png -o sweep").expect(0);
    assert!(samples(&desk.path("sweep/sheet.png")).0 > 48);
}

#[test]
fn views_without_a_material_tell_the_remedy() {
    let desk = Desk::new();
    desk.write("a.ron", GLAZED);
    let err = desk.shibo("render a.ron --view ball --output lit").expect(2).stderr;
    assert!(err.contains("no output `lit` has that name and is a material"), "{err}");
    let err = desk.shibo("render a.ron --environment sky").expect(2).stderr;
    assert!(err.contains("--view"), "{err}");
}

/// A half of the bowl is red. Its picture on the mesh shows both halves, and the backdrop.
#[test]
fn mesh_of_the_graph_shows_its_material() {
    let desk = Desk::new();
    desk.write(
        "bowl.ron",
        r##"(
  version: 1,
  canvas: (size_mm: 100, resolution: 64, tile: None),
  nodes: {
    "ball": MeshShape(shape: Sphere),
    "atlas": MeshAtlas(mesh: "ball"),
    "place": BakePosition(atlas: "atlas"),
    "half": Material(base_color: "= if(place.b > 0, (0.7, 0.02, 0.02), (0.02, 0.02, 0.7))"),
    "painted": DilateGutter(input: "half", atlas: "atlas"),
  },
  outputs: { "painted": "painted", "ball": Gltf(material: "painted", mesh: "atlas") },
)"##,
    );
    desk.shibo("render bowl.ron --view mesh -o out").expect(0);
    assert_eq!(desk.names("out"), ["painted_mesh.png"]);
    let (width, pixels) = samples(&desk.path("out/painted_mesh.png"));
    let at = |x: usize, y: usize| pixels[y * width + x];
    let (top, bottom, corner) = (at(32, 14), at(32, 50), at(1, 1));
    assert!(top[0] > 3 * top[2], "{top:?}");
    assert!(bottom[2] > 3 * bottom[0], "{bottom:?}");
    assert!(corner[0].abs_diff(corner[2]) < 800, "{corner:?}");
    // A graph without a mesh names the remedy.
    desk.write("a.ron", GLAZED);
    let err = desk.shibo("render a.ron --view mesh").expect(2).stderr;
    assert!(err.contains("no output of the graph has a mesh") && err.contains("Gltf"), "{err}");
}

/// A panorama that is bright at the right lights slopes that face the right.
#[test]
fn panorama_lights_the_surface() {
    let desk = Desk::new();
    let sky = r#"(
      version: 1,
      canvas: (size_mm: (64, 32), resolution: (64, 32), tile: None, seed: 1),
      nodes: { "sky": "= step(36, x) * 3 + 0.05" },
      outputs: { "sky": File(from: "sky", format: Exr) },
    )"#;
    desk.write("sky.ron", sky);
    desk.shibo("render sky.ron -o .").expect(0);
    let lit =
        |file: &str| GLAZED.replace("environment: Studio", &format!("panorama: {file:?}, tone: Linear, exposure: 0.3"));
    desk.write("b.ron", lit("sky.exr"));
    desk.shibo("render b.ron --output lit -o lit").expect(0);
    let (_, pixels) = samples(&desk.path("lit/lit.png"));
    assert!(pixels.iter().max() > pixels.iter().min());
    // A picture of another shape is an error at the parameter; so is a missing file.
    desk.write("wide.ron", sky.replace("(64, 32)", "(64, 16)"));
    desk.shibo("render wide.ron -o wide").expect(0);
    desk.write("c.ron", lit("wide/sky.exr"));
    let err = desk.shibo("render c.ron --output lit").expect(1).stderr;
    assert!(err.contains("twice as wide as high") && err.contains("c.ron:9"), "{err}");
    desk.write("d.ron", lit("missing.exr"));
    let err = desk.shibo("check d.ron").expect(1).stderr;
    assert!(err.contains("missing.exr") && err.contains("d.ron:9"), "{err}");
}
