//! The 3D view and pictures of `Relief` agree: the page has the only second copy of the engine's reflection.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};

const ROOT: &str = "document.documentElement.dataset";

/// Pixels along an edge of the pictures.
const SIDE: u32 = 256;

/// Nodes that make materials: grained leather, brushed brass under half a coat, and cloth with sheen.
const MATERIALS: [(&str, &str); 3] = [
    (
        "leather",
        r#""lumps": Worley(size: 2.5, normalize: true), "height": "= 0.6 * lumps.f1",
           "final": Material(base_color: "= mix((0.08, 0.04, 0.02), (0.3, 0.14, 0.07), lumps.f1)", roughness: "= 0.3 + 0.3 * lumps.f1",
             metallic: 0, height: "height", ao: "= 0.6 + 0.4 * lumps.f1", anisotropy: 0, coat: 0)"#,
    ),
    (
        "brass",
        r#""waves": Perlin(size: 6), "height": "= 0.35 * waves",
           "final": Material(base_color: (0.89, 0.65, 0.3), roughness: 0.35, metallic: 1, height: "height",
             anisotropy: "= 0.8 * waves", anisotropy_angle: 20, coat: "= 0.5 * waves", coat_roughness: 0.2)"#,
    ),
    (
        "cloth",
        r#""threads": Perlin(size: 1.5), "height": "= 0.2 * threads",
           "final": Material(base_color: "= mix((0.05, 0.1, 0.3), (0.2, 0.3, 0.6), threads)", roughness: 0.85, metallic: 0, height: "height",
             sheen: 0.8, ao: "= 0.5 + 0.5 * threads", anisotropy: 0, coat: 0, emission: (0.02, 0, 0.01))"#,
    ),
];

/// A graph of a material, and of its picture in each environment.
fn graph(nodes: &str) -> String {
    let lit = |scene: &str| {
        // The lamp casts no shadows.
        let shadows = if scene == "Lamp" { "" } else { "shadows: 0, " };
        format!("\"in_{scene}\": Relief(material: \"final\", environment: {scene}, {shadows}anisotropy: 1),\n")
    };
    let outputs = |scene: &str| format!(", \"{scene}\": \"in_{scene}\"");
    let (pictures, outputs): (String, String) = (SCENES.map(lit).concat(), SCENES.map(outputs).concat());
    format!(
        "(version: 1, canvas: (size_mm: 40, resolution: {SIDE}), nodes: {{ {nodes},\n {pictures} }}, outputs: {{ \"final\": \"final\"{outputs} }})"
    )
}

const SCENES: [&str; 5] = ["Studio", "Overcast", "Window", "Sky", "Lamp"];

/// Red, green and blue of an image or a canvas, by rows.
fn pixels(page: &mut Page, image: &str) -> Vec<f64> {
    let script = format!(
        "(async () => {{ const image = await ({image}); const s = new OffscreenCanvas({SIDE}, {SIDE}).getContext('2d'); s.drawImage(image, 0, 0);
            return [...s.getImageData(0, 0, {SIDE}, {SIDE}).data]; }})()"
    );
    let data: Vec<u8> = serde_json::from_value(page.eval(&script)).unwrap();
    data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]].map(f64::from)).collect()
}

/// Mean difference of the page's picture and that of `Relief`, in steps of 255.
fn difference(page: &mut Page, scene: &str) -> f64 {
    page.eval(&format!(
        "(async () => {{ const l = window.lit; await l.staging.setScene('{scene}'); l.set('lightHeight', 37); }})()"
    ));
    // It is drawn and read in one step, because the page draws in other sizes in between.
    let shown = pixels(page, &format!("(window.lit.render({SIDE}, {SIDE}), document.getElementById('lit'))"));
    let address = format!("window.page.state.scene.pictures['{scene}'].picture");
    let made = pixels(page, &format!("fetch({address}).then(r => r.blob()).then(createImageBitmap)"));
    assert_eq!(shown.len(), made.len());
    let bright = made.iter().sum::<f64>() / made.len() as f64;
    assert!((15.0..240.0).contains(&bright), "{scene} shows nothing: {bright}");
    shown.iter().zip(&made).map(|(a, b)| (a - b).abs()).sum::<f64>() / made.len() as f64
}

#[test]
fn page_and_relief_agree_in_every_environment() {
    let browser = Browser::start();
    let mut found = Vec::new();
    for (name, nodes) in MATERIALS {
        let place = Place::new(&graph(nodes));
        let watch = Watch::start(&place.graph, &[]);
        let mut page = browser.open(&watch.url);
        page.size(640, 480, 0.5);
        page.wait(&format!("{ROOT}.done && {ROOT}.done == {ROOT}.generation"));
        page.eval("import('./app.js').then(m => { window.page = m.page; window.lit = m.page.lit; })");
        page.key("2");
        page.wait("window.lit.done && window.lit.done === window.lit.asked");
        // The texture has the resolution of the picture, so both show the same pixels.
        page.eval(&format!(
            "(async () => {{ const l = window.lit; l.setShape('plane'); l.setRelief('displacement'); l.staging.shadow = false; l.above = true;
                await l.load(l.asked.scene, l.asked.maps, {SIDE}); }})()"
        ));
        page.wait("window.lit.done === window.lit.asked");
        for scene in SCENES {
            found.push((name, scene, difference(&mut page, scene)));
        }
        assert!(page.complaints.is_empty(), "{:?}", page.complaints);
    }
    println!("mean differences of 255: {found:.2?}");
    assert!(found.iter().all(|(.., apart)| *apart <= 3.0), "{found:.2?}");
}
