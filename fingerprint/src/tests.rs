#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::fingerprint;
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
fn ignores_times_order_and_line_ends() {
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
fn tells_different_sources_apart() {
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
fn counts_only_libraries_under_the_crate() {
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

fn of(files: &[(&str, &str)]) -> u128 {
    sources(tempfile::tempdir().unwrap().path(), files)
}

#[test]
fn ignores_comments_layout_and_tests() {
    let plain = of(&[("lib.rs", "pub fn f(x: f32) -> f32 { x * 2.0 }\nmod deep;"), ("deep.rs", "const A: u8 = 1;")]);
    let told = "//! Module.\n/// Twice.\npub fn f(x: f32) -> f32 {\n    // A reason.\n    x * /* why */ 2.0\n}\nmod deep;\n
        #[cfg(test)]\n#[path = \"lib_tests.rs\"]\nmod tests;\n#[cfg(test)]\nfn helper() {}\n#[cfg(test)]\nuse std::{fs, io};";
    let deep = "const A: u8 = 1;\n#[cfg(test)]\nmod stand_in;\n#[cfg(test)]\nmod tests { fn t() {} }";
    let files = [("lib.rs", told), ("deep.rs", deep), ("lib_tests.rs", "fn t() {}"), ("deep/stand_in.rs", "fn s() {}")];
    assert_eq!(of(&files), plain);
}

#[test]
fn counts_every_other_token() {
    let texts = [
        "fn f() { a == b }",
        "fn f() { a = = b }",
        "fn f() { \"a // b\" }",
        "fn f() { \"a\" }",
        "fn f() { 'a' }",
        "#[inline] fn f() { a == b }",
        "struct S { #[cfg(test)] a: u8, b: u8 }",
        "struct S { #[cfg(test)] a: u8, b: u16 }",
        "#[cfg(not(test))] fn f() {}",
        "#[cfg(not(test))] fn f() { g() }",
        "#[cfg(test)] fn t() {} fn f() {}",
        "#[cfg(test)] const T: S = S { a: 1 }; fn g() {}",
        "not Rust: \"",
        "not Rust: '\"",
    ];
    let all: std::collections::BTreeSet<u128> = texts.iter().map(|text| of(&[("lib.rs", text)])).collect();
    assert_eq!(all.len(), texts.len());
}
