//! Code fingerprint: the same for the same sources in any folder, different for other sources or libraries.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

#[allow(dead_code, reason = "only the build runs its `main`")]
use crate::script::fingerprint;
use std::fs;
use std::path::Path;

const LOCK: &str = r#"
version = 4

[[package]]
name = "numbers"
version = "0.1.0"
dependencies = [
 "fast",
 "glue 2.0.0",
]

[[package]]
name = "fast"
version = "1.2.3"
checksum = "aa"

[[package]]
name = "glue"
version = "1.0.0"
checksum = "bb"

[[package]]
name = "glue"
version = "2.0.0"
checksum = "cc"
dependencies = [
 "deep",
 "numbers",
]

[[package]]
name = "deep"
version = "0.3.0"
checksum = "dd"

[[package]]
name = "page"
version = "9.0.0"
checksum = "ee"
"#;

fn sources(dir: &Path, files: &[(&str, &str)]) -> u128 {
    for (name, text) in files {
        fs::create_dir_all(dir.join(name).parent().unwrap()).unwrap();
        fs::write(dir.join(name), text).unwrap();
    }
    fingerprint(dir, LOCK, "numbers").unwrap()
}

#[test]
fn same_sources_have_the_same_fingerprint_in_any_folder() {
    let dirs = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let first = sources(dirs[0].path(), &[("lib.rs", "a\nb\n"), ("kernel/mod.rs", "c"), ("kernel.rs", "d")]);
    let second = sources(dirs[1].path(), &[("kernel.rs", "d"), ("kernel/mod.rs", "c"), ("lib.rs", "a\nb\n")]);
    let long_ago = std::time::SystemTime::UNIX_EPOCH;
    fs::File::options().write(true).open(dirs[1].path().join("lib.rs")).unwrap().set_modified(long_ago).unwrap();
    assert_eq!(fingerprint(dirs[1].path(), LOCK, "numbers").unwrap(), first);
    let other_system = [(".lib.rs.swp", "x"), ("lib.rs~", "x"), ("lib.rs", "a\r\nb\r\n"), ("kernel/mod.rs", "c")];
    assert_ne!(sources(dirs[2].path(), &other_system), first, "a file is missing");
    assert_eq!(sources(dirs[2].path(), &[("kernel.rs", "d")]), first);
    assert_eq!(first, second);
}

#[test]
fn other_sources_have_another_fingerprint() {
    let files = [
        &[("lib.rs", "a"), ("x.rs", "b")][..],
        &[("lib.rs", "a"), ("x.rs", "c")],
        &[("lib.rs", "ab"), ("x.rs", "")],
        &[("lib.rs", "a"), ("y.rs", "b")],
        &[("lib.rs", "a"), ("x/x.rs", "b")],
        &[("lib.rs", "a")],
    ];
    let all: std::collections::BTreeSet<u128> =
        files.iter().map(|files| sources(tempfile::tempdir().unwrap().path(), files)).collect();
    assert_eq!(all.len(), files.len());
}

#[test]
fn counts_only_dependencies_of_a_crate() {
    let dir = tempfile::tempdir().unwrap();
    let of = |lock: &str| fingerprint(dir.path(), lock, "numbers").unwrap();
    for (from, to) in [("1.2.3", "1.2.4"), ("\"aa\"", "\"ab\""), ("\"cc\"", "\"ab\""), ("0.3.0", "0.4.0")] {
        assert_ne!(of(&LOCK.replace(from, to)), of(LOCK), "{from}");
    }
    for (from, to) in [("9.0.0", "9.0.1"), ("\"bb\"", "\"ab\""), ("name = \"page\"", "name = \"pages\"")] {
        assert_eq!(of(&LOCK.replace(from, to)), of(LOCK), "{from}");
    }
    assert_ne!(of(""), of(LOCK));
}
