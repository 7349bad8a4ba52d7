//! Tests of photographs as operations of a host.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::Photographs;
use super::held::too_large;
use serde_json::{Value as Json, json};
use shibo_bridge::Tools;
use shibo_bridge::host::{Asked, Host, Job, Message};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Session, Settings};
use shibo_graph::Gate;
use shibo_value::files::Memory;
use std::sync::Arc;

const GRAPH: &str = r#"(version: 1, canvas: (size_mm: 8, resolution: 64, seed: 3),
  params: { "size": Number(default: 2, range: (0.5, 4), doc: "Size"), "gain": Number(default: 1, range: (0.2, 1), doc: "Height") },
  nodes: { "noise": Perlin(size: "$size"), "bumps": "= noise * $gain", "color": "= #808080 * (1 + 0.5 * bumps)",
    "_ball": MeshShape(shape: Sphere, size: (2, 2, 2)) },
  outputs: { "color": "color" })"#;

/// A photograph: 64 × 64 grey pixels with waves of 8 pixels, as a PNG in base64.
fn photo() -> String {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 64, 64);
    encoder.set_color(png::ColorType::Grayscale);
    let pixels: Vec<u8> = (0..64_u8).flat_map(|y| (0..64_u8).map(move |x| x % 8 * 20 + y % 5 * 15)).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    base64(&bytes)
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let letters = |three: &[u8]| {
        let word = (0..3).fold(0_u32, |word, at| word << 8 | u32::from(three.get(at).copied().unwrap_or(0)));
        (0..=three.len()).map(|at| char::from(LETTERS[(word >> (18 - 6 * at) & 63) as usize])).collect::<String>()
    };
    bytes.chunks(3).map(letters).collect()
}

fn host() -> Host {
    let registry = Arc::new(shibo_library::registry());
    let session = Session::new(registry.clone(), &Settings { threads: 1, ..Settings::default() }).unwrap();
    let (gate, cancel) = (Gate::of(Memory::default()), CancelToken::default());
    let tools = Tools { registry, import_paths: Vec::new(), gate, cancel };
    Host::new(session, tools).with(Arc::new(Photographs::default()))
}

fn begun(host: &mut Host, request: &Json) -> Asked {
    host.ask(request.to_string().as_bytes())
}

/// The answer to a request without steps.
fn one(host: &mut Host, request: &Json) -> Json {
    match begun(host, request) {
        Asked::Answer(answer) => answer.json.into(),
        _ => panic!("{request} takes time"),
    }
}

fn job(host: &mut Host, request: &Json) -> Box<Job> {
    match begun(host, request) {
        Asked::Job(job) => job,
        Asked::Answer(answer) => panic!("{:?}", answer.json),
        _ => panic!("{request} is no job"),
    }
}

fn rest(job: &mut Job) -> Vec<Message> {
    std::iter::from_fn(|| job.step(&|_| {})).collect()
}

/// A host with the graph `g1` and the photograph.
fn ready() -> Host {
    let mut host = host();
    assert_eq!(one(&mut host, &json!({ "id": 1, "op": "open", "text": GRAPH }))["ok"]["graph"], "g1");
    let taken = one(&mut host, &json!({ "id": 2, "op": "photo", "name": "felt\u{7}.png", "content": photo() }));
    assert_eq!(taken["ok"], json!({ "name": "felt.png", "size": [64, 64] }), "{taken}");
    host
}

#[test]
fn takes_photographs_in_parts_and_refuses_others() {
    let mut host = ready();
    let whole = photo();
    let (first, second) = whole.split_at(whole.len() / 8 * 4);
    let part =
        |content: &str, more: bool| json!({ "id": 3, "op": "photo", "name": "a", "content": content, "more": more });
    assert_eq!(one(&mut host, &part(first, true))["ok"], json!({}));
    assert_eq!(one(&mut host, &part(second, false))["ok"]["size"], json!([64, 64]));
    let refused = |host: &mut Host, content: &str| one(host, &part(content, false))["error"].clone();
    assert_eq!(refused(&mut host, "*")["code"], "bad-request");
    // A part of a file that was refused is forgotten.
    assert_eq!(one(&mut host, &part(first, true))["ok"], json!({}));
    assert_eq!(refused(&mut host, "*")["code"], "bad-request");
    assert_eq!(one(&mut host, &part(&whole, false))["ok"]["size"], json!([64, 64]));
    let text = refused(&mut host, &base64(b"not a picture"));
    assert_eq!(text["code"], "file", "{text}");
    // Without a photograph there is nothing to compare.
    let beside = one(&mut host, &json!({ "id": 4, "op": "beside", "graph": "g1", "target": "color" }));
    assert_eq!(beside["error"]["code"], "usage", "{beside}");
    let fit = one(&mut host, &json!({ "id": 4, "op": "fit", "graph": "g1" }));
    assert_eq!(fit["error"]["code"], "usage", "{fit}");
}

#[test]
fn refuses_a_large_file_before_its_end() {
    let mut host = host();
    let part = "A".repeat(12 << 20);
    let request = |more: bool| json!({ "id": 3, "op": "photo", "name": "a", "content": part, "more": more });
    for _ in 0..7 {
        assert_eq!(one(&mut host, &request(true))["ok"], json!({}));
    }
    // The eighth part would give 72 MiB.
    let refused = one(&mut host, &request(true));
    assert_eq!(refused["error"]["message"], too_large(), "{refused}");
    // A picture of 60000 × 60000 pixels is refused by its head.
    let mut head = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\0\0\0\0".to_vec();
    head.extend([0; 64]);
    let refused = one(&mut host, &json!({ "id": 3, "op": "photo", "name": "a", "content": base64(&head) }));
    assert_eq!(refused["error"]["code"], "file", "{refused}");
}

#[test]
fn compares_the_picture_in_words() {
    let mut host = ready();
    let beside = |host: &mut Host, more: Json| {
        let mut request = json!({ "id": 5, "op": "beside", "graph": "g1", "target": "color" });
        request.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        let messages = rest(&mut job(host, &request));
        assert_eq!(messages.len(), 1, "{messages:?}");
        Json::from(messages[0].json.clone())
    };
    let plain = beside(&mut host, json!({}));
    assert!(plain["ok"]["words"].as_array().is_some_and(|words| !words.is_empty()), "{plain}");
    // Values and the width count.
    let low = beside(&mut host, json!({ "set": { "gain": 0.2 } }));
    assert!(low["ok"]["contrast"]["value"].as_f64() < plain["ok"]["contrast"]["value"].as_f64(), "{low} {plain}");
    let wide = beside(&mut host, json!({ "mm": 16 }));
    assert_ne!(wide["ok"]["distance"], plain["ok"]["distance"]);
    let edits = |index: usize| json!({ "edits": [{ "node": "color", "field": "", "index": index, "value": "0.1" }] });
    let pale = beside(&mut host, edits(1));
    assert!(pale["ok"]["contrast"]["value"].as_f64() < plain["ok"]["contrast"]["value"].as_f64(), "{pale} {plain}");
    // The formula has two numbers, so this value is left out.
    assert_eq!(beside(&mut host, edits(2)), plain);
    // Meshes are no pictures, and unknown targets are none either.
    assert_eq!(beside(&mut host, json!({ "target": "@_ball" }))["ok"], json!({}));
    assert_eq!(beside(&mut host, json!({ "target": "nothing" }))["error"]["code"], "no-output");
}

#[test]
fn fits_in_steps_and_keeps_the_best_when_it_is_stopped() {
    let mut host = ready();
    let request = json!({ "id": 6, "op": "fit", "graph": "g1", "mm": 8 });
    let mut whole = job(&mut host, &request);
    let messages = rest(&mut whole);
    let (last, news) = messages.split_last().unwrap();
    let ok = &last.json["ok"];
    assert_eq!((&ok["name"], &ok["report"]["renders"]), (&"felt".into(), &news.len().into()), "{ok}");
    assert!(ok["comment"].as_str().unwrap().starts_with("fitted to felt.png, 8 mm wide"), "{ok}");
    let set: Vec<(String, String)> = serde_json::from_value(ok["set"].clone()).unwrap();
    assert_eq!(set.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["size", "gain"]);
    for (count, one) in news.iter().enumerate() {
        assert_eq!((&one.json["event"], &one.json["done"]), (&"fit".into(), &(count + 1).into()));
    }
    assert_eq!(news.last().unwrap().json["total"], news[0].json["total"]);
    // Stopped after some renders: the best of them is the result.
    let mut stopped = job(&mut host, &request);
    for _ in 0..12 {
        assert!(!stopped.step(&|_| {}).unwrap().is_last());
    }
    stopped.token().cancel();
    let end = rest(&mut stopped);
    assert_eq!((end.len(), &end[0].json["ok"]["report"]["interrupted"]), (1, &true.into()), "{end:?}");
    // The preset is written with its comment, and replaced by the next one.
    let opened = one(&mut host, &json!({ "id": 7, "op": "open", "text": GRAPH }))["ok"].clone();
    let keep = json!({ "id": 8, "op": "keep", "graph": opened["graph"], "sha256": opened["sha256"], "preset": "felt",
        "values": { "size": 1.25 }, "comment": "fitted to felt.png" });
    let text = one(&mut host, &keep)["ok"]["text"].as_str().unwrap().to_owned();
    assert!(text.contains("// fitted to felt.png\n") && text.contains(r#""felt": { "size": 1.25 }"#), "{text}");
}

#[test]
fn a_fit_that_is_stopped_before_it_begins_has_no_result() {
    let mut host = ready();
    let mut fit = job(&mut host, &json!({ "id": 6, "op": "fit", "graph": "g1" }));
    fit.token().cancel();
    let end = rest(&mut fit);
    assert_eq!((end.len(), &end[0].json["error"]["code"]), (1, &"cancelled".into()), "{end:?}");
}
