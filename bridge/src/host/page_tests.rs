//! Tests of the requests that pages make: nodes, levels, shapes and meshes.
use super::tests::{asked, host, one};
use super::*;

/// A sub-graph, objects, a material, and a solid.
const GRAPH: &str = r#"(version: 1, canvas: (size_mm: 40, resolution: 32, seed: 1),
  params: { "gain": Number(default: 0.5, range: (0, 2), doc: "How much") },
  graphs: {
    "inner": (nodes: { "cells": Worley(size: 5), "soft": Blur(input: "cells", radius: 1) }, outputs: { "soft": "soft" }),
  },
  nodes: {
    // Wood: a tree.
    "curve": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
    "tree": FitSkeleton(curve: "curve"),
    "time": TrunkTime(tree: "tree"),
    "pattern": ColorPattern(),
    "wood": RingColor(time: "time", pattern: "pattern"),
    "color": CutPlane(solid: "wood"),

    // Bumps.
    "dots": PoissonPoints(pitch: 6),
    "use": Use(graph: "inner"),
    "more": "= use * $gain",
    "ball": MeshShape(shape: Sphere, size: (8, 8, 8)),
    "atlas": MeshAtlas(mesh: "ball"),
    "m": Material(base_color: "color", height: "more"),
  },
  outputs: { "m": "m" })"#;

fn open(host: &mut Serial) -> Json {
    let answer = one(host, &json!({ "id": 1, "op": "open", "graph": "g.ron", "text": GRAPH }));
    assert_eq!(answer["ok"]["graph"], "g1", "{answer}");
    answer["ok"].clone()
}

fn look(host: &mut Serial, target: &str, more: &Json) -> Vec<Message> {
    let mut request = json!({ "id": 2, "op": "look", "graph": "g1", "target": target });
    for (name, value) in more.as_object().unwrap() {
        request[name] = value.clone();
    }
    asked(host, &request)
}

#[test]
fn looks_at_outputs_and_nodes() {
    let mut host = host();
    let opened = open(&mut host);
    assert_eq!((&opened["solid"], &opened["mesh"], &opened["bodies"]), (&true.into(), &true.into(), &json!([])));
    let of_output = look(&mut host, "m.height", &json!({ "size": 16, "set": { "gain": 1 } }));
    assert_eq!((of_output.len(), &of_output[0].json["width"]), (2, &16.into()), "{of_output:?}");
    let rendered = asked(
        &mut host,
        &json!({ "id": 3, "op": "render", "graph": "g1", "output": "m.height", "sizes": [16], "set": { "gain": 1 } }),
    );
    assert_eq!(of_output[0].bytes.as_ref().map(Vec::len), Some(16 * 16 * 4));
    assert_eq!(of_output[0].bytes, rendered[0].bytes, "a look has the samples of a render");
    // The formula is the node by its name, and its number is that of the output.
    let of_node = look(&mut host, "@more", &json!({ "size": 16, "set": { "gain": 1 } }));
    assert_eq!(of_node[0].bytes, of_output[0].bytes);
    assert_eq!(of_node[0].json["meaning"], "number");
    // The first answer tells the work for each node.
    let nodes = of_output[1].json["ok"]["nodes"].as_array().unwrap();
    let state = |name: &str| nodes.iter().find(|node| node["name"] == name).map(|node| node["state"].clone());
    assert_eq!(state("use/soft"), Some("computed".into()), "{nodes:?}");
    assert_eq!(state("ball"), Some("unused".into()), "{nodes:?}");
    let refused = |host: &mut Serial, target: &str, more: Json| {
        look(host, target, &more).pop().unwrap().json["error"]["code"].clone()
    };
    assert_eq!(refused(&mut host, "@none", json!({})), "no-output");
    assert_eq!(refused(&mut host, "@more", json!({ "port": 7 })), "no-output");
    assert_eq!(refused(&mut host, "@more", json!({ "size": 0 })), "usage");
    assert_eq!(refused(&mut host, "@more", json!({ "shape": "teapot" })), "bad-request");
}

#[test]
fn draws_objects() {
    let mut host = host();
    open(&mut host);
    for more in [json!({ "size": 16 }), json!({ "size": 16, "port": 0 })] {
        let messages = look(&mut host, "@dots", &more);
        let object = &messages[0].json;
        assert_eq!((&object["event"], &object["type"]), (&"object".into(), &"Points".into()), "{object:?}");
        assert_eq!(object["drawing"]["size_mm"], json!([40.0, 40.0]));
        assert!(object["drawing"]["points"].as_array().unwrap().len() > 5, "{object:?}");
    }
}

#[test]
fn cuts_solids_along_shapes() {
    let mut host = host();
    open(&mut host);
    let worn = |host: &mut Serial, target: &str, shape: &str| {
        look(host, target, &json!({ "size": 24, "shape": shape })).remove(0)
    };
    let mut found = Vec::new();
    for (shape, size) in [("sphere", [24, 12]), ("cube", [24, 16]), ("leg", [24, 24])] {
        let cut = worn(&mut host, "m.base_color", shape);
        let json = &cut.json;
        assert_eq!([&json["width"], &json["height"]], size.map(Json::from).each_ref(), "{shape}");
        assert_eq!((&json["components"], &json["meaning"]), (&3.into(), &"color".into()), "{shape}");
        found.push(cut.bytes.unwrap());
    }
    assert!(found[0].chunks_exact(12).any(|pixel| pixel != &found[0][..12]), "the rings run through the sphere");
    // A target without a cut has the colour of the solid; a height that no solid gives has no texture.
    assert_eq!(worn(&mut host, "@time", "sphere").json["event"], "picture");
    assert!(worn(&mut host, "@more.height", "sphere").json.contains_key("ok"));
}

#[test]
fn describes_nodes() {
    let mut host = host();
    open(&mut host);
    let about = |host: &mut Serial, target: &str| {
        one(host, &json!({ "id": 2, "op": "about", "graph": "g1", "target": target, "set": { "gain": 1.5 } }))
    };
    let curve = about(&mut host, "@curve")["ok"].clone();
    assert_eq!((&curve["kind"], &curve["line"]), (&"TrunkNodes".into(), &8.into()), "{curve}");
    assert_eq!(curve["text"], "TrunkNodes(height: (-600, 600), count: 7, wander: 9)");
    let count = curve["fields"].as_array().unwrap().iter().find(|field| field["name"] == "count").cloned().unwrap();
    assert_eq!((&count["text"], &count["fixed"]), (&"7".into(), &false.into()));
    let material = about(&mut host, "@m")["ok"].clone();
    assert_eq!(material["channels"], json!(["base_color", "height"]));
    assert_eq!(about(&mut host, "@none")["error"]["code"], "no-output");
}

#[test]
fn lays_out_levels() {
    let mut host = host();
    open(&mut host);
    let level =
        |host: &mut Serial, path: &str| one(host, &json!({ "id": 2, "op": "level", "graph": "g1", "path": path }));
    let whole = level(&mut host, "")["ok"].clone();
    let named =
        |level: &Json, name: &str| level["nodes"].as_array().unwrap().iter().find(|node| node["name"] == name).cloned();
    let (inner, more) = (named(&whole, "use").unwrap(), named(&whole, "more").unwrap());
    assert_eq!((&inner["use"], &inner["members"].as_array().unwrap().len()), (&true.into(), &2));
    assert!(inner["column"].as_u64() < more["column"].as_u64(), "wires run from left to right");
    assert_eq!(named(&whole, "dots").unwrap()["group"], "Bumps");
    assert!(whole["wires"].as_array().unwrap().iter().any(|wire| wire["type"] == "Gray"), "{whole}");
    let inside = level(&mut host, "use")["ok"].clone();
    assert!(named(&inside, "use/cells").is_some(), "{inside}");
    assert_eq!(level(&mut host, "none")["error"]["code"], "no-output");
}

#[test]
fn sends_the_mesh_once() {
    let mut host = host();
    open(&mut host);
    let shape = |host: &mut Serial, more: &Json| {
        let mut request = json!({ "id": 2, "op": "shape", "graph": "g1" });
        for (name, value) in more.as_object().unwrap() {
            request[name] = value.clone();
        }
        asked(host, &request).remove(0)
    };
    let mesh = shape(&mut host, &json!({}));
    let count = |name: &str| usize::try_from(mesh.json[name].as_u64().unwrap()).unwrap();
    assert!(count("indices") > 100 && count("indices") % 3 == 0, "{:?}", mesh.json);
    assert_eq!(mesh.bytes.as_ref().map(Vec::len), Some(44 * count("vertices") + 4 * count("indices")));
    // A ball of 8 mm reaches 4 mm from its middle.
    assert!((mesh.json["per_mm"].as_f64().unwrap() - 0.25).abs() < 0.01, "{:?}", mesh.json);
    let again = shape(&mut host, &json!({ "known": mesh.json["key"] }));
    assert_eq!((&again.json["event"], again.bytes), (&"same".into(), None));
    let marks = shape(&mut host, &json!({ "marks": true }));
    assert_eq!(marks.json["marks"]["charts"].as_array().unwrap().len() * 3, count("indices"));
    // Bodies come in WebAssembly only.
    assert_eq!(shape(&mut host, &json!({ "output": "m" })).json["error"]["code"], "usage");
    let plain = "(version: 1, canvas: (size_mm: 8, resolution: 16), nodes: { \"noise\": Perlin() }, outputs: { \"noise\": \"noise\" })";
    one(&mut host, &json!({ "id": 1, "op": "open", "graph": "g.ron", "text": plain }));
    let missing = one(&mut host, &json!({ "id": 2, "op": "shape", "graph": "g2" }));
    assert_eq!(missing["error"]["code"], "no-output");
}

/// The first sample of the output, with further fields of the request.
fn sample(host: &mut Host, more: &Json) -> f32 {
    let mut request = json!({ "id": 2, "op": "look", "graph": "g1", "target": "more", "size": 8 });
    request.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    let Asked::Job(mut job) = host.ask(request.to_string().as_bytes()) else { panic!("no job") };
    let bytes = job.step(&|_| {}).unwrap().bytes.unwrap();
    f32::from_le_bytes(bytes[..4].try_into().unwrap())
}

fn answered(host: &mut Host, request: &Json) -> Json {
    let Asked::Answer(answer) = host.ask(request.to_string().as_bytes()) else { panic!("{request} takes time") };
    answer.json.into()
}

/// A host with a graph whose output is a constant, and the answer of `open`.
fn constant() -> (Host, Json) {
    const TEXT: &str = r#"(version: 1, canvas: (size_mm: 8, resolution: 8),
  params: { "gain": Number(default: 2, range: (0, 4), doc: "How much") },
  nodes: {
    "flat": "= 0.5",
    "noise": Perlin(size: 2.0),
    "more": "= flat * $gain + 3 + 0 * noise",
  },
  outputs: { "more": "more" })"#;
    let tools = crate::testing::tools();
    let settings = shibo_engine::session::Settings { threads: 1, ..Default::default() };
    let session = Session::new(tools.registry.clone(), &settings).unwrap();
    let mut host = Host::new(session, tools);
    let opened = answered(&mut host, &json!({ "id": 1, "op": "open", "graph": "g.ron", "text": TEXT }));
    assert_eq!(opened["ok"]["graph"], "g1", "{opened}");
    (host, opened["ok"].clone())
}

fn edit(node: &str, field: &str, index: Option<usize>, value: &str) -> Json {
    json!({ "node": node, "field": field, "index": index, "value": value })
}

#[test]
fn tries_values_of_nodes_in_every_request() {
    let (mut host, _) = constant();
    let edits = [edit("flat", "", Some(0), "0.75"), edit("more", "", Some(0), "1")];
    assert_eq!(sample(&mut host, &json!({})), 4.0);
    assert_eq!(sample(&mut host, &json!({ "edits": edits })), 2.5);
    assert_eq!(sample(&mut host, &json!({ "edits": edits, "set": { "gain": 4 } })), 4.0);
    let about = json!({ "id": 3, "op": "about", "graph": "g1", "target": "@flat", "edits": edits });
    assert_eq!(answered(&mut host, &about)["ok"]["fields"][0]["formula"][1], "0.75");
    // Values that do not fit are left out, and told with the reason.
    let wrong = [edit("noise", "size", None, "-1"), edit("gone", "size", None, "1"), edits[0].clone()];
    assert_eq!(sample(&mut host, &json!({ "edits": wrong })), 4.5);
    let tried = answered(&mut host, &json!({ "id": 4, "op": "try", "graph": "g1", "edits": wrong }));
    let refused = tried["ok"]["refused"].as_array().unwrap();
    let mut nodes: Vec<&str> = refused.iter().map(|one| one["edit"]["node"].as_str().unwrap()).collect();
    nodes.sort_unstable();
    assert_eq!(nodes, ["gone", "noise"], "{tried}");
    assert!(refused.iter().all(|one| one["why"].as_str().is_some_and(|why| !why.is_empty())), "{tried}");
    let text = tried["ok"]["text"].as_str().unwrap();
    assert!(text.contains("\"= 0.75\"") && text.contains("Perlin(size: 2.0)"), "{text}");
    // The graph itself stays as it is.
    assert_eq!(sample(&mut host, &json!({})), 4.0);
}

#[test]
fn keeps_values_of_nodes_and_makes_parameters() {
    let (mut host, opened) = constant();
    let keep = |host: &mut Host, more: Json| {
        let mut request = json!({ "id": 5, "op": "keep", "graph": "g1", "sha256": opened["sha256"] });
        request.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        answered(host, &request)
    };
    let edits = [edit("noise", "size", None, "3"), edit("more", "", Some(0), "1")];
    let kept = keep(&mut host, json!({ "edits": edits, "values": { "gain": 4 } }));
    let text = kept["ok"]["text"].as_str().unwrap().to_owned();
    // In the notation of the old values.
    assert!(text.contains("Perlin(size: 3.0)") && text.contains("= flat * $gain + 1 + 0 * noise"), "{text}");
    assert!(text.contains("default: 4,"), "{text}");
    let promoted = keep(&mut host, json!({ "promote": { "node": "noise", "field": "size" } }));
    let text = promoted["ok"]["text"].as_str().unwrap();
    assert!(text.contains("Perlin(size: \"$") && text.contains("default: 2.0"), "{text}");
    let wrong = keep(&mut host, json!({ "edits": [edit("noise", "size", None, "-1")] }));
    assert_eq!((&wrong["error"]["code"], wrong["ok"].is_null()), (&"graph".into(), true), "{wrong}");
    let gone = keep(&mut host, json!({ "promote": { "node": "gone", "field": "size" } }));
    assert_eq!(gone["error"]["code"], "usage", "{gone}");
}
