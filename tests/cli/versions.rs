//! `shibo diff`, `shibo merge` and `shibo git`, with real repositories.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH};
use std::process::{Command, Stdio};

/// A repository with the small graph, and the drivers.
pub(crate) struct Repository {
    pub(crate) desk: Desk,
}

impl Repository {
    pub(crate) fn new() -> Self {
        let repository = Self { desk: Desk::with_graph() };
        repository.git("init -q -b main .");
        repository.desk.run_in_home("git install").expect(0);
        repository.git("add a.ron .gitattributes");
        repository.git("commit -qm base");
        repository
    }

    /// Runs git; returns its exit code and its output.
    pub(crate) fn try_git(&self, line: &str) -> (Option<i32>, String) {
        let mut command = Command::new("git");
        command.args(["-c", "user.name=a", "-c", "user.email=a@b", "-c", "core.editor=true"]).args(line.split(' '));
        command.current_dir(self.desk.path("")).env("HOME", self.desk.path("")).env("GIT_CONFIG_NOSYSTEM", "1");
        let output = command.stdin(Stdio::null()).output().unwrap();
        let text = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8_lossy(&text).into_owned())
    }

    #[track_caller]
    pub(crate) fn git(&self, line: &str) -> String {
        let (code, text) = self.try_git(line);
        assert_eq!(code, Some(0), "git {line}: {text}");
        text
    }

    /// Changes the graph by a replacement and commits that on a new branch, which starts at `main`.
    pub(crate) fn branch(&self, name: &str, from: &str, to: &str) {
        self.git(&format!("checkout -qb {name} main"));
        self.change(from, to);
    }

    pub(crate) fn change(&self, from: &str, to: &str) {
        let text = self.text();
        assert!(text.contains(from), "{from}");
        self.desk.write("a.ron", text.replace(from, to));
        self.git("commit -qam change");
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8(self.desk.read("a.ron")).unwrap()
    }
}

impl Desk {
    /// Runs the command with this folder as the home of git.
    pub(crate) fn run_in_home(&self, line: &str) -> crate::support::Ran {
        let mut command = self.command(line.split_whitespace());
        command.env("HOME", self.path("")).env("GIT_CONFIG_NOSYSTEM", "1").env_remove("XDG_CONFIG_HOME");
        crate::support::finish(command)
    }
}

#[test]
fn diff_lists_changes_and_exit_codes() {
    let desk = Desk::with_graph();
    desk.write(
        "b.ron",
        GRAPH.replace("pitch: 4", "pitch: 4.5").replace("\"bumps\": Perlin", "// Bumps.\n\"bumps\": Perlin"),
    );
    let shown = desk.shibo("diff a.ron b.ron").expect(0);
    assert_eq!(shown.stdout, "b.ron\n  nodes.points.pitch  4 → 4.5\n");
    desk.shibo("diff a.ron b.ron --exit-code").expect(1);
    assert_eq!(desk.shibo("diff a.ron a.ron --exit-code").expect(0).stdout, "a.ron\n  no change\n");
    let all = desk.shibo("diff a.ron b.ron --all").expect(0).stdout;
    assert!(all.contains("nodes.bumps") && all.contains("new: // Bumps."), "{all}");
    let json = desk.shibo("diff a.ron b.ron --format json").expect(0).json();
    let change = &json["graphs"][0]["changes"][0];
    assert_eq!((change["path"][2].as_str(), change["change"].as_str()), (Some("pitch"), Some("changed")));
    assert_eq!(
        (change["before"].as_str(), change["line_after"].as_u64()),
        (Some("4"), change["line_before"].as_u64().map(|n| n + 1))
    );
    assert_eq!(json["errors"].as_array().map(Vec::len), Some(0));
    for line in ["diff a.ron", "diff a.ron none.ron", "diff a.ron HEAD:none.ron", "diff", "diff --git a.ron a.ron"] {
        desk.shibo(line).expect(2);
    }
}

#[test]
fn diff_reads_revisions() {
    let repository = Repository::new();
    repository.change("pitch: 4", "pitch: 5");
    let desk = &repository.desk;
    let shown = desk.run_in_home("diff HEAD~1:a.ron a.ron").expect(0).stdout;
    assert_eq!(shown, "a.ron\n  nodes.points.pitch  4 → 5\n");
    desk.write(
        "user.ron",
        "(imports: { \"a\": \"a.ron\" }, nodes: { \"a\": Use(graph: \"a\") }, outputs: { \"bumps\": \"a.bumps\" })",
    );
    repository.git("add user.ron");
    repository.git("commit -qm user");
    repository.change("pitch: 5", "pitch: 6");
    let shown = desk.run_in_home("diff --since HEAD~1").expect(0).stdout;
    assert_eq!(shown, "a.ron\n  nodes.points.pitch  5 → 6\n\nuser.ron\n  imports a.ron, which changed\n");
    let shown = desk.run_in_home("diff --since HEAD~2").expect(0).stdout;
    assert!(shown.contains("user.ron\n  graph  new, 1 line\n"), "{shown}");
    // Git calls it for files with the attribute.
    let shown = repository.git("diff HEAD~1");
    assert!(shown.contains("nodes.points.pitch  5 → 6"), "{shown}");
}

#[test]
fn merge_writes_result_and_exit_codes() {
    let desk = Desk::with_graph();
    desk.write("ours.ron", GRAPH.replace("pitch: 4", "pitch: 5"));
    desk.write("theirs.ron", GRAPH.replace("drag: 4", "drag: 3"));
    desk.shibo("merge a.ron ours.ron theirs.ron -o out.ron").expect(0);
    let merged = GRAPH.replace("pitch: 4", "pitch: 5").replace("drag: 4", "drag: 3");
    assert_eq!(desk.read("out.ron"), merged.as_bytes());
    assert_eq!(desk.read("ours.ron"), GRAPH.replace("pitch: 4", "pitch: 5").as_bytes());
    desk.write("theirs.ron", GRAPH.replace("pitch: 4", "pitch: 3"));
    let marked = desk.shibo("merge a.ron ours.ron theirs.ron").expect(1);
    assert!(marked.stderr.contains("ours.ron:9: nodes.points.pitch"), "{}", marked.stderr);
    let checked = desk.shibo("check ours.ron --format json").expect(1).json();
    let codes: Vec<_> =
        checked["errors"].as_array().unwrap().iter().map(|error| error["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["conflict"]);
    for line in
        ["merge a.ron ours.ron none.ron", "merge a.ron ours.ron", "merge a.ron ours.ron theirs.ron -o none/out.ron"]
    {
        desk.shibo(line).expect(129);
    }
}

#[test]
fn git_merges_rebases_and_picks() {
    let repository = Repository::new();
    // Neighbouring lines, which plain git cannot merge.
    repository.branch("ours", "pitch: 4", "pitch: 5");
    repository.branch(
        "theirs",
        "\"bumps\": Perlin(size: \"$size\"),",
        "\"bumps\": Perlin(size: \"$size\", octaves: 2),",
    );
    repository.git("checkout -q ours");
    repository.git("merge -q theirs -m both");
    let merged = repository.text();
    assert!(merged.contains("pitch: 5") && merged.contains("octaves: 2"), "{merged}");
    repository.git("checkout -qb rebased theirs");
    repository.git("reset -q --hard theirs");
    repository.git("cherry-pick ours~1");
    assert_eq!(repository.text(), merged);
    repository.git("checkout -qb moved main");
    repository.change("drag: 4", "drag: 3");
    repository.git("rebase -q ours");
    assert_eq!(repository.text(), merged.replace("drag: 4", "drag: 3"));
    repository.desk.write("a.ron", repository.text().replace("step: 0.1", "step: 0.2"));
    repository.git("stash -q");
    repository.change("steps: 20", "steps: 30");
    repository.git("stash pop -q");
    assert!(repository.text().contains("step: 0.2, steps: 30"), "{}", repository.text());
}

#[test]
fn git_stops_at_conflicts_in_worktree() {
    let repository = Repository::new();
    repository.branch("ours", "pitch: 4", "pitch: 5");
    repository.branch("theirs", "pitch: 4", "pitch: 3");
    repository.git("worktree add -q other ours");
    let (code, text) = repository.try_git("-C other merge -q theirs");
    assert_eq!(code, Some(1), "{text}");
    let marked = String::from_utf8(repository.desk.read("other/a.ron")).unwrap();
    assert!(
        marked.contains(
            "<<<<<<< ours\n      pitch: 5,\n||||||| base\n      pitch: 4,\n=======\n      pitch: 3,\n>>>>>>> theirs\n"
        ),
        "{marked}"
    );
    // A bare repository has no files; git merges trees there.
    repository.git("clone -q --bare . bare.git");
    repository.git("-C bare.git branch more main");
    let bare = repository.try_git("-C bare.git merge-tree --write-tree ours theirs");
    assert_eq!(bare.0, Some(1), "{}", bare.1);
}

#[test]
fn git_merges_locks_and_leaves_those_that_cannot_be_read() {
    let repository = Repository::new();
    let desk = &repository.desk;
    let lock = |bits: [&str; 3]| {
        let entry = |(name, bits): (&str, &str)| {
            format!(
                "    {name:?}: (\n        pins: 1, text: \"\",\n        pictures: {{\n            \"a\": (bits: {bits:?}),\n        }},\n    ),\n"
            )
        };
        format!("{{\n{}}}\n", ["a.ron", "b.ron", "c.ron"].into_iter().zip(bits).map(entry).collect::<String>())
    };
    let commit = |branch: &str, text: &str| {
        repository.git(&format!("checkout -q -B {branch} main"));
        desk.write("shibo.lock", text);
        repository.git("add shibo.lock");
        repository.git("commit -qm lock");
    };
    let read = || String::from_utf8(desk.read("shibo.lock")).unwrap();
    commit("main", &lock(["0", "0", "0"]));
    commit("theirs", &lock(["0", "2", "2"]));
    // A newer form, in lines that plain git would merge.
    let newer = lock(["0", "0", "2"]).replace("(bits: \"2\")", "(bits: \"2\", size: 128)");
    commit("newer", &newer);
    let ours = lock(["1", "0", "1"]);
    commit("ours", &ours);
    repository.git("merge -q theirs -m both");
    let merged = read();
    assert!(merged.contains("bits: \"1\"") && merged.contains("bits: \"2\"") && !merged.contains("c.ron"), "{merged}");
    for ours in [lock(["1", "0", "0"]), ours] {
        commit("ours", &ours);
        let (code, text) = repository.try_git("merge newer -m both");
        assert_eq!(code, Some(1), "{text}");
        assert!(
            text.contains("shibo.lock was not merged: their version is no lock that this program reads ("),
            "{text}"
        );
        assert!(text.contains("CONFLICT (content): Merge conflict in shibo.lock"), "{text}");
        assert_eq!(read(), ours, "the file is left as it is");
        assert!(repository.git("ls-files -u shibo.lock").contains("shibo.lock"), "git calls it unmerged");
        repository.git("merge --abort");
        assert_eq!(read(), ours);
    }
    // The same without git.
    desk.write("base", lock(["0", "0", "0"]));
    desk.write("newer", &newer);
    desk.write("ours", lock(["1", "0", "0"]));
    let ran = desk.shibo("merge base newer ours --path shibo.lock -o out").expect(1);
    assert!(ran.stderr.contains("shibo.lock was not merged: our version is no lock"), "{}", ran.stderr);
    assert!(!desk.path("out").exists() && desk.read("newer") == newer.as_bytes());
}

#[test]
fn git_settings_come_and_go() {
    let repository = Repository::new();
    let desk = &repository.desk;
    let attributes = desk.read(".gitattributes");
    desk.run_in_home("git install").expect(0);
    assert_eq!(desk.read(".gitattributes"), attributes);
    let printed = desk.run_in_home("git install --print").expect(0).stdout;
    assert!(
        printed.contains("*.ron diff=shibo merge=shibo")
            && printed.contains("merge --marker-size %L --path=%P -- %O %A %B"),
        "{printed}"
    );
    desk.write(".gitattributes", "*.png binary\n");
    desk.run_in_home("git install").expect(0);
    desk.run_in_home("git install --remove").expect(0);
    assert_eq!(desk.read(".gitattributes"), b"*.png binary\n");
    assert_eq!(repository.try_git("config merge.shibo.driver").0, Some(1));
    desk.run_in_home("git install --global").expect(0);
    let global = String::from_utf8(desk.read(".config/git/attributes")).unwrap();
    assert!(global.contains("shibo.lock merge=shibo"), "{global}");
    // Without a repository, and without git.
    let alone = Desk::with_graph();
    alone.run_in_home("git install").expect(2);
    let mut command = alone.command(["diff", "a.ron", "a.ron"]);
    command.env("PATH", "");
    crate::support::finish(command).expect(0);
    let mut command = alone.command(["diff", "HEAD:a.ron", "a.ron"]);
    command.env("PATH", "");
    assert!(crate::support::finish(command).expect(1).stderr.contains("cannot run `git`"));
}

#[test]
fn compare_prints_words_and_numbers() {
    let desk = Desk::with_graph();
    desk.write("b.ron", GRAPH.replace("default: 5", "default: 6.5"));
    for graph in ["a", "b"] {
        desk.shibo(&format!("render {graph}.ron -o {graph} --output bumps --quiet")).expect(0);
    }
    let same = desk.shibo("compare a/bumps.png a/bumps.png").expect(0).stdout;
    assert!(same.starts_with("distance 0.00") && same.ends_with("  no difference that one would see\n"), "{same}");
    let json = desk.shibo("compare a/bumps.png b/bumps.png --format json").expect(0).json();
    assert!(json["distance"].as_f64().unwrap() > 0.0 && json["floor"].is_null(), "{json}");
    assert!(json["words"].is_array() && json["color"]["value"].is_array(), "{json}");
    desk.shibo("compare a/bumps.png b/bumps.png --max-distance 0").expect(1);
    assert!(desk.shibo("compare a/bumps.png none.png").expect(1).stderr.contains("none.png"));
}

#[test]
fn diff_compares_pictures() {
    let desk = Desk::new();
    let graph = |amount: &str, more: &str| {
        format!(
            "(canvas: (size_mm: 20, resolution: 64), nodes: {{ \"a\": Perlin(size: 5), \"h\": \"= a * {amount}\", \"m\": Material(height: \"h\", \
             base_color: \"= (a, 0.2, 0.1)\") }}, outputs: {{ \"a\": \"a\", \"m\": \"m\"{more} }})"
        )
    };
    desk.write("old.ron", graph("0.5", ""));
    desk.write("new.ron", graph("0.75", ", \"h\": \"h\""));
    let json = desk.shibo("diff old.ron new.ron --pictures 64 --format json").expect(0).json();
    let pictures = json["graphs"][0]["pictures"].as_array().unwrap();
    let of = |name: &str| pictures.iter().find(|one| one["name"] == name).unwrap().clone();
    assert_eq!(of("a")["change"], "same");
    assert_eq!(of("m.base_color")["change"], "same", "only the height differs");
    assert_eq!(of("h")["change"], "added");
    let height = of("m.height");
    assert_eq!((&height["change"], &height["unit"]), (&"changed".into(), &"mm".into()));
    // The figures are those of the pictures.
    for name in ["old", "new"] {
        desk.shibo(&format!("render {name}.ron --resolution 64 --output m.height --format exr -o {name} --no-cache"))
            .expect(0);
    }
    let samples = |name: &str| {
        let folder = desk.path(name);
        let file = std::fs::read_dir(folder).unwrap().next().unwrap().unwrap().path();
        shibo_picture::read(&file, &shibo_picture::ReadLimits::default()).unwrap().planes
    };
    let apart: Vec<f64> = samples("old").iter().zip(samples("new")).map(|(a, b)| f64::from((a - b).abs())).collect();
    let (mean, max) = (apart.iter().sum::<f64>() / apart.len() as f64, apart.iter().copied().fold(0.0, f64::max));
    let close = |found: &serde_json::Value, wanted: f64| (found.as_f64().unwrap() - wanted).abs() < 1e-3 * wanted;
    assert!(close(&height["mean"], mean) && close(&height["max"], max), "{height} {mean} {max}");
    let ran = desk.shibo("diff old.ron new.ron --sheet s.png --output m").expect(0);
    assert!(ran.stdout.contains("pictures at 128 pixels: 1 of 2 changes\n  m.height  mean "), "{}", ran.stdout);
    assert!(desk.read("s.png").starts_with(b"\x89PNG"));
    assert!(
        desk.shibo("diff old.ron new.ron --output n").expect(1).stderr.contains("neither version has the output `n`")
    );
    assert!(desk.shibo("diff old.ron new.ron --pictures big").expect(2).stderr.contains("a number of pixels"));
    assert!(!desk.shibo("diff old.ron new.ron").expect(0).stdout.contains("pictures"));
}
