//! Files of the user: Shibo removes only files that it made, and never overwrites a text saved at the same time.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::{Desk, finish};
use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// All files below a folder, with their contents.
fn all(dir: &Path) -> Vec<(std::path::PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap().flatten() {
        let path = entry.path();
        if entry.file_type().unwrap().is_dir() {
            found.extend(all(&path));
        } else {
            found.push((path.clone(), fs::read(path).unwrap_or_default()));
        }
    }
    found.sort();
    found
}

/// A folder like that of a version control system: its objects are named like cache entries.
fn repository(desk: &Desk, dir: &str) {
    let object = format!("{dir}/objects/ab/{}", "0123456789abcdef".repeat(2).split_at(30).0);
    for file in [object, format!("{dir}/tiles/cd/{}", "c".repeat(30)), format!("{dir}/HEAD")] {
        fs::create_dir_all(desk.path(&file).parent().unwrap()).unwrap();
        desk.write(&file, "of the user");
    }
}

#[test]
fn folders_that_are_no_cache_are_refused_and_left_alone() {
    let desk = Desk::with_graph();
    repository(&desk, ".git");
    let before = all(&desk.path(".git"));
    for line in ["cache clear --cache-dir .git", "cache stat --cache-dir .git"] {
        let ran = desk.shibo(line).expect(1);
        assert!(ran.stderr.contains("`.git`") && ran.stderr.contains("not marked as a cache"), "{}", ran.stderr);
    }
    // The pictures are rendered nevertheless.
    let ran = desk.shibo("render a.ron --cache-dir .git --cache-size 1").expect(0);
    assert!(ran.stderr.contains("not marked as a cache"), "{}", ran.stderr);
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
    assert_eq!(all(&desk.path(".git")), before);
}

#[test]
fn marks_caches_and_removes_only_entries() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron --cache-dir new/c -o one").expect(0);
    let tag = String::from_utf8(desk.read("new/c/CACHEDIR.TAG")).unwrap();
    assert!(tag.starts_with("Signature: 8a477f597d28d172789f06886806bc55\n") && tag.contains("shibo"), "{tag}");
    desk.write("new/c/mine", "mine");
    desk.write("new/c/files/mine", "mine");
    let cleared = desk.shibo("cache clear --cache-dir new/c").expect(0);
    assert!(!cleared.stderr.contains("removed 0 entries"), "{}", cleared.stderr);
    let left: Vec<_> = all(&desk.path("new/c")).into_iter().map(|(path, _)| path).collect();
    assert_eq!(left, ["CACHEDIR.TAG", "files/mine", "mine"].map(|name| desk.path("new/c").join(name)));
}

#[test]
fn adopts_default_cache_of_earlier_version() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron -o one").expect(0);
    let tag = desk.path("cache/shibo/CACHEDIR.TAG");
    fs::remove_file(&tag).unwrap();
    let ran = desk.shibo("render a.ron -o two --stats json").expect(0);
    assert!(!ran.stderr.contains("warning"), "{}", ran.stderr);
    assert!(tag.exists() && desk.shibo("cache stat").expect(0).json()["entries"].as_u64().unwrap() > 0);
    // With any other file in it, the owner of the folder is unknown.
    fs::remove_file(&tag).unwrap();
    desk.write("cache/shibo/notes", "mine");
    let ran = desk.shibo("render a.ron -o three").expect(0);
    assert!(ran.stderr.contains("not marked as a cache") && !tag.exists(), "{}", ran.stderr);
}

#[test]
fn join_removes_only_joined_parts() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(version: 1, canvas: (size_mm: 40, resolution: 600), nodes: { \"b\": Perlin(size: 5) }, outputs: { \"b\": \"b\" })",
    );
    let parts = |more: &str| {
        (1..=2).for_each(|part| drop(desk.shibo(&format!("render a.ron --part {part}/2 -o parts {more}")).expect(0)));
    };
    parts("--no-cache");
    // Another program's cache, a user's file, and an empty folder.
    repository(&desk, "parts/cache");
    fs::create_dir_all(desk.path("parts/cache/empty")).unwrap();
    desk.write("parts/notes", "mine");
    let mine: Vec<_> =
        all(&desk.path("parts")).into_iter().filter(|(path, _)| !path.to_string_lossy().ends_with(".part")).collect();
    assert_eq!(mine.len(), 4);
    desk.shibo("join parts -o joined --remove").expect(0);
    assert_eq!(all(&desk.path("parts")), mine);
    assert!(desk.path("parts/cache/empty").exists());
    // A cache made by a job is removed with the parts.
    fs::remove_dir_all(desk.path("parts")).unwrap();
    parts("--cache-dir parts/cache");
    assert!(desk.path("parts/cache/CACHEDIR.TAG").exists());
    desk.shibo("join parts -o joined --remove").expect(0);
    assert!(!desk.path("parts").exists());
}

#[test]
#[cfg(unix)]
fn clearing_a_shared_folder_follows_no_links_and_removes_only_entries() {
    let desk = Desk::with_graph();
    let url = format!("file://{}", desk.path("share").display());
    // Only results that took long to compute are shared.
    let graph = String::from_utf8(desk.read("a.ron")).unwrap();
    desk.write("a.ron", graph.replace("steps: 20,", "steps: 100000,").replace("pitch: 4", "pitch: 1"));
    desk.run(["render", "a.ron", "--shared-cache", &url]).expect(0);
    let shared = desk.path("share/shibo-cache-1");
    fs::write(shared.join("objects/notes"), "mine").unwrap();
    repository(&desk, "elsewhere");
    let free = (0..256).map(|n| shared.join(format!("objects/{n:02x}"))).find(|path| !path.exists()).unwrap();
    std::os::unix::fs::symlink(desk.path("elsewhere/objects/ab"), free).unwrap();
    let before = all(&desk.path("elsewhere"));
    let cleared = desk.run(["cache", "clear", "--shared-cache", &url]).expect(0);
    assert!(!cleared.stderr.contains("removed 0 entries"), "{}", cleared.stderr);
    assert_eq!(all(&desk.path("elsewhere")), before);
    assert_eq!(fs::read(shared.join("objects/notes")).unwrap(), b"mine");
    let stat = desk.run(["cache", "stat", "--shared-cache", &url]).expect(0).json();
    assert_eq!(stat["entries"], 0, "{stat}");
}

#[test]
fn temporary_files_of_other_machines_stay_for_a_day() {
    let desk = Desk::with_graph();
    fs::create_dir(desk.path("out")).unwrap();
    // Named as in another container: another host, and a process that does not exist here.
    let [young, old] = ["a", "b"].map(|name| format!("out/.{name}.png.shibo-00c0ffee-00c0ffee-4294967295-7-0.tmp"));
    [&young, &old].into_iter().for_each(|name| desk.write(name, "half"));
    let day = SystemTime::now() - Duration::from_secs(25 * 3600);
    fs::File::options().write(true).open(desk.path(&old)).unwrap().set_modified(day).unwrap();
    desk.shibo("render a.ron").expect(0);
    assert!(desk.path(&young).exists() && !desk.path(&old).exists());
    fs::remove_file(desk.path(&young)).unwrap();
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
}

#[test]
#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn fmt_keeps_concurrent_saves() {
    let desk = Desk::new();
    let path = desk.path("a.ron");
    let untidy = |number: u32| {
        let nodes: String = (0..400).map(|node| format!("\"n{node}\":Perlin(size:{number}),")).collect();
        format!("(version:1,canvas:(size_mm:8,resolution:8),nodes:{{{nodes}}},outputs:{{\"o\":\"n0\"}})")
    };
    let mut refused = 0;
    for round in 0..40 {
        fs::write(&path, untidy(1)).unwrap();
        let saved = untidy(round + 2);
        let saver = std::thread::spawn({
            let (path, saved) = (path.clone(), saved.clone());
            move || {
                std::thread::sleep(Duration::from_micros(u64::from(round) * 700));
                if round % 2 == 0 {
                    fs::write(path, saved).unwrap();
                } else {
                    fs::write(path.with_extension("new"), saved).unwrap();
                    fs::rename(path.with_extension("new"), path).unwrap();
                }
            }
        });
        let ran = finish(desk.command(["fmt", "a.ron"]));
        saver.join().unwrap();
        // Either the save came later and stays, or `fmt` laid out the saved text.
        let now = fs::read_to_string(&path).unwrap();
        assert!(now.contains(&format!("{})", round + 2)), "round {round}: {} {}", ran.stderr, &now[..200]);
        refused += u32::from(ran.stderr.contains("saved meanwhile"));
        // `fs::write` empties the file first, so `fmt` may read an empty file.
        let told = ran.stderr.contains("saved meanwhile") || ran.stderr.contains("error[syntax]");
        assert_eq!(ran.code == Some(1), told, "{}", ran.stderr);
    }
    assert_eq!(desk.names("."), ["a.ron"], "{refused} were refused");
}
