//! Every save is recognised, by any program and in any way.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching;

use crate::watching::{Place, Watch, plain, sha256};
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Four tests that mostly wait, so they run at the same time; failing ones are named by their threads.
#[test]
fn recognises_saves_at_no_idle_cost() {
    let waiting: [(&str, fn()); 4] = [
        ("every way to save is seen", every_way_to_save_is_seen),
        ("random saves are never lost", random_saves_are_never_lost_and_leave_nothing_behind),
        ("folders come and go", folders_come_and_go),
        ("watching costs nothing", watching_costs_nothing),
    ];
    std::thread::scope(|scope| {
        let started = waiting.map(|(name, test)| {
            (name, std::thread::Builder::new().name(name.to_owned()).spawn_scoped(scope, test).unwrap())
        });
        let failed: Vec<&str> =
            started.into_iter().filter_map(|(name, test)| test.join().err().map(|_| name)).collect();
        assert!(failed.is_empty(), "{failed:?}; see above");
    });
}

/// A way to save a file: its name, and a function that saves a text.
type Style = (&'static str, fn(&Path, &str));

fn beside(path: &Path, name: &str) -> std::path::PathBuf {
    path.with_file_name(name)
}

fn pause(ms: u64) {
    std::thread::sleep(Duration::from_millis(ms));
}

fn shell(script: &str, path: &Path, text: &str) {
    let source = beside(path, "source.txt");
    fs::write(&source, text).unwrap();
    let status = Command::new("sh").args(["-c", script, "sh"]).arg(path).arg(&source).status().unwrap();
    assert!(status.success(), "{script}");
}

const STYLES: &[Style] = &[
    ("truncate and write", |path, text| fs::write(path, text).unwrap()),
    ("rename over", |path, text| {
        fs::write(beside(path, ".graph.tmp"), text).unwrap();
        fs::rename(beside(path, ".graph.tmp"), path).unwrap();
    }),
    ("rename over, flushed", |path, text| {
        let mut file = File::create(beside(path, "graph.ron.new")).unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file.sync_all().unwrap();
        fs::rename(beside(path, "graph.ron.new"), path).unwrap();
    }),
    ("backup and write", |path, text| {
        fs::rename(path, beside(path, "graph.ron~")).unwrap();
        fs::write(path, text).unwrap();
    }),
    ("backup, write and remove the backup", |path, text| {
        fs::write(beside(path, "4913"), "").unwrap();
        fs::remove_file(beside(path, "4913")).unwrap();
        fs::rename(path, beside(path, "graph.ron~")).unwrap();
        fs::write(path, text).unwrap();
        fs::remove_file(beside(path, "graph.ron~")).unwrap();
    }),
    ("backup by copy", |path, text| {
        fs::copy(path, beside(path, "graph.ron.bak")).unwrap();
        fs::write(path, text).unwrap();
    }),
    ("lock file and backup", |path, text| {
        let lock = beside(path, ".#graph.ron");
        let _ = fs::remove_file(&lock);
        symlink("me@here.1", &lock).unwrap();
        fs::rename(path, beside(path, "graph.ron~")).unwrap();
        fs::write(path, text).unwrap();
        fs::remove_file(&lock).unwrap();
    }),
    ("in chunks with pauses", |path, text| {
        let mut file = File::create(path).unwrap();
        for chunk in text.as_bytes().chunks(text.len() / 5 + 1) {
            file.write_all(chunk).unwrap();
            file.flush().unwrap();
            pause(12);
        }
    }),
    ("very slowly", |path, text| {
        let mut file = File::create(path).unwrap();
        for chunk in text.as_bytes().chunks(text.len() / 3 + 1) {
            file.write_all(chunk).unwrap();
            pause(240);
        }
    }),
    ("emptied, and filled later", |path, text| {
        File::create(path).unwrap();
        pause(120);
        fs::write(path, text).unwrap();
    }),
    ("removed, and made later", |path, text| {
        fs::remove_file(path).unwrap();
        pause(150);
        fs::write(path, text).unwrap();
    }),
    ("written over and cut", |path, text| {
        let mut file = OpenOptions::new().write(true).open(path).unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file.set_len(text.len() as u64).unwrap();
    }),
    ("from the end to the start", |path, text| {
        let mut file = OpenOptions::new().write(true).truncate(true).create(true).open(path).unwrap();
        let half = text.len() / 2;
        file.seek(SeekFrom::Start(half as u64)).unwrap();
        file.write_all(&text.as_bytes()[half..]).unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file.write_all(&text.as_bytes()[..half]).unwrap();
    }),
    ("twice", |path, text| {
        fs::write(path, plain(0.123)).unwrap();
        fs::write(path, text).unwrap();
    }),
    ("a burst", |path, text| {
        for i in 0..10 {
            fs::write(path, plain(f64::from(i) / 100.0)).unwrap();
        }
        fs::write(path, text).unwrap();
    }),
    ("a link swapped", |path, text| {
        let target = beside(path, &format!("target-{}.ron", &sha256(text.as_bytes())[..12]));
        fs::write(&target, text).unwrap();
        let link = beside(path, "link.tmp");
        let _ = fs::remove_file(&link);
        symlink(target.file_name().unwrap(), &link).unwrap();
        fs::rename(&link, path).unwrap();
    }),
    ("through a link into another folder", |path, text| {
        let folder = beside(path, "elsewhere");
        fs::create_dir_all(&folder).unwrap();
        let real = folder.join("real.ron");
        if fs::read_link(path).ok().as_deref() != Some(Path::new("elsewhere/real.ron")) {
            fs::write(&real, plain(0.321)).unwrap();
            let _ = fs::remove_file(path);
            symlink("elsewhere/real.ron", path).unwrap();
            pause(60);
        }
        fs::write(&real, text).unwrap();
    }),
    ("a hard link", |path, text| {
        let other = beside(path, "hard.ron");
        let _ = fs::remove_file(&other);
        fs::write(&other, text).unwrap();
        fs::remove_file(path).unwrap();
        fs::hard_link(&other, path).unwrap();
    }),
    ("with an old date", |path, text| {
        fs::write(path, text).unwrap();
        let file = OpenOptions::new().write(true).open(path).unwrap();
        file.set_modified(std::time::SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_000)).unwrap();
    }),
    ("cp", |path, text| shell("cp \"$2\" \"$1\"", path, text)),
    ("mv", |path, text| shell("mv \"$2\" \"$1\"", path, text)),
    ("cat", |path, text| shell("cat \"$2\" > \"$1\"", path, text)),
    ("sed -i", |path, text| {
        shell("cat \"$2\" > \"$1.x\"; sed -i 's/nothing/else/' \"$1.x\"; mv \"$1.x\" \"$1\"", path, text)
    }),
];

/// Times in milliseconds from the end of a save to its event.
#[derive(Default)]
struct Figures(Vec<f64>);

impl Figures {
    fn tell(&mut self, what: &str) {
        self.0.sort_by(f64::total_cmp);
        let at = |share: f64| {
            #[expect(clippy::cast_possible_truncation, reason = "a share of a small number")]
            #[expect(clippy::cast_sign_loss, reason = "a share is not negative")]
            let index = ((self.0.len() - 1) as f64 * share) as usize;
            self.0[index]
        };
        println!(
            "{what}: median {:.1} ms, 95 % {:.1} ms, worst {:.1} ms of {}",
            at(0.5),
            at(0.95),
            at(1.0),
            self.0.len()
        );
    }
}

fn every_style(args: &[&str]) {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, args);
    watch.wait_shown(plain(0.5).as_bytes());
    let (mut saved, mut shown) = (Figures::default(), Figures::default());
    for round in 0..2 {
        for (i, (name, save)) in STYLES.iter().enumerate() {
            let text = plain(0.6 + 0.01 * i as f64 + 0.001 * f64::from(round));
            let sha = sha256(text.as_bytes());
            save(&place.graph, &text);
            let end = Instant::now();
            let told = watch.wait_for(|e| {
                assert_ne!(e["event"], "error", "{name}: {e}");
                e["event"] == "saved" && e["sha256"] == *sha
            });
            saved.0.push(told.at.saturating_duration_since(end).as_secs_f64() * 1000.0);
            let told = watch.wait_for(|e| {
                assert_ne!(e["event"], "error", "{name}: {e}");
                e["event"] == "shown" && e["sha256"] == *sha && e["final"] == true
            });
            shown.0.push(told.at.saturating_duration_since(end).as_secs_f64() * 1000.0);
        }
    }
    saved.tell(&format!("save to recognised {args:?}"));
    shown.tell(&format!("save to a 64² picture {args:?}"));
}

fn every_way_to_save_is_seen() {
    // With events of the system, and by polling.
    std::thread::scope(|scope| {
        [&[][..], &["--poll"]].map(|args| scope.spawn(|| every_style(args))).map(|style| style.join().unwrap())
    });
}

fn random_saves_are_never_lost_and_leave_nothing_behind() {
    let saves: u64 = std::env::var("SHIBO_SAVES").ok().and_then(|n| n.parse().ok()).unwrap_or(200);
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &["--memory", "16"]);
    watch.wait_shown(plain(0.5).as_bytes());
    let mut seed = 7_u64;
    let mut random = move |n: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % n
    };
    let mut figures = Figures::default();
    let mut settled = None;
    for i in 0..saves {
        let slow = ["very slowly", "emptied, and filled later", "removed, and made later"];
        let quick: Vec<&Style> = STYLES.iter().filter(|(name, _)| !slow.contains(name)).collect();
        let (name, save) = quick[usize::try_from(random(quick.len() as u64)).unwrap()];
        let text = plain(0.4 + i as f64 * 1e-6);
        save(&place.graph, &text);
        let end = Instant::now();
        // Most saves are followed by another one before they are shown.
        if random(4) == 0 {
            let sha = sha256(text.as_bytes());
            let told = watch.wait_for(|e| {
                assert_ne!(e["event"], "error", "{name}: {e}");
                e["event"] == "saved" && e["sha256"] == *sha
            });
            figures.0.push(told.at.saturating_duration_since(end).as_secs_f64() * 1000.0);
            watch.wait_shown(text.as_bytes());
        } else {
            pause(random(30));
        }
        if i == saves / 3 {
            settled = Some((watch.status("VmRSS"), watch.status("Threads"), watch.handles()));
        }
    }
    let last = plain(0.39);
    place.write(&last);
    watch.wait_shown(last.as_bytes());
    assert_eq!(watch.state()["scene"]["sha256"], sha256(last.as_bytes()));
    figures.tell("save to recognised, at random");
    let (memory, threads, handles) = settled.unwrap();
    let now = (watch.status("VmRSS"), watch.status("Threads"), watch.handles());
    println!(
        "after {saves} saves: {memory} → {} KiB, {threads} → {} threads, {handles} → {} handles",
        now.0, now.1, now.2
    );
    assert!(now.0 < memory + (48 << 10), "memory grows: {memory} → {}", now.0);
    assert!(now.1 <= threads + 4 && now.2 <= handles + 6, "{threads} → {}, {handles} → {}", now.1, now.2);
}

#[test]
fn ignores_half_written_files() {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.5).as_bytes());
    let text = plain(0.9);
    let half = text.len() / 2;
    // Repeats the test if the machine stalls, because a file that stays incomplete for too long is reported.
    for _ in 0..5 {
        let mut file = File::create(&place.graph).unwrap();
        let start = Instant::now();
        file.write_all(&text.as_bytes()[..half]).unwrap();
        let events = watch.during(Duration::from_millis(400));
        file.write_all(&text.as_bytes()[half..]).unwrap();
        drop(file);
        let quick = start.elapsed() < Duration::from_millis(800);
        watch.wait_shown(text.as_bytes());
        if quick {
            assert!(events.is_empty(), "{events:?}");
            break;
        }
        place.write(&plain(0.5));
        watch.wait_shown(plain(0.5).as_bytes());
    }
    // A file that stays incomplete is reported in the end.
    place.write(&text[..half]);
    watch.wait_error(&text.as_bytes()[..half]);
    assert_eq!(watch.state()["errors"].as_array().unwrap().len(), 1);
    place.write(&plain(0.8));
    watch.wait_shown(plain(0.8).as_bytes());
    assert_eq!(watch.state()["errors"], serde_json::json!([]));
}

#[test]
fn follows_imported_files() {
    let place = Place::shipped("calf.ron");
    let watch = Watch::start(&place.graph, &["--set", "pitch=2"]);
    let text = place.text();
    watch.wait_shown(text.as_bytes());
    let import = place.graph.with_file_name("lib/wrinkles.ron");
    let old = fs::read_to_string(&import).unwrap();
    let broken = old.replacen("nodes:", "nodez:", 1);
    assert_ne!(old, broken);
    fs::write(&import, broken).unwrap();
    let error = watch.wait_error(text.as_bytes());
    assert!(error.json["errors"][0]["file"].as_str().unwrap().ends_with("wrinkles.ron"), "{}", error.json);
    fs::remove_file(&import).unwrap();
    let error = watch.wait_error(text.as_bytes());
    assert_eq!(error.json["errors"][0]["code"], "file-not-found");
    // A missing file is watched for. Pictures of the first version may follow until it is found.
    fs::write(&import, old).unwrap();
    watch.wait_for(|e| e["event"] == "saved" && e["sha256"] == sha256(text.as_bytes()));
    watch.wait_shown(text.as_bytes());
    // Files outside the graph cause no event.
    fs::create_dir(place.graph.with_file_name("out")).unwrap();
    fs::write(place.graph.with_file_name("out/height.png"), "x").unwrap();
    fs::write(place.graph.with_file_name("notes.txt"), "x").unwrap();
    fs::write(&place.graph, &text).unwrap();
    let events = watch.during(Duration::from_millis(900));
    assert!(events.iter().all(|e| e["event"] == "shown"), "{events:#?}");
}

fn folders_come_and_go() {
    let place = Place::new(&plain(0.5));
    let folder = place.dir.path().join("deep/er");
    fs::create_dir_all(&folder).unwrap();
    let graph = folder.join("graph.ron");
    fs::write(&graph, plain(0.2)).unwrap();
    let watch = Watch::start(&graph, &[]);
    watch.wait_shown(plain(0.2).as_bytes());
    let (_, picture) = {
        let state = watch.state();
        watch.get(state["scene"]["pictures"]["grey"]["picture"].as_str().unwrap())
    };
    for i in 0..3 {
        fs::remove_dir_all(place.dir.path().join("deep")).unwrap();
        let error = watch.wait_for(|e| e["event"] == "error");
        assert_eq!(error.json["errors"][0]["code"], "file-not-found");
        assert!(error.json["sha256"].is_null());
        // The last good picture is still served.
        let state = watch.state();
        let (status, again) = watch.get(state["scene"]["pictures"]["grey"]["picture"].as_str().unwrap());
        assert_eq!(status, 200);
        assert!(i > 0 || again == picture);
        fs::create_dir_all(&folder).unwrap();
        let text = plain(0.3 + 0.1 * f64::from(i));
        fs::write(&graph, &text).unwrap();
        watch.wait_shown(text.as_bytes());
    }
    // A folder takes the place of the file.
    fs::remove_file(&graph).unwrap();
    fs::create_dir(&graph).unwrap();
    let error = watch.wait_for(|e| e["event"] == "error");
    assert_eq!(error.json["errors"][0]["code"], "bad-file");
    fs::remove_dir(&graph).unwrap();
    fs::write(&graph, plain(0.9)).unwrap();
    watch.wait_shown(plain(0.9).as_bytes());
    // The whole folder is replaced.
    let other = place.dir.path().join("other");
    fs::create_dir_all(other.join("er")).unwrap();
    fs::write(other.join("er/graph.ron"), plain(0.95)).unwrap();
    fs::rename(place.dir.path().join("deep"), place.dir.path().join("old")).unwrap();
    fs::rename(&other, place.dir.path().join("deep")).unwrap();
    watch.wait_shown(plain(0.95).as_bytes());
}

/// A graph with a long simulation.
fn heavy(steps: u32) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 60, resolution: 256), nodes: {{ \"f\": Perlin(size: 9), \
         \"p\": GridPoints(pitch: 0.12), \"l\": ConnectNeighbors(points: \"p\", neighbors: Eight), \
         \"s\": DefineSprings(lattice: \"l\", field: \"f\", stiffness: (1, 10)), \
         \"m\": SimulateSprings(springs: \"s\", step: 0.1, steps: {steps}, drag: 4), \
         \"w\": PlaceWrinkles(lattice: \"m\"), \"d\": DrawWrinkles(segments: \"w\", width: (0.2, 0.4)) }}, outputs: {{ \"mask\": \"d.mask\" }})"
    )
}

#[test]
fn newest_save_stops_older_work() {
    let place = Place::new(&plain(0.5));
    let watch = Watch::start(&place.graph, &[]);
    watch.wait_shown(plain(0.5).as_bytes());
    let mut figures = Figures::default();
    for i in 0..8_u32 {
        let slow = heavy(4000 + i);
        place.write(&slow);
        let sha = sha256(slow.as_bytes());
        watch.wait_for(|e| e["event"] == "saved" && e["sha256"] == *sha);
        pause(150);
        let quick = plain(0.6 + 0.01 * f64::from(i));
        place.write(&quick);
        let end = Instant::now();
        let shown = watch.wait_for(|e| {
            assert!(e["event"] != "shown" || e["sha256"] != *sha, "the old one should have been stopped");
            e["event"] == "shown" && e["sha256"] == sha256(quick.as_bytes())
        });
        figures.0.push(shown.at.saturating_duration_since(end).as_secs_f64() * 1000.0);
    }
    figures.tell("save during a simulation to the next 64² picture");
    // While the newest file is broken, the last good one is rendered.
    let slow = heavy(40);
    place.write(&slow);
    watch.wait_for(|e| e["event"] == "saved" && e["sha256"] == sha256(slow.as_bytes()));
    place.write("(version: 1, nodes: { \"a\": Nonsense() })");
    watch.wait_for(|e| e["event"] == "error");
    let end = Instant::now();
    while watch.state()["scene"]["sha256"] != sha256(slow.as_bytes()) {
        assert!(end.elapsed() < watching::PATIENCE);
        pause(20);
    }
    assert_eq!(watch.state()["errors"][0]["code"], "unknown-kind");
}

fn watching_costs_nothing() {
    let place = Place::new(&plain(0.5));
    let all = [&[][..], &["--poll"]].map(|args| {
        let watch = Watch::start(&place.graph, args);
        watch.wait_shown(plain(0.5).as_bytes());
        (args, watch)
    });
    let ticks = |watch: &Watch| {
        let text = fs::read_to_string(format!("/proc/{}/stat", watch.pid)).unwrap();
        let fields = text.rsplit(')').next().unwrap().split_whitespace().skip(11).take(2);
        fields.map(|n| n.parse::<u64>().unwrap()).sum::<u64>()
    };
    pause(300);
    let before = all.each_ref().map(|(_, watch)| ticks(watch));
    pause(4000);
    for ((args, watch), before) in all.iter().zip(before) {
        let used = ticks(watch) - before;
        println!("idle {args:?}: {:.2} % of a core", used as f64 / 4.0);
        assert!(used <= 8, "{args:?}: {used} hundredths of a second in 4 s");
    }
}
