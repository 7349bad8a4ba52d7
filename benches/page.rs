//! Latency of an edit on the page of `shibo watch` in a real browser: `cargo bench -p shibo --bench page`. Seven edits
//! late in `calf.ron` at 512², seven of its simulation, each from the save to the picture on the page; then the number
//! of pictures per second while a slider is dragged.
#![allow(clippy::unwrap_used, reason = "benches fail by panicking")]
#[path = "../tests/live/watching/mod.rs"]
mod watching;

use watching::browser::{Browser, Page};
use watching::{Place, Watch};

/// The state that the page publishes.
const ROOT: &str = "document.documentElement.dataset";

/// Waits until the page shows the current file.
fn wait_for_file(page: &mut Page, place: &Place) {
    let sha = watching::sha256(place.text().as_bytes());
    page.wait(&format!("{ROOT}.sha == '{sha}' && {ROOT}.final == 'true'"));
    page.painted();
}

fn main() {
    let place = Place::shipped("calf.ron");
    place.write(&place.text().replace("resolution: 2048", "resolution: 512"));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page.wait(&format!("{ROOT}.target == 'lit' && {ROOT}.done"));
    page.eval(&format!(
        "new MutationObserver(() => {{ if ({ROOT}.sha !== window.last) {{ window.last = {ROOT}.sha; window.at = Date.now(); }} }}) \
         .observe(document.documentElement, {{ attributes: true, attributeFilter: ['data-picture', 'data-sha'] }})"
    ));
    let text = place.text();
    let start = |name: &str| {
        let declared = format!("\"{name}\": Number(default: ");
        text.find(&declared).expect("the graph declares it") + declared.len()
    };
    for (what, at, value) in
        [("late in the graph", start("roughness"), 0.45), ("of the simulation", start("pitch"), 0.7)]
    {
        let end = at + text[at..].find(',').unwrap();
        let mut times = Vec::new();
        for i in 0..7 {
            let edited = format!("{}{:.3}{}", &text[..at], value + 0.003 * f64::from(i), &text[end..]);
            place.write(&edited);
            let saved =
                std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs_f64() * 1000.0;
            wait_for_file(&mut page, &place);
            times.push(page.eval("window.at").as_f64().unwrap() - saved);
            page.wait(&format!("{ROOT}.done == {ROOT}.generation"));
        }
        times.sort_by(f64::total_cmp);
        println!("save of an edit {what} to its 512² picture on the page: {times:.0?} ms");
    }
    // Drag a slider and count the pictures per second.
    let seen = page.eval(&format!(
        "(async () => {{ const s = document.getElementById('param-roughness'); const seen = new Set(); const end = Date.now() + 3000; \
         for (let i = 0; Date.now() < end; i += 1) {{ s.value = 0.3 + (i % 200) * 0.001; s.onchange(); \
         await new Promise(done => setTimeout(done, 16)); seen.add({ROOT}.picture); }} return seen.size; }})()"
    ));
    println!("a drag of a slider late in the graph: {:.1} pictures a second", seen.as_f64().unwrap() / 3.0);
}
