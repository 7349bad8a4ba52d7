//! Foreign meshes that are broken, hostile, or no valid surface. Each gives an error or advice at its place, and no
//! file is opened except the named ones.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use glam::UVec2;
use shibo_contract::kinds::{STAND_INS, bytes, load, needed, session, stand_in};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::Failure;
use shibo_node::KindInfo;
use shibo_node::registry::Registry;
use shibo_value::{Accepts, Type};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A graph with the mesh in line 4, its atlas in line 5, and nodes that read them from line 6 on.
fn graph(atlas: &str, more: &str) -> String {
    format!(
        "(\n  canvas: (size_mm: 40, resolution: 64, tile: None),\n  nodes: {{\n    \"mesh\": LoadMesh(path: \"a.obj\", up: Z),\n    \
         \"atlas\": MeshAtlas(mesh: \"mesh\"{atlas}),\n    {more}\n  }},\n  outputs: {{ \"out\": \"out\" }},\n)\n"
    )
}

const NORMAL: &str = "\"out\": BakeNormal(atlas: \"atlas\"),";

/// The messages about a graph with this mesh, in one line.
fn said(desk: &Desk, mesh: &[u8], graph: &str, code: i32) -> String {
    desk.write("a.obj", mesh);
    desk.write("a.ron", graph);
    let told = desk.shibo("render a.ron --no-cache --quiet").expect(code).stderr;
    told.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Two triangles with UVs, with more lines.
fn sheet(more: &str) -> Vec<u8> {
    let sheet =
        "v 0 0 0\nv 30 0 0\nv 30 30 0\nv 0 30 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    (sheet.to_owned() + more).into_bytes()
}

#[test]
fn files_that_are_no_meshes_are_refused_at_their_place() {
    let desk = Desk::new();
    let mut long = b"glTF\x02\x00\x00\x00\xff\xff\xff\x7f".to_vec();
    long.extend([0xFF; 40]);
    let corner = "v 0 0 0\nv 30 0 0\nv 0 30 0\n";
    let files: [(&[u8], &str); 11] = [
        (b"", "bad-file"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\0", "neither OBJ nor glTF"),
        (&long, "truncated"),
        (b"{\"asset\": {\"version\": \"2.0\"}, \"meshes\": [", "bad-file"),
        (&sheet("f 1 2 9\n"), "line 11: `f 1 2 9`"),
        (&sheet("f 1 2 0\n"), "line 11: `f 1 2 0`"),
        (&sheet("f 1 2 x\n"), "line 11: `f 1 2 x`"),
        (&sheet("v 1 nan 2\nf 1 2 5\n"), "line 11: `v 1 nan 2`"),
        (&sheet("v 1e9 0 0\nf 1 2 5\n"), "within"),
        ((corner.to_owned() + "f 1 1 2\nf 3 3 3\n").leak().as_bytes(), "none of its triangles has an area"),
        (b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "none of its triangles has an area"),
    ];
    for (file, words) in files {
        let told = said(&desk, file, &graph("", NORMAL), 1);
        assert!(told.contains(words) && told.contains("a.ron:4:") && told.contains("bad-file"), "{words}: {told}");
        assert!(!told.contains("a.ron:5:"), "{told}");
    }
    // A file beyond the limit is not read.
    let file = std::fs::File::create(desk.path("a.obj")).unwrap();
    file.set_len((512 << 20) + 1).unwrap();
    let begun = Instant::now();
    let told = desk.shibo("check a.ron").expect(1).stderr;
    assert!(told.contains("too-large") && told.contains("512 MiB") && told.contains("a.ron:4:"), "{told}");
    assert!(begun.elapsed() < Duration::from_secs(20));
}

#[test]
fn reports_invalid_surfaces_with_places() {
    let desk = Desk::new();
    let advice = |mesh: &[u8], atlas: &str, words: &str, line: u32| {
        let told = said(&desk, mesh, &graph(atlas, NORMAL), 0);
        assert!(told.contains(words) && told.contains(&format!("a.ron:{line}:")), "{words}: {told}");
    };
    // No area, more than two triangles at an edge, a Möbius strip, the wrong unit.
    advice(&sheet("f 1/1 1/1 2/2\nf 3/3 4/4 3/3\n"), "", "2 triangles have no area and are left out", 4);
    let fan = sheet("v 0 0 30\nvt .5 .5\nf 1/1 3/3 5/5\nf 1/1 3/3 2/2\n");
    advice(&fan, "", "1 edges have more than two triangles", 4);
    let strip = include_bytes!("../meshes/moebius.obj");
    advice(strip, ", charts: New", "as a Möbius strip", 4);
    let small = String::from_utf8(sheet("")).unwrap().replace("30", "0.3");
    advice(small.as_bytes(), "", "its largest side is 0.3000 mm", 4);
    let large = String::from_utf8(sheet("")).unwrap().replace("30", "30000");
    advice(large.as_bytes(), "", "is it in millimetres?", 4);
    // Overlapping UVs, no UVs, and UVs outside the unit square.
    let twice = sheet("v 0 0 9\nv 30 0 9\nv 30 30 9\nf 5/1 6/2 7/3\n");
    advice(&twice, "", "of the texels belong to several triangles", 5);
    let error = |mesh: &[u8], atlas: &str, more: &str, words: &[&str]| {
        let told = said(&desk, mesh, &graph(atlas, more), 1);
        words.iter().for_each(|word| assert!(told.contains(word), "{word}: {told}"));
    };
    error(&twice, ", overlap: Refuse", NORMAL, &["bad-value", "several triangles", "a.ron:5:"]);
    let bare = b"v 0 0 0\nv 30 0 0\nv 30 30 0\nf 1 2 3\n";
    error(bare, ", charts: Given", NORMAL, &["missing-input", "has no UVs", "take `charts: New`", "a.ron:5:"]);
    assert!(!said(&desk, bare, &graph("", NORMAL), 0).contains("error"));
    let tiled = String::from_utf8(sheet("")).unwrap().replace("vt 1 1", "vt 4 1");
    error(tiled.as_bytes(), "", NORMAL, &["bad-value", "charts: Repack", "a.ron:5:"]);
    // Directions need an outside; strokes must lie on the surface; pixels of the exemplar must be smaller than the
    // mesh.
    let flow = |more: &str| {
        format!(
            "\"flow\": TangentField(mesh: \"mesh\"{more}), \"out\": JacobianFromMesh(atlas: \"atlas\", frames: \"flow\"),"
        )
    };
    error(strip, ", charts: New", &flow(""), &["bad-file", "has no outside", "a.ron:6:"]);
    error(&sheet(""), "", &flow(", strokes: [[(0, 0, 90), (9, 0, 0)]]"), &["bad-value", "off the surface", "a.ron:6:"]);
    let grown = flow("").replace(
        "\"out\": JacobianFromMesh(",
        "\"ground\": Worley(size: 12), \"piece\": Exemplar(input: \"ground\", \
        size: (16, 16), size_mm: 160), \"grown\": SynthesizeSurface(exemplar: \"piece\", ",
    ) + "\"out\": SampleExemplar(coords: \"grown\", input: \"ground\"),";
    error(&sheet(""), "", &grown, &["bad-value", "a pixel of the exemplar is", "a.ron:6:"]);
}

/// Paths in meshes point to a pipe without a writer: opening it would block for ever.
#[cfg(unix)]
#[test]
fn opens_only_named_files() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("in")).unwrap();
    for pipe in ["secret.bin", "in/secret.mtl", "in/secret.png"] {
        assert!(std::process::Command::new("mkfifo").arg(desk.path(pipe)).status().unwrap().success());
    }
    let absolute = desk.path("secret.bin").display().to_string();
    let uris =
        ["../secret.bin", &absolute, &format!("file://{absolute}"), "secret.png", "/dev/zero", "%2e%2e/secret.bin"];
    let document = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}], "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
 "textures": [{"source": 0}], "images": [{"uri": "secret.png"}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
 "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": "URI"}]}"#;
    // The command itself must not block.
    let run = |node: &str| {
        desk.write("a.ron", graph("", NORMAL).replace("path: \"a.obj\", up: Z", node));
        let mut child = desk.command(["render", "a.ron", "--no-cache", "--quiet"]);
        let mut child = child.stderr(std::process::Stdio::piped()).spawn().unwrap();
        let begun = Instant::now();
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break status,
                None if begun.elapsed() > Duration::from_secs(60) => {
                    child.kill().unwrap();
                    panic!("it waits for a file that the mesh names: {node}");
                }
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        let told = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
        (status.code(), told)
    };
    for uri in uris {
        desk.write("in/a.gltf", document.replace("URI", uri));
        let (code, told) = run("path: \"in/a.gltf\"");
        assert_eq!(code, Some(1), "{uri}: {told}");
        assert!(
            told.contains("missing-input") && told.contains("`buffer`") && told.contains("a.ron:4:"),
            "{uri}: {told}"
        );
    }
    desk.write(
        "in/secret.obj",
        [&b"mtllib secret.mtl\nmtllib ../secret.bin /dev/zero\n"[..], &sheet("usemtl a\nf 1 2 3\n")].concat(),
    );
    let (code, told) = run("path: \"in/secret.obj\"");
    assert_eq!(code, Some(0), "{told}");
    // A pipe that the graph names is an error.
    let (code, told) = run("path: \"in/secret.mtl\"");
    assert!(code == Some(1) && told.contains("not a regular file"), "{told}");
}

/// Kinds that read meshes or values made from them.
fn is_of_meshes(info: &KindInfo) -> bool {
    let types = [Type::Mesh, Type::Atlas, Type::Frames, Type::IndirectionMap, Type::SurfaceNet];
    info.ports().any(|(_, port)| types.iter().any(|ty| port.ty == Accepts::One(*ty)))
}

/// A graph of a kind that reads `mesh` in place of the usual one.
fn on_mesh(registry: &Arc<Registry>, info: &KindInfo, mesh: &str) -> Result<String, String> {
    let mut args: Vec<String> = Vec::new();
    let mut nodes = String::new();
    for (field, port) in info.ports() {
        let wanted = matches!(
            port.ty,
            Accepts::One(Type::Mesh | Type::Atlas | Type::Frames | Type::IndirectionMap | Type::SurfaceNet)
        );
        if !port.required && !wanted {
            continue;
        }
        let (text, more) = stand_in(registry, port.ty)?;
        args.push(format!("{}: {text}", field.name));
        if !nodes.contains(&more) {
            nodes.push_str(&more);
        }
    }
    if info.kind == "StartCoords" {
        // On a surface this kind needs the size of the exemplar's pixels.
        args.push("exemplar: \"exemplar\"".into());
    }
    args.extend(needed(&info.kind).map(|(field, text)| format!("{field}: {text}")));
    let ours = STAND_INS.lines().map(|line| match line.trim_start().starts_with("\"mesh\":") {
        true => format!("    \"mesh\": {mesh},\n"),
        false => format!("{line}\n"),
    });
    Ok(format!("{} {nodes} \"it\": {}({}),", ours.collect::<String>(), info.kind, args.join(", ")))
}

/// Every kind accepts every shape and odd mesh: its values are finite, or it gives an error.
#[test]
fn every_node_takes_odd_meshes() {
    let desk = Desk::new();
    let strip: String = (0..20).map(|k| format!("v {k} 0 0\nv {k} {} 0\n", if k % 3 == 0 { 0 } else { 4 })).collect();
    let faces: String = (0..19)
        .map(|k| format!("f {0} {1} {2}\nf {1} {3} {2}\n", 2 * k + 1, 2 * k + 3, 2 * k + 2, 2 * k + 4))
        .collect();
    let pieces: String = (0..300)
        .map(|k| {
            let (x, y, n) = (f64::from(k % 20), f64::from(k / 20), 3 * k + 1);
            format!("v {x} {y} 0\nv {} {y} 0\nv {x} {} 0.4\nf {n} {} {}\n", x + 0.8, y + 0.8, n + 1, n + 2)
        })
        .collect();
    let uv = |side: f64| {
        let at = [0.3, 0.3 + side];
        let corners =
            [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[x, y]: [usize; 2]| format!("vt {} {}\n", at[x], at[y])).concat();
        format!("v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\n{corners}f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    };
    let files = [
        ("one.obj", "v 0 0 0\nv 9 0 0\nv 0 9 2\nf 1 2 3\n".to_owned()),
        ("two.obj", "v 0 0 0\nv 9 0 0\nv 0 9 2\nv -9 0 0\nv 0 -9 0\nf 1 2 3\nf 1 4 5\n".to_owned()),
        ("strip.obj", strip + &faces),
        ("pieces.obj", pieces),
        // A chart of about one texel of 48, and one without a pixel at any level.
        ("texel.obj", uv(1.2 / 48.0)),
        // Half of the mesh has no UVs.
        ("bare.obj", uv(0.4).replace("f 1/1 3/3 4/4", "f 1 3 4")),
        ("nothing.obj", uv(1e-5)),
    ];
    let mut meshes: Vec<(String, bool)> = ["Cube", "Sphere", "Torus", "Cylinder", "Plane", "Lathe"]
        .map(|shape| (format!("MeshShape(shape: {shape}, size: (20, 20, 10), radius: 4, segments: 12)"), true))
        .to_vec();
    for (name, text) in files {
        desk.write(name, text);
        meshes.push((format!("LoadMesh(path: {:?}, up: Z)", desk.path(name)), false));
    }
    let registry = Arc::new(shibo_nodes::registry());
    let session = session(&registry, 1);
    let infos: Vec<&KindInfo> =
        registry.kinds().filter_map(|kind| registry.info(kind)).filter(|i| is_of_meshes(i)).collect();
    assert!(infos.len() > 20, "{}", infos.len());
    let (mut made, mut refused) = (0, 0);
    for (mesh, right) in &meshes {
        for info in &infos {
            let graph =
                on_mesh(&registry, info, mesh).and_then(|nodes| load(&registry, &nodes, UVec2::splat(48))).unwrap();
            match bytes(&session, &graph, 48) {
                Ok(_) => made += 1,
                Err(told) => {
                    // The stand-in coordinates are not those of a surface.
                    let plane = ["the size of the exemplar's pixels", "where the surface has"];
                    let plane = plane.iter().any(|words| told.contains(words));
                    refused += i32::from(!plane);
                    println!("{mesh}: {}: {told}", info.kind);
                    assert!(!right || plane, "{}: {mesh}: {told}", info.kind);
                    // An error with a message, at a node of the graph.
                    let problem =
                        ["BadValue", "BadFile", "TooLarge", "MissingInput"].iter().any(|code| told.contains(code));
                    assert!(problem && !told.contains("panicked"), "{}: {mesh}: {told}", info.kind);
                }
            }
        }
    }
    assert!(made > 10 * refused, "{made} {refused}");
}

/// Work on large meshes stops at once: reading and laying out check for cancellation regularly.
#[test]
fn large_meshes_stop_when_asked() {
    let desk = Desk::new();
    let side = 300;
    let places = (0..=side).flat_map(|j| (0..=side).map(move |i| (i, j)));
    let at = |i: usize, j: usize| j * (side + 1) + i + 1;
    let mut text: String = places
        .map(|(i, j)| format!("v {i} {j} {}\nvt {} {}\n", i * j % 7, i as f64 / side as f64, j as f64 / side as f64))
        .collect();
    for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        text += &format!("f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}\n");
    }
    desk.write("large.obj", text);
    let registry = Arc::new(shibo_nodes::registry());
    let nodes = format!("\"m\": LoadMesh(path: {:?}, up: Z), \"it\": MeshAtlas(mesh: \"m\"),", desk.path("large.obj"));
    let graph = load(&registry, &nodes, UVec2::splat(16)).unwrap();
    let node = |name: &str| graph.nodes.node_indices().find(|i| graph.nodes[*i].name == name).unwrap();
    // 180,000 triangles: one check every 8,000 lines, triangles, edges and vertices.
    for (name, least) in [("m", 150), ("it", 150)] {
        let session = session(&registry, 1);
        let prepare = || {
            session.caches().memory.clear();
            if name == "it" {
                session.value(&graph, (node("m"), 0), &CancelToken::default(), &Silent).unwrap();
            }
        };
        prepare();
        let token = CancelToken::counting(0);
        session.value(&graph, (node(name), 0), &token, &Silent).unwrap();
        let all = token.asked();
        println!("{name}: asked {all} times");
        assert!(all >= least, "{name}: asked {all} times");
        for percent in [5, 35, 65, 95] {
            prepare();
            let token = CancelToken::counting(all * percent / 100);
            let stopped = session.value(&graph, (node(name), 0), &token, &Silent);
            assert!(matches!(stopped, Err(Failure::Cancelled)), "{name} at {percent} %");
        }
    }
}
