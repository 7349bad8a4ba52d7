//! Light and stage of the 3D view in a real browser: settings have an effect and are kept for the next run.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::json;
use std::collections::BTreeSet;
use std::fmt::Display;
use std::thread::sleep;
use std::time::{Duration, Instant};

const ROOT: &str = "document.documentElement.dataset";
const LIT: &str = "document.getElementById('lit')";

/// A grey material without relief, so that only the light changes the picture.
const GREY: &str = "(
  version: 1,
  canvas: (size_mm: 8, resolution: 64),
  nodes: {
    \"final\": Material(base_color: 0.5, roughness: 0.3),
  },
  outputs: { \"final\": \"final\" },
)
";

fn open(browser: &Browser, watch: &Watch) -> Page {
    let mut page = browser.open(&watch.url);
    page.size(640, 480, 0.5);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page.key("2");
    page.wait(&format!("{LIT}.dataset.drawn > 1"));
    page
}

/// Sets a control of the panel, and waits for the next drawing.
fn set(page: &mut Page, id: &str, value: impl Display, event: &str) {
    page.redraw(&format!(
        "const b = document.getElementById('{id}'); if (b.type == 'checkbox') b.checked = {value}; else b.value = '{value}'; b.{event}()"
    ));
}

/// Quantised colours in the middle of the view, independent of the size of its pixels.
fn seen(page: &mut Page) -> Vec<u64> {
    let script = format!(
        "(() => {{ const s = new OffscreenCanvas(16, 12).getContext('2d'); s.drawImage({LIT}, 0, 0, 16, 12);
            return [...s.getImageData(4, 3, 8, 6).data].map(v => v >> 3); }})()"
    );
    page.eval(&script).as_array().unwrap().iter().map(|v| v.as_u64().unwrap()).collect()
}

#[test]
fn light_and_stage_are_set_and_stay_with_the_graph() {
    let place = Place::new(GREY);
    let browser = Browser::start();
    {
        let watch = Watch::start(&place.graph, &[]);
        let mut page = open(&browser, &watch);
        let high = "document.getElementById('light-lightHeight').value";
        assert_eq!(page.eval(high), "37");
        // A plane is lit at a grazing angle until the user moves the light.
        page.eval("document.querySelector('[data-shape=plane]').click()");
        assert_eq!(page.eval(high), "14");
        page.eval("document.querySelector('[data-shape=sphere]').click()");
        assert_eq!(page.eval(high), "37");
        // Each of the environments of Relief looks different, and so does each change of height, size and direction of
        // the light.
        let scenes = ["Lamp", "Studio", "Overcast", "Window", "Sky"].map(|scene| ("scene", scene, "onchange"));
        let sliders =
            [("lightHeight", "80"), ("lightSize", "4"), ("light", "120")].map(|(id, value)| (id, value, "oninput"));
        let mut looks = BTreeSet::new();
        for (id, value, event) in scenes.into_iter().chain(sliders) {
            set(&mut page, &format!("light-{id}"), value, event);
            // A drawing of an earlier setting may come first.
            let start = Instant::now();
            while !looks.insert(seen(&mut page)) {
                assert!(start.elapsed() < Duration::from_secs(20), "{id} = {value} looks like an earlier setting");
                sleep(Duration::from_millis(50));
            }
        }
        // The shadow falls on the ground below; without it nothing is drawn there.
        let ground = format!(
            "(() => {{ const c = {LIT}; const s = new OffscreenCanvas(c.width, c.height).getContext('2d'); s.drawImage(c, 0, 0);
                return Math.max(...s.getImageData(0, 0.97 * c.height, c.width, 1).data.filter((_, i) => i % 4 == 3)); }})()"
        );
        assert!(page.eval(&ground).as_u64() > Some(20));
        set(&mut page, "light-shadow", false, "onchange");
        // A drawing of an earlier setting may come first.
        page.wait(&format!("{ground} === 0"));
        set(&mut page, "light-backdrop", 2, "onchange");
        let back = "getComputedStyle(document.getElementById('stage')).backgroundColor";
        assert_eq!(page.eval(back), "rgb(119, 119, 119)");
        // Settings are saved shortly after the last change.
        page.eval("new Promise(done => setTimeout(done, 900))");
        assert!(page.complaints.is_empty(), "{:?}", page.complaints);
    }
    let watch = Watch::start(&place.graph, &[]);
    let mut page = open(&browser, &watch);
    let now = "['light-scene', 'light-backdrop', 'light-lightHeight', 'light-lightSize', 'light-light'].map(id => document.getElementById(id).value)";
    assert_eq!(page.eval(now), json!(["Sky", "2", "80", "4", "120"]));
    assert_eq!(page.eval("document.getElementById('light-shadow').checked"), false);
    assert_eq!(page.eval("document.querySelector('#views [data-view=lit]').textContent"), "3D");
}
