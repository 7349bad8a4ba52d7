//! Another graph of the folder is shown on the page.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching::{Place, Watch, plain};
use serde_json::Value as Json;
use std::fs;
use std::time::{Duration, Instant};

/// A graph whose evaluation takes many minutes.
const ENDLESS: &str = "(version: 1, canvas: (size_mm: 60, resolution: 64), nodes: { \"f\": Perlin(size: 9), \
    \"p\": GridPoints(pitch: 0.3), \"l\": ConnectNeighbors(points: \"p\", neighbors: Eight), \
    \"s\": DefineSprings(lattice: \"l\", field: \"f\", stiffness: (1, 10)), \
    \"moved\": SimulateSprings(springs: \"s\", step: 0.05, steps: 100000, drag: 6), \
    \"w\": PlaceWrinkles(lattice: \"moved\"), \"d\": DrawWrinkles(segments: \"w\", width: (0.2, 0.4)) }, outputs: { \"mask\": \"d.mask\" })";

fn wait(watch: &Watch, what: &str, is: impl Fn(&Json) -> bool) {
    let begun = Instant::now();
    while !is(&watch.state()) {
        assert!(begun.elapsed() < Duration::from_secs(60), "{what}: {}", watch.state());
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn another_graph_stops_the_work_on_the_shown_one() {
    let place = Place::new(ENDLESS);
    // The other graph has an error, and so is not evaluated itself.
    fs::write(place.graph.with_file_name("broken.ron"), plain(0.5).replace("Remap", "Remapp")).unwrap();
    let watch = Watch::start(&place.graph, &[]);
    wait(&watch, "the work begins", |state| !state["progress"].is_null());
    assert_eq!(watch.post("open", "{ \"name\": \"broken.ron\" }").0, 202);
    wait(&watch, "the error is shown", |state| state["errors"].as_array().is_some_and(|errors| !errors.is_empty()));
    wait(&watch, "the work ends", |state| state["busy"] == false);
}
