//! Editing on the page of `shibo watch` in a real browser: slider values are written to the file, looks are kept and
//! compared, files are exported, and the graph is shown.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::{Value as Json, json};

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

/// A text with comments, odd blanks and CRLF line endings.
fn odd() -> String {
    "// A height.  \r\n(\r\n  version: 1,\r\n  canvas: (size_mm: 8, resolution: 64),\r\n  params: {\r\n    \
     \"depth\":   Number(default: 1.0, range: (0, 4), unit: \"mm\", doc: \"Depth\"), // keep me\r\n    \
     \"tint\": Color(default: (0.1, 0.2, 0.3), doc: \"Tint\"),\r\n    \"seed\": Integer(default: 1, range: (0, 99), doc: \"Seed\"),\r\n  },\r\n  \
     presets: { \"deep\": { \"depth\": 3.0 } },\r\n  nodes: {\r\n    \"noise\": Perlin(size: 2, seed: \"$seed\"), /* and me */\r\n    \
     \"height\": Remap(input: \"noise\", from: (0, 1), to: (-1, \"$depth\")),\r\n    \"tinted\": \"= $tint\",\r\n  },\r\n  \
     outputs: { \"height\": \"height\", \"tinted\": \"tinted\" },\r\n)\r\n"
        .to_owned()
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
fn a_slider_is_saved_to_the_file_and_that_is_undone() {
    let place = Place::new(&odd());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    assert_eq!(page.eval("document.getElementById('save').disabled"), true);
    slide(&mut page, "depth", 2.0);
    page.press("s", 2);
    let saved = odd().replace("default: 1.0", "default: 2.0");
    page.wait(
        "document.getElementById('save').disabled && document.getElementById('notice').textContent == 'Saved to file: depth 2'",
    );
    // No other byte changes.
    assert_eq!(place.text(), saved);
    wait_for_file(&mut page, &place);
    assert_eq!(page.eval("document.getElementById('param-depth').value"), "2");
    assert_eq!(page.eval("document.querySelector('[data-param=depth]').classList.contains('changed')"), false);
    // Ctrl+Z undoes value and file; Ctrl+Shift+Z redoes them.
    page.press("z", 2);
    wait_for_file(&mut page, &place);
    page.wait("document.getElementById('param-depth').value == '2' && !document.getElementById('save').disabled");
    assert_eq!(place.text(), odd());
    page.press("z", 10);
    page.wait("document.getElementById('save').disabled");
    assert_eq!(place.text(), saved);
    wait_for_file(&mut page, &place);
    // With a preset in force, saving writes to the preset. Colours keep their notation.
    page.eval("document.querySelector('.presets button[value=deep]').click()");
    page.wait("document.getElementById('param-depth').value == '3'");
    slide(&mut page, "depth", 3.5);
    page.eval("(() => { const c = document.getElementById('param-tint'); c.value = '#ffffff'; c.oninput(); })()");
    page.wait("document.querySelector('[data-param=tint] .from').textContent.startsWith('by hand')");
    page.eval("document.getElementById('save').click()");
    page.wait("document.getElementById('notice').textContent == 'Saved to preset deep: depth 3.5, tint #ffffff'");
    let deep = saved.replace("{ \"depth\": 3.0 }", "{ \"depth\": 3.5, \"tint\": (1.0, 1.0, 1.0) }");
    assert_eq!(place.text(), deep);
    wait_for_file(&mut page, &place);
    assert_eq!(page.eval("document.getElementById('param-depth').value"), "3.5");
    // Saves the current values as a new preset.
    slide(&mut page, "seed", 7.0);
    page.eval("(() => { document.getElementById('preset-name').value = 'mine'; })()");
    page.eval("[...document.querySelectorAll('#parameters button')].find(b => b.textContent == 'New preset').click()");
    page.wait("document.querySelector('.presets button[value=mine]')?.ariaPressed == 'true'");
    let mine = ", \"mine\": { \"depth\": 3.5, \"tint\": (1.0, 1.0, 1.0), \"seed\": 7 } }";
    assert!(place.text().contains(mine), "{}", place.text());
    assert_calm(&page);
}

#[test]
fn refuses_to_write_changed_file() {
    let place = Place::new(&odd());
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(place.text().as_bytes());
    let base = watching::sha256(place.text().as_bytes());
    let wish = |base: &str, change: Json| json!({ "base": base, "change": change, "then": null }).to_string();
    let deeper = json!({ "values": { "set": [["depth", "2"]], "preset": null } });
    let other = odd().replace("Seed", "Sowing");
    place.write(&other);
    let (status, text) = watch.post("change", &wish(&base, deeper.clone()));
    assert_eq!((status, place.text()), (409, other.clone()));
    assert!(String::from_utf8_lossy(&text).contains("has changed meanwhile"));
    let now = watching::sha256(other.as_bytes());
    watch.wait_shown(other.as_bytes());
    for (change, wanted) in [
        (json!({ "values": { "set": [["none", "2"]], "preset": null } }), 422),
        (json!({ "values": { "set": [["depth", "2"]], "preset": "none" } }), 422),
        (json!({ "values": { "set": [["depth", "9"]], "preset": null } }), 422),
        (json!({ "values": { "set": [["depth", "1), nodes: ("]], "preset": null } }), 422),
        (json!({ "preset": { "name": "deep", "set": [] } }), 422),
        (json!({ "preset": { "name": "a\"b", "set": [] } }), 422),
        (json!({ "promote": { "node": "none", "field": "size" } }), 404),
        (
            json!({ "values": { "set": [], "preset": null, "edits": [{ "node": "noise", "field": "size", "value": "-3" }] } }),
            422,
        ),
        (
            json!({ "values": { "set": [], "preset": null, "edits": [{ "node": "noise", "field": "size", "value": "1), b: (" }] } }),
            422,
        ),
        (json!({ "restore": { "to": "none" } }), 422),
        (json!({ "other": {} }), 400),
    ] {
        assert_eq!(watch.post("change", &wish(&now, change.clone())).0, wanted, "{change}");
        assert_eq!(place.text(), other);
    }
    // Requests with a wrong origin write nothing.
    let (port, token) = watch.address();
    let body = wish(&now, deeper.clone());
    for origin in ["", "Origin: null\r\n", "Origin: http://evil.example\r\n"] {
        let request = format!(
            "POST /{token}/change HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{origin}Content-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        );
        assert_eq!(watching::split(&watch.raw(request.as_bytes())).0, 403, "{origin}");
    }
    assert_eq!(place.text(), other);
    assert_eq!(watch.post("change", &body).0, 200);
    assert_eq!(place.text(), other.replace("default: 1.0", "default: 2.0"));
}

#[test]
fn constants_of_nodes_are_edited_and_become_parameters() {
    let place = Place::new(&odd());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.querySelectorAll('#names option').length == 3");
    page.eval("(() => { const f = document.getElementById('find'); f.value = 'noise'; f.onchange(); })()");
    page.wait("document.getElementById('field-size')");
    page.eval("(() => { const b = document.getElementById('field-size'); b.value = 3; b.onchange(); })()");
    page.press("s", 2);
    page.wait("document.getElementById('notice').textContent == 'Saved to file: noise size 3'");
    assert_eq!(place.text(), odd().replace("Perlin(size: 2", "Perlin(size: 3"));
    wait_for_file(&mut page, &place);
    page.wait("document.getElementById('field-size')?.value == '3'");
    page.wait("!document.querySelector('[data-field=size] button').disabled");
    page.eval("document.querySelector('[data-field=size] button').click()");
    page.wait("document.getElementById('param-size')");
    assert!(place.text().contains("Perlin(size: \"$size\", seed"), "{}", place.text());
    assert!(!place.text().replace("\r\n", "").contains('\n'), "line endings are kept");
    wait_for_file(&mut page, &place);
    for wanted in [odd().replace("Perlin(size: 2", "Perlin(size: 3"), odd()] {
        page.press("z", 2);
        let sha = watching::sha256(wanted.as_bytes());
        page.wait(&format!("{ROOT}.sha == '{sha}'"));
        assert_eq!(place.text(), wanted);
    }
    assert_calm(&page);
}

#[test]
fn looks_are_kept_and_compared() {
    let place = Place::new(&odd());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("history");
    slide(&mut page, "seed", 9.0);
    page.eval("new Promise(done => setTimeout(done, 1000))");
    slide(&mut page, "depth", 4.0);
    place.write(&odd().replace("Depth", "How deep"));
    wait_for_file(&mut page, &place);
    let labels = "[...document.querySelectorAll('.looks .look span')].map(s => s.textContent)";
    page.wait(&format!("{labels}.length == 4"));
    assert_eq!(page.eval(labels), json!(["4. File saved", "3. depth 4", "2. seed 9", "1. Opened"]));
    // Each look has a picture that is not blank.
    let seen = page.eval("[...document.querySelectorAll('.looks canvas')].map(c => new Set(c.getContext('2d').getImageData(0, 0, 84, 84).data).size)");
    assert!(seen.as_array().unwrap().iter().all(|n| n.as_u64() > Some(8)), "{seen}");
    // Compares two looks without pinning.
    let mark = |n: usize| format!("document.querySelector('[aria-label=\"Compare look {n}\"]').click()");
    page.eval(&mark(1));
    page.eval(&mark(3));
    page.wait(
        "!document.getElementById('compares').hidden && document.getElementById('tag-b').textContent == '3. depth 4'",
    );
    assert_eq!(page.eval("document.getElementById('tag-a').textContent"), "1. Opened");
    for mode in ["side", "difference", "wipe"] {
        page.eval(&format!("document.querySelector('[data-compare={mode}]').click()"));
        page.painted();
        let (pixels, width) = page.screenshot();
        let row: Vec<_> = (200..1000).step_by(5).map(|x| pixels[300 * width as usize + x]).collect();
        assert!(row.iter().collect::<std::collections::BTreeSet<_>>().len() > 20, "{mode}");
    }
    // The difference in numbers; outside of that mode the legend has none.
    let legend = "document.getElementById('legend').textContent";
    assert!(!page.eval(legend).as_str().unwrap().contains("difference"));
    page.eval("document.querySelector('[data-compare=difference]').click()");
    let said = page.eval(legend);
    let number = |of: &str| -> f64 {
        let said = said.as_str().unwrap();
        said.split_once(of).unwrap_or_else(|| panic!("{said}")).1.split_whitespace().next().unwrap().parse().unwrap()
    };
    let (mean, rms, most) = (number("mean difference"), number("RMS"), number("most"));
    assert!(0.0 < mean && mean < rms && rms < most, "{said}");
    page.eval("document.querySelector('[data-compare=wipe]').click()");
    // Arrow keys move the dividing line.
    page.eval("document.getElementById('wipe').focus()");
    page.press("ArrowRight", 0);
    assert_eq!(page.eval("document.getElementById('wipe').ariaValueNow"), "52");
    page.eval(&mark(1));
    page.wait("document.getElementById('compares').hidden");
    // A click on a look restores its values and the file.
    page.eval("[...document.querySelectorAll('.looks .look')].at(-1).click()");
    page.wait(
        "document.getElementById('param-seed').value == '1' && document.getElementById('param-depth').value == '1'",
    );
    wait_for_file(&mut page, &place);
    assert_eq!(place.text(), odd());
    assert_calm(&page);
}

/// A material small enough to export quickly.
const MATERIAL: &str = "(
  version: 1,
  canvas: (size_mm: 8, resolution: 64),
  nodes: {
    \"noise\": Perlin(size: 2),
    \"final\": Material(base_color: \"noise\", roughness: 0.5, height: \"noise\"),
  },
  outputs: { \"final\": \"final\", \"noise\": \"noise\" },
)
";

#[test]
fn maps_and_models_are_exported() {
    let place = Place::new(MATERIAL);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let downloads = tempfile::tempdir().unwrap();
    let way = json!({ "behavior": "allow", "browserContextId": browser.context, "downloadPath": downloads.path() });
    page.call("Browser.setDownloadBehavior", way);
    page.tab("export");
    for (what, size, format, name, begin) in [
        ("map", "256", "png", "final_base_color.png", &b"\x89PNG"[..]),
        ("maps", "", "exr", "graph.zip", b"PK"),
        ("gltf", "256", "", "final.glb", b"glTF"),
    ] {
        page.eval(&format!(
            "(() => {{ const v = (id, value) => {{ document.getElementById('export-' + id).value = '' + value; }}; v('what', '{what}'); v('size', '{size}'); v('format', '{format}'); document.getElementById('export-begin').click(); }})()"
        ));
        page.wait(&format!("document.getElementById('export-note').textContent.startsWith('{name}')"));
        let bytes = std::fs::read(watching::downloaded(downloads.path(), name)).unwrap();
        assert!(bytes.starts_with(begin), "{name}");
        if what == "map" {
            assert_eq!(image::load_from_memory(&bytes).unwrap().width(), 256);
        }
    }
    // Exports the material in light as one HTML page, which opens without a server. Without a graphics card, large
    // views are slow.
    page.size(640, 480, 0.5);
    page.key("2");
    page.wait("document.getElementById('lit').dataset.drawn > 1");
    page.eval("document.getElementById('share').click()");
    page.wait("document.getElementById('export-note').textContent.startsWith('graph.html')");
    let path = watching::downloaded(downloads.path(), "graph.html");
    let mut alone = browser.open(&format!("file://{}", path.display()));
    alone.size(640, 480, 0.5);
    alone.wait("document.querySelector('canvas')?.dataset.drawn > 2");
    alone.painted();
    let (pixels, width) = alone.screenshot();
    let seen: std::collections::BTreeSet<_> =
        (90..150).flat_map(|y| (120..200).map(move |x| (x, y))).map(|(x, y)| pixels[y * width as usize + x]).collect();
    assert!(seen.len() > 50, "{}", seen.len());
    assert_calm(&alone);
    // A long export can be cancelled.
    page.eval("(() => { document.getElementById('export-what').value = 'maps'; document.getElementById('export-size').value = '8192'; document.getElementById('export-begin').click(); })()");
    page.wait("!document.getElementById('export-cancel').hidden && document.querySelector('#export .body').dataset.last == 'done'");
    page.wait("document.getElementById('export-cancel').click(), document.getElementById('export-note').textContent == 'Cancelled'");
    assert_calm(&page);
}

#[test]
fn sub_graphs_are_boxes_that_open() {
    let place = Place::shipped("inlay.ron");
    let text = place.text();
    let at = text.find("resolution: ").unwrap();
    let end = at + text[at..].find([',', ')']).unwrap();
    place.write(&format!("{}resolution: 64{}", &text[..at], &text[end..]));
    let watch = Watch::start(&place.graph, &["--memory", "512"]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.getElementById('graph').dataset.computed >= 0");
    let folded = page.eval("+document.getElementById('graph').dataset.nodes").as_u64().unwrap();
    let all = page.eval("document.querySelectorAll('#names option').length").as_u64().unwrap();
    assert!(folded * 3 < all, "{folded} boxes of {all} nodes");
    let generation = page.eval(&format!("+{ROOT}.generation")).as_u64().unwrap();
    let level = |path: &str| -> Json {
        serde_json::from_slice(&watch.get(&format!("graph?g={generation}&u={path}")).1).unwrap()
    };
    let uses: Vec<String> = level("")["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|node| node["use"] == true)
        .map(|node| node["name"].as_str().unwrap().to_owned())
        .collect();
    assert!(!uses.is_empty());
    // Keys open a sub-graph and leave it again.
    page.eval("document.getElementById('graph').focus()");
    page.press("f", 0);
    let inner = level(&uses[0]);
    assert!(inner["nodes"].as_array().unwrap().iter().any(|node| node["name"].as_str().unwrap().starts_with(&uses[0])));
    page.eval(&format!("(() => {{ const f = document.getElementById('find'); f.value = {}; f.onchange(); }})()", {
        inner["nodes"].as_array().unwrap().iter().find(|n| n["outside"] != true && n["use"] != true).unwrap()["name"]
            .to_string()
    }));
    page.wait(&format!("document.getElementById('graph').dataset.level == '{}'", uses[0]));
    page.wait("document.querySelectorAll('#crumbs button').length == 2");
    page.eval("document.getElementById('graph').focus()");
    page.press("Backspace", 0);
    page.wait("document.getElementById('graph').dataset.level == ''");
    page.press("ArrowLeft", 0);
    assert_ne!(page.eval("document.getElementById('graph-at').textContent"), "");
    // Keys resize the drawer, and it can fill the window.
    let height = page.eval("document.getElementById('drawer').offsetHeight").as_u64().unwrap();
    page.eval("document.getElementById('drawer-size').focus()");
    page.press("ArrowUp", 0);
    assert!(page.eval("document.getElementById('drawer').offsetHeight").as_u64().unwrap() > height);
    page.eval("document.getElementById('graph-full').click()");
    assert_eq!(page.eval("document.getElementById('drawer').offsetHeight == innerHeight"), true);
    page.eval("document.getElementById('graph-heat').click()");
    page.painted();
    assert_calm(&page);
}

#[test]
fn applies_seed_chosen_on_sheet() {
    let place = Place::new(&odd());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("history");
    page.wait("document.getElementById('sheet-param').options.length == 2");
    page.eval("(() => { document.getElementById('sheet-param').value = 'seed'; document.getElementById('sheet-count').value = '4'; document.getElementById('sheet-make').click(); })()");
    page.wait("document.querySelectorAll('.sheet canvas[data-drawn]').length == 4");
    let sums = page.eval("[...document.querySelectorAll('.sheet canvas')].map(c => c.getContext('2d').getImageData(0, 0, 120, 120).data.reduce((a, b) => a + b))");
    let sums: std::collections::BTreeSet<u64> = sums.as_array().unwrap().iter().map(|v| v.as_u64().unwrap()).collect();
    assert_eq!(sums.len(), 4, "each is another picture");
    page.eval("document.querySelectorAll('.sheet button')[2].click()");
    page.wait(&format!("document.getElementById('param-seed').value == '3' && {ROOT}.final == 'true'"));
    page.press("z", 2);
    page.wait("document.getElementById('param-seed').value == '1'");
    assert_calm(&page);
}

#[test]
fn heights_are_measured() {
    let place = Place::new(&odd());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.tab("measure");
    page.wait("document.getElementById('histogram-note').textContent.includes('greatest')");
    let note = page.eval("document.getElementById('histogram-note').textContent");
    let least: f64 = note.as_str().unwrap().split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!((-1.0..0.0).contains(&least), "{note}");
    page.eval("[...document.querySelectorAll('#measure button')].find(b => b.textContent == 'Across').click()");
    let note = page.eval("document.getElementById('profile-note').textContent");
    assert!(note.as_str().unwrap().starts_with("7.875 mm long"), "{note}");
    let at = |page: &mut Page| page.color(440, 300);
    let grey = at(&mut page);
    assert!(grey[0] == grey[1] && grey[1] == grey[2], "{grey:?}");
    page.eval("document.getElementById('false-colour').click()");
    page.painted();
    let colour = at(&mut page);
    assert!(colour[0] != colour[1] || colour[1] != colour[2], "{colour:?}");
    page.eval("document.getElementById('tone-reset').click()");
    page.painted();
    assert_eq!(at(&mut page), grey);
    page.eval("(() => { const e = document.getElementById('picture-exposure'); e.value = 3; e.oninput(); })()");
    page.painted();
    assert!(at(&mut page)[0] >= grey[0]);
    // With `seam` the edges meet in the middle, and the page says whether the canvas tiles.
    page.eval("document.getElementById('seam').click()");
    page.painted();
    assert_eq!(page.eval("document.getElementById('tiling').textContent"), "tiles");
    assert_calm(&page);
}

/// A texture of a shape: size and format, and its bytes.
fn worn(watch: &Watch, target: &str, shape: &str, side: u32) -> Option<(String, Vec<u8>)> {
    let generation = watch.state()["scene"]["generation"].as_u64().unwrap();
    let (port, token) = watch.address();
    let answer = watch.raw(
        format!(
            "GET /{token}/wear?g={generation}&t={target}&shape={shape}&s={side} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n"
        )
        .as_bytes(),
    );
    let (status, body) = watching::split(&answer);
    let head = String::from_utf8_lossy(&answer).into_owned();
    let form = head.lines().find_map(|line| line.strip_prefix("x-map: ")).map(str::to_owned);
    (status == 200).then(|| (form.unwrap(), body))
}

#[test]
fn shapes_cut_from_wood_have_all_channels() {
    let place = Place::shipped("oak_cuts.ron");
    let text = place.text().replace("resolution: (2048, 1024)", "resolution: (128, 64)");
    place.write(&text);
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(text.as_bytes());
    let halves = |bytes: &[u8]| -> Vec<f32> {
        bytes.as_chunks::<2>().0.iter().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect()
    };
    for (channel, form) in [
        ("base_color", "rgba8"),
        ("roughness", "r16f"),
        ("normal", "rgba8"),
        ("height", "r16f"),
        ("anisotropy", "r16f"),
        ("anisotropy_angle", "r16f"),
    ] {
        let (found, bytes) = worn(&watch, &format!("material.{channel}"), "cube", 240).unwrap();
        assert_eq!(found, format!("240 160 {form}"), "{channel}");
        let seen: std::collections::BTreeSet<&[u8]> = bytes.chunks(if form == "rgba8" { 4 } else { 2 }).collect();
        // At this coarse resolution pores are shallow.
        let least = if channel == "normal" { 2 } else { 40 };
        assert!(seen.len() > least, "{channel} has {} values", seen.len());
    }
    // Fibres stand upright: they lie in the plane of the sides and are perpendicular to the top.
    let (_, bytes) = worn(&watch, "material.anisotropy", "cube", 240).unwrap();
    let lying = halves(&bytes);
    let mean = |left: usize, top: usize| {
        let all = (top + 8..top + 72).flat_map(|y| (left + 8..left + 72).map(move |x| y * 240 + x));
        all.map(|i| lying[i]).sum::<f32>() / 4096.0
    };
    assert!(mean(0, 0) > 0.95 && mean(160, 0) > 0.95 && mean(80, 80) < 0.05, "{} {}", mean(0, 0), mean(80, 80));
    // Rings continue over the edge: where a side and the top meet, colours are nearly the same.
    let (_, bytes) = worn(&watch, "material.base_color", "cube", 960).unwrap();
    let colour = |x: usize, y: usize| bytes[4 * (y * 960 + x)..][..3].to_vec();
    let apart = |a: Vec<u8>, b: Vec<u8>| a.iter().zip(&b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / 3.0;
    // The upper rim of the first side, and the lower rim of the top, which is the second face in the second row.
    let along = (20..300).map(|x| apart(colour(x, 0), colour(320 + x, 639))).sum::<f64>() / 280.0;
    let elsewhere = (20..300).map(|x| apart(colour(x, 0), colour(320 + x, 400))).sum::<f64>() / 280.0;
    assert!(along < 0.6 * elsewhere, "{along} {elsewhere}");
    // A node without a cut shows only the colour of the wood.
    assert!(worn(&watch, "@pores", "sphere", 60).is_some());
    assert!(worn(&watch, "none", "sphere", 60).is_none());
}

#[test]
fn shapes_are_cut_out_of_the_wood() {
    let place = Place::shipped("oak_cuts.ron");
    place.write(&place.text().replace("resolution: (2048, 1024)", "resolution: (64, 32)"));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    // Without a graphics card, the lit view is slow for many pixels.
    page.size(1280, 720, 0.5);
    page.press("2", 0);
    page.wait("document.getElementById('lit').dataset.drawn > 0");
    page.eval("(() => { const r = document.getElementById('light-resolution'); r.value = 512; r.onchange(); })()");
    for shape in ["cube", "leg", "sphere"] {
        let drawn = page.eval("+document.getElementById('lit').dataset.drawn");
        page.eval(&format!("document.querySelector('[data-shape=solid-{shape}]').click()"));
        page.wait(&format!("performance.getEntriesByType('resource').some(r => r.name.includes('/wear?') && r.name.includes('shape={shape}') && r.responseEnd > 0)"));
        page.wait(&format!("document.getElementById('lit').dataset.drawn > {drawn} + 1"));
        // The other channels are loaded too.
        page.wait(&format!("['roughness', 'height', 'normal'].every(c => performance.getEntriesByType('resource').some(r => r.name.includes(`material.${{c}}`) && r.name.includes('shape={shape}') && r.responseEnd > 0))"));
        page.painted();
        let (pixels, width) = page.screenshot();
        let seen: std::collections::BTreeSet<_> = (125..225)
            .flat_map(|y| (200..290).map(move |x| (x, y)))
            .map(|(x, y)| pixels[y * width as usize + x])
            .collect();
        assert!(seen.len() > 300, "{shape}: {} colours", seen.len());
    }
    assert_calm(&page);
}
