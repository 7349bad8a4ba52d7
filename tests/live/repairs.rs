//! Details of the page of `shibo watch` for long sessions, in a real browser.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::{Value as Json, json};
use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

const ROOT: &str = "document.documentElement.dataset";

fn open(browser: &Browser, watch: &Watch) -> Page {
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page
}

fn wait_for_file(page: &mut Page, place: &Place) {
    let sha = watching::sha256(place.text().as_bytes());
    page.wait(&format!("{ROOT}.sha == '{sha}' && {ROOT}.final == 'true'"));
    page.painted();
}

fn assert_calm(page: &Page) {
    assert!(page.complaints.is_empty(), "{:#?}", page.complaints);
}

/// A graph with presets and with a height whose depth is a parameter.
const DEEP: &str = r##"(
  version: 1,
  canvas: (size_mm: 8, resolution: 128),
  params: {
    "depth": Number(default: 1.0, range: (0, 4), unit: "mm", doc: "Depth"),
    "low": Number(default: 0.0, range: (0, 1), doc: "The lowest"),
    "seed": Integer(default: 1, range: (0, 99), doc: "Seed"),
  },
  presets: { "deep": { "depth": 3.0 }, "flat": { "depth": 0.5 } },
  nodes: {
    "noise": Perlin(size: 2, seed: "$seed"),
    "height": Remap(input: "noise", from: (0, 1), to: (-1, "$depth")),
    "spare": Perlin(size: 1),
  },
  outputs: { "height": "height" },
)
"##;

/// All visible controls that a keyboard should reach.
const CONTROLS: &str = "[...document.querySelectorAll('button, input, select, textarea, summary, a[href], canvas, [role=slider], [role=separator]')] \
    .filter(e => e.checkVisibility() && e.getClientRects().length && !e.disabled && e.tagName != 'SUMMARY' || e.tagName == 'SUMMARY' && e.checkVisibility())";

#[test]
fn every_control_is_reached_by_keyboard_and_nothing_is_cut_off() {
    let place = Place::new(DEEP);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.eval("document.body.focus()");
    for (width, height) in [(600, 900), (900, 1200), (1440, 900)] {
        page.size(width, height, 1.0);
        page.painted();
        page.eval("window.reached = new Set(), document.activeElement.blur()");
        let count = page.eval(&format!("{CONTROLS}.length")).as_u64().unwrap();
        assert!(count > 25, "{count}");
        for _ in 0..count + 5 {
            page.press("Tab", 0);
            // Arrow keys move within a group.
            let in_group = page.eval(
                "(() => { const e = document.activeElement; reached.add(e); const g = e.closest('[data-rove], [role=tablist]'); return g && !window.roving && (window.roving = g, g.querySelectorAll('button').length) || 0; })()",
            );
            for _ in 0..in_group.as_u64().unwrap_or(0) {
                page.press("ArrowRight", 0);
                page.eval("reached.add(document.activeElement)");
            }
            page.eval("window.roving = null");
        }
        let missed =
            page.eval(&format!("{CONTROLS}.filter(e => !reached.has(e)).map(e => e.id || e.outerHTML.slice(0, 90))"));
        assert_eq!(missed, json!([]), "{width} × {height}");
        // The focused control has an outline in the accent colour.
        page.eval("document.getElementById('zoom-in').focus()");
        page.press("Tab", 0);
        let outline = page.eval("getComputedStyle(document.activeElement).outlineStyle + getComputedStyle(document.activeElement).outlineWidth");
        assert_eq!(outline, "solid2px");
        let cut = page.eval(
            "[...document.querySelectorAll('header *, footer *, .tools *')].filter(e => e.checkVisibility()).filter(e => { const b = e.getBoundingClientRect(); \
             return b.width && (b.right > innerWidth + 1 || b.bottom > innerHeight + 1 || b.left < -1 || b.top < -1); }).map(e => e.id || e.textContent)",
        );
        assert_eq!(cut, json!([]), "{width} × {height}");
        let wide = "(() => { const p = document.getElementById('panel'); return p.scrollWidth - p.clientWidth; })()";
        assert_eq!(page.eval(wide), 0, "the panel scrolls sideways at {width} × {height}");
    }
    let pressed = page.eval("[...document.querySelectorAll('#views button, #planes button, #outputs button')].every(b => b.ariaPressed !== null)");
    assert_eq!(pressed, true);
    assert_calm(&page);
}

#[test]
fn thumbnails_equal_reduced_picture() {
    // Thin lines, which nearest sampling at 96 pixels would miss or thicken.
    let place = Place::new(
        "(version: 1, canvas: (size_mm: 64, resolution: 2048), nodes: {
           \"points\": GridPoints(pitch: 2), \"dots\": Dots(points: \"points\", diameter: 0.4),
           \"noise\": Perlin(size: 0.3), \"thin\": Threshold(input: \"noise\", level: 0.6, softness: 0.0),
           \"both\": \"= max(dots, thin)\" },
         outputs: { \"both\": \"both\" })",
    );
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(place.text().as_bytes());
    while watch.state()["done"].is_null() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let generation = watch.state()["scene"]["generation"].as_u64().unwrap();
    let stats: Json = serde_json::from_slice(&watch.get(&format!("stats?g={generation}")).1).unwrap();
    let mut seen = 0;
    for (n, node) in stats.as_array().unwrap().iter().enumerate() {
        let name = node["name"].as_str().unwrap();
        let (status, small) = watch.get(&format!("thumb?g={generation}&n={n}"));
        if status != 200 {
            continue;
        }
        let about: Json =
            serde_json::from_slice(&watch.get(&format!("look?g={generation}&t=@{name}&s=2048")).1).unwrap();
        let whole = watch.get(about["shown"]["picture"].as_str().unwrap()).1;
        let small = image::load_from_memory(&small).unwrap().to_luma8();
        let whole = image::load_from_memory(&whole).unwrap().to_luma8();
        let wanted = image::imageops::thumbnail(&whole, small.width(), small.height());
        let off: u64 = small.iter().zip(wanted.iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        let mean = off as f64 / small.len() as f64;
        assert!(mean <= 8.0, "{name}: {mean}");
        assert!(small.width().max(small.height()) <= 96);
        seen += 1;
    }
    assert!(seen >= 4, "{stats}");
}

#[test]
fn page_marks_only_unreachable_nodes_as_unused() {
    let place = Place::new(DEEP);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.getElementById('graph').dataset.unused !== undefined");
    assert_eq!(page.eval("document.getElementById('graph').dataset.unused"), "spare");
}

/// Standard deviation of grey between two columns of the screen.
fn contrast(page: &mut Page, from: usize, to: usize) -> f64 {
    let (pixels, width) = page.screenshot();
    let all: Vec<f64> = (250..450_usize)
        .flat_map(|y| (from..to).map(move |x| y * width as usize + x))
        .map(|i| f64::from(pixels[i][0]))
        .collect();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    (all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
}

fn slide(page: &mut Page, name: &str, value: f64) {
    let generation = page.eval(&format!("{ROOT}.generation"));
    page.eval(&format!(
        "(() => {{ const b = document.getElementById('param-{name}'); b.value = {value}; b.onchange(); }})()"
    ));
    page.wait(&format!("{ROOT}.generation != {generation} && {ROOT}.final == 'true'"));
    page.painted();
}

#[test]
fn pinned_heights_share_one_range() {
    let place = Place::new(DEEP);
    let watch = Watch::start(&place.graph, &["--set", "depth=0"]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let alone = contrast(&mut page, 280, 440);
    page.key("a");
    slide(&mut page, "depth", 4.0);
    // The shallow height is left, the deep one right; it is five times as deep.
    let (left, right) = (contrast(&mut page, 280, 440), contrast(&mut page, 540, 700));
    assert!(left < 0.4 * right && left < 0.4 * alone, "{alone} {left} {right}");
    let legend = page.eval("document.getElementById('legend').textContent");
    assert!(legend.as_str().unwrap().contains("shared"), "{legend}");
    // The range can be locked, and the legend shows it.
    page.tab("measure");
    page.wait("document.getElementById('white-point').value !== ''");
    page.eval("(() => { const w = document.getElementById('white-point'), b = document.getElementById('black-point'), l = document.getElementById('lock-range'); b.value = -1; w.value = 8; l.checked = true; l.onchange(); })()");
    page.painted();
    let legend = page.eval("document.getElementById('legend').textContent");
    assert!(legend.as_str().unwrap().contains("white 8") && legend.as_str().unwrap().contains("locked"), "{legend}");
    assert!(contrast(&mut page, 540, 700) < 0.8 * right);
    assert_calm(&page);
}

/// The number in the box of a parameter.
fn boxed(page: &mut Page, name: &str) -> String {
    page.eval(&format!("document.getElementById('param-{name}').value")).as_str().unwrap().to_owned()
}

#[test]
fn undoes_every_step() {
    let place = Place::new(DEEP);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    slide(&mut page, "low", 0.5);
    page.eval("new Promise(done => setTimeout(done, 1000))");
    slide(&mut page, "depth", 2.0);
    let lit = "[...document.querySelectorAll('.presets button')].filter(b => b.ariaPressed == 'true').map(b => b.textContent).join()";
    // Values set by hand are marked.
    assert_eq!(page.eval(lit), "as written");
    assert_eq!(page.eval("document.querySelector('.by-hand.on').textContent"), "+ 2 by hand");
    assert_eq!(page.eval("document.querySelector('[data-param=depth] .from').textContent"), "by hand; the file says 1");
    page.eval("document.querySelector('.presets button[value=deep]').click()");
    page.wait(&format!("{ROOT}.final == 'true' && document.getElementById('param-depth').value == '3'"));
    assert_eq!(page.eval(lit), "deep");
    assert_eq!(boxed(&mut page, "low"), "0");
    // Choosing the preset was one step.
    page.press("z", 2);
    page.wait("document.getElementById('param-depth').value == '2'");
    assert_eq!(boxed(&mut page, "low"), "0.5");
    page.press("z", 2);
    page.wait("document.getElementById('param-depth').value == '1'");
    assert_eq!(boxed(&mut page, "low"), "0.5");
    // The buttons undo and redo as well.
    page.eval("document.getElementById('undo').click()");
    page.wait("document.getElementById('param-low').value == '0'");
    assert_eq!(page.eval("document.getElementById('undo').disabled"), true);
    page.press("z", 10);
    page.wait("document.getElementById('param-low').value == '0.5'");
    page.eval("document.getElementById('redo').click()");
    page.wait("document.getElementById('param-depth').value == '2'");
    // The page shows the new value of the file beside the one set by hand.
    place.write(&DEEP.replace("default: 1.0", "default: 1.5"));
    wait_for_file(&mut page, &place);
    assert_eq!(boxed(&mut page, "depth"), "2");
    assert_eq!(
        page.eval("document.querySelector('[data-param=depth] .from').textContent"),
        "by hand; the file says 1.5"
    );
    // Undoing values does not change a file saved by another program.
    page.press("z", 2);
    page.wait("document.getElementById('param-depth').value == '1.5'");
    assert!(place.text().contains("default: 1.5"));
    assert_calm(&page);
}

#[test]
fn page_stays_usable_with_broken_file() {
    let place = Place::new(DEEP);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.size(1440, 900, 1.0);
    let broken = DEEP.replace("Perlin(size: 2", "Perlim(size: 2").replace("\"spare\": Perlin", "\"spare\": Perlum");
    place.write(&broken);
    page.wait(&format!("{ROOT}.errors > 1"));
    let share = page.eval(
        "(() => { const [e, s] = ['errors', 'stage'].map(i => document.getElementById(i).getBoundingClientRect()); return e.width * e.height / (s.width * s.height); })()",
    );
    assert!(share.as_f64().unwrap() > 0.0 && share.as_f64().unwrap() <= 0.1, "{share}");
    page.eval("document.querySelector('#errors [aria-label=Close]').click()");
    // A new value shows in the slider and in the box, and the closed list of errors stays closed.
    page.eval("(() => { const b = document.getElementById('param-depth'); b.value = 2.5; b.onchange(); })()");
    watch.wait_for(|e| e["event"] == "error");
    page.eval("new Promise(done => setTimeout(done, 800))");
    assert_eq!(
        page.eval("document.querySelector('[data-param=depth] .field').style.getPropertyValue('--at')"),
        "62.5%"
    );
    assert_eq!(boxed(&mut page, "depth"), "2.5");
    assert_eq!(page.eval("document.getElementById('errors').hidden"), true);
    // Different errors open the list again.
    place.write(&broken.replace("Perlum", "Perlem"));
    page.wait("!document.getElementById('errors').hidden");
    // After the repair the value still counts.
    place.write(DEEP);
    page.wait(&format!("{ROOT}.errors == '0' && {ROOT}.final == 'true'"));
    assert_eq!(boxed(&mut page, "depth"), "2.5");
    assert_calm(&page);
}

#[test]
fn answers_among_300_foreign_connections() {
    let place = Place::new(DEEP);
    let watch = Watch::start(&place.graph, &[]);
    let (port, token) = watch.address();
    let mut strangers = Vec::new();
    for i in 0..300 {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        // A third stays silent, a third sends half a request, a third is refused.
        let said = [&b""[..], b"GET / HTTP/1.1\r\nHost: 127", b"GET /x/ HTTP/1.1\r\nHost: evil.example\r\n\r\n"][i % 3];
        let _ = stream.write_all(said);
        strangers.push(stream);
    }
    let start = Instant::now();
    assert_eq!(watch.get("state").0, 200);
    let took = start.elapsed();
    println!("answered after {took:?} beside 300 strangers");
    // Connections without a token are closed after 15 seconds; the request does not wait for that.
    assert!(took < Duration::from_secs(10), "{took:?}");
    // Connections that know the token stay open while new ones come.
    let mut known = TcpStream::connect(("127.0.0.1", port)).unwrap();
    let ask = format!("GET /{token}/state HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n");
    for _ in 0..2 {
        known.write_all(ask.as_bytes()).unwrap();
        let mut head = [0; 12];
        std::io::Read::read_exact(&mut known, &mut head).unwrap();
        assert_eq!(&head, b"HTTP/1.1 200");
        let mut rest = [0; 65536];
        let _ = std::io::Read::read(&mut known, &mut rest).unwrap();
        strangers.extend((0..100).map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap()));
    }
}

#[test]
fn keys_act_in_visible_view_and_settings_persist() {
    let place = Place::new(DEEP);
    let browser = Browser::start();
    let theme = {
        let watch = Watch::start(&place.graph, &[]);
        let mut page = open(&browser, &watch);
        page.press("2", 0);
        page.wait(&format!("{ROOT}.view == 'lit'"));
        for key in ["t", "h", "r", "9"] {
            page.press(key, 0);
        }
        assert_eq!(
            page.eval("document.getElementById('repeat').ariaPressed + document.getElementById('seam').ariaPressed"),
            "falsefalse"
        );
        assert_eq!(page.eval("document.querySelector('[data-plane=all]').ariaPressed"), "true");
        page.press("1", 0);
        page.press("t", 0);
        assert_eq!(page.eval("document.getElementById('repeat').ariaPressed"), "true");
        page.press("d", 0);
        page.press("p", 0);
        // Removing the selected node and thumbnails of objects cause no errors.
        page.press("g", 0);
        page.wait("document.querySelectorAll('#names option').length > 0");
        page.eval("(() => { const f = document.getElementById('find'); f.value = 'spare'; f.onchange(); })()");
        page.wait(&format!("{ROOT}.shown == '@spare'"));
        place.write(&DEEP.replace("\"spare\": Perlin(size: 1),", ""));
        page.wait(&format!("{ROOT}.shown == 'height' && {ROOT}.final == 'true'"));
        assert_calm(&page);
        page.eval(&format!("{ROOT}.theme")).as_str().unwrap().to_owned()
    };
    // Another run uses another port.
    let watch = Watch::start(&place.graph, &[]);
    let mut page = open(&browser, &watch);
    assert_eq!(page.eval(&format!("{ROOT}.theme")), *theme);
    assert_eq!(page.eval("document.getElementById('panel').hidden"), true);
    page.press("d", 0);
    assert_ne!(page.eval(&format!("{ROOT}.theme")), *theme);
}
