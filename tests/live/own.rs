//! The user's own files on the page: a mesh that wears the material, and a panorama that lights it; dropping, sharing,
//! and invalid files.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::{Value as Json, json};

/// A material small enough to render quickly.
const MATERIAL: &str = "(
  version: 1,
  canvas: (size_mm: 8, resolution: 64),
  nodes: {
    \"noise\": Perlin(size: 2),
    \"final\": Material(base_color: \"noise\", roughness: 0.5, height: \"noise\"),
  },
  outputs: { \"final\": \"final\" },
)
";

/// A roof: two rectangles with texture coordinates and without normals; one uses negative indices.
const ROOF: &str = "v -2 0 1\nv 2 0 1\nv 2 1 0\nv -2 1 0\nv -2 0 -1\nv 2 0 -1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
                    f 1/1 2/2 3/3 4/4\nf -3/-1 -4/-2 -1/-3 -2/-4\n";

/// A triangle as a binary glTF file, moved upwards by its node.
fn triangle() -> Vec<u8> {
    let numbers: [f32; 15] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    let mut text = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": [0, 5, 0], "scale": [2, 2, 2] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 } }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
            { "bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC2" },
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 60 }], "buffers": [{ "byteLength": 60 }],
    })
    .to_string();
    while !text.len().is_multiple_of(4) {
        text.push(' ');
    }
    let mut file = b"glTF\x02\0\0\0".to_vec();
    let length = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    file.extend(length(12 + 8 + text.len() + 8 + bytes.len()));
    file.extend(length(text.len()));
    file.extend(b"JSON");
    file.extend(text.as_bytes());
    file.extend(length(bytes.len()));
    file.extend(b"BIN\0");
    file.extend(bytes);
    file
}

pub(crate) fn drop_file(page: &mut Page, name: &str, bytes: &[u8]) {
    page.eval(&format!(
        "(() => {{ const data = new DataTransfer(); data.items.add(new File([new Uint8Array({bytes:?})], '{name}')); \
         window.dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true, cancelable: true }})); }})()"
    ));
}

/// A material without relief or colour of its own.
fn matte() -> String {
    MATERIAL.replace("base_color: \"noise\"", "base_color: 0.7").replace("height: \"noise\"", "metallic: 0")
}

const LIT: &str = "document.getElementById('lit')";
const NOTICE: &str = "document.getElementById('notice').textContent";
const OWN: &str = "document.querySelector('[data-shape=own]')";

/// The notice about a mesh that gets its texture coordinates from the page.
fn projected(name: &str) -> String {
    format!(
        "{NOTICE} == '{name} wears the material; it has no texture coordinates, so the material is projected on it from six sides'"
    )
}

/// Number of colours in the middle of the window, which is drawn at half its size.
fn colours(page: &mut Page) -> usize {
    page.painted();
    let (pixels, width) = page.screenshot();
    let places = (100..140).flat_map(|y| (130..190).map(move |x| y * width as usize + x));
    places.map(|i| pixels[i]).collect::<std::collections::BTreeSet<_>>().len()
}

#[test]
fn own_meshes_wear_the_material() {
    let place = Place::new(MATERIAL);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.size(640, 480, 0.5);
    page.wait("document.documentElement.dataset.final == 'true'");
    assert_eq!(page.eval(&format!("{OWN}.hidden")), true);
    // A dropped mesh is shown in the lit view.
    drop_file(&mut page, "roof.obj", ROOF.as_bytes());
    page.wait(&format!("{NOTICE} == 'roof.obj wears the material'"));
    assert_eq!(page.eval(&format!("[{OWN}.hidden, {OWN}.ariaPressed]")), json!([false, "true"]));
    assert_eq!(page.eval(&format!("{OWN}.textContent")), "roof");
    page.wait("document.documentElement.dataset.view == 'lit' && document.getElementById('lit').dataset.drawn > 1");
    assert!(colours(&mut page) > 100);
    // Another mesh replaces it; an invalid file is reported and changes nothing.
    let drawn = page.eval("+document.getElementById('lit').dataset.drawn").as_f64().unwrap();
    drop_file(&mut page, "triangle.glb", &triangle());
    page.wait(&format!("{NOTICE} == 'triangle.glb wears the material'"));
    assert_eq!(page.eval(&format!("{OWN}.textContent")), "triangle");
    page.wait(&format!("document.getElementById('lit').dataset.drawn > {drawn}"));
    for (name, bytes, why) in [
        ("empty.obj", &b""[..], "it has no triangles"),
        ("odd.obj", b"v 0 0 0\nf 1/1 2/2 3/3\n", "which is not there"),
        ("torn.glb", &triangle()[..90], ""),
        ("notes.txt", b"v 0 0 0\n", "only meshes (OBJ, glb), panoramas (EXR, HDR) and photographs (PNG, JPEG, TIFF)"),
    ] {
        drop_file(&mut page, name, bytes);
        page.wait(&format!("{NOTICE}.startsWith('{name} cannot wear the material: ') && {NOTICE}.includes('{why}')"));
    }
    assert_eq!(page.eval(&format!("{OWN}.ariaPressed")), "true");
    // The shared page contains the mesh.
    drop_file(&mut page, "roof.obj", ROOF.as_bytes());
    page.wait(&format!("{NOTICE} == 'roof.obj wears the material'"));
    let downloads = tempfile::tempdir().unwrap();
    let way = json!({ "behavior": "allow", "browserContextId": browser.context, "downloadPath": downloads.path() });
    page.call("Browser.setDownloadBehavior", way);
    page.tab("export");
    page.eval("document.getElementById('share').click()");
    page.wait("document.getElementById('export-note').textContent.startsWith('graph.html')");
    let path = watching::downloaded(downloads.path(), "graph.html");
    let text = std::fs::read_to_string(&path).unwrap();
    let shared: Json = serde_json::from_str(
        text.lines()
            .find_map(|line| line.strip_prefix("view(document.querySelector('canvas'), ")?.strip_suffix(");"))
            .unwrap(),
    )
    .unwrap();
    assert!(shared["mesh"]["data"].as_str().unwrap().len() > 50, "{}", shared["mesh"]);
    let mut alone = browser.open(&format!("file://{}", path.display()));
    alone.size(640, 480, 0.5);
    alone.wait("document.querySelector('canvas')?.dataset.drawn > 2");
    assert!(colours(&mut alone) > 100);
    assert!(page.complaints.is_empty() && alone.complaints.is_empty(), "{:?} {:?}", page.complaints, alone.complaints);
}

/// A panorama as OpenEXR: the left half red, the right half blue and weaker, with a bright window in the upper right.
fn panorama(width: usize, height: usize) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let colour = |at: exr::math::Vec2<usize>| match (at.x() * 2 < width, at.x() * 8 / width, at.y() * 8 / height) {
        (true, ..) => (1.5_f32, 0.05_f32, 0.05_f32),
        (false, 6, 2) => (3.0, 3.0, 3.0),
        _ => (0.02, 0.02, 0.4),
    };
    use exr::prelude::WritableImage;
    let channels = exr::image::SpecificChannels::rgb(colour);
    exr::image::Image::from_channels((width, height), channels).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Excess of red over blue on the left and on the right of the shape.
fn redness(page: &mut Page, canvas: &str) -> [f64; 2] {
    let script = format!(
        "(() => {{ const c = {canvas}; const s = new OffscreenCanvas(c.width, c.height).getContext('2d'); s.drawImage(c, 0, 0);
            return [-0.3, 0.3].map(x => {{ const d = s.getImageData(0.5 * c.width + x * c.height - 4, 0.5 * c.height - 4, 8, 8).data;
                let n = 0; for (let i = 0; i < d.length; i += 4) n += d[i] - d[i + 2]; return n / 64; }}); }})()"
    );
    let found = page.eval(&script);
    [0, 1].map(|i| found[i].as_f64().unwrap())
}

#[test]
fn own_panoramas_light_the_material() {
    let place = Place::new(&matte());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.size(800, 600, 0.5);
    page.wait("document.documentElement.dataset.final == 'true'");
    drop_file(&mut page, "sky.exr", &panorama(128, 64));
    page.wait(&format!("{NOTICE} == 'sky.exr lights the material'"));
    page.wait(&format!("document.documentElement.dataset.view == 'lit' && {LIT}.dataset.drawn > 1"));
    let chosen = "(() => { const b = document.getElementById('light-scene'); return [b.value, b.selectedOptions[0].textContent, document.getElementById('light-lightHeight').checkVisibility()]; })()";
    assert_eq!(page.eval(chosen), json!(["Own HDRI", "sky.exr", false]));
    // Light that is brighter than white loses its colour.
    page.redraw("const s = document.getElementById('light-exposure'); s.value = -2; s.oninput()");
    let [left, right] = redness(&mut page, LIT);
    assert!(left > 20.0 && right < left / 3.0, "{left} {right}");
    // It turns with the light.
    page.redraw("const s = document.getElementById('light-light'); s.value = 180; s.oninput()");
    let [turned, other] = redness(&mut page, LIT);
    assert!(other > 20.0 && turned < other / 3.0, "{turned} {other}");
    // The backdrop shows it behind the shape.
    let corner = format!(
        "(() => {{ const c = {LIT}; const s = new OffscreenCanvas(c.width, c.height).getContext('2d'); s.drawImage(c, 0, 0); return [...s.getImageData(3, 3, 1, 1).data]; }})()"
    );
    assert_eq!(page.eval(&corner)[3], 0);
    page.redraw("const b = document.getElementById('light-backdrop'); b.value = 4; b.onchange()");
    let seen = page.eval(&corner);
    assert!(seen[3] == 255 && seen[2].as_u64() > seen[0].as_u64(), "{seen}");
    // An invalid file is reported and changes nothing.
    let whole = panorama(128, 64);
    for (name, bytes, why) in [
        ("text.exr", &b"not a picture"[..], "it is neither OpenEXR nor Radiance HDR"),
        ("torn.exr", &whole[..whole.len() / 2], "the file is truncated"),
        ("square.exr", &panorama(64, 64), "a panorama is twice as wide as high"),
    ] {
        drop_file(&mut page, name, bytes);
        page.wait(&format!("{NOTICE}.startsWith('{name} cannot be the environment: ') && {NOTICE}.includes('{why}')"));
    }
    assert_eq!(page.eval(chosen), json!(["Own HDRI", "sky.exr", false]));
    // The shared page contains the panorama.
    let downloads = tempfile::tempdir().unwrap();
    page.call(
        "Browser.setDownloadBehavior",
        json!({ "behavior": "allow", "browserContextId": browser.context, "downloadPath": downloads.path() }),
    );
    page.tab("export");
    page.eval("document.getElementById('share').click()");
    page.wait("document.getElementById('export-note').textContent.startsWith('graph.html')");
    let path = watching::downloaded(downloads.path(), "graph.html");
    let mut alone = browser.open(&format!("file://{}", path.display()));
    alone.size(640, 480, 0.5);
    alone.wait("document.querySelector('canvas')?.dataset.drawn > 2");
    let [left, right] = redness(&mut alone, "document.querySelector('canvas')");
    assert!(right > 20.0 && left < right / 3.0, "{left} {right}");
    // Browsers log the status 422 of the refused files; no other error is allowed.
    let odd = page.complaints.iter().filter(|c| !c.contains("422")).collect::<Vec<_>>();
    assert!(odd.is_empty() && alone.complaints.is_empty(), "{odd:?} {:?}", alone.complaints);
    // After a reload the page still has it.
    page.eval("new Promise(done => setTimeout(done, 600))");
    let url = watch.url.clone();
    page.call("Page.navigate", json!({ "url": url }));
    page.wait("document.documentElement.dataset.final == 'true'");
    page.wait("document.getElementById('light-scene').value == 'Own HDRI'");
}

#[test]
fn meshes_without_texture_coordinates_wear_the_material() {
    let place = Place::new(MATERIAL);
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.size(640, 480, 0.5);
    page.wait("document.documentElement.dataset.final == 'true'");
    let bust = std::fs::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/meshes/bust.glb")).unwrap();
    for (name, bytes) in [("bare.obj", &b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"[..]), ("bust.glb", &bust)] {
        drop_file(&mut page, name, bytes);
        page.wait(&projected(name));
    }
    page.wait("document.documentElement.dataset.view == 'lit' && document.getElementById('lit').dataset.drawn > 1");
    assert!(colours(&mut page) > 100);
    assert!(page.complaints.is_empty(), "{:?}", page.complaints);
}

/// A panorama as Radiance HDR: the left half is red, the right half is blue and weaker.
fn radiance(width: usize, height: usize) -> Vec<u8> {
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for _ in 0..height {
        let [high, low] = u16::try_from(width).unwrap().to_be_bytes();
        let [left, right] = [width / 2, width - width / 2].map(|n| u8::try_from(128 + n).unwrap());
        file.extend([2, 2, high, low, left, 200, right, 2]);
        file.extend([left, 1, right, 1, left, 2, right, 100, left, 130, right, 130]);
    }
    file
}

#[test]
fn radiance_panoramas_light_the_material() {
    let place = Place::new(&matte());
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.size(800, 600, 0.5);
    page.wait("document.documentElement.dataset.final == 'true'");
    drop_file(&mut page, "sky.hdr", &radiance(128, 64));
    page.wait(&format!("{NOTICE} == 'sky.hdr lights the material'"));
    page.wait(&format!("document.documentElement.dataset.view == 'lit' && {LIT}.dataset.drawn > 1"));
    page.redraw("const s = document.getElementById('light-exposure'); s.value = -2; s.oninput()");
    let [left, right] = redness(&mut page, LIT);
    assert!(left > 20.0 && right < left / 3.0, "{left} {right}");
    drop_file(&mut page, "torn.hdr", &radiance(128, 64)[..200]);
    page.wait(&format!("{NOTICE}.startsWith('torn.hdr cannot be the environment: the file is truncated')"));
}

#[test]
fn refuses_panoramas_without_token_or_origin() {
    let place = Place::new(MATERIAL);
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(place.text().as_bytes());
    let (port, token) = watch.address();
    let body = panorama(64, 32);
    let send = |token: &str, origin: &str, kind: &str| {
        let mut request = format!(
            "POST /{token}/environment HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{origin}Content-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
            body.len()
        )
        .into_bytes();
        request.extend(&body);
        watching::split(&watch.raw(&request)).0
    };
    let ours = format!("Origin: http://127.0.0.1:{port}\r\n");
    let plain = "application/octet-stream";
    assert_eq!(send(token, "", plain), 403);
    assert_eq!(send(token, "Origin: http://evil.example\r\n", plain), 403);
    assert_eq!(send("0123", &ours, plain), 404);
    assert_eq!(send(token, &ours, "text/plain"), 415);
    assert_eq!(watch.get("environment").0, 204);
    assert_eq!(send(token, &ours, plain), 200);
    assert_eq!(watch.get("environment").0, 200);
}
