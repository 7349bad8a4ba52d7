//! The 3D view in a real browser: each channel of a material changes the picture as expected.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::{Value as Json, json};

const ROOT: &str = "document.documentElement.dataset";
const LIT: &str = "document.getElementById('lit')";

/// A graph of a material with these channels.
fn graph(channels: &str) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 100, resolution: 32, tile: None),
           nodes: {{ \"slope\": \"= 0.3 * x\", \"leaning\": HeightToNormal(input: \"slope\"),
                     \"final\": Material({channels}) }},
           outputs: {{ \"final\": \"final\" }})"
    )
}

/// A page that views the material from the direction of the light.
struct View {
    place: Place,
    page: Page,
    _browser: Browser,
    _watch: Watch,
}

impl View {
    /// Opens the view with a shape, an environment, and an angle between light and eye.
    fn open(shape: &str, scene: &str, aside: f64) -> Self {
        let place = Place::new(&graph("base_color: 0.5"));
        let watch = Watch::start(&place.graph, &[]);
        let browser = Browser::start();
        let mut page = browser.open(&watch.url);
        page.size(640, 480, 0.5);
        page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
        page.key("2");
        page.wait(&format!("{LIT}.dataset.drawn > 1"));
        // Azimuth of the lamp.
        page.eval(&format!(
            "import('./app.js').then(({{ page }}) => {{ const l = page.lit; window.lit = l; l.setShape('{shape}'); l.staging.setScene('{scene}'); l.staging.shadow = false;
               l.set('lightHeight', 3); l.turn = -0.7002 + {aside}; l.tilt = 0.05; l.bearable = () => 0.5; l.draw(); }})"
        ));
        Self { place, page, _browser: browser, _watch: watch }
    }

    /// Red, green and blue of 64 × 64 pixels around the middle of the shape, for a material with these channels.
    fn of(&mut self, channels: &str) -> Pixels {
        let text = graph(channels);
        if text != self.place.text() {
            self.place.write(&text);
        }
        let sha = watching::sha256(text.as_bytes());
        self.page.wait(&format!("{ROOT}.sha == '{sha}' && {ROOT}.final == 'true' && {ROOT}.done == {ROOT}.generation"));
        self.page.wait(&format!("window.lit.done === window.lit.asked && window.lit.done.scene.sha256 == '{sha}'"));
        self.page.painted();
        let script = format!(
            "(() => {{ window.lit.render(160, 120);
               const s = new OffscreenCanvas(64, 64).getContext('2d'); s.drawImage({LIT}, 48, 28, 64, 64, 0, 0, 64, 64);
               return [...s.getImageData(0, 0, 64, 64).data]; }})()"
        );
        let data: Vec<u8> = serde_json::from_value(self.page.eval(&script)).unwrap();
        Pixels(data.chunks_exact(4).map(|p| [p[0], p[1], p[2]].map(f64::from)).collect())
    }

    fn end(self) {
        assert!(self.page.complaints.is_empty(), "{:?}", self.page.complaints);
    }
}

struct Pixels(Vec<[f64; 3]>);

impl Pixels {
    /// Mean of a colour over some columns.
    fn mean(&self, color: usize, columns: std::ops::Range<usize>) -> f64 {
        let chosen = || self.0.iter().enumerate().filter(|(i, _)| columns.contains(&(i % 64)));
        chosen().map(|(_, pixel)| pixel[color]).sum::<f64>() / chosen().count() as f64
    }

    fn brightness(&self) -> f64 {
        self.mean(1, 0..64)
    }

    /// Green above 0.7 of its maximum, as weights of positions.
    fn highlight(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        let most = self.0.iter().map(|p| p[1]).fold(0.0, f64::max);
        let place = |i: usize| [(i % 64) as f64, (i / 64) as f64];
        self.0.iter().enumerate().map(move |(i, p)| (place(i), (p[1] - 0.7 * most).max(0.0)))
    }

    /// Centre of the highlight, its size along x and y, and its tilt: positive if it falls to the right.
    fn moments(&self) -> ([f64; 2], [f64; 2], f64) {
        let all: f64 = self.highlight().map(|(_, w)| w).sum();
        let mean = |of: &dyn Fn([f64; 2]) -> f64| self.highlight().map(|(at, w)| w * of(at)).sum::<f64>() / all;
        let [x, y] = [mean(&|at| at[0]), mean(&|at| at[1])];
        let wide = [mean(&|at| (at[0] - x).powi(2)).sqrt(), mean(&|at| (at[1] - y).powi(2)).sqrt()];
        ([x, y], wide, mean(&|at| (at[0] - x) * (at[1] - y)))
    }
}

/// A single light with a weak sky, and the studio with soft boxes.
const LAMP: &str = "Lamp";
const STUDIO: &str = "Studio";

/// Highlights stretch across the brush lines, as in pictures of `Relief`, under the lamp and in the studio.
#[test]
fn shows_highlights_across_brush_lines() {
    for scene in [LAMP, STUDIO] {
        let mut view = View::open("sphere", scene, 0.0);
        let mut brushed = |angle: &str| {
            let metal =
                format!("base_color: 0.5, metallic: 1, roughness: 0.4, anisotropy: 0.9, anisotropy_angle: {angle}");
            view.of(&metal).moments()
        };
        let (_, along, _) = brushed("0");
        assert!(along[1] > 1.5 * along[0], "lines along x in {scene}: {along:?}");
        let (_, upright, _) = brushed("90");
        assert!(upright[0] > 1.5 * upright[1], "lines along y in {scene}: {upright:?}");
        if scene == LAMP {
            // Lines fall to the right by 45°, so the highlight rises to the right. Rows are counted downwards.
            let (_, _, falls) = brushed("45");
            let (_, _, rises) = brushed("-45");
            assert!(falls < -5.0 && rises > 5.0, "{falls} {rises}");
        }
        view.end();
    }
}

#[test]
fn shows_specular_and_ior() {
    let mut view = View::open("sphere", LAMP, 0.0);
    let mut shiny = |more: &str| view.of(&format!("base_color: 0.02, roughness: 0.5{more}")).brightness();
    let plain = shiny("");
    let [weak, none] = [", specular: 0.4", ", specular: 0"].map(&mut shiny);
    assert!(plain > weak + 2.0 && weak > none + 2.0, "{plain} {weak} {none}");
    let [water, same, diamond] = [", ior: 1.2", ", ior: 1.5", ", ior: 2.4"].map(&mut shiny);
    assert!(
        diamond > plain + 5.0 && plain > water + 2.0 && (plain - same).abs() < 0.5,
        "{water} {plain} {same} {diamond}"
    );
    view.end();
}

#[test]
fn shows_emission() {
    let mut view = View::open("sphere", LAMP, 2.6);
    let mut glowing = |emission: &str| view.of(&format!("base_color: 0.02, emission: {emission}"));
    let [dark, green, strong] = ["(0, 0, 0)", "(0, 0.3, 0)", "(0, 4, 0)"].map(&mut glowing);
    let seen = |pixels: &Pixels, color| pixels.mean(color, 0..64);
    assert!(seen(&green, 1) > seen(&dark, 1) + 50.0 && (seen(&green, 0) - seen(&dark, 0)).abs() < 20.0);
    // Emission above 1 looks brighter than 1.
    let white = glowing("(0, 1, 0)");
    assert!(seen(&white, 1) > seen(&green, 1) + 20.0 && seen(&strong, 1) > seen(&white, 1) + 10.0);
    view.end();
}

/// Subsurface scattering spreads light into the shadow.
#[test]
fn shows_subsurface_scattering() {
    // The light comes from the left, slightly from behind.
    let mut view = View::open("sphere", LAMP, 1.7);
    let [hard, half, soft] = ["0", "0.5", "1"]
        .map(|share| view.of(&format!("base_color: 0.8, roughness: 1, specular: 0, subsurface: {share}")));
    let lit = |pixels: &Pixels| pixels.mean(1, 0..64);
    assert!(
        lit(&soft) > lit(&half) + 1.0 && lit(&half) > lit(&hard) + 1.0,
        "{} {} {}",
        lit(&hard),
        lit(&half),
        lit(&soft)
    );
    view.end();
    // Scattered light is missing where the light falls.
    let mut view = View::open("sphere", LAMP, 0.0);
    let [hard, soft] =
        ["0", "1"].map(|share| view.of(&format!("base_color: 0.3, roughness: 1, specular: 0, subsurface: {share}")));
    let middle = |pixels: &Pixels| pixels.mean(1, 28..36);
    assert!(middle(&soft) < middle(&hard) - 2.0, "{} {}", middle(&hard), middle(&soft));
    view.end();
}

/// A coat has its own roughness and normal.
#[test]
fn shows_the_surface_of_a_coat() {
    let mut view = View::open("sphere", LAMP, 0.0);
    let mut coated = |more: &str| view.of(&format!("base_color: 0.01, roughness: 1, specular: 0, coat: 1{more}"));
    let [smooth, satin] = [", coat_roughness: 0.1", ", coat_roughness: 0.6"].map(&mut coated);
    let most = |pixels: &Pixels| pixels.0.iter().map(|p| p[1]).fold(0.0, f64::max);
    assert!(most(&smooth) > most(&satin) + 10.0, "{} {}", most(&smooth), most(&satin));
    // Beside the highlight of a smooth coat.
    let beside = |pixels: &Pixels| pixels.mean(1, 44..48);
    assert!(beside(&satin) > beside(&smooth) + 1.0, "{} {}", beside(&smooth), beside(&satin));
    // A coat tilted to the left reflects the light farther to the right. Normals are steepened like the relief.
    let leaning = coated(", coat_roughness: 0.1, coat_normal: \"leaning\"");
    let (level, moved) = (smooth.moments().0, leaning.moments().0);
    assert!(moved[0] > level[0] + 4.0 && (moved[1] - level[1]).abs() < 3.0, "{level:?} {moved:?}");
    view.end();
}

/// Every channel is supported and has an effect.
#[test]
fn shows_every_channel() {
    let mut view = View::open("sphere", STUDIO, 0.6);
    let ground = "base_color: BASE, roughness: ROUGH, metallic: METAL, coat: COAT, anisotropy: LONG";
    let filled = |with: &[(&str, &str)]| {
        let usual = [("BASE", "0.5"), ("ROUGH", "0.4"), ("METAL", "0"), ("COAT", "0"), ("LONG", "0")];
        let all = with.iter().chain(&usual);
        all.fold(ground.to_owned(), |text, (name, value)| text.replacen(name, value, 1))
    };
    let more = |with: &[(&str, &str)], more: &str| format!("{}, {more}", filled(with));
    let plain = filled(&[]);
    let pairs = [
        ("base_color", plain.clone(), filled(&[("BASE", "(0.5, 0.2, 0.1)")])),
        ("roughness", plain.clone(), filled(&[("ROUGH", "0.8")])),
        ("metallic", plain.clone(), filled(&[("METAL", "1")])),
        ("coat", plain.clone(), filled(&[("COAT", "1")])),
        ("anisotropy", plain.clone(), filled(&[("LONG", "0.9")])),
        ("anisotropy_angle", filled(&[("LONG", "0.9")]), more(&[("LONG", "0.9")], "anisotropy_angle: 90")),
        ("normal", plain.clone(), more(&[], "normal: \"leaning\"")),
        ("height", plain.clone(), more(&[], "height: \"slope\"")),
        ("ao", plain.clone(), more(&[], "ao: 0.2")),
        ("sheen", plain.clone(), more(&[], "sheen: 1")),
        ("opacity", plain.clone(), more(&[], "opacity: 0")),
        ("coat_roughness", filled(&[("COAT", "1")]), more(&[("COAT", "1")], "coat_roughness: 0.7")),
        ("coat_normal", filled(&[("COAT", "1")]), more(&[("COAT", "1")], "coat_normal: \"leaning\"")),
        ("emission", plain.clone(), more(&[], "emission: (0.1, 0.2, 0.3)")),
        ("ior", plain.clone(), more(&[], "ior: 2.2")),
        ("specular", plain.clone(), more(&[], "specular: 0")),
        ("subsurface", plain.clone(), more(&[], "subsurface: 1")),
    ];
    let known: Json = view.page.eval("import('./textures.js').then(m => m.CHANNELS)");
    assert_eq!(known.as_array().unwrap().len(), pairs.len());
    for (name, without, with) in pairs {
        assert!(known.as_array().unwrap().contains(&json!(name)), "{name}");
        let (without, with) = (view.of(&without), view.of(&with));
        let apart = without.0.iter().zip(&with.0).flat_map(|(a, b)| (0..3).map(move |c| (a[c] - b[c]).abs()));
        let apart = apart.sum::<f64>() / (3.0 * 64.0 * 64.0);
        // Sheen shows only at the rim.
        assert!(apart > 0.05, "{name} changes the view by {apart}");
    }
    // All channels and the environment fit in the texture units that every graphics card has.
    let units = view.page.eval("import('./textures.js').then(m => Object.keys(m.SLOTS).length)");
    assert!(units.as_u64() < Some(16), "{units}");
    view.end();
}
