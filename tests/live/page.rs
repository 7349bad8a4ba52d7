//! The page of `shibo watch` in a real browser.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch, plain};
use serde_json::Value as Json;

/// State that the page exposes for tests.
const ROOT: &str = "document.documentElement.dataset";

pub(crate) fn open(browser: &Browser, watch: &Watch) -> Page {
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page
}

/// Waits until the page shows the current file.
pub(crate) fn wait_for_file(page: &mut Page, place: &Place) {
    let sha = watching::sha256(place.text().as_bytes());
    page.wait(&format!("{ROOT}.sha == '{sha}' && {ROOT}.final == 'true'"));
    // The picture is painted in the next frame.
    page.eval(
        "new Promise(done => { requestAnimationFrame(() => requestAnimationFrame(done)); setTimeout(done, 500); })",
    );
}

/// Mean brightness in the middle of the picture.
pub(crate) fn brightness(page: &mut Page) -> f64 {
    let (pixels, width) = page.screenshot();
    let middle = (300..400_usize).flat_map(|y| (400..500_usize).map(move |x| (x, y)));
    let sum: u32 = middle.map(|(x, y)| u32::from(pixels[y * width as usize + x][0])).sum();
    f64::from(sum) / 10_000.0
}

/// Fails on errors in the console, except those that contain `provoked`.
pub(crate) fn assert_calm(page: &Page, provoked: &str) {
    let odd: Vec<&String> = page.complaints.iter().filter(|c| provoked.is_empty() || !c.contains(provoked)).collect();
    assert!(odd.is_empty(), "{odd:#?}");
}

#[test]
fn the_page_follows_the_file() {
    let place = Place::new(&plain(0.4));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    wait_for_file(&mut page, &place);
    let dark = brightness(&mut page);
    place.write(&plain(1.0));
    wait_for_file(&mut page, &place);
    let bright = brightness(&mut page);
    assert!(bright > dark + 25.0, "{dark} {bright}");

    // With a broken file, the error names its line and the picture stays.
    place.write(&plain(1.0).replace("Remap(", "Remapp("));
    page.wait(&format!("{ROOT}.errors == '1'"));
    let told = page.eval("document.getElementById('errors').innerText");
    let told = told.as_str().unwrap();
    assert!(told.contains("graph.ron:7:13") && told.contains("unknown-kind"), "{told}");
    assert_eq!(page.eval("document.querySelector('#errors mark').textContent"), "Remapp");
    assert_eq!(page.eval("document.querySelector('#errors .at b').textContent"), "7");
    assert!((brightness(&mut page) - bright).abs() < 1.0, "the old picture stays");

    // The file is repaired.
    place.write(&plain(0.1));
    wait_for_file(&mut page, &place);
    page.wait("document.getElementById('errors').hidden");
    assert!(brightness(&mut page) < dark);
    assert_calm(&page, "");
}

#[test]
fn first_page_is_small_and_loads_nothing_external() {
    let place = Place::new(&plain(0.4));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let found = page.eval(
        "[...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')].map(e => [e.name, e.encodedBodySize])",
    );
    let found: Vec<(String, u64)> = serde_json::from_value(found).unwrap();
    assert!(found.iter().all(|(name, _)| name.starts_with(&watch.url)), "{found:?}");
    // Only files of the page count; data has a query, comes from a folder, or is a stream.
    let is_file = |name: &str| {
        let rest = name.strip_prefix(&watch.url).unwrap_or(name);
        rest.is_empty() || [".js", ".css", ".svg"].iter().any(|end| rest.ends_with(end))
    };
    let all: u64 = found.iter().filter(|(name, _)| is_file(name)).map(|(_, bytes)| bytes).sum();
    println!("first page: {} KiB", all >> 10);
    assert!(found.len() > 20 && (100 << 10..=300 << 10).contains(&all), "{all} {found:?}");
    assert_calm(&page, "");
}

#[test]
fn loads_repaired_file_after_broken_start() {
    let place = Place::new("(version: 1, nodes: { \"a\": Nonsense() })");
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.errors > 0"));
    place.write(&plain(0.7));
    wait_for_file(&mut page, &place);
    assert_eq!(page.eval(&format!("{ROOT}.errors")), "0");
    assert_calm(&page, "");
}

#[test]
fn a_slider_changes_the_picture_and_gives_the_text() {
    let place = Place::new(&plain(1.0));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    wait_for_file(&mut page, &place);
    let before = brightness(&mut page);
    let generation = page.eval(&format!("{ROOT}.generation"));
    page.eval("(() => { const b = document.getElementById('param-low'); b.value = 0.9; b.onchange(); })()");
    page.wait(&format!("{ROOT}.generation != {generation} && {ROOT}.final == 'true'"));
    page.eval(
        "new Promise(done => { requestAnimationFrame(() => requestAnimationFrame(done)); setTimeout(done, 500); })",
    );
    assert!(brightness(&mut page) > before + 20.0);
    page.wait("document.querySelector('[data-param=low]').classList.contains('changed')");
    page.eval("document.getElementById('copy').click()");
    let copied = page.eval("document.getElementById('copy').dataset.copied");
    assert_eq!(copied, "params: { \"low\": Number(default: 0.9, range: (0, 1), doc: \"The darkest\") },");
    page.eval("document.getElementById('reset').click()");
    page.wait("!document.querySelector('[data-param=low]').classList.contains('changed')");
    // If a save no longer allows the value of a slider, the file wins.
    page.eval("(() => { const b = document.getElementById('param-low'); b.value = 0.9; b.onchange(); })()");
    page.wait("document.querySelector('[data-param=low]').classList.contains('changed')");
    place.write(&plain(1.0).replace("range: (0, 1)", "range: (0, 0.5)"));
    wait_for_file(&mut page, &place);
    page.wait("!document.querySelector('[data-param=low]').classList.contains('changed')");
    assert_eq!(page.eval(&format!("{ROOT}.errors")), "0");
    assert_calm(&page, "");
}

#[test]
fn selects_every_node() {
    let place = Place::shipped("starter.ron");
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait(
        "document.getElementById('graph').dataset.nodes > 5 && document.getElementById('graph').dataset.computed >= 0",
    );
    let names: Json = page.eval("[...document.querySelectorAll('#names option')].map(o => o.value)");
    assert!(names.as_array().unwrap().len() > 5);
    for name in names.as_array().unwrap() {
        page.eval(&format!(
            "(() => {{ const f = document.getElementById('find'); f.value = {name}; f.onchange(); }})()"
        ));
        page.wait(&format!("{ROOT}.shown?.split(' ')[0].split('.')[0] == '@' + {name} && document.querySelector('#inspector .name')?.textContent == {name}"));
    }
    page.key("Escape");
    page.wait(&format!("!{ROOT}.shown.startsWith('@')"));
    // A click on a box selects its node too.
    page.key("f");
    let at = page.eval("(() => { const b = document.getElementById('graph').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()");
    let [left, top, width, height] = std::array::from_fn(|i| at[i].as_f64().unwrap());
    let spots = (1..40).flat_map(|i| [0.5, 0.35, 0.65].map(|v| (left + width * f64::from(i) / 40.0, top + height * v)));
    for (x, y) in spots {
        page.mouse("mousePressed", x, y);
        page.mouse("mouseReleased", x, y);
        if page.eval(&format!("{ROOT}.target.startsWith('@')")) == true {
            break;
        }
    }
    page.wait(&format!("{ROOT}.shown?.startsWith('@') && {ROOT}.target.startsWith('@')"));
    assert_calm(&page, "");
}

/// A wall from a patch of bricks, whose lattice is found.
const WALL: &str = r#"(
  version: 1,
  canvas: (size_mm: 1920, resolution: 256, tile: Both, seed: 5),
  imports: { "bricks": "shibo:bricks" },
  nodes: {
    "bricks": Use(graph: "bricks", with: { "courses": 24, "bricks": 8, "width": 1920 }),
    "exemplar": Exemplar(input: "bricks.color", size_mm: 700, origin: (97, 151), size: (176, 176), periodic: No),
    "regular": DetectLattice(exemplar: "exemplar"),
    "coords": Synthesize(exemplar: "regular", preset: Regular),
    "color": SampleExemplar(coords: "coords", input: "bricks.color"),
  },
  outputs: { "color": "color" },
)"#;

#[test]
fn draws_nodes_without_picture() {
    let browser = Browser::start();
    let wood = ["pith", "trunk", "tree", "even", "grown", "fiber", "year", "ring_color", "light"];
    let pine = Place::shipped("pine_knots.ron");
    let resolution = pine.text().find("resolution: ").unwrap();
    let end = resolution + pine.text()[resolution..].find(',').unwrap();
    pine.write(&(pine.text()[..resolution].to_owned() + "resolution: 256" + &pine.text()[end..]));
    for (place, nodes) in [(pine, &wood[..]), (Place::new(WALL), &["exemplar", "regular", "coords"])] {
        let watch = Watch::start(&place.graph, &[]);
        let mut page = open(&browser, &watch);
        page.key("g");
        page.wait("document.getElementById('graph').dataset.computed >= 0");
        for node in nodes {
            page.eval(&format!(
                "(() => {{ const f = document.getElementById('find'); f.value = '{node}'; f.onchange(); }})()"
            ));
            page.wait(&format!("{ROOT}.shown?.split(' ')[0] == '@{node}'"));
            // More colours than background and lines: the drawing is not blank.
            page.wait(
                "(() => { const c = document.getElementById('picture'); const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; \
                 const seen = new Set(); for (let i = 0; i < d.length; i += 4) seen.add(d[i] << 24 | d[i + 1] << 16 | d[i + 2] << 8 | d[i + 3]); return seen.size > 2; })()",
            );
            page.screenshot();
        }
        assert_calm(&page, "");
    }
}

#[test]
fn the_picture_is_moved_zoomed_repeated_and_compared() {
    let place = Place::new(&plain(1.0));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    wait_for_file(&mut page, &place);
    // The footer shows the position in mm and the value under the cursor.
    page.mouse("mouseMoved", 450.0, 350.0);
    page.wait(
        "/x \\d\\.\\d+ +y \\d\\.\\d+ mm.*\\d+, \\d+ px.*0\\.\\d+/.test(document.getElementById('cursor').textContent)",
    );
    let fitted = page.eval("document.getElementById('zoom').textContent");
    for _ in 0..9 {
        page.key("+");
    }
    page.wait(&format!("document.getElementById('zoom').textContent != '{}'", fitted.as_str().unwrap()));
    page.mouse("mousePressed", 450.0, 350.0);
    page.mouse("mouseMoved", 500.0, 380.0);
    page.mouse("mouseReleased", 500.0, 380.0);
    page.key("0");
    page.wait(&format!("document.getElementById('zoom').textContent == '{}'", fitted.as_str().unwrap()));
    page.key("t");
    assert_eq!(page.eval("document.getElementById('repeat').ariaPressed"), "true");
    page.key("t");
    for key in ["r", "b", "c"] {
        page.key(key);
    }
    // The pinned picture stays on the left, and the right follows the file.
    page.key("a");
    assert_eq!(page.eval("document.getElementById('wipe').hidden"), false);
    let before = page.color(440, 350);
    place.write(&plain(0.0));
    wait_for_file(&mut page, &place);
    assert_eq!(page.color(440, 350), before);
    assert!(page.color(530, 350)[0] < 5, "{:?}", page.color(530, 350));
    page.key("a");
    page.eval(
        "new Promise(done => { requestAnimationFrame(() => requestAnimationFrame(done)); setTimeout(done, 500); })",
    );
    assert!(page.color(440, 350)[0] < 5);
    // Dark and light theme.
    let theme = page.eval(&format!("{ROOT}.theme"));
    page.key("d");
    assert_ne!(page.eval(&format!("{ROOT}.theme")), theme);
    assert_calm(&page, "");
}

#[test]
fn the_page_fits_small_and_large_screens() {
    let place = Place::shipped("starter.ron");
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    // Without a graphics card, the lit view takes minutes for so many pixels.
    let views = [(1280, 720, &["g", "g", "2", "1"][..]), (3840, 2160, &["g", "g"])];
    for (width, height, keys) in views {
        page.size(width, height, 0.5);
        for view in keys {
            page.key(view);
            let over = page.eval(
                "[...document.querySelectorAll('header, header > button, header nav, footer, .tools:not([hidden]), #panel, #stage')] \
                 .filter(e => { const b = e.getBoundingClientRect(); return b.width && (b.right > innerWidth + 1 || b.bottom > innerHeight + 1 || b.left < -1); }).map(e => e.id || e.tagName)",
            );
            assert_eq!(over, serde_json::json!([]), "{width}x{height} {view}");
        }
        page.screenshot();
    }
    assert_calm(&page, "");
}

#[test]
fn many_tabs_share_a_connection() {
    let place = Place::new(&plain(0.3));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    // Browsers allow six connections to a server.
    let mut pages: Vec<Page> = (0..7).map(|_| browser.open(&watch.url)).collect();
    for page in &mut pages {
        page.wait(&format!("{ROOT}.final == 'true'"));
    }
    place.write(&plain(0.9));
    for page in &mut pages {
        wait_for_file(page, &place);
    }
    assert!(watch.handles() < 120, "{}", watch.handles());
    // After the tabs close, a new one works.
    drop(pages);
    let mut page = open(&browser, &watch);
    wait_for_file(&mut page, &place);
    assert_calm(&page, "");
}

#[test]
fn a_picture_of_16384_is_shown_by_tiles() {
    let place = Place::new(&plain(1.0).replace("resolution: 64", "resolution: 16384"));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let largest = page.eval("performance.getEntriesByType('resource').filter(r => r.name.includes('/picture/')).map(r => r.transferSize).reduce((a, b) => Math.max(a, b), 0)");
    assert!(largest.as_u64().unwrap() < 20 << 20, "{largest}");
    page.key("9");
    page.wait("performance.getEntriesByType('resource').filter(r => r.name.includes('/tile?') && r.name.includes('l=0')).length >= 2");
    assert_eq!(page.eval("document.getElementById('zoom').textContent"), "100 %");
    page.mouse("mouseMoved", 450.0, 350.0);
    page.wait("/\\d{4}, \\d{4} px/.test(document.getElementById('cursor').textContent)");
    assert_calm(&page, "");
}
