//! Plates, rolls and meshes with a relief, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use std::collections::BTreeMap;

/// A graph with a relief of about 0.5 mm on a canvas of 8 mm.
fn graph(tile: &str, outputs: &str) -> String {
    format!(
        "(canvas: (size_mm: 8, resolution: 96, tile: {tile}, seed: 3),
          nodes: {{ \"waves\": Perlin(size: 2), \"h\": \"= 0.5 * waves\", \"m\": Material(height: \"h\"),
                   \"flat\": Material(roughness: 0.5), \"far\": \"= 1e30 + waves\",
                   \"tint\": GradientMap(input: \"waves\", stops: [(0, \"#000000\"), (1, \"#ffffff\")]) }},
          outputs: {{ {outputs} }})"
    )
}

fn desk(tile: &str, outputs: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", graph(tile, outputs));
    desk
}

/// The triangles of a binary STL.
fn stl(bytes: &[u8]) -> Vec<[[f32; 3]; 3]> {
    let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
    assert_eq!(bytes.len(), 84 + 50 * count);
    let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let corner = |at: usize| [number(at), number(at + 4), number(at + 8)];
    (0..count).map(|n| [12, 24, 36].map(|at| corner(84 + 50 * n + at))).collect()
}

/// Checks that each edge is used once in each direction; returns the volume.
fn volume(triangles: &[[[f32; 3]; 3]]) -> f64 {
    let mut edges: BTreeMap<[[u32; 3]; 2], i32> = BTreeMap::new();
    let mut volume = 0.0;
    for triangle in triangles {
        let bits = triangle.map(|corner| corner.map(f32::to_bits));
        for k in 0..3 {
            let (a, b) = (bits[k], bits[(k + 1) % 3]);
            assert_ne!(a, b);
            *edges.entry(if a < b { [a, b] } else { [b, a] }).or_default() += if a < b { 1 } else { 1000 };
        }
        let [a, b, c] = triangle.map(|corner| corner.map(f64::from));
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        volume += (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0;
    }
    assert!(edges.values().all(|uses| *uses == 1001), "the body is not closed");
    volume
}

#[test]
fn a_plate_is_closed_and_its_line_tells_its_figures() {
    let desk = desk("Both", "\"p\": Plate(height: \"h\", report: true), \"q\": Plate(height: \"m\")");
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    let triangles = stl(&desk.read("out/p.stl"));
    let volume = volume(&triangles);
    let report: serde_json::Value = serde_json::from_slice(&desk.read("out/p_report.json")).unwrap();
    assert_eq!(report["triangles"], triangles.len());
    assert!((report["volume_mm3"].as_f64().unwrap() - volume).abs() < 1e-3);
    assert!((volume / 192.0 - 1.0).abs() < 0.1, "{volume}");
    assert!(report["error_mm"].as_f64().unwrap() <= 0.01);
    assert_eq!((&report["kind"], &report["closed"]), (&"Plate".into(), &true.into()));
    let line = said.lines().find(|line| line.contains("p.stl")).unwrap();
    assert!(line.contains("triangles, error 0.0100 mm, ") && line.ends_with(" mm³, closed"), "{line}");
    // A material stands for its height, and any run gives the same bytes.
    assert_eq!(desk.read("out/p.stl"), desk.read("out/q.stl"));
    desk.shibo("render a.ron -o again --threads 1").expect(0);
    assert_eq!(desk.read("out/p.stl"), desk.read("again/p.stl"));
}

#[test]
fn any_material_with_a_height_becomes_a_body() {
    let desk = desk("X", "\"m\": \"m\"");
    for (target, file, head) in [
        ("stl", "m.stl", &b"Shibo"[..]),
        ("3mf", "m.3mf", b"PK"),
        ("ply", "m.ply", b"ply\nformat binary_little_endian"),
    ] {
        desk.shibo(&format!("render a.ron -o {target} --as {target}")).expect(0);
        assert!(desk.read(&format!("{target}/{file}")).starts_with(head), "{target}");
    }
    desk.write("b.ron", graph("X", "\"f\": \"flat\""));
    let told = desk.shibo("render b.ron -o b --as stl").expect(1).stderr;
    assert!(told.contains("has no height"), "{told}");
}

#[test]
fn rolls_and_moulds_are_closed() {
    let desk = desk(
        "Both",
        "\"r\": Roll(height: \"h\", around: 2, along: 2, form: Mould, bore: 1.5),
         \"y\": Roll(height: \"h\", around: 3, direction: Y, pattern: Even, error: 0.02),
         \"p\": Plate(height: \"h\", tiles: (2, 1), form: Mould, pattern: Even)",
    );
    desk.shibo("render a.ron -o out").expect(0);
    let of = |file: &str| volume(&stl(&desk.read(file)));
    let core = |around: f64, length: f64, bore: f64| {
        let radius = around * 8.0 / std::f64::consts::TAU;
        std::f64::consts::PI * (radius * radius - bore * bore / 4.0) * length
    };
    assert!((of("out/r.stl") / core(2.0, 16.0, 1.5) - 1.0).abs() < 0.35);
    assert!((of("out/y.stl") / core(3.0, 8.0, 0.0) - 1.0).abs() < 0.35);
    assert!((of("out/p.stl") / 384.0 - 1.0).abs() < 0.15);
}

#[test]
fn slopes_over_the_limit_are_reported() {
    let desk = desk(
        "Both",
        "\"p\": Plate(height: \"h\", report: true, steepest: 10),
         \"q\": Plate(height: \"h\", report: true)",
    );
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    let report = |name: &str| serde_json::from_slice::<serde_json::Value>(&desk.read(name)).unwrap();
    let (limited, free) = (report("out/p_report.json"), report("out/q_report.json"));
    let share = limited["over_limit_share"].as_f64().unwrap();
    assert!(share > 0.0 && share < 1.0, "{share}");
    assert!(limited["steepest_deg"].as_f64().unwrap() > 10.0 && limited["limit_deg"] == 10.0);
    assert!(said.contains("% of the relief is steeper than 10°"), "{said}");
    assert_eq!((&free["over_limit_share"], &free["findings"]), (&0.0.into(), &serde_json::json!([])));
    assert_eq!(free["pitch_mm"], serde_json::json!([8.0 / 96.0, 8.0 / 96.0]));
    assert_eq!(desk.read("out/p.stl"), desk.read("out/q.stl"));
}

#[test]
fn refused_bodies_leave_all_files_as_they_were() {
    let refused = |tile: &str, output: &str, code: &str, message: &str, help: &str| {
        let desk = desk(tile, &format!("\"picture\": \"h\", \"p\": {output}"));
        // The picture is in the cache, so it would only be copied.
        desk.shibo("render a.ron -o out --output picture").expect(0);
        desk.write("out/picture.png", "before");
        let told = desk.shibo("render a.ron -o out").expect(1).stderr;
        assert!(told.contains(code) && told.contains(message) && told.contains(help), "{told}");
        assert!(told.contains("a.ron:"), "{told}");
        assert_eq!(desk.read("out/picture.png"), b"before");
        assert!(!desk.path("out/p.stl").exists());
    };
    refused("Both", "Plate(height: \"h\", triangles: 500)", "over-budget", "500 are allowed", "or `error: 0.");
    refused(
        "Both",
        "Plate(height: \"h\", triangles: 500, error: 0.0001)",
        "over-budget",
        "allowed",
        "noise with `Blur`",
    );
    refused(
        "Both",
        "Plate(height: \"far\")",
        "too-large",
        "rounds its places by up to 3.8e22 mm",
        "make the height smaller",
    );
    refused("Both", "Plate(height: \"h\", thickness: 0.1)", "thin-wall", "mm thick at (", "`thickness`");
    refused("X", "Plate(height: \"h\", tiles: (1, 2))", "does-not-tile", "from top to bottom", "`tiles`");
    refused("Y", "Roll(height: \"h\", around: 2)", "does-not-tile", "goes round", "tiles");
    refused("Both", "Roll(height: \"h\", around: 1, bore: 30)", "bad-value", "no smaller than the roll", "`around`");
    let desk = desk(
        "Both",
        "\"p\": Roll(height: \"h\"), \"q\": Plate(height: \"h\", thickness: 0), \"s\": Plate(height: \"flat\"),
         \"t\": Plate(height: \"tint\")",
    );
    let told = desk.shibo("check a.ron").expect(1).stderr;
    for part in ["`Roll` has no `around`", "thickness is `0`", "the material `flat` has none", "= 2 * luminance(tint)"]
    {
        assert!(told.contains(part), "{part} is not in\n{told}");
    }
}

#[test]
fn coarser_bodies_keep_their_budget_and_warn() {
    let desk = desk("Both", "\"p\": Plate(height: \"h\", triangles: 400, over: Coarsen)");
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    assert!(said.contains("so the error is 0."), "{said}");
    let triangles = stl(&desk.read("out/p.stl"));
    assert!(triangles.len() <= 400, "{}", triangles.len());
    volume(&triangles);
}

/// A graph with a ball of 20 mm that has a relief, and a sheet.
fn on_mesh(outputs: &str) -> String {
    format!(
        "(canvas: (size_mm: 40, resolution: 64, tile: None, seed: 3),
          nodes: {{ \"ball\": MeshShape(shape: Sphere, size: (20, 20, 20), segments: 32),
                   \"atlas\": MeshAtlas(mesh: \"ball\"), \"place\": BakePosition(atlas: \"atlas\"),
                   \"h\": \"= 0.8 * noise(place.r / 3, place.g / 3, place.b / 3)\",
                   \"carved\": DisplaceMesh(atlas: \"atlas\", height: \"h\", error: 0.03, pitch: 0.1),
                   \"few\": DisplaceMesh(atlas: \"atlas\", height: \"h\", error: 0.03, pitch: 0.1, triangles: 2000),
                   \"coarse\": DisplaceMesh(atlas: \"atlas\", height: \"h\", error: 0.03, pitch: 0.1, triangles: 2000,
                     over: Coarsen),
                   \"tiny\": DisplaceMesh(atlas: \"atlas\", height: \"h\", triangles: 100, over: Coarsen),
                   \"through\": DisplaceMesh(atlas: \"atlas\", height: -30, pitch: 0.1),
                   \"sheet\": MeshShape(shape: Plane, size: (20, 20, 1)) }},
          outputs: {{ {outputs} }})"
    )
}

#[test]
fn a_mesh_with_a_relief_becomes_a_closed_model() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        on_mesh(
            "\"z\": Model(mesh: \"carved\", report: true), \"y\": Model(mesh: \"carved\", up: Y),
             \"m\": Model(mesh: \"carved\", format: ThreeMf), \"plain\": Model(mesh: \"atlas\", format: Ply)",
        ),
    );
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    let triangles = stl(&desk.read("out/z.stl"));
    let volume = volume(&triangles);
    let ball = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    assert!(volume > ball(10.0) && volume < ball(10.8), "{volume}");
    let report: serde_json::Value = serde_json::from_slice(&desk.read("out/z_report.json")).unwrap();
    assert_eq!((&report["triangles"], &report["kind"]), (&triangles.len().into(), &"Model".into()));
    assert!((report["volume_mm3"].as_f64().unwrap() - volume).abs() < 1e-2);
    let line = said.lines().find(|line| line.contains("z.stl")).unwrap();
    assert!(line.contains(" triangles, ") && line.ends_with(" mm³, closed"), "{line}");
    // The same body, turned.
    let turned = stl(&desk.read("out/y.stl"));
    assert!(triangles.iter().flatten().zip(turned.iter().flatten()).all(|([x, y, z], at)| *at == [*x, *z, -y]));
    assert!(desk.read("out/m.3mf").starts_with(b"PK") && desk.read("out/plain.ply").starts_with(b"ply"));
    // The resolution and the number of threads do not change it.
    desk.shibo("render a.ron -o again --output z --resolution 32 --threads 1 --no-cache").expect(0);
    assert_eq!(desk.read("out/z.stl"), desk.read("again/z.stl"));
    desk.shibo("pin a.ron").expect(0);
    desk.shibo("verify a.ron").expect(0);
}

#[test]
fn models_that_are_open_or_too_large_are_refused() {
    let refused = |output: &str, parts: &[&str]| {
        let desk = Desk::new();
        desk.write("a.ron", on_mesh(&format!("\"p\": {output}")));
        let told = desk.shibo("render a.ron -o out").expect(1).stderr;
        for part in parts {
            assert!(told.contains(part), "{part} is not in\n{told}");
        }
        assert!(!desk.path("out/p.stl").exists());
    };
    refused("Model(mesh: \"sheet\")", &["open-mesh", "an edge at (", "`open: Keep`", "a.ron:"]);
    refused(
        "Model(mesh: \"few\")",
        &["over-budget", "0.03 mm needs ", "2000 are allowed", "`triangles: ", "`error: 0."],
    );
    refused("Model(mesh: \"tiny\")", &["over-budget", "the mesh itself has ", "100 are allowed", "a mesh with fewer"]);
    refused("Model(mesh: \"through\")", &["bad-value", "the relief turns the mesh", "less than half the thickness"]);
    refused("Model(mesh: \"h\")", &["type-mismatch", "`Model` takes a mesh"]);
    refused("Model(format: Ply)", &["missing-input", "`Model` has no `mesh`"]);
    let desk = Desk::new();
    desk.write("a.ron", on_mesh("\"p\": Model(mesh: \"sheet\", open: Keep), \"q\": Model(mesh: \"coarse\")"));
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    assert!(said.contains("mm, open") && said.contains("so the error is 0."), "{said}");
    let triangles = stl(&desk.read("out/q.stl"));
    assert!(triangles.len() <= 2000);
    volume(&triangles);
}

#[test]
fn warnings_about_a_mesh_are_repeated_from_the_cache_and_in_its_report() {
    let desk = Desk::new();
    // A dent at the top that goes through the middle.
    let inverted =
        "\"deep\": DisplaceMesh(atlas: \"atlas\", height: \"= -12 * smoothstep(5, 8, place.b)\", pitch: 0.1),";
    let graph =
        on_mesh("\"p\": Model(mesh: \"deep\", report: true)").replace("nodes: {", &format!("nodes: {{ {inverted}"));
    desk.write("a.ron", graph);
    let [first, second] = ["out", "again"].map(|folder| {
        let ran = desk.shibo(&format!("render a.ron -o {folder} --stats human")).expect(0);
        let report: serde_json::Value = serde_json::from_slice(&desk.read(&format!("{folder}/p_report.json"))).unwrap();
        (ran.stderr, ran.stdout, report)
    });
    let folds = |said: &str| said.matches("the relief folds over itself").count();
    assert_eq!((folds(&first.0), folds(&second.0)), (1, 1), "{}\n{}", first.0, second.0);
    let findings = first.2["findings"].as_array().unwrap();
    let finding = findings.iter().find(|one| one["message"].as_str().unwrap().contains("folds over itself")).unwrap();
    assert_eq!((&finding["code"], finding["at_mm"].as_array().map(Vec::len)), (&"advice".into(), Some(3)));
    assert_eq!(first.2, second.2);
    assert_eq!(desk.read("out/p.stl"), desk.read("again/p.stl"));
}

/// A mesh file whose triangles face inwards becomes a body that faces outwards, with advice; a mesh does not tile and
/// need not, on a canvas that does.
#[test]
fn a_mesh_that_is_inside_out_is_turned_round() {
    let desk = Desk::new();
    let corners: String = (0..8).map(|n| format!("v {} {} {}\n", n & 1, n >> 1 & 1, n >> 2 & 1)).collect();
    desk.write("in.obj", corners + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n");
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 8, resolution: 16, tile: Both),
          nodes: { \"box\": LoadMesh(path: \"in.obj\"), \"ball\": MeshShape(shape: Sphere, size: (8, 8, 8)),
                   \"atlas\": MeshAtlas(mesh: \"ball\") },
          outputs: { \"p\": Model(mesh: \"box\", report: true), \"ball\": Model(mesh: \"atlas\") })",
    );
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    assert!(said.contains("the mesh is inside out: its triangles are turned round"), "{said}");
    assert!(!said.contains("not tile"), "{said}");
    let volume = volume(&stl(&desk.read("out/p.stl")));
    assert!(volume > 0.0, "{volume}");
    let report: serde_json::Value = serde_json::from_slice(&desk.read("out/p_report.json")).unwrap();
    assert!((report["volume_mm3"].as_f64().unwrap() / volume - 1.0).abs() < 1e-6);
    assert!(report["findings"][0]["message"].as_str().unwrap().contains("inside out"), "{report}");
}

#[test]
fn a_relief_that_needs_more_memory_than_allowed_is_refused_before() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        on_mesh("\"p\": Model(mesh: \"wide\")")
            .replace("nodes: {", "nodes: { \"wide\": DisplaceMesh(atlas: \"atlas\", height: \"h\"),"),
    );
    let told = desk.shibo("render a.ron -o out --memory 16").expect(1).stderr;
    assert!(told.contains("4194304 texels of the height and ") && told.contains(" MiB; "), "{told}");
    assert!(told.contains("raise `--memory`, or make `pitch` larger"), "{told}");
}
