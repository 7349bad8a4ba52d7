//! The 3-D view of the page: the material in light, on shapes and on the mesh of the graph.
use crate::page::{assert_calm, open, wait_for_file};
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch, plain};

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
        page.redraw(&format!("document.querySelector('[data-shape={shape}]').click()"));
        let (count, differ) = colours(&mut page);
        assert!(count > 100 && differ, "{shape}: {count} colours");
    }
    page.redraw("document.querySelector('[data-relief=displacement]').click()");
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

/// A mesh that arrives later is shown unless the user has chosen a shape.
#[test]
fn a_chosen_shape_stays_when_the_mesh_arrives() {
    const MESH: &str = "document.querySelector('[data-shape=mesh]')";
    const SHAPE: &str = "document.querySelector('#shapes [aria-pressed=true]').dataset.shape";
    let meshes = "    \"mesh\": MeshShape(shape: Sphere),\n    \"atlas\": MeshAtlas(mesh: \"mesh\"),\n";
    let place = Place::new(&on_a_mesh("Sphere").replace(meshes, ""));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    small(&mut page);
    page.key("2");
    page.wait("document.getElementById('lit').dataset.drawn > 0");
    assert_eq!(page.eval(&format!("{MESH}.hidden")), true);
    page.eval("document.querySelector('[data-shape=plane]').click()");
    place.write(&on_a_mesh("Sphere"));
    page.wait(&format!("!{MESH}.hidden"));
    assert_eq!(page.eval(SHAPE), "plane");
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
    let click =
        |page: &mut Page, name: &str| page.redraw(&format!("document.querySelector('[data-mark={name}]').click()"));
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
