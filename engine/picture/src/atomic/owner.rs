//! The owner of a temporary file: host, boot and process, encoded in the name of the file.
use shibo_value::clock::time_of_day;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use std::time::UNIX_EPOCH;

/// Separates the name of the target from the owner.
const MARK: &str = ".shibo-";
/// Maximum length in bytes of a target's name within a temporary name: file names have at most 255 bytes.
const MOST: usize = 120;

/// A process that writes files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Owner {
    /// The machine, or the container on it. Each has process ids of its own.
    host: u32,
    /// The boot in which the process id is valid; 0 if the system does not report it.
    boot: u32,
    process: u32,
    /// Start time of the process, because ids are reused. In the system's own unit.
    start: u64,
}

impl Owner {
    /// This process.
    pub(super) fn this() -> Self {
        static THIS: OnceLock<Owner> = OnceLock::new();
        *THIS.get_or_init(|| {
            let process = std::process::id();
            // If the system does not report the start of a process, the current time replaces it: it only makes names
            // unique.
            let now = || time_of_day().duration_since(UNIX_EPOCH).map_or(1, |time| time.as_secs());
            Self { host: host(), boot: boot(), process, start: started(process).unwrap_or_else(now) }
        })
    }

    /// Name of temporary file number `counter` for this target.
    pub(super) fn name(self, target: &str, counter: u32) -> String {
        let short = (0..=target.len().min(MOST)).rev().find(|end| target.is_char_boundary(*end)).unwrap_or(0);
        let Self { host, boot, process, start } = self;
        format!(".{}{MARK}{host:08x}-{boot:08x}-{process}-{start}-{counter}.tmp", &target[..short])
    }

    /// Reads the owner from the name of a temporary file; `None` for any other name.
    pub(super) fn of(name: &str) -> Option<Self> {
        let (target, owner) = name.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once(MARK)?;
        let parts: Vec<&str> = owner.split('-').collect();
        let [host, boot, process, start, counter] = parts[..] else { return None };
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        let hex = |text: &str| {
            let exact = text.len() == 8 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
            exact.then(|| u32::from_str_radix(text, 16).ok())?
        };
        let whole = !target.is_empty() && [process, start, counter].into_iter().all(digits);
        counter.parse::<u32>().ok().filter(|_| whole)?;
        Some(Self { host: hex(host)?, boot: hex(boot)?, process: process.parse().ok()?, start: start.parse().ok()? })
    }

    /// Returns true if the process may still run on this machine. Processes of other hosts and earlier boots do not.
    pub(super) fn may_run(self) -> bool {
        let this = Self::this();
        (self.host, self.boot) == (this.host, this.boot) && (self.process == this.process || is_running(self))
    }
}

/// Returns true if the process still runs, or if the system does not report it.
fn is_running(owner: Owner) -> bool {
    if Path::new("/proc/self/stat").exists() {
        // Another process may have reused the id.
        return started(owner.process) == Some(owner.start);
    }
    has_number(owner.process)
}

/// Returns true if a process with this id exists.
#[cfg(unix)]
fn has_number(process: u32) -> bool {
    use rustix::process::{Pid, test_kill_process};
    let process = i32::try_from(process).ok().and_then(Pid::from_raw);
    process.is_some_and(|process| test_kill_process(process) != Err(rustix::io::Errno::SRCH))
}

/// Assumes that the process exists.
#[cfg(not(unix))]
fn has_number(_process: u32) -> bool {
    true
}

/// Start time of a process, in ticks since the boot; `None` if there is no such process or the system does not report
/// it.
fn started(process: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name of the program, in brackets, may contain spaces and brackets. The start is the 22nd field of the line.
    stat.rsplit_once(')')?.1.split_whitespace().nth(19)?.parse().ok()
}

/// A number for this machine and container: a hash of the host name, the machine id and the process namespace.
fn host() -> u32 {
    #[cfg(unix)]
    let name = rustix::system::uname().nodename().to_bytes().to_vec();
    #[cfg(not(unix))]
    let name = Vec::new();
    let space = fs::read_link("/proc/self/ns/pid").unwrap_or_default().into_os_string().into_encoded_bytes();
    short(&[&name, &fs::read("/etc/machine-id").unwrap_or_default(), &space])
}

/// A number for this boot.
fn boot() -> u32 {
    fs::read("/proc/sys/kernel/random/boot_id").map_or(0, |boot| short(&[&boot]))
}

fn short(parts: &[&[u8]]) -> u32 {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
    }
    let hash = hasher.finalize();
    u32::from_le_bytes(hash.as_bytes()[..4].try_into().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_owners_from_names() {
        let this = Owner::this();
        for target in ["a.b.png", ".shibo-", "x-1-2", &"ä".repeat(120)] {
            let name = this.name(target, 7);
            assert!(name.len() < 256, "{name}");
            assert_eq!(Owner::of(&name), Some(this), "{name}");
        }
        let good = ".a.png.shibo-0000000a-0000000b-12-34-0.tmp";
        assert_eq!(Owner::of(good), Some(Owner { host: 10, boot: 11, process: 12, start: 34 }));
        let wrong = [
            "a.png.shibo-0000000a-0000000b-12-34-0.tmp",
            ".shibo-0000000a-0000000b-12-34-0.tmp",
            ".a.png.shibo-000000a-0000000b-12-34-0.tmp",
            ".a.png.shibo-0000000A-0000000b-12-34-0.tmp",
            ".a.png.shibo-0000000a-0000000b-+12-34-0.tmp",
            ".a.png.shibo-0000000a-0000000b-12-34-.tmp",
            ".a.png.shibo-0000000a-0000000b-12-34.tmp",
            ".a.png.shibo-0000000a-0000000b-12-34-0.tmp~",
            ".a.png.123.0.tmp",
        ];
        wrong.iter().for_each(|name| assert_eq!(Owner::of(name), None, "{name}"));
    }

    #[test]
    fn tells_which_owners_may_still_run() {
        let this = Owner::this();
        assert!(this.may_run());
        // Real process ids are far below this number.
        let gone = Owner { process: u32::MAX, ..this };
        assert!(!Owner { host: !this.host, ..this }.may_run());
        assert!(!Owner { boot: !this.boot, ..this }.may_run());
        #[cfg(unix)]
        assert!(!gone.may_run() && !has_number(gone.process) && has_number(1));
        if Path::new("/proc/self/stat").exists() {
            let first = Owner { process: 1, start: started(1).unwrap(), ..this };
            assert!(first.may_run());
            assert!(!Owner { start: first.start + 1, ..first }.may_run(), "another process has its number");
        }
    }
}
