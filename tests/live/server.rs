//! The server of the page: which requests it refuses, and that it survives all.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::{Place, Watch, plain, split};
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

fn watch() -> (Place, Watch) {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.5).as_bytes());
    (place, watch)
}

/// The status of an answer to a request line and headers; `PORT` and `TOKEN` are filled in.
fn status(watch: &Watch, request: &str) -> u16 {
    split(&ask(watch, request)).0
}

fn ask(watch: &Watch, request: &str) -> Vec<u8> {
    let (port, token) = watch.address();
    let request = request.replace("PORT", &port.to_string()).replace("TOKEN", token).replace('\n', "\r\n");
    watch.raw(request.as_bytes())
}

const HOST: &str = "Host: 127.0.0.1:PORT\nConnection: close\n";

#[test]
fn refuses_wrong_hosts_origins_tokens_and_paths() {
    let (_place, watch) = watch();
    let get = |line: &str, headers: &str| status(&watch, &format!("{line} HTTP/1.1\n{headers}\n"));
    assert_eq!(get("GET /TOKEN/", HOST), 200);
    assert_eq!(get("HEAD /TOKEN/", HOST), 200);
    // Wrong hosts and origins.
    for host in
        ["localhost:PORT", "127.0.0.1", "127.0.0.1:1", "evil.example:PORT", "127.0.0.1:PORT.evil.example", "[::1]:PORT"]
    {
        assert_eq!(get("GET /TOKEN/", &format!("Host: {host}\nConnection: close\n")), 403, "{host}");
    }
    assert!([400, 403].contains(&get("GET /TOKEN/", "Connection: close\n")));
    assert!([400, 403].contains(&get("GET /TOKEN/", &format!("{HOST}Host: evil.example\n"))));
    assert!([400, 403].contains(&get("GET http://evil.example/TOKEN/", HOST)));
    for origin in
        ["null", "http://evil.example", "https://127.0.0.1:PORT", "http://127.0.0.1:PORT/", "http://localhost:PORT"]
    {
        assert_eq!(get("GET /TOKEN/state", &format!("{HOST}Origin: {origin}\n")), 403, "{origin}");
    }
    assert_eq!(get("GET /TOKEN/state", &format!("{HOST}Origin: http://127.0.0.1:PORT\n")), 200);
    assert_eq!(get("GET /TOKEN/state", &format!("{HOST}Sec-Fetch-Site: cross-site\n")), 403);
    // Wrong tokens.
    for path in [
        "/",
        "/TOKEN",
        "/token/",
        "/TOKENx/",
        "/00000000000000000000000000000000/",
        "//TOKEN/",
        "/x/TOKEN/",
        "/%2e/TOKEN/",
    ] {
        assert_eq!(get(&format!("GET {path}"), HOST), 404, "{path}");
    }
    // Paths outside of the page.
    for path in [
        "../../../etc/passwd",
        "..%2f..%2f..%2fetc%2fpasswd",
        "picture/../../../../etc/passwd.png",
        "picture/..%2f..%2f..%2fetc%2fpasswd.png",
        "picture/%00.png",
        "picture//etc/passwd.png",
        "graph.ron",
        "page/app.js",
        "app.js/",
        "index.html%00",
        "picture/.png",
        "file:///etc/passwd",
    ] {
        assert_eq!(get(&format!("GET /TOKEN/{path}"), HOST), 404, "{path}");
    }
}

#[test]
fn accepts_only_valid_parameters() {
    let (_place, watch) = watch();
    for method in ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"] {
        for path in ["", "state", "picture/x.png", "look", "app.js", "events"] {
            let origin = "Origin: http://127.0.0.1:PORT\nContent-Length: 0\n";
            let got = status(&watch, &format!("{method} /TOKEN/{path} HTTP/1.1\n{HOST}{origin}\n"));
            assert_eq!(got, 405, "{method} {path}");
        }
    }
    assert_eq!(status(&watch, &format!("GET /TOKEN/values HTTP/1.1\n{HOST}\n")), 405);
    assert!([400, 403].contains(&status(&watch, &format!("CONNECT evil.example:80 HTTP/1.1\n{HOST}\n"))));
    let post = |headers: &str, body: &str| {
        status(&watch, &format!("POST /TOKEN/values HTTP/1.1\n{HOST}{headers}Content-Length: {}\n\n{body}", body.len()))
    };
    let origin = "Origin: http://127.0.0.1:PORT\n";
    let json = "Content-Type: application/json\n";
    let good = "{\"preset\":null,\"set\":[[\"low\",\"0.25\"]]}";
    assert_eq!(post(json, good), 403, "without an origin");
    assert_eq!(post(origin, good), 415);
    assert_eq!(post(&format!("{origin}Content-Type: text/plain\n"), good), 415);
    assert_eq!(post(&format!("{origin}{json}"), good), 202);
    let end = Instant::now() + watching::PATIENCE;
    while watch.state()["scene"]["params"][0]["value"] != "0.25" {
        assert!(Instant::now() < end);
    }
    for body in ["", "{", "{\"set\":{}}", "{\"set\":[[1,2]]}", "{\"other\":1}", "\u{0}", "{\"set\":[[\"low\"]]}"] {
        assert_eq!(post(&format!("{origin}{json}"), body), 400, "{body}");
    }
    // Values that the graph does not accept are dropped.
    for body in [
        "{\"set\":[[\"none\",\"1\"]]}",
        "{\"set\":[[\"low\",\"9\"]]}",
        "{\"set\":[[\"low\",\"((((\"]]}",
        "{\"set\":[[\"low\",\"1e999\"]]}",
        "{\"preset\":\"none\"}",
        "{\"set\":[[\"\",\"\"]]}",
        "{\"set\":[[\"low\",\"\\u0000\"]]}",
    ] {
        assert_eq!(post(&format!("{origin}{json}"), body), 202, "{body}");
    }
    let end = Instant::now() + watching::PATIENCE;
    while watch.state()["values"]["set"] != serde_json::json!([])
        || watch.state()["scene"]["params"][0]["value"] != "0.0"
    {
        assert!(Instant::now() < end, "{}", watch.state());
    }
    assert_eq!(watch.state()["errors"], serde_json::json!([]));
    let large = format!("{{\"set\":[[\"low\",\"{}\"]]}}", "1".repeat(80 << 10));
    assert_eq!(post(&format!("{origin}{json}"), &large), 413);
}

#[test]
fn answers_invalid_queries() {
    let (_place, watch) = watch();
    let generation = watch.state()["scene"]["generation"].as_u64().unwrap();
    for (path, wanted) in [
        ("look", 400),
        ("look?g=x&t=grey&s=1", 400),
        ("look?g=99&t=grey&s=1", 204),
        ("look?g=G&t=none&s=1", 200),
        ("look?g=G&t=@none&s=1", 200),
        ("look?g=G&t=&s=1", 200),
        ("look?g=G&t=grey&s=0", 200),
        ("look?g=G&t=grey&s=4294967295", 200),
        ("look?g=G&t=grey.height&s=64", 200),
        ("look?g=G&t=@grey:none&s=1", 200),
        ("look?g=G&t=@grey&s=99999999999", 400),
        ("tile?g=G&t=grey&l=0&x=0&y=0", 200),
        ("tile?g=G&t=grey&l=99&x=0&y=0", 200),
        ("tile?g=G&t=grey&l=0&x=1&y=0", 404),
        ("tile?g=G&t=grey&l=0&x=4294967295&y=4294967295", 404),
        ("tile?g=G&t=grey&l=0&x=-1&y=0", 400),
        ("thumb?g=G&n=0", 200),
        ("thumb?g=G&n=18446744073709551615", 404),
        ("thumb?g=G&n=2", 404),
        ("probe?g=G&t=grey&x=63&y=63", 200),
        ("probe?g=G&t=grey&x=64&y=0", 404),
        ("map?g=G&t=grey&s=16", 200),
        ("map?g=G&t=grey&s=0", 200),
        ("object?g=G&t=grey", 204),
        ("graph?g=G", 200),
        ("graph?g=0", 204),
        ("graph?g=G&u=none", 200),
        ("vary?g=G&t=grey&v={}", 200),
        ("vary?g=G&t=grey&v=x", 400),
        ("vary?g=G&t=none&v={}", 204),
        ("map?g=G&t=grey&s=16&exact=true", 200),
        ("wear?g=G&t=grey&shape=leg&s=16", 204),
        ("wear?g=G&t=grey&shape=none&s=16", 400),
        ("export/1", 404),
        ("graphs", 200),
        ("targets", 200),
        ("stats?g=G", 200),
        ("stats", 400),
        ("state", 200),
    ] {
        let path = path.replace("=G", &format!("={generation}"));
        let (status, body) = watch.get(&path);
        assert_eq!(status, wanted, "{path}");
        // The graph that is shown has no such node or sub-graph. About another graph, nothing is said.
        let is_gone =
            path.starts_with("look") && (path.contains("none&") || path.contains("t=&")) || path.ends_with("u=none");
        assert_eq!(body == b"null", is_gone, "{path}");
    }
    let probe: serde_json::Value =
        serde_json::from_slice(&watch.get(&format!("probe?g={generation}&t=grey&x=3&y=5")).1).unwrap();
    assert_eq!(probe["mm"], serde_json::json!([0.4375, 0.6875]));
    assert_eq!(probe["values"].as_array().unwrap().len(), 1);
}

#[test]
fn answers_allow_nothing_inline() {
    let (_place, watch) = watch();
    for path in ["", "app.js", "state", "none", "picture/none.png"] {
        let answer = ask(&watch, &format!("GET /TOKEN/{path} HTTP/1.1\n{HOST}\n"));
        let head = String::from_utf8_lossy(&answer).split("\r\n\r\n").next().unwrap().to_lowercase();
        assert!(head.contains("content-security-policy: default-src 'none'; script-src 'self'"), "{path}: {head}");
        assert!(head.contains("x-content-type-options: nosniff") && head.contains("frame-ancestors 'none'"), "{head}");
        assert!(!head.contains("unsafe") && !head.contains("access-control"), "{head}");
    }
    let page = String::from_utf8(watch.get("").1).unwrap();
    assert!(
        !page.contains("<style")
            && !page.contains(" style=")
            && !page.contains("onclick=")
            && !page.contains("<script>")
    );
    // All modules and styles of the page are served, and name nothing elsewhere.
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/serve/page");
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let files: Vec<String> = names.filter(|name| name.ends_with(".js") || name.ends_with(".css")).collect();
    assert!(files.len() > 40, "{files:?}");
    for file in &files {
        let (status, text) = watch.get(file);
        assert_eq!(status, 200, "{file}");
        let text = String::from_utf8(text).unwrap().replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains("http://") && !text.contains("https://") && !text.contains("eval("), "{file}");
    }
}

#[test]
fn survives_malformed_requests_and_idle_connections() {
    let (place, mut watch) = watch();
    let port = watch.address().0;
    for noise in [
        &b"\0\0\0\0\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    ] {
        let (status, _) = split(&watch.raw(noise));
        assert!(status == 0 || status >= 400, "{status} {noise:?}");
    }
    let long = format!("GET /{} HTTP/1.1\nHost: 127.0.0.1:PORT\n\n", "x".repeat(60 << 10));
    assert!(status(&watch, &long) >= 400);
    let many = format!("GET /TOKEN/ HTTP/1.1\nHost: 127.0.0.1:PORT\n{}\n", "X: y\n".repeat(5000));
    assert!(status(&watch, &many) >= 400);
    // An endless body.
    let head =
        format!("POST /TOKEN/values HTTP/1.1\n{HOST}Origin: http://127.0.0.1:PORT\nContent-Type: application/json\n");
    let (at, token) = watch.address();
    let endless = format!("{head}Transfer-Encoding: chunked\n\n")
        .replace("PORT", &at.to_string())
        .replace("TOKEN", token)
        .replace('\n', "\r\n");
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    stream.set_read_timeout(Some(watching::PATIENCE)).unwrap();
    stream.write_all(endless.as_bytes()).unwrap();
    for _ in 0..100 {
        if stream.write_all(format!("1000\r\n{}\r\n", "1".repeat(4096)).as_bytes()).is_err() {
            break;
        }
    }
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    assert!([0, 413].contains(&split(&answer).0));
    // Silent connections, and listeners that do not read.
    let idlers: Vec<TcpStream> = (0..120).map(|_| TcpStream::connect(("127.0.0.1", port)).unwrap()).collect();
    let mut deaf = Vec::new();
    for _ in 0..40 {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        write!(stream, "GET /{token}/events HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").unwrap();
        deaf.push(stream);
    }
    for i in 0..20 {
        let text = plain(0.6 + 0.01 * f64::from(i));
        place.write(&text);
        watch.wait_shown(text.as_bytes());
    }
    assert_eq!(watch.get("state").0, 200);
    drop((idlers, deaf));
    // Closed connections leave no handles.
    let end = Instant::now() + watching::PATIENCE;
    while watch.handles() > 60 {
        assert!(Instant::now() < end, "{} handles", watch.handles());
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(watch.is_alive());
}

#[test]
fn reports_port_in_use() {
    let (place, watch) = watch();
    let port = watch.address().0.to_string();
    let out = Command::new(env!("CARGO_BIN_EXE_shibo"))
        .args(["watch", "--no-open", "--no-cache", "--port", &port])
        .arg(&place.graph)
        .output()
        .unwrap();
    assert_eq!(out.status.code(), Some(1));
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(said.contains(&format!("port {port} is in use")) && said.contains("--port"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn only_this_machine_can_connect_and_a_signal_ends_it() {
    let (_place, mut watch) = watch();
    let port = format!("{:04X}", watch.address().0);
    let table = |name: &str| std::fs::read_to_string(format!("/proc/net/{name}")).unwrap_or_default();
    let listening = |text: &str, address: &str| {
        text.lines().any(|l| l.contains(&format!(" {address}:{port} ")) && l.contains(" 0A "))
    };
    assert!(listening(&table("tcp"), "0100007F"));
    assert!(!listening(&table("tcp"), "00000000") && !table("tcp6").contains(&format!(":{port} ")));
    assert!(Command::new("kill").args(["-INT", &watch.pid.to_string()]).status().unwrap().success());
    let end = Instant::now() + watching::PATIENCE;
    while watch.is_alive() {
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn serves_graph_of_ten_thousand_nodes() {
    let mut nodes = String::from("\"n0\": Perlin(size: 4),\n");
    for i in 1..10_000 {
        nodes += &format!("\"n{i}\": \"= 1.0001 * n{}\",\n", (i - 1) / 3);
    }
    let text = format!(
        "(version: 1, canvas: (size_mm: 8, resolution: 64), nodes: {{ {nodes} }}, outputs: {{ \"a\": \"n9999\" }})"
    );
    let place = Place::new(&text);
    let mut watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(text.as_bytes());
    let generation = watch.state()["scene"]["generation"].as_u64().unwrap();
    let graph: serde_json::Value = serde_json::from_slice(&watch.get(&format!("graph?g={generation}")).1).unwrap();
    assert_eq!(graph["nodes"].as_array().unwrap().len(), 10_000);
    assert_eq!(watch.get(&format!("thumb?g={generation}&n=9998")).0, 200);
    let edited = text.replace("size: 4", "size: 3");
    place.write(&edited);
    watch.wait_shown(edited.as_bytes());
    assert!(watch.is_alive());
}

#[test]
fn serves_picture_of_16384_in_tiles() {
    let text = plain(0.5).replace("resolution: 64", "resolution: 16384");
    let place = Place::new(&text);
    let watch = Watch::start(&place.graph, &["--memory", "256"]);
    let shown = watch.wait_shown(text.as_bytes());
    assert_eq!(shown.json["size"], serde_json::json!([2048, 2048]));
    let generation = watch.state()["scene"]["generation"].as_u64().unwrap();
    for (l, x, y) in [(0, 0, 0), (0, 31, 31), (3, 3, 3), (5, 0, 0)] {
        let (status, png) = watch.get(&format!("tile?g={generation}&t=grey&l={l}&x={x}&y={y}"));
        assert_eq!(status, 200);
        assert_eq!(image::load_from_memory(&png).unwrap().width(), 512, "{l}");
    }
    assert!(watch.status("VmHWM") < 700 << 10, "{} KiB", watch.status("VmHWM"));
}

#[cfg(unix)]
#[test]
fn a_file_without_permission_is_waited_for() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let place = Place::new(&plain(0.5));
    std::fs::set_permissions(place.dir.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
    // Root never gets this error.
    let watch = if std::fs::metadata("/proc/self").is_ok_and(|me| me.uid() == 0) {
        Watch::start_as_nobody(&place.graph, &[])
    } else {
        None
    };
    let watch = watch.unwrap_or_else(|| Watch::start(&place.graph, &[]));
    watch.wait_shown(plain(0.5).as_bytes());
    std::fs::set_permissions(&place.graph, std::fs::Permissions::from_mode(0o000)).unwrap();
    let owner = format!("/proc/{}", watch.pid);
    if std::fs::metadata(owner).is_ok_and(|it| it.uid() != 0) {
        let error = watch.wait_for(|e| e["event"] == "error");
        assert_eq!(error.json["errors"][0]["code"], "bad-file");
    }
    std::fs::set_permissions(&place.graph, std::fs::Permissions::from_mode(0o644)).unwrap();
    watch.wait_shown(plain(0.5).as_bytes());
    place.write(&plain(0.8));
    watch.wait_shown(plain(0.8).as_bytes());
}

/// A tab as the server sees it: loads the page and the picture, listens until it hears of `sha`, and gives the stream.
fn tab(port: u16, token: &str, sha: &str) -> TcpStream {
    let connect = || {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(watching::PATIENCE)).unwrap();
        stream
    };
    let get = |path: &str| {
        let mut stream = connect();
        let head = format!("GET /{token}/{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n");
        stream.write_all(head.as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let (status, body) = split(&answer);
        assert_eq!(status, 200, "{path}");
        body
    };
    let mut stream = connect();
    write!(stream, "GET /{token}/events HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").unwrap();
    for file in ["", "app.js", "style.css"] {
        assert!(!get(file).is_empty());
    }
    let state: serde_json::Value = serde_json::from_slice(&get("state")).unwrap();
    let picture = state["scene"]["pictures"]["grey"]["picture"].as_str().unwrap();
    assert!(get(picture).starts_with(b"\x89PNG"));
    let (mut heard, mut part) = (String::new(), [0; 16 << 10]);
    while !heard.contains(sha) {
        let n = stream.read(&mut part).unwrap();
        assert!(n > 0, "{heard}");
        heard += &String::from_utf8_lossy(&part[..n]);
    }
    stream
}

#[test]
fn a_hundred_tabs_hear_of_every_save_and_leave_nothing_behind() {
    let (place, mut watch) = watch();
    let (port, token) = watch.address();
    let before = (watch.handles(), watch.status("Threads"), watch.status("VmRSS"));
    for round in 0..3 {
        let last = plain(0.7 + 0.01 * f64::from(round));
        let sha = watching::sha256(last.as_bytes());
        let streams: Vec<TcpStream> = std::thread::scope(|scope| {
            let tabs: Vec<_> = (0..100).map(|_| scope.spawn(|| tab(port, token, &sha))).collect();
            for i in 0..10 {
                place.write(&plain(0.1 + 0.01 * f64::from(i)));
                std::thread::sleep(Duration::from_millis(20));
            }
            place.write(&last);
            tabs.into_iter().map(|tab| tab.join().unwrap()).collect()
        });
        watch.wait_shown(last.as_bytes());
        assert!(watch.handles() < before.0 + 140, "{}", watch.handles());
        // Some more listeners are accepted, then further ones get status 503; other requests still work.
        let mut statuses = Vec::new();
        let more: Vec<TcpStream> = (0..40)
            .map(|_| {
                let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
                stream.set_read_timeout(Some(watching::PATIENCE)).unwrap();
                write!(stream, "GET /{token}/events HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n").unwrap();
                let mut head = [0; 12];
                stream.read_exact(&mut head).unwrap();
                statuses.push(String::from_utf8_lossy(&head[9..]).into_owned());
                stream
            })
            .collect();
        let count = |status: &str| statuses.iter().filter(|s| *s == status).count();
        assert_eq!((count("200"), count("503")), (28, 12), "{statuses:?}");
        assert_eq!(watch.get("state").0, 200);
        drop((streams, more));
        // Closed streams are noticed when an event is sent, and every ten seconds.
        let end = Instant::now() + watching::PATIENCE;
        while watch.handles() > before.0 + 2 {
            assert!(Instant::now() < end, "{} handles", watch.handles());
            std::thread::sleep(Duration::from_millis(50));
        }
    }
    let after = (watch.handles(), watch.status("Threads"), watch.status("VmRSS"));
    println!("before and after 300 tabs: {before:?}, {after:?} (handles, threads, KiB)");
    assert!(after.1 <= before.1 + 16 && after.2 < before.2 + (48 << 10), "{before:?} {after:?}");
    assert!(watch.is_alive());
}
