//! The page of `shibo watch` when its server ends, runs again, or has another address.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::page::{assert_calm, open, wait_for_file};
use crate::watching::browser::Browser;
use crate::watching::{Place, Watch, plain, split};
use serde_json::json;
use std::net::TcpListener;
use std::time::Instant;

const ROOT: &str = "document.documentElement.dataset";

/// A port that is free now.
fn port() -> String {
    TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port().to_string()
}

#[test]
fn the_page_connects_again_and_keeps_what_is_unsaved() {
    let place = Place::new(&plain(0.7));
    let port = port();
    let args = ["--port", port.as_str()];
    let watch = Watch::start(&place.graph, &args);
    let browser = Browser::start();
    let mut page = open(&browser, &watch);
    let url = watch.url.clone();
    page.eval("(() => { const b = document.getElementById('param-low'); b.value = '0.5'; b.onchange(); })()");
    page.wait("document.getElementById('param-low').value == '0.5'");
    watch.wait_for(|e| e["event"] == "shown");
    drop(watch);
    page.wait("!document.getElementById('offline').hidden");
    let said = page.eval("document.getElementById('offline').innerText");
    assert!(said.as_str().unwrap().contains("Unsaved: low 0.5"), "{said}");
    page.screenshot();
    assert_eq!(page.eval("document.getElementById('working').hidden"), true, "nothing is computed");
    page.eval("document.getElementById('offline-copy').click()");
    let copied = page.eval("document.getElementById('offline-copy').dataset.copied");
    assert!(copied.as_str().unwrap().contains("default: 0.5"), "{copied}");
    page.eval("document.getElementById('save').click()");
    page.wait("document.getElementById('notice').textContent.startsWith('no connection')");
    // The same port has the same address, from a file that only the user can read.
    let watch = Watch::start(&place.graph, &args);
    assert_eq!(watch.url, url);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let file = place.graph.with_file_name(".cache").join("shibo").join(format!("token-{port}"));
        assert_eq!(std::fs::metadata(file).unwrap().permissions().mode() & 0o777, 0o600);
    }
    page.wait(&format!("{ROOT}.online == 'yes' && document.getElementById('offline').hidden"));
    let end = Instant::now() + crate::watching::PATIENCE;
    while watch.state()["values"]["set"] != json!([["low", "0.5"]]) {
        assert!(Instant::now() < end, "{}", watch.state()["values"]);
        std::thread::sleep(std::time::Duration::from_millis(30));
    }
    place.write(&plain(0.9));
    wait_for_file(&mut page, &place);
    assert_eq!(page.eval("document.getElementById('param-low').value"), "0.5");
    assert_calm(&page, "ERR_");
}

#[test]
fn old_addresses_explain_themselves() {
    let place = Place::new(&plain(0.7));
    let watch = Watch::start(&place.graph, &[]);
    let (port, token) = watch.address();
    let get = |path: &str, accept: &str| {
        let request =
            format!("GET /{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAccept: {accept}\r\nConnection: close\r\n\r\n");
        let (status, body) = split(&watch.raw(request.as_bytes()));
        (status, String::from_utf8(body).unwrap())
    };
    let old = "0".repeat(32);
    for path in ["", &format!("{old}/"), &format!("{old}/state")] {
        let (status, body) = get(path, "text/html,*/*");
        assert!(status == 404 && body.contains("out of date") && !body.contains(token), "{path}: {status} {body}");
        // Programs get no text.
        assert_eq!(get(path, "*/*"), (404, String::new()));
    }
    let browser = Browser::start();
    let mut page = browser.open(&format!("http://127.0.0.1:{port}/{old}/"));
    page.wait("document.querySelector('h1')?.textContent == 'This address is out of date'");
    page.screenshot();
    // Without `--port`, each run has another address.
    let again = Watch::start(&place.graph, &[]);
    assert_ne!(again.address().1, token);
}
