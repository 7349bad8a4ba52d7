//! A photograph on the page: compared in words, fitted, and kept as a preset.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::own::drop_file;
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::json;
use std::process::Command;

/// A material with a size and a colour to find.
const MATERIAL: &str = "(
  version: 1,
  canvas: (size_mm: 8, resolution: 128, tile: Both),
  params: {
    \"size\": Number(default: 2.0, range: (0.4, 4), unit: \"mm\", doc: \"Size of the spots\"),
    \"dye\": Color(default: \"#808080\", doc: \"Colour\"),
  },
  nodes: {
    \"spots\": Perlin(size: \"$size\"),
    \"dyed\": \"= $dye * (0.5 + spots)\",
  },
  outputs: { \"lit\": \"dyed\" },
)
";

/// The picture of the graph with other values and another seed.
fn photograph(place: &Place) -> Vec<u8> {
    let dir = place.graph.parent().unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .args([
            "render",
            "graph.ron",
            "-o",
            "photo",
            "--set",
            "seed=9",
            "--set",
            "size=1.0",
            "--set",
            "dye=\"#a07040\"",
        ])
        .args(["--no-cache", "--quiet"])
        .current_dir(dir)
        .status()
        .unwrap();
    assert!(run.success());
    std::fs::read(dir.join("photo/lit.png")).unwrap()
}

const WORDS: &str = "document.getElementById('photo-words')?.textContent";
const STATE: &str = "document.querySelector('#photo .body').dataset.fit";

fn value(page: &mut Page, name: &str) -> String {
    page.eval(&format!("document.getElementById('param-{name}').value")).as_str().unwrap().to_owned()
}

#[test]
fn photograph_is_compared_fitted_and_kept() {
    let place = Place::new(MATERIAL);
    let photo = photograph(&place);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait("document.documentElement.dataset.final == 'true'");
    drop_file(&mut page, "my photo.png", &photo);
    page.wait(&format!("{WORDS}.includes('too coarse')"));
    // It stands beside the picture.
    assert_eq!(page.eval("document.getElementById('tag-a').textContent"), "photograph");
    page.eval("(() => { const w = document.getElementById('photo-width'); w.value = 8; w.onchange(); })()");
    page.eval("document.getElementById('photo-fit').click()");
    // The sliders show the best values so far.
    page.wait("document.querySelector('[data-param=size] .from').textContent == 'tried by the fit'");
    page.wait(&format!("{STATE} == 'done'"));
    let size: f64 = value(&mut page, "size").parse().unwrap();
    assert!((size - 1.0).abs() < 0.15, "{size}");
    let dye = value(&mut page, "dye");
    let part = |at: usize| i32::from_str_radix(&dye[at..at + 2], 16).unwrap();
    for (at, want) in [(1, 0xa0), (3, 0x70), (5, 0x40)] {
        assert!((part(at) - want).abs() < 16, "{dye}");
    }
    let said = "document.querySelector('[data-param=size] .from').textContent";
    assert!(page.eval(said).as_str().unwrap().starts_with("fitted: "));
    // The words follow the new picture.
    page.wait(&format!("!{WORDS}.includes('too coarse')"));
    // The fit is one step of the history.
    page.eval("document.getElementById('undo').click()");
    page.wait("document.getElementById('param-size').value == 2");
    page.eval("document.getElementById('redo').click()");
    page.wait("document.getElementById('param-size').value < 1.2");
    page.eval("document.getElementById('photo-keep').click()");
    page.wait("document.getElementById('notice').textContent == 'Preset my photo kept'");
    let text = place.text();
    assert!(text.contains("// fitted to my photo.png, 8 mm wide: ") && text.contains("\"my photo\": {"), "{text}");
    // All but the presets is as before.
    let without = text.lines().filter(|line| !line.contains("my photo") && !line.trim().starts_with("presets"));
    assert!(MATERIAL.lines().all(|line| without.clone().any(|kept| kept == line)), "{text}");
}

#[test]
fn photographs_that_cannot_be_fitted_are_refused() {
    let place = Place::new(MATERIAL);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait("document.documentElement.dataset.final == 'true'");
    let notice = "document.getElementById('notice').textContent";
    drop_file(&mut page, "torn.png", b"\x89PNG\r\n\x1a\n");
    page.wait(&format!("{notice}.startsWith('torn.png cannot be compared: ')"));
    let generation = watch.state()["scene"]["generation"].clone();
    let (status, answer) = watch.post("photo/fit", &json!({ "g": generation }).to_string());
    assert_eq!((status, String::from_utf8(answer).unwrap().as_str()), (422, "no photograph is on the page"));
}

/// An edit of the file ends a fit: its values would belong to another graph.
#[test]
fn edit_ends_a_fit() {
    let place = Place::new(MATERIAL);
    let photo = photograph(&place);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait("document.documentElement.dataset.final == 'true'");
    drop_file(&mut page, "photo.png", &photo);
    page.wait(&format!("{WORDS}.length > 0"));
    page.eval("document.getElementById('photo-fit').click()");
    page.wait(&format!("{STATE} == 'running'"));
    place.write(&MATERIAL.replace("0.5 + spots", "0.4 + spots"));
    page.wait(&format!("{STATE} == 'cancelled'"));
    assert_eq!(value(&mut page, "size"), "2");
    assert!(!page.eval("document.getElementById('photo-fit').disabled").as_bool().unwrap());
}
