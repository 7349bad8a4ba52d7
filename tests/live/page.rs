//! The page of `shibo watch` in a real browser.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch, plain};
use serde_json::Value as Json;

/// State that the page exposes for tests.
const ROOT: &str = "document.documentElement.dataset";

fn open(browser: &Browser, watch: &Watch) -> Page {
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page
}

/// Waits until the page shows the current file.
fn wait_for_file(page: &mut Page, place: &Place) {
    let sha = watching::sha256(place.text().as_bytes());
    page.wait(&format!("{ROOT}.sha == '{sha}' && {ROOT}.final == 'true'"));
    // The picture is painted in the next frame.
    page.eval(
        "new Promise(done => { requestAnimationFrame(() => requestAnimationFrame(done)); setTimeout(done, 500); })",
    );
}

/// Mean brightness in the middle of the picture.
fn brightness(page: &mut Page) -> f64 {
    let (pixels, width) = page.screenshot();
    let middle = (300..400_usize).flat_map(|y| (400..500_usize).map(move |x| (x, y)));
    let sum: u32 = middle.map(|(x, y)| u32::from(pixels[y * width as usize + x][0])).sum();
    f64::from(sum) / 10_000.0
}

/// Fails on errors in the console, except those that contain `provoked`.
fn assert_calm(page: &Page, provoked: &str) {
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
    page.eval("(() => { const s = document.querySelector('[data-param=low] input[type=range]'); s.value = 0.9; s.dispatchEvent(new Event('input', { bubbles: true })); })()");
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
    page.eval("(() => { const s = document.querySelector('[data-param=low] input[type=range]'); s.value = 0.9; s.dispatchEvent(new Event('input', { bubbles: true })); })()");
    page.wait("document.querySelector('[data-param=low]').classList.contains('changed')");
    place.write(&plain(1.0).replace("range: (0, 1)", "range: (0, 0.5)"));
    wait_for_file(&mut page, &place);
    page.wait("!document.querySelector('[data-param=low]').classList.contains('changed')");
    assert_eq!(page.eval(&format!("{ROOT}.errors")), "0");
    assert_calm(&page, "");
}

/// Renders the page at half its size: without a graphics card, the lit view is slow for many pixels.
fn small(page: &mut Page) {
    page.size(1280, 720, 0.5);
}

/// Number of colours in the middle of the stage, and whether most differ from the corner.
fn colours(page: &mut Page) -> (usize, bool) {
    let (pixels, width) = page.screenshot();
    let at = |x: usize, y: usize| pixels[y * width as usize + x];
    // Coordinates for a page at half its size, see `small`.
    let mut seen: Vec<[u8; 3]> = (125..250).flat_map(|y| (175..310).map(move |x| at(x, y))).collect();
    let corner = at(10, 40);
    let differ = seen.iter().filter(|c| **c != corner).count() * 10 > seen.len() * 9;
    seen.sort_unstable();
    seen.dedup();
    (seen.len(), differ)
}

#[test]
fn the_lit_view_draws_the_material() {
    let place = Place::shipped("starter.ron");
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    small(&mut page);
    page.key("2");
    page.wait("document.getElementById('lit').dataset.drawn > 0");
    page.eval("document.getElementById('light-resolution').value = 512, document.getElementById('light-resolution').onchange()");
    for shape in ["sphere", "plane", "cylinder", "cube"] {
        let drawn = page.eval("+document.getElementById('lit').dataset.drawn");
        page.eval(&format!("document.querySelector('[data-shape={shape}]').click()"));
        page.wait(&format!("document.getElementById('lit').dataset.drawn > {drawn}"));
        let (count, differ) = colours(&mut page);
        assert!(count > 100 && differ, "{shape}: {count} colours");
    }
    let drawn = page.eval("+document.getElementById('lit').dataset.drawn");
    page.eval("document.querySelector('[data-relief=displacement]').click()");
    page.wait(&format!("document.getElementById('lit').dataset.drawn > {drawn}"));
    assert!(colours(&mut page).0 > 100);
    // An edit of the file updates the textures.
    let generation = page.eval("document.getElementById('lit').dataset.generation");
    place.write(&place.text().replace("resolution: 1024", "resolution: 512"));
    page.wait(&format!("document.getElementById('lit').dataset.generation != {generation}"));
    assert_calm(&page, "");
}

/// A graph whose material covers a mesh of this shape.
fn on_a_mesh(shape: &str) -> String {
    format!(
        r##"(
  version: 1,
  canvas: (size_mm: 240, resolution: 256, tile: None, seed: 1),
  nodes: {{
    "mesh": MeshShape(shape: {shape}),
    "atlas": MeshAtlas(mesh: "mesh"),
    "lumps": Perlin(size: 20),
    "color": GradientMap(input: "lumps", stops: [(0, "#102040"), (1, "#f0c040")]),
    "final": Material(base_color: "color", roughness: 0.5, height: "lumps"),
  }},
  outputs: {{ "final": "final" }},
)"##
    )
}

#[test]
fn the_mesh_of_the_graph_wears_the_material() {
    const MESH: &str = "document.querySelector('[data-shape=mesh]')";
    let place = Place::new(&on_a_mesh("Sphere"));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    small(&mut page);
    page.key("2");
    // The mesh of the graph is selected at first.
    page.wait(&format!("!{MESH}.hidden && {MESH}.ariaPressed == 'true'"));
    page.wait("document.getElementById('lit').dataset.drawn > 1");
    let (count, differ) = colours(&mut page);
    assert!(count > 100 && differ, "{count} colours");
    // Another mesh replaces it; without a mesh, one of the page's own shapes is shown.
    let drawn = page.eval("+document.getElementById('lit').dataset.drawn");
    place.write(&on_a_mesh("Cube"));
    page.wait(&format!("document.getElementById('lit').dataset.drawn > {drawn}"));
    place.write(&plain(0.5));
    page.wait(&format!("{MESH}.hidden && {MESH}.ariaPressed != 'true'"));
    assert_calm(&page, "");
}

/// Row C20: strokes drawn on the mesh by hand become text for the graph.
#[test]
fn strokes_are_drawn_on_the_mesh_and_copied_as_ron() {
    const TEXT: &str = "document.querySelector('#strokes textarea').value";
    let place = Place::new(&on_a_mesh("Sphere"));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    small(&mut page);
    page.key("2");
    page.wait("document.getElementById('lit').dataset.drawn > 1 && !document.getElementById('draw').hidden");
    let drag = |page: &mut Page, way: [[f64; 2]; 2]| {
        let [[ax, ay], [bx, by]] = way;
        page.eval(&format!(
            "(() => {{ const c = document.getElementById('lit'); const b = c.getBoundingClientRect();
                c.setPointerCapture = () => {{}};
                const at = (kind, x, y) => c.dispatchEvent(new PointerEvent(kind, {{ pointerId: 1, bubbles: true,
                    clientX: b.left + b.width * (0.5 + x), clientY: b.top + b.height * (0.5 + y) }}));
                at('pointerdown', {ax}, {ay});
                for (let t = 0; t <= 1.0001; t += 0.1) at('pointermove', {ax} + ({bx} - {ax}) * t, {ay} + ({by} - {ay}) * t);
                at('pointerup', {bx}, {by}); }})()"
        ));
    };
    // Outside of the stroke mode, a drag turns the mesh.
    drag(&mut page, [[-0.05, 0.0], [0.05, 0.0]]);
    assert_eq!(page.eval(TEXT).as_str(), Some(""));
    let before = colours(&mut page).0;
    page.key("s");
    drag(&mut page, [[-0.08, 0.05], [0.08, -0.05]]);
    drag(&mut page, [[0.0, -0.1], [0.0, 0.1]]);
    let text = page.eval(TEXT).as_str().expect("text").to_owned();
    assert!(text.starts_with("strokes: [") && text.lines().count() == 4 && before > 100, "{text}");
    // All points lie on the sphere of 60 mm, and the graph accepts the text.
    let points: Vec<Vec<f64>> = text
        .split('(')
        .skip(1)
        .map(|p| p.split(')').next().unwrap_or("").split(", ").map(|n| n.parse().unwrap()).collect())
        .collect();
    assert!(points.len() > 8, "{text}");
    for point in &points {
        let radius = point.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((radius - 30.0).abs() < 0.2, "{point:?}");
    }
    let field = format!("\"field\": TangentField(mesh: \"mesh\", {text}),\n    \"lumps\": Perlin");
    place.write(&place.text().replacen("\"lumps\": Perlin", &field, 1));
    wait_for_file(&mut page, &place);
    assert_eq!(page.eval(TEXT).as_str(), Some(&*text), "strokes stay while the mesh does");
    // Other shapes have no strokes; the strokes come back with the mesh.
    page.eval("document.querySelector('[data-shape=cube]').click()");
    assert_eq!(page.eval(TEXT).as_str(), Some(""));
    page.eval("document.querySelector('[data-shape=mesh]').click()");
    assert_eq!(page.eval(TEXT).as_str(), Some(&*text));
    page.eval("document.querySelector('[data-stroke=undo]').click()");
    assert_eq!(page.eval(TEXT).as_str().expect("text").lines().count(), 3);
    page.eval("document.querySelector('[data-stroke=clear]').click()");
    assert_eq!(page.eval(TEXT).as_str(), Some(""));
    assert_calm(&page, "");
}

/// Charts, borders and directions are drawn on the mesh, and the footer describes the point under the cursor.
#[test]
fn charts_borders_and_directions_are_shown_on_the_mesh() {
    const CURSOR: &str = "document.getElementById('cursor').textContent";
    let field = "\"field\": TangentField(mesh: \"mesh\", from: Smooth, symmetry: 2),\n    \"lumps\": Perlin";
    let place = Place::new(&on_a_mesh("Sphere").replacen("\"lumps\": Perlin", field, 1));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    small(&mut page);
    page.key("2");
    page.wait("document.getElementById('lit').dataset.drawn > 1 && !document.getElementById('marks').hidden");
    page.wait("document.getElementById('lit').dataset.quality >= 0.35");
    let without = colours(&mut page).0;
    // A click switches each mark on, and another click off.
    let click = |page: &mut Page, name: &str| {
        let drawn = page.eval("+document.getElementById('lit').dataset.drawn").as_f64().unwrap();
        page.eval(&format!("document.querySelector('[data-mark={name}]').click()"));
        page.wait(&format!("document.getElementById('lit').dataset.drawn > {drawn}"));
    };
    let count = |page: &mut Page, test: &str| {
        let script = format!(
            "(() => {{ const c = document.getElementById('lit'); const s = new OffscreenCanvas(c.width, c.height).getContext('2d');
                s.drawImage(c, 0, 0); const d = s.getImageData(0, 0, c.width, c.height).data; let n = 0;
                for (let i = 0; i < d.length; i += 4) {{ const [r, g, b] = [d[i], d[i + 1], d[i + 2]]; if ({test}) n += 1; }}
                return n; }})()"
        );
        page.eval(&script).as_f64().unwrap()
    };
    let (yellow, cyan, red) =
        ("r > 240 && g > 190 && b < 60", "r < 60 && g > 170 && b > 240", "r > 240 && g < 70 && b < 60");
    assert_eq!([yellow, cyan, red].map(|test| count(&mut page, test)), [0.0; 3]);
    click(&mut page, "seams");
    assert!(count(&mut page, yellow) > 20.0, "no borders");
    click(&mut page, "seams");
    assert_eq!(count(&mut page, yellow), 0.0);
    click(&mut page, "directions");
    assert!(count(&mut page, cyan) > 200.0, "no directions");
    click(&mut page, "directions");
    assert_eq!(count(&mut page, cyan), 0.0);
    click(&mut page, "charts");
    click(&mut page, "grid");
    assert_eq!(page.eval("document.querySelector('[data-mark=charts]').ariaPressed").as_str(), Some("false"));
    assert_ne!(colours(&mut page).0, without);
    click(&mut page, "grid");
    // The point lies on the sphere of 60 mm.
    page.eval(
        "(() => { const c = document.getElementById('lit'); const b = c.getBoundingClientRect();
            c.dispatchEvent(new PointerEvent('pointermove', { bubbles: true, clientX: b.left + b.width / 2, clientY: b.top + b.height / 2 })); })()",
    );
    page.wait(&format!("/mm .* triangle \\d+ .* chart \\d+ .* px .* \\d/.test({CURSOR})"));
    let text = page.eval(CURSOR).as_str().expect("text").to_owned();
    let numbers: Vec<f64> = text.split_whitespace().take(3).map(|n| n.parse().unwrap()).collect();
    assert!((numbers.iter().map(|n| n * n).sum::<f64>().sqrt() - 30.0).abs() < 0.3, "{text}");
    // The picture view draws the triangles.
    page.size(1280, 720, 1.0);
    page.key("1");
    let flat = "(() => { const c = document.getElementById('picture'); const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
        let n = 0; for (let i = 0; i < d.length; i += 4) if (d[i] > 230 && d[i + 1] > 180 && d[i + 2] < 80) n += 1; return n; })()";
    page.eval("document.getElementById('wire').click()");
    page.wait(&format!("document.getElementById('wire').ariaPressed === 'true' && {flat} > 2000"));
    page.eval("document.getElementById('wire').click()");
    page.wait(&format!("{flat} < 2000"));
    page.key("2");
    // Other shapes have no marks.
    page.eval("document.querySelector('[data-shape=cube]').click()");
    assert_eq!(page.eval("document.getElementById('marks').hidden").as_bool(), Some(true));
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

#[test]
fn draws_nodes_without_picture() {
    let browser = Browser::start();
    let wood = ["pith", "trunk", "tree", "even", "grown", "fiber", "year", "ring_color", "light"];
    for (file, nodes) in [("pine_knots.ron", &wood[..]), ("brick_wall.ron", &["exemplar", "regular", "coords"])] {
        let place = Place::shipped(file);
        let resolution = place.text().find("resolution: ").unwrap();
        let end = resolution + place.text()[resolution..].find(',').unwrap();
        place.write(&(place.text()[..resolution].to_owned() + "resolution: 256" + &place.text()[end..]));
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
