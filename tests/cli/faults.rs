//! Failures while files are written: full disks, folders without permission, interruptions.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, WIDE, finish};
use std::time::{Duration, Instant};

#[test]
fn previous_outputs_survive_errors() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron").expect(0);
    let before = desk.read("out/bumps.png");
    let broken = String::from_utf8(desk.read("a.ron")).unwrap().replace("Perlin(", "Perlim(");
    desk.write("a.ron", broken);
    desk.shibo("render a.ron").expect(1);
    assert_eq!(desk.read("out/bumps.png"), before);
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
}

#[test]
fn folders_that_cannot_be_written() {
    let desk = Desk::with_graph();
    desk.write("file", "");
    let ran = desk.shibo("render a.ron -o file/deep").expect(1);
    assert!(ran.stderr.contains("file/deep"), "{}", ran.stderr);
    let ran = desk.shibo("render a.ron -o file").expect(1);
    assert!(ran.stderr.contains("`file`"), "{}", ran.stderr);
    std::fs::create_dir_all(desk.path("out/bumps.png")).unwrap();
    let ran = desk.shibo("render a.ron").expect(1);
    assert!(ran.stderr.contains("out/bumps.png"), "{}", ran.stderr);
    assert!(desk.names("out").iter().all(|name| !name.ends_with(".tmp")), "{:?}", desk.names("out"));
}

#[test]
fn a_cache_that_cannot_be_written_is_a_warning() {
    let desk = Desk::with_graph();
    desk.write("file", "");
    let ran = desk.shibo("render a.ron --cache-dir file/cache").expect(0);
    assert!(ran.stderr.contains("warning") && ran.stderr.contains("file/cache"), "{}", ran.stderr);
    assert_eq!(desk.names("out").len(), 2);
    let mut homeless = desk.command(["render", "a.ron"]);
    homeless.env_remove("XDG_CACHE_HOME").env_remove("HOME");
    let ran = finish(homeless).expect(0);
    assert!(ran.stderr.contains("warning") && ran.stderr.contains("--cache-dir"), "{}", ran.stderr);
}

#[test]
fn damaged_cache_entries_are_made_again() {
    fn damage(dir: &std::path::Path) {
        for entry in std::fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                damage(&path);
            } else {
                let mut bytes = std::fs::read(&path).unwrap();
                let middle = bytes.len() / 2;
                bytes[middle] ^= 0x55;
                std::fs::write(&path, bytes).unwrap();
            }
        }
    }
    let desk = Desk::with_graph();
    desk.shibo("render a.ron -o one").expect(0);
    damage(&desk.path("cache"));
    desk.shibo("render a.ron -o two").expect(0);
    for name in ["bumps.png", "mask.png"] {
        assert_eq!(desk.read(&format!("one/{name}")), desk.read(&format!("two/{name}")));
    }
    assert_eq!(desk.names("two"), ["bumps.png", "mask.png"]);
}

/// A limit of a few kB for each file fails as a full disk does.
#[test]
#[cfg(unix)]
fn a_full_disk_leaves_the_old_files() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron --resolution 16 --no-cache").expect(0);
    let before = desk.read("out/bumps.png");
    let shibo = assert_cmd::cargo::cargo_bin!("shibo");
    let mut limited = std::process::Command::new("sh");
    limited
        .current_dir(desk.path("."))
        .arg("-c")
        .arg(format!("trap '' XFSZ; ulimit -f 8; exec '{}' render a.ron --resolution 512 --no-cache", shibo.display()));
    let ran = finish(limited);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(ran.stderr.contains("out/"), "{}", ran.stderr);
    assert_eq!(desk.read("out/bumps.png"), before);
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
}

/// The same for a picture in strips: the waiting strips exceed the limit before the picture does, and are removed.
#[test]
#[cfg(unix)]
fn a_full_disk_ends_strips_that_wait() {
    let desk = Desk::new();
    desk.write("a.ron", WIDE);
    desk.shibo("render a.ron --resolution 16 --no-cache").expect(0);
    let before = desk.read("out/mask.png");
    let shibo = assert_cmd::cargo::cargo_bin!("shibo");
    // Blocks of 512 bytes: the first strip fits, which is at most half the picture's width, but not all strips.
    let room = 2304 * 1700 * 4 / 512;
    let mut limited = std::process::Command::new("sh");
    limited.current_dir(desk.path(".")).arg("-c").arg(format!(
        "trap '' XFSZ; ulimit -f {room}; exec '{}' render a.ron --resolution 2304 --memory 16 --no-cache",
        shibo.display()
    ));
    let ran = finish(limited);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
    let text = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("cannot keep the strips of `out/") && text.contains("File too large"), "{}", ran.stderr);
    assert_eq!(desk.read("out/mask.png"), before);
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
}

/// Starts a long render, and waits until it writes.
#[cfg(unix)]
fn long_render(desk: &Desk) -> std::process::Child {
    let args = ["render", "a.ron", "--output", "bumps", "--resolution", "30000", "--no-cache", "--compress", "best"];
    let mut command = desk.command(args);
    let child = command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    while !desk.names("out").iter().any(|name| name.ends_with(".tmp")) {
        assert!(start.elapsed() < Duration::from_secs(60), "nothing is written");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
#[cfg(unix)]
fn an_interrupted_run_leaves_nothing_behind() {
    for signal in ["-INT", "-TERM"] {
        let desk = Desk::with_graph();
        desk.shibo("render a.ron").expect(0);
        let before = desk.read("out/bumps.png");
        let mut child = long_render(&desk);
        assert!(std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let code = child.wait().unwrap().code();
        // The exit code tells that the run was interrupted.
        let mut stderr = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut stderr).unwrap();
        assert_eq!(code, Some(1), "{signal}: {stderr}");
        assert!(stderr.contains("interrupted"), "{stderr}");
        assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
        assert_eq!(desk.read("out/bumps.png"), before);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn removes_temporary_files_of_killed_run() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron").expect(0);
    let before = desk.read("out/bumps.png");
    let mut child = long_render(&desk);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(desk.read("out/bumps.png"), before);
    // Young temporary files stay, because another machine may be working in the folder.
    desk.shibo("render a.ron").expect(0);
    let left: Vec<String> = desk.names("out").into_iter().filter(|name| name.ends_with(".tmp")).collect();
    assert!(!left.is_empty());
    for name in &left {
        let file = std::fs::File::options().write(true).open(desk.path("out").join(name)).unwrap();
        file.set_modified(std::time::SystemTime::now() - std::time::Duration::from_secs(25 * 3600)).unwrap();
    }
    desk.shibo("render a.ron").expect(0);
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_device_behind_stdout_is_an_error() {
    let desk = Desk::with_graph();
    for args in [vec!["nodes", "--format", "json"], vec!["dump", "a.ron", "bumps"], vec!["--help"]] {
        let mut command = desk.command(&args);
        command.stdout(std::fs::File::options().write(true).open("/dev/full").unwrap());
        let ran = finish(command);
        assert_eq!(ran.code, Some(1), "{args:?}");
        assert!(ran.stderr.contains("cannot write to stdout"), "{args:?}: {}", ran.stderr);
    }
}

#[test]
fn stays_silent_when_stdout_closes() {
    let desk = Desk::with_graph();
    for args in [vec!["nodes", "--format", "markdown"], vec!["dump", "a.ron", "bumps", "--resolution", "512"]] {
        let mut command = desk.command(&args);
        let mut child =
            command.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{args:?}");
        assert!(matches!(output.status.code(), Some(0 | 1)), "{args:?}");
    }
}
