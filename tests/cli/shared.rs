//! A cache that several machines share: a folder, and an S3 server that fails in every possible way. Pictures keep the
//! same bytes, little time is lost, and one warning is printed.
//!
//! `$SHIBO_TEST_S3` may give the address of a real S3 server with a bucket `shibo-test`, which is then tested too.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH, Ran, finish};
use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Must never be printed.
const SECRET: &str = "hunter2hunter2";

/// Its simulation takes much longer than 0.2 s, above which results are always shared, also on a fast machine.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("steps: 20,", "steps: 100000,").replace("pitch: 4", "pitch: 1"));
    desk
}

/// Renders as a machine with a cache folder of its own.
fn render(desk: &Desk, machine: &str, url: &str, key: Option<&str>) -> Ran {
    let ran = finish(rendering(desk, machine, url, key)).expect(0);
    assert!(!ran.stdout.contains(SECRET) && !ran.stderr.contains(SECRET));
    ran
}

/// The command for [`render`].
fn rendering(desk: &Desk, machine: &str, url: &str, key: Option<&str>) -> std::process::Command {
    let args = ["render", "a.ron", "-o", machine, "--cache-dir", &format!("cache-{machine}"), "--shared-cache", url];
    let mut command = desk.command(args.into_iter().chain(["--stats", "json"]));
    command.env("AWS_ACCESS_KEY_ID", "key").env("AWS_SECRET_ACCESS_KEY", SECRET).env("AWS_REGION", "us-east-1");
    command.env("AWS_ALLOW_HTTP", "true").env_remove("SHIBO_CACHE_KEY").env("NO_PROXY", "127.0.0.1");
    if let Some(key) = key {
        command.env("SHIBO_CACHE_KEY", key);
    }
    if let Some(server) = url.strip_prefix("s3+") {
        let (server, bucket) = server.split_once(' ').unwrap();
        command.env("AWS_ENDPOINT_URL", server);
        let place = std::iter::once("render").chain(["a.ron", "-o", machine, "--cache-dir"]);
        let mut again =
            desk.command(place.chain([&*format!("cache-{machine}"), "--shared-cache", bucket, "--stats", "json"]));
        again.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
        again.env_remove("SHIBO_CACHE_KEY");
        if let Some(key) = key {
            again.env("SHIBO_CACHE_KEY", key);
        }
        command = again;
    }
    command
}

/// State of the node whose result is costly.
fn state(ran: &Ran) -> String {
    let json = ran.json();
    let node = json["nodes"].as_array().unwrap().iter().find(|node| node["name"] == "moved").unwrap().clone();
    node["state"].as_str().unwrap().to_owned()
}

fn warnings(ran: &Ran) -> usize {
    ran.stderr.matches("warning").count()
}

#[track_caller]
fn same(desk: &Desk, one: &str, two: &str) {
    assert_eq!(desk.names(one), desk.names(two));
    for name in desk.names(one) {
        assert!(desk.read(&format!("{one}/{name}")) == desk.read(&format!("{two}/{name}")), "{two}/{name}");
    }
}

#[test]
fn machines_share_a_folder() {
    let desk = desk();
    let url = format!("file://{}", desk.path("share").display());
    let (a, b) = (render(&desk, "a", &url, None), render(&desk, "b", &url, None));
    assert_eq!((state(&a).as_str(), warnings(&a)), ("computed", 0), "{}", a.stderr);
    assert_ne!(state(&b), "computed", "{}", b.stderr);
    same(&desk, "a", "b");
    // With a secret, entries written without it are rejected, and others reject the entries written with it.
    let keyed = [
        render(&desk, "c", &url, Some("one")),
        render(&desk, "d", &url, Some("one")),
        render(&desk, "e", &url, Some("two")),
    ];
    assert_eq!(keyed.each_ref().map(|ran| state(ran) == "computed"), [true, false, true]);
    same(&desk, "a", "d");
    let cache = |line: &str| desk.shibo(&format!("cache {line} --shared-cache {url}"));
    let stat = cache("stat").expect(0).json();
    assert!(stat["entries"].as_u64().unwrap() >= 3 && stat["bytes"].as_u64().unwrap() > 1000, "{stat}");
    // Without a secret, entries of both secrets are foreign.
    assert!(cache("verify").expect(1).stderr.contains("another key"));
    // Files beside the entries are kept.
    desk.write("share/mine.txt", "mine");
    cache("clear").expect(0);
    assert_eq!(cache("stat").expect(0).json()["entries"], 0);
    assert_eq!(desk.read("share/mine.txt"), b"mine");
    render(&desk, "f", &url, None);
    assert_eq!(cache("verify").expect(0).json()["foreign"], 0);
}

#[test]
fn two_processes_write_into_a_folder_at_once() {
    let desk = desk();
    let url = format!("file://{}", desk.path("share").display());
    desk.shibo("render a.ron -o right --no-cache").expect(0);
    std::thread::scope(|scope| {
        for machine in ["a", "b"] {
            let (desk, url) = (&desk, &url);
            scope.spawn(move || assert_eq!(warnings(&render(desk, machine, url, None)), 0));
        }
    });
    assert_ne!(state(&render(&desk, "c", &url, None)), "computed");
    ["a", "b", "c"].into_iter().for_each(|machine| same(&desk, "right", machine));
}

#[test]
fn wrong_addresses_are_refused_without_repeating_them() {
    let desk = desk();
    for url in [
        &format!("s3://key:{SECRET}@b/p"),
        &format!("https://h/p?sig={SECRET}"),
        "ftp://h/p",
        "bucket",
        "s3://",
        "file://x/y",
    ] {
        let ran = desk.run(["render", "a.ron", "--shared-cache", url]).expect(2);
        assert!(!ran.stderr.contains(SECRET) && ran.stderr.contains("shared cache"), "{}", ran.stderr);
        let mut command = desk.command(["render", "a.ron"]);
        command.env("SHIBO_SHARED_CACHE", url);
        finish(command).expect(2);
    }
    let ran = desk.shibo("cache verify").expect(2);
    assert!(ran.stderr.contains("--shared-cache"), "{}", ran.stderr);
}

/// How the server of the tests answers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    Well,
    Unavailable,
    Stall,
    Drip,
    Cut,
    Lie,
    Deny,
    NoBucket,
    HangUp,
    /// More bytes than announced, without end.
    Endless,
    /// An error message without end.
    EndlessReason,
}

/// A server with the part of S3 that the cache needs.
struct Server {
    address: String,
    how: Arc<Mutex<How>>,
    held: Arc<Mutex<HashMap<String, Vec<u8>>>>,
}

impl Server {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("http://{}", listener.local_addr().unwrap());
        let (how, held) = (Arc::new(Mutex::new(How::Well)), Arc::new(Mutex::new(HashMap::new())));
        let shared = (how.clone(), held.clone());
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (how, held) = shared.clone();
                std::thread::spawn(move || while answer(&stream, &how, &held).is_some() {});
            }
        });
        Self { address, how, held }
    }

    fn url(&self) -> String {
        format!("s3+{} s3://bucket/prefix", self.address)
    }
}

/// Answers a request; `None` at the end of the connection.
fn answer(mut stream: &TcpStream, how: &Mutex<How>, held: &Mutex<HashMap<String, Vec<u8>>>) -> Option<()> {
    let mut head = Vec::new();
    let mut byte = [0];
    while !head.ends_with(b"\r\n\r\n") {
        stream.read_exact(&mut byte).ok()?;
        head.push(byte[0]);
    }
    let head = String::from_utf8(head).ok()?;
    let length = head.lines().find_map(|line| line.to_lowercase().strip_prefix("content-length:")?.trim().parse().ok());
    let mut body = vec![0; length.unwrap_or(0)];
    stream.read_exact(&mut body).ok()?;
    let mut words = head.split_whitespace();
    let (method, path) = (words.next()?, words.next()?.to_owned());
    let how = *how.lock().unwrap();
    let send = |mut stream: &TcpStream, status: &str, body: &[u8]| {
        let head = format!(
            "HTTP/1.1 {status}\r\ncontent-length: {}\r\nlast-modified: Wed, 01 Jan 2025 00:00:00 GMT\r\netag: \"x\"\r\n\r\n",
            body.len()
        );
        stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body)).ok()
    };
    match how {
        How::Unavailable => return send(stream, "503 Slow Down", b"<Error><Code>SlowDown</Code></Error>"),
        How::NoBucket => return send(stream, "404 Not Found", b"<Error><Code>NoSuchBucket</Code></Error>"),
        How::Stall => std::thread::sleep(Duration::from_secs(30)),
        How::HangUp => return None,
        How::Endless | How::EndlessReason => {
            let status = if how == How::Endless { "200 OK" } else { "500 Internal Server Error" };
            let head = format!(
                "HTTP/1.1 {status}\r\ncontent-length: 100\r\ntransfer-encoding: chunked\r\n\
                 last-modified: Wed, 01 Jan 2025 00:00:00 GMT\r\netag: \"x\"\r\n\r\n"
            );
            stream.write_all(head.as_bytes()).ok()?;
            let chunk = [&b"100000\r\n"[..], &vec![7; 1 << 20], b"\r\n"].concat();
            while stream.write_all(&chunk).is_ok() {}
            return None;
        }
        How::Deny if method == "PUT" => {
            return send(stream, "403 Forbidden", b"<Error><Code>AccessDenied</Code></Error>");
        }
        _ => {}
    }
    if method == "PUT" {
        held.lock().unwrap().insert(path, body);
        return send(stream, "200 OK", b"");
    }
    let Some(found) = held.lock().unwrap().get(&path).cloned() else {
        return send(stream, "404 Not Found", b"<Error><Code>NoSuchKey</Code></Error>");
    };
    match how {
        How::Lie => send(stream, "200 OK", &vec![7; found.len()]),
        How::Cut | How::Drip => {
            let head = format!(
                "HTTP/1.1 200 OK\r\ncontent-length: {}\r\nlast-modified: Wed, 01 Jan 2025 00:00:00 GMT\r\netag: \"x\"\r\n\r\n",
                found.len()
            );
            stream.write_all(head.as_bytes()).ok()?;
            if how == How::Cut {
                stream.write_all(&found[..found.len() / 2]).ok()?;
                return None;
            }
            for byte in found {
                stream.write_all(&[byte]).ok()?;
                std::thread::sleep(Duration::from_millis(50));
            }
            Some(())
        }
        _ => send(stream, "200 OK", &found),
    }
}

#[test]
fn survives_all_server_failures() {
    let desk = desk();
    desk.shibo("render a.ron -o right --no-cache").expect(0);
    let server = Server::start();
    let first = render(&desk, "first", &server.url(), None);
    assert_eq!((state(&first).as_str(), warnings(&first)), ("computed", 0), "{}", first.stderr);
    let second = render(&desk, "second", &server.url(), None);
    assert_eq!((state(&second) == "computed", warnings(&second)), (false, 0), "{}", second.stderr);
    same(&desk, "right", "second");
    let held = server.held.lock().unwrap().clone();
    assert!(held.keys().all(|path| path.starts_with("/bucket/prefix/")), "{:?}", held.keys());
    let all = [How::Unavailable, How::Stall, How::Drip, How::Cut, How::Lie, How::NoBucket, How::HangUp];
    // One server for each failure, because most of the time is waiting.
    let fail = &|how: How| {
        let server = Server::start();
        server.held.lock().unwrap().clone_from(&held);
        *server.how.lock().unwrap() = how;
        let machine = format!("{how:?}");
        let started = Instant::now();
        let ran = render(&desk, &machine, &server.url(), None);
        // A store costs at most five seconds; this bound finds a client that waits for the server.
        assert!(started.elapsed() < Duration::from_secs(300), "{how:?}: {:?}", started.elapsed());
        assert_eq!(warnings(&ran), 1, "{how:?}: {}", ran.stderr);
        assert!(ran.stderr.contains("s3://bucket/prefix") && ran.stderr.contains("the same results"), "{}", ran.stderr);
        same(&desk, "right", &machine);
    };
    std::thread::scope(|scope| all.map(|how| scope.spawn(move || fail(how))).map(|one| one.join().unwrap()));
    // A wrong entry was replaced, since the server accepted the write.
    *server.how.lock().unwrap() = How::Lie;
    render(&desk, "lie", &server.url(), None);
    *server.how.lock().unwrap() = How::Well;
    assert_ne!(state(&render(&desk, "mended", &server.url(), None)), "computed");
    // A client without write permission still reads.
    *server.how.lock().unwrap() = How::Deny;
    let reader = render(&desk, "reader", &server.url(), None);
    assert_ne!(state(&reader), "computed");
    server.held.lock().unwrap().clear();
    let denied = render(&desk, "denied", &server.url(), None);
    assert_eq!((state(&denied).as_str(), warnings(&denied)), ("computed", 1), "{}", denied.stderr);
    assert!(denied.stderr.contains("does not allow it"), "{}", denied.stderr);
}

/// Peak memory of a process in MiB.
#[cfg(target_os = "linux")]
fn peak(mut command: std::process::Command) -> u64 {
    let mut child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
        most = most.max(kilobytes.unwrap_or(0) >> 10);
        std::thread::sleep(Duration::from_millis(5));
    }
    most
}

#[test]
#[cfg(target_os = "linux")]
fn endless_answers_take_no_memory() {
    let desk = desk();
    desk.shibo("render a.ron -o right --no-cache").expect(0);
    let usual = peak(desk.command(["render", "a.ron", "-o", "usual", "--no-cache"]));
    for how in [How::Endless, How::EndlessReason] {
        let server = Server::start();
        *server.how.lock().unwrap() = how;
        let machine = format!("{how:?}");
        let most = peak(rendering(&desk, &machine, &server.url(), None));
        assert!(most < usual + 96, "{how:?}: {most} MiB, without a shared cache {usual} MiB");
        same(&desk, "right", &machine);
    }
}

#[test]
fn unreachable_server_gives_one_warning() {
    let desk = desk();
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let ran = render(&desk, "a", &format!("s3+http://{address} s3://bucket"), None);
    assert_eq!((state(&ran).as_str(), warnings(&ran)), ("computed", 1), "{}", ran.stderr);
    assert!(ran.stderr.contains("cannot be reached"), "{}", ran.stderr);
}

#[test]
fn a_real_server_is_shared() {
    let Ok(server) = std::env::var("SHIBO_TEST_S3") else { return };
    let desk = desk();
    let none = render(&desk, "none", &format!("s3+{server} s3://no-such-bucket/p"), None);
    assert_eq!(warnings(&none), 1, "{}", none.stderr);
    let url = format!("s3+{server} s3://shibo-test/p");
    let (a, b) = (render(&desk, "a", &url, Some("one")), render(&desk, "b", &url, Some("one")));
    assert_eq!((state(&a) == "computed", warnings(&a)), (true, 0), "{}", a.stderr);
    assert_eq!((state(&b) == "computed", warnings(&b)), (false, 0), "{}", b.stderr);
    same(&desk, "a", "b");
}
