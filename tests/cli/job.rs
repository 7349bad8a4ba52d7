//! Jobs for schedulers, run without a scheduler: the files of a job, and that its commands give the files of a single
//! run.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

/// A graph of two rows of tiles with a sub-graph, in a folder whose name must be quoted in shells.
fn desk() -> Desk {
    let desk = Desk::new();
    std::fs::create_dir_all(desk.path("it's here/lib")).unwrap();
    let inner = "(version: 1, nodes: { \"b\": Perlin(size: 5) }, outputs: { \"b\": \"b\" })";
    desk.write("it's here/lib/bumps.ron", inner);
    desk.write(
        "it's here/a b.ron",
        "(version: 1, canvas: (size_mm: 40, resolution: 500), imports: { \"bumps\": \"lib/bumps.ron\" },
          params: { \"r\": Number(default: 1, range: (0, 9)) },
          nodes: { \"u\": Use(graph: \"bumps\"), \"soft\": Blur(input: \"u.b\", radius: \"$r\") },
          outputs: { \"soft\": \"soft\" })",
    );
    desk
}

#[test]
fn a_bundle_holds_the_graph_and_no_absolute_path() {
    let desk = desk();
    let args = ["job", "it's here/a b.ron", "-o", "x.job", "--set", "r=2", "--parts", "2"];
    desk.run(args).expect(0);
    assert_eq!(desk.names("x.job"), ["asset_references.yaml", "graph", "parameter_values.yaml", "template.yaml"]);
    assert_eq!(desk.read("x.job/graph/lib/bumps.ron"), desk.read("it's here/lib/bumps.ron"));
    let all = ["template.yaml", "parameter_values.yaml", "asset_references.yaml"]
        .map(|name| String::from_utf8(desk.read(&format!("x.job/{name}"))).unwrap());
    for text in &all {
        assert!(!text.contains(&*desk.path("").to_string_lossy()), "{text}");
    }
    for wanted in [
        "jobtemplate-2023-09",
        "dataFlow: IN",
        "dataFlow: OUT",
        "\"graph/a b.ron\"",
        "\"r=2\"",
        "dependsOn: render",
        "range: \"1-2\"",
    ] {
        assert!(all[0].contains(wanted), "{wanted}: {}", all[0]);
    }
}

#[test]
fn a_script_for_slurm_makes_the_files_of_a_single_run() {
    let desk = desk();
    desk.run(["render", "it's here/a b.ron", "--set", "r=2", "-o", "whole", "--no-cache"]).expect(0);
    desk.run(["job", "it's here/a b.ron", "-o", "a $job", "--set", "r=2", "--parts", "2", "--for", "slurm"]).expect(0);
    let script = desk.path("a $job/submit.sh");
    assert!(script.metadata().unwrap().permissions().mode() & 0o111 == 0o111);
    // Runs the tasks one after another, as Slurm does.
    let out = desk.path("out put");
    let task = |task: &str, number: &str| {
        let mut command = Command::new("bash");
        command.arg(&script).args(["--task", task]).arg(desk.path("a $job")).arg(&out);
        command.env("SHIBO", assert_cmd::cargo::cargo_bin!("shibo")).env("SLURM_ARRAY_TASK_ID", number);
        command.output().unwrap()
    };
    assert!(task("prepare", "").status.success());
    assert!(task("render", "2").status.success());
    // Joining too early names the missing part; a later attempt succeeds.
    let early = task("join", "");
    assert!(!early.status.success() && String::from_utf8_lossy(&early.stderr).contains("part 1/2 is missing"));
    assert!(task("render", "1").status.success() && task("render", "2").status.success());
    let last = task("join", "");
    assert!(last.status.success(), "{}", String::from_utf8_lossy(&last.stderr));
    assert_eq!(desk.names("out put"), desk.names("whole"));
    assert!(desk.read("out put/soft.png") == desk.read("whole/soft.png"));
}

#[test]
fn jobs_that_cannot_run_are_refused() {
    let desk = desk();
    for (args, said) in [
        (vec!["job", "it's here/a b.ron", "-o", "x", "--parts", "3"], "2 rows of tiles"),
        (vec!["job", "shibo:calf", "-o", "x"], "shibo new"),
        (vec!["job", "it's here/a b.ron"], "--out"),
    ] {
        let ran = desk.run(args).expect(2);
        assert!(ran.stderr.contains(said) && !desk.path("x").exists(), "{}", ran.stderr);
    }
}

#[test]
fn splits_sweep_into_tasks() {
    let desk = desk();
    let graph = "it's here/a b.ron";
    desk.run(["render", graph, "--sweep", "r=1..4", "--sweep", "seed=1,2", "-o", "whole", "--no-cache"]).expect(0);
    let sweep = ["--sweep", "r=1..4", "--sweep", "seed=1,2"];
    // Tasks run one by one in any order, one of them twice; the last run lists all variants.
    for some in [Some("5-8"), Some("1"), Some("2-4"), Some("5-8"), None] {
        let mut args = vec!["render", graph, "-o", "many", "--no-cache"];
        args.extend(sweep);
        args.extend(some.iter().flat_map(|some| ["--variants", some]));
        let ran = desk.run(args).expect(0);
        assert!(some.is_some() || ran.stderr.contains("0 variants rendered, 8 were there already"), "{}", ran.stderr);
    }
    assert_eq!(desk.names("many"), desk.names("whole"));
    let files = |dir: &str| -> Vec<Vec<u8>> {
        desk.names(dir)
            .iter()
            .filter(|name| name.ends_with("png"))
            .map(|name| desk.read(&format!("{dir}/{name}")))
            .collect()
    };
    assert!(files("many") == files("whole"));
    let rows = |dir: &str| String::from_utf8(desk.read(&format!("{dir}/sweep.csv"))).unwrap().lines().count();
    assert_eq!(rows("many"), rows("whole"));
    for (some, said) in [("9", "has 8 variants"), ("0", "counted from 1"), ("3-2", "counted from 1")] {
        let ran = desk.run(["render", graph, "--sweep", "r=1..8", "--variants", some]).expect(2);
        assert!(ran.stderr.contains(said), "{}", ran.stderr);
    }
    // A job does the same, for both kinds of schedulers.
    desk.run(["job", graph, "-o", "x.job", "--set", "r=2", "--sweep", "seed=1..250"]).expect(0);
    let template = String::from_utf8(desk.read("x.job/template.yaml")).unwrap();
    for wanted in ["range: \"1-250\"", "defaultTaskCount: 3", "{{Task.Param.Variant}}", "name: list", "\"seed=1..250\""]
    {
        assert!(template.contains(wanted) && !template.contains("prepare"), "{wanted}: {template}");
    }
    desk.run(["job", graph, "-o", "a $job", "--for", "slurm", "--sweep", "r=1..4", "--sweep", "seed=1,2"]).expect(0);
    let out = desk.path("out put");
    std::fs::create_dir_all(&out).unwrap();
    let numbers: Vec<String> = (1..=8).map(|n| n.to_string()).collect();
    for (task, number) in numbers.iter().map(|n| ("render", n.as_str())).chain([("list", "")]) {
        let mut command = Command::new("bash");
        command.arg(desk.path("a $job/submit.sh")).args(["--task", task]).arg(desk.path("a $job")).arg(&out);
        command.env("SHIBO", assert_cmd::cargo::cargo_bin!("shibo")).env("SLURM_ARRAY_TASK_ID", number);
        let ran = command.output().unwrap();
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    }
    assert!(files("out put") == files("whole"));
    assert_eq!(rows("out put"), rows("whole"));
    let refused = desk.run(["job", graph, "-o", "y", "--set", "r=2", "--sweep", "r=1..4"]).expect(2);
    assert!(refused.stderr.contains("both set and swept"), "{}", refused.stderr);
}

/// All values of a field in a template of Shibo, at any depth, in order.
fn values<'t>(template: &'t str, field: &str) -> Vec<&'t str> {
    template.lines().filter_map(|line| line.trim().strip_prefix(field)).collect()
}

#[test]
fn keeps_braces_in_job_arguments() {
    let desk = desk();
    let graph = "(version: 1, canvas: (size_mm: 40, resolution: 500), params: { \"t\": Text(default: \"a\") },
                  nodes: { \"b\": Perlin(size: 5) }, outputs: { \"b\": \"b\" })";
    desk.write("{{Param.Shibo}}.ron", graph);
    let set = "t={{Param.Graph}} }} {";
    for sweep in [&["--parts", "2"][..], &["--sweep", "seed=1..3"]] {
        let args = [&["job", "{{Param.Shibo}}.ron", "-o", "x.job", "--set", set], sweep].concat();
        desk.run(args).expect(0);
        let template = String::from_utf8(desk.read("x.job/template.yaml")).unwrap();
        // The scheduler replaces variables in names and arguments, and knows only these.
        let known = [
            "Param.Graph",
            "Param.OutDir",
            "Param.Shibo",
            "Param.Text1",
            "Param.Text2",
            "Task.Param.Part",
            "Task.Param.Variant",
        ];
        let replaced = values(&template, "- \"")
            .into_iter()
            .chain(values(&template, "name: "))
            .chain(values(&template, "command: "));
        for word in replaced {
            let mut rest = word;
            while let Some((_, after)) = rest.split_once("{{") {
                let (name, more) = after.split_once("}}").unwrap_or_else(|| panic!("{word}"));
                assert!(known.contains(&name), "{word}");
                rest = more;
            }
            assert!(!rest.contains("}}"), "{word}");
        }
        let texts: Vec<_> = values(&template, "default: ").into_iter().filter(|text| text.contains("Param")).collect();
        assert!(texts.contains(&"\"t={{Param.Graph}} }} {\""), "{texts:?}");
        assert!(!values(&template, "- \"").iter().any(|word| word.starts_with("t=")), "{template}");
    }
}
