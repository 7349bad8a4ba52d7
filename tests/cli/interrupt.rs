//! Ctrl-C of long commands: they end at once without partial files, and a second run completes the work.
#![cfg(unix)]
use crate::support::{Desk, Ran};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Starts a command and interrupts it after a while; returns its result and how long it took to end.
fn interrupted(desk: &Desk, line: &str, after: Duration) -> (Ran, Duration) {
    let mut child =
        desk.command(line.split_whitespace()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let end = Instant::now() + after;
    while Instant::now() < end && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let start = Instant::now();
    // The command may have ended by itself.
    let _ = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    let output = child.wait_with_output().unwrap();
    let ran = Ran {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    };
    (ran, start.elapsed())
}

/// The folder has no hidden or temporary files.
fn clean(desk: &Desk, folder: &str) {
    if desk.path(folder).exists() {
        let names = desk.names(folder);
        assert!(names.iter().all(|name| !name.starts_with('.') && !name.ends_with(".tmp")), "{names:?}");
    }
}

const GRAPH: &str = r#"(
  version: 1,
  canvas: (size_mm: 40, resolution: 3000, tile: Both, seed: 1),
  nodes: {
    "ground": Fractal(size: 5, octaves: 8), "exemplar": Exemplar(input: "ground", size: (96, 96)),
    "coords": Synthesize(exemplar: "exemplar", size: (700, 700)), "shown": SampleExemplar(coords: "coords", input: "ground"),
    "fine": Fractal(size: 2, octaves: 8), "both": "= shown + fine",
    "grey": Remap(input: "both", from: (0, 2), to: (0, 1), clamp: true),
  },
  outputs: { "grey": File(from: "grey", format: Tiff) },
)"#;

#[test]
fn long_commands_resume_after_interrupt() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    desk.shibo("render a.ron -o whole --cache-dir other").expect(0);
    let steps = [
        "prepare a.ron --cache-dir c",
        "render a.ron --part 1/2 -o parts --cache-dir c",
        "render a.ron --part 2/2 -o parts --cache-dir c",
        "join parts -o joined",
        "render a.ron --sweep seed=1..3 --resolution 700 -o many --cache-dir c",
    ];
    let mut stopped = 0;
    for line in steps {
        for wait in [1, 40, 250] {
            let (ran, took) = interrupted(&desk, line, Duration::from_millis(wait));
            // Before the handler is set, the signal kills the process; nothing has begun then.
            assert!(matches!(ran.code, None | Some(0 | 1)), "{line}: {:?} {}", ran.code, ran.stderr);
            assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
            assert!(took < Duration::from_secs(20), "{line} went on for {took:?}");
            stopped += usize::from(ran.code == Some(1) && ran.stderr.contains("interrupted"));
            for folder in ["parts", "joined", "many"] {
                clean(&desk, folder);
            }
        }
        desk.shibo(line).expect(0);
    }
    assert_eq!(desk.names("parts").len(), 2, "{:?}", desk.names("parts"));
    assert!(stopped >= 4, "only {stopped} of 15 were stopped in the middle");
    assert!(desk.read("joined/grey.tiff") == desk.read("whole/grey.tiff"));
    assert_eq!(desk.names("many").len(), 4);
}
