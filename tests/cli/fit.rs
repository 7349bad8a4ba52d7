//! `shibo fit`: finds hidden values, writes a preset and nothing else, and refuses bad input.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::{Desk, Ran};
use serde_json::Value as Json;

const GRAPH: &str = r##"// Bumps in two colours.
(
  version: 1,
  canvas: (size_mm: 40, resolution: 96, tile: Both, seed: 1),
  params: {
    "size": Number(default: 4, range: (2, 8), unit: "mm", doc: "Size of the bumps"),
    "grain": Number(default: 0, range: (-90, 90), unit: "°", doc: "Direction of the bumps"),
    "amount": Number(default: 0.5, range: (0, 1), doc: "Contrast"),
    "color": Color(default: "#806040", doc: "Colour"),
    "style": Choice(default: "Plain", options: ["Plain", "Dark"], doc: "Shade"),
  },
  presets: {
    "pale": { "color": "#a09070" }, // a comment that stays
  },
  nodes: {
    "bumps": Fractal(size: "$size",   octaves: 2, aspect: 2.5, angle: "$grain", seed: 1),
    "tint": "= $color * (1 - $amount * bumps) * if($style == Dark, 0.8, 1)",
  },
  outputs: { "picture": "tint" },
)
"##;

/// A folder with the graph and a picture of it at hidden values and another seed.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    desk.shibo("render a.ron -o out --resolution 128 --set size=3 --set grain=50 --set amount=0.8 --set color=#907050 --set seed=9")
        .expect(0);
    std::fs::rename(desk.path("out/picture.png"), desk.path("scan.png")).unwrap();
    desk
}

fn fitted(desk: &Desk, more: &str) -> Ran {
    desk.shibo(&format!("fit a.ron scan.png --width-mm 40 --format json --quiet {more}"))
}

fn value(found: &Json, name: &str) -> f64 {
    found["parameters"][name]["value"].as_f64().unwrap()
}

#[test]
fn finds_hidden_values_and_writes_a_preset() {
    let desk = desk();
    let found = fitted(&desk, "--renders 60 --sheet sheet.png").expect(0).json();
    assert!((value(&found, "size") - 3.0).abs() < 0.45, "{found}");
    assert!((value(&found, "grain") - 50.0).abs() < 9.0, "{found}");
    assert!((value(&found, "amount") - 0.8).abs() < 0.12, "{found}");
    let distance = found["distance"].as_f64().unwrap();
    assert!(distance < 2.5 * found["floor"].as_f64().unwrap() && distance < 0.5 * found["start"].as_f64().unwrap());
    assert_eq!((&found["preset"], &found["width_fitted"]), (&Json::from("scan"), &Json::from(false)));
    // All other text stays.
    let text = String::from_utf8(desk.read("a.ron")).unwrap();
    let kept: Vec<&str> = text
        .lines()
        .filter(|line| !line.contains("\"scan\"") && !line.contains("// fitted to scan.png, 40 mm wide: "))
        .collect();
    assert_eq!(kept, GRAPH.lines().collect::<Vec<_>>());
    assert_eq!(text.lines().count(), GRAPH.lines().count() + 2, "{text}");
    desk.shibo("render a.ron -o fit --preset scan").expect(0);
    assert!(desk.path("sheet.png").exists());
    // A second run replaces the preset, with the same bits for any number of threads.
    for threads in [1, 2] {
        let again = fitted(&desk, &format!("--renders 60 --threads {threads}")).expect(0).json();
        assert_eq!((&again["parameters"], &again["distance"]), (&found["parameters"], &found["distance"]));
        assert_eq!(String::from_utf8(desk.read("a.ron")).unwrap(), text);
    }
}

#[test]
fn only_prints_where_nothing_is_to_be_written() {
    let desk = desk();
    let line = "fit a.ron scan.png --width-mm 40 --only color --renders 20 --dry-run --quiet";
    let ran = desk.shibo(line).expect(0);
    assert!(
        ran.stdout.contains("// fitted to scan.png, 40 mm wide: ") && ran.stdout.contains("\"color\": \"#"),
        "{}",
        ran.stdout
    );
    assert!(!ran.stdout.contains("\"size\""), "{}", ran.stdout);
    assert_eq!(desk.read("a.ron"), GRAPH.as_bytes());
    // Without a width, the size of the canvas is an unknown.
    let found =
        desk.shibo("fit a.ron scan.png --only size --renders 24 --dry-run --quiet --format json").expect(0).json();
    assert_eq!(found["width_fitted"], true);
    assert!(found["width_mm"].as_f64().unwrap() > 5.0, "{found}");
}

#[test]
fn bad_input_is_refused_with_a_remedy() {
    let desk = desk();
    let cases = [
        ("fit a.ron scan.png --width-mm 0", 2, "must be a number above 0"),
        ("fit a.ron scan.png --width-mm nan", 2, "must be a number above 0"),
        ("fit a.ron scan.png --only colr", 2, "did you mean `color`?"),
        ("fit a.ron scan.png --output pictures", 2, "did you mean `picture`?"),
        ("fit a.ron scan.png --fixed size,grain,amount,color", 2, "nothing is left to fit"),
        ("fit a.ron scan.png --only style --width-mm 40", 2, "add presets that differ"),
        ("fit a.ron scan.png --light 30", 2, "AZIMUTH,ELEVATION"),
        ("fit a.ron scan.png --light 30,40", 2, "no `Relief`"),
        ("fit a.ron scan.png --crop 0,0,300,300", 2, "128 × 128 pixels"),
        ("fit a.ron scan.png --crop 0,0,12,300", 2, "crop is not inside"),
        ("fit a.ron scan.png --crop 0,0,12,100", 1, "at least 16 a side"),
        ("fit a.ron a.ron --width-mm 40", 1, "a.ron"),
        ("fit a.ron none.png --width-mm 40", 1, "none.png"),
        ("fit none.ron scan.png --width-mm 40", 1, "none.ron"),
        ("fit a.ron scan.png --preset a/b --renders 8 --quiet", 2, "cannot be the name of a preset"),
        ("fit a.ron flat.png --width-mm 40", 1, "has one colour"),
    ];
    desk.write("flat.ron", "(version: 1, canvas: (size_mm: 8, resolution: 32), nodes: { \"c\": \"= (0.2, 0.3, 0.4)\" }, outputs: { \"c\": \"c\" })");
    desk.shibo("render flat.ron -o out").expect(0);
    std::fs::rename(desk.path("out/c.png"), desk.path("flat.png")).unwrap();
    for (line, code, part) in cases {
        let ran = desk.shibo(line).expect(code);
        assert!(ran.stderr.contains(part), "{line}: {}", ran.stderr);
    }
    assert_eq!(desk.read("a.ron"), GRAPH.as_bytes());
}

#[test]
fn among_ranks_shipped_graphs_and_fits_the_nearest() {
    let desk = Desk::new();
    desk.shibo("render shibo:cork -o out --output lit --resolution 256 --set seed=77").expect(0);
    std::fs::rename(desk.path("out/lit.png"), desk.path("scan.png")).unwrap();
    let line =
        "fit --among concrete,cork,brushed_steel,sandstone,brick_wall scan.png --width-mm 100 --renders 8 --quiet";
    let found = desk.shibo(&format!("{line} --format json")).expect(0).json();
    let ranking = found["ranking"].as_array().unwrap();
    assert_eq!((&ranking[0]["graph"], ranking.len()), (&Json::from("cork"), 4), "{found}");
    assert_eq!(ranking[0]["preset"], Json::Null, "{found}");
    let distance = |at: usize| ranking[at]["distance"].as_f64().unwrap();
    assert!((1..4).all(|at| distance(at - 1) <= distance(at)) && distance(0) < 0.5 * distance(1), "{found}");
    // Concrete has boards that do not fit 100 mm.
    assert_eq!(
        (&found["refused"][0]["graph"], found["refused"].as_array().unwrap().len()),
        (&Json::from("concrete"), 1)
    );
    // The nearest three are fitted.
    let fits = found["fits"].as_array().unwrap();
    let graphs = |rows: &[Json]| rows.iter().map(|row| row["graph"].clone()).collect::<Vec<_>>();
    assert_eq!(graphs(fits), graphs(&ranking[..3]));
    assert!(fits[0]["fit"]["parameters"].is_object(), "{found}");
    let page = desk.shibo(line).expect(0).stdout;
    assert!(page.lines().nth(1).unwrap().starts_with("cork "), "{page}");
    assert!(page.contains("cork comes nearest, at the preset\n    // fitted to scan.png, 100 mm wide: "), "{page}");
}

#[test]
fn among_takes_families_and_refuses_unknown_names() {
    let desk = desk();
    let cases = [
        ("fit --among stoen scan.png", "did you mean `stone`?"),
        ("fit --among zzzzzz scan.png", "the families are: ceramics and glass, concrete and plaster,"),
        ("fit --among stone a.ron scan.png", "cannot be used with"),
        ("fit --among stone --preset a scan.png", "cannot be used with"),
        ("fit scan.png", "<GRAPH>"),
    ];
    for (line, part) in cases {
        let ran = desk.shibo(line).expect(2);
        assert!(ran.stderr.contains(part), "{line}: {}", ran.stderr);
    }
    // A word of a family stands for it: here, `plastic and rubber`.
    let found =
        desk.shibo("fit --among rubber scan.png --width-mm 40 --renders 8 --quiet --format json").expect(0).json();
    let all = [&found["ranking"], &found["refused"]].map(|rows| rows.as_array().unwrap().len());
    assert_eq!(all[0] + all[1], 3, "{found}");
}

#[cfg(unix)]
#[test]
fn interrupting_keeps_the_best_so_far() {
    let desk = desk();
    let line = "fit a.ron scan.png --width-mm 40 --format json --renders 5000";
    let child = desk
        .command(line.split_whitespace())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(2500));
    let _ = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    let output = child.wait_with_output().unwrap();
    let (stdout, stderr) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    // On a slow machine, the signal may come before the first render or before the handler; on a fast one, after the end.
    match output.status.code() {
        Some(130) if stderr.contains("nothing was written") => assert_eq!(desk.read("a.ron"), GRAPH.as_bytes()),
        Some(130) => {
            let found: Json = serde_json::from_str(&stdout).unwrap();
            assert_eq!(found["interrupted"], true);
            assert!(String::from_utf8(desk.read("a.ron")).unwrap().contains("interrupted at distance"));
        }
        code => assert!(matches!(code, None | Some(0)), "{code:?} {stderr}"),
    }
}
