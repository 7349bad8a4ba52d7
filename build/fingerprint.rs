//! Build script of the crates whose code computes results: sets `CODE_FINGERPRINT`, which changes only with their
//! sources and with the versions of the libraries they use. Results that outlive a process carry the fingerprint, so
//! that a cache never mixes the results of two builds.
//!
//! The same sources give the same fingerprint on every machine: files are hashed in the order of their paths within
//! `src`; times, absolute paths and line endings do not count. The libraries are those that `Cargo.lock` lists under
//! the crate, with their checksums; each crate of this workspace has a fingerprint of its own.
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let package = env::var("CARGO_PKG_NAME").unwrap_or_default();
    let (sources, lock) = (root.join("src"), root.join("../Cargo.lock"));
    println!("cargo::rerun-if-changed={}", sources.display());
    // Outside of the workspace there is no `Cargo.lock`.
    let libraries = fs::read_to_string(&lock).unwrap_or_default();
    if lock.exists() {
        println!("cargo::rerun-if-changed={}", lock.display());
    }
    println!("cargo::rustc-env=CODE_FINGERPRINT={:032x}", fingerprint(&sources, &libraries, &package)?);
    Ok(())
}

/// Fingerprint of all files in a folder and of the dependencies of `package` in the text of a `Cargo.lock`.
pub(crate) fn fingerprint(sources: &Path, lock: &str, package: &str) -> io::Result<u128> {
    let mut files = Vec::new();
    list(sources, "", &mut files)?;
    files.sort();
    let mut hash = Fnv::default();
    for name in files {
        hash.part(name.as_bytes());
        let content = fs::read(sources.join(&name))?;
        hash.part(&content.into_iter().filter(|byte| *byte != b'\r').collect::<Vec<u8>>());
    }
    libraries(lock, package).iter().for_each(|library| hash.part(library.as_bytes()));
    Ok(hash.0)
}

/// The paths of all files below a folder, with `/` on every system; hidden and backup files are left out.
fn list(folder: &Path, prefix: &str, files: &mut Vec<String>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            list(&entry.path(), &format!("{name}/"), files)?;
        } else if !entry.file_name().to_string_lossy().starts_with('.') && !name.ends_with('~') {
            files.push(name);
        }
    }
    Ok(())
}

/// Name, version and checksum of all direct and indirect dependencies of `package`.
fn libraries(lock: &str, package: &str) -> BTreeSet<String> {
    let value = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "))?;
        Some(line.trim_matches('"').to_owned())
    };
    let blocks: Vec<(String, String, &str)> = lock
        .split("[[package]]")
        .filter_map(|block| Some((value(block, "name")?, value(block, "version")?, block)))
        .collect();
    let mut found = BTreeSet::new();
    let mut stack = vec![package.to_owned()];
    let mut seen = BTreeSet::new();
    while let Some(wanted) = stack.pop() {
        // A dependency is written `name`, or `name version` if there are several versions.
        let mut words = wanted.split(' ');
        let (name, version) = (words.next().unwrap_or_default(), words.next());
        for (_, at, block) in blocks.iter().filter(|(n, v, _)| n == name && version.is_none_or(|version| version == v))
        {
            if !seen.insert(format!("{name} {at}")) {
                continue;
            }
            if name != package {
                found.insert(format!("{name} {at} {}", value(block, "checksum").unwrap_or_default()));
            }
            let below = block.split_once("dependencies = [").and_then(|(_, rest)| rest.split_once(']'));
            let names = below.map_or("", |(list, _)| list).split('"').skip(1).step_by(2);
            stack.extend(names.map(str::to_owned));
        }
    }
    found
}

/// The hash FNV-1a with 128 bits, so that the build script needs no library.
struct Fnv(u128);

impl Default for Fnv {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fnv {
    /// Hashes a part with its length, so that parts with shifted bytes differ.
    fn part(&mut self, bytes: &[u8]) {
        for byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}
