//! Tests of requests without a transport.
use super::*;
use shibo_engine::session::Settings;

pub(super) fn host() -> Serial {
    let tools = crate::testing::tools();
    let session = Session::new(tools.registry.clone(), &Settings { threads: 1, ..Settings::default() }).unwrap();
    Serial::new(Host::new(session, tools))
}

/// All messages of a request.
pub(super) fn asked(host: &mut Serial, request: &Json) -> Vec<Message> {
    host.ask(request.to_string().as_bytes());
    std::iter::from_fn(|| host.step()).collect()
}

/// The only message of a request.
pub(super) fn one(host: &mut Serial, request: &Json) -> Json {
    let mut found = asked(host, request);
    assert_eq!(found.len(), 1, "{found:?}");
    found.remove(0).json.into()
}

const GRAPH: &str = r##"(version: 1, canvas: (size_mm: (8, 4), resolution: (16, 8), tile: X, seed: 3),
  params: { "gain": Number(default: 0.5, range: (0, 2), unit: "mm", doc: "How much"), "tint": Color(default: "#804020") },
  presets: { "strong": { "gain": 2 } },
  nodes: { "noise": Perlin(), "more": "= noise * $gain", "seen": Image(path: "a.png"),
    "m": Material(base_color: "$tint", height: "more") },
  outputs: { "m": "m", "noise": "noise", "seen": "seen" })"##;

fn open(host: &mut Serial) -> Json {
    // A picture of one white pixel.
    let png = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";
    one(host, &json!({ "id": 1, "op": "open", "graph": "g.ron", "text": GRAPH, "files": { "a.png": png } }))
}

#[test]
fn opens_texts_with_files_and_tells_params() {
    let answer = open(&mut host());
    let ok = &answer["ok"];
    assert_eq!((&answer["id"], &ok["graph"]), (&1.into(), &"g1".into()), "{answer}");
    let gain = json!({ "name": "gain", "type": "Number", "value": 0.5, "default": 0.5, "range": [0.0, 2.0], "unit": "mm",
        "group": null, "doc": "How much", "options": null });
    let mut found = ok["params"][0].clone();
    let source = found.as_object_mut().unwrap().remove("source").unwrap();
    assert_eq!((found, &source["value"]), (gain, &"0.5".into()));
    assert_eq!(ok["presets"], json!({ "strong": { "gain": 2 } }));
    assert_eq!(ok["canvas"], json!({ "size_mm": [8.0, 4.0], "resolution": [16, 8], "tile": "X", "seed": 3 }));
    assert_eq!(ok["outputs"][0], json!({ "name": "m", "type": "Material", "channels": ["base_color", "height"] }));
}

#[test]
fn renders_each_picture_at_each_size() {
    let mut host = host();
    open(&mut host);
    let messages = asked(&mut host, &json!({ "id": 2, "op": "render", "graph": "g1", "sizes": [8, 16] }));
    let names: Vec<String> = messages
        .iter()
        .map(|one| {
            format!(
                "{}{}{}",
                one.json["id"],
                one.json.get("output").unwrap_or(&Json::Null),
                one.json.get("width").unwrap_or(&Json::Null)
            )
        })
        .collect();
    assert_eq!(names.len(), 9, "{names:?}");
    assert!(messages[8].json["ok"]["computed"] == 8, "{messages:?}");
    let color = &messages[0].json;
    assert_eq!(
        (&color["channel"], &color["components"], color["value"].as_array().map(Vec::len)),
        (&"base_color".into(), &3.into(), Some(3))
    );
    let height = &messages[5];
    assert_eq!(
        (&height.json["channel"], &height.json["unit"], &height.json["final"]),
        (&"height".into(), &"mm".into(), &true.into())
    );
    assert_eq!(height.bytes.as_ref().map(Vec::len), Some(16 * 8 * 4));

    let render = |set: Json, rows: &str, components: usize| {
        json!({ "id": 3, "op": "render", "graph": "g1", "output": "m.height",
        "set": set, "rows": rows, "components": components })
    };
    let floats = |host: &mut Serial, request: &Json| -> Vec<f32> {
        let bytes = asked(host, request).remove(0).bytes.unwrap();
        bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
    };
    let plain = floats(&mut host, &render(json!({}), "top", 1));
    let four = floats(&mut host, &render(json!({ "gain": 1 }), "bottom", 4));
    assert_eq!(four[(7 * 16 + 5) * 4..][..4], [plain[5] * 2.0, plain[5] * 2.0, plain[5] * 2.0, 1.0]);
}

#[test]
fn explains_what_is_wrong() {
    let mut host = host();
    let code = |host: &mut Serial, request: Json| one(host, &request)["error"]["code"].as_str().map(str::to_owned);
    assert_eq!(code(&mut host, json!({ "id": 1, "op": "fly" })).as_deref(), Some("unknown-op"));
    assert_eq!(code(&mut host, json!({ "op": "hello" })).as_deref(), Some("bad-request"));
    assert_eq!(code(&mut host, json!({ "id": 1, "op": "open" })).as_deref(), Some("bad-request"));
    assert_eq!(code(&mut host, json!({ "id": 1, "op": "render", "graph": "g9" })).as_deref(), Some("no-graph"));
    assert_eq!(code(&mut host, json!({ "id": 1, "op": "open", "graph": "shibo:nothing" })).as_deref(), Some("graph"));
    assert_eq!(
        code(&mut host, json!({ "id": 1, "op": "open", "text": "()", "files": { "a": "*" } })).as_deref(),
        Some("bad-request")
    );
    host.ask(b"{");
    let message = host.step().unwrap();
    assert_eq!((&message.json["id"], &message.json["error"]["code"]), (&Json::Null, &"bad-request".into()));
    assert!(host.step().is_none());

    // Files outside of the request do not exist, whatever their path.
    let text = GRAPH.replace("a.png", "/etc/passwd");
    let answer = one(&mut host, &json!({ "id": 1, "op": "open", "text": text }));
    assert_eq!(answer["error"]["errors"][0]["code"], "file-not-found", "{answer}");
    let checked = one(&mut host, &json!({ "id": 1, "op": "check", "text": text }));
    let found = &checked["ok"]["diagnostics"][0];
    assert_eq!(
        (&found["code"], &found["level"], &found["line"]),
        (&"file-not-found".into(), &"error".into(), &4.into())
    );

    open(&mut host);
    let wrong = |field: &str, value: Json| {
        let mut request = json!({ "id": 2, "op": "render", "graph": "g1" });
        request[field] = value;
        request
    };
    for (field, value, expected) in [
        ("output", json!("none"), "no-output"),
        ("set", json!({ "gain": 9 }), "graph"),
        ("sizes", json!([0]), "usage"),
        ("components", json!(5), "usage"),
        ("as", json!("gif"), "bad-request"),
    ] {
        assert_eq!(code(&mut host, wrong(field, value)).as_deref(), Some(expected), "{field}");
    }
    assert_eq!(one(&mut host, &json!({ "id": 1, "op": "close", "graph": "g1" }))["ok"], json!({}));
    assert_eq!(code(&mut host, wrong("output", json!("m"))).as_deref(), Some("no-graph"));
}

#[test]
fn leaves_outputs_alone_that_are_not_asked_for() {
    let mut host = host();
    // A hundred triangles cannot show this relief, so the mesh has an error when it is made.
    let text = "(version: 1, canvas: (size_mm: 8, resolution: 16), nodes: { \"ball\": MeshShape(shape: Sphere, size: (8, 8, 8)),
      \"atlas\": MeshAtlas(mesh: \"ball\"), \"noise\": Perlin(), \"m\": Material(height: \"noise\"),
      \"carved\": DisplaceMesh(atlas: \"atlas\", height: \"noise\", triangles: 100) },
      outputs: { \"m\": \"m\", \"carved\": Model(mesh: \"carved\") })";
    one(&mut host, &json!({ "id": 1, "op": "open", "graph": "g.ron", "text": text }));
    let last = |host: &mut Serial, output: Json| {
        asked(host, &json!({ "id": 2, "op": "render", "graph": "g1", "output": output })).pop().unwrap().json
    };
    assert_eq!(last(&mut host, "m.height".into())["ok"]["computed"], 1);
    assert_eq!(last(&mut host, Json::Null)["error"]["errors"][0]["code"], "over-budget");
    let missing = last(&mut host, "none".into());
    assert_eq!(missing["error"]["message"], "there is no picture `none`; there are m.height, carved");
}
