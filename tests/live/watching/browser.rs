//! A real headless browser, driven by its DevTools protocol.
use super::PATIENCE;
use serde_json::{Value as Json, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Instant;
use tungstenite::{Message, WebSocket};

/// Supported browsers.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// A profile in the one browser shared by all tests: starting a browser takes longer than most tests.
pub(crate) struct Browser {
    shared: &'static Shared,
    /// The profile's identifier in the protocol.
    pub(crate) context: String,
}

/// The running browser. It ends when this process ends in any way, because its pipe is then closed.
struct Shared {
    port: u16,
    control: Mutex<Page>,
    /// Ends when its input is closed, that is, with this process.
    _child: Child,
}

/// A page of the browser.
pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    next: u64,
    /// Errors and warnings of the page's console.
    pub(crate) complaints: Vec<String>,
}

fn find() -> PathBuf {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found = NAMES.iter().flat_map(|name| std::env::split_paths(&paths).map(move |dir| dir.join(name)));
    found.into_iter().find(|path| path.is_file()).expect("a browser: install chromium (`apt-get install chromium`)")
}

impl Shared {
    fn start() -> Self {
        let profile = tempfile::tempdir().unwrap().keep();
        // The browser ends when the pipe at its third file descriptor closes; then its profile is removed.
        let mut child = Command::new("sh")
            .args([
                "-c",
                "profile=$1; shift; \"$@\" \"--user-data-dir=$profile\" about:blank 3<&0 4>&1; rm -rf \"$profile\"",
                "sh",
            ])
            .arg(&profile)
            .arg(find())
            .args(["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio"])
            .args(["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--remote-debugging-port=0"])
            .args(["--remote-debugging-pipe", "--remote-allow-origins=*", "--disable-background-networking"])
            .arg("--window-size=1280,720")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
        let address = lines.find_map(|line| Some(line.split_once("ws://127.0.0.1:")?.1.to_owned())).expect("a port");
        let (port, path) = address.split_once('/').unwrap();
        let port = port.parse().unwrap();
        // Keeps reading stderr, so that the browser never blocks on it.
        std::thread::spawn(move || lines.for_each(drop));
        Self { port, control: Mutex::new(Page::connect(port, path)), _child: child }
    }

    fn call(&self, method: &str, params: Json) -> Json {
        self.control.lock().unwrap_or_else(PoisonError::into_inner).call(method, params)
    }
}

impl Browser {
    pub(crate) fn start() -> Self {
        static SHARED: OnceLock<Shared> = OnceLock::new();
        let shared = SHARED.get_or_init(Shared::start);
        let context = shared.call("Target.createBrowserContext", json!({}));
        Self { shared, context: context["browserContextId"].as_str().unwrap().to_owned() }
    }

    /// Opens `url` in a window of its own, because hidden tabs draw nothing.
    pub(crate) fn open(&self, url: &str) -> Page {
        let wanted = json!({ "url": "about:blank", "browserContextId": self.context, "newWindow": true });
        let target = self.shared.call("Target.createTarget", wanted);
        let path = format!("devtools/page/{}", target["targetId"].as_str().unwrap());
        let mut page = Page::connect(self.shared.port, &path);
        page.call("Runtime.enable", json!({}));
        page.call("Log.enable", json!({}));
        page.call("Page.enable", json!({}));
        page.size(1280, 720, 1.0);
        page.call("Page.navigate", json!({ "url": url }));
        page
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // A failed test may have left the connection in a bad state: then the browser ends with the process.
        if !std::thread::panicking() {
            self.shared.call("Target.disposeBrowserContext", json!({ "browserContextId": self.context }));
        }
    }
}

impl Page {
    fn connect(port: u16, path: &str) -> Self {
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (socket, _) = tungstenite::client(format!("ws://127.0.0.1:{port}/{path}"), stream).unwrap();
        Self { socket, next: 0, complaints: Vec::new() }
    }

    /// Shows a tab of the panel, and waits for its code.
    pub(crate) fn tab(&mut self, name: &str) {
        self.eval(&format!("document.getElementById('tab-{name}').click()"));
        self.wait(&format!("document.documentElement.dataset.tab == '{name}'"));
    }

    /// Calls a method of the protocol.
    pub(crate) fn call(&mut self, method: &str, params: Json) -> Json {
        self.next += 1;
        let id = self.next;
        let request = json!({ "id": id, "method": method, "params": params });
        self.socket.send(Message::text(request.to_string())).unwrap();
        loop {
            let message = self.socket.read().unwrap();
            let Ok(text) = message.to_text() else { continue };
            let Ok(mut json) = serde_json::from_str::<Json>(text) else { continue };
            if json["id"] == id {
                assert!(json["error"].is_null(), "{method}: {}", json["error"]);
                return json["result"].take();
            }
            match json["method"].as_str() {
                Some("Runtime.exceptionThrown") => self.complaints.push(json["params"].to_string()),
                Some("Log.entryAdded") if json["params"]["entry"]["level"] == "error" => {
                    self.complaints.push(json["params"]["entry"].to_string());
                }
                _ => {}
            }
        }
    }

    /// The value of an expression.
    pub(crate) fn eval(&mut self, expression: &str) -> Json {
        let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {}", result["exceptionDetails"]);
        result["result"]["value"].take()
    }

    /// Waits until an expression is true.
    pub(crate) fn wait(&mut self, expression: &str) {
        let end = Instant::now() + PATIENCE;
        while self.eval(&format!("!!document.documentElement && !!({expression})")) != true {
            let state = "document.documentElement?.outerHTML.slice(0, 300) + JSON.stringify({...document.documentElement?.dataset})";
            assert!(Instant::now() < end, "waited for {expression}: {} {:?}", self.eval(state), self.complaints);
            std::thread::sleep(std::time::Duration::from_millis(15));
        }
    }

    /// Presses a key.
    pub(crate) fn key(&mut self, key: &str) {
        let event =
            format!("document.body.dispatchEvent(new KeyboardEvent('keydown', {{ key: {key:?}, bubbles: true }}))");
        self.eval(&event);
    }

    /// Presses a key as a keyboard does. `modifiers` is the sum of 1 for Alt, 2 for Control and 8 for Shift.
    pub(crate) fn press(&mut self, key: &str, modifiers: u8) {
        let code = match key {
            "Tab" => 9,
            "Enter" => 13,
            "Escape" => 27,
            "Backspace" => 8,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            key => u32::from(key.to_uppercase().as_bytes()[0]),
        };
        let digit = key.len() == 1 && key.as_bytes()[0].is_ascii_digit();
        let physical = if digit { format!("Digit{key}") } else { key.to_owned() };
        let plain = key.len() == 1 && modifiers & 3 == 0;
        let mut event = json!({
            "type": if plain { "keyDown" } else { "rawKeyDown" },
            "key": key, "code": physical, "modifiers": modifiers, "windowsVirtualKeyCode": code,
        });
        if plain {
            event["text"] = key.into();
        }
        self.call("Input.dispatchKeyEvent", event.clone());
        if key == "Enter" {
            self.call("Input.dispatchKeyEvent", json!({ "type": "char", "key": key, "text": "\r" }));
        }
        event["type"] = "keyUp".into();
        self.call("Input.dispatchKeyEvent", event);
    }

    /// Waits until changes are painted.
    pub(crate) fn painted(&mut self) {
        self.eval(
            "new Promise(done => { requestAnimationFrame(() => requestAnimationFrame(done)); setTimeout(done, 500); })",
        );
    }

    /// Runs a script that changes the 3-D view, and waits for a drawing that includes the change. The script also reads the number of
    /// drawings in the same step, so a drawing that was due before does not count.
    pub(crate) fn redraw(&mut self, change: &str) {
        const DRAWN: &str = "(+document.getElementById('lit').dataset.drawn || 0)";
        let before = self.eval(&format!("(() => {{ const n = {DRAWN}; {change}; return n; }})()"));
        self.wait(&format!("{DRAWN} > {before}"));
    }

    /// Sets the size of the window in CSS pixels, and the number of screen pixels for each.
    pub(crate) fn size(&mut self, width: u32, height: u32, scale: f64) {
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": scale, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Sends a mouse event at a point.
    pub(crate) fn mouse(&mut self, kind: &str, x: f64, y: f64) {
        let button = if kind == "mouseMoved" { "none" } else { "left" };
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": kind, "x": x, "y": y, "button": button, "clickCount": 1 }),
        );
    }

    /// A screenshot of the page as RGB by rows, and its width.
    pub(crate) fn screenshot(&mut self) -> (Vec<[u8; 3]>, u32) {
        let data = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let png = base64(data["data"].as_str().unwrap());
        if let Some(dir) = std::env::var_os("SHIBO_SHOTS") {
            let n = std::fs::read_dir(&dir).unwrap().count();
            std::fs::write(PathBuf::from(dir).join(format!("{n:02}.png")), &png).unwrap();
        }
        let image = image::load_from_memory(&png).unwrap().to_rgb8();
        (image.pixels().map(|p| p.0).collect(), image.width())
    }

    /// The colour of a point of the page.
    pub(crate) fn color(&mut self, x: u32, y: u32) -> [u8; 3] {
        let (pixels, width) = self.screenshot();
        pixels[(y * width + x) as usize]
    }
}

fn base64(text: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u8> = text.bytes().filter(|c| *c != b'=').map(value).collect();
    let group = |group: &[u8]| {
        let bits = group.iter().fold(0_u32, |bits, d| bits << 6 | u32::from(*d)) << (6 * (4 - group.len()));
        bits.to_be_bytes()[1..group.len()].to_vec()
    };
    digits.chunks(4).flat_map(group).collect()
}
