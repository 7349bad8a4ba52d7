//! The fingerprint of a crate's code, for build scripts. Results that outlive a process carry it, so that a cache never
//! mixes the results of two builds.
//!
//! The fingerprint depends on the tokens of the crate's sources and on the versions of the libraries under it. Comments,
//! layout and tests do not count: a reworded comment keeps every cache. The same sources give the same fingerprint on every
//! machine: files are taken by their path within `src`, in order; times, absolute paths and line ends do not count.
//! Libraries are those that `Cargo.lock` lists under the crate, with their checksums. Crates of the same workspace have
//! fingerprints of their own.
//!
//! A build script needs one line:
//!
//! ```no_run
//! fn main() -> std::io::Result<()> {
//!     shibo_fingerprint::emit()
//! }
//! ```
mod code;
mod libraries;

use crate::code::{Code, within};
use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Sets `CODE_FINGERPRINT` for the crate whose build script calls this: 32 hexadecimal digits, for `env!`.
///
/// # Errors
///
/// Fails if a file of the crate's sources cannot be read.
pub fn emit() -> io::Result<()> {
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let package = env::var("CARGO_PKG_NAME").unwrap_or_default();
    let sources = root.join("src");
    println!("cargo::rerun-if-changed={}", sources.display());
    // A crate outside of a workspace may lack a lock file; then its sources alone count.
    let lock = root.ancestors().map(|folder| folder.join("Cargo.lock")).find(|lock| lock.exists());
    let libraries = lock.as_deref().map_or(Ok(String::new()), fs::read_to_string)?;
    if let Some(lock) = lock {
        println!("cargo::rerun-if-changed={}", lock.display());
    }
    println!("cargo::rustc-env=CODE_FINGERPRINT={:032x}", fingerprint(&sources, &libraries, &package)?);
    Ok(())
}

/// The fingerprint of all files in the folder `sources`, and of the libraries under `package` in `lock`, the text of a
/// `Cargo.lock`.
///
/// # Errors
///
/// Fails if a file of `sources` cannot be read.
pub fn fingerprint(sources: &Path, lock: &str, package: &str) -> io::Result<u128> {
    let mut names = Vec::new();
    list(sources, "", &mut names)?;
    names.sort();
    let mut files = Vec::new();
    for name in names {
        let content = fs::read(sources.join(&name))?;
        files.push((Code::read(&name, content.into_iter().filter(|byte| *byte != b'\r').collect()), name));
    }
    let tests: Vec<String> = files.iter().flat_map(|(code, _)| code.test_modules.iter().cloned()).collect();
    let mut hash = Fnv::default();
    for (code, name) in files.iter().filter(|(_, name)| !tests.iter().any(|module| within(name, module))) {
        hash.part(name.as_bytes());
        hash.part(&code.content);
    }
    libraries::under(lock, package).iter().for_each(|library| hash.part(library.as_bytes()));
    Ok(hash.0)
}

/// Lists the paths of all files below a folder, with `/` on every system. Hidden files and backups of editors are left out.
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

/// The hash FNV-1a of 128 bits.
struct Fnv(u128);

impl Default for Fnv {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fnv {
    /// Takes a part and its length, so that no byte can move from one part to the next.
    fn part(&mut self, bytes: &[u8]) {
        for byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}

#[cfg(test)]
mod tests;
