//! The state of the work and of the views of the page: progress, the size of a fit, and errors.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::page::{assert_calm, open, wait_for_file};
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch, plain, sha256};

const ROOT: &str = "document.documentElement.dataset";

/// A graph with a simulation.
fn heavy(steps: u32) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 60, resolution: 1024), nodes: {{ \"f\": Perlin(size: 9), \
         \"p\": GridPoints(pitch: 0.3), \"l\": ConnectNeighbors(points: \"p\", neighbors: Eight), \
         \"s\": DefineSprings(lattice: \"l\", field: \"f\", stiffness: (1, 10)), \
         \"moved\": SimulateSprings(springs: \"s\", step: 0.05, steps: {steps}, drag: 6), \
         \"w\": PlaceWrinkles(lattice: \"moved\"), \"d\": DrawWrinkles(segments: \"w\", width: (0.2, 0.4)) }}, outputs: {{ \"mask\": \"d.mask\" }})"
    )
}

#[test]
fn progress_is_the_share_of_known_costs() {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let done = |page: &mut Page, text: &str| {
        page.wait(&format!("{ROOT}.sha == '{}' && {ROOT}.done == {ROOT}.generation", sha256(text.as_bytes())));
    };
    // The first run measures the costs.
    place.write(&heavy(4000));
    done(&mut page, &heavy(4000));
    page.eval(
        "(() => { window.seen = []; const begun = performance.now(); window.watcher = setInterval(() => { const w = document.getElementById('working'); \
         if (!w.hidden) seen.push([performance.now() - begun, w.textContent, parseFloat(document.querySelector('#progress i').style.width)]); }, 40); })()",
    );
    place.write(&heavy(4001));
    page.wait("/^moved.* % of all · .* s$/.test(document.getElementById('working').textContent)");
    page.screenshot();
    done(&mut page, &heavy(4001));
    let seen = page.eval("(clearInterval(watcher), seen.filter(s => s[1].includes('% of all')))");
    let seen: Vec<(f64, String, f64)> = serde_json::from_value(seen).unwrap();
    assert!(seen.len() > 4, "{seen:?}");
    assert!(seen.windows(2).all(|pair| pair[0].2 <= pair[1].2), "{seen:?}");
    // Half-way through the time, the bar is neither empty nor full.
    let (begin, end) = (seen[0].0, seen[seen.len() - 1].0);
    let middle = seen.iter().find(|(at, ..)| *at >= (begin + end) / 2.0).unwrap();
    assert!((10.0..=90.0).contains(&middle.2), "{middle:?} of {seen:?}");
    page.wait("document.getElementById('working').hidden");
    assert_calm(&page, "");
}

#[test]
fn fits_show_everything() {
    let place = Place::shipped("starter.ron");
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    page.key("g");
    page.wait("document.getElementById('graph').dataset.nodes > 5");
    page.eval("document.getElementById('graph-fit').click()");
    let out = page.eval(
        "import('./app.js').then(({ page }) => { const g = page.graph; const [w, h] = [g.canvas.clientWidth / 2 / g.scale, g.canvas.clientHeight / 2 / g.scale]; \
         return g.nodes.filter(n => n.x < g.center[0] - w || n.x + 168 > g.center[0] + w || n.y < g.center[1] - h || n.y + 112 > g.center[1] + h).length; })",
    );
    assert_eq!(out, 0);
    page.painted();
    page.screenshot();
    page.key("g");
    // Side by side, both pictures are whole.
    page.key("a");
    page.eval("document.querySelector('[data-compare=side]').click()");
    page.painted();
    page.screenshot();
    let cut =
        page.eval("import('./app.js').then(({ page: { picture: p } }) => p.size[0] * p.scale > p.canvas.width / 2)");
    assert_eq!(cut, false);
    page.eval("document.querySelector('[data-compare=wipe]').click()");
    page.painted();
    let full =
        page.eval("import('./app.js').then(({ page: { picture: p } }) => p.size[0] * p.scale > p.canvas.width / 2)");
    assert_eq!(full, true);
    assert_calm(&page, "");
}

#[test]
fn the_closed_box_of_errors_shows_the_faulty_line() {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    wait_for_file(&mut page, &place);
    place.write(&plain(0.5).replace("Remap(", "Remapp("));
    page.wait(&format!("{ROOT}.errors == '1'"));
    page.screenshot();
    let seen = page.eval(
        "(() => { const m = document.querySelector('#errors mark').getBoundingClientRect(), b = document.getElementById('errors').getBoundingClientRect(); \
         return m.height > 0 && m.top >= b.top && m.bottom <= b.bottom; })()",
    );
    assert_eq!(seen, true);
    assert_calm(&page, "");
}

#[test]
fn buttons_say_their_effect() {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let text = |page: &mut Page, element: &str| page.eval(&format!("{element}.textContent"));
    assert_eq!(text(&mut page, "document.getElementById('pin')"), "Pin to compare");
    assert_eq!(text(&mut page, "document.getElementById('pin-lit')"), "Pin to compare");
    page.tab("measure");
    assert_eq!(text(&mut page, "document.getElementById('tone-reset')"), "Reset tone");
    page.tab("export");
    assert_eq!(text(&mut page, "document.querySelector('[for=export-size]')"), "Resolution");
    page.key("2");
    page.wait("[...document.querySelectorAll('#light label')].some(l => l.textContent == 'Light direction')");
}
