//! `shibo mcp`: an agent talks to the server over stdin and stdout.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::{Desk, GRAPH};
use serde_json::{Value as Json, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use std::time::{Duration, Instant};

/// A server and a client of it.
struct Client {
    server: Child,
    stdin: Option<ChildStdin>,
    stdout: BufReader<ChildStdout>,
    id: u64,
}

impl Client {
    /// Starts a server and shakes hands. `None` if the program has no server.
    fn start(desk: &Desk, line: &str) -> Option<Self> {
        let mut command = desk.command(line.split_whitespace());
        let mut server = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let stdin = server.stdin.take();
        let stdout = BufReader::new(server.stdout.take().unwrap());
        let mut client = Self { server, stdin, stdout, id: 0 };
        let hello = json!({ "protocolVersion": "2025-11-25", "capabilities": {}, "clientInfo": { "name": "t", "version": "1" } });
        client.send("initialize", &hello);
        let Some(answer) = client.receive() else {
            let mut said = String::new();
            client.server.stderr.take().unwrap().read_to_string(&mut said).unwrap();
            assert!(said.contains("built without the server"), "{said}");
            eprintln!("skipped: shibo mcp, this program was built without the feature `mcp`");
            return None;
        };
        assert_eq!(answer["result"]["serverInfo"]["name"], "shibo", "{answer}");
        client.line(&json!({ "jsonrpc": "2.0", "method": "notifications/initialized" }));
        Some(client)
    }

    fn line(&mut self, message: &Json) {
        writeln!(self.stdin.as_mut().unwrap(), "{message}").ok();
    }

    fn send(&mut self, method: &str, params: &Json) {
        self.id += 1;
        let id = self.id;
        self.line(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
    }

    fn receive(&mut self) -> Option<Json> {
        let mut line = String::new();
        self.stdout.read_line(&mut line).unwrap();
        (!line.is_empty()).then(|| serde_json::from_str(&line).unwrap())
    }

    fn ask(&mut self, method: &str, params: &Json) -> Json {
        self.send(method, params);
        let answer = self.receive().unwrap();
        assert_eq!(answer["id"], self.id, "{answer}");
        answer
    }

    /// Calls a tool: its structured content, and true if the call succeeded.
    fn call(&mut self, tool: &str, arguments: &Json) -> (Json, bool) {
        let answer = self.ask("tools/call", &json!({ "name": tool, "arguments": arguments }));
        let result = &answer["result"];
        let text: Json = serde_json::from_str(result["content"][0]["text"].as_str().unwrap()).unwrap();
        assert_eq!(text, result["structuredContent"], "{tool}");
        (text, result["isError"] != true)
    }

    fn good(&mut self, tool: &str, arguments: &Json) -> Json {
        let (content, good) = self.call(tool, arguments);
        assert!(good, "{tool}: {content}");
        content
    }

    /// Calls a tool that refuses: the code.
    fn refused(&mut self, tool: &str, arguments: &Json) -> String {
        let (content, good) = self.call(tool, arguments);
        assert!(!good, "{tool}: {content}");
        content["refused"]["code"].as_str().unwrap_or_default().to_owned()
    }

    /// Closes stdin; the server must end within a second, and within three on a busy machine. Returns the last lines.
    fn end(mut self) -> String {
        drop(self.stdin.take());
        let start = Instant::now();
        let mut rest = String::new();
        self.stdout.read_to_string(&mut rest).unwrap();
        assert_eq!(self.server.wait().unwrap().code(), Some(0));
        assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
        rest
    }
}

#[test]
fn tools_have_schemas_and_hints() {
    let desk = Desk::new();
    let Some(mut client) = Client::start(&desk, "mcp") else { return };
    let listed = client.ask("tools/list", &json!({}));
    let tools = listed["result"]["tools"].as_array().unwrap();
    let names: Vec<&str> = tools.iter().map(|tool| tool["name"].as_str().unwrap()).collect();
    assert_eq!(
        names,
        [
            "search_nodes",
            "describe_node",
            "list_graphs",
            "describe_graph",
            "check",
            "fix",
            "format",
            "render",
            "compare",
            "write"
        ]
    );
    for tool in tools {
        assert_eq!(tool["inputSchema"]["type"], "object", "{tool}");
        assert_eq!(tool["outputSchema"]["type"], "object", "{tool}");
        assert_eq!(tool["annotations"]["readOnlyHint"], tool["name"] != "write", "{tool}");
    }
    assert!(client.ask("tools/call", &json!({ "name": "rm", "arguments": {} }))["error"]["code"].is_i64());
    assert_eq!(client.refused("check", &json!({ "txt": "" })), "bad-arguments");
    client.end();
}

#[test]
fn agent_finds_checks_and_renders() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    let Some(mut client) = Client::start(&desk, "mcp --read .") else { return };
    let found = client.good("search_nodes", &json!({ "words": "color ramp" }));
    assert!(found["nodes"].as_array().unwrap().iter().any(|node| node["kind"] == "GradientMap"), "{found}");
    let node = client.good("describe_node", &json!({ "kind": "Perlin" }));
    assert!(node["manual"].as_str().unwrap().contains("```"), "{node}");
    assert_eq!(client.refused("describe_node", &json!({ "kind": "Perlim" })), "unknown");
    let graphs = client.good("list_graphs", &json!({}));
    let paths: Vec<&str> = graphs["graphs"].as_array().unwrap().iter().map(|g| g["path"].as_str().unwrap()).collect();
    assert!(paths.contains(&"shibo:calf") && paths.contains(&"a.ron"), "{paths:?}");
    let graph = client.good("describe_graph", &json!({ "path": "a.ron" }));
    assert_eq!((&graph["params"][0]["unit"], &graph["outputs"][0]["name"]), (&json!("mm"), &json!("bumps")));
    let bumps = graph["nodes"].as_array().unwrap().iter().find(|node| node["name"] == "bumps").unwrap();
    assert_eq!(bumps["readers"], json!(["springs"]));
    let checked = client.good("check", &json!({ "text": "(nodes: { \"a\": Perlim() })" }));
    assert_eq!(checked["errors"][0]["code"], "unknown-kind");
    assert_eq!(checked["errors"][0]["file"], "text.ron");
    assert_eq!(checked["errors"][0]["fixes"][0]["edits"][0]["text"], "Perlin");
    let fixed = client.good("fix", &json!({ "text": "(nodes: { \"a\": Perlim(size: 3mm) })" }));
    assert_eq!(fixed["text"], "(nodes: { \"a\": Perlin(size: 3) })");
    assert_eq!(fixed["diagnostics"]["errors"], json!([]));
    let laid = client.good("format", &json!({ "text": "(nodes:{\"a\":Perlin()})" }));
    assert_eq!(laid["text"], "(\n  nodes: {\n    \"a\": Perlin(),\n  },\n)\n");

    client.send(
        "tools/call",
        &json!({ "name": "render", "arguments": { "path": "a.ron", "output": "bumps", "size": 64 } }),
    );
    let answer = client.receive().unwrap();
    let result = &answer["result"];
    assert_eq!(result["content"][1]["mimeType"], "image/png", "{answer}");
    assert!(result["content"][1]["data"].as_str().unwrap().starts_with("iVBORw0KGgo"));
    let facts = &result["structuredContent"];
    assert_eq!((&facts["size"], &facts["tiles"]), (&json!([64, 64]), &json!([true, true])));
    assert!(
        facts["min"][0].as_f64() < facts["mean"][0].as_f64() && facts["mean"][0].as_f64() < facts["max"][0].as_f64()
    );
    client.good("render", &json!({ "path": "a.ron", "node": "bumps", "size": 32, "set": { "size": "9" } }));
    assert_eq!(client.refused("render", &json!({ "path": "a.ron", "size": 4096 })), "out-of-range");
    let (faulty, good) = client.call("render", &json!({ "text": "(nodes: { \"a\": Perlim() })", "node": "a" }));
    assert!(!good && faulty["diagnostics"]["errors"][0]["code"] == "unknown-kind", "{faulty}");
    let side = |size: &str| json!({ "path": "a.ron", "output": "bumps", "size": 128, "set": { "size": size } });
    let compared = client.good("compare", &json!({ "a": side("8"), "b": side("4") }));
    assert!(compared["words"].is_array(), "{compared}");
    client.end();
}

#[test]
fn resources_are_read() {
    let desk = Desk::new();
    let Some(mut client) = Client::start(&desk, "mcp") else { return };
    let listed = client.ask("resources/list", &json!({}));
    assert!(listed["result"]["resources"].as_array().unwrap().len() > 60);
    for (uri, part) in [
        ("shibo://schema", "draft/2020-12"),
        ("shibo://manual/Perlin", "Perlin"),
        ("shibo://docs/graph-file", "# "),
        ("shibo://graph/calf", "nodes"),
    ] {
        let read = client.ask("resources/read", &json!({ "uri": uri }));
        let text = read["result"]["contents"][0]["text"].as_str().unwrap_or_else(|| panic!("{read}"));
        assert!(text.contains(part), "{uri}");
    }
    for uri in ["shibo://docs/../Cargo", "shibo://graph/none", "file:///etc/passwd"] {
        assert!(client.ask("resources/read", &json!({ "uri": uri }))["error"].is_object(), "{uri}");
    }
    client.end();
}

#[test]
fn agent_stays_in_its_folders() {
    let desk = Desk::new();
    for folder in ["data", "data-2"] {
        std::fs::create_dir(desk.path(folder)).unwrap();
    }
    desk.write("secret.ron", GRAPH);
    desk.write("data-2/secret.ron", GRAPH);
    desk.write("data/a.ron", GRAPH);
    #[cfg(unix)]
    std::os::unix::fs::symlink("../secret.ron", desk.path("data/link.ron")).unwrap();
    let Some(mut client) = Client::start(&desk, "mcp --read data --write data") else { return };
    let whole = |path: &str| desk.path(path).to_string_lossy().into_owned();
    let mut outside = vec!["../secret.ron".to_owned(), "../data-2/secret.ron".to_owned(), whole("secret.ron")];
    outside.extend([
        whole("data-2/secret.ron"),
        whole("data-2/none.ron"),
        "~/x.ron".to_owned(),
        "/etc/passwd".to_owned(),
    ]);
    if cfg!(unix) {
        outside.push("link.ron".to_owned());
    }
    for path in &outside {
        assert_eq!(client.refused("check", &json!({ "path": path })), "outside", "{path}");
        assert_ne!(client.refused("write", &json!({ "path": path, "text": "x" })), "", "{path}");
        // A graph reaches no further than its agent, and does not tell if a file exists.
        let import = format!("(imports: {{ \"s\": {path:?} }}, nodes: {{ \"a\": Perlin() }})");
        let checked = client.good("check", &json!({ "text": import }));
        let code = checked["errors"][0]["code"].as_str().unwrap();
        assert!(["outside", "file-not-found"].contains(&code), "{path}: {checked}");
        let (fixed, _) = client.call("fix", &json!({ "text": import }));
        assert_eq!(fixed["text"], import, "{path}: {fixed}");
        let picture = format!("(nodes: {{ \"a\": Image(path: {path:?}) }})");
        let checked = client.good("check", &json!({ "text": picture }));
        assert_eq!(checked["errors"][0]["code"], "outside", "{path}: {checked}");
    }
    assert_eq!(client.refused("check", &json!({ "path": "none.ron" })), "file-not-found");

    let saved = client.good("write", &json!({ "path": "new.ron", "text": "one\n" }));
    assert_eq!(desk.read("data/new.ron"), b"one\n");
    assert_eq!(client.refused("write", &json!({ "path": "new.ron", "text": "two\n" })), "changed");
    let saved = client.good("write", &json!({ "path": "new.ron", "text": "two\n", "expect": saved["sha256"] }));
    assert!(saved["diff"].as_str().unwrap().contains("-one"), "{saved}");
    client.end();
    let Some(mut client) = Client::start(&desk, "mcp --read data") else { return };
    assert_eq!(client.refused("write", &json!({ "path": "b.ron", "text": "x" })), "outside");
    client.end();
}

#[test]
fn bad_lines_and_long_calls_do_not_end_the_server() {
    let desk = Desk::new();
    let Some(mut client) = Client::start(&desk, "mcp --seconds 1 --threads 1") else { return };
    writeln!(client.stdin.as_mut().unwrap(), "{}", "x".repeat(9 << 20)).unwrap();
    let error = client.receive().unwrap();
    assert_eq!((&error["id"], &error["error"]["code"]), (&Json::Null, &json!(-32600)), "{error}");
    // A long call is answered by its number.
    let text = "x".repeat(9 << 20);
    let error = client.ask("tools/call", &json!({ "name": "check", "arguments": { "text": text } }));
    assert!(error["error"]["message"].as_str().unwrap().contains("longer than 8 MiB"), "{error}");
    for (line, code) in
        [("not json", -32700), ("{}", -32600), (r#"{"jsonrpc":"2.0","id":1.5,"method":"ping"}"#, -32600)]
    {
        writeln!(client.stdin.as_mut().unwrap(), "{line}").unwrap();
        let error = client.receive().unwrap();
        assert_eq!((&error["id"], &error["error"]["code"]), (&Json::Null, &json!(code)), "{error}");
    }
    let (content, good) = client.call("render", &json!({ "path": "shibo:oak", "size": 512 }));
    assert!(good || content["refused"]["code"] == "too-long", "{content}");
    // Cancelling frees the place of a call.
    client.send("tools/call", &json!({ "name": "render", "arguments": { "path": "shibo:burl", "size": 512 } }));
    let id = client.id;
    client.line(&json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": id } }));
    client.send("ping", &json!({}));
    let ping = client.id;
    loop {
        let answer = client.receive().unwrap();
        if answer["id"] == ping {
            break;
        }
    }
    client.end();
}

/// A graph that takes minutes.
const LONG: &str = r#"(
  canvas: (size_mm: 200, resolution: 64, tile: Both, seed: 1),
  nodes: {
    "noise": Fractal(size: 9), "points": PoissonPoints(pitch: 1), "net": ConnectNeighbors(points: "points"),
    "springs": DefineSprings(lattice: "net", field: "noise"),
    "moved": SimulateSprings(springs: "springs", steps: 100000, drag: 4),
    "folds": PlaceWrinkles(lattice: "moved"), "drawn": DrawWrinkles(segments: "folds", width: (0.5, 1)),
  },
  outputs: { "mask": "drawn.mask" },
)"#;

#[test]
fn end_of_stdin_ends_work() {
    let desk = Desk::new();
    let Some(mut client) = Client::start(&desk, "mcp --threads 1") else { return };
    // Four calls run, and two wait.
    for _ in 0..6 {
        client.send("tools/call", &json!({ "name": "render", "arguments": { "text": LONG } }));
    }
    // Its answer tells that the calls are read.
    client.send("ping", &json!({}));
    assert_eq!(client.receive().unwrap()["id"], client.id);
    std::thread::sleep(Duration::from_millis(200));
    let rest = client.end();
    // Calls that are answered at all tell that they were cancelled.
    assert!(rest.lines().all(|line| line.contains("cancelled")), "{rest}");
}

#[test]
fn calls_that_were_given_up_make_room() {
    let desk = Desk::new();
    let Some(mut client) = Client::start(&desk, "mcp --threads 1") else { return };
    // More than the requests that may wait for their answers.
    for _ in 0..80 {
        client.send("tools/call", &json!({ "name": "render", "arguments": { "text": LONG } }));
        let id = client.id;
        client.line(&json!({ "jsonrpc": "2.0", "method": "notifications/cancelled", "params": { "requestId": id } }));
    }
    client.send("tools/call", &json!({ "name": "check", "arguments": { "text": "(nodes: {})" } }));
    // A call that was refused before it was cancelled may be answered first.
    let answer = std::iter::repeat_with(|| client.receive().unwrap()).find(|answer| answer["id"] == 82).unwrap();
    assert!(answer["result"]["isError"] != true || answer.to_string().contains("busy"), "{answer}");
    client.end();
}

#[test]
fn a_client_may_read_its_answers_late() {
    let desk = Desk::new();
    let Some(mut client) = Client::start(&desk, "mcp") else { return };
    let first = client.id + 1;
    for _ in 0..300 {
        client.send("tools/list", &json!({}));
    }
    let mut ids: Vec<u64> = (0..300).map(|_| client.receive().unwrap()["id"].as_u64().unwrap()).collect();
    ids.sort_unstable();
    assert_eq!(ids, (first..first + 300).collect::<Vec<u64>>());
    client.end();
}

#[test]
fn render_shows_a_region() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    let Some(mut client) = Client::start(&desk, "mcp --read .") else { return };
    let mut bumps = |size: u32, region: Option<[f64; 4]>| {
        let arguments = json!({ "path": "a.ron", "output": "bumps", "size": size, "region": region });
        client.good("render", &arguments)
    };
    let whole = bumps(128, None);
    assert_eq!((&whole["size"], &whole["region"]), (&json!([128, 128]), &json!([0.0, 0.0, 40.0, 40.0])));
    let part = bumps(64, Some([10.0, 20.0, 10.0, 5.0]));
    assert_eq!((&part["size"], &part["region"]), (&json!([64, 32]), &json!([10.0, 20.0, 10.0, 5.0])));
    assert_eq!(part["mm_per_pixel"].as_f64(), Some(10.0 / 64.0));
    // Four quarters have the pixels of the whole.
    let quarters =
        [[0.0, 0.0], [20.0, 0.0], [0.0, 20.0], [20.0, 20.0]].map(|[x, y]| bumps(64, Some([x, y, 20.0, 20.0])));
    let each = |name: &str| quarters.clone().map(|quarter| quarter[name][0].as_f64().unwrap());
    let same = |name: &str, value: f64| (whole[name][0].as_f64().unwrap() - value).abs() < 1e-6;
    assert!(same("min", each("min").into_iter().fold(f64::INFINITY, f64::min)), "{whole} {quarters:?}");
    assert!(same("max", each("max").into_iter().fold(f64::NEG_INFINITY, f64::max)), "{whole} {quarters:?}");
    assert!(same("mean", each("mean").iter().sum::<f64>() / 4.0), "{whole} {quarters:?}");
    assert!(each("mean")[0] != each("mean")[1], "{quarters:?}");
    for region in [json!([35, 0, 10, 10]), json!([0, 0, 0, 1]), json!([0, 0, 0.01, 0.01])] {
        let arguments = json!({ "path": "a.ron", "output": "bumps", "region": region });
        assert_eq!(client.refused("render", &arguments), "out-of-range", "{region}");
    }
    client.end();
}

#[test]
fn agents_see_no_paths_of_the_machine() {
    let desk = Desk::new();
    for folder in ["one/deep", "one/lib", "two"] {
        std::fs::create_dir_all(desk.path(folder)).unwrap();
    }
    let import = |path: &str| format!("(imports: {{ \"x\": \"{path}\" }}, nodes: {{ \"a\": Perlim() }})");
    desk.write("one/shibo.toml", "[imports]\npaths = [\"lib\"]\n");
    desk.write("one/lib/found.ron", GRAPH);
    desk.write("one/deep/good.ron", import("found"));
    desk.write("one/deep/bad.ron", import("none"));
    desk.write("two/b.ron", import("c.ron"));
    desk.write("two/c.ron", GRAPH);
    desk.write("one/broken.png", "no picture");
    let Some(mut client) = Client::start(&desk, "mcp --read one --read two --write two") else { return };
    let here = desk.path("").canonicalize().unwrap().to_string_lossy().trim_end_matches('/').to_owned();
    let given = desk.path("").to_string_lossy().trim_end_matches('/').to_owned();
    let mut ask = |tool: &str, arguments: Json| {
        let (content, _) = client.call(tool, &arguments);
        assert!(
            ![&here, &given].into_iter().any(|path| content.to_string().contains(path.as_str())),
            "{tool}: {content}"
        );
        content
    };
    let listed = ask("list_graphs", json!({})).to_string();
    for path in ["deep/good.ron", "lib/found.ron", "2:/b.ron", "2:/c.ron"] {
        assert!(listed.contains(&format!("\"{path}\"")), "{listed}");
    }
    // The settings of the folder count from any folder in it, and imports of the second folder are found beside their graph.
    for (path, errors) in [("deep/good.ron", 1), ("deep/bad.ron", 2), ("2:/b.ron", 1)] {
        let checked = ask("check", json!({ "path": path }));
        let found = checked["errors"].as_array().unwrap();
        assert_eq!(found.len(), errors, "{checked}");
        assert!(found.iter().all(|error| error["file"] == path), "{checked}");
    }
    let absolute = format!("{given}/one/deep/good.ron");
    assert_eq!(ask("check", json!({ "path": absolute }))["errors"][0]["file"], "deep/good.ron");
    for picture in ["none.png", "deep", "broken.png", "set.<UDIM>.png", "2:/none.png", "shibo.toml"] {
        let text = format!("(nodes: {{ \"a\": Image(path: \"{picture}\") }}, outputs: {{ \"a\": \"a\" }})");
        for tool in ["check", "fix", "render", "describe_graph"] {
            let said = ask(tool, json!({ "text": text })).to_string();
            assert!(tool == "describe_graph" || said.contains(picture), "{tool} {picture}: {said}");
        }
    }
    ask("write", json!({ "path": "none/a.ron", "text": "x" }));
    ask("compare", json!({ "a": { "file": "broken.png" }, "b": { "file": "none.png" } }));
    client.end();
}

#[test]
fn pages_show_commands_that_start_the_server() {
    let desk = Desk::new();
    for folder in ["materials", "drafts"] {
        std::fs::create_dir(desk.path(folder)).unwrap();
    }
    let mut shown: Vec<Vec<String>> = Vec::new();
    for page in ["docs/mcp.md", "docs/lasting.md"] {
        let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
        for start in ["\"args\": [", "args = ["] {
            let lists = page.split(start).skip(1).map(|rest| rest.split(']').next().unwrap());
            shown.extend(lists.map(|list| serde_json::from_str(&format!("[{list}]")).unwrap()));
        }
        let lines = page.lines().filter_map(|line| line.split_once(" -- shibo ")?.1.split('`').next());
        shown.extend(lines.map(|line| line.split_whitespace().map(str::to_owned).collect()));
    }
    assert_eq!(shown.len(), 8, "{shown:?}");
    for args in shown {
        assert_eq!(args[0], "mcp");
        // The folders of the pages, in the folder of this test.
        let here = |arg: &String| match arg.as_str() {
            "mcp" | "--read" | "--write" => arg.clone(),
            path => desk.path(Path::new(path).file_name().unwrap_or_default()).to_string_lossy().into_owned(),
        };
        let line = args.iter().map(here).collect::<Vec<_>>().join(" ");
        let Some(mut client) = Client::start(&desk, &line) else { return };
        if args.iter().any(|arg| arg == "--write") {
            client.good("write", &json!({ "path": "new.ron", "text": "(nodes: {})\n" }));
            std::fs::remove_file(desk.path("drafts/new.ron")).unwrap();
        }
        client.end();
    }
}
