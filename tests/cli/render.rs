//! `shibo render`, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH, WIDE, samples};
use serde_json::Value as Json;

#[test]
fn all_outputs_are_written_and_named() {
    let desk = Desk::with_graph();
    let ran = desk.shibo("render a.ron").expect(0);
    assert_eq!(ran.stdout, "");
    assert_eq!(desk.names("out"), ["bumps.png", "mask.png"]);
    assert!(ran.stderr.contains("wrote out/bumps.png\n"), "{}", ran.stderr);
    let (width, pixels) = samples(&desk.path("out/bumps.png"));
    assert_eq!((width, pixels.len()), (96, 96 * 96));
    assert!(pixels.iter().any(|p| *p != pixels[0]));
    let ran = desk.shibo("render a.ron -o other/deep --quiet --output mask").expect(0);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    assert_eq!(desk.names("other/deep"), ["mask.png"]);
}

fn states(stats: &Json) -> Vec<(String, String)> {
    let text = |v: &Json| v.as_str().unwrap().to_owned();
    stats["nodes"].as_array().unwrap().iter().map(|n| (text(&n["name"]), text(&n["state"]))).collect()
}

#[test]
fn only_unreachable_nodes_are_unused() {
    let desk = Desk::with_graph();
    desk.write(
        "part.ron",
        "(nodes: { \"n\": Perlin(size: 2), \"m\": Material(roughness: 0.5, height: \"n\") }, outputs: { \"m\": \"m\" })",
    );
    desk.write(
        "u.ron",
        "(canvas: (size_mm: 8, resolution: 32), imports: { \"part\": \"part.ron\" },
          nodes: { \"u\": Use(graph: \"part\"), \"spare\": Perlin(size: 1), \"one\": \"= 1\",
                   \"set\": Material(from: \"u.m\", roughness: \"one\") },
          outputs: { \"o\": \"set\" })",
    );
    for _ in 0..2 {
        // The same when everything comes from the cache.
        let stats = desk.shibo("render u.ron --stats json").expect(0).json();
        let unused: Vec<String> =
            states(&stats).into_iter().filter(|(_, state)| state == "unused").map(|(name, _)| name).collect();
        assert_eq!(unused, ["spare"], "{stats}");
        let uses = stats["uses"].as_array().unwrap();
        assert_eq!((uses.len(), &uses[0]["name"], &uses[0]["kind"]), (1, &"u".into(), &"Use part".into()), "{stats}");
        let inside =
            stats["nodes"].as_array().unwrap().iter().filter(|n| n["name"].as_str().unwrap().starts_with("u/"));
        let sum: f64 = inside.map(|n| n["seconds"].as_f64().unwrap()).sum();
        assert!((uses[0]["seconds"].as_f64().unwrap() - sum).abs() < 1e-9 && uses[0]["nodes"].as_u64() >= Some(2));
    }
}

#[test]
fn a_second_run_computes_nothing() {
    let desk = Desk::with_graph();
    let first = desk.shibo("render a.ron --stats json").expect(0).json();
    for key in ["wall_s", "cpu_s", "peak_rss_mib"] {
        assert!(first[key].as_f64().is_some_and(|v| v >= 0.0), "{key}: {first}");
    }
    assert_eq!(first["files"], serde_json::json!(["out/bumps.png", "out/mask.png"]));
    assert!(states(&first).iter().all(|(_, state)| state == "computed"), "{first}");
    let node = &first["nodes"][0];
    assert!(node["kind"].is_string() && node["seconds"].is_number() && node["tiles"].is_u64(), "{node}");
    let bytes = desk.read("out/bumps.png");
    std::fs::remove_dir_all(desk.path("out")).unwrap();
    let second = desk.shibo("render a.ron --stats json").expect(0).json();
    assert!(states(&second).iter().all(|(_, state)| state != "computed"), "{second}");
    assert_eq!(desk.read("out/bumps.png"), bytes);
    // Comments, order and spelling do not count as changes.
    desk.write("a.ron", GRAPH.replace("(size: \"$size\")", "(size: 5.00) /* as before */"));
    let third = desk.shibo("render a.ron --stats json").expect(0).json();
    assert!(states(&third).iter().all(|(_, state)| state != "computed"), "{third}");
}

#[test]
fn edit_recomputes_downstream_nodes() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron").expect(0);
    desk.write("a.ron", GRAPH.replace("steps: 20", "steps: 21"));
    let stats = desk.shibo("render a.ron --stats json").expect(0).json();
    for node in stats["nodes"].as_array().unwrap() {
        let downstream = ["moved", "wrinkles", "strokes"].contains(&node["name"].as_str().unwrap());
        // Cheap results are not kept, and a busy machine changes the measured times.
        let cheap = node["seconds"].as_f64().unwrap() < 2e-2;
        assert!(downstream || cheap || node["state"] != "computed", "{node}");
        assert!(!downstream || node["state"] == "computed", "{node}");
    }
}

#[test]
fn nothing_is_kept_without_a_cache() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron --no-cache").expect(0);
    assert!(!desk.path("cache").exists());
    let stats = desk.shibo("render a.ron --no-cache --stats json").expect(0).json();
    assert!(states(&stats).iter().all(|(_, state)| state == "computed"));
}

#[test]
fn bytes_are_equal_for_any_thread_count() {
    let desk = Desk::with_graph();
    for threads in ["1", "2", "8"] {
        desk.run(["render", "a.ron", "--no-cache", "--threads", threads, "-o", threads]).expect(0);
    }
    for name in ["bumps.png", "mask.png"] {
        let [one, two, eight] = ["1", "2", "8"].map(|t| desk.read(&format!("{t}/{name}")));
        assert!(one == two && one == eight, "{name}");
    }
}

#[test]
fn a_region_is_the_crop_of_the_whole() {
    let desk = Desk::with_graph();
    for (format, depth, more) in [("png", "8", ""), ("png", "16", ""), ("tiff", "16", ""), ("png", "8", "--dither")] {
        let common = format!("render a.ron --resolution 300x200 --format {format} --depth {depth} {more}");
        desk.shibo(&format!("{common} -o whole")).expect(0);
        desk.shibo(&format!("{common} -o part --region 37,61,150,99")).expect(0);
        for name in ["bumps", "mask"] {
            let (w, whole) = samples(&desk.path(format!("whole/{name}.{format}")));
            let (pw, part) = samples(&desk.path(format!("part/{name}.{format}")));
            assert_eq!((w, whole.len(), pw, part.len()), (300, 300 * 200, 150, 150 * 99));
            let crop: Vec<_> = (61..160).flat_map(|y| &whole[y * 300 + 37..y * 300 + 187]).copied().collect();
            assert!(crop == part, "{name} {format} {depth}");
        }
    }
}

#[test]
fn equal_graphs_give_equal_bytes() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron --no-cache -o one").expect(0);
    desk.write("b.ron", format!("// A comment.\n{}", GRAPH.replace("bumps\": P", "bumps\":   P")));
    desk.shibo("render b.ron --no-cache -o two").expect(0);
    assert_eq!(desk.read("one/mask.png"), desk.read("two/mask.png"));
    // The file states the seed, the parameters and the version.
    let bytes = desk.read("one/bumps.png");
    let text = String::from_utf8_lossy(&bytes).into_owned();
    for word in ["Shibo 0.", "shibo:graph", "shibo:seed", "size: 5"] {
        assert!(text.contains(word), "{word}");
    }
}

#[test]
fn parameters_change_the_picture() {
    let desk = Desk::with_graph();
    for (dir, args) in
        [("a", ""), ("b", "--set size=15"), ("c", "--preset large"), ("d", "--preset large --set size=5")]
    {
        desk.shibo(&format!("render a.ron --output bumps -o {dir} {args}")).expect(0);
    }
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|dir| samples(&desk.path(format!("{dir}/bumps.png"))).1);
    assert!(a != b && b == c && a == d);
}

#[test]
fn formats_and_depths() {
    let desk = Desk::with_graph();
    for (args, name) in [
        ("--format exr", "bumps.exr"),
        ("--format exr --depth f16", "bumps.exr"),
        ("--format tiff --depth f32", "bumps.tiff"),
        ("--depth f32", "bumps.exr"),
        ("--depth 16 --dither --compress best", "bumps.png"),
    ] {
        desk.shibo(&format!("render a.ron --output bumps -o o {args}")).expect(0);
        assert!(desk.path("o").join(name).exists(), "{args}");
        std::fs::remove_dir_all(desk.path("o")).unwrap();
    }
    for args in ["--format png --depth f16", "--format exr --depth 8", "--format tiff --depth f16"] {
        desk.shibo(&format!("render a.ron {args} -o none")).expect(2);
        assert!(!desk.path("none").exists() || desk.names("none").is_empty(), "{args}");
    }
}

#[test]
fn exit_codes_separate_usage_from_file_errors() {
    let desk = Desk::with_graph();
    for args in [
        "--output mesk",
        "--output bumps.height",
        "--region 0,0,97,1",
        "--region 0,0,0,1",
        "--region 1,2,3",
        "--resolution 0",
        "--resolution 1x2x3",
        "--format bmp",
        "--depth 12",
        "--threads x",
        "--stats xml",
        "--nonsense",
    ] {
        let ran = desk.shibo(&format!("render a.ron {args}")).expect(2);
        assert!(ran.stderr.starts_with("error: "), "{args}: {}", ran.stderr);
        assert_eq!(ran.stdout, "");
    }
    let ran = desk.shibo("render a.ron --output mesk").expect(2);
    assert!(ran.stderr.contains("did you mean `mask`?"), "{}", ran.stderr);
    for args in ["--resolution 1024000", "--set size=1000"] {
        let ran = desk.shibo(&format!("render a.ron {args}")).expect(1);
        assert!(ran.stderr.contains("error["), "{args}: {}", ran.stderr);
    }
    assert!(!desk.path("out").exists() || desk.names("out").is_empty());
}

#[test]
fn a_plan_beyond_the_budget_is_refused() {
    let desk = Desk::with_graph();
    let ran = desk.shibo("render a.ron --memory 16 --resolution 65536").expect(1);
    assert!(ran.stderr.contains("too-large") && ran.stderr.contains("--memory"), "{}", ran.stderr);
    assert!(desk.names("out").is_empty());
}

#[test]
fn wide_pictures_are_made_in_strips_of_the_same_bytes() {
    let desk = Desk::new();
    desk.write("a.ron", WIDE);
    let render = "render a.ron --no-cache --quiet --format exr --resolution 2304";
    desk.shibo(&format!("{render} -o whole")).expect(0);
    desk.shibo(&format!("{render} -o strips --memory 16")).expect(0);
    desk.shibo(&format!("{render} -o part --memory 16 --region 100,200,2000,300")).expect(0);
    desk.shibo(&format!("{render} -o crop --region 100,200,2000,300")).expect(0);
    for (a, b) in [("whole", "strips"), ("crop", "part")] {
        let names = desk.names(a);
        assert_eq!(names, desk.names(b), "the files that wait are gone");
        for name in names {
            assert!(desk.read(&format!("{a}/{name}")) == desk.read(&format!("{b}/{name}")), "{b}/{name}");
        }
    }
}
