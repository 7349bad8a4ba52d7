//! Git with the drivers of Shibo: odd names of files, texts in other encodings, and conflicts in all commands that merge.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH};
use crate::versions::Repository;

/// The small graph with a comment in Latin-1.
fn latin(changes: &[(&str, &str)]) -> Vec<u8> {
    let graph = changes.iter().fold(GRAPH.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    [b"// caf\xe9\n".as_slice(), graph.as_bytes()].concat()
}

/// A repository whose `a.ron` is in Latin-1, on the branch `main`.
fn in_latin() -> Repository {
    let repository = Repository::new();
    repository.desk.write("a.ron", latin(&[]));
    repository.git("commit -qam latin");
    repository
}

/// Writes a file on a new branch from `main`, and commits it.
fn branch(repository: &Repository, name: &str, content: &[u8]) {
    repository.git(&format!("checkout -qb {name} main"));
    repository.desk.write("a.ron", content);
    repository.git("commit -qam change");
}

fn contains(bytes: &[u8], part: &str) -> bool {
    bytes.windows(part.len()).any(|window| window == part.as_bytes())
}

#[test]
fn takes_names_that_begin_with_a_dash() {
    let repository = Repository::new();
    let desk = &repository.desk;
    desk.write("-a.ron", GRAPH);
    repository.git("add -- -a.ron");
    repository.git("commit -qm dash");
    for (branch, from, to) in [("ours", "pitch: 4", "pitch: 5"), ("theirs", "drag: 4", "drag: 3")] {
        repository.git(&format!("checkout -qb {branch} main"));
        desk.write("-a.ron", GRAPH.replace(from, to));
        let shown = repository.git("diff");
        assert!(shown.contains("-a.ron\n  nodes."), "{shown}");
        repository.git("commit -qam change");
    }
    // Plain git finds a conflict in neighbouring lines.
    repository.git("checkout -qb near main");
    desk.write(
        "-a.ron",
        GRAPH.replace("\"bumps\": Perlin(size: \"$size\")", "\"bumps\": Perlin(size: \"$size\", octaves: 2)"),
    );
    repository.git("commit -qam near");
    repository.git("merge -q ours -m both");
    repository.git("merge -q theirs -m three");
    let merged = String::from_utf8(desk.read("-a.ron")).unwrap();
    assert!(["pitch: 5", "drag: 3", "octaves: 2"].iter().all(|part| merged.contains(part)), "{merged}");
    let shown = desk.run_in_home("diff --since main").expect(0).stdout;
    assert!(shown.contains("-a.ron\n") && shown.contains("nodes.points.pitch   4 → 5"), "{shown}");
    let shown = desk.run_in_home("diff main:-a.ron ./-a.ron").expect(0).stdout;
    assert!(shown.contains("nodes.points.pitch   4 → 5"), "{shown}");
    assert!(repository.git("log -p --ext-diff -- -a.ron").contains("nodes.points.pitch  4 → 5"));
}

#[test]
fn merges_lines_of_other_encodings() {
    let repository = in_latin();
    branch(&repository, "ours", &latin(&[("pitch: 4", "pitch: 5")]));
    branch(&repository, "theirs", &latin(&[("\"mask\": \"strokes.mask\"", "\"cover\": \"strokes.mask\"")]));
    branch(&repository, "other", &latin(&[("pitch: 4", "pitch: 3")]));
    repository.git("checkout -q ours");
    let said = repository.git("merge -q theirs -m both");
    assert!(said.contains("git merged the lines of a.ron") && said.contains("is not UTF-8 text"), "{said}");
    let merged = repository.desk.read("a.ron");
    assert_eq!(
        merged,
        latin(&[("pitch: 4", "pitch: 5"), ("\"mask\": \"strokes.mask\"", "\"cover\": \"strokes.mask\"")])
    );
    let (code, said) = repository.try_git("merge -q other -m three");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("1 conflict in a.ron"), "{said}");
    let marked = repository.desk.read("a.ron");
    let parts = ["<<<<<<< ours\n", "PoissonPoints(pitch: 5)", "||||||| base\n", "=======\n", ">>>>>>> theirs\n"];
    assert!(parts.iter().all(|part| contains(&marked, part)) && marked.starts_with(b"// caf\xe9\n"));
    // One version is enough.
    repository.git("merge --abort");
    branch(&repository, "mended", GRAPH.as_bytes());
    let said = repository.git("merge -q ours -m four");
    assert!(said.contains("is not UTF-8 text"), "{said}");
}

#[test]
fn merge_of_other_encodings_has_exit_codes() {
    let desk = Desk::new();
    for (name, changes) in [
        ("base.ron", &[][..]),
        ("ours.ron", &[("pitch: 4", "pitch: 5")][..]),
        ("theirs.ron", &[("step: 0.1", "step: 0.2")][..]),
        ("other.ron", &[("pitch: 4", "pitch: 3")][..]),
    ] {
        desk.write(name, latin(changes));
    }
    let ran = desk.shibo("merge base.ron ours.ron theirs.ron -o out.ron").expect(0);
    assert!(ran.stderr.contains("warning: git merged the lines of out.ron, because the base"), "{}", ran.stderr);
    assert_eq!(desk.read("out.ron"), latin(&[("pitch: 4", "pitch: 5"), ("step: 0.1", "step: 0.2")]));
    assert_eq!(desk.read("ours.ron"), latin(&[("pitch: 4", "pitch: 5")]));
    desk.shibo("merge base.ron ours.ron other.ron --marker-size 9").expect(1);
    assert!(contains(&desk.read("ours.ron"), "<<<<<<<<< ours\n"));
    // Git does not merge files that are no text.
    desk.write("theirs.ron", b"\xff\0\xff");
    desk.shibo("merge base.ron other.ron theirs.ron").expect(129);
    assert_eq!(desk.read("other.ron"), latin(&[("pitch: 4", "pitch: 3")]));
}

#[test]
fn shows_changes_in_other_encodings() {
    let repository = in_latin();
    let desk = &repository.desk;
    desk.write("a.ron", latin(&[("pitch: 4", "pitch: 5")]));
    repository.git("commit -qam pitch");
    for line in ["diff HEAD~1", "log -p --ext-diff", "show --ext-diff", "log -p", "diff --no-ext-diff HEAD~1"] {
        let shown = repository.git(line);
        let expected = if line.contains("--no-ext-diff") || line == "log -p" { "pitch: 5" } else { "pitch  4 → 5" };
        assert!(shown.contains(expected), "{line}: {shown}");
        assert!(expected == "pitch: 5" || shown.contains("is not UTF-8 text"), "{line}: {shown}");
    }
    // A file that is no text stops no list either.
    desk.write("a.ron", b"\xff\0\xff");
    let shown = repository.git("diff HEAD");
    assert!(shown.contains("\n  the version after is no text\n"), "{shown}");
    // The commands for people tell the file and the reason.
    desk.write("a.ron", latin(&[]));
    desk.write("b.ron", GRAPH);
    for line in ["diff b.ron a.ron", "diff HEAD:a.ron b.ron"] {
        let ran = desk.run_in_home(line).expect(2);
        assert!(ran.stderr.contains("a.ron` is not UTF-8 text"), "{}", ran.stderr);
    }
    let ran = desk.run_in_home("diff --since HEAD").expect(1);
    assert!(ran.stderr.contains("is not UTF-8 text"), "{}", ran.stderr);
}

#[test]
fn shows_files_with_conflicts() {
    let repository = Repository::new();
    repository.branch("ours", "pitch: 4", "pitch: 5");
    repository.branch("theirs", "pitch: 4", "pitch: 3");
    assert_eq!(repository.try_git("merge -q ours").0, Some(1));
    // Git gives the name alone for such a file.
    let shown = repository.git("diff --ours");
    assert!(shown.contains("a.ron\n  a merge left conflicts in this file"), "{shown}");
    repository.git("diff");
    repository.git("diff HEAD");
}

#[test]
fn attributes_of_others_stay() {
    let repository = Repository::new();
    let desk = &repository.desk;
    let own = "*.ron diff=shibo merge=shibo\nshibo.lock merge=shibo\n";
    let cases: [(&[u8], &[u8]); 2] = [
        (b"*.txt note=\xe9\n", b"*.txt note=\xe9\n"),
        (b"*.png binary\r\n*.ron diff=shibo merge=shibo\r\n*.txt text", b"*.png binary\r\n*.txt text\n"),
    ];
    for (before, after) in cases {
        desk.write(".gitattributes", before);
        desk.run_in_home("git install").expect(0);
        assert_eq!(desk.read(".gitattributes"), [after, own.as_bytes()].concat());
        desk.run_in_home("git install --remove").expect(0);
        assert_eq!(desk.read(".gitattributes"), after);
    }
}

/// The small graph with conflict marks around a field, and the same graph with our version.
fn resolved(repository: &Repository) -> String {
    let text = repository.text();
    assert!(text.contains("<<<<<<< ours\n") && text.contains(">>>>>>> theirs\n"), "{text}");
    let base = text.find("||||||| base\n").unwrap();
    let end = text.find(">>>>>>> theirs\n").unwrap() + ">>>>>>> theirs\n".len();
    (text[..base].to_owned() + &text[end..]).replace("<<<<<<< ours\n", "")
}

#[test]
fn rebase_cherry_pick_and_stash_stop_at_conflicts() {
    let repository = Repository::new();
    repository.branch("ours", "pitch: 4", "pitch: 5");
    repository.branch("theirs", "pitch: 4", "pitch: 3");
    let go_on = |line: &str| {
        repository.desk.write("a.ron", resolved(&repository));
        repository.git("add a.ron");
        repository.git(line);
        let text = repository.text();
        repository.desk.shibo("check a.ron").expect(0);
        text
    };
    repository.git("checkout -qb rebased theirs");
    assert_eq!(repository.try_git("rebase -q ours").0, Some(1));
    // The commits of a rebase are put onto the other branch, which is ours.
    assert!(repository.text().contains("<<<<<<< ours\n      pitch: 5,\n"), "{}", repository.text());
    repository.desk.write("a.ron", resolved(&repository).replace("pitch: 5", "pitch: 6"));
    repository.git("add a.ron");
    repository.git("rebase --continue");
    assert!(repository.text().contains("pitch: 6"));
    repository.git("checkout -qb picked theirs");
    assert_eq!(repository.try_git("cherry-pick ours").0, Some(1));
    assert!(go_on("commit -qam picked").contains("pitch: 3"));
    repository.git("checkout -qb stashed main");
    repository.desk.write("a.ron", repository.text().replace("pitch: 4", "pitch: 7"));
    repository.git("stash -q");
    repository.change("pitch: 4", "pitch: 8");
    assert_eq!(repository.try_git("stash pop -q").0, Some(1));
    assert!(go_on("commit -qam popped").contains("pitch: 8"));
}

#[test]
fn locks_merge_in_git() {
    let repository = Repository::new();
    let desk = &repository.desk;
    let lock = |entries: &[(&str, u32)]| {
        let entry = |(name, pins): &(&str, u32)| format!("  {name:?}: (pins: {pins}, text: \"\", pictures: {{}}),\n");
        format!("{{\n{}}}\n", entries.iter().map(entry).collect::<String>())
    };
    desk.write("shibo.lock", lock(&[("a.ron", 1), ("b.ron", 1)]));
    repository.git("add shibo.lock");
    repository.git("commit -qm lock");
    for (branch, entries) in
        [("ours", &[("a.ron", 2), ("b.ron", 2)][..]), ("theirs", &[("a.ron", 1), ("b.ron", 3)][..])]
    {
        repository.git(&format!("checkout -qb {branch} main"));
        desk.write("shibo.lock", lock(entries));
        repository.git("commit -qam lock");
    }
    repository.git("merge -q ours -m both");
    let merged = String::from_utf8(desk.read("shibo.lock")).unwrap();
    // The entry that both sides changed is gone.
    assert!(merged.contains("pins: 2,") && !merged.contains("b.ron") && !merged.contains("<<<<"), "{merged}");
}

#[test]
fn serves_bare_repositories_and_worktrees() {
    let repository = Repository::new();
    let desk = &repository.desk;
    repository.change("pitch: 4", "pitch: 5");
    repository.git("clone -q --bare . bare.git");
    repository.git("worktree add -q other main~1");
    let run = |folder: &str, line: &str, with_git: bool| {
        let mut command = desk.command(line.split_whitespace());
        command.current_dir(desk.path(folder)).env("HOME", desk.path("")).env("GIT_CONFIG_NOSYSTEM", "1");
        command.env_remove("XDG_CONFIG_HOME");
        if !with_git {
            command.env("PATH", "");
        }
        crate::support::finish(command)
    };
    // A bare repository has no files, so its attributes are in its own folder.
    run("bare.git", "git install", true).expect(0);
    let attributes = String::from_utf8(desk.read("bare.git/info/attributes")).unwrap();
    assert!(attributes.contains("*.ron diff=shibo merge=shibo\n"), "{attributes}");
    let shown = run("bare.git", "diff HEAD~1:a.ron HEAD:a.ron", true).expect(0).stdout;
    assert_eq!(shown, "HEAD:a.ron\n  nodes.points.pitch  4 → 5\n");
    let ran = run("bare.git", "diff --since HEAD~1", true).expect(2);
    assert!(ran.stderr.contains("with the files of a repository, and this one has none"), "{}", ran.stderr);
    run("bare.git", "git install --remove", true).expect(0);
    assert!(!desk.path("bare.git/info/attributes").exists());
    // A worktree.
    for line in ["diff --since main", "diff main:a.ron a.ron"] {
        assert_eq!(run("other", line, true).expect(0).stdout, "a.ron\n  nodes.points.pitch  5 → 4\n", "{line}");
    }
    run("other", "pin a.ron", true).expect(0);
    repository.git("-C other add -A");
    repository.git("-C other commit -qm pin");
    let pinned = String::from_utf8(desk.read("other/a.ron")).unwrap();
    desk.write("other/a.ron", pinned.replace("pitch: 4", "pitch: 3"));
    let ran = run("other", "verify a.ron", true).expect(1);
    assert!(ran.stdout.contains("  nodes.points.pitch  4 → 3\n"), "{}", ran.stdout);
    // Without git only the fact of an edit is known.
    let ran = run("other", "verify a.ron", false).expect(1);
    assert!(ran.stdout.contains("  the text was edited since the graph was pinned\n"), "{}", ran.stdout);
    for line in ["git install", "diff --since main"] {
        let ran = run("other", line, false).expect(1);
        assert!(ran.stderr.contains("cannot run `git`"), "{line}: {}", ran.stderr);
    }
}
