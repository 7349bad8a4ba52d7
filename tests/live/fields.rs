//! Values of nodes and parameters on the page of `shibo watch`: texts of fields, their input, and the steps of the
//! history.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::page::{assert_calm, open, wait_for_file};
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch, sha256};
use serde_json::json;
use std::fs;
use std::time::Duration;

const ROOT: &str = "document.documentElement.dataset";

/// A sub-graph whose node computes a value from parameters, with a bracket in a comment.
const BEND: &str = r#"(
  version: 1,
  params: {
    "pitch": Number(default: 1.0, range: (0.1, 20), unit: "mm", doc: "Pitch"),
    "warp": Number(default: 0.2, range: (0, 1), doc: "How far it is bent"),
  },
  nodes: {
    "noise": Perlin(size: "= (4) * $pitch"),
    "bent": Warp(input: "= max(noise, 0.1)", amount: "= $warp * $pitch", size: 3, /* ) */ seed: 4),
  },
  outputs: { "bent": "bent" },
)
"#;

const TEXT: &str = r##"(
  version: 1,
  canvas: (size_mm: 8, resolution: 64),
  imports: { "bend": "bend.ron" },
  params: {
    "low": Number(default: 0.2, range: (0, 1), doc: "The lowest"),
    "high": Number(default: 1.0, range: (0, 4), unit: "mm", doc: "The highest"),
    "tint": Color(default: "#804020", doc: "Tint"),
    "seed": Integer(default: 1, range: (0, 99), doc: "Seed"),
  },
  presets: { "black": { "low": 0.1 }, "oxblood": { "low": 0.1 }, "natural": { "low": 0.1 }, "heavy": { "high": 3 }, "worn": { "high": 2 } },
  nodes: {
    "grain": Use(graph: "bend", with: { "pitch": 0.62, "warp": 0.22 }),
    "noise": Fractal(size: 2.5, octaves: 2, seed: "$seed"),
    "height": Remap(input: "= noise + 0.1 * grain", from: (0, 1), to: ("$low", "$high")),
    "tinted": "= $tint * 1",
  },
  outputs: { "height": "height", "tinted": "tinted" },
)
"##;

fn place() -> Place {
    let place = Place::new(TEXT);
    fs::write(place.graph.with_file_name("bend.ron"), BEND).unwrap();
    place
}

fn select(page: &mut Page, node: &str) {
    page.eval(&format!("(() => {{ const f = document.getElementById('find'); f.value = '{node}'; f.onchange(); }})()"));
    page.wait(&format!("document.querySelector('#inspector:not([hidden]) .name')?.textContent == '{node}'"));
}

#[test]
fn nodes_of_sub_graphs_show_their_own_values() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.querySelectorAll('#names option').length > 4");
    select(&mut page, "grain/bent");
    let field = |name: &str| format!("document.querySelector('[data-field={name}]')");
    assert_eq!(page.eval(&format!("{}.querySelector('.now').textContent", field("amount"))), "0.1364 mm");
    assert_eq!(page.eval(&format!("{}.querySelector('code').textContent", field("amount"))), "\"= $warp * $pitch\"");
    assert_eq!(page.eval(&format!("{}.querySelector('.now').textContent", field("size"))), "3 mm");
    // The file of the sub-graph is not changed by the page.
    assert_eq!(
        page.eval("document.querySelectorAll('.constant input, .constant button, .constant .number').length"),
        0
    );
    let whole = page.eval("document.querySelector('#inspector pre').textContent");
    assert!(whole.as_str().unwrap().ends_with("/* ) */ seed: 4)"), "{whole}");
    let facts = page.eval("document.querySelector('#inspector .facts').textContent");
    assert!(facts.as_str().unwrap().contains("bend.ron"), "{facts}");
    page.screenshot();
    let base = sha256(TEXT.as_bytes());
    for change in [
        json!({ "values": { "set": [], "preset": null, "edits": [{ "node": "grain/bent", "field": "amount", "value": "0.5" }] } }),
        json!({ "promote": { "node": "grain/bent", "field": "amount" } }),
        json!({ "values": { "set": [], "preset": null, "edits": [{ "node": "grain/bent", "field": "input", "index": 0, "value": "1" }] } }),
    ] {
        let wish = json!({ "base": base, "change": change, "then": null }).to_string();
        assert_eq!(watch.post("change", &wish).0, 422, "{change}");
        assert_eq!(place.text(), TEXT);
    }
    // A value that a parameter drives shows the number.
    select(&mut page, "noise");
    assert_eq!(page.eval(&format!("{}.querySelector('input').value", field("size"))), "2.5");
    page.screenshot();
    // Names are readable at the usual width.
    let cut = page.eval(
        "[...document.querySelectorAll('.constant label, .constant .label')].filter(l => l.scrollWidth > l.clientWidth + 1).map(l => l.textContent)",
    );
    assert_eq!(cut, json!([]));
    assert_calm(&page, "");
}

#[test]
fn refused_values_of_nodes_leave_their_fields() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.querySelectorAll('#names option').length > 4");
    select(&mut page, "noise");
    let size = "document.getElementById('field-size')";
    page.eval(&format!("{size}.focus()"));
    page.eval(&format!("{size}.select()"));
    page.call("Input.insertText", json!({ "text": "-3" }));
    page.press("Enter", 0);
    page.wait("document.getElementById('notice').textContent.startsWith('noise: size -3 is not taken: ')");
    page.wait(&format!("{size}.value == '2.5'"));
    // The refused value is no step of the history, and nothing is left to save.
    page.wait("document.getElementById('undo').disabled && document.getElementById('save').disabled");
    assert_eq!(place.text(), TEXT);
    assert_calm(&page, "");
}

#[test]
fn values_of_nodes_are_tried_before_they_are_written() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.querySelectorAll('#names option').length > 4");
    select(&mut page, "noise");
    let before = page.eval(&format!("{ROOT}.picture"));
    let found = page.eval("(() => { const b = document.querySelector('[data-field=size] .field').getBoundingClientRect(); return [b.left + 20, b.top + b.height / 2]; })()");
    let [x, y] = std::array::from_fn(|i| found[i].as_f64().unwrap());
    page.mouse("mousePressed", x, y);
    for step in 1..=4 {
        drag(&mut page, x + 10.0 * f64::from(step), y);
    }
    // The picture changes while the mouse is down, the file does not.
    page.wait(&format!("{ROOT}.picture != '{}'", before.as_str().unwrap()));
    page.mouse("mouseReleased", x + 40.0, y);
    let size = page.eval("document.getElementById('field-size').value").as_str().unwrap().to_owned();
    assert!(size.parse::<f64>().unwrap() > 2.5, "{size}");
    page.wait("document.getElementById('save').textContent == 'Save 1 change'");
    assert_eq!(place.text(), TEXT);
    // A number of a formula is set in the same way.
    select(&mut page, "height");
    page.eval(
        "(() => { const b = document.querySelector('.formula .number input'); b.value = '0.4'; b.onchange(); })()",
    );
    page.wait("document.getElementById('save').textContent == 'Save 2 changes'");
    page.press("s", 2);
    page.wait("document.getElementById('save').disabled");
    let saved = TEXT.replace("size: 2.5", &format!("size: {size}")).replace("0.1 * grain", "0.4 * grain");
    assert_eq!(place.text(), saved);
    wait_for_file(&mut page, &place);
    // One drag is one step; undo brings back the text, and then the values.
    page.press("z", 2);
    page.wait("document.getElementById('save').textContent == 'Save 2 changes'");
    assert_eq!(place.text(), TEXT);
    page.press("z", 2);
    page.wait("document.getElementById('save').textContent == 'Save 1 change'");
    page.press("z", 2);
    page.wait("document.getElementById('save').textContent == 'Saved'");
    // A double click resets.
    select(&mut page, "noise");
    page.eval("(() => { const b = document.getElementById('field-size'); b.value = '4'; b.onchange(); })()");
    page.wait("document.getElementById('save').textContent == 'Save 1 change'");
    page.eval("document.getElementById('field-size').ondblclick(new MouseEvent('dblclick'))");
    page.wait("document.getElementById('field-size').value == '2.5' && document.getElementById('save').disabled");
    assert_calm(&page, "");
}

#[test]
fn a_selected_node_stays_when_the_graph_changes() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.querySelectorAll('#names option').length > 4");
    // The server answers the first question about the node in this way if it has begun to show the next text of the file.
    page.eval(
        "(() => { const real = window.fetch; window.left = 1; window.fetch = (path, options) => { \
         if (!window.left || !String(path).startsWith('look') || !String(path).includes('noise')) return real(path, options); \
         window.left--; return Promise.resolve(new Response(null, { status: 204 })); }; \
         const find = document.getElementById('find'); find.value = 'noise'; find.onchange(); })()",
    );
    page.wait("window.left === 0");
    place.write(&format!("// A comment.\n{TEXT}"));
    page.wait("document.querySelector('#inspector:not([hidden]) .name')?.textContent == 'noise'");
    assert_eq!(page.eval(&format!("{ROOT}.target")), "@noise");
    assert_calm(&page, "");
}

/// The middle of a field, and its width, over which the whole range is dragged.
fn middle(page: &mut Page, name: &str) -> (f64, f64, f64) {
    let found = page.eval(&format!(
        "(() => {{ const s = document.querySelector('[data-param={name}] .field'); s.scrollIntoView({{ block: 'center' }}); const b = s.getBoundingClientRect(); \
         return [b.left + b.width / 2, b.top + b.height / 2, s.clientWidth]; }})()"
    ));
    let [x, y, width] = std::array::from_fn(|i| found[i].as_f64().unwrap());
    (x, y, width)
}

fn drag(page: &mut Page, x: f64, y: f64) {
    let moved = json!({ "type": "mouseMoved", "x": x, "y": y, "button": "left", "buttons": 1 });
    page.call("Input.dispatchMouseEvent", moved);
}

const STEPS: &str = "[...document.querySelectorAll('.looks .look span')].map(s => s.textContent)";

#[test]
fn a_drag_is_one_step_and_moves_nothing() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let (x, y, width) = middle(&mut page, "low");
    page.mouse("mousePressed", x, y);
    drag(&mut page, x + 0.1 * width, y);
    page.wait("document.querySelector('[data-param=low]').classList.contains('changed')");
    page.painted();
    assert_eq!(middle(&mut page, "low").1, y, "the panel moves under the mouse");
    // The mouse rests longer than between two steps.
    std::thread::sleep(Duration::from_millis(1300));
    drag(&mut page, x + 0.2 * width, y);
    // Beyond the end, the value stays.
    drag(&mut page, x + 2.0 * width, y);
    std::thread::sleep(Duration::from_millis(1300));
    drag(&mut page, x + 3.0 * width, y);
    page.mouse("mouseReleased", x + 3.0 * width, y);
    page.wait("document.getElementById('param-low').value == '1'");
    page.tab("history");
    assert_eq!(page.eval(STEPS), json!(["2. low 1", "1. Opened"]));
    page.tab("parameters");
    // Another drag is another step, also at once.
    let (x, y, width) = middle(&mut page, "low");
    page.mouse("mousePressed", x, y);
    drag(&mut page, x - 0.5 * width, y);
    page.mouse("mouseReleased", x - 0.5 * width, y);
    page.tab("history");
    page.wait(&format!("{STEPS}.length == 3"));
    // The same value twice is one step.
    for _ in 0..2 {
        page.eval("(() => { const b = document.getElementById('param-high'); b.value = '9'; b.onchange(); })()");
        page.eval("new Promise(done => setTimeout(done, 1000))");
    }
    page.wait(&format!("{STEPS}[0] == '4. high 4'"));
    page.screenshot();
    page.press("z", 2);
    page.wait("document.getElementById('param-high').value == '1'");
    page.press("z", 2);
    page.wait("document.getElementById('param-low').value == '1'");
    page.press("z", 2);
    page.wait("document.getElementById('param-low').value == '0.2'");
    assert_calm(&page, "");
}

#[test]
fn sliders_change_the_picture_while_looks_are_compared() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("history");
    let slide = |page: &mut Page, name: &str, value: f64| {
        let generation = page.eval(&format!("{ROOT}.generation"));
        page.eval(&format!(
            "(() => {{ const b = document.getElementById('param-{name}'); b.value = {value}; b.onchange(); }})()"
        ));
        page.wait(&format!("{ROOT}.generation != {generation} && {ROOT}.final == 'true'"));
        page.painted();
    };
    slide(&mut page, "seed", 9.0);
    for n in [1, 2] {
        page.eval(&format!("document.querySelector('[aria-label=\"Compare look {n}\"]').click()"));
    }
    page.wait("document.getElementById('tag-b').textContent == '2. seed 9'");
    let right = |page: &mut Page| {
        page.painted();
        let (pixels, width) = page.screenshot();
        let at = |x: usize| pixels[300 * width as usize + x];
        ((300..460).step_by(4).map(at).collect::<Vec<_>>(), (520..700).step_by(4).map(at).collect::<Vec<_>>())
    };
    let before = right(&mut page);
    slide(&mut page, "seed", 30.0);
    page.wait("document.getElementById('tag-b').textContent == 'now'");
    assert_eq!(page.eval("document.getElementById('tag-a').textContent"), "1. Opened");
    let after = right(&mut page);
    assert_ne!(before.1, after.1);
    assert_calm(&page, "");
}

#[test]
fn values_on_their_way_do_not_follow_a_change_of_the_file() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("history");
    page.eval("(() => { const b = document.getElementById('param-low'); b.value = '0.5'; b.onchange(); })()");
    page.press("s", 2);
    // The notice names every value that is written.
    page.wait("document.getElementById('notice').textContent == 'Saved to file: low 0.5'");
    wait_for_file(&mut page, &place);
    // Three values in quick succession, of which the last one waits; and then the first look, whose file is another one.
    page.eval(
        "(() => { const b = document.getElementById('param-high'); for (const v of [2, 2.5, 3]) { b.value = v; b.onchange(); } \
         [...document.querySelectorAll('.looks .look')].at(-1).click(); })()",
    );
    wait_for_file(&mut page, &place);
    page.wait(&format!("{ROOT}.sha == '{}'", sha256(TEXT.as_bytes())));
    page.eval("new Promise(done => setTimeout(done, 1500))");
    assert_eq!(watch.state()["values"]["set"], json!([]));
    assert_eq!(page.eval("document.getElementById('param-high').value"), "1");
    // A colour is saved alone.
    page.eval("(() => { const c = document.getElementById('param-tint'); c.value = '#123456'; c.oninput(); c.onchange(); })()");
    page.press("s", 2);
    page.wait("document.getElementById('notice').textContent == 'Saved to file: tint #123456'");
    assert_eq!(place.text(), TEXT.replace("#804020", "#123456"));
    assert_calm(&page, "");
}

#[test]
fn number_fields_read_what_people_type() {
    let place = place();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let field = |name: &str| format!("document.getElementById('param-{name}')");
    let enter = |page: &mut Page, name: &str, text: &str| {
        page.eval(&format!("({0}.focus(), {0}.select())", field(name)));
        page.call("Input.insertText", json!({ "text": text }));
        page.press("Enter", 0);
    };
    let low = field("low");
    let notice = "document.getElementById('notice').textContent";
    for (text, shown) in [("0,7", "0.7"), ("0.3*2", "0.6"), ("(1 + 2) / 10", "0.3")] {
        enter(&mut page, "low", text);
        page.wait(&format!("{low}.value == '{shown}'"));
        // The bar shows the place in the range.
        let bar = "document.querySelector('[data-param=low] .field').style.getPropertyValue('--at')";
        page.wait(&format!("Math.abs(parseFloat({bar}) - 100 * {shown}) < 0.1"));
    }
    // A value beyond the range is said.
    enter(&mut page, "high", "9");
    page.wait(&format!("{}.value == '4'", field("high")));
    assert_eq!(page.eval(notice), "high goes from 0 to 4 mm: 4 is taken");
    enter(&mut page, "seed", "3.4");
    page.wait(&format!("{}.value == '3'", field("seed")));
    assert_eq!(page.eval(notice), "seed is a whole number: 3 is taken");
    enter(&mut page, "low", "abc");
    page.wait(&format!("{low}.value == '0.3'"));
    assert!(page.eval(notice).as_str().unwrap().contains("is no number"));
    // Arrow keys step by the range.
    page.press("ArrowUp", 0);
    page.wait(&format!("{low}.value == '0.31'"));
    page.press("PageUp", 0);
    page.wait(&format!("{low}.value == '0.41'"));
    // With Shift the steps are fine.
    page.press("ArrowDown", 8);
    page.wait(&format!("{low}.value == '0.409'"));
    page.press("ArrowUp", 8);
    page.wait(&format!("{low}.value == '0.41'"));
    page.press("ArrowDown", 0);
    page.wait(&format!("{low}.value == '0.4'"));
    // While text is typed, undo is that of the text.
    page.eval(&format!("{low}.select()"));
    page.call("Input.insertText", json!({ "text": "0.9" }));
    page.press("z", 2);
    page.eval("new Promise(done => setTimeout(done, 300))");
    assert_eq!(page.eval("document.getElementById('redo').disabled"), true, "no step of the page is undone");
    page.press("Escape", 0);
    page.wait(&format!("{low}.value == '0.4'"));
    page.press("z", 2);
    page.wait(&format!("{low}.value == '0.3' && !document.getElementById('redo').disabled"));
    assert_calm(&page, "");
}

/// A sub-graph that is defined in the same file.
const INSIDE: &str = r#"(
  version: 1,
  canvas: (size_mm: 8, resolution: 64),
  graphs: {
    "bend": (
      params: { "warp": Number(default: 0.1, range: (0, 1), doc: "Warp") },
      nodes: { "noise": Perlin(size: 2), "bent": Warp(input: "noise", amount: "= $warp * 0.5", size: 3) },
      outputs: { "bent": "bent" },
    ),
  },
  nodes: { "grain": Use(graph: "bend", with: { "warp": 0.22 }) },
  outputs: { "grain": "grain" },
)
"#;

#[test]
fn constants_of_sub_graphs_in_the_file_become_their_parameters() {
    let place = Place::new(INSIDE);
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(INSIDE.as_bytes());
    let post = |change: serde_json::Value| {
        let base = sha256(place.text().as_bytes());
        watch.post("change", &json!({ "base": base, "change": change, "then": null }).to_string())
    };
    let (status, said) = post(json!({ "promote": { "node": "grain/bent", "field": "amount" } }));
    assert_eq!((status, place.text().as_str()), (422, INSIDE), "{}", String::from_utf8_lossy(&said));
    let (status, said) = post(json!({ "promote": { "node": "grain/bent", "field": "size" } }));
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&said));
    let text = place.text();
    assert!(text.contains("amount: \"= $warp * 0.5\", size: \"$size\")"), "{text}");
    assert!(text.contains("\"warp\": 0.22") && text.contains("\"size\": Number(default: 3"), "{text}");
    watch.wait_shown(text.as_bytes());
}
