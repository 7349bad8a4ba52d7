//! Bodies of outputs in the lit view of the page.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::page::assert_calm;
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};

const GRAPH: &str = r#"(
  version: 1,
  canvas: (size_mm: 20, resolution: 64, tile: Both),
  params: { "depth": Number(default: 0.4, range: (0, 4), unit: "mm", doc: "Depth") },
  nodes: { "noise": Perlin(size: 5), "height": "= $depth * (noise - 0.5)" },
  outputs: {
    "height": "height",
    "plate": Plate(height: "height", thickness: 1),
    "roll": Roll(height: "height", around: 3),
  },
)
"#;

const FACTS: &str = "document.querySelector('#body-facts ul').textContent";
const SHAPE: &str = "document.querySelector('#shapes [aria-pressed=true]').dataset.shape";

fn choose(page: &mut Page, name: &str) {
    page.eval(&format!("document.querySelector('[data-shape=\"body:{name}\"]').click()"));
    page.wait(&format!("{SHAPE} == 'body:{name}'"));
}

#[test]
fn bodies_of_outputs_are_shown_with_their_figures() {
    let place = Place::new(GRAPH);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait("document.documentElement.dataset.final == 'true'");
    page.key("2");
    page.wait("document.querySelectorAll('[data-shape^=\"body:\"]').length == 2");
    choose(&mut page, "plate");
    page.wait(&format!("{FACTS}.includes('Plate, 20 × 20 × ')"));
    page.wait("Number(document.getElementById('lit').dataset.drawn) > 0");
    assert!(page.eval(FACTS).as_str().unwrap().contains(" mm³"));
    // The body follows the graph.
    let before = page.eval(FACTS);
    place.write(&GRAPH.replace("default: 0.4", "default: 0.6"));
    page.wait(&format!("{FACTS} != {before} && {FACTS}.includes('Plate')"));
    assert_eq!(page.eval(SHAPE), "body:plate");
    choose(&mut page, "roll");
    page.wait(&format!("{FACTS}.includes('Roll')"));
    // A body that cannot be made tells the reason.
    place.write(&GRAPH.replace("default: 0.4", "default: 3.9"));
    page.wait("document.documentElement.dataset.final == 'true'");
    page.eval("document.querySelector('[data-shape=\"body:plate\"]').click()");
    page.wait(&format!("{FACTS}.includes('the wall is')"));
    // A graph without bodies has no such shapes.
    place.write(
        &GRAPH
            .replace("\"plate\": Plate(height: \"height\", thickness: 1),", "")
            .replace("\"roll\": Roll(height: \"height\", around: 3),", ""),
    );
    page.wait("!document.querySelector('[data-shape^=\"body:\"]')");
    page.wait("document.getElementById('body-facts').hidden");
    // The browser tells of the body that was refused.
    assert_calm(&page, "422");
}

#[test]
fn only_bodies_are_given_as_bodies() {
    let place = Place::new(GRAPH);
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(GRAPH.as_bytes());
    let generation = watch.state()["scene"]["generation"].clone();
    for (name, status) in [("plate", 200), ("height", 404), ("none", 404)] {
        assert_eq!(watch.get(&format!("body?g={generation}&o={name}")).0, status, "{name}");
    }
}
