//! Numbers of formulas on the page of `shibo watch`: they are dragged, and written to the file.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::Browser;
use crate::watching::{Place, Watch};
use serde_json::json;

const ROOT: &str = "document.documentElement.dataset";
const TEXT: &str = r#"(
  canvas: (size_mm: 8, resolution: 64),
  nodes: {
    "noise": Perlin(size: "= 4 * 0.5"),
    "height": "= 0.25 * noise + 1",
  },
  outputs: { "height": "height" },
)
"#;

#[test]
fn writes_numbers_of_formulas() {
    let place = Place::new(TEXT);
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(TEXT.as_bytes());
    let base = watching::sha256(TEXT.as_bytes());
    let post = |node: &str, field: &str, index: usize, value: &str| {
        let edit = json!({ "node": node, "field": field, "index": index, "value": value });
        let change = json!({ "values": { "set": [], "preset": null, "edits": [edit] } });
        watch.post("change", &json!({ "base": base, "change": change, "then": null }).to_string()).0
    };
    for (node, field, index, value, wanted) in [
        ("height", "", 2, "3", 422),
        ("height", "", 0, "-3", 422),
        ("height", "", 0, "3 * noise", 422),
        ("height", "none", 0, "3", 422),
        ("none", "", 0, "3", 422),
        ("noise", "", 0, "3", 422),
    ] {
        assert_eq!(post(node, field, index, value), wanted, "{node} {field} {index} {value}");
        assert_eq!(place.text(), TEXT);
    }
    assert_eq!(post("noise", "size", 1, "1"), 200);
    assert_eq!(place.text(), TEXT.replace("4 * 0.5", "4 * 1.0"));
}

#[test]
fn drags_numbers_of_formulas() {
    let place = Place::new(TEXT);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page.key("g");
    page.wait("document.querySelectorAll('#names option').length == 2");
    page.eval("(() => { const f = document.getElementById('find'); f.value = 'height'; f.onchange(); })()");
    page.wait("document.querySelectorAll('.formula .number').length == 2");
    let found = page.eval("(() => { const n = document.querySelector('.formula .number'); n.scrollIntoView({ block: 'center' }); const b = n.getBoundingClientRect(); return [b.left + 5, b.top + b.height / 2]; })()");
    let [x, y] = std::array::from_fn(|i| found[i].as_f64().unwrap());
    page.mouse("mousePressed", x, y);
    let moved = json!({ "type": "mouseMoved", "x": x + 30.0, "y": y, "button": "left", "buttons": 1 });
    page.call("Input.dispatchMouseEvent", moved);
    page.mouse("mouseReleased", x + 30.0, y);
    // A quarter of the range from 0 to 0.5, over 120 pixels.
    page.wait("document.querySelector('.formula .number input').value == '0.375'");
    assert_eq!(place.text(), TEXT);
    page.press("s", 2);
    let wanted = TEXT.replace("0.25 * noise", "0.375 * noise");
    let sha = watching::sha256(wanted.as_bytes());
    page.wait(&format!("{ROOT}.sha == '{sha}'"));
    assert_eq!(place.text(), wanted);
    assert!(page.complaints.is_empty(), "{:#?}", page.complaints);
}
