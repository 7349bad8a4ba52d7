//! Variants of a graph: shared work is computed once, existing files are kept, and file names never collide.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH, samples};
use std::collections::BTreeSet;
use std::time::{Duration, SystemTime};

fn times(desk: &Desk, dir: &str) -> Vec<(String, SystemTime)> {
    let modified = |name: &String| std::fs::metadata(desk.path(format!("{dir}/{name}"))).unwrap().modified().unwrap();
    desk.names(dir).into_iter().map(|name| (name.clone(), modified(&name))).collect()
}

fn rows(desk: &Desk) -> Vec<Vec<String>> {
    let text = String::from_utf8(desk.read("out/sweep.csv")).unwrap();
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn all_combinations_are_rendered_and_listed() {
    let desk = Desk::with_graph();
    let line = "render a.ron --sweep seed=1..3 --sweep size=2..4/2 --sweep preset=large --sheet sheet.png";
    // `size` is both set by the preset and swept: the swept value wins.
    desk.shibo(line).expect(0);
    let rows = rows(&desk);
    assert_eq!(rows[0], ["file", "seed", "size", "preset", "key", "seconds"]);
    assert_eq!(rows.len(), 1 + 3 * 2 * 2);
    assert_eq!(rows[1][..4], ["seed-1_size-2_preset-large_bumps.png", "1", "2", "large"]);
    let files: BTreeSet<&String> = rows[1..].iter().map(|row| &row[0]).collect();
    assert_eq!(files.len(), 12);
    desk.shibo("render a.ron --set seed=2 --set size=4 --preset large -o one").expect(0);
    for name in ["bumps", "mask"] {
        let variant = desk.read(&format!("out/seed-2_size-4_preset-large_{name}.png"));
        assert!(variant == desk.read(&format!("one/{name}.png")), "{name}");
    }
    let (width, pixels) = samples(&desk.path("out/sheet.png"));
    assert!(width == 3 * 136 + 8 && pixels.len() > width * 300, "{width} {}", pixels.len());
    // A second run rewrites no file.
    let before = times(&desk, "out");
    desk.shibo(line).expect(0);
    assert_eq!(times(&desk, "out"), before);
    // A missing file is made again, and only that one.
    std::fs::remove_file(desk.path("out/seed-3_size-2_preset-large_mask.png")).unwrap();
    let ran = desk.shibo(line).expect(0);
    assert!(ran.stderr.contains("1 variant rendered, 5 were there already"), "{}", ran.stderr);
    assert_eq!(desk.names("out").len(), before.len());
}

#[test]
fn a_sheet_of_two_names_is_a_matrix() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(version: 1, canvas: (size_mm: 8, resolution: 8), params: { \"r\": Number(default: 0), \"g\": Number(default: 0) },
          nodes: { \"c\": \"= ($r, $g, 0)\" }, outputs: { \"c\": \"c\" })",
    );
    desk.shibo("render a.ron --sweep r=0..1/2 --sweep g=0..1/3 --sheet sheet.png").expect(0);
    let (width, pixels) = samples(&desk.path("out/sheet.png"));
    // A row for each value of the first name, a column for each value of the second.
    let left = 8 + 3 * 6 + 8;
    assert_eq!((width, pixels.len() / width), (left + 3 * 136, 17 + 2 * 140 + 8));
    let colour = |row: usize, column: usize| {
        let [r, g, b, _] = pixels[(17 + row * 140 + 8 + 64) * width + left + column * 136 + 64];
        [r, g, b].map(|sample| sample >> 8)
    };
    assert_eq!(
        [colour(0, 0), colour(0, 2), colour(1, 0), colour(1, 2)],
        [[0; 3], [0, 255, 0], [255, 0, 0], [255, 255, 0]]
    );
    assert_eq!(colour(0, 1)[1], 188, "half the light");
    // Labels stand above the columns and left of the rows.
    let lit = |x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
        y.flat_map(|y| x.clone().map(move |x| y * width + x)).filter(|at| pixels[*at][0] > 40_000).count()
    };
    assert!((0..3).all(|column| lit(left + column * 136..left + column * 136 + 40, 0..17) > 10));
    assert!((0..2).all(|row| lit(0..left, 17 + row * 140..17 + (row + 1) * 140) > 10));
}

#[test]
fn computes_shared_work_of_variants_once() {
    let desk = Desk::new();
    // Only the colours differ between the variants.
    let graph = GRAPH.replace(
        "\"bumps\": Perlin(size: \"$size\")",
        "\"bumps\": Perlin(size: 5),\n    \"t\": Remap(input: \"strokes.mask\", to: (0, \"= $size / 20\"))",
    );
    desk.write(
        "a.ron",
        graph
            .replace("outputs: { \"bumps\": \"bumps\", \"mask\": \"strokes.mask\" }", "outputs: { \"t\": \"t\" }")
            .replace("steps: 20", "steps: 30000"),
    );
    desk.shibo("render a.ron --sweep size=1..16 -o many --cache-dir c").expect(0);
    assert_eq!(desk.names("many").len(), 17);
    // Each object of the graph is stored at most once, although there are sixteen graphs.
    let objects: usize = desk.names("c/objects").iter().map(|dir| desk.names(&format!("c/objects/{dir}")).len()).sum();
    assert!((1..=5).contains(&objects), "{objects}");
}

#[test]
fn resumes_killed_sweep() {
    let desk = Desk::with_graph();
    let args = ["render", "a.ron", "--sweep", "seed=1..40", "--no-cache"];
    let mut child = desk.command(args).stderr(std::process::Stdio::null()).spawn().unwrap();
    let table = desk.path("out/sweep.csv");
    while !std::fs::read_to_string(&table).is_ok_and(|text| text.lines().count() > 9) {
        assert!(child.try_wait().unwrap().is_none() || table.exists());
        std::thread::sleep(Duration::from_millis(5));
    }
    let _ = child.kill();
    child.wait().unwrap();
    let before: BTreeSet<(String, SystemTime)> = times(&desk, "out").into_iter().collect();
    let listed: BTreeSet<String> = rows(&desk)[1..].iter().map(|row| row[0].clone()).collect();
    let ran = desk.run(args).expect(0);
    assert!(!ran.stderr.contains("0 were there already"), "{}", ran.stderr);
    assert_eq!(rows(&desk).len(), 81);
    let after: BTreeSet<(String, SystemTime)> = times(&desk, "out").into_iter().collect();
    let kept = before.intersection(&after).filter(|(name, _)| listed.contains(name)).count();
    // The last variant may have only one of its two rows.
    assert!(kept + 1 >= listed.len() && listed.len() >= 9, "{kept} of {}", listed.len());
    // The second run leaves no temporary files of its own; those of the killed run stay for a day.
    assert!(after.difference(&before).all(|(name, _)| !name.starts_with('.')), "{after:?}");
    desk.shibo("render a.ron --set seed=40 -o one --no-cache").expect(0);
    assert!(desk.read("out/seed-40_bumps.png") == desk.read("one/bumps.png"));
}

#[test]
fn refuses_invalid_sweeps_before_rendering() {
    let desk = Desk::with_graph();
    for (line, code, said) in [
        ("--sweep seed=1..2 --sweep seed=3..4", 2, "twice"),
        ("--sweep seed=1..1000 --sweep size=1..20/1000", 2, "100000"),
        ("--sweep size=1,1", 2, "twice"),
        ("--sweep size=2..1", 2, "empty"),
        ("--sweep size=1.5..3", 2, "TO/COUNT"),
        ("--sweep size=", 2, "missing"),
        ("--sweep size=1..2 --set size=1", 2, "both set and swept"),
        ("--sweep preset=large --preset large", 2, "one preset"),
        ("--sweep sise=1..2", 1, "size"),
        ("--sweep size=1..99", 1, "size"),
        ("--sweep preset=none", 1, "preset"),
        ("--sweep seed=a,b", 1, "seed"),
        ("--sweep seed=1..2 --part 1/1", 2, "cannot be used"),
        ("--sheet a.png", 2, "--sweep"),
        ("--set seed=-1", 1, "seed is `-1`"),
    ] {
        let ran = desk.shibo(&format!("render a.ron {line}")).expect(code);
        assert!(ran.stderr.contains(said), "{line}: {}", ran.stderr);
        assert!(!desk.path("out").exists(), "{line}");
    }
}

#[test]
fn accepts_parameter_named_seed() {
    let desk = Desk::with_graph();
    let graph = GRAPH.replace("params: {", "params: { \"seed\": Integer(default: 3, range: (0, 9)),");
    desk.write("a.ron", graph.replace("Perlin(size: \"$size\")", "Perlin(size: \"$size\", seed: \"$seed\")"));
    desk.shibo("render a.ron --sweep seed=3..4").expect(0);
    desk.shibo("render a.ron -o one").expect(0);
    assert!(desk.read("out/seed-3_mask.png") == desk.read("one/mask.png"));
    desk.shibo("render a.ron --sweep seed=10").expect(1);
}
