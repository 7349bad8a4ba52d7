//! `shibo bridge`: a program in another language asks over stdin and stdout. The session has every message of docs/protocol.md.
mod session;

use crate::support::{Desk, samples};
use serde_json::{Value as Json, json};
use session::Session;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

const TEXT: &str = r##"(version: 1, canvas: (size_mm: (8, 4), resolution: (32, 16), seed: 1),
  params: { "gain": Number(default: 0.5, range: (0, 2)), "tint": Color(default: "#804020") },
  presets: { "strong": { "gain": 2 } },
  nodes: { "noise": Perlin(), "more": "= noise * $gain", "m": Material(base_color: "$tint", height: "more") },
  outputs: { "m": "m", "noise": "noise" })
"##;

/// A graph that takes many seconds, and tells its progress.
const LONG: &str = r#"(version: 1, canvas: (size_mm: 40, resolution: 96, tile: Both, seed: 1),
  nodes: {
    "bumps": Perlin(size: 5),
    "points": PoissonPoints(pitch: 0.5),
    "links": ConnectNeighbors(points: "points"),
    "springs": DefineSprings(lattice: "links", field: "bumps", stiffness: (1, 10)),
    "moved": SimulateSprings(springs: "springs", step: 0.01, steps: 100000, drag: 4, boundary: Periodic),
    "wrinkles": PlaceWrinkles(lattice: "moved"),
    "strokes": DrawWrinkles(segments: "wrinkles", width: (0.5, 1)),
  },
  outputs: { "mask": "strokes.mask" })
"#;

fn file(message: &Json) -> Vec<u8> {
    let path = message["file"].as_str().unwrap_or_else(|| panic!("{message}"));
    std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect()
}

#[test]
fn opens_checks_and_writes_graphs() {
    let desk = Desk::new();
    desk.write("a.ron", TEXT);
    let mut session = Session::start(&desk);
    let hello = session.ok(json!({ "op": "hello", "protocol": 1, "client": "test", "unknown": [1, {}] }));
    assert_eq!((&hello["protocol"], &hello["limits"]["pixels"]), (&1.into(), &65_536.into()));
    assert!(hello["folder"].as_str().unwrap().starts_with(desk.path("tmp").to_str().unwrap()), "{hello}");
    assert!(hello["graphs"].as_array().unwrap().iter().any(|graph| graph["name"] == "calf" && graph["part"] == false));
    assert!(hello["targets"].as_array().unwrap().iter().any(|target| target == "gltf"), "{hello}");

    let opened = session.ok(json!({ "op": "open", "graph": desk.path("a.ron") }));
    assert_eq!((&opened["graph"], &opened["solid"]), (&"g1".into(), &false.into()), "{opened}");
    assert_eq!((&opened["params"][0]["name"], &opened["presets"]["strong"]["gain"]), (&"gain".into(), &2.into()));
    let shipped = session.ok(json!({ "op": "open", "graph": "shibo:walnut" }));
    assert_eq!((&shipped["graph"], &shipped["solid"]), (&"g2".into(), &true.into()));
    let broken = session.ask(json!({ "op": "open", "text": TEXT.replace("Perlin", "Perlim"), "graph": "b.ron" }));
    assert_eq!((&broken[0]["error"]["code"], &broken[0]["error"]["errors"][0]["line"]), (&"graph".into(), &4.into()));
    let checked = session.ok(json!({ "op": "check", "text": TEXT.replace("Perlin", "Perlim") }));
    assert_eq!(checked["diagnostics"][0]["level"], "error");

    // Files as `shibo render` writes them.
    let written = session.ok(json!({ "op": "write", "graph": "g1", "folder": desk.path("out"), "set": { "gain": 1 } }));
    desk.shibo("render a.ron -o two --set gain=1").expect(0);
    assert_eq!(desk.names("out"), desk.names("two"));
    assert_eq!(written["files"].as_array().unwrap().len(), desk.names("out").len());
    for name in desk.names("out") {
        assert!(desk.read(&format!("out/{name}")) == desk.read(&format!("two/{name}")), "{name} differs");
    }
    let gltf = json!({ "op": "write", "graph": "g1", "folder": desk.path("gltf"), "target": "gltf", "size": 8 });
    assert!(session.ok(gltf)["files"][0].as_str().unwrap().ends_with("m.glb"));
    assert_eq!(session.refused(json!({ "op": "write", "graph": "g1", "folder": "x", "target": "gif" })), "usage");
    assert_eq!(session.refused(json!({ "op": "write", "graph": "g1" })), "usage");

    assert_eq!(session.ok(json!({ "op": "close", "graph": "g2" })), json!({}));
    assert_eq!(session.refused(json!({ "op": "render", "graph": "g2" })), "no-graph");
    assert_eq!(session.refused(json!({ "op": "fly" })), "unknown-op");
    session.end(&desk);
}

#[test]
fn pictures_have_the_samples_of_files() {
    let desk = Desk::new();
    desk.write("a.ron", TEXT);
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "open", "graph": desk.path("a.ron") }));
    let mut render = |form: &str| {
        let request = json!({ "op": "render", "graph": "g1", "output": "noise", "as": form, "slot": form });
        let messages = session.ask(request);
        assert_eq!((messages.len(), &messages[0]["as"]), (2, &form.into()), "{messages:?}");
        file(&messages[0])
    };
    let [exact, bytes, png, exr] = ["f32", "u8", "png", "exr"].map(&mut render);
    desk.write("r.png", png);
    desk.write("r.exr", exr);
    desk.shibo("render a.ron --output noise --format exr --depth f32 -o exact").expect(0);
    desk.shibo("render a.ron --output noise --format png --depth 8 -o small").expect(0);
    let read = |name: &str| {
        let image = exr::prelude::read_first_flat_layer_from_file(desk.path(name)).unwrap();
        image.layer_data.channel_data.list[0].sample_data.values_as_f32().collect::<Vec<_>>()
    };
    assert!(floats(&exact) == read("exact/noise.exr"), "the floats are those of the file");
    assert!(read("r.exr") == read("exact/noise.exr"));
    let small = samples(&desk.path("small/noise.png"));
    assert!(samples(&desk.path("r.png")) == small);
    assert!(bytes.iter().map(|byte| u16::from(*byte) * 257).eq(small.1.iter().map(|pixel| pixel[0])));
    session.end(&desk);
}

#[test]
fn slots_report_pictures_that_stay_the_same() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "open", "text": TEXT }));
    let render = |gain: f64| {
        json!({ "op": "render", "graph": "g1", "slot": "m", "sizes": [8, 16], "set": { "gain": gain },
            "rows": "bottom", "components": 4 })
    };
    let first = session.ask(render(0.5));
    let names = |messages: &[Json]| {
        let name = |m: &Json| {
            let text = |field: &str| m[field].as_str().unwrap_or("-").to_owned();
            format!("{} {} {} {}", text("event"), text("output"), text("channel"), m["width"])
        };
        messages.iter().map(name).collect::<Vec<_>>()
    };
    let wanted = [
        "picture m base_color 8",
        "picture m height 8",
        "picture noise - 8",
        "picture m base_color 16",
        "picture m height 16",
        "picture noise - 16",
        "- - - null",
    ];
    assert_eq!(names(&first), wanted, "{first:?}");
    assert_eq!(first[6]["ok"]["computed"], 6);
    // A constant picture has one value per component and no file.
    assert_eq!((first[0]["value"].as_array().unwrap().len(), first[0].get("file")), (4, None));
    let [height, noise] = [&first[4], &first[5]].map(|message| floats(&file(message)));
    assert!(
        height
            .as_chunks()
            .0
            .iter()
            .zip(noise.as_chunks().0)
            .all(|(h, n): (&[f32; 4], &[f32; 4])| h[0] == n[0] * 0.5 && h[3] == 1.0)
    );

    let second = session.ask(render(1.0));
    let wanted = [
        "same m base_color 8",
        "picture m height 8",
        "same noise - 8",
        "same m base_color 16",
        "picture m height 16",
        "same noise - 16",
        "- - - null",
    ];
    assert_eq!(names(&second), wanted, "{second:?}");
    // The file of an unchanged picture stays; that of a replaced one is removed.
    assert_eq!(second[5]["file"], first[5]["file"]);
    assert!(floats(&file(&second[5])) == noise);
    assert!(!std::path::Path::new(first[4]["file"].as_str().unwrap()).exists());

    // A freed picture comes again.
    let free = json!({ "op": "free", "files": [second[5]["file"], "/etc/passwd", "/no/such/file"] });
    assert_eq!(session.ok(free), json!({}));
    assert!(!std::path::Path::new(second[5]["file"].as_str().unwrap()).exists());
    let third = session.ask(render(1.0));
    assert_eq!(third[6]["ok"]["computed"], 1, "{third:?}");
    assert!(floats(&file(&third[5])) == noise);
    session.end(&desk);
}

#[test]
fn a_newer_render_of_a_slot_and_cancel_stop_work() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "open", "text": LONG }));
    session.ok(json!({ "op": "open", "text": TEXT }));
    let long = |slot: &str| json!({ "op": "render", "graph": "g1", "slot": slot });
    let first = session.send(long("m"));
    let second = session.send(long("m"));
    // Another slot is not held up.
    let other = session.send(json!({ "op": "render", "graph": "g2", "slot": "n", "output": "noise" }));
    let messages = session.all(other);
    assert_eq!(messages.last().unwrap()["ok"]["computed"], 1);
    let mut known = messages;
    let answer = |messages: &[Json], id: u64| {
        messages.iter().find(|m| m["id"] == id && m.get("error").is_some()).map(|m| m["error"]["code"].clone())
    };
    if answer(&known, first).is_none() {
        known.extend(session.all(first));
    }
    assert_eq!(answer(&known, first), Some("cancelled".into()), "{known:?}");
    let cancel = session.send(json!({ "op": "cancel", "of": second }));
    known.extend(session.until(|message| message["id"] == second || message["id"] == cancel));
    known.extend(session.until(|message| message["id"] == second || message["id"] == cancel));
    assert_eq!(answer(&known, second), Some("cancelled".into()), "{known:?}");
    session.end(&desk);
}

#[test]
fn long_work_tells_its_progress() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "open", "text": LONG }));
    let id = session.send(json!({ "op": "render", "graph": "g1" }));
    let progress = session.receive();
    assert_eq!((&progress["id"], &progress["event"]), (&id.into(), &"progress".into()), "{progress}");
    assert!(progress["done"].as_u64() <= progress["of"].as_u64(), "{progress}");
    session.ok(json!({ "op": "cancel", "of": id }));
    session.end(&desk);
}

#[test]
fn watched_files_are_read_again() {
    let desk = Desk::new();
    desk.write("a.ron", TEXT);
    let mut session = Session::start(&desk);
    let opened = session.ok(json!({ "op": "open", "graph": desk.path("a.ron"), "watch": true }));
    desk.write("a.ron", TEXT.replace("default: 0.5", "default: 0.75"));
    let changed = session.receive();
    assert_eq!((&changed["event"], &changed["graph"]), (&"changed".into(), &"g1".into()), "{changed}");
    assert_eq!(changed["params"][0]["default"], 0.75);
    assert_ne!(changed["sha256"], opened["sha256"]);

    desk.write("a.ron", TEXT.replace("Perlin", "Perlim"));
    let broken = session.receive();
    assert_eq!((&broken["event"], &broken["errors"][0]["line"]), (&"broken".into(), &4.into()), "{broken}");
    // The last good graph stays.
    let value = |session: &mut Session| {
        session.ask(json!({ "op": "render", "graph": "g1", "output": "m", "sizes": [8] })).len()
    };
    assert_eq!(value(&mut session), 3);

    // Values go to the file, if it is the one that the program knows.
    desk.write("a.ron", TEXT);
    let changed = session.receive();
    let keep = |sha: &Json| json!({ "op": "keep", "graph": "g1", "values": { "gain": 1.25, "tint": "#102030" }, "sha256": sha });
    assert_eq!(session.refused(keep(&"0".into())), "changed");
    assert_eq!(String::from_utf8(desk.read("a.ron")).unwrap(), TEXT);
    let kept = session.ask(keep(&changed["sha256"]));
    let text = String::from_utf8(desk.read("a.ron")).unwrap();
    assert!(text.contains("default: 1.25") && text.contains("\"#102030\""), "{text}");
    let again = session.receive();
    assert_eq!(
        (&again["event"], &again["sha256"]),
        (&"changed".into(), &kept.last().unwrap()["ok"]["sha256"]),
        "{again}"
    );
    let wrong = json!({ "op": "keep", "graph": "g1", "values": { "gain": 9 }, "sha256": again["sha256"] });
    assert_eq!(session.refused(wrong), "graph");
    session.end(&desk);
}

#[test]
fn language_server_answers_beside_renders() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    let lsp = |message: Json| json!({ "op": "lsp", "message": message });
    let request =
        |id: u32, method: &str, params: Json| json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params });
    let ready = session.ok(lsp(request(1, "initialize", json!({ "capabilities": {} }))));
    assert_eq!(ready["messages"][0]["result"]["serverInfo"]["name"], "shibo", "{ready}");
    let note = |method: &str, params: Json| json!({ "jsonrpc": "2.0", "method": method, "params": params });
    assert_eq!(session.ok(lsp(note("initialized", json!({}))))["messages"], json!([]));
    let document = json!({ "uri": "file:///a.ron", "languageId": "shibo", "version": 1, "text": TEXT.replace("Perlin", "Perlim") });
    let id = session.send(lsp(note("textDocument/didOpen", json!({ "textDocument": document }))));
    let found = session.until(|message| {
        message["event"] == "lsp" && message["message"]["method"] == "textDocument/publishDiagnostics"
    });
    assert!(found.iter().any(|message| message["id"] == id && message.get("ok").is_some()), "{found:?}");
    assert_eq!(found.last().unwrap()["message"]["params"]["diagnostics"][0]["range"]["start"]["line"], 3);
    let hover = json!({ "textDocument": { "uri": "file:///a.ron" }, "position": { "line": 3, "character": 32 } });
    let answer = session.ok(lsp(request(2, "textDocument/hover", hover)));
    assert_eq!(answer["messages"][0]["id"], 2, "{answer}");
    assert_eq!(session.refused(lsp(json!({ "nothing": 1 }))), "bad-request");
    session.end(&desk);
}

#[test]
fn garbage_half_lines_and_long_lines_are_survived() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    for garbage in
        [&b"{\n"[..], b"\xff\xfe\x00\n", b"[]\n", b"7\n", b"{\"id\":-1,\"op\":\"hello\"}\n", b"{\"op\":7,\"id\":1}\n"]
    {
        session.bytes(garbage);
        let answer = session.receive();
        assert_eq!(answer["error"]["code"], "bad-request", "{answer}");
    }
    session.bytes(b"\n \r\n");
    session.bytes(b"{\"id\":5,\"op\":");
    std::thread::sleep(Duration::from_millis(50));
    session.bytes(b"\"hello\"}\r\n");
    assert_eq!(session.receive()["id"], 5);

    // 16 MiB are read, more are refused; the next line is read again.
    let line = |length: usize| {
        let mut line = b"{\"id\":6,\"op\":\"hello\",\"pad\":\"".to_vec();
        line.resize(length - 2, b'x');
        line.extend(b"\"}\n");
        line
    };
    session.bytes(&line(16 << 20));
    assert_eq!(session.receive()["ok"]["protocol"], 1);
    for length in [(16 << 20) + 1, (16 << 20) + 2, (16 << 20) + 3, 40 << 20] {
        session.bytes(&line(length));
        let answer = session.receive();
        assert_eq!((&answer["id"], &answer["error"]["code"]), (&Json::Null, &"too-large".into()), "{length}");
    }
    // The input may end within a line.
    session.bytes(b"{\"id\":7,\"op\":\"hello\"}");
    drop(session.stdin.take());
    assert_eq!(session.receive()["id"], 7);
    session.end(&desk);
}

#[test]
fn a_host_that_dies_leaves_no_process_and_no_folder() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "open", "text": LONG }));
    session.send(json!({ "op": "render", "graph": "g1" }));
    assert_eq!(desk.names("tmp").len(), 1);
    // The thread that reads ends at the next line, and closes the pipe.
    drop(session.stdin.take());
    session.lines = channel().1;
    let bridge = &mut session.bridge;
    let start = Instant::now();
    while bridge.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < Duration::from_secs(60), "the process goes on");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(desk.names("tmp").is_empty(), "{:?}", desk.names("tmp"));
}

#[test]
#[cfg(unix)]
fn a_signal_removes_the_folder() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "hello" }));
    assert_eq!(desk.names("tmp").len(), 1);
    let id = session.bridge.id().to_string();
    assert!(std::process::Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    session.bridge.wait().unwrap();
    assert!(desk.names("tmp").is_empty());
}

#[test]
fn requests_in_a_pipe_are_all_answered() {
    let desk = Desk::new();
    let mut session = Session::start(&desk);
    session.send(json!({ "op": "open", "text": TEXT }));
    for _ in 0..3 {
        session.send(json!({ "op": "render", "graph": "g1", "output": "noise" }));
    }
    drop(session.stdin.take());
    let rest: String = session.lines.iter().collect();
    assert_eq!(rest.matches("\"computed\":1").count(), 3, "{rest}");
    session.end(&desk);
}

/// A solid, and a picture of it on the canvas.
const WOOD: &str = r#"(version: 1, canvas: (size_mm: 40, resolution: 32, seed: 1),
  nodes: {
    "curve": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
    "tree": FitSkeleton(curve: "curve"),
    "time": TrunkTime(tree: "tree"),
    "pattern": ColorPattern(),
    "wood": RingColor(time: "time", pattern: "pattern"),
    "color": CutPlane(solid: "wood"),
    "m": Material(base_color: "color"),
  },
  outputs: { "m": "m" })
"#;

#[test]
fn solids_are_cut_along_a_mesh() {
    let desk = Desk::new();
    let quad = "v 0 20 0\nv 40 20 0\nv 40 20 40\nv 0 20 40\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    desk.write("quad.obj", quad);
    desk.write("twice.obj", format!("{quad}v 0 30 0\nv 40 30 0\nv 40 30 40\nf 5/1 6/2 7/3\n"));
    let mut session = Session::start(&desk);
    session.ok(json!({ "op": "open", "text": WOOD }));
    let mesh = session.ok(json!({ "op": "mesh", "file": desk.path("quad.obj"), "unit": "mm", "up": "Z" }));
    let wanted = json!({ "mesh": "o2", "triangles": 2, "uv": true, "overlaps": 0.0, "size_mm": 40.0, "density_mm": [40.0, 40.0] });
    assert_eq!(mesh, wanted);
    let on = |mesh: &str| {
        json!({ "op": "render", "graph": "g1", "slot": "m", "on": { "mesh": mesh, "by": "Part",
            "place": { "move": [1, 40, 0], "turn": [0, 10, 0] } } })
    };
    let worn = session.ask(on("o2"));
    assert_eq!((worn.len(), &worn[0]["channel"]), (2, &"base_color".into()), "{worn:?}");

    // The same cut, written in the graph.
    let cut = r#""mesh": LoadMesh(path: "quad.obj", unit: Mm, up: Z), "atlas": MeshAtlas(mesh: "mesh"),
        "placed": PlaceInTree(solid: "wood", position: (1, 40, 0), turn: (0, 10, 0)),
        "color": BakeSolid(atlas: "atlas", solid: "placed", by: Part)"#;
    desk.write("cut.ron", WOOD.replace(r#""color": CutPlane(solid: "wood")"#, cut));
    session.ok(json!({ "op": "open", "graph": desk.path("cut.ron") }));
    let written = session.ask(json!({ "op": "render", "graph": "g3" }));
    let along = file(&worn[0]);
    assert!(along == file(&written[0]), "the picture on the mesh is another one");
    let flat = session.ask(json!({ "op": "render", "graph": "g1" }));
    assert!(along != file(&flat[0]), "the mesh has no effect");

    // Pieces come from other places, as the graph file writes them.
    let spread = json!({ "op": "render", "graph": "g1", "slot": "m", "on": { "mesh": "o2", "by": "Piece",
        "place": { "move": [1, 40, 0], "turn": [0, 10, 0] }, "spread": [30, 30, 9], "turn": 45, "seed": 7 } });
    let moved = file(&session.ask(spread)[0]);
    let by_piece = cut.replace("by: Part", "by: Piece, spread: (30, 30, 9), turn: 45, seed: 7");
    desk.write("moved.ron", WOOD.replace(r#""color": CutPlane(solid: "wood")"#, &by_piece));
    session.ok(json!({ "op": "open", "graph": desk.path("moved.ron") }));
    let written = session.ask(json!({ "op": "render", "graph": "g4" }));
    assert!(moved == file(&written[0]) && moved != along, "pieces have other places");
    let mut far = on("o2");
    far["on"]["spread"] = json!([-1, 0, 0]);
    assert_eq!(session.refused(far), "usage");

    let twice = session.ok(json!({ "op": "mesh", "file": desk.path("twice.obj") }));
    assert!(twice["overlaps"].as_f64().unwrap() > 0.1, "{twice}");
    assert_eq!(session.refused(on(twice["mesh"].as_str().unwrap())), "graph");
    assert_eq!(session.refused(on("o9")), "no-mesh");
    assert_eq!(session.refused(json!({ "op": "mesh", "file": "none.obj" })), "graph");
    assert_eq!(session.ok(json!({ "op": "close", "mesh": "o2" })), json!({}));
    assert_eq!(session.refused(on("o2")), "no-mesh");
    session.end(&desk);
}
