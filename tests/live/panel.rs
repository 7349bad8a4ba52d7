//! The panel of the page of `shibo watch`: tabs, groups and search of parameters, the list of graphs, formats for other
//! programs; and the tools for looking at a picture.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::page::{assert_calm, open};
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::json;
use std::fs;
use std::time::{Duration, Instant};

const ROOT: &str = "document.documentElement.dataset";

const TEXT: &str = r##"(
  version: 1,
  canvas: (size_mm: 40, resolution: 64),
  params: {
    "seed": Integer(default: 1, range: (0, 99), doc: "Seed"),
    "pitch": Number(default: 8, range: (1, 20), unit: "mm", group: "Grain", doc: "Size of the noise"),
    "octaves": Integer(default: 2, range: (1, 6), group: "Grain", doc: "Layers"),
    "low": Number(default: 0, range: (-1, 1), group: "Depth", doc: "The lowest"),
    "high": Number(default: 1, range: (0, 4), unit: "mm", group: "Depth",
      doc: "The highest"),
    "a": Number(default: 1, range: (0, 2)), "b": Number(default: 1, range: (0, 2)), "c": Number(default: 1, range: (0, 2)),
    "tint": Color(default: "#804020", group: "Grain", doc: "Tint"),
  },
  nodes: {
    // The grain: one noise.
    "noise": Fractal(size: "$pitch", octaves: "$octaves", seed: "$seed"),
    "height": Remap(input: "noise", from: (0, 1), to: ("$low", "$high")),

    // Colour. It follows the noise.
    "tinted": "= $tint * noise",
    "sum": "= noise + height * $a * $b * $c",
  },
  outputs: { OUTPUTS },
)
"##;

fn place(outputs: usize) -> Place {
    let list = (0..outputs).map(|n| format!("\"map_{n}\": \"{}\"", ["height", "tinted", "noise", "sum"][n % 4]));
    Place::new(&TEXT.replace("OUTPUTS", &list.collect::<Vec<_>>().join(", ")))
}

fn set(page: &mut Page, name: &str, value: &str) {
    page.eval(&format!(
        "(() => {{ const b = document.getElementById('param-{name}'); b.value = '{value}'; b.onchange(); }})()"
    ));
}

/// Waits until the server shows a file; then the page has time to be loaded again, during which it cannot be asked.
fn loaded_again(watch: &Watch, file: &str) {
    let end = Instant::now() + crate::watching::PATIENCE;
    while watch.state()["file"] != file {
        assert!(Instant::now() < end, "{}", watch.state()["file"]);
        std::thread::sleep(Duration::from_millis(30));
    }
    std::thread::sleep(Duration::from_secs(2));
}

#[test]
fn parameters_stand_in_groups_and_are_found() {
    let place = place(2);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let groups = page.eval("[...document.querySelectorAll('.group')].map(g => [g.querySelector('summary').firstChild.data, ...[...g.querySelectorAll('.param')].map(p => p.dataset.param)])");
    assert_eq!(groups, json!([["Grain", "pitch", "octaves", "tint"], ["Depth", "low", "high"]]));
    // A folded group says how many of its values are set.
    page.eval("document.querySelector('.group summary').click()");
    page.wait("!document.querySelector('.group').open");
    assert_eq!(page.eval("document.getElementById('save').textContent"), "Saved");
    set(&mut page, "pitch", "9");
    set(&mut page, "octaves", "3");
    set(&mut page, "seed", "5");
    page.wait("document.querySelector('.group .set').textContent == '2 set'");
    // Save is filled and says how many changes there are.
    page.wait("document.getElementById('save').textContent == 'Save 3 changes'");
    let filled = "getComputedStyle(document.getElementById('save')).backgroundColor == getComputedStyle(document.querySelector('#tab-parameters')).backgroundColor";
    assert_eq!(page.eval(filled), false);
    // A search opens the groups, and afterwards they are as before.
    let found = "[...document.querySelectorAll('.param')].filter(p => p.checkVisibility()).map(p => p.dataset.param)";
    page.eval("(() => { const f = document.getElementById('param-find'); f.value = 'noise'; f.oninput(); })()");
    page.wait(&format!("JSON.stringify({found}) == '[\"pitch\"]'"));
    page.eval("(() => { const f = document.getElementById('param-find'); f.value = 'depth'; f.oninput(); })()");
    page.wait(&format!("JSON.stringify({found}) == '[\"low\",\"high\"]'"));
    page.eval("(() => { const f = document.getElementById('param-find'); f.value = ''; f.oninput(); })()");
    page.wait("!document.querySelector('.group').open && document.querySelectorAll('.group')[1].open");
    // A declaration on two lines is copied whole.
    set(&mut page, "high", "2");
    page.wait("document.getElementById('save').textContent == 'Save 4 changes'");
    page.eval("document.getElementById('copy').click()");
    let copied = page.eval("document.getElementById('copy').dataset.copied");
    assert!(
        copied.as_str().unwrap().contains(
            "\"high\": Number(default: 2, range: (0, 4), unit: \"mm\", group: \"Depth\",\n      doc: \"The highest\"),"
        ),
        "{copied}"
    );
    page.screenshot();
    assert_calm(&page, "");
}

#[test]
fn many_outputs_have_a_menu() {
    let place = place(12);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    assert_eq!(page.eval("document.querySelectorAll('#outputs button').length"), 8);
    assert_eq!(
        page.eval("[...document.getElementById('more').options].map(o => o.textContent)"),
        json!(["4 more", "map 8", "map 9", "map 10", "map 11"])
    );
    page.eval("(() => { const m = document.getElementById('more'); m.value = 'map_10'; m.onchange(); })()");
    page.wait(&format!("{ROOT}.shown == 'map_10' && document.getElementById('more').value == 'map_10'"));
    page.eval("document.querySelector('#outputs button').click()");
    page.wait(&format!("{ROOT}.shown == 'map_0' && document.getElementById('more').value == ''"));
    assert_calm(&page, "");
}

#[test]
fn another_graph_of_the_folder_is_shown() {
    let place = place(1);
    fs::write(
        place.graph.with_file_name("other.ron"),
        "(canvas: (size_mm: 8, resolution: 32), nodes: { \"x\": Perlin(size: 2) }, outputs: { \"x\": \"x\" })",
    )
    .unwrap();
    fs::write(place.graph.with_file_name("broken.ron"), "(nodes: { \"x\": Perlim() }, outputs: { \"x\": \"x\" })")
        .unwrap();
    fs::write(place.graph.with_file_name("palette.ron"), "(colors: [])").unwrap();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    set(&mut page, "pitch", "9");
    page.press("o", 2);
    let names = "[...document.querySelectorAll('#graphs .list button')].map(b => b.value)";
    page.wait(&format!("{names}.length == 3"));
    assert_eq!(page.eval(names), json!(["broken.ron", "graph.ron", "other.ron"]));
    // The list warns of values that are not in the file.
    page.wait("document.querySelector('#graphs .doc').textContent.includes('pitch 9')");
    page.screenshot();
    page.eval("document.querySelector('#graphs .list button[value=\"other.ron\"]').click()");
    loaded_again(&watch, "other.ron");
    page.wait(&format!(
        "document.getElementById('file')?.textContent == 'other.ron' && {ROOT}.shown == 'x' && {ROOT}.final == 'true'"
    ));
    assert_eq!(watch.state()["values"]["set"], json!([]));
    // Its saves are followed, those of the first one no longer.
    let other = place.graph.with_file_name("other.ron");
    let sha = page.eval(&format!("{ROOT}.sha"));
    place.write(&place.text().replace("size_mm: 40", "size_mm: 41"));
    fs::write(&other, fs::read_to_string(&other).unwrap().replace("size: 2", "size: 3")).unwrap();
    page.wait(&format!("{ROOT}.sha != {sha} && {ROOT}.final == 'true'"));
    assert_eq!(watch.state()["file"], "other.ron");
    // A graph with errors is shown with them, and one can go back.
    assert_eq!(watch.post("open", &json!({ "name": "../graph.ron" }).to_string()).0, 404);
    assert_eq!(watch.post("open", &json!({ "name": "broken.ron" }).to_string()).0, 202);
    loaded_again(&watch, "broken.ron");
    page.wait(&format!("document.getElementById('file')?.textContent == 'broken.ron' && {ROOT}.errors > 0"));
    assert_eq!(watch.post("open", &json!({ "name": "graph.ron" }).to_string()).0, 202);
    loaded_again(&watch, "graph.ron");
    page.wait(&format!("document.getElementById('file')?.textContent == 'graph.ron' && {ROOT}.shown == 'map_0'"));
    assert_calm(&page, "");
}

#[test]
fn the_stage_shows_lengths_and_values() {
    let place = place(2);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    // The bar is as long as it says.
    page.eval("document.getElementById('zoom-one').click()");
    page.painted();
    let bar = page.eval("[document.querySelector('#scale i').getBoundingClientRect().width, parseFloat(document.querySelector('#scale span').textContent)]");
    let [px, mm] = std::array::from_fn(|i| bar[i].as_f64().unwrap());
    // 64 pixels are 40 mm; the footer tells the zoom.
    let zoom = page.eval("parseFloat(document.getElementById('zoom').textContent) / 100").as_f64().unwrap();
    assert!((px / mm / zoom - 64.0 / 40.0).abs() < 0.03, "{bar} {zoom}");
    // Heights have a colour bar with their range; colours have none.
    page.wait("!document.getElementById('ramp').hidden");
    let ends = page.eval("[...document.querySelectorAll('#ramp span')].map(s => parseFloat(s.textContent))");
    assert!(ends[0].as_f64() > ends[1].as_f64(), "{ends}");
    page.key("m");
    page.wait("!document.getElementById('rulers').hidden");
    page.screenshot();
    page.eval("document.querySelectorAll('#outputs button')[1].click()");
    page.wait(&format!("{ROOT}.shown == 'map_1' && document.getElementById('ramp').hidden"));
    assert_calm(&page, "");
}

#[test]
fn two_pictures_flicker_and_slots_keep_looks() {
    let place = place(1);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("look");
    let slots =
        "[...document.querySelectorAll('.slots button')].map(b => b.ariaLabel.endsWith('kept')).map(Number).join('')";
    // Shift and a digit keep the look, and bring it back.
    page.press("1", 8);
    page.wait(&format!("{slots}.startsWith('1')"));
    let first = page.eval(&format!("{ROOT}.picture"));
    set(&mut page, "pitch", "15");
    page.wait(&format!("{ROOT}.picture != {first} && {ROOT}.final == 'true'"));
    page.eval("document.querySelectorAll('.slots button')[1].click()");
    page.wait(&format!("{slots}.startsWith('11')"));
    page.eval("document.querySelectorAll('.slots button')[0].click()");
    page.wait("document.getElementById('param-pitch').value == '8'");
    // A kept look beside the present one.
    page.eval(
        "[...document.querySelectorAll('#slots .segments button')].find(b => b.textContent == 'Compare').click()",
    );
    page.eval("document.querySelectorAll('.slots button')[1].click()");
    page.wait("document.getElementById('tag-a').textContent == 'slot 2'");
    page.eval("document.querySelector('[data-compare=flicker]').click()");
    let shown = "[...document.querySelectorAll('.tag:not([hidden])')].map(t => t.id).join()";
    page.wait(&format!("{shown} == 'tag-a'"));
    page.wait(&format!("{shown} == 'tag-b'"));
    // By hand: the clock stops.
    page.key("x");
    let by_hand = page.eval(shown);
    page.eval("new Promise(done => setTimeout(done, 1500))");
    assert_eq!(page.eval(shown), by_hand);
    page.key("x");
    assert_ne!(page.eval(shown), by_hand);
    assert_calm(&page, "");
}

#[test]
fn a_sheet_of_two_parameters_fills_the_stage() {
    let place = place(1);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("history");
    page.eval("(() => { const v = (id, value) => { document.getElementById('sheet-' + id).value = value; }; v('param', 'pitch'); v('second', 'octaves'); v('count', '4'); document.getElementById('sheet-make').click(); })()");
    page.wait("document.querySelectorAll('.cells canvas[data-drawn]').length == 16");
    page.screenshot();
    let different = page.eval("new Set([...document.querySelectorAll('.cells canvas')].map(c => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.reduce((a, b) => a + b))).size");
    assert_eq!(different, 16);
    // Keys go through the sheet; a picture is enlarged first, and Take sets its values.
    page.press("ArrowDown", 0);
    page.press("ArrowRight", 0);
    page.press("Enter", 0);
    page.wait("document.querySelector('#contact .large')");
    assert_eq!(page.eval("document.getElementById('param-pitch').value"), "8");
    page.press("Escape", 0);
    page.wait("!document.querySelector('#contact .large') && !document.getElementById('contact').hidden");
    page.press("Enter", 0);
    page.wait("document.activeElement.textContent == 'Take'");
    page.press("Enter", 0);
    page.wait("document.getElementById('contact').hidden && document.getElementById('param-octaves').value == '3'");
    assert_eq!(
        page.eval(
            "+document.getElementById('param-pitch').value > 7 && +document.getElementById('param-pitch').value < 8"
        ),
        true
    );
    page.press("z", 2);
    page.wait(
        "document.getElementById('param-pitch').value == '8' && document.getElementById('param-octaves').value == '2'",
    );
    assert_calm(&page, "");
}

#[test]
fn the_graph_can_be_read() {
    let place = place(4);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.getElementById('graph').dataset.computed >= 0");
    let generation = watch.state()["scene"]["generation"].as_u64().unwrap();
    let level: serde_json::Value = serde_json::from_slice(&watch.get(&format!("graph?g={generation}")).1).unwrap();
    let groups: Vec<_> =
        level["nodes"].as_array().unwrap().iter().map(|n| (n["name"].as_str().unwrap(), n["group"].as_str())).collect();
    for (node, group) in [("noise", "The grain"), ("height", "The grain"), ("tinted", "Colour"), ("sum", "Colour")] {
        assert!(groups.contains(&(node, Some(group))), "{groups:?}");
    }
    let wire = level["wires"].as_array().unwrap().iter().find(|w| w["port"] == "input").unwrap();
    assert_eq!(wire["type"], "Gray");
    assert!(page.eval("document.getElementById('types').textContent").as_str().unwrap().contains("Gray"));
    // Shift and arrows follow the wires.
    page.eval("(() => { const f = document.getElementById('find'); f.value = 'height'; f.onchange(); })()");
    page.wait("document.querySelector('#inspector .name')?.textContent == 'height'");
    page.eval("document.getElementById('graph').focus()");
    let at = "document.getElementById('graph-at').textContent";
    page.press("ArrowLeft", 8);
    page.wait(&format!("{at}.startsWith('noise:')"));
    page.press("ArrowRight", 8);
    page.wait(&format!("!{at}.startsWith('noise:')"));
    let first = page.eval(at);
    page.press("ArrowDown", 8);
    page.wait(&format!("{at} != {first} && !{at}.startsWith('noise:')"));
    // The space bar shows a larger picture.
    page.press(" ", 0);
    page.wait("!document.getElementById('peek').hidden && document.querySelector('#peek canvas').width >= 64");
    page.screenshot();
    page.press(" ", 0);
    page.wait("document.getElementById('peek').hidden");
    assert_calm(&page, "");
}
