//! Build script of the crates whose code makes results: gives them `CODE_FINGERPRINT`, which changes with their sources and
//! with the versions of the libraries under them, and with nothing else. Results that outlive a process carry it, so that a
//! cache never mixes what two builds made.
//!
//! The same sources give the same fingerprint on every machine: files are taken by their path within `src`, in order, and
//! neither times nor absolute paths nor the ends of lines count. Libraries are those that `Cargo.lock` lists under the crate,
//! with their checksums; a crate of this workspace has a fingerprint of its own.
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let package = env::var("CARGO_PKG_NAME").unwrap_or_default();
    let (sources, lock) = (root.join("src"), root.join("../Cargo.lock"));
    println!("cargo::rerun-if-changed={}", sources.display());
    // Outside of its workspace a crate has no list of its own.
    let libraries = fs::read_to_string(&lock).unwrap_or_default();
    if lock.exists() {
        println!("cargo::rerun-if-changed={}", lock.display());
    }
    println!("cargo::rustc-env=CODE_FINGERPRINT={:032x}", fingerprint(&sources, &libraries, &package)?);
    Ok(())
}

/// Of all files in a folder, and of what stands under `package` in the text of a `Cargo.lock`.
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

/// The paths of all files below a folder, with `/` on every system; not what editors leave beside them.
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

/// Name, version and checksum of all packages that one stands on, itself left out.
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
        // A dependency is written `name`, or `name version` where there are several of that name.
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

/// The hash FNV-1a of 128 bits. Build scripts are best without libraries of their own.
struct Fnv(u128);

impl Default for Fnv {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fnv {
    /// Takes a part and its length, so that no byte can move from one to the next.
    fn part(&mut self, bytes: &[u8]) {
        for byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}
