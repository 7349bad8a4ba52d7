//! Checks of bodies, end to end: the milling tool, warnings in reports, and the memory of large pictures.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::Desk;
use serde_json::Value as Json;

/// A graph with outputs, on a canvas of 8 mm with a groove of 1 mm along y, 0.5 mm deep, whose walls are 0.1 mm wide.
fn grooved(tile: &str, outputs: &str) -> String {
    let walls = "smoothstep(3.4, 3.5, x) - smoothstep(4.5, 4.6, x)";
    format!(
        "(canvas: (size_mm: 8, resolution: 96, tile: {tile}),
          nodes: {{ \"groove\": \"= -0.5 * ({walls})\", \"waves\": \"= 0.2 * cos(360 * x / 4)\" }},
          outputs: {{ {outputs} }})"
    )
}

fn report(desk: &Desk, name: &str) -> Json {
    serde_json::from_slice(&desk.read(name)).unwrap()
}

#[test]
fn a_tool_that_is_too_wide_for_a_groove_is_told_with_its_place() {
    let desk = Desk::new();
    let plate = |options: &str| format!("Plate(height: \"groove\", report: true{options})");
    let outputs = [("wide", ", tool: 3"), ("narrow", ", tool: 0.3"), ("none", ""), ("mould", ", tool: 3, form: Mould")]
        .map(|(name, options)| format!("\"{name}\": {}", plate(options)));
    desk.write("a.ron", grooved("None", &outputs.join(", ")));
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("a tool of 3 mm with a ball end leaves up to 0."), "{said}");
    assert!(words.contains("more than 0.01 mm on ") && words.contains("`ToolReach`"), "{said}");
    let [wide, narrow, none, mould] =
        ["wide", "narrow", "none", "mould"].map(|name| report(&desk, &format!("out/{name}_report.json")));
    let number = |report: &Json, name: &str| report["tool"][name].as_f64().unwrap();
    assert_eq!(wide["tool"]["diameter_mm"], 3.0);
    // The groove is a seventh of the canvas, with its walls. The ball of 3 mm goes 0.1 mm down in it.
    assert!((0.3..0.5).contains(&number(&wide, "left_mm")), "{wide}");
    assert!((0.1..0.2).contains(&number(&wide, "left_share")), "{wide}");
    let at = |report: &Json| report["tool"]["left_at_mm"][0].as_f64().unwrap();
    assert!((3.4..4.6).contains(&at(&wide)), "{wide}");
    // A smaller tool leaves less, in the corners only.
    assert!(number(&narrow, "left_mm") < number(&wide, "left_mm"), "{narrow}");
    assert!(number(&narrow, "left_share") < number(&wide, "left_share"), "{narrow}");
    // In the mould the groove is a ridge, and the tool leaves material at its foot, beside the groove of the picture.
    assert!((2.2..5.8).contains(&at(&mould)) && !(3.6..4.4).contains(&at(&mould)), "{mould}");
    let finding = wide["findings"].as_array().unwrap().iter().find(|one| one["at_mm"].is_array()).unwrap();
    assert_eq!(finding["code"], "advice");
    assert_eq!((finding["at_mm"][0].as_f64(), &finding["at_mm"][2]), (Some(at(&wide)), &0.0.into()));
    assert_eq!((&none["tool"], &none["findings"]), (&Json::Null, &serde_json::json!([])));
    // The check changes no body, and it is the same on any number of threads.
    assert_eq!(desk.read("out/wide.stl"), desk.read("out/none.stl"));
    desk.shibo("render a.ron -o again --threads 1").expect(0);
    assert_eq!(desk.read("out/wide_report.json"), desk.read("again/wide_report.json"));
}

#[test]
fn a_tool_is_checked_on_rolls_too() {
    let desk = Desk::new();
    let roll = |options: &str| format!("Roll(height: \"waves\", around: 4, report: true{options})");
    let outputs = format!("\"fits\": {}, \"wide\": {}", roll(", tool: 1"), roll(", tool: 40"));
    desk.write("a.ron", grooved("Both", &outputs));
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    assert!(said.contains("a tool of 40 mm with a ball end") && !said.contains("a tool of 1 mm"), "{said}");
    // The hollows of the waves lie at 2 and 6 mm.
    let wide = report(&desk, "out/wide_report.json");
    let at = wide["tool"]["left_at_mm"][0].as_f64().unwrap();
    assert!((at % 4.0 - 2.0).abs() < 0.1, "{wide}");
}

#[test]
fn a_tool_that_reaches_over_too_many_samples_is_refused() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 1, resolution: 256, tile: None), nodes: { \"h\": \"= 0.5 * x\" },
          outputs: { \"p\": Plate(height: \"h\", tool: 50) })",
    );
    let said = desk.shibo("render a.ron -o out").expect(1).stderr;
    assert!(said.contains("the tool of 50 mm reaches over ") && said.contains("at most 512"), "{said}");
    assert!(said.contains("a.ron:2:") && said.contains("leave `tool` out"), "{said}");
    assert!(!desk.path("out/p.stl").exists());
}

/// Errors of bodies stand at the field that they are about, with line and column.
#[test]
fn errors_of_bodies_have_the_place_of_their_field() {
    let refused = |output: &str, place: &str, code: &str| {
        let desk = Desk::new();
        let output = output.replace("; ", ",\n  ");
        desk.write("in.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        desk.write(
            "a.ron",
            format!(
                "(canvas: (size_mm: 8, resolution: 96, tile: Both),\nnodes: {{ \"h\": Perlin(size: 2), \"open\": LoadMesh(path: \"in.obj\") }},\n\
                 outputs: {{ \"p\":\n  {output} }})"
            ),
        );
        let said = desk.shibo("render a.ron -o out").expect(1).stderr;
        assert!(
            said.contains(&format!("error[{code}]")) && said.contains(&format!("[a.ron:{place}]")),
            "{output}: {said}"
        );
    };
    refused("Model(up: Z; mesh: \"open\")", "5:9", "open-mesh");
    refused("Plate(height: \"h\"; wall: 50; thickness: 3)", "6:14", "thin-wall");
    // A field that is not written has no place: the error stands at the height.
    refused("Plate(height: \"h\"; wall: 50)", "4:17", "thin-wall");
    refused("Plate(height: \"h\"; error: 0.0001; triangles: 100)", "6:14", "over-budget");
    refused("Plate(height: \"h\"; tool: 0; error: 0.0001; triangles: 100)", "7:14", "over-budget");
}

/// Warnings about the values of a picture stand in the report, also if the values come from a cache.
#[test]
fn warnings_about_values_are_repeated_from_the_cache_and_in_the_report() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 8, resolution: 300, tile: None),
          nodes: { \"bad\": \"= log(x - 4)\", \"soft\": Blur(input: \"bad\", radius: 0.5) },
          outputs: { \"picture\": File(from: \"soft\", range: (-4, 4)),
                     \"p\": Plate(height: \"= 0.1 * soft\", report: true) })",
    );
    let runs = [
        ("first", "render a.ron -o first"),
        ("again", "render a.ron -o again"),
        ("alone", "render a.ron -o alone --threads 1 --no-cache"),
        ("small", "render a.ron -o small --no-cache --memory 24"),
        ("picture", "render a.ron -o picture --output picture"),
    ];
    for (folder, line) in runs {
        let said = desk.shibo(line).expect(0).stderr;
        let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(words.matches("the formula is not finite at").count(), 1, "{folder}: {said}");
        assert!(words.contains("the formula is not finite at x = 0.013, y = 0.013 mm"), "{folder}: {said}");
        if folder == "picture" {
            continue;
        }
        let report = report(&desk, &format!("{folder}/p_report.json"));
        let finding = &report["findings"][0];
        assert!(finding["message"].as_str().unwrap().contains("not finite"), "{folder}: {report}");
        assert_eq!(finding["at_mm"].as_array().map(Vec::len), Some(3), "{folder}: {report}");
        assert_eq!(report["findings"].as_array().unwrap().len(), 1, "{folder}: {report}");
    }
    assert_eq!(desk.read("first/p_report.json"), desk.read("again/p_report.json"));
    assert_eq!(desk.read("first/p_report.json"), desk.read("small/p_report.json"));
}

/// The heights of the picture have 309 MiB, and the command may have addresses for 390 MiB, its own code included.
#[cfg(target_os = "linux")]
#[test]
fn the_plate_of_a_large_picture_needs_little_memory() {
    use crate::support::finish;
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 90, resolution: 9000, tile: None), nodes: { \"h\": \"= 0.1 * smoothstep(0, 90, x)\" },
          outputs: { \"p\": Plate(height: \"h\", error: 0.04) })",
    );
    let shibo = assert_cmd::cargo::cargo_bin!("shibo");
    let mut limited = std::process::Command::new("sh");
    limited.current_dir(desk.path("")).env("MALLOC_ARENA_MAX", "1").arg("-c");
    let line = "render a.ron -o out --threads 1 --memory 64 --no-cache";
    limited.arg(format!("ulimit -v 400000; exec '{}' {line}", shibo.display()));
    let ran = finish(limited).expect(0);
    assert!(ran.stdout.contains("out/p.stl") || ran.stderr.contains("out/p.stl"), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(desk.names("out"), ["p.stl"], "no temporary file stays behind");
}
