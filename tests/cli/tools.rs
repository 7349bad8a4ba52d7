//! Commands on graphs of several parts: presets, intermediate nodes, drawings, tables, archives, searches.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support;

use crate::support::Desk;

const PART: &str = r#"(version: 1, canvas: (size_mm: 16, resolution: 16),
  inputs: { "at": Gray(default: 0.5) },
  nodes: { "noise": Perlin(size: 4), "sum": "= noise + at" },
  outputs: { "sum": "sum", "noise": "noise" })"#;

const MAIN: &str = r#"(version: 1, canvas: (size_mm: 16, resolution: 16), imports: { "part": "lib/part" },
  params: { "size": Number(default: 4, doc: "Size"), "tone": Number(default: 1, doc: "Tone") },
  presets: { "small": { "size": 2 }, "dark": { "tone": 0.5 } },
  nodes: {
    "waves": Perlin(size: "$size"), "left": Use(graph: "part", with: { "at": "waves" }),
    "right": Use(graph: "part", seed: 3, with: { "at": "left.noise" }),
    "points": PoissonPoints(pitch: 4),
    "out": "= left.noise + $tone * right",
    "surface": Material(base_color: "out"),
  },
  outputs: { "m": "surface", "out": "out" })"#;

fn desk() -> Desk {
    let desk = Desk::new();
    std::fs::create_dir_all(desk.path("lib")).unwrap();
    desk.write("lib/part.ron", PART);
    desk.write("main.ron", MAIN);
    desk
}

#[test]
fn several_presets_give_a_set_of_pictures_each() {
    let desk = desk();
    desk.shibo("render main.ron --preset small --preset dark --preset small+dark -q").expect(0);
    let names = desk.names("out");
    let wanted = [
        "dark_m_base_color.png",
        "dark_out.png",
        "small+dark_m_base_color.png",
        "small+dark_out.png",
        "small_m_base_color.png",
        "small_out.png",
    ];
    assert_eq!(names, wanted);
    assert_ne!(desk.read("out/dark_out.png"), desk.read("out/small_out.png"));
    // The same pictures as one by one, and merged.
    desk.run(["render", "main.ron", "--preset", "small+dark", "-o", "one/{preset}", "-q"]).expect(0);
    assert_eq!(desk.names("one"), ["small+dark"]);
    desk.shibo("render main.ron --set size=2 --set tone=0.5 -o by_hand -q").expect(0);
    assert_eq!(support::samples(&desk.path("one/small+dark/out.png")), support::samples(&desk.path("by_hand/out.png")));
    desk.run(["render", "main.ron", "--preset", "small", "--preset", "dark", "-o", "by/{preset}/x", "-q"]).expect(0);
    assert_eq!(desk.names("by"), ["dark", "small"]);
    assert_eq!(desk.names("by/dark/x"), ["m_base_color.png", "out.png"]);
    desk.run(["render", "main.ron", "-o", "plain/{preset}", "-q"]).expect(0);
    assert_eq!(desk.names("plain"), ["default"]);
    let ran = desk.shibo("render main.ron --preset small --preset small").expect(2);
    assert!(ran.stderr.contains("overwrite"), "{}", ran.stderr);
    let ran = desk.shibo("render main.ron --preset small+drak -o none").expect(1);
    assert!(ran.stderr.contains("no preset `drak`") && ran.stderr.contains("`dark`"), "{}", ran.stderr);
    assert!(!desk.path("none").exists());
}

#[test]
fn any_node_can_be_rendered() {
    let desk = desk();
    desk.shibo("render main.ron --node left/sum --node waves --node right -o nodes -q").expect(0);
    assert_eq!(desk.names("nodes"), ["left_sum.png", "right.png", "waves.png"]);
    desk.shibo("render main.ron --node left.noise --output out -o some -q").expect(0);
    assert_eq!(desk.names("some"), ["left_noise.png", "out.png"]);
    // A node does not overwrite the output that has its name.
    desk.shibo("render main.ron --node out --node surface --output out -o same -q").expect(0);
    assert_eq!(desk.names("same"), ["out.png", "out_2.png", "surface_base_color.png"]);
    assert_eq!(support::samples(&desk.path("same/out.png")), support::samples(&desk.path("same/out_2.png")));
    let ran = desk.shibo("render main.ron --node points").expect(2);
    assert!(ran.stderr.contains("Points") && ran.stderr.contains("shibo dump"), "{}", ran.stderr);
    let ran = desk.shibo("render main.ron --node left/noize").expect(2);
    assert!(ran.stderr.contains("did you mean `noise`?"), "{}", ran.stderr);
    let ran = desk.shibo("render main.ron --node lft").expect(2);
    assert!(ran.stderr.contains("did you mean `left`?"), "{}", ran.stderr);
}

#[test]
fn the_table_of_costs_sums_sub_graphs() {
    let desk = desk();
    let table = desk.shibo("render main.ron --resolution 512 --stats human --no-cache -q").expect(0).stdout;
    let seconds: Vec<f64> =
        table.lines().skip(1).filter_map(|line| line.split_whitespace().next()?.parse().ok()).collect();
    let rows = &seconds[..seconds.len() - 1];
    assert!(rows.len() > 2 && rows.is_sorted_by(|a, b| a >= b), "{table}");
    assert!(table.contains("Use part") && !table.contains("left/"), "{table}");
    assert!(table.contains("CPU s in all") || table.contains("s in all"), "{table}");
}

#[test]
fn sub_graphs_are_drawn_as_boxes() {
    let desk = desk();
    let dot = desk.shibo("graph main.ron --format dot").expect(0).stdout;
    assert!(dot.contains("label=\"Use part\\nleft\"") && dot.contains("label=\"Use part\\nright\""), "{dot}");
    assert!(!dot.contains("left/"), "{dot}");
    assert!(dot.contains("headlabel=\"at\"") && dot.contains("taillabel=\"noise\""), "{dot}");
    let whole = desk.shibo("graph main.ron --format dot --unfold").expect(0).stdout;
    assert!(whole.contains("left/sum") && !whole.contains("Use part"), "{whole}");
    let svg = desk.shibo("graph main.ron --format svg").expect(0).stdout;
    // A ground, waves, left, right, points, out, surface and two outputs.
    assert_eq!((svg.matches("<rect ").count(), svg.matches("<path ").count()), (9, 7), "{svg}");
}

#[test]
fn boxes_that_feed_each_other_are_opened() {
    let desk = desk();
    // `left` reads a node that is made from its own output.
    desk.write(
        "main.ron",
        r#"(version: 1, imports: { "part": "lib/part.ron" }, nodes: {
          "left": Use(graph: "part", with: { "at": "half" }), "half": "= 0.5 * left.noise" },
          outputs: { "out": "left" })"#,
    );
    let dot = desk.shibo("graph main.ron --format dot").expect(0).stdout;
    assert!(dot.contains("left/sum") && dot.contains("left/noise"), "{dot}");
}

#[test]
fn a_graph_is_packed_with_what_it_reads() {
    let desk = desk();
    std::fs::create_dir_all(desk.path("work")).unwrap();
    std::fs::copy("library/examples/ramp.png", desk.path("work/ramp.png")).unwrap();
    desk.write(
        "work/g.ron",
        r#"(version: 1, imports: { "part": "part", "bricks": "shibo:bricks", "photo": "shibo:calf_from_photo" },
          params: { "file": Path(default: "ramp.png", doc: "x") }, presets: { "other": { "file": "../lib/other.png" } },
          nodes: { "a": Use(graph: "part"), "i": Image(path: "$file"), "b": Use(graph: "bricks"), "p": Use(graph: "photo") }, outputs: { "a": "a", "i": "i" })"#,
    );
    std::fs::copy("library/examples/ramp.png", desk.path("lib/other.png")).unwrap();
    desk.write("work/shibo.toml", "[imports]\npaths = [\"../lib\"]\n");
    let list = desk.shibo("pack work/g.ron --list").expect(0).stdout;
    let names: Vec<&str> = list.lines().collect();
    assert_eq!(names, ["lib/other.png", "lib/part.ron", "work/g.ron", "work/ramp.png", "work/shibo.toml"]);
    desk.shibo("pack work/g.ron -o x.zip").expect(0);
    let (one, archive) = (desk.read("x.zip"), desk.read("lib/part.ron"));
    assert!(one.windows(archive.len()).any(|window| window == archive), "the text is in the archive as it is");
    desk.shibo("pack work/g.ron").expect(0);
    assert_eq!(desk.read("work/g.zip"), one, "the same archive every time");
    // The unpacked archive works elsewhere; its stored entries are unpacked here.
    let there = Desk::new();
    unpack(&one, &there);
    there.shibo("check work/g.ron --preset other").expect(0);
    let absolute = desk.path("lib/other.png");
    desk.write(
        "abs.ron",
        format!("(version: 1, nodes: {{\n\"i\": Image(path: {absolute:?}) }}, outputs: {{ \"i\": \"i\" }})"),
    );
    let ran = desk.shibo("pack abs.ron").expect(1);
    assert!(ran.stderr.contains("absolute") && ran.stderr.contains("relative to the graph file"), "{}", ran.stderr);
    assert!(!desk.path("abs.zip").exists());
}

#[test]
fn rewrites_imports_outside_the_package() {
    let desk = desk();
    std::fs::create_dir_all(desk.path("work/deep")).unwrap();
    std::fs::create_dir_all(desk.path("named")).unwrap();
    desk.write("named/other.ron", PART);
    let whole = desk.path("lib/part.ron").to_string_lossy().into_owned();
    // More steps upwards than there are folders, so the path passes the root, and down again.
    let climbing = format!("{}{whole}", "../".repeat(60));
    desk.write(
        "work/deep/g.ron",
        format!(
            "(version: 1, // keep `{whole}`\n imports: {{ \"a\": {whole:?}, \"b\": {climbing:?}, \"c\": \"../../lib/part\", \"d\": \"other\" }},
              nodes: {{ \"a\": Use(graph: \"a\"), \"b\": Use(graph: \"b\"), \"c\": Use(graph: \"c\"), \"d\": Use(graph: \"d\") }},
              outputs: {{ \"a\": \"a\", \"b\": \"b\", \"c\": \"c\", \"d\": \"d\" }})"
        ),
    );
    let named = desk.path("named");
    let ran = desk
        .run([
            std::ffi::OsStr::new("pack"),
            "work/deep/g.ron".as_ref(),
            "-o".as_ref(),
            "x.zip".as_ref(),
            "--import-path".as_ref(),
            named.as_ref(),
        ])
        .expect(0);
    assert_eq!(ran.stderr.matches("in the package").count(), 3, "{}", ran.stderr);
    let there = Desk::new();
    unpack(&desk.read("x.zip"), &there);
    let text = String::from_utf8(there.read("work/deep/g.ron")).unwrap();
    assert!(text.contains("\"a\": \"../../lib/part.ron\", \"b\": \"../../lib/part.ron\", \"c\": \"../../lib/part\", \"d\": \"../../named/other.ron\""), "{text}");
    assert!(text.contains(&format!("// keep `{whole}`")), "{text}");
    // The original files are gone, so only the packaged ones can be found.
    std::fs::remove_dir_all(desk.path("lib")).unwrap();
    there.shibo("check work/deep/g.ron").expect(0);
    // `shibo job` rewrites imports in the same way.
    std::fs::create_dir_all(desk.path("lib")).unwrap();
    desk.write("lib/part.ron", PART);
    desk.run([
        std::ffi::OsStr::new("job"),
        "work/deep/g.ron".as_ref(),
        "-o".as_ref(),
        "x.job".as_ref(),
        "--import-path".as_ref(),
        named.as_ref(),
    ])
    .expect(0);
    assert!(
        !String::from_utf8(desk.read("x.job/graph/work/deep/g.ron"))
            .unwrap()
            .replace("// keep `", "")
            .contains(&format!("\"{whole}"))
    );
    // A picture path that leaves the package is refused, and no graph is overwritten.
    std::fs::copy("library/examples/ramp.png", desk.path("lib/ramp.png")).unwrap();
    let picture = format!("{}{}", "../".repeat(60), desk.path("lib/ramp.png").display());
    desk.write(
        "climb.ron",
        format!("(version: 1, nodes: {{ \"i\": Image(path: {picture:?}) }}, outputs: {{ \"i\": \"i\" }})"),
    );
    let ran = desk.shibo("pack climb.ron").expect(1);
    assert!(ran.stderr.contains("climbs out") && !desk.path("climb.zip").exists(), "{}", ran.stderr);
    let ran = desk.shibo("pack main.ron -o lib/part.ron").expect(2);
    assert!(ran.stderr.contains("one of the files") && desk.read("lib/part.ron") == PART.as_bytes(), "{}", ran.stderr);
}

/// Writes the stored entries of an archive into a folder.
fn unpack(archive: &[u8], desk: &Desk) {
    let mut rest = archive;
    while let Some(entry) = rest.strip_prefix(b"PK\x03\x04") {
        let size = u32::from_le_bytes(entry[14..18].try_into().unwrap()) as usize;
        let length = usize::from(u16::from_le_bytes(entry[22..24].try_into().unwrap()));
        let name = std::str::from_utf8(&entry[26..26 + length]).unwrap();
        std::fs::create_dir_all(desk.path(name).parent().unwrap()).unwrap();
        desk.write(name, &entry[26 + length..26 + length + size]);
        rest = &entry[26 + length + size..];
    }
    assert!(rest.starts_with(b"PK\x01\x02"));
}

#[test]
fn nodes_are_found_by_words() {
    let desk = Desk::new();
    let found = |words: &str| desk.shibo(&format!("nodes {words}")).expect(0).stdout;
    assert!(found("noise").contains("Perlin"));
    for (words, kind) in [
        ("ColorRamp", "GradientMap"),
        ("color ramp", "GradientMap"),
        ("Poisson Disk", "PoissonPoints"),
        ("node group", "Use"),
        ("for-each", "Each"),
        ("drawwrinkle", "DrawWrinkles"),
    ] {
        let out = found(words);
        assert!(out.lines().any(|line| line.split_whitespace().next() == Some(kind)), "{words}: {out}");
    }
    // The best match comes first, and only matches are listed.
    let out = found("gradientmap");
    assert_eq!(out.lines().filter(|line| line.starts_with("    ") && !line.starts_with("     ")).count(), 1, "{out}");
    let ran = desk.shibo("nodes qwertz").expect(2);
    assert!(ran.stdout.is_empty() && ran.stderr.contains("`qwertz`"), "{}", ran.stderr);
    let json = desk.shibo("nodes color ramp --format json").expect(0).json();
    assert_eq!(json["nodes"][0]["kind"], "GradientMap");
    let manual = found("Use");
    for word in ["with", "preset", "seed", "canvas", "shibo:walnut", "shibo.toml"] {
        assert!(manual.contains(word), "{word}: {manual}");
    }
    assert!(found("Each").contains("$index"));
    assert!(desk.shibo("nodes Use --format markdown").expect(0).stdout.starts_with("### Use\n"));
    assert_eq!(desk.shibo("nodes Use --format json").expect(0).json()["nodes"][0]["kind"], "Use");
}
