//! Pinned graphs, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;

const GRAPH: &str = "// A.\n(\n  version: 1,\n  canvas: (size_mm: 20, resolution: 16),\n  nodes: {\n    \"a\": Perlin(size: 5),\n  },\n  outputs: { \"a\": \"a\" },\n)\n";

fn text(desk: &Desk) -> String {
    String::from_utf8(desk.read("a.ron")).unwrap()
}

#[test]
fn pins_a_graph_and_removes_the_pin() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    let ran = desk.shibo("pin --to 1 a.ron").expect(0);
    assert!(ran.stderr.contains("a.ron: pinned at change 1, 1 picture in shibo.lock"), "{}", ran.stderr);
    let pinned = text(&desk);
    assert_eq!(pinned, GRAPH.replace("version: 1,", "version: 1,\n  pins: 1,"));
    desk.shibo("pin --to 1 a.ron").expect(0);
    assert_eq!(text(&desk), pinned);
    desk.shibo("fmt --check a.ron").expect(0);
    desk.shibo("check a.ron").expect(0);
    desk.shibo("pin --remove a.ron").expect(0);
    assert_eq!(text(&desk), GRAPH);
}

#[test]
fn a_graph_with_an_error_is_not_pinned() {
    let desk = Desk::new();
    let wrong = GRAPH.replace("Perlin", "Perlim");
    desk.write("a.ron", &wrong);
    assert!(desk.shibo("pin a.ron").expect(1).stderr.contains("did you mean `Perlin`?"));
    assert_eq!(text(&desk), wrong);
    assert!(desk.shibo("pin --to 9999 a.ron").expect(2).stderr.contains("change 9999 is unknown"));
}

#[test]
fn a_pin_of_a_newer_program_is_an_error_but_can_be_ignored() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("version: 1,", "version: 1, pins: 9999,"));
    let ran = desk.shibo("check a.ron").expect(1);
    assert!(
        ran.stderr.contains("made with a newer Shibo: change 9999") && ran.stderr.contains("a.ron:3:21"),
        "{}",
        ran.stderr
    );
    desk.shibo("render a.ron --newest --no-cache -o out").expect(0);
    desk.shibo("pin a.ron").expect(0);
    desk.shibo("check a.ron").expect(0);
}

fn lock(desk: &Desk) -> String {
    String::from_utf8(desk.read("shibo.lock")).unwrap()
}

#[test]
fn pin_keeps_pictures_and_verify_compares_them() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        GRAPH
            .replace("\"a\": \"a\" }", "\"a\": \"a\", \"m\": \"m\" }")
            .replace("5),", "5),\n    \"m\": Material(height: \"a\", roughness: 0.4),"),
    );
    desk.write("b.ron", GRAPH);
    assert!(desk.shibo("pin a.ron").expect(0).stderr.contains("3 pictures in shibo.lock"));
    let (pinned, kept) = (text(&desk), lock(&desk));
    assert!(kept.contains("\"m.roughness\": (bits: \""), "{kept}");
    desk.shibo("pin a.ron").expect(0);
    assert_eq!((text(&desk), lock(&desk)), (pinned.clone(), kept.clone()), "a second pin changes nothing");
    assert!(desk.shibo("verify a.ron").expect(0).stdout.contains("a.ron  same  3 pictures"));
    let ran = desk.shibo("verify a.ron b.ron").expect(1);
    assert!(ran.stdout.contains("b.ron  not pinned\n  a: it has no picture in the lock"), "{}", ran.stdout);
    // Comments, layout and order do not matter.
    desk.write("a.ron", format!("// More.\n{}", pinned.replace("    \"m\"", "\n\"m\"")));
    desk.shibo("verify a.ron").expect(0);
    desk.write("a.ron", pinned.replace("size: 5", "size: 4"));
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(ran.stdout.contains("a.ron  edited\n  a, m.height: "), "{}", ran.stdout);
    assert!(ran.stdout.contains("  the text was edited since the graph was pinned\n"), "{}", ran.stdout);
    // Other bits of the same recipe are a defect.
    desk.write("a.ron", pinned);
    let at = kept.find("bits: \"").unwrap() + 7;
    desk.write("shibo.lock", format!("{}{}{}", &kept[..at], "0".repeat(16), &kept[at + 16..]));
    let ran = desk.shibo("verify a.ron --format json").expect(1);
    let found: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(found["graphs"][0]["state"], "defect");
    assert_eq!(found["graphs"][0]["pictures"][0]["state"], "defect");
    assert_eq!(found["graphs"][0]["pictures"][1]["state"], "same");
    let newer = format!("{}{}{}", &kept[..at], "0".repeat(16), &kept[at + 16..]);
    desk.write("shibo.lock", newer.replace("pins: ", "pins: 9"));
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(
        ran.stdout.contains("a.ron  newer\n") && ran.stdout.contains("a newer Shibo made the entry"),
        "{}",
        ran.stdout
    );
    desk.write("shibo.lock", "{ \"a.ron\": 3 }");
    // A lock that cannot be read stops only its own folder.
    std::fs::create_dir_all(desk.path("good")).unwrap();
    desk.write("good/c.ron", GRAPH);
    desk.shibo("pin good/c.ron").expect(0);
    let ran = desk.shibo("verify a.ron good/c.ron b.ron --format json").expect(1);
    let found = ran.json();
    let states: Vec<&str> = (0..3).map(|at| found["graphs"][at]["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["bad-file", "same", "bad-file"]);
    let ran = desk.shibo("verify a.ron b.ron good/c.ron").expect(1);
    assert_eq!(ran.stderr.matches("is no lock").count(), 1, "the lock is read once: {}", ran.stderr);
    assert!(ran.stdout.contains("a.ron  bad-file\n") && ran.stdout.contains("c.ron  same"), "{}", ran.stdout);
    assert!(desk.shibo("verify a.ron").expect(1).stderr.contains("is no lock (`bad-file`): 1:"));
    let before = text(&desk);
    desk.shibo("pin a.ron").expect(1);
    assert_eq!(text(&desk), before, "a lock that cannot be read is not replaced");
    desk.write("shibo.lock", kept);
    desk.shibo("pin --remove a.ron").expect(0);
    assert!(!lock(&desk).contains("a.ron"));
}

#[test]
fn a_lock_that_is_too_large_or_no_file_is_left_alone() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    let refused = |says: &str| {
        for command in ["verify", "pin"] {
            let ran = desk.shibo(&format!("{command} a.ron")).expect(1);
            assert!(ran.stderr.contains("`shibo.lock` is ") && ran.stderr.contains(says), "{says}: {}", ran.stderr);
        }
        assert_eq!(text(&desk), GRAPH);
    };
    for (content, says) in [
        (" ".repeat((16 << 20) + 1), "it has more than 16777216 bytes"),
        ("{".repeat(200_000), "is no lock (`bad-file`): 1:2: "),
        (format!("{{ \"a.ron\": (pins: 1, text: {}", "[".repeat(200_000)), "is no lock (`bad-file`): 1:"),
    ] {
        desk.write("shibo.lock", &content);
        refused(says);
        assert_eq!(desk.read("shibo.lock"), content.as_bytes());
    }
    std::fs::remove_file(desk.path("shibo.lock")).unwrap();
    std::fs::create_dir(desk.path("shibo.lock")).unwrap();
    refused("is not a regular file");
    #[cfg(unix)]
    {
        std::fs::remove_dir(desk.path("shibo.lock")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(desk.path("shibo.lock")).status().unwrap().success());
        refused("is not a regular file");
    }
}

#[test]
fn verify_tells_edits_that_git_knows_and_files_that_changed() {
    let desk = Desk::new();
    desk.write("part.ron", GRAPH);
    desk.write(
        "a.ron",
        GRAPH
            .replace("nodes: {", "imports: { \"part\": \"part.ron\" },\n  nodes: {\n    \"p\": Use(graph: \"part\"),")
            .replace("\"a\": \"a\"", "\"a\": \"= a + p\""),
    );
    desk.shibo("pin a.ron").expect(0);
    let git = |line: &str| {
        let mut command = std::process::Command::new("git");
        command.args(["-c", "user.name=a", "-c", "user.email=a@b"]).args(line.split(' ')).current_dir(desk.path(""));
        assert!(command.output().unwrap().status.success(), "{line}");
    };
    git("init -q");
    git("add .");
    git("commit -qm pin");
    desk.write("a.ron", text(&desk).replace("size: 5", "size: 4"));
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(ran.stdout.contains("  nodes.a.size  5 → 4\n"), "{}", ran.stdout);
    git("checkout -q a.ron");
    desk.shibo("verify a.ron").expect(0);
    desk.write("part.ron", GRAPH.replace("size: 5", "size: 3"));
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(ran.stdout.contains("a.ron  edited\n"), "{}", ran.stdout);
    assert!(ran.stdout.contains("  part.ron was edited since the graph was pinned\n"), "{}", ran.stdout);
}

#[test]
fn merge_of_locks_takes_the_changes_of_both_sides() {
    let desk = Desk::new();
    let entry = |name: &str, bits: &str| {
        format!("    {name:?}: (pins: 1, text: \"\", pictures: {{ \"a\": (bits: {bits:?}) }}),\n")
    };
    let lock = |entries: &[(&str, &str)]| {
        format!("{{\n{}}}\n", entries.iter().map(|(name, bits)| entry(name, bits)).collect::<String>())
    };
    desk.write("base", lock(&[("a.ron", "0"), ("b.ron", "0"), ("c.ron", "0")]));
    desk.write("ours", lock(&[("a.ron", "1"), ("b.ron", "0"), ("c.ron", "1")]));
    desk.write("theirs", lock(&[("a.ron", "0"), ("b.ron", "2"), ("c.ron", "2")]));
    desk.shibo("merge base ours theirs --path graphs/shibo.lock").expect(0);
    let merged = String::from_utf8(desk.read("ours")).unwrap();
    let kept = ["a.ron\": (\n        pins: 1", "b.ron\"", "bits: \"1\"", "bits: \"2\""];
    assert!(kept.iter().all(|text| merged.contains(text)) && !merged.contains("c.ron"), "{merged}");
}

#[test]
fn a_kept_version_gives_its_picture_and_a_new_one_is_named() {
    let desk = Desk::new();
    let veins = GRAPH.replace("Perlin(size: 5)", "Fractal(size: 5, kind: Turbulence)");
    desk.write("a.ron", &veins);
    desk.shibo("pin --to 1 a.ron").expect(0);
    desk.shibo("verify a.ron").expect(0);
    let advice = desk.shibo("check a.ron").expect(0).stderr;
    assert!(
        advice.contains("the pin keeps `Fractal` at version 2; version 3: the octaves of `Turbulence` are turned"),
        "{advice}"
    );
    // Without its pin the graph has the new version.
    desk.write("a.ron", &veins);
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(ran.stdout.starts_with("a.ron  changed\n  a: "), "{}", ran.stdout);
    assert!(ran.stdout.contains("  `Fractal` 3 (change 2, node \"a\", line 6): "), "{}", ran.stdout);
    // The change does not touch other kinds of noise.
    desk.write("a.ron", veins.replace("Turbulence", "Ridged"));
    desk.shibo("pin --to 1 a.ron").expect(0);
    desk.shibo("pin --remove --no-lock a.ron").expect(0);
    desk.shibo("verify a.ron").expect(0);
}

/// The change at which a text is pinned as a number.
fn change_of(text: &str) -> u32 {
    let at = text.find("pins: ").unwrap() + 6;
    text[at..].split(',').next().unwrap().parse().unwrap()
}

#[test]
fn a_shipped_graph_that_changed_is_refused_until_the_graph_is_migrated() {
    let desk = Desk::new();
    let uses = GRAPH.replace("\"a\": Perlin(size: 5)", "\"a\": Use(graph: \"s\")");
    let uses = uses.replace("version: 1,", "version: 1,\n  pins: 3,\n  imports: { \"s\": \"shibo:starter\" },");
    desk.write("a.ron", &uses);
    // The graph that uses it has no pins of its own.
    desk.write("part.ron", uses.replace("  pins: 3,\n", ""));
    desk.write("b.ron", uses.replace("shibo:starter", "part.ron"));
    for (graph, place) in [("a.ron", "a.ron:8:10"), ("b.ron", "part.ron:7:10")] {
        for command in ["check", "verify", "render --no-cache -o out"] {
            let ran = desk.shibo(&format!("{command} {graph}")).expect(1);
            let told = [
                "changed-kind",
                place,
                "`shibo:starter` of version 1 is not in this program any more",
                "shibo migrate",
            ];
            assert!(told.iter().all(|text| ran.stderr.contains(text)), "{command} {graph}: {}", ran.stderr);
        }
    }
    desk.shibo("render --newest --no-cache -o out a.ron --resolution 16").expect(0);
    let ran = desk.shibo("migrate a.ron").expect(0);
    assert!(ran.stderr.contains("a.ron: `a` looks different since change 4: another grain"), "{}", ran.stderr);
    assert!(change_of(&text(&desk)) > 3);
    assert!(!desk.shibo("check a.ron").expect(0).stderr.contains("changed-kind"));
}

#[test]
fn a_function_of_a_shipped_graph_that_changed_is_refused_until_the_graph_is_migrated() {
    let desk = Desk::new();
    let calls = GRAPH.replace("Perlin(size: 5)", "\"= d.float(x / 5)\"");
    let calls = calls.replace("version: 1,", "version: 1,\n  pins: 45,\n  imports: { \"d\": \"shibo:denim\" },");
    desk.write("a.ron", &calls);
    for command in ["check", "verify", "render --no-cache -o out"] {
        let ran = desk.shibo(&format!("{command} a.ron")).expect(1);
        let told = [
            "changed-kind",
            "a.ron:8:13",
            "`shibo:denim` of version 1 is not in this program any more",
            "`shibo migrate FILE` takes version 2: plain twist",
        ];
        assert!(told.iter().all(|text| ran.stderr.contains(text)), "{command}: {}", ran.stderr);
    }
    desk.shibo("render --newest --no-cache -o out a.ron").expect(0);
    let ran = desk.shibo("migrate a.ron").expect(0);
    assert!(ran.stderr.contains("a.ron: `a` looks different since change 46: plain twist"), "{}", ran.stderr);
    assert!(change_of(&text(&desk)) > 46);
    assert!(!desk.shibo("check a.ron").expect(0).stderr.contains("changed-kind"));
    // A picture in the lock is from before the change.
    desk.shibo("pin a.ron").expect(0);
    let (kept, newest) = (lock(&desk), change_of(&text(&desk)));
    let at = kept.find("bits: \"").unwrap() + 7;
    let old = format!("{}{}{}", &kept[..at], "0".repeat(16), &kept[at + 16..]);
    desk.write("shibo.lock", old.replace(&format!("pins: {newest},"), "pins: 45,"));
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(ran.stdout.starts_with("a.ron  changed\n  a: "), "{}", ran.stdout);
    assert!(ran.stdout.contains("  `denim` 2 (change 46, node \"a\", line 8): plain twist"), "{}", ran.stdout);
}

#[test]
fn verify_calls_changed_pins_an_edit() {
    let desk = Desk::new();
    let veins = GRAPH.replace("Perlin(size: 5)", "Fractal(size: 5, kind: Turbulence)");
    let part = veins.replace("version: 1,", "version: 1,\n  pins: 1,");
    desk.write("part.ron", &part);
    let uses = GRAPH.replace("\"a\": \"a\"", "\"a\": \"= a + p\"");
    let uses =
        uses.replace("nodes: {", "imports: { \"part\": \"part.ron\" },\n  nodes: {\n    \"p\": Use(graph: \"part\"),");
    desk.write("a.ron", uses);
    desk.shibo("pin a.ron").expect(0);
    let newest = change_of(&text(&desk));
    desk.shibo("verify a.ron").expect(0);
    let held = format!("pins: (change: {newest}, hold: {{ \"Fractal\": 3 }}),");
    for pins in ["", &format!("pins: {newest},"), &held] {
        desk.write("part.ron", part.replace("pins: 1,", pins));
        let ran = desk.shibo("verify a.ron").expect(1);
        assert!(ran.stdout.starts_with("a.ron  edited\n  a: "), "{pins}: {}", ran.stdout);
        assert!(ran.stdout.contains("  part.ron was edited since the graph was pinned\n"), "{pins}: {}", ran.stdout);
    }
    // Pins with the same meaning change no picture.
    desk.write("part.ron", part.replace("pins: 1,", "pins: (change: 1, hold: { \"Perlin\": 1 }),"));
    desk.shibo("verify a.ron").expect(0);
    // The pins of the graph itself.
    desk.write("a.ron", &veins);
    desk.shibo("pin a.ron").expect(0);
    let pinned = text(&desk);
    for pins in [format!("pins: (change: {newest}, hold: {{ \"Fractal\": 2 }}),"), "pins: 1,".to_owned()] {
        desk.write("a.ron", pinned.replace(&format!("pins: {newest},"), &pins));
        let ran = desk.shibo("verify a.ron").expect(1);
        assert!(ran.stdout.starts_with("a.ron  edited\n"), "{pins}: {}", ran.stdout);
        assert!(ran.stdout.contains("  the text was edited since the graph was pinned\n"), "{pins}: {}", ran.stdout);
    }
    // A later change is the reason where a pin is raised.
    desk.shibo("pin --to 1 a.ron").expect(0);
    desk.write("a.ron", pinned);
    assert!(desk.shibo("verify a.ron").expect(1).stdout.starts_with("a.ron  changed\n"));
}

#[test]
fn verify_tells_pictures_that_are_new_or_gone() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("\"a\": \"a\" }", "\"a\": \"a\", \"b\": \"= 2 * a\" }"));
    desk.shibo("pin a.ron").expect(0);
    let pinned = text(&desk);
    desk.write("a.ron", pinned.replace("\"b\": \"= 2 * a\"", "\"b\": \"= 2 * a\", \"c\": \"= 3 * a\""));
    let ran = desk.shibo("verify a.ron --format json").expect(1).json();
    let of = |name: usize| ran["graphs"][0]["pictures"][name]["state"].as_str().unwrap().to_owned();
    assert_eq!([0, 1, 2].map(of), ["same", "same", "not-pinned"]);
    assert_eq!(ran["graphs"][0]["state"], "not-pinned");
    desk.write("a.ron", pinned.replace(", \"b\": \"= 2 * a\"", ""));
    let ran = desk.shibo("verify a.ron").expect(1);
    assert!(ran.stdout.starts_with("a.ron  edited\n  b: it is gone\n"), "{}", ran.stdout);
}

#[test]
fn migrate_names_versions_that_are_gone() {
    let desk = Desk::new();
    let lit = GRAPH.replace("Perlin(size: 5),", "Perlin(size: 5),\n    \"r\": Relief(height: \"a\"),");
    let lit = lit.replace("\"a\": \"a\" }", "\"a\": \"r\" }");
    let held = lit.replace("version: 1,", "version: 1,\n  pins: (change: 3, hold: { \"Relief\": 3 }),");
    desk.write("a.ron", &held);
    let told = [
        "changed-kind",
        "a.ron:8:10",
        "`Relief` of version 3 is not in this program any more",
        "remove `Relief` from `hold` of the pins to take version 4:",
        "the version is held here",
    ];
    // The change is raised, and the kind stays held.
    for command in ["migrate --dry-run", "migrate", "migrate", "migrate --check"] {
        let ran = desk.shibo(&format!("{command} a.ron")).expect(1);
        assert!(told.iter().all(|text| ran.stderr.contains(text)), "{command}: {}", ran.stderr);
    }
    let raised = text(&desk);
    assert!(!raised.contains("change: 3,") && raised.contains("hold: { \"Relief\": 3 }"), "{raised}");
    // A version from before the table of changes.
    desk.write("a.ron", held.replace("\"Relief\": 3", "\"Relief\": 1"));
    let ran = desk.shibo("migrate a.ron").expect(1);
    assert!(ran.stderr.contains("`Relief` has the versions 3 to 4; found 1"), "{}", ran.stderr);
    // The same in an import, whose pins are its own.
    desk.write("part.ron", held);
    let uses = GRAPH.replace("Perlin(size: 5)", "Use(graph: \"p\")");
    desk.write("a.ron", uses.replace("version: 1,", "version: 1,\n  pins: 3,\n  imports: { \"p\": \"part.ron\" },"));
    let ran = desk.shibo("migrate a.ron").expect(1);
    assert!(
        ran.stderr.contains("part.ron:8:10") && ran.stderr.contains("remove `Relief` from `hold`"),
        "{}",
        ran.stderr
    );
    // Without `hold` the newest version is taken, and the new look is told.
    desk.write("a.ron", lit.replace("version: 1,", "version: 1,\n  pins: 2,"));
    let ran = desk.shibo("migrate a.ron").expect(0);
    assert!(ran.stderr.contains("a.ron: `r` looks different since change 3: "), "{}", ran.stderr);
    desk.shibo("migrate --check a.ron").expect(0);
}
