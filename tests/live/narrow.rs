//! The page in narrow windows and for the keyboard: all controls can be seen and reached.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::watching::browser::{Browser, Page};
use crate::watching::{Place, Watch};
use serde_json::json;

/// Opens `starter` with all sections and all tools of the 3-D view, as for a graph with a mesh and a solid.
fn opened(browser: &Browser, watch: &Watch, width: u32, height: u32) -> Page {
    let mut page = browser.open(&watch.url);
    page.size(width, height, 1.0);
    page.wait("document.documentElement.dataset.shown && document.documentElement.dataset.final == 'true'");
    page.key("2");
    page.eval("document.querySelectorAll('[data-shape], #marks, #draw').forEach(b => { b.hidden = false; })");
    page.painted();
    page
}

const TABS: [&str; 5] = ["parameters", "look", "measure", "history", "export"];

/// Controls that a user sees and can use.
const CONTROLS: &str = "[...document.querySelectorAll('button, input, select, textarea, summary, [tabindex]')].filter(e => e.checkVisibility() && !e.disabled)";

/// Names of the controls for which `fault(e)` holds when they have the focus and are scrolled into view.
fn faulty(page: &mut Page, fault: &str) -> serde_json::Value {
    page.eval(&format!(
        "{CONTROLS}.filter(e => {{ e.focus(); e.scrollIntoView({{ block: 'nearest', inline: 'nearest' }}); return ({fault})(e); }}).map(e => e.id || e.textContent.trim() || e.ariaLabel)"
    ))
}

fn starter() -> Place {
    let place = Place::shipped("starter.ron");
    place.write(&place.text().replace("resolution: 1024", "resolution: 128"));
    place
}

#[test]
fn controls_are_whole_in_narrow_windows() {
    let place = starter();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    for (width, height) in [(390, 840), (600, 900), (1280, 800)] {
        let mut page = opened(&browser, &watch, width, height);
        // A control with its focus ring lies inside the window, and inside all parts that clip their contents.
        let cut = "e => { const s = getComputedStyle(e), ring = parseFloat(s.outlineWidth) + parseFloat(s.outlineOffset), r = e.getBoundingClientRect(); \
            for (let a = e.parentElement; a; a = a.parentElement) { if (getComputedStyle(a).overflowX === 'visible') continue; \
            const b = a.getBoundingClientRect(), left = b.left + a.clientLeft, top = b.top + a.clientTop; \
            if (r.left - ring < left - 0.5 || r.right + ring > left + a.clientWidth + 0.5 || r.top - ring < top - 0.5 || r.bottom + ring > top + a.clientHeight + 0.5) return true; } return false; }";
        for tab in TABS {
            page.tab(tab);
            assert_eq!(faulty(&mut page, cut), json!([]), "{width} × {height}, {tab}");
        }
        // All tools together cover at most an eighth of the stage; in narrow windows they cover nothing.
        let covered = page.eval(
            "(() => { const t = document.getElementById('lit-tools').getBoundingClientRect(), c = document.getElementById('lit').getBoundingClientRect(); \
             return Math.max(0, c.bottom - t.top) > 0 ? t.height / c.height : 0; })()",
        );
        assert!(covered.as_f64() <= Some(if width < 760 { 0.0 } else { 1.0 / 8.0 }), "{width}: {covered}");
    }
}

#[test]
fn buttons_are_apart_and_have_the_colour_of_the_page() {
    let place = starter();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = opened(&browser, &watch, 1280, 2400);
    for tab in TABS {
        page.tab(tab);
        let close = page.eval(
            "(() => { const all = [...document.querySelectorAll('button, select')].filter(e => e.checkVisibility() && !e.closest('.segments')); \
             const gap = (a, b) => Math.max(Math.max(a.left, b.left) - Math.min(a.right, b.right), Math.max(a.top, b.top) - Math.min(a.bottom, b.bottom)); \
             return all.flatMap((a, i) => all.slice(i + 1).filter(b => gap(a.getBoundingClientRect(), b.getBoundingClientRect()) < 3).map(b => `${a.textContent} ${b.textContent}`)); })()",
        );
        assert_eq!(close, json!([]), "{tab}");
    }
    page.tab("measure");
    let color = page.eval(
        "(() => { const probe = document.createElement('i'); probe.style.color = 'var(--accent)'; document.body.append(probe); const color = getComputedStyle(probe).color; probe.remove(); \
         return [...document.querySelectorAll('input[type=checkbox]')].every(e => getComputedStyle(e).accentColor === color); })()",
    );
    assert_eq!(color, true);
}

#[test]
fn keyboard_reaches_all_controls() {
    let place = starter();
    let watch = Watch::start(&place.graph, &[]);
    let browser = Browser::start();
    let mut page = opened(&browser, &watch, 1280, 800);
    // Arrows change the tab.
    page.eval("document.getElementById('tab-parameters').focus()");
    for tab in ["look", "measure", "history", "export", "parameters"] {
        page.press("ArrowRight", 0);
        page.wait(&format!(
            "document.documentElement.dataset.tab == '{tab}' && document.activeElement.id == 'tab-{tab}'"
        ));
    }
    for tab in TABS {
        page.tab(tab);
        page.eval("(() => { document.activeElement.blur(); window.reached = new Set(); })()");
        let count = page.eval(&format!("{CONTROLS}.length")).as_u64().unwrap();
        for _ in 0..2 * count {
            page.press("Tab", 0);
            page.eval("reached.add(document.activeElement)");
        }
        // Arrows go through a group or a list of tabs, of which Tab reaches one control.
        let missed = page.eval(&format!(
            "{CONTROLS}.filter(e => !reached.has(e) && !e.closest('[data-rove], [role=tablist]')).map(e => e.id || e.textContent.trim() || e.ariaLabel)"
        ));
        assert_eq!(missed, json!([]), "{tab}");
    }
    let groups = page.eval(
        "[...document.querySelectorAll('[data-rove]')].filter(g => g.checkVisibility() && g.querySelector('button:not([hidden])')).filter(g => ![...reached].some(e => g.contains(e))).map(g => g.id)",
    );
    assert_eq!(groups, json!([]));
    page.eval("document.querySelector('[data-shape=sphere]').focus()");
    for _ in 0..8 {
        page.press("ArrowRight", 0);
    }
    assert_eq!(page.eval("document.activeElement.dataset.shape"), "own");
}
