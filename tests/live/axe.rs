//! The page of `shibo watch` under axe-core, which finds obstacles for users of keyboards and screen readers.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::watching::browser::Browser;
use crate::watching::{Place, Watch};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = "document.documentElement.dataset";

const TABS: [&str; 5] = ["parameters", "look", "measure", "history", "export"];

/// The serious violations.
const SERIOUS: &str = "axe.run(document, { resultTypes: ['violations'] }).then(r => r.violations.filter(v => ['serious', 'critical'].includes(v.impact)) \
     .map(v => v.id + ': ' + v.nodes.map(n => n.target.join(' ') + ' ' + (n.any[0]?.message ?? '')).slice(0, 4).join(' | ')))";

/// The source of axe-core from npm, fetched once, in the version of the lock file.
fn axe() -> String {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/axe");
    let dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("axe");
    let script = dir.join("node_modules/axe-core/axe.min.js");
    if !script.is_file() {
        std::fs::create_dir_all(&dir).unwrap();
        for file in ["package.json", "package-lock.json"] {
            std::fs::copy(from.join(file), dir.join(file)).unwrap();
        }
        let done = Command::new("npm").args(["ci", "--no-audit", "--no-fund"]).current_dir(&dir).output();
        let done = done.expect("npm: install it (`apt-get install npm`)");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    std::fs::read_to_string(script).unwrap()
}

#[test]
fn page_has_no_serious_accessibility_violations() {
    let axe = axe();
    let place = Place::shipped("starter.ron");
    place.write(&place.text().replace("resolution: 1024", "resolution: 128"));
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = browser.open(&watch.url);
    page.wait(&format!("{ROOT}.shown && {ROOT}.final == 'true'"));
    page.eval(&axe);
    // Opens everything: the graph, a node, the panels, a comparison.
    page.key("g");
    page.wait("document.getElementById('graph').dataset.computed >= 0");
    page.eval("(() => { const f = document.getElementById('find'); f.value = document.querySelector('#names option').value; f.onchange(); })()");
    page.wait("!document.getElementById('inspector').hidden");
    page.key("a");
    // All tabs with their code.
    for tab in TABS {
        page.tab(tab);
        let found = page.eval(SERIOUS);
        assert_eq!(found, json!([]), "{tab}");
    }
    page.tab("parameters");
    let checked = page.eval("axe.run(document).then(r => r.passes.length)");
    assert!(checked.as_u64() > Some(15), "{checked}");
    let mut runs = 0;
    for (width, height) in [(600, 900), (1440, 900), (3840, 2160)] {
        page.size(width, height, 0.5);
        for theme in ["dark", "light"] {
            if page.eval(&format!("{ROOT}.theme")) != theme {
                page.key("d");
            }
            // Both views at one size; at the other sizes one view in dark and the other in light.
            let views: &[&str] = match (width, theme) {
                (1440, _) => &["2", "1"],
                (_, "dark") => &["2"],
                _ => &["1"],
            };
            for view in views {
                page.key(view);
                page.painted();
                // Each run looks at another tab.
                runs += 1;
                page.tab(TABS[runs % TABS.len()]);
                let found = page.eval(SERIOUS);
                assert_eq!(found, json!([]), "{width} × {height}, {theme}, view {view}");
            }
        }
    }
    place.write(&place.text().replace("nodes:", "nodez:"));
    page.wait("!document.getElementById('errors').hidden");
    let found = page.eval("axe.run('#errors').then(r => r.violations.filter(v => ['serious', 'critical'].includes(v.impact)).map(v => v.id))");
    assert_eq!(found, json!([]));
}
